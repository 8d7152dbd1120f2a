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

// The roles of the numbers that the weights of subpath.hpp take. Several of one measure stand beside each
// other there, and exchanging two of them leaves no trace but a wrong image; so each is named where it is
// given, `mis::pdf_forward{p}`, and a bare number, or one of another role, does not compile. They cost
// nothing.

// |cos| between the *geometric* normal and an edge. 1 in a medium, at a point light, at infinity.
template <class T> struct cosine {
    T value;
    MIS_HOST_DEVICE constexpr explicit cosine(T x) : value(x) {}
};
// The same where one call takes both: at the vertex that a walk leaves, and at the one at which it arrives.
template <class T> struct cosine_out {
    T value;
    MIS_HOST_DEVICE constexpr explicit cosine_out(T x) : value(x) {}
};
template <class T> struct cosine_in {
    T value;
    MIS_HOST_DEVICE constexpr explicit cosine_in(T x) : value(x) {}
};
// The square of an edge's length. 1 for an edge to or from infinity.
template <class T> struct squared_distance {
    T value;
    MIS_HOST_DEVICE constexpr explicit squared_distance(T x) : value(x) {}
};

// At a walk's vertex, per solid angle, roulette survival included: of the direction in which the walk goes
// on, given where it came from; and of the direction back to where it came from, given the one in which it
// goes on. At a Dirac scatterer the discrete probabilities of the lobe, likewise.
template <class T> struct pdf_forward {
    T value;
    MIS_HOST_DEVICE constexpr explicit pdf_forward(T x) : value(x) {}
};
template <class T> struct pdf_reverse {
    T value;
    MIS_HOST_DEVICE constexpr explicit pdf_reverse(T x) : value(x) {}
};
// At a vertex where both walks have arrived, by the path's ends instead of a walk's way: omega->, omega<-.
template <class T> struct pdf_to_light {
    T value;
    MIS_HOST_DEVICE constexpr explicit pdf_to_light(T x) : value(x) {}
};
template <class T> struct pdf_to_camera {
    T value;
    MIS_HOST_DEVICE constexpr explicit pdf_to_camera(T x) : value(x) {}
};

// At the camera or a light: of the point as its own walk's start, and as sampled for the end of the other
// walk, both per area (an infinite light's per solid angle), selection of the light included; and of the
// walk's first direction, per solid angle (an infinite light's per area of the perpendicular disk).
template <class T> struct pdf_position {
    T value;
    MIS_HOST_DEVICE constexpr explicit pdf_position(T x) : value(x) {}
};
template <class T> struct pdf_next_event {
    T value;
    MIS_HOST_DEVICE constexpr explicit pdf_next_event(T x) : value(x) {}
};
template <class T> struct pdf_direction {
    T value;
    MIS_HOST_DEVICE constexpr explicit pdf_direction(T x) : value(x) {}
};

// The refractive index on the side from which a walk comes to a Dirac scatterer, and on that to which it
// leaves.
template <class T> struct eta_in {
    T value;
    MIS_HOST_DEVICE constexpr explicit eta_in(T x) : value(x) {}
};
template <class T> struct eta_out {
    T value;
    MIS_HOST_DEVICE constexpr explicit eta_out(T x) : value(x) {}
};

// In media, of the distance that a walk travels along an edge, per length: in the walk's direction and in the
// other; or towards the light (a camera walk) and towards the camera (a light walk). Behind a medium: the
// probability of reaching the vertex.
template <class T> struct pdf_distance_forward {
    T value;
    MIS_HOST_DEVICE constexpr explicit pdf_distance_forward(T x) : value(x) {}
};
template <class T> struct pdf_distance_reverse {
    T value;
    MIS_HOST_DEVICE constexpr explicit pdf_distance_reverse(T x) : value(x) {}
};
template <class T> struct pdf_distance_to_light {
    T value;
    MIS_HOST_DEVICE constexpr explicit pdf_distance_to_light(T x) : value(x) {}
};
template <class T> struct pdf_distance_to_camera {
    T value;
    MIS_HOST_DEVICE constexpr explicit pdf_distance_to_camera(T x) : value(x) {}
};

// Density per area of the point that a sampled direction hits: p |cos| / d^2, [J] 2. cos is at the hit point,
// between its *geometric* normal and the edge. From a direction at infinity (an environment) there is no
// distance: pass distance2 = 1. At distance 0 the result is infinite.
template <class T>
MIS_HOST_DEVICE constexpr per_area<T> to_area(per_solid_angle<T> p, detail::identity_t<T> cos,
                                              detail::identity_t<T> distance2) {
    return {p.value * detail::absolute<T>(cos) / distance2};
}

// The inverse of to_area. At cos = 0 the result is infinite.
template <class T>
MIS_HOST_DEVICE constexpr per_solid_angle<T> to_solid_angle(per_area<T> p, detail::identity_t<T> cos,
                                                            detail::identity_t<T> distance2) {
    return {p.value * distance2 / detail::absolute<T>(cos)};
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
    const T above = detail::absolute<T>(cos_in_shading * cos_out_geometric);
    const T below = detail::absolute<T>(cos_in_geometric * cos_out_shading);
    return detail::select(above > T(0), above / below, T(0));
}

} // namespace mis
