// SPDX-License-Identifier: MIT
// The weights of records, and the diagnosis, on random paths. That each mistake is found where a renderer
// really makes it is shown by mistakes_test.cpp.
#include "random_paths.hpp"

#include <cstdio>
#include <doctest/doctest.h>
#include <functional>
#include <mis/verify/diagnosis.hpp>
#include <numeric>

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
    for (const double bad : {nan, inf, -1.0}) {
        is_bad("families", [&](auto& r) { r.families[2].radius = bad; });
        is_bad("sin_angle", [&](auto& r) { r.vertices[1].sin_angle = bad; });
        is_bad("pass_from_light", [&](auto& r) { r.vertices[1].pass_from_light = bad; });
        is_bad("boundaries", [&](auto& r) { r.boundaries = {{0, bad}}; });
        is_bad("boundaries", [&](auto& r) { r.boundaries = {{0, 1, bad}}; });
        is_bad("boundaries", [&](auto& r) { r.boundaries = {{0, 1, 1, bad, 1}}; });
    }
    is_bad("boundaries", [](auto& r) { r.boundaries = {{2, 1}}; }); // behind the light
    is_bad("boundaries", [](auto& r) { r.boundaries = {{-1, 1}}; });
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

// ---- Media ----

namespace {

// A random path with vertices in media, all families on; merged in a medium where there is one.
mis::path_record media_record(generator& g) {
    for (;;) {
        const int n = g.integer(3, 8);
        auto path = make_path<double>(g, n, spread{1.5, 1, 0.1, 0});
        const int place = g.integer(0, mis::technique_count(n) - 1);
        auto r = record_of(path, mis::technique_at(n, place));
        for (auto& family : r.families)
            family = {g.log_uniform<double>(0, 3), g.log_uniform<double>(-1, 0)};
        r.family = static_cast<mis::merge_family>(g.integer(0, 3));
        r.heuristic = g.chance(0.5) ? mis::heuristic_kind::power : mis::heuristic_kind::balance;
        bool any = false;
        for (auto& x : r.vertices) {
            x.merge_factor = 1;
            if (x.kind != mis::vertex_kind::medium)
                continue;
            any = true;
            x.beam_from_camera = g.log_uniform<double>(-1, 1);
            x.beam_from_light = g.log_uniform<double>(-1, 1);
            x.sin_angle = g.chance(0.1) ? 0 : g.uniform();
            x.pass_from_camera = 0.1 + 0.9 * g.uniform();
            x.pass_from_light = 0.1 + 0.9 * g.uniform();
        }
        if (any)
            return r;
    }
}
bool is_merged_in_medium(const mis::path_record& r) {
    return r.technique.kind == mis::technique_kind::merge &&
           r.vertices[std::size_t(r.technique.camera_vertices - 1)].kind == mis::vertex_kind::medium;
}

double weight_of(const mis::path_record& r) {
    mis::weight_terms terms;
    mis::terms_of(r, terms);
    return mis::weight_of(terms).weight;
}
// The weight that the mistake with this sentence predicts.
double predicted(const char* what, const mis::path_record& r) {
    for (const mis::mistake& m : mis::mistakes)
        if (std::string(m.what) == what) {
            mis::weight_terms terms;
            mis::terms_of(r, terms);
            REQUIRE(m.plant(terms, r) != mis::planted::unknown);
            return mis::weight_of(terms).weight;
        }
    FAIL("no such mistake: ", what);
    return 0;
}

} // namespace

TEST_CASE("mistakes in media predict the weights of records that are changed in the same way") {
    using mis::path_record, mis::recorded_vertex;
    const auto each_in_media = [](path_record& r, auto&& change) {
        for (auto& x : r.vertices)
            if (x.kind == mis::vertex_kind::medium)
                change(x);
    };
    const auto merged = [](path_record& r) -> recorded_vertex* {
        return is_merged_in_medium(r) ? &r.vertices[std::size_t(r.technique.camera_vertices - 1)] : nullptr;
    };
    const auto family = [](path_record& r, mis::merge_family f) -> mis::recorded_family& {
        return r.families[std::size_t(f)];
    };
    using f = mis::merge_family;
    const auto has_camera_beam = [](const path_record& r) {
        return r.family == f::point_beam || r.family == f::beam_beam;
    };
    using change = std::function<void(path_record&)>;
    const std::vector<std::pair<const char*, change>> changes{
        {"Densities of distances in media, and probabilities of passing them, are left out.",
         [](path_record& r) {
             for (auto& x : r.vertices)
                 x.pdf_distance_from_camera = x.pdf_distance_from_light = 1;
         }},
        {"Densities of distances are left out of the reverse densities at vertices in media.",
         [](path_record& r) {
             const bool merges = r.technique.kind == mis::technique_kind::merge;
             for (int i = 0; i < int(r.vertices.size()); ++i) {
                 auto& x = r.vertices[std::size_t(i)];
                 if (x.kind != mis::vertex_kind::medium)
                     continue;
                 if (i >= r.technique.camera_vertices)
                     x.pdf_distance_from_camera = 1;
                 if (i < r.technique.camera_vertices - (merges ? 1 : 0))
                     x.pdf_distance_from_light = 1;
             }
         }},
        {"At a merge in a medium, the density of the light walk's distance is left out.",
         [&](path_record& r) {
             if (auto* x = merged(r))
                 x->pdf_distance_from_light = 1;
         }},
        {"At a merge in a medium, both densities of distances are applied twice.",
         [&](path_record& r) {
             if (auto* x = merged(r)) {
                 x->pdf_distance_from_camera *= x->pdf_distance_from_camera;
                 x->pdf_distance_from_light *= x->pdf_distance_from_light;
             }
         }},
        {"Where a merge is on a camera beam, the camera walk's density has the probability of passing in the "
         "place of the density of the distance.",
         [&](path_record& r) {
             auto* x = merged(r);
             if (x && has_camera_beam(r)) {
                 x->pdf_distance_from_camera *= x->beam_from_camera;
                 x->beam_from_camera = 1;
             }
         }},
        {"Beams count as points: one sample for each density of the distance.",
         [&](path_record& r) {
             each_in_media(r, [](recorded_vertex& x) { x.beam_from_camera = x.beam_from_light = 1; });
         }},
        {"The samples of long beams are 1 over the probability of passing instead of 1 over the density of "
         "the distance.",
         [&](path_record& r) {
             each_in_media(r, [](recorded_vertex& x) {
                 x.beam_from_camera = 1 / x.pass_from_camera;
                 x.beam_from_light = 1 / x.pass_from_light;
             });
         }},
        {"Short light beams count as long ones: the probability of passing is left out.",
         [&](path_record& r) {
             each_in_media(r, [](recorded_vertex& x) { x.beam_from_light /= x.pass_from_light; });
         }},
        {"Long camera beams count as short ones: the probability of passing is applied.",
         [&](path_record& r) {
             each_in_media(r, [](recorded_vertex& x) { x.beam_from_camera *= x.pass_from_camera; });
         }},
        {"The sine of the angle between the beams is left out of beam-beam merges.",
         [&](path_record& r) { each_in_media(r, [](recorded_vertex& x) { x.sin_angle = 1; }); }},
        {"Beam-beam merges are divided by the sine of the angle between the beams.",
         [&](path_record& r) {
             each_in_media(
                 r, [](recorded_vertex& x) { x.sin_angle = x.sin_angle > 0 ? 1 / x.sin_angle : 1e300; });
         }},
        {"Beam-beam merges have the number of light walks that leave points.",
         [&](path_record& r) { family(r, f::beam_beam).count = mis::detail::number_of_points(r); }},
        {"Merges with light points have the number of light walks that leave beams.",
         [&](path_record& r) {
             family(r, f::point_point).count = family(r, f::point_beam).count =
                 std::max(family(r, f::beam_point).count, family(r, f::beam_beam).count);
         }},
        {"Beam-beam merges have the radius of point-beam ones.",
         [&](path_record& r) { family(r, f::beam_beam).radius = family(r, f::point_beam).radius; }},
        {"All families have the radius of beam-beam merges.",
         [&](path_record& r) {
             for (auto& one : r.families)
                 one.radius = family(r, f::beam_beam).radius;
         }},
        {"All families have the kernel of point-beam merges: its dimension and its radius.",
         [&](path_record& r) {
             const double radius = family(r, f::point_beam).radius, area = mis::merge_area(radius);
             family(r, f::point_point).radius = std::cbrt(area / (4.1887902047863910));
             family(r, f::beam_point).radius = radius;
             family(r, f::beam_beam).radius = area / 2;
         }},
        {"The number of photons, or beams, is left out of merges in media.",
         [&](path_record& r) {
             for (auto& one : r.families)
                 one.count = 1;
         }},
        {"The kernel's volume, area or length is left out of merges in media.",
         [&](path_record& r) {
             r.families = {{{family(r, f::point_point).count, std::cbrt(1 / 4.1887902047863910)},
                            {family(r, f::point_beam).count, std::sqrt(1 / mis::merge_area(1.0))},
                            {family(r, f::beam_point).count, std::sqrt(1 / mis::merge_area(1.0))},
                            {family(r, f::beam_beam).count, 0.5}}};
         }},
        {"Point-beam merges are missing in the other techniques' weights.",
         [&](path_record& r) {
             if (!is_merged_in_medium(r) || r.family != f::point_beam)
                 family(r, f::point_beam).count = 0;
         }},
    };
    generator g(13);
    int merges = 0, changed = 0;
    for (int k = 0; k < 3000; ++k) {
        const path_record r = media_record(g);
        merges += is_merged_in_medium(r);
        for (const auto& [sentence, make] : changes) {
            const char* const what = sentence;
            path_record different = r;
            make(different);
            const double weight = weight_of(different);
            CAPTURE(std::string(what));
            CHECK(predicted(what, r) == doctest::Approx(weight).epsilon(1e-9));
            changed += !mis::agree(weight, weight_of(r), 1e-4);
        }
    }
    CHECK(merges > 200);
    CHECK(changed > 10'000);
}

TEST_CASE("boundaries that count as vertices predict the weights of paths with these vertices") {
    generator g(17);
    int compared = 0, at_infinity = 0;
    for (int k = 0; k < 4000; ++k) {
        // The path of the mistaken renderer: its boundaries are surfaces between other vertices.
        const int n = g.integer(2, 5);
        auto path = make_path<double>(g, n, spread{1, 1, 0.1, 0});
        const auto true_technique = mis::technique_at(n, g.integer(0, mis::technique_count(n) - 1));
        const bool merges = true_technique.kind == mis::technique_kind::merge;
        const int joined = merges ? -1 : true_technique.camera_vertices - 1;
        auto r = record_of(path, true_technique);
        random_path<double> longer = path;
        auto t = true_technique;
        for (int i = n - 2; i >= 0; --i) {
            if (g.chance(0.5))
                continue;
            const int count = g.integer(1, 3);
            const auto& x = path.vertices[std::size_t(i)];
            const bool is_infinite = path.vertices[std::size_t(i) + 1].kind == vertex_kind::infinite_light;
            const double whole = is_infinite ? 4 : std::sqrt(x.distance2_to_light);
            std::vector<mis::recorded_boundary> found;
            std::vector<double> pieces; // of the edge, and of the probabilities of passing, from either side
            std::vector<double> to_light, to_camera;
            for (int p = 0; p <= count; ++p) {
                pieces.push_back(0.1 + g.uniform());
                to_light.push_back(0.1 + 0.9 * g.uniform());
                to_camera.push_back(0.1 + 0.9 * g.uniform());
            }
            const double sum = std::accumulate(pieces.begin(), pieces.end(), 0.0);
            double distance = 0, from_camera = 1;
            for (int p = 0; p < count; ++p) {
                distance += pieces[std::size_t(p)] * whole / sum;
                from_camera *= to_light[std::size_t(p)];
                const double from_light =
                    std::accumulate(to_camera.begin() + p + 1, to_camera.end(), 1.0, std::multiplies<>());
                found.push_back({i, distance, 0.1 + 0.9 * g.uniform(), from_camera, from_light});
            }
            r.boundaries.insert(r.boundaries.begin(), found.begin(), found.end());
            if (i == joined)
                continue;
            at_infinity += is_infinite;
            auto& first = longer.vertices[std::size_t(i)];
            auto& second = longer.vertices[std::size_t(i) + 1];
            const double d_light = first.pdf_distance_from_light, d_camera = second.pdf_distance_from_camera;
            first.distance2_to_light = found[0].distance * found[0].distance;
            first.pdf_distance_from_light = d_light / found[0].pass_from_light;
            second.pdf_distance_from_camera = d_camera / found.back().pass_from_camera;
            for (int p = count - 1; p >= 0; --p) {
                const auto& b = found[std::size_t(p)];
                const bool is_last = p + 1 == count;
                mis::measured_vertex<double> between;
                between.pdf_to_light = between.pdf_to_camera = 1;
                between.cos_to_camera = between.cos_to_light = b.cosine;
                const double length = (is_last ? whole : found[std::size_t(p) + 1].distance) - b.distance;
                between.distance2_to_light = is_last && is_infinite ? 1 : length * length;
                between.pdf_distance_from_camera = to_light[std::size_t(p)];
                between.pdf_distance_from_light = to_camera[std::size_t(p) + 1];
                longer.vertices.insert(longer.vertices.begin() + i + 1, between);
            }
            t.camera_vertices += i < true_technique.camera_vertices - 1 ? count : 0;
        }
        REQUIRE(t.kind == mis::technique_at(longer.size(), mis::technique_index(longer.size(), t)).kind);
        const double right = mis::weight(mis::balance, longer.counts, longer.data(), longer.size(), t);
        const double found = predicted(
            "Index-matched boundaries of media count as vertices that can be joined and merged.", r);
        CHECK(found == doctest::Approx(right).epsilon(1e-9));
        compared += right > 0 && right < 1;
    }
    CHECK(compared > 1000);
    CHECK(at_infinity > 100);
}

TEST_CASE("a merge on a beam that is not given is missing what it needs; on one that is off, nothing") {
    generator g(19);
    int missing = 0;
    for (int k = 0; k < 2000; ++k) {
        auto r = media_record(g);
        if (!is_merged_in_medium(r) || weight_of(r) == 0)
            continue;
        const int j = r.technique.camera_vertices - 1;
        r.vertices[std::size_t(j)].beam_from_light = mis::not_given;
        const mis::judgement all = judged(r);
        CHECK(all.verdict == mis::verdict::incomplete);
        for (const auto f : {mis::merge_family::beam_point, mis::merge_family::beam_beam})
            r.families[std::size_t(f)].count = 0;
        r.family = mis::merge_family::point_beam;
        CHECK(judged(r).verdict != mis::verdict::incomplete);
        if (all.place.field && all.place.vertex == j) {
            CHECK(std::string(all.place.field) == "beam_from_light");
            ++missing;
        }
    }
    CHECK(missing > 50);
}

TEST_CASE("the product of a family's density that leaves the range of float is found") {
    mis::path_record r = small_record();
    auto& x = r.vertices[1];
    x.kind = mis::vertex_kind::medium;
    x.beam_from_camera = x.beam_from_light = x.sin_angle = 1;
    r.technique = {mis::technique_kind::merge, 2};
    r.family = mis::merge_family::point_beam;
    r.families[1] = {1e10, 1};
    const auto overflow = [&] {
        mis::weight_terms terms;
        mis::terms_of(r, terms);
        return mis::first_float_overflow(terms);
    };
    CHECK(overflow() == -1);
    x.beam_from_camera = 1e30; // 1e40 from the first vertex on
    CHECK(overflow() == 0);
    x.beam_from_camera = 1;
    x.density_from_camera = 1e20; // and of both walks' densities at the merged vertex
    x.density_from_light = 1e20;
    CHECK(overflow() == 1);
    r.families[1].count = 0; // that nobody else has
    CHECK(overflow() == -1);
}
