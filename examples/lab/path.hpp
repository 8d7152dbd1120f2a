// A complete path, looked at from outside: everything here is computed anew from the finished path, its
// positions and directions, its materials, its end points, and nothing is what the walks told the weights.
#pragma once

#include "any_heuristic.hpp"
#include <bpt/render.hpp>
#include <mis/verify/record.hpp>

namespace lab {

using namespace bpt;

template <class Real> using renderer = bpt::renderer<Real, any_heuristic>;

// An index-matched boundary that an edge passes. No vertex of a path.
template <class Real> struct boundary {
    int edge = 0;                                   // from x_i to x_{i+1}: i
    Real distance = 0, cosine = 1;                  // from x_i; between the edge and the boundary's normal
    Real pass_from_camera = 1, pass_from_light = 1; // of coming so far, from x_i and from x_{i+1}
};

template <class Real> struct seen_path {
    int size = 0;            // n
    int camera_vertices = 0; // s: x_0 ... x_{s-1} have been made by a camera walk
    const vertex<Real>* vertices[longest_path];
    std::optional<vertex<Real>> photon; // merges only: the light walk's vertex that has been merged with
    int merged = -1;                    // and the place of the camera walk's
    mis::merge_family family{};

    // At each vertex, towards its neighbours, as walks have travelled: positions in float cannot give short
    // edges' directions back. Where walks have merged, the edge towards the light is the photon's.
    vec3<Real> to_camera[longest_path], to_light[longest_path];
    mis::measured_vertex<Real> records[longest_path];
    Real eta_to_camera[longest_path], eta_to_light[longest_path]; // 1 but at mirrors and glass
    flight<Real> edges[longest_path];            // from x_i, or the photon, to x_{i+1}: what lies on it
    mis::family_sizes<Real> sizes[longest_path]; // of the merges at vertices in media
    mis::beams<Real> beams[longest_path];        // that end there
    std::vector<boundary<Real>> boundaries;      // from camera to light
    bpt::roulette<Real> roulette;                // that the densities know

    const vertex<Real>& operator[](int i) const { return *vertices[i]; }
};

// The vertices and directions. Light walks are those that the photons come from, by number; only merges need
// them.
template <class Real>
void find_vertices(const scene<Real>& scene, const complete_path<Real>& path,
                   const std::vector<walk<Real>>& light_walks, seen_path<Real>& seen) {
    const int n = path.size(), s = path.camera_vertices;
    seen.size = n;
    seen.camera_vertices = s;
    for (int i = 0; i < (path.photon ? s : n); ++i)
        seen.vertices[i] = &path[i];
    if (path.photon) {
        const vertex<Real>* const light =
            light_walks[path.photon->walk].data(); // those that merge do not split
        if (!is_in_medium(*path.camera)) {
            seen.photon = light[path.photon->vertices - 1];
        } else { // it may be any point of the walk's beam
            seen.photon = medium_vertex(scene, path.photon->medium, path.photon->position);
            seen.photon->towards_previous = path.photon->towards_previous;
        }
        seen.merged = s - 1;
        for (int k = 0; k < path.light_vertices; ++k)
            seen.vertices[n - 1 - k] = light + k;
    }

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

// The vertex from which an edge goes on to the light.
template <class Real> const vertex<Real>& start_of_edge(const seen_path<Real>& seen, int i) {
    return i == seen.merged ? *seen.photon : seen[i];
}

// The medium that the edge from x_i begins in.
template <class Real> int medium_of_edge(const scene<Real>& scene, const seen_path<Real>& seen, int i) {
    const vertex<Real>& x = start_of_edge(seen, i);
    if (i == 0)
        return scene.medium;
    return scatters_dirac(x) && x.material->kind == material_kind::glass
               ? medium_towards(scene, x.point, seen.to_light[i])
               : x.medium;
}

// What lies on the edge from x_i, followed anew. A surface that rounding has put there is no matter.
template <class Real> flight<Real> edge_from(const scene<Real>& scene, const seen_path<Real>& seen, int i) {
    vertex<Real> x = start_of_edge(seen, i);
    x.medium = medium_of_edge(scene, seen, i);
    bool is_blocked = false;
    return has_media(scene) ? between(scene, x, seen[i + 1], seen.to_light[i], is_blocked) : flight<Real>{};
}

// Adds the boundaries on the edge from x_i.
template <class Real> void add_boundaries(const scene<Real>& scene, seen_path<Real>& seen, int i) {
    const vertex<Real>&x = start_of_edge(seen, i), &y = seen[i + 1];
    const vec3<Real>& to = seen.to_light[i];
    const Real whole = is_infinite(y) ? 3 * scene.radius : std::sqrt(squared_distance(x, y));
    const std::size_t first = seen.boundaries.size();
    int medium = medium_of_edge(scene, seen, i);
    const auto passed = [&](Real length) { // in the present medium
        const auto* m = medium_at(scene, medium);
        return m ? mis::distance_in_medium(&m->extinction.x, 3, length).pass : Real(1);
    };
    Real begin = 0, reached = 1;
    for (;;) {
        const bool starts_in_medium = seen.boundaries.size() == first && is_in_medium(x);
        const auto hit = intersect(scene, x.point.position + begin * to, to, whole - begin,
                                   starts_in_medium ? Real(0) : scene.epsilon());
        if (!hit || !is_boundary(scene, *hit))
            break;
        const Real end = std::max(begin, dot(hit->position - x.point.position, to)),
                   piece = passed(end - begin);
        reached *= piece;
        for (std::size_t k = first; k < seen.boundaries.size(); ++k)
            seen.boundaries[k].pass_from_light *= piece;
        seen.boundaries.push_back({i, end, std::abs(dot(hit->normal, to)), reached, Real(1)});
        medium = medium_towards(scene, *hit, to);
        begin = end;
    }
    const Real piece = passed(whole - begin);
    for (std::size_t k = first; k < seen.boundaries.size(); ++k)
        seen.boundaries[k].pass_from_light *= piece;
}

// The rate of a walk at x_i, over the survival that densities have in them already.
template <class Real> Real over_survival(const seen_path<Real>& seen, walk_kind kind, int i) {
    const bool camera = kind == walk_kind::from_camera;
    return seen.roulette.over_survival(kind, camera ? seen[i] : start_of_edge(seen, i),
                                       camera ? seen.to_camera[i] : seen.to_light[i]);
}
// That rate: how many copies of a walk are expected to go on, all in all.
template <class Real> Real rate_at(const seen_path<Real>& seen, walk_kind kind, int i) {
    const auto& x = kind == walk_kind::from_camera ? seen[i] : start_of_edge(seen, i);
    return x.material->survival * over_survival(seen, kind, i);
}

// Densities, cosines and distances of one vertex that scatters.
template <class Real> void record_surface(seen_path<Real>& seen, int i) {
    const vertex<Real>& x = seen[i];
    const vec3<Real>&to_camera = seen.to_camera[i], &to_light = seen.to_light[i];
    auto& record = seen.records[i];
    record.cos_to_camera = geometric_cosine(x, to_camera);
    record.cos_to_light = geometric_cosine(start_of_edge(seen, i), to_light);
    if (scatters_dirac(x)) {
        const bool by_camera = i < seen.camera_vertices;
        const bool reflects = dot(x.point.normal, to_camera) * dot(x.point.normal, to_light) > Real(0);
        const auto lobe = dirac_scatter(*x.material, x.point, by_camera ? to_camera : to_light, reflects);
        seen.eta_to_camera[i] = by_camera ? lobe.eta_from : lobe.eta_to;
        seen.eta_to_light[i] = by_camera ? lobe.eta_to : lobe.eta_from;
        record.pdf_to_camera =
            mis::dirac_density(lobe.probability * over_survival(seen, walk_kind::from_light, i),
                               seen.eta_to_camera[i], record.cos_to_camera);
        record.pdf_to_light =
            mis::dirac_density(lobe.probability * over_survival(seen, walk_kind::from_camera, i),
                               seen.eta_to_light[i], record.cos_to_light);
        return;
    }
    material<Real> light_side = *x.material;
    if (i == seen.merged) // the light walk would go on from the photon
        light_side.survival = seen.photon->material->survival;
    record.pdf_to_light =
        density(*x.material, x.point, to_camera, to_light) * over_survival(seen, walk_kind::from_camera, i);
    record.pdf_to_camera =
        density(light_side, x.point, to_light, to_camera) * over_survival(seen, walk_kind::from_light, i);
}

template <class Real> void record_ends(const scene<Real>& scene, int width, seen_path<Real>& seen) {
    const int last = seen.size - 1;
    const auto camera = camera_end_point(scene.camera, seen.to_light[0], width);
    const auto light =
        light_end_point(seen.roulette, scene, seen[last], seen.to_camera[last], seen[last - 1]);
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
                        const std::vector<walk<Real>>& light_walks = {},
                        const bpt::roulette<Real>& roulette = {}) {
    seen_path<Real> seen;
    seen.roulette = roulette;
    find_vertices(scene, path, light_walks, seen);
    const bool has_boundaries =
        std::any_of(scene.materials.begin(), scene.materials.end(),
                    [](const material<Real>& m) { return m.kind == material_kind::boundary; });
    for (int i = 0; i + 1 < seen.size; ++i) {
        seen.edges[i] = edge_from(scene, seen, i);
        if (has_boundaries)
            add_boundaries(scene, seen, i);
    }
    for (int i = 0; i < seen.size; ++i) {
        seen.records[i].kind = seen[i].kind;
        seen.eta_to_camera[i] = seen.eta_to_light[i] = 1;
        if (i > 0 && i + 1 < seen.size)
            record_surface(seen, i);
        if (i + 1 < seen.size)
            seen.records[i].distance2_to_light = squared_distance(start_of_edge(seen, i), seen[i + 1]);
        if (i > 0)
            seen.records[i].pdf_distance_from_camera = seen.edges[i - 1].forward(is_in_medium(seen[i]));
        if (i + 1 < seen.size)
            seen.records[i].pdf_distance_from_light = seen.edges[i].reverse(is_in_medium(seen[i]));
        if (is_in_medium(seen[i]))
            seen.records[i].merge_factor = 0; // unless somebody merges there, see below
    }
    record_ends(scene, width, seen);
    return seen;
}

// With the merges of a renderer.
template <class Real>
seen_path<Real> look_at(const renderer<Real>& r, const contribution<Real>& c, const complete_path<Real>& path,
                        const std::vector<walk<Real>>& light_walks = {}) {
    seen_path<Real> seen = look_at(r.scene, r.set.width, path, light_walks, r.weigh.roulette);
    seen.family = c.family;
    for (int i = 1; i + 1 < seen.size; ++i) {
        auto& factor = seen.records[i].merge_factor;
        factor = r.weigh.surface_factor;
        if (!is_in_medium(seen[i]))
            continue;
        seen.beams[i] = {r.weigh.beam(walk_kind::from_camera, seen.edges[i - 1].last),
                         r.weigh.beam(walk_kind::from_light, seen.edges[i].first)};
        const Real sine = length(cross(seen.to_camera[i], seen.to_light[i]));
        seen.sizes[i] = mis::at_vertex(r.weigh.media.sizes, seen.beams[i], sine);
        factor = r.weigh.media.any() ? joined(r.weigh.heuristic, seen.sizes[i]) : Real(0);
    }
    return seen;
}

template <class Real> mis::family_sizes<double> in_double(const mis::family_sizes<Real>& k) {
    return {double(k.point_point), double(k.point_beam), double(k.beam_point), double(k.beam_beam)};
}

// Of a vertex' merges, the part that is the path's family's; 1 for what is no merge in a medium.
template <class Real>
double family_share(const any_heuristic& heuristic, const seen_path<Real>& path, mis::technique t) {
    const int i = t.camera_vertices - 1;
    if (t.kind != mis::technique_kind::merge || !is_in_medium(path[i]))
        return 1;
    return mis::family_share(heuristic, in_double(path.sizes[i]), path.family);
}

template <class Real> mis::measured_vertex<double> in_double(const mis::measured_vertex<Real>& r) {
    return {r.kind,
            r.dirac,
            double(r.pdf_to_light),
            double(r.pdf_to_camera),
            double(r.pdf_position),
            double(r.pdf_next_event),
            double(r.pdf_distance_from_camera),
            double(r.pdf_distance_from_light),
            double(r.cos_to_camera),
            double(r.cos_to_light),
            double(r.distance2_to_light),
            double(r.merge_factor)};
}
// The path's records in double.
template <class Real> void records_of(const seen_path<Real>& path, mis::measured_vertex<double>* out) {
    for (int i = 0; i < path.size; ++i)
        out[i] = in_double(path.records[i]);
}

} // namespace lab
