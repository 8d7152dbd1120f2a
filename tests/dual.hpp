// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>

namespace test {

// A number and its derivative by one variable, as a renderer would bring it: nothing of it is known to mis.
template <class T> struct dual {
    T value, derivative;

    constexpr dual(T v = 0, T d = 0) : value(v), derivative(d) {}

    constexpr dual operator-() const { return {-value, -derivative}; }
    friend constexpr dual operator+(dual a, dual b) {
        return {a.value + b.value, a.derivative + b.derivative};
    }
    friend constexpr dual operator-(dual a, dual b) {
        return {a.value - b.value, a.derivative - b.derivative};
    }
    friend constexpr dual operator*(dual a, dual b) {
        return {a.value * b.value, a.value * b.derivative + a.derivative * b.value};
    }
    friend constexpr dual operator/(dual a, dual b) {
        const T quotient = a.value / b.value;
        return {quotient, (a.derivative - quotient * b.derivative) / b.value};
    }
    constexpr dual& operator+=(dual b) { return *this = *this + b; }
    friend dual pow(dual a, dual b) { // b constant
        return {std::pow(a.value, b.value), b.value * std::pow(a.value, b.value - 1) * a.derivative};
    }
    friend constexpr bool operator<(dual a, dual b) { return a.value < b.value; }
    friend constexpr bool operator>(dual a, dual b) { return a.value > b.value; }
    friend constexpr bool operator>=(dual a, dual b) { return a.value >= b.value; }
    friend constexpr bool operator==(dual a, dual b) { return a.value == b.value; }
};

} // namespace test

template <class T> struct std::numeric_limits<test::dual<T>> : std::numeric_limits<T> {};
