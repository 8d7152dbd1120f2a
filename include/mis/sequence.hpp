// SPDX-License-Identifier: MIT
// Floor 2: weights for a sum of integrals of more and more dimensions, as a random walk or an iteration has
// them: term j is an integral over the first j draws, and one sequence of draws gives a sample of every term.
// Several methods make such sequences (walks by different directions, iterations that carry all radiance at
// once), each N_i times; mis.hpp does not include it.
//
// [C] Csonka, Szirmay-Kalos, Antal, "Cost-driven multiple importance sampling for Monte-Carlo rendering",
// 2001, sections 5 and 6, puts one weight on all terms of a sequence. That is biased: term j depends on the
// first j draws alone, and its expectation is right only where the weights of all methods, averaged over the
// draws after j, add up to 1. So there are two things here: the weight for each term, which is to be used,
// and [C]'s, to reproduce it.
#pragma once

#include <cassert>
#include <mis/heuristic.hpp>

namespace mis {

// A sequence as far as it goes, of one of M methods: relative[k] is N_k p_k(draws so far), over that of the
// method itself without its count; all counts may have a common factor. Densities contain the probability
// that the sequence goes on so far.
template <class T, int M> struct sequence_state { T relative[M]; };

// Before the first draw. counts: N_k >= 0, how many sequences each method makes.
template <class T, int M>
MIS_HOST_DEVICE constexpr sequence_state<T, M> start_sequence(const T (&counts)[M]) {
    detail::expect_real<T>();
    sequence_state<T, M> x{};
    for (int k = 0; k < M; ++k) {
        detail::assert_density(counts[k]);
        x.relative[k] = counts[k];
    }
    return x;
}

// After another draw by method `own`, which all methods could have made with the given densities (given the
// draws before; survival included). Its own must be positive. A relative density beyond the range of T
// saturates there, and then stands for all that is larger.
template <class T, int M>
MIS_HOST_DEVICE constexpr sequence_state<T, M> next_draw(const sequence_state<T, M>& x,
                                                         const T (&densities)[M], int own) {
    assert(own >= 0 && own < M && densities[own] > T(0));
    sequence_state<T, M> y{};
    for (int k = 0; k < M; ++k) {
        detail::assert_density(densities[k]);
        y.relative[k] =
            k == own ? x.relative[k] : detail::saturate(x.relative[k] * (densities[k] / densities[own]));
    }
    return y;
}

// The weight of the term that depends on the draws so far, for the method that made them:
// b(N_i p_i) / sum b(N_k p_k) of the densities of these draws. Weights of all methods sum to 1 for each term.
template <class Heuristic, class T, int M>
MIS_HOST_DEVICE constexpr T term_weight(const Heuristic& heuristic, const sequence_state<T, M>& x, int own) {
    assert(own >= 0 && own < M);
    return mis::weight(heuristic, x.relative, own);
}

// ---- [C]'s one weight for all terms ----

// Of a sequence, for each method: sum over the terms of L_j^2 / p_k(first j draws), L_j the term's integrand.
// It is built from the last draw to the first.
template <class T, int M> struct single_weight_state { T sum[M]; };

// The end of a sequence: what the last term's source, L^e, adds.
template <class T, int M> MIS_HOST_DEVICE constexpr single_weight_state<T, M> end_sequence(T source) {
    detail::expect_real<T>();
    single_weight_state<T, M> x{};
    for (T& sum : x.sum)
        sum = source * source;
    return x;
}

// A draw is put in front: I <- (L^e)^2 + (w^2 / p_k) I, [C] 6. `source`: L^e where the new sequence starts;
// `factor`: w, by which it multiplies what comes after; densities: of the draw, by each method; all positive.
template <class T, int M>
MIS_HOST_DEVICE constexpr single_weight_state<T, M> put_in_front(const single_weight_state<T, M>& x, T source,
                                                                 T factor, const T (&densities)[M]) {
    single_weight_state<T, M> y{};
    for (int k = 0; k < M; ++k) {
        assert(densities[k] > T(0));
        y.sum[k] = source * source + factor * factor / densities[k] * x.sum[k];
    }
    return y;
}

// v_i / sum v_k with v_k = N_k / I_k, [C] 5. Biased, see above.
template <class T, int M>
MIS_HOST_DEVICE constexpr T single_weight(const single_weight_state<T, M>& x, const T (&counts)[M], int own) {
    assert(own >= 0 && own < M);
    T v[M]{};
    for (int k = 0; k < M; ++k)
        v[k] = detail::select(x.sum[k] > T(0), counts[k] / x.sum[k], T(0));
    return mis::weight(balance_heuristic{}, v, own);
}

} // namespace mis
