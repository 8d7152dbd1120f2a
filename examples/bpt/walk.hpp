// The two random walks. Each vertex takes the three steps of the recursion: start, arrive, scatter.
#pragma once

#include "vertex.hpp"

namespace bpt {

template <class Real> using walk = std::vector<vertex<Real>>; // its own end point first

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

// Leaves the walk's last vertex in a sampled direction. Returns false where the walk ends. `state` and
// `throughput` are on their way to the next vertex.
template <class Real, class Weights>
bool scatter(const vertex<Real>& x, const Weights& weigh, walk_kind kind, pcg32& rng,
             mis::subpath_state<Real>& state, color<Real>& throughput, vec3<Real>& to) {
    const material<Real>& m = *x.material;
    if (uniform<Real>(rng) >= m.survival)
        return false;
    if (is_dirac(m)) {
        const dirac_lobe<Real> lobe = sample_dirac(m, x.point, x.towards_previous, rng);
        const mis::cosine cos_in{geometric_cosine(x, x.towards_previous)};
        to = lobe.to;
        state = weigh.scatter_dirac(x.state, cos_in, mis::pdf_forward{lobe.probability},
                                    mis::pdf_reverse{lobe.probability}, mis::eta_in{lobe.eta_from},
                                    mis::eta_out{lobe.eta_to});
        throughput = x.throughput * lobe.value * (radiance_scale(lobe, kind) / lobe.probability);
        return true;
    }
    to = sample(m, x.point, x.towards_previous, rng);
    const color<Real> f = scattered(x, to, kind);
    if (f == color<Real>(0))
        return false;
    const mis::cosine cos_out{geometric_cosine(x, to)};
    const mis::pdf_forward forward{density(m, x.point, x.towards_previous, to)};
    const mis::pdf_reverse reverse{density(m, x.point, to, x.towards_previous)};
    state = weigh.scatter(x.state, cos_out, forward, reverse);
    throughput = x.throughput * f / forward.value;
    return true;
}

// What a ray meets: a surface, a light (camera walks only: lights do not scatter), or nothing.
template <class Real>
std::optional<vertex<Real>> meet(const scene<Real>& scene, walk_kind kind, const ray<Real>& ray) {
    const bool camera = kind == walk_kind::from_camera;
    vertex<Real> x;
    if (const auto hit = intersect(scene, ray.origin, ray.direction)) {
        const bool on_light = hit->light >= 0;
        if (on_light && !camera)
            return std::nullopt;
        if (on_light)
            x = light_vertex(scene, hit->light, hit->position, hit->normal);
        x.point = *hit;
        x.material = on_light ? nullptr : &scene.materials[static_cast<std::size_t>(hit->material)];
        if (!on_light && is_dirac(*x.material))
            x.kind = mis::vertex_kind::dirac;
        return x;
    }
    if (camera && scene.environment >= 0)
        return light_vertex(scene, scene.environment, vec3<Real>(0), ray.direction);
    return std::nullopt;
}

// Continues a walk that has left its end point until it leaves the scene, is absorbed, hits a light or has
// reached its limits.
template <class Real, class Weights>
void continue_walk(const scene<Real>& scene, const Weights& weigh, walk_kind kind, walk<Real>& walk,
                   ray<Real> ray, mis::subpath_state<Real> state, color<Real> throughput, walk_limits limits,
                   pcg32& rng) {
    while (static_cast<int>(walk.size()) < limits.vertices) {
        std::optional<vertex<Real>> x = meet(scene, kind, ray);
        if (!x)
            return;
        const mis::squared_distance distance2{squared_distance(walk.back(), *x)};
        const mis::cosine cos_in{geometric_cosine(*x, ray.direction)};
        x->towards_previous = -ray.direction;
        x->throughput = throughput;
        x->state = weigh.arrive(state, distance2, cos_in);
        walk.push_back(*x);
        const bool stays = limits.ends_where_it_can_join && can_join(*x);
        if (is_light(*x) || stays || !scatter(*x, weigh, kind, rng, state, throughput, ray.direction))
            return;
        ray.origin = x->point.position;
    }
}

// Starts at a random point of the lens, for a point of the film.
template <class Real, class Weights>
void walk_from_camera(const scene<Real>& scene, const Weights& weigh, int width, Real film_x, Real film_y,
                      walk_limits limits, walk<Real>& walk, pcg32& rng) {
    const vertex<Real> lens = sample_lens(scene.camera, rng);
    const vec3<Real> leaving = film_to_direction(scene.camera, lens, film_x, film_y);
    const mis::end_point<Real> end = camera_end_point(scene.camera, leaving, width);
    walk.assign(1, lens);
    continue_walk(scene, weigh, walk_kind::from_camera, walk, {lens.point.position, leaving},
                  weigh.start_camera(end), color<Real>(1), limits, rng);
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
    walk.assign(1, x);
    continue_walk(scene, weigh, walk_kind::from_light, walk, ray, weigh.start_light(end),
                  emitted(scene, x, ray.direction) * (end.cos.value / density), {longest}, rng);
}

} // namespace bpt
