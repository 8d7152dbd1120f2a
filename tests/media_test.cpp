// SPDX-License-Identifier: MIT
#include "oracle.hpp"
#include "random_paths.hpp"

#include <array>
#include <cstdio>
#include <doctest/doctest.h>
#include <mis/bias.hpp>
#include <mis/media.hpp>
#include <mis/verify/subpaths.hpp>

using namespace test;
using mis::merge_family;
using oracle::heuristic_kind;

namespace {

constexpr merge_family families[] = {merge_family::point_point, merge_family::point_beam,
                                     merge_family::beam_point, merge_family::beam_beam};

// A path whose medium vertices have merge families: what each family's size is, and how the walks' beams end
// there.
template <class T> struct media_path {
    random_path<T> path;
    mis::family_sizes<T> sizes;
    std::vector<std::array<T, 2>> pass; // of camera and light beams: 1 for long ones
    std::vector<T> sin_angle;
    T surface_size; // N pi r^2

    bool has_families(int j) const {
        return path.vertices[static_cast<std::size_t>(j)].kind == vertex_kind::medium;
    }
    mis::family_sizes<T> sizes_at(int j) const {
        const auto k = static_cast<std::size_t>(j);
        const auto& x = path.vertices[k];
        return mis::at_vertex(sizes,
                              mis::beams<T>{mis::beam(x.pdf_distance_from_camera, pass[k][0]),
                                            mis::beam(x.pdf_distance_from_light, pass[k][1])},
                              sin_angle[k]);
    }
};

template <class T> media_path<T> make_media_path(generator& g, int n) {
    media_path<T> m{make_path<T>(g, n, ordinary), {}, {}, {}, T(0)};
    const auto size = [&](double low, double high) {
        return g.chance(0.2) ? T(0) : g.log_uniform<T>(low, high);
    };
    m.sizes = {size(-3, 3), size(-3, 3), size(-3, 3), size(-3, 3)};
    m.surface_size = size(-3, 3);
    const bool long_camera_beams = g.chance(0.5), long_light_beams = g.chance(0.5);
    m.path.counts.merge = T(1); // factors carry everything
    for (auto& x : m.path.vertices) {
        if (x.kind == vertex_kind::surface && g.chance(0.4)) { // more media than most paths have
            x.kind = vertex_kind::medium;
            x.cos_to_camera = x.cos_to_light = T(1);
            x.pdf_distance_from_camera = g.log_uniform<T>(-2, 2);
            x.pdf_distance_from_light = g.log_uniform<T>(-2, 2);
        }
        m.pass.push_back({long_camera_beams ? T(1) : static_cast<T>(g.uniform(0.01, 1)),
                          long_light_beams ? T(1) : static_cast<T>(g.uniform(0.01, 1))});
        m.sin_angle.push_back(static_cast<T>(g.uniform(0.01, 1)));
    }
    return m;
}

// Sets the vertices' merge factors as a renderer would.
template <class T, class Heuristic> void set_factors(media_path<T>& m, const Heuristic& h) {
    for (int j = 1; j + 1 < m.path.size(); ++j)
        m.path.vertices[static_cast<std::size_t>(j)].merge_factor =
            m.has_families(j) ? mis::joined(h, m.sizes_at(j)) : m.surface_size;
}

// The effective density of a family's merge at x_j from its definition: the walk that has a beam there was
// sampled up to the direction of its last segment, and passes with a probability instead of stopping with a
// density.
template <class T> wide family_density(const media_path<T>& m, int j, merge_family family) {
    const auto k = static_cast<std::size_t>(j);
    const auto& x = m.path.vertices;
    const oracle::path p = oracle::path_of(x);
    const bool camera_beam = family == merge_family::point_beam || family == merge_family::beam_beam;
    const bool light_beam = family == merge_family::beam_point || family == merge_family::beam_beam;
    const wide from_camera =
        camera_beam ? wide{x[k - 1].pdf_to_light} / wide{x[k - 1].distance2_to_light} * wide{m.pass[k][0]}
                    : p.from_camera[k];
    const wide from_light =
        light_beam ? wide{x[k + 1].pdf_to_camera} / wide{x[k].distance2_to_light} * wide{m.pass[k][1]}
                   : p.from_light[k];
    wide size;
    switch (family) {
    case merge_family::point_point:
        size = wide{m.sizes.point_point};
        break;
    case merge_family::point_beam:
        size = wide{m.sizes.point_beam};
        break;
    case merge_family::beam_point:
        size = wide{m.sizes.beam_point};
        break;
    case merge_family::beam_beam:
        size = wide{m.sizes.beam_beam} * wide{m.sin_angle[k]};
        break;
    }
    return size * oracle::walks(p, j, j + 1) * from_camera * from_light;
}

// All techniques without merges, surfaces' merges, and each family by itself; `place` tells where the merges
// of x_j begin.
template <class T> std::vector<wide> all_densities(const media_path<T>& m, std::vector<std::size_t>& place) {
    const int n = m.path.size();
    auto without = m.path;
    without.counts.merge = T(0);
    std::vector<wide> q = oracle::densities(without.counts, oracle::path_of(without.vertices));
    q.resize(static_cast<std::size_t>(n) + 1);
    place.assign(static_cast<std::size_t>(n), 0);
    const oracle::path p = oracle::path_of(m.path.vertices);
    for (int j = 1; j <= n - 2; ++j) {
        place[static_cast<std::size_t>(j)] = q.size();
        if (m.has_families(j))
            for (const merge_family family : families)
                q.push_back(family_density(m, j, family));
        else
            q.push_back(oracle::can_be_joined(p, j) ? wide{m.surface_size} * oracle::walks(p, j + 1, j)
                                                    : wide{});
    }
    return q;
}

double relative_error(double computed, const wide& exact) {
    const double e = static_cast<double>(oracle::to_long_double(exact));
    if (e < 1e-290) // below what a double has to 1e-9
        return computed <= 1e-280 ? 0 : hopeless;
    return std::fabs(computed / e - 1);
}

// Of the recursion and of complete paths, every technique and family.
template <class Heuristic>
void check(std::uint64_t seed, int paths, const Heuristic& h, oracle::heuristic reference) {
    generator g(seed);
    worst_case complete, recursion, unity;
    long long with_families = 0;
    for (int sample = 0; sample < paths; ++sample) {
        media_path<double> m = make_media_path<double>(g, g.integer(3, 12));
        set_factors(m, h);
        const int n = m.path.size();
        std::vector<std::size_t> place;
        const auto exact = oracle::weights(reference, all_densities(m, place));
        std::vector<double> w(static_cast<std::size_t>(mis::technique_count(n)));
        mis::weights(h, m.path.counts, m.path.data(), n, w.data());
        double sum = 0;
        for (int k = 0; k < mis::technique_count(n); ++k) {
            const mis::technique t = mis::technique_at(n, k);
            const double weight = w[static_cast<std::size_t>(k)];
            const bool is_possible =
                mis::detail::is_possible(m.path.data(), n, t) &&
                (t.kind == mis::technique_kind::merge || mis::count_of(m.path.counts, t.kind) > 0);
            const double by_recursion =
                is_possible ? mis::weight_in_subpaths(h, m.path.counts, m.path.data(), n, t) : weight;
            if (k <= n) {
                complete.see(relative_error(weight, exact[static_cast<std::size_t>(k)]), sample);
                recursion.see(relative_error(by_recursion, exact[static_cast<std::size_t>(k)]), sample);
                sum += weight;
                continue;
            }
            const int j = k - n;
            const std::size_t first = place[static_cast<std::size_t>(j)];
            if (!m.has_families(j)) {
                complete.see(relative_error(weight, exact[first]), sample);
                recursion.see(relative_error(by_recursion, exact[first]), sample);
                sum += weight;
                continue;
            }
            ++with_families;
            for (std::size_t f = 0; f < 4; ++f) {
                const double share = mis::family_share(h, m.sizes_at(j), families[f]);
                complete.see(relative_error(weight * share, exact[first + f]), sample);
                recursion.see(relative_error(by_recursion * share, exact[first + f]), sample);
                sum += weight * share;
            }
        }
        bool any = false;
        for (const wide& x : exact)
            any = any || !x.zero();
        unity.see(any ? std::fabs(sum - 1) : sum, sample);
    }
    std::printf("families, heuristic %d (%g): complete paths %.2g, recursion %.2g relative, sum to 1 within "
                "%.2g; %lld "
                "vertices\n",
                static_cast<int>(reference.kind), reference.parameter, complete.error, recursion.error,
                unity.error, with_families);
    CAPTURE(reference.parameter);
    CHECK(with_families > paths);
    CHECK(complete.error <= 1e-9);
    CHECK(recursion.error <= 1e-9);
    CHECK(unity.error <= 1e-12);
}

} // namespace

TEST_CASE_TEMPLATE("a family that is off, or an angle of 0, has size 0, however many samples beams have", T,
                   float, double) {
    constexpr T infinity = std::numeric_limits<T>::infinity();
    const mis::family_sizes<T> some{1, 0, 2, 3};
    const auto on = mis::at_vertex(some, mis::beams<T>{infinity, infinity}, T(0));
    CHECK(on.point_point == 1);
    CHECK(on.point_beam == 0);
    CHECK(on.beam_point > mis::detail::limits<T>::largest / 2);
    CHECK(on.beam_beam == 0);
    const auto none = mis::at_vertex(some, mis::beams<T>{0, infinity}, T(1));
    CHECK(none.beam_beam == 0);
}

TEST_CASE("100,000 random paths in media: every family's weight is that of its own density") {
    check(31, 40'000, mis::balance, {heuristic_kind::balance});
    check(32, 40'000, mis::power, {heuristic_kind::power, 2});
    check(33, 20'000, mis::power_heuristic{0.5}, {heuristic_kind::power, 0.5});
}

TEST_CASE("a walk knows what step needs when it has found the next vertex") {
    generator g(34);
    for (int sample = 0; sample < 2'000; ++sample) {
        media_path<double> m = make_media_path<double>(g, 8);
        for (auto& x : m.path.vertices)
            if (x.kind == vertex_kind::dirac)
                x.kind = vertex_kind::surface;
        m.path.vertices[7].kind = vertex_kind::light;
        m.path.vertices[7].dirac = false;
        m.path.vertices[6].distance2_to_light = 1.5;
        m.path.counts.light_hit = 1;
        m.path.counts.direct = 0;
        set_factors(m, mis::power);
        const auto* x = m.path.data();
        const mis::path_weights weigh{mis::power, m.path.counts};
        mis::subpath_state<double> state = weigh.arrive(
            weigh.start_camera(
                {mis::pdf_position{x[0].pdf_position}, mis::pdf_next_event{x[0].pdf_next_event},
                 mis::pdf_direction{x[0].pdf_to_light}, mis::cosine{x[0].cos_to_light}, !x[0].dirac}),
            mis::squared_distance{x[0].distance2_to_light}, mis::cosine{x[1].cos_to_camera},
            mis::pdf_distance_forward{x[1].pdf_distance_from_camera},
            mis::pdf_distance_reverse{x[0].pdf_distance_from_light});
        for (int i = 1; i + 1 < 8; ++i) {
            // x_{i + 1} is found. Of x_i the camera walk's beam is known since it came, and now the light
            // walk's.
            const auto k = static_cast<std::size_t>(i);
            double factor = m.surface_size;
            if (m.has_families(i)) {
                const mis::beams<double> beams{mis::beam(x[i].pdf_distance_from_camera, m.pass[k][0]),
                                               mis::beam(x[i].pdf_distance_from_light, m.pass[k][1])};
                factor = mis::joined(mis::power, mis::at_vertex(m.sizes, beams, m.sin_angle[k]));
            }
            state = weigh.step(state, mis::cosine_out{x[i].cos_to_light}, mis::pdf_forward{x[i].pdf_to_light},
                               mis::pdf_reverse{x[i].pdf_to_camera},
                               mis::squared_distance{x[i].distance2_to_light},
                               mis::cosine_in{x[i + 1].cos_to_camera}, factor,
                               mis::pdf_distance_forward{x[i + 1].pdf_distance_from_camera},
                               mis::pdf_distance_reverse{x[i].pdf_distance_from_light});
        }
        const double w =
            weigh.light_hit(state, mis::end_point<double>{mis::pdf_position{x[7].pdf_position},
                                                          mis::pdf_next_event{x[7].pdf_next_event},
                                                          mis::pdf_direction{x[7].pdf_to_camera},
                                                          mis::cosine{x[7].cos_to_camera}, true});
        std::vector<std::size_t> place;
        const auto exact = oracle::weights({heuristic_kind::power, 2}, all_densities(m, place));
        CHECK(relative_error(w, exact[8]) < 1e-9);
    }
}

TEST_CASE_TEMPLATE("joined sizes over the whole range, and shares", T, float, double) {
    generator g(35);
    worst_case joined_error, shares;
    for (int sample = 0; sample < 20'000; ++sample) {
        const mis::family_sizes<T> k{g.any_positive<T>(), g.chance(0.3) ? T(0) : g.any_positive<T>(),
                                     g.chance(0.3) ? T(0) : g.any_positive<T>(), T(0)};
        const auto exact = [&](double beta) {
            wide sum;
            for (const merge_family f : families)
                sum = sum + oracle::pow(wide{mis::size_of(k, f)}, beta);
            return sum;
        };
        // b of the joined size is the sum of b
        const T joined = mis::joined(mis::power, k);
        if (joined < largest_finite<T>() && joined > std::numeric_limits<T>::min())
            joined_error.see(ulp_error(joined, oracle::pow(exact(2), 0.5)), sample);
        T sum = 0;
        for (const merge_family f : families)
            sum += mis::family_share(mis::power, k, f);
        shares.see(unity_error<T>(static_cast<long double>(sum)), sample);
    }
    CHECK(joined_error.error <= 4);
    CHECK(shares.error <= 4);
    const mis::family_sizes<T> none{};
    CHECK(mis::joined(mis::power, none) == 0);
    CHECK(mis::joined(mis::balance, none) == 0);
    CHECK(mis::family_share(mis::power, none, merge_family::beam_beam) == 0);
    CHECK(mis::joined(mis::maximum, mis::family_sizes<T>{T(1), T(3), T(2), T(0)}) == 3);
}

TEST_CASE("sizes, beams and distances are what the formulas say") {
    CHECK(mis::point_point_size(10.0, 0.5) == doctest::Approx(10 * 4 / 3.0 * 3.14159265358979 * 0.125));
    CHECK(mis::point_beam_size(10.0, 0.5) == doctest::Approx(10 * 3.14159265358979 * 0.25));
    CHECK(mis::beam_beam_size(10.0, 0.5) == doctest::Approx(10.0));
    CHECK(mis::beam(4.0) == 0.25);
    CHECK(mis::beam(4.0, 0.5) == 0.125);
    CHECK(mis::beam(0.0) == 0);
    // The mean of the channels: its density is minus the derivative of the probability to pass, and both are
    // a probability's.
    const double extinction[] = {0.5, 2, 0};
    for (const double t : {0.0, 0.3, 2.0, 9.0}) {
        const double step = 1e-5;
        const auto here = mis::distance_in_medium(extinction, 3, t);
        const auto after = mis::distance_in_medium(extinction, 3, t + step);
        CHECK((here.pass - after.pass) / step ==
              doctest::Approx((here.density + after.density) / 2).epsilon(1e-6));
    }
    CHECK(mis::distance_in_medium(extinction, 3, 0.0).pass == doctest::Approx(1));
}

TEST_CASE_TEMPLATE("radii of each dimension: squared bias and variance fall at one rate", T, float, double) {
    for (const int d : {1, 2, 3}) {
        const double alpha = 4.0 / (4 + d);
        CHECK(static_cast<double>(mis::optimal_alpha_in<T>(d)) == doctest::Approx(alpha));
        const auto radius = [&](long long i) {
            return static_cast<double>(mis::progressive_radius(T(0.5), i, mis::optimal_alpha_in<T>(d), d));
        };
        CHECK(radius(1) == doctest::Approx(0.5));
        // Over the iterations' means: bias ~ mean of r^2, variance ~ mean of 1 / r^d over n.
        const auto errors = [&](long long n) {
            double bias = 0, variance = 0;
            for (long long i = 1; i <= n; ++i) {
                bias += radius(i) * radius(i);
                variance += std::pow(radius(i), -d);
            }
            const double count = static_cast<double>(n);
            return std::array<double, 2>{std::pow(bias / count, 2), variance / (count * count)};
        };
        const auto early = errors(2'000), late = errors(32'000);
        CHECK(std::log(early[0] / late[0]) / std::log(16.0) == doctest::Approx(alpha).epsilon(0.02));
        CHECK(std::log(early[1] / late[1]) / std::log(16.0) == doctest::Approx(alpha).epsilon(0.02));
    }
    CHECK(mis::optimal_alpha_in<double>(2) == mis::optimal_alpha<double>);
}
