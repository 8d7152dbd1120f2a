// SPDX-License-Identifier: MIT
#include "dual.hpp"
#include "oracle.hpp"
#include "ulp.hpp"

#include <Eigen/Core>
#include <array>
#include <cstdio>
#include <doctest/doctest.h>
#include <mis/mis.hpp>
#include <mis/packet.hpp>
#include <vector>
#if __has_include(<experimental/simd>)
#include <experimental/simd>
#define MIS_TEST_STD_SIMD
#endif
#if __has_include(<xsimd/xsimd.hpp>)
#include <xsimd/xsimd.hpp>
#define MIS_TEST_XSIMD
#endif

using namespace test;
using oracle::heuristic_kind;

namespace {

// What the tests need of each library: its name, how many numbers a packet holds, and the way in and out.
template <class Scalar> struct eigen_packets {
    using scalar = Scalar;
    using packet = Eigen::Array<Scalar, 8, 1>;
    static constexpr const char* name = "Eigen::Array";
    static constexpr bool has_pow = true;
    static constexpr int size = 8;

    static packet load(const Scalar* from) { return Eigen::Map<const packet>(from); }
    static void store(const packet& x, Scalar* to) { std::copy(x.data(), x.data() + size, to); }
};
#ifdef MIS_TEST_STD_SIMD
namespace stdx = std::experimental;
template <class Packet> struct std_packets {
    using packet = Packet;
    using scalar = typename packet::value_type;
    static constexpr const char* name = "std::experimental::simd";
    static constexpr bool has_pow = true;
    static constexpr int size = static_cast<int>(packet::size());

    static packet load(const scalar* from) { return packet(from, stdx::element_aligned); }
    static void store(const packet& x, scalar* to) { x.copy_to(to, stdx::element_aligned); }
};
#endif
#ifdef MIS_TEST_XSIMD
template <class Scalar> struct xsimd_packets {
    using scalar = Scalar;
    using packet = xsimd::batch<Scalar>;
    static constexpr const char* name = "xsimd::batch";
    static constexpr bool has_pow =
        false; // not of 0 and subnormal numbers: shares that are as small are wrong
    static constexpr int size = static_cast<int>(packet::size);

    static packet load(const Scalar* from) { return packet::load_unaligned(from); }
    static void store(const packet& x, Scalar* to) { x.store_unaligned(to); }
};
#endif

template <class Visit> void for_each_library(Visit&& visit) {
    int libraries = 0;
    const auto see = [&](auto library) {
        ++libraries;
        visit(library);
    };
    see(eigen_packets<float>());
    see(eigen_packets<double>());
#ifdef MIS_TEST_STD_SIMD
    see(std_packets<stdx::fixed_size_simd<float, 8>>());
#endif
#ifdef MIS_TEST_XSIMD
    see(xsimd_packets<float>());
#endif
    CHECK(libraries >= 2);
}

template <class Library, class Fill> typename Library::packet filled(Fill&& fill) {
    typename Library::scalar numbers[Library::size];
    for (auto& x : numbers)
        x = fill();
    return Library::load(&numbers[0]);
}
template <class Library> typename Library::scalar lane(const typename Library::packet& x, int i) {
    typename Library::scalar numbers[Library::size];
    Library::store(x, &numbers[0]);
    return numbers[i];
}

template <class L, class Visit> void for_each_heuristic(Visit&& visit) {
    visit(mis::average, oracle::heuristic{heuristic_kind::average}, 0);
    visit(mis::balance, oracle::heuristic{heuristic_kind::balance}, 1);
    visit(mis::power, oracle::heuristic{heuristic_kind::power, 2}, 2);
    if (L::has_pow)
        visit(mis::power_heuristic{1.5}, oracle::heuristic{heuristic_kind::power, 1.5}, 2);
    visit(mis::cutoff_heuristic{0.125}, oracle::heuristic{heuristic_kind::cutoff, 0.125}, 1);
    visit(mis::maximum, oracle::heuristic{heuristic_kind::maximum}, 0);
}

// A density from the whole range, or near another one.
template <class T> T density(generator& g, T near) {
    const T x = near * g.log_uniform<T>(-3, 3);
    return g.chance(0.5) && x < largest_finite<T>() ? x : g.any<T>();
}

} // namespace

TEST_CASE("heuristics: each lane has the weights of its densities, over the whole range") {
    for_each_library([](auto library) {
        using L = decltype(library);
        using T = typename L::scalar;
        using P = typename L::packet;
        for_each_heuristic<L>([&](const auto& heuristic, oracle::heuristic reference, int beta) {
            generator g(1);
            worst_case of_two, of_many;
            for (int k = 0; k < 2000; ++k) {
                const int n = g.integer(2, 16);
                P q[16], w[16];
                T last = 1;
                for (int i = 0; i < n; ++i)
                    q[i] = filled<L>([&] { return last = density(g, last); });
                mis::weights(heuristic, &q[0], n, &w[0]);
                const P first = heuristic(q[0], q[1]);
                for (int at = 0; at < L::size; ++at) {
                    T densities[16];
                    for (int i = 0; i < n; ++i)
                        densities[i] = lane<L>(q[i], at);
                    const auto exact = oracle::weights(reference, &densities[0], n);
                    for (int i = 0; i < n; ++i)
                        of_many.see(
                            ulp_error(lane<L>(w[i], at), exact[static_cast<std::size_t>(i)]) / (n + beta), k);
                    of_two.see(
                        error_of_two(lane<L>(first, at), oracle::weights(reference, &densities[0], 2)[0]), k);
                }
            }
            std::printf("%s, %d lanes, beta %d: two techniques %.2f ulp, N techniques %.2f (N + beta) ulp\n",
                        L::name, L::size, beta, of_two.error, of_many.error);
            CHECK(of_two.error <= 2 + beta);
            CHECK(of_many.error <= 1);
        });
    });
}

TEST_CASE("throughputs and biased densities: each lane has the numbers of its own") {
    for_each_library([](auto library) {
        using L = decltype(library);
        using T = typename L::scalar;
        using P = typename L::packet;
        generator g(2);
        worst_case of_throughputs, of_biased;
        for (int k = 0; k < 5000; ++k) {
            const int n = g.integer(2, 8);
            P counts[8], throughputs[8], densities[8];
            for (int i = 0; i < n; ++i) {
                counts[i] = filled<L>([&] { return g.chance(0.2) ? T(0) : g.log_uniform<T>(-3, 6); });
                throughputs[i] = filled<L>([&] { return g.log_uniform<T>(-30, 30); });
            }
            mis::densities_from_throughputs(&counts[0], &throughputs[0], n, &densities[0]);
            for (int at = 0; at < L::size; ++at) {
                // a scalar float is weighed in double, and so is exact beside the lane
                T c[8], s[8], q[8];
                for (int i = 0; i < n; ++i)
                    c[i] = lane<L>(counts[i], at), s[i] = lane<L>(throughputs[i], at);
                mis::densities_from_throughputs(&c[0], &s[0], n, &q[0]);
                for (int i = 0; i < n; ++i)
                    of_throughputs.see(ulp_distance(lane<L>(densities[i], at), q[i]), k);
            }
            const auto number = [&] {
                return g.chance(0.1) ? g.chance(0.5) ? T(0) : std::numeric_limits<T>::infinity()
                                     : g.log_uniform<T>(-8, 8);
            };
            const P q = filled<L>(number), r = filled<L>(number), a = filled<L>(number);
            const P biased = mis::bias_aware_density(q, r, a);
            for (int at = 0; at < L::size; ++at)
                of_biased.see(
                    ulp_distance(lane<L>(biased, at),
                                 mis::bias_aware_density(lane<L>(q, at), lane<L>(r, at), lane<L>(a, at))),
                    k);
        }
        std::printf("%s: throughputs %.2f ulp, biased densities %.2f ulp\n", L::name, of_throughputs.error,
                    of_biased.error);
        CHECK(of_throughputs.error <= 4);
        CHECK(of_biased.error <= 6);
    });
}

namespace {

// The numbers of one lane, or of all lanes of a packet.
template <class T> struct numbers { std::function<T(T (*)(generator&))> draw; };

// Every call of the recursion with random numbers; `make(f)` gives a T of random numbers f(generator).
template <class T, class Scalar, class Heuristic, class Use, class Make>
std::vector<T> every_call(const Heuristic& heuristic, Use use, Make&& make) {
    using gen = generator&;
    const auto positive = [&] { return make([](gen g) { return g.log_uniform<Scalar>(-3, 3); }); };
    const auto maybe = [&] {
        return make([](gen g) { return g.chance(0.1) ? Scalar(0) : g.log_uniform<Scalar>(-3, 3); });
    };
    const auto pdf = [&] {
        return make([](gen g) { return g.chance(0.04) ? g.any<Scalar>() : g.log_uniform<Scalar>(-3, 3); });
    };
    const auto cos = [&] { return mis::cosine<T>(make([](gen g) { return g.log_uniform<Scalar>(-2, 0); })); };
    const auto d2 = [&] { return mis::squared_distance<T>(positive()); };
    const auto forward = [&] { return mis::pdf_forward<T>(pdf()); };
    const auto reverse = [&] { return mis::pdf_reverse<T>(pdf()); };

    mis::technique_counts<T> counts;
    counts.light_hit = Use::always_connects ? positive() : maybe();
    counts.next_event = positive();
    counts.connection = Use::always_connects ? positive() : maybe();
    counts.camera_connection = positive();
    counts.merge = maybe();
    if (!Use::always_connects) {
        counts.camera_hit = maybe();
        counts.direct = maybe();
    }
    const mis::path_weights<Heuristic, T, Use> weigh(heuristic, counts, use);

    const auto end_point = [&](const T& low, const T& high) { // hittable where low < high
        return mis::end_point<T>{mis::pdf_position<T>(pdf()), mis::pdf_next_event<T>(pdf()),
                                 mis::pdf_direction<T>(pdf()), cos(), low < high};
    };
    const auto maybe_hittable = [&] { return end_point(positive(), positive()); };
    std::vector<T> weights;
    const auto camera = maybe_hittable(), light = maybe_hittable(), hittable = end_point(T(0), T(1));
    const auto walk = [&](mis::subpath_state<T> x) {
        x = weigh.arrive(x, d2(), cos());
        x = weigh.step(x, mis::cosine_out<T>(cos().value), forward(), reverse(), d2(),
                       mis::cosine_in<T>(cos().value));
        const auto in = cos();
        x = weigh.arrive(
            weigh.scatter_dirac(x, in, forward(), reverse(), mis::eta_in<T>(T(1)), mis::eta_out<T>(T(2))),
            d2(), cos());
        return weigh.arrive(weigh.scatter(x, cos(), forward(), reverse(), positive()), d2(), cos());
    };
    const auto x = walk(weigh.start_camera(camera)), y = walk(weigh.start_light(light));
    const auto first = weigh.arrive(weigh.start_camera(camera), d2(), cos());
    const auto end = [&](const mis::subpath_state<T>& state) {
        return mis::subpath_end<T>{state, cos(), forward(), reverse(), positive()};
    };
    weights.push_back(weigh.connection(end(x), end(y), d2()));
    weights.push_back(weigh.next_event(end(x), light, d2()));
    weights.push_back(weigh.next_event(end(x), mis::keep(light), d2()));
    weights.push_back(weigh.camera_connection(camera, end(y), d2()));
    weights.push_back(weigh.camera_connection(mis::pdf_direction<T>(pdf()), end(y), d2()));
    weights.push_back(weigh.light_hit(x, hittable));
    weights.push_back(weigh.light_hit(first, hittable));
    weights.push_back(weigh.camera_hit(y, hittable));
    weights.push_back(
        weigh.merge(x, y, mis::pdf_to_light<T>(pdf()), mis::pdf_to_camera<T>(pdf()), positive()));
    weights.push_back(weigh.direct(camera, hittable, d2()));
    return weights;
}

template <class L, class Heuristic, class Use>
double worst_of_calls(const Heuristic& heuristic, Use use, int& within) {
    using T = typename L::scalar;
    using P = typename L::packet;
    worst_case worst;
    for (std::uint64_t seed = 0; seed < 500; ++seed) {
        std::vector<generator> of_lanes, of_packet;
        for (int at = 0; at < L::size; ++at)
            of_lanes.emplace_back(seed * 64 + static_cast<std::uint64_t>(at));
        of_packet = of_lanes;
        const auto packets = every_call<P, T>(heuristic, use, [&](T (*draw)(generator&)) {
            std::size_t at = 0;
            return filled<L>([&] { return draw(of_packet[at++]); });
        });
        for (int at = 0; at < L::size; ++at) {
            generator& g = of_lanes[static_cast<std::size_t>(at)];
            const auto alone =
                every_call<T, T>(heuristic, use, [&](T (*draw)(generator&)) { return draw(g); });
            REQUIRE(alone.size() == packets.size());
            for (std::size_t k = 0; k < alone.size(); ++k) {
                const T w = lane<L>(packets[k], at);
                worst.see(ulp_distance(w, alone[k]), static_cast<long long>(seed));
                within += w > T(0) && w < T(1);
            }
        }
    }
    return worst.error;
}

} // namespace

TEST_CASE("the recursion: each lane has the weights of a scalar, call by call") {
    for_each_library([](auto library) {
        using L = decltype(library);
        int within = 0;
        const double worst = std::max({worst_of_calls<L>(mis::power, mis::any_techniques(), within),
                                       worst_of_calls<L>(mis::balance, mis::connected_surfaces(), within),
                                       worst_of_calls<L>(mis::maximum, mis::any_techniques(), within)});
        std::printf("%s, %d lanes: recursion %.2f ulp from the scalar, %d weights within (0, 1)\n", L::name,
                    L::size, worst, within);
        CHECK(worst <= 2);
        CHECK(within > 2000 * L::size);
    });
}

TEST_CASE("dual numbers: derivatives of weights, by any input") {
    using D = dual<double>;
    const auto close = [](double x, double exact) {
        return std::fabs(x - exact) <= 1e-12 * (1 + std::fabs(exact));
    };
    generator g(4);
    for (int k = 0; k < 1000; ++k) {
        const double a = g.log_uniform<double>(-3, 3), b = g.log_uniform<double>(-3, 3);
        const D balance = mis::balance(D(a, 1), D(b)), power = mis::power(D(a, 1), D(b));
        CHECK(close(balance.derivative * a, a * b / ((a + b) * (a + b))));
        const double w = a * a / (a * a + b * b);
        CHECK(close(power.derivative * a, 2 * w * (1 - w)));
        D out[3];
        const D q[] = {D(a), D(b, 1), D(1)};
        mis::weights(mis::balance, q, out);
        CHECK(close(out[0].derivative * b, -a * b / ((a + b + 1) * (a + b + 1))));
        CHECK(close(out[0].derivative + out[1].derivative + out[2].derivative, 0));
    }
}

TEST_CASE("dual numbers: the recursion's derivatives are those of finite differences") {
    // Of every weight by the logarithm of one number after the other; the weights themselves are the
    // scalar's.
    using D = dual<double>;
    const auto draw = [](generator& g) { return g.log_uniform<double>(-1, 1); };
    const auto run = [&](auto make, auto heuristic) {
        // the same calls, with ordinary numbers only
        return every_call<std::decay_t<decltype(make(nullptr))>, double>(heuristic, mis::any_techniques(),
                                                                         make);
    };
    worst_case worst, values;
    int moved = 0;
    for (std::uint64_t seed = 0; seed < 20; ++seed)
        for (int varied = 0; varied < 60; ++varied) {
            const auto scalar_run = [&](double factor) {
                generator g(seed);
                int at = 0;
                return run(
                    [&](double (*)(generator&)) {
                        const double x = draw(g);
                        return at++ == varied ? x * factor : x;
                    },
                    mis::power);
            };
            generator g(seed);
            int at = 0;
            const auto duals = run(
                [&](double (*)(generator&)) {
                    const double x = draw(g);
                    return at++ == varied ? D(x, x) : D(x);
                },
                mis::power);
            const double h = 1e-5;
            const auto above = scalar_run(std::exp(h)), below = scalar_run(std::exp(-h)),
                       alone = scalar_run(1);
            for (std::size_t k = 0; k < duals.size(); ++k) {
                const double expected = (above[k] - below[k]) / (2 * h);
                worst.see(std::fabs(duals[k].derivative - expected), varied);
                values.see(std::fabs(duals[k].value - alone[k]), varied);
                moved += std::fabs(expected) > 1e-3;
            }
        }
    std::printf(
        "duals: derivatives within %.2g of differences, values within %.2g, %d derivatives above 0.001\n",
        worst.error, values.error, moved);
    CHECK(worst.error <= 1e-7);
    CHECK(values.error <= 1e-15);
    CHECK(moved > 1000);
}
