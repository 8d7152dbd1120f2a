// SPDX-License-Identifier: MIT
#include "ulp.hpp"

#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <doctest/doctest.h>
#include <mis/optimal/allocation.hpp>
#include <new>
#include <vector>

using namespace test;

namespace {
std::atomic<int> news{0};
}
void* operator new(std::size_t size) {
    ++news;
    if (void* p = std::malloc(size > 0 ? size : 1))
        return p;
    std::abort();
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace {

using numbers = std::vector<double>;

// A problem on a domain of cells, on which integrals are sums, in long double, and everything is known.
struct problem {
    std::vector<numbers> p; // of technique k in cell x; what is missing of 1 is outside the domain
    numbers f;

    int techniques() const { return static_cast<int>(p.size()); }
    std::size_t cells() const { return f.size(); }
    long double at(std::size_t k, std::size_t x) const { return static_cast<long double>(p[k][x]); }
    double integral() const {
        long double sum = 0;
        for (const double y : f)
            sum += static_cast<long double>(y);
        return static_cast<double>(sum);
    }
};

double gaussian(double x, double mean, double deviation) {
    const double z = (x - mean) / deviation;
    return std::exp(-z * z / 2);
}

numbers normalized(numbers p, double sum = 1) {
    double total = 0;
    for (const double x : p)
        total += x;
    for (double& x : p)
        x *= sum / total;
    return p;
}

template <class F> numbers over_cells(int cells, F&& f) {
    numbers all;
    for (int i = 0; i < cells; ++i)
        all.push_back(f((i + 0.5) / cells));
    return all;
}

// Peaks that one technique finds, or the other, or several share.
std::vector<problem> known_problems() {
    const auto density = [](double mean, double deviation, double even) {
        return normalized(over_cells(120, [&](double x) { return gaussian(x, mean, deviation) + even; }));
    };
    const auto two_peaks = over_cells(
        120, [](double x) { return gaussian(x, 0.35, 0.06) + 2 * gaussian(x, 0.65, 0.09) + 0.02; });
    const auto one_peak = over_cells(120, [](double x) { return gaussian(x, 0.4, 0.03) + 0.03 * x; });
    const auto changing =
        over_cells(120, [](double x) { return gaussian(x, 0.3, 0.1) - 0.6 * gaussian(x, 0.7, 0.1); });
    const auto rising = normalized(over_cells(120, [](double x) { return x; }));
    const auto even = normalized(numbers(120, 1.0));
    return {{{density(0.35, 0.08, 0.01), density(0.65, 0.08, 0.01)}, two_peaks},
            {{density(0.4, 0.03, 0.02), even}, one_peak},
            {{even, rising}, two_peaks},
            {{density(0.3, 0.15, 0.02), density(0.7, 0.15, 0.02)}, changing},
            {{density(0.35, 0.07, 0), even, density(0.65, 0.12, 0)}, two_peaks},
            {{density(0.3, 0.1, 0), density(0.7, 0.1, 0), even}, changing}};
}

// The variance of an estimate that adds f / D for N_k samples of each technique, by its definition.
template <class Counts> double variance_of_balance(const problem& s, const Counts& n) {
    long double sum = 0;
    for (std::size_t k = 0; k < s.p.size(); ++k) {
        long double square = 0, mean = 0;
        for (std::size_t x = 0; x < s.cells(); ++x) {
            long double d = 0;
            for (std::size_t i = 0; i < s.p.size(); ++i)
                d += static_cast<long double>(n[i]) * s.at(i, x);
            if (!(s.p[k][x] > 0 && n[k] > 0))
                continue;
            const long double added = static_cast<long double>(s.f[x]) / d;
            square += added * added * s.at(k, x);
            mean += added * s.at(k, x);
        }
        sum += static_cast<long double>(n[k]) * (square - mean * mean);
    }
    return static_cast<double>(sum);
}

// The same with the best alpha: by what alpha has to be orthogonal to, and elimination with the largest
// pivot. Draws outside are cells with f = 0 of one technique.
template <class Counts> double variance_of_optimal(const problem& s, const Counts& n) {
    const std::size_t m = s.p.size();
    std::vector<std::vector<long double>> a(m, std::vector<long double>(m + 1, 0));
    long double squares = 0;
    const auto add = [&](long double f, const std::vector<long double>& p) {
        long double d = 0;
        for (std::size_t k = 0; k < m; ++k)
            d += static_cast<long double>(n[k]) * p[k];
        if (!(d > 0))
            return;
        squares += f * f / d;
        for (std::size_t k = 0; k < m; ++k) {
            for (std::size_t l = 0; l < m; ++l)
                a[k][l] += p[k] * p[l] / d;
            a[k][m] += f * p[k] / d;
        }
    };
    std::vector<long double> inside(m, 0);
    for (std::size_t x = 0; x < s.cells(); ++x) {
        std::vector<long double> p(m);
        for (std::size_t k = 0; k < m; ++k) {
            p[k] = n[k] > 0 ? s.at(k, x) : 0;
            inside[k] += p[k];
        }
        add(static_cast<long double>(s.f[x]), p);
    }
    for (std::size_t k = 0; k < m; ++k) {
        std::vector<long double> p(m, 0);
        p[k] = n[k] > 0 && inside[k] < 1 - 1e-12L ? 1 - inside[k] : 0;
        add(0, p);
    }
    long double explained = 0; // b . alpha, as the pivots find it
    std::vector<bool> done(m, false);
    for (std::size_t round = 0; round < m; ++round) {
        std::size_t pivot = m;
        for (std::size_t k = 0; k < m; ++k)
            if (!done[k] && (pivot == m || a[k][k] > a[pivot][pivot]))
                pivot = k;
        if (!(a[pivot][pivot] > 1e-16L))
            break;
        done[pivot] = true;
        explained += a[pivot][m] * a[pivot][m] / a[pivot][pivot];
        for (std::size_t k = 0; k < m; ++k) {
            if (done[k])
                continue;
            const long double factor = a[k][pivot] / a[pivot][pivot];
            for (std::size_t l = 0; l <= m; ++l)
                a[k][l] -= factor * a[pivot][l];
        }
        for (std::size_t k = 0; k < m; ++k)
            if (!done[k])
                a[k][pivot] = 0;
    }
    return static_cast<double>(squares - explained);
}

// All of a problem as a pilot: its integrals are exact.
template <int M = mis::dynamic> mis::pilot<M> all_of(const problem& s) {
    mis::pilot<M> all(s.techniques());
    for (std::size_t x = 0; x < s.cells(); ++x) {
        numbers densities;
        for (const numbers& p : s.p)
            densities.push_back(p[x]);
        all.add(s.f[x], densities, 1);
    }
    for (int k = 0; k < s.techniques(); ++k) {
        double inside = 0;
        for (const double p : s.p[static_cast<std::size_t>(k)])
            inside += p;
        if (inside < 1 - 1e-12)
            all.add_outside(k, 1, 1 - inside);
    }
    all.passes = 1;
    all.is_quadrature = true;
    return all;
}

std::size_t draw(const numbers& p, generator& g) { // cells(): outside
    double u = g.uniform();
    for (std::size_t x = 0; x < p.size(); ++x)
        if ((u -= p[x]) < 0)
            return x;
    return p.size();
}

// Samples of all techniques, as many of each.
mis::pilot<mis::dynamic> samples_of(const problem& s, int passes, generator& g) {
    mis::pilot<mis::dynamic> some(s.techniques());
    for (int pass = 0; pass < passes; ++pass)
        for (int k = 0; k < s.techniques(); ++k) {
            const std::size_t x = draw(s.p[static_cast<std::size_t>(k)], g);
            if (x == s.cells()) {
                some.add_outside(k, 1);
                continue;
            }
            numbers densities;
            double q = 0;
            for (const numbers& p : s.p) {
                densities.push_back(p[x]);
                q += p[x];
            }
            some.add(s.f[x], densities, q);
        }
    some.passes = passes;
    return some;
}

numbers counts_of(const mis::allocation<mis::dynamic>& a) { return a.counts.number; }

// All shares of a budget in steps, one after the other.
template <class Visit> void for_each_share(int m, int steps, const Visit& visit) {
    numbers shares(static_cast<std::size_t>(m));
    const auto fill = [&](const auto& self, int k, int left) -> void {
        if (k == m - 1) {
            shares[static_cast<std::size_t>(k)] = left / double(steps);
            visit(shares);
            return;
        }
        for (int i = 0; i <= left; ++i) {
            shares[static_cast<std::size_t>(k)] = i / double(steps);
            self(self, k + 1, left - i);
        }
    };
    fill(fill, 0, steps);
}
numbers to_counts(const numbers& shares, const numbers& costs, double budget) {
    numbers n;
    for (std::size_t k = 0; k < shares.size(); ++k)
        n.push_back(budget * shares[k] / costs[k]);
    return n;
}
numbers equal_counts(const numbers& costs, double budget) { // as many samples of each
    double sum = 0;
    for (const double c : costs)
        sum += c;
    return numbers(costs.size(), budget / sum);
}

template <class Variance>
double best_of_grid(const problem& s, const numbers& costs, double budget, const Variance& variance) {
    double best = 1e300;
    for_each_share(s.techniques(), s.techniques() == 2 ? 500 : 50, [&](const numbers& shares) {
        const numbers n = to_counts(shares, costs, budget);
        bool covered = true;
        for (std::size_t x = 0; x < s.cells(); ++x) {
            double d = 0;
            for (std::size_t k = 0; k < s.p.size(); ++k)
                d += n[k] * s.p[k][x];
            covered = covered && (d > 0 || !(std::fabs(s.f[x]) > 0));
        }
        if (covered)
            best = std::min(best, variance(s, n));
    });
    return best;
}

numbers costs_of(int m, double ratio, bool first_is_dear) {
    numbers c;
    for (int k = 0; k < m; ++k)
        c.push_back(std::pow(ratio, double(first_is_dear ? m - 1 - k : k) / (m - 1)));
    return c;
}

problem random_problem(generator& g, int m, int cells, bool with_signs) {
    problem s{{}, numbers(static_cast<std::size_t>(cells))};
    for (double& y : s.f)
        y = (with_signs && g.chance(0.5) ? -1 : 1) * g.log_uniform<double>(-2, 1) * (g.chance(0.1) ? 0 : 1);
    for (int k = 0; k < m; ++k) {
        numbers p(static_cast<std::size_t>(cells));
        for (double& x : p)
            x = k > 0 && g.chance(0.3) ? 0 : g.log_uniform<double>(-2, 1);
        s.p.push_back(normalized(p, g.chance(0.3) ? g.uniform(0.3, 1) : 1.0));
    }
    return s;
}

// Makes its samples anew each time.
struct on_the_fly {
    static constexpr int techniques = 2, channels = 1;
    const problem* s;
    double passes = 1, importance = 1;
    bool is_quadrature = true;
    std::array<double, 2> outside{};

    int size() const { return 2; }
    template <class Visit> void for_each(const Visit& visit) const {
        for (std::size_t x = 0; x < s->cells(); ++x) {
            const double sum = s->p[0][x] + s->p[1][x];
            const double u[]{s->p[0][x] / sum, s->p[1][x] / sum};
            visit(&u[0], 1 / sum, &s->f[x]);
        }
    }
};

} // namespace

namespace {

// Greatest errors of a variance of counts, relative to its second moment: of the value and its gradient, by
// an oracle and its central differences, and of the Hessian, by the gradient's.
struct derivative_errors {
    double value = 0, gradient = 0, hessian = 0;

    template <class At, class Oracle> void see(const At& at, const Oracle& oracle, const numbers& n) {
        const auto d = at(n);
        value = std::max(value, std::fabs(d.value - oracle(n)) / d.second_moment);
        for (std::size_t k = 0; k < n.size(); ++k) {
            const double h = 1e-4 * n[k], scale = d.second_moment / n[k];
            numbers more = n, less = n;
            more[k] += h, less[k] -= h;
            const double slope = (oracle(more) - oracle(less)) / (2 * h);
            gradient = std::max(gradient, std::fabs(d.gradient[static_cast<int>(k)] - slope) / scale);
            const auto up = at(more), down = at(less);
            for (std::size_t l = 0; l < n.size(); ++l) {
                const int i = static_cast<int>(l);
                const double bend = (up.gradient[i] - down.gradient[i]) / (2 * h);
                hessian = std::max(hessian, std::fabs(d.hessian[static_cast<int>(k * n.size() + l)] - bend) /
                                                scale * n[l]);
            }
        }
    }
    void check() const {
        CHECK(value <= 1e-12);
        CHECK(gradient <= 1e-6);
        CHECK(hessian <= 1e-6);
    }
};

numbers random_counts(generator& g, int m) {
    numbers n(static_cast<std::size_t>(m));
    for (double& x : n)
        x = g.log_uniform<double>(-1, 2);
    return n;
}

} // namespace

TEST_CASE("variance of counts: the definition's; gradient and Hessian: its central differences") {
    generator g(51);
    derivative_errors worst;
    for (int sample = 0; sample < 300; ++sample) {
        const problem s = random_problem(g, g.integer(1, 5), 30, true);
        const numbers n = random_counts(g, s.techniques());
        const auto all = all_of(s);
        worst.see([&](const numbers& counts) { return mis::variance_of_counts(all, counts); },
                  [&](const numbers& counts) { return variance_of_balance(s, counts); }, n);
        worst.see([&](const numbers& counts) { return mis::optimal::variance_of_counts(all, counts); },
                  [&](const numbers& counts) { return variance_of_optimal(s, counts); }, n);
    }
    std::printf("largest errors relative to the second moment: variance %.2g, gradient %.2g, Hessian %.2g\n",
                worst.value, worst.gradient, worst.hessian);
    worst.check();
}

TEST_CASE("simulation tells the formula from the printed one, which has a factor n too many") {
    const problem s = known_problems()[0];
    const numbers n{3, 2};
    const auto d = mis::variance_of_counts(all_of(s), n);
    const double means = d.second_moment - d.value, printed = 2 * d.second_moment - means;
    generator g(52);
    constexpr int estimates = 200'000;
    double squares = 0, fourths = 0;
    for (int e = 0; e < estimates; ++e) {
        double off = -s.integral();
        for (std::size_t k = 0; k < 2; ++k)
            for (int i = 0; i < static_cast<int>(n[k]); ++i) {
                const std::size_t x = draw(s.p[k], g);
                off += s.f[x] / (n[0] * s.p[0][x] + n[1] * s.p[1][x]);
            }
        squares += off * off / estimates;
        fourths += off * off * off * off / estimates;
    }
    const double error = std::sqrt((fourths - squares * squares) / estimates);
    std::printf("variance %.5g, as printed %.5g; simulated %.5g +- %.2g\n", d.value, printed, squares, error);
    CHECK(std::fabs(squares - d.value) <= 4.5 * error); // 7 of a million seeds would fail
    CHECK(printed > squares + 100 * error);
}

TEST_CASE("exact integrals: the found counts are as good as the best of a grid") {
    for (const problem& s : known_problems())
        for (const double ratio : {1.0, 3.0, 10.0, 100.0})
            for (const bool first_is_dear : {false, true}) {
                const numbers costs = costs_of(s.techniques(), ratio, first_is_dear);
                const auto all = all_of(s);
                const auto balance = mis::allocate(all, costs, 7);
                const auto optimal = mis::optimal::allocate(all, costs, 7);
                CAPTURE(ratio);
                CHECK(balance.converged);
                CHECK(optimal.converged);
                CHECK(variance_of_balance(s, counts_of(balance)) <=
                      (1 + 1e-6) * best_of_grid(s, costs, 7, variance_of_balance<numbers>));
                const double found = variance_of_optimal(s, counts_of(optimal));
                const double optimal_moment = // what rounding is measured by
                    mis::variance_of_counts(all, counts_of(optimal)).second_moment;
                CHECK(found <= (1 + 1e-6) * best_of_grid(s, costs, 7, variance_of_optimal<numbers>) +
                                   1e-13 * optimal_moment);
                CHECK(std::fabs(found - optimal.variance) <= 1e-7 * found + 1e-12 * optimal_moment);
                for (const auto* a : {&balance, &optimal}) {
                    double spent = 0;
                    for (int k = 0; k < s.techniques(); ++k)
                        spent += costs[static_cast<std::size_t>(k)] * a->counts[k];
                    CHECK(std::fabs(spent / 7 - 1) <= 1e-12);
                }
            }
}

TEST_CASE("1000 pilot samples: within 1 % of the best, and no worse than equal counts") {
    generator g(53);
    double worst_median = 0, worst = 0;
    for (const problem& s : known_problems())
        for (const double ratio : {1.0, 30.0}) {
            const numbers costs = costs_of(s.techniques(), ratio, true);
            const double best = best_of_grid(s, costs, 7, variance_of_balance<numbers>);
            const double equal = variance_of_balance(s, equal_counts(costs, 7));
            numbers over;
            for (int seed = 0; seed < 100; ++seed) {
                const auto a = mis::allocate(samples_of(s, 1000 / s.techniques(), g), costs, 7);
                const double found = variance_of_balance(s, counts_of(a));
                over.push_back(found / best);
                worst = std::max(worst, found / equal);
            }
            std::nth_element(over.begin(), over.begin() + 50, over.end());
            worst_median = std::max(worst_median, over[50]);
        }
    std::printf("over the best: median of 100 seeds %.4f; over equal counts, worst of all: %.4f\n",
                worst_median, worst);
    CHECK(worst_median <= 1.01);
    CHECK(worst <= 1.02);
}

TEST_CASE("the certificate bounds how much better any counts are, in every run, stopped early or not") {
    generator g(54);
    double closest = 1e300;
    for (int sample = 0; sample < 60; ++sample) {
        const problem s = random_problem(g, g.integer(2, 3), 20, true);
        const numbers costs = costs_of(s.techniques(), g.log_uniform<double>(0, 4), g.chance(0.5));
        mis::allocation_options options;
        options.most_iterations = g.integer(0, 4);
        const auto a = mis::optimal::allocate(all_of(s), costs, 5, options);
        const double found = variance_of_optimal(s, counts_of(a));
        const double best = best_of_grid(s, costs, 5, variance_of_optimal<numbers>);
        CHECK(a.gap >= 0);
        CHECK(found - a.gap <= best + 1e-10 * found);
        if (options.most_iterations == 0 && a.gap > 0)
            closest = std::min(closest, (best - (found - a.gap)) / found);
    }
    CHECK(closest < 0.5); // it is no empty bound
}

TEST_CASE("up to 32 techniques, any start, costs to 1e4: converges, useless techniques get exactly 0") {
    generator g(55);
    int most = 0;
    for (int sample = 0; sample < 40; ++sample) {
        const int m = sample % 4 == 0 ? 32 : g.integer(3, 16);
        problem s = random_problem(g, m, 60, true);
        const auto last = static_cast<std::size_t>(m - 1);
        s.p[1] = s.p[0];              // a duplicate
        s.p[last] = numbers(60, 0.0); // never where f is: all draws are outside
        numbers costs;
        for (int k = 0; k < m; ++k)
            costs.push_back(g.log_uniform<double>(0, 4));
        costs[1] = 2 * costs[0]; // and a dearer one, so that it is useless, too
        const auto all = all_of(s);
        double least = 1e300, largest = 0;
        for (int start = 0; start < 6; ++start) {
            numbers shares(static_cast<std::size_t>(m));
            for (double& x : shares)
                x = start == 0 ? 0 : g.log_uniform<double>(-12, 0);
            if (start == 1)
                shares = numbers(static_cast<std::size_t>(m), 0.0), shares[last] = 1;
            const auto a = mis::optimal::allocate(all, costs, 1e4, {}, shares.data());
            CHECK(a.converged);
            CHECK(!(a.counts[1] > 0));
            CHECK(!(a.counts[m - 1] > 0));
            for (int k = 0; k < m; ++k)
                CHECK((a.counts[k] >= 0 && a.counts[k] <= 1e4));
            least = std::min(least, a.variance);
            largest = std::max(largest, a.variance);
            most = std::max(most, a.iterations);
        }
        CHECK(largest <= least * (1 + 3e-7));
        const auto balance = mis::allocate(all, costs, 1e4);
        CHECK(balance.converged);
        CHECK(!(balance.counts[m - 1] > 0));
        CHECK(!(balance.counts[1] > 0));
        CHECK(least <= balance.variance * (1 + 1e-9));
    }
    std::printf("iterations at most: %d\n", most);
}

TEST_CASE("projected gradient steps find the same variance") {
    generator g(56);
    for (int sample = 0; sample < 20; ++sample) {
        const problem s = random_problem(g, g.integer(2, 4), 20, false);
        const numbers costs = costs_of(s.techniques(), g.log_uniform<double>(0, 1), true);
        mis::allocation_options slow;
        slow.method = mis::allocation_method::projected_gradient;
        slow.most_iterations = 5000;
        const auto all = all_of(s);
        CHECK(mis::allocate(all, costs, 3, slow).variance ==
              doctest::Approx(mis::allocate(all, costs, 3).variance).epsilon(1e-5));
        const auto a = mis::optimal::allocate(all, costs, 3, slow), b = mis::optimal::allocate(all, costs, 3);
        CHECK(std::fabs(a.variance - b.variance) <= std::max(a.gap, b.gap) + 1e-9 * b.variance);
    }
}

TEST_CASE("no count is 0 where a technique alone covers f, however dear; a least share is kept") {
    problem s{{{0.5, 0.5, 0}, {0, 0.01, 0.99}}, {1, 2, 1e-3}};
    const numbers costs{1, 1e6};
    const auto all = all_of(s);
    for (const auto& a : {mis::allocate(all, costs, 10), mis::optimal::allocate(all, costs, 10)}) {
        CHECK(a.counts[0] > 0);
        CHECK(a.counts[1] > 0);
        CHECK(a.converged);
    }
    s.f[2] = 0; // now it does not matter: the second gets nothing, unless it is asked for
    mis::allocation_options options;
    options.least_share = 0.125;
    const auto none = mis::allocate(all_of(s), costs, 10),
               some = mis::allocate(all_of(s), costs, 10, options),
               most = mis::optimal::allocate(all_of(s), costs, 10, options);
    CHECK(!(none.counts[1] > 0));
    CHECK(some.counts[1] * 1e6 >= 1.25 * (1 - 1e-12));
    CHECK(most.counts[1] * 1e6 >= 1.25 * (1 - 1e-12));
    // Not covered: said, not divided by.
    CHECK(!mis::variance_of_counts(all, numbers{1, 0}).covered);
    CHECK(!mis::optimal::variance_of_counts(all, numbers{0, 1}).covered);
}

TEST_CASE("several integrals and channels are the sum of their variances times importance") {
    generator g(57);
    const problem a = random_problem(g, 3, 20, true), b = random_problem(g, 3, 20, true);
    problem c = a;
    for (double& y : c.f)
        y *= g.uniform(-2, 2);
    const numbers n{2, 3, 1};
    std::array<mis::pilot<mis::dynamic>, 2> tile{all_of(a), all_of(b)};
    tile[1].importance = 9;
    CHECK(mis::variance_of_counts(tile.data(), 2, n).value ==
          doctest::Approx(variance_of_balance(a, n) + 9 * variance_of_balance(b, n)).epsilon(1e-12));
    CHECK(mis::optimal::variance_of_counts(tile.data(), 2, n).value ==
          doctest::Approx(variance_of_optimal(a, n) + 9 * variance_of_optimal(b, n)).epsilon(1e-12));
    mis::pilot<3, 2> channels;
    for (std::size_t x = 0; x < a.cells(); ++x)
        channels.add(std::array<double, 2>{a.f[x], c.f[x]},
                     std::array<double, 3>{a.p[0][x], a.p[1][x], a.p[2][x]}, 1);
    for (int k = 0; k < 3; ++k)
        channels.outside[k] += all_of(a).outside[k];
    channels.passes = 1;
    channels.is_quadrature = true;
    CHECK(mis::variance_of_counts(channels, n).value ==
          doctest::Approx(variance_of_balance(a, n) + variance_of_balance(c, n)).epsilon(1e-12));
    CHECK(mis::optimal::variance_of_counts(channels, n).value ==
          doctest::Approx(variance_of_optimal(a, n) + variance_of_optimal(c, n)).epsilon(1e-12));
}

TEST_CASE("parts of a pilot add up, in any order; the pilot's own estimate") {
    generator g(58);
    const problem s = known_problems()[0];
    const auto a = samples_of(s, 300, g), b = samples_of(s, 200, g);
    auto ab = a, ba = b;
    ab += b;
    ba += a;
    CHECK(ab.samples == a.samples + b.samples);
    CHECK(ab.passes == 500);
    const numbers costs{1, 2};
    CHECK(mis::allocate(ab, costs, 5).variance ==
          doctest::Approx(mis::allocate(ba, costs, 5).variance).epsilon(1e-9));
    CHECK(mis::integral(all_of(s))[0] == doctest::Approx(s.integral()).epsilon(1e-14));
    CHECK(mis::integral(ab)[0] ==
          doctest::Approx((300 * mis::integral(a)[0] + 200 * mis::integral(b)[0]) / 500).epsilon(1e-12));
    CHECK(mis::integral(mis::pilot<2>{})[0] == 0);
}

TEST_CASE("a random pilot: V is that of a sum over pairs of samples, with its derivatives") {
    generator g(61);
    derivative_errors worst;
    for (int run = 0; run < 100; ++run) {
        const problem s = random_problem(g, g.integer(1, 4), 12, true);
        const auto m = static_cast<std::size_t>(s.techniques());
        const int passes = g.integer(1, 4);
        const auto pilot = samples_of(s, passes, g);
        const auto in_pairs = [&](const numbers& n) {
            struct seen {
                std::vector<long double> p;
                long double added, square;
            };
            std::vector<seen> all; // f / (q D), f^2 / (q D), of a pass
            pilot.for_each([&](const double* u, double q, const double* y) {
                seen x{{}, 0, 0};
                long double d = 0;
                for (std::size_t k = 0; k < m; ++k) {
                    x.p.push_back(static_cast<long double>(u[k]));
                    d += static_cast<long double>(n[k]) * x.p.back();
                }
                const auto contribution = static_cast<long double>(y[0]);
                x.added = contribution / d / passes;
                x.square = contribution * contribution * static_cast<long double>(q) / d / passes;
                all.push_back(x);
            });
            long double v = 0;
            for (std::size_t a = 0; a < all.size(); ++a) {
                v += all[a].square;
                for (std::size_t b = 0; b < all.size(); ++b)
                    for (std::size_t k = 0; a != b && k < m; ++k)
                        v -= static_cast<long double>(n[k]) * all[a].p[k] * all[a].added * all[b].p[k] *
                             all[b].added;
            }
            return static_cast<double>(v);
        };
        worst.see([&](const numbers& n) { return mis::variance_of_counts(pilot, n); }, in_pairs,
                  random_counts(g, s.techniques()));
    }
    worst.check();
}

TEST_CASE("pilots of one pass each, however many, do not take a bad technique for a good one") {
    // A peak that the second technique samples perfectly, and the first, which makes the pilots, seldom
    // finds.
    const problem s{{normalized(numbers(100, 1.0)), numbers(100, 0.0)}, numbers(100, 0.0)};
    problem peak = s;
    peak.p[1][7] = 1, peak.f[7] = 1;
    generator g(62);
    std::vector<mis::pilot<2>> pixels(10'000);
    for (auto& pixel : pixels) {
        const std::size_t x = draw(peak.p[0], g);
        pixel.add(peak.f[x], std::array<double, 2>{peak.p[0][x], peak.p[1][x]}, peak.p[0][x]);
        pixel.passes = 1;
    }
    const auto a = mis::allocate(pixels.data(), pixels.size(), numbers{1, 1}, 1);
    CHECK(a.counts[1] > 1 - 1e-6);
    CHECK(a.converged);
    // One sample: the technique that alone could make it gets all.
    mis::pilot<2> single;
    single.add(1, std::array<double, 2>{100, 0}, 1);
    single.passes = 1;
    CHECK(mis::allocate(single, numbers{1, 1}, 1).counts[0] == doctest::Approx(1).epsilon(1e-9));
}

TEST_CASE("a pilot so small that its V is negative: counts for the first integral, not converged") {
    mis::pilot<3> p; // one sample of each technique, all in one place, where the first has nearly all density
    for (int k = 0; k < 3; ++k)
        p.add(1, std::array<double, 3>{0.98, 0.01, 0.01}, 1);
    p.passes = 1;
    CHECK(mis::variance_of_counts(p, numbers{1, 1, 1}).value < 0);
    const auto a = mis::allocate(p, numbers{1, 1, 1}, 3);
    CHECK(!a.converged);
    CHECK(a.counts[0] == doctest::Approx(3).epsilon(1e-9));
    CHECK(a.variance > 0);
}

TEST_CASE("bad costs, budgets, starts, importances and sizes: nothing is spent on them") {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                     infinity = std::numeric_limits<double>::infinity();
    const problem s = known_problems()[0];
    const auto all = all_of(s);
    const numbers costs{1, 2};
    const auto expected = mis::allocate(all, costs, 5);
#ifdef NDEBUG // else asserted
    for (const numbers& bad : {numbers{0, 1}, numbers{nan, 1}, numbers{infinity, 1}, numbers{-1, 1}})
        for (const auto& a : {mis::allocate(all, bad, 5), mis::optimal::allocate(all, bad, 5)}) {
            CHECK(!a.converged);
            CHECK(std::fabs(a.counts[0]) + std::fabs(a.counts[1]) <= 0);
        }
    for (const double bad : {0.0, -1.0, nan, infinity})
        CHECK(!mis::allocate(all, costs, bad).converged);
#endif
    for (const numbers& bad :
         {numbers{nan, 1}, numbers{infinity, 1}, numbers{1e308, 1e308}, numbers{-1, -2}}) {
        const auto a = mis::allocate(all, costs, 5, {}, bad.data());
        CHECK(a.converged);
        CHECK(a.variance == doctest::Approx(expected.variance).epsilon(1e-5));
    }
    // A black pixel, 1 / 0 of importance, among others; and pixels that nothing was ever added to.
    std::vector<mis::pilot<mis::dynamic>> tile(4);
    tile[1] = tile[2] = all;
    tile[2].importance = infinity;
    for (const auto& a : {mis::allocate(tile.data(), tile.size(), costs, 5),
                          mis::optimal::allocate(tile.data(), tile.size(), costs, 5)}) {
        CHECK(a.converged);
        CHECK(a.variance > 0);
    }
    CHECK(mis::allocate(tile.data(), tile.size(), costs, 5).counts[0] ==
          doctest::Approx(expected.counts[0]).epsilon(1e-6));
    // Sums with one without techniques, and with itself.
    mis::pilot<mis::dynamic> sum;
    sum += all;
    sum += sum;
    CHECK(sum.samples == 2 * all.samples);
    CHECK(sum.passes == 2);
    CHECK(mis::integral(sum)[0] == doctest::Approx(s.integral()));
    // In float, what is no number of the type is left out.
    mis::pilot<2, 1, float> f;
    f.add(1.f, std::array<float, 2>{1e-10f, 1e-10f}, 1e30f);
    f.add(1.f, std::array<float, 2>{1e12f, 1e12f}, 1e-38f);
    CHECK(f.left_out == 2);
    CHECK(f.samples == 0);
}

TEST_CASE_TEMPLATE("units do not matter, over the whole range of the scalar", T, float, double) {
    generator g(59);
    const problem s = known_problems()[1];
    const auto pilot_in = [&](T f_unit, T p_unit) {
        mis::pilot<2, 1, T> p;
        for (std::size_t x = 0; x < s.cells(); ++x)
            p.add(T(s.f[x]) * f_unit, std::array<T, 2>{T(s.p[0][x]) * p_unit, T(s.p[1][x]) * p_unit}, p_unit);
        p.passes = 1;
        p.is_quadrature = true;
        return p;
    };
    const numbers costs{1, 2};
    const auto expected = mis::allocate(pilot_in(1, 1), costs, 5);
    constexpr double most = sizeof(T) == 4 ? 33 : 300;
    for (int i = 0; i < 50; ++i) {
        const T unit = g.log_uniform<T>(-most, most);
        const T f = unit * g.log_uniform<T>(-3, 3); // f / p stays a number of T
        const auto found = mis::allocate(pilot_in(f, unit), costs, 5);
        const auto same = mis::optimal::allocate(pilot_in(f, unit), costs, 5);
        CHECK(found.counts[0] == doctest::Approx(expected.counts[0]).epsilon(1e-4));
        CHECK(same.converged);
    }
    // contributions far from 1
    for (const T unit : {g.log_uniform<T>(-most + 3, -most + 4), g.log_uniform<T>(most - 4, most - 3)}) {
        const auto found = mis::allocate(pilot_in(unit, 1), costs, 5);
        CHECK(found.counts[0] == doctest::Approx(expected.counts[0]).epsilon(1e-4));
    }
}

TEST_CASE("what is no number is left out and counted; nothing at all gives equal shares") {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                     infinity = std::numeric_limits<double>::infinity(),
                     tiny = std::numeric_limits<double>::denorm_min();
    using two = std::array<double, 2>;
    const problem s = known_problems()[0];
    auto good = all_of<2>(s), hostile = good;
    hostile.add(nan, two{1, 1}, 1);
    hostile.add(infinity, two{1, 1}, 1);
    hostile.add(-infinity, two{1, 1}, 1);
    hostile.add(1, two{nan, 1}, 1);
    hostile.add(1, two{infinity, 1}, 1);
    hostile.add(1, two{-1, 1}, 1);
    hostile.add(1, two{0, 0}, 1);
    hostile.add(1, two{1, 1}, 0);
    hostile.add(1, two{1, 1}, nan);
    hostile.add(1, two{1, 1}, infinity);
    hostile.add(1, two{1, 1}, -1);
    hostile.add(1, two{1, 1}, tiny);
    hostile.add_relative(1, two{0, 0}, 1);
    hostile.add_relative(nan, two{1, 0}, 1);
    hostile.add_relative(1, two{1, 0}, 0);
    CHECK(hostile.left_out == 15);
    CHECK(hostile.samples == good.samples);
    const numbers costs{1, 1};
    CHECK(mis::allocate(hostile, costs, 5).counts[0] == mis::allocate(good, costs, 5).counts[0]);
    // extreme, but numbers
    hostile.add(1e-300, two{tiny, 1}, 1);
    hostile.add(1, two{1e308, 1e308}, 1e308);
    hostile.add(0, two{tiny, tiny}, tiny);
    hostile.add_relative(0.5, two{1, 0}, 1);
    for (const auto& a : {mis::allocate(hostile, costs, 5), mis::optimal::allocate(hostile, costs, 5)}) {
        CHECK(a.counts[0] + a.counts[1] == doctest::Approx(5).epsilon(1e-12));
        CHECK(a.variance >= 0);
        CHECK(a.converged);
    }
    for (const auto& a : {mis::allocate(mis::pilot<2>{}, two{1, 3}, 6),
                          mis::optimal::allocate(mis::pilot<2>{}, two{1, 3}, 6)}) {
        CHECK(a.counts[0] == doctest::Approx(3));
        CHECK(a.counts[1] == doctest::Approx(1));
        CHECK(a.converged);
    }
}

TEST_CASE("random whole counts have the expected ones as their mean, and the budget") {
    generator g(60);
    for (int sample = 0; sample < 200; ++sample) {
        const int m = g.integer(1, 6);
        numbers n, mean(static_cast<std::size_t>(m), 0.0);
        double sum = 0;
        for (int k = 0; k < m; ++k) {
            n.push_back(g.chance(0.2) ? 0 : g.chance(0.2) ? g.integer(1, 9) : g.log_uniform<double>(-2, 2));
            sum += n.back();
        }
        double off = 0;
        constexpr int steps = 2000; // u on a grid: means are exact but for a step
        for (int i = 0; i < steps; ++i) {
            std::array<int, 6> whole{};
            mis::round_counts(n, m, (i + 0.5) / steps, whole);
            int total = 0;
            for (int k = 0; k < m; ++k) {
                const auto at = static_cast<std::size_t>(k);
                off = std::max(off, std::fabs(whole[at] - n[at]));
                mean[at] += whole[at] / double(steps);
                total += whole[at];
            }
            off = std::max(off, std::fabs(total - sum));
        }
        CHECK(off < 1 + 1e-9);
        for (std::size_t k = 0; k < n.size(); ++k)
            CHECK(std::fabs(mean[k] - n[k]) <= 2.0 / steps);
    }
}

TEST_CASE("the pilot's samples in the image: a fixed share is unbiased, weights over all samples are not") {
    // A pilot of one sample of each technique on three cells, all nine of its outcomes, and what follows from
    // each: counts, rounded at random, so that N_k p_k(x) samples are expected in x.
    const problem s{{{0.7, 0.2, 0.1}, {0.1, 0.3, 0.6}}, {1, 0.2, 3}};
    const numbers costs{1, 3};
    mis::allocation_options options;
    options.least_share = 0.05;
    double by_share = 0, together = 0;
    for (std::size_t x = 0; x < 3; ++x)
        for (std::size_t y = 0; y < 3; ++y) {
            const double probability = s.p[0][x] * s.p[1][y];
            mis::pilot<2> pilot;
            for (const std::size_t at : {x, y})
                pilot.add(s.f[at], std::array<double, 2>{s.p[0][at], s.p[1][at]}, s.p[0][at] + s.p[1][at]);
            pilot.passes = 1;
            const auto n = mis::allocate(pilot, costs, 6, options).counts;
            double later = 0, all = 0;
            constexpr int steps = 1000;
            for (int i = 0; i < steps; ++i) {
                std::array<double, 2> whole{};
                mis::round_counts(n, 2, (i + 0.5) / steps, whole);
                for (std::size_t k = 0; k < 2; ++k)
                    for (std::size_t at = 0; at < 3; ++at) {
                        const double d = n[0] * s.p[0][at] + n[1] * s.p[1][at],
                                     with_pilot = d + s.p[0][at] + s.p[1][at];
                        later += whole[k] * s.p[k][at] * s.f[at] / d / steps;
                        all += whole[k] * s.p[k][at] * s.f[at] / with_pilot / steps;
                    }
            }
            for (const std::size_t at : {x, y})
                all += s.f[at] / ((n[0] + 1) * s.p[0][at] + (n[1] + 1) * s.p[1][at]);
            by_share += probability * (0.25 * mis::integral(pilot)[0] + 0.75 * later);
            together += probability * all;
        }
    std::printf("integral %.6f; by a fixed share %.6f, by weights over all samples %.6f\n", s.integral(),
                by_share, together);
    CHECK(std::fabs(by_share / s.integral() - 1) <= 1e-3); // steps of u
    CHECK(std::fabs(together / s.integral() - 1) >= 0.01);
}

TEST_CASE("techniques, channels and capacity that are known: nothing is allocated") {
    const problem s = known_problems()[0];
    mis::pilot<2, 1, float, 128> p;
    const std::array<double, 2> costs{1, 2};
    const int before = news;
    for (std::size_t x = 0; x < s.cells(); ++x)
        p.add(float(s.f[x]), std::array<float, 2>{float(s.p[0][x]), float(s.p[1][x])}, 1);
    p.passes = 1;
    p.is_quadrature = true;
    const auto a = mis::allocate(p, costs, 5);
    const int after = news;
    CHECK(after == before);
    CHECK(p.samples == 120);
    CHECK(a.variance == doctest::Approx(mis::allocate(all_of(s), costs, 5).variance).epsilon(1e-5));
    for (int i = 0; i < 20; ++i)
        p.add(1.f, std::array<float, 2>{1, 1}, 1);
    CHECK(p.is_full());
    CHECK(p.left_out == 12);
}

TEST_CASE("samples made anew each time can stand for a pilot") {
    const problem s = known_problems()[0];
    CHECK(mis::allocate(on_the_fly{&s}, numbers{1, 2}, 5).variance ==
          doctest::Approx(mis::allocate(all_of(s), numbers{1, 2}, 5).variance).epsilon(1e-10));
}
