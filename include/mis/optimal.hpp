// SPDX-License-Identifier: MIT
// Floor 4: optimal multiple importance sampling, [O]: what the sums of optimal_estimator.hpp are solved for.
//
// The only header that needs Eigen (3.4), which must be in the include path: mis::mis does not bring it.
// Runs on the host.
//
// In all of it `counts` are the numbers of samples n_i a pass, real numbers: anything with [i]. They must be
// those of the densities n_i p_i that were added.
//
// alpha is the solution of A alpha = b of minimum norm, all techniques' alpha_i measured in the units of F:
// where techniques are linearly dependent they share, and the estimate is the one without the superfluous
// ones. Techniques with count 0, and those that no sample could have been made by, get 0. There is no NaN,
// and no estimate depends on the units of f or of the densities.
//
// What counts as dependent: sums of N products carry noise of about epsilon sqrt(N) of their size. An
// eigenvalue lambda of the matrix, scaled to a diagonal of 1, below that is taken for 0. The price is small,
// because no alpha along a near-dependent direction v can move F far: A exact, |sum_k v_k| <= sqrt(lambda N)
// by Cauchy and Schwarz.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <mis/optimal_estimator.hpp>

namespace mis::optimal {

namespace detail {

template <int M, class W> using square = Eigen::Matrix<W, M, M, Eigen::RowMajor>;
template <int M, class W> using column = Eigen::Matrix<W, M, 1>;

template <int M, class W> struct rows { using type = std::array<W, static_cast<std::size_t>(M)>; };
template <class W> struct rows<dynamic, W> { using type = std::vector<W>; };

// The matrix of sum u_i u_k, its lower triangle: techniques i and i + d in diagonal d below the main one,
// those around the end in diagonal m - d.
template <int M, int Channels, class T, class W>
void copy_lower(const estimator<M, Channels, T>& e, square<M, W>& a) {
    const int m = e.size();
    const W* from = &e.products[0];
    const auto copy_diagonal = [&](int d, int count) {
        W* const to = a.data();
        for (int i = 0, at = d * m; i < count; ++i, at += m + 1)
            to[at] = from[i];
        from += count;
    };
    for (int d = 0; 2 * d < m; ++d) {
        copy_diagonal(d, m - d);
        if (d > 0)
            copy_diagonal(m - d, d);
    }
    if (m % 2 == 0)
        copy_diagonal(m / 2, m / 2);
}

// Whether a technique takes part: not if its count is 0, or all its weights were 0 or so small that their
// squares are not accurate.
template <class W, class N> bool takes_part(W diagonal, N count) {
    return count > N(0) && diagonal > std::numeric_limits<W>::min() / std::numeric_limits<W>::epsilon();
}

// L D L^T of the matrix: L below the diagonal, and the reciprocals of D, 0 for techniques that do not take
// part. It needs neither scaling nor pivots, since scaling leaves the fraction of a diagonal that is left
// when earlier techniques are eliminated what it is. False if that fraction is so small that the matrix may
// be singular.
template <int M, int Channels, class T, class Counts, class W>
bool factorize(const estimator<M, Channels, T>& e, const Counts& counts, square<M, W>& l,
               column<M, W>& inverse) {
    const int m = e.size();
    copy_lower(e, l);
    for (int i = 0; i < m; ++i) {
        W* const row = &l(i, 0);
        const W diagonal = row[i];
        inverse[i] = W(0);
        if (!takes_part(diagonal, counts[i]))
            continue;
        int j = 0;
        for (; j + 1 < i; j += 2) { // two at a time, which share their loads
            const W *const other = &l(j, 0), *const next = &l(j + 1, 0);
            W x = row[j], y = row[j + 1];
            for (int k = 0; k < j; ++k) {
                x -= row[k] * other[k];
                y -= row[k] * next[k];
            }
            row[j] = x;
            row[j + 1] = y - x * next[j];
        }
        if (j < i)
            for (int k = 0; k < j; ++k)
                row[j] -= row[k] * l(j, k);
        W left = diagonal;
        for (j = 0; j < i; ++j) {
            const W x = row[j] * inverse[j];
            left -= x * row[j];
            row[j] = x;
        }
        if (!(left > W(1e-8) * diagonal))
            return false;
        inverse[i] = W(1) / left;
    }
    return true;
}

// Solves in place with what factorize has made.
template <int M, class W>
void substitute(const square<M, W>& l, const column<M, W>& inverse, column<M, W>& x) {
    const int m = static_cast<int>(x.size());
    for (int i = 1; i < m; ++i) {
        const W* const row = &l(i, 0);
        W sum = x[i];
        for (int k = 0; k < i; ++k)
            sum -= row[k] * x[k];
        x[i] = sum;
    }
    for (int i = 0; i < m; ++i)
        x[i] *= inverse[i];
    for (int i = m - 1; i > 0; --i) {
        const W* const row = &l(i, 0);
        const W known = x[i];
        for (int k = 0; k < i; ++k)
            x[k] -= row[k] * known;
    }
}

template <int M, class W> struct general_solution {
    square<M, W> alpha; // alpha = this times the vector of sum (f / D) u_k
    int rank;
};

// The solution of minimum norm for a matrix that may be singular. With S such that S A' S has a diagonal of 1
// and N = diag(n), alpha = P N S (S A' S)^+ S b', where P projects onto what is orthogonal to those alpha
// that change no density: minimum norm in the scale of alpha, rank in the scale in which noise is alike.
template <int M, int Channels, class T, class Counts>
general_solution<M, typename estimator<M, Channels, T>::number>
solve_in_general(const estimator<M, Channels, T>& e, const Counts& counts) {
    using W = typename estimator<M, Channels, T>::number;
    const int m = e.size();
    square<M, W> a(m, m);
    copy_lower(e, a);
    column<M, W> scale(m), alpha_scale(m);
    for (int i = 0; i < m; ++i) {
        const bool used = takes_part(a(i, i), counts[i]);
        scale[i] = used ? W(1) / std::sqrt(a(i, i)) : W(0);
        alpha_scale[i] = used ? static_cast<W>(counts[i]) * scale[i] : W(1);
    }
    for (int i = 0; i < m; ++i)
        for (int k = 0; k <= i; ++k)
            a(i, k) *= scale[i] * scale[k];

    const Eigen::SelfAdjointEigenSolver<square<M, W>> eigen(a);
    const W noise = W(8) * std::numeric_limits<W>::epsilon() * (W(m) + std::sqrt(draws(e)));
    int nullity = 0; // eigenvalues ascend
    while (nullity < m && !(eigen.eigenvalues()[nullity] > noise))
        ++nullity;
    const int rank = m - nullity;
    const auto range = eigen.eigenvectors().rightCols(rank);
    square<M, W> alpha = alpha_scale.asDiagonal() * range *
                         eigen.eigenvalues().tail(rank).cwiseInverse().asDiagonal() * range.transpose() *
                         scale.asDiagonal();
    if (nullity > 0) {
        using basis = Eigen::Matrix<W, M, Eigen::Dynamic, Eigen::ColMajor, M, M>;
        const basis free = alpha_scale.asDiagonal() * eigen.eigenvectors().leftCols(nullity);
        const basis q = Eigen::ColPivHouseholderQR<basis>(free).householderQ() * basis::Identity(m, nullity);
        alpha -= (q * (q.transpose() * alpha)).eval();
    }
    return {alpha, rank};
}

// alpha_k of all channels, and the rank of the matrix.
template <int M, int Channels, class T, class Counts, class Alpha>
int solve(const estimator<M, Channels, T>& e, const Counts& counts, const Alpha& alpha) {
    using W = typename estimator<M, Channels, T>::number;
    const int m = e.size();
    square<M, W> l(m, m);
    column<M, W> inverse(m), x(m);
    if (factorize(e, counts, l, inverse)) {
        int rank = 0;
        for (int k = 0; k < m; ++k)
            rank += inverse[k] > W(0);
        for (int c = 0; c < Channels; ++c) {
            for (int k = 0; k < m; ++k)
                x[k] = e.values[c * m + k];
            substitute(l, inverse, x);
            for (int k = 0; k < m; ++k)
                alpha(c, k, static_cast<W>(counts[k]) * x[k]);
        }
        return rank;
    }
    const auto general = solve_in_general(e, counts);
    for (int c = 0; c < Channels; ++c) {
        for (int k = 0; k < m; ++k)
            x[k] = e.values[c * m + k];
        const column<M, W> solution = general.alpha * x;
        for (int k = 0; k < m; ++k)
            alpha(c, k, solution[k]);
    }
    return general.rank;
}

} // namespace detail

// The direct estimator sum_i alpha_i per channel, in the units of F. One solve for all channels: since A is
// symmetric, sum_i alpha_i = (A^+ 1) b. 0 without samples.
template <int M, int Channels, class T, class Counts>
std::array<T, static_cast<std::size_t>(Channels)> integral(const estimator<M, Channels, T>& e,
                                                           const Counts& counts) {
    using W = typename estimator<M, Channels, T>::number;
    const int m = e.size();
    detail::square<M, W> l(m, m);
    detail::column<M, W> inverse(m), y(m);
    if (detail::factorize(e, counts, l, inverse)) {
        for (int k = 0; k < m; ++k)
            y[k] = static_cast<W>(counts[k]);
        detail::substitute(l, inverse, y);
    } else {
        y = detail::solve_in_general(e, counts).alpha.colwise().sum().transpose();
    }
    std::array<T, static_cast<std::size_t>(Channels)> result;
    for (int c = 0; c < Channels; ++c) {
        W sum = W(0);
        for (int k = 0; k < m; ++k)
            sum += y[k] * e.values[c * m + k];
        result[static_cast<std::size_t>(c)] = static_cast<T>(sum);
    }
    return result;
}

// alpha[channel][k], a std::array of std::arrays, or of std::vectors for a dynamic number of techniques; in
// the units of F.
template <int M, int Channels, class T, class Counts>
std::array<typename detail::rows<M, T>::type, static_cast<std::size_t>(Channels)>
coefficients(const estimator<M, Channels, T>& e, const Counts& counts) {
    std::array<typename detail::rows<M, T>::type, static_cast<std::size_t>(Channels)> result;
    if constexpr (M == dynamic)
        for (auto& row : result)
            row.resize(static_cast<std::size_t>(e.size()));
    detail::solve(e, counts, [&](int c, int k, auto alpha) {
        result[static_cast<std::size_t>(c)][static_cast<std::size_t>(k)] = static_cast<T>(alpha);
    });
    return result;
}

// Estimated variance of `integral` per channel, in the units of F^2. With the optimal alpha the residuals
// (f - sum_k alpha_k p_k) / D have the mean 0 under every technique, so that the variance of a pass, [O], is
// the sum of their squares over one, int f^2 / D - alpha b. Over the R passes that were summed,
//   (sum (f / D)^2 - alpha b) N / (N - rank) / R^2,   N = n^T A n draws, R = N / sum n_i,
// where N - rank and not N residuals are free. Infinite as long as N does not exceed the rank, 0 without any
// draw, infinite if squares overflowed. It holds for many passes: with few, alpha is uncertain itself.
template <int M, int Channels, class T, class Counts>
std::array<T, static_cast<std::size_t>(Channels)> variance(const estimator<M, Channels, T>& e,
                                                           const Counts& counts) {
    using W = typename estimator<M, Channels, T>::number;
    const int m = e.size();
    W residual[Channels], per_pass = W(0);
    for (int c = 0; c < Channels; ++c)
        residual[c] = e.squares[c];
    for (int k = 0; k < m; ++k)
        per_pass += static_cast<W>(counts[k]);
    const int rank = detail::solve(e, counts, [&](int c, int k, W alpha) {
        const W n = static_cast<W>(counts[k]);
        if (n > W(0))
            residual[c] -= alpha / n * e.values[c * m + k];
    });
    const W count = draws(e), free = count - static_cast<W>(rank);
    std::array<T, static_cast<std::size_t>(Channels)> result;
    for (int c = 0; c < Channels; ++c) {
        W estimate = W(0);
        if (mis::detail::is_infinite(e.squares[c]) || (count > W(0) && !(free > W(0.5))))
            estimate = mis::detail::limits<W>::infinity;
        else if (count > W(0) && residual[c] > W(0))
            estimate = residual[c] * (per_pass / count) * (per_pass / free);
        result[static_cast<std::size_t>(c)] = static_cast<T>(estimate);
    }
    return result;
}

// Closes the batch to which `passes` passes were added, and solves for the next one's alpha if the number of
// all passes has grown by the factor `growth` since that was last done: 2 keeps the work small, 1 solves
// after every batch. `passes` is a number of its own, and not counted from the draws, so that a technique
// that makes a random number of samples, n_i on average, leaves the estimate unbiased.
template <int M, int Channels, class T, class Counts>
void end_batch(progressive<M, Channels, T>& p, const Counts& counts,
               typename progressive<M, Channels, T>::number passes,
               typename progressive<M, Channels, T>::number growth = 2) {
    using W = typename progressive<M, Channels, T>::number;
    const int m = p.size();
    for (int c = 0; c < Channels; ++c) {
        W controlled = W(0); // sum_k alpha_k
        for (int k = 0; k < m; ++k)
            controlled += p.control[c * m + k] * static_cast<W>(counts[k]);
        p.total[c] += p.residual[c] + passes * controlled;
        p.residual[c] = W(0);
    }
    p.open = false;
    p.passes += passes;
    if (p.passes < growth * p.passes_at_solve)
        return;
    p.passes_at_solve = p.passes;
    detail::solve(p.sums, counts, [&](int c, int k, W alpha) {
        const W n = static_cast<W>(counts[k]);
        p.control[c * m + k] = n > W(0) ? alpha / n : W(0);
    });
}

// The mean over all passes of closed batches, per channel; 0 before the first.
template <int M, int Channels, class T>
std::array<T, static_cast<std::size_t>(Channels)> integral(const progressive<M, Channels, T>& p) {
    std::array<T, static_cast<std::size_t>(Channels)> result{};
    if (p.passes > 0)
        for (int c = 0; c < Channels; ++c)
            result[static_cast<std::size_t>(c)] = static_cast<T>(p.total[c] / p.passes);
    return result;
}

} // namespace mis::optimal
