// SPDX-License-Identifier: MIT
// Floor 0: the host/device marker and the few scalar helpers that everything else stands on.
#pragma once

#if __cplusplus < 201703L && (!defined(_MSVC_LANG) || _MSVC_LANG < 201703L)
#error "mis needs C++17: compile with -std=c++17 (MSVC: /std:c++17) or later"
#endif

#include <cassert>
#include <cstdint>
#include <limits>
#include <mis/version.hpp>
#include <type_traits>

// Marks every function of the library. Define it before the first include to use another marker.
#ifndef MIS_HOST_DEVICE
#if defined(__CUDACC__) || defined(__HIPCC__)
#define MIS_HOST_DEVICE __host__ __device__
#else
#define MIS_HOST_DEVICE
#endif
#endif

// For what is only fast where numbers stay in registers.
#if defined(__GNUC__)
#define MIS_DETAIL_INLINE [[gnu::always_inline]] MIS_HOST_DEVICE inline
#else
#define MIS_DETAIL_INLINE MIS_HOST_DEVICE inline
#endif

namespace mis::detail {

// The type in which weights of T are computed. In double, no product or sum of a few powers of floats can
// overflow or underflow, whatever the compiler reorders, and the result needs to be rounded only once.
template <class T> struct wide { using type = T; };
template <> struct wide<float> { using type = double; };
template <class T> using wide_t = typename wide<T>::type;

// The same for heuristics and complete paths, on which the speed of weights in kernels hangs: there floats
// are weighed as they are, because many devices compute doubles at a small part of the speed.
// MIS_WEIGH_IN_FLOAT, defined in all of a program, does so on the host.
#if defined(MIS_WEIGH_IN_FLOAT) || defined(__CUDA_ARCH__) || defined(__HIP_DEVICE_COMPILE__)
template <class T> using weighing_t = T;
#else
template <class T> using weighing_t = wide_t<T>;
#endif

// Counts and densities are real numbers. In integers products and quotients would be something else.
template <class T> MIS_HOST_DEVICE constexpr void expect_real() {
    static_assert(!std::is_integral_v<T>,
                  "mis: counts, densities and throughputs are real numbers: write float(pixels), 3.f, not 3");
}

// Keeps the argument next to it from taking part in template argument deduction.
template <class T> struct identity { using type = T; };
template <class T> using identity_t = typename identity<T>::type;

// What is different if T is not a number but a packet of numbers, packet.hpp: its comparisons are masks.
template <class T, class = void> struct lanes {
    using scalar = T;
    using mask = bool;

    MIS_HOST_DEVICE static constexpr T select(bool condition, T yes, T no) { return condition ? yes : no; }
    MIS_HOST_DEVICE static constexpr bool any(bool condition) { return condition; }
};
template <class T> using scalar_t = typename lanes<T>::scalar;
template <class T> using mask_t = typename lanes<T>::mask;

// A constant, in each lane.
template <class T> MIS_HOST_DEVICE constexpr T all_lanes(double x) { return T(static_cast<scalar_t<T>>(x)); }

// Arguments of which T is not deduced may be expressions that become a T, as Eigen's.
template <class T, class Mask>
MIS_HOST_DEVICE constexpr T select(const Mask& condition, identity_t<T> yes, T no) {
    return lanes<T>::select(condition, yes, no);
}
template <class T> MIS_HOST_DEVICE constexpr T larger(T a, identity_t<T> b) { return select<T>(a < b, b, a); }
template <class T> MIS_HOST_DEVICE constexpr T smaller(T a, identity_t<T> b) {
    return select<T>(a < b, a, b);
}
template <class T> MIS_HOST_DEVICE constexpr T absolute(T a) { return select<T>(a < T(0), -a, a); }

// True for +infinity, for a >= 0. Only infinity and 0 are not above their half; a compiler that assumes
// finite numbers (-ffast-math) has no reason to remove this comparison, as it removes isinf.
template <class T> MIS_HOST_DEVICE constexpr mask_t<T> is_infinite(T a) {
    return a > T(0) && !(a * all_lanes<T>(0.5) < a);
}

// Whether comparisons may be relied on to be false for NaN: not by a compiler that assumes finite numbers.
// Then the bits of a float or double have to be looked at.
#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__
constexpr bool compares_nan = false;
#else
constexpr bool compares_nan = true;
#endif
template <class T> constexpr bool has_bits = std::is_same_v<T, float> || std::is_same_v<T, double>;
template <class T> using bits_t = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;

// Limits as constants, because device code may not call the functions of std::numeric_limits.
// A packet's are those of its numbers.
template <class T> struct limits {
    using scalar = scalar_t<T>;
    static_assert(std::numeric_limits<scalar>::is_specialized,
                  "mis: this scalar has no limits: specialize std::numeric_limits for it (for a packet of "
                  "numbers, include <mis/packet.hpp>)");
    static constexpr scalar largest = (std::numeric_limits<scalar>::max)();
    static constexpr scalar least_normal = (std::numeric_limits<scalar>::min)();
#ifdef __FAST_MATH__ // where subnormal numbers count as 0
    static constexpr scalar least_positive = least_normal;
#else
    static constexpr scalar least_positive = std::numeric_limits<scalar>::denorm_min();
#endif
    static constexpr scalar infinity = std::numeric_limits<scalar>::infinity();
    // Numbers above this count as infinite in the recursion's state. A sixteenth of the largest number, so
    // that the sum of a few saturated terms is still finite, and so that no compiler can prove that nothing
    // is above it.
    static constexpr scalar saturation = largest / 16;
};

// False for NaN and infinity, which are told by their bits where a compiler assumes that there are none.
template <class T> MIS_HOST_DEVICE constexpr bool is_finite(T x) {
    if constexpr (!compares_nan && has_bits<T>) {
        constexpr auto exponent = __builtin_bit_cast(bits_t<T>, limits<T>::infinity);
        return (__builtin_bit_cast(bits_t<T>, x) & exponent) != exponent;
    }
    return absolute(x) <= T(limits<T>::largest);
}

// min(a, saturation), also for +infinity and NaN.
template <class T> MIS_HOST_DEVICE constexpr T saturate(T a) { return smaller(a, T(limits<T>::saturation)); }

// The weight of a technique with the density `own`, as computed: in [0, 1], or 0 in place of NaN. `zero` is a
// 0 that the compiler does not know: where it is in memory this is one instruction. A compiler that assumes
// finite numbers (-ffast-math) may make 0 / 0 a 1, or leave NaN in, so there `own` and the weight's bits are
// looked at.
template <class T> MIS_HOST_DEVICE constexpr T proper(T weight, [[maybe_unused]] T own, T zero) {
    if constexpr (!compares_nan && has_bits<T>) {
        const bool is_number = __builtin_bit_cast(bits_t<T>, weight) < __builtin_bit_cast(bits_t<T>, T(2));
        return own > zero && is_number ? smaller(weight, T(1)) : T(0);
    }
    return larger(zero, weight);
}

// Densities, throughputs and counts must be non-negative numbers; anything else is a caller's bug. The
// comparison is false for NaN as well.
template <class T> MIS_HOST_DEVICE constexpr void assert_density([[maybe_unused]] T density) {
    assert(!lanes<T>::any(!(density >= T(0))));
}

} // namespace mis::detail
