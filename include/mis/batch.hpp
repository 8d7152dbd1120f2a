// SPDX-License-Identifier: MIT
// Floor 1: heuristics over arrays, one array per technique, as wavefront renderers keep densities: technique
// i has the effective relative density densities[i * stride + k] for sample k, stride >= samples. Weights and
// edges are those of heuristic.hpp. Accuracy: balance and power (2) weigh floats in float, N techniques
// within N + beta ulp, and may give 0 for a weight below the least normal number. Under -ffast-math, where
// compilers approximate divisions, it is 2 ulp more, and floats below 1e-29 have 3 digits.
//
// Compilers vectorise balance and power, at -O2 as well.
#pragma once

#include <cstddef>
#include <cstdint>
#include <mis/heuristic.hpp>

namespace mis {

namespace detail {

// So many samples at a time: their sums stay in the first cache, and the compiler knows how many they are.
constexpr std::ptrdiff_t samples_at_once = 64;

// Integers as wide as T, the exponent of whose bits is all ones for infinity.
template <class T> struct bits_of {
    using type = std::conditional_t<sizeof(T) == 4, std::int32_t, std::int64_t>;
    static constexpr type infinity = sizeof(T) == 4 ? type(0x7f800000) : type(0x7ff0000000000000);
    static constexpr type one = sizeof(T) == 4 ? type(0x3f800000) : type(0x3ff0000000000000);
    static constexpr type exponent_of_one = sizeof(T) == 4 ? type(1) << 23 : type(1) << 52;
};
template <class To, class From> constexpr To cast_bits(From x) { return __builtin_bit_cast(To, x); }

// The power of two that takes `largest` into [2, 4); less if it is subnormal or 0; 0 if it is infinite.
template <class T> constexpr T scale_for(T largest) {
    using bits = bits_of<T>;
    const auto down = bits::infinity - (cast_bits<typename bits::type>(largest) & bits::infinity);
    constexpr auto most = bits::infinity - bits::exponent_of_one;
    return cast_bits<T>(down < most ? down : most);
}

// q times its scale. Where the largest is infinite: 1 if q is, too, else 0. Infinity is told by its bits, so
// that neither a branch nor a NaN is needed.
template <class T> constexpr T scaled(T q, T scale) {
    using bits = bits_of<T>;
    const auto x = cast_bits<typename bits::type>(q);
    const auto finite = x < bits::infinity ? x : bits::infinity - 1;
    const auto one_if_infinite = x < bits::infinity ? 0 : bits::one;
    return cast_bits<T>(finite) * scale + cast_bits<T>(one_if_infinite);
}

// Samples 0 to Size - 1 of a heuristic that is_of_quotients.
template <std::ptrdiff_t Size, class Heuristic, class T>
void weights_of_some(const Heuristic& heuristic, const T* densities, int techniques, std::ptrdiff_t stride,
                     T* out) {
    T largest[Size] = {}, scale[Size], total[Size] = {}, share[Size];
    for (int i = 0; i < techniques; ++i) {
        const T* q = densities + i * stride;
        for (std::ptrdiff_t k = 0; k < Size; ++k)
            assert_density(q[k]);
        for (std::ptrdiff_t k = 0; k < Size; ++k)
            largest[k] = larger(largest[k], q[k]);
    }
    for (std::ptrdiff_t k = 0; k < Size; ++k)
        scale[k] = scale_for(largest[k]);
    // Through a copy of its own, because `out` may be `densities`.
    for (int i = 0; i < techniques; ++i) {
        for (std::ptrdiff_t k = 0; k < Size; ++k)
            share[k] = heuristic.times(T(1), scaled(densities[i * stride + k], scale[k]));
        for (std::ptrdiff_t k = 0; k < Size; ++k) {
            total[k] += share[k];
            out[i * stride + k] = share[k];
        }
    }
    for (std::ptrdiff_t k = 0; k < Size; ++k)
        total[k] = larger(total[k], T(limits<T>::least_normal)); // not 0 / 0
    for (int i = 0; i < techniques; ++i) {
        T* w = out + i * stride;
        for (std::ptrdiff_t k = 0; k < Size; ++k)
            w[k] = w[k] / total[k];
    }
}

} // namespace detail

// out[k] = weight of the first of two techniques with the effective densities a[k] and b[k], for k < samples.
// `out` may be a or b.
template <class Heuristic, class T>
void weights_of_first(const Heuristic& heuristic, const T* a, const T* b, std::size_t samples, T* out) {
    detail::expect_real<T>();
    using detail::samples_at_once;
    T w[samples_at_once];
    const auto all = static_cast<std::ptrdiff_t>(samples), in_blocks = all - all % samples_at_once;
    for (std::ptrdiff_t first = 0; first < in_blocks; first += samples_at_once) {
        for (std::ptrdiff_t k = 0; k < samples_at_once; ++k)
            w[k] = mis::weight_of_first(heuristic, a[first + k], b[first + k]);
        for (std::ptrdiff_t k = 0; k < samples_at_once; ++k)
            out[first + k] = w[k];
    }
    for (std::ptrdiff_t k = in_blocks; k < all; ++k)
        out[k] = mis::weight_of_first(heuristic, a[k], b[k]);
}

// out[i * stride + k] = weight of technique i for sample k. `out` may be `densities`.
template <class Heuristic, class T>
void weights_of_arrays(const Heuristic& heuristic, const T* densities, int techniques, std::size_t samples,
                       std::size_t stride, T* out) {
    detail::expect_real<T>();
    assert(stride >= samples || techniques <= 1);
    const auto all = static_cast<std::ptrdiff_t>(samples), apart = static_cast<std::ptrdiff_t>(stride);
    if constexpr (detail::has_bits<T> && detail::is_of_quotients<Heuristic>) {
        constexpr std::ptrdiff_t some = detail::samples_at_once;
        const std::ptrdiff_t in_blocks = all - all % some;
        for (std::ptrdiff_t k = 0; k < in_blocks; k += some)
            detail::weights_of_some<some>(heuristic, densities + k, techniques, apart, out + k);
        for (std::ptrdiff_t k = in_blocks; k < all; ++k)
            detail::weights_of_some<1>(heuristic, densities + k, techniques, apart, out + k);
    } else {
        for (std::ptrdiff_t k = 0; k < all; ++k) {
            const auto n = detail::normalize(heuristic, densities + k, techniques, apart);
            for (int i = 0; i < techniques; ++i)
                out[i * apart + k] = detail::normalized(heuristic, n, densities[i * apart + k]);
        }
    }
}

// The same for sample k alone and N techniques, for kernels: N is known to the compiler, so that the
// densities are read once and stay in registers, and neighbouring threads read neighbouring numbers.
template <int N, class Heuristic, class T>
MIS_HOST_DEVICE constexpr void weights_of_sample(const Heuristic& heuristic, const T* densities,
                                                 std::size_t stride, std::size_t k, T* out) {
    T q[N]{};
    for (int i = 0; i < N; ++i)
        q[i] = densities[static_cast<std::size_t>(i) * stride + k];
    mis::weights(heuristic, &q[0], N, &q[0]);
    for (int i = 0; i < N; ++i)
        out[static_cast<std::size_t>(i) * stride + k] = q[i];
}

} // namespace mis
