// SPDX-License-Identifier: MIT
#pragma once

#include "wide.hpp"

#include <mis/config.hpp>

// A scalar without limits that remembers whether T would have had them. Code that is run with it, beside T,
// tells whether every number on its way fits into T: is 0, or a normal number with some room above.

namespace test {

template <class T> struct ranged {
    oracle::wide magnitude;
    bool negative = false;

    static inline bool escaped = false;   // set by a number that T cannot hold, cleared by whoever asks
    static inline oracle::wide margin{1}; // the factor by which a number must be away from T's limits

    ranged() = default;
    template <class U, class = std::enable_if_t<std::is_arithmetic_v<U>>>
    ranged(U x) : magnitude(x < U(0) ? -x : x), negative(x < U(0)) {}
    ranged(const oracle::wide& x, bool is_negative) : magnitude(x), negative(is_negative && !x.zero()) {
        const oracle::wide least = std::numeric_limits<T>::min(), largest = std::numeric_limits<T>::max();
        if (!x.zero() && (x.infinite || x < least * margin || largest < x * oracle::wide{32} * margin))
            escaped = true;
    }

    friend ranged operator-(ranged a) {
        a.negative = !a.negative && !a.magnitude.zero();
        return a;
    }
    friend ranged operator*(const ranged& a, const ranged& b) {
        return {a.magnitude * b.magnitude, a.negative != b.negative};
    }
    friend ranged operator/(const ranged& a, const ranged& b) {
        return {a.magnitude / b.magnitude, a.negative != b.negative};
    }
    // of numbers that are not negative
    friend ranged operator+(const ranged& a, const ranged& b) { return {a.magnitude + b.magnitude, false}; }
    friend bool operator<(const ranged& a, const ranged& b) {
        if (a.negative != b.negative)
            return a.negative;
        return a.negative ? b.magnitude < a.magnitude : a.magnitude < b.magnitude;
    }
    friend bool operator>(const ranged& a, const ranged& b) { return b < a; }
    friend bool operator>=(const ranged& a, const ranged& b) { return !(a < b); }
    friend bool operator==(const ranged& a, const ranged& b) { return !(a < b) && !(b < a); }
    friend ranged pow(const ranged& x, const ranged& beta) {
        return {oracle::pow(x.magnitude, static_cast<double>(oracle::to_long_double(beta.magnitude))), false};
    }
};

} // namespace test

template <class T> struct mis::detail::limits<test::ranged<T>> {
    static inline const test::ranged<T> saturation = std::numeric_limits<T>::max() / 16;
};
