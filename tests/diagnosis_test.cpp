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
