// SPDX-License-Identifier: MIT
// The weights of records, and the diagnosis, on random paths. That each mistake is found where a renderer
// really makes it is shown by mistakes_test.cpp.
#include "random_paths.hpp"

#include <cstdio>
#include <doctest/doctest.h>
#include <mis/verify/diagnosis.hpp>

using namespace test;

namespace {

mis::path_record record_of(const random_path<double>& path, mis::technique t) {
    return mis::record_of(path.counts, path.data(), path.size(), t, 0);
}

// P-> and P<- in place of everything else.
mis::path_record area_record_of(const random_path<double>& path, mis::technique t) {
    std::vector<mis::area_vertex<double>> area;
    for (int i = 0; i < path.size(); ++i)
        area.push_back(mis::area_densities(path.data(), path.size(), i));
    return mis::record_of(path.counts, area.data(), path.size(), t, 0);
}

double oracle_weight(const mis::path_record& r, const random_path<double>& path) {
    const auto of = [&](const auto& h) {
        return mis::weight(h, path.counts, path.data(), path.size(), r.technique);
    };
    switch (r.heuristic) {
    case mis::heuristic_kind::average:
        return of(mis::average);
    case mis::heuristic_kind::balance:
        return of(mis::balance);
    case mis::heuristic_kind::power:
        return of(mis::power_heuristic{r.parameter});
    case mis::heuristic_kind::cutoff:
        return of(mis::cutoff_heuristic{r.parameter});
    case mis::heuristic_kind::maximum:
        return of(mis::maximum);
    }
    return -1;
}

constexpr mis::heuristic_kind heuristics[] = {mis::heuristic_kind::average, mis::heuristic_kind::balance,
                                              mis::heuristic_kind::power, mis::heuristic_kind::cutoff,
                                              mis::heuristic_kind::maximum};

} // namespace

TEST_CASE("the weight of a record is that of the complete path, 40,000 random ones of 2 to 64 vertices") {
    generator g(7);
    double worst = 0;
    int undecided = 0, compared = 0;
    for (int k = 0; k < 40'000; ++k) {
        const int n = g.chance(0.7) ? g.integer(2, 8) : g.integer(2, 64);
        auto path = make_path<double>(g, n, g.chance(0.5) ? ordinary : extreme<double>);
        if (g.chance(0.3))
            path.counts.max_camera_vertices = g.integer(1, n),
            path.counts.max_light_vertices = g.integer(1, n);
        auto record = record_of(path, mis::technique_at(n, g.integer(0, mis::technique_count(n) - 1)));
        record.heuristic = heuristics[g.integer(0, 4)];
        record.parameter = record.heuristic == mis::heuristic_kind::cutoff ? 0.1 : 0.5 + g.uniform() * 3;
        const double right = oracle_weight(record, path);
        const auto close = [&](const mis::path_record& r) {
            mis::weight_terms terms;
            mis::terms_of(r, terms);
            const mis::expected_weight expected = mis::weight_of(terms);
            REQUIRE(expected.missing < 0);
            undecided += expected.undecided;
            // mis::weight keeps the smallest positive density positive, which raised to 1/2 is 1e-162.
            if (expected.undecided || (expected.weight < 1e-150 && right < 1e-150))
                return;
            // Logarithms as large as those of 128 extreme densities are known to about 1e-12.
            worst = std::max(worst, std::abs(expected.weight - right) / std::max(right, expected.weight));
            ++compared;
        };
        close(record);
        bool representable = true; // densities per area may overflow where their ratios do not
        auto area = area_record_of(path, record.technique);
        area.heuristic = record.heuristic;
        area.parameter = record.parameter;
        for (const auto& x : area.vertices)
            representable &= mis::is_number(x.density_from_camera) && x.density_from_camera != 0 &&
                             mis::is_number(x.density_from_light) && x.density_from_light != 0;
        if (representable)
            close(area);
    }
    std::printf("weights of records: %d compared, at most %.2g relative apart, %d undecided\n", compared,
                worst, undecided);
    CHECK(compared > 20'000);
    CHECK(worst < 1e-9);
}

// ---- Numbers from which no weight follows ----

namespace {

// Camera, surface, light: a light hit that competes with one next event.
mis::path_record small_record() {
    mis::path_record r;
    r.technique = {mis::technique_kind::light_hit, 3};
    r.counts.light_hit = r.counts.next_event = 1;
    for (const auto kind : {mis::vertex_kind::camera, mis::vertex_kind::surface, mis::vertex_kind::light}) {
        mis::recorded_vertex x;
        x.kind = kind;
        x.density_from_camera = x.density_from_light = 1;
        r.vertices.push_back(x);
    }
    r.weight = 0.5;
    return r;
}

mis::judgement judged(const mis::path_record& record) {
    mis::diagnosis d;
    return mis::judge(d, record);
}

} // namespace

TEST_CASE("a weight that is no number never agrees, whatever it should follow from") {
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
    REQUIRE(judged(small_record()).verdict == mis::verdict::agrees);
    const auto is_bad = [&](const char* field, auto&& change) {
        for (const double weight : {nan, inf, 0.5}) {
            mis::path_record r = small_record();
            r.weight = weight;
            change(r);
            const mis::judgement j = judged(r);
            CAPTURE(std::string(field));
            CHECK(j.verdict == mis::verdict::bad_numbers);
            CHECK(std::string(j.place.field ? j.place.field : "") == field);
        }
    };
    for (const double bad : {nan, inf, -1.0}) {
        is_bad("beta", [&](auto& r) { r.heuristic = mis::heuristic_kind::power, r.parameter = bad; });
        is_bad("alpha", [&](auto& r) { r.heuristic = mis::heuristic_kind::cutoff, r.parameter = bad; });
        is_bad("radius", [&](auto& r) { r.radius = bad; });
        is_bad("counts", [&](auto& r) { r.counts.next_event = bad; });
        is_bad("merge_factor", [&](auto& r) { r.vertices[1].merge_factor = bad; });
        is_bad("selection", [&](auto& r) { r.vertices[2].selection = bad; });
        is_bad("selection_next_event", [&](auto& r) { r.vertices[2].selection_next_event = bad; });
        is_bad("photon.survival", [&](auto& r) { r.vertices[1].photon_survival = bad; });
        is_bad("splits", [&](auto& r) { r.vertices[1].splits = bad; });
        is_bad("splits_to_camera", [&](auto& r) { r.vertices[1].splits_to_camera = bad; });
        is_bad("eta_to_light", [&](auto& r) { r.vertices[1].eta_to_light = bad; });
        is_bad("material", [&](auto& r) { r.vertices[1].material = bad; });
        is_bad("density_from_light", [&](auto& r) { r.vertices[1].density_from_light = bad; });
    }
    is_bad("alpha", [](auto& r) { r.heuristic = mis::heuristic_kind::cutoff, r.parameter = 2; });
    is_bad("vertices", [](auto& r) { r.vertices.clear(); });
    is_bad("vertices", [](auto& r) { r.vertices.resize(1); });
    for (const mis::technique t :
         {mis::technique{mis::technique_kind::light_hit, 2},
          mis::technique{mis::technique_kind::light_hit, -1}, mis::technique{mis::technique_kind::merge, 3},
          mis::technique{mis::technique_kind::merge, 1}, mis::technique{mis::technique_kind::merge, 1000}})
        is_bad("technique", [&](auto& r) { r.technique = t; });
    mis::path_record r = small_record(); // nothing wrong but the weight
    r.weight = nan;
    CHECK(judged(r).verdict == mis::verdict::disagrees);
}

TEST_CASE("densities that are not given are missed on a path of any length, beside any that are 0") {
    for (const int n : {3, 40, 60, 100, 1000}) {
        mis::path_record r = small_record();
        mis::recorded_vertex inner;
        inner.density_from_light = 0;
        r.vertices.insert(r.vertices.begin() + 1, static_cast<std::size_t>(n - 3), inner);
        for (std::size_t i = 1; i < r.vertices.size(); ++i)
            r.vertices[i].density_from_camera = mis::not_given;
        r.technique.camera_vertices = n;
        CAPTURE(n);
        CHECK(judged(r).verdict == mis::verdict::incomplete);
    }
}

// ---- Constants ----

namespace {

// Paths of one renderer: weights that follow from other counts, or another beta, than the records say.
mis::finding with_constants(const mis::technique_counts<double>& given, double given_beta,
                            const mis::technique_counts<double>& used, double used_beta) {
    generator g(11);
    mis::diagnosis d;
    for (int k = 0; k < 1000; ++k) {
        const int n = g.integer(2, 6);
        auto path = make_path<double>(g, n, spread{1.5, 1, 0.1, 0});
        path.counts = used;
        path.vertices.front().dirac = path.vertices.back().dirac = false;
        const auto t = mis::technique_at(n, g.integer(0, mis::technique_count(n) - 1));
        const double weight = mis::weight(mis::power_heuristic{used_beta}, used, path.data(), n, t);
        path.counts = given;
        auto record = record_of(path, t);
        record.weight = weight;
        record.heuristic = given_beta == 1 ? mis::heuristic_kind::balance : mis::heuristic_kind::power;
        record.parameter = given_beta;
        if (mis::count_of(given, t.kind) > 0 && mis::count_of(used, t.kind) > 0)
            mis::judge(d, record);
    }
    CHECK(d.disagreeing > 100);
    return mis::suspects_of(d);
}

double& count_in(mis::technique_counts<double>& counts, mis::technique_kind kind) {
    switch (kind) {
    case mis::technique_kind::camera_hit:
        return counts.camera_hit;
    case mis::technique_kind::camera_connection:
        return counts.camera_connection;
    case mis::technique_kind::direct:
        return counts.direct;
    case mis::technique_kind::connection:
        return counts.connection;
    case mis::technique_kind::next_event:
        return counts.next_event;
    case mis::technique_kind::light_hit:
        return counts.light_hit;
    case mis::technique_kind::merge:
        break;
    }
    return counts.merge;
}

mis::technique_counts<double> some_counts() {
    mis::technique_counts<double> c;
    c.light_hit = 2;
    c.next_event = 3;
    c.connection = 5;
    c.camera_connection = 70;
    c.direct = 60;
    c.camera_hit = 50;
    c.merge = 11;
    return c;
}

} // namespace

TEST_CASE("counts that are off by any factor from 1.1 to 1e6 are found to 1 %") {
    double worst = 0;
    for (int k = 0; k < 7; ++k)
        for (const double factor : {1.1, 1 / 1.1, 1.7, 0.37, 13.0, 1 / 170.0, 1e4, 1e6, 1e-6})
            for (const double beta : {1.0, 2.0}) {
                const auto kind = static_cast<mis::technique_kind>(k);
                auto used = some_counts();
                count_in(used, kind) *= factor;
                const auto f = with_constants(some_counts(), beta, used, beta);
                CAPTURE(std::string(mis::name_of(kind)));
                CAPTURE(factor);
                CAPTURE(beta);
                REQUIRE(f.suspects.size() == 1);
                const mis::suspect& s = f.suspects[0];
                CHECK(s.mistake == &mis::wrong_constant);
                CHECK(!s.constant.is_beta);
                CHECK(s.constant.kind == kind);
                CHECK(s.constant.given == mis::count_of(some_counts(), kind));
                worst = std::max(worst, std::abs(s.constant.fitted / mis::count_of(used, kind) - 1));
            }
    std::printf("counts are fitted to %.1e\n", worst);
    CHECK(worst < 0.01);
}

TEST_CASE("the count of a technique that the records have switched off is found") {
    for (int k = 0; k < 7; ++k) {
        const auto kind = static_cast<mis::technique_kind>(k);
        auto given = some_counts(), used = some_counts();
        count_in(given, kind) = 0;
        count_in(used, kind) = 128.7;
        const auto f = with_constants(given, 2, used, 2);
        CAPTURE(std::string(mis::name_of(kind)));
        REQUIRE(f.suspects.size() == 1);
        CHECK(f.suspects[0].mistake == &mis::wrong_constant);
        CHECK(f.suspects[0].constant.kind == kind);
        CHECK(f.suspects[0].constant.given == 0);
        CHECK(f.suspects[0].constant.fitted == doctest::Approx(128.7).epsilon(1e-3));
        if (kind == mis::technique_kind::merge)
            CHECK(mis::describe(f.suspects[0]) ==
                  "The weights follow if merges, times pi r^2, counted 128.7 instead of 0.");
    }
}

TEST_CASE("a beta from 1/4 to 8 is found") {
    for (const double given : {1.0, 2.0})
        for (const double used : {0.25, 0.37, 0.9, 1.25, 1.9, 2.7, 5.5, 8.0}) {
            const auto f = with_constants(some_counts(), given, some_counts(), used);
            CAPTURE(given);
            CAPTURE(used);
            REQUIRE(f.suspects.size() == 1);
            CHECK(f.suspects[0].mistake == &mis::wrong_constant);
            CHECK(f.suspects[0].constant.is_beta);
            CHECK(f.suspects[0].constant.given == given);
            CHECK(f.suspects[0].constant.fitted == doctest::Approx(used).epsilon(1e-3));
        }
}
