// SPDX-License-Identifier: MIT
// Floor 5: changes to a path that change no weight, for a renderer's unit tests. See verify.hpp.
#pragma once

#include <cstddef>
#include <mis/verify/weights.hpp>

namespace mis::verify {

// A path with the counts it is weighed with.
template <class Vertex> struct weighed_path {
    technique_counts<typename Vertex::scalar> counts;
    std::vector<Vertex> vertices;

    int size() const { return static_cast<int>(vertices.size()); }
};

namespace detail {

// Only a density per area scales. That of a point light or a pinhole is a probability, that of a point at
// infinity is per solid angle.
template <class Vertex> bool has_area(const Vertex& end) {
    return !end.dirac && end.kind != vertex_kind::infinite_light;
}

template <class T> T scaled_end(T density, bool scales, T k) { return scales ? density / (k * k) : density; }

// What path_vertex and measured_vertex have in common.
template <class Vertex, class T> void scale_densities(Vertex& x, bool is_end, T k) {
    if (x.kind == vertex_kind::infinite_light)
        x.pdf_to_camera /= k * k; // per area of the perpendicular disk
    if (is_end) {
        x.pdf_position = scaled_end(x.pdf_position, has_area(x), k);
        x.pdf_next_event = scaled_end(x.pdf_next_event, has_area(x), k);
    }
    if (x.kind == vertex_kind::medium) {
        x.pdf_distance_from_camera /= k;
        x.pdf_distance_from_light /= k;
        x.merge_factor *= k; // a kernel's volume over one's area
    }
}

template <class Vec, class T>
void scale_vertex(std::vector<path_vertex<Vec, T>>& path, std::size_t i, bool is_end, T k) {
    path[i].position = path[i].position * k;
    scale_densities(path[i], is_end, k);
}

template <class T> void scale_vertex(std::vector<measured_vertex<T>>& path, std::size_t i, bool is_end, T k) {
    const bool has_length = i + 1 < path.size() && path[i].kind != vertex_kind::infinite_light &&
                            path[i + 1].kind != vertex_kind::infinite_light;
    if (has_length)
        path[i].distance2_to_light *= k * k;
    scale_densities(path[i], is_end, k);
}

template <class T> void scale_vertex(std::vector<area_vertex<T>>& path, std::size_t i, bool is_end, T k) {
    area_vertex<T>& x = path[i];
    const T unit = x.kind == vertex_kind::infinite_light ? T(1)
                   : x.kind == vertex_kind::medium       ? T(1) / (k * k * k)
                                                         : T(1) / (k * k);
    // An end point's own density scales as its own walk's start; the other is per area, light or pinhole.
    const bool starts_camera = i == 0, starts_light = i + 1 == path.size();
    x.density_from_camera =
        starts_camera ? scaled_end(x.density_from_camera, has_area(x), k) : x.density_from_camera * unit;
    x.density_from_light =
        starts_light ? scaled_end(x.density_from_light, has_area(x), k) : x.density_from_light * unit;
    if (is_end)
        x.next_event = scaled_end(x.next_event, has_area(x), k);
    if (x.kind == vertex_kind::medium)
        x.merge_factor *= k;
}

template <class Vec, class T> void swap_vertex(path_vertex<Vec, T>& x, const path_vertex<Vec, T>*) {
    std::swap(x.pdf_to_light, x.pdf_to_camera);
    std::swap(x.pdf_distance_from_camera, x.pdf_distance_from_light);
}
template <class T> void swap_vertex(measured_vertex<T>& x, const measured_vertex<T>* edge) {
    std::swap(x.pdf_to_light, x.pdf_to_camera);
    std::swap(x.pdf_distance_from_camera, x.pdf_distance_from_light);
    std::swap(x.cos_to_light, x.cos_to_camera);
    x.distance2_to_light = edge != nullptr ? edge->distance2_to_light : T(1);
}
template <class T> void swap_vertex(area_vertex<T>& x, const area_vertex<T>*) {
    std::swap(x.density_from_camera, x.density_from_light);
}

} // namespace detail

// The path in a scene k times as large: positions and distances times k, densities per area over k^2, per
// length over k, per solid angle and probabilities unchanged; the counts of merges, which contain pi r^2,
// times k^2. No weight changes.
template <class T, class Vertex>
weighed_path<Vertex> scaled(const technique_counts<T>& counts, const Vertex* path, int n, T k) {
    weighed_path<Vertex> result{counts, {path, path + n}};
    result.counts.merge *= k * k;
    for (std::size_t i = 0; i < result.vertices.size(); ++i)
        detail::scale_vertex(result.vertices, i, i == 0 || i + 1 == result.vertices.size(), k);
    return result;
}

// The path the other way round: camera and light change places, and so do the walks, their counts and caps.
// Each technique has the weight that its image swapped(t, n) has here. An infinite light becomes a camera of
// kind infinite_light. A cap of 0 has no image where `direct` is on.
template <class T, class Vertex>
weighed_path<Vertex> swapped(const technique_counts<T>& counts, const Vertex* path, int n) {
    weighed_path<Vertex> result{counts, {path, path + n}};
    std::swap(result.counts.light_hit, result.counts.camera_hit);
    std::swap(result.counts.next_event, result.counts.camera_connection);
    std::swap(result.counts.max_camera_vertices, result.counts.max_light_vertices);
    std::reverse(result.vertices.begin(), result.vertices.end());
    for (int i = 0; i < n; ++i) {
        Vertex& x = result.vertices[static_cast<std::size_t>(i)];
        detail::swap_vertex(x, i + 1 < n ? &path[n - 2 - i] : nullptr); // the edge x_i, x_{i+1}
        if (x.kind == vertex_kind::camera)
            x.kind = vertex_kind::light;
        else if (x.kind == vertex_kind::light)
            x.kind = vertex_kind::camera;
    }
    return result;
}

// s becomes n - s, a merge at x_j one at x_{n-1-j}.
inline technique swapped(technique t, int n) {
    const int index = technique_index(n, t);
    return technique_at(n, index <= n ? n - index : n + (n - 1 - (index - n)));
}

namespace detail {

struct weight_change {
    std::string name;
    double before, after;

    double ratio() const { return after / before; }
};

// " = 3^-2", if it is a power of the base.
inline std::string as_power(double factor, double base) {
    if (!(base > 0) || agree(base, 1, 1e-6) || !(factor > 0))
        return "";
    const double exponent = std::log(factor) / std::log(base);
    const double whole = std::round(exponent);
    if (std::fabs(exponent - whole) > 1e-3 || std::fabs(whole) < 1 || std::fabs(whole) > 20)
        return "";
    return " = " + text(base) + "^" + text(whole);
}

// The ratio that most weights have changed by: what a single mistake leaves alone.
inline double common_ratio(const std::vector<weight_change>& changes, double tolerance) {
    double common = 1;
    std::ptrdiff_t most = 0;
    for (const auto& a : changes) {
        if (!(a.before > 0 && a.after > 0))
            continue;
        const auto sharing = std::count_if(changes.begin(), changes.end(), [&](const weight_change& b) {
            return b.before > 0 && agree(a.ratio(), b.ratio(), 4 * tolerance);
        });
        if (sharing > most) {
            most = sharing;
            common = a.ratio();
        }
    }
    return common;
}

inline result unchanged(const std::string& change, const std::vector<weight_change>& changes,
                        double tolerance, double base = 0) {
    std::vector<std::string> faults, lines;
    bool same = true;
    for (const auto& c : changes) {
        for (const double w : {c.before, c.after})
            if (const std::string fault = fault_of(w); !fault.empty())
                faults.push_back("the weight of " + c.name + " is " + fault);
        same = same && weights_agree(c.before, c.after, tolerance);
    }
    if (!faults.empty())
        return {false, change + ":" + list(faults)};
    const auto stays_0 = [](const weight_change& c) { return !(c.before > 0) && !(c.after > 0); };
    if (changes.empty())
        return undecided(change + ": no technique can make the path, nothing to compare");
    if (std::all_of(changes.begin(), changes.end(), stays_0))
        return undecided(change + ": all weights are 0, nothing to compare");
    if (same)
        return {true, change + " changes no weight"};

    const double common = common_ratio(changes, tolerance);
    const auto add_line = [&](const weight_change& c, double relative) {
        std::string line = c.name + ": " + text(c.before) + " became " + text(c.after);
        if (c.before > 0 && is_number(relative))
            line += ", relative to the rest times " + text(relative) + as_power(relative, base);
        lines.push_back(line);
    };
    for (const auto& c : changes) {
        const bool was_0 = !(c.before > 0), is_0 = !(c.after > 0);
        if (was_0 != is_0 || (!was_0 && !agree(c.ratio(), common, 4 * tolerance)))
            add_line(c, was_0 ? 0 : c.ratio() / common);
    }
    if (lines.empty()) // all by one ratio: the sum is wrong on one side
        for (const auto& c : changes)
            add_line(c, 1);
    return {false, change + " changes weights:" + list(lines)};
}

template <class T, class Vertex, class Weight, class Image>
std::vector<weight_change> changes_of(Weight& weight_of, const technique_counts<T>& counts,
                                      const Vertex* path, int n, const weighed_path<Vertex>& other,
                                      Image image) {
    std::vector<weight_change> changes;
    for_each_possible(counts, path, n, [&](technique t) {
        const double before = static_cast<double>(weight_of(counts, path, n, t));
        const double after = static_cast<double>(weight_of(other.counts, other.vertices.data(), n, image(t)));
        changes.push_back({to_string(t), before, after});
    });
    return changes;
}

constexpr auto same_technique = [](technique t) { return t; };

// A factor of 1 changes nothing, others than positive numbers are none.
inline bool is_a_change(double factor) { return is_number(factor) && factor > 0 && !agree(factor, 1, 1e-3); }

} // namespace detail

// A renderer's weight function T weight_of(counts, path, n, technique) does not change with the size of the
// scene. This check and those below are undecided where there is nothing to compare: no technique can make
// the path, all weights are 0, or the factor is within 0.1% of 1 or is no positive number.
template <class T, class Vertex, class Weight>
result scale_invariance(Weight&& weight_of, const technique_counts<T>& counts, const Vertex* path, int n,
                        mis::detail::identity_t<T> k = T(3), double tolerance = default_tolerance<T>) {
    const std::string change = "a scene " + detail::text(static_cast<double>(k)) + " times as large";
    if (!detail::is_a_change(static_cast<double>(k)))
        return detail::undecided(change + " is none to compare with");
    const auto other = scaled(counts, path, (std::max)(n, 0), k);
    return detail::unchanged(change,
                             detail::changes_of(weight_of, counts, path, n, other, detail::same_technique),
                             tolerance, static_cast<double>(k));
}

// It does not change if camera and light are exchanged, see swapped. Techniques in the message are those of
// the path given.
template <class T, class Vertex, class Weight>
result swap_invariance(Weight&& weight_of, const technique_counts<T>& counts, const Vertex* path, int n,
                       double tolerance = default_tolerance<T>) {
    const auto image = [n](technique t) { return swapped(t, n); };
    const auto other = swapped(counts, path, (std::max)(n, 0));
    return detail::unchanged("exchanging camera and light",
                             detail::changes_of(weight_of, counts, path, n, other, image), tolerance);
}

// It does not change if all counts are multiplied by one factor.
template <class T, class Vertex, class Weight>
result count_invariance(Weight&& weight_of, const technique_counts<T>& counts, const Vertex* path, int n,
                        mis::detail::identity_t<T> factor = T(7), double tolerance = default_tolerance<T>) {
    const std::string change = "all counts times " + detail::text(static_cast<double>(factor));
    if (!detail::is_a_change(static_cast<double>(factor)))
        return detail::undecided(change + " are none to compare with");
    const weighed_path<Vertex> other{mis::scaled(counts, factor), {path, path + (std::max)(n, 0)}};
    return detail::unchanged(change,
                             detail::changes_of(weight_of, counts, path, n, other, detail::same_technique),
                             tolerance, static_cast<double>(factor));
}

// Balance heuristic only: one technique counted as two of half the density each changes no other weight, and
// the halves' weights sum to the whole's. T weight_of(const T* densities, int count, int i). Undecided
// without a technique, and where all weights are 0.
template <class T, class Weight>
result splitting_invariance(Weight&& weight_of, const T* densities, int count,
                            double tolerance = default_tolerance<T>) {
    if (count < 1)
        return detail::undecided("there is no technique to split");
    for (int split = 0; split < count; ++split) {
        std::vector<T> halves(densities, densities + count);
        halves[static_cast<std::size_t>(split)] /= T(2);
        halves.push_back(halves[static_cast<std::size_t>(split)]);
        std::vector<detail::weight_change> changes;
        for (int i = 0; i < count; ++i) {
            const double before = static_cast<double>(weight_of(densities, count, i));
            double after = static_cast<double>(weight_of(halves.data(), count + 1, i));
            if (i == split)
                after += static_cast<double>(weight_of(halves.data(), count + 1, count));
            changes.push_back({"technique " + std::to_string(i), before, after});
        }
        auto r = detail::unchanged("technique " + std::to_string(split) + " split into two halves", changes,
                                   tolerance);
        if (!r)
            return r;
    }
    return {true, "splitting a technique changes no weight"};
}

} // namespace mis::verify
