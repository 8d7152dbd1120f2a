// Writes weighted paths as JSON Lines, one contribution each, for tools that check weights.
#pragma once

#include "weigh.hpp"
#include <mis/verify/record.hpp>
#include <nlohmann/json.hpp>

namespace lab {

using mis::name_of;

template <class Real> nlohmann::ordered_json to_json(const vec3<Real>& v) { return {v.x, v.y, v.z}; }

// Rates that are learned may be above 1, and are another number for each walk.
template <class Real> void rates_to_json(const seen_path<Real>& path, int i, nlohmann::ordered_json& j) {
    const Real to_light = rate_at(path, walk_kind::from_camera, i);
    if (!is_learned(path.roulette.mode)) {
        j["survival"] = to_light;
        return;
    }
    j["splits"] = to_light;
    j["splits_to_camera"] = rate_at(path, walk_kind::from_light, i);
}

template <class Real>
nlohmann::ordered_json to_json(const scene<Real>& scene, const seen_path<Real>& path, int i) {
    const vertex<Real>& x = path[i];
    const auto& r = path.records[i];
    const bool has_previous = i > 0, has_next = i + 1 < path.size;
    nlohmann::ordered_json j{{"kind", name_of(r.kind)}};
    if (is_infinite(x)) {
        j["direction"] = to_json(x.point.normal);
    } else {
        j["position"] = to_json(x.point.position);
        if (x.point.normal != vec3<Real>(0))
            j["normal"] = to_json(x.point.normal);
        if (x.point.shading_normal != x.point.normal)
            j["shading_normal"] = to_json(x.point.shading_normal);
    }
    if (has_next) {
        j["pdf_to_light"] = r.pdf_to_light;
        j["cos_to_light"] = r.cos_to_light;
        j["distance"] = std::sqrt(r.distance2_to_light);
    }
    if (has_previous) {
        j["pdf_to_camera"] = r.pdf_to_camera;
        j["cos_to_camera"] = r.cos_to_camera;
    }
    if (has_media(scene) && has_previous)
        j["pdf_distance_from_camera"] = r.pdf_distance_from_camera;
    if (has_media(scene) && has_next)
        j["pdf_distance_from_light"] = r.pdf_distance_from_light;
    if (is_in_medium(x)) {
        j["beam_from_camera"] = path.beams[i].from_camera;
        j["beam_from_light"] = path.beams[i].from_light;
        j["sin_angle"] = length(cross(path.to_camera[i], path.to_light[i]));
        j["pass_from_camera"] = path.edges[i - 1].last.pass;
        j["pass_from_light"] = path.edges[i].first.pass;
    }
    for (const auto& b : path.boundaries)
        if (b.edge == i)
            j["boundaries"].push_back({{"distance", b.distance},
                                       {"cos", b.cosine},
                                       {"pass_from_camera", b.pass_from_camera},
                                       {"pass_from_light", b.pass_from_light}});
    if (!has_previous || !has_next)
        j["pdf_position"] = r.pdf_position;
    if (is_light(x)) {
        j["pdf_next_event"] = r.pdf_next_event;
        const light<Real>& l = light_of(scene, x);
        j["selection"] = l.select_emission;
        j["selection_next_event"] = l.select_next_event;
    }
    if (r.dirac && is_light(x))
        j["dirac"] = true;
    if (x.material) {
        rates_to_json(path, i, j);
        j["material"] = is_in_medium(x) ? static_cast<std::ptrdiff_t>(scene.materials.size()) + x.medium
                                        : x.material - scene.materials.data();
    }
    if (scatters_dirac(x)) {
        j["eta_to_camera"] = path.eta_to_camera[i];
        j["eta_to_light"] = path.eta_to_light[i];
    }
    return j;
}

// The light walk's vertex of a merge: the edge to the light starts there.
template <class Real> nlohmann::ordered_json photon_to_json(const vertex<Real>& x, Real survival) {
    nlohmann::ordered_json j{{"position", to_json(x.point.position)}};
    if (!is_in_medium(x))
        j["normal"] = to_json(x.point.normal);
    j["survival"] = survival;
    if (x.point.shading_normal != x.point.normal)
        j["shading_normal"] = to_json(x.point.shading_normal);
    return j;
}

// The families that are on, as how many light walks and which radius.
template <class Real> void families_to_json(const renderer<Real>& r, nlohmann::ordered_json& j) {
    using family = mis::merge_family;
    const auto& merges = r.set.media;
    for (const auto kind : {family::point_point, family::point_beam, family::beam_point, family::beam_beam}) {
        if (!(mis::size_of(merges.sizes, kind) > Real(0)))
            continue;
        const auto [kernel, walks] = kernel_and_walks(r, kind, Real(1));
        j["families"][name_of(kind)] = {{"count", walks}, {"radius", mis::size_of(merges.radii, kind)}};
    }
}

// Merges are dumped as the number of light walks and the radius, not as their product.
template <class Real>
std::string to_json_line(const renderer<Real>& r, const contribution<Real>& c, const seen_path<Real>& path) {
    const any_heuristic& heuristic = r.weigh.heuristic;
    nlohmann::ordered_json j{{"technique", name_of(c.technique.kind)},
                             {"camera_vertices", c.technique.camera_vertices},
                             {"weight", c.weight},
                             {"heuristic", name_of(heuristic.kind)}};
    if (heuristic.kind == heuristic_kind::power)
        j["beta"] = heuristic.parameter;
    if (heuristic.kind == heuristic_kind::cutoff)
        j["alpha"] = heuristic.parameter;
    const auto counts = counts_for(r, path);
    for (const auto kind :
         {mis::technique_kind::light_hit, mis::technique_kind::next_event, mis::technique_kind::connection,
          mis::technique_kind::camera_connection, mis::technique_kind::direct})
        if (const Real count = mis::count_of(counts, kind); count > Real(0))
            j["counts"][name_of(kind)] = count;
    if (const Real merges = counts.merge * r.weigh.surface_factor; merges > Real(0)) {
        j["counts"][name_of(mis::technique_kind::merge)] =
            std::round(merges / mis::merge_area(r.set.merge_radius));
        j["radius"] = r.set.merge_radius;
    }
    if (has_media(r.scene) && r.set.media.any())
        families_to_json(r, j);
    if (c.technique.kind == mis::technique_kind::merge && is_in_medium(path[c.technique.camera_vertices - 1]))
        j["family"] = name_of(c.family);
    if (counts.max_camera_vertices < INT_MAX)
        j["max_camera_vertices"] = counts.max_camera_vertices;
    if (counts.max_light_vertices < INT_MAX)
        j["max_light_vertices"] = counts.max_light_vertices;
    for (int i = 0; i < path.size; ++i)
        j["vertices"].push_back(to_json(r.scene, path, i));
    if (path.photon)
        j["vertices"][static_cast<std::size_t>(c.technique.camera_vertices - 1)]["photon"] =
            photon_to_json(*path.photon, is_learned(path.roulette.mode)
                                             ? Real(1)
                                             : path.photon->material->survival *
                                                   over_survival(path, walk_kind::from_light, path.merged));
    return j.dump();
}

} // namespace lab
