// SPDX-License-Identifier: MIT
#include "heuristics.hpp"

#include <array>
#include <cstdio>
#include <doctest/doctest.h>
#include <mis/heuristic.hpp>

using namespace test;
using oracle::heuristic_kind;

// Whether N densities are weighed in a wider type and rounded once: floats, but in heuristic_test_in_float.
template <class T> constexpr bool is_rounded_once = !std::is_same_v<mis::detail::weighing_t<T>, T>;

namespace {

// Pairs that matter: all pairs of special values, pairs from the whole range (mostly so far apart that one
// weight is 0), and pairs close enough for both weights to be felt.
template <class T> std::vector<std::array<T, 2>> pairs(int count, std::uint64_t seed) {
    std::vector<std::array<T, 2>> result;
    for (T a : special_values<T>())
        for (T b : special_values<T>())
            result.push_back({a, b});
    generator g(seed);
    while (static_cast<int>(result.size()) < count) {
        const T a = g.any<T>();
        result.push_back({a, g.any<T>()});
        const T close = a * static_cast<T>(std::pow(10.0, g.uniform(-4, 4)));
        if (close <= largest_finite<T>() && (subnormals || close >= std::numeric_limits<T>::min()))
            result.push_back({a, close});
    }
    return result;
}

struct pair_errors {
    worst_case weight, unity;
};

template <class T, class Heuristic>
pair_errors errors_of_pairs(const Heuristic& h, oracle::heuristic reference,
                            const std::vector<std::array<T, 2>>& inputs) {
    pair_errors worst;
    for (std::size_t k = 0; k < inputs.size(); ++k) {
        const auto [a, b] = inputs[k];
        const auto exact = oracle::weights(reference, inputs[k].data(), 2);
        const T first = h(a, b), second = h(b, a);
        const auto at = static_cast<long long>(k);
        worst.weight.see(std::max(error_of_two(first, exact[0]), error_of_two(second, exact[1])), at);
        const long double sum = static_cast<long double>(first) + static_cast<long double>(second);
        worst.unity.see(a > 0 || b > 0 ? unity_error<T>(sum) : static_cast<double>(sum) * hopeless, at);
    }
    return worst;
}

template <class T> const char* name = "float";
template <> const char* name<double> = "double";

template <class T> long double sum_of(const std::vector<T>& w) {
    long double sum = 0;
    for (T x : w)
        sum += static_cast<long double>(x);
    return sum;
}

template <class T> bool any_positive(const std::vector<T>& q) {
    return std::any_of(q.begin(), q.end(), [](T x) { return x > 0; });
}

template <class T> std::vector<T> weights_of(oracle::heuristic h, const std::vector<T>& q) {
    std::vector<T> w(q.size());
    switch (h.kind) {
    case heuristic_kind::average:
        mis::weights(mis::average, q, w);
        break;
    case heuristic_kind::balance:
        mis::weights(mis::balance, q, w);
        break;
    case heuristic_kind::power:
        mis::weights(mis::power_heuristic{h.parameter}, q, w);
        break;
    case heuristic_kind::cutoff:
        mis::weights(mis::cutoff_heuristic{h.parameter}, q, w);
        break;
    case heuristic_kind::maximum:
        mis::weights(mis::maximum, q, w);
        break;
    }
    return w;
}

const oracle::heuristic all_heuristics[] = {{heuristic_kind::average, 0},    {heuristic_kind::balance, 0},
                                            {heuristic_kind::power, 2},      {heuristic_kind::power, 5},
                                            {heuristic_kind::cutoff, 0.125}, {heuristic_kind::maximum, 0}};

} // namespace

TEST_CASE_TEMPLATE("two techniques over the whole range: within 2 + beta ulp", T, float, double) {
    const auto many = pairs<T>(1'000'000, 1), few = pairs<T>(100'000, 1);
    for_each_heuristic([&](const auto& h, oracle::heuristic reference) {
        const bool common =
            reference.kind == heuristic_kind::balance || reference.kind == heuristic_kind::power;
        const auto& inputs = common ? many : few;
        const pair_errors worst = errors_of_pairs<T>(h, reference, inputs);
        std::printf("two techniques, %s, heuristic %d: %.3f ulp, sum to 1 within %.3f epsilon\n", name<T>,
                    static_cast<int>(reference.kind), worst.weight.error, worst.unity.error);
        const double beta = beta_of(reference);
        CAPTURE(static_cast<int>(reference.kind));
        CAPTURE(inputs[static_cast<std::size_t>(std::max(worst.weight.sample, 0LL))][0]);
        CAPTURE(inputs[static_cast<std::size_t>(std::max(worst.weight.sample, 0LL))][1]);
        CHECK(worst.weight.error <= 2 + beta);
        CHECK(worst.unity.error <= 2);
    });
}

// What pow itself may be off, in ulp, beyond the first.
#ifdef __MINGW32__
constexpr double of_pow = 11;
#else
constexpr double of_pow = 0;
#endif

TEST_CASE_TEMPLATE("two techniques, power beta: within 2 + beta ulp", T, float, double) {
    const auto inputs = pairs<T>(40'000, 2);
    for (double beta :
         {1.0, 1.5, 2.0, 2.25, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.5, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0}) {
        const pair_errors worst =
            errors_of_pairs<T>(mis::power_heuristic{beta}, {heuristic_kind::power, beta}, inputs);
        CAPTURE(beta);
        CAPTURE(inputs[static_cast<std::size_t>(std::max(worst.weight.sample, 0LL))][0]);
        CAPTURE(inputs[static_cast<std::size_t>(std::max(worst.weight.sample, 0LL))][1]);
        CHECK(worst.weight.error <= 2 + beta + of_pow);
        CHECK(worst.unity.error <= 2);
    }
}

TEST_CASE_TEMPLATE("N <= 64 techniques over the whole range: within N ulp, summing to 1", T, float, double) {
    for (const oracle::heuristic h : all_heuristics) {
        generator g(3);
        worst_case weight_over_n, unity_over_n, single;
        for (int sample = 0; sample < 5'000; ++sample) {
            const int count = g.integer(1, 64);
            const auto q = random_densities<T>(g, count);
            const auto exact = oracle::weights(h, q.data(), count);
            const auto w = weights_of(h, q);
            const double beta = beta_of(h);
            const double bound = is_rounded_once<T> ? count : count + beta;
            for (int i = 0; i < count; ++i)
                weight_over_n.see(
                    ulp_error(w[static_cast<std::size_t>(i)], exact[static_cast<std::size_t>(i)]) / bound,
                    sample);
            const int i = g.integer(0, count - 1);
            T one = 0;
            for_each_heuristic([&](const auto& library, oracle::heuristic reference) {
                if (reference.kind == h.kind && reference.parameter == h.parameter)
                    one = mis::weight(library, q, i);
            });
            if (h.parameter != 5) // for_each_heuristic has no such power
                single.see(ulp_error(one, exact[static_cast<std::size_t>(i)]) / bound, sample);
            unity_over_n.see(any_positive(q) ? unity_error<T>(sum_of(w)) / bound
                                             : static_cast<double>(sum_of(w)) * hopeless,
                             sample);
        }
        CAPTURE(static_cast<int>(h.kind));
        CAPTURE(weight_over_n.sample);
        CHECK(weight_over_n.error <= 1);
        CHECK(unity_over_n.error <= 1);
        CHECK(single.error <= 1);
    }
}

TEST_CASE_TEMPLATE("edge cases of all heuristics", T, float, double) {
    const T inf = from_bits<T>(oracle::infinity_bits<T>), max = largest_finite<T>(),
            min = std::numeric_limits<T>::min();
    const auto expect = [](oracle::heuristic h, std::vector<T> q, std::vector<T> expected) {
        const auto w = weights_of(h, q);
        for (std::size_t i = 0; i < q.size(); ++i) {
            CAPTURE(static_cast<int>(h.kind));
            CAPTURE(i);
            CHECK(bits_of(w[i]) == bits_of(expected[i]));
        }
    };
    for (const oracle::heuristic h : all_heuristics) {
        expect(h, {T(0)}, {T(0)});
        expect(h, {T(0), T(0), T(0)}, {T(0), T(0), T(0)});
        expect(h, {min}, {T(1)});
        expect(h, {max}, {T(1)});
        expect(h, {inf}, {T(1)});
        expect(h, {T(0), min, T(0)}, {T(0), T(1), T(0)});
        expect(h, {max, max}, {T(0.5), T(0.5)});
        expect(h, {min, min, min, min}, {T(0.25), T(0.25), T(0.25), T(0.25)});
        expect(h, {T(3), inf, max}, {T(0), T(1), T(0)});
        expect(h, {inf, T(1), inf, T(0), inf, inf}, {T(0.25), T(0), T(0.25), T(0), T(0.25), T(0.25)});
        if (subnormals) {
            const T least = from_bits<T>(1);
            expect(h, {least, least}, {T(0.5), T(0.5)});
            expect(h, {T(0), least}, {T(0), T(1)});
        }
    }
    expect({heuristic_kind::average, 0}, {max, min, T(0), T(1)},
           {T(1) / T(3), T(1) / T(3), T(0), T(1) / T(3)});
    // Not {0.5, 0.5, 0, 0}, of which GCC 12 makes four times 0.5 where it has AVX-512.
    expect({heuristic_kind::maximum, 0}, {max, T(0), max, T(1)}, {T(0.5), T(0), T(0.5), T(0)});
    expect({heuristic_kind::cutoff, 0.25}, {T(1), T(4), T(0.99)}, {T(0.2), T(0.8), T(0)});
    expect({heuristic_kind::cutoff, 1}, {T(1), T(4), T(4)}, {T(0), T(0.5), T(0.5)});
    expect({heuristic_kind::cutoff, 0}, {T(1), T(3), T(0)}, {T(0.25), T(0.75), T(0)});
    expect({heuristic_kind::power, 2}, {max, max / 2, T(0)}, {T(0.8), T(0.2), T(0)});
}

TEST_CASE("a technique's share at the cutoff: densities exactly at alpha times the largest are kept") {
    // The two-technique form and the form for N agree at the threshold.
    for (float largest : {1e-30f, 1.0f, 3e37f}) {
        CHECK(mis::cutoff_heuristic{0.125}(largest, largest / 8) == doctest::Approx(8.0 / 9));
        CHECK(mis::cutoff_heuristic{0.125}(largest, largest / 8 * 0.999f) == 1);
        CHECK(mis::cutoff_heuristic{0.125}(largest / 8 * 0.999f, largest) == 0);
    }
}

TEST_CASE_TEMPLATE("the order of techniques does not matter", T, float, double) {
    for (const oracle::heuristic h : all_heuristics) {
        generator g(4);
        worst_case worst;
        for (int sample = 0; sample < 2'000; ++sample) {
            const int count = g.integer(2, 64);
            const auto q = random_densities<T>(g, count);
            std::vector<std::size_t> order(q.size());
            for (std::size_t i = 0; i < order.size(); ++i)
                order[i] = i;
            for (std::size_t i = order.size() - 1; i > 0; --i)
                std::swap(order[i], order[static_cast<std::size_t>(g.integer(0, static_cast<int>(i)))]);
            std::vector<T> shuffled;
            for (std::size_t i : order)
                shuffled.push_back(q[i]);
            const auto w = weights_of(h, q), ws = weights_of(h, shuffled);
            for (std::size_t i = 0; i < order.size(); ++i)
                worst.see(ulp_distance(ws[i], w[order[i]]) / count, sample);
        }
        CAPTURE(static_cast<int>(h.kind));
        CHECK(worst.error <= 1);
    }
}

TEST_CASE_TEMPLATE("balance: splitting a technique's samples in two leaves every weight as it was", T, float,
                   double) {
    generator g(5);
    worst_case worst;
    for (int sample = 0; sample < 5'000; ++sample) {
        const int count = g.integer(2, 32);
        std::vector<T> q;
        for (int i = 0; i < count; ++i)
            q.push_back(g.log_uniform<T>(-8, 8));
        const auto split_at = static_cast<std::size_t>(g.integer(0, count - 1));
        std::vector<T> split = q;
        const T part = q[split_at] * T(0.25);
        split[split_at] = part;
        split.push_back(q[split_at] - part);
        const auto w = weights_of({heuristic_kind::balance, 0}, q),
                   ws = weights_of({heuristic_kind::balance, 0}, split);
        for (std::size_t i = 0; i < q.size(); ++i)
            worst.see(ulp_distance(i == split_at ? ws[i] + ws.back() : ws[i], w[i]) / (count + 1), sample);
    }
    CHECK(worst.error <= 2); // each side may be N + 1 ulp off
}

TEST_CASE("every way to call") {
    const float array[3] = {1, 2, 5};
    float out[3];
    mis::weights(mis::balance, array, out);
    CHECK(out[2] == 0.625f);
    CHECK(mis::weight(mis::balance, array, 1) == 0.25f);
    CHECK(mis::weight(mis::balance, &array[0], 2, 1) == doctest::Approx(2.0 / 3));

    std::array<double, 2> q{1, 3}, w{};
    mis::weights(mis::power, q, w);
    CHECK(w[0] == doctest::Approx(0.1));
    mis::weights(mis::balance, q, q); // in place
    CHECK(q[1] == 0.75);

    CHECK(mis::power(3.0f, 1.0f) == 0.9f);
    CHECK(mis::balance(3.0, 1.0) == 0.75);
    CHECK(mis::maximum(3.0f, 3.0f) == 0.5f);
    CHECK(mis::average(3.0f, 1e-30f) == 0.5f);
    CHECK(mis::cutoff(100.0f, 1.0f) == 1.0f);
    CHECK(mis::power_heuristic{1}(3.0, 1.0) == 0.75);
    static_assert(mis::power(3.0f, 1.0f) > 0.89f, "usable in constant expressions");
}
