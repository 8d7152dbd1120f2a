// SPDX-License-Identifier: MIT
// Floor 2: merges in media, by points and beams, for who renders media; mis.hpp does not include it. What a
// renderer without merges needs of media is in path.hpp and subpath.hpp: the densities of distances.
//
// At a vertex x_i in a medium both walks may be merged in four families (Krivanek et al., "Unifying points,
// beams, and paths in volumetric light transport simulation", 2014, [UPBP]; the lecture [K], last part). Each
// is a technique of its own, of whose samples so many are expected for each density of the path up to x_i
// from either side, per volume, that its size says:
//
//   point_point  3D  N 4/3 pi r^3                       both walks have a vertex there
//   point_beam   2D  N pi r^2 X->                       light walk's vertex, camera walk's beam
//   beam_point   2D  N pi r^2 X<-                       light walk's beam, camera walk's vertex
//   beam_beam    1D  N_B k r sin(theta) X-> X<-         both walks' beams, theta the angle between them
//
// X-> undoes the sampling of the distance from x_{i-1} to x_i by the camera walk, X<- that of the distance
// from x_{i+1} to x_i by the light walk: see beam(). Sizes are volumes. All families' raised densities add up
// to one, that of their joined size, so that the records and the recursion know one merge per vertex:
//
//     const mis::family_sizes<float> here = mis::at_vertex(sizes, beams, sin_angle);
//     merge_factor = mis::joined(heuristic, here) / counts.merge;       // of the vertex
//     w = weigh.merge(...) * mis::family_share(heuristic, here, family); // weight of one family's merge
//
// With counts.merge = 1 the factor is the size itself; on surfaces it then is N pi r^2, or 0. A walk knows
// X<- of its vertex when it has found the next one: so in media leave and arrive by `step`.
#pragma once

#include <cmath>
#include <mis/heuristic.hpp>
#include <mis/techniques.hpp>

namespace mis {

enum class merge_family : unsigned char { point_point, point_beam, beam_point, beam_beam };

// Of the families: on its own what one density per volume, area or length stands for (at no vertex in
// particular, 0 where a family is off); at a vertex, by at_vertex, all are volumes.
template <class T> struct family_sizes {
    T point_point = T(0);
    T point_beam = T(0);
    T beam_point = T(0);
    T beam_beam = T(0);
};

// N 4/3 pi r^3, N pi r^2, N_B k r. k is 2 for a constant kernel over [-r, r]; the probability with which a
// pair of beams is looked at (beams that are selected at random) is part of the number of beams.
template <class T> MIS_HOST_DEVICE constexpr T point_point_size(T photons, detail::identity_t<T> radius) {
    detail::expect_real<T>();
    return photons * radius * radius * radius * detail::all_lanes<T>(4.1887902047863910);
}
template <class T> MIS_HOST_DEVICE constexpr T point_beam_size(T photons, detail::identity_t<T> radius) {
    detail::expect_real<T>();
    return photons * mis::merge_area(radius);
}
template <class T> MIS_HOST_DEVICE constexpr T beam_point_size(T beams, detail::identity_t<T> radius) {
    return point_beam_size(beams, radius);
}
template <class T>
MIS_HOST_DEVICE constexpr T beam_beam_size(T beams, detail::identity_t<T> radius,
                                           detail::identity_t<T> kernel = T(2)) {
    detail::expect_real<T>();
    return beams * radius * kernel;
}

// X of a walk's segment, a length: how many samples its beam has for each density of the distance at which
// the walk could have stopped.
//   distance  per length, the density of the distance at the merge: T
//   pass      a long beam, which has a sample at every distance: 1; a short one, which ends where the walk
//             collides: the probability that it comes so far, Pr(t > d)
// 0 where the density is 0, and with it the path's contribution.
template <class T> MIS_HOST_DEVICE constexpr T beam(T distance, detail::identity_t<T> pass = T(1)) {
    detail::expect_real<T>();
    detail::assert_density(distance);
    detail::assert_density(pass);
    const T x = pass / distance;
    return detail::select(distance > T(0), x, T(0));
}

// The segments that end at a vertex, as beams: X-> and X<-.
template <class T> struct beams { T from_camera, from_light; };

// The sizes at a vertex. sin_angle: of the angle between the segments from x_{i-1} and from x_{i+1}. A family
// that is off, or a sine of 0, gives 0, also where an X is infinite.
template <class T>
MIS_HOST_DEVICE constexpr family_sizes<T> at_vertex(const family_sizes<T>& sizes, const beams<T>& x,
                                                    detail::identity_t<T> sin_angle) {
    const auto times = [](T size, T samples) {
        return detail::select(size > T(0) && samples > T(0), T(size * samples), T(0));
    };
    return {sizes.point_point, times(sizes.point_beam, x.from_camera), times(sizes.beam_point, x.from_light),
            times(times(sizes.beam_beam * sin_angle, x.from_camera), x.from_light)};
}

template <class T> MIS_HOST_DEVICE constexpr T size_of(const family_sizes<T>& sizes, merge_family family) {
    switch (family) {
    case merge_family::point_point:
        return sizes.point_point;
    case merge_family::point_beam:
        return sizes.point_beam;
    case merge_family::beam_point:
        return sizes.beam_point;
    case merge_family::beam_beam:
        return sizes.beam_beam;
    }
    return T(0);
}

// The part of a vertex' merges, as weighted, that is a family's: b(k_f) / sum b(k). All families' add up to
// 1, or are 0 where all sizes are.
template <class Heuristic, class T>
MIS_HOST_DEVICE constexpr T family_share(const Heuristic& heuristic, const family_sizes<T>& sizes,
                                         merge_family family) {
    const T all[] = {sizes.point_point, sizes.point_beam, sizes.beam_point, sizes.beam_beam};
    return mis::weight(heuristic, all, static_cast<int>(family));
}

namespace detail {

template <class T> MIS_HOST_DEVICE constexpr void expect(const family_sizes<T>& k) {
    assert_density(k.point_point);
    assert_density(k.point_beam);
    assert_density(k.beam_point);
    assert_density(k.beam_beam);
}

} // namespace detail

// The size that alone weighs as much as all families: b(joined) = sum b(k). Balance: their sum; power: the
// 1 / beta-th power of the sum of powers, without overflow on the way. Average counts techniques and cutoff
// needs all at once: for these there is no such size.
template <class T> MIS_HOST_DEVICE constexpr T joined(balance_heuristic, const family_sizes<T>& k) {
    detail::expect(k);
    return (k.point_point + k.point_beam) + (k.beam_point + k.beam_beam);
}
template <class T> MIS_HOST_DEVICE constexpr T joined(maximum_heuristic, const family_sizes<T>& k) {
    detail::expect(k);
    return detail::larger(detail::larger(k.point_point, k.point_beam),
                          detail::larger(k.beam_point, k.beam_beam));
}
template <class Beta, class T>
MIS_HOST_DEVICE T joined(const power_heuristic<Beta>& heuristic, const family_sizes<T>& k) {
    using std::pow;
    using std::sqrt;
    using W = detail::weighing_t<T>; // -ffast-math multiplies by the reciprocal of the largest
    const W largest = static_cast<W>(joined(maximum_heuristic{}, k));
    const auto share = [&](T size) { return heuristic.share(static_cast<W>(size), largest); };
    const W sum = (share(k.point_point) + share(k.point_beam)) + (share(k.beam_point) + share(k.beam_beam));
    if constexpr (std::is_same_v<Beta, two>)
        return static_cast<T>(largest * sqrt(sum));
    else
        return static_cast<T>(
            largest *
            static_cast<W>(pow(sum, detail::all_lanes<W>(1 / static_cast<double>(heuristic.beta)))));
}

// The distance in a homogeneous medium whose extinction depends on the channel (colour), where one distance
// serves all channels: a channel is drawn for each segment anew, each with the same probability, so that the
// path's density is a product of densities of segments.
template <class T> struct distance_density {
    T density; // per length, of the distance t: mean of sigma_c exp(-sigma_c t)
    T pass;    // the probability of a longer one: mean of exp(-sigma_c t)
};
template <class T>
MIS_HOST_DEVICE distance_density<T> distance_in_medium(const T* extinction, int channels,
                                                       detail::identity_t<T> t) {
    detail::expect_real<T>();
    assert(channels > 0 && t >= T(0));
    using std::exp;
    distance_density<T> mean{T(0), T(0)};
    for (int c = 0; c < channels; ++c) {
        detail::assert_density(extinction[c]);
        const T pass = exp(-extinction[c] * t);
        mean.density += extinction[c] * pass;
        mean.pass += pass;
    }
    const T each = T(1) / T(channels);
    return {mean.density * each, mean.pass * each};
}

} // namespace mis
