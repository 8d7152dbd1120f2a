// Media: how light is scattered and how far it goes, and what lies along an edge. A scene without media pays
// a comparison for each edge.
#pragma once

#include "sampling.hpp"
#include <mis/media.hpp>

namespace bpt {

// Homogeneous. All in the scene's lengths.
template <class Real> struct medium {
    color<Real> extinction{0}; // per length: scattering and absorption
    material<Real> phase;
};

// ---- Phase functions ----

// Henyey and Greenstein's, per solid angle; the cosine is that between the directions of light before and
// after.
template <class Real> Real phase_density(Real mean_cosine, Real cosine) {
    const Real g = mean_cosine, below = 1 + g * g - 2 * g * cosine;
    return sphere_density<Real> * (1 - g * g) / (below * std::sqrt(below));
}
// The inverse of its integral, without a division by the mean cosine.
template <class Real> vec3<Real> sample_phase(Real mean_cosine, const vec3<Real>& onwards, pcg32& rng) {
    const Real g = mean_cosine, s = 2 * uniform<Real>(rng) - 1, below = 1 + g * s;
    const Real cosine = (s + g * (s * s + 3) / 2 + g * g * s + g * g * g * (s * s - 1) / 2) / (below * below);
    return around(onwards, std::clamp(cosine, Real(-1), Real(1)), rng);
}

// ---- Distances ----

template <class Real> bool has_media(const scene<Real>& scene) { return !scene.media.empty(); }

// One distance serves all colours: the channel that it is drawn for is drawn anew for every piece of an edge,
// so that the density of a piece is the mean of the channels' (mis::distance_in_medium).
template <class Real> Real sample_distance(const medium<Real>& m, pcg32& rng) {
    const Real extinction = m.extinction[std::uniform_int_distribution<int>(0, 2)(rng)];
    const Real u = uniform<Real>(rng);
    return extinction > Real(0) ? -std::log(1 - u) / extinction : std::numeric_limits<Real>::max();
}

// What an edge passes through. Each piece between index-matched boundaries has a distance of its own; the
// edge's density is the product of passing all pieces but the last, and of passing that or colliding there.
template <class Real> struct flight {
    color<Real> transmittance{1};
    mis::distance_density<Real> first{0, 1}, last{0, 1}; // of the pieces at both ends
    Real before = 1, after = 1;                          // of passing all pieces but the last, but the first
    bool has_pieces = false;

    void add(const medium<Real>& m, Real length) {
        const auto piece = mis::distance_in_medium(&m.extinction.x, 3, length);
        before *= has_pieces ? last.pass : Real(1);
        after *= has_pieces ? piece.pass : Real(1);
        first = has_pieces ? first : piece;
        last = piece;
        has_pieces = true;
        transmittance *= exp(-m.extinction * length);
    }
    // Of a walk that starts where the edge does and ends in a medium or not; and of the other walk.
    Real forward(bool ends_in_medium) const { return before * (ends_in_medium ? last.density : last.pass); }
    Real reverse(bool starts_in_medium) const {
        return after * (starts_in_medium ? first.density : first.pass);
    }
};

// The same edge from its other end.
template <class Real> flight<Real> reversed(flight<Real> f) {
    std::swap(f.first, f.last);
    std::swap(f.before, f.after);
    return f;
}

// The medium on the side of a boundary, or of glass, that a direction leaves to; -1 is none.
template <class Real>
int medium_towards(const scene<Real>& scene, const surface_point<Real>& x, const vec3<Real>& to) {
    return dot(x.normal, to) < Real(0) ? scene.materials[static_cast<std::size_t>(x.material)].inside
                                       : scene.medium;
}

template <class Real> bool is_boundary(const scene<Real>& scene, const surface_point<Real>& x) {
    return !(x.light >= 0) &&
           scene.materials[static_cast<std::size_t>(x.material)].kind == material_kind::boundary;
}

// Where a ray is, and in what. Rays that start within a medium look for surfaces right from there.
template <class Real> struct place_on_ray {
    Real begin = 0; // of the present piece, from the ray's origin
    int medium = -1;
    bool starts_in_medium = false; // this piece

    Real nearest(const scene<Real>& scene) const { return starts_in_medium ? Real(0) : scene.epsilon(); }
};

// Follows a ray from piece to piece: piece(place, end) is called for each, with the distance at which it
// ends, and returns whether the ray goes on. Returns what it has met: a surface, but no index-matched
// boundary, or nothing before `farthest`.
template <class Real, class Piece>
std::optional<surface_point<Real>> follow(const scene<Real>& scene, const vec3<Real>& origin,
                                          const vec3<Real>& direction, place_on_ray<Real> place,
                                          Real farthest, Piece&& piece) {
    for (vec3<Real> from = origin;;) {
        const bool is_far = farthest == std::numeric_limits<Real>::max();
        const auto hit = intersect(scene, from, direction, is_far ? farthest : farthest - place.begin,
                                   place.nearest(scene));
        const Real end =
            hit ? place.begin + std::max(Real(0), dot(hit->position - from, direction)) : farthest;
        const bool goes_on = piece(place, end);
        if (!goes_on || !hit || !is_boundary(scene, *hit))
            return goes_on ? hit : std::nullopt;
        from = hit->position;
        place = {end, medium_towards(scene, *hit, direction), false};
    }
}

template <class Real> const medium<Real>* medium_at(const scene<Real>& scene, int medium) {
    return medium < 0 ? nullptr : &scene.media[static_cast<std::size_t>(medium)];
}

// Adds a piece to a flight: of a medium, or of nothing.
template <class Real> void add_piece(const scene<Real>& scene, flight<Real>& f, int medium, Real length) {
    static const bpt::medium<Real> nothing{};
    f.add(medium < 0 ? nothing : *medium_at(scene, medium), length);
}

} // namespace bpt
