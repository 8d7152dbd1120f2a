// The techniques: how the two walks of one sample become complete paths, and what each path carries.
#pragma once

#include "walk.hpp"

namespace bpt {

constexpr int longest_path = 10; // vertices

// One path made by one technique: `value` is what the technique estimates with it alone, divided by its
// samples.
template <class Real> struct contribution {
    mis::technique technique{};
    int vertices = 0;
    int pixel = 0;
    color<Real> value{0};
    Real weight = 0;
    mis::merge_family family{}; // of a merge in a medium
};

// The vertices of a complete path: x_0 ... x_{s-1} of a camera walk, and a light walk's in the other
// direction. They are the renderer's own, and change with its next path.
template <class Real> struct photon;
template <class Real> struct complete_path {
    const vertex<Real>* camera; // x_{s-1}; those before it go back to the lens
    int camera_vertices;
    const vertex<Real>* light; // x_s; those before it go back to the light. None: null. Merges: see photon
    int light_vertices;
    const bpt::photon<Real>* photon = nullptr; // merges: what x_{s-1} has been merged with

    int size() const { return camera_vertices + light_vertices; }
    const vertex<Real>& operator[](int i) const {
        const bool by_camera = i < camera_vertices;
        const vertex<Real>* x = by_camera ? camera : light;
        for (int k = by_camera ? camera_vertices - 1 - i : i - camera_vertices; k > 0; --k)
            x = &previous(*x);
        return *x;
    }
};

// A camera walk and a light walk, and what all their techniques need.
template <class Real, class Weights> struct sample_pair {
    const bpt::scene<Real>& scene;
    const Weights& weigh;
    int width = 0;
    int pixel = 0; // of the camera walk
    int longest = longest_path;
    walk<Real> camera, light;
};

// The camera walk has hit a light at x.
template <class Real, class Weights, class Sink>
void light_hit(const sample_pair<Real, Weights>& pair, const vertex<Real>& x, Sink&& sink) {
    const int n = x.depth;
    const color<Real> value =
        x.throughput * emitted(pair.scene, x, x.towards_previous) / pair.weigh.counts.light_hit;
    const Real weight = pair.weigh.light_hit(
        x.state, light_end_point(pair.weigh.roulette, pair.scene, x, x.towards_previous, previous(x)));
    sink({{mis::technique_kind::light_hit, n}, n, pair.pixel, value, weight}, {&x, n, nullptr, 0});
}

// The end of a camera walk, x, is joined to a light point sampled for it.
template <class Real, class Weights, class Sink>
void next_event(const sample_pair<Real, Weights>& pair, const vertex<Real>& x, pcg32& rng, Sink&& sink) {
    const int s = x.depth;
    const int i = pick_light(pair.scene, &light<Real>::select_next_event, rng);
    const Real lobe_share = pair.scene.lights[static_cast<std::size_t>(i)].lobe_share_next_event;
    const vertex<Real> y = sample_light_point(pair.scene, i, lobe_share, rng);
    const vec3<Real> across = direction(x, y);
    const color<Real> f = scattered(x, across, walk_kind::from_camera);
    const color<Real> radiance = emitted(pair.scene, y, -across);
    const auto edge = f * radiance == color<Real>(0) ? std::nullopt : between(pair.scene, x, y, across);
    if (!edge)
        return;
    const mis::end_point<Real> light = light_end_point(pair.weigh.roulette, pair.scene, y, -across, x);
    const mis::squared_distance distance2{squared_distance(x, y)};
    const Real density = light_end_point(pair.scene, y, -across).next_event.value,
               samples = pair.weigh.counts.next_event * density * x.next_event_rate;
    const color<Real> value =
        x.throughput * f * radiance * edge->transmittance * (light.cos.value / (distance2.value * samples));
    const Real weight =
        pair.weigh.next_event(end_towards(pair.weigh, walk_kind::from_camera, x, across, *edge), light,
                              distance2, to_light(*edge, y), to_camera(*edge, x));
    sink({{mis::technique_kind::next_event, s}, s + 1, pair.pixel, value, weight}, {&x, s, &y, 1});
}

// The ends of a camera walk and of a light walk, x and y, are joined; of any light walk, not only the pair's.
template <class Real, class Weights, class Sink>
void connection(const sample_pair<Real, Weights>& pair, const vertex<Real>& x, const vertex<Real>& y,
                Sink&& sink) {
    const int s = x.depth, t = y.depth;
    const vec3<Real> across = direction(x, y);
    const color<Real> f =
        scattered(x, across, walk_kind::from_camera) * scattered(y, -across, walk_kind::from_light);
    const auto edge = f == color<Real>(0) ? std::nullopt : between(pair.scene, x, y, across);
    if (!edge)
        return;
    const color<Real> value = x.throughput * f * y.throughput * edge->transmittance / squared_distance(x, y);
    const mis::squared_distance distance2 = edge_between(pair.weigh, x, y);
    const Real weight =
        pair.weigh.connection(end_towards(pair.weigh, walk_kind::from_camera, x, across, *edge),
                              end_towards(pair.weigh, walk_kind::from_light, y, -across, reversed(*edge)),
                              distance2, to_light(*edge, y), to_camera(*edge, x));
    sink({{mis::technique_kind::connection, s}, s + t, pair.pixel, value, weight}, {&x, s, &y, t});
}

// The end of a light walk, y, is joined to a point of the lens; the light itself: the technique `direct`.
template <class Real, class Weights, class Sink>
void camera_connection(const sample_pair<Real, Weights>& pair, const vertex<Real>& y, pcg32& rng,
                       Sink&& sink) {
    const auto& [scene, weigh, width, own_pixel, longest, camera, light] = pair;
    const int t = y.depth;
    vertex<Real> lens = sample_lens(scene.camera, rng);
    lens.medium = scene.medium;
    const vec3<Real> leaving = direction(lens, y);
    const int pixel = pixel_of(scene.camera, lens, leaving, width);
    if (pixel < 0)
        return;
    const mis::end_point<Real> lens_end = camera_end_point(scene.camera, leaving, width);
    const mis::squared_distance distance2{squared_distance(lens, y)};
    // The pixel's response W |cos| is the density of the direction times that of the lens point, which has
    // been sampled.
    const Real response = lens_end.direction.value / distance2.value;
    const complete_path<Real> path{&lens, 1, &y, t};
    if (t == 1) {
        const mis::end_point<Real> light_end = light_end_point(scene, y, -leaving);
        color<Real> f = emitted(scene, y, -leaving);
        f *= light_end.cos.value / light_end.position.value;
        const auto edge = f == color<Real>(0) ? std::nullopt : between(scene, lens, y, leaving);
        if (edge)
            sink({{mis::technique_kind::direct, 1},
                  2,
                  pixel,
                  f * edge->transmittance * response / weigh.counts.direct,
                  weigh.direct(lens_end, light_end, distance2, to_light(*edge, y), to_camera(*edge, lens))},
                 path);
        return;
    }
    const color<Real> f = y.throughput * scattered(y, -leaving, walk_kind::from_light);
    const auto edge = f == color<Real>(0) ? std::nullopt : between(scene, lens, y, leaving);
    if (!edge)
        return;
    const auto light_end = end_towards(weigh, walk_kind::from_light, y, -leaving, reversed(*edge));
    sink(
        {{mis::technique_kind::camera_connection, 1},
         t + 1,
         pixel,
         f * edge->transmittance * response / weigh.counts.camera_connection,
         weigh.camera_connection(lens_end, light_end, distance2, to_light(*edge, y), to_camera(*edge, lens))},
        path);
}

// All connections of a camera walk's end, x, to the pair's own light walk. With `random`, it is joined to one
// light vertex picked from the walk instead of to all; the weight then counts on their mean number
// (mis::random_connection).
template <class Real, class Weights, class Sink>
void connect_to_own(const sample_pair<Real, Weights>& pair, const vertex<Real>& x, bool random, pcg32& rng,
                    Sink&& sink) {
    int count = 0;
    for (std::size_t i = 1; i < pair.light.size(); ++i) {
        const vertex<Real>& y = pair.light[i];
        if (!can_join(y))
            continue;
        ++count;
        if (!random && x.depth + y.depth <= pair.longest)
            connection(pair, x, y, sink);
    }
    if (!random || count == 0)
        return;
    int left = std::uniform_int_distribution<int>(0, count - 1)(rng);
    const auto times_count = [&](contribution<Real> c, const complete_path<Real>& path) {
        c.value *= static_cast<Real>(count);
        sink(c, path);
    };
    for (std::size_t i = 1; i < pair.light.size(); ++i)
        if (const auto& y = pair.light[i]; can_join(y) && left-- == 0 && x.depth + y.depth <= pair.longest)
            connection(pair, x, y, times_count);
}

// All techniques that are switched on, on all vertices: sink(contribution, complete path). connections(x)
// makes those of the camera walk's end x.
template <class Real, class Weights, class Sink, class Connections>
void connect_all(const sample_pair<Real, Weights>& pair, pcg32& rng, Sink&& sink, Connections&& connections) {
    const auto& counts = pair.weigh.counts;
    const int light_samples = static_cast<int>(counts.next_event);
    if (counts.light_hit > Real(0))
        for (const auto& x : pair.camera)
            if (is_light(x))
                light_hit(pair, x, sink);
    for (std::size_t i = 1; i < pair.camera.size(); ++i) {
        const vertex<Real>& x = pair.camera[i];
        if (!can_join(x))
            continue;
        const int next_events = x.next_events < 0 ? light_samples : x.next_events;
        for (int k = 0; k < next_events && x.depth + 1 <= pair.longest; ++k)
            next_event(pair, x, rng, sink);
        if (counts.connection > Real(0))
            connections(x);
    }
    if (counts.direct > Real(0) && !pair.light.empty() &&
        light_of(pair.scene, pair.light[0]).kind != light_kind::point)
        camera_connection(pair, pair.light[0], rng, sink);
    for (std::size_t i = 1; i < pair.light.size(); ++i)
        if (const auto& y = pair.light[i];
            counts.camera_connection > Real(0) && y.depth + 1 <= pair.longest && can_join(y))
            camera_connection(pair, y, rng, sink);
}

} // namespace bpt
