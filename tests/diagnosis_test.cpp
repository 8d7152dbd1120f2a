// SPDX-License-Identifier: MIT
// The weights of records, and the diagnosis, on random paths. That each mistake is found where a renderer
// really makes it is shown by mistakes_test.cpp.
#include "random_paths.hpp"

#include <cstdio>
#include <doctest/doctest.h>
#include <mis/diagnosis.hpp>

using namespace test;

namespace {

mis::path_record record_of(const random_path<double>& path, const mis::technique& t) {
    mis::path_record record;
    record.technique = t;
    record.counts = path.counts;
    for (const auto& m : path.vertices) {
        mis::recorded_vertex x;
        x.kind = m.kind;
        x.dirac = m.dirac;
        x.pdf_to_light = m.pdf_to_light;
        x.pdf_to_camera = m.pdf_to_camera;
        x.pdf_position = m.pdf_position;
        x.pdf_next_event = m.pdf_next_event;
        x.pdf_distance_from_camera = m.pdf_distance_from_camera;
        x.pdf_distance_from_light = m.pdf_distance_from_light;
        x.merge_factor = m.merge_factor;
        x.cos_to_camera = m.cos_to_camera;
        x.cos_to_light = m.cos_to_light;
        x.distance2_to_light = m.distance2_to_light;
        record.vertices.push_back(x);
    }
    return record;
}

// P-> and P<- in place of everything else.
mis::path_record with_area_densities(mis::path_record record, const random_path<double>& path) {
    for (int i = 0; i < path.size(); ++i) {
        const auto area = mis::area_densities(path.data(), path.size(), i);
        mis::recorded_vertex x;
        x.kind = area.kind;
        x.dirac = area.dirac;
        x.merge_factor = area.merge_factor;
        x.density_from_camera = area.density_from_camera;
        x.density_from_light = area.density_from_light;
        if (i == 0 || i == path.size() - 1)
            x.pdf_next_event = area.next_event;
        record.vertices[static_cast<std::size_t>(i)] = x;
    }
    return record;
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
        const auto area = with_area_densities(record, path);
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
