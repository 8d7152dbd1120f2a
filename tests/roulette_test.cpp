// SPDX-License-Identifier: MIT
#include "../examples/studies/zero_variance_model.hpp"
#include "random_paths.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <doctest/doctest.h>
#include <mis/heuristic.hpp>
#include <mis/roulette.hpp>
#include <mis/verify/subpaths.hpp>

#include <vector>

using namespace test;

namespace {

template <class T> T not_a_number() { return from_bits<T>(oracle::infinity_bits<T> + 1); }

// All that learned numbers may be.
template <class T> std::vector<T> any_values() {
    std::vector<T> values = special_values<T>();
    const std::size_t positive = values.size();
    for (std::size_t i = 0; i < positive; ++i) // the sign by its bit, because -ffast-math may know no -0
        values.push_back(from_bits<T>(bits_of(values[i]) | oracle::sign_bit<T>));
    values.push_back(not_a_number<T>());
    values.push_back(from_bits<T>(bits_of(not_a_number<T>()) | oracle::sign_bit<T>));
    return values;
}
template <class T> T magnitude(T x) { return from_bits<T>(bits_of(x) & ~oracle::sign_bit<T>); }
template <class T> bool is_known(T x) { return oracle::is_finite(x); }

// A random number as it may come: of the whole range, of any sign, sometimes none.
template <class T> T any_number(generator& g) {
    const T x = g.chance(0.01) ? not_a_number<T>() : g.any<T>();
    return g.chance(0.2) ? from_bits<T>(bits_of(x) | oracle::sign_bit<T>) : x;
}

// Numbers in [1e-70, 1e70], and 0, are what rates are made from.
template <class T> wide limited(T x) {
    const wide a(magnitude(x)), least(1e-70), most(1e70);
    return a.zero() ? a : a < least ? least : most < a ? most : a;
}

wide between(const wide& x, double least, double most) {
    return x < wide(least) ? wide(least) : wide(most) < x ? wide(most) : x;
}

// nu Psi / I, [V] 17, in the window and the bounds.
template <class T>
wide exact_adjoint_rate(T weight, T adjoint, T estimate, const mis::weight_window<T>& window,
                        const mis::rate_bounds<T>& bounds) {
    if (!is_known(weight) || !is_known(adjoint) || !is_known(estimate) || limited(estimate).zero())
        return wide(1);
    const wide r = limited(weight) * limited(adjoint) / limited(estimate);
    const wide rate = r < wide(window.lower)   ? r / wide(window.lower)
                      : wide(window.upper) < r ? r / wide(window.upper)
                                               : wide(1);
    return between(rate, static_cast<double>(bounds.least), static_cast<double>(bounds.most));
}

wide square_root(const wide& x) {
    if (x.zero())
        return x;
    const long even = x.exponent - (x.exponent & 1);
    return wide::scaled(std::sqrt(std::ldexp(x.mantissa, static_cast<int>(x.exponent - even))), even / 2);
}

// nu sqrt(V / C) sqrt(C_I / V_I), or 1.
template <class T> wide exact_factor(T weight, T variance, T cost, const mis::image_estimate<T>& image) {
    for (T x : {weight, variance, cost, image.variance, image.cost})
        if (!is_known(x))
            return wide(1);
    for (T x : {cost, image.variance, image.cost})
        if (limited(x).zero())
            return wide(1);
    return limited(weight) * square_root(limited(variance) / limited(cost)) *
           square_root(limited(image.cost) / limited(image.variance));
}
template <class T>
wide exact_efficiency_rate(T weight, const mis::walk_estimate<T>& here, const mis::image_estimate<T>& image,
                           const mis::rate_bounds<T>& bounds) {
    const wide by_moment = exact_factor(weight, here.second_moment, here.cost, image);
    const wide by_variance = exact_factor(weight, here.variance, here.cost, image);
    const wide rate = !(wide(1) < by_moment) ? by_moment : !(by_variance < wide(1)) ? by_variance : wide(1);
    return between(rate, static_cast<double>(bounds.least), static_cast<double>(bounds.most));
}

// A rate, as computed: never out of bounds.
template <class T> bool is_bounded(T rate, const mis::rate_bounds<T>& bounds) {
    return !is_nan(rate) && !oracle::is_negative(rate) && bits_of(rate) >= bits_of(bounds.least) &&
           bits_of(rate) <= bits_of(bounds.most);
}

template <class T> constexpr mis::rate_bounds<T> standard{};

} // namespace

TEST_CASE_TEMPLATE("rates by the adjoint are nu Psi / I in the window, over the whole range", T, float,
                   double) {
    generator g(1);
    worst_case worst;
    bool bounded = true;
    for (int k = 0; k < 1'000'000; ++k) {
        const bool ordinary_numbers = g.chance(0.5);
        const auto number = [&] { return ordinary_numbers ? g.log_uniform<T>(-2, 2) : any_number<T>(g); };
        const T weight = number(), adjoint = number(), estimate = number();
        const mis::weight_window<T> window =
            g.chance(0.3) ? mis::weight_window<T>{} : mis::window_of_size(T(1) + g.log_uniform<T>(-2, 2));
        const mis::rate_bounds<T> bounds =
            g.chance(0.5) ? standard<T>
                          : mis::rate_bounds<T>{g.log_uniform<T>(-6, 0), g.log_uniform<T>(0, 6)};
        const T rate = mis::adjoint_rate(weight, adjoint, estimate, window, bounds);
        bounded = bounded && is_bounded(rate, bounds);
        worst.see(ulp_error(rate, exact_adjoint_rate(weight, adjoint, estimate, window, bounds)), k);
    }
    CHECK(bounded);
    // One division more than the formula has, in double for float; three in double, and -ffast-math's
    // reciprocals.
    CHECK_MESSAGE(worst.error <= (sizeof(T) == 4 ? 1 : 4), "sample ", worst.sample);
}

TEST_CASE_TEMPLATE("a played walk's weight is in the window", T, float, double) {
    generator g(2);
    const mis::rate_bounds<T> bounds{T(1e-6), T(1e5)};
    worst_case worst;
    for (int k = 0; k < 100'000; ++k) {
        const T weight = g.log_uniform<T>(-2, 2), adjoint = g.log_uniform<T>(-1, 1), estimate = T(0.7);
        const auto window = mis::window_of_size(T(1) + g.log_uniform<T>(-2, 1));
        const T rate = mis::adjoint_rate(weight, adjoint, estimate, window, bounds);
        const T relative = weight / rate * adjoint / estimate;
        worst.see(std::max(static_cast<double>(window.lower - relative),
                           static_cast<double>(relative - window.upper)),
                  k);
        if (rate == T(1))
            continue;
        // Played against up to the lower bound, and split down to the upper one.
        const T edge = rate < T(1) ? window.lower : window.upper;
        worst.see(static_cast<double>(std::fabs(relative - edge) / edge), k);
    }
    CHECK(worst.error <= 8 * std::numeric_limits<T>::epsilon());
    CHECK(mis::window_of_size(T(5)).lower == T(2) / T(6)); // as the authors of [V] have it
    CHECK(mis::window_of_size(T(5)).upper == doctest::Approx(10.0 / 6));
    CHECK(mis::window_of_size(T(1)).lower == T(1));
    CHECK(mis::window_of_size(T(1)).upper == T(1));
}

TEST_CASE_TEMPLATE("rates by efficiency, over the whole range", T, float, double) {
    generator g(3);
    worst_case worst, worst_technique;
    int below = 0, between_both = 0, above = 0;
    for (int k = 0; k < 1'000'000; ++k) {
        const bool ordinary_numbers = g.chance(0.5);
        const auto number = [&] { return ordinary_numbers ? g.log_uniform<T>(-1, 1) : any_number<T>(g); };
        const T weight = number();
        mis::walk_estimate<T> here{number(), number(), number()};
        if (ordinary_numbers)
            here.second_moment += here.variance;
        const mis::image_estimate<T> image{number(), number()};
        const T rate = mis::efficiency_rate(weight, here, image);
        const wide exact = exact_efficiency_rate(weight, here, image, standard<T>);
        // Where q_E is 1 but for rounding, it may be on either side of it: below, it counts, above it q_V.
        const wide by_moment = exact_factor(weight, here.second_moment, here.cost, image);
        const wide by_variance = exact_factor(weight, here.variance, here.cost, image);
        double error = ulp_error(rate, exact);
        if (wide(1 - 1e-12) < by_moment && by_moment < wide(1 + 1e-12))
            error = std::min({error, ulp_error(rate, wide(1)), ulp_error(rate, between(by_variance, 1, 32))});
        worst.see(error, k);
        if (ordinary_numbers)
            ++(rate < T(1) ? below : rate > T(1) ? above : between_both);
        worst_technique.see(ulp_error(mis::technique_rate(weight, here.variance, here.cost, image),
                                      between(by_variance, 1 / 32.0, 32)),
                            k);
    }
    CHECK_MESSAGE(worst.error <= (sizeof(T) == 4 ? 1 : 6), "sample ", worst.sample);
    CHECK_MESSAGE(worst_technique.error <= (sizeof(T) == 4 ? 1 : 6), "sample ", worst_technique.sample);
    CHECK(std::min({below, between_both, above}) > 10'000); // all three cases
}

TEST_CASE_TEMPLATE("whatever a guess is, the rate is bounded and the estimate unbiased", T, float, double) {
    const auto values = any_values<T>();
    // Copies over a fine grid of u: their mean is the rate, so that each rate's copies carry the whole
    // weight.
    const auto mean_copies = [](T rate) {
        constexpr int steps = 1 << 12;
        long long sum = 0;
        for (int i = 0; i < steps; ++i)
            sum += mis::copies(rate, T(i) / T(steps));
        return static_cast<double>(sum) / steps;
    };
    bool bounded = true, one_where_unknown = true, least_where_nothing = true;
    std::vector<T> rates;
    for (T weight : values)
        for (T adjoint : values)
            for (T estimate : values) {
                const T rate = mis::adjoint_rate(weight, adjoint, estimate, mis::window_of_size(T(5)));
                bounded = bounded && is_bounded(rate, standard<T>);
                const bool known = is_known(weight) && is_known(adjoint) && is_known(estimate) &&
                                   bits_of(magnitude(estimate)) != 0;
                if (!known)
                    one_where_unknown = one_where_unknown && rate == T(1);
                else if (bits_of(magnitude(weight)) == 0 || bits_of(magnitude(adjoint)) == 0)
                    least_where_nothing = least_where_nothing && rate == standard<T>.least;
                rates.push_back(rate);
                const mis::image_estimate<T> image{estimate, weight};
                rates.push_back(mis::efficiency_rate(weight, {adjoint, estimate, weight}, image));
                rates.push_back(mis::efficiency_rate(weight, {adjoint, weight, estimate}, {T(1), T(1)}));
                rates.push_back(mis::technique_rate(weight, adjoint, estimate, {T(1), T(1)}));
                rates.push_back(mis::technique_rate(T(1), T(1), T(1), {adjoint, estimate}));
                for (std::size_t i = rates.size() - 4; i < rates.size(); ++i)
                    bounded = bounded && is_bounded(rates[i], standard<T>);
            }
    CHECK(bounded);
    CHECK(one_where_unknown);
    CHECK(least_where_nothing);
    std::sort(rates.begin(), rates.end());
    rates.erase(std::unique(rates.begin(), rates.end()), rates.end());
    double worst = 0;
    for (T rate : rates)
        worst = std::max(worst, std::fabs(mean_copies(rate) - static_cast<double>(rate)));
    CHECK(rates.size() > 10);
    CHECK(worst <= 0x1p-12);
    CHECK(standard<T>.most == T(32)); // the cap that the header states
}

TEST_CASE_TEMPLATE("copies are the rate rounded down or up, and on average the rate", T, float, double) {
    generator g(4);
    bool whole = true;
    double worst = 0;
    for (int k = 0; k < 2'000; ++k) {
        const T rate = k < 40 ? T(k) / T(2) : g.log_uniform<T>(-3, 4);
        const int floor = static_cast<int>(rate);
        constexpr int steps = 1 << 10;
        long long sum = 0;
        for (int i = 0; i < steps; ++i) {
            const int n = mis::copies(rate, (T(i) + T(0.5)) / T(steps));
            whole = whole && (n == floor || n == floor + 1);
            sum += n;
        }
        worst = std::max(worst, std::fabs(static_cast<double>(sum) / steps - static_cast<double>(rate)));
    }
    CHECK(whole);
    CHECK(worst <= 0.5 / (1 << 10) + 1e-9);
    CHECK(mis::copies(T(0), T(0)) == 0);
    CHECK(mis::copies(T(3), T(0)) == 3);
    CHECK(mis::copies(T(3), T(1) - std::numeric_limits<T>::epsilon()) == 3);
#ifdef NDEBUG // a caller's bug, asserted elsewhere: one copy, and no more than 2^20 + 1
    CHECK(mis::copies(not_a_number<T>(), T(0.5)) == 1);
    CHECK(mis::copies(from_bits<T>(oracle::infinity_bits<T>), T(0.5)) == 1);
    CHECK(mis::copies(largest_finite<T>(), T(0.5)) <= (1 << 20) + 1);
#endif
}

TEST_CASE_TEMPLATE("statistics are those of two passes, however they are merged", T, float, double) {
    generator g(5);
    const double tolerance = sizeof(T) == 4 ? 2e-4 : 1e-11;
    for (int trial = 0; trial < 200; ++trial) {
        const int n = g.integer(1, 200), parts = g.integer(1, 8);
        const double offset = g.uniform(-3, 3);
        std::vector<mis::running_statistics<T>> part(static_cast<std::size_t>(parts));
        std::vector<std::array<double, 3>> all;
        for (int i = 0; i < n; ++i) {
            const std::array<T, 3> x{T(offset + g.uniform()), g.log_uniform<T>(-1, 1),
                                     g.log_uniform<T>(-1, 1)};
            part[static_cast<std::size_t>(g.integer(0, parts - 1))].add(x[0], x[1], x[2]);
            all.push_back({double(x[0]), double(x[1]), double(x[2])});
        }
        mis::running_statistics<T> sum;
        for (const auto& p : part) {
            sum += p;
            sum += mis::running_statistics<T>{}; // adds nothing
        }
        double weight = 0, mean = 0, cost = 0, second = 0, squares = 0;
        for (const auto& [value, c, w] : all) {
            weight += w, mean += w * value, cost += w * c;
        }
        mean /= weight, cost /= weight;
        for (const auto& [value, c, w] : all)
            squares += w * (value - mean) * (value - mean) / weight, second += w * value * value / weight;
        const auto agrees = [&](T a, double b) {
            return std::fabs(double(a) - b) <= tolerance * (1 + std::fabs(b));
        };
        REQUIRE(agrees(sum.weight, weight));
        REQUIRE(agrees(sum.mean, mean));
        REQUIRE(agrees(mis::variance(sum), squares));
        REQUIRE(agrees(mis::second_moment(sum), second));
        REQUIRE(agrees(mis::mean_cost(sum), cost));
        const auto here =
            mis::estimate_of(mis::scaled(sum, T(0.25))); // forgets how sure it was, and nothing else
        REQUIRE(agrees(here.variance, squares));
        REQUIRE(agrees(here.second_moment, second));
        REQUIRE(agrees(here.cost, cost));
    }
}

TEST_CASE_TEMPLATE("statistics leave out what is no number", T, float, double) {
    mis::running_statistics<T> s;
    CHECK(mis::variance(s) == T(0));
    CHECK(mis::mean_cost(s) == T(0));
    s.add(T(1), T(2)), s.add(T(3), T(4));
    const auto before = s;
    for (T bad : {not_a_number<T>(), from_bits<T>(oracle::infinity_bits<T>),
                  from_bits<T>(oracle::infinity_bits<T> | oracle::sign_bit<T>)}) {
        s.add(bad, T(1)), s.add(T(1), bad), s.add(T(1), T(1), bad);
    }
    s.add(T(5), T(5), T(0)), s.add(T(5), T(5), T(-1));
    CHECK(s.weight == before.weight);
    CHECK(mis::variance(s) == T(1));
    CHECK(s.mean == T(2));
    CHECK(mis::mean_cost(s) == T(3));
}

TEST_CASE_TEMPLATE("a mean without the largest values", T, float, double) {
    generator g(6);
    double worst = 0;
    for (int trial = 0; trial < 300; ++trial) {
        const int n = g.integer(1, 400), parts = g.integer(1, 5);
        std::vector<mis::trimmed_mean<T>> part(static_cast<std::size_t>(parts));
        std::vector<double> values;
        for (int i = 0; i < n; ++i) {
            // Of two values in each range at most, so that what the range's mean stands for is known.
            const T x = g.chance(0.05) ? T(0) : T(std::ldexp(1.0, 2 * g.integer(-20, 20)));
            part[static_cast<std::size_t>(g.integer(0, parts - 1))].add(x);
            values.push_back(double(x));
        }
        for (int i = 1; i < parts; ++i)
            part[0] += part[static_cast<std::size_t>(i)];
        const double share = trial % 4 == 0 ? 0 : g.uniform(0, 0.9);
        std::sort(values.begin(), values.end());
        double left = share * n, sum = 0, weight = 0; // of the largest, some part of one, too
        for (std::size_t i = values.size(); i-- > 0;) {
            const double kept = std::max(0.0, 1 - left);
            left = std::max(0.0, left - 1);
            sum += kept * values[i], weight += kept;
        }
        const double exact = sum / weight, found = double(mis::mean(part[0], T(share)));
        if (exact > 0)
            worst = std::max(worst, std::fabs(found - exact) / exact);
        else
            REQUIRE(found == 0);
    }
    // What is left of a value is a difference of sums of up to 400.
    CHECK(worst <= (sizeof(T) == 4 ? 2e-2 : 1e-9));

    mis::trimmed_mean<T> t;
    CHECK(mis::mean(t, T(0.1)) == T(0));
    for (int i = 0; i < 99; ++i)
        t.add(T(2));
    const mis::trimmed_mean<T> calm = t;
    t.add(T(1e18)); // a firefly
    CHECK(mis::mean(t, T(0)) > T(1e15));
    CHECK(double(mis::mean(t, T(0.02))) == doctest::Approx(2));
    t = calm;
    for (T bad : {not_a_number<T>(), from_bits<T>(oracle::infinity_bits<T>), T(-1)})
        t.add(bad);
    t.add(T(7), T(0));
    CHECK(double(mis::mean(t, T(0))) == doctest::Approx(2));
    t.add(largest_finite<T>()), t.add(std::numeric_limits<T>::min()); // counted at the ends of the range
    CHECK(double(mis::mean(t, T(0.05))) < 2);
}

// Techniques with variances V_t / n_t and costs c_t n_t: variance times cost is least where n_t is in
// proportion to sqrt(V_t / c_t). 10,000 samples of each, 100 seeds; the shapes of contributions and costs
// differ.
TEST_CASE_TEMPLATE("rates of techniques are those of the best allocation", T, float, double) {
    struct shape {
        double scale, cost;
        int kind; // uniform, exponential, rare
    };
    const std::array<shape, 4> shapes{{{1, 1, 0}, {0.05, 3, 1}, {4, 0.5, 0}, {0.7, 10, 2}}};
    const auto exact_variance = [](const shape& s) {
        return s.scale * s.scale * (s.kind == 0 ? 1.0 / 12 : s.kind == 1 ? 1 : 0.1 * 0.9);
    };
    std::array<std::vector<double>, 6> errors; // of the ratio of each two rates
    std::vector<double> worst;                 // of a seed's six
    double excess = 0;
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
        generator g(seed + 100);
        std::array<double, 4> ratio{};
        double variance_times = 0, cost_times = 0, least = 0;
        for (std::size_t t = 0; t < 4; ++t) {
            mis::running_statistics<T> s;
            for (int i = 0; i < 10'000; ++i) {
                const double u = g.uniform();
                const double x = shapes[t].kind == 0 ? u : shapes[t].kind == 1 ? -std::log1p(-u) : u < 0.1;
                s.add(T(shapes[t].scale * x), T(shapes[t].cost * g.uniform(0.5, 1.5)));
            }
            const T rate = mis::technique_rate(T(1), mis::variance(s), mis::mean_cost(s), {T(1), T(1)},
                                               {T(1e-6), T(1e6)});
            const double v = exact_variance(shapes[t]), c = shapes[t].cost;
            ratio[t] = double(rate) / std::sqrt(v / c);
            variance_times += v / double(rate), cost_times += c * double(rate), least += std::sqrt(v * c);
        }
        worst.push_back(0);
        for (std::size_t a = 0, pair = 0; a < 4; ++a)
            for (std::size_t b = a + 1; b < 4; ++b, ++pair) {
                errors[pair].push_back(std::fabs(ratio[a] / ratio[b] - 1));
                worst.back() = std::max(worst.back(), errors[pair].back());
            }
        excess = std::max(excess, variance_times * cost_times / (least * least) - 1);
    }
    const auto median = [](std::vector<double> of) {
        std::nth_element(of.begin(), of.begin() + 50, of.end());
        return of[50];
    };
    double largest = 0;
    for (const auto& of_pair : errors)
        largest = std::max(largest, median(of_pair));
    // What remains is the sampling error of a variance: that of an exponential's is sqrt(8 / 10,000).
    std::printf(
        "rates of techniques: ratios off by %.2f %% at most in the median, the worst of a seed's six by "
        "%.2f %%; variance times cost %.1e above the least, at most\n",
        100 * largest, 100 * median(worst), excess);
    CHECK(largest <= 0.02);
    CHECK(excess >= 0); // Cauchy and Schwarz
    CHECK(excess <= 1e-3);
}

TEST_CASE_TEMPLATE("choices with zero variance", T, float, double) {
    generator g(7);
    worst_case worst;
    bool picks_its_share = true;
    for (int trial = 0; trial < 2'000; ++trial) {
        const int n = g.integer(1, 12);
        std::vector<T> kernel, adjoint, p(static_cast<std::size_t>(n));
        double sum = 0, kernels = 0;
        for (int i = 0; i < n; ++i) {
            kernel.push_back(i > 0 && g.chance(0.2) ? T(0) : g.log_uniform<T>(-3, 3));
            adjoint.push_back(i > 0 && g.chance(0.2) ? T(0) : g.log_uniform<T>(-3, 3));
            sum += double(kernel.back()) * double(adjoint.back()), kernels += double(kernel.back());
        }
        const T defensive = g.chance(0.5) ? T(0) : T(g.uniform(0, 0.9));
        const auto call = [&](int i) { return adjoint[static_cast<std::size_t>(i)]; };
        const T total = trial % 2
                            ? mis::zero_variance_probabilities(kernel, adjoint, n, p.data(), defensive)
                            : mis::zero_variance_probabilities(kernel.data(), call, n, p.data(), defensive);
        worst.see(std::fabs(double(total) - sum) / sum, trial);
        double sum_p = 0;
        for (std::size_t i = 0; i < p.size(); ++i) {
            const double k = double(kernel[i]),
                         exact = (1 - double(defensive)) * k * double(adjoint[i]) / sum +
                                 double(defensive) * k / kernels;
            worst.see(std::fabs(double(p[i]) - exact) / (exact > 0 ? exact : 1), trial);
            if (defensive == T(0))
                worst.see(
                    std::fabs(double(mis::zero_variance_density(kernel[i], adjoint[i], total)) - exact) /
                        (exact > 0 ? exact : 1),
                    trial);
            sum_p += double(p[i]);
            // u in the middle of the i-th share.
            const T u = T(std::min(sum_p - double(p[i]) / 2, 1 - 1e-7));
            picks_its_share = picks_its_share && (double(p[i]) < 1e-4 || mis::pick(p.data(), n, u) == int(i));
        }
    }
    CHECK_MESSAGE(worst.error <= 16 * std::numeric_limits<T>::epsilon(), "sample ", worst.sample);
    CHECK(picks_its_share);
    const T some[] = {T(0), T(0.5), T(0), T(0.5), T(0)};
    CHECK(mis::pick(some, 5, T(0)) == 1);
    CHECK(mis::pick(some, 5, T(1) - std::numeric_limits<T>::epsilon()) == 3);
    CHECK(mis::pick(some, 1, T(0.5)) == 0); // all are 0
}

TEST_CASE_TEMPLATE("choices where the adjoint is no guide", T, float, double) {
    const T infinity = from_bits<T>(oracle::infinity_bits<T>);
    const std::array<T, 3> kernel{T(1), T(3), T(-4)};
    std::array<T, 3> p{};
    const auto by_kernel = [&] { return p[0] == T(0.125) && p[1] == T(0.375) && p[2] == T(0.5); };
    for (const std::array<T, 3>& adjoint :
         {std::array<T, 3>{T(0), T(0), T(0)}, {infinity, T(1), T(1)}, {T(1), not_a_number<T>(), T(0)}}) {
        p = {};
        CHECK(mis::zero_variance_probabilities(kernel, adjoint, 3, p.data(), T(0.25)) == T(0));
        CHECK(by_kernel());
    }
    // A negative one counts as its magnitude; one that is 0 by mistake is still chosen.
    CHECK(mis::zero_variance_probabilities(kernel, std::array<T, 3>{T(-3), T(0), T(0)}, 3, p.data(),
                                           T(0.5)) == T(3));
    CHECK(double(p[0]) == doctest::Approx(0.5 + 0.0625));
    CHECK(double(p[1]) == doctest::Approx(0.1875));
    CHECK(double(p[2]) == doctest::Approx(0.25));
    // Products beyond the range of the scalar.
    const T large = sizeof(T) == 4 ? T(1e30) : T(1e60);
    mis::zero_variance_probabilities(std::array<T, 3>{large, large, 0}, std::array<T, 3>{large, large, large},
                                     3, p.data());
    CHECK(p[0] == T(0.5));
    CHECK(p[1] == T(0.5));
    CHECK(p[2] == T(0));
    mis::zero_variance_probabilities(std::array<T, 3>{}, kernel, 3, p.data());
    CHECK((p[0] == T(0) && p[1] == T(0) && p[2] == T(0)));

    CHECK(mis::zero_variance_survival(T(3), T(1)) == T(0.75));
    CHECK(mis::zero_variance_survival(T(3), T(0)) == T(1));
    CHECK(mis::zero_variance_survival(T(0), T(1)) == T(0));
    CHECK(mis::zero_variance_survival(T(0), T(0)) == T(1));
    CHECK(mis::zero_variance_survival(infinity, T(1)) == T(1));
    CHECK(mis::zero_variance_survival(not_a_number<T>(), T(1)) == T(1));
    CHECK(mis::zero_variance_survival(T(-1), T(3)) == T(1));
    CHECK(mis::zero_variance_density(T(1), T(2), T(0)) == T(0));
}

// Emission [V] 5, scattering [V] 6 and survival [V] 7 on a chain of random states, each of which emits, too:
// a walk scores only where it ends, and every walk the same.
TEST_CASE("a walk by zero-variance rules always scores the integral") {
    generator g(8);
    constexpr int n = 8;
    for (int trial = 0; trial < 20; ++trial) {
        std::array<std::array<double, n>, n> kernel{};
        std::array<double, n> source{}, emitted{}, reflected{};
        for (int i = 0; i < n; ++i) {
            const std::size_t at = static_cast<std::size_t>(i);
            source[at] = g.uniform(), emitted[at] = i % 3 == 0 ? g.log_uniform<double>(-3, 0) : 0;
            for (double& k : kernel[at])
                k = g.chance(0.3) ? 0 : 0.2 * g.uniform();
            kernel[at][0] = 0.1; // what emits can be reached
        }
        const auto adjoint = [&](int i) {
            return emitted[static_cast<std::size_t>(i)] + reflected[static_cast<std::size_t>(i)];
        };
        for (int k = 0; k < 3'000; ++k) // Psi^r = K (Psi^e + Psi^r), to the last bit
            for (std::size_t i = 0; i < n; ++i) {
                double sum = 0;
                for (int j = 0; j < n; ++j)
                    sum += kernel[i][static_cast<std::size_t>(j)] * adjoint(j);
                reflected[i] = sum;
            }
        std::array<double, n> p{};
        const double integral = mis::zero_variance_probabilities(source, adjoint, n, p.data());
        double worst_weight = 0, worst_score = 0;
        for (int walk = 0; walk < 1'000; ++walk) {
            mis::zero_variance_probabilities(source, adjoint, n, p.data());
            std::size_t x = static_cast<std::size_t>(mis::pick(p.data(), n, g.uniform()));
            double weight = source[x] / p[x];
            for (;;) {
                const double survival = mis::zero_variance_survival(reflected[x], emitted[x]);
                if (mis::copies(survival, g.uniform()) == 0) {
                    const double score = weight / (1 - survival) * emitted[x];
                    worst_score = std::max(worst_score, std::fabs(score / integral - 1));
                    break;
                }
                weight /= survival;
                worst_weight =
                    std::max(worst_weight, std::fabs(weight * reflected[x] / integral - 1)); // [V] 8
                mis::zero_variance_probabilities(kernel[x], adjoint, n, p.data());
                const std::size_t next = static_cast<std::size_t>(mis::pick(p.data(), n, g.uniform()));
                weight *= kernel[x][next] / p[next];
                x = next;
            }
        }
        REQUIRE(worst_weight <= 1e-12);
        REQUIRE(worst_score <= 1e-12);
    }
}

// ---- The rod ----

TEST_CASE("the rod's adjoint is what is left of it in special cases, and solves its equation") {
    using namespace studies;
    const rod half{1, 1, 0.6};
    for (double x : {0.0, 0.3, 1.0}) { // no absorption
        CHECK(adjoint(half, x, studies::right) == doctest::Approx((1 + 0.4 * x) / 1.4).epsilon(1e-12));
        CHECK(adjoint(half, x, studies::left) == doctest::Approx(0.4 * x / 1.4).epsilon(1e-12));
        const rod straight{2, 0.3, 1}; // no scattering back
        CHECK(adjoint(straight, x, studies::right) ==
              doctest::Approx(std::exp(0.7 * (x - 2))).epsilon(1e-12));
        CHECK(adjoint(straight, x, studies::left) == 0);
    }
    CHECK(adjoint({2, 0.9, 0.7}, 0, studies::right) == doctest::Approx(0.52556).epsilon(1e-5));
    // Psi(x) = integral of e^-t Psi^r + what leaves, by Simpson's rule.
    const rod s{3, 0.5, 0.7};
    const double x = 1.3;
    double sum = 0;
    const int steps = 2'000;
    for (int i = 0; i <= steps; ++i) {
        const double t = (s.length - x) * i / steps, factor = i == 0 || i == steps ? 1 : i % 2 ? 4 : 2;
        sum += factor * std::exp(-t) * reflected(s, x + t, studies::right) * (s.length - x) / steps / 3;
    }
    CHECK(sum + std::exp(x - s.length) == doctest::Approx(adjoint(s, x, studies::right)).epsilon(1e-10));
}

TEST_CASE("rod: with zero variance nu Psi = I at every collision, and every walk scores I") {
    studies::walk_rules rules;
    rules.lower = rules.upper = 1;
    rules.zero_variance_directions = rules.zero_variance_flights = true;
    for (double length : {0.5, 10.0, 20.0}) {
        generator g(9);
        double worst = 0, worst_score = 0;
        long long collisions = 0;
        for (int i = 0; i < 2'000; ++i) {
            const auto result = studies::walk(
                {length, 0.5, 0.7}, rules, [&] { return g.uniform(); },
                [&](double, studies::direction, double r) { worst = std::max(worst, std::fabs(r - 1)); });
            worst_score = std::max(worst_score, std::fabs(result.score - 1));
            collisions += result.collisions;
        }
        CHECK(collisions > 200);
        CHECK(worst <= 1e-12);
        CHECK(worst_score <= 1e-12);
    }
}

TEST_CASE("rod: roulette and splitting alone keep every weight in the window") {
    for (double size : {1.0, 2.0, 5.0, 20.0})
        for (bool zero_variance_directions : {false, true}) {
            const auto window = mis::window_of_size(size);
            studies::walk_rules rules;
            rules.lower = window.lower, rules.upper = window.upper;
            rules.zero_variance_directions = zero_variance_directions;
            generator g(10);
            double lowest = 1, highest = 1;
            long long collisions = 0;
            for (int i = 0; i < 2'000; ++i)
                collisions += studies::walk(
                                  {10, 0.5, 0.7}, rules, [&] { return g.uniform(); },
                                  [&](double, studies::direction, double r) {
                                      lowest = std::min(lowest, r), highest = std::max(highest, r);
                                  })
                                  .collisions;
            CHECK(collisions > 5'000);
            CHECK(lowest >= window.lower * (1 - 1e-12));
            CHECK(highest <= window.upper * (1 + 1e-12));
        }
}

TEST_CASE("rod: efficiency over the analogue walk, from the equation of the second moment") {
    using namespace studies;
    const auto gain = [](double length, bool zero_variance_directions) {
        const rod s{length, 0.5, 0.7};
        walk_rules exact;
        exact.lower = exact.upper = 1;
        exact.zero_variance_directions = zero_variance_directions;
        const expectation by_rates = moment_equation(s, exact, 20, 1).solve();
        const expectation analogue = moment_equation(s, {}, 20, 1).solve();
        CHECK(by_rates.mean == doctest::Approx(1).epsilon(1e-3));
        return efficiency(by_rates) / efficiency(analogue);
    };
    CHECK(gain(10, false) == doctest::Approx(4.02).epsilon(0.01));
    CHECK(gain(20, false) == doctest::Approx(72.65).epsilon(0.01));
    CHECK(gain(10, true) == doctest::Approx(5.02).epsilon(0.01));
    CHECK(gain(20, true) == doctest::Approx(90.9).epsilon(0.01));
}

// ---- Weights ----

namespace {

// Rates at the inner vertices: of the camera walk and of the light walk.
template <class T> struct rates_of_path { std::vector<T> camera, light; };

// By what rates multiply the number of samples of a technique: those of each walk's vertices, on arrival all
// that it has, else all but the last, which is joined before.
template <class T>
long double product(const rates_of_path<T>& rates, int n, mis::technique t, bool on_arrival) {
    const bool merges = t.kind == mis::technique_kind::merge;
    const int camera_end = t.camera_vertices - 1, light_end = merges ? camera_end : t.camera_vertices;
    long double q = 1;
    for (int i = 1; i < n - 1; ++i) {
        if (on_arrival ? i <= camera_end : i < camera_end)
            q *= rates.camera[static_cast<std::size_t>(i)];
        if (on_arrival ? i >= light_end : i > light_end)
            q *= rates.light[static_cast<std::size_t>(i)];
    }
    return q;
}

} // namespace

TEST_CASE("rates as factors of densities are factors of numbers of samples, in both forms of the weights") {
    generator g(11);
    worst_case complete, recursive;
    for (int k = 0; k < 4'000; ++k) {
        const int n = g.integer(3, 9); // of 2 vertices have no inner one
        const bool on_arrival = g.chance(0.5);
        const auto path = make_path<double>(g, n, ordinary);
        rates_of_path<double> rates;
        for (int i = 0; i < n; ++i) {
            rates.camera.push_back(g.log_uniform<double>(-1, 1));
            rates.light.push_back(g.log_uniform<double>(-1, 1));
        }
        const double next_events = g.log_uniform<double>(-1, 1);
        auto rated = path.vertices;
        rated.back().pdf_next_event =
            mis::with_rate(mis::pdf_next_event{rated.back().pdf_next_event}, next_events).value;
        for (int i = 1; i < n - 1; ++i) {
            const std::size_t at = static_cast<std::size_t>(i);
            auto& x = rated[at];
            // with_rate, as a renderer calls it.
            if (on_arrival) {
                x.pdf_distance_from_camera =
                    mis::with_rate(mis::pdf_distance_forward{x.pdf_distance_from_camera}, rates.camera[at])
                        .value;
                x.pdf_distance_from_light =
                    mis::with_rate(mis::pdf_distance_reverse{x.pdf_distance_from_light}, rates.light[at])
                        .value;
            } else {
                x.pdf_to_light = mis::with_rate(mis::pdf_forward{x.pdf_to_light}, rates.camera[at]).value;
                x.pdf_to_camera = mis::with_rate(mis::pdf_reverse{x.pdf_to_camera}, rates.light[at]).value;
            }
        }
        const int count = mis::technique_count(n);
        std::vector<double> q(static_cast<std::size_t>(count)), w(q.size()), exact(q.size());
        mis::relative_densities(path.counts, path.data(), n, q.data());
        for (int i = 0; i < count; ++i)
            q[static_cast<std::size_t>(i)] *= // and next events have a rate of their own
                (mis::technique_at(n, i).kind == mis::technique_kind::next_event ? next_events : 1) *
                static_cast<double>(product(rates, n, mis::technique_at(n, i), on_arrival));
        mis::weights(mis::power, q.data(), count, exact.data());
        mis::weights(mis::power, path.counts, rated.data(), n, w.data());
        for (int i = 0; i < count; ++i) {
            const std::size_t at = static_cast<std::size_t>(i);
            complete.see(std::fabs(w[at] - exact[at]) / (exact[at] + 1e-12), k);
            if (exact[at] > 1e-6)
                recursive.see(std::fabs(mis::weight_in_subpaths(mis::power, path.counts, rated.data(), n,
                                                                mis::technique_at(n, i)) /
                                            exact[at] -
                                        1),
                              k);
        }
    }
    CHECK_MESSAGE(complete.error <= 1e-10, "sample ", complete.sample);
    CHECK_MESSAGE(recursive.error <= 1e-10, "sample ", recursive.sample);
}

// Two scattering events, each to one of two places; a light's two points are next to the second. The walk
// splits at the first place; scattering and next events both make all paths. What the counts are is seen, not
// assumed.
TEST_CASE("what a rate multiplies, seen in samples; and which weights are biased") {
    const double first[] = {0.3, 0.7}, second[2][2] = {{0.2, 0.8}, {0.6, 0.4}}, next_event[] = {0.5, 0.5};
    const double rate[] = {0.4, 2.7}, f[2][2] = {{1, 3}, {0.5, 2}};
    for (bool on_arrival : {false, true}) {
        generator g(12);
        constexpr int walks = 200'000;
        double hits[2][2] = {}, joins[2][2] = {}; // numbers of samples
        const auto choose = [&](const double* p) { return mis::pick(p, 2, g.uniform()); };
        for (int k = 0; k < walks; ++k) {
            const int x = choose(first);
            if (!on_arrival)
                ++joins[x][choose(next_event)];
            for (int copies = mis::copies(rate[x], g.uniform()); copies > 0; --copies) {
                if (on_arrival)
                    ++joins[x][choose(next_event)];
                ++hits[x][choose(second[x])];
            }
        }
        double with = 0, without = 0, one_sided = 0, exact = 0, worst = 0;
        for (int x = 0; x < 2; ++x)
            for (int y = 0; y < 2; ++y) {
                const double q = rate[x], hit = first[x] * second[x][y] * q;
                const double join = first[x] * next_event[y] * (on_arrival ? q : 1);
                // The numbers of samples are the densities' with the rate in it. A sample more or less in a
                // walk has at most the variance of 4 q^2, and 8 such comparisons fail once in a million times
                // at 5.1 of their errors, were they normal; the seed is fixed.
                const double error = 2 * std::max(q, 1.0) * std::sqrt(std::max(hit, join) / walks);
                worst = std::max({worst, std::fabs(hits[x][y] / walks - hit) / error,
                                  std::fabs(joins[x][y] / walks - join) / error});
                // What each technique's samples sum to, on average: f times the weights.
                const double plain_hit = hit / q, plain_join = first[x] * next_event[y];
                exact += f[x][y];
                with += f[x][y] * (mis::balance(hit, join) + mis::balance(join, hit));
                without +=
                    f[x][y] * (mis::balance(plain_hit, plain_join) + mis::balance(plain_join, plain_hit));
                one_sided += f[x][y] * (mis::balance(hit, join) + mis::balance(plain_join, plain_hit));
            }
        CHECK(worst <= 5.1);
        CHECK(with == doctest::Approx(exact).epsilon(1e-14));
        CHECK(without == doctest::Approx(exact).epsilon(1e-14));
        if (!on_arrival) // where both are split alike, the rate cancels
            CHECK(std::fabs(one_sided / exact - 1) > 0.02);
    }
}
