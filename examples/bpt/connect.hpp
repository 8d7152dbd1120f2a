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
    const vertex<Real>* camera;
    int camera_vertices;
    const vertex<Real>* light; // its end point first. Merges: null, see photon
    int light_vertices;
    const bpt::photon<Real>* photon = nullptr; // merges: what x_{s-1} has been merged with

    int size() const { return camera_vertices + light_vertices; }
    const vertex<Real>& operator[](int i) const {
        return i < camera_vertices ? camera[i] : light[size() - 1 - i];
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

// s >= 2: the camera walk has hit a light.
template <class Real, class Weights, class Sink>
void light_hit(const sample_pair<Real, Weights>& pair, Sink&& sink) {
    const int n = static_cast<int>(pair.camera.size());
    const vertex<Real>& x = pair.camera.back();
    if (!is_light(x))
        return;
    const color<Real> value =
        x.throughput * emitted(pair.scene, x, x.towards_previous) / pair.weigh.counts.light_hit;
    const Real weight = pair.weigh.light_hit(x.state, light_end_point(pair.scene, x, x.towards_previous));
    sink({{mis::technique_kind::light_hit, n}, n, pair.pixel, value, weight},
         {pair.camera.data(), n, nullptr, 0});
}

// The end of a camera walk of s vertices is joined to a light point sampled for it.
template <class Real, class Weights, class Sink>
void next_event(const sample_pair<Real, Weights>& pair, int s, pcg32& rng, Sink&& sink) {
    const int i = pick_light(pair.scene, &light<Real>::select_next_event, rng);
    const Real lobe_share = pair.scene.lights[static_cast<std::size_t>(i)].lobe_share_next_event;
    const vertex<Real>& x = pair.camera[static_cast<std::size_t>(s - 1)];
    const vertex<Real> y = sample_light_point(pair.scene, i, lobe_share, rng);
    const vec3<Real> across = direction(x, y);
    const color<Real> f = scattered(x, across, walk_kind::from_camera);
    const color<Real> radiance = emitted(pair.scene, y, -across);
    const auto edge = f * radiance == color<Real>(0) ? std::nullopt : between(pair.scene, x, y, across);
    if (!edge)
        return;
    const mis::end_point<Real> light = light_end_point(pair.scene, y, -across);
    const mis::squared_distance distance2{squared_distance(x, y)};
    const Real samples = pair.weigh.counts.next_event * light.next_event.value;
    const color<Real> value =
        x.throughput * f * radiance * edge->transmittance * (light.cos.value / (distance2.value * samples));
    const Real weight =
        pair.weigh.next_event(end_towards(pair.weigh, walk_kind::from_camera, x, across, *edge), light,
                              distance2, to_light(*edge, y), to_camera(*edge, x));
    sink({{mis::technique_kind::next_event, s}, s + 1, pair.pixel, value, weight},
         {pair.camera.data(), s, &y, 1});
}

// The ends of a camera walk of s and a light walk of t vertices are joined; of any light walk, not only the
// pair's.
template <class Real, class Weights, class Sink>
void connection(const sample_pair<Real, Weights>& pair, int s, const walk<Real>& light, int t, Sink&& sink) {
    const vertex<Real>& x = pair.camera[static_cast<std::size_t>(s - 1)];
    const vertex<Real>& y = light[static_cast<std::size_t>(t - 1)];
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
    sink({{mis::technique_kind::connection, s}, s + t, pair.pixel, value, weight},
         {pair.camera.data(), s, light.data(), t});
}

// The end of a light walk of t vertices is joined to a point of the lens; t = 1 is the technique `direct`.
template <class Real, class Weights, class Sink>
void camera_connection(const sample_pair<Real, Weights>& pair, int t, pcg32& rng, Sink&& sink) {
    const auto& [scene, weigh, width, own_pixel, longest, camera, light] = pair;
    vertex<Real> lens = sample_lens(scene.camera, rng);
    lens.medium = scene.medium;
    const vertex<Real>& y = light[static_cast<std::size_t>(t - 1)];
    const vec3<Real> leaving = direction(lens, y);
    const int pixel = pixel_of(scene.camera, lens, leaving, width);
    if (pixel < 0)
        return;
    const mis::end_point<Real> lens_end = camera_end_point(scene.camera, leaving, width);
    const mis::squared_distance distance2{squared_distance(lens, y)};
    // The pixel's response W |cos| is the density of the direction times that of the lens point, which has
    // been sampled.
    const Real response = lens_end.direction.value / distance2.value;
    const complete_path<Real> path{&lens, 1, light.data(), t};
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

// All connections of the camera walk's end of s vertices to its own light walk. With `random`, it is joined
// to one light vertex picked from the walk instead of to all; the weight then counts on their mean number
// (mis::random_connection).
template <class Real, class Weights, class Sink>
void connect_to_own(const sample_pair<Real, Weights>& pair, int s, bool random, pcg32& rng, Sink&& sink) {
    int candidates[longest_path], count = 0;
    for (int t = 2; t < static_cast<int>(pair.light.size()) + 1; ++t)
        if (can_join(pair.light[static_cast<std::size_t>(t - 1)]))
            candidates[count++] = t;
    if (random && count > 0) {
        const int t = candidates[std::uniform_int_distribution<int>(0, count - 1)(rng)];
        const auto times_count = [&](contribution<Real> c, const complete_path<Real>& path) {
            c.value *= static_cast<Real>(count);
            sink(c, path);
        };
        if (s + t <= pair.longest)
            connection(pair, s, pair.light, t, times_count);
        return;
    }
    for (int k = 0; k < count; ++k)
        if (s + candidates[k] <= pair.longest)
            connection(pair, s, pair.light, candidates[k], sink);
}

// All techniques that are switched on, on all vertices: sink(contribution, complete path). connections(s)
// makes those of the camera walk's end of s vertices.
template <class Real, class Weights, class Sink, class Connections>
void connect_all(const sample_pair<Real, Weights>& pair, pcg32& rng, Sink&& sink, Connections&& connections) {
    const auto& counts = pair.weigh.counts;
    const int s_end = static_cast<int>(pair.camera.size()) + 1;
    const int t_end = static_cast<int>(pair.light.size()) + 1;
    const auto joinable = [&](const walk<Real>& walk, int i) {
        return can_join(walk[static_cast<std::size_t>(i - 1)]);
    };

    const int light_samples = static_cast<int>(counts.next_event);
    if (counts.light_hit > Real(0) && s_end > 2)
        light_hit(pair, sink);
    for (int s = 2; s < s_end; ++s) {
        if (!joinable(pair.camera, s))
            continue;
        for (int k = 0; k < light_samples && s + 1 <= pair.longest; ++k)
            next_event(pair, s, rng, sink);
        if (counts.connection > Real(0))
            connections(s);
    }
    if (counts.direct > Real(0) && !pair.light.empty() &&
        light_of(pair.scene, pair.light[0]).kind != light_kind::point)
        camera_connection(pair, 1, rng, sink);
    for (int t = 2; t < t_end; ++t)
        if (counts.camera_connection > Real(0) && t + 1 <= pair.longest && joinable(pair.light, t))
            camera_connection(pair, t, rng, sink);
}

} // namespace bpt
