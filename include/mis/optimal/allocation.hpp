// SPDX-License-Identifier: MIT
// Floor 4: how many samples each technique is to take for optimal weights, and how much better any other
// counts could be at most. Needs Eigen, as solve.hpp does; runs on the host.
//
// With the coefficients alpha that are best for the counts N, [O], D = sum N_k p_k, the variance is
//   V(N) = min_alpha int (f - sum_k alpha_k p_k)^2 / D + sum_k alpha_k^2 (1 - int p_k) / N_k,
// the last sum for techniques that miss the domain. The function under the minimum is jointly convex in
// counts and coefficients, as He and Owen, "Optimal mixture weights in multiple importance sampling", 2014,
// have it for mixtures; so V is convex, there is one minimum, and
//   dV/dN_k = - int (f - sum_i alpha_i p_i)^2 p_k / D^2 - alpha_k^2 (1 - int p_k) / N_k^2
// because at the best alpha its changes do not count. At the minimum under sum c_k N_k = C all techniques
// that are used have the same -dV/dN_k / c_k, and no other has more; and anywhere else no counts have a
// variance below 2 V - C max_k (-dV/dN_k / c_k): a certificate, of the pilot's samples.
#pragma once

#include <mis/allocation.hpp>
#include <mis/optimal/solve.hpp>

namespace mis::optimal {

namespace detail {

// The inverse of a symmetric matrix that may be singular, but for the directions along which it is 0 to
// rounding: techniques that depend on others share, those without samples get 0. A template, as is all below,
// so that who includes this and does not call it need not compile Eigen's solver.
template <class Matrix> Matrix pseudo_inverse(Matrix a, double draws) {
    using vector = Eigen::Matrix<typename Matrix::Scalar, Eigen::Dynamic, 1>;
    const Eigen::Index m = a.rows();
    vector scale(m);
    for (Eigen::Index k = 0; k < m; ++k)
        scale[k] = a(k, k) > 0 ? 1 / std::sqrt(a(k, k)) : 0;
    a = scale.asDiagonal() * a * scale.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Matrix> eigen(a);
    vector inverse = eigen.eigenvalues();
    const double least = noise(static_cast<int>(m), draws);
    for (double& x : inverse)
        x = x > least ? 1 / x : 0;
    const Matrix vectors = scale.asDiagonal() * eigen.eigenvectors();
    return vectors * inverse.asDiagonal() * vectors.transpose();
}

// The variance with the best alpha of shares t_k of a budget of 1, as differentiate_balance has it. The
// derivatives are meant where no share is 0; a technique without a share has no alpha.
template <int M, class Pilot, class Shares, class Costs>
void differentiate_optimal(const mis::detail::pilots<Pilot>& all, const Shares& t, const Costs& costs,
                           count_derivatives<M>& result) {
    const int m = all.size();
    constexpr int channels = Pilot::channels;
    using Eigen::MatrixXd, Eigen::VectorXd;
    VectorXd g(m), u(m), gradient = VectorXd::Zero(m);
    MatrixXd hessian = MatrixXd::Zero(m, m), a(m, m), b(m, channels), alpha(m, channels);
    result.value = result.second_moment = 0;
    result.covered = true;
    const auto cover = [&](const auto* relative) {
        double d = 0;
        for (int k = 0; k < m; ++k) {
            u[k] = static_cast<double>(relative[k]);
            g[k] = u[k] / costs[k];
            d += t[k] * g[k];
            u[k] = t[k] > 0 ? u[k] : 0;
        }
        return d;
    };
    for (const Pilot& p : all) {
        if (p.size() != m)
            continue;
        const double per_pass = p.passes > 0 ? 1 / p.passes : 0;
        double draws = 0;
        a.setZero();
        b.setZero();
        p.for_each([&](const auto* relative, double rho, const auto* value) {
            const double d = cover(relative);
            ++draws;
            if (!(d > mis::detail::least_relative)) {
                for (int c = 0; c < channels; ++c)
                    result.covered = result.covered && !(value[c] < 0) && !(value[c] > 0);
                return;
            }
            a.template selfadjointView<Eigen::Lower>().rankUpdate(u, per_pass / (rho * d));
            for (int c = 0; c < channels; ++c)
                b.col(c) += u * (all.scaled(value[c], p) * per_pass / d);
        });
        a.template triangularView<Eigen::StrictlyUpper>() = a.transpose();
        const auto outside = [&](int k) { // (1 - int p_k) / N_k, for shares
            draws += p.outside[k];
            return t[k] > 0 ? p.outside[k] * per_pass * costs[k] / t[k] : 0;
        };
        for (int k = 0; k < m; ++k)
            a(k, k) += outside(k);
        const MatrixXd inverse = pseudo_inverse(a, draws);
        alpha = inverse * b;
        alpha += inverse * (b - a * alpha); // what rounding has left
        for (int c = 0; c < channels; ++c) {
            MatrixXd mixed = MatrixXd::Zero(m, m); // half the derivatives by share k and alpha i
            p.for_each([&](const auto* relative, double rho, const auto* value) {
                const double d = cover(relative);
                if (!(d > mis::detail::least_relative))
                    return;
                const double y = all.scaled(value[c], p), e = y - alpha.col(c).dot(u) / rho;
                const double square = e * e * rho * per_pass / d;
                result.second_moment += y * y * rho * per_pass / d;
                result.value += square;
                gradient -= g * (square / d);
                hessian.template selfadjointView<Eigen::Lower>().rankUpdate(g, 2 * square / (d * d));
                mixed += (e * per_pass / (d * d)) * g * u.transpose();
            });
            for (int k = 0; k < m; ++k) {
                const double x = alpha(k, c) * outside(k);
                if (t[k] > 0) {
                    result.value += alpha(k, c) * x;
                    gradient[k] -= alpha(k, c) * x / t[k];
                    hessian(k, k) += 2 * alpha(k, c) * x / (t[k] * t[k]);
                    mixed(k, k) -= x / t[k];
                }
            }
            hessian.template triangularView<Eigen::Lower>() -= 2 * mixed * inverse * mixed.transpose();
        }
    }
    for (int k = 0; k < m; ++k) {
        result.gradient[k] = gradient[k];
        for (int l = 0; l <= k; ++l)
            result.hessian[k * m + l] = result.hessian[l * m + k] = hessian(k, l);
    }
}

} // namespace detail

// V(N) of optimal weights with the alpha that are best for the pilot's samples, summed over channels and
// pilots, as mis::variance_of_counts has it for balance. Techniques of count 0 have no alpha, as in
// solve.hpp; derivatives are meant for positive counts. Samples with f = 0 and draws outside count.
template <class Pilot, class Counts>
count_derivatives<Pilot::techniques> variance_of_counts(const Pilot* pilots, std::size_t count,
                                                        const Counts& counts) {
    const mis::detail::pilots<Pilot> all(pilots, count);
    const int m = all.size();
    count_derivatives<Pilot::techniques> result(m);
    mis::detail::numbers<Pilot::techniques, double> n(m), costs(m);
    for (int k = 0; k < m; ++k) {
        mis::detail::assert_density(detail::at(counts, k));
        n[k] = static_cast<double>(detail::at(counts, k));
        costs[k] = 1;
    }
    detail::differentiate_optimal(all, n, costs, result);
    mis::detail::scale_derivatives(result, m, all.unit());
    return result;
}
template <class Pilot, class Counts>
count_derivatives<Pilot::techniques> variance_of_counts(const Pilot& pilot, const Counts& counts) {
    return optimal::variance_of_counts(&pilot, 1, counts);
}

// The counts that optimal weights have the least variance with, as mis::allocate has it for balance. One
// descent, from `start`, shares c_k N_k / C of any size, or equal shares; it ends at the same variance from
// wherever. result.gap is the certificate: no counts (that keep to the least share, if one is asked for) have
// a variance below variance - gap. That is of the pilot's samples: few of them are met exactly by some alpha,
// and say nothing then; let a pilot have several times as many samples as techniques, for each integral.
//
// A technique that helps neither by its samples nor as a control variate gets exactly 0. One that serves as a
// control variate alone, whose samples are not wanted, keeps 1e-10 of the budget, which no whole count will
// ever show: its density then still takes part in the sums of estimator.hpp.
template <class Pilot, class Costs>
allocation<Pilot::techniques> allocate(const Pilot* pilots, std::size_t count, const Costs& costs,
                                       double budget, const allocation_options& options = {},
                                       const double* start = nullptr) {
    constexpr int M = Pilot::techniques;
    constexpr double nothing = 1e-10; // D stays positive wherever there is density
    assert(count > 0 && budget > 0);
    const mis::detail::pilots<Pilot> all(pilots, count);
    const int m = all.size();
    mis::detail::numbers<M, double> c(m);
    allocation<M> result(m);
    const double scaled_budget = mis::detail::normalize_costs<M>(costs, budget, m, c);
    if (!(scaled_budget > 0))
        return result;
    const double asked = mis::detail::smaller(mis::detail::larger(options.least_share, 0.0), 1.0 / m);
    const double least = mis::detail::larger(asked, nothing);
    const auto differentiate = [&](const auto& t, auto& derivatives) {
        detail::differentiate_optimal(all, t, c, derivatives);
    };
    mis::detail::descent<M> d(m);
    mis::detail::start_from(start, m, least, d.shares);
    mis::detail::descend<M>(differentiate, least, options, d, m);
    result.iterations = d.iterations;
    const double bound = d.at.value - mis::detail::gap_of(d.at, d.shares, m, asked);
    const auto leave_out = [&](int first, int last) { // if nothing is lost without them
        auto without = d.shares;
        for (int k = first; k < last; ++k)
            if (without[k] <= 2 * nothing)
                without[k] = 0;
        count_derivatives<M> then(m);
        differentiate(without, then);
        const bool same = then.covered && then.value <= d.at.value * (1 + 1e-8) + 1e-14 * d.at.second_moment;
        if (same) {
            d.shares = without;
            d.at.value = then.value;
        }
        return same;
    };
    mis::detail::numbers<M, double> tried(m);
    if (asked < nothing && !leave_out(0, m))
        for (int round = 0; round < m; ++round) { // the dearest first
            int k = -1;
            for (int i = 0; i < m; ++i)
                if (!(tried[i] > 0) && (k < 0 || c[i] > c[k]))
                    k = i;
            tried[k] = 1;
            if (d.shares[k] > 0 && d.shares[k] <= 2 * nothing)
                leave_out(k, k + 1);
        }
    d.gap = mis::detail::larger(mis::detail::larger(d.at.value, 0.0) - bound, 0.0);
    mis::detail::fill_allocation(d, c, scaled_budget, all.unit(), m, result);
    return result;
}
template <class Pilot, class Costs>
allocation<Pilot::techniques> allocate(const Pilot& pilot, const Costs& costs, double budget,
                                       const allocation_options& options = {},
                                       const double* start = nullptr) {
    return optimal::allocate(&pilot, 1, costs, budget, options, start);
}

} // namespace mis::optimal
