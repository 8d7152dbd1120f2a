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
    unweighted
};
inline constexpr const char* mistake_names[] = {
    "power_overflow",        "maximum_tie",         "roulette_omitted",   "roulette_one_sided",
    "merge_roulette",        "shading_normal",      "dirac_geometry",     "dirac_etendue",
    "dirac_light",           "dirac_connectible",   "selection_omitted",  "next_event_is_emission",
    "environment_measure",   "light_paths_missing", "light_paths_twice",  "counts_omitted",
    "photon_count",          "merge_area",          "disabled_technique", "missing_technique",
    "subpath_caps",          "solid_angle_as_area", "reverse_is_forward", "wrong_heuristic",
    "average_of_techniques", "unweighted"};
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

// P-> and P<- of what has been told. A renderer that gives Dirac choices the density 1 does so here.
template <class Real>
void told_densities(const mistake_set& mistakes, const scene<Real>& scene, const seen_path<Real>& path,
                    mis::area_vertex<double>* out) {
    const int n = path.size;
    mis::measured_vertex<Real> told[longest_path];
    std::copy(path.records, path.records + n, told);
    for (int i = 1; i < n - 1; ++i)
        tell_scatter(mistakes, path, i, told[i]);
    tell_edges(mistakes, path, told);
    tell_light(mistakes, scene, path[n - 1], told[n - 1]);

    mis::measured_vertex<double> in_doubles[longest_path];
    for (int i = 0; i < n; ++i)
        in_doubles[i] = in_double(told[i]);
    for (int i = 0; i < n; ++i)
        out[i] = mis::area_densities(in_doubles, n, i);
    for (int i = 1; i < n - 1; ++i)
        if (scatters_dirac(path[i]) && mistakes.has(mistake::dirac_geometry))
            out[i + 1].density_from_camera = out[i - 1].density_from_light = 1;
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

// q^beta / sum q^beta with all products in float.
inline float overflowing_weight(const mis::technique_counts<double>& counts,
                                const mis::area_vertex<double>* path, int n, double beta,
                                mis::technique technique) {
    float sum = 0, own = 0;
    for (int k = 0; k < mis::technique_count(n); ++k) {
        const mis::technique t = mis::technique_at(n, k);
        if (!mis::detail::is_possible(path, n, t))
            continue;
        const int first_of_light = t.camera_vertices - (t.kind == mis::technique_kind::merge ? 1 : 0);
        float density = static_cast<float>(mis::count_of(counts, n, t));
        for (int i = 0; i < t.camera_vertices; ++i)
            density *= static_cast<float>(path[i].density_from_camera);
        for (int i = first_of_light; i < n; ++i)
            density *= static_cast<float>(t.kind == mis::technique_kind::next_event && i == n - 1
                                              ? path[i].next_event
                                              : path[i].density_from_light);
        const float raised = std::pow(density, static_cast<float>(beta));
        sum += raised;
        own = t == technique ? raised : own;
    }
    return own / sum;
}

// A maximum heuristic that does not see ties: 1 for every technique that none is above.
inline double maximum_without_ties(const mis::technique_counts<double>& counts,
                                   const mis::area_vertex<double>* path, int n, mis::technique technique) {
    double densities[mis::technique_count(longest_path)];
    mis::relative_densities(counts, path, n, densities);
    return densities[mis::technique_index(n, technique)] >= 1 - 1e-12 ? 1 : 0;
}

template <class Real>
double mistaken_weight(const mistake_set& mistakes, const renderer<Real>& r, const seen_path<Real>& path,
                       mis::technique technique) {
    if (mistakes.has(mistake::unweighted))
        return 1;
    mis::area_vertex<double> told[longest_path];
    told_densities(mistakes, r.scene, path, told);
    const auto counts =
        in_double(told_counts(mistakes, counts_for(r, path), r.set.merge_radius, technique.kind));
    const any_heuristic heuristic = told_heuristic(mistakes, r.weigh.heuristic);
    if (heuristic.kind == heuristic_kind::power && mistakes.has(mistake::power_overflow))
        return static_cast<double>(
            overflowing_weight(counts, told, path.size, heuristic.parameter, technique));
    if (heuristic.kind == heuristic_kind::maximum && mistakes.has(mistake::maximum_tie))
        return maximum_without_ties(counts, told, path.size, technique);
    return mis::weight(heuristic, counts, told, path.size, technique);
}

} // namespace lab
