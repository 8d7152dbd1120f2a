// SPDX-License-Identifier: MIT
// The lines that the migration guides (docs/migrate*.md, docs/end_points.md) put into renderers, and what
// they say of them. docs_test.cpp compares pages and lines.
#include "../benchmarks/alternatives.hpp"
#include "random_paths.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <doctest/doctest.h>
#include <fstream>
#include <map>
#include <mis/mis.hpp>
#include <mis/packet.hpp>
#include <mis/verify/subpaths.hpp>
#include <sstream>
#include <string>
#include <vector>

using namespace test;
using mis::technique_kind;

namespace {

const float pi = 3.14159265f;

double relative(double a, double b) { return std::fabs(a - b) / std::max(std::fabs(a), std::fabs(b)); }

// The vertices of a walk in its own order: what it scatters with at x_i, and the edge to the vertex after.
struct scattering {
    float cos_in, cos_out, p, q, distance2;
};
scattering along(const std::vector<mis::measured_vertex<float>>& path, int i, bool from_camera) {
    const auto& x = path[static_cast<std::size_t>(i)];
    if (from_camera)
        return {x.cos_to_camera, x.cos_to_light, x.pdf_to_light, x.pdf_to_camera, x.distance2_to_light};
    return {x.cos_to_light, x.cos_to_camera, x.pdf_to_camera, x.pdf_to_light,
            path[static_cast<std::size_t>(i - 1)].distance2_to_light};
}

// A path of surfaces and mirrors, as three numbers per vertex have been published for.
std::vector<mis::measured_vertex<float>> surfaces(generator& g, int n, bool mirrors) {
    auto path = make_path<float>(g, n, spread{1, 1, 0.1, 0}).vertices;
    for (auto& x : path) {
        if (x.kind == vertex_kind::medium || (x.kind == vertex_kind::dirac && !mirrors))
            x.kind = vertex_kind::surface;
        x.pdf_distance_from_camera = x.pdf_distance_from_light = x.merge_factor = 1;
        if (x.kind == vertex_kind::surface && x.cos_to_camera == 1)
            x.cos_to_camera = x.cos_to_light = 0.5f;
        if (x.kind == vertex_kind::dirac) { // reflections
            x.pdf_to_camera = x.pdf_to_light;
            x.cos_to_camera = x.cos_to_light;
        }
    }
    path.front().dirac = true; // a pinhole
    path.front().pdf_position = path.front().pdf_next_event = 1;
    return path;
}

} // namespace

// ---- docs/migrate_three_numbers.md ----

namespace {

const float light_walks = 4096, radius = 0.01f;

// The renderer's lights: emission_pdf is the product of both densities of emission, so it is one field and
// the other is 1.
mis::end_point<float> light_end(float pick, float direct_pdf, float emission_pdf, float cos_light,
                                bool is_delta) {
    return {mis::pdf_position{pick * emission_pdf}, mis::pdf_next_event{pick * direct_pdf},
            mis::pdf_direction{1.f}, mis::cosine{cos_light}, !is_delta};
}

// And its camera: camera_pdf is per pixel, because the image plane lies where a pixel has the area 1.
mis::end_point<float> camera_end(float camera_pdf, float cos_camera) {
    return {mis::pdf_position{1.f}, mis::pdf_next_event{1.f}, mis::pdf_direction{camera_pdf},
            mis::cosine{cos_camera}, false};
}

// The renderer with two numbers.
template <class Weights> struct two_numbers {
    Weights weigh;
    using state_type = mis::subpath_state<float>;

    state_type start_camera(float camera_pdf, float cos_camera) const {
        state_type state;
        // clang-format off
state = weigh.start_camera(camera_end(camera_pdf, cos_camera));
        // clang-format on
        return state;
    }
    state_type start_light(float direct_pdf, float emission_pdf, float cos_light, bool is_delta) const {
        const float pick = 1;
        state_type state;
        // clang-format off
state = weigh.start_light(light_end(pick, direct_pdf, emission_pdf, cos_light, is_delta));
        // clang-format on
        return state;
    }
    state_type arrive(state_type state, float dist, float cos_in, bool from_infinite) const {
        // clang-format off
state = from_infinite ? weigh.arrive_from_infinity(state, mis::cosine{cos_in})
                      : weigh.arrive(state, mis::squared_distance{dist * dist}, mis::cosine{cos_in});
        // clang-format on
        return state;
    }
    state_type sample_scattering(state_type state, bool specular, float cos_in, float cos_out, float p,
                                 float q, float eta_in = 1, float eta_out = 1) const {
        // clang-format off
state = specular ? weigh.scatter_dirac(state, mis::cosine{cos_in}, mis::pdf_forward{p}, mis::pdf_reverse{q},
                                       mis::eta_in{eta_in}, mis::eta_out{eta_out})
                 : weigh.scatter(state, mis::cosine{cos_out}, mis::pdf_forward{p}, mis::pdf_reverse{q});
        // clang-format on
        return state;
    }
    float light_hit(state_type state, float direct_pdf, float emission_pdf, float cos_light) const {
        const float pick = 1;
        // clang-format off
const float weight = weigh.light_hit(state, light_end(pick, direct_pdf, emission_pdf, cos_light, false));
        // clang-format on
        return weight;
    }
    float next_event(state_type camera, float cos_camera, float p, float q, float direct_pdf_w,
                     float emission_pdf, float cos_light, bool is_delta, float dist2) const {
        const float pick = 1;
        // clang-format off
const float direct_pdf = direct_pdf_w * cos_light / dist2; // per area; of what is infinite dist2 and cos_light are 1
const float weight = weigh.next_event({camera, mis::cosine{cos_camera}, mis::pdf_forward{p}, mis::pdf_reverse{q}},
                                      light_end(pick, direct_pdf, emission_pdf, cos_light, is_delta),
                                      mis::squared_distance{dist2});
        // clang-format on
        return weight;
    }
    float connect_vertices(state_type camera, float cos_camera, float camera_p, float camera_q,
                           state_type light, float cos_light, float light_p, float light_q,
                           float dist2) const {
        // clang-format off
const float weight =
    weigh.connection({camera, mis::cosine{cos_camera}, mis::pdf_forward{camera_p}, mis::pdf_reverse{camera_q}},
                     {light, mis::cosine{cos_light}, mis::pdf_forward{light_p}, mis::pdf_reverse{light_q}},
                     mis::squared_distance{dist2});
        // clang-format on
        return weight;
    }
    float connect_to_camera(float camera_pdf, float cos_at_camera, state_type light, float cos_to_camera,
                            float p, float q, float dist2) const {
        // clang-format off
const float weight =
    weigh.camera_connection(camera_end(camera_pdf, cos_at_camera),
                            {light, mis::cosine{cos_to_camera}, mis::pdf_forward{p}, mis::pdf_reverse{q}},
                            mis::squared_distance{dist2});
        // clang-format on
        return weight;
    }
    float merge(state_type camera, state_type light, float camera_p, float camera_q) const {
        // clang-format off
const float weight = weigh.merge(camera, light, mis::pdf_to_light{camera_p}, mis::pdf_to_camera{camera_q});
        // clang-format on
        return weight;
    }
};

// The same renderer before, in double, with the sums of the technical report.
template <int Power> struct three_numbers_before {
    using scheme = alternatives::three_number_weights<Power, double>;
    using state_type = alternatives::three_numbers<double>;
    scheme weigh{scheme::raise(light_walks * mis::merge_area(double(radius))),
                 1 / scheme::raise(light_walks* mis::merge_area(double(radius))), light_walks};

    state_type start_camera(float camera_pdf, float) const {
        return {scheme::raise(double(light_walks) / camera_pdf), 0, 0};
    }
    state_type start_light(float direct_pdf, float emission_pdf, float cos_light, bool is_delta) const {
        const double vc = is_delta ? 0 : scheme::raise(double(cos_light) / emission_pdf);
        return {scheme::raise(double(direct_pdf) / emission_pdf), vc, vc * weigh.inverse_merges};
    }
    state_type arrive(state_type state, float dist, float cos_in, bool from_infinite) const {
        return weigh.arrive(state, from_infinite ? 1 : double(dist) * dist, cos_in);
    }
    state_type sample_scattering(state_type state, bool specular, float, float cos_out, float p,
                                 float q) const {
        return specular ? weigh.scatter_dirac(state, cos_out) : weigh.scatter(state, cos_out, p, q);
    }
    static typename scheme::end_point end(float direct_pdf, float emission_pdf, float cos_light,
                                          bool is_delta) {
        return {emission_pdf, direct_pdf, 1, cos_light, !is_delta};
    }
    double light_hit(state_type state, float direct_pdf, float emission_pdf, float cos_light) const {
        return weigh.light_hit(state, end(direct_pdf, emission_pdf, cos_light, false));
    }
    double next_event(state_type camera, float cos_camera, float p, float q, float direct_pdf_w,
                      float emission_pdf, float cos_light, bool is_delta, float dist2) const {
        return weigh.next_event({camera, cos_camera, p, q},
                                end(direct_pdf_w * cos_light / dist2, emission_pdf, cos_light, is_delta),
                                dist2);
    }
    double connect_vertices(state_type camera, float cos_camera, float camera_p, float camera_q,
                            state_type light, float cos_light, float light_p, float light_q,
                            float dist2) const {
        return weigh.connection({camera, cos_camera, camera_p, camera_q},
                                {light, cos_light, light_p, light_q}, dist2);
    }
    double connect_to_camera(float camera_pdf, float cos_at_camera, state_type light, float cos_to_camera,
                             float p, float q, float dist2) const {
        return weigh.camera_connection({1, 1, camera_pdf, cos_at_camera, false}, {light, cos_to_camera, p, q},
                                       dist2);
    }
    double merge(state_type camera, state_type light, float camera_p, float camera_q) const {
        return weigh.merge(camera, light, camera_p, camera_q);
    }
};

// The weights of all techniques of a path in the order of technique_at; -1 where the renderer has none.
template <class Renderer>
std::vector<double> weights_by(const Renderer& r, const std::vector<mis::measured_vertex<float>>& path) {
    const int n = static_cast<int>(path.size());
    const auto &lens = path.front(), &end = path.back();
    const bool infinite = end.kind == vertex_kind::infinite_light;
    const float emission_pdf = end.pdf_position * end.pdf_to_camera;
    std::vector<typename Renderer::state_type> camera(path.size()), light(path.size());
    const auto walk = [&](auto& states, bool from_camera) {
        const int step = from_camera ? 1 : -1, first = from_camera ? 0 : n - 1, last = n - 1 - first;
        auto state = from_camera
                         ? r.start_camera(lens.pdf_to_light, lens.cos_to_light)
                         : r.start_light(end.pdf_next_event, emission_pdf, end.cos_to_camera, end.dirac);
        for (int i = first;; i += step) {
            if (i != first) {
                const scattering x = along(path, i, from_camera);
                state =
                    r.sample_scattering(state, path[static_cast<std::size_t>(i)].kind == vertex_kind::dirac,
                                        x.cos_in, x.cos_out, x.p, x.q);
            }
            const int next = i + step;
            const auto& y = path[static_cast<std::size_t>(next)];
            const float distance2 = along(path, i, from_camera).distance2;
            state = r.arrive(state, std::sqrt(distance2), from_camera ? y.cos_to_camera : y.cos_to_light,
                             infinite && (from_camera ? next == n - 1 : i == n - 1));
            states[static_cast<std::size_t>(next)] = state;
            if (next == last)
                return;
        }
    };
    walk(camera, true);
    walk(light, false);
    const auto can_join = [&](int i) {
        return path[static_cast<std::size_t>(i)].kind == vertex_kind::surface;
    };
    std::vector<double> w(static_cast<std::size_t>(mis::technique_count(n)), -1);
    for (int s = 1; s < n; ++s) { // joins of x_{s-1} and x_s
        const auto i = static_cast<std::size_t>(s);
        const scattering x = along(path, s - 1, true);
        const float dist2 = path[i - 1].distance2_to_light;
        if (s == n - 1) {
            if (can_join(s - 1))
                w[i] = r.next_event(camera[i - 1], x.cos_out, x.p, x.q,
                                    end.pdf_next_event * dist2 / end.cos_to_camera, emission_pdf,
                                    end.cos_to_camera, end.dirac, dist2);
        } else if (const scattering y = along(path, s, false); s == 1) {
            if (can_join(1))
                w[i] = r.connect_to_camera(lens.pdf_to_light, lens.cos_to_light, light[1], y.cos_out, y.p,
                                           y.q, dist2);
        } else if (can_join(s - 1) && can_join(s))
            w[i] =
                r.connect_vertices(camera[i - 1], x.cos_out, x.p, x.q, light[i], y.cos_out, y.p, y.q, dist2);
    }
    if (!end.dirac)
        w[path.size()] = r.light_hit(camera.back(), end.pdf_next_event, emission_pdf, end.cos_to_camera);
    for (int j = 1; j <= n - 2; ++j)
        if (const auto i = static_cast<std::size_t>(j); can_join(j))
            w[path.size() + i] = r.merge(camera[i], light[i], path[i].pdf_to_light, path[i].pdf_to_camera);
    return w;
}

template <int Power, class Heuristic> void compare_numbers(const Heuristic& heuristic) {
    // clang-format off
const mis::path_weights weigh{heuristic, mis::connection_and_merging(light_walks, radius)}; // of each iteration
    // clang-format on
    const two_numbers<std::decay_t<decltype(weigh)>> after{weigh};
    const three_numbers_before<Power> before;
    generator g(Power);
    double worst = 0, worst_sum = 0;
    int compared = 0;
    for (int k = 0; k < 20'000; ++k) {
        const auto path = surfaces(g, g.integer(3, 9), true);
        const auto w = weights_by(after, path), expected = weights_by(before, path);
        double sum = 0, all = 0;
        for (std::size_t i = 0; i < w.size(); ++i) {
            REQUIRE((w[i] < 0) == (expected[i] < 0));
            if (w[i] < 0)
                continue;
            worst = std::max(worst, std::fabs(w[i] - expected[i]));
            sum += w[i], all += 1;
            ++compared;
        }
        if (all > 0)
            worst_sum = std::max(worst_sum, std::fabs(sum - 1));
    }
    CHECK(compared > 100'000);
    CHECK(worst < 2e-5);
    CHECK(worst_sum < 2e-5);
    std::printf("three numbers and two, power %d: %d weights at most %.1e apart, sums at most %.1e from 1\n",
                Power, compared, worst, worst_sum);
}

} // namespace

TEST_CASE("photon mapping as three numbers have it; a light that the camera sees directly") {
    auto counts = mis::photon_mapping(light_walks, radius);
    counts.light_hit = 0;
    const mis::path_weights weigh{mis::balance, counts};
    const two_numbers<std::decay_t<decltype(weigh)>> after{weigh};
    three_numbers_before<1> before;
    before.weigh.inverse_merges = 0; // no connections
    const mis::path_weights all{mis::power, mis::connection_and_merging(light_walks, radius)};
    generator g(4);
    double worst = 0;
    for (int k = 0; k < 2000; ++k) {
        const auto path = surfaces(g, g.integer(3, 9), true);
        const auto w = weights_by(after, path), expected = weights_by(before, path);
        for (std::size_t i = path.size() + 1; i < w.size(); ++i) // merges
            worst = std::max(worst, std::fabs(w[i] - expected[i]));
        const auto seen =
            all.arrive(all.start_camera(camera_end(path[0].pdf_to_light, 1)),
                       mis::squared_distance{path[0].distance2_to_light}, mis::cosine{path[1].cos_to_camera});
        CHECK(all.light_hit(seen, light_end(0.5f, 3, 2, 0.7f, false)) == 1);
    }
    CHECK(worst < 2e-5);
}

TEST_CASE("glass as three numbers have it") {
    const mis::path_weights weigh{mis::balance, mis::bidirectional(16.f)};
    const two_numbers<std::decay_t<decltype(weigh)>> after{weigh};
    const alternatives::three_number_weights<1, double> before{0, 0, 16};
    const float cos_in = 0.4f, cos_out = 0.7f, p = 0.9f;
    const double ratio = before.scatter_dirac({0, 3, 0}, double(cos_out)).vc / 3;
    const mis::subpath_state<float> state{0, 3};
    CHECK(double(after.sample_scattering(state, true, cos_out, cos_out, p, p).b / 3) ==
          doctest::Approx(ratio)); // cos_out for cos_in
    CHECK(double(after.sample_scattering(state, true, cos_in, cos_out, p, p, 1.f, 1.5f).b / 3) ==
          doctest::Approx(double(cos_in) / (1.5 * 1.5))); // as it is
}

TEST_CASE("three numbers and two are the same weights") {
    compare_numbers<1>(mis::balance);
    compare_numbers<2>(mis::power);
}

// ---- docs/migrate_pbrt.md ----

TEST_CASE("a loop over the path and two numbers are the same weights; a camera per image or per pixel") {
    generator g(3);
    const float image = 4096;
    const mis::path_weights weigh{mis::balance, mis::bidirectional(1.f)};
    const mis::path_weights by_pixel{mis::balance, mis::bidirectional(image)};
    double worst = 0, worst_pixel = 0;
    int compared = 0;
    for (int k = 0; k < 5000; ++k) {
        const int n = g.integer(4, 9);
        auto path = surfaces(g, n, false);
        path.back().dirac = false;
        path.back().pdf_next_event = path.back().pdf_position; // the loop knows but one of them
        path.front().pdf_to_light /= image;                    // per image, as this renderer has it
        auto of_pixel = path;
        of_pixel.front().pdf_to_light *= image;
        const auto loop_walk = [&](int count, bool from_camera) {
            std::vector<alternatives::loop_vertex<double>> walk;
            double density = from_camera ? 1.0 : double(path.back().pdf_position);
            for (int j = 0; j < count; ++j) {
                const int i = from_camera ? j : n - 1 - j;
                const scattering x = along(path, i, from_camera);
                const bool inner = i > 0 && i < n - 1;
                const int before = i + (from_camera ? -1 : 1);
                const double distance2 = j > 0 ? double(along(path, before, from_camera).distance2) : 1;
                walk.push_back({density, 0, x.cos_out, distance2, false});
                if (j > 1 || (j == 1 && inner)) { // what this vertex's other density says of the one before
                    auto& last = walk[walk.size() - 2];
                    last.reverse = double(x.q) * last.cos / distance2;
                }
                const auto& next = path[static_cast<std::size_t>(i + (from_camera ? 1 : -1))];
                density = double(x.p) * double(from_camera ? next.cos_to_camera : next.cos_to_light) /
                          double(x.distance2);
            }
            return walk;
        };
        for (int s = 2; s <= n - 2; ++s) {
            const mis::technique t{mis::technique_kind::connection, s};
            const scattering x = along(path, s - 1, true), y = along(path, s, false);
            const auto camera = loop_walk(s, true), light = loop_walk(n - s, false);
            const double expected = alternatives::loop_connection<double>(
                camera.data(), s, light.data(), n - s, {{}, x.cos_out, x.p, x.q}, {{}, y.cos_out, y.p, y.q},
                double(x.distance2));
            const double w = double(mis::weight_in_subpaths(mis::balance, weigh.counts, path.data(), n, t));
            const double w_pixel =
                double(mis::weight_in_subpaths(mis::balance, by_pixel.counts, of_pixel.data(), n, t));
            worst = std::max(worst, relative(w, expected));
            worst_pixel = std::max(worst_pixel, relative(w, w_pixel));
            ++compared;
        }
    }
    CHECK(compared > 10'000);
    CHECK(worst < 2e-5);
    CHECK(worst_pixel < 2e-5);
}

namespace {

using Float = float;

// One vertex of a random walk, as a bidirectional integrator that keeps its path has it.
struct pbrt_vertex {
    mis::subpath_state<float> mis;
};
struct pbrt_sample {
    float pdf, eta;
    bool specular;
    bool IsSpecular() const { return specular; }
};

} // namespace

TEST_CASE("walks that keep two numbers at each vertex") {
    // clang-format off
const mis::path_weights weigh{mis::balance, mis::bidirectional(1.f)}; // once; all densities are per image
    // clang-format on
    const float pdfPos = 1, pdfDir = 9, absCosLens = 1, pdfRev = 0.3f, absCosIn = 0.5f, absCosOut = 0.7f;
    const float pmf = 0.5f, pdfPosLight = 0.25f, pdfDirLight = 0.2f, pdfLi = 3, absCosLight = 0.6f;
    const bool isDelta = false;
    const float dist2[] = {4, 2};
    pbrt_vertex vertex, pt, qs;
    // A path of three vertices: the walk from the camera, then that from the light.
    for (const bool specular : {true, false}) {
        const pbrt_sample bs{0.25f, 1.5f, specular};
        const float distance2 = dist2[0];
        // clang-format off
auto mis = weigh.start_camera({mis::pdf_position{pdfPos}, mis::pdf_next_event{pdfPos}, mis::pdf_direction{pdfDir},
                               mis::cosine{absCosLens}, false}); // PDF_We

vertex.mis = weigh.arrive(mis, mis::squared_distance{distance2}, mis::cosine{absCosIn}); // after CreateSurface

if (bs.IsSpecular()) // after Sample_f
    mis = weigh.scatter_dirac(vertex.mis, mis::cosine{absCosIn}, mis::pdf_forward{bs.pdf}, mis::pdf_reverse{bs.pdf},
                              mis::eta_in{1.f}, mis::eta_out{bs.eta});
else
    mis = weigh.scatter(vertex.mis, mis::cosine{absCosOut}, mis::pdf_forward{bs.pdf}, mis::pdf_reverse{pdfRev});
        // clang-format on
        CHECK((mis.a == 0) == specular);
        qs = vertex; // x_1, as the camera walk has it
        vertex.mis = mis;
    }
    const float camera_p = 0.25f; // bs.pdf
    const auto hit = weigh.arrive(vertex.mis, mis::squared_distance{dist2[1]}, mis::cosine{absCosLight});
    const pbrt_vertex at_x1 = qs;
    const auto light_point = [&] {
        const float distance2 = dist2[1];
        // clang-format off
const mis::end_point<float> light{mis::pdf_position{pmf * pdfPosLight}, // PDF_Le
                                  mis::pdf_next_event{pmf * pdfLi * absCosLight / distance2}, // PDF_Li
                                  mis::pdf_direction{pdfDirLight}, mis::cosine{absCosLight}, !isDelta};
        // clang-format on
        return light;
    };
    const auto light = light_point();
    const mis::end_point<float> camera{mis::pdf_position{pdfPos}, mis::pdf_next_event{pdfPos},
                                       mis::pdf_direction{pdfDir}, mis::cosine{absCosLens}, false};
    const auto from_light =
        weigh.arrive(weigh.start_light(light), mis::squared_distance{dist2[1]}, mis::cosine{absCosOut});
    const mis::subpath_end<float> pt_end{at_x1.mis, mis::cosine{absCosOut}, mis::pdf_forward{camera_p},
                                         mis::pdf_reverse{pdfRev}};
    const mis::subpath_end<float> qs_end{from_light, mis::cosine{absCosIn}, mis::pdf_forward{pdfRev},
                                         mis::pdf_reverse{camera_p}};
    pt.mis = hit;
    // By the definition: the densities per area of light hit, next event and camera connection.
    const float from_camera = pdfDir * absCosIn / dist2[0];
    const float expected[] = {
        from_camera * camera_p * absCosLight / dist2[1],
        from_camera * mis::to_area(mis::per_solid_angle{pmf * pdfLi}, absCosLight, dist2[1]).value,
        pmf * pdfPosLight * pdfDirLight * absCosOut / dist2[1]};
    for (int s = 0; s <= 2; ++s) {
        const int t = 3 - s;
        const mis::squared_distance distance2{dist2[t == 1 ? 0 : 1]};
        // clang-format off
const float weight = s == 0   ? weigh.light_hit(pt.mis, light)
                     : s == 1 ? weigh.next_event(pt_end, light, distance2)
                     : t == 1 ? weigh.camera_connection(camera, qs_end, distance2)
                              : weigh.connection(pt_end, qs_end, distance2);
        // clang-format on
        CHECK(weight == doctest::Approx(mis::weight(mis::balance, expected, s)));
    }
    const float p_l = 2, p_b = 3;
    // clang-format off
const Float w_l = mis::power(p_l, p_b); // SampleLd
const Float w_b = mis::power(p_b, p_l); // Li, at an area light and at an infinite one
    // clang-format on
    CHECK(w_l + w_b == 1);
}

// ---- docs/migrate_path_tracers.md ----

// An array of a just-in-time compiler, as Dr.Jit's headers have it: its numbers are called Value, its
// comparisons make masks that are no bools, and select stands beside it.
namespace jit {

constexpr std::size_t lanes = 4;
struct mask_array {
    std::array<bool, lanes> x;
};
struct float_array {
    using Value = float;
    std::array<float, lanes> x{};

    float_array() = default;
    float_array(float all) { x.fill(all); }
};
template <class Function> auto map(const float_array& a, const float_array& b, Function f) {
    std::conditional_t<std::is_same_v<decltype(f(0.f, 0.f)), bool>, mask_array, float_array> result{};
    for (std::size_t i = 0; i < lanes; ++i)
        result.x[i] = f(a.x[i], b.x[i]);
    return result;
}
float_array operator+(const float_array& a, const float_array& b) {
    return map(a, b, [](float x, float y) { return x + y; });
}
float_array operator-(const float_array& a) {
    return map(a, a, [](float x, float) { return -x; });
}
float_array operator*(const float_array& a, const float_array& b) {
    return map(a, b, [](float x, float y) { return x * y; });
}
float_array operator/(const float_array& a, const float_array& b) {
    return map(a, b, [](float x, float y) { return x / y; });
}
mask_array operator<(const float_array& a, const float_array& b) {
    return map(a, b, [](float x, float y) { return x < y; });
}
mask_array operator>(const float_array& a, const float_array& b) { return b < a; }
mask_array operator>=(const float_array& a, const float_array& b) {
    return map(a, b, [](float x, float y) { return x >= y; });
}
mask_array operator==(const float_array& a, const float_array& b) {
    return map(a, b, [](float x, float y) { return !(x < y) && !(y < x); });
}
mask_array operator!(mask_array a) {
    for (bool& x : a.x)
        x = !x;
    return a;
}
mask_array operator&&(mask_array a, const mask_array& b) {
    for (std::size_t i = 0; i < lanes; ++i)
        a.x[i] = a.x[i] && b.x[i];
    return a;
}
mask_array operator||(const mask_array& a, const mask_array& b) { return !(!a && !b); }
float_array select(const mask_array& m, const float_array& yes, const float_array& no) {
    float_array result;
    for (std::size_t i = 0; i < lanes; ++i)
        result.x[i] = m.x[i] ? yes.x[i] : no.x[i];
    return result;
}
bool any(const mask_array& m) { return m.x[0] || m.x[1] || m.x[2] || m.x[3]; }

} // namespace jit

namespace {

template <class Float> Float mis_weight(Float pdf_a, Float pdf_b) {
    // clang-format off
return mis::power(pdf_a, pdf_b); // in differentiable variants detached, as before
                                     // clang-format on
}

} // namespace

TEST_CASE("two weights for each light in a path tracer") {
    const float p_bsdf = 2, n_lights = 8, area = 2, cos_light = 0.5f, d2 = 4;
    const bool delta_light = false, delta_bsdf = false;
    {
        const float p_light = 3;
        // clang-format off
const float weight = delta_light ? 1 : mis::power(p_light, p_bsdf);       // of a light sample
const float weight_of_hit = mis::power(p_bsdf, delta_bsdf ? 0 : p_light); // of a light that was hit
        // clang-format on
        CHECK(weight + weight_of_hit == doctest::Approx(1));
    }
    {
        // clang-format off
const float p_light = mis::to_solid_angle(mis::per_area{1 / area}, cos_light, d2).value / n_lights; // at both places
        // clang-format on
        CHECK(p_light == 0.5f);
    }
}

TEST_CASE("squares in float lose both weights where densities are large") {
    const float a = 3e19f, b = 4e19f;
    const float square = a * a / (a * a + b * b);
    CHECK(!(square >= 0)); // NaN, which renderers make 0: so is the other's, and the light is lost
    CHECK(mis::power(a, b) + mis::power(b, a) == 1);
    CHECK(mis::power(a, b) == doctest::Approx(0.36f));
}

TEST_CASE("arrays of a just-in-time compiler as the scalar") {
    jit::float_array a, b;
    a.x = {3e19f, 1, 0, 0};
    b.x = {4e19f, 3, 2, 0};
    const auto w = mis_weight(a, b);
    for (std::size_t i = 0; i < jit::lanes; ++i)
        CHECK(w.x[i] == doctest::Approx(mis_weight(a.x[i], b.x[i])));
    // The two numbers, for lanes that scatter and lanes that a mirror reflects.
    generator g(13);
    const mis::path_weights weigh{mis::power, mis::bidirectional(jit::float_array(64))};
    const mis::path_weights one{mis::power, mis::bidirectional(64.f)};
    const jit::mask_array is_delta{{true, false, true, false}}, hittable{{true, true, false, false}};
    const auto random = [&] {
        jit::float_array x;
        for (float& y : x.x)
            y = g.log_uniform<float>(-1, 1);
        return x;
    };
    for (int k = 0; k < 100; ++k) {
        const auto d2 = random(), cos_in = random(), cos_out = random(), p = random(), q = random();
        const auto pdf = random();
        const mis::end_point<jit::float_array> end{mis::pdf_position{pdf}, mis::pdf_next_event{q},
                                                   mis::pdf_direction{p}, mis::cosine{cos_out}, hittable};
        auto state = weigh.arrive(weigh.start_light(end), mis::squared_distance{d2}, mis::cosine{cos_in});
        // clang-format off
const auto mirror = weigh.scatter_dirac(state, mis::cosine{cos_in}, mis::pdf_forward{p}, mis::pdf_reverse{q});
const auto rough = weigh.scatter(state, mis::cosine{cos_out}, mis::pdf_forward{p}, mis::pdf_reverse{q});
state = {select(is_delta, mirror.a, rough.a), select(is_delta, mirror.b, rough.b)};
        // clang-format on
        for (std::size_t i = 0; i < jit::lanes; ++i) {
            const mis::end_point<float> end_i{mis::pdf_position{pdf.x[i]}, mis::pdf_next_event{q.x[i]},
                                              mis::pdf_direction{p.x[i]}, mis::cosine{cos_out.x[i]},
                                              hittable.x[i]};
            auto s =
                one.arrive(one.start_light(end_i), mis::squared_distance{d2.x[i]}, mis::cosine{cos_in.x[i]});
            const mis::pdf_forward forward{p.x[i]};
            const mis::pdf_reverse reverse{q.x[i]};
            s = is_delta.x[i] ? one.scatter_dirac(s, mis::cosine{cos_in.x[i]}, forward, reverse)
                              : one.scatter(s, mis::cosine{cos_out.x[i]}, forward, reverse);
            CHECK(state.a.x[i] == doctest::Approx(s.a));
            CHECK(state.b.x[i] == doctest::Approx(s.b));
        }
    }
}

// ---- docs/migrate_hard_cases.md ----

namespace {

// A light tree of two lights, in one dimension: the nearer one is picked more often.
float tree_probability(float receiver, int l) {
    const float d = receiver - static_cast<float>(l), other = receiver - static_cast<float>(1 - l);
    return (1 / (1 + d * d)) / (1 / (1 + d * d) + 1 / (1 + other * other));
}

} // namespace

TEST_CASE("a light tree: whose next event it would be") {
    generator g(5);
    const auto counts = mis::bidirectional(64.f);
    const mis::path_weights weigh{mis::power, counts};
    double worst = 0, worst_if_wrong = 0;
    for (int k = 0; k < 2000; ++k) {
        const int n = g.integer(3, 7), l = g.integer(0, 1);
        auto path = surfaces(g, n, false);
        path.back().dirac = false;
        if (path.back().kind == vertex_kind::infinite_light)
            continue;
        std::vector<float> place(path.size()); // what the tree looks at
        for (float& x : place)
            x = g.log_uniform<float>(-1, 1);
        const float area = 2, pick_emission = 0.5f;
        const auto& end = path.back();
        const auto make_end = [&](float receiver) {
            // clang-format off
const mis::end_point<float> light{mis::pdf_position{pick_emission / area},
                                  mis::pdf_next_event{tree_probability(receiver, l) / area}, // of this receiver
                                  mis::pdf_direction{end.pdf_to_camera}, mis::cosine{end.cos_to_camera}, true};
            // clang-format on
            return light;
        };
        const float receiver = place[path.size() - 2]; // of all techniques: the vertex before the light
        const auto sum_of_weights = [&](float receiver_of_start) {
            std::vector<mis::subpath_state<float>> camera(path.size()), from_light(path.size());
            const auto lens = camera_end(path[0].pdf_to_light, path[0].cos_to_light);
            auto state = weigh.start_camera(lens);
            for (int i = 0; i + 1 < n; ++i) {
                const scattering x = along(path, i, true);
                const auto at = static_cast<std::size_t>(i);
                if (i > 0)
                    state = weigh.scatter(camera[at], mis::cosine{x.cos_out}, mis::pdf_forward{x.p},
                                          mis::pdf_reverse{x.q});
                camera[at + 1] = weigh.arrive(state, mis::squared_distance{x.distance2},
                                              mis::cosine{path[at + 1].cos_to_camera});
            }
            for (int i = n - 1; i > 1; --i) {
                const scattering y = along(path, i, false);
                const auto at = static_cast<std::size_t>(i);
                const mis::squared_distance d2{y.distance2};
                const mis::cosine cos_in{path[at - 1].cos_to_light};
                if (i == n - 1) {
                    // clang-format off
state = weigh.arrive(weigh.start_light(make_end(receiver_of_start)), d2, cos_in); // once the first hit is known
                                                  // clang-format on
                } else
                    state = weigh.arrive(weigh.scatter(from_light[at], mis::cosine{y.cos_out},
                                                       mis::pdf_forward{y.p}, mis::pdf_reverse{y.q}),
                                         d2, cos_in);
                from_light[at - 1] = state;
            }
            const auto end_of = [&](const auto& states, int i, bool from_camera) {
                const scattering x = along(path, i, from_camera);
                return mis::subpath_end<float>{states[static_cast<std::size_t>(i)], mis::cosine{x.cos_out},
                                               mis::pdf_forward{x.p}, mis::pdf_reverse{x.q}};
            };
            const auto light = make_end(receiver);
            double sum = double(weigh.light_hit(camera.back(), light));
            for (int s = 1; s < n; ++s) {
                const mis::squared_distance d2{path[static_cast<std::size_t>(s - 1)].distance2_to_light};
                const float w = s == n - 1 ? weigh.next_event(end_of(camera, s - 1, true), light, d2)
                                : s == 1   ? weigh.camera_connection(lens, end_of(from_light, s, false), d2)
                                           : weigh.connection(end_of(camera, s - 1, true),
                                                              end_of(from_light, s, false), d2);
                sum += double(w);
            }
            return sum;
        };
        worst = std::max(worst, std::fabs(sum_of_weights(receiver) - 1));
        worst_if_wrong = std::max(worst_if_wrong, std::fabs(sum_of_weights(place[0]) - 1));
    }
    CHECK(worst < 2e-5);
    CHECK(worst_if_wrong > 0.1); // with another receiver's density where a light walk starts
    std::printf("light tree: sums off by up to %.2g with another receiver where light walks start\n",
                worst_if_wrong);
}

namespace {

// Three directions, all choices enumerated: what is sampled, what is found, and what is expected of the sum.
constexpr int directions = 3;
struct toy {
    std::array<double, directions> f, bsdf, light, guide;
    explicit toy(generator& g) {
        const auto fill = [&](std::array<double, directions>& p) {
            double sum = 0;
            for (double& x : p)
                sum += x = g.uniform(0.05, 1);
            for (double& x : p)
                x /= sum;
        };
        fill(bsdf), fill(light), fill(guide);
        for (double& x : f)
            x = g.uniform(0, 2);
    }
    double integral() const { return f[0] + f[1] + f[2]; }
};
// The expectation of a light sample's weighted contribution.
template <class Density> double of_light(const toy& t, const Density& other) {
    double sum = 0;
    for (std::size_t x = 0; x < directions; ++x)
        sum += t.f[x] * mis::power(t.light[x], other(x));
    return sum;
}

} // namespace

TEST_CASE("roulette by throughput: out of both weights, or in both, not in one") {
    generator g(6);
    double worst = 0, worst_in_both = 0, worst_on_arrival = 0, worst_if_one = 0;
    for (int k = 0; k < 1000; ++k) {
        const toy t(g);
        const auto survival = [&](std::size_t x) { return std::min(1.0, 0.5 * t.f[x] / t.bsdf[x]); };
        const auto bsdf = [&](std::size_t x) { return t.bsdf[x]; };
        const auto with_survival = [&](std::size_t x) { return t.bsdf[x] * survival(x); };
        double left_out = of_light(t, bsdf), in_one = left_out, in_both = of_light(t, with_survival);
        for (std::size_t x = 0; x < directions;
             ++x) { // sampled by the BSDF and alive, it contributes f / (p q)
            const double happens = t.bsdf[x] * survival(x), value = t.f[x] / (t.bsdf[x] * survival(x));
            left_out += happens * value * mis::power(bsdf(x), t.light[x]);
            in_one += happens * value * mis::power(with_survival(x), t.light[x]);
            in_both += happens * value * mis::power(with_survival(x), t.light[x]);
            // On arrival, before both: the same factor in both densities changes no weight.
            worst_on_arrival =
                std::max(worst_on_arrival, std::fabs(mis::power(0.3 * t.bsdf[x], 0.3 * t.light[x]) -
                                                     mis::power(t.bsdf[x], t.light[x])));
        }
        worst = std::max(worst, relative(left_out, t.integral()));
        worst_in_both = std::max(worst_in_both, relative(in_both, t.integral()));
        worst_if_one = std::max(worst_if_one, relative(in_one, t.integral()));
    }
    CHECK(worst < 1e-12);
    CHECK(worst_in_both < 1e-12);
    CHECK(worst_on_arrival < 1e-15);
    CHECK(worst_if_one > 0.05);
    std::printf("survival in one of two weights: up to %.2g of the light is lost\n", worst_if_one);
}

TEST_CASE("guiding: a mixture is one technique, and resampling has a stand-in for its density") {
    generator g(7);
    double worst_mixture = 0, worst_resampled = 0, worst_if_one_sided = 0;
    for (int k = 0; k < 500; ++k) {
        const toy t(g);
        const double share = 0.3;
        const auto mixture = [&](std::size_t x) {
            const double p_guide = t.guide[x], p_bsdf = t.bsdf[x];
            // clang-format off
const double p = share * p_guide + (1 - share) * p_bsdf; // whichever of the two was drawn
            // clang-format on
            return p;
        };
        double sum = 0;
        for (std::size_t x = 0; x < directions; ++x)
            sum += t.f[x] * mis::power(mixture(x), t.light[x]);
        worst_mixture = std::max(worst_mixture, relative(sum + of_light(t, mixture), t.integral()));

        // One candidate of each; one of both is taken by target / mean density; its "density" follows from
        // both.
        const auto target = [&](std::size_t x) { return t.bsdf[x] * (0.5 + t.guide[x]); };
        const auto stand_in = [&](std::size_t x) {
            const double p_guide = t.guide[x], p_bsdf = t.bsdf[x];
            // clang-format off
const double p_weighed = (p_guide + p_bsdf) / 2; // in both weights; what is divided by is another number
            // clang-format on
            return p_weighed;
        };
        double resampled = 0, one_sided = 0;
        for (std::size_t a = 0; a < directions; ++a)
            for (std::size_t b = 0; b < directions; ++b) {
                const double total = target(a) / stand_in(a) + target(b) / stand_in(b);
                for (const std::size_t x : {a, b}) {
                    const double chosen = t.bsdf[a] * t.guide[b] * (target(x) / stand_in(x)) / total;
                    const double divided_by = target(x) * 2 / total;
                    resampled += chosen * t.f[x] / divided_by * mis::power(stand_in(x), t.light[x]);
                    one_sided += chosen * t.f[x] / divided_by * mis::power(divided_by, t.light[x]);
                }
            }
        worst_resampled =
            std::max(worst_resampled, relative(resampled + of_light(t, stand_in), t.integral()));
        worst_if_one_sided =
            std::max(worst_if_one_sided, relative(one_sided + of_light(t, stand_in), t.integral()));
    }
    CHECK(worst_mixture < 1e-12);
    CHECK(worst_resampled < 1e-12);
    CHECK(worst_if_one_sided > 0.01);
    std::printf("resampling's divisor in one of two weights: off by up to %.2g\n", worst_if_one_sided);
}

namespace {

constexpr int wavelengths = 4;

} // namespace

TEST_CASE("hero wavelengths: as many techniques as heroes") {
    generator g(8);
    double worst = 0, worst_sum = 0, worst_form = 0;
    for (int k = 0; k < 300; ++k) {
        // A first draw and a direction; all densities depend on the wavelength, the light sampler's do not.
        std::array<toy, wavelengths> of{toy(g), toy(g), toy(g), toy(g)};
        const std::array<double, directions> light = of[0].light;
        std::array<double, wavelengths> first{};
        std::array<double, wavelengths> L{}, right{};
        for (double& p : first)
            p = g.uniform(0.2, 0.8); // of a first draw, of which one outcome is looked at
        for (std::size_t j = 0; j < wavelengths; ++j)
            right[j] = of[j].integral();
        for (int hero = 0; hero < wavelengths; ++hero) // all that can happen, with its probability
            for (std::size_t x = 0; x < directions; ++x)
                for (const bool by_light : {false, true}) {
                    std::array<double, wavelengths> before{}, p_bsdf{}, f{};
                    for (std::size_t j = 0; j < wavelengths; ++j) {
                        before[j] = first[j] / first[static_cast<std::size_t>(hero)];
                        p_bsdf[j] = of[j].bsdf[x], f[j] = of[j].f[x];
                    }
                    const double p_light = light[x];
                    // clang-format off
double q[2 * wavelengths]; // the path's densities with each wavelength as hero: by the BSDF; by the light sampler
for (std::size_t j = 0; j < wavelengths; ++j) {
    q[j] = before[j] * p_bsdf[j] / wavelengths; // each is the hero once in so many paths
    q[wavelengths + j] = before[j] * p_light / wavelengths;
}
const int own = by_light ? wavelengths + hero : hero;
const double factor = mis::weight(mis::balance, q, own) / q[own]; // of beta, f and Le of every wavelength
                    // clang-format on
                    double all[2 * wavelengths], r_u = 0, r_l = 0, sum = 0;
                    mis::weights(mis::balance, q, all);
                    for (double w : all)
                        sum += w;
                    worst_sum = std::max(worst_sum, std::fabs(sum - 1));
                    // the quotient of pbrt-v4's volumetric integrator: one over the mean of all, relative to
                    // the hero's
                    const double own_density = by_light ? p_light : p_bsdf[static_cast<std::size_t>(hero)];
                    for (std::size_t j = 0; j < wavelengths; ++j) {
                        r_u += before[j] * p_bsdf[j] / own_density / wavelengths;
                        r_l += before[j] * p_light / own_density / wavelengths;
                    }
                    worst_form = std::max(worst_form, relative(factor, 1 / ((r_u + r_l) * own_density)));
                    const double happens = first[static_cast<std::size_t>(hero)] / wavelengths *
                                           (by_light ? light[x] : of[static_cast<std::size_t>(hero)].bsdf[x]);
                    for (std::size_t j = 0; j < wavelengths; ++j) {
                        const double beta = 1 / first[static_cast<std::size_t>(hero)];
                        L[j] += happens * beta * f[j] * factor;
                    }
                }
        for (std::size_t j = 0; j < wavelengths; ++j)
            worst = std::max(worst, relative(L[j], right[j]));
    }
    CHECK(worst < 1e-12);
    CHECK(worst_sum < 1e-14);
    CHECK(worst_form < 1e-13);
}

TEST_CASE("hero wavelengths with the two numbers: a recursion for each hero") {
    generator g(9);
    const auto counts = mis::bidirectional(16.0);
    double worst = 0;
    int compared = 0;
    for (int k = 0; k < 2000; ++k) {
        const int n = g.integer(3, 7), hero = g.integer(0, wavelengths - 1);
        std::vector<std::vector<mis::measured_vertex<double>>> paths;
        for (int j = 0; j < wavelengths; ++j) {
            auto path = make_path<double>(g, n, spread{1, 1, 0.1, 0}).vertices;
            if (j > 0) // the same path with other densities
                for (std::size_t i = 0; i < path.size(); ++i) {
                    auto x = paths[0][i];
                    x.pdf_to_light = path[i].pdf_to_light, x.pdf_to_camera = path[i].pdf_to_camera;
                    path[i] = x;
                }
            paths.push_back(path);
        }
        // All techniques with all heroes, in absolute densities, by hand.
        const std::size_t all = static_cast<std::size_t>(mis::technique_count(n));
        std::vector<double> q;
        for (const auto& path : paths) {
            std::vector<double> of_hero(all, 0.0);
            std::vector<double> from_camera(path.size()), from_light(path.size());
            for (int i = 0; i < n; ++i) {
                const auto a = mis::area_densities(path.data(), n, i);
                from_camera[static_cast<std::size_t>(i)] = a.density_from_camera;
                from_light[static_cast<std::size_t>(i)] = a.density_from_light;
            }
            for (int s = 1; s <= n; ++s) {
                const mis::technique t = mis::technique_at(n, s);
                if (!mis::detail::is_possible(path.data(), n, t))
                    continue;
                double p = mis::count_of(counts, t.kind);
                for (int i = 0; i < n; ++i)
                    p *= i < s ? from_camera[static_cast<std::size_t>(i)]
                               : from_light[static_cast<std::size_t>(i)];
                if (t.kind == mis::technique_kind::next_event)
                    p *= path.back().pdf_next_event / path.back().pdf_position;
                if (t.kind == mis::technique_kind::camera_connection)
                    p *= path.front().pdf_next_event / path.front().pdf_position;
                of_hero[static_cast<std::size_t>(s)] = p;
            }
            q.insert(q.end(), of_hero.begin(), of_hero.end());
        }
        for (int s = 1; s <= n; ++s) {
            const auto own = static_cast<std::size_t>(hero) * all + static_cast<std::size_t>(s);
            if (!(q[own] > 0))
                continue;
            std::array<double, wavelengths> w{}, ratio{};
            for (std::size_t j = 0; j < wavelengths; ++j) {
                ratio[j] = q[j * all + static_cast<std::size_t>(s)] / q[own];
                w[j] =
                    mis::weight_in_subpaths(mis::power, counts, paths[j].data(), n, mis::technique_at(n, s));
            }
            // clang-format off
double sum = 0; // w[j]: the weight as if wavelength j were the hero; ratio[j]: this technique's density then, over its own
for (std::size_t j = 0; j < wavelengths; ++j)
    if (ratio[j] > 0)
        sum += ratio[j] * ratio[j] / w[j]; // power; of balance ratio[j] / w[j]
const double weight = 1 / sum;
            // clang-format on
            worst = std::max(worst, relative(weight, mis::weight(mis::power, q, static_cast<int>(own))));
            ++compared;
        }
    }
    CHECK(compared > 2000);
    CHECK(worst < 1e-12);
}

TEST_CASE("a jump under the surface is an edge without a cosine or a distance") {
    generator g(10);
    double worst = 0;
    const auto counts = mis::bidirectional(16.0);
    const mis::path_weights weigh{mis::power, counts};
    for (int k = 0; k < 2000; ++k) {
        constexpr int n = 6; // in at x_2, out at x_3, seen from the camera
        std::array<double, n> cos_to_camera{}, cos_to_light{}, to_light{}, to_camera{}, d2{};
        for (std::size_t i = 0; i < n; ++i) {
            const auto x = [&] { return g.log_uniform<double>(-1, 1); };
            cos_to_camera[i] = g.uniform(0.1, 1), cos_to_light[i] = g.uniform(0.1, 1);
            to_light[i] = x(), to_camera[i] = x(), d2[i] = x();
        }
        const double position = g.log_uniform<double>(-1, 1), p_nee = g.log_uniform<double>(-1, 1);
        const double exit_given_entry = g.log_uniform<double>(-1, 1),
                     entry_given_exit = g.log_uniform<double>(-1, 1);
        // The definition: densities per area, of each walk.
        std::array<double, n> from_camera{}, from_light{};
        from_camera[0] = 1, from_light[n - 1] = position;
        for (std::size_t i = 1; i < n; ++i)
            from_camera[i] = i == 3 ? exit_given_entry : to_light[i - 1] * cos_to_camera[i] / d2[i - 1];
        for (std::size_t i = n - 1; i-- > 0;)
            from_light[i] = i == 2 ? entry_given_exit : to_camera[i + 1] * cos_to_light[i] / d2[i];
        std::vector<double> q(n + 1, 0.0);
        for (std::size_t s = 1; s <= n; ++s) {
            q[s] = s == 1 ? counts.camera_connection : s == 3 ? 0 : 1; // nobody joins x_2 and x_3
            for (std::size_t i = 0; i < n; ++i)
                q[s] *= i < s ? from_camera[i] : from_light[i];
        }
        q[n - 1] *= p_nee / position;
        const mis::end_point<double> lens{mis::pdf_position{1.0}, mis::pdf_next_event{1.0},
                                          mis::pdf_direction{to_light[0]}, mis::cosine{cos_to_light[0]},
                                          false};
        const mis::end_point<double> light{mis::pdf_position{position}, mis::pdf_next_event{p_nee},
                                           mis::pdf_direction{to_camera[n - 1]},
                                           mis::cosine{cos_to_camera[n - 1]}, true};
        std::array<mis::subpath_state<double>, n> camera{}, from{};
        auto state = weigh.start_camera(lens);
        for (std::size_t i = 1; i < n; ++i) {
            const mis::squared_distance distance2{d2[i - 1]};
            if (i == 3) {
                const mis::pdf_reverse back{to_camera[2]};
                const double p = to_light[3], cos_out = cos_to_light[3];
                // clang-format off
state = weigh.scatter(state, mis::cosine{1.0}, mis::pdf_forward{exit_given_entry}, back); // in, at x
state = weigh.arrive(state, mis::squared_distance{1.0}, mis::cosine{1.0});                // out, at y
state.a = 0; // no technique joins x with y

                // clang-format on
                camera[3] = state;
                // clang-format off
state = weigh.scatter(state, mis::cosine{cos_out}, mis::pdf_forward{p}, mis::pdf_reverse{entry_given_exit}); // on from y
                // clang-format on
                continue;
            }
            if (i > 1 && i != 4)
                state = weigh.scatter(state, mis::cosine{cos_to_light[i - 1]},
                                      mis::pdf_forward{to_light[i - 1]}, mis::pdf_reverse{to_camera[i - 1]});
            camera[i] = state = weigh.arrive(state, distance2, mis::cosine{cos_to_camera[i]});
        }
        state = weigh.start_light(light);
        for (std::size_t i = n - 1; i-- > 1;) {
            if (i == 2) { // the light walk's entry is x_3
                state = weigh.scatter(state, mis::cosine{1.0}, mis::pdf_forward{entry_given_exit},
                                      mis::pdf_reverse{to_light[3]});
                state = weigh.arrive(state, mis::squared_distance{1.0}, mis::cosine{1.0});
                state.a = 0;
                from[2] = state;
                continue;
            }
            if (i + 1 < n - 1)
                state = weigh.scatter(state, mis::cosine{cos_to_camera[i + 1]},
                                      mis::pdf_forward{to_camera[i + 1]},
                                      mis::pdf_reverse{i == 1 ? exit_given_entry : to_light[i + 1]});
            from[i] = state = weigh.arrive(state, mis::squared_distance{d2[i]}, mis::cosine{cos_to_light[i]});
        }
        const auto end_of = [&](std::size_t i, bool is_camera) {
            const double camera_back = i == 3 ? entry_given_exit : to_camera[i];
            const double light_back = i == 2 ? exit_given_entry : to_light[i];
            return is_camera ? mis::subpath_end<double>{camera[i], mis::cosine{cos_to_light[i]},
                                                        mis::pdf_forward{to_light[i]},
                                                        mis::pdf_reverse{camera_back}}
                             : mis::subpath_end<double>{from[i], mis::cosine{cos_to_camera[i]},
                                                        mis::pdf_forward{to_camera[i]},
                                                        mis::pdf_reverse{light_back}};
        };
        const double w[n + 1] = {
            0,
            weigh.camera_connection(lens, end_of(1, false), mis::squared_distance{d2[0]}),
            weigh.connection(end_of(1, true), end_of(2, false), mis::squared_distance{d2[1]}),
            0,
            weigh.connection(end_of(3, true), end_of(4, false), mis::squared_distance{d2[3]}),
            weigh.next_event(end_of(4, true), light, mis::squared_distance{d2[4]}),
            weigh.light_hit(camera[5], light)};
        for (std::size_t s = 1; s <= n; ++s)
            worst = std::max(worst, std::fabs(w[s] - mis::weight(mis::power, q, static_cast<int>(s))));
    }
    CHECK(worst < 1e-12);
}

TEST_CASE("photon mapping: with light hits and without them") {
    // clang-format off
auto counts = mis::photon_mapping(light_walks, radius); // merges, and lights that are hit
counts.light_hit = 0;                                   // merges alone

counts = mis::photon_mapping(light_walks, radius);
counts.next_event = 1; // and next events beside both
    // clang-format on
    generator g(11);
    double worst = 0, worst_if_listed = 0; // where hits are not made, and counted
    for (const float hits : {0.f, 1.f})
        for (const float next_events : {0.f, 1.f})
            for (int k = 0; k < 1000; ++k) {
                const int n = g.integer(3, 7);
                const auto path = surfaces(g, n, true);
                counts.light_hit = hits, counts.next_event = next_events;
                auto listed = counts;
                listed.light_hit = 1;
                double sum = 0, sum_if_listed = 0;
                for (int i = 0; i < mis::technique_count(n); ++i) { // what the renderer makes
                    const mis::technique t = mis::technique_at(n, i);
                    const bool makes = t.kind == technique_kind::merge ||
                                       (t.kind == technique_kind::light_hit && hits > 0) ||
                                       (t.kind == technique_kind::next_event && next_events > 0);
                    if (!makes || !mis::detail::is_possible(path.data(), n, t))
                        continue;
                    sum += double(mis::weight_in_subpaths(mis::balance, counts, path.data(), n, t));
                    sum_if_listed += double(mis::weight_in_subpaths(mis::balance, listed, path.data(), n, t));
                }
                if (sum > 0) {
                    worst = std::max(worst, std::fabs(sum - 1));
                    worst_if_listed = std::max(worst_if_listed, 1 - sum_if_listed);
                }
            }
    CHECK(worst < 2e-5);
    CHECK(worst_if_listed > 0.5);
}

// ---- docs/end_points.md ----

namespace {

// The rows of the page's table of numbers: position, next_event, direction, cos; hittable as 1 or 0.
std::map<std::string, std::array<double, 5>> table_of_numbers() {
    std::ifstream in(std::string(MIS_ROOT) + "/docs/end_points.md");
    std::map<std::string, std::array<double, 5>> rows;
    bool here = false;
    for (std::string line; std::getline(in, line);) {
        here = here || line == "## In numbers";
        if (!here || line.rfind("| ", 0) != 0 || line.rfind("| |", 0) == 0 || line.rfind("| -", 0) == 0)
            continue;
        std::istringstream cells(line.substr(2));
        std::string name, cell;
        std::getline(cells, name, '|');
        name.pop_back(); // the space before the bar
        std::array<double, 5> row{};
        for (double& x : row) {
            std::getline(cells, cell, '|');
            x = cell == " yes " ? 1 : std::strtod(cell.c_str(), nullptr);
        }
        rows[name] = row;
    }
    return rows;
}

} // namespace

TEST_CASE("the table of end points in numbers") {
    const float q = 0.25f, q_nee = 0.5f, cos_theta = 0.8f, R = 10, light_area = 2, lens_radius = 0.02f;
    const float pixel_area = 1 / (512.f * 512.f), cos_cone = std::sqrt(0.75f), sky_pdf = 1 / (4 * pi);
    const float film_area = 4 / 512.f * 4 / 512.f;
    const float pixel_angle = 2 * pi / 1024 * pi / 512; // at the horizon
    const float pinhole_direction = 1 / (pixel_area * cos_theta * cos_theta * cos_theta);
    const float lens = 1 / (pi * lens_radius * lens_radius), disk = 1 / (pi * R * R);
    const std::map<std::string, std::array<float, 5>> expected{
        {"pinhole camera", {1, 1, pinhole_direction, cos_theta, 0}},
        {"thin lens", {lens, lens, pinhole_direction, cos_theta, 1}},
        {"orthographic camera", {1, 1, 1 / film_area, 1, 0}},
        {"panorama", {1, 1, 1 / pixel_angle, 1, 0}},
        {"area light", {q / light_area, q_nee / light_area, cos_theta / pi, cos_theta, 1}},
        {"point light", {q, q_nee, 1 / (4 * pi), 1, 0}},
        {"spot light", {q, q_nee, 1 / (2 * pi * (1 - cos_cone)), 1, 0}},
        {"directional light", {q, q_nee, disk, 1, 0}},
        {"environment", {q * sky_pdf, q_nee * sky_pdf, disk, 1, 1}}};
    const auto page = table_of_numbers();
    for (const auto& row : expected) {
        CAPTURE(row.first);
        REQUIRE(page.count(row.first) == 1);
        for (std::size_t i = 0; i < row.second.size(); ++i)
            CHECK(page.at(row.first)[i] == doctest::Approx(double(row.second[i])).epsilon(1e-3));
    }
}

TEST_CASE("an orthographic camera is a directional light seen the other way") {
    generator g(12);
    const auto counts = mis::bidirectional(16.0);
    const mis::path_weights weigh{mis::power, counts};
    double worst = 0, worst_sum = 0;
    for (int k = 0; k < 2000; ++k) {
        const int n = g.integer(4, 7);
        auto path = make_path<double>(g, n, spread{1, 1, 0.1, 0}).vertices;
        const double pixel_area = g.log_uniform<double>(-2, 0);
        for (auto& x : path)
            if (x.kind == vertex_kind::medium || x.kind == vertex_kind::dirac) {
                x.kind = vertex_kind::surface;
                x.pdf_distance_from_camera = x.pdf_distance_from_light = 1;
            }
        path.back().dirac = false;
        // The record: no cosine and no distance at the camera.
        path[0].dirac = true;
        path[0].pdf_position = path[0].pdf_next_event = 1;
        path[0].pdf_to_light = 1 / pixel_area;
        path[0].cos_to_light = path[0].distance2_to_light = 1;
        // The first vertex by its definition: per area of the surface, the share of the pixel that it sees.
        const auto first = mis::area_densities(path.data(), n, 1);
        worst = std::max(worst, relative(first.density_from_camera, path[1].cos_to_camera / pixel_area));
        const mis::cosine cos_in{path[1].cos_to_camera};
        // clang-format off
const mis::end_point<double> camera{mis::pdf_position{1.0}, mis::pdf_next_event{1.0}, mis::pdf_direction{1 / pixel_area},
                                    mis::cosine{1.0}, false};
auto state = weigh.arrive_from_infinity(weigh.start_camera(camera), cos_in); // the first edge has no distance
        // clang-format on
        std::vector<double> w(static_cast<std::size_t>(mis::technique_count(n)));
        mis::weights(mis::power, counts, path.data(), n, w.data());
        double sum = 0;
        for (int s = 1; s <= n; ++s) {
            const double two =
                mis::weight_in_subpaths(mis::power, counts, path.data(), n, mis::technique_at(n, s));
            worst = std::max(worst, std::fabs(two - w[static_cast<std::size_t>(s)]));
            sum += two;
        }
        worst_sum = std::max(worst_sum, std::fabs(sum - 1));
        // By the lines: the camera connection, and the connection of x_1 and x_2.
        const auto& end = path.back();
        const auto from_light = [&](int i) {
            const mis::end_point<double> light{
                mis::pdf_position{end.pdf_position}, mis::pdf_next_event{end.pdf_next_event},
                mis::pdf_direction{end.pdf_to_camera}, mis::cosine{end.cos_to_camera}, true};
            const auto& x = path[static_cast<std::size_t>(i)];
            return mis::subpath_end<double>{
                mis::detail::state_at(weigh, weigh.start_light(light), path.data(), n - 1, i, -1),
                mis::cosine{x.cos_to_camera}, mis::pdf_forward{x.pdf_to_camera},
                mis::pdf_reverse{x.pdf_to_light}};
        };
        const double seen = weigh.camera_connection(camera, from_light(1), mis::squared_distance{1.0});
        const double joined = weigh.connection(
            {state, mis::cosine{path[1].cos_to_light}, mis::pdf_forward{path[1].pdf_to_light},
             mis::pdf_reverse{path[1].pdf_to_camera}},
            from_light(2), mis::squared_distance{path[1].distance2_to_light});
        worst = std::max({worst, std::fabs(seen - w[1]), std::fabs(joined - w[2])});
    }
    CHECK(worst < 1e-12);
    CHECK(worst_sum < 1e-12);
}
