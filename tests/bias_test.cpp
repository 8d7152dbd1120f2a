// SPDX-License-Identifier: MIT
#include "ulp.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <doctest/doctest.h>
#include <mis/bias.hpp>
#include <mis/heuristic.hpp>

using namespace test;

namespace {

// [H] 14 as it is printed, and its limits.
wide exact_density(const wide& q, const wide& r, const wide& a) {
    if (r.zero())
        return q;
    if (r.infinite) // nothing but bias
        return {};
    if (q.infinite)
        return wide{1} / (a * r * r);
    const wide variance = wide{1} + r;
    return q / (variance * variance + q * a * r * r);
}

template <class T> const char* name = "float";
template <> const char* name<double> = "double";

#ifdef __FAST_MATH__
constexpr bool fast_math = true;
#else
constexpr bool fast_math = false;
#endif

// Whatever bias_aware_density accepts: the whole range, and in double under -ffast-math 1e-60 .. 1e60.
template <class T> T any_number(generator& g) {
    return fast_math && sizeof(T) == sizeof(double) ? g.log_uniform<T>(-60, 60) : g.any<T>();
}

template <class T> bool is_allowed(T x) {
    return !fast_math || sizeof(T) == sizeof(float) || x == T(0) || is_infinite(x) ||
           (x >= T(1e-60) && x <= T(1e60));
}

template <class T> bool is_subnormal(T x) {
    return bits_of(x) != 0 && bits_of(x) < oracle::min_normal_bits<T>;
}

// Density, relative bias and measure: all special values with one another, the whole range, and numbers so
// close that both terms of the denominator are felt.
template <class T> std::vector<std::array<T, 3>> inputs(int count, std::uint64_t seed) {
    std::vector<std::array<T, 3>> result;
    for (T q : special_values<T>())
        for (T r : special_values<T>())
            for (T a : special_values<T>())
                if (is_allowed(q) && is_allowed(r) && is_allowed(a) && !is_subnormal(a))
                    result.push_back({q, r, a});
    generator g(seed);
    while (static_cast<int>(result.size()) < count) {
        const T q = any_number<T>(g), r = any_number<T>(g), a = any_number<T>(g);
        if (!is_subnormal(a))
            result.push_back({q, r, a});
        const T near_r = g.log_uniform<T>(-6, 3), near_a = g.log_uniform<T>(-3, 3);
        result.push_back({g.log_uniform<T>(-6, 12), near_r, near_a});
    }
    return result;
}

template <class T> T density_of(const std::array<T, 3>& x) {
    return mis::bias_aware_density(x[0], x[1], x[2]);
}

} // namespace

TEST_CASE_TEMPLATE("[H] 14 over the whole range", T, float, double) {
    const auto many = inputs<T>(1'000'000, 1);
    worst_case worst;
    for (std::size_t k = 0; k < many.size(); ++k) {
        const auto& [q, r, a] = many[k];
        // where the exact value is beyond the type's range, infinity is the nearest number
        const wide exact = exact_density(q, r, a);
        const T computed = density_of(many[k]);
        const bool overflows = !exact.infinite && exact.exponent > std::numeric_limits<T>::max_exponent;
        worst.see(overflows && is_infinite(computed) ? 0 : ulp_error(computed, exact),
                  static_cast<long long>(k));
    }
    std::printf("bias-aware density, %s: %.3f ulp\n", name<T>, worst.error);
    const auto& at = many[static_cast<std::size_t>(std::max(worst.sample, 0LL))];
    CAPTURE(at[0]);
    CAPTURE(at[1]);
    CAPTURE(at[2]);
    // rounded once in float; seven roundings in double
    CHECK(worst.error <= (sizeof(T) == sizeof(float) ? 0.501 : 7));
}

TEST_CASE_TEMPLATE("without bias the weights are balance's to the last bit", T, float, double) {
    generator g(2);
    int different = 0;
    for (int sample = 0; sample < 100'000; ++sample) {
        const T a = g.any<T>(), b = g.any<T>(), measure = g.any<T>();
        const T aware = mis::bias_aware_density(b, T(0), measure);
        different += bits_of(aware) != bits_of(b);
        different += bits_of(mis::balance(a, aware)) != bits_of(mis::balance(a, b));
        different += bits_of(mis::balance(aware, a)) != bits_of(mis::balance(b, a));
    }
    CHECK(different == 0);
}

TEST_CASE_TEMPLATE("limits", T, float, double) {
    const T inf = from_bits<T>(oracle::infinity_bits<T>);
    const auto is = [](T computed, T expected) { return bits_of(computed) == bits_of(expected); };
    CHECK(is(mis::bias_aware_density(inf, T(0.5), T(2)), T(2)));       // 1 / (A r^2)
    CHECK(is(mis::bias_aware_density(inf, T(0), T(2)), inf));          // a Dirac technique without bias
    CHECK(is(mis::bias_aware_density(inf, T(0), inf), inf));           // r = 0 whatever the measure
    CHECK(is(mis::bias_aware_density(T(0), T(0.5), T(2)), T(0)));      // cannot make the sample
    CHECK(is(mis::bias_aware_density(T(0), inf, inf), T(0)));          //
    CHECK(is(mis::bias_aware_density(T(3), inf, T(2)), T(0)));         // f = 0: nothing but bias
    CHECK(is(mis::bias_aware_density(inf, inf, T(2)), T(0)));          //
    CHECK(is(mis::bias_aware_density(inf, T(0.5), inf), T(0)));        // an infinite domain
    CHECK(is(mis::bias_aware_density(T(3), T(0.5), inf), T(0)));       //
    CHECK(is(mis::bias_aware_density(T(9), T(0.5), T(0)), T(4)));      // only (1 + r)^2
    CHECK(is(mis::bias_aware_density(inf, T(0.5), T(0)), inf));        //
    CHECK(is(mis::bias_aware_density(T(2), T(1), T(2)), T(2) / T(8))); // 2 / (4 + 4)
    static_assert(mis::bias_aware_density(T(2), T(1), T(2)) == T(0.25), "usable in constant expressions");
}

TEST_CASE("intermediate products may leave the range where the result does not") {
    if (fast_math)
        return;
    CHECK(mis::bias_aware_density(1e308, 1e200, 1e-100) == doctest::Approx(1e-92).epsilon(1e-14));
    CHECK(mis::bias_aware_density(1e300, 1e-3, 1e300) == doctest::Approx(1e-294).epsilon(1e-14));
    CHECK(mis::bias_aware_density(1e300, 1e-200, 1e300) == doctest::Approx(1e100).epsilon(1e-14));
    CHECK(mis::bias_aware_density(1e308, 1e-308, 1e308) == doctest::Approx(5e307).epsilon(1e-14));
    CHECK(mis::bias_aware_density(3e38f, 1e30f, 1e-30f) == doctest::Approx(3e38 / 1e60).epsilon(1e-7));
}

TEST_CASE_TEMPLATE("more bias, never more density; more density, never less", T, float, double) {
    generator g(3);
    const double rounding = 8 * std::numeric_limits<T>::epsilon();
    int wrong = 0, far_apart = 0;
    for (int sample = 0; sample < 200'000; ++sample) {
        const T q = g.log_uniform<T>(-6, 12), r = g.log_uniform<T>(-6, 3), a = g.log_uniform<T>(-3, 3);
        const T here = mis::bias_aware_density(q, r, a);
        const T biased = mis::bias_aware_density(q, r * 2, a), denser = mis::bias_aware_density(q * 2, r, a);
        const T larger = mis::bias_aware_density(q, r, a * 2);
        const auto above = [&](T x, T y) { return double(x) > double(y) * (1 + rounding); };
        wrong += above(biased, here) || above(here, denser) || above(larger, here) || above(here, q);
        // the limit from below
        wrong += above(here, static_cast<T>(1 / (double(a) * double(r) * double(r))));
        far_apart += double(biased) < 0.5 * double(here);
    }
    CHECK(wrong == 0);
    CHECK(far_apart > 10'000); // the inputs are such that it matters
}

TEST_CASE_TEMPLATE("several techniques, each with its own bias and measure", T, float, double) {
    generator g(4);
    worst_case densities, weights;
    for (int sample = 0; sample < 20'000; ++sample) {
        const int count = g.integer(1, 16);
        std::vector<T> q, r, a;
        std::vector<wide> exact;
        wide sum;
        for (int i = 0; i < count; ++i) {
            q.push_back(g.log_uniform<T>(-3, 6));
            r.push_back(g.chance(0.4) ? T(0) : g.log_uniform<T>(-4, 1));
            a.push_back(g.log_uniform<T>(-2, 2));
            exact.push_back(exact_density(q.back(), r.back(), a.back()));
            sum = sum + exact.back();
        }
        std::vector<T> out(q.size()), w(q.size()), in_place = r;
        mis::bias_aware_densities(q.data(), r.data(), a.data(), count, out.data());
        mis::bias_aware_densities(q.data(), in_place.data(), a.data(), count, in_place.data());
        mis::weights(mis::balance, out, w);
        for (std::size_t i = 0; i < q.size(); ++i) {
            densities.see(ulp_error(out[i], exact[i]), sample);
            densities.see(ulp_distance(in_place[i], out[i]), sample);
            weights.see(ulp_error(w[i], exact[i] / sum) / count, sample);
        }
    }
    CHECK(densities.error <= 7);
    CHECK(weights.error <= 10); // N ulp of the weights, and those of the densities
}

TEST_CASE_TEMPLATE("progressive radius: the closed form, and the recurrence that approaches it", T, float,
                   double) {
    const double epsilon = std::numeric_limits<T>::epsilon();
    for (T alpha : {T(0.1), T(0.5), mis::optimal_alpha<T>, T(0.9), T(1)}) {
        CAPTURE(alpha);
        const double a = double(alpha);
        T squared = T(0.25); // r_1 = 0.5
        double worst_recurrence = 0, worst_closed = 0;
        for (long long i = 1; i <= 10'000; ++i) {
            // prod (k + alpha) / (k + 1) over k < i, in one piece
            const double product =
                0.25 * std::exp(std::lgamma(double(i) + a) - std::lgamma(1 + a) - std::lgamma(double(i) + 1));
            const auto closed = double(0.5L * std::exp(std::log(static_cast<long double>(i)) * (a - 1) / 2));
            const double radius = double(mis::progressive_radius(T(0.5), i, alpha));
            worst_recurrence = std::max(worst_recurrence, std::fabs(double(squared) / product - 1));
            worst_closed = std::max(worst_closed, std::fabs(radius / closed - 1));
            squared = mis::next_squared_radius(squared, i, alpha);
        }
        CHECK(worst_closed <= 4 * epsilon);
        CHECK(worst_recurrence <= 1e-10 + 100 * epsilon); // roundings of 10,000 steps, and lgamma's
        const double radius = double(mis::progressive_radius(T(0.5), 10'001, alpha));
        CHECK(double(squared) / (radius * radius) == doctest::Approx(1 / std::tgamma(1 + a)).epsilon(1e-4));
    }
    CHECK(mis::progressive_radius(T(3), 1) == T(3));
    CHECK(double(mis::progressive_radius(T(3), 8)) == doctest::Approx(3 / std::sqrt(2.0)));
    CHECK(double(mis::next_squared_radius(T(3), 1)) == doctest::Approx(3 * 5.0 / 6));
    CHECK(double(mis::optimal_alpha<T>) == doctest::Approx(2 * (1 - double(mis::optimal_alpha<T>))));
}

TEST_CASE("the bound of the gap") {
    CHECK(mis::balance_gap_bound(4.0, 8.0, 3.0) == 1.125); // (1/4 - 1/8) 9
    CHECK(mis::balance_gap_bound(4.0f, 4.0f, 3.0f) == 0);  // one technique has nothing to gain
}
