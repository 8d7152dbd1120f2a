// SPDX-License-Identifier: MIT
// Floor 1: densities carry the measure they are taken in, and the conversions between the measures.
#pragma once

#include <mis/config.hpp>

namespace mis {

// A probability density per solid angle (1/sr), per surface area (1/m^2), per volume (1/m^3). Build one where
// the measure is known, `per_solid_angle{pdf}`, and the compiler sees to it that it is not taken for another.
template <class T> struct per_solid_angle { T value; };
template <class T> struct per_area { T value; };
template <class T> struct per_volume { T value; };
template <class T> per_solid_angle(T) -> per_solid_angle<T>;
template <class T> per_area(T) -> per_area<T>;
template <class T> per_volume(T) -> per_volume<T>;

// Density per area of the point that a sampled direction hits: p |cos| / d^2, [J] 2. cos is at the hit point,
// between its *geometric* normal and the edge. From a direction at infinity (an environment) there is no
// distance: pass distance2 = 1. At distance 0 the result is infinite.
template <class T>
MIS_HOST_DEVICE constexpr per_area<T> to_area(per_solid_angle<T> p, detail::identity_t<T> cos,
                                              detail::identity_t<T> distance2) {
    return {p.value * detail::absolute(cos) / distance2};
}

// The inverse of to_area. At cos = 0 the result is infinite.
template <class T>
MIS_HOST_DEVICE constexpr per_solid_angle<T> to_solid_angle(per_area<T> p, detail::identity_t<T> cos,
                                                            detail::identity_t<T> distance2) {
    return {p.value * distance2 / detail::absolute(cos)};
}

// Density per volume of a scattering point in a medium: a direction, and the density per length of the
// distance. There is no cosine.
template <class T>
MIS_HOST_DEVICE constexpr per_volume<T> to_volume(per_solid_angle<T> p, detail::identity_t<T> pdf_distance,
                                                  detail::identity_t<T> distance2) {
    return {p.value * pdf_distance / distance2};
}

// Density of a direction that a Dirac scatterer (mirror, glass) chooses, in basic etendue, up to the Dirac
// factor that all techniques share: q eta^2 |cos|. q is the discrete probability of the lobe, roulette
// included; eta and cos are those of the side on which the direction leaves. For a reflection eta^2 |cos| is
// the same in both directions and may be left out of both.
template <class T> MIS_HOST_DEVICE constexpr T dirac_density(T probability, T eta, T cos) {
    return probability * eta * eta * detail::absolute(cos);
}

// Veach's factor for shading normals, [V97] 5.3.2:  k = |in.n_s| |out.n_g| / (|in.n_g| |out.n_s|).
// `in` points back along the light walk (towards the light), `out` along it (towards the camera); n_s is the
// shading normal and n_g the geometric one. The light walk multiplies its throughput by k at every scattering
// vertex, beside f |out.n_s| / pdf; the camera walk does not. 1 where the normals agree; 0 where a cosine
// above is 0; where only one below is 0 the result is infinite, and the path carries no light.
//
// A renderer that multiplies k and converts its densities with geometric cosines needs nothing else: the
// densities already are those of the throughput. One that converts with *shading* cosines must divide its
// light walk's densities by k, [J] 4.
template <class T>
MIS_HOST_DEVICE constexpr T shading_normal_factor(T cos_in_shading, T cos_in_geometric, T cos_out_shading,
                                                  T cos_out_geometric) {
    const T above = detail::absolute(cos_in_shading * cos_out_geometric);
    const T below = detail::absolute(cos_in_geometric * cos_out_shading);
    return detail::select(above > T(0), above / below, T(0));
}

} // namespace mis
