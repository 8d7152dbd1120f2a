// SPDX-License-Identifier: MIT
#include "ulp.hpp"

#include <cstdio>
#include <cstring>
#include <doctest/doctest.h>
#include <memory>
#include <mis/optimal/solve.hpp>
#include <numeric>
#include <type_traits>

using namespace test;
using mis::optimal::dynamic;
using mis::optimal::estimator;
using mis::optimal::progressive;

// ---- What the types promise ----

template <int M, std::size_t bytes, class T = double> constexpr bool fits() {
    return std::is_trivially_copyable_v<estimator<M, 3, T>> && sizeof(estimator<M, 3, T>) <= bytes &&
           std::is_trivially_copyable_v<progressive<M, 3, T>>;
}
static_assert(fits<2, 96>() && fits<4, 224>() && fits<8, 560>() && fits<16, 1620>());
static_assert(fits<2, 96, float>() && fits<4, 224, float>() && fits<8, 560, float>());

namespace {

// ---- The oracle: [O] as it is printed, from stored samples, in long double ----

using real = long double;
using vector = std::vector<real>;
using matrix = std::vector<vector>;

// Samples of m techniques, and what the library is given of them.
struct samples {
    int m = 0, channels = 3;
    std::vector<double> counts;
    std::vector<std::vector<double>> f, q; // contributions, and n_k p_k
    std::vector<double> outside;           // draws that left the domain
};

real density(const samples& s, std::size_t x, std::size_t k) {
    return s.counts[k] > 0 ? static_cast<real>(s.q[x][k]) / static_cast<real>(s.counts[k]) : 0;
}
real mixture(const samples& s, std::size_t x) {
    real d = 0;
    for (double q : s.q[x])
        d += static_cast<real>(q);
    return d;
}

matrix matrix_a(const samples& s) {
    const std::size_t m = s.counts.size();
    matrix a(m, vector(m, 0));
    for (std::size_t x = 0; x < s.q.size(); ++x)
        for (std::size_t i = 0; i < m; ++i)
            for (std::size_t k = 0; k < m; ++k)
                a[i][k] += density(s, x, i) / mixture(s, x) * (density(s, x, k) / mixture(s, x));
    for (std::size_t i = 0; i < m; ++i)
        if (s.outside[i] > 0)
            a[i][i] += static_cast<real>(s.outside[i]) / static_cast<real>(s.counts[i]) /
                       static_cast<real>(s.counts[i]);
    return a;
}

vector vector_b(const samples& s, std::size_t channel) {
    vector b(s.counts.size(), 0);
    for (std::size_t x = 0; x < s.q.size(); ++x)
        for (std::size_t i = 0; i < b.size(); ++i)
            b[i] += static_cast<real>(s.f[x][channel]) / mixture(s, x) * (density(s, x, i) / mixture(s, x));
    return b;
}

// The solution of minimum norm of a symmetric system, by Jacobi's rotations. Eigenvalues below `cutoff` of
// the largest are 0.
vector minimum_norm(matrix a, const vector& b, real cutoff = 1e-14L) {
    const std::size_t m = b.size();
    matrix v(m, vector(m, 0));
    for (std::size_t i = 0; i < m; ++i)
        v[i][i] = 1;
    for (int sweep = 0; sweep < 40; ++sweep)
        for (std::size_t p = 0; p < m; ++p)
            for (std::size_t q = p + 1; q < m; ++q) {
                if (std::fabs(a[p][q]) == 0)
                    continue;
                const real theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                const real t = (theta < 0 ? -1 : 1) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
                const real c = 1 / std::sqrt(t * t + 1), s = t * c;
                for (std::size_t k = 0; k < m; ++k) {
                    const real x = a[k][p], y = a[k][q];
                    a[k][p] = c * x - s * y, a[k][q] = s * x + c * y;
                }
                for (std::size_t k = 0; k < m; ++k) {
                    const real x = a[p][k], y = a[q][k];
                    a[p][k] = c * x - s * y, a[q][k] = s * x + c * y;
                    const real w = v[k][p], z = v[k][q];
                    v[k][p] = c * w - s * z, v[k][q] = s * w + c * z;
                }
            }
    real largest = 0;
    for (std::size_t i = 0; i < m; ++i)
        largest = std::max(largest, a[i][i]);
    vector x(m, 0);
    for (std::size_t i = 0; i < m; ++i) {
        if (!(a[i][i] > cutoff * largest))
            continue;
        real share = 0;
        for (std::size_t k = 0; k < m; ++k)
            share += v[k][i] * b[k];
        for (std::size_t k = 0; k < m; ++k)
            x[k] += share / a[i][i] * v[k][i];
    }
    return x;
}

vector alpha_of(const samples& s, int channel) {
    return minimum_norm(matrix_a(s), vector_b(s, static_cast<std::size_t>(channel)));
}

real sum_of(const vector& v) { return std::accumulate(v.begin(), v.end(), real(0)); }
real norm_of(const vector& v) {
    return std::accumulate(v.begin(), v.end(), real(0), [](real a, real b) { return a + std::fabs(b); });
}

// sum (f - sum_k alpha_k p_k) / D over the samples, divided by sum |f| / D.
real second_term(const samples& s, const vector& alpha, std::size_t channel) {
    real sum = 0, size = 0;
    for (std::size_t x = 0; x < s.q.size(); ++x) {
        real rest = static_cast<real>(s.f[x][channel]);
        size += std::fabs(rest) / mixture(s, x);
        for (std::size_t k = 0; k < alpha.size(); ++k)
            rest -= alpha[k] * density(s, x, k);
        sum += rest / mixture(s, x);
    }
    for (std::size_t k = 0; k < alpha.size(); ++k)
        if (s.outside[k] > 0)
            sum -= static_cast<real>(s.outside[k]) * alpha[k] / static_cast<real>(s.counts[k]);
    return std::fabs(sum) / size;
}

// sum ((f - sum_k alpha_k p_k) / D)^2 over all draws.
real squared_residuals(const samples& s, const vector& alpha, std::size_t channel) {
    real sum = 0;
    for (std::size_t x = 0; x < s.q.size(); ++x) {
        real rest = static_cast<real>(s.f[x][channel]);
        for (std::size_t k = 0; k < alpha.size(); ++k)
            rest -= alpha[k] * density(s, x, k);
        sum += rest / mixture(s, x) * (rest / mixture(s, x));
    }
    for (std::size_t k = 0; k < alpha.size(); ++k) {
        const real rest = s.outside[k] > 0 ? alpha[k] / static_cast<real>(s.counts[k]) : 0;
        sum += static_cast<real>(s.outside[k]) * rest * rest;
    }
    return sum;
}

// ---- The library on the same samples ----

template <int M, int C, class T = double> estimator<M, C, T> summed(const samples& s) {
    estimator<M, C, T> e(s.m);
    for (std::size_t x = 0; x < s.q.size(); ++x) {
        if (x % 2 == 0) {
            e.add(s.f[x], s.q[x]);
        } else { // every other sample has been weighed already
            std::vector<double> u(s.q[x].size()), v;
            mis::weights(mis::balance, s.q[x], u);
            for (double f : s.f[x])
                v.push_back(static_cast<double>(static_cast<real>(f) / mixture(s, x)));
            e.add_weighted(v, u);
        }
    }
    for (int i = 0; i < s.m; ++i)
        e.add_outside(i, static_cast<T>(s.outside[static_cast<std::size_t>(i)]));
    return e;
}

template <int M, int C, class T> vector alpha_of(const estimator<M, C, T>& e, const samples& s, int channel) {
    const auto alpha = coefficients(e, s.counts)[static_cast<std::size_t>(channel)];
    return {alpha.begin(), alpha.end()};
}

// ---- Random samples ----

// Techniques of which each is good at its own part of the samples, so that the matrix is regular.
samples random_samples(generator& g, int m, int count, int channels = 3) {
    samples s;
    s.m = m;
    s.channels = channels;
    for (int i = 0; i < m; ++i) {
        s.counts.push_back(g.chance(0.5) ? g.integer(1, 4) : g.log_uniform<double>(-1, 3));
        s.outside.push_back(g.chance(0.3) ? g.integer(1, 5) : 0);
    }
    for (int x = 0; x < count; ++x) {
        std::vector<double> f, q;
        for (int c = 0; c < channels; ++c)
            f.push_back(g.chance(0.2) ? 0 : g.uniform(-0.5, 2));
        for (int i = 0; i < m; ++i) {
            const double p = g.chance(0.2) ? 0 : g.log_uniform<double>(-2, 0);
            q.push_back(s.counts[static_cast<std::size_t>(i)] * (i == x % m ? 3 : p));
        }
        s.f.push_back(f);
        s.q.push_back(q);
    }
    return s;
}

// Errors of the estimate and of alpha relative to sum |alpha|, and the second term.
struct errors {
    worst_case integral, alpha, zero;
};

template <int M, int C, class T = double> void compare(const samples& s, errors& worst, long long at) {
    const auto e = summed<M, C, T>(s);
    const auto estimate = integral(e, s.counts);
    for (int c = 0; c < C; ++c) {
        const vector exact = alpha_of(s, c), computed = alpha_of(e, s, c);
        const real size = norm_of(exact);
        const real f = static_cast<real>(estimate[static_cast<std::size_t>(c)]);
        if (!(size > 0)) {
            worst.integral.see(std::fabs(static_cast<double>(f)), at);
            continue;
        }
        worst.integral.see(static_cast<double>(std::fabs(f - sum_of(exact)) / size), at);
        worst.integral.see(static_cast<double>(std::fabs(f - sum_of(computed)) / size), at);
        for (std::size_t k = 0; k < exact.size(); ++k)
            worst.alpha.see(static_cast<double>(std::fabs(exact[k] - computed[k]) / size), at);
        worst.zero.see(static_cast<double>(second_term(s, computed, static_cast<std::size_t>(c))), at);
    }
}

void print(const char* what, const errors& worst) {
    std::printf("%s: integral %.2g, alpha %.2g, second term %.2g\n", what, worst.integral.error,
                worst.alpha.error, worst.zero.error);
}

template <int M> void compare_random(errors& worst, int trials, std::uint64_t seed) {
    generator g(seed);
    for (int trial = 0; trial < trials; ++trial) {
        const int m = M == dynamic ? g.integer(1, 16) : M;
        compare<M, 3>(random_samples(g, m, g.integer(2 * m, 8 * m)), worst, trial);
        compare<M, 1>(random_samples(g, m, g.integer(2 * m, 8 * m), 1), worst, trial);
    }
}

template <class F> void for_fixed_and_dynamic(const F& f) {
    f(std::integral_constant<int, 2>{}), f(std::integral_constant<int, 5>{});
    f(std::integral_constant<int, 8>{}), f(std::integral_constant<int, dynamic>{});
#ifndef __FAST_MATH__ // each takes seconds to compile
    f(std::integral_constant<int, 1>{}), f(std::integral_constant<int, 3>{});
    f(std::integral_constant<int, 4>{}), f(std::integral_constant<int, 13>{});
    f(std::integral_constant<int, 16>{});
#endif
}

} // namespace

TEST_CASE("the formulas of [O], written out: integral, alpha, and a second term of 0") {
    errors worst;
    for_fixed_and_dynamic([&](auto m) { compare_random<m.value>(worst, m.value == dynamic ? 300 : 40, 1); });
    print("[O] written out", worst);
    CHECK(worst.integral.error <= 1e-12);
    CHECK(worst.alpha.error <= 1e-12);
    CHECK(worst.zero.error <= 1e-12);
}

namespace {

// Techniques 0 .. m - 1 on [0, 1] around as many nodes, each with a tail, so that every one reaches every
// point: well spread. Not normalized: the tests of formulas need no densities that are.
double hump(int m, int k, double x) {
    const double d = x * m - k - 0.5;
    return m * (std::exp(-d * d) + 0.01);
}

// Sampled at the nodes (and between, for count > m). f = sum of (k + 1) p_k and, per channel, of others.
samples in_the_span(int m, int count) {
    samples s;
    s.m = m;
    for (int k = 0; k < m; ++k) {
        s.counts.push_back(1 + k % 3);
        s.outside.push_back(0);
    }
    for (int x = 0; x < count; ++x) {
        std::vector<double> q, f(3);
        for (int k = 0; k < m; ++k) {
            const double p = hump(m, k, (x + 0.5) / count);
            q.push_back(s.counts[static_cast<std::size_t>(k)] * p);
            f[0] += (k + 1) * p;
            f[1] += (k % 2 == 0 ? 1 : -0.25) * p;
            f[2] += 7 * p;
        }
        s.q.push_back(q);
        s.f.push_back(f);
    }
    return s;
}

std::array<double, 3> integral_in_the_span(int m) {
    std::array<double, 3> f{};
    for (int k = 0; k < m; ++k) {
        f[0] += k + 1;
        f[1] += k % 2 == 0 ? 1 : -0.25;
        f[2] += 7;
    }
    return f;
}

// Random samples in which technique `copied` is split into two, n_i = share n_i + (1 - share) n_i.
samples with_copy(samples s, std::size_t copied, double share) {
    for (auto& q : s.q) {
        q.push_back(q[copied] * (1 - share));
        q[copied] *= share;
    }
    s.counts.push_back(s.counts[copied] * (1 - share));
    s.counts[copied] *= share;
    s.outside.push_back(0);
    ++s.m;
    return s;
}

template <class E> bool same_bytes(const E& a, const E& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

} // namespace

TEST_CASE("f in the span of the densities is integrated to 1e-12 from as many samples as techniques") {
    double worst = 0;
    const auto see = [&](auto size, int m) {
        const samples s = in_the_span(m, m);
        const auto f = integral(summed<size.value, 3>(s), s.counts);
        for (std::size_t c = 0; c < 3; ++c)
            worst = std::max(worst, std::fabs(f[c] / integral_in_the_span(m)[c] - 1));
    };
    for_fixed_and_dynamic([&](auto size) {
        if constexpr (size.value == dynamic)
            for (int m = 1; m <= 16; ++m)
                see(size, m);
        else
            see(size, size.value);
    });
    std::printf("f in the span: %.2g\n", worst);
    CHECK(worst <= 1e-12);
}

TEST_CASE("near-dependent techniques are not taken for dependent ones") {
    // The last is the first but for 1e-5 of it: eigenvalues are 1e-10 of the largest, far above rounding. Its
    // part of f would be lost with it.
    double worst = 0, lost = 0;
    for (int m = 2; m <= 8; ++m) {
        samples s = in_the_span(m, 5 * m);
        for (std::size_t x = 0; x < s.q.size(); ++x) {
            const double wave = std::cos(static_cast<double>(x)), p = s.q[x][0] / s.counts[0];
            s.q[x].push_back(p * (1 + 1e-5 * wave));
            s.f[x][0] += 1e5 * (s.q[x].back() - p); // wave p, whose coefficients sum to 0
        }
        s.counts.push_back(1), s.outside.push_back(0), ++s.m;
        const double truth = integral_in_the_span(m)[0];
        worst = std::max(worst, std::fabs(integral(summed<dynamic, 3>(s), s.counts)[0] / truth - 1));
        lost = std::max(
            lost,
            std::fabs(static_cast<double>(sum_of(minimum_norm(matrix_a(s), vector_b(s, 0), 1e-8L))) / truth -
                      1));
    }
    std::printf("near-dependent: %.2g, and %.2g if taken for dependent\n", worst, lost);
    CHECK(worst <= 1e-5);
    CHECK(lost > 1e-2);
}

namespace {

constexpr double pi = 3.14159265358979323846;

// Techniques on [0, 1] of which some are nearly the same, up to a wave of a small size.
struct near_dependent {
    int m, family, wave;
    double size;
    std::vector<double> counts, mean_wave; // of each technique, so that its density integrates to 1

    static constexpr int families = 3, waves = 4, grid = 2048;

    near_dependent(int techniques, int of_family, int of_wave, double of_size, int of_counts)
        : m(techniques), family(of_family), wave(of_wave), size(of_size) {
        for (int k = 0; k < m; ++k)
            counts.push_back(of_counts == 0 ? 1 : of_counts == 1 ? 1 + k % 3 : std::pow(30.0, k % 3));
        for (int k = 0; k < m; ++k) {
            mean_wave.push_back(0);
            for (int i = 0; i < grid; ++i)
                mean_wave.back() += smooth(k, (i + 0.5) / grid) * waved((i + 0.5) / grid) / grid;
        }
    }
    double waved(double x) const {
        return wave == 0   ? std::cos(7 * x)
               : wave == 1 ? std::cos(6 * pi * x)
               : wave == 2 ? (x < 0.5 ? 1 : -1)
                           : 2 * x - 1;
    }
    // One of `count` around as many nodes.
    static double node(int count, int k, double x) {
        return count == 1 ? 1
                          : 0.2 + 0.8 * (1 + std::cos(2 * pi * (x - double(k) / count)) * (k % 2 + 1) / 2);
    }
    // Without its wave. The last is the first; the second half is the first half; the last is a mixture.
    double smooth(int k, double x) const {
        if (family == 1)
            return node(m / 2, k % (m / 2), x) + (k == m - 1 && m % 2 == 1 ? 0.5 * std::cos(10 * pi * x) : 0);
        if (k < m - 1)
            return m < 5 ? node(m - 1, k, x) : hat(m - 1, k, x);
        return family == 0 || m == 2 ? smooth(0, x) : 0.75 * smooth(0, x) + 0.25 * smooth(1, x);
    }
    static double hat(int count, int k, double x) {
        const double d = std::fabs(x - (k + 0.5) / count), around = count * std::min(d, 1 - d);
        return 0.1 + 0.9 * count * std::max(0.0, 1 - around);
    }
    bool has_wave(int k) const { return family == 1 ? k >= m / 2 && k < m / 2 * 2 : k == m - 1; }
    double pdf(int k, double x) const {
        const double p = smooth(k, x), w = waved(x) - mean_wave[static_cast<std::size_t>(k)];
        return has_wave(k) ? p * (1 + size * w) : p;
    }

    // Contributions: the first technique's density, the last one's, and a mixture of all with these factors.
    std::vector<double> factors(int channel) const {
        std::vector<double> c(counts.size(), 0);
        for (std::size_t k = 0; k < c.size(); ++k)
            c[k] = channel == 0   ? k == 0
                   : channel == 1 ? k + 1 == c.size()
                                  : std::cos(1 + 2 * static_cast<double>(k * k));
        return c;
    }

    // N samples that are distributed as all techniques' together: u of each is (s + 1/2) / N, or random.
    template <class U> estimator<dynamic> summed(int n, const U& u_of) const {
        std::vector<double> below{0}, q(counts.size());
        const auto weigh = [&](double x) {
            for (int k = 0; k < m; ++k)
                q[static_cast<std::size_t>(k)] = counts[static_cast<std::size_t>(k)] * pdf(k, x);
            return std::accumulate(q.begin(), q.end(), 0.0);
        };
        for (int i = 0; i < grid; ++i)
            below.push_back(below.back() + weigh((i + 0.5) / grid));
        estimator<dynamic> e(m);
        for (int x = 0; x < n; ++x) {
            const double u = u_of(x) * below.back();
            const auto after = std::upper_bound(below.begin() + 1, below.end() - 1, u);
            const double at =
                (static_cast<double>(after - below.begin()) - 1 + (u - after[-1]) / (after[0] - after[-1])) /
                grid;
            weigh(at);
            double f[3] = {};
            for (int c = 0; c < 3; ++c)
                for (std::size_t k = 0; k < counts.size(); ++k)
                    f[c] += factors(c)[k] * pdf(static_cast<int>(k), at);
            e.add(f, q);
        }
        return e;
    }
    // |F - integral| over the sum of |factors|.
    double error(const std::array<double, 3>& f, int channel) const {
        real exact = 0, all = 0;
        for (double c : factors(channel))
            exact += static_cast<real>(c), all += static_cast<real>(std::fabs(c));
        return static_cast<double>(
            std::fabs(static_cast<real>(f[static_cast<std::size_t>(channel)]) - exact) / all);
    }
};

// The least part of any technique's diagonal that is left when those before it are eliminated.
template <class E> double least_pivot(const E& e) {
    const int m = e.size();
    matrix a(static_cast<std::size_t>(m), vector(static_cast<std::size_t>(m)));
    double least = 1;
    for (int i = 0; i < m; ++i)
        for (int k = 0; k < m; ++k)
            a[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)] =
                static_cast<real>(e.products[e.pair(i, k)]);
    for (std::size_t j = 0; j < a.size(); ++j) {
        least = std::min(least, static_cast<double>(a[j][j] / e.products[static_cast<int>(j)]));
        for (std::size_t i = j + 1; i < a.size(); ++i)
            for (std::size_t k = a.size(); k-- > j;)
                a[i][k] -= a[i][j] / a[j][j] * a[j][k];
    }
    return least;
}

} // namespace

TEST_CASE("near-dependent techniques: f in the span is integrated to 1e-9, down to pivots of 1e-15") {
    // sizes of the wave from 1e-1 to 4e-8, whose squares the pivots are about
    worst_case error;
    double worst_of_variance = 0;
    int by_factors = 0, in_general = 0, tiny = 0;
    for (int m = 2; m <= 8; ++m)
        for (int family = 0; family < near_dependent::families; ++family)
            for (int wave = 0; wave < near_dependent::waves; ++wave)
                for (int counts = 0; counts < 3; ++counts)
                    for (int step = 0; step <= 19; ++step) {
                        const near_dependent s(m, family, wave, 0.1 * std::pow(10, -step / 3.0), counts);
                        constexpr int n = 1000;
                        const auto e = s.summed(n, [](int x) { return (x + 0.5) / n; });
                        mis::optimal::detail::factors<dynamic, double> a(m);
                        const bool regular = mis::optimal::detail::factorize(e, s.counts, a);
                        ++(regular ? by_factors : in_general);
                        tiny += least_pivot(e) < 3e-15;
                        const auto f = integral(e, s.counts), v = variance(e, s.counts);
                        for (int c = 0; c < 3; ++c) {
                            error.see(s.error(f, c), m * 1000 + family * 100 + wave * 10 + counts);
                            worst_of_variance = std::max(worst_of_variance, v[static_cast<std::size_t>(c)]);
                        }
                    }
    std::printf(
        "near-dependent, f in the span: %.2g (case %lld), variance %.2g; %d systems by factors, %d in "
        "general, %d with a pivot below 3e-15\n",
        error.error, error.sample, worst_of_variance, by_factors, in_general, tiny);
    CHECK(error.error <= 1e-9);
    CHECK(by_factors > 1000);
    CHECK(in_general > 1000);
    CHECK(tiny > 100);
    CHECK(worst_of_variance <= 1e-13);
    CHECK(worst_of_variance > 0); // what rounding hides is in it
}

TEST_CASE("near-dependent: densities 1 and 1 + size cos 7x, at evenly spaced points") {
    // The second does not integrate to 1, so that F depends on what alpha is: f is one of the two.
    double worst = 0;
    for (const int n : {100, 1000, 10'000})
        for (int step = 0; step <= 18; ++step) {
            const double size = 0.05 * std::pow(10, -step / 3.0); // to 5e-8: a pivot of 1e-15
            estimator<2, 2> e;
            for (int x = 0; x < n; ++x) {
                const double q[] = {1, 1 + size * std::cos(7 * (x + 0.5) / n)};
                e.add(q, q);
            }
            const int counts[] = {1, 1};
            for (double f : integral(e, counts))
                worst = std::max(worst, std::fabs(f - 1));
        }
    std::printf("near-dependent, 1 and 1 + size cos 7x: %.2g\n", worst);
    // What is left of the sums' own rounding is epsilon over the square root of the pivot, a few 1e-9, if
    // nothing cancels. 7.4e-10 in the order in which the library adds; -ffast-math chooses another.
#ifdef __FAST_MATH__
    CHECK(worst <= 5e-9);
#else
    CHECK(worst <= 1e-9);
#endif
}

TEST_CASE("near-dependent, from random samples: what is lost is within the variance") {
    // 3,780 errors over their standard deviations: none above 5.
    generator g(20);
    double worst = 0, worst_error = 0;
    for (int m = 2; m <= 8; ++m)
        for (int family = 0; family < near_dependent::families; ++family)
            for (const int n : {100, 1000})
                for (int step = 6; step <= 20; ++step) {
                    const near_dependent s(m, family, step % 4, 0.1 * std::pow(10, -step / 3.0), 1);
                    const auto e = s.summed(n, [&](int) { return g.uniform(); });
                    const auto f = integral(e, s.counts), v = variance(e, s.counts);
                    for (int c = 0; c < 3; ++c) {
                        worst_error = std::max(worst_error, s.error(f, c));
                        worst = std::max(worst, s.error(f, c) / std::sqrt(v[static_cast<std::size_t>(c)]));
                    }
                }
    std::printf("near-dependent, random samples: %.2g, %.2g standard deviations\n", worst_error, worst);
    CHECK(worst <= 5);
    CHECK(worst_error <= 1e-7);
}

TEST_CASE("a technique that is a mixture with a small share of another does no harm, in any order") {
    // Its pivots are the share's square, no smaller, wherever it stands; the matrix is singular.
    double worst = 0, worst_alpha = 0;
    for (int step = 2; step <= 16; ++step) {
        const double share = std::pow(10, -step / 2.0);
        std::vector<int> order{0, 1, 2, 3};
        do {
            estimator<dynamic, 2> with(4), without(3);
            const double counts[] = {1, 1, 1, 1};
            for (int x = 0; x < 1000; ++x) {
                const double y = (x + 0.5) / 1000, p[] = {1, 2 * y, hump(3, 1, y), 1 - share + share * 2 * y};
                double q[4];
                for (std::size_t k = 0; k < 4; ++k)
                    q[k] = p[order[k]];
                const double f[] = {y > 0.4 ? 1.0 : 0.0, p[1] + p[2]};
                with.add(f, q);
                // the mixture's samples would have been of the two
                without.add(f, std::array<double, 3>{p[0] * (2 - share), p[1] * (1 + share), p[2]});
            }
            const auto f = integral(with, counts);
            const auto expected = integral(without, std::array<double, 3>{2 - share, 1 + share, 1});
            const auto all_alpha = coefficients(with, counts);
            for (std::size_t c = 0; c < 2; ++c) {
                worst = std::max(worst, std::fabs(f[c] - expected[c]));
                for (double alpha : all_alpha[c])
                    worst_alpha = std::max(worst_alpha, std::fabs(alpha));
            }
        } while (std::next_permutation(order.begin(), order.end()));
    }
    std::printf("mixtures with a small share: %.2g, alpha up to %.2g\n", worst, worst_alpha);
    CHECK(worst <= 1e-9);
    CHECK(worst_alpha <= 3);
}

TEST_CASE("what is regular has no eigenvalue below the bound, and what has noise only is dependent") {
    generator g(21);
    double least = 1e30, worst = 0;
    for (int trial = 0; trial < 2'000; ++trial) { // regular by the factors: Jacobi's eigenvalues
        const int m = g.integer(2, 8);
        samples s = random_samples(g, m, 6 * m);
        for (auto& q : s.q) { // nearly dependent
            const std::size_t to = s.counts.size() - 1;
            q[to] = q[0] / s.counts[0] * s.counts[to] + q[to] * std::pow(10, -(trial % 50) / 10.0);
        }
        const auto e = summed<dynamic, 3>(s);
        mis::optimal::detail::factors<dynamic, double> a(m);
        if (!mis::optimal::detail::factorize(e, s.counts, a))
            continue;
        Eigen::MatrixXd scaled(m, m);
        for (int i = 0; i < m; ++i)
            for (int k = 0; k < m; ++k)
                scaled(i, k) = e.products[e.pair(i, k)] / std::sqrt(e.products[i] * e.products[k]);
        const double lambda = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled).eigenvalues()[0];
        least = std::min(least, lambda * m / mis::optimal::detail::regular);
    }
    // Pivots do not tell: 1, 1 + d w, 1 + (w + d z) / 2 leave some d^2 each, and an eigenvalue of some d^4.
    estimator<dynamic, 1> chain(3);
    const double ones[] = {1, 1, 1};
    for (int x = 0; x < 1000; ++x) {
        constexpr double d = 5e-4;
        const double y = (x + 0.5) / 1000, w = std::cos(2 * pi * y), z = std::cos(4 * pi * y);
        const double q[] = {1, 1 + d * w, 1 + (w + d * z) / 2};
        chain.add(q[0] + q[1] - q[2], q);
    }
    mis::optimal::detail::factors<dynamic, double> of_chain(3);
    CHECK(least_pivot(chain) > 1e-8);
    CHECK_FALSE(mis::optimal::detail::factorize(chain, ones, of_chain));

    // copies of many samples: alpha of least norm, equal shares, however many there are
    for (const int n : {100, 1000, 10'000, 100'000}) {
        estimator<dynamic, 1> e(4);
        const double share = g.uniform(0.1, 0.9), counts[] = {share, 2, 1 - share, 3};
        for (int x = 0; x < n; ++x) {
            const double y = (x + 0.5) / n, q[] = {share, 4 * y, 1 - share, 3 * hump(2, 0, y)};
            e.add(std::sqrt(y), q);
        }
        const auto alpha = coefficients(e, counts)[0];
        worst = std::max(worst, std::fabs(alpha[0] - alpha[2]));
    }
    std::printf("least eigenvalue of regular matrices %.2g of the bound; copies' alpha %.2g apart\n", least,
                worst);
    CHECK(least >= 1);
    CHECK(least < 1e4); // the bound is not far off
    CHECK(worst <= 1e-10);
}

TEST_CASE("solving changes nothing: twice, the same answer to the last bit") {
    generator g(3);
    for (int trial = 0; trial < 20; ++trial) {
        samples s = random_samples(g, 4, trial < 10 ? 40 : 3); // regular and singular
        const auto e = summed<4, 3>(s), before = e;
        const auto f = integral(e, s.counts);
        const auto alpha = coefficients(e, s.counts);
        const auto v = variance(e, s.counts);
        CHECK(integral(e, s.counts) == f);
        CHECK(coefficients(e, s.counts) == alpha);
        CHECK(variance(e, s.counts) == v);
        CHECK(same_bytes(e, before));
    }
}

TEST_CASE("10,000 partial sums merged in any order agree to 1e-12") {
    generator g(4);
    const samples all = random_samples(g, 4, 30'000);
    std::vector<estimator<4>> parts(10'000);
    for (std::size_t x = 0; x < all.q.size(); ++x)
        parts[x / 3].add(all.f[x], all.q[x]);
    for (std::size_t i = 0; i < parts.size(); ++i)
        parts[i].add_outside(static_cast<int>(i % 3), 2);

    const auto in_sequence = [&](const std::vector<estimator<4>>& p) {
        estimator<4> sum;
        for (const auto& e : p)
            sum += e;
        return sum;
    };
    const auto as_tree = [&](std::vector<estimator<4>> p) {
        while (p.size() > 1) {
            for (std::size_t i = 0; 2 * i < p.size(); ++i) {
                p[i] = p[2 * i];
                if (2 * i + 1 < p.size())
                    p[i] += p[2 * i + 1];
            }
            p.resize((p.size() + 1) / 2);
        }
        return p[0];
    };
    const auto first = integral(in_sequence(parts), all.counts);
    estimator<4> one = summed<4, 3>(all);
    for (int i = 0; i < 3; ++i)
        one.add_outside(i, 2 * (10'000 / 3 + (i == 0)) - all.outside[static_cast<std::size_t>(i)]);
    one.add_outside(3, -all.outside[3]);
    const auto first_variance = variance(one, all.counts);
    double worst = 0;
    const auto see = [&](const estimator<4>& e) {
        CHECK(draws(e) == doctest::Approx(50'000).epsilon(1e-12));
        for (std::size_t c = 0; c < 3; ++c)
            worst = std::max(worst, std::fabs(variance(e, all.counts)[c] / first_variance[c] - 1));
        for (std::size_t c = 0; c < 3; ++c)
            worst = std::max(worst, std::fabs(integral(e, all.counts)[c] / first[c] - 1));
    };
    for (int order = 0; order < 5; ++order) {
        see(as_tree(parts));
        std::shuffle(parts.begin(), parts.end(), g.engine);
        see(in_sequence(parts));
    }
    std::printf("merging: %.2g\n", worst);
    CHECK(worst <= 1e-12);
}

TEST_CASE("a technique twice, or one between two others, changes the integral by less than 1e-10") {
    generator g(5);
    double worst = 0, worst_alpha = 0;
    const auto see = [&](const samples& with, const samples& without) {
        const auto f = integral(summed<dynamic, 3>(with), with.counts);
        const auto expected = integral(summed<dynamic, 3>(without), without.counts);
        for (std::size_t c = 0; c < 3; ++c) {
            const real size = norm_of(alpha_of(without, static_cast<int>(c)));
            worst = std::max(worst, std::fabs(f[c] - expected[c]) / static_cast<double>(size));
        }
    };
    for (int trial = 0; trial < 300; ++trial) {
        const int m = g.integer(1, 8);
        samples without = random_samples(g, m, g.integer(2 * m, 500));
        std::fill(without.outside.begin(), without.outside.end(), 0); // there, no other technique has density
        // shares of 1e-6: the copies have very different counts
        const samples twice = with_copy(without, static_cast<std::size_t>(g.integer(0, m - 1)),
                                        trial % 3 == 0 ? 1e-6 : g.uniform(0.1, 0.9));
        see(twice, without);
        see(with_copy(twice, 0, 0.5), without);
        // minimum norm: copies share alpha equally, whatever their counts
        const auto alpha =
            coefficients(summed<dynamic, 3>(with_copy(without, 0, 1e-3)),
                         without.counts.size() == 1
                             ? std::vector<double>{without.counts[0] * 1e-3, without.counts[0] * (1 - 1e-3)}
                             : with_copy(without, 0, 1e-3).counts);
        const real size = norm_of(alpha_of(without, 0));
        worst_alpha =
            std::max(worst_alpha, std::fabs(alpha[0].front() - alpha[0].back()) / static_cast<double>(size));
        if (m < 2)
            continue;
        // technique m has the density (p_0 + p_1) / 2 and count n; what it samples, 0 and 1 would have
        // sampled
        const double n = g.log_uniform<double>(-1, 1);
        samples between = without, of_the_ends = without;
        for (std::size_t x = 0; x < between.q.size(); ++x) {
            auto &q = between.q[x], &ends = of_the_ends.q[x];
            const double p0 = q[0] / between.counts[0], p1 = q[1] / between.counts[1];
            q.push_back(n * (p0 + p1) / 2);
            ends[0] += n * p0 / 2, ends[1] += n * p1 / 2;
        }
        between.counts.push_back(n), of_the_ends.counts[0] += n / 2, of_the_ends.counts[1] += n / 2;
        between.outside.push_back(0), ++between.m;
        see(between, of_the_ends);
    }
    std::printf("dependent techniques: integral %.2g, alpha of copies %.2g\n", worst, worst_alpha);
    CHECK(worst <= 1e-10);
    CHECK(worst_alpha <= 1e-10);
}

TEST_CASE("singular matrices: the alpha of minimum norm") {
    generator g(6);
    errors worst;
    for (int trial = 0; trial < 300; ++trial) {
        const int m = g.integer(2, 8);
        samples s = random_samples(g, m, g.integer(1, m)); // fewer samples than techniques
        std::fill(s.outside.begin(), s.outside.end(), 0);
        for (std::size_t k = 0; k < s.counts.size(); ++k) { // of similar scale, to judge the oracle's rank
            const double n = g.integer(1, 4);
            for (auto& q : s.q)
                q[k] *= n / s.counts[k];
            s.counts[k] = n;
        }
        compare<dynamic, 3>(s, worst, trial);
        if (m == 4)
            compare<4, 3>(s, worst, trial);
    }
    print("singular", worst);
    CHECK(worst.integral.error <= 1e-10);
    CHECK(worst.alpha.error <= 1e-10);
    CHECK(worst.zero.error <= 1e-10);
}

TEST_CASE("no samples, techniques without density, and techniques with count 0") {
    const double counts[] = {1, 2, 0, 1e6};
    const estimator<4> empty;
    const std::array<double, 3> zero{};
    CHECK(integral(empty, counts) == zero);
    CHECK(variance(empty, counts) == zero);
    CHECK(coefficients(empty, counts)[2] == std::array<double, 4>{});
    CHECK(integral(estimator<dynamic>(4), counts) == zero);
    CHECK(integral(progressive<4>{}) == zero);

    // a count of 0 takes a technique out, even where it has been given weights
    estimator<2, 1> given;
    given.add_weighted(6, std::array<double, 2>{0.75, 0.25});
    given.add_weighted(2, std::array<double, 2>{0.5, 0.5});
    const double first[] = {1, 0};
    CHECK(integral(given, first)[0] == doctest::Approx(5.5 / 0.8125).epsilon(1e-14)); // b_0 / a_00
    CHECK(coefficients(given, first)[0][1] == 0);

    // only techniques 0 and 1 count
    generator g(7);
    const samples two = random_samples(g, 2, 30);
    samples four = two;
    four.m = 4;
    four.counts = {two.counts[0], 0, two.counts[1], 5};
    four.outside = {two.outside[0], 0, two.outside[1], 0};
    for (auto& q : four.q)
        q = {q[0], 0, q[1], 0};
    const auto e = summed<4, 3>(four);
    const auto alpha = coefficients(e, four.counts), expected = coefficients(summed<4, 3>(four), four.counts);
    CHECK(alpha == expected);
    for (std::size_t c = 0; c < 3; ++c) {
        CHECK(alpha[c][1] == 0);
        CHECK(alpha[c][3] == 0);
        CHECK(integral(e, four.counts)[c] ==
              doctest::Approx(integral(summed<2, 3>(two), two.counts)[c]).epsilon(1e-14));
        CHECK(variance(e, four.counts)[c] > 0);
    }
}

TEST_CASE("units of f and of densities, and counts of 1 and 1e6 in one system") {
    generator g(8);
    double worst = 0;
    errors mixed;
    for (int trial = 0; trial < 100; ++trial) {
        const int m = g.integer(1, 6);
        const samples s = random_samples(g, m, 50);
        const auto expected = integral(summed<dynamic, 3>(s), s.counts);
        for (const double of_f : {1e-200, 1.0, 1e200})
            for (const double of_densities : {1e-90, 1.0, 1e90}) {
                samples scaled = s;
                for (auto& f : scaled.f)
                    for (double& x : f)
                        x *= of_f;
                for (auto& q : scaled.q)
                    for (double& x : q)
                        x *= of_densities;
                const auto f = integral(summed<dynamic, 3>(scaled), s.counts);
                for (std::size_t c = 0; c < 3; ++c)
                    worst =
                        std::max(worst, std::fabs(f[c] / of_f * of_densities - expected[c]) /
                                            static_cast<double>(norm_of(alpha_of(s, static_cast<int>(c)))));
            }
        samples counts = s;
        for (std::size_t k = 0; k < s.counts.size(); ++k) {
            counts.counts[k] = k % 2 == 0 ? 1e6 : 1;
            // the others' weights are then around 1e-6 everywhere, and products of two of them 1e-12
            for (auto& q : counts.q)
                q[k] = std::max(q[k] / s.counts[k], 0.01) * counts.counts[k];
        }
        compare<dynamic, 3>(counts, mixed, trial);
    }
    std::printf("units: %.2g\n", worst);
    print("counts of 1 and 1e6", mixed);
    CHECK(worst <= 1e-12);
    CHECK(mixed.integral.error <= 1e-10);
    CHECK(mixed.zero.error <= 1e-10);
}

namespace {

// What an estimator with one sample is made of: f / D, and balance weights.
template <class T = double, class F, class Q> std::pair<real, vector> one_sample(const F& f, const Q& q) {
    using numbers = std::array<double, 3>;
    estimator<3, 1, T> e;
    e.add(f, q);
    estimator<dynamic, 1, T> d(3);
    d.add(f, q);
    vector u;
    for (int k = 0; k < 3; ++k) {
        u.push_back(std::sqrt(static_cast<real>(e.products[e.pair(k, k)])));
        // to the last bit, but for -ffast-math, which may round each loop in its own way
        const double rounding = subnormals ? 0 : 1e-15;
        CHECK(std::fabs(d.products[k] - e.products[k]) <= rounding * std::fabs(e.products[k]));
        CHECK(std::fabs(d.values[k] - e.values[k]) <= rounding * std::fabs(e.values[k]));
    }
    const numbers values{double(e.values[0]), double(e.values[1]), double(e.values[2])};
    real value = 0; // sum of f / D u_k
    for (double v : values)
        value += static_cast<real>(v);
    CHECK(!is_nan(double(value)));
    return {value, u};
}

template <class Q, class F> bool weighs_as_balance(F f, const Q& q, real expected, real rounding = 1e-14L) {
    double u[3];
    mis::weights(mis::balance, &q[0], 3, &u[0]);
    const auto [value, weights] = one_sample(f, q);
    bool same = std::fabs(value - expected) <= rounding * std::fabs(expected);
    for (std::size_t k = 0; k < 3; ++k)
        same = same && std::fabs(weights[k] - static_cast<real>(u[k])) <= 1e-14L;
    return same;
}

} // namespace

TEST_CASE("densities of 0 and infinity, and the whole range") {
    const double inf = from_bits<double>(oracle::infinity_bits<double>);
    using q3 = std::array<double, 3>;
    CHECK(weighs_as_balance(5.0, q3{0, 2, 0}, 2.5L));
    CHECK(weighs_as_balance(0.0, q3{1, 2, 3}, 0));
    CHECK(weighs_as_balance(5.0, q3{inf, 2, 3}, 0)); // infinite ones share, f / D = 0
    CHECK(weighs_as_balance(5.0, q3{inf, inf, 3}, 0));
    // f / D where D, 1 / D or both are out of range
    CHECK(weighs_as_balance(1e300, q3{1e300, 2e300, 1e300}, 0.25L));
    CHECK(weighs_as_balance(1e-300, q3{1e-300, 2e-300, 1e-300}, 0.25L));
    CHECK(weighs_as_balance(-1e-300, q3{1e-300, 0, 1e-300}, -0.5L));
    CHECK(weighs_as_balance(1e-5, q3{1e-305, 0, 1e-305}, 0.5e300L));
    CHECK(weighs_as_balance(1e305, q3{1e304, 0, 0}, 10));
    CHECK(weighs_as_balance(1e-150, q3{1e150, 1e150, 2e150}, 0.25e-300L));
    if (subnormals) { // not under -ffast-math
        CHECK(weighs_as_balance(1e308, q3{1.7e308, 1.7e308, 1.7e308}, 1e308L / 5.1e308L));
        CHECK(weighs_as_balance(1e-310, q3{1e-310, 0, 1e-310}, 0.5L, 1e-13L)); // fewer digits
    }
#ifdef NDEBUG
    estimator<3> e;
    e.add(std::array<double, 3>{1, 2, 3}, q3{0, 0, 0}); // no technique can make it: ignored
    CHECK(draws(e) == 0);
    progressive<3> p;
    p.add(std::array<double, 3>{1, 2, 3}, q3{0, 0, 0});
    CHECK(!p.open);
#endif
    // float over its whole range
    for (const float scale : {2e-38f, 1e-20f, 1.0f, 1e20f, 1e38f}) {
        const float q[] = {scale, 2 * scale, 0};
        CHECK(double(one_sample<float>(scale, q).first) == doctest::Approx(1.0 / 3).epsilon(1e-7));
    }
    const float q[] = {2e-38f, 2e-38f, 0};
    CHECK(double(one_sample<float>(1e38f, q).first) == doctest::Approx(0.25e76).epsilon(1e-6));
}

TEST_CASE("the whole range of densities at random: the estimate is finite, and no number is NaN") {
    generator g(9);
    int wrong = 0;
    for (int trial = 0; trial < 5'000; ++trial) {
        estimator<4> e;
        const int count = g.integer(1, 12);
        for (int x = 0; x < count; ++x) {
            double q[4], f[3];
            for (double& v : q) {
                v = g.chance(0.1) ? from_bits<double>(oracle::infinity_bits<double>)
                                  : g.log_uniform<double>(-290, 290);
                v = g.chance(0.2) ? 0 : v;
            }
            q[g.integer(0, 3)] = 1;
            for (double& v : f)
                v = g.chance(0.2) ? 0 : g.log_uniform<double>(-10, 10);
            e.add(f, q);
        }
        const double counts[] = {1, 1e12, 1e-12, 3};
        const auto f = integral(e, counts), v = variance(e, counts);
        for (std::size_t c = 0; c < 3; ++c)
            wrong += is_nan(f[c]) || !is_finite(f[c]) || is_nan(v[c]) || v[c] < 0;
    }
    CHECK(wrong == 0);
}

TEST_CASE("one channel takes plain numbers, others anything with []") {
    const double q[] = {1, 2, 3}, f[] = {5};
    estimator<3, 1> number, array;
    number.add(5, q), array.add(f, q);
    number.add_weighted(2.0f, q), array.add_weighted(std::vector<double>{2}, q);
    CHECK(same_bytes(number, array));
    CHECK(number.squares[0] == doctest::Approx(25.0 / 36 + 4));
}

TEST_CASE("in float: sums and solution in double") {
    generator g(10);
    for (int trial = 0; trial < 50; ++trial) {
        const samples s = random_samples(g, 4, 100);
        estimator<4, 3, float> e;
        estimator<4, 3, double> d;
        for (std::size_t x = 0; x < s.q.size(); ++x) {
            const std::vector<float> q(s.q[x].begin(), s.q[x].end()), f(s.f[x].begin(), s.f[x].end());
            e.add(f, q);
            d.add(f, q);
        }
        const auto in_float = integral(e, s.counts);
        const auto in_double = integral(d, s.counts);
        static_assert(std::is_same_v<decltype(in_float), const std::array<float, 3>>);
        for (std::size_t c = 0; c < 3; ++c)
            CHECK(in_float[c] == static_cast<float>(in_double[c]));
    }
}

TEST_CASE("weights: [O], their sum, and where they are undefined") {
    generator g(11);
    double worst = 0, worst_sum = 0;
    int negative = 0;
    for (int trial = 0; trial < 2'000; ++trial) {
        const int m = g.integer(1, 8);
        const samples s = random_samples(g, m, 1);
        const double f = g.uniform(0.1, 2);
        std::vector<double> alpha, w(s.q[0]);
        for (int k = 0; k < m; ++k)
            alpha.push_back(g.uniform(-1, 2));
        mis::optimal::weights(alpha, f, s.counts, w, m, w); // in place
        real sum = 0, controls = 0, size = 1;
        for (std::size_t k = 0; k < w.size(); ++k)
            controls += static_cast<real>(alpha[k]) * density(s, 0, k) / static_cast<real>(f),
                size += std::fabs(static_cast<real>(alpha[k]) * density(s, 0, k) / static_cast<real>(f));
        for (std::size_t k = 0; k < w.size(); ++k) {
            const real exact = static_cast<real>(alpha[k]) * density(s, 0, k) / static_cast<real>(f) +
                               static_cast<real>(s.q[0][k]) / mixture(s, 0) * (1 - controls);
            worst = std::max(worst, static_cast<double>(std::fabs(static_cast<real>(w[k]) - exact) / size));
            sum += static_cast<real>(w[k]);
            negative += w[k] < 0;
        }
        worst_sum = std::max(worst_sum, static_cast<double>(std::fabs(sum - 1) / size));
    }
    CHECK(worst <= 1e-14);
    CHECK(worst_sum <= 1e-14);
    CHECK(negative > 100);

    const double inf = from_bits<double>(oracle::infinity_bits<double>);
    const double alpha[] = {1, 2, 3}, counts[] = {1, 1, 0}, q[] = {1, 3, 0}, dirac[] = {1, inf, inf};
    const float none[] = {0, 0, 0};
    double w[3];
    float v[3];
    mis::optimal::weights(alpha, 0.0, counts, q, 3, w);
    CHECK((w[0] == 0.25 && w[1] == 0.75 && w[2] == 0)); // balance
    mis::optimal::weights(alpha, 1.0, counts, dirac, 3, w);
    CHECK((w[0] == 0 && w[1] == 0.5 && w[2] == 0.5)); // balance
    mis::optimal::weights(alpha, 1.0f, counts, none, 3, v);
    CHECK((v[0] == 0 && v[1] == 0 && v[2] == 0));
}

// ---- Sampling ----

namespace {

// On [0, 1]: uniform, linear, and a technique whose samples are uniform in [0, 1.5], so that a third leaves.
constexpr int sampled = 3;
double pdf(int k, double x) { return k == 0 ? 1 : k == 1 ? 2 * x : 1 / 1.5; }
double draw(generator& g, int k) {
    const double u = g.uniform();
    return k == 0 ? u : k == 1 ? std::sqrt(u) : 1.5 * u;
}
// A step, a smooth function, and one in the span; their integrals are 1 / 2, 1 / 3 and 2.
std::array<double, 3> functions(double x) { return {x > 0.5 ? 1.0 : 0.0, x * x, 1 + 2 * x}; }

// Makes one pass with all techniques: adds each sample by add(f, densities), or by outside(technique).
template <class Add, class Outside>
void make_pass(generator& g, const int* counts, const Add& add, const Outside& outside) {
    for (int i = 0; i < sampled; ++i)
        for (int n = 0; n < counts[i]; ++n) {
            const double x = draw(g, i);
            double q[sampled];
            for (int k = 0; k < sampled; ++k)
                q[k] = counts[k] * pdf(k, x);
            if (x > 1)
                outside(i);
            else
                add(functions(x), q);
        }
}
template <class E> void make_pass(generator& g, const int* counts, E& e) {
    make_pass(
        g, counts, [&](const auto& f, const auto& q) { e.add(f, q); }, [&](int i) { e.add_outside(i); });
}

// Mean and variance of many estimates.
struct statistics {
    double count = 0, sum = 0, squares = 0;

    void see(double x) { ++count, sum += x, squares += x * x; }
    double mean() const { return sum / count; }
    double variance() const { return (squares / count - mean() * mean()) * count / (count - 1); }
    // distance from the truth in standard errors
    double deviation(double truth) const { return std::fabs(mean() - truth) / std::sqrt(variance() / count); }
};

} // namespace

TEST_CASE("variance: the estimate is what the integral's variance is") {
    generator g(12);
    const int counts[] = {2, 1, 3};
    constexpr int repetitions = 4'000, passes = 200;
    statistics estimates[3], variances[3];
    double worst_draws = 0;
    for (int r = 0; r < repetitions; ++r) {
        estimator<sampled> e;
        for (int pass = 0; pass < passes; ++pass)
            make_pass(g, counts, e);
        const auto f = integral(e, counts), v = variance(e, counts);
        for (std::size_t c = 0; c < 3; ++c)
            estimates[c].see(f[c]), variances[c].see(v[c]);
        worst_draws = std::max(worst_draws, std::fabs(draws(e) / (6 * passes) - 1));
    }
    CHECK(worst_draws <= 1e-12);
    for (int c = 0; c < 2; ++c) {
        // The relative standard error of a variance from n estimates is sqrt(2 / n), 2.2 %. 4 of them: a
        // false alarm in 16,000 seeds, but the seed is fixed.
        CAPTURE(c);
        std::printf("variance %.3g, estimated %.3g\n", estimates[c].variance(), variances[c].mean());
        CHECK(std::fabs(variances[c].mean() / estimates[c].variance() - 1) <=
              4 * std::sqrt(2.0 / repetitions));
        CHECK(estimates[c].mean() == doctest::Approx(c == 0 ? 0.5 : 1.0 / 3).epsilon(1e-3));
    }
    CHECK(estimates[2].mean() == doctest::Approx(2).epsilon(1e-12)); // in the span
    CHECK(variances[2].mean() <= 1e-15);
}

TEST_CASE("variance written out: squared residuals, draws that are free, and the squares of weights") {
    generator g(18);
    double worst = 0;
    for (int trial = 0; trial < 200; ++trial) {
        const int m = g.integer(1, 8);
        const bool copies = trial % 4 == 0; // of rank m, nevertheless
        samples s = random_samples(g, m, g.integer(2 * m, 4 * m));
        if (copies) {
            s.outside.assign(s.outside.size(), 0);
            s = with_copy(s, 0, 0.25);
        }
        const auto v = variance(summed<dynamic, 3>(s), s.counts);
        const auto sum = [](const std::vector<double>& x) {
            return std::accumulate(x.begin(), x.end(), 0.0);
        };
        const double n = sum(s.outside) + static_cast<double>(s.q.size()), passes = n / sum(s.counts);
        // F is the sum of f / D weighted by sum_k y_k p_k / D, A y = (1, .., 1)
        const vector y = minimum_norm(matrix_a(s), vector(s.counts.size(), 1));
        real squares = 0;
        for (std::size_t x = 0; x < s.q.size(); ++x) {
            real weight = 0;
            for (std::size_t k = 0; k < y.size(); ++k)
                weight += y[k] * density(s, x, k) / mixture(s, x);
            squares += weight * weight;
        }
        for (std::size_t k = 0; k < y.size(); ++k)
            if (s.outside[k] > 0)
                squares += static_cast<real>(s.outside[k]) * (y[k] / static_cast<real>(s.counts[k])) *
                           (y[k] / static_cast<real>(s.counts[k]));
        const double l = std::max(1.0, static_cast<double>(squares) * passes * passes / n);
        for (std::size_t c = 0; c < 3; ++c) {
            const vector alpha = alpha_of(s, static_cast<int>(c));
            const double expected = static_cast<double>(squared_residuals(s, alpha, c)) / (passes * passes) *
                                    (n / (n - m)) * (n / (n - m)) * l * l;
            worst = std::max(worst, std::fabs(v[c] / expected - 1));
        }
    }
    std::printf("variance written out: %.2g\n", worst);
    CHECK(worst <= 1e-10);
}

namespace {

// Densities on [0, 1] that can be sampled: hats around m nodes, each with a tenth that reaches everywhere; or
// (k + 1) x^k, of which 0 is reached by the first alone, and is rarely sampled.
template <int M> struct sampled_densities {
    bool powers;
    std::array<double, M> counts;

    explicit sampled_densities(bool of_powers) : powers(of_powers) {
        for (std::size_t k = 0; k < M; ++k)
            counts[k] = 1 + static_cast<double>(k % 3);
    }
    double pdf(int k, double x) const {
        return powers ? (k + 1) * std::pow(x, k) : near_dependent::hat(M, k, x);
    }
    double draw(generator& g, int k) const {
        if (powers)
            return std::pow(g.uniform(), 1.0 / (k + 1));
        if (g.chance(0.1))
            return g.uniform();
        const double x = (k + 0.5 + g.uniform() + g.uniform() - 1) / M;
        return x < 0 ? x + 1 : x >= 1 ? x - 1 : x;
    }
    // A step, a wave and a bump.
    static std::array<double, 3> functions(double x) {
        return {x > 0.55 ? 1.0 : 0.0, 1 + std::sin(9 * x), std::exp(-50 * (x - 0.3) * (x - 0.3))};
    }
    template <class Add> void pass(generator& g, const Add& add) const {
        for (int i = 0; i < M; ++i)
            for (int n = 0; n < counts[static_cast<std::size_t>(i)]; ++n) {
                const double x = draw(g, i);
                std::array<double, M> q;
                for (int k = 0; k < M; ++k)
                    q[static_cast<std::size_t>(k)] = counts[static_cast<std::size_t>(k)] * pdf(k, x);
                add(functions(x), q);
            }
    }
};

struct ratios {
    double least = 1e30, most = 0;
};

// Mean of the estimated variances over the variance of the estimates, and whether squared errors are.
template <int M> ratios variance_ratios(bool powers, int passes, int repetitions) {
    const sampled_densities<M> s(powers);
    generator g(22);
    statistics estimates[3], variances[3];
    for (int r = 0; r < repetitions; ++r) {
        estimator<M> e;
        for (int pass = 0; pass < passes; ++pass)
            s.pass(g, [&](const auto& f, const auto& q) { e.add(f, q); });
        const auto f = integral(e, s.counts), v = variance(e, s.counts);
        for (std::size_t c = 0; c < 3; ++c)
            estimates[c].see(f[c]), variances[c].see(v[c]);
    }
    ratios found;
    for (int c = 0; c < 3; ++c) {
        const double ratio = variances[c].mean() / estimates[c].variance();
        found.least = std::min(found.least, ratio);
        found.most = std::max(found.most, ratio);
    }
    return found;
}
template <int M> void see_variance_ratios(bool powers) {
    std::printf("%s, %d techniques:", powers ? "powers" : "hats", M);
    for (const int passes : {4, 8, 16, 64}) {
        const ratios r = variance_ratios<M>(powers, passes, passes == 64 ? 4'000 : 10'000);
        std::printf("  %d passes %.2f to %.2f", passes, r.least, r.most);
        CAPTURE(M);
        CAPTURE(passes);
        if (!powers) {
            // The relative standard error of a variance from n estimates is sqrt(2 / n) or, with tails as
            // these have, up to twice that: 2.8 % and 4.5 %.
            CHECK(r.least >= 0.95);
            CHECK(r.most <= (passes == 4 ? 1.6 : passes == 8 ? 1.25 : 1.15));
        } else if (M == 2) {
            CHECK(r.least >= 0.6);
        }
    }
    std::printf("\n");
}

} // namespace

TEST_CASE("variance from few passes, over what it estimates") {
    // docs/optimal.md has what this prints.
    see_variance_ratios<2>(false), see_variance_ratios<3>(false);
    see_variance_ratios<4>(false), see_variance_ratios<8>(false);
    see_variance_ratios<2>(true), see_variance_ratios<3>(true), see_variance_ratios<4>(true);
}

TEST_CASE("progressive: the variance is what it is, or more") {
    // Of 10,000 runs; relative standard errors are 1.4 %.
    const sampled_densities<4> s(false);
    for (const int batches : {1, 2, 4, 8}) {
        generator g(23);
        statistics estimates[3], variances[3];
        for (int run = 0; run < 10'000; ++run) {
            progressive<4> p;
            CHECK(is_infinite(variance(p)[0]));
            for (int batch = 0; batch < batches; ++batch) {
                auto worker = fork(p);
                for (int pass = 0; pass < 8; ++pass)
                    s.pass(g, [&](const auto& f, const auto& q) {
                        pass % 2 == 0 ? p.add(f, q) : worker.add(f, q);
                    });
                p += worker;
                end_batch(p, s.counts, 8);
            }
            const auto f = integral(p), v = variance(p);
            for (std::size_t c = 0; c < 3; ++c)
                estimates[c].see(f[c]), variances[c].see(v[c]);
        }
        std::printf("progressive, %d batches:", batches);
        for (int c = 0; c < 3; ++c) {
            const double ratio = variances[c].mean() / estimates[c].variance();
            std::printf(" %.2f", ratio);
            CHECK(ratio >= 1 - 4 * 0.014);
        }
        std::printf("\n");
    }
    // With the optimal alpha nothing is missing: the mean of many passes at once, alpha from as many before.
    generator g(24);
    statistics estimates[3], variances[3];
    progressive<4> learned;
    for (int pass = 0; pass < 1'000; ++pass)
        s.pass(g, [&](const auto& f, const auto& q) { learned.add(f, q); });
    end_batch(learned, s.counts, 1'000);
    for (int run = 0; run < 10'000; ++run) {
        auto p = fork(learned);
        for (int pass = 0; pass < 4; ++pass)
            s.pass(g, [&](const auto& f, const auto& q) { p.add(f, q); });
        end_batch(p, s.counts, 4);
        const auto f = integral(p), v = variance(p);
        for (std::size_t c = 0; c < 3; ++c)
            estimates[c].see(f[c]), variances[c].see(v[c]);
    }
    for (int c = 0; c < 3; ++c)
        CHECK(std::fabs(variances[c].mean() / estimates[c].variance() - 1) <= 4 * 0.014);
}

TEST_CASE("progressive: variance with draws outside, written out") {
    const int counts[] = {1, 2, 1};
    generator g(25);
    progressive<sampled> p;
    real squares[3] = {};
    for (int batch = 0; batch < 6; ++batch) {
        make_pass(
            g, counts,
            [&](const auto& f, const double* q) {
                const real d = static_cast<real>(q[0]) + q[1] + q[2];
                for (int c = 0; c < 3; ++c) {
                    real r = static_cast<real>(f[static_cast<std::size_t>(c)]) / d;
                    for (int k = 0; k < sampled; ++k)
                        r -= static_cast<real>(p.control[c * sampled + k]) * q[k] / d;
                    squares[c] += r * r;
                }
                p.add(f, q);
            },
            [&](int i) {
                for (int c = 0; c < 3; ++c)
                    squares[c] += static_cast<real>(p.control[c * sampled + i]) * p.control[c * sampled + i];
                p.add_outside(i);
            });
        end_batch(p, counts, 1, {1, 0});
        for (int c = 0; c < 3; ++c)
            CHECK(variance(p)[static_cast<std::size_t>(c)] ==
                  doctest::Approx(double(squares[c] / (batch + 1) / (batch + 1))).epsilon(1e-10));
    }
}

// ---- Input that is no number, and callers' bugs ----

namespace {

// Not a constant, of which -ffast-math may make anything.
double made(std::uint64_t bits) {
    volatile std::uint64_t hidden = bits;
    return from_bits<double>(hidden);
}

// By its bits, whatever -ffast-math makes of comparisons with infinity.
template <class V> bool unknown(const V& v) { return oracle::bits_of(v) == oracle::infinity_bits<V>; }
bool no_number(double x) { return is_nan(x) || is_infinite(x); }

} // namespace

TEST_CASE("an f that is no number is never taken for converged, and leaves the other channels alone") {
    generator g(26);
    const auto infinity = oracle::infinity_bits<double>, nan = infinity + 12345;
    for (const std::uint64_t bits : {infinity, nan, infinity | oracle::sign_bit<double>})
        for (const bool singular : {false, true})
            for (const bool weighted : {false, true}) {
                estimator<3> e;
                progressive<3> p;
                const double bad = made(bits), counts[] = {1, 1, 1};
                for (int x = 0; x < 100; ++x) {
                    std::array<double, 3> f{1, g.uniform(), 2};
                    if (x == 50)
                        f[0] = bad;
                    const double second = g.uniform(0.5, 1), third = g.uniform(0.5, 1);
                    const std::array<double, 3> q{1, second, singular ? 2 * second : third};
                    if (weighted) {
                        std::array<double, 3> u;
                        mis::weights(mis::balance, q, u);
                        e.add_weighted(f, u), p.add_weighted(f, u);
                    } else {
                        e.add(f, q), p.add(f, q);
                    }
                }
                end_batch(p, counts, 33);
                CHECK(no_number(integral(e, counts)[0]));
                CHECK(unknown(variance(e, counts)[0]));
                CHECK(no_number(integral(p)[0]));
                CHECK(unknown(variance(p)[0]));
                for (std::size_t c = 1; c < 3; ++c) {
                    CHECK(is_finite(integral(e, counts)[c]));
                    CHECK(is_finite(variance(e, counts)[c]));
                    CHECK(is_finite(integral(p)[c]));
                    CHECK(is_finite(variance(p)[c]));
                }
            }
    // also where no technique takes part that has seen it
    estimator<2, 1> given;
    given.add_weighted(1.0, std::array<double, 2>{0, 1});
    given.add_weighted(made(nan), std::array<double, 2>{0, 1});
    CHECK(unknown(variance(given, std::array<double, 2>{1, 0})[0]));
}

TEST_CASE("f / D out of range: the integral is no number, the variance infinite") {
    generator g(27);
    const std::array<double, 2> counts{1, 1};
    const auto see = [&](double f, double q, int n) {
        estimator<2, 1> e;
        progressive<2, 1> p;
        for (int x = 0; x < n; ++x) {
            const std::array<double, 2> densities{q, x % 2 == 0 ? q : 0};
            e.add(f, densities), p.add(f, densities);
        }
        end_batch(p, counts, n / 2);
        CHECK(unknown(variance(e, counts)[0]));
        CHECK(unknown(variance(p)[0]));
        return std::pair(integral(e, counts)[0], integral(p)[0]);
    };
    if (subnormals) {
        const auto [f, of_progressive] = see(1, made(1), 4); // 1 over the least subnormal number
        CHECK(no_number(f));
        CHECK(no_number(of_progressive));
    }
    const double huge = g.log_uniform<double>(305, 305.1);
    const auto [f, of_progressive] = see(huge, 1e-10, 4); // f / D overflows
    CHECK(no_number(f));
    CHECK(no_number(of_progressive));
    // squares overflow, and sums do not
    const auto [large, large_progressive] = see(huge, 1, 4);
    CHECK(large == doctest::Approx(huge).epsilon(1e-12));
    CHECK(large_progressive == doctest::Approx(1.5 * huge).epsilon(1e-12)); // balance
    // sums overflow
    CHECK(no_number(see(huge, 1e-2, 10'000).first));
}

TEST_CASE("weights and densities that are no numbers, and counts of 0: no variance is known") {
    generator g(28);
    const double nan = made(oracle::infinity_bits<double> + 1), counts[] = {1, 1}, none[] = {0, 0};
    estimator<2, 1> e;
    for (int x = 0; x < 20; ++x)
        e.add(g.uniform(), std::array<double, 2>{1, g.uniform(0.5, 1)});
    CHECK(is_finite(variance(e, counts)[0]));
    CHECK(unknown(variance(e, none)[0]));
    CHECK(integral(e, none)[0] == 0);
    estimator<2, 1> outside = e;
    outside.add_outside(0, nan);
    CHECK(unknown(variance(outside, counts)[0]));
#ifdef NDEBUG
    estimator<2, 1> weighted = e;
    weighted.add_weighted(1.0, std::array<double, 2>{nan, nan});
    CHECK(unknown(variance(weighted, counts)[0]));
#endif
}

#ifdef NDEBUG // asserted otherwise, tests/edge_cases_optimal.cpp
TEST_CASE("callers' bugs touch nothing else, and leave no estimate that looks like one") {
    const std::array<double, 2> counts{1, 1};
    const std::vector<double> one{1};
    generator g(29);
    const auto spoiled = [&](const auto& bug) {
        struct {
            double before[4] = {1, 2, 3, 4};
            estimator<2, 1> e;
            progressive<2, 1> p;
            double after[4] = {1, 2, 3, 4};
        } guarded;
        estimator<dynamic, 1> d(2);
        progressive<dynamic, 1> dp(2);
        for (int x = 0; x < 50; ++x) {
            const std::array<double, 2> q{1, g.uniform(0.5, 1)};
            guarded.e.add(1.0, q), guarded.p.add(1.0, q), d.add(1.0, q), dp.add(1.0, q);
        }
        bug(guarded.e, guarded.p, d, dp);
        end_batch(guarded.p, counts, 25), end_batch(dp, counts, 25);
        bool same = true;
        for (int k = 0; k < 4; ++k)
            same = same && guarded.before[k] == k + 1 && guarded.after[k] == k + 1;
        CHECK(same);
        CHECK((no_number(integral(guarded.e, counts)[0]) && no_number(integral(d, counts)[0])));
        CHECK((no_number(integral(guarded.p)[0]) && no_number(integral(dp)[0])));
        CHECK((unknown(variance(guarded.e, counts)[0]) && unknown(variance(d, counts)[0])));
        CHECK((unknown(variance(guarded.p)[0]) && unknown(variance(dp)[0])));
    };
    for (const int i : {-1, 2, 1'000'000'000, -2'000'000'000})
        spoiled([i](auto& e, auto& p, auto& d, auto& dp) {
            e.add_outside(i), p.add_outside(i), d.add_outside(i), dp.add_outside(i);
        });
    spoiled([](auto& e, auto& p, auto& d, auto& dp) {
        d += estimator<dynamic, 1>(3), dp += progressive<dynamic, 1>(1);
        e.add_outside(2), p.add_outside(2);
    });
    spoiled([](auto& e, auto& p, auto& d, auto& dp) {
        d += estimator<dynamic, 1>(), dp += progressive<dynamic, 1>();
        e.add_outside(2), p.add_outside(2);
    });
    // no techniques
    for (const int m : {0, -1, -5}) {
        estimator<dynamic, 1> e(m), weighted(m), outside(m), negative(m);
        progressive<dynamic, 1> p(m);
        CHECK(e.size() == 0);
        CHECK(integral(e, one)[0] == 0);
        e.add(1.0, one), weighted.add_weighted(1.0, one), outside.add_outside(0), p.add(1.0, one);
        for (const auto* x : {&e, &weighted, &outside}) {
            CHECK(integral(*x, one)[0] == 0);
            CHECK(unknown(variance(*x, one)[0]));
        }
        p.add_weighted(1.0, one), p.add_outside(0);
        end_batch(p, one, 1);
        CHECK(unknown(variance(p)[0]));
    }
}
#endif

TEST_CASE("integers as f are weighed as real numbers") {
    estimator<2, 1> e, real_e;
    estimator<2, 3> color, real_color;
    const std::array<double, 2> q{1.5, 2};
    const int f[] = {1, 2, 3};
    const unsigned char bytes[] = {1, 2, 3};
    e.add(1, q), e.add_weighted(2u, q), real_e.add(1.0, q), real_e.add_weighted(2.0, q);
    color.add(f, q), color.add(bytes, q);
    for (int k = 0; k < 2; ++k)
        real_color.add(std::array<double, 3>{1, 2, 3}, q);
    CHECK(same_bytes(e, real_e));
    CHECK(same_bytes(color, real_color));
}

TEST_CASE("many techniques: 129, which a matrix on the stack has no room for, and 300") {
    const auto see = [](auto size) {
        constexpr int m = size.value;
        auto e = std::make_unique<estimator<m, 1>>();
        std::vector<double> counts(m, 2), q(m);
        for (int x = 0; x < 3 * m; ++x) {
            for (int k = 0; k < m; ++k)
                q[static_cast<std::size_t>(k)] = 2 * near_dependent::hat(m, k, (x + 0.5) / (3 * m));
            e->add(q[0] / 2 + 2 * q[1], q);
        }
        CHECK(integral(*e, counts)[0] == doctest::Approx(5).epsilon(1e-12));
        CHECK(variance(*e, counts)[0] <= 1e-10); // what rounding may hide of 25
        for (int x = 0; x < 3 * m; ++x) {        // and singular
            q.assign(m, 0);
            q[0] = q[1] = 2;
            e->add(5, q);
        }
        CHECK(is_finite(integral(*e, counts)[0]));
        CHECK(coefficients(*e, counts)[0].size() == m);
    };
    see(std::integral_constant<int, 64>{}), see(std::integral_constant<int, 65>{});
    see(std::integral_constant<int, 129>{}), see(std::integral_constant<int, 300>{});
}

TEST_CASE("variance is unknown while draws do not exceed the rank") {
    const int counts[] = {1, 1, 1};
    generator g(13);
    estimator<sampled> e;
    e.add(functions(0.2), std::array<double, 3>{1, 0.4, 0.7});
    CHECK(is_infinite(variance(e, counts)[0]));
    for (int pass = 0; pass < 2; ++pass)
        make_pass(g, counts, e);
    CHECK(is_finite(variance(e, counts)[1]));
    // not a constant: with -ffast-math a compiler may do anything with a square that it knows to overflow
    const double large = g.log_uniform<double>(200, 201);
    e.add_weighted(std::array<double, 3>{large, 0, 0}, std::array<double, 3>{0.2, 0.3, 0.5});
    CHECK(is_infinite(variance(e, counts)[0])); // squares overflow
    CHECK(is_finite(variance(e, counts)[1]));
}

TEST_CASE("progressive is unbiased; leaving out samples with f = 0, as published code does, is not") {
    // Mean of 100,000 runs within 4 standard errors of 1 / 2, for a step function, that is 0 on half of the
    // domain. A false alarm in 16,000 seeds; the seed is fixed. The published mistake: where f = 0, a sample
    // is skipped, so that -sum alpha_k p_k / D is missing.
    constexpr int runs = 100'000, batches = 4, passes = 3;
    const int counts[] = {1, 1, 0}; // uniform and linear
    const auto deviation = [&](bool skips, double growth) {
        generator g(14);
        statistics means;
        for (int run = 0; run < runs; ++run) {
            progressive<sampled> p;
            const auto add = [&](const auto& f, const auto& q) {
                if (skips && f[0] == 0)
                    p.sums.add(f, q);
                else
                    p.add(f, q);
            };
            for (int batch = 0; batch < batches; ++batch) {
                for (int pass = 0; pass < passes; ++pass)
                    make_pass(g, counts, add, [&](int i) { p.add_outside(i); });
                end_batch(p, counts, passes, {growth, 0});
            }
            means.see(integral(p)[0]);
        }
        std::printf("progressive%s, growth %g: %.5f, %.2f standard errors\n",
                    skips ? " with the mistake" : "", growth, means.mean(), means.deviation(0.5));
        return means.deviation(0.5);
    };
    CHECK(deviation(false, 2) <= 4);
    CHECK(deviation(false, 1) <= 4);
    CHECK(deviation(true, 2) > 4);
}

TEST_CASE("progressive with draws outside is unbiased, dynamic too; without them it is not") {
    const int counts[] = {0, 1, 2}; // with technique 0, the leaving one would be superfluous
    const auto deviation = [&](bool skips) {
        generator g(15);
        statistics means;
        for (int run = 0; run < 20'000; ++run) {
            progressive<dynamic> p(sampled);
            for (int batch = 0; batch < 4; ++batch) {
                for (int pass = 0; pass < 4; ++pass)
                    make_pass(
                        g, counts, [&](const auto& f, const auto& q) { p.add(f, q); },
                        [&](int i) { skips ? p.sums.add_outside(i) : p.add_outside(i); });
                end_batch(p, counts, 4, {2, 0});
            }
            means.see(integral(p)[0]);
        }
        std::printf("progressive with draws outside%s: %.2f standard errors\n", skips ? ", left out" : "",
                    means.deviation(0.5));
        return means.deviation(0.5);
    };
    CHECK(deviation(false) <= 4);
    CHECK(deviation(true) > 4);
}

TEST_CASE("progressive written out: batches, their alpha, and the schedule") {
    generator g(16);
    const int counts[] = {2, 1, 3};
    for (const auto& [growth, least_draws] : {std::pair(1.0, 0.0), std::pair(2.0, 0.0), std::pair(3.0, 0.0),
                                              std::pair(2.0, -1.0), std::pair(1.0, 60.0)}) {
        progressive<sampled> p;
        estimator<sampled> all;
        std::array<std::array<double, sampled>, 3> alpha{};
        real total[3] = {};
        double solved_at = 0, passes = 0;
        for (int batch = 0; batch < 12; ++batch) {
            for (int pass = 0; pass < 2; ++pass) {
                for (std::size_t c = 0; c < 3; ++c)
                    for (double a : alpha[c])
                        total[c] += static_cast<real>(a);
                make_pass(
                    g, counts,
                    [&](const auto& f, const double* q) {
                        double u[sampled], value[3];
                        mis::weights(mis::balance, q, sampled, u);
                        for (std::size_t c = 0; c < 3; ++c) {
                            real rest = static_cast<real>(f[c]);
                            for (std::size_t k = 0; k < sampled; ++k)
                                rest -= static_cast<real>(alpha[c][k]) * q[k] / counts[k];
                            total[c] += rest / (static_cast<real>(q[0]) + q[1] + q[2]);
                            value[c] = f[c] / (q[0] + q[1] + q[2]);
                        }
                        all.add(f, q);
                        if (batch % 2 == 0)
                            p.add(f, q);
                        else
                            p.add_weighted(value, u);
                    },
                    [&](int i) {
                        for (std::size_t c = 0; c < 3; ++c)
                            total[c] -= static_cast<real>(alpha[c][static_cast<std::size_t>(i)]) / counts[i];
                        all.add_outside(i);
                        p.add_outside(i);
                    });
            }
            end_batch(p, counts, 2, {growth, least_draws});
            passes += 2;
            const double draws_needed = least_draws < 0 ? 16 * sampled : least_draws;
            if (6 * passes >= draws_needed && passes >= growth * solved_at)
                alpha = coefficients(all, counts), solved_at = passes;
            CHECK(p.passes_at_solve == solved_at);
            for (std::size_t c = 0; c < 3; ++c)
                CHECK(integral(p)[c] == doctest::Approx(double(total[c] / passes)).epsilon(1e-10));
        }
    }
}

TEST_CASE("progressive: forks of a batch merged are the batch, and runs merged are their mean") {
    generator g(17);
    const int counts[] = {1, 2, 1};
    progressive<sampled> one, threads, other;
    for (int batch = 0; batch < 5; ++batch) {
        auto first = fork(threads), second = fork(threads);
        CHECK(draws(first.sums) == 0);
        generator g1 = g;
        for (int pass = 0; pass < 4; ++pass)
            make_pass(g1, counts, pass % 2 == 0 ? first : second);
        for (int pass = 0; pass < 4; ++pass)
            make_pass(g, counts, one);
        threads += second, threads += first;
        CHECK(threads.open);
        end_batch(one, counts, 4, {2, 0}), end_batch(threads, counts, 4, {2, 0});
        for (std::size_t c = 0; c < 3; ++c)
            CHECK(integral(threads)[c] == doctest::Approx(integral(one)[c]).epsilon(1e-10));
    }
    for (int batch = 0; batch < 3; ++batch) {
        for (int pass = 0; pass < 10; ++pass)
            make_pass(g, counts, other);
        end_batch(other, counts, 10, {2, 0});
    }
    const auto f1 = integral(one), f2 = integral(other);
    one += other;
    CHECK(one.passes == 50);
    CHECK(draws(one.sums) == doctest::Approx(200));
    for (std::size_t c = 0; c < 3; ++c)
        CHECK(integral(one)[c] == doctest::Approx((f1[c] * 20 + f2[c] * 30) / 50).epsilon(1e-12));
}
