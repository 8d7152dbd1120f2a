// The weight of a path as a renderer with planted mistakes computes it, from what its walks have told.
#pragma once

#include "weigh.hpp"

namespace bpt {

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
    if (!mistakes.has(mistake::wrong_heuristic))
        return heuristic;
    const bool balance = heuristic.kind == heuristic_kind::balance;
    return {balance ? heuristic_kind::power : heuristic_kind::balance, 2};
}

// P-> and P<- of what has been told. A renderer that gives Dirac choices the density 1 does so here.
template <class Real>
void told_densities(const mistake_set& mistakes, const complete_path<Real>& path,
                    mis::area_vertex<double>* out) {
    mis::measured_vertex<double> told[longest_path];
    for (int i = 0; i < path.size; ++i)
        told[i] = in_double(path.vertices[i].told);
    for (int i = 0; i < path.size; ++i)
        out[i] = mis::area_densities(told, path.size, i);
    for (int i = 1; i < path.size - 1; ++i)
        if (scatters_dirac(path.vertices[i]) && mistakes.has(mistake::dirac_geometry))
            out[i + 1].density_from_camera = out[i - 1].density_from_light = 1;
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
double mistaken_weight(const mistake_set& mistakes, const weights<Real>& weigh, Real merge_radius,
                       const complete_path<Real>& path, mis::technique technique) {
    mis::area_vertex<double> told[longest_path];
    told_densities(mistakes, path, told);
    const auto counts =
        in_double(told_counts(mistakes, counts_for(weigh, path), merge_radius, technique.kind));
    const any_heuristic heuristic = told_heuristic(mistakes, weigh.heuristic);
    if (heuristic.kind == heuristic_kind::power && mistakes.has(mistake::power_overflow))
        return static_cast<double>(
            overflowing_weight(counts, told, path.size, heuristic.parameter, technique));
    if (heuristic.kind == heuristic_kind::maximum && mistakes.has(mistake::maximum_tie))
        return maximum_without_ties(counts, told, path.size, technique);
    return mis::weight(heuristic, counts, told, path.size, technique);
}

} // namespace bpt
