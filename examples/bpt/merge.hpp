// Merging, or photon mapping: a camera walk meets the light walks of all pixels where they come near.
#pragma once

#include "connect.hpp"
#include <cstdint>
#include <memory>
#include <nanoflann.hpp>

namespace bpt {

// What turns f of light from a direction into the light walk's, f*, at the surface it has met: the flux there
// goes with the geometric cosine. f |in.n_s| / |in.n_g|, [V97] 5.3.
template <class Real> Real adjoint_factor(const vertex<Real>& x) {
    const vec3<Real>& in = x.towards_previous;
    return shading_cosine(x, in) / geometric_cosine(x, in);
}

// All that a merge takes of a light walk's vertex.
template <class Real> struct photon {
    vec3<Real> position, towards_previous;
    color<Real> throughput; // of the walk, up to here, times adjoint_factor
    mis::subpath_state<Real> state;
    Real survival;      // in densities: the rate of going on
    std::uint32_t walk; // its number, which is its pixel
    int vertices;       // of the walk, up to here
    int medium;         // through which it has come, or none
    Real beam;          // X, of vertices in media
};
static_assert(sizeof(photon<float>) <= 64, "memory is what limits photon maps");

template <class Real>
photon<Real> photon_at(const vertex<Real>& x, std::uint32_t walk, const roulette<Real>& roulette = {}) {
    return {x.point.position,
            x.towards_previous,
            x.throughput * adjoint_factor(x),
            x.state,
            x.material->survival * roulette.over_survival(walk_kind::from_light, x, x.towards_previous),
            walk,
            x.depth,
            x.medium,
            x.beam};
}

// Those of a walk on surfaces, or in media.
template <class Real>
void add_photons(const walk<Real>& walk, std::size_t number, std::vector<photon<Real>>& photons,
                 bool in_media = false, const roulette<Real>& roulette = {}) {
    for (std::size_t k = 1; k < walk.size(); ++k)
        if (can_join(walk[k]) && is_in_medium(walk[k]) == in_media)
            photons.push_back(photon_at(walk[k], static_cast<std::uint32_t>(number), roulette));
}

// A k-d tree over the photons of one pass.
template <class Real> struct media_map;
template <class Real> struct photon_map {
    std::vector<photon<Real>> photons;
    std::shared_ptr<const media_map<Real>> media; // what is merged in media, or none
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<Real, photon_map>, photon_map, 3> tree;

    explicit photon_map(std::vector<photon<Real>> all) : photons(std::move(all)), tree(3, *this) {}
    photon_map(const photon_map&) = delete; // the tree refers to this map
    photon_map& operator=(const photon_map&) = delete;

    // What the tree asks for.
    std::size_t kdtree_get_point_count() const { return photons.size(); }
    Real kdtree_get_pt(std::size_t i, std::size_t axis) const {
        return photons[i].position[static_cast<int>(axis)];
    }
    template <class Box> bool kdtree_get_bbox(Box&) const { return false; } // it measures the box itself
};

// Calls f(photon) for all photons within the radius of a position.
template <class Real, class F>
void for_each_near(const photon_map<Real>& map, const vec3<Real>& position, Real radius, F&& f) {
    std::vector<std::pair<std::size_t, Real>> found;
    nanoflann::RadiusResultSet<Real, std::size_t> within(radius * radius, found);
    map.tree.radiusSearchCustomCallback(&position.x, within);
    for (const auto& match : found)
        f(map.photons[match.first]);
}

// A merge joins the camera walk's vertex to the light walk's edge that ends in the photon. Both directions
// are the camera vertex' BSDF's. But the survival in to_camera is the photon's: it is the light walk that
// would have gone on from there.
template <class Real>
mis::pdf_to_light<Real> merge_density_to_light(const vertex<Real>& x, const vec3<Real>& towards_light,
                                               const roulette<Real>& roulette = {}) {
    return mis::pdf_to_light{
        walk_density(roulette, walk_kind::from_camera, x, x.towards_previous, towards_light)};
}
template <class Real>
mis::pdf_to_camera<Real> merge_density_to_camera(const vertex<Real>& x, const vec3<Real>& towards_light,
                                                 Real survival_of_photon) {
    bpt::material<Real> light_side = *x.material;
    light_side.survival = survival_of_photon;
    return mis::pdf_to_camera{density(light_side, x.point, towards_light, x.towards_previous)};
}

// The end of a camera walk, x, is merged with a photon.
template <class Real, class Weights, class Sink>
void merge(const sample_pair<Real, Weights>& pair, const vertex<Real>& x, const photon<Real>& photon,
           Sink&& sink) {
    const vec3<Real>& to_light = photon.towards_previous;
    const color<Real> f = evaluate(*x.material, x.point, x.towards_previous, to_light);
    if (f == color<Real>(0))
        return;
    const Real samples = pair.weigh.surface_samples(); // light walks times pi r^2: a density estimate
    const color<Real> value = x.throughput * f * photon.throughput / samples;
    const Real weight =
        pair.weigh.merge(x.state, photon.state, merge_density_to_light(x, to_light, pair.weigh.roulette),
                         merge_density_to_camera(x, to_light, photon.survival), pair.weigh.surface_factor);
    const int s = x.depth, t = photon.vertices - 1; // without the photon, which stands for x
    sink({{mis::technique_kind::merge, s}, s + t, pair.pixel, value, weight}, {&x, s, nullptr, t, &photon});
}

// All merges of a camera walk. The sink is that of connect_all.
template <class Real, class Weights, class Sink>
void merge_all(const sample_pair<Real, Weights>& pair, const photon_map<Real>& map, Real radius,
               Sink&& sink) {
    for (std::size_t i = 1; i < pair.camera.size(); ++i) {
        const vertex<Real>& end = pair.camera[i];
        if (!can_join(end) || is_in_medium(end))
            continue;
        for_each_near(map, end.point.position, radius, [&](const photon<Real>& photon) {
            if (end.depth + photon.vertices - 1 <= pair.longest)
                merge(pair, end, photon, sink);
        });
    }
}

} // namespace bpt
