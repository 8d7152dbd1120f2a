// Mistakes that authors of renderers make in their weights, to be planted here on purpose: --mistake. The
// walks and connections then tell the weights something else than what they have sampled with; the paths stay
// the same. Without a mistake nothing of this page has any effect.
//
// What the weights are told of a vertex is its `told`, beside its `record`. The functions here fill it in,
// each called where a renderer would make the mistakes in it. mistaken_weight.hpp has those that concern
// counts and heuristics.
#pragma once

#include "vertex.hpp"
#include <bitset>

namespace bpt {

enum class mistake {
    power_overflow,
    maximum_tie,
    roulette_omitted,
    roulette_one_sided,
    merge_roulette,
    shading_normal,
    dirac_geometry,
    dirac_etendue,
    dirac_light,
    dirac_connectible,
    selection_omitted,
    next_event_is_emission,
    environment_measure,
    light_paths_missing,
    light_paths_twice,
    counts_omitted,
    photon_count,
    merge_area,
    disabled_technique,
    missing_technique,
    subpath_caps,
    solid_angle_as_area,
    reverse_is_forward,
    wrong_heuristic
};
inline constexpr const char* mistake_names[] = {
    "power_overflow",      "maximum_tie",         "roulette_omitted",   "roulette_one_sided",
    "merge_roulette",      "shading_normal",      "dirac_geometry",     "dirac_etendue",
    "dirac_light",         "dirac_connectible",   "selection_omitted",  "next_event_is_emission",
    "environment_measure", "light_paths_missing", "light_paths_twice",  "counts_omitted",
    "photon_count",        "merge_area",          "disabled_technique", "missing_technique",
    "subpath_caps",        "solid_angle_as_area", "reverse_is_forward", "wrong_heuristic"};
constexpr std::size_t mistake_count = std::size(mistake_names);

// The mistakes that are planted, by their places above.
struct mistake_set {
    std::bitset<mistake_count> planted;

    bool any() const { return planted.any(); }
    bool has(mistake m) const { return planted[static_cast<std::size_t>(m)]; }
};

// A vertex has scattered, or would scatter, towards `to`: its densities and the cosine on that side.
template <class Real>
void tell_scatter(const mistake_set& mistakes, vertex<Real>& x, walk_kind kind, const vec3<Real>& to) {
    if (!mistakes.any())
        return;
    const bool camera = kind == walk_kind::from_camera;
    Real& forward = camera ? x.told.pdf_to_light : x.told.pdf_to_camera;
    Real& reverse = camera ? x.told.pdf_to_camera : x.told.pdf_to_light;
    Real& cosine = camera ? x.told.cos_to_light : x.told.cos_to_camera;
    x.told.pdf_to_light = x.record.pdf_to_light;
    x.told.pdf_to_camera = x.record.pdf_to_camera;
    cosine = mistakes.has(mistake::shading_normal) ? shading_cosine(x, to) : geometric_cosine(x, to);
    if (scatters_dirac(x)) {
        if (mistakes.has(mistake::dirac_etendue)) {
            x.told.pdf_to_light /= x.eta_to_light * x.eta_to_light * x.record.cos_to_light;
            x.told.pdf_to_camera /= x.eta_to_camera * x.eta_to_camera * x.record.cos_to_camera;
        }
        if (mistakes.has(mistake::dirac_connectible))
            x.told.kind = mis::vertex_kind::surface;
    } else if (mistakes.has(mistake::reverse_is_forward)) {
        reverse = forward;
    }
    if (mistakes.has(mistake::roulette_omitted))
        forward /= x.material->survival;
    if (mistakes.has(mistake::roulette_omitted) || mistakes.has(mistake::roulette_one_sided))
        reverse /= x.material->survival;
}

// The edge between two vertices, without the cosines.
template <class Real>
void tell_edge(const mistake_set& mistakes, vertex<Real>& nearer_camera, Real distance2) {
    if (mistakes.any())
        nearer_camera.told.distance2_to_light = distance2;
}

// A walk that came from `previous` along `travelled` has arrived.
template <class Real>
void tell_arrival(const mistake_set& mistakes, vertex<Real>& previous, vertex<Real>& x, walk_kind kind,
                  const vec3<Real>& travelled) {
    if (!mistakes.any())
        return;
    const bool camera = kind == walk_kind::from_camera;
    x.told.kind = x.record.kind;
    Real& cosine = camera ? x.told.cos_to_camera : x.told.cos_to_light;
    const bool shading = mistakes.has(mistake::shading_normal) && !is_light(x);
    cosine = shading ? shading_cosine(x, travelled) : geometric_cosine(x, travelled);
    tell_edge(mistakes, camera ? previous : x, squared_distance(previous, x));
    if (mistakes.has(mistake::solid_angle_as_area)) {
        cosine = 1;
        tell_edge(mistakes, camera ? previous : x, Real(1));
    }
    if (mistakes.has(mistake::environment_measure) && is_infinite(previous))
        cosine = 1;
    if (mistakes.has(mistake::environment_measure) && is_infinite(x))
        previous.told.cos_to_light = 1;
}

// A light's or the camera's vertex that a walk starts from, or that has been sampled.
template <class Real> void tell_end(const mistake_set& mistakes, const scene<Real>& scene, vertex<Real>& x) {
    if (!mistakes.any())
        return;
    x.told = x.record;
    if (!is_light(x))
        return;
    if (mistakes.has(mistake::selection_omitted))
        x.told.pdf_next_event /= scene.lights[static_cast<std::size_t>(x.point.light)].select_next_event;
    if (mistakes.has(mistake::next_event_is_emission))
        x.told.pdf_next_event = x.told.pdf_position;
    if (mistakes.has(mistake::dirac_light))
        x.told.dirac = false;
}
// A light that a camera walk has hit; the cosine there has been told on arrival.
template <class Real> void tell_hit(const mistake_set& mistakes, const scene<Real>& scene, vertex<Real>& x) {
    const Real cosine = x.told.cos_to_camera;
    tell_end(mistakes, scene, x);
    x.told.cos_to_camera = cosine;
}
// A light point has been sampled for a vertex.
template <class Real>
void tell_next_event(const mistake_set& mistakes, const scene<Real>& scene, vertex<Real>& x,
                     vertex<Real>& light, const vec3<Real>& to_light, Real distance2) {
    tell_scatter(mistakes, x, walk_kind::from_camera, to_light);
    tell_edge(mistakes, x, distance2);
    tell_end(mistakes, scene, light);
    if (mistakes.has(mistake::environment_measure) && is_infinite(light))
        x.told.cos_to_light = 1;
}

// The ends of two walks have been joined.
template <class Real>
void tell_connection(const mistake_set& mistakes, vertex<Real>& x, vertex<Real>& y,
                     const vec3<Real>& to_light, Real distance2) {
    tell_scatter(mistakes, x, walk_kind::from_camera, to_light);
    tell_scatter(mistakes, y, walk_kind::from_light, -to_light);
    tell_edge(mistakes, x, distance2);
}

// A merge: the record of the camera's vertex has been completed with the photon's edge.
template <class Real>
void tell_merge(const mistake_set& mistakes, vertex<Real>& x, const vertex<Real>& photon) {
    if (!mistakes.any())
        return;
    const Real camera_survival = x.material->survival, photon_survival = photon.material->survival;
    x.told.pdf_to_light = x.record.pdf_to_light;
    x.told.pdf_to_camera = x.record.pdf_to_camera;
    x.told.cos_to_light = photon.told.cos_to_light;
    x.told.distance2_to_light = photon.told.distance2_to_light;
    Real in_density = photon_survival; // what pdf_to_camera includes
    if (mistakes.has(mistake::merge_roulette)) {
        x.told.pdf_to_camera *= camera_survival / photon_survival;
        in_density = camera_survival;
    }
    if (mistakes.has(mistake::roulette_omitted))
        x.told.pdf_to_light /= camera_survival;
    if (mistakes.has(mistake::roulette_omitted) || mistakes.has(mistake::roulette_one_sided))
        x.told.pdf_to_camera /= in_density;
}

} // namespace bpt
