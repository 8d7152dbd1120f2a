// SPDX-License-Identifier: MIT
// Floor 5: checks for the unit tests of a renderer, in whatever test framework it uses.
//
// Every check returns a `result`: whether it passed, and a message that says what was claimed, what is right
// and where.
//
//     CHECK_MESSAGE(r, r.message)         doctest
//     EXPECT_TRUE(r) << r.message         GoogleTest
//
// A check that calls back asks only for techniques that can make the path. Tolerances are relative. Host
// only. Nothing here depends on isnan or isinf, so that it works under -ffast-math. docs/unit_tests.md shows
// every check in use.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <mis/path.hpp>
#include <mis/techniques.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace mis::verify {

struct result {
    bool passed = true;
    std::string message;
    explicit operator bool() const { return passed; }
};

// Neither NaN nor infinite. Looks at the bits, because compilers may assume that all numbers are finite.
inline bool is_number(double x) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &x, sizeof bits);
    return (bits >> 52 & 0x7ff) != 0x7ff;
}

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

inline bool is_nan(double x) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &x, sizeof bits);
    return !is_number(x) && (bits << 12) != 0;
}

inline bool is_infinite(double x) { return !is_number(x) && !is_nan(x); }

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
    for (std::size_t i = 0; i < std::min(lines.size(), longest_list); ++i)
        all += "\n  " + lines[i];
    if (lines.size() > longest_list)
        all += "\n  and " + std::to_string(lines.size() - longest_list) + " more";
    return all;
}

inline bool agree(double a, double b, double tolerance) {
    const double difference = std::fabs(a - b);
    return difference <= tolerance * std::max(std::fabs(a), std::fabs(b));
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
        return {true, whose + ": no technique can make it, nothing to sum"};
    const std::string message = whose + " sum to " + text(sum);
    if (std::fabs(sum - 1) <= tolerance)
        return {true, message};
    return {false,
            message + ", not 1 (difference " + text(sum - 1) + ", tolerance " + text(tolerance) + "):" + all};
}

// Calls visit(technique) for every technique with a positive density.
template <class T, class Vertex, class Visit>
void for_each_possible(const technique_counts<T>& counts, const Vertex* path, int n, Visit&& visit) {
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
// positive density only; passes where there are none. Weights that are NaN, infinite or negative are named
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

// The same for any `count` weights of one sample: a pointer or an array, or a callable weight(i).
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

// One claimed weight against that of the complete path, mis::weight. The message names the techniques that
// should have the largest weights.
template <class Heuristic, class T, class Vertex, class Claimed>
result weight(const Heuristic& heuristic, const technique_counts<T>& counts, const Vertex* path, int n,
              technique t, Claimed claimed, double tolerance = default_tolerance<T, Claimed>) {
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
    const auto q = a.value / b.value;
    return static_cast<double>(std::ldexp(q.mantissa, q.exponent));
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
    for (int i = std::max(first, 0); i <= std::min(last, n - 1); ++i) {
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
    std::vector<product> densities(static_cast<std::size_t>(technique_count(n)));
    mis::detail::for_each_density(
        counts, path, n, [&](int k, const product& p) { densities[static_cast<std::size_t>(k)] = p; });
    std::vector<seen_contribution<T>> seen;
    std::vector<std::string> dark;
    for (int k = 0; k < technique_count(n); ++k) {
        const technique t = technique_at(n, k);
        if (!(count_of(counts, n, t) > T(0)))
            continue;
        const double s = static_cast<double>(throughput(t));
        const product& p = densities[static_cast<std::size_t>(k)];
        const bool without_density = p.zeros > 0, without_throughput = is_infinite(s);
        if (is_nan(s) || s < 0)
            complaints.push_back("the throughput of " + to_string(t) + " is " + text(s));
        else if (without_density && !without_throughput)
            complaints.push_back(to_string(t) + " has density 0, but the throughput " + text(s) +
                                 " (impossible would be infinity)");
        else if (!without_density && without_throughput)
            complaints.push_back(to_string(t) + " has a positive density, but an infinite throughput");
        else if (!without_density && p.infinities > 0 && s > 0)
            complaints.push_back(to_string(t) + " has an infinite density, but the throughput " + text(s));
        else if (!without_density && p.infinities == 0 && s > 0)
            seen.push_back({t, p * mis::detail::scaled_factor<mis::detail::wide_t<T>>(s)});
        else if (!without_density && p.infinities == 0)
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
// the path's densities, see one_sample_each; techniques with count 0 are not asked.
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
    if (complaints.empty())
        return {true, what + " is the same for " + std::to_string(seen.size()) + " techniques"};
    return {false, what + " is not the same for all techniques:" + detail::list(complaints)};
}

namespace detail {

// Regularized upper incomplete gamma function Q(a, x): the series of the lower one for small x, else the
// continued fraction by the modified Lentz method. About 12 digits for a below 1e5.
inline double upper_gamma(double a, double x) {
    if (!(x > 0))
        return 1;
    const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
    if (x < a + 1) {
        double term = 1 / a, sum = term;
        for (int k = 1; k < 100'000 && term > sum * 1e-17; ++k)
            sum += term *= x / (a + k);
        return std::max(0.0, 1 - front * sum);
    }
    double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
    for (int k = 1; k < 100'000; ++k) {
        const double numerator = k * (a - k);
        b += 2;
        const auto away_from_0 = [](double y) { return std::fabs(y) < 1e-300 ? 1e-300 : y; };
        d = 1 / away_from_0(numerator * d + b);
        c = away_from_0(b + numerator / c);
        h *= d * c;
        if (std::fabs(d * c - 1) < 1e-15)
            break;
    }
    return front * h;
}

// Probability that a chi-squared variable is larger, that a standard normal one is farther from 0, and that a
// Poisson variable is at least `count`.
inline double chi_squared_tail(double statistic, double degrees) {
    return upper_gamma(degrees / 2, statistic / 2);
}
inline double normal_tails(double z) { return std::erfc(std::fabs(z) / std::sqrt(2.0)); }
inline double poisson_tail(double count, double mean) { return count > 0 ? 1 - upper_gamma(count, mean) : 1; }

} // namespace detail

// A point of the unit square.
struct point {
    double x, y;
};

struct sampler_options {
    int samples = 100'000;
    int bins = 16; // along each axis
    double false_alarm = 1e-6;
    int refinement = 2; // each bin is cut at least this many times into four where the density is integrated
    std::optional<double> support = {}; // measure of the set where the density is positive, where known
};

namespace detail {

struct cell {
    double x, y, size;

    cell quarter(int k) const {
        const double half = size / 2;
        return {x + (k & 1 ? half : 0), y + (k & 2 ? half : 0), half};
    }
};

template <class F> double two_point_gauss(F& f, const cell& c) {
    constexpr double offset = 0.28867513459481288225; // 1 / (2 sqrt 3)
    const double low = (0.5 - offset) * c.size, high = (0.5 + offset) * c.size;
    return (f(point{c.x + low, c.y + low}) + f(point{c.x + high, c.y + low}) +
            f(point{c.x + low, c.y + high}) + f(point{c.x + high, c.y + high})) *
           c.size * c.size / 4;
}

struct quadrature {
    double absolute;    // error that does not matter
    int least, at_most; // how often a cell is cut
};

template <class F> double integrate(F& f, const cell& c, double coarse, const quadrature& q, int depth = 0) {
    double parts[4], fine = 0;
    for (int k = 0; k < 4; ++k)
        fine += parts[k] = two_point_gauss(f, c.quarter(k));
    const bool settled = std::fabs(fine - coarse) <= std::max(q.absolute, 1e-4 * std::fabs(fine));
    if (depth + 1 >= q.at_most || (settled && depth + 1 >= q.least))
        return fine;
    fine = 0;
    for (int k = 0; k < 4; ++k)
        fine += integrate(f, c.quarter(k), parts[k], q, depth + 1);
    return fine;
}

struct bin {
    double expected = 0; // as a probability first, then as a count
    double observed = 0;
    std::string place;
};

// Calls of a density, and the first result that no density may have.
template <class Pdf> struct watched_density {
    Pdf& pdf;
    std::optional<point> faulty = {};
    double fault = 0;

    double operator()(point at) {
        const double p = static_cast<double>(pdf(at));
        if (fault_of(p).empty())
            return p;
        if (!faulty) {
            faulty = at;
            fault = p;
        }
        return 0;
    }
};

// The mean of min(1 / p, cap). 1 / p itself may have no variance, and its mean is far from normally
// distributed: with a cap of 100 supports instead of 10, four times too many right samplers failed.
struct inverse_density {
    double cap, sum = 0, sum_of_squares = 0;

    void add(double p) {
        const double x = p * cap > 1 ? 1 / p : cap;
        sum += x;
        sum_of_squares += x * x;
    }
};

// What a domain other than the unit square says about itself.
template <class Place> struct domain {
    double measure; // of the whole square
    const char* unit;
    const char* outside;
    Place place;
};

inline std::string interval(const char* name, double from, double to) {
    return std::string(name) + " in [" + text(from) + ", " + text(to) + ")";
}

template <class Place> std::string place_of_bin(const Place& place, const cell& c) {
    return interval("u", c.x, c.x + c.size) + ", " + interval("v", c.y, c.y + c.size) +
           place(point{c.x + c.size / 2, c.y + c.size / 2});
}

// Puts all bins with less than `least` expected counts into one, and that one, if still too small, into the
// largest.
inline std::vector<bin> pooled(const std::vector<bin>& bins, double least) {
    std::vector<bin> kept;
    bin rest{0, 0, "bins of small expectation"};
    for (const bin& b : bins) {
        if (b.expected >= least) {
            kept.push_back(b);
        } else {
            rest.expected += b.expected;
            rest.observed += b.observed;
        }
    }
    if (rest.expected >= least || kept.empty()) {
        kept.push_back(rest);
        return kept;
    }
    auto largest = std::max_element(kept.begin(), kept.end(),
                                    [](const bin& a, const bin& b) { return a.expected < b.expected; });
    largest->expected += rest.expected;
    largest->observed += rest.observed;
    return kept;
}

inline double deviation(const bin& b) {
    return (b.observed - b.expected) / std::sqrt(std::max(b.expected, 1e-300));
}

struct chi_squared_test {
    double statistic = 0, degrees = 0, p_value = 1;
    bin worst;
};

inline chi_squared_test chi_squared(const std::vector<bin>& bins) {
    chi_squared_test test;
    test.degrees = static_cast<double>(bins.size()) - 1;
    for (const bin& b : bins) {
        test.statistic += deviation(b) * deviation(b);
        if (std::fabs(deviation(b)) >= std::fabs(deviation(test.worst)))
            test.worst = b;
    }
    if (test.degrees > 0)
        test.p_value = chi_squared_tail(test.statistic, test.degrees);
    return test;
}

inline std::string percent_of_samples(double mass) { return text(100 * mass) + "% of the samples"; }

constexpr double least_expected = 10;     // samples per bin of the chi-squared test
constexpr double quadrature_error = 1e-4; // of the density's integral

// What is expected of a sampler and what it does.
struct tally {
    double support; // its share of the square
    inverse_density inverse;
    std::vector<bin> bins = {};
    double mass = 0;       // integral of the density
    double beyond_cap = 0; // what the cap takes away from the mean of 1 / p
    double lost = 0, impossible = 0;
    point impossible_at{0, 0};
};

template <class Pdf, class Place>
void integrate_bins(watched_density<Pdf>& density, const sampler_options& o, const Place& place, tally& t) {
    // Each leaf of the quadrature may be wrong by a thousandth of a sample.
    const quadrature rule{1e-3 / o.samples, o.refinement, o.refinement + 7};
    auto capped_part = [&](point at) {
        const double p = density(at);
        return p > 0 ? std::max(0.0, 1 - t.inverse.cap * p) : 0.0;
    };
    const double size = 1.0 / o.bins;
    for (int k = 0; k < o.bins * o.bins; ++k) {
        const cell c{size * (k % o.bins), size * (k / o.bins), size};
        t.bins.push_back({integrate(density, c, 0, rule), 0, place_of_bin(place, c)});
        t.mass += t.bins.back().expected;
        if (o.support)
            t.beyond_cap += integrate(capped_part, c, 0, rule);
    }
}

// False if a sample is outside the square.
template <class Sample, class Pdf>
bool count_samples(Sample& sample, watched_density<Pdf>& density, const sampler_options& o, tally& t) {
    const auto along = [&](double x) { return std::min(static_cast<int>(x * o.bins), o.bins - 1); };
    for (int k = 0; k < o.samples; ++k) {
        const std::optional<point> p = sample();
        if (!p) {
            t.lost += 1;
            continue;
        }
        if (!is_number(p->x) || !is_number(p->y) || !(p->x >= 0 && p->x <= 1 && p->y >= 0 && p->y <= 1))
            return false;
        t.bins[static_cast<std::size_t>(along(p->y) * o.bins + along(p->x))].observed += 1;
        const double d = density(*p);
        if (d > 0) {
            t.inverse.add(d);
        } else {
            t.impossible += 1;
            t.impossible_at = *p;
        }
    }
    return true;
}

// Whether the mean of 1 / p is the measure of the support, in standard errors. The integral of what the cap
// takes away may be as wrong as that of the density.
inline double support_deviation(const tally& t, double samples) {
    const double mean = t.inverse.sum / samples;
    const double variance = std::max(0.0, t.inverse.sum_of_squares / samples - mean * mean) / samples;
    const double difference = mean + t.beyond_cap - t.support;
    const double beyond_quadrature = std::max(0.0, std::fabs(difference) - quadrature_error * t.support);
    return std::copysign(beyond_quadrature, difference) / (std::sqrt(variance) + 1e-3 * quadrature_error);
}

// Lost samples are a bin of the chi-squared test if enough are expected, else they have a Poisson test of
// their own.
template <class Place> result judge(const tally& t, const sampler_options& o, const domain<Place>& where) {
    const double samples = o.samples;
    const double expected_lost = std::max(0.0, 1 - t.mass) * samples;
    const bool lost_is_a_bin = expected_lost >= std::max(least_expected, 10 * quadrature_error * samples);
    const double total = lost_is_a_bin ? samples : (samples - t.lost) / t.mass;
    std::vector<bin> bins = t.bins;
    for (bin& b : bins)
        b.expected *= total;
    bins = pooled(bins, least_expected);
    if (lost_is_a_bin)
        bins.push_back({expected_lost, t.lost, "samples lost"});

    const chi_squared_test chi = chi_squared(bins);
    const double z = o.support ? support_deviation(t, samples) : 0;
    const double lost_p_value =
        lost_is_a_bin ? 1 : poisson_tail(t.lost, expected_lost + quadrature_error * samples);
    const int tests = 1 + (lost_is_a_bin ? 0 : 1) + (o.support ? 1 : 0);
    const double threshold = o.false_alarm / tests;
    const bool fits = chi.p_value >= threshold, loses_right = lost_p_value >= threshold,
               covers = normal_tails(z) >= threshold;

    std::string message = "chi-squared " + text(chi.statistic) + " with " + text(chi.degrees) +
                          " degrees of freedom, p-value " + text(chi.p_value);
    if (!fits)
        message += " is below " + text(threshold) +
                   ", the sampler does not have this density\n  worst: " + chi.worst.place + ", " +
                   text(chi.worst.observed) + " samples, expected " + text(chi.worst.expected);
    if (!loses_right)
        message += "\n  " + percent_of_samples(t.lost / samples) +
                   " are lost, though the density integrates to " + text(t.mass);
    if (!covers)
        message += "\n  the mean of 1/p is " +
                   text((t.inverse.sum / samples + t.beyond_cap) * where.measure) + where.unit +
                   ", the support measures " + text(t.support * where.measure) + where.unit +
                   " (z = " + text(z) + ")";
    return {fits && loses_right && covers, message};
}

// Everything about a sampler whose domain has been mapped to the unit square, area-preserving but for the
// constant factor domain.measure.
template <class Sample, class Pdf, class Place>
result check_sampler(Sample& sample, Pdf& pdf, const sampler_options& o, const domain<Place>& where) {
    const auto at = [&](point p) { return "(" + text(p.x) + ", " + text(p.y) + ")" + where.place(p); };
    const double support = o.support.value_or(where.measure) / where.measure;
    watched_density<Pdf> density{pdf};
    tally t{support, {10 * support}};
    integrate_bins(density, o, where.place, t);
    if (!count_samples(sample, density, o, t))
        return {false, where.outside};
    if (density.faulty)
        return {false, "the density is " + text(density.fault) + " at " + at(*density.faulty)};
    if (t.mass > 1 + 10 * quadrature_error)
        return {false, "the density integrates to " + text(t.mass) + ", more than 1"};
    if (t.impossible > 1e-4 * o.samples)
        return {false, percent_of_samples(t.impossible / o.samples) +
                           " are where the density is 0, the last at " + at(t.impossible_at)};
    return judge(t, o, where);
}

} // namespace detail

// A sampler of the unit square against its density. sample() returns std::optional<point>, empty where it
// makes no sample (absorption, a direction below the surface), and pdf(point) its density per unit area,
// whose integral may be less than 1 by what is lost so.
//
//   - chi-squared over bins x bins equal squares, whose expectations are integrals of the density; those with
//     less than 10 expected samples are pooled, lost samples are a bin of their own;
//   - if the support is given, the mean of 1 / p against its measure (1 / p is capped at ten supports,
//     and what the cap takes away is integrated);
//   - samples where the density is 0 fail beyond one in 10,000, as rounding may make a few.
//
// A right sampler fails with probability false_alarm in all. Peaks narrower than a bin / 2^refinement may be
// missed by the integration: raise `bins` or `refinement`.
template <class Sample, class Pdf>
result square_sampler(Sample&& sample, Pdf&& pdf, const sampler_options& options = {}) {
    const auto nothing_to_add = [](point) { return std::string(); };
    const detail::domain<decltype(nothing_to_add)> square{1, "", "a sample is outside the unit square",
                                                          nothing_to_add};
    return detail::check_sampler(sample, pdf, options, square);
}

// The same for unit vectors and densities per solid angle. sample() returns an optional of any vector type
// with operator[], made from three numbers in braces (GLM, Eigen, std::array); pdf takes it. The bins are
// equal in z and azimuth; `support` is in steradians, 2 pi for a hemisphere.
template <class Sample, class Pdf>
result direction_sampler(Sample&& sample, Pdf&& pdf, const sampler_options& options = {}) {
    using Vec = typename std::decay_t<decltype(sample())>::value_type;
    using T = std::decay_t<decltype(std::declval<const Vec&>()[0])>;
    const double sphere = 4 * detail::pi;
    const auto direction = [](point at) {
        const double z = 1 - 2 * at.x, azimuth = 2 * detail::pi * at.y;
        const double sine = std::sqrt(std::max(0.0, 1 - z * z));
        return Vec{static_cast<T>(sine * std::cos(azimuth)), static_cast<T>(sine * std::sin(azimuth)),
                   static_cast<T>(z)};
    };
    const auto on_square = [&]() -> std::optional<point> {
        const std::optional<Vec> d = sample();
        if (!d)
            return std::nullopt;
        const double x = static_cast<double>((*d)[0]), y = static_cast<double>((*d)[1]),
                     z = static_cast<double>((*d)[2]);
        const double length2 = x * x + y * y + z * z;
        if (!is_number(length2) || std::fabs(length2 - 1) > 1e-3)
            return point{-1, -1};
        const double turn = std::atan2(y, x) / (2 * detail::pi);
        return point{std::min(1.0, std::max(0.0, (1 - z) / 2)), turn < 0 ? turn + 1 : turn};
    };
    const auto density = [&](point at) { return sphere * static_cast<double>(pdf(direction(at))); };
    const auto place = [&](point at) {
        const Vec d = direction(at);
        return " about direction (" + detail::text(static_cast<double>(d[0])) + ", " +
               detail::text(static_cast<double>(d[1])) + ", " + detail::text(static_cast<double>(d[2])) + ")";
    };
    const detail::domain<decltype(place)> unit_sphere{sphere, " sr", "a sampled direction is not of length 1",
                                                      place};
    return detail::check_sampler(on_square, density, options, unit_sphere);
}

// The mean of samples. Give it pixels, images or batches of samples rather than single contributions where
// those are rare and large: the checks take means to be normally distributed.
struct running_mean {
    double count = 0, sum = 0, sum_of_squares = 0;

    running_mean& operator+=(const running_mean& other) {
        count += other.count;
        sum += other.sum;
        sum_of_squares += other.sum_of_squares;
        return *this;
    }
};

inline void add(running_mean& m, double sample) { m += {1, sample, sample * sample}; }
inline double mean(const running_mean& m) { return m.count > 0 ? m.sum / m.count : 0; }

// The squared standard error of the mean, 0 below two samples.
inline double variance_of_mean(const running_mean& m) {
    if (m.count < 2)
        return 0;
    const double spread = m.sum_of_squares - m.sum * m.sum / m.count;
    return std::max(0.0, spread) / ((m.count - 1) * m.count);
}

struct named_estimate {
    std::string subset; // of techniques, for the message
    int path_length;    // estimates are compared with those of the same length
    running_mean value;
};

// All estimates of one path length have one mean, whatever techniques they come from: every pair by a z-test,
// with the false-alarm rate of the whole table (Bonferroni). Means closer than `rounding` times their size
// agree, whatever the variance.
//
// An estimate whose samples are all the same, as where a subset has never hit, counts as exact: two such
// agree if they are equal, and the message says so where one disagrees with another. Either its techniques
// are missing something or it needs more samples. Estimates of less than two samples and tables without a
// pair to compare fail.
inline result estimates_agree(const std::vector<named_estimate>& estimates, double false_alarm = 1e-6,
                              double rounding = 1e-6) {
    std::vector<std::string> complaints;
    std::vector<std::pair<const named_estimate*, const named_estimate*>> pairs;
    for (std::size_t i = 0; i < estimates.size(); ++i) {
        const auto& e = estimates[i];
        const std::string name = e.subset + ", path length " + std::to_string(e.path_length);
        if (e.value.count < 2)
            complaints.push_back(name + ": fewer than two samples");
        else if (!is_number(e.value.sum) || !is_number(e.value.sum_of_squares))
            complaints.push_back(name + ": a sample is NaN or infinite");
        for (std::size_t j = 0; j < i; ++j)
            if (estimates[j].path_length == e.path_length)
                pairs.emplace_back(&estimates[j], &e);
    }
    if (!complaints.empty())
        return {false, "estimates cannot be compared:" + detail::list(complaints)};
    if (pairs.empty())
        return {false, "estimates cannot be compared: no two have the same path length"};

    const double threshold = false_alarm / static_cast<double>(pairs.size());
    for (const auto& [a, b] : pairs) {
        const double difference = std::fabs(mean(a->value) - mean(b->value));
        const double forgiven = rounding * std::max(std::fabs(mean(a->value)), std::fabs(mean(b->value)));
        const double error = std::sqrt(variance_of_mean(a->value) + variance_of_mean(b->value));
        const bool both_exact = !(error > 0);
        const double z = both_exact ? 0 : difference / error;
        if (difference <= forgiven || (!both_exact && detail::normal_tails(z) >= threshold))
            continue;
        std::string line = "path length " + std::to_string(a->path_length) + ": ";
        for (const auto* e : {a, b})
            line += e->subset + " " + detail::text(mean(e->value)) + " +- " +
                    detail::text(std::sqrt(variance_of_mean(e->value))) +
                    (variance_of_mean(e->value) > 0                          ? ""
                     : std::fabs(e->value.sum) + e->value.sum_of_squares > 0 ? " (all samples the same)"
                                                                             : " (never hit)") +
                    (e == a ? ", " : "");
        complaints.push_back(line + (both_exact ? "" : ", z = " + detail::text(z)));
    }
    const std::string pairs_text = std::to_string(pairs.size()) + " pairs of estimates";
    if (complaints.empty())
        return {true, pairs_text + " agree"};
    return {false, std::to_string(complaints.size()) + " of " + pairs_text + " disagree (false alarm " +
                       detail::text(false_alarm) + " in all):" + detail::list(complaints)};
}

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
    long most = 0;
    for (const auto& a : changes) {
        if (!(a.before > 0 && a.after > 0))
            continue;
        const long sharing = std::count_if(changes.begin(), changes.end(), [&](const weight_change& b) {
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

} // namespace detail

// A renderer's weight function T weight_of(counts, path, n, technique) does not change with the size of the
// scene.
template <class T, class Vertex, class Weight>
result scale_invariance(Weight&& weight_of, const technique_counts<T>& counts, const Vertex* path, int n,
                        mis::detail::identity_t<T> k = T(3), double tolerance = default_tolerance<T>) {
    const auto other = scaled(counts, path, n, k);
    return detail::unchanged("a scene " + detail::text(static_cast<double>(k)) + " times as large",
                             detail::changes_of(weight_of, counts, path, n, other, detail::same_technique),
                             tolerance, static_cast<double>(k));
}

// It does not change if camera and light are exchanged, see swapped. Techniques in the message are those of
// the path given.
template <class T, class Vertex, class Weight>
result swap_invariance(Weight&& weight_of, const technique_counts<T>& counts, const Vertex* path, int n,
                       double tolerance = default_tolerance<T>) {
    const auto image = [n](technique t) { return swapped(t, n); };
    return detail::unchanged("exchanging camera and light",
                             detail::changes_of(weight_of, counts, path, n, swapped(counts, path, n), image),
                             tolerance);
}

// It does not change if all counts are multiplied by one factor.
template <class T, class Vertex, class Weight>
result count_invariance(Weight&& weight_of, const technique_counts<T>& counts, const Vertex* path, int n,
                        mis::detail::identity_t<T> factor = T(7), double tolerance = default_tolerance<T>) {
    const weighed_path<Vertex> other{mis::scaled(counts, factor), {path, path + n}};
    return detail::unchanged("all counts times " + detail::text(static_cast<double>(factor)),
                             detail::changes_of(weight_of, counts, path, n, other, detail::same_technique),
                             tolerance, static_cast<double>(factor));
}

// Balance heuristic only: one technique counted as two of half the density each changes no other weight, and
// the halves' weights sum to the whole's. T weight_of(const T* densities, int count, int i).
template <class T, class Weight>
result splitting_invariance(Weight&& weight_of, const T* densities, int count,
                            double tolerance = default_tolerance<T>) {
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
        const auto r = detail::unchanged("technique " + std::to_string(split) + " split into two halves",
                                         changes, tolerance);
        if (!r)
            return r;
    }
    return {true, "splitting a technique changes no weight"};
}

} // namespace mis::verify
