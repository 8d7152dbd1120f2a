// SPDX-License-Identifier: MIT
// Floor 4: how many samples each technique is to take, so that the variance at a given cost is least, for the
// balance heuristic; from pilot samples that are kept. For the host; no Eigen. optimal/allocation.hpp does
// the same for optimal weights.
//
// [C] Csonka, Szirmay-Kalos, Antal, "Cost-driven multiple importance sampling for Monte-Carlo rendering",
// 2001, section 3. With N_k samples of technique k, whose density is p_k, and D = sum N_k p_k, balance has
//   V(N) = int f^2 / D - sum_i N_i m_i^2,   m_i = int p_i f / D
// (the printed formula has a factor n in the first integral that does not belong there), and
//   dV/dN_k = - int f^2 p_k / D^2 - m_k^2 + 2 sum_i N_i m_i int p_i p_k f / D^2.
// The counts that are looked for spend a budget: sum c_k N_k = C, N_k >= 0, with c_k the cost of a sample.
// All integrals are sums over the pilot's samples, each divided by the pilot's density. m_i^2 is a sum over
// pairs of samples, of which none is paired with itself: the square of a sum of few samples would be too
// large, and with it V too small, most where a technique is bad.
//
// Counts are real numbers and expected ones: round_counts makes whole ones of them, at random, and weights
// use the expected counts whatever was drawn. Several channels, and several integrals, such as the pixels of
// a tile, are one objective: the sum of their variances, each times its pilot's `importance`.
//
// A technique that alone covers a pilot sample with f != 0 never gets the count 0, because V is infinite
// there. What no pilot sample has seen is not known: from few samples, leave every technique a least share.
// And V is that of real counts: random whole ones, round_counts, add up to about (m_i - m_k)^2 / 4, so let a
// budget be several samples of each.
#pragma once

#include <array>
#include <cmath>
#include <mis/optimal/estimator.hpp>

namespace mis {

using optimal::dynamic;

namespace detail {

using optimal::detail::numbers;

// Between these a relative density takes part; also what a pilot sample must be covered with. Cubes and their
// products are numbers then.
constexpr double least_relative = 1e-60, largest_relative = 1e60;

constexpr int product(int a, int b) { return a == dynamic || b == dynamic ? dynamic : a * b; }

} // namespace detail

// Pilot samples of one integral, of M techniques (or dynamic, given to the constructor), with Channels
// channels. Capacity: the most samples it can hold, without memory from the heap; dynamic: any number.
//
//     pilot<2> pixel;
//     for each pass: for each sample: pixel.add(f, densities, pilot_density);
//     pixel.passes += 1;
//
// A record has the sample's contribution to the pilot's own estimate, f / q, with q the pilot's density, and
// what of it is relative: the techniques' densities over their sum, and q over that sum. The samples of two
// pilots, of tiles or ranks, are one pilot's after `+=`.
template <int M, int Channels = 1, class T = double, int Capacity = dynamic> struct pilot {
    static_assert(M >= 1 || M == dynamic, "mis: a pilot of no techniques");
    static_assert(Channels >= 1, "mis: a pilot of no channels");
    static_assert(!std::is_integral_v<T>, "mis: densities are real numbers: write pilot<M, Channels, float>");
    static_assert(M != dynamic || Capacity == dynamic, "mis: dynamic techniques need a dynamic capacity");

    static constexpr int techniques = M, channels = Channels;

    double passes = 0;                  // how many the sums over samples are the sum of
    double importance = 1;              // what a variance of this integral counts, such as 1 / its square;
                                        // nothing if that is not finite
    bool is_quadrature = false;         // the records are points of a quadrature, not random
    double left_out = 0;                // samples that were no numbers, or that nothing could have made
    detail::numbers<M, double> outside; // sum of 1 / n_k over draws of k where f is 0 and only k has density
    int samples = 0;
    detail::numbers<detail::product(Capacity, M + 1 + Channels), T> records; // of size() + 1 + Channels

    pilot() = default;
    explicit pilot(int m) : outside(m) { assert(M == dynamic ? m >= 1 : M == m); }

    int size() const {
        if constexpr (M == dynamic)
            return outside.size();
        else
            return M;
    }
    // Whether there is room for another sample.
    bool is_full() const { return Capacity != dynamic && samples >= Capacity; }

    // A sample of the pilot.
    //   f              its value per channel, [c], or a number if there is one channel;
    //   densities      p_k of all techniques there, [k], without counts, in the units of pilot_density;
    //   pilot_density  q, of a pass: p of the one technique that makes the pilot's samples, or sum n_k p_k of
    //                  those that do, n_k times a pass.
    // Samples with f = 0 matter to optimal weights alone: for balance they may be passed by, if their passes
    // are counted. Infinite densities cannot be divided: add_relative is for them. What is no number, has a
    // pilot density of 0 or infinity, or is covered by no technique is left out, and counted as such; it is
    // then as a sample with f = 0. Also where the pilot's density and the sum of all are further than 1e60
    // apart. A full pilot leaves out what comes.
    template <class F, class Densities> void add(const F& f, const Densities& densities, T pilot_density) {
        const int m = size();
        double largest = 0, total = 0;
        bool good = true;
        for (int k = 0; k < m; ++k) {
            const double p = density(densities, k);
            good = good && detail::is_finite(p) && p >= 0;
            largest = detail::larger(largest, p);
        }
        const double q = static_cast<double>(pilot_density);
        good = good && largest > 0 && detail::is_finite(q) && q > 0;
        if (!good) {
            ++left_out;
            return;
        }
        for (int k = 0; k < m; ++k)
            total += density(densities, k) / largest;
        store([&](int c) { return optimal::detail::channel<double>(f, c) / q; },
              [&](int k) { return density(densities, k) / largest / total; }, q / largest / total);
    }

    // The same of a sample whose densities are infinite, or known relatively only: its contribution f / q to
    // the pilot's estimate; the techniques' densities and the pilot's, all times the same factor.
    template <class F, class Densities>
    void add_relative(const F& contribution, const Densities& densities, T pilot_density) {
        double total = 0;
        bool good = detail::is_finite(static_cast<double>(pilot_density)) && pilot_density > T(0);
        for (int k = 0; k < size(); ++k) {
            const double p = density(densities, k);
            good = good && detail::is_finite(p) && p >= 0;
            total += p;
        }
        if (!good || !(total > 0) || !detail::is_finite(total)) {
            ++left_out;
            return;
        }
        store([&](int c) { return optimal::detail::channel<double>(contribution, c); },
              [&](int k) { return density(densities, k) / total; },
              static_cast<double>(pilot_density) / total);
    }

    // Draws of technique k that left the domain, n_k times a pass: for optimal weights; balance needs only
    // their passes.
    void add_outside(int k, double n, double draws = 1) {
        assert(k >= 0 && k < size() && n > 0);
        outside[k] += draws / n;
    }

    // Another pilot's samples. One that has no number of techniques yet takes the other's; of one with
    // another number, a caller's bug, all is left out.
    pilot& operator+=(const pilot& other) {
        assert(size() == other.size() || size() == 0);
        if (M == dynamic && size() == 0) {
            outside = detail::numbers<M, double>(other.size());
            is_quadrature = other.is_quadrature;
        }
        if (size() != other.size()) { // see above
            left_out += other.samples + other.left_out;
            return *this;
        }
        const int stride = size() + 1 + Channels, added = other.samples; // `other` may be this one
        passes += other.passes;
        left_out += other.left_out;
        for (int k = 0; k < size(); ++k)
            outside[k] += other.outside[k];
        for (int s = 0; s < added; ++s) {
            if (is_full()) {
                ++left_out;
                continue;
            }
            T* const to = next_record();
            for (int i = 0; i < stride; ++i)
                to[i] = other.records[s * stride + i];
        }
        return *this;
    }

    // Calls visit(relative densities [k], pilot's relative density, contributions [c]) for every sample.
    // Whatever has this, size(), channels, techniques, passes, importance, is_quadrature and outside can
    // stand for a pilot, such as one that makes its samples anew each time.
    template <class Visit> void for_each(const Visit& visit) const {
        const int m = size(), stride = m + 1 + Channels;
        for (int s = 0; s < samples; ++s) {
            const T* const r = &records[s * stride];
            visit(r, static_cast<double>(r[m]), r + m + 1);
        }
    }

private:
    template <class Densities> static double density(const Densities& densities, int k) {
        return static_cast<double>(optimal::detail::at(densities, k));
    }
    T* next_record() {
        const int stride = size() + 1 + Channels, at = samples++ * stride;
        if constexpr (Capacity == dynamic)
            records.number.resize(static_cast<std::size_t>(at + stride));
        return &records[at];
    }
    template <class Value, class Relative>
    void store(const Value& contribution, const Relative& any_relative, double own) {
        const int m = size();
        // What is below takes no part, and would only slow down sums of its squares.
        const auto relative = [&](int k) {
            const double x = any_relative(k);
            return x > detail::least_relative ? x : 0;
        };
        int covering = 0, only = 0;
        const T stored = static_cast<T>(own);
        bool is_zero = true, good = own > detail::least_relative && own < detail::largest_relative &&
                                    stored > T(0) && detail::is_finite(stored);
        for (int k = 0; k < m; ++k)
            if (relative(k) > 0)
                ++covering, only = k;
        for (int c = 0; c < Channels; ++c) {
            const double y = static_cast<double>(static_cast<T>(contribution(c)));
            good = good && detail::is_finite(y);
            is_zero = is_zero && !(y < 0) && !(y > 0);
        }
        if (!good || (is_full() && !(is_zero && covering == 1))) {
            ++left_out;
            return;
        }
        if (is_zero && covering == 1) { // as a draw that left the domain
            outside[only] += 1 / own;
            return;
        }
        T* const r = next_record();
        for (int k = 0; k < m; ++k)
            r[k] = static_cast<T>(relative(k));
        r[m] = stored;
        for (int c = 0; c < Channels; ++c)
            r[m + 1 + c] = static_cast<T>(contribution(c));
    }
};

// The pilot's own estimate of the integral, per channel: 0 before the first pass. Unbiased, if the passes are
// not stopped because of what they found. So is share * integral(pilot) + (1 - share) * F, with F the
// estimate of the counts that the pilot has led to, if the share does not depend on the pilot's samples: that
// of the cost, say. Weights over the pilot's and the later samples together would be biased, because the
// counts in them depend on the pilot's samples.
template <int M, int Channels, class T, int Capacity>
std::array<T, static_cast<std::size_t>(Channels)> integral(const pilot<M, Channels, T, Capacity>& p) {
    std::array<double, static_cast<std::size_t>(Channels)> sums{};
    std::array<T, static_cast<std::size_t>(Channels)> result{};
    p.for_each([&](const T*, double, const T* y) {
        for (int c = 0; c < Channels; ++c)
            sums[static_cast<std::size_t>(c)] += static_cast<double>(y[c]);
    });
    for (std::size_t c = 0; c < sums.size(); ++c)
        result[c] = static_cast<T>(p.passes > 0 ? sums[c] / p.passes : 0);
    return result;
}

// A variance as a function of counts. hessian: [k m + l]. Not covered: there is a pilot sample with f != 0
// that techniques with a count cannot make, and the variance is infinite; the numbers are then not meant.
template <int M> struct count_derivatives {
    double value = 0;
    detail::numbers<M, double> gradient;
    detail::numbers<detail::product(M, M), double> hessian;
    double second_moment = 0; // the first integral of V: what rounding is measured by
    bool covered = true;

    explicit count_derivatives(int m) : gradient(m), hessian(m * m) {}
};

namespace detail {

// An array of pilots, all of the same number of techniques. Contributions are divided by `scale`, a power of
// 2, importances by the largest, so that squares are in range; variances then are in units of `unit`.
template <class Pilot> struct pilots {
    const Pilot* first;
    std::size_t count;
    double scale = 0, importance = 0;

    pilots(const Pilot* all, std::size_t n) : first(all), count(n) {
        for (const Pilot& p : *this) {
            importance = larger(importance, own_importance(p));
            p.for_each([&](const auto*, double, const auto* y) {
                for (int c = 0; c < Pilot::channels; ++c)
                    scale = larger(scale, absolute(static_cast<double>(y[c])));
            });
        }
        scale = std::exp2(std::floor(std::log2(larger(scale, limits<double>::least_normal))));
        importance = importance > 0 ? importance : 1;
    }
    const Pilot* begin() const { return first; }
    const Pilot* end() const { return first + count; }
    // Those that have no number of techniques yet, of dynamic ones, hold nothing and are passed by.
    int size() const {
        for (const Pilot& p : *this)
            if (p.size() > 0)
                return p.size();
        return 0;
    }
    static double own_importance(const Pilot& p) {
        return is_finite(p.importance) && p.importance > 0 ? p.importance : 0;
    }
    double unit() const { return scale * scale * importance; }
    // A contribution in units, times the root of the pilot's importance.
    template <class T> double scaled(T y, const Pilot& p) const {
        return static_cast<double>(y) / scale * std::sqrt(own_importance(p) / importance);
    }
};

// The variance of balance of shares t_k of a budget of 1, sum t_k = 1: counts are t_k / c_k. In units of
// pilots' scale. It is homogeneous of degree -1, so that sum t_k dV/dt_k = -V, and with c_k = 1 and any t it
// is the variance of the counts t. with_means: false for the first integral alone, which is convex.
template <int M, class Pilot, class Shares, class Costs>
void differentiate_balance(const pilots<Pilot>& all, const Shares& t, const Costs& costs, bool with_means,
                           count_derivatives<M>& result) {
    const int m = all.size();
    constexpr int channels = Pilot::channels;
    numbers<M, double> reciprocal(m), means(m), g(m);
    numbers<product(M, M), double> shared(m * m);
    for (int k = 0; k < m; ++k) {
        reciprocal[k] = 1 / costs[k];
        result.gradient[k] = 0;
    }
    for (int i = 0; i < m * m; ++i)
        result.hessian[i] = 0;
    result.value = result.second_moment = 0;
    result.covered = true;
    // g_k = p_k / c_k over the sum of all p, and its sum weighed by shares
    const auto cover = [&](const auto* u) {
        double d = 0;
        for (int k = 0; k < m; ++k) {
            g[k] = static_cast<double>(u[k]) * reciprocal[k];
            d += t[k] * g[k];
        }
        return d;
    };
    for (const Pilot& p : all) {
        if (p.size() != m)
            continue;
        const double per_pass = p.passes > 0 ? 1 / p.passes : 0;
        for (int c = 0; c < channels; ++c) {
            for (int k = 0; k < m; ++k)
                means[k] = 0;
            for (int i = 0; i < m * m; ++i)
                shared[i] = 0;
            if (with_means)
                p.for_each([&](const auto* u, double, const auto* value) {
                    const double d = cover(u), y = all.scaled(value[c], p) * per_pass;
                    for (int k = 0; d > least_relative && k < m; ++k)
                        means[k] += g[k] * (y / d);
                });
            p.for_each([&](const auto* u, double rho, const auto* value) {
                const double d = cover(u), y = all.scaled(value[c], p);
                if (!(d > least_relative)) {
                    result.covered = result.covered && !(y < 0) && !(y > 0);
                    return;
                }
                double expected = 0; // sum_i t_i c_i m_i g_i
                for (int k = 0; k < m; ++k)
                    expected += t[k] * costs[k] * means[k] * g[k];
                const double square = y * y * rho * per_pass / d, linear = y * per_pass / (d * d);
                const double first = (2 * expected * linear - square / d),
                             second = (2 * square - 4 * expected * y * per_pass / d) / (d * d);
                result.second_moment += square;
                for (int k = 0; k < m; ++k) {
                    result.gradient[k] += first * g[k];
                    for (int l = 0; l <= k; ++l) {
                        result.hessian[k * m + l] += second * g[k] * g[l];
                        shared[k * m + l] += linear * g[k] * g[l];
                    }
                }
                if (!with_means || p.is_quadrature)
                    return;
                // What m_i^2 has of this sample paired with itself is taken out again.
                const double itself = y * per_pass * y * per_pass;
                double all_of_it = 0;
                for (int k = 0; k < m; ++k) {
                    g[k] /= d;
                    all_of_it += t[k] * costs[k] * g[k] * g[k];
                }
                result.value += itself * all_of_it;
                for (int k = 0; k < m; ++k) {
                    const double own = costs[k] * g[k];
                    result.gradient[k] += itself * g[k] * (own - 2 * all_of_it);
                    for (int l = 0; l <= k; ++l)
                        result.hessian[k * m + l] +=
                            2 * itself * g[k] * g[l] * (3 * all_of_it - own - costs[l] * g[l]);
                }
            });
            if (!with_means)
                continue;
            for (int k = 0; k < m; ++k)
                for (int l = 0; l < k; ++l)
                    shared[l * m + k] = shared[k * m + l];
            for (int k = 0; k < m; ++k) {
                result.value -= t[k] * costs[k] * means[k] * means[k];
                result.gradient[k] -= costs[k] * means[k] * means[k];
                for (int l = 0; l <= k; ++l) {
                    double sum = (costs[k] * means[k] + costs[l] * means[l]) * shared[k * m + l];
                    for (int i = 0; i < m; ++i)
                        sum -= t[i] * costs[i] * shared[i * m + k] * shared[i * m + l];
                    result.hessian[k * m + l] += 2 * sum;
                }
            }
        }
    }
    result.value += result.second_moment;
    for (int k = 0; k < m; ++k)
        for (int l = 0; l < k; ++l)
            result.hessian[l * m + k] = result.hessian[k * m + l];
}

// Brings a variance in units of pilots' scale, of shares or counts, into its own.
template <int M> void scale_derivatives(count_derivatives<M>& d, int m, double square) {
    d.value *= square;
    d.second_moment *= square;
    for (int k = 0; k < m; ++k)
        d.gradient[k] *= square;
    for (int i = 0; i < m * m; ++i)
        d.hessian[i] *= square;
}

} // namespace detail

// V(N) of the balance heuristic, summed over channels and pilots, with its gradient and Hessian by the
// counts.
//   pilots, count  an array of pilots, of the pixels of a tile, say;
//   counts         N_k >= 0, [k].
// Each pilot's sums are over its passes; one without passes adds nothing. In units of f^2, times importance.
// Of a random pilot V is too large by up to sum N_i m_i^2 over the pilot's passes, and may come out negative
// where there are few.
template <class Pilot, class Counts>
count_derivatives<Pilot::techniques> variance_of_counts(const Pilot* pilots, std::size_t count,
                                                        const Counts& counts) {
    const detail::pilots<Pilot> all(pilots, count);
    const int m = all.size();
    count_derivatives<Pilot::techniques> result(m);
    detail::numbers<Pilot::techniques, double> n(m), costs(m);
    for (int k = 0; k < m; ++k) {
        detail::assert_density(optimal::detail::at(counts, k));
        n[k] = static_cast<double>(optimal::detail::at(counts, k));
        costs[k] = 1;
    }
    detail::differentiate_balance(all, n, costs, true, result);
    detail::scale_derivatives(result, m, all.unit());
    return result;
}
template <class Pilot, class Counts>
count_derivatives<Pilot::techniques> variance_of_counts(const Pilot& pilot, const Counts& counts) {
    return mis::variance_of_counts(&pilot, 1, counts);
}

enum class allocation_method { newton, projected_gradient };

struct allocation_options {
    // Ends where no shift of the budget can lower the variance, to first order, by more than this part of it.
    double tolerance = 1e-7;
    // What no technique's share of the budget c_k N_k / C is below, at most 1 / M. From few pilot samples,
    // leave some: a technique that gets nothing is not there for what the pilot has not seen.
    double least_share = 0;
    int most_iterations = 300; // steps that each descent tries
    allocation_method method = allocation_method::newton;
};

// Counts for a budget.
template <int M> struct allocation {
    detail::numbers<M, double> counts; // N_k, real numbers
    double variance = 0;               // V(N), of the pilot's samples
    // No shift of the budget lowers the variance, to first order, by more than this: C max_k(-dV/dN_k / c_k)
    // - V, where there is no least share. For optimal weights, whose variance is convex, no counts at all
    // have a variance below variance - gap, of these samples.
    double gap = 0;
    int iterations = 0;     // steps tried, of all descents
    bool converged = false; // within the tolerance, or to what rounding leaves

    explicit allocation(int m) : counts(m) {}
};

namespace detail {

// Least of gradient . x + x . H x / 2 over sum x_k = 1, x_k >= least, from x and into it, by active sets: no
// count that is at its least comes out beside it. H has damping times its diagonal added. False if H is not
// positive definite then.
template <int M> class simplex_quadratic {
public:
    explicit simplex_quadratic(int techniques)
        : m(techniques), h(m * m), lower(m * m), slope(m), direction(m), unit(m), free(m) {}

    // gradient: at x0, in whose differences the quadratic is meant.
    template <class Gradient, class Hessian, class Point>
    bool minimize(const Gradient& gradient, const Hessian& hessian, double damping, double least, Point& x) {
        double largest = 0;
        for (int k = 0; k < m; ++k)
            largest = larger(largest, absolute(hessian[k * m + k]));
        for (int k = 0; k < m; ++k) {
            for (int l = 0; l < m; ++l)
                h[k * m + l] = hessian[k * m + l];
            h[k * m + k] += damping * absolute(hessian[k * m + k]) + 1e-14 * largest;
            slope[k] = gradient[k];
            free[k] = x[k] > least;
        }
        for (int round = 0; round < 20 * m + 20; ++round) {
            if (!factorize())
                return false;
            const double multiplier = solve();
            double step = 1, moved = 0;
            int blocking = -1;
            for (int k = 0; k < m; ++k)
                if (free[k] > 0) {
                    moved = larger(moved, absolute(direction[k]));
                    if (direction[k] < 0 && x[k] - least < -direction[k] * step) {
                        step = (x[k] - least) / -direction[k];
                        blocking = k;
                    }
                }
            for (int k = 0; k < m; ++k)
                if (free[k] > 0)
                    x[k] += step * direction[k];
            for (int k = 0; k < m; ++k) {
                double change = 0;
                for (int l = 0; l < m; ++l)
                    change += free[l] > 0 ? h[k * m + l] * direction[l] : 0;
                slope[k] += step * change;
            }
            if (blocking >= 0) {
                x[blocking] = least;
                free[blocking] = 0;
                continue;
            }
            int best = -1; // what would gain most if it were let go
            double gain = 1e-13 * absolute(multiplier);
            for (int k = 0; k < m; ++k)
                if (!(free[k] > 0) && multiplier - slope[k] > gain) {
                    gain = multiplier - slope[k];
                    best = k;
                }
            if (best < 0)
                break;
            free[best] = 1;
        }
        return true;
    }

private:
    bool factorize() {
        for (int k = 0; k < m; ++k)
            for (int l = 0; l <= k; ++l) {
                if (!(free[k] > 0 && free[l] > 0))
                    continue;
                double sum = h[k * m + l];
                for (int i = 0; i < l; ++i)
                    if (free[i] > 0)
                        sum -= lower[k * m + i] * lower[l * m + i];
                if (l < k)
                    lower[k * m + l] = sum / lower[l * m + l];
                else if (sum > 0)
                    lower[k * m + k] = std::sqrt(sum);
                else
                    return false;
            }
        return true;
    }
    template <class Vector> void substitute(Vector& x) const {
        for (int k = 0; k < m; ++k) {
            if (!(free[k] > 0))
                continue;
            for (int i = 0; i < k; ++i)
                if (free[i] > 0)
                    x[k] -= lower[k * m + i] * x[i];
            x[k] /= lower[k * m + k];
        }
        for (int k = m - 1; k >= 0; --k) {
            if (!(free[k] > 0))
                continue;
            x[k] /= lower[k * m + k];
            for (int i = 0; i < k; ++i)
                if (free[i] > 0)
                    x[i] -= lower[k * m + i] * x[k];
        }
    }
    // The direction to the least of what is free; returns the slope that all of it then has.
    double solve() {
        double sum = 0, of_unit = 0;
        for (int k = 0; k < m; ++k) {
            direction[k] = free[k] > 0 ? -slope[k] : 0;
            unit[k] = free[k] > 0 ? 1 : 0;
        }
        substitute(direction);
        substitute(unit);
        for (int k = 0; k < m; ++k) {
            sum += direction[k];
            of_unit += unit[k];
        }
        const double multiplier = of_unit > 0 ? -sum / of_unit : 0;
        for (int k = 0; k < m; ++k)
            direction[k] += multiplier * unit[k];
        return multiplier;
    }

    int m;
    numbers<product(M, M), double> h, lower;
    numbers<M, double> slope, direction, unit, free;
};

// To the nearest x with sum x_k = 1 and x_k >= least: all are shifted alike, but for those that would fall
// below.
template <int M> void project(numbers<M, double>& x, int m, double least) {
    numbers<M, double> low(m);
    for (bool changed = true; changed;) {
        changed = false;
        double shift = -1;
        int shifted = 0;
        for (int k = 0; k < m; ++k) {
            shift += low[k] > 0 ? least : x[k];
            shifted += low[k] > 0 ? 0 : 1;
        }
        for (int k = 0; k < m; ++k) // one at least stays: the largest is not below the mean
            if (!(low[k] > 0) && shifted > 1 && x[k] - shift / shifted < least) {
                low[k] = 1;
                changed = true;
            }
        for (int k = 0; k < m && !changed; ++k)
            x[k] = low[k] > 0 ? least : larger(x[k] - shift / shifted, least);
    }
}

// A descent over shares of the budget.
template <int M> struct descent {
    numbers<M, double> shares;
    count_derivatives<M> at; // them
    double gap = 0;
    int iterations = 0;
    bool converged = false;

    explicit descent(int m) : shares(m), at(m) {}
};

// What a shift of the budget can lower the variance by, to first order: the best shares for the gradient have
// all that is left of the least ones in one place.
template <int M, class Shares>
double gap_of(const count_derivatives<M>& d, const Shares& shares, int m, double least) {
    double all = 0, best = 0, present = 0;
    for (int k = 0; k < m; ++k) {
        all -= least * d.gradient[k];
        best = k == 0 ? -d.gradient[k] : larger(best, -d.gradient[k]);
        present -= shares[k] * d.gradient[k];
    }
    return larger(0.0, all + (1 - m * least) * best - present);
}

// By Newton's steps, damped as Levenberg and Marquardt have it, or by gradient steps, each projected [C].
// differentiate(shares, derivatives). Every step lowers the variance; ends where the gap is within the
// tolerance, or what rounding leaves, or where no step is found that does.
template <int M, class Differentiate>
void descend(const Differentiate& differentiate, double least, const allocation_options& options,
             descent<M>& d, int m) {
    numbers<M, double> next(m);
    count_derivatives<M> there(m);
    simplex_quadratic<M> quadratic(m);
    constexpr double epsilon = std::numeric_limits<double>::epsilon(), least_damping = 1e-10;
    const bool by_newton = options.method == allocation_method::newton;
    double damping = least_damping, step = 0;
    differentiate(d.shares, d.at);
    for (;;) {
        d.gap = gap_of(d.at, d.shares, m, least);
        d.converged = is_finite(d.at.value) && d.gap <= options.tolerance * larger(0.0, d.at.value) +
                                                            64 * epsilon * d.at.second_moment;
        if (d.converged || d.iterations >= options.most_iterations || !d.at.covered)
            return;
        bool found = false;
        for (int attempt = 0; attempt < 24 && !found && d.iterations < options.most_iterations; ++attempt) {
            double predicted = 0; // to first order
            for (int k = 0; k < m; ++k)
                next[k] = d.shares[k];
            if (by_newton) {
                if (!quadratic.minimize(d.at.gradient, d.at.hessian, damping, least, next)) {
                    damping *= 8;
                    continue;
                }
            } else {
                if (!(step > 0))
                    step = 1 / larger(d.gap, limits<double>::least_normal);
                for (int k = 0; k < m; ++k)
                    next[k] -= step * d.at.gradient[k];
                project(next, m, least);
            }
            for (int k = 0; k < m; ++k)
                predicted += d.at.gradient[k] * (next[k] - d.shares[k]);
            ++d.iterations;
            differentiate(next, there);
            // where rounding hides what a step gains, the gap has to shrink
            const bool hidden = there.value < d.at.value + 64 * epsilon * d.at.second_moment;
            found = there.covered && predicted < 0 &&
                    (there.value < d.at.value + 1e-4 * predicted ||
                     (hidden && gap_of(there, next, m, least) < d.gap / 2));
            if (by_newton)
                damping = found ? larger(damping / 16, least_damping) : damping * 8;
            else
                step *= found ? 2 : 0.5;
        }
        if (!found)
            return;
        d.shares = next;
        d.at = there;
    }
}

// Costs with 1 for the largest. Returns the budget in their units; 0 if one of them is not what it must be.
template <int M, class Costs>
double normalize_costs(const Costs& costs, double budget, int m, numbers<M, double>& out) {
    double largest = 0;
    bool good = is_finite(budget) && budget > 0;
    for (int k = 0; k < m; ++k) {
        const double cost = static_cast<double>(optimal::detail::at(costs, k));
        good = good && is_finite(cost) && cost > 0;
        largest = larger(largest, cost);
    }
    assert(good);
    for (int k = 0; k < m; ++k)
        out[k] = good ? static_cast<double>(optimal::detail::at(costs, k)) / largest : 1;
    return good && m > 0 ? budget / largest : 0;
}

// Shares in proportion to `start`, or equal ones, moved a tenth of the way to equal shares, so that every
// sample is covered.
template <int M> void start_from(const double* start, int m, double least, numbers<M, double>& shares) {
    const auto wanted = [&](int k) { return start && is_finite(start[k]) ? larger(start[k], 0.0) : 0.0; };
    double largest = 0, sum = 0;
    for (int k = 0; k < m; ++k)
        largest = larger(largest, wanted(k));
    for (int k = 0; k < m; ++k)
        sum += largest > 0 ? wanted(k) / largest : 0;
    for (int k = 0; k < m; ++k) {
        const double share = sum > 0 ? 0.9 * (wanted(k) / largest / sum) + 0.1 / m : 1.0 / m;
        shares[k] = least + (1 - m * least) * share;
    }
}

template <int M>
void fill_allocation(const descent<M>& d, const numbers<M, double>& costs, double budget, double square,
                     int m, allocation<M>& result) {
    for (int k = 0; k < m; ++k)
        result.counts[k] = budget * d.shares[k] / costs[k];
    result.variance = larger(0.0, d.at.value) / budget * square;
    result.gap = d.gap / budget * square;
    result.converged = d.converged;
}

} // namespace detail

// The counts that the balance heuristic's variance is least with, summed over channels and pilots, and that
// cost `budget`: one set of counts for all of the pilots.
//   costs    of a sample of each technique, [k], > 0, within 1e60 of one another;
//   budget   C > 0, in the same units;
//   start    shares of the budget, [k], of any sum, to start from, such as those of a neighbour; or null.
// V is not convex: there may be several minima. So without a start there are up to 2 M + 2 descents: from
// equal shares, from the counts that are best for the first integral of V, which is convex, and from near
// each technique alone and near all but each; the best is taken. Where the pilot is so small that V comes out
// negative, the counts are those of the first integral, and not `converged`. Without samples: equal shares,
// or the start's. A technique that adds nothing gets exactly 0 where the least share is 0. Costs or a budget
// that are not positive and finite are a caller's bug, asserted in debug builds: then all counts are 0.
template <class Pilot, class Costs>
allocation<Pilot::techniques> allocate(const Pilot* pilots, std::size_t count, const Costs& costs,
                                       double budget, const allocation_options& options = {},
                                       const double* start = nullptr) {
    constexpr int M = Pilot::techniques;
    assert(count > 0 && budget > 0);
    const detail::pilots<Pilot> all(pilots, count);
    const int m = all.size();
    detail::numbers<M, double> c(m);
    allocation<M> result(m);
    const double scaled_budget = detail::normalize_costs<M>(costs, budget, m, c);
    if (!(scaled_budget > 0))
        return result;
    const double least = detail::smaller(detail::larger(options.least_share, 0.0), 1.0 / m);
    const auto with_means = [&](const auto& t, auto& derivatives) {
        detail::differentiate_balance(all, t, c, true, derivatives);
    };
    const auto of_squares = [&](const auto& t, auto& derivatives) {
        detail::differentiate_balance(all, t, c, false, derivatives);
    };
    detail::descent<M> best(m);
    const auto descend_from = [&](detail::descent<M>& d) {
        detail::descend<M>(with_means, least, options, d, m);
        result.iterations += d.iterations;
    };
    detail::start_from(start, m, least, best.shares);
    descend_from(best);
    const auto keep_better = [&](detail::descent<M>& d) {
        d.iterations = 0;
        descend_from(d);
        if (d.at.covered && d.at.value < best.at.value - 1e-12 * d.at.second_moment)
            best = d;
    };
    const auto best_for_squares = [&] {
        detail::descent<M> d(m);
        detail::start_from(start, m, least, d.shares);
        detail::descend<M>(of_squares, least, options, d, m);
        result.iterations += d.iterations;
        return d;
    };
    if (!start) {
        auto d = best_for_squares();
        keep_better(d);
    }
    const int corners = start || m == 1 ? 0 : m == 2 ? 2 : 2 * m;
    for (int corner = 0; corner < corners; ++corner) {
        detail::descent<M> d(m);
        detail::numbers<M, double> wanted(m);
        for (int k = 0; k < m; ++k) // one technique, then all but one
            wanted[k] = (corner < m) == (corner % m == k) ? 1 : 0;
        detail::start_from(&wanted[0], m, least, d.shares);
        keep_better(d);
    }
    if (best.at.value < -1e-12 * best.at.second_moment) {
        best = best_for_squares();
        best.converged = false;
    }
    detail::fill_allocation(best, c, scaled_budget, all.unit(), m, result);
    return result;
}
template <class Pilot, class Costs>
allocation<Pilot::techniques> allocate(const Pilot& pilot, const Costs& costs, double budget,
                                       const allocation_options& options = {},
                                       const double* start = nullptr) {
    return mis::allocate(&pilot, 1, costs, budget, options, start);
}

// Whole counts at random, whose expectation is `counts`, and with that the expected cost, too; each is its
// count rounded down or up, and so is their sum. `u` is uniform in [0, 1), one number for all `count`
// techniques, and independent of the samples. Weights use the expected counts, also the contributions f /
// (N_k p_k): the mean over whole counts then is what counts are. Systematic sampling: technique k gets the
// whole numbers between the sums of counts before it and after it, shifted by u. Counts are below 2^52 in
// sum, and each fits the numbers of `out`.
template <class Counts, class T, class Out>
MIS_HOST_DEVICE void round_counts(const Counts& counts, int count, T u, Out&& out) {
    assert(u >= T(0) && u < T(1));
    using std::floor;
    double sum = static_cast<double>(u), below = 0;
    for (int k = 0; k < count; ++k) {
        detail::assert_density(optimal::detail::at(counts, k));
        sum += static_cast<double>(optimal::detail::at(counts, k));
        const double whole = floor(sum);
        optimal::detail::at(out, k) =
            static_cast<std::decay_t<decltype(optimal::detail::at(out, k))>>(whole - below);
        below = whole;
    }
}

} // namespace mis
