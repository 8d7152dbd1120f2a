// Mistakes that authors of renderers make in their weights, to be planted here on purpose: --mistake. The
// paths stay the same; their weights are computed from what a renderer with the mistake would have told them,
// beside the right records.
#pragma once

#include "weigh.hpp"
#include <bitset>

namespace lab {

enum class mistake {
    power_overflow,
    maximum_tie,
    roulette_omitted,
    roulette_one_sided,
    merge_roulette,
    shading_normal,
    dirac_geometry,
    dirac_etendue,
    dirac_light,
    dirac_connectible,
    selection_omitted,
    next_event_is_emission,
    environment_measure,
    light_paths_missing,
    light_paths_twice,
    counts_omitted,
    photon_count,
    merge_area,
    disabled_technique,
    missing_technique,
    subpath_caps,
    solid_angle_as_area,
    reverse_is_forward,
    wrong_heuristic,
    average_of_techniques,
    unweighted,
    splitting_omitted,
    distance_omitted,
    distance_twice,
    pass_is_density,
    short_is_long,
    beam_sine,
    beam_count,
    family_radius,
    boundary_vertex
};
inline constexpr const char* mistake_names[] = {
    "power_overflow",        "maximum_tie",         "roulette_omitted",
    "roulette_one_sided",    "merge_roulette",      "shading_normal",
    "dirac_geometry",        "dirac_etendue",       "dirac_light",
    "dirac_connectible",     "selection_omitted",   "next_event_is_emission",
    "environment_measure",   "light_paths_missing", "light_paths_twice",
    "counts_omitted",        "photon_count",        "merge_area",
    "disabled_technique",    "missing_technique",   "subpath_caps",
    "solid_angle_as_area",   "reverse_is_forward",  "wrong_heuristic",
    "average_of_techniques", "unweighted",          "splitting_omitted",
    "distance_omitted",      "distance_twice",      "pass_is_density",
    "short_is_long",         "beam_sine",           "beam_count",
    "family_radius",         "boundary_vertex"};
// Where walks split; all others where they end by the material's albedo.
inline constexpr std::size_t of_splitting = static_cast<std::size_t>(mistake::splitting_omitted);
inline constexpr std::size_t first_of_media = static_cast<std::size_t>(mistake::distance_omitted);
constexpr std::size_t mistake_count = std::size(mistake_names);

// The mistakes that are planted, by their places above.
struct mistake_set {
    std::bitset<mistake_count> planted;

    bool any() const { return planted.any(); }
    bool has(mistake m) const { return planted[static_cast<std::size_t>(m)]; }
};

// ---- What the weights are told of densities, cosines and distances ----

// A vertex between its neighbours.
template <class Real>
void tell_scatter(const mistake_set& mistakes, const seen_path<Real>& path, int i,
                  mis::measured_vertex<Real>& told) {
    const vertex<Real>& x = path[i];
    const bool by_camera = i < path.camera_vertices;
    Real& forward = by_camera ? told.pdf_to_light : told.pdf_to_camera;
    Real& reverse = by_camera ? told.pdf_to_camera : told.pdf_to_light;
    if (mistakes.has(mistake::splitting_omitted)) {
        told.pdf_to_light /= rate_at(path, walk_kind::from_camera, i);
        told.pdf_to_camera /= rate_at(path, walk_kind::from_light, i);
    }
    if (mistakes.has(mistake::shading_normal)) {
        told.cos_to_camera = shading_cosine(x, path.to_camera[i]);
        told.cos_to_light = shading_cosine(i == path.merged ? *path.photon : x, path.to_light[i]);
    }
    if (i == path.merged) {
        Real in_density = path.photon->material->survival; // what pdf_to_camera includes
        if (mistakes.has(mistake::merge_roulette)) {
            told.pdf_to_camera *= x.material->survival / in_density;
            in_density = x.material->survival;
        }
        if (mistakes.has(mistake::roulette_omitted))
            told.pdf_to_light /= x.material->survival;
        if (mistakes.has(mistake::roulette_omitted) || mistakes.has(mistake::roulette_one_sided))
            told.pdf_to_camera /= in_density;
        return;
    }
    if (scatters_dirac(x)) {
        if (mistakes.has(mistake::dirac_etendue)) {
            const Real eta_to_light = path.eta_to_light[i], eta_to_camera = path.eta_to_camera[i];
            told.pdf_to_light /= eta_to_light * eta_to_light * path.records[i].cos_to_light;
            told.pdf_to_camera /= eta_to_camera * eta_to_camera * path.records[i].cos_to_camera;
        }
        if (mistakes.has(mistake::dirac_connectible))
            told.kind = mis::vertex_kind::surface;
    } else if (mistakes.has(mistake::reverse_is_forward)) {
        reverse = forward;
    }
    if (mistakes.has(mistake::roulette_omitted))
        forward /= x.material->survival;
    if (mistakes.has(mistake::roulette_omitted) || mistakes.has(mistake::roulette_one_sided))
        reverse /= x.material->survival;
}

// The edges' measures. A joined edge is no walk's: nobody forgets to convert across it what is never sampled.
template <class Real>
void tell_edges(const mistake_set& mistakes, const seen_path<Real>& path, mis::measured_vertex<Real>* told) {
    const int n = path.size, joined = path.photon ? -1 : path.camera_vertices - 1;
    for (int i = 0; i + 1 < n && mistakes.has(mistake::solid_angle_as_area); ++i) {
        if (i == joined)
            continue;
        const bool by_camera = i + 1 < path.camera_vertices;
        (by_camera ? told[i + 1].cos_to_camera : told[i].cos_to_light) = 1;
        told[i].distance2_to_light = 1;
    }
    if (mistakes.has(mistake::environment_measure) && is_infinite(path[n - 1]) && n > 2)
        told[n - 2].cos_to_light = 1;
}

template <class Real>
void tell_light(const mistake_set& mistakes, const scene<Real>& scene, const vertex<Real>& x,
                mis::measured_vertex<Real>& told) {
    if (mistakes.has(mistake::selection_omitted))
        told.pdf_next_event /= light_of(scene, x).select_next_event;
    if (mistakes.has(mistake::next_event_is_emission))
        told.pdf_next_event = told.pdf_position;
    if (mistakes.has(mistake::dirac_light))
        told.dirac = false;
}

// ---- What they are told of media ----

// Whether the path has been made by merging in a medium, and with the camera walk's beam or the light walk's.
template <class Real> bool has_merged_in_medium(const seen_path<Real>& path) {
    return path.merged >= 0 && is_in_medium(path[path.merged]);
}
template <class Real> bool has_merged_beam(const seen_path<Real>& path, walk_kind kind) {
    using family = mis::merge_family;
    const auto with_one = kind == walk_kind::from_camera ? family::point_beam : family::beam_point;
    return has_merged_in_medium(path) && (path.family == with_one || path.family == family::beam_beam);
}

// Densities of distances at the vertex where walks have merged.
template <class Real>
void tell_distances(const mistake_set& mistakes, const seen_path<Real>& path,
                    mis::measured_vertex<Real>* told) {
    if (!has_merged_in_medium(path))
        return;
    const int j = path.merged;
    Real &from_camera = told[j].pdf_distance_from_camera, &from_light = told[j].pdf_distance_from_light;
    if (mistakes.has(mistake::distance_omitted))
        from_camera = from_light = 1;
    if (mistakes.has(mistake::distance_twice)) {
        from_camera *= from_camera;
        from_light *= from_light;
    }
    // What a beam has passed, 1 if it is long, where the density of stopping belongs.
    if (mistakes.has(mistake::pass_is_density)) {
        from_camera *= has_merged_beam(path, walk_kind::from_camera) ? path.beams[j].from_camera : Real(1);
        from_light *= has_merged_beam(path, walk_kind::from_light) ? path.beams[j].from_light : Real(1);
    }
}

// What the weights know of the families at vertex i.
template <class Real>
mis::family_sizes<double> told_sizes(const mistake_set& mistakes, const renderer<Real>& r,
                                     const seen_path<Real>& path, int i) {
    using family = mis::merge_family;
    const media_merges<Real>& merges = r.set.media;
    auto radii = in_double(merges.radii);
    if (mistakes.has(mistake::family_radius)) // in 1D that of 2D
        radii.beam_beam = radii.point_beam;
    const auto walks = [&](family f) {
        const auto counted =
            mistakes.has(mistake::beam_count) && f == family::beam_beam ? family::point_beam : f;
        const double number = static_cast<double>(kernel_and_walks(r, counted, Real(1)).second);
        const bool is_on = mis::size_of(merges.sizes, f) > Real(0);
        return !is_on ? 0.0 : mistakes.has(mistake::photon_count) ? 1.0 : number;
    };
    mis::family_sizes<double> sizes{mis::point_point_size(walks(family::point_point), radii.point_point),
                                    mis::point_beam_size(walks(family::point_beam), radii.point_beam),
                                    mis::beam_point_size(walks(family::beam_point), radii.beam_point),
                                    mis::beam_beam_size(walks(family::beam_beam), radii.beam_beam)};
    if (mistakes.has(mistake::merge_area))
        sizes = {walks(family::point_point), walks(family::point_beam), walks(family::beam_point),
                 walks(family::beam_beam)};
    const auto beam = [&](const mis::distance_density<Real>& piece, bool is_long) {
        const bool told_long = is_long || mistakes.has(mistake::short_is_long);
        return static_cast<double>(mis::beam(piece.density, told_long ? Real(1) : piece.pass));
    };
    mis::beams<double> x{beam(path.edges[i - 1].last, merges.long_camera_beams),
                         beam(path.edges[i].first, merges.long_light_beams)};
    if (mistakes.has(mistake::pass_is_density) && i == path.merged) {
        x.from_camera = has_merged_beam(path, walk_kind::from_camera) ? 1 : x.from_camera;
        x.from_light = has_merged_beam(path, walk_kind::from_light) ? 1 : x.from_light;
    }
    const double sine = static_cast<double>(length(cross(path.to_camera[i], path.to_light[i])));
    return mis::at_vertex(sizes, x, mistakes.has(mistake::beam_sine) ? 1.0 : sine);
}

// ---- The path that they are told of ----

// With boundaries that count as vertices it is longer than the true one. Merges on surfaces have a count of
// their own (1 in the vertices' factors), those in media are families.
struct told_path {
    std::vector<mis::area_vertex<double>> vertices;
    std::vector<mis::family_sizes<double>> sizes;
    mis::technique technique;
    mis::merge_family family{};

    int size() const { return static_cast<int>(vertices.size()); }
    bool in_medium(int i) const {
        return vertices[static_cast<std::size_t>(i)].kind == mis::vertex_kind::medium;
    }
};

struct told_vertex {
    mis::measured_vertex<double> record;
    int place = -1; // in the true path, or none
};

// The boundaries of the edges that walks have gone, after their vertices: they lead straight on, with
// probability 1. Returns the number of them before the edge that joins the walks, or the vertex that has been
// merged.
template <class Real>
int insert_boundaries(const seen_path<Real>& path, mis::technique technique, double merge_factor,
                      std::vector<told_vertex>& told) {
    const int s = technique.camera_vertices, joined = path.merged >= 0 ? -1 : s - 1;
    int before = 0, edge = -1;
    double from_light = 1; // of passing what lies between the end of the edge and the boundary behind
    for (auto b = path.boundaries.rbegin(); b != path.boundaries.rend(); ++b) { // from the last on
        if (b->edge == joined)
            continue;
        const auto at = static_cast<std::size_t>(b->edge);
        auto &x = told[at].record, &next = told[at + 1].record;
        const double near = static_cast<double>(b->distance), whole = std::sqrt(x.distance2_to_light);
        const bool is_infinite = next.kind == mis::vertex_kind::infinite_light;
        from_light = b->edge == edge ? from_light : 1;
        edge = b->edge;

        mis::measured_vertex<double> boundary;
        boundary.pdf_to_light = boundary.pdf_to_camera = 1;
        boundary.cos_to_camera = boundary.cos_to_light = static_cast<double>(b->cosine);
        boundary.distance2_to_light = is_infinite ? 1 : (whole - near) * (whole - near);
        boundary.pdf_distance_from_camera = static_cast<double>(b->pass_from_camera);
        boundary.pdf_distance_from_light = static_cast<double>(b->pass_from_light) / from_light;
        boundary.merge_factor = merge_factor;
        next.pdf_distance_from_camera /= boundary.pdf_distance_from_camera;
        x.pdf_distance_from_light /= boundary.pdf_distance_from_light;
        x.distance2_to_light = near * near;
        from_light = static_cast<double>(b->pass_from_light);
        told.insert(told.begin() + b->edge + 1, told_vertex{boundary});
        before += b->edge < s - 1;
    }
    return before;
}

// P-> and P<- of what has been told. A renderer that gives Dirac choices the density 1 does so here.
template <class Real>
told_path tell_path(const mistake_set& mistakes, const renderer<Real>& r, const seen_path<Real>& path,
                    mis::technique technique, double merge_factor) {
    const int n = path.size;
    mis::measured_vertex<Real> records[longest_path];
    std::copy(path.records, path.records + n, records);
    for (int i = 1; i < n - 1; ++i)
        tell_scatter(mistakes, path, i, records[i]);
    tell_edges(mistakes, path, records);
    tell_light(mistakes, r.scene, path[n - 1], records[n - 1]);
    tell_distances(mistakes, path, records);

    std::vector<told_vertex> told;
    for (int i = 0; i < n; ++i) {
        told.push_back({in_double(records[i]), i});
        told.back().record.merge_factor = is_in_medium(path[i]) ? 1 : merge_factor;
    }
    told_path result{{}, {}, technique, path.family};
    if (mistakes.has(mistake::boundary_vertex))
        result.technique.camera_vertices += insert_boundaries(path, technique, merge_factor, told);

    std::vector<mis::measured_vertex<double>> measured;
    for (const told_vertex& x : told)
        measured.push_back(x.record);
    for (std::size_t k = 0; k < told.size(); ++k) {
        const int i = told[k].place;
        result.vertices.push_back(
            mis::area_densities(measured.data(), static_cast<int>(measured.size()), static_cast<int>(k)));
        result.sizes.push_back(i >= 0 && is_in_medium(path[i]) ? told_sizes(mistakes, r, path, i)
                                                               : mis::family_sizes<double>{});
    }
    for (std::size_t k = 1; k + 1 < told.size(); ++k)
        if (const int i = told[k].place;
            i > 0 && i + 1 < n && scatters_dirac(path[i]) && mistakes.has(mistake::dirac_geometry))
            result.vertices[k + 1].density_from_camera = result.vertices[k - 1].density_from_light = 1;
    return result;
}

// ---- What they are told of counts and heuristics ----

// The counts that the weight of a technique is computed with.
template <class Real>
mis::technique_counts<Real> told_counts(const mistake_set& mistakes, mis::technique_counts<Real> counts,
                                        Real merge_radius, mis::technique_kind own) {
    if (mistakes.has(mistake::light_paths_missing))
        counts.camera_connection = counts.camera_connection > Real(0) ? Real(1) : Real(0);
    if (mistakes.has(mistake::light_paths_twice))
        counts.camera_connection *= counts.camera_connection;
    if (mistakes.has(mistake::counts_omitted) && counts.next_event > Real(0))
        counts.next_event = 1;
    if (mistakes.has(mistake::photon_count) && counts.merge > Real(0)) // a single light walk
        counts.merge /= std::round(counts.merge / mis::merge_area(merge_radius));
    if (mistakes.has(mistake::merge_area) && counts.merge > Real(0))
        counts.merge /= mis::merge_area(merge_radius);
    if (mistakes.has(mistake::disabled_technique)) // see planted(): no connections are made
        counts.connection = 1;
    if (mistakes.has(mistake::missing_technique) && own != mis::technique_kind::camera_connection)
        counts.camera_connection = 0;
    if (mistakes.has(mistake::subpath_caps))
        counts.max_camera_vertices = counts.max_light_vertices = INT_MAX;
    return counts;
}

inline any_heuristic told_heuristic(const mistake_set& mistakes, const any_heuristic& heuristic) {
    if (mistakes.has(mistake::average_of_techniques))
        return {heuristic_kind::average, heuristic.parameter};
    if (!mistakes.has(mistake::wrong_heuristic))
        return heuristic;
    const bool balance = heuristic.kind == heuristic_kind::balance;
    return {balance ? heuristic_kind::power : heuristic_kind::balance, 2};
}

constexpr mis::merge_family all_families[] = {mis::merge_family::point_point, mis::merge_family::point_beam,
                                              mis::merge_family::beam_point, mis::merge_family::beam_beam};

// Of a merge in a medium the place of its family, behind all other techniques.
inline int place_of(const told_path& path) {
    const int i = path.technique.camera_vertices - 1;
    return path.technique.kind == mis::technique_kind::merge && path.in_medium(i)
               ? throughput_index(path.size(), i, path.family)
               : mis::technique_index(path.size(), path.technique);
}

// The relative densities of all techniques, and behind them of the families of every vertex in a medium. The
// count of merges is 1.
inline std::vector<double> densities_of(const mis::technique_counts<double>& counts, const told_path& path) {
    const int n = path.size();
    std::vector<double> q(static_cast<std::size_t>(throughput_count(n)));
    mis::relative_densities(counts, path.vertices.data(), n, q.data());
    for (int i = 1; i + 1 < n; ++i) {
        if (!path.in_medium(i))
            continue;
        double& both =
            q[static_cast<std::size_t>(mis::technique_index(n, {mis::technique_kind::merge, i + 1}))];
        for (const auto f : all_families)
            q[static_cast<std::size_t>(throughput_index(n, i, f))] =
                both * mis::size_of(path.sizes[static_cast<std::size_t>(i)], f);
        both = 0;
    }
    return q;
}

// q^beta / sum q^beta with all products in float.
inline float overflowing_weight(const mis::technique_counts<double>& counts, const told_path& path,
                                double beta) {
    const int n = path.size();
    float sum = 0, own = 0;
    const auto add = [&](mis::technique t, double samples, int place) {
        const int first_of_light = t.camera_vertices - (t.kind == mis::technique_kind::merge ? 1 : 0);
        float density = static_cast<float>(samples);
        for (int i = 0; i < t.camera_vertices; ++i)
            density *= static_cast<float>(path.vertices[static_cast<std::size_t>(i)].density_from_camera);
        for (int i = first_of_light; i < n; ++i) {
            const auto& x = path.vertices[static_cast<std::size_t>(i)];
            density *= static_cast<float>(t.kind == mis::technique_kind::next_event && i == n - 1
                                              ? x.next_event
                                              : x.density_from_light);
        }
        const float raised = std::pow(density, static_cast<float>(beta));
        sum += raised;
        own = place == place_of(path) ? raised : own;
    };
    for (int k = 0; k < mis::technique_count(n); ++k) {
        const mis::technique t = mis::technique_at(n, k);
        const int i = t.camera_vertices - 1;
        if (!mis::detail::is_possible(path.vertices.data(), n, t))
            continue;
        const double count = mis::count_of(counts, n, t);
        if (t.kind != mis::technique_kind::merge)
            add(t, count, k);
        else if (!path.in_medium(i))
            add(t, count * path.vertices[static_cast<std::size_t>(i)].merge_factor, k);
        else
            for (const auto f : all_families)
                add(t, count * mis::size_of(path.sizes[static_cast<std::size_t>(i)], f),
                    throughput_index(n, i, f));
    }
    return own / sum;
}

template <class Real>
double mistaken_weight(const mistake_set& mistakes, const renderer<Real>& r, const seen_path<Real>& path,
                       mis::technique technique) {
    if (mistakes.has(mistake::unweighted))
        return 1;
    auto told_by_renderer = counts_for(r, path);
    told_by_renderer.merge *= r.weigh.surface_factor;
    auto counts = in_double(told_counts(mistakes, told_by_renderer, r.set.merge_radius, technique.kind));
    const told_path told = tell_path(mistakes, r, path, technique, counts.merge);
    counts.merge = 1;
    const any_heuristic heuristic = told_heuristic(mistakes, r.weigh.heuristic);
    if (heuristic.kind == heuristic_kind::power && mistakes.has(mistake::power_overflow))
        return static_cast<double>(overflowing_weight(counts, told, heuristic.parameter));
    const std::vector<double> q = densities_of(counts, told);
    const int own = place_of(told);
    // A maximum heuristic that does not see ties: 1 for every technique that none is above.
    if (heuristic.kind == heuristic_kind::maximum && mistakes.has(mistake::maximum_tie))
        return q[static_cast<std::size_t>(own)] >= (1 - 1e-12) * *std::max_element(q.begin(), q.end()) ? 1
                                                                                                       : 0;
    return mis::weight(heuristic, q.data(), static_cast<int>(q.size()), own);
}

} // namespace lab
