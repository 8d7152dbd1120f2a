// SPDX-License-Identifier: MIT
#include "ulp.hpp"

#include <doctest/doctest.h>
#include <mis/techniques.hpp>
#include <set>

using mis::technique_kind;

TEST_CASE("each place holds one technique and each technique has one place") {
    for (int n = 2; n <= 64; ++n) {
        std::set<std::pair<int, int>> seen;
        for (int k = 0; k < mis::technique_count(n); ++k) {
            const mis::technique t = mis::technique_at(n, k);
            CHECK(mis::technique_index(n, t) == k);
            CHECK(seen.insert({static_cast<int>(t.kind), t.camera_vertices}).second);
        }
        // every technique there is, from its definition
        std::set<std::pair<int, int>> expected;
        const auto expect = [&](technique_kind kind, int s) { expected.insert({static_cast<int>(kind), s}); };
        expect(technique_kind::camera_hit, 0);
        expect(technique_kind::light_hit, n);
        expect(n == 2 ? technique_kind::direct : technique_kind::camera_connection, 1);
        if (n > 2)
            expect(technique_kind::next_event, n - 1);
        for (int s = 2; s <= n - 2; ++s)
            expect(technique_kind::connection, s);
        for (int j = 1; j <= n - 2; ++j)
            expect(technique_kind::merge, j + 1);
        CHECK(seen == expected);
    }
    CHECK(mis::technique{technique_kind::merge, 3} != mis::technique{technique_kind::connection, 3});
}

TEST_CASE("counts by kind") {
    mis::technique_counts<double> c;
    c.camera_hit = 1;
    c.camera_connection = 2;
    c.direct = 3;
    c.connection = 4;
    c.next_event = 5;
    c.light_hit = 6;
    c.merge = 7;
    CHECK(mis::count_of(c, technique_kind::camera_hit) == 1);
    CHECK(mis::count_of(c, technique_kind::camera_connection) == 2);
    CHECK(mis::count_of(c, technique_kind::direct) == 3);
    CHECK(mis::count_of(c, technique_kind::connection) == 4);
    CHECK(mis::count_of(c, technique_kind::next_event) == 5);
    CHECK(mis::count_of(c, technique_kind::light_hit) == 6);
    CHECK(mis::count_of(c, technique_kind::merge) == 7);

    c.max_camera_vertices = 3;
    c.max_light_vertices = 2;
    CHECK(mis::count_of(c, 5, {technique_kind::light_hit, 5}) == 0);
    CHECK(mis::count_of(c, 3, {technique_kind::light_hit, 3}) == 6);
    CHECK(mis::count_of(c, 4, {technique_kind::next_event, 3}) == 5);
    CHECK(mis::count_of(c, 5, {technique_kind::connection, 3}) == 4);
    CHECK(mis::count_of(c, 5, {technique_kind::connection, 2}) == 0);
    CHECK(mis::count_of(c, 3, {technique_kind::camera_connection, 1}) == 2);
    CHECK(mis::count_of(c, 4, {technique_kind::camera_connection, 1}) == 0);
    CHECK(mis::count_of(c, 4, {technique_kind::merge, 3}) == 7); // both walks end at x_2: 3 and 2 vertices
    CHECK(mis::count_of(c, 5, {technique_kind::merge, 3}) == 0);
}

TEST_CASE("the named subsets") {
    const auto pt = mis::path_tracing<float>();
    CHECK((pt.light_hit == 1 && pt.next_event == 0 && pt.connection == 0 && pt.camera_connection == 0));
    const auto nee = mis::path_tracing_next_event<float>(4);
    CHECK((nee.light_hit == 1 && nee.next_event == 4 && nee.connection == 0 && nee.merge == 0));
    const auto lt = mis::light_tracing<float>(1000);
    CHECK((lt.camera_connection == 1000 && lt.direct == 1000 && lt.light_hit == 0 && lt.next_event == 0));
    const auto bpt = mis::bidirectional<float>(1000);
    CHECK((bpt.light_hit == 1 && bpt.next_event == 1 && bpt.connection == 1 &&
           bpt.camera_connection == 1000 && bpt.direct == 0 && bpt.camera_hit == 0 && bpt.merge == 0));
    const auto pm = mis::photon_mapping<double>(1000, 0.5);
    CHECK(pm.merge == doctest::Approx(1000 * 3.14159265358979 * 0.25).epsilon(1e-14));
    CHECK((pm.connection == 0 && pm.next_event == 0 && pm.camera_connection == 0));
    const auto vcm = mis::connection_and_merging<double>(1000, 0.5);
    CHECK(vcm.merge == pm.merge);
    CHECK(
        (vcm.light_hit == 1 && vcm.next_event == 1 && vcm.connection == 1 && vcm.camera_connection == 1000));
    CHECK(vcm.max_camera_vertices == INT_MAX);
}

TEST_CASE("merge areas and random connections") {
    mis::technique_counts<double> c;
    c.camera_hit = c.camera_connection = c.direct = c.connection = c.next_event = c.light_hit = c.merge = 8;
    c.max_light_vertices = 5;
    const double area = 3.141592653589793 * 4;
    CHECK(mis::merge_area(2.0) == doctest::Approx(area).epsilon(1e-15));
    const auto times = mis::times_merge_area(c, 2.0);
    CHECK(times.merge == doctest::Approx(8 * area).epsilon(1e-15));
    CHECK((times.connection == 8 && times.light_hit == 8 && times.max_light_vertices == 5));
    const auto divided = mis::divided_by_merge_area(c, 2.0);
    CHECK(divided.merge == 8);
    for (double x : {divided.camera_hit, divided.camera_connection, divided.direct, divided.connection,
                     divided.next_event, divided.light_hit})
        CHECK(x == doctest::Approx(8 / area).epsilon(1e-15));
    CHECK(divided.max_light_vertices == 5);
    const auto random = mis::random_connection(c, 4.0);
    CHECK((random.connection == 2 && random.next_event == 8 && random.merge == 8 &&
           random.max_light_vertices == 5));
}
