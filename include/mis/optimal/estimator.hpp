// SPDX-License-Identifier: MIT
// Floor 4: what is summed over samples so that solve.hpp can find the optimal weights. No Eigen here: a
// renderer's inner loop, or kernel, needs nothing else.
//
// The optimal weights of Kondapaneni et al., "Optimal multiple importance sampling", 2019 [O], have the least
// variance of all and may be negative. Technique i has density p_i and takes n_i samples a pass, and D = sum
// n_k p_k. Over all samples x of all techniques:
//   a_ik = sum p_i p_k / D^2,   b_i = sum f p_i / D^2 (for each channel),   A alpha = b,
//   F = sum_i alpha_i + sum (f - sum_k alpha_k p_k) / D.
// With alpha from these same samples the second sum is 0 and F = sum_i alpha_i: the direct estimator,
// slightly biased, as are all ratios of sums. With alpha from earlier samples F is the progressive one,
// unbiased. alpha = 0 is the balance heuristic.
//
// Everything is stored in terms of the balance weights u_i = n_i p_i / D:
//   sum u_i u_k = n_i n_k a_ik,   sum (f / D) u_i = n_i b_i,   sum (f / D)^2.
// They are within [0, 1] and finite where densities are not, and together with f / D, a contribution that has
// been weighed by balance, they are what a renderer has at hand. Counts are needed only to solve.
//
// Accuracy: everything is summed in double for float. f / D is computed without overflow wherever it is a
// number of the type. Its square, of which only the variance is made, may underflow or overflow.
//
// An f that is NaN or infinite, an f / D beyond the type's range (f = 1 and a subnormal D), and a sum of them
// beyond it: the integral of that channel is then NaN or infinite, and the variance infinite. Densities that
// are negative or NaN are a caller's bug, asserted in debug builds, of which the estimates are unspecified.
// What would need memory that is not there is asserted as well, and in release builds *spoils* the estimator:
// from then on its integrals are NaN or infinite, and its variances infinite. That is a technique number out
// of range, the sum of estimators of different sizes, and a sample for an estimator of no techniques.
//
// Under -ffast-math the same holds, but for subnormal densities, which may count as 0, and for densities in
// double above 1e305.
#pragma once

#include <mis/heuristic.hpp>
#include <type_traits>
#include <vector>

// For what runs once a sample: the loops are of constant length once they are inlined, and numbers then stay
// in registers. Unrolling the loops over channels and pairs lets the loop around them be vectorized.
#if defined(__GNUC__) && !defined(__clang__) && !defined(__CUDACC__)
#define MIS_DETAIL_UNROLL _Pragma("GCC unroll 16")
#define MIS_DETAIL_UNROLL_TWICE _Pragma("GCC unroll 2")
#else
#define MIS_DETAIL_UNROLL
#define MIS_DETAIL_UNROLL_TWICE
#endif

namespace mis::optimal {

// In the place of a number of techniques that is known at run time only. For the host: nvcc warns of it.
constexpr int dynamic = -1;

namespace detail {

// N numbers, at first 0: in the object itself, or on the heap for N = dynamic.
template <int N, class W> struct numbers {
    W number[N] = {};

    numbers() = default;
    MIS_HOST_DEVICE explicit numbers(int) {}
    MIS_HOST_DEVICE W& operator[](int i) { return number[i]; }
    MIS_HOST_DEVICE const W& operator[](int i) const { return number[i]; }
};
template <class W> struct numbers<dynamic, W> {
    std::vector<W> number;

    numbers() = default;
    explicit numbers(int n) : number(static_cast<std::size_t>(n > 0 ? n : 0)) {}
    int size() const { return static_cast<int>(number.size()); }
    W& operator[](int i) { return number[static_cast<std::size_t>(i)]; }
    const W& operator[](int i) const { return number[static_cast<std::size_t>(i)]; }
};

MIS_HOST_DEVICE constexpr int times(int factor, int m) { return m == dynamic ? dynamic : factor * m; }

// How many pairs i <= k there are of m techniques.
MIS_HOST_DEVICE constexpr int pair_count(int m) { return m == dynamic ? dynamic : m * (m + 1) / 2; }

// One sample, in the numbers of which sums are made. Not initialized.
template <int M, int Channels, class W> struct sample {
    W value[Channels];   // f / D
    W weight[M + M / 2]; // balance weights, then the first half of them again

    MIS_HOST_DEVICE explicit sample(int) {}
    MIS_HOST_DEVICE W* weights() { return &weight[0]; }
};
template <int Channels, class W> struct sample<dynamic, Channels, W> {
    W value[Channels];
    std::vector<W> weight;

    explicit sample(int m) : weight(static_cast<std::size_t>(m + m / 2)) {}
    W* weights() { return weight.data(); }
};

// a[i] of a caller's array, in the type in which it counts: std::size_t for the standard library's
// containers.
template <class Array, class = void> struct index_of { using type = int; };
template <class Array> struct index_of<Array, std::void_t<typename Array::size_type>> {
    using type = typename Array::size_type;
};
template <class Array> MIS_DETAIL_INLINE decltype(auto) at(Array& a, int i) {
    return a[static_cast<typename index_of<Array>::type>(i)];
}

// Contributions are anything with [channel] and, for one channel, plain numbers.
template <class W, class F> MIS_DETAIL_INLINE W channel(const F& f, [[maybe_unused]] int c) {
    if constexpr (std::is_arithmetic_v<F>)
        return static_cast<W>(f);
    else
        return static_cast<W>(at(f, c));
}

// Weighs the rare sample where D or its reciprocal is out of range: infinite densities share equally and
// leave f / D 0. False if all densities are 0.
template <int Channels, class W, class F, class Densities>
MIS_HOST_DEVICE bool weigh_extreme(const F& f, const Densities& densities, int m, W* u, W* value) {
    W largest = W(0), total = W(0);
    for (int k = 0; k < m; ++k)
        largest = mis::detail::larger(largest, static_cast<W>(at(densities, k)));
    assert(largest > W(0)); // no technique can have made this sample
    if (!(largest > W(0)))
        return false;
    for (int k = 0; k < m; ++k)
        total += u[k] = balance_heuristic{}.share(static_cast<W>(at(densities, k)), largest);
    for (int k = 0; k < m; ++k)
        u[k] /= total;
    for (int c = 0; c < Channels; ++c)
        value[c] = channel<W>(f, c) / total / largest;
    return true;
}

// Where reciprocals are normal numbers, with room for rounding.
template <class W> struct reciprocal {
    static constexpr W largest = (std::numeric_limits<W>::max)() * std::numeric_limits<W>::epsilon();
    static constexpr W least = W(1) / largest;
};

// Weighs any sample.
template <int Channels, class W, class F, class Densities>
MIS_DETAIL_INLINE bool weigh(const F& f, const Densities& densities, int m, W* u, W* value) {
    for (int k = 0; k < m; ++k)
        mis::detail::assert_density(at(densities, k));
    W sum = u[0] = static_cast<W>(at(densities, 0));
    MIS_DETAIL_UNROLL
    for (int k = 1; k < m; ++k)
        sum += u[k] = static_cast<W>(at(densities, k));
    if (!(sum > reciprocal<W>::least && sum < reciprocal<W>::largest)) // also for NaN
        return weigh_extreme<Channels>(f, densities, m, u, value);
    const W inverse = W(1) / sum;
    MIS_DETAIL_UNROLL
    for (int k = 0; k < m; ++k)
        u[k] *= inverse;
    MIS_DETAIL_UNROLL
    for (int c = 0; c < Channels; ++c)
        value[c] = channel<W>(f, c) * inverse;
    return true;
}

// Takes over a sample that has been weighed.
template <int Channels, class W, class Value, class Weights>
MIS_DETAIL_INLINE void copy(const Value& f_over_d, const Weights& balance_weights, int m, W* u, W* value) {
    for (int k = 0; k < m; ++k)
        mis::detail::assert_density(at(balance_weights, k));
    MIS_DETAIL_UNROLL
    for (int k = 0; k < m; ++k)
        u[k] = static_cast<W>(at(balance_weights, k));
    MIS_DETAIL_UNROLL
    for (int c = 0; c < Channels; ++c)
        value[c] = channel<W>(f_over_d, c);
}

} // namespace detail

// The sums over samples of M techniques. M = dynamic: of any number, estimator<dynamic>(m), on the heap, and
// adding a sample allocates. Channels: of a contribution, such as the three of a color.
//
// Plain data. The sum of two estimators is the estimator of both their samples: tiles, threads and ranks may
// be merged in any order. More passes need no normalization, they leave alpha what it is.
template <int M, int Channels = 3, class T = double> struct alignas(16) estimator {
    static_assert(M >= 1 || M == dynamic, "mis: an estimator of no techniques");
    static_assert(Channels >= 1, "mis: an estimator of no channels");
    static_assert(!std::is_integral_v<T>,
                  "mis: estimates are real numbers: write estimator<M, Channels, float>");
    using number = mis::detail::wide_t<T>;

    detail::numbers<detail::times(Channels, M), number> values; // sum (f / D) u_k, [c m + k]
    detail::numbers<detail::pair_count(M), number> products;    // sum u_i u_k, [pair(i, k)]
    number squares[Channels] = {};                              // sum (f / D)^2

    estimator() = default;
    MIS_HOST_DEVICE explicit estimator(int techniques)
        : values(Channels * techniques), products(detail::pair_count(techniques)) {
        assert(M == dynamic ? techniques >= 1 : M == techniques);
    }

    // m, the number of techniques.
    MIS_HOST_DEVICE int size() const {
        if constexpr (M == dynamic)
            return values.size() / Channels;
        else
            return M;
    }

    // Where the products are: [d m + i] for techniques i and k = i + d modulo m. Those of one distance d
    // stand together and none stands twice, so that adding a sample is one loop over i, of all m and as many
    // d.
    MIS_HOST_DEVICE int pair(int i, int k) const {
        const int m = size(), d = k < i ? k - i + m : k - i;
        return 2 * d > m || (2 * d == m && i > k) ? (m - d) * m + k : d * m + i;
    }

    // A sample that any of the techniques has made.
    //   f          contribution per channel, also where it is 0: [c], or a number if there is one channel;
    //   densities  n_k p_k of all techniques at the sample, [k], >= 0, absolute: in the units of f.
    // Infinite densities share the sample equally; f / D is then 0, and what f adds needs add_weighted.
    // Densities that are all 0 are a caller's bug, asserted in debug builds; the sample is ignored.
    // An estimator of no techniques is spoiled, which is asserted in debug builds.
    template <class F, class Densities> MIS_DETAIL_INLINE void add(const F& f, const Densities& densities) {
        if (has_none())
            return;
        detail::sample<M, Channels, number> x(size());
        if (detail::weigh<Channels>(f, densities, size(), x.weights(), x.value))
            add_sample(x);
    }

    // The same from a renderer that has weighed its sample:
    //   value    f / D per channel: the contribution f / (n_i p_i) of technique i, times its balance weight;
    //   weights  balance weights of all techniques at the sample, [k], whose sum is 1.
    template <class Value, class Weights>
    MIS_DETAIL_INLINE void add_weighted(const Value& value, const Weights& weights) {
        if (has_none())
            return;
        detail::sample<M, Channels, number> x(size());
        detail::copy<Channels>(value, weights, size(), x.weights(), x.value);
        add_sample(x);
    }

    // Draws of technique i that left the domain: a walk that ended, a direction that missed. There no other
    // technique has density, so each adds 1 / n_i^2 to a_ii, and nothing to b. Negative: taken back. An i
    // that is no technique spoils the estimator.
    MIS_HOST_DEVICE void add_outside(int i, number draws = 1) {
        if (!has(i))
            return;
        products[pair(i, i)] += draws;
    }

    // An estimator of another size spoils this one.
    MIS_HOST_DEVICE estimator& operator+=(const estimator& other) {
        const int m = size();
        assert(other.size() == m);
        if (other.size() != m) {
            spoil();
            return *this;
        }
        for (int i = 0; i < Channels * m; ++i)
            values[i] += other.values[i];
        for (int i = 0; i < detail::pair_count(m); ++i)
            products[i] += other.products[i];
        for (int c = 0; c < Channels; ++c)
            squares[c] += other.squares[c];
        return *this;
    }

    // For a caller's bug, where debug builds stop: no estimate of this is a number any more.
    MIS_HOST_DEVICE void spoil() {
        for (int i = 0; i < Channels * size(); ++i)
            values[i] = mis::detail::limits<number>::infinity;
        for (int c = 0; c < Channels; ++c)
            squares[c] = mis::detail::limits<number>::infinity;
    }
    // Whether i is a technique; spoils the estimator if not.
    MIS_HOST_DEVICE bool has(int i) {
        const bool is_technique = i >= 0 && i < size();
        assert(is_technique);
        if (!is_technique)
            spoil();
        return is_technique;
    }
    // Whether there is no technique; spoils the estimator then.
    MIS_DETAIL_INLINE bool has_none() {
        if constexpr (M == dynamic)
            return !has(0);
        else
            return false;
    }

    // What the functions above are made of. Completes the sample.
    MIS_DETAIL_INLINE void add_sample(detail::sample<M, Channels, number>& x) {
        const int m = size();
        number* const u = x.weights();
        MIS_DETAIL_UNROLL
        for (int k = 0; k < m / 2; ++k)
            u[m + k] = u[k];
        MIS_DETAIL_UNROLL_TWICE
        for (int i = 0; i < m; ++i) {
            MIS_DETAIL_UNROLL
            for (int d = 0; d < (m + 1) / 2; ++d)
                products[d * m + i] += u[i] * u[i + d];
            MIS_DETAIL_UNROLL
            for (int c = 0; c < Channels; ++c)
                values[c * m + i] += x.value[c] * u[i];
        }
        if (m % 2 == 0) // opposite techniques, half a round apart: each pair once
            for (int i = 0; i < m / 2; ++i)
                products[m / 2 * m + i] += u[i] * u[i + m / 2];
        MIS_DETAIL_UNROLL
        for (int c = 0; c < Channels; ++c)
            squares[c] += x.value[c] * x.value[c];
    }
};

// How many draws have been added, those that left the domain included: n^T A n, because balance weights sum
// to 1. Up to rounding. Divided by the sum of all counts it is the number of passes.
template <int M, int Channels, class T>
MIS_HOST_DEVICE typename estimator<M, Channels, T>::number draws(const estimator<M, Channels, T>& e) {
    typename estimator<M, Channels, T>::number same = 0, different = 0;
    const int m = e.size();
    for (int i = 0; i < detail::pair_count(m); ++i)
        (i < m ? same : different) += e.products[i];
    return same + 2 * different;
}

// The progressive estimator: sums of all samples for the next alpha, and the estimate with the present one,
// which earlier batches have determined. Unbiased, where the direct one is only consistent.
//
//     progressive<4> p;
//     for each batch:
//         for each pass: p.add(f, densities); or one of the others, for every draw
//         end_batch(p, counts, passes);      // solve.hpp
//     integral(p)
//
// Every draw must be added: a sample with f = 0 still subtracts sum alpha_k p_k / D, one outside the domain
// still alpha_i / n_i. Counts must be the same in all batches. Threads add to forks of p, merged before
// end_batch.
template <int M, int Channels = 3, class T = double> struct alignas(16) progressive {
    using number = mis::detail::wide_t<T>;

    estimator<M, Channels, T> sums;                              // of all batches, the open one included
    detail::numbers<detail::times(Channels, M), number> control; // alpha_k / n_k of the open batch, [c m + k]
    number residual[Channels] = {};         // sum of r = (f - sum_k alpha_k p_k) / D over the open batch
    number residual_squares[Channels] = {}; // sum r^2
    number total[Channels] = {};            // of the estimates of all passes of closed batches
    number total_squares[Channels] = {};    // sum r^2 of closed batches
    number passes = 0;                      // in closed batches
    number passes_at_solve = 0;             // that alpha is made from
    bool open = false;                      // whether anything has been added since the last batch was closed

    progressive() = default;
    MIS_HOST_DEVICE explicit progressive(int techniques) : sums(techniques), control(Channels * techniques) {}

    MIS_HOST_DEVICE int size() const { return sums.size(); }

    // As the estimator's functions, which say what spoils it.
    template <class F, class Densities> MIS_DETAIL_INLINE void add(const F& f, const Densities& densities) {
        if (has_none())
            return;
        detail::sample<M, Channels, number> x(size());
        if (detail::weigh<Channels>(f, densities, size(), x.weights(), x.value))
            add_sample(x);
    }
    template <class Value, class Weights>
    MIS_DETAIL_INLINE void add_weighted(const Value& value, const Weights& weights) {
        if (has_none())
            return;
        detail::sample<M, Channels, number> x(size());
        detail::copy<Channels>(value, weights, size(), x.weights(), x.value);
        add_sample(x);
    }
    MIS_HOST_DEVICE void add_outside(int i, number draws = 1) {
        if (!sums.has(i)) {
            spoil();
            return;
        }
        sums.add_outside(i, draws);
        for (int c = 0; c < Channels; ++c) {
            const number r = control[c * size() + i];
            residual[c] -= r * draws;
            residual_squares[c] += r * r * draws;
        }
        open = true;
    }

    // Meaningful in two cases: for a fork of this, into the batch it was made in, because its residual is of
    // the same alpha; and for one whose batches are all closed, with any alpha. The present alpha stays.
    MIS_HOST_DEVICE progressive& operator+=(const progressive& other) {
        assert(size() == other.size() && (!other.open || same_control(other)));
        sums += other.sums;
        if (size() != other.size())
            spoil();
        for (int c = 0; c < Channels; ++c) {
            residual[c] += other.residual[c];
            residual_squares[c] += other.residual_squares[c];
            total[c] += other.total[c];
            total_squares[c] += other.total_squares[c];
        }
        passes += other.passes;
        open = open || other.open;
        return *this;
    }

    MIS_HOST_DEVICE bool same_control(const progressive& other) const {
        for (int i = 0; i < Channels * size(); ++i)
            if (control[i] < other.control[i] || other.control[i] < control[i])
                return false;
        return true;
    }

    MIS_HOST_DEVICE void spoil() {
        sums.spoil();
        for (int c = 0; c < Channels; ++c)
            total[c] = total_squares[c] = mis::detail::limits<number>::infinity;
    }
    MIS_DETAIL_INLINE bool has_none() {
        const bool none = sums.has_none();
        if (none)
            spoil();
        return none;
    }

    MIS_DETAIL_INLINE void add_sample(detail::sample<M, Channels, number>& x) {
        sums.add_sample(x);
        const int m = size();
        const number* const u = x.weights();
        for (int c = 0; c < Channels; ++c) {
            number g = number(0);
            for (int k = 0; k < m; ++k)
                g += control[c * m + k] * u[k];
            const number r = x.value[c] - g;
            residual[c] += r;
            residual_squares[c] += r * r;
        }
        open = true;
    }
};

// The present alpha and nothing added: for one thread's part of the open batch.
template <int M, int Channels, class T>
MIS_HOST_DEVICE progressive<M, Channels, T> fork(const progressive<M, Channels, T>& p) {
    progressive<M, Channels, T> empty(p.size());
    empty.control = p.control;
    return empty;
}

// w_i = alpha_i p_i / f + n_i p_i / D (1 - sum_k alpha_k p_k / f), [O]: the optimal weights of one channel at
// a sample, by which its contributions f / (n_i p_i) are to be multiplied. Their sum is 1; some may be
// negative or above 1.
//   alpha      coefficients of the channel, [k];
//   f          contribution of the channel at the sample;
//   counts     n_k, [k], and densities n_k p_k, [k], of all `count` techniques, absolute.
// Undefined where f is 0, infinite or NaN, or where a density is infinite: there, those of the balance
// heuristic. (With f = 0 the products w_i f are not 0: the estimate has to be made from add, not from
// weights.) All 0 where all densities are. alpha_k p_k must not overflow; a weight beyond the range of T, for
// a very small f, is infinite. `out` may be `densities`.
template <class Alpha, class T, class Counts, class Densities, class Out>
MIS_HOST_DEVICE void weights(const Alpha& alpha, T f, const Counts& counts, const Densities& densities,
                             int count, Out&& out) {
    mis::detail::expect_real<T>();
    using W = mis::detail::wide_t<T>;
    const balance_heuristic balance{};
    W largest = W(0), total = W(0), sum = W(0);
    for (int k = 0; k < count; ++k) {
        mis::detail::assert_density(detail::at(densities, k));
        largest = mis::detail::larger(largest, static_cast<W>(detail::at(densities, k)));
    }
    const bool optimal = (f > T(0) || f < T(0)) && !mis::detail::is_infinite(mis::detail::absolute(f)) &&
                         !mis::detail::is_infinite(largest);
    const auto controlled = [&](int k) { // alpha_k p_k
        const W n = static_cast<W>(detail::at(counts, k));
        return optimal && n > W(0)
                   ? static_cast<W>(detail::at(alpha, k)) * (static_cast<W>(detail::at(densities, k)) / n)
                   : W(0);
    };
    for (int k = 0; k < count; ++k) {
        total += balance.share(static_cast<W>(detail::at(densities, k)), largest);
        sum += controlled(k);
    }
    const W contribution = optimal ? static_cast<W>(f) : W(1);
    for (int k = 0; k < count; ++k) {
        const W own =
            largest > W(0) ? balance.share(static_cast<W>(detail::at(densities, k)), largest) / total : W(0);
        const W weight = (controlled(k) + own * (contribution - sum)) / contribution;
        detail::at(out, k) = static_cast<T>(weight);
    }
}

} // namespace mis::optimal

#undef MIS_DETAIL_UNROLL
#undef MIS_DETAIL_UNROLL_TWICE
