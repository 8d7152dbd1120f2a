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

// Leaves a vertex in a sampled direction, as one of the copies that go on from there. Returns false where it
// ends.
template <class Weights, class Real>
bool scatter(const scene<Real>& scene, const Weights& weigh, const vertex<Real>& x, walk_kind kind,
             pcg32& rng, departure<Real>& leaving) {
    const material<Real>& m = *x.material;
    const roulette<Real>& roulette = weigh.roulette;
    const Real over_rate = m.survival / x.rate; // densities have the survival in them
    leaving.origin = x.point.position;
    leaving.medium = x.medium;
    if (is_dirac(m)) {
        const dirac_lobe<Real> lobe = sample_dirac(m, x.point, x.towards_previous, rng);
        leaving.to = lobe.to;
        leaving.forward = lobe.probability * roulette.over_survival(kind, x, x.towards_previous);
        leaving.reverse = lobe.probability * roulette.over_survival(other(kind), x, lobe.to);
        leaving.eta_in = lobe.eta_from, leaving.eta_out = lobe.eta_to;
        leaving.throughput =
            x.throughput * lobe.value * (radiance_scale(lobe, kind) / lobe.probability) * over_rate;
        if (dot(x.point.normal, lobe.to) * dot(x.point.normal, x.towards_previous) < Real(0))
            leaving.medium = medium_towards(scene, x.point, lobe.to);
        return true;
    }
    leaving.to = sample(m, x.point, x.towards_previous, rng);
    const color<Real> f = scattered(x, leaving.to, kind);
    if (f == color<Real>(0))
        return false;
    leaving.forward = walk_density(roulette, kind, x, x.towards_previous, leaving.to);
    leaving.reverse = walk_density(roulette, other(kind), x, leaving.to, x.towards_previous);
    leaving.throughput = x.throughput * f / density(m, x.point, x.towards_previous, leaving.to) * over_rate;
    return true;
}

// Continues a walk that has left the vertex at a place until it leaves the scene, is absorbed, hits a light
// or has reached its limits: one copy after the other.
template <class Real, class Weights>
void continue_walk(const scene<Real>& scene, const Weights& weigh, walk_kind kind, walk<Real>& walk,
                   std::size_t place, departure<Real> leaving, walk_limits limits, pcg32& rng) {
    const bool camera = kind == walk_kind::from_camera;
    const bool long_beams = camera ? weigh.media.long_camera_beams : weigh.media.long_light_beams;
    flight<Real> flight;
    std::optional<vertex<Real>> x;
    if (walk[place].depth < limits.vertices)
        x = meet(scene, kind, long_beams, place, leaving, walk, rng, flight);
    if (!x)
        return;
    weigh.roulette.find_cells(*x);
    x->depth = walk[place].depth + 1;
    x->back = static_cast<int>(walk.size() - place);
    if (!camera && place == 0 && weigh.roulette.has_next_event_rates())
        walk[0].state = weigh.start_light(light_end_point(weigh.roulette, scene, walk[0], leaving.to, *x));
    arrive(weigh, kind, walk[place], leaving, flight, *x);
    const bool stays = limits.ends_where_it_can_join && can_join(*x);
    if (camera && can_join(*x))
        play_next_events(weigh.roulette, weigh.counts.next_event, walk, *x, rng);
    const int copies = is_light(*x) || stays ? 0 : play(weigh.roulette, kind, walk, *x, rng);
    const std::size_t here = walk.size();
    walk.push_back(*x);
    for (int k = 0; k < copies; ++k)
        if (scatter(scene, weigh, *x, kind, rng, leaving))
            continue_walk(scene, weigh, kind, walk, here, leaving, limits, rng);
}

// Starts at a random point of the lens, for a point of the film.
template <class Real, class Weights>
void walk_from_camera(const scene<Real>& scene, const Weights& weigh, int width, Real film_x, Real film_y,
                      walk_limits limits, walk<Real>& walk, pcg32& rng) {
    const vertex<Real> lens = sample_lens(scene.camera, rng);
    const vec3<Real> leaving = film_to_direction(scene.camera, lens, film_x, film_y);
    const mis::end_point<Real> end = camera_end_point(scene.camera, leaving, width);
    start(weigh, walk, lens, weigh.start_camera(end), scene.medium);
    continue_walk(scene, weigh, walk_kind::from_camera, walk, 0,
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
    start(weigh, walk, x, weigh.start_light(end), scene.medium);
    const color<Real> flux = emitted(scene, x, ray.direction) * (end.cos.value / density);
    walk.front().throughput = flux;
    continue_walk(scene, weigh, walk_kind::from_light, walk, 0,
                  {ray.origin, ray.direction, flux, 0, 0, 1, 1, scene.medium}, {longest}, rng);
}

} // namespace bpt
