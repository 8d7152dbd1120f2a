// SPDX-License-Identifier: MIT
#pragma once

#include "wide.hpp"

#include <algorithm>
#include <pcg_random.hpp>
#include <vector>

// Distances in units in the last place, and random scalars over the whole range of the type.

namespace test {

using oracle::bits_of;
using oracle::from_bits;
using oracle::is_finite;
using oracle::is_infinite;
using oracle::is_nan;
using oracle::wide;

// Inputs that the tests leave out when they are compiled with -ffast-math:
// - subnormal numbers, because it sets the processor to read and write them as 0 (GCC) or lets the compiler
// do so.
// - doubles above 2^1015, because it lets the compiler multiply the largest density by the sum of up to 64
// shares,
//   and take the reciprocal, which is subnormal beyond that. Floats have no such limit: they are weighed in
//   double.
// - in the recursion, factors beyond 1e8 in float and 1e60 in double, because it lets the compiler group
// products of
//   three and more as it likes; and exact ties of densities, because quotients in float may be one ulp off.
// 0, infinity and all other normal numbers stay in.
#ifdef __FAST_MATH__
constexpr bool subnormals = false;
#else
constexpr bool subnormals = true;
#endif

// The largest finite number that the tests use.
template <class T> T largest_finite() {
    if (!subnormals && sizeof(T) == sizeof(double))
        return static_cast<T>(0x1p1015);
    return std::numeric_limits<T>::max();
}

// Marks a result that no tolerance may forgive: NaN, infinite or negative.
constexpr double hopeless = 1e30;

// |computed - exact| in units in the last place of the exact value. The unit stops shrinking at the smallest
// normal number's (subnormal results are then measured in the smallest subnormal; where subnormals are
// flushed to 0, anything below the smallest normal number counts as agreeing with 0).
template <class T> double ulp_error(T computed, const wide& exact) {
    using limits = std::numeric_limits<T>;
    if (is_nan(computed) || oracle::is_negative(computed))
        return hopeless;
    if (is_infinite(computed) || exact.infinite)
        return is_infinite(computed) && exact.infinite ? 0 : hopeless;
    if (!subnormals && bits_of(computed) < oracle::min_normal_bits<T> &&
        (exact.zero() || exact.exponent <= limits::min_exponent))
        return 0;
    const long floor = limits::min_exponent - limits::digits;
    const long unit = exact.zero() ? floor : std::max(exact.exponent - limits::digits, floor);
    const wide x{computed};
    const auto in_units = [&](const wide& v) {
        const long e = v.exponent - unit;
        if (v.zero() || e < -100)
            return 0.0L;
        return e > 200 ? static_cast<long double>(hopeless) : std::ldexp(v.mantissa, static_cast<int>(e));
    };
    return static_cast<double>(std::fabs(in_units(x) - in_units(exact)));
}

// The same for a weight of two techniques, where one below the least normal number may be 0.
template <class T> double error_of_two(T weight, const wide& exact) {
    const bool is_below_normal = exact.exponent <= std::numeric_limits<T>::min_exponent - 1;
    return bits_of(weight) == 0 && is_below_normal ? 0 : ulp_error(weight, exact);
}

// Same between two computed values.
template <class T> double ulp_distance(T a, T b) {
    if (is_nan(a) || is_nan(b))
        return hopeless;
    return ulp_error(a, wide{b});
}

// |sum - 1| in units of the machine epsilon.
template <class T> double unity_error(long double sum) {
    return static_cast<double>(std::fabs(sum - 1) / std::numeric_limits<T>::epsilon());
}

// The worst of many errors and where it happened; one CHECK per test instead of one per sample.
struct worst_case {
    double error = 0;
    long long sample = -1;

    void see(double e, long long at) {
        if (!(e <= error)) { // also true for an error that is itself NaN
            error = e;
            sample = at;
        }
    }
};

struct generator {
    pcg32 engine;

    explicit generator(std::uint64_t seed) : engine(seed) {}

    std::uint64_t bits64() { return (static_cast<std::uint64_t>(engine()) << 32) | engine(); }

    // Uniform in [0, 1).
    double uniform() { return static_cast<double>(bits64() >> 11) * 0x1p-53; }

    double uniform(double low, double high) { return low + (high - low) * uniform(); }

    // Uniform in {low, ..., high}.
    int integer(int low, int high) {
        return low + static_cast<int>(engine(static_cast<std::uint32_t>(high - low + 1)));
    }

    bool chance(double probability) { return uniform() < probability; }

    // 10 to a power uniform in [low, high].
    template <class T> T log_uniform(double low, double high) {
        return static_cast<T>(std::pow(10.0, uniform(low, high)));
    }

    // Uniform over the bit patterns of the positive finite numbers of T: log-uniform over its range.
    template <class T> T any_positive() {
        const oracle::bits_t<T> low = subnormals ? 1 : oracle::min_normal_bits<T>;
        const std::uint64_t count = bits_of(largest_finite<T>()) - low + 1;
        return from_bits<T>(static_cast<oracle::bits_t<T>>(low + bits64() % count));
    }

    // any_positive, with 0, infinity and the range's ends thrown in.
    template <class T> T any() {
        const double u = uniform();
        if (u < 0.02)
            return T(0);
        if (u < 0.03)
            return from_bits<T>(oracle::infinity_bits<T>);
        if (u < 0.04)
            return largest_finite<T>();
        if (u < 0.05)
            return std::numeric_limits<T>::min();
        return any_positive<T>();
    }
};

// Values where heuristics break first: 0, infinity, the ends of the range, and numbers whose square or sum
// leaves it.
template <class T> std::vector<T> special_values() {
    using limits = std::numeric_limits<T>;
    const T max = largest_finite<T>(), root = std::sqrt(max), small_root = std::sqrt(limits::min());
    std::vector<T> values = {T(0),
                             from_bits<T>(oracle::infinity_bits<T>),
                             limits::min(),
                             limits::min() * (1 + limits::epsilon()),
                             limits::min() * 3,
                             max,
                             max / 2,
                             max / T(1.13),
                             root,
                             root * T(1.6),
                             root / 2,
                             small_root,
                             small_root / 3,
                             small_root * 3,
                             T(1e-30),
                             T(3e19),
                             T(1e30),
                             T(3e38),
                             T(0.1),
                             T(1) - limits::epsilon() / 2,
                             T(1),
                             T(1) + limits::epsilon(),
                             T(2),
                             T(3)};
    if (subnormals) {
        values.push_back(from_bits<T>(1));
        values.push_back(from_bits<T>(3));
        values.push_back(from_bits<T>(oracle::min_normal_bits<T> - 1));
        values.push_back(from_bits<T>(oracle::min_normal_bits<T> / 2));
    }
    return values;
}

} // namespace test
