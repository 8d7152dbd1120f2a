// The two random walks. Each vertex takes the three steps of the recursion: start, arrive, scatter.
#pragma once

#include "mistakes.hpp"

namespace bpt {

template <class Real> using walk = std::vector<vertex<Real>>; // its own end point first

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

// The record names directions by the path's ends, a walk by its own way.
template <class Real>
void record_scatter(vertex<Real>& x, walk_kind kind, Real cos_out, Real forward, Real reverse) {
    const bool camera = kind == walk_kind::from_camera;
    (camera ? x.record.cos_to_light : x.record.cos_to_camera) = cos_out;
    (camera ? x.record.pdf_to_light : x.record.pdf_to_camera) = forward;
    (camera ? x.record.pdf_to_camera : x.record.pdf_to_light) = reverse;
}

// Leaves the walk's last vertex in a sampled direction. Returns false where the walk ends. `state` and
// `throughput` are on their way to the next vertex.
template <class Real, class Weights>
bool scatter(vertex<Real>& x, const Weights& weigh, walk_kind kind, pcg32& rng,
             mis::subpath_state<Real>& state, color<Real>& throughput, vec3<Real>& to) {
    const material<Real>& m = *x.material;
    if (uniform<Real>(rng) >= m.survival)
        return false;
    if (is_dirac(m)) {
        const dirac_lobe<Real> lobe = sample_dirac(m, x.point, x.towards_previous, rng);
        const Real cos_in = geometric_cosine(x, x.towards_previous);
        const Real cos_out = geometric_cosine(x, lobe.to);
        to = lobe.to;
        state = weigh.scatter_dirac(x.state, mis::cosine{cos_in}, mis::pdf_forward{lobe.probability},
                                    mis::pdf_reverse{lobe.probability}, mis::eta_in{lobe.eta_from},
                                    mis::eta_out{lobe.eta_to});
        throughput = x.throughput * lobe.value * (radiance_scale(lobe, kind) / lobe.probability);
        const bool camera = kind == walk_kind::from_camera;
        x.eta_to_camera = camera ? lobe.eta_from : lobe.eta_to;
        x.eta_to_light = camera ? lobe.eta_to : lobe.eta_from;
        record_scatter(x, kind, cos_out, mis::dirac_density(lobe.probability, lobe.eta_to, cos_out),
                       mis::dirac_density(lobe.probability, lobe.eta_from, cos_in));
        tell_scatter(weigh.mistakes, x, kind, to);
        return true;
    }
    to = sample(m, x.point, x.towards_previous, rng);
    const color<Real> f = scattered(x, to, kind);
    if (f == color<Real>(0))
        return false;
    const Real cos_out = geometric_cosine(x, to);
    const Real forward = density(m, x.point, x.towards_previous, to);
    const Real reverse = density(m, x.point, to, x.towards_previous);
    state =
        weigh.scatter(x.state, mis::cosine{cos_out}, mis::pdf_forward{forward}, mis::pdf_reverse{reverse});
    throughput = x.throughput * f / forward;
    record_scatter(x, kind, cos_out, forward, reverse);
    tell_scatter(weigh.mistakes, x, kind, to);
    return true;
}

// Continues a walk that has left its end point until it leaves the scene, is absorbed, hits a light or has
// `longest` vertices; a camera walk that merges once stays where it can.
template <class Real, class Weights>
void continue_walk(const scene<Real>& scene, const Weights& weigh, walk_kind kind, walk<Real>& walk,
                   ray<Real> ray, mis::subpath_state<Real> state, color<Real> throughput, int longest,
                   pcg32& rng) {
    const bool camera = kind == walk_kind::from_camera;
    while (static_cast<int>(walk.size()) < longest) {
        vertex<Real> x;
        if (const auto hit = intersect(scene, ray.origin, ray.direction)) {
            const bool on_light = hit->light >= 0;
            if (on_light && !camera)
                return; // lights do not scatter
            if (on_light)
                x = light_vertex(scene, hit->light, hit->position, hit->normal);
            x.point = *hit;
            x.material = on_light ? nullptr : &scene.materials[static_cast<std::size_t>(hit->material)];
            if (!on_light && is_dirac(*x.material))
                x.record.kind = mis::vertex_kind::dirac;
        } else if (camera && scene.environment >= 0) {
            x = light_vertex(scene, scene.environment, vec3<Real>(0), ray.direction);
        } else {
            return;
        }
        vertex<Real>& previous = walk.back();
        const Real distance2 = squared_distance(previous, x);
        x.towards_previous = -ray.direction;
        x.throughput = throughput;
        const Real cos_in = geometric_cosine(x, ray.direction);
        (camera ? x.record.cos_to_camera : x.record.cos_to_light) = cos_in;
        (camera ? previous : x).record.distance2_to_light = distance2;
        x.state = weigh.arrive(state, mis::squared_distance{distance2}, mis::cosine{cos_in});
        tell_arrival(weigh.mistakes, previous, x, kind, ray.direction);
        walk.push_back(x);
        const bool stays = camera && weigh.merges_once && can_join(x);
        if (is_light(x) || stays || !scatter(walk.back(), weigh, kind, rng, state, throughput, ray.direction))
            return;
        ray.origin = x.point.position;
    }
}

// Starts at a random point of the lens, for a point of the film.
template <class Real, class Weights>
void walk_from_camera(const scene<Real>& scene, const Weights& weigh, int width, Real film_x, Real film_y,
                      int longest, walk<Real>& walk, pcg32& rng) {
    vertex<Real> lens = sample_lens(scene.camera, rng);
    const vec3<Real> leaving = film_to_direction(scene.camera, lens, film_x, film_y);
    aim(scene.camera, lens, leaving, width);
    tell_end(weigh.mistakes, scene, lens);
    walk.assign(1, lens);
    continue_walk(scene, weigh, walk_kind::from_camera, walk, {lens.point.position, leaving},
                  weigh.start_camera(camera_end_point(lens)), color<Real>(1), longest, rng);
}

// Starts at a random point of a random light.
template <class Real, class Weights>
void walk_from_light(const scene<Real>& scene, const Weights& weigh, int longest, walk<Real>& walk,
                     pcg32& rng) {
    const int i = pick_light(scene, &light<Real>::select_emission, rng);
    vertex<Real> x =
        sample_light_point(scene, i, scene.lights[static_cast<std::size_t>(i)].lobe_share_emission, rng);
    const ray<Real> ray = sample_emission(scene, x, rng);
    const color<Real> emitted = emit(scene, x, ray.direction);
    const Real density = x.record.pdf_position * x.record.pdf_to_camera;
    tell_end(weigh.mistakes, scene, x);
    walk.assign(1, x);
    continue_walk(scene, weigh, walk_kind::from_light, walk, ray, weigh.start_light(light_end_point(x)),
                  emitted * (x.record.cos_to_camera / density), longest, rng);
}

} // namespace bpt
