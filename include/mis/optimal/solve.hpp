// SPDX-License-Identifier: MIT
// Floor 4: optimal multiple importance sampling, [O]: what the sums of estimator.hpp are solved for.
//
// Needs Eigen (3.4), which must be in the include path: mis::mis does not bring it. Runs on the host.
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

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <mis/optimal/estimator.hpp>

namespace mis::optimal {

namespace detail {

// N numbers to work with, not initialized.
template <int N, class W> struct scratch {
    W number[N];

    explicit scratch(int) {}
    W* data() { return &number[0]; }
};
template <class W> struct scratch<dynamic, W> {
    std::vector<W> number;

    explicit scratch(int n) : number(static_cast<std::size_t>(n)) {}
    W* data() { return number.data(); }
};

template <int M, class W> struct rows { using type = std::array<W, static_cast<std::size_t>(M)>; };
template <class W> struct rows<dynamic, W> { using type = std::vector<W>; };

// The matrix of sum u_i u_k, its lower triangle, by rows: techniques i and i + d are d below the diagonal,
// those around the end m - d.
template <int M, int Channels, class T, class W> void copy_lower(const estimator<M, Channels, T>& e, W* a) {
    const int m = e.size();
    const W* from = &e.products[0];
    const auto copy_diagonal = [&](int d, int count) {
        for (int i = 0, at = d * m; i < count; ++i, at += m + 1)
            a[at] = from[i];
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

// Whether a technique takes part: not if its count is 0, or if all its weights were 0 or so small that their
// squares are not accurate.
template <class W, class N> bool takes_part(W diagonal, N count) {
    return count > N(0) && diagonal > std::numeric_limits<W>::min() / std::numeric_limits<W>::epsilon();
}

// The matrix as L D L^T.
template <int M, class W> struct factors {
    scratch<M == dynamic ? dynamic : M * M, W> lower; // L below the diagonal, by rows
    scratch<M, W> inverse;                            // 1 / D, 0 for techniques that do not take part
    int m;

    explicit factors(int techniques) : lower(techniques * techniques), inverse(techniques), m(techniques) {}
};

// False if the matrix may be singular: if, of any technique's diagonal, almost nothing is left when those
// before it are eliminated. What fraction is left does not depend on scale, so nothing needs to be scaled.
template <int M, int Channels, class T, class Counts, class W>
bool factorize(const estimator<M, Channels, T>& e, const Counts& counts, factors<M, W>& a) {
    const int m = e.size();
    W *const lower = a.lower.data(), *const inverse = a.inverse.data();
    copy_lower(e, lower);
    for (int i = 0; i < m; ++i) {
        W* const row = lower + i * m;
        const W diagonal = row[i];
        inverse[i] = W(0);
        if (!takes_part(diagonal, at(counts, i)))
            continue;
        int j = 0;
        for (; j + 1 < i; j += 2) { // two at a time, which share their loads
            const W *const other = lower + j * m, *const next = other + m;
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
                row[j] -= row[k] * lower[j * m + k];
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

// Solves in place.
template <int M, class W> void substitute(factors<M, W>& a, W* x) {
    const int m = a.m;
    const W *const lower = a.lower.data(), *const inverse = a.inverse.data();
    for (int i = 1; i < m; ++i) {
        W sum = x[i];
        for (int k = 0; k < i; ++k)
            sum -= lower[i * m + k] * x[k];
        x[i] = sum;
    }
    for (int i = 0; i < m; ++i)
        x[i] *= inverse[i];
    for (int i = m - 1; i > 0; --i) {
        const W known = x[i];
        for (int k = 0; k < i; ++k)
            x[k] -= lower[i * m + k] * known;
    }
}

// Matrices for singular systems: of one type for all small M, so that Eigen is compiled once for them and
// nothing is allocated.
template <int M> constexpr int most = M == dynamic ? Eigen::Dynamic : M <= 16 ? 16 : M;
template <int Most, class W>
using general_matrix = Eigen::Matrix<W, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, Most, Most>;
template <int Most, class W>
using general_vector = Eigen::Matrix<W, Eigen::Dynamic, 1, Eigen::ColMajor, Most, 1>;

template <int Most, class W> struct general_solution {
    general_matrix<Most, W> alpha; // by the vector of sum (f / D) u_k it gives alpha
    int rank;
};

// Makes the first `count` columns orthonormal, by Gram and Schmidt, each done twice: enough for any columns
// that are independent beyond rounding.
template <int Most, class W> void orthonormalize(general_matrix<Most, W>& a, int count) {
    const int m = static_cast<int>(a.rows());
    const auto divide = [&](int j, W length) {
        for (int i = 0; i < m && length > W(0); ++i)
            a(i, j) /= length;
    };
    for (int j = 0; j < count; ++j) {
        W largest = W(0); // brings the squares below into range
        for (int i = 0; i < m; ++i)
            largest = mis::detail::larger(largest, mis::detail::absolute(a(i, j)));
        divide(j, largest);
        for (int repeat = 0; repeat < 2; ++repeat) {
            for (int k = 0; k < j; ++k) {
                W shared = W(0);
                for (int i = 0; i < m; ++i)
                    shared += a(i, k) * a(i, j);
                for (int i = 0; i < m; ++i)
                    a(i, j) -= shared * a(i, k);
            }
            W square = W(0);
            for (int i = 0; i < m; ++i)
                square += a(i, j) * a(i, j);
            divide(j, std::sqrt(square));
        }
    }
}

// The solution of minimum norm of a matrix A' (lower triangle) that may be singular. With S such that S A' S
// has the diagonal 1, and N = diag(n), it is P N S (S A' S)^+ S b', where P projects onto what is orthogonal
// to all alpha that change no density: the norm is that of alpha, but the rank is judged where noise is
// alike.
template <int Most, class W>
general_solution<Most, W> solve_in_general(general_matrix<Most, W> a, const general_vector<Most, W>& counts,
                                           W draws) {
    const int m = static_cast<int>(a.rows());
    general_vector<Most, W> scale(m), alpha_scale(m);
    for (int i = 0; i < m; ++i) {
        const bool used = takes_part(a(i, i), counts[i]);
        scale[i] = used ? W(1) / std::sqrt(a(i, i)) : W(0);
        alpha_scale[i] = used ? counts[i] * scale[i] : W(1);
    }
    for (int i = 0; i < m; ++i)
        for (int k = 0; k <= i; ++k)
            a(i, k) *= scale[i] * scale[k];

    const Eigen::SelfAdjointEigenSolver<general_matrix<Most, W>> eigen(a);
    const auto& values = eigen.eigenvalues(); // ascending
    general_matrix<Most, W> vectors = eigen.eigenvectors();
    const W noise = W(8) * std::numeric_limits<W>::epsilon() * (W(m) + std::sqrt(draws));
    int nullity = 0;
    while (nullity < m && !(values[nullity] > noise))
        ++nullity;

    general_solution<Most, W> result{general_matrix<Most, W>(m, m), m - nullity};
    general_matrix<Most, W>& alpha = result.alpha;
    for (int i = 0; i < m; ++i)
        for (int k = 0; k < m; ++k) {
            vectors(i, k) *= alpha_scale[i];
            alpha(i, k) = W(0);
        }
    for (int i = 0; i < m; ++i)
        for (int k = 0; k < m; ++k)
            for (int j = nullity; j < m; ++j)
                alpha(i, k) += vectors(i, j) / values[j] * eigen.eigenvectors()(k, j) * scale[k];
    orthonormalize<Most, W>(vectors, nullity);
    for (int j = 0; j < nullity; ++j)
        for (int k = 0; k < m; ++k) {
            W shared = W(0);
            for (int i = 0; i < m; ++i)
                shared += vectors(i, j) * alpha(i, k);
            for (int i = 0; i < m; ++i)
                alpha(i, k) -= shared * vectors(i, j);
        }
    return result;
}

template <int M, int Channels, class T, class Counts>
general_solution<most<M>, typename estimator<M, Channels, T>::number>
solve_in_general(const estimator<M, Channels, T>& e, const Counts& counts) {
    using W = typename estimator<M, Channels, T>::number;
    const int m = e.size();
    general_matrix<most<M>, W> a(m, m);
    general_vector<most<M>, W> n(m);
    copy_lower(e, a.data());
    for (int k = 0; k < m; ++k)
        n[k] = static_cast<W>(at(counts, k));
    return solve_in_general<most<M>, W>(a, n, draws(e));
}

// Calls set(channel, k, alpha_k) for all of them. Returns the rank of the matrix.
template <int M, int Channels, class T, class Counts, class Set>
int solve(const estimator<M, Channels, T>& e, const Counts& counts, const Set& set) {
    using W = typename estimator<M, Channels, T>::number;
    const int m = e.size();
    factors<M, W> a(m);
    if (factorize(e, counts, a)) {
        scratch<M, W> solution(m);
        W* const x = solution.data();
        int rank = 0;
        for (int k = 0; k < m; ++k)
            rank += a.inverse.data()[k] > W(0);
        for (int c = 0; c < Channels; ++c) {
            for (int k = 0; k < m; ++k)
                x[k] = e.values[c * m + k];
            substitute(a, x);
            for (int k = 0; k < m; ++k)
                set(c, k, static_cast<W>(at(counts, k)) * x[k]);
        }
        return rank;
    }
    const auto general = solve_in_general(e, counts);
    for (int c = 0; c < Channels; ++c)
        for (int i = 0; i < m; ++i) {
            W alpha = W(0);
            for (int k = 0; k < m; ++k)
                alpha += general.alpha(i, k) * e.values[c * m + k];
            set(c, i, alpha);
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
    detail::scratch<M, W> solution(m);
    W* const y = solution.data();
    detail::factors<M, W> a(m);
    if (detail::factorize(e, counts, a)) {
        for (int k = 0; k < m; ++k)
            y[k] = static_cast<W>(detail::at(counts, k));
        detail::substitute(a, y);
    } else {
        const auto general = detail::solve_in_general(e, counts);
        for (int k = 0; k < m; ++k) {
            y[k] = W(0);
            for (int i = 0; i < m; ++i)
                y[k] += general.alpha(i, k);
        }
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
        per_pass += static_cast<W>(detail::at(counts, k));
    const int rank = detail::solve(e, counts, [&](int c, int k, W alpha) {
        const W n = static_cast<W>(detail::at(counts, k));
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

// When a progressive estimator solves for alpha: once it has seen `least_draws` draws, and then whenever its
// passes have grown by the factor `growth`: 2 keeps the work small, 1 solves after every batch. Until then it
// is the balance heuristic. An alpha from hardly more draws than techniques can be so far off that its batch
// spoils the mean for good; least_draws < 0 means 16 for each technique.
struct schedule {
    double growth = 2, least_draws = -1;
};

// Closes the batch to which `passes` passes were added, and solves for the next one's alpha if that is due.
// `passes` is a number of its own, and not counted from the draws, so that a technique that makes a random
// number of samples, n_i on average, leaves the estimate unbiased.
template <int M, int Channels, class T, class Counts>
void end_batch(progressive<M, Channels, T>& p, const Counts& counts,
               typename progressive<M, Channels, T>::number passes, const schedule& when = {}) {
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
    W draws_of_pass = W(0);
    for (int k = 0; k < m; ++k)
        draws_of_pass += static_cast<W>(counts[k]);
    const W least_draws = when.least_draws < 0 ? W(16) * W(m) : static_cast<W>(when.least_draws);
    if (p.passes * draws_of_pass < least_draws || p.passes < static_cast<W>(when.growth) * p.passes_at_solve)
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
