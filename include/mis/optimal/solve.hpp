// SPDX-License-Identifier: MIT
// Floor 4: optimal multiple importance sampling, [O]: what the sums of estimator.hpp are solved for.
//
// Needs Eigen (3.4), which must be in the include path: mis::mis does not bring it. Runs on the host.
//
// In all of it `counts` are the numbers of samples n_i a pass, real numbers: anything with [i]. They must be
// those of the densities n_i p_i that were added. Negative and NaN ones are asserted in debug builds, and 0
// in others; with an infinite one no estimate is a number.
//
// alpha is the solution of A alpha = b of minimum norm, all techniques' alpha_i measured in the units of F:
// where techniques are linearly dependent they share, and the estimate is the one without the superfluous
// ones. Techniques with count 0, and those that no sample could have been made by, get 0. No estimate depends
// on the units of f or of the densities.
//
// What counts as dependent: an eigenvalue of the matrix, scaled to a diagonal of 1, that is not above
// detail::noise, (8 m + N / 2) epsilon for N draws: as much as all roundings can add up to. Rounding cannot
// tell it from 0, and it is taken for 0, unless F hardly changes along its eigenvector but does change, as
// with a density that is nearly a mixture of others (detail::general_factors). What taking it for 0 costs: if
// f has the part c v . p along the direction v, |v| = 1, of such an eigenvalue lambda, that part is estimated
// by balance, with a relative standard error of c sqrt(lambda / N) < 1e-8 c, which `variance` contains.
//
// Input that is no number: where an f / D is NaN or infinite, or the sum of f / D is not in the range of the
// type, the integral of that channel is NaN or infinite, and its variance infinite. Weights that are no
// numbers leave the variance of all channels infinite.
#pragma once

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <mis/optimal/estimator.hpp>

namespace mis::optimal {

namespace detail {

// Whether x is neither NaN nor infinite. By its bits, because with -ffast-math comparisons do not tell.
template <class W> bool is_number(W x) {
    if constexpr (sizeof(W) == sizeof(std::uint64_t)) {
        std::uint64_t bits;
        std::memcpy(&bits, &x, sizeof x);
        return (bits >> 52 & 0x7ff) != 0x7ff;
    } else {
        return std::isfinite(x);
    }
}

// N numbers to work with, not initialized; many of them on the heap.
constexpr int most_on_stack = 4096;
template <int N, class W, bool on_stack = N != dynamic&& N <= most_on_stack> struct scratch {
    W number[N];

    explicit scratch(int) {}
    scratch(int, W all) {
        for (W& x : number)
            x = all;
    }
    W* data() { return &number[0]; }
};
template <int N, class W> struct scratch<N, W, false> {
    std::vector<W> number;

    explicit scratch(int n, W all = W(0)) : number(static_cast<std::size_t>(n), all) {}
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
    mis::detail::assert_density(count);
    return count > N(0) && diagonal > (std::numeric_limits<W>::min)() / std::numeric_limits<W>::epsilon();
}

// The matrix as L D L^T.
template <int M, class W> struct factors {
    scratch<M == dynamic ? dynamic : M * M, W> lower; // L below the diagonal, by rows
    scratch<M, W> inverse;                            // 1 / D, 0 for techniques that do not take part
    scratch<M, W> reach;                              // see factorize
    int m;

    explicit factors(int techniques)
        : lower(techniques * techniques), inverse(techniques), reach(techniques), m(techniques) {}
};

// The matrix scaled to a diagonal of 1 is solved by its factors if it has no eigenvalue below this over m.
constexpr double regular = 1e-8;

// How large an eigenvalue of it rounding can make of 0, for N draws. A sum of N numbers >= 0 may be wrong by
// N epsilon / 2 of its size; by about sqrt(N) epsilon / 4 where each addition is rounded differently. The
// eigenvalues themselves are computed to some m epsilon. Never above what `regular` leaves to the factors.
template <class W> W noise(int m, W draws) {
    return mis::detail::smaller(std::numeric_limits<W>::epsilon() * (W(8 * m) + draws / W(2)),
                                W(regular) / W(m));
}

// False if the matrix may have an eigenvalue below regular / m. With the pivot d_i, row i of L^-1, v, and
// s = sqrt(diagonal), d_i / (sum |v_k| s_k)^2 is a Rayleigh quotient, or less, of the scaled matrix; and the
// trace of its inverse, which no 1 / eigenvalue exceeds, is sum_i sum_k (v_k s_k)^2 / d_i, exactly. `reach`
// is at least sum_k |v_k| s_k, since |L^-1| <= (2 I - |L|)^-1. (The pivots alone would not do: a technique
// that is a mixture with the share 1e-4 of another leaves pivots of 1e-8, and an eigenvalue of 1e-16.)
template <int M, int Channels, class T, class Counts, class W>
bool factorize(const estimator<M, Channels, T>& e, const Counts& counts, factors<M, W>& a) {
    const int m = e.size();
    W *const lower = a.lower.data(), *const inverse = a.inverse.data(), *const reach = a.reach.data();
    copy_lower(e, lower);
    for (int i = 0; i < m; ++i) {
        W* const row = lower + i * m;
        const W diagonal = row[i];
        inverse[i] = reach[i] = W(0);
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
        W left = diagonal, reached = std::sqrt(diagonal);
        for (j = 0; j < i; ++j) {
            const W x = row[j] * inverse[j];
            left -= x * row[j];
            reached += std::abs(x) * reach[j];
            row[j] = x;
        }
        if (!(left > W(regular) * reached * reached))
            return false;
        inverse[i] = W(1) / left;
        reach[i] = reached;
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

// Matrices for singular systems: of one type for all M up to 64, so that Eigen is compiled once for them and
// nothing is allocated; on the heap for large M.
template <int M> constexpr int most = M == dynamic || M > 64 ? Eigen::Dynamic : 64;
template <int Most, class W>
using general_matrix = Eigen::Matrix<W, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, Most, Most>;
template <int Most, class W>
using general_vector = Eigen::Matrix<W, Eigen::Dynamic, 1, Eigen::ColMajor, Most, 1>;

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

// A matrix A' (its lower triangle) that may be singular, and its solution of minimum norm. With S such that
// S A' S has the diagonal 1 and the eigenvectors V, and N = diag(n), it is alpha = P N S V (V^T S b' /
// values), over the values above noise, where P projects onto what is orthogonal to all alpha that change no
// density: the norm is that of alpha, but the rank is judged where noise is alike. From the right to the
// left: small values are then divided into what they belong to. In the matrix V (1 / values) V^T they would
// stand beside each other, and be lost in rounding.
//
// Of the values that are not above noise, some belong to techniques that are nearly dependent, and not
// exactly so. Along the vector v of exact dependency F does not change: S n . v, which is F's part, is 0 to
// rounding. Where samples are too few for so many techniques, it may be anything. Where a density is nearly a
// mixture of others, it is at most sqrt(N value) sum n_k / N, because sum_x v . S u is at most sqrt(N value),
// by Cauchy and Schwarz. Such a direction is `close`: most often sums are more accurate than noise, and
// whatever is found along it, if it is not larger than the rest, moves F by less than 1e-8 of it.
template <int Most, class W> struct general_factors {
    general_matrix<Most, W> vectors, null; // of S A' S; the first of N S V, orthonormal: what P takes out
    general_vector<Most, W> values, scale, alpha_scale, close; // close: 1 or 0, of the first `nullity`
    int m, nullity = 0;                                        // how many are not above noise

    general_factors(general_matrix<Most, W>& a, const general_vector<Most, W>& counts, W draws)
        : null(a.rows(), a.rows()), scale(a.rows()), alpha_scale(a.rows()), close(a.rows()),
          m(static_cast<int>(a.rows())) {
        W of_pass = W(0), largest = W(0); // sum n_k, max n_k S_k
        for (int i = 0; i < m; ++i) {
            const bool used = takes_part(a(i, i), counts[i]);
            scale[i] = used ? W(1) / std::sqrt(a(i, i)) : W(0);
            alpha_scale[i] = used ? counts[i] * scale[i] : W(1);
            if (used) {
                of_pass += counts[i];
                largest = mis::detail::larger(largest, alpha_scale[i]);
            }
        }
        for (int i = 0; i < m; ++i)
            for (int k = 0; k <= i; ++k)
                a(i, k) *= scale[i] * scale[k];
        const Eigen::SelfAdjointEigenSolver<general_matrix<Most, W>> eigen(a);
        values = eigen.eigenvalues(); // ascending
        vectors = eigen.eigenvectors();
        const W least = noise(m, draws), epsilon = std::numeric_limits<W>::epsilon();
        for (; nullity < m && !(values[nullity] > least); ++nullity) {
            W part = W(0); // S n . v
            for (int i = 0; i < m; ++i)
                part += scale[i] > W(0) ? alpha_scale[i] * vectors(i, nullity) : W(0);
            part = mis::detail::absolute(part);
            const bool is_close = values[nullity] > epsilon && part > least * largest &&
                                  part <= of_pass * std::sqrt(least / draws);
            close[nullity] = is_close ? W(1) : W(0);
            for (int i = 0; i < m; ++i)
                null(i, nullity) = is_close ? W(0) : vectors(i, nullity) * alpha_scale[i];
        }
        orthonormalize<Most, W>(null, nullity);
    }

    // From sum (f / D) u_k, [k], alpha, in place.
    void solve(W* x) const {
        general_vector<Most, W> alpha(m);
        for (int i = 0; i < m; ++i)
            alpha[i] = W(0);
        W found = W(0); // the square of what has been
        for (int j = m - 1; j >= 0; --j) {
            if (j < nullity && !(close[j] > W(0)))
                continue;
            W shared = W(0);
            for (int k = 0; k < m; ++k)
                shared += vectors(k, j) * (scale[k] * x[k]);
            shared /= values[j];
            if (j < nullity && !(shared * shared <= W(m * m) * found))
                continue;
            found += shared * shared;
            for (int i = 0; i < m; ++i)
                alpha[i] += vectors(i, j) * shared;
        }
        for (int i = 0; i < m; ++i)
            x[i] = alpha[i] * alpha_scale[i];
        for (int j = 0; j < nullity; ++j) {
            W shared = W(0);
            for (int i = 0; i < m; ++i)
                shared += null(i, j) * x[i];
            for (int i = 0; i < m; ++i)
                x[i] -= shared * null(i, j);
        }
    }
};

template <int M, int Channels, class T, class Counts>
general_factors<most<M>, typename estimator<M, Channels, T>::number>
factorize_in_general(const estimator<M, Channels, T>& e, const Counts& counts) {
    using W = typename estimator<M, Channels, T>::number;
    const int m = e.size();
    general_matrix<most<M>, W> a(m, m);
    general_vector<most<M>, W> n(m);
    copy_lower(e, a.data());
    for (int k = 0; k < m; ++k)
        n[k] = static_cast<W>(at(counts, k));
    return {a, n, draws(e)};
}

// Solves for several right-hand sides, right(c, k) for c < sides, in the units of sum (f / D) u_k, and calls
// set(c, k, alpha_k) for all of them. Returns the rank of the matrix.
template <int M, int Channels, class T, class Counts, class Right, class Set>
int solve(const estimator<M, Channels, T>& e, const Counts& counts, int sides, const Right& right,
          const Set& set) {
    using W = typename estimator<M, Channels, T>::number;
    const int m = e.size();
    scratch<M, W> solution(m);
    W* const x = solution.data();
    const auto solve_all = [&](const auto& in_place) {
        for (int c = 0; c < sides; ++c) {
            for (int k = 0; k < m; ++k)
                x[k] = right(c, k);
            in_place();
            for (int k = 0; k < m; ++k)
                set(c, k, x[k]);
        }
    };
    factors<M, W> a(m);
    if (factorize(e, counts, a)) {
        int rank = 0;
        for (int k = 0; k < m; ++k)
            rank += a.inverse.data()[k] > W(0);
        solve_all([&] {
            substitute(a, x);
            for (int k = 0; k < m; ++k)
                x[k] *= static_cast<W>(at(counts, k));
        });
        return rank;
    }
    const auto general = factorize_in_general(e, counts);
    solve_all([&] { general.solve(x); });
    return m - general.nullity;
}

// The same for all channels' sums.
template <int M, int Channels, class T, class Counts, class Set>
int solve(const estimator<M, Channels, T>& e, const Counts& counts, const Set& set) {
    return solve(
        e, counts, Channels, [&](int c, int k) { return e.values[c * e.size() + k]; }, set);
}

} // namespace detail

// The direct estimator sum_i alpha_i per channel, in the units of F. Where the matrix is regular, one solve
// for all channels: since A is symmetric, sum_i alpha_i = (A^-1 1) b. 0 without samples.
template <int M, int Channels, class T, class Counts>
std::array<T, static_cast<std::size_t>(Channels)> integral(const estimator<M, Channels, T>& e,
                                                           const Counts& counts) {
    using W = typename estimator<M, Channels, T>::number;
    const int m = e.size();
    detail::scratch<M, W> solution(m);
    W* const y = solution.data();
    detail::factors<M, W> a(m);
    const bool is_regular = detail::factorize(e, counts, a);
    if (is_regular) {
        for (int k = 0; k < m; ++k)
            y[k] = static_cast<W>(detail::at(counts, k));
        detail::substitute(a, y);
    }
    std::array<T, static_cast<std::size_t>(Channels)> result;
    if (!is_regular) {
        const auto general = detail::factorize_in_general(e, counts);
        // of 16 numbers at least, and 0: GCC at -O3 does not see that m is M, and warns of those beyond
        detail::scratch<(M == dynamic || M > 16 ? M : 16), W> alpha(m, W(0));
        W* const x = alpha.data();
        for (int c = 0; c < Channels; ++c) {
            W sum = W(0);
            for (int k = 0; k < m; ++k)
                x[k] = e.values[c * m + k];
            general.solve(x);
            for (int k = 0; k < m; ++k)
                sum += x[k];
            result[static_cast<std::size_t>(c)] = static_cast<T>(sum);
        }
        return result;
    }
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
// the sum of their squares over one. Over the R passes that were summed, N = n^T A n draws, R = N / sum n_i:
//   Q / R^2 (N / (N - rank))^2 L^2,   Q = sum (f / D)^2 - alpha b,   L = R^2 n^T A'^-1 n / N >= 1.
// The two factors are for alpha that was fitted to the same samples. N / (N - rank) once because only N -
// rank residuals are free, and once more because the estimate follows those that it has swallowed (the
// jackknife's (1 - h)^2, with the mean leverage h = rank / N). F is the sum of f / D weighted by R n^T A'^-1
// u, whose mean square is L: the further the samples' mean of u is from the known n_i / sum n_k, the larger;
// once because residuals are so weighted, and once more because they are largest where weights are.
//
// The estimate's mean over the variance that it estimates was 0.98 to 1.3 from 4 passes on in well-posed
// cases, and is above 1 more often than below; it can be much less than the variance while some alpha is
// determined by few samples: docs/optimal.md has a table. Q is never taken to be less than what rounding
// hides, noise sum (f / D)^2. 0 without any sample; infinite as long as N does not exceed the rank, if
// squares overflow, and if an f / D or a weight was no number.
template <int M, int Channels, class T, class Counts>
std::array<T, static_cast<std::size_t>(Channels)> variance(const estimator<M, Channels, T>& e,
                                                           const Counts& counts) {
    using W = typename estimator<M, Channels, T>::number;
    const int m = e.size();
    const auto n = [&](int k) { return static_cast<W>(detail::at(counts, k)); };
    W residual[Channels], per_pass = W(0), spread = W(0);
    for (int c = 0; c < Channels; ++c)
        residual[c] = e.squares[c];
    for (int k = 0; k < m; ++k)
        per_pass += n(k);
    const int rank = detail::solve(
        e, counts, Channels + 1, // the last one for n^T A'^-1 n
        [&](int c, int k) { return c < Channels ? e.values[c * m + k] : n(k); },
        [&](int c, int k, W alpha) {
            if (c == Channels)
                spread += alpha;
            else if (n(k) > W(0))
                residual[c] -= alpha / n(k) * e.values[c * m + k];
        });
    const W count = draws(e), free = count - static_cast<W>(rank), passes = count / per_pass;
    const W weights_square = mis::detail::larger(spread * passes * passes / count, W(1));
    const bool enough = free > W(0.5) && passes > W(0) && detail::is_number(passes);
    std::array<T, static_cast<std::size_t>(Channels)> result;
    for (int c = 0; c < Channels; ++c) {
        const bool no_sample = !(count > W(0)) && !(e.squares[c] > W(0)) && detail::is_number(count);
        W estimate = mis::detail::limits<W>::infinity;
        if (no_sample && detail::is_number(e.squares[c])) {
            estimate = W(0);
        } else if (enough && detail::is_number(e.squares[c]) && detail::is_number(residual[c])) {
            const W deviation = weights_square * (count / free) / passes;
            const W squares = mis::detail::larger(residual[c], detail::noise(m, count) * e.squares[c]);
            estimate = squares > W(0) ? squares * deviation * deviation : W(0); // never 0 times infinity
        }
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
    mis::detail::assert_density(passes);
    const int m = p.size();
    const auto n = [&](int k) { return static_cast<W>(detail::at(counts, k)); };
    for (int c = 0; c < Channels; ++c) {
        W controlled = W(0); // sum_k alpha_k
        for (int k = 0; k < m; ++k)
            controlled += p.control[c * m + k] * n(k);
        p.total[c] += p.residual[c] + passes * controlled;
        p.total_squares[c] += p.residual_squares[c];
        p.residual[c] = p.residual_squares[c] = W(0);
    }
    p.open = false;
    p.passes += passes;
    W draws_of_pass = W(0);
    for (int k = 0; k < m; ++k)
        draws_of_pass += n(k);
    const W least_draws = when.least_draws < 0 ? W(16) * W(m) : static_cast<W>(when.least_draws);
    if (p.passes * draws_of_pass < least_draws || p.passes < static_cast<W>(when.growth) * p.passes_at_solve)
        return;
    p.passes_at_solve = p.passes;
    detail::solve(p.sums, counts,
                  [&](int c, int k, W alpha) { p.control[c * m + k] = n(k) > W(0) ? alpha / n(k) : W(0); });
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

// Estimated variance of that mean, per channel, in the units of F^2: the squares of all (f - sum_k alpha_k
// p_k) / D over the square of the passes, each with the alpha of its batch. An upper bound in the mean, from
// the first pass on, whatever alpha: what is missing is each technique's mean, sum_i n_i (E_i r)^2 of a pass,
// and with the optimal alpha that is 0. (It holds for random numbers of samples, too, if they are Poisson's.)
// Infinite before the first batch is closed, and if anything that was added was no number.
template <int M, int Channels, class T>
std::array<T, static_cast<std::size_t>(Channels)> variance(const progressive<M, Channels, T>& p) {
    using W = typename progressive<M, Channels, T>::number;
    std::array<T, static_cast<std::size_t>(Channels)> result{};
    for (int c = 0; c < Channels; ++c) {
        const W squares = p.total_squares[c];
        const bool known = p.passes > W(0) && detail::is_number(p.passes) && detail::is_number(squares);
        result[static_cast<std::size_t>(c)] =
            static_cast<T>(known ? squares / p.passes / p.passes : mis::detail::limits<W>::infinity);
    }
    return result;
}

} // namespace mis::optimal
