// SPDX-License-Identifier: MIT
// Floor 5: checks of a renderer's weights and throughputs, for its unit tests. See verify.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mis/verify/record.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace mis::verify {

// What a check has found: it has passed, or it has failed, or it is undecided, because there was nothing to
// check, or too little. Only what has passed converts to true, so that a test that compares nothing does not
// pass; the message says what was lacking.
struct result {
    bool passed = false;
    std::string message;
    bool undecided = false; // neither passed nor failed
    explicit operator bool() const { return passed; }
};

// The relative tolerance of all checks unless another is given: 1e-4 if anything is in float, else 1e-9.
template <class... T>
inline constexpr double default_tolerance = (std::is_same_v<T, float> || ...) ? 1e-4 : 1e-9;

inline std::string to_string(technique_kind kind) {
    switch (kind) {
    case technique_kind::camera_hit:
        return "camera hit";
    case technique_kind::camera_connection:
        return "camera connection";
    case technique_kind::direct:
        return "direct";
    case technique_kind::connection:
        return "connection";
    case technique_kind::next_event:
        return "next event";
    case technique_kind::light_hit:
        return "light hit";
    case technique_kind::merge:
        return "merge";
    }
    return "unknown technique";
}

// "connection (s = 3)", "merge at x_2 (s = 3)".
inline std::string to_string(technique t) {
    const std::string s = std::to_string(t.camera_vertices);
    const bool merges = t.kind == technique_kind::merge;
    const std::string at = merges ? " at x_" + std::to_string(t.camera_vertices - 1) : "";
    return to_string(t.kind) + at + " (s = " + s + ")";
}

inline std::string to_string(vertex_kind kind) {
    switch (kind) {
    case vertex_kind::camera:
        return "camera";
    case vertex_kind::surface:
        return "surface";
    case vertex_kind::dirac:
        return "dirac";
    case vertex_kind::medium:
        return "medium";
    case vertex_kind::light:
        return "light";
    case vertex_kind::infinite_light:
        return "infinite light";
    }
    return "unknown vertex";
}

namespace detail {

constexpr double pi = 3.14159265358979323846;
constexpr std::size_t longest_list = 8; // lines of one message

inline bool is_infinite(double x) { return !is_number(x) && !is_nan(x); }

inline result undecided(const std::string& why) { return {false, "undecided: " + why, true}; }

inline std::string text(double x) {
    if (is_nan(x))
        return "NaN";
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%.6g", is_number(x) ? x : 0.0);
    if (is_number(x))
        return buffer;
    return x < 0 ? "-infinity" : "infinity";
}

inline std::string vertex_name(int i) { return "x_" + std::to_string(i); }

template <class Vertex> std::string describe_vertex(const Vertex* path, int i) {
    return vertex_name(i) + " (" + to_string(path[i].kind) + ")";
}

// One line each, indented; what is beyond the longest list is counted.
inline std::string list(const std::vector<std::string>& lines) {
    std::string all;
    for (std::size_t i = 0; i < (std::min)(lines.size(), longest_list); ++i)
        all += "\n  " + lines[i];
    if (lines.size() > longest_list)
        all += "\n  and " + std::to_string(lines.size() - longest_list) + " more";
    return all;
}

inline bool agree(double a, double b, double tolerance) {
    const double difference = std::fabs(a - b);
    return difference <= tolerance * (std::max)(std::fabs(a), std::fabs(b));
}

// Weights below 1e-30 are as good as 0; those that are subnormal in float have lost their precision.
inline bool weights_agree(double a, double b, double tolerance) {
    return agree(a, b, tolerance) || (std::fabs(a) < 1e-30 && std::fabs(b) < 1e-30);
}

// What no weight, density or throughput may be; empty if `x` is all right.
inline std::string fault_of(double x) {
    if (is_nan(x) || is_infinite(x) || x < 0)
        return text(x);
    return "";
}

struct named_number {
    std::string name;
    double value;
};

inline result check_unity(const std::string& whose, const std::vector<named_number>& weights,
                          double tolerance) {
    std::vector<std::string> faults;
    std::string all;
    double sum = 0;
    for (const auto& w : weights) {
        all += (all.empty() ? "\n  " : ", ") + w.name + " " + text(w.value);
        if (const std::string fault = fault_of(w.value); !fault.empty())
            faults.push_back("the weight of " + w.name + " is " + fault);
        sum += w.value;
    }
    if (!faults.empty())
        return {false, whose + ":" + list(faults)};
    if (weights.empty())
        return undecided(whose + ": no technique can make it, nothing to sum");
    const std::string message = whose + " sum to " + text(sum);
    if (std::fabs(sum - 1) <= tolerance)
        return {true, message};
    return {false,
            message + ", not 1 (difference " + text(sum - 1) + ", tolerance " + text(tolerance) + "):" + all};
}

// Calls visit(technique) for every technique with a positive density.
template <class T, class Vertex, class Visit>
void for_each_possible(const technique_counts<T>& counts, const Vertex* path, int n, Visit&& visit) {
    if (n < 2)
        return;
    std::vector<T> densities(static_cast<std::size_t>(technique_count(n)));
    relative_densities(counts, path, n, densities.data());
    for (int k = 0; k < technique_count(n); ++k)
        if (densities[static_cast<std::size_t>(k)] > T(0))
            visit(technique_at(n, k));
}

inline std::string path_of(int n) { return "path of " + std::to_string(n) + " vertices"; }

template <class F> using weight_type = std::decay_t<std::invoke_result_t<F&, technique>>;

} // namespace detail

// The weights of all techniques of one path sum to 1. weight_of(technique) is asked for the techniques with a
// positive density only; undecided where there are none. Weights that are NaN, infinite or negative are named
// before any sum is taken.
template <class T, class Vertex, class Weight>
result partition_of_unity(const technique_counts<T>& counts, const Vertex* path, int n, Weight&& weight_of,
                          double tolerance = default_tolerance<T, detail::weight_type<Weight>>) {
    std::vector<detail::named_number> claimed;
    detail::for_each_possible(counts, path, n, [&](technique t) {
        claimed.push_back({to_string(t), static_cast<double>(weight_of(t))});
    });
    return detail::check_unity("the weights of a " + detail::path_of(n), claimed, tolerance);
}

// The same for any `count` weights of one sample: a pointer or an array, or a callable weight(i). Undecided
// where there are none.
template <class Weight>
result partition_of_unity(Weight&& weight_of, int count, std::optional<double> tolerance = {}) {
    constexpr bool is_callable = std::is_invocable_v<Weight&, int>;
    std::vector<detail::named_number> claimed;
    bool in_float = false;
    for (int i = 0; i < count; ++i) {
        const auto w = [&] {
            if constexpr (is_callable)
                return weight_of(i);
            else
                return weight_of[static_cast<std::size_t>(i)];
        }();
        in_float = std::is_same_v<std::decay_t<decltype(w)>, float>;
        claimed.push_back({"technique " + std::to_string(i), static_cast<double>(w)});
    }
    const double standard = in_float ? default_tolerance<float> : default_tolerance<double>;
    return detail::check_unity("the weights of a sample", claimed, tolerance.value_or(standard));
}

// One claimed weight against that of the complete path, mis::weight, which is 0 where the technique cannot
// make it. The message names the techniques that should have the largest weights. A technique that no path of
// n vertices has fails.
template <class Heuristic, class T, class Vertex, class Claimed>
result weight(const Heuristic& heuristic, const technique_counts<T>& counts, const Vertex* path, int n,
              technique t, Claimed claimed, double tolerance = default_tolerance<T, Claimed>) {
    if (n < 2 || technique_index(n, t) < 0 || technique_index(n, t) >= technique_count(n) ||
        !(technique_at(n, technique_index(n, t)) == t))
        return {false, "there is no " + to_string(t) + " in a " + detail::path_of(n)};
    std::vector<T> all(static_cast<std::size_t>(technique_count(n)));
    mis::weights(heuristic, counts, path, n, all.data());
    const auto right_of = [&](int k) { return static_cast<double>(all[static_cast<std::size_t>(k)]); };
    const double right = right_of(technique_index(n, t));
    const double number = static_cast<double>(claimed);
    const bool agrees = detail::fault_of(number).empty() && detail::weights_agree(number, right, tolerance);
    std::string message = "the weight of " + to_string(t) + " in a " + detail::path_of(n) + ": claimed " +
                          detail::text(number) + ", right " + detail::text(right);
    if (agrees)
        return {true, message};
    if (right > 0)
        message += ", ratio " + detail::text(number / right);
    else
        message += " (the technique cannot make this path, or is off)";

    std::vector<int> others;
    for (int k = 0; k < technique_count(n); ++k)
        if (k != technique_index(n, t) && right_of(k) > 0)
            others.push_back(k);
    std::stable_sort(others.begin(), others.end(), [&](int a, int b) { return right_of(a) > right_of(b); });
    others.resize(std::min<std::size_t>(others.size(), 3));
    for (std::size_t k = 0; k < others.size(); ++k)
        message += (k == 0 ? "\n  strongest others: " : ", ") + to_string(technique_at(n, others[k])) + " " +
                   detail::text(right_of(others[k]));
    return {false, message};
}

// Every technique with one sample. `merge_area` is the kernel's pi r^2 that a merge's throughput is divided
// by.
template <class T> technique_counts<T> one_sample_each(T merge_area = T(1)) {
    technique_counts<T> counts;
    counts.light_hit = counts.next_event = counts.connection = T(1);
    counts.camera_connection = counts.direct = counts.camera_hit = T(1);
    counts.merge = merge_area;
    return counts;
}

namespace detail {

// One technique's throughput times its density: the contribution of the path, as this technique sees it.
template <class T> struct seen_contribution {
    technique t;
    mis::detail::path_product<T> value;
};

template <class T> double quotient(const seen_contribution<T>& a, const seen_contribution<T>& b) {
    const auto q = without(a.value, b.value);
    return static_cast<double>(std::ldexp(q.mantissa, static_cast<int>(q.exponent)));
}

inline void add_ratio(std::vector<named_number>& quantities, const std::string& a, double x,
                      const std::string& b, double y, const std::string& at) {
    if (x > 0)
        quantities.push_back({a + at, x});
    if (y > 0)
        quantities.push_back({b + at, y});
    if (x > 0 && y > 0)
        quantities.push_back({a + " / " + b + at, x / y});
}

// What a throughput may have missed or have in excess at x_i.
template <class T> void add_geometry(std::vector<named_number>&, const area_vertex<T>*, int, int) {}
template <class Vertex>
void add_geometry(std::vector<named_number>& quantities, const Vertex* path, int n, int i) {
    const auto x = measure(path, n, i);
    const std::string at = " at " + vertex_name(i);
    const auto number = [](auto v) { return static_cast<double>(v); };
    add_ratio(quantities, "cos_to_light", number(x.cos_to_light), "cos_to_camera", number(x.cos_to_camera),
              at);
    add_ratio(quantities, "pdf_to_light", number(x.pdf_to_light), "pdf_to_camera", number(x.pdf_to_camera),
              at);
    add_ratio(quantities, "pdf_distance_from_camera", number(x.pdf_distance_from_camera),
              "pdf_distance_from_light", number(x.pdf_distance_from_light), at);
    if (i == 0 || i == n - 1)
        add_ratio(quantities, "pdf_position", number(x.pdf_position), "pdf_next_event",
                  number(x.pdf_next_event), at);
    if (i < n - 1) {
        const std::string edge = " from " + vertex_name(i) + " to " + vertex_name(i + 1);
        const double distance2 = number(x.distance2_to_light);
        quantities.push_back({"distance" + edge, std::sqrt(distance2)});
        quantities.push_back({"squared distance" + edge, distance2});
    }
}

template <class T, class Vertex>
std::vector<named_number> quantities_between(const technique_counts<T>& counts, const Vertex* path, int n,
                                             int first, int last, technique a, technique b) {
    std::vector<named_number> quantities;
    for (int i = (std::max)(first, 0); i <= (std::min)(last, n - 1); ++i) {
        add_geometry(quantities, path, n, i);
        const auto p = area_densities(path, n, i);
        add_ratio(quantities, "P->", static_cast<double>(p.density_from_camera), "P<-",
                  static_cast<double>(p.density_from_light), " at " + vertex_name(i));
        quantities.push_back({"merge_factor at " + vertex_name(i), static_cast<double>(p.merge_factor)});
    }
    for (const technique t : {a, b})
        quantities.push_back(
            {"count of " + to_string(t.kind), static_cast<double>(count_of(counts, t.kind))});
    return quantities;
}

// ", which is cos_to_light at x_2", if the factor is one of the quantities or its inverse.
inline std::string explain(double factor, const std::vector<named_number>& quantities, double tolerance) {
    std::vector<std::string> names;
    for (const auto& q : quantities) {
        if (!is_number(q.value) || !(q.value > 0) || agree(q.value, 1, tolerance))
            continue;
        if (agree(factor, q.value, tolerance))
            names.push_back(q.name);
        else if (agree(factor, 1 / q.value, tolerance))
            names.push_back("1 / (" + q.name + ")");
    }
    std::string all;
    for (std::size_t i = 0; i < std::min<std::size_t>(names.size(), 3); ++i)
        all += (i == 0 ? ", which is " : " or ") + names[i];
    return all;
}

// The contributions as the techniques see them; techniques that neither form allows are left out, those on
// which the forms disagree become complaints.
template <class T, class Vertex, class Throughput>
std::vector<seen_contribution<T>> contributions(const technique_counts<T>& counts, const Vertex* path, int n,
                                                Throughput& throughput,
                                                std::vector<std::string>& complaints) {
    using product = mis::detail::path_product<T>;
    if (n < 2)
        return {};
    std::vector<product> densities(static_cast<std::size_t>(technique_count(n)));
    const long long exponent = mis::detail::for_each_density(
        counts, path, n, 0, [&](int k, const product& p) { densities[static_cast<std::size_t>(k)] = p; });
    for (product& p : densities)
        p.exponent += exponent; // whole, with the zeros and infinities of the light walk
    std::vector<seen_contribution<T>> seen;
    std::vector<std::string> dark;
    for (int k = 0; k < technique_count(n); ++k) {
        const technique t = technique_at(n, k);
        if (!(count_of(counts, n, t) > T(0)))
            continue;
        const double s = static_cast<double>(throughput(t));
        const product& p = densities[static_cast<std::size_t>(k)];
        const bool without_density = is_zero(p), without_throughput = is_infinite(s);
        if (is_nan(s) || s < 0)
            complaints.push_back("the throughput of " + to_string(t) + " is " + text(s));
        else if (without_density && !without_throughput)
            complaints.push_back(to_string(t) + " has density 0, but the throughput " + text(s) +
                                 " (impossible would be infinity)");
        else if (!without_density && without_throughput)
            complaints.push_back(to_string(t) + " has a positive density, but an infinite throughput");
        else if (!without_density && is_infinite(p) && s > 0)
            complaints.push_back(to_string(t) + " has an infinite density, but the throughput " + text(s));
        else if (!without_density && !is_infinite(p) && s > 0)
            seen.push_back({t, p * mis::detail::scaled_factor<mis::detail::wide_t<T>>(s)});
        else if (!without_density && !is_infinite(p))
            dark.push_back("the throughput of " + to_string(t) + " is 0, those of others are not");
    }
    if (!seen.empty())
        complaints.insert(complaints.end(), dark.begin(), dark.end());
    return seen;
}

template <class T, class Vertex>
void compare_neighbours(const technique_counts<T>& counts, const Vertex* path, int n,
                        const seen_contribution<T>& a, const seen_contribution<T>& b, double tolerance,
                        std::vector<std::string>& complaints) {
    const double factor = quotient(b, a);
    if (agree(factor, 1, tolerance))
        return;
    const int first = a.t.camera_vertices, last = b.t.camera_vertices - 1;
    const auto quantities = quantities_between(counts, path, n, first - 1, last + 1, a.t, b.t);
    std::string where = "at " + describe_vertex(path, first);
    if (last > first)
        where = "between " + describe_vertex(path, first) + " and " + describe_vertex(path, last);
    complaints.push_back("from " + to_string(a.t) + " to " + to_string(b.t) + " it changes by the factor " +
                         text(factor) + explain(factor, quantities, 10 * tolerance) + ": " + where +
                         ", which the camera walk takes over from the light walk");
}

// A merge against the nearest connections before and after it. Where these differ, they have been reported,
// and the merge is all right if it agrees with one of them.
template <class T, class Vertex>
void compare_merge(const technique_counts<T>& counts, const Vertex* path, int n,
                   const seen_contribution<T>& merge, const seen_contribution<T>* before,
                   const seen_contribution<T>* after, double tolerance,
                   std::vector<std::string>& complaints) {
    std::string factors;
    const int j = merge.t.camera_vertices - 1;
    for (const auto* other : {before, after}) {
        if (other == nullptr)
            continue;
        const double factor = quotient(merge, *other);
        if (agree(factor, 1, tolerance))
            return;
        const auto quantities = quantities_between(counts, path, n, j - 1, j + 1, merge.t, other->t);
        factors += (factors.empty() ? "" : " and ") + text(factor) + " times that of " + to_string(other->t) +
                   explain(factor, quantities, 10 * tolerance);
    }
    if (!factors.empty())
        complaints.push_back("at " + to_string(merge.t) + " it is " + factors + ": at " +
                             describe_vertex(path, j));
}

} // namespace detail

// The throughputs of one path's techniques against its densities: S_k p_k is the path's contribution, the
// same for every technique. throughput(technique) gives S_k, infinity where the technique cannot make the
// path. `counts` are not numbers of samples here but what a technique's throughput has been divided by beside
// the path's densities, see one_sample_each; techniques with count 0 are not asked. Undecided where there are
// less than two contributions to compare: no technique can make the path, one alone can, all throughputs are
// 0.
//
// From s to s + 1 the camera walk takes x_s over from the light walk. So where S p changes there, the two
// forms part at x_s or its edges, and the factor often tells what is missing.
template <class T, class Vertex, class Throughput>
result throughputs(const technique_counts<T>& counts, const Vertex* path, int n, Throughput&& throughput,
                   double tolerance = default_tolerance<T, detail::weight_type<Throughput>>) {
    std::vector<std::string> complaints;
    const auto seen = detail::contributions(counts, path, n, throughput, complaints);
    const auto is_merge = [](const auto& c) { return c.t.kind == technique_kind::merge; };
    std::vector<detail::seen_contribution<T>> joins, merges;
    for (const auto& c : seen)
        (is_merge(c) ? merges : joins).push_back(c);

    for (std::size_t k = 1; k < joins.size(); ++k)
        detail::compare_neighbours(counts, path, n, joins[k - 1], joins[k], tolerance, complaints);
    for (std::size_t m = 0; m < merges.size(); ++m) {
        const detail::seen_contribution<T>* before = nullptr;
        const detail::seen_contribution<T>* after = nullptr;
        for (const auto& c : joins) {
            if (c.t.camera_vertices < merges[m].t.camera_vertices)
                before = &c;
            else if (after == nullptr)
                after = &c;
        }
        if (joins.empty() && m > 0)
            before = &merges[m - 1];
        detail::compare_merge(counts, path, n, merges[m], before, after, tolerance, complaints);
    }
    const std::string what = "throughput times density in a " + detail::path_of(n);
    if (complaints.empty() && seen.size() < 2)
        return detail::undecided(what + ": " + (seen.empty() ? "no technique" : "one technique only") +
                                 " contributes, nothing to compare");
    if (complaints.empty())
        return {true, what + " is the same for " + std::to_string(seen.size()) + " techniques"};
    return {false, what + " is not the same for all techniques:" + detail::list(complaints)};
}

} // namespace mis::verify
