// SPDX-License-Identifier: MIT
#include "oracle.hpp"
#include "random_paths.hpp"

#include <array>
#include <cstdio>
#include <doctest/doctest.h>
#include <mis/throughput.hpp>
#include <mis/verify.hpp>

// Every check passes on what is right and, on planted mistakes, fails with a message that names the place.

using namespace test;
using mis::technique;
using mis::technique_counts;
using mis::technique_kind;
using mis::verify::result;

namespace {

struct vec3 {
    double x = 0, y = 0, z = 0;
    double operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
};
vec3 operator-(const vec3& a, const vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
vec3 operator*(const vec3& a, double k) { return {a.x * k, a.y * k, a.z * k}; }
double dot(const vec3& a, const vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

bool says(const result& r, const std::string& part) {
    if (r.message.find(part) != std::string::npos)
        return true;
    MESSAGE("no \"" << part << "\" in: " << r.message);
    return false;
}

// The first sample that was not as it should be, so that a loop makes one CHECK.
struct first_failure {
    std::string message;
    int failures = 0, passed = 0, undecided = 0;

    void see(const result& r) {
        passed += r.passed;
        undecided += r.undecided;
        if (!r.passed && !r.undecided && failures++ == 0)
            message = r.message;
    }
};

// Random paths may be such that no technique can make them: not most.
#define CHECK_PASSED(failure)                                                                                \
    do {                                                                                                     \
        CHECK_MESSAGE(failure.failures == 0, failure.message);                                               \
        CHECK(failure.passed > failure.undecided);                                                           \
    } while (false)

// Neither passed nor failed, and the message says why.
bool is_undecided(const result& r, const std::string& why) {
    return r.undecided && !r.passed && !r && r.message.rfind("undecided: ", 0) == 0 && says(r, why);
}

std::string name(technique_kind kind, int s) { return mis::verify::to_string(technique{kind, s}); }

// A path of n vertices without a Dirac vertex, all techniques on.
random_path<double> plain_path(generator& g, int n) {
    auto path = make_path<double>(g, n, ordinary);
    path.counts = mis::connection_and_merging(100.0, 0.1);
    path.counts.camera_hit = path.counts.direct = 100;
    for (auto& x : path.vertices) {
        x.dirac = false;
        if (x.kind == vertex_kind::dirac)
            x.kind = vertex_kind::surface;
        if (x.kind == vertex_kind::infinite_light)
            x.kind = vertex_kind::light;
        x.merge_factor = 1;
    }
    return path;
}

std::vector<mis::area_vertex<double>> in_areas(const random_path<double>& path) {
    std::vector<mis::area_vertex<double>> areas;
    for (int i = 0; i < path.size(); ++i)
        areas.push_back(mis::area_densities(path.data(), path.size(), i));
    return areas;
}

// Random positions and normals in place of cosines and distances.
std::vector<mis::path_vertex<vec3>> in_positions(generator& g, const random_path<double>& path) {
    std::vector<mis::path_vertex<vec3>> result;
    const auto random_vector = [&] { return vec3{g.uniform(-1, 1), g.uniform(-1, 1), g.uniform(-1, 1)}; };
    for (const auto& m : path.vertices) {
        mis::path_vertex<vec3> x;
        x.kind = m.kind;
        x.dirac = m.dirac;
        x.position = random_vector();
        x.normal = random_vector();
        x.normal = x.normal * (1 / std::sqrt(dot(x.normal, x.normal)));
        x.pdf_to_light = m.pdf_to_light;
        x.pdf_to_camera = m.pdf_to_camera;
        x.pdf_position = m.pdf_position;
        x.pdf_next_event = m.pdf_next_event;
        x.pdf_distance_from_camera = m.pdf_distance_from_camera;
        x.pdf_distance_from_light = m.pdf_distance_from_light;
        x.merge_factor = m.merge_factor;
        result.push_back(x);
    }
    return result;
}

const auto power_weight = [](const auto& counts, const auto* path, int n, technique t) {
    return mis::weight(mis::power, counts, path, n, t);
};
const auto balance_weight = [](const auto& counts, const auto* path, int n, technique t) {
    return mis::weight(mis::balance, counts, path, n, t);
};

const double not_a_number = from_bits<double>(0x7ff8000000000000u);
const double infinity = from_bits<double>(oracle::infinity_bits<double>);

} // namespace

TEST_CASE("names, and numbers that are none") {
    CHECK(name(technique_kind::connection, 3) == "connection (s = 3)");
    CHECK(name(technique_kind::merge, 3) == "merge at x_2 (s = 3)");
    CHECK(mis::verify::to_string(vertex_kind::infinite_light) == "infinite light");
    CHECK(mis::is_number(0));
    CHECK(mis::is_number(-std::numeric_limits<double>::max()));
    CHECK_FALSE(mis::is_number(not_a_number));
    CHECK_FALSE(mis::is_number(infinity));
    CHECK(mis::verify::detail::text(not_a_number) == "NaN");
    CHECK(mis::verify::detail::text(-infinity) == "-infinity");
    CHECK_FALSE(static_cast<bool>(result{false, ""}));
}

TEST_CASE_TEMPLATE("partition of unity: the library's weights", T, float, double) {
    generator g(101);
    first_failure failure;
    for (int sample = 0; sample < 5'000; ++sample) {
        const auto path = make_path<T>(g, g.integer(2, 12), g.chance(0.5) ? ordinary : extreme<T>);
        const int n = path.size();
        failure.see(mis::verify::partition_of_unity(path.counts, path.data(), n, [&](technique t) {
            return mis::weight(mis::power, path.counts, path.data(), n, t);
        }));
    }
    CHECK_PASSED(failure);
}

TEST_CASE("partition of unity: planted mistakes") {
    generator g(102);
    const auto path = plain_path(g, 6);
    const auto areas = in_areas(path);
    const auto positions = in_positions(g, path);
    const auto with = [&](technique wrong, double weight_of_wrong) {
        return mis::verify::partition_of_unity(path.counts, path.data(), 6, [&](technique t) {
            return t == wrong ? weight_of_wrong : mis::weight(mis::balance, path.counts, path.data(), 6, t);
        });
    };
    const technique merge{technique_kind::merge, 4}, hit{technique_kind::light_hit, 6};
    CHECK_FALSE(with(merge, not_a_number));
    CHECK(says(with(merge, not_a_number), "the weight of merge at x_3 (s = 4) is NaN"));
    CHECK(says(with(hit, infinity), "the weight of light hit (s = 6) is infinity"));
    CHECK(says(with(hit, -0.5), "the weight of light hit (s = 6) is -0.5"));
    CHECK_FALSE(with(hit, 2));
    CHECK(says(with(hit, 2), "light hit (s = 6) 2"));
    for (int k = 0; k < mis::technique_count(6); ++k)
        CHECK(says(with(hit, 2), mis::verify::to_string(mis::technique_at(6, k))));

    // techniques that cannot make the path are not asked: 10 others at 0.1 each
    int asked = 0;
    auto without_hit = path;
    without_hit.vertices.back().dirac = true;
    const auto tenth = [&](technique t) {
        ++asked;
        CHECK(t != hit);
        return 0.1;
    };
    CHECK(mis::verify::partition_of_unity(path.counts, without_hit.data(), 6, tenth));
    CHECK(asked == 10);
    CHECK(says(mis::verify::partition_of_unity(path.counts, areas.data(), 6, [](technique) { return 0.1f; }),
               "sum to 1.1, not 1"));
    CHECK(
        says(mis::verify::partition_of_unity(path.counts, positions.data(), 6, [](technique) { return 0.2; }),
             "sum to 2.2, not 1"));
    CHECK(mis::verify::partition_of_unity(
        path.counts, path.data(), 6, [](technique) { return 0.1; }, 0.11));
    const technique_counts<double> off;
    CHECK(is_undecided(mis::verify::partition_of_unity(off, path.data(), 6, tenth), "nothing to sum"));
    for (const int n : {1, 0, -1})
        CHECK(is_undecided(mis::verify::partition_of_unity(path.counts, path.data(), n, tenth), "nothing"));
}

TEST_CASE("partition of unity: weights of any sample") {
    const std::vector<double> q{1, 5, 2};
    const auto of = [&](int i) { return mis::weight(mis::power, q, i); };
    CHECK(mis::verify::partition_of_unity(of, 3));
    const float weights[3] = {0.5f, 0.25f, 0.25f + 1e-6f};
    CHECK(mis::verify::partition_of_unity(weights, 3));
    CHECK_FALSE(mis::verify::partition_of_unity(weights, 3, 1e-7));
    CHECK(says(mis::verify::partition_of_unity(weights, 2), "technique 1 0.25"));
    CHECK(says(mis::verify::partition_of_unity([](int i) { return i == 1 ? not_a_number : 0.5; }, 3),
               "the weight of technique 1 is NaN"));
    CHECK_FALSE(mis::verify::partition_of_unity([](int) { return not_a_number; }, 1));
    for (const int count : {0, -1})
        CHECK(is_undecided(mis::verify::partition_of_unity(weights, count), "nothing to sum"));
}

TEST_CASE_TEMPLATE("one weight: right ones pass, wrong ones are named", T, float, double) {
    generator g(111);
    first_failure failure;
    int wrong_passed = 0, unnamed = 0;
    for (int sample = 0; sample < 5'000; ++sample) {
        const auto path = make_path<T>(g, g.integer(2, 12), ordinary);
        const int n = path.size();
        const auto t = mis::technique_at(n, g.integer(0, mis::technique_count(n) - 1));
        const T right = mis::weight(mis::power, path.counts, path.data(), n, t);
        const auto check = [&](T claimed) {
            return mis::verify::weight(mis::power, path.counts, path.data(), n, t, claimed);
        };
        failure.see(check(right));
        if (!(right > T(1e-20)))
            continue;
        const result r = check(right * T(1.001));
        wrong_passed += r.passed;
        unnamed += r.message.find(mis::verify::to_string(t) + " in a") == std::string::npos ||
                   r.message.find("ratio 1.001") == std::string::npos;
    }
    CHECK_PASSED(failure);
    CHECK(wrong_passed == 0);
    CHECK(unnamed == 0);
}

TEST_CASE("one weight: the message") {
    std::vector<mis::area_vertex<double>> path(4);
    for (auto& x : path)
        x.density_from_camera = x.density_from_light = x.next_event = 1;
    path[3].density_from_camera = 2; // the light hit's weight is 2/5, that of the others 1/5
    const auto counts = mis::bidirectional(1.0);
    const auto check = [&](technique t, double claimed) {
        return mis::verify::weight(mis::balance, counts, path.data(), 4, t, claimed);
    };
    const technique join{technique_kind::connection, 2};
    CHECK(check(join, 0.2));
    CHECK(says(check(join, 0.4),
               "connection (s = 2) in a path of 4 vertices: claimed 0.4, right 0.2, ratio 2"));
    CHECK(says(check(join, 0.4), "strongest others: light hit (s = 4) 0.4, camera connection (s = 1) 0.2"));
    CHECK(says(check(join, not_a_number), "claimed NaN, right 0.2"));
    CHECK(says(check({technique_kind::merge, 2}, 0.3), "cannot make this path"));
    CHECK(check({technique_kind::merge, 2}, 0.0));
    // no such technique, or no such path
    for (const technique t : {technique{technique_kind::connection, 3}, technique{technique_kind::merge, 1},
                              technique{technique_kind::merge, 4}, technique{technique_kind::light_hit, -1}})
        CHECK(says(check(t, 0), "there is no " + mis::verify::to_string(t) + " in a path of 4 vertices"));
    CHECK_FALSE(mis::verify::weight(mis::balance, counts, path.data(), 0, join, 0.0));
}

namespace {

// The throughputs f / p of all techniques, one sample each.
struct path_with_throughputs {
    random_path<double> path;
    std::vector<double> throughput;

    result check(const technique_counts<double>& counts = mis::verify::one_sample_each<double>()) const {
        return mis::verify::throughputs(counts, path.data(), path.size(), [&](technique t) {
            return throughput[static_cast<std::size_t>(mis::technique_index(path.size(), t))];
        });
    }
    double& at(technique t) {
        return throughput[static_cast<std::size_t>(mis::technique_index(path.size(), t))];
    }
    double& at(int s) { return throughput[static_cast<std::size_t>(s)]; }

    // All techniques whose light walk makes x_i.
    void multiply_light_walk(int i, double factor) {
        for (int k = 0; k < mis::technique_count(path.size()); ++k)
            if (const technique t = mis::technique_at(path.size(), k);
                t.camera_vertices <= i || (t.kind == technique_kind::merge && t.camera_vertices == i + 1))
                at(t) *= factor;
    }
};

path_with_throughputs with_throughputs(const random_path<double>& path) {
    path_with_throughputs result{path, {}};
    const auto counts = mis::verify::one_sample_each<double>();
    for (const wide& p : oracle::densities(counts, oracle::path_of(path.vertices))) {
        const wide s = wide{2.5} / p;
        result.throughput.push_back(s.infinite ? infinity : static_cast<double>(oracle::to_long_double(s)));
    }
    return result;
}

} // namespace

TEST_CASE("throughputs that belong to the densities") {
    generator g(121);
    first_failure failure;
    for (int sample = 0; sample < 5'000; ++sample)
        failure.see(with_throughputs(make_path<double>(g, g.integer(2, 9), ordinary)).check());
    CHECK_PASSED(failure);

    // a path without a contribution, and one that no technique can make
    auto dark = with_throughputs(plain_path(g, 5));
    for (double& s : dark.throughput)
        s = 0;
    CHECK(is_undecided(dark.check(), "no technique contributes, nothing to compare"));
    for (double& s : dark.throughput)
        s = infinity;
    dark.path.counts = {};
    CHECK(is_undecided(dark.check(dark.path.counts), "no technique contributes, nothing to compare"));
    technique_counts<double> hits_alone;
    hits_alone.light_hit = 1;
    CHECK(is_undecided(with_throughputs(plain_path(g, 5)).check(hits_alone), "one technique only"));
    for (const int n : {1, 0, -1})
        CHECK(is_undecided(
            mis::verify::throughputs(hits_alone, dark.path.data(), n, [](technique) { return 1.0; }),
            "nothing to compare"));
}

TEST_CASE("throughputs: a factor missing at a vertex is named with the vertex") {
    generator g(122);
    int passed = 0, misplaced = 0, unexplained = 0;
    std::string first;
    for (int sample = 0; sample < 2'000; ++sample) {
        const int n = g.integer(4, 8), i = g.integer(1, n - 2);
        auto right = plain_path(g, n);
        auto& x = right.vertices[static_cast<std::size_t>(i)];
        x.kind = vertex_kind::surface;
        x.cos_to_camera = g.uniform(0.2, 0.9);
        x.cos_to_light = g.uniform(0.2, 0.9);
        x.distance2_to_light = g.uniform(2, 9);
        const auto p = mis::area_densities(right.data(), n, i);
        const std::string v = "x_" + std::to_string(i), next = "x_" + std::to_string(i + 1);
        const std::pair<double, std::string> mistakes[] = {
            {x.cos_to_light, "cos_to_light at " + v},
            {1 / x.cos_to_camera, "cos_to_camera at " + v},
            {x.distance2_to_light, "squared distance from " + v + " to " + next},
            {std::sqrt(x.distance2_to_light), "distance from " + v + " to " + next},
            {p.density_from_camera / p.density_from_light, "P-> / P<- at " + v},
            {1 / x.pdf_to_camera, "pdf_to_camera at " + v}};
        auto wrong = with_throughputs(right);
        const auto& [factor, cause] = mistakes[g.integer(0, 5)];
        wrong.multiply_light_walk(i, factor);
        const result r = wrong.check();
        passed += r.passed;
        misplaced += r.message.find(": at " + v + " (surface), which the camera walk") == std::string::npos;
        // one place only: the merges have not been blamed, nor other vertices
        misplaced += std::count(r.message.begin(), r.message.end(), '\n') != 1;
        unexplained += r.message.find(cause) == std::string::npos;
        if (first.empty() && (r.passed || misplaced + unexplained > 0))
            first = cause + ": " + r.message;
    }
    INFO(first);
    CHECK(passed == 0);
    CHECK(misplaced == 0);
    CHECK(unexplained == 0);
}

TEST_CASE("throughputs: merges, end points, techniques that one form only allows") {
    generator g(123);
    const auto right = with_throughputs(plain_path(g, 6));
    const technique merge{technique_kind::merge, 4};
    auto wrong = right;
    wrong.at(merge) *= 9;
    CHECK_FALSE(wrong.check());
    CHECK(says(wrong.check(), "at merge at x_3 (s = 4) it is 9 times that of connection (s = 3)"));
    CHECK(says(wrong.check(), "and 9 times that of connection (s = 4)"));

    // merges that divide by the disk's area: right if the counts say so, else named
    const double area = mis::merge_area(0.1);
    wrong = right;
    for (int j = 1; j <= 4; ++j)
        wrong.at({technique_kind::merge, j + 1}) /= area;
    CHECK(wrong.check(mis::verify::one_sample_each(area)));
    CHECK_FALSE(wrong.check());
    CHECK(says(right.check(mis::verify::one_sample_each(area)), "which is count of merge"));

    // next event and light hit part at the light
    wrong = right;
    wrong.at({technique_kind::light_hit, 6}) *= 3;
    CHECK(says(wrong.check(), "from next event (s = 5) to light hit (s = 6) it changes by the factor 3"));
    CHECK(says(wrong.check(), "at x_5 (light)"));
    wrong.at({technique_kind::light_hit, 6}) = infinity;
    CHECK(says(wrong.check(), "light hit (s = 6) has a positive density, but an infinite throughput"));
    wrong.at({technique_kind::light_hit, 6}) = not_a_number;
    CHECK(says(wrong.check(), "the throughput of light hit (s = 6) is NaN"));
    wrong.at({technique_kind::light_hit, 6}) = -1;
    CHECK(says(wrong.check(), "the throughput of light hit (s = 6) is -1"));
    wrong.at({technique_kind::light_hit, 6}) = 0;
    CHECK(says(wrong.check(), "the throughput of light hit (s = 6) is 0, those of others are not"));

    wrong = right;
    wrong.path.vertices[2].kind = vertex_kind::dirac;
    CHECK_FALSE(wrong.check());
    CHECK(says(wrong.check(), "connection (s = 2) has density 0, but the throughput"));
    CHECK(says(wrong.check(), "merge at x_2 (s = 3) has density 0, but the throughput"));
    wrong.at(2) = wrong.at(3) = wrong.at({technique_kind::merge, 3}) = infinity;
    CHECK(wrong.check());
    wrong.multiply_light_walk(2, 5); // between s = 1 and s = 4 nothing tells the vertices apart
    CHECK(says(wrong.check(), "by the factor 0.2"));
    CHECK(says(wrong.check(), "between x_1 (surface) and x_3"));

    // area records have no cosines to name, but the same places
    auto areas = in_areas(right.path);
    const auto check = [&] {
        return mis::verify::throughputs(
            mis::verify::one_sample_each<double>(), areas.data(), 6, [&](technique t) {
                return right.throughput[static_cast<std::size_t>(mis::technique_index(6, t))];
            });
    };
    CHECK(check());
    areas[3].density_from_camera *= 4;
    CHECK(says(check(), "by the factor 4: at x_3"));
}

TEST_CASE("the chi-squared distribution's tail") {
    using mis::verify::detail::chi_squared_tail;
    using mis::verify::detail::upper_gamma;
    // tabulated quantiles
    const double known[][3] = {{1, 3.841458820694124, 0.05},   {10, 18.307038053275146, 0.05},
                               {10, 29.588298445074425, 1e-3}, {100, 124.34211340400407, 0.05},
                               {2, 27.631021115928547, 1e-6},  {5, 0.5543, 0.99}};
    for (const auto& [degrees, statistic, tail] : known)
        CHECK(chi_squared_tail(statistic, degrees) ==
              doctest::Approx(tail).epsilon(degrees == 5 ? 1e-5 : 1e-10));
    worst_case worst;
    generator g(131);
    for (int sample = 0; sample < 5'000; ++sample) {
        const double x = g.log_uniform<double>(-3, 2);
        worst.see(std::fabs(upper_gamma(0.5, x) / std::erfc(std::sqrt(x)) - 1), sample);
        worst.see(std::fabs(upper_gamma(1, x) / std::exp(-x) - 1), sample);
        // a whole: the chance of fewer than a events
        const int a = g.integer(1, 600);
        const double mean = a * g.uniform(0.8, 1.2);
        long double sum = 0;
        for (int k = 0; k < a; ++k)
            sum += std::exp(k * std::log(static_cast<long double>(mean)) - static_cast<long double>(mean) -
                            std::lgamma(k + 1.0L));
        worst.see(std::fabs(upper_gamma(a, mean) / static_cast<double>(sum) - 1), sample);
    }
    CHECK(worst.error <= 1e-10);
    CHECK(upper_gamma(3, 0) == 1);
    CHECK(mis::verify::detail::poisson_tail(0, 2) == 1);
    CHECK(mis::verify::detail::poisson_tail(1, 2) == doctest::Approx(1 - std::exp(-2.0)));
    CHECK(mis::verify::detail::normal_tails(1.959963984540054) == doctest::Approx(0.05));
}

namespace {

// The same for a whole number of degrees of freedom: Abramowitz and Stegun, 26.7.3 and 26.7.4.
double student_tails_as_a_sum(double t, int degrees) {
    const long double angle = std::atan(t / std::sqrt(static_cast<long double>(degrees)));
    const long double cosine = std::cos(angle), sine = std::sin(angle);
    const bool is_odd = degrees % 2 == 1;
    long double term = is_odd ? cosine : 1, sum = degrees == 1 ? 0 : term;
    for (int k = is_odd ? 3 : 2; k < degrees; k += 2)
        sum += term *= cosine * cosine * static_cast<long double>(k - 1) / static_cast<long double>(k);
    const long double half_pi = std::acos(-1.0L) / 2;
    return static_cast<double>(1 - (is_odd ? (angle + sine * sum) / half_pi : sine * sum));
}

} // namespace

TEST_CASE("Student's distribution's tails") {
    using mis::verify::detail::normal_tails;
    using mis::verify::detail::student_tails;
    const double known[][3] = {{1, 12.706204736432095, 0.05},
                               {4, 8.610301581379272, 1e-3},
                               {10, 2.2281388519649385, 0.05},
                               {2, 999.9992499997811, 1e-6}};
    for (const auto& [degrees, t, tails] : known)
        CHECK(student_tails(t, degrees) == doctest::Approx(tails).epsilon(1e-9));
    worst_case worst;
    generator g(132);
    for (int sample = 0; sample < 5'000; ++sample) {
        const int degrees = g.integer(1, 400);
        const double t = g.log_uniform<double>(-3, 1), tails = student_tails_as_a_sum(t, degrees);
        if (tails > 1e-8)
            worst.see(std::fabs(student_tails(-t, degrees) / tails - 1), sample);
        worst.see(std::fabs(student_tails(1e6 * t, 1) * std::acos(-1.0) / 2 / std::atan(1e-6 / t) - 1),
                  sample);
    }
    CHECK(worst.error <= 1e-9);
    CHECK(student_tails(0, 3) == 1);
    CHECK(student_tails(infinity, 3) == 0);
    CHECK(student_tails(5, 1e9) == normal_tails(5));
    CHECK(student_tails(5, 1e7) == doctest::Approx(normal_tails(5)).epsilon(1e-4));
}

// The chance that a noncentral chi-squared variable is above the least that a test rejects: a mixture of
// central ones.
TEST_CASE("the noncentrality that nine runs of ten see") {
    using mis::verify::detail::chi_squared_tail;
    for (const double degrees : {1.0, 3.0, 15.0, 63.0, 255.0, 4000.0})
        for (const double false_alarm : {1e-3, 1e-6, 1e-9}) {
            const double least = mis::verify::detail::where_falls_to(
                false_alarm, [&](double x) { return chi_squared_tail(x, degrees); });
            CHECK(chi_squared_tail(least, degrees) == doctest::Approx(false_alarm).epsilon(1e-6));
            const double mean = mis::verify::detail::visible_noncentrality(degrees, false_alarm) / 2;
            double power = 0;
            for (int k = 0; k < 2'000; ++k)
                power += std::exp(k * std::log(mean) - mean - std::lgamma(k + 1.0)) *
                         chi_squared_tail(least, degrees + 2 * k);
            CAPTURE(degrees);
            CAPTURE(false_alarm);
            CHECK(power == doctest::Approx(0.9).epsilon(0.01));
        }
}

namespace {

using mis::verify::point;
using mis::verify::sampler_options;
using point_sampler = std::optional<point>;
constexpr double pi = 3.14159265358979323846;

// Density 2 x on the square; `lose` of the samples are lost.
struct linear_sampler {
    generator g;
    double lose = 0;

    point_sampler operator()() {
        if (g.chance(lose))
            return std::nullopt;
        return point{std::sqrt(1 - g.uniform()), g.uniform()};
    }
};
double linear_density(point p) { return 2 * p.x; }

// Around the z axis, density (e + 1) / (2 pi) cos^e.
template <class Vec> struct lobe_sampler {
    generator g;
    double exponent = 1;

    std::optional<Vec> operator()() {
        using T = std::decay_t<decltype(std::declval<const Vec&>()[0])>;
        const double z = std::pow(1 - g.uniform(), 1 / (exponent + 1)), phi = 2 * pi * g.uniform();
        const double r = std::sqrt(1 - z * z);
        return Vec{static_cast<T>(r * std::cos(phi)), static_cast<T>(r * std::sin(phi)), static_cast<T>(z)};
    }
};
template <class Vec> auto lobe_density(double exponent, double scale = 1) {
    return [=](const Vec& w) {
        const double z = static_cast<double>(w[2]);
        return z > 0 ? scale * (exponent + 1) / (2 * pi) * std::pow(z, exponent) : 0;
    };
}

} // namespace

// The default false alarm: one right sampler in a million fails, at fixed seeds none.
TEST_CASE("right samplers pass") {
    const auto passes = [](const result& r) { CHECK_MESSAGE(r.passed, r.message); };
    sampler_options whole_square, hemisphere;
    whole_square.samples = hemisphere.samples = 1'700'000;
    whole_square.support = 1;
    hemisphere.support = 2 * pi;
    passes(mis::verify::square_sampler(linear_sampler{generator(141)}, linear_density, whole_square));
    passes(mis::verify::square_sampler(
        linear_sampler{generator(142), 0.3}, [](point p) { return 0.7 * linear_density(p); }, whole_square));
    passes(mis::verify::direction_sampler(lobe_sampler<vec3>{generator(143), 0}, lobe_density<vec3>(0),
                                          hemisphere));
    passes(mis::verify::direction_sampler(lobe_sampler<vec3>{generator(144), 1}, lobe_density<vec3>(1),
                                          hemisphere));
    using floats = std::array<float, 3>;
    passes(mis::verify::direction_sampler(lobe_sampler<floats>{generator(145), 50}, lobe_density<floats>(50),
                                          hemisphere));
    passes(mis::verify::direction_sampler(
        lobe_sampler<vec3>{generator(146), 1000},
        lobe_density<vec3>(1000))); // positive in double on a part of the hemisphere only
    // a peak that the integration misses with the default
    sampler_options peak;
    peak.samples = 1'200'000;
    peak.refinement = 6;
    passes(mis::verify::direction_sampler(lobe_sampler<vec3>{generator(148), 10'000},
                                          lobe_density<vec3>(10'000), peak));

    // the hemisphere about a slanted normal: the density jumps inside bins
    const vec3 normal{0.6, 0.48, 0.64};
    generator g(147);
    const auto slanted = [&]() -> std::optional<vec3> {
        const double z = g.uniform(-1, 1), phi = 2 * pi * g.uniform(), r = std::sqrt(1 - z * z);
        const vec3 w{r * std::cos(phi), r * std::sin(phi), z};
        return dot(w, normal) > 0 ? w : w * -1;
    };
    const auto density = [&](const vec3& w) { return dot(w, normal) > 0 ? 1 / (2 * pi) : 0; };
    passes(mis::verify::direction_sampler(slanted, density, hemisphere));
}

TEST_CASE("wrong samplers fail and the place is named") {
    sampler_options hemisphere, square;
    hemisphere.samples = square.samples = 200'000;
    hemisphere.visible_error = square.visible_error = 0.03;
    hemisphere.support = 2 * pi;
    const auto lobe = [&](double sampled, auto density) {
        return mis::verify::direction_sampler(lobe_sampler<vec3>{generator(151), sampled}, density,
                                              hemisphere);
    };
    // uniform in place of cosine; a slightly wrong exponent; the normalization of another lobe
    CHECK(says(lobe(0, lobe_density<vec3>(1)), "the sampler does not have this density"));
    CHECK_FALSE(lobe(1, lobe_density<vec3>(1.1)));
    CHECK(says(lobe(1000, lobe_density<vec3>(1100)), "the sampler does not have this density"));
    CHECK(says(lobe(1, lobe_density<vec3>(1, 2)), "the density integrates to 2, more than 1"));
    CHECK(says(lobe(1, lobe_density<vec3>(1, 0.5)), "worst: samples lost, 0 samples, expected 100000"));
    // 1 / pi without the cosine: the worst bins are at the horizon or the pole
    CHECK(says(lobe(1, [](const vec3& w) { return w.z > 0 ? 0.5 / pi : 0; }), "worst: u in ["));

    // too many samples in one bin of the square, with the bin's place
    generator g(152);
    const auto one_bin_too_often = [&]() -> point_sampler {
        if (g.chance(0.01))
            return point{0.8, 0.3};
        return point{g.uniform(), g.uniform()};
    };
    const auto uniform = [](point) { return 1.0; };
    CHECK(says(mis::verify::square_sampler(one_bin_too_often, uniform, square),
               "worst: u in [0.75, 0.875), v in [0.25, 0.375)"));
    // samples lost that should not be, and the other way round
    CHECK(says(mis::verify::square_sampler(linear_sampler{generator(153), 0.01}, linear_density, square),
               "are lost, though the density integrates to 1"));
    CHECK(says(
        mis::verify::square_sampler(
            linear_sampler{generator(154), 0.01}, [](point p) { return 0.8 * linear_density(p); }, square),
        "worst: samples lost"));
    // a support of other measure
    hemisphere.support = 4 * pi;
    CHECK(says(lobe(0, lobe_density<vec3>(0)), "the mean of 1/p is 6.28"));
    CHECK(says(lobe(0, lobe_density<vec3>(0)), "the support measures 12.5664 sr"));
    // what no density or sample may be
    const auto not_a_density = [](point p) { return p.x > 0.9 ? not_a_number : 1.0; };
    CHECK(says(mis::verify::square_sampler(linear_sampler{generator(155)}, not_a_density, square),
               "the density is NaN at"));
    const auto negative = [](point p) { return p.x > 0.9 ? -1.0 : 1.0; };
    CHECK(says(mis::verify::square_sampler(linear_sampler{generator(155)}, negative, square),
               "the density is -1 at"));
    CHECK(says(mis::verify::square_sampler(
                   []() -> point_sampler {
                       return point{1.5, 0};
                   },
                   uniform),
               "outside"));
    CHECK(says(mis::verify::direction_sampler(
                   [] {
                       return std::optional<vec3>(vec3{2, 0, 0});
                   },
                   [](const vec3&) { return 0.25 / pi; }),
               "not of length 1"));
    const auto left_half = [](point p) { return p.x < 0.5 ? 2.0 : 0.0; };
    CHECK(says(mis::verify::square_sampler(linear_sampler{generator(156)}, left_half, square),
               "where the density is 0"));
    // under the surface
    const auto below = [&]() -> std::optional<vec3> {
        const double z = g.uniform(-1, 1), phi = 2 * pi * g.uniform(), r = std::sqrt(1 - z * z);
        return vec3{r * std::cos(phi), r * std::sin(phi), z};
    };
    CHECK(says(mis::verify::direction_sampler(below, lobe_density<vec3>(0), hemisphere),
               "% of the samples are where the density is 0"));
    // right, but for a peak that the integration cannot find
    hemisphere.support = 0;
    CHECK(says(lobe(1e6, lobe_density<vec3>(1e6)), "raise refinement, a peak has been missed"));
}

TEST_CASE("samplers: too little data is neither right nor wrong") {
    const auto uniform = [](point) { return 1.0; };
    generator g(158);
    const auto check = [&](const sampler_options& o) {
        return mis::verify::square_sampler(
            [&]() -> point_sampler {
                return point{g.uniform(), g.uniform()};
            },
            uniform, o);
    };
    sampler_options o;
    for (const int samples : {-1, 0, 1, 10, 639}) {
        o.samples = samples;
        CHECK(is_undecided(check(o), "samples are too few for 8 x 8 bins, which need 640 and more"));
    }
    o.samples = 100'000;
    CHECK(is_undecided(check(o), "could be missed. To see 1%, take 1"));
    CHECK(says(check(o), "samples, or fewer bins"));
    o.visible_error = 0.04;
    CHECK(check(o));
    CHECK(says(check(o), "an error of 3.15"));
    for (const int bins : {101, 1'000, 50'000, INT_MAX}) {
        o.bins = bins;
        CHECK(is_undecided(check(o), "samples are too few for"));
    }
    o.bins = 100; // 10 samples in each, of which some are pooled for rounding
    CHECK(is_undecided(check(o), ""));
    o.bins = 1;
    CHECK(is_undecided(check(o), "one bin, nothing is compared"));
    for (const int bins : {0, -1, INT_MIN}) {
        o.bins = bins;
        CHECK(is_undecided(check(o), "no bins"));
    }
    o.bins = 8;
    for (const double false_alarm : {0.0, 1e-300, -1.0, 1.0, not_a_number, infinity}) {
        o.false_alarm = false_alarm;
        CHECK(is_undecided(check(o), "false_alarm is "));
    }
    o.false_alarm = 1e-6;
    for (const double support : {-1.0, not_a_number, infinity}) {
        o.support = support;
        CHECK(is_undecided(check(o), "support is "));
    }
    o.support = 0;
    for (const double visible : {0.0, -1.0, not_a_number, infinity}) {
        o.visible_error = visible;
        CHECK(is_undecided(check(o), "visible_error is "));
    }
    o.visible_error = 0.04;
    for (const int refinement : {-1, 11, INT_MAX}) {
        o.refinement = refinement;
        CHECK(is_undecided(check(o), "refinement is "));
    }
    o.refinement = 2;
    CHECK(check(o));
    // nothing is sampled, and rightly so
    const auto nothing = []() -> point_sampler { return std::nullopt; };
    CHECK(is_undecided(mis::verify::square_sampler(
                           nothing, [](point) { return 0.0; }, o),
                       "nothing is compared"));
    CHECK(says(mis::verify::square_sampler(nothing, uniform, o), "100% of the samples are lost"));
    // few samples that are wrong are wrong
    o.samples = 1'000;
    CHECK(says(mis::verify::square_sampler(linear_sampler{generator(159)}, uniform, o),
               "does not have this density"));
}

TEST_CASE("bins of small expectation are pooled") {
    using mis::verify::detail::pooled;
    const auto pool = pooled({{100, 90, "a"}, {3, 4, "b"}, {8, 9, "c"}}, 10);
    REQUIRE(pool.size() == 2);
    CHECK(pool[1].expected == 11);
    CHECK(pool[1].observed == 13);
    const auto joined = pooled({{50, 40, "a"}, {100, 90, "b"}, {3, 4, "c"}}, 10); // too small for a bin
    REQUIRE(joined.size() == 2);
    CHECK(joined[1].expected == 103);
    CHECK(joined[1].observed == 94);
}

namespace {

// How many of 2,000 right samplers fail, absorption included.
int failing_samplers(const sampler_options& o) {
    const auto density = [](point p) { return 0.8 * linear_density(p); };
    int failures = 0;
    for (std::uint64_t seed = 0; seed < 2'000; ++seed)
        failures +=
            !mis::verify::square_sampler(linear_sampler{generator(1000 + seed), 0.2}, density, o).passed;
    return failures;
}

} // namespace

// Bounds that a right rate of failures leaves once in a million: 20 +- 25 at 1e-2. At 0.2, 400 +- 88 for the
// chi-squared test alone, which shows a few degrees of freedom too many. With the support, whose bound is
// never met by chance, half as many.
TEST_CASE("right samplers fail as often as they are meant to") {
    sampler_options o;
    o.samples = 3'000;
    o.bins = 6;
    o.false_alarm = 1e-2;
    o.visible_error = 0.5;
    const int rare = failing_samplers(o);
    CHECK(rare >= 3);
    CHECK(rare <= 45);
    o.support = 1;
    CHECK(failing_samplers(o) <= 30);
    o.false_alarm = 0.2;
    o.support = 0;
    const int often = failing_samplers(o);
    CHECK(often >= 312);
    CHECK(often <= 488);
    std::printf("right samplers failing at 1e-2, at 0.2: %d, %d of 2000\n", rare, often);
}

// Uniform, but for the sampler's error: the left half of the bins has so much too many samples, the right
// half too few. Of 400 samplers with the error that is called visible, 360 should be seen: bounds once in a
// million, and 1% for the noncentral distribution's approximation. Hardly any with a third of it, all with
// twice.
TEST_CASE("samplers: errors are seen as often as is said") {
    sampler_options o;
    o.samples = 20'000;
    o.visible_error = 1;
    const double visible =
        std::sqrt(mis::verify::detail::visible_noncentrality(63, o.false_alarm / 2) / o.samples);
    const auto seen = [&](double error, std::uint64_t seed, int runs) {
        int count = 0;
        for (int run = 0; run < runs; ++run) {
            generator g(seed + static_cast<std::uint64_t>(run));
            const auto sample = [&]() -> point_sampler {
                const bool left = g.chance((1 + error) / 2);
                return point{(left ? 0 : 0.5) + 0.5 * g.uniform(), g.uniform()};
            };
            const result r = mis::verify::square_sampler(
                sample, [](point) { return 1.0; }, o);
            CHECK_FALSE(r.undecided);
            count += !r;
        }
        return count;
    };
    const int at_visible = seen(visible, 3000, 400);
    CHECK(at_visible >= 325);
    CHECK(at_visible <= 388);
    CHECK(seen(visible / 3, 4000, 100) <= 2);
    CHECK(seen(2 * visible, 5000, 100) == 100);
    std::printf("samplers with an error of %.2g%% failing: %d of 400\n", 100 * visible, at_visible);
}

// With the default options, a slope of 1% from the middle to the edge is seen in 98 of 100 runs: less than 3
// times in 6 with probability 1e-6.
TEST_CASE("samplers: an error of 1% is seen") {
    int seen = 0;
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
        generator g(6000 + seed);
        const auto sloping = [&]() -> point_sampler {
            const double x = g.uniform();
            return point{g.chance(0.01) ? std::sqrt(x) : x, g.uniform()};
        };
        seen += !mis::verify::square_sampler(sloping, [](point) { return 1.0; });
    }
    CHECK(seen >= 3);
    std::printf("slopes of 1%% seen: %d of 6\n", seen);
}

namespace {

mis::verify::running_mean mean_of(generator& g, double value, double noise, int count) {
    mis::verify::running_mean m;
    for (int k = 0; k < count; ++k)
        mis::verify::add(m, value + noise * g.uniform(-1, 1));
    return m;
}

} // namespace

TEST_CASE("running means") {
    mis::verify::running_mean a, b, all;
    const double samples[] = {1, 4, 2, 8, 5, 7};
    for (int k = 0; k < 6; ++k) {
        mis::verify::add(k < 2 ? a : b, samples[k]);
        mis::verify::add(all, samples[k]);
    }
    a += b;
    for (const auto& m : {a, all}) {
        CHECK(m.count == 6);
        CHECK(mis::verify::mean(m) == doctest::Approx(4.5));
        CHECK(mis::verify::variance_of_mean(m) == doctest::Approx(37.5 / 5 / 6));
    }
    CHECK(mis::verify::mean({}) == 0);
    CHECK(mis::verify::variance_of_mean({1, 2, 4}) == 0);
}

// False alarm of the right tables: 1e-6 each, at a fixed seed none.
TEST_CASE("estimates of subsets") {
    generator g(161);
    std::vector<mis::verify::named_estimate> table;
    for (int length = 2; length <= 5; ++length)
        for (const char* subset : {"path tracing", "light tracing", "bidirectional"})
            table.push_back({subset, length, mean_of(g, 1.0 / length, 0.1 * length, 40'000)});
    CHECK(mis::verify::estimates_agree(table));
    CHECK(says(mis::verify::estimates_agree(table), "12 pairs of estimates agree"));

    auto wrong = table;
    wrong[4].value = mean_of(g, 0.36, 0.1, 10'000); // light tracing, path length 3
    const result r = mis::verify::estimates_agree(wrong);
    CHECK_FALSE(r);
    CHECK(says(r, "2 of 12 pairs"));
    CHECK(says(r, "path length 3: path tracing 0.33"));
    CHECK(says(r, "light tracing 0.3"));
    CHECK(says(r, ", t = "));
    CHECK(r.message.find("path length 2") == std::string::npos);

    // subsets that never hit, or always the same
    wrong = table;
    wrong[0].value = wrong[1].value = wrong[2].value = {100, 0, 0};
    CHECK(mis::verify::estimates_agree(wrong));
    CHECK(says(mis::verify::estimates_agree(wrong), "agree, in 3 of them neither has ever hit"));
    const std::vector<mis::verify::named_estimate> dark(wrong.begin(), wrong.begin() + 3);
    CHECK(is_undecided(mis::verify::estimates_agree(dark), "no estimate has ever hit"));
    wrong[0].value = mean_of(g, 0.5, 0.1, 10'000);
    CHECK(says(mis::verify::estimates_agree(wrong), "light tracing 0 +- 0 (never hit)"));
    const std::vector<mis::verify::named_estimate> constant{{"a", 2, {2, 2, 2}}, {"b", 2, {2, 2, 2}}};
    CHECK(mis::verify::estimates_agree(constant));
    const std::vector<mis::verify::named_estimate> unequal{{"a", 2, {2, 2, 2}}, {"b", 2, {2, 4, 8}}};
    CHECK(says(mis::verify::estimates_agree(unequal), "a 1 +- 0 (all samples the same), b 2 +- 0"));

    CHECK(is_undecided(mis::verify::estimates_agree({{"a", 2, {1, 1, 1}}, {"b", 2, {2, 4, 8}}}),
                       "a, path length 2: fewer than two samples"));
    CHECK(is_undecided(mis::verify::estimates_agree({{"a", 2, {}}, {"b", 2, {}}}), "fewer than two samples"));
    const result bad = mis::verify::estimates_agree({{"a", 2, {2, not_a_number, 1}}, {"b", 2, {1, 4, 8}}});
    CHECK(says(bad, "a, path length 2: a sample is NaN"));
    CHECK_FALSE(bad.undecided);
    CHECK(is_undecided(mis::verify::estimates_agree({{"a", 2, {2, 1, 1}}, {"b", 3, {2, 4, 8}}}), "no two"));
    CHECK(is_undecided(mis::verify::estimates_agree({}), "no two"));
    for (const double false_alarm : {0.0, 1e-300, 1.0, not_a_number})
        CHECK(is_undecided(mis::verify::estimates_agree(table, false_alarm), "false_alarm is "));

    // means of 2 and of 300, of two samples each: whatever they are, such a table tells nothing
    const result few = mis::verify::estimates_agree({{"a", 2, {2, 4, 10}}, {"b", 2, {2, 600, 200'000}}});
    CHECK(is_undecided(few, "path length 2: a and b, means of 2 and 300, could differ by "));
    CHECK(is_undecided(mis::verify::estimates_agree(table, 1e-6, 1e-6, 1e-3), "0.1% might not be seen"));
}

// 2,000 right tables of 3 pairs at a false alarm of 1e-2: Bonferroni is conservative, so at most 20 are
// expected to fail; beyond 45 once in a million. Below 2 likewise, as dependent pairs cost less than half.
TEST_CASE("right tables of estimates fail as often as they are meant to") {
    int failures = 0;
    generator g(162);
    for (int sample = 0; sample < 2'000; ++sample) {
        std::vector<mis::verify::named_estimate> table;
        for (const char* subset : {"a", "b", "c"})
            table.push_back({subset, 2, mean_of(g, 1, 1, 200)});
        const result r = mis::verify::estimates_agree(table, 1e-2, 1e-6, 1);
        CHECK_FALSE(r.undecided);
        failures += !r.passed;
    }
    CHECK(failures >= 2);
    CHECK(failures <= 45);
    std::printf("right tables failing at 1e-2: %d of 2000\n", failures);
}

namespace {

// How many of 5,000 right pairs disagree: normal samples, the second's with this standard deviation.
int disagreeing_pairs(int samples, int others, double deviation, double false_alarm) {
    generator g(163);
    const auto normal = [&] {
        return std::sqrt(-2 * std::log(1 - g.uniform())) * std::cos(2 * pi * g.uniform());
    };
    int failures = 0;
    for (int pair = 0; pair < 5'000; ++pair) {
        mis::verify::running_mean a, b;
        for (int k = 0; k < samples; ++k)
            mis::verify::add(a, 1 + normal());
        for (int k = 0; k < others; ++k)
            mis::verify::add(b, 1 + deviation * normal());
        const result r = mis::verify::estimates_agree({{"a", 2, a}, {"b", 2, b}}, false_alarm, 0, 1e9);
        failures += !r.passed && !r.undecided;
    }
    return failures;
}

} // namespace

// Against an exact mean, the rate is that which is stated, 50 +- 35 once in a million; against another
// estimate of normal samples at most that.
TEST_CASE("few samples disagree no more often than is stated") {
    for (const int samples : {2, 3, 5, 20}) {
        CAPTURE(samples);
        const int against_exact = disagreeing_pairs(samples, 2, 0, 1e-2);
        CHECK(against_exact >= 18);
        CHECK(against_exact <= 88);
        for (const auto& [others, deviation] :
             {std::pair{2, 1.0}, {2, 0.1}, {2, 10.0}, {20, 1.0}, {3, 3.0}}) {
            CHECK(disagreeing_pairs(samples, others, deviation, 1e-2) <= 88);
            CHECK(disagreeing_pairs(samples, others, deviation, 1e-6) <= 1);
        }
        std::printf("pairs of %d samples and an exact mean failing at 1e-2: %d of 5000\n", samples,
                    against_exact);
    }
}

namespace {

template <class Vertex, class Weight>
void see_all_invariances(first_failure& failure, const technique_counts<double>& counts,
                         const std::vector<Vertex>& path, Weight weight_of, double k) {
    const int n = static_cast<int>(path.size());
    failure.see(mis::verify::scale_invariance(weight_of, counts, path.data(), n, k));
    failure.see(mis::verify::swap_invariance(weight_of, counts, path.data(), n));
    failure.see(mis::verify::count_invariance(weight_of, counts, path.data(), n, k));
}

} // namespace

TEST_CASE("the library's weights are invariant, for every kind of vertex record") {
    generator g(171);
    first_failure failure;
    for (int sample = 0; sample < 2'000; ++sample) {
        auto path = make_path<double>(g, g.integer(2, 9), ordinary);
        if (g.chance(0.3)) {
            path.counts.max_camera_vertices = g.integer(1, 9);
            path.counts.max_light_vertices = g.integer(1, 9);
        }
        const double k = g.log_uniform<double>(-1, 1);
        see_all_invariances(failure, path.counts, path.vertices, power_weight, k);
        see_all_invariances(failure, path.counts, path.vertices, balance_weight, k);
        see_all_invariances(failure, path.counts, in_areas(path), balance_weight, k);
        see_all_invariances(failure, path.counts, in_positions(g, path), power_weight, k);
    }
    CHECK_PASSED(failure);
}

TEST_CASE("scaled and swapped agree with measuring, and twice swapped is the path") {
    generator g(172);
    worst_case worst;
    for (int sample = 0; sample < 2'000; ++sample) {
        const auto path = make_path<double>(g, g.integer(2, 9), ordinary);
        const int n = path.size();
        const auto positions = in_positions(g, path);
        random_path<double> measured{{}, path.counts};
        for (int i = 0; i < n; ++i)
            measured.vertices.push_back(mis::measure(positions.data(), n, i));
        const auto see = [&](const auto& a, const auto& b) { // weighed_path of different records
            for (int i = 0; i < n; ++i) {
                const auto x = mis::area_densities(a.vertices.data(), n, i);
                const auto y = mis::area_densities(b.vertices.data(), n, i);
                worst.see(ulp_distance(x.density_from_camera, y.density_from_camera), sample);
                worst.see(ulp_distance(x.density_from_light, y.density_from_light), sample);
                worst.see(ulp_distance(x.next_event, y.next_event), sample);
                worst.see(ulp_distance(x.merge_factor, y.merge_factor), sample);
                CHECK(a.vertices[static_cast<std::size_t>(i)].kind ==
                      b.vertices[static_cast<std::size_t>(i)].kind);
            }
        };
        const auto areas = in_areas(measured);
        const auto& counts = path.counts;
        const auto bigger = mis::verify::scaled(counts, measured.data(), n, 4.0);
        see(bigger, mis::verify::scaled(counts, positions.data(), n, 4.0));
        see(bigger, mis::verify::scaled(counts, areas.data(), n, 4.0));
        const auto other_way = mis::verify::swapped(counts, measured.data(), n);
        see(other_way, mis::verify::swapped(counts, positions.data(), n));
        see(other_way, mis::verify::swapped(counts, areas.data(), n));
        see(mis::verify::swapped(other_way.counts, other_way.vertices.data(), n), measured);
    }
    CHECK(worst.error <= 32);

    // by hand: k = 2, a finite lens, a surface, a medium, an area light
    auto path = plain_path(g, 4);
    path.vertices[1].kind = vertex_kind::surface;
    path.vertices[2].kind = vertex_kind::medium;
    const auto before = path.vertices;
    auto after = mis::verify::scaled(path.counts, path.data(), 4, 2.0);
    CHECK(after.vertices[0].pdf_position == before[0].pdf_position / 4);
    CHECK(after.vertices[3].pdf_next_event == before[3].pdf_next_event / 4);
    CHECK(after.vertices[1].distance2_to_light == before[1].distance2_to_light * 4);
    CHECK(after.vertices[1].pdf_to_light == before[1].pdf_to_light);
    CHECK(after.vertices[2].pdf_distance_from_light == before[2].pdf_distance_from_light / 2);
    CHECK(after.counts.merge == path.counts.merge * 4);
    CHECK(after.counts.connection == path.counts.connection);
    path.vertices[0].dirac = true;
    path.vertices[3].kind = vertex_kind::infinite_light;
    after = mis::verify::scaled(path.counts, path.data(), 4, 2.0);
    CHECK(after.vertices[0].pdf_position == before[0].pdf_position);
    CHECK(after.vertices[3].pdf_position == before[3].pdf_position);
    CHECK(after.vertices[3].pdf_to_camera == before[3].pdf_to_camera / 4);
    CHECK(after.vertices[2].distance2_to_light == before[2].distance2_to_light);
    const auto turned = mis::verify::swapped(path.counts, path.data(), 4); // the infinite light first
    after = mis::verify::scaled(turned.counts, turned.vertices.data(), 4, 2.0);
    CHECK(after.vertices[0].distance2_to_light == turned.vertices[0].distance2_to_light);
    CHECK(after.vertices[1].distance2_to_light == turned.vertices[1].distance2_to_light * 4);
    CHECK(mis::verify::swapped(technique{technique_kind::merge, 2}, 5) ==
          technique{technique_kind::merge, 4});
    CHECK(mis::verify::swapped(technique{technique_kind::next_event, 4}, 5).kind ==
          technique_kind::camera_connection);
}

TEST_CASE("weights that are not invariant: the technique and the power are named") {
    generator g(173);
    using counts_type = technique_counts<double>;
    using vertex = mis::measured_vertex<double>;
    // A path on which all techniques have much the same density, so that each matters.
    auto path = plain_path(g, 5);
    for (auto& x : path.vertices) {
        if (x.kind == vertex_kind::medium)
            x.kind = vertex_kind::surface;
        x.pdf_to_light = x.pdf_to_camera = 1.1;
        x.pdf_position = x.pdf_next_event = 0.9;
        x.cos_to_camera = 0.8;
        x.cos_to_light = 0.7;
        x.distance2_to_light = 1.2;
        x.pdf_distance_from_camera = x.pdf_distance_from_light = 1;
    }
    path.counts = mis::connection_and_merging(1.0, 0.5);
    const auto with_fixed_radius = [&](counts_type counts, const vertex* x, int n, technique t) {
        counts.merge = path.counts.merge;
        return mis::weight(mis::balance, counts, x, n, t);
    };
    result r = mis::verify::scale_invariance(with_fixed_radius, path.counts, path.data(), 5);
    CHECK_FALSE(r);
    for (int j = 1; j <= 3; ++j)
        CHECK(says(r, name(technique_kind::merge, j + 1) + ": "));
    CHECK(says(r, "relative to the rest times 0.111111 = 3^-2"));
    CHECK(r.message.find("connection") == std::string::npos);

    // next event in the wrong unit: its density does not change with the light's area
    const auto without_area = [](const counts_type& counts, const vertex* x, int n, technique t) {
        std::vector<vertex> copy(x, x + n);
        copy.back().pdf_next_event = 1;
        return mis::weight(mis::balance, counts, copy.data(), n, t);
    };
    r = mis::verify::scale_invariance(without_area, path.counts, path.data(), 5);
    CHECK_FALSE(r);
    CHECK(says(r, "a scene 3 times as large changes weights:\n  next event (s = 4): "));
    CHECK(says(r, "times 9 = 3^2"));
    CHECK(std::count(r.message.begin(), r.message.end(), '\n') == 1);

    // the camera walk's cosine at x_2 taken on the wrong side: only the image shows it
    const auto wrong_side = [](const counts_type& counts, const vertex* x, int n, technique t) {
        std::vector<vertex> copy(x, x + n);
        copy[1].cos_to_camera = copy[1].cos_to_light;
        return mis::weight(mis::balance, counts, copy.data(), n, t);
    };
    CHECK(mis::verify::scale_invariance(wrong_side, path.counts, path.data(), 5));
    r = mis::verify::swap_invariance(wrong_side, path.counts, path.data(), 5);
    CHECK_FALSE(r);
    CHECK(says(r, "exchanging camera and light changes weights:\n  "));
    const auto light_walks_only = [](const counts_type& counts, const vertex* x, int n, technique t) {
        const double w = mis::weight(mis::balance, counts, x, n, t);
        return t.kind == technique_kind::camera_connection ? 0.5 * w : w;
    };
    r = mis::verify::swap_invariance(light_walks_only, path.counts, path.data(), 5);
    CHECK(says(r, "camera connection (s = 1): "));
    CHECK(says(r, "next event (s = 4): "));
    CHECK(std::count(r.message.begin(), r.message.end(), '\n') == 2);

    // a count that is forgotten
    const auto one_connection = [](counts_type counts, const vertex* x, int n, technique t) {
        counts.connection = 1;
        return mis::weight(mis::balance, counts, x, n, t);
    };
    r = mis::verify::count_invariance(one_connection, path.counts, path.data(), 5);
    CHECK_FALSE(r);
    CHECK(says(r, "all counts times 7"));
    CHECK(says(r, "connection (s = 2): "));
    CHECK(says(r, "connection (s = 3): "));
    CHECK(says(r, "0.142857 = 7^-1"));
    CHECK(r.message.find("merge") == std::string::npos);

    const auto never = [](const counts_type&, const vertex*, int, technique t) {
        return t.kind == technique_kind::merge ? not_a_number : 0.1;
    };
    CHECK(says(mis::verify::count_invariance(never, path.counts, path.data(), 5),
               "the weight of merge at x_1 (s = 2) is NaN"));
}

TEST_CASE("invariances: where nothing is compared, nothing is decided") {
    generator g(174);
    const auto path = plain_path(g, 5);
    const auto none = [](const auto&, const auto*, int, technique) { return 0.0; };
    const auto check_all = [&](const auto& weight_of, const technique_counts<double>& counts, int n,
                               const std::string& why) {
        CHECK(is_undecided(mis::verify::scale_invariance(weight_of, counts, path.data(), n), why));
        CHECK(is_undecided(mis::verify::swap_invariance(weight_of, counts, path.data(), n), why));
        CHECK(is_undecided(mis::verify::count_invariance(weight_of, counts, path.data(), n), why));
    };
    check_all(power_weight, {}, 5, "no technique can make the path");
    for (const int n : {1, 0, -1})
        check_all(power_weight, path.counts, n, "no technique can make the path");
    check_all(none, path.counts, 5, "all weights are 0");
    for (const double k : {1.0, 0.0, -3.0, not_a_number, infinity}) {
        CHECK(is_undecided(mis::verify::scale_invariance(power_weight, path.counts, path.data(), 5, k),
                           "times as large is none to compare with"));
        CHECK(is_undecided(mis::verify::count_invariance(power_weight, path.counts, path.data(), 5, k),
                           "are none to compare with"));
    }
    const auto balance = [](const double* q, int count, int i) {
        return mis::weight(mis::balance, q, count, i);
    };
    const double q[] = {0, 0};
    for (const int count : {0, -1})
        CHECK(is_undecided(mis::verify::splitting_invariance(balance, q, count), "no technique to split"));
    CHECK(is_undecided(mis::verify::splitting_invariance(balance, q, 2), "all weights are 0"));
}

TEST_CASE("splitting a technique") {
    generator g(181);
    const auto balance = [](const double* q, int count, int i) {
        return mis::weight(mis::balance, q, count, i);
    };
    const auto power = [](const double* q, int count, int i) { return mis::weight(mis::power, q, count, i); };
    const auto first_only = [](const double* q, int count, int i) { return q[i] / (q[0] + q[count - 1]); };
    first_failure failure;
    for (int sample = 0; sample < 1'000; ++sample) {
        std::vector<double> q;
        for (int i = g.integer(1, 8); i > 0; --i)
            q.push_back(g.any_positive<double>());
        failure.see(mis::verify::splitting_invariance(balance, q.data(), static_cast<int>(q.size())));
    }
    CHECK_PASSED(failure);
    const double q[] = {1, 2, 4};
    CHECK_FALSE(mis::verify::splitting_invariance(power, q, 3));
    CHECK(says(mis::verify::splitting_invariance(power, q, 3), "technique 0 split into two halves"));
    CHECK(says(mis::verify::splitting_invariance(power, q, 3), "technique 0: "));
    CHECK_FALSE(mis::verify::splitting_invariance(first_only, q, 3));
}
