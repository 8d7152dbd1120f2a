// SPDX-License-Identifier: MIT
// Floor 1: heuristics turn relative densities into weights. They know nothing of paths.
//
// A density q_i here is an *effective relative* density: technique i's density of the sample times its number
// of samples, all techniques' multiplied by the same unknown positive factor at will. Sources: Veach's thesis
// [V97] 9.2; the lecture of Křivánek and Vorba [K].
//
// All heuristics agree on the edges:
//   - all densities 0: every weight is 0;
//   - some densities +infinity (Dirac): those share 1 equally, the others get 0;
//   - no finite densities make q^beta or the sum overflow or underflow;
//   - a negative or NaN density is a caller's bug, asserted in debug builds; the result is then unspecified.
// Under -ffast-math the same holds, except that subnormal densities may count as 0, and that densities in
// double must stay below 1e305, floats in kernels below 1e35.
//
// Accuracy: two techniques are within 2 + beta ulp, but that balance and power give 0 for a weight below the
// least normal number. (The bias is less than that number times the integral.) N techniques are within N +
// beta ulp; on the host, where floats are weighed in double, floats are rounded once. For a beta that is not
// known to be 2 this takes a pow that is right to 1 ulp, such as glibc's; MinGW-w64's may be 12 ulp off, and
// so may the weights of doubles be then.
#pragma once

#include <cmath>
#include <cstddef>
#include <mis/config.hpp>

namespace mis {

// For heuristics that are only known at run time. Those below are types, so that nothing is decided in inner
// loops.
enum class heuristic_kind : unsigned char { average, balance, power, cutoff, maximum };

struct balance_heuristic;
template <class Beta> struct power_heuristic;
struct two;

namespace detail {

// Whether a quotient of densities that overflows loses no more than a weight below the least normal number.
template <class Heuristic>
constexpr bool is_of_quotients =
    std::is_same_v<Heuristic, balance_heuristic> || std::is_same_v<Heuristic, power_heuristic<two>>;

// Whether the heuristic's powers of numbers of T, and sums of as many as there are, surely are numbers of the
// type in which they are weighed: of floats at most their squares. Then nothing has to be scaled.
template <class Heuristic, class T>
constexpr bool needs_no_scale = !std::is_same_v<weighing_t<T>, T> && is_of_quotients<Heuristic>;

// q as the type in which it is weighed, with a number that beats all others, and whose square is one, for
// infinity.
MIS_HOST_DEVICE constexpr double finite_density(float q) { return smaller(static_cast<double>(q), 1e150); }

} // namespace detail

// Weight of the first of two techniques with effective densities a and b.
template <class Heuristic, class T>
MIS_HOST_DEVICE constexpr T weight_of_first(const Heuristic& heuristic, T a, T b) {
    detail::expect_real<T>();
    detail::assert_density(a);
    detail::assert_density(b);
    if constexpr (detail::is_of_quotients<Heuristic> && detail::compares_nan) {
        // Nothing here branches or changes the type, so that compilers can vectorise it.
        const T weight = T(1) / (T(1) + heuristic.times(T(1), b / a));
        const T if_same =
            detail::select(a > T(0), detail::all_lanes<T>(0.5), T(0)); // 0 / 0, infinity / infinity
        return detail::select(weight >= T(0), weight, if_same);
    } else {
        using W = detail::weighing_t<T>;
        const W low = static_cast<W>(detail::smaller(a, b));
        const W high = static_cast<W>(detail::larger(a, b));
        const W share = heuristic.share(low, high);
        const W weight_of_low = share / (W(1) + share);
        const W weight = detail::select<W>(a < b, weight_of_low, W(1) - weight_of_low);
        return static_cast<T>(detail::select(a > T(0), weight, W(0)));
    }
}

// Every heuristic is a plain struct of three parts:
//   share(q, largest)        what technique q gets for each 1 that the largest density gets, in [0, 1];
//   times(s, x), join(x, y)  s x^beta and the sum, as the recursion in subpath.hpp needs them (not cutoff's);
//   against(own, others)     the weight of `own` once all other techniques have been joined into `others`;
//                            NaN where both are 0 or infinite;
// and of the call operator, the weight of the first of two techniques.

// 1 / M for each of the M techniques with positive density.
struct average_heuristic {
    template <class T> MIS_HOST_DEVICE constexpr T share(T q, T largest) const {
        const T if_less = detail::select(q > T(0) && !detail::is_infinite(largest), T(1), T(0));
        return detail::select(q < largest, if_less, T(1));
    }
    template <class T> MIS_HOST_DEVICE constexpr T times(T s, detail::identity_t<T> x) const {
        return detail::select(x > T(0), s, T(0));
    }
    template <class T> MIS_HOST_DEVICE constexpr T join(T x, detail::identity_t<T> y) const { return x + y; }
    template <class T> MIS_HOST_DEVICE constexpr T against(T own, T others) const {
        return own / (own + others);
    }
    template <class T> MIS_HOST_DEVICE constexpr T operator()(T a, T b) const {
        return mis::weight_of_first(*this, a, b);
    }
};

// q_i / sum q_k, [V97] 9.2.2.
struct balance_heuristic {
    template <class T> MIS_HOST_DEVICE constexpr T share(T q, T largest) const {
        return detail::select(q < largest, q / largest, T(1));
    }
    template <class T> MIS_HOST_DEVICE constexpr T times(T s, detail::identity_t<T> x) const { return s * x; }
    template <class T> MIS_HOST_DEVICE constexpr T join(T x, detail::identity_t<T> y) const { return x + y; }
    template <class T> MIS_HOST_DEVICE constexpr T against(T own, T others) const {
        return own / (own + others);
    }
    template <class T> MIS_HOST_DEVICE constexpr T operator()(T a, T b) const {
        return mis::weight_of_first(*this, a, b);
    }
};

// q_i^beta / sum q_k^beta, beta > 0, [V97] 9.2.3. Without a beta it is 2, known to the compiler: no branch,
// no pow.
struct two {};
template <class Beta = two> struct power_heuristic {
    Beta beta;

    template <class T> MIS_HOST_DEVICE constexpr T to_the_beta(T x) const {
        using std::pow;
        if constexpr (std::is_same_v<Beta, two>)
            return x * x;
        else
            return static_cast<T>(pow(x, detail::all_lanes<T>(static_cast<double>(beta))));
    }
    template <class T> MIS_HOST_DEVICE constexpr T share(T q, T largest) const {
        return to_the_beta(detail::select(q < largest, q / largest, T(1)));
    }
    template <class T> MIS_HOST_DEVICE constexpr T times(T s, detail::identity_t<T> x) const {
        return s * to_the_beta(x);
    }
    template <class T> MIS_HOST_DEVICE constexpr T join(T x, detail::identity_t<T> y) const { return x + y; }
    template <class T> MIS_HOST_DEVICE constexpr T against(T own, T others) const {
        return own / (own + others);
    }
    template <class T> MIS_HOST_DEVICE constexpr T operator()(T a, T b) const {
        return mis::weight_of_first(*this, a, b);
    }
};

template <class Beta> power_heuristic(Beta) -> power_heuristic<Beta>;

// 0 if q_i < alpha q_max, else q_i over the sum of the densities that are not below, 0 <= alpha <= 1,
// [V97] 9.2.3.
struct cutoff_heuristic {
    double alpha = 0.1;

    template <class T> MIS_HOST_DEVICE constexpr T share(T q, T largest) const {
        const T kept = detail::select(q < largest, q / largest, T(1));
        return detail::select(q < detail::all_lanes<T>(alpha) * largest, T(0), kept);
    }
    template <class T> MIS_HOST_DEVICE constexpr T operator()(T a, T b) const {
        return mis::weight_of_first(*this, a, b);
    }
};

// 1 for the largest density, 0 for the others; ties share equally, [V97] 9.2.3.
struct maximum_heuristic {
    template <class T> MIS_HOST_DEVICE constexpr T share(T q, T largest) const {
        return detail::select(q < largest, T(0), T(1));
    }
    template <class T> MIS_HOST_DEVICE constexpr T times(T s, detail::identity_t<T> x) const { return s * x; }
    template <class T> MIS_HOST_DEVICE constexpr T join(T x, detail::identity_t<T> y) const {
        return detail::larger(x, y);
    }
    // Counts a tie as one of two: the recursion does not know how many techniques tie. path.hpp does.
    template <class T> MIS_HOST_DEVICE constexpr T against(T own, T others) const {
        const T unless_less = detail::select(own > others, T(1), detail::all_lanes<T>(0.5));
        return detail::select(own < others || !(own > T(0)), T(0), unless_less);
    }
    template <class T> MIS_HOST_DEVICE constexpr T operator()(T a, T b) const {
        return mis::weight_of_first(*this, a, b);
    }
};

// The heuristics by name: mis::power(a, b) weighs two techniques, mis::weights(mis::power, ...) any number.
// Other parameters: mis::power_heuristic{1.5}, mis::cutoff_heuristic{0.01}.
#ifdef __CUDA_ARCH__ // device code cannot refer to constants of the host's
#define MIS_DETAIL_CONSTANT static __device__ constexpr
#else
#define MIS_DETAIL_CONSTANT inline constexpr
#endif
MIS_DETAIL_CONSTANT average_heuristic average{};
MIS_DETAIL_CONSTANT balance_heuristic balance{};
MIS_DETAIL_CONSTANT power_heuristic<> power{};
MIS_DETAIL_CONSTANT cutoff_heuristic cutoff{};
MIS_DETAIL_CONSTANT maximum_heuristic maximum{};
#undef MIS_DETAIL_CONSTANT

namespace detail {

template <class T> struct normalizer {
    weighing_t<T> largest,
        total; // the largest density; the sum of all shares, 0 only where all densities are 0
};

template <class Heuristic, class T>
MIS_HOST_DEVICE constexpr weighing_t<T> share_of(const Heuristic& heuristic, T density,
                                                 weighing_t<T> largest) {
    if constexpr (needs_no_scale<Heuristic, T>)
        return heuristic.times(weighing_t<T>(1), finite_density(density));
    else
        return heuristic.share(static_cast<weighing_t<T>>(density), largest);
}

// Of the densities 0, stride, 2 stride ...
template <class Heuristic, class T>
MIS_HOST_DEVICE constexpr normalizer<T> normalize(const Heuristic& heuristic, const T* densities, int count,
                                                  std::ptrdiff_t stride = 1) {
    expect_real<T>();
    using W = weighing_t<T>;
    normalizer<T> n{W(0), W(0)};
    for (int i = 0; i < count; ++i)
        assert_density(densities[i * stride]);
    if constexpr (!needs_no_scale<Heuristic, T>)
        for (int i = 0; i < count; ++i)
            n.largest = larger(n.largest, static_cast<W>(densities[i * stride]));
    for (int i = 0; i < count; ++i)
        n.total += share_of(heuristic, densities[i * stride], n.largest);
    if constexpr (!needs_no_scale<Heuristic, T>)
        n.total = select(n.largest > W(0), n.total, W(0));
    return n;
}

template <class Heuristic, class T>
MIS_HOST_DEVICE constexpr T normalized(const Heuristic& heuristic, const normalizer<T>& n, T density) {
    using W = weighing_t<T>;
    const W weight = share_of(heuristic, density, n.largest) / n.total;
    return static_cast<T>(select(n.total > W(0), weight, W(0)));
}

} // namespace detail

// Weight of technique i of `count` techniques with the given effective relative densities.
template <class Heuristic, class T>
MIS_HOST_DEVICE constexpr T weight(const Heuristic& heuristic, const T* densities, int count, int i) {
    return detail::normalized(heuristic, detail::normalize(heuristic, densities, count), densities[i]);
}

// Weights of all `count` techniques. `out` may be `densities`.
template <class Heuristic, class T>
MIS_HOST_DEVICE constexpr void weights(const Heuristic& heuristic, const T* densities, int count, T* out) {
    const auto n = detail::normalize(heuristic, densities, count);
    for (int i = 0; i < count; ++i)
        out[i] = detail::normalized(heuristic, n, densities[i]);
}

// The same for arrays and for anything contiguous with data() and size(): std::array, std::vector, std::span.
template <class Heuristic, class T, std::size_t N>
MIS_HOST_DEVICE constexpr T weight(const Heuristic& heuristic, const T (&densities)[N], int i) {
    return mis::weight(heuristic, &densities[0], static_cast<int>(N), i);
}
template <class Heuristic, class T, std::size_t N>
MIS_HOST_DEVICE constexpr void weights(const Heuristic& heuristic, const T (&densities)[N], T (&out)[N]) {
    mis::weights(heuristic, &densities[0], static_cast<int>(N), &out[0]);
}
template <class Heuristic, class Range>
constexpr auto weight(const Heuristic& heuristic, const Range& densities, int i)
    -> std::decay_t<decltype(*densities.data())> {
    return mis::weight(heuristic, densities.data(), static_cast<int>(densities.size()), i);
}
template <class Heuristic, class Range, class Out>
constexpr auto weights(const Heuristic& heuristic, const Range& densities, Out&& out)
    -> decltype(densities.data(), void(out.data())) {
    assert(out.size() >= densities.size());
    mis::weights(heuristic, densities.data(), static_cast<int>(densities.size()), out.data());
}

} // namespace mis
