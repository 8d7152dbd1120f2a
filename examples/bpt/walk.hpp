// The two random walks. Each vertex takes the three steps of the recursion: start, arrive, scatter.
#pragma once

#include "beam.hpp"

namespace bpt {

// How long a walk may get, and whether it ends at the first vertex where it can be joined.
struct walk_limits {
    int vertices = 0;
    bool ends_where_it_can_join = false;
};

// f |cos| of a scattering event as the walk multiplies it: the light walk's has Veach's shading-normal
// factor.
template <class Real> color<Real> scattered(const vertex<Real>& x, const vec3<Real>& to, walk_kind kind) {
    const vec3<Real>& from = x.towards_previous;
    const Real cosine = shading_cosine(x, to);
    const color<Real> f = evaluate(*x.material, x.point, from, to) * cosine;
    if (kind == walk_kind::from_camera || f == color<Real>(0))
        return f;
    return f * mis::shading_normal_factor(shading_cosine(x, from), geometric_cosine(x, from), cosine,
                                          geometric_cosine(x, to));
}

// Radiance is squeezed where it enters a denser medium; the camera walk accounts for it, flux does not
// change.
template <class Real> Real radiance_scale(const dirac_lobe<Real>& lobe, walk_kind kind) {
    const Real ratio = lobe.eta_from / lobe.eta_to;
    return kind == walk_kind::from_camera ? ratio * ratio : Real(1);
}

// Leaves a vertex in a sampled direction. Returns false where the walk ends.
template <class Real>
bool scatter(const scene<Real>& scene, const vertex<Real>& x, walk_kind kind, pcg32& rng,
             departure<Real>& leaving) {
    const material<Real>& m = *x.material;
    if (uniform<Real>(rng) >= m.survival)
        return false;
    leaving.origin = x.point.position;
    leaving.medium = x.medium;
    if (is_dirac(m)) {
        const dirac_lobe<Real> lobe = sample_dirac(m, x.point, x.towards_previous, rng);
        leaving.to = lobe.to;
        leaving.forward = leaving.reverse = lobe.probability;
        leaving.eta_in = lobe.eta_from, leaving.eta_out = lobe.eta_to;
        leaving.throughput = x.throughput * lobe.value * (radiance_scale(lobe, kind) / lobe.probability);
        if (dot(x.point.normal, lobe.to) * dot(x.point.normal, x.towards_previous) < Real(0))
            leaving.medium = medium_towards(scene, x.point, lobe.to);
        return true;
    }
    leaving.to = sample(m, x.point, x.towards_previous, rng);
    const color<Real> f = scattered(x, leaving.to, kind);
    if (f == color<Real>(0))
        return false;
    leaving.forward = density(m, x.point, x.towards_previous, leaving.to);
    leaving.reverse = density(m, x.point, leaving.to, x.towards_previous);
    leaving.throughput = x.throughput * f / leaving.forward;
    return true;
}

// Continues a walk that has left its end point until it leaves the scene, is absorbed, hits a light or has
// reached its limits.
template <class Real, class Weights>
void continue_walk(const scene<Real>& scene, const Weights& weigh, walk_kind kind, walk<Real>& walk,
                   departure<Real> leaving, walk_limits limits, pcg32& rng) {
    const bool long_beams =
        kind == walk_kind::from_camera ? weigh.media.long_camera_beams : weigh.media.long_light_beams;
    while (static_cast<int>(walk.size()) < limits.vertices) {
        flight<Real> flight;
        std::optional<vertex<Real>> x = meet(scene, kind, long_beams, leaving, walk, rng, flight);
        if (!x)
            return;
        arrive(weigh, kind, walk.back(), leaving, flight, *x);
        walk.push_back(*x);
        const bool stays = limits.ends_where_it_can_join && can_join(*x);
        if (is_light(*x) || stays || !scatter(scene, *x, kind, rng, leaving))
            return;
    }
}

// Starts at a random point of the lens, for a point of the film.
template <class Real, class Weights>
void walk_from_camera(const scene<Real>& scene, const Weights& weigh, int width, Real film_x, Real film_y,
                      walk_limits limits, walk<Real>& walk, pcg32& rng) {
    const vertex<Real> lens = sample_lens(scene.camera, rng);
    const vec3<Real> leaving = film_to_direction(scene.camera, lens, film_x, film_y);
    const mis::end_point<Real> end = camera_end_point(scene.camera, leaving, width);
    start(walk, lens, weigh.start_camera(end), scene.medium);
    continue_walk(scene, weigh, walk_kind::from_camera, walk,
                  {lens.point.position, leaving, color<Real>(1), 0, 0, 1, 1, scene.medium}, limits, rng);
}

// Starts at a random point of a random light.
template <class Real, class Weights>
void walk_from_light(const scene<Real>& scene, const Weights& weigh, int longest, walk<Real>& walk,
                     pcg32& rng) {
    const int i = pick_light(scene, &light<Real>::select_emission, rng);
    const vertex<Real> x =
        sample_light_point(scene, i, scene.lights[static_cast<std::size_t>(i)].lobe_share_emission, rng);
    const ray<Real> ray = sample_emission(scene, x, rng);
    const mis::end_point<Real> end = light_end_point(scene, x, ray.direction);
    const Real density = end.position.value * end.direction.value;
    start(walk, x, weigh.start_light(end), scene.medium);
    const color<Real> flux = emitted(scene, x, ray.direction) * (end.cos.value / density);
    continue_walk(scene, weigh, walk_kind::from_light, walk,
                  {ray.origin, ray.direction, flux, 0, 0, 1, 1, scene.medium}, {longest}, rng);
}

} // namespace bpt
