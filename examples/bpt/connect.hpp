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
    Real weight = 0;       // filled in by who receives it
    Real right_weight = 0; // the same but where mistakes are planted
};

template <class Real>
contribution<Real> made_by(mis::technique_kind kind, int s, int n, int pixel, const color<Real>& value) {
    contribution<Real> c;
    c.technique = {kind, s};
    c.vertices = n;
    c.pixel = pixel;
    c.value = value;
    return c;
}

// The vertices of a complete path from camera to light. Walks are copied, not moved: their records are
// completed differently for each path that uses them.
template <class Real> struct complete_path {
    vertex<Real> vertices[longest_path];
    int size = 0;
    const vertex<Real>* photon = nullptr; // merges only: the light walk's vertex that has been merged with
    int merged = -1;                      // and the place of the camera walk's

    void join(const walk<Real>& camera, int s, const walk<Real>& light, int t) {
        size = s + t;
        photon = nullptr;
        merged = -1;
        for (int i = 0; i < s; ++i)
            vertices[i] = camera[static_cast<std::size_t>(i)];
        for (int i = 0; i < t; ++i)
            vertices[size - 1 - i] = light[static_cast<std::size_t>(i)];
    }
    vertex<Real>& operator[](int i) { return vertices[i]; }
};

// A camera walk and a light walk, and what all their techniques need.
template <class Real, class Weights> struct sample_pair {
    const bpt::scene<Real>& scene;
    const Weights& weigh;
    int width = 0;
    int pixel = 0; // of the camera walk
    int longest = longest_path;
    walk<Real> camera, light;
    complete_path<Real> path;
};

// Completes the record of a surface vertex for an edge chosen for it: `across` continues its walk along the
// edge.
template <class Real>
mis::subpath_end<Real> complete_end(vertex<Real>& x, const vec3<Real>& across, walk_kind kind) {
    const Real cosine = geometric_cosine(x, across);
    const Real forward = density(*x.material, x.point, x.towards_previous, across);
    const Real back = density(*x.material, x.point, across, x.towards_previous);
    record_scatter(x, kind, cosine, forward, back);
    return {x.state, mis::cosine{cosine}, mis::pdf_forward{forward}, mis::pdf_reverse{back}};
}

// s >= 2: the camera walk has hit a light.
template <class Real, class Weights, class Sink>
void light_hit(sample_pair<Real, Weights>& pair, Sink&& sink) {
    const int n = static_cast<int>(pair.camera.size());
    if (!is_light(pair.camera.back()))
        return;
    auto& path = pair.path;
    path.join(pair.camera, n, {}, 0);
    vertex<Real>& x = path[n - 1];
    const color<Real> emitted = emit(pair.scene, x, x.towards_previous);
    tell_hit(pair.weigh.mistakes, pair.scene, x);
    const color<Real> value = x.throughput * emitted / pair.weigh.counts.light_hit;
    sink(made_by(mis::technique_kind::light_hit, n, n, pair.pixel, value), path,
         [&] { return pair.weigh.light_hit(x.state, light_end_point(x)); });
}

// The end of a camera walk of s vertices is joined to a light point sampled for it.
template <class Real, class Weights, class Sink>
void next_event(sample_pair<Real, Weights>& pair, int s, pcg32& rng, Sink&& sink) {
    const int i = pick_light(pair.scene, &light<Real>::select_next_event, rng);
    const Real lobe_share = pair.scene.lights[static_cast<std::size_t>(i)].lobe_share_next_event;
    auto& path = pair.path;
    path.join(pair.camera, s, {sample_light_point(pair.scene, i, lobe_share, rng)}, 1);
    vertex<Real>& x = path[s - 1];
    vertex<Real>& y = path[s];
    const vec3<Real> to_light = direction(x, y);
    const color<Real> f = scattered(x, to_light, walk_kind::from_camera);
    const color<Real> emitted = emit(pair.scene, y, -to_light);
    if (f * emitted == color<Real>(0))
        return;
    const vec3<Real> target =
        is_infinite(y) ? x.point.position + 3 * pair.scene.radius * to_light : y.point.position;
    if (!is_visible(pair.scene, x.point.position, target))
        return;
    const Real distance2 = squared_distance(x, y);
    const mis::subpath_end<Real> end = complete_end(x, to_light, walk_kind::from_camera);
    x.record.distance2_to_light = distance2;
    tell_next_event(pair.weigh.mistakes, pair.scene, x, y, to_light, distance2);
    const Real samples = pair.weigh.counts.next_event * y.record.pdf_next_event;
    const color<Real> value = x.throughput * f * emitted * (y.record.cos_to_camera / (distance2 * samples));
    sink(made_by(mis::technique_kind::next_event, s, s + 1, pair.pixel, value), path,
         [&] { return pair.weigh.next_event(end, light_end_point(y), mis::squared_distance{distance2}); });
}

// The ends of a camera walk of s and a light walk of t vertices are joined.
template <class Real, class Weights, class Sink>
void connection(sample_pair<Real, Weights>& pair, int s, int t, Sink&& sink) {
    auto& path = pair.path;
    path.join(pair.camera, s, pair.light, t);
    vertex<Real>& x = path[s - 1];
    vertex<Real>& y = path[s];
    const vec3<Real> to_light = direction(x, y);
    const color<Real> f =
        scattered(x, to_light, walk_kind::from_camera) * scattered(y, -to_light, walk_kind::from_light);
    if (f == color<Real>(0) || !is_visible(pair.scene, x.point.position, y.point.position))
        return;
    const Real distance2 = squared_distance(x, y);
    const mis::subpath_end<Real> camera_end = complete_end(x, to_light, walk_kind::from_camera);
    const mis::subpath_end<Real> light_end = complete_end(y, -to_light, walk_kind::from_light);
    x.record.distance2_to_light = distance2;
    tell_connection(pair.weigh.mistakes, x, y, to_light, distance2);
    const color<Real> value = x.throughput * f * y.throughput / distance2;
    sink(made_by(mis::technique_kind::connection, s, s + t, pair.pixel, value), path,
         [&] { return pair.weigh.connection(camera_end, light_end, mis::squared_distance{distance2}); });
}

// The end of a light walk of t vertices is joined to a point of the lens; t = 1 is the technique `direct`.
template <class Real, class Weights, class Sink>
void camera_connection(sample_pair<Real, Weights>& pair, int t, pcg32& rng, Sink&& sink) {
    auto& path = pair.path;
    path.join({sample_lens(pair.scene.camera, rng)}, 1, pair.light, t);
    vertex<Real>& lens = path[0];
    vertex<Real>& y = path[1];
    const vec3<Real> leaving = direction(lens, y);
    const int pixel = pixel_of(pair.scene.camera, lens, leaving, pair.width);
    if (pixel < 0)
        return;
    aim(pair.scene.camera, lens, leaving, pair.width);
    const Real distance2 = squared_distance(lens, y);
    const bool direct = t == 1;
    color<Real> f;
    if (direct) {
        f = emit(pair.scene, y, -leaving);
        f *= y.record.cos_to_camera / y.record.pdf_position;
    } else {
        f = y.throughput * scattered(y, -leaving, walk_kind::from_light);
    }
    const vec3<Real> target =
        is_infinite(y) ? lens.point.position + 3 * pair.scene.radius * leaving : y.point.position;
    if (f == color<Real>(0) || !is_visible(pair.scene, lens.point.position, target))
        return;
    lens.record.distance2_to_light = distance2;
    tell_end(pair.weigh.mistakes, pair.scene, lens);
    // The pixel's response W |cos| is pdf_to_light times the density of the lens point, which has been
    // sampled.
    const color<Real> value = f * (lens.record.pdf_to_light / distance2);
    if (direct) {
        tell_end(pair.weigh.mistakes, pair.scene, y);
        sink(made_by(mis::technique_kind::direct, 1, 2, pixel, value / pair.weigh.counts.direct), path, [&] {
            return pair.weigh.direct(camera_end_point(lens), light_end_point(y),
                                     mis::squared_distance{distance2});
        });
        return;
    }
    const mis::subpath_end<Real> light_end = complete_end(y, -leaving, walk_kind::from_light);
    tell_scatter(pair.weigh.mistakes, y, walk_kind::from_light, -leaving);
    const color<Real> share = value / pair.weigh.counts.camera_connection;
    sink(made_by(mis::technique_kind::camera_connection, 1, t + 1, pixel, share), path, [&] {
        return pair.weigh.camera_connection(camera_end_point(lens), light_end,
                                            mis::squared_distance{distance2});
    });
}

// All techniques that are switched on, on all vertices. The sink is given the contribution without its
// weight, the complete path and a function that computes the weight. With `random`, each camera vertex is
// joined to one light vertex picked from the walk instead of to all; the weight then counts on their mean
// number (mis::random_connection).
template <class Real, class Weights, class Sink>
void connect_all(sample_pair<Real, Weights>& pair, bool random, pcg32& rng, Sink&& sink) {
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
        if (counts.connection <= Real(0))
            continue;
        int candidates[longest_path], count = 0;
        for (int t = 2; t < t_end; ++t)
            if (joinable(pair.light, t))
                candidates[count++] = t;
        if (random && count > 0) {
            const int t = candidates[std::uniform_int_distribution<int>(0, count - 1)(rng)];
            const auto times_count = [&](contribution<Real> c, complete_path<Real>& path,
                                         const auto& weight) {
                c.value *= static_cast<Real>(count);
                sink(c, path, weight);
            };
            if (s + t <= pair.longest)
                connection(pair, s, t, times_count);
            continue;
        }
        for (int k = 0; k < count; ++k)
            if (s + candidates[k] <= pair.longest)
                connection(pair, s, candidates[k], sink);
    }
    if (counts.direct > Real(0) && !pair.light.empty() && !pair.light[0].record.dirac)
        camera_connection(pair, 1, rng, sink);
    for (int t = 2; t < t_end; ++t)
        if (counts.camera_connection > Real(0) && t + 1 <= pair.longest && joinable(pair.light, t))
            camera_connection(pair, t, rng, sink);
}

} // namespace bpt
