// A complete path, looked at from outside: everything here is computed anew from the finished path, its
// positions and directions, its materials, its end points, and nothing is what the walks told the weights.
#pragma once

#include "any_heuristic.hpp"
#include <bpt/render.hpp>

namespace lab {

using namespace bpt;

template <class Real> using renderer = bpt::renderer<Real, any_heuristic>;

template <class Real> struct seen_path {
    int size = 0;            // n
    int camera_vertices = 0; // s: x_0 ... x_{s-1} have been made by a camera walk
    const vertex<Real>* vertices[longest_path];
    const vertex<Real>* photon = nullptr; // merges only: the light walk's vertex that has been merged with
    int merged = -1;                      // and the place of the camera walk's

    // At each vertex, towards its neighbours, as walks have travelled: positions in float cannot give short
    // edges' directions back. Where walks have merged, the edge towards the light is the photon's.
    vec3<Real> to_camera[longest_path], to_light[longest_path];
    mis::measured_vertex<Real> records[longest_path];
    Real eta_to_camera[longest_path], eta_to_light[longest_path]; // 1 but at mirrors and glass

    const vertex<Real>& operator[](int i) const { return *vertices[i]; }
};

// The vertices and directions. Light walks are those that the photons come from, by number; only merges need
// them.
template <class Real>
void find_vertices(const complete_path<Real>& path, const std::vector<walk<Real>>& light_walks,
                   seen_path<Real>& seen) {
    const int n = path.size(), s = path.camera_vertices;
    seen.size = n;
    seen.camera_vertices = s;
    const vertex<Real>* light = path.light;
    if (path.photon) {
        light = light_walks[path.photon->walk].data();
        seen.photon = light + path.photon->vertices - 1;
        seen.merged = s - 1;
    }
    for (int i = 0; i < s; ++i)
        seen.vertices[i] = path.camera + i;
    for (int k = 0; k < path.light_vertices; ++k)
        seen.vertices[n - 1 - k] = light + k;

    const auto set_edge = [&](int i, const vec3<Real>& to_light) { // between x_i and x_{i+1}
        seen.to_light[i] = to_light;
        seen.to_camera[i + 1] = -to_light;
    };
    for (int i = 0; i + 1 < s; ++i)
        set_edge(i, -seen[i + 1].towards_previous);
    for (int i = s; i + 1 < n; ++i)
        set_edge(i, seen[i].towards_previous);
    if (s < n)
        set_edge(s - 1, seen.photon ? seen.photon->towards_previous : direction(seen[s - 1], seen[s]));
}

// Densities, cosines and distances of one vertex that scatters.
template <class Real> void record_surface(seen_path<Real>& seen, int i) {
    const vertex<Real>& x = seen[i];
    const vec3<Real>&to_camera = seen.to_camera[i], &to_light = seen.to_light[i];
    auto& record = seen.records[i];
    record.cos_to_camera = geometric_cosine(x, to_camera);
    record.cos_to_light = geometric_cosine(i == seen.merged ? *seen.photon : x, to_light);
    if (scatters_dirac(x)) {
        const bool by_camera = i < seen.camera_vertices;
        const bool reflects = dot(x.point.normal, to_camera) * dot(x.point.normal, to_light) > Real(0);
        const auto lobe = dirac_scatter(*x.material, x.point, by_camera ? to_camera : to_light, reflects);
        seen.eta_to_camera[i] = by_camera ? lobe.eta_from : lobe.eta_to;
        seen.eta_to_light[i] = by_camera ? lobe.eta_to : lobe.eta_from;
        record.pdf_to_camera =
            mis::dirac_density(lobe.probability, seen.eta_to_camera[i], record.cos_to_camera);
        record.pdf_to_light = mis::dirac_density(lobe.probability, seen.eta_to_light[i], record.cos_to_light);
        return;
    }
    material<Real> light_side = *x.material;
    if (i == seen.merged) // the light walk would go on from the photon
        light_side.survival = seen.photon->material->survival;
    record.pdf_to_light = density(*x.material, x.point, to_camera, to_light);
    record.pdf_to_camera = density(light_side, x.point, to_light, to_camera);
}

template <class Real> void record_ends(const scene<Real>& scene, int width, seen_path<Real>& seen) {
    const int last = seen.size - 1;
    const auto camera = camera_end_point(scene.camera, seen.to_light[0], width);
    const auto light = light_end_point(scene, seen[last], seen.to_camera[last]);
    const auto record = [&](int i, const mis::end_point<Real>& end) {
        seen.records[i].dirac = !end.hittable;
        seen.records[i].pdf_position = end.position.value;
        seen.records[i].pdf_next_event = end.next_event.value;
    };
    record(0, camera);
    record(last, light);
    seen.records[0].pdf_to_light = camera.direction.value;
    seen.records[0].cos_to_light = camera.cos.value;
    seen.records[last].pdf_to_camera = light.direction.value;
    seen.records[last].cos_to_camera = light.cos.value;
}

template <class Real>
seen_path<Real> look_at(const scene<Real>& scene, int width, const complete_path<Real>& path,
                        const std::vector<walk<Real>>& light_walks = {}) {
    seen_path<Real> seen;
    find_vertices(path, light_walks, seen);
    for (int i = 0; i < seen.size; ++i) {
        seen.records[i].kind = seen[i].kind;
        seen.eta_to_camera[i] = seen.eta_to_light[i] = 1;
        if (i > 0 && i + 1 < seen.size)
            record_surface(seen, i);
        if (i + 1 < seen.size)
            seen.records[i].distance2_to_light =
                squared_distance(i == seen.merged ? *seen.photon : seen[i], seen[i + 1]);
    }
    record_ends(scene, width, seen);
    return seen;
}

template <class Real> mis::measured_vertex<double> in_double(const mis::measured_vertex<Real>& r) {
    return {r.kind,
            r.dirac,
            double(r.pdf_to_light),
            double(r.pdf_to_camera),
            double(r.pdf_position),
            double(r.pdf_next_event),
            1,
            1,
            double(r.cos_to_camera),
            double(r.cos_to_light),
            double(r.distance2_to_light)};
}
// The path's records in double.
template <class Real> void records_of(const seen_path<Real>& path, mis::measured_vertex<double>* out) {
    for (int i = 0; i < path.size; ++i)
        out[i] = in_double(path.records[i]);
}

inline mis::technique_counts<double> in_double(const mis::technique_counts<double>& c) { return c; }
inline mis::technique_counts<double> in_double(const mis::technique_counts<float>& c) {
    return {c.light_hit,  c.next_event, c.connection,          c.camera_connection, c.direct,
            c.camera_hit, c.merge,      c.max_camera_vertices, c.max_light_vertices};
}

} // namespace lab
