// SPDX-License-Identifier: MIT
// Floor 2: Russian roulette and splitting: by which rate a walk ends or goes on in several copies. For who
// lets walks do so; mis.hpp does not include it.
//
// A rate q is an expected number of copies. Below 1 the walk survives with probability q (roulette), above 1
// it goes on in q copies on average (splitting), each with 1 / q of the weight. Any positive rate leaves the
// estimate unbiased, so rates may come from guesses:
//
//     const float q = mis::adjoint_rate(nu, adjoint, estimate, mis::window_of_size(5.f));
//     const int n = mis::copies(q, uniform());
//     nu /= q;                                // of each of the n copies
//
// [V] Vorba and Krivanek, "Adjoint-Driven Russian Roulette and Splitting in Light Transport Simulation", 2016
// (equations of its supplemental document); [R] Rath et al., "EARS: Efficiency-Aware Russian Roulette and
// Splitting", 2022; [M] Meyer et al., "MARS: Multi-sample Allocation through Russian Roulette and Splitting",
// 2024.
//
// Rates are bounded, and defined for all that learned numbers may be, also under -ffast-math. Of a number
// only the magnitude counts: negative weights and estimates have rates, too. A weight or adjoint of 0 has the
// least rate. Where anything is NaN or infinite, or what is divided by is 0, nothing is known, and the rate
// is 1. In double (float is computed in it), numbers beyond 1e-70 and 1e70 count as these.
//
// docs/roulette.md tells how rates enter the weights of multiple importance sampling.
#pragma once

#include <cmath>
#include <cstddef>
#include <mis/config.hpp>

namespace mis {

// What no rate is below or above. `least` > 0, so that where a guess is 0 by mistake the walk still comes by;
// `most` is the cap on the copies at one vertex. A renderer that also caps the copies of a whole walk passes
// what is left as `most`.
template <class T> struct rate_bounds {
    T least = T(1) / T(32);
    T most = T(32);
};

// The window within which nu Psi / I is to stay: below it walks are played against, above it they are split,
// and inside left alone. {1, 1} is the exact rate, which makes all weights I / Psi.
template <class T> struct weight_window { T lower = T(1), upper = T(1); };

// The window of size s = upper / lower >= 1 whose middle is 1: 2 / (1 + s) and s times that, as the authors
// of [V] have it, with s = 5. An infinite s: {0, 2}, which splits only.
template <class T> MIS_HOST_DEVICE constexpr weight_window<T> window_of_size(T s) {
    detail::expect_real<T>();
    assert(s >= T(1));
    const T lower = T(2) / (T(1) + s);
    return {lower, T(2) - lower};
}

namespace detail {

template <class... T> MIS_HOST_DEVICE constexpr bool are_finite(T... x) { return (is_finite(x) && ...); }

// |x|, 0 or in a range in which products and quotients of four numbers are finite and positive in any order.
template <class T> MIS_HOST_DEVICE constexpr wide_t<T> magnitude(T x) {
    using W = wide_t<T>;
    const W a = absolute(static_cast<W>(x));
    return a > W(0) ? larger(smaller(a, W(1e70)), W(1e-70)) : W(0);
}

template <class T> MIS_HOST_DEVICE constexpr T bounded(wide_t<T> rate, const rate_bounds<T>& bounds) {
    assert(bounds.least > T(0) && bounds.least <= T(1) && bounds.most >= T(1) && is_finite(bounds.most));
    using W = wide_t<T>;
    return static_cast<T>(smaller(larger(rate, static_cast<W>(bounds.least)), static_cast<W>(bounds.most)));
}

} // namespace detail

// nu Psi^r / I, [V] 17, brought into the window.
//   weight    nu, of the walk that arrives;
//   adjoint   Psi^r, what a walk of weight 1 will contribute from here on, on average: reflected importance
//             (light walks) or radiance (camera walks), for the direction in which the walk arrives. What it
//             contributes here itself, such as a light that is hit, is no part of it;
//   estimate  I, of the pixel (camera walks) or image (light walks), in the units of nu Psi.
// Colours: the mean over the channels of nu Psi, as `weight` with an adjoint of 1. With a constant adjoint it
// is roulette by throughput. The authors of [V] leave Dirac scatterers out. Up to the bounds, nu Psi / I of
// what goes on is within the window.
template <class T>
MIS_HOST_DEVICE constexpr T adjoint_rate(T weight, detail::identity_t<T> adjoint,
                                         detail::identity_t<T> estimate,
                                         const weight_window<detail::identity_t<T>>& window = {},
                                         const rate_bounds<detail::identity_t<T>>& bounds = {}) {
    detail::expect_real<T>();
    assert(window.lower >= T(0) && window.upper >= window.lower);
    using W = detail::wide_t<T>;
    const W scale = detail::magnitude(estimate);
    if (!detail::are_finite(weight, adjoint, estimate) || !(scale > W(0)))
        return T(1);
    const W relative = detail::magnitude(weight) * detail::magnitude(adjoint) / scale;
    const W lower = static_cast<W>(window.lower), upper = static_cast<W>(window.upper);
    const W rate = relative < lower ? relative / lower : relative > upper ? relative / upper : W(1);
    return detail::bounded<T>(rate, bounds);
}

// The whole number of copies for a rate, which is their expectation: rate rounded down, and one more with the
// probability of what is left. `u` is uniform in [0, 1); the probability is as fine as u's steps. The rate is
// one of this page's, so bounded. NaN and infinity, a caller's bug, asserted in debug builds, are 1 copy.
template <class T> MIS_HOST_DEVICE constexpr int copies(T rate, detail::identity_t<T> u) {
    detail::expect_real<T>();
    assert(detail::is_finite(rate) && rate >= T(0) && rate < T(1 << 20) && u >= T(0) && u < T(1));
    if (!detail::is_finite(rate))
        return 1;
    const int whole = static_cast<int>(detail::smaller(rate, T(1 << 20)));
    return whole + (u < rate - T(whole) ? 1 : 0);
}

// ---- Efficiency: variance and cost in place of the adjoint ----

// What a walk of weight 1 does from a vertex on: moments of its contribution, and its cost, in any unit.
template <class T> struct walk_estimate {
    T second_moment = T(0);
    T variance = T(0);
    T cost = T(0);
};
// The same of one estimate of the image, or of the pixel: mean over the pixels, outliers left out.
template <class T> struct image_estimate {
    T variance = T(0);
    T cost = T(0);
};

namespace detail {

// nu sqrt(V / C) sqrt(C_I / V_I), or 1 where it is not known.
template <class T>
MIS_HOST_DEVICE wide_t<T> efficiency_factor(T weight, T variance, T cost, const image_estimate<T>& image) {
    using W = wide_t<T>;
    using std::sqrt;
    const W c = magnitude(cost), image_variance = magnitude(image.variance),
            image_cost = magnitude(image.cost);
    if (!are_finite(weight, variance, cost, image.variance, image.cost) || !(c > W(0)) ||
        !(image_variance > W(0)) || !(image_cost > W(0)))
        return W(1);
    return magnitude(weight) * (sqrt(magnitude(variance) / c) * sqrt(image_cost / image_variance));
}

} // namespace detail

// Efficiency-aware roulette and splitting [R]: with q_V = nu sqrt(V / C) sqrt(C_I / V_I), and q_E the same
// with the second moment in place of V, roulette by q_E where that is at most 1, splitting by q_V where that
// is at least 1, and 1 between them. A fixed point: V and C are those of walks that use the rate, so that
// both are learned over a few passes.
template <class T>
MIS_HOST_DEVICE T efficiency_rate(T weight, const walk_estimate<detail::identity_t<T>>& here,
                                  const image_estimate<detail::identity_t<T>>& image,
                                  const rate_bounds<detail::identity_t<T>>& bounds = {}) {
    detail::expect_real<T>();
    using W = detail::wide_t<T>;
    const W by_moment = detail::efficiency_factor<T>(weight, here.second_moment, here.cost, image);
    const W by_variance = detail::efficiency_factor<T>(weight, here.variance, here.cost, image);
    const W rate = by_moment <= W(1) ? by_moment : by_variance >= W(1) ? by_variance : W(1);
    return detail::bounded<T>(rate, bounds);
}

// The same for one of several techniques that start at a vertex (scattering, next events, guiding), each with
// a rate of its own [M]: variance and cost are those of the technique's own weighted contributions. Rates in
// the ratio sqrt(V_t / C_t) make variance times cost least, whatever the rest of the renderer does. The
// weights count the rate as that technique's number of samples.
template <class T>
MIS_HOST_DEVICE T technique_rate(T weight, detail::identity_t<T> variance, detail::identity_t<T> cost,
                                 const image_estimate<detail::identity_t<T>>& image,
                                 const rate_bounds<detail::identity_t<T>>& bounds = {}) {
    detail::expect_real<T>();
    return detail::bounded<T>(detail::efficiency_factor<T>(weight, variance, cost, image), bounds);
}

// Weighted mean, variance and cost of contributions as they come. Plain data, in the scalar that is asked
// for; threads sum their own and add them up. Values and costs that are NaN or infinite are left out, and
// what has no positive weight.
template <class T> struct running_statistics {
    T weight = T(0);     // sum of weights
    T mean = T(0);       // of values
    T deviations = T(0); // sum of weight (value - mean)^2
    T cost = T(0);       // sum of weight times cost

    MIS_HOST_DEVICE constexpr void add(T value, T value_cost = T(1), T value_weight = T(1)) {
        if (!detail::are_finite(value, value_cost, value_weight) || !(value_weight > T(0)))
            return;
        weight += value_weight;
        const T off = value - mean;
        mean += off * (value_weight / weight);
        deviations += value_weight * off * (value - mean);
        cost += value_weight * value_cost;
    }
    MIS_HOST_DEVICE constexpr running_statistics& operator+=(const running_statistics& other) {
        if (!(other.weight > T(0)))
            return *this;
        const T all = weight + other.weight, off = other.mean - mean, share = other.weight / all;
        deviations += other.deviations + off * off * (weight * share);
        mean += off * share;
        weight = all;
        cost += other.cost;
        return *this;
    }
};
// Of one contribution; 0 where there is none yet.
template <class T> MIS_HOST_DEVICE constexpr T variance(const running_statistics<T>& s) {
    return s.weight > T(0) ? s.deviations / s.weight : T(0);
}
template <class T> MIS_HOST_DEVICE constexpr T second_moment(const running_statistics<T>& s) {
    return variance(s) + s.mean * s.mean;
}
template <class T> MIS_HOST_DEVICE constexpr T mean_cost(const running_statistics<T>& s) {
    return s.weight > T(0) ? s.cost / s.weight : T(0);
}
template <class T> MIS_HOST_DEVICE constexpr walk_estimate<T> estimate_of(const running_statistics<T>& s) {
    return {second_moment(s), variance(s), mean_cost(s)};
}
// As if all weights had been multiplied by a factor: below 1, what comes later counts for more. For fixed
// points, whose earlier values came from other rates.
template <class T>
MIS_HOST_DEVICE constexpr running_statistics<T> scaled(running_statistics<T> s,
                                                       detail::identity_t<T> factor) {
    s.weight *= factor;
    s.deviations *= factor;
    s.cost *= factor;
    return s;
}

// A mean that leaves out the largest values, as the mean over an image's pixels of their variances must: one
// firefly would otherwise set the rates of all. Sums over ranges of a factor of 4, so that it needs no list
// of values, and merging is exact. Values that are negative, NaN or infinite are left out, and what has no
// positive weight; those beyond 1e-19 and 1e19 are counted with the next range.
template <class T> struct trimmed_mean {
    static constexpr int ranges = 64;
    T weights[ranges] = {}, sums[ranges] = {};

    MIS_HOST_DEVICE void add(T value, T value_weight = T(1)) {
        if (!detail::are_finite(value, value_weight) || !(value >= T(0)) || !(value_weight > T(0)))
            return;
        using std::frexp;
        int exponent = -ranges;
        if (value > T(0))
            (void)frexp(value, &exponent);
        const int range = (exponent + ranges) / 2;
        const int i = exponent <= -ranges ? 0 : range < ranges ? range : ranges - 1;
        weights[i] += value_weight;
        sums[i] += value_weight * value;
    }
    MIS_HOST_DEVICE constexpr trimmed_mean& operator+=(const trimmed_mean& other) {
        for (int i = 0; i < ranges; ++i) {
            weights[i] += other.weights[i];
            sums[i] += other.sums[i];
        }
        return *this;
    }
};
// The mean without the largest values, which are `share` of all weight, in [0, 1). Within the range of the
// last one left out, the values left out are taken to have the mean of the range. 0 where there is none.
template <class T> MIS_HOST_DEVICE constexpr T mean(const trimmed_mean<T>& t, detail::identity_t<T> share) {
    assert(share >= T(0) && share < T(1));
    T all = T(0);
    for (const T& w : t.weights)
        all += w;
    T left_out = share * all, weight = T(0), sum = T(0);
    for (int i = trimmed_mean<T>::ranges - 1; i >= 0; --i) {
        const T kept = detail::larger(t.weights[i] - left_out, T(0));
        left_out = detail::larger(left_out - t.weights[i], T(0));
        if (kept > T(0)) {
            weight += kept;
            sum += t.sums[i] * (kept / t.weights[i]);
        }
    }
    return weight > T(0) ? sum / weight : T(0);
}

// ---- Zero variance ----

// k Psi / total: the density by which every choice of a walk makes the estimate exact, where Psi is. Emission
// [V] 5: k = L_e |cos|, Psi the incident adjoint, total = I. Scattering [V] 6: k = f |cos|, total = Psi^r.
// Flights in media: k = T sigma_t, Psi = Psi^r at the collision, total = Psi at the start. A total of 0: 0.
template <class T>
MIS_HOST_DEVICE constexpr T zero_variance_density(T kernel, detail::identity_t<T> adjoint,
                                                  detail::identity_t<T> total) {
    detail::expect_real<T>();
    return total > T(0) ? kernel * adjoint / total : T(0);
}

// Psi^r / (Psi^e + Psi^r), [V] 7: the probability that a walk goes on from where it may also contribute and
// end. It then contributes only where it ends. 1 where neither is known to be positive.
template <class T>
MIS_HOST_DEVICE constexpr T zero_variance_survival(T reflected, detail::identity_t<T> emitted) {
    detail::expect_real<T>();
    const bool known = detail::are_finite(reflected, emitted) && reflected >= T(0) && emitted >= T(0);
    return known && reflected + emitted > T(0) ? reflected / (reflected + emitted) : T(1);
}

namespace detail {

// The i-th of a table, or of what a function gives.
template <class T, class F> MIS_HOST_DEVICE constexpr T value_at(const F& f, int i) {
    if constexpr (std::is_invocable_v<const F&, int>)
        return static_cast<T>(f(i));
    else
        return static_cast<T>(f[static_cast<std::size_t>(i)]);
}

} // namespace detail

// The probabilities of `count` choices (directions, lobes, cells of a guide, lights) with zero variance:
// out_i = |k_i Psi_i| / sum |k Psi|; returns sum |k Psi|, where nothing is negative the reflected adjoint.
//   kernel, adjoint  tables, or functions of i: k_i, what the choice multiplies the walk's weight by
//                    (integrated over the cell), and Psi_i, what will come of it;
//   defensive        in [0, 1): that share of the choices is made by |k_i| alone. Above 0 for a guessed
//                    adjoint: a choice whose adjoint is 0 by mistake would never be made, which is biased.
// Where sum |k Psi| is 0, or any Psi is NaN or infinite, nothing is known: all choices are made by |k|, and 0
// is returned. A k that is NaN or infinite counts as 0; where all k are 0, all probabilities are.
template <class Kernel, class Adjoint, class T>
MIS_HOST_DEVICE constexpr T zero_variance_probabilities(const Kernel& kernel, const Adjoint& adjoint,
                                                        int count, T* out,
                                                        detail::identity_t<T> defensive = T(0)) {
    detail::expect_real<T>();
    assert(defensive >= T(0) && defensive < T(1));
    using W = detail::wide_t<T>;
    W products = W(0), kernels = W(0);
    const auto kernel_at = [&](int i) {
        const T k = detail::value_at<T>(kernel, i);
        return detail::is_finite(k) ? detail::magnitude(k) : W(0);
    };
    bool known = true;
    for (int i = 0; i < count; ++i) {
        const T psi = detail::value_at<T>(adjoint, i);
        known = known && detail::is_finite(psi);
        products += kernel_at(i) * detail::magnitude(psi);
        kernels += kernel_at(i);
    }
    known = known && products > W(0);
    const W by_kernel = known ? static_cast<W>(defensive) : W(1);
    for (int i = 0; i < count; ++i) {
        const W k = kernel_at(i);
        W p = kernels > W(0) ? by_kernel * (k / kernels) : W(0);
        if (known)
            p += (W(1) - by_kernel) * (k * detail::magnitude(detail::value_at<T>(adjoint, i)) / products);
        out[i] = static_cast<T>(p);
    }
    return known ? static_cast<T>(products) : T(0);
}

// The choice that a uniform u in [0, 1) makes by such probabilities; one of probability 0 only where all are.
template <class T> MIS_HOST_DEVICE constexpr int pick(const T* probabilities, int count, T u) {
    int last = 0;
    for (int i = 0; i < count; ++i) {
        if (!(probabilities[i] > T(0)))
            continue;
        if (u < probabilities[i])
            return i;
        u -= probabilities[i];
        last = i;
    }
    return last;
}

// ---- Weights ----

// A density with a rate in it, for path_weights: docs/roulette.md has which density it is. Where walks split
// and end after the joins at a vertex, that of leaving it (pdf_forward, and pdf_reverse by the rate of the
// other walk); where they do so on arrival, before the joins, that of the distance.
//
//     state = weigh.scatter(state, cos_out, mis::with_rate(forward, q), mis::with_rate(reverse, q_other));
template <template <class> class Density, class T>
MIS_HOST_DEVICE constexpr Density<T> with_rate(const Density<T>& density, detail::identity_t<T> rate) {
    return Density<T>(density.value * rate);
}

} // namespace mis
