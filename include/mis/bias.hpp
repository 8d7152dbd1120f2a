// SPDX-License-Identifier: MIT
// Floor 2: techniques that are biased, such as density estimation, as a source of effective densities.
//
// A biased technique returns (f + b) / p where an unbiased one returns f / p. The bias-aware balance
// heuristic of Hachisuka, Pantaleoni and Jensen, "A Path Space Extension for Robust Light Transport
// Simulation" [H] 13 and 14, is the balance heuristic with a smaller effective density for it: mis::balance
// or mis::weights(mis::balance, ...) turns what is computed here into weights.
//
// Unlike everything else here it needs *absolute* densities: n p in units of 1 / measure of the domain, all
// techniques of a sample in the same units. A common factor does not cancel.
#pragma once

#include <cmath>
#include <mis/config.hpp>

namespace mis {

// n p / ((1 + r)^2 + n p A r^2), [H] 14: effective density of a biased technique.
//   density         n p, absolute, >= 0;
//   relative_bias   r = |b| / f, >= 0, at the sample and for samples of *any* technique. For b < 0 this is on
//                   the safe side, because |f + b| is then below f;
//   domain_measure  A, the measure of the domain that is integrated over, in the units of 1 / p; not
//   subnormal.
// r = 0 gives n p itself, so weights equal balance's to the last bit. An infinite density gives the limit
// 1 / (A r^2), an infinite r or A (with r > 0) gives 0, and A = 0 charges the bias only as variance. Computed
// without overflow wherever the result is a number of the type, and in double for float. In double under
// -ffast-math, n p, r and A must stay within 1e-60 and 1e60, or be 0 or infinite.
template <class T>
MIS_HOST_DEVICE constexpr T bias_aware_density(T density, detail::identity_t<T> relative_bias,
                                               detail::identity_t<T> domain_measure) {
    detail::expect_real<T>();
    detail::assert_density(density);
    detail::assert_density(relative_bias);
    detail::assert_density(domain_measure);
    using W = detail::wide_t<T>;
    const W q = static_cast<W>(density), r = static_cast<W>(relative_bias),
            a = static_cast<W>(domain_measure);
    // r / (1 + r) on each side: neither factor exceeds its density or measure, and where a product of the two
    // overflows nothing but the limit is left.
    const W u = r / (W(1) + r);
    const W charge = (q * u) * (a * u);
    W result = q / (W(1) + r) / (W(1) + r) / (W(1) + charge);
    // Selected, for packets, and tested first, for scalars, which seldom have one of these.
    const detail::mask_t<W> at_limit = detail::is_infinite(q) || detail::is_infinite(charge);
    if (detail::lanes<W>::any(at_limit))
        result = detail::select<W>(at_limit, W(1) / r / a / r, result);
    const detail::mask_t<W> impossible = detail::is_infinite(r) || detail::is_infinite(a);
    result = detail::select(impossible, W(0), result);
    return detail::select(r > W(0) && q > W(0), static_cast<T>(result), density);
}

// The same for all `count` techniques of a sample, each with its own r and A; r = 0 for those without bias.
// `out` may be any of the inputs. Several biased techniques are the natural extension: [H] proves one.
template <class T>
MIS_HOST_DEVICE constexpr void bias_aware_densities(const T* densities, const T* relative_biases,
                                                    const T* domain_measures, int count, T* out) {
    for (int i = 0; i < count; ++i)
        out[i] = bias_aware_density(densities[i], relative_biases[i], domain_measures[i]);
}

// (1 / min n_i - 1 / sum n_i) mu^2: how far the squared error of balance may be above that of any other
// non-negative weights, unbiased techniques [V97] 9.2; [H] 15 for bias-aware balance, whose proof puts an
// upper bound in the place of the squared bias. docs/bias.md has the consequence.
template <class T>
MIS_HOST_DEVICE constexpr T balance_gap_bound(T least_count, detail::identity_t<T> total_count,
                                              detail::identity_t<T> integral) {
    return (T(1) / least_count - T(1) / total_count) * integral * integral;
}

// Progressive density estimation lets the radius shrink with the iterations, so that bias vanishes: squared
// radii fall as i^(alpha - 1), and for a kernel in two dimensions and 0 < alpha < 1
//   variance O(n^-alpha), squared bias O(n^-2(1 - alpha)), after n iterations (Knaus and Zwicker; [H] 19).
// Both fall at one rate where alpha = 2 (1 - alpha): 2/3, the one alpha for which balance, which ignores
// bias, keeps the rate of bias-aware balance, [H] 20 - 23.
template <class T> constexpr T optimal_alpha = T(2) / T(3);

// The same for a kernel in D dimensions, 1 to 3, as merges in media have them (media.hpp): with bias O(r^2),
// variance 1 / (N r^D) and radii that fall as i^((alpha - 1) / D), both errors fall at one rate for this
// alpha.
template <class T> MIS_HOST_DEVICE constexpr T optimal_alpha_in(int dimensions) {
    return T(4) / T(4 + dimensions);
}

// r^2_{i+1} = r^2_i (i + alpha) / (i + 1), i >= 1: the recurrence, in squared radii, [H] 3.2.4. Approaches
// r^2_1 i^(alpha - 1) / Gamma(1 + alpha).
template <class T>
MIS_HOST_DEVICE constexpr T next_squared_radius(T squared_radius, long long iteration,
                                                detail::identity_t<T> alpha = optimal_alpha<T>) {
    using W = detail::wide_t<T>;
    const W i = static_cast<W>(iteration);
    return static_cast<T>(static_cast<W>(squared_radius) * ((i + static_cast<W>(alpha)) / (i + W(1))));
}

// r_i = r_1 i^((alpha - 1) / D), i >= 1: the closed form, which any iteration can compute alone; D = 2 but
// for merges in media.
template <class T>
MIS_HOST_DEVICE T progressive_radius(T first_radius, long long iteration,
                                     detail::identity_t<T> alpha = optimal_alpha<T>, int dimensions = 2) {
    detail::expect_real<T>();
    using std::pow;
    using W = detail::wide_t<T>;
    const W exponent = (static_cast<W>(alpha) - W(1)) / static_cast<W>(dimensions);
    return static_cast<T>(static_cast<W>(first_radius) * pow(static_cast<W>(iteration), exponent));
}

} // namespace mis
