// SPDX-License-Identifier: MIT
#pragma once

#include "ulp.hpp"

#include <mis/path.hpp>

// Random paths and random technique counts. Densities need not belong to any scene: weights must be right for
// all.

namespace test {

using mis::vertex_kind;

// How far apart the factors of a path may be: decades to either side of 1 for densities and squared
// distances, the smallest cosine, and the chance of a density of 0.
struct spread {
    double density, distance2, cosine, zeros;
};

// Densities as in a renderer.
constexpr spread ordinary = {3, 3, 1e-2, 0};

// Path after path beyond what the scalar can multiply, though each factor of P-> and P<- fits.
template <class T>
constexpr spread extreme = subnormals ? spread{20, 6, 1e-4, 0.02} : spread{8, 3, 1e-3, 0.02};
template <>
constexpr spread extreme<double> = subnormals ? spread{150, 40, 1e-8, 0.02} : spread{60, 15, 1e-4, 0.02};

template <class T> struct random_path {
    std::vector<mis::measured_vertex<T>> vertices;
    mis::technique_counts<T> counts;

    int size() const { return static_cast<int>(vertices.size()); }
    const mis::measured_vertex<T>* data() const { return vertices.data(); }
};

// Counts of any size, each technique off now and then. `direct` needs camera_connection, and camera_hit
// beside it next_event, in the O(1) weights.
template <class T> mis::technique_counts<T> random_counts(generator& g) {
    const auto count = [&](double decades) { return g.chance(0.15) ? T(0) : g.log_uniform<T>(0, decades); };
    mis::technique_counts<T> c;
    c.light_hit = count(1);
    c.next_event = count(1);
    c.connection = count(1);
    c.camera_connection = count(6);
    c.camera_hit = count(6);
    c.merge = count(6) * g.log_uniform<T>(-6, 0);
    if (c.camera_connection > 0 && c.next_event > 0)
        c.direct = count(6);
    return c;
}

template <class T> random_path<T> make_path(generator& g, int n, const spread& r) {
    random_path<T> path;
    path.counts = random_counts<T>(g);
    const auto density = [&] { return g.chance(r.zeros) ? T(0) : g.log_uniform<T>(-r.density, r.density); };
    const auto cosine = [&] { return g.log_uniform<T>(std::log10(r.cosine), 0); };
    for (int i = 0; i < n; ++i) {
        mis::measured_vertex<T> x;
        const double u = g.uniform();
        if (i == 0)
            x.kind = vertex_kind::camera;
        else if (i == n - 1)
            x.kind = u < 0.25 ? vertex_kind::infinite_light : vertex_kind::light;
        else
            x.kind = u < 0.25 ? vertex_kind::dirac : u < 0.35 ? vertex_kind::medium : vertex_kind::surface;
        const bool end = i == 0 || i == n - 1;
        x.dirac = end && g.chance(0.3);
        x.pdf_to_light = i < n - 1 ? density() : T(0);
        x.pdf_to_camera = i > 0 ? density() : T(0);
        if (end) {
            x.pdf_position = density();
            x.pdf_next_event = density();
        }
        if (x.kind == vertex_kind::medium) {
            x.pdf_distance_from_camera = g.log_uniform<T>(-2, 2);
            x.pdf_distance_from_light = g.log_uniform<T>(-2, 2);
        } else if (x.kind != vertex_kind::infinite_light) {
            x.cos_to_camera = i > 0 ? cosine() : T(1);
            x.cos_to_light = i < n - 1 ? cosine() : T(1);
        }
        x.merge_factor = g.chance(0.1) ? T(0) : g.log_uniform<T>(-1, 1);
        x.distance2_to_light = i < n - 1 ? g.log_uniform<T>(-r.distance2, r.distance2) : T(1);
        path.vertices.push_back(x);
    }
    if (path.vertices.back().kind == vertex_kind::infinite_light)
        path.vertices[path.vertices.size() - 2].distance2_to_light = 1;
    return path;
}

// The same path seen the other way: camera and light change places, and so do their walks and counts.
template <class T> random_path<T> mirrored(const random_path<T>& path) {
    random_path<T> result = path;
    const std::size_t n = path.vertices.size();
    for (std::size_t i = 0; i < n; ++i) {
        const auto& x = path.vertices[n - 1 - i];
        auto& y = result.vertices[i];
        y = x;
        std::swap(y.pdf_to_light, y.pdf_to_camera);
        std::swap(y.pdf_distance_from_camera, y.pdf_distance_from_light);
        std::swap(y.cos_to_camera, y.cos_to_light);
        y.distance2_to_light = i + 1 < n ? path.vertices[n - 2 - i].distance2_to_light : T(1);
    }
    std::swap(result.counts.light_hit, result.counts.camera_hit);
    std::swap(result.counts.next_event, result.counts.camera_connection);
    std::swap(result.counts.max_camera_vertices, result.counts.max_light_vertices);
    return result;
}

// Where the mirror image of the technique at `index` is.
inline int mirrored_index(int n, int index) { return index <= n ? n - index : n + (n - 1 - (index - n)); }

} // namespace test
