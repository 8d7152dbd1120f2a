// SPDX-License-Identifier: MIT
#pragma once

#include <climits>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

// Numbers for the oracles: non-negative, at least 64 bits of mantissa, and an exponent that no product of a
// path's densities can exhaust. Infinity and NaN are told by their bits, because -ffast-math lets a compiler
// assume that comparisons never meet them.

namespace oracle {

// Unsigned integer of the scalar's size.
template <class T> using bits_t = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;

template <class T> bits_t<T> bits_of(T x) {
    bits_t<T> bits;
    std::memcpy(&bits, &x, sizeof x);
    return bits;
}

template <class T> T from_bits(bits_t<T> bits) {
    T x;
    std::memcpy(&x, &bits, sizeof x);
    return x;
}

// Bit patterns of the scalar's landmarks.
template <class T> constexpr int mantissa_bits = std::numeric_limits<T>::digits - 1;
template <class T> constexpr bits_t<T> sign_bit = bits_t<T>(1) << (sizeof(T) * CHAR_BIT - 1);
template <class T>
constexpr bits_t<T> infinity_bits = (sign_bit<T> - 1) & ~((bits_t<T>(1) << mantissa_bits<T>)-1);
template <class T> constexpr bits_t<T> min_normal_bits = bits_t<T>(1) << mantissa_bits<T>;
template <class T> constexpr bits_t<T> max_bits = infinity_bits<T> - 1;

template <class T> bool is_infinite(T x) { return (bits_of(x) & ~sign_bit<T>) == infinity_bits<T>; }
template <class T> bool is_nan(T x) { return (bits_of(x) & ~sign_bit<T>) > infinity_bits<T>; }
template <class T> bool is_finite(T x) { return (bits_of(x) & ~sign_bit<T>) < infinity_bits<T>; }
template <class T> bool is_negative(T x) { return bits_of(x) > sign_bit<T>; }

// mantissa · 2^exponent with the mantissa 0 or in [1/2, 1), or +infinity.
struct wide {
    long double mantissa = 0;
    long exponent = 0;
    bool infinite = false;

    wide() = default;

    template <class T, class = std::enable_if_t<std::is_arithmetic_v<T>>> wide(T x) {
        if constexpr (std::is_same_v<T, float> || std::is_same_v<T, double>) {
            if (is_infinite(x)) {
                infinite = true;
                return;
            }
            // the common case without a call: the same mantissa bits with the exponent of [1/2, 1)
            const auto exponent_of_half = static_cast<long>(bits_of(T(0.5)) / min_normal_bits<T>);
            const bits_t<T> bits = bits_of(x), fraction = bits & (min_normal_bits<T> - 1);
            if (bits >= min_normal_bits<T> && bits < infinity_bits<T>) {
                mantissa = from_bits<T>(fraction | bits_of(T(0.5)));
                exponent = static_cast<long>(bits / min_normal_bits<T>) - exponent_of_half;
                return;
            }
        }
        *this = scaled(static_cast<long double>(x), 0);
    }

    static wide scaled(long double value, long exponent) {
        wide result;
        int shift = 0;
        result.mantissa = std::frexp(value, &shift);
        result.exponent = result.mantissa == 0 ? 0 : exponent + shift;
        return result;
    }

    // With the mantissa already in [1/2, 1).
    static wide normal(long double mantissa, long exponent) {
        wide result;
        result.mantissa = mantissa;
        result.exponent = exponent;
        return result;
    }

    static wide infinity() {
        wide result;
        result.infinite = true;
        return result;
    }

    bool zero() const { return !infinite && mantissa == 0; }
};

// Product, with 0 · infinity = 0.
inline wide operator*(const wide& a, const wide& b) {
    if (a.zero() || b.zero())
        return {};
    if (a.infinite || b.infinite)
        return wide::infinity();
    const long double m = a.mantissa * b.mantissa; // in [1/4, 1)
    return m < 0.5L ? wide::normal(2 * m, a.exponent + b.exponent - 1)
                    : wide::normal(m, a.exponent + b.exponent);
}

// Quotient, with x/0 = infinity for x > 0 and 0/0 = 0.
inline wide operator/(const wide& a, const wide& b) {
    if (a.zero() || b.infinite)
        return {};
    if (a.infinite || b.zero())
        return wide::infinity();
    const long double m = a.mantissa / b.mantissa; // in (1/2, 2)
    return m < 1 ? wide::normal(m, a.exponent - b.exponent)
                 : wide::normal(m / 2, a.exponent - b.exponent + 1);
}

inline wide operator+(const wide& a, const wide& b) {
    if (a.infinite || b.infinite)
        return wide::infinity();
    if (a.zero())
        return b;
    if (b.zero())
        return a;
    if (a.exponent < b.exponent)
        return b + a;
    const long shift = a.exponent - b.exponent;
    if (shift > 200)
        return a;
    const long double m = a.mantissa + std::ldexp(b.mantissa, -static_cast<int>(shift)); // in [1/2, 2)
    return m < 1 ? wide::normal(m, a.exponent) : wide::normal(m / 2, a.exponent + 1);
}

inline bool operator==(const wide& a, const wide& b) {
    return a.infinite == b.infinite && (a.infinite || (a.mantissa == b.mantissa && a.exponent == b.exponent));
}

inline bool operator<(const wide& a, const wide& b) {
    if (a.infinite || b.zero())
        return false;
    if (b.infinite || a.zero())
        return true;
    return a.exponent != b.exponent ? a.exponent < b.exponent : a.mantissa < b.mantissa;
}

// x^beta. Powers the mantissa and the exponent apart, so the error stays a few units of the 64-bit mantissa
// however large the exponent; beta should have a short binary fraction (1.5, 2, ...).
inline wide pow(const wide& x, double beta) {
    if (beta == 1 || x.zero() || x.infinite)
        return x;
    if (beta == 2)
        return x * x;
    const long double exponent = static_cast<long double>(beta) * static_cast<long double>(x.exponent);
    const long double whole = std::floor(exponent);
    return wide::scaled(std::pow(x.mantissa, static_cast<long double>(beta)) * std::exp2(exponent - whole),
                        static_cast<long>(whole));
}

// Nearest long double; overflow to infinity and underflow to 0 are harmless where this is used (messages,
// comparisons with numbers of ordinary size).
inline long double to_long_double(const wide& x) {
    if (x.infinite || x.exponent > 16000)
        return std::numeric_limits<long double>::max();
    if (x.exponent < -16000)
        return 0;
    return std::ldexp(x.mantissa, static_cast<int>(x.exponent));
}

// Whether x is exactly 0 or within the normal range of T.
template <class T> bool in_normal_range(const wide& x) {
    if (x.zero())
        return true;
    return !x.infinite && x.exponent >= std::numeric_limits<T>::min_exponent &&
           x.exponent < std::numeric_limits<T>::max_exponent;
}

} // namespace oracle
