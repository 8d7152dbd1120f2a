// Integrals of one dimension, techniques to sample them with, and the variance of every estimator in closed
// form or by quadrature. All techniques make one sample a pass: D = sum p_k.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <mis/heuristic.hpp>
#include <pcg_random.hpp>
#include <random>
#include <string>
#include <vector>

namespace studies {

// A function whose integral is 1.
struct shape {
    enum class kind { uniform, linear, gaussian } of;
    double a, b; // uniform on [a, b]; rises from 0 at a to the end at b; mean and standard deviation
};

inline double value_at(const shape& s, double x) {
    const double width = s.b - s.a, z = (x - s.a) / s.b;
    switch (s.of) {
    case shape::kind::uniform:
        return x >= s.a && x < s.b ? 1 / width : 0;
    case shape::kind::linear:
        return x >= s.a && x < s.b ? 2 * (x - s.a) / (width * width) : 0;
    case shape::kind::gaussian:
        return std::exp(-z * z / 2) * (0.39894228040143268 / s.b);
    }
    return 0;
}

// A sum of shapes: a density if the factors are positive and their sum is 1.
struct part {
    double factor;
    shape of;
};
using mixture = std::vector<part>;

inline double value_at(const mixture& m, double x) {
    double sum = 0;
    for (const part& p : m)
        sum += p.factor * value_at(p.of, x);
    return sum;
}
inline double integral_of(const mixture& m) {
    double sum = 0;
    for (const part& p : m)
        sum += p.factor;
    return sum;
}

// In [0, 1).
inline double uniform(pcg32& rng) { return std::uniform_real_distribution<double>(0, 1)(rng); }

inline double sample(const shape& s, pcg32& rng) {
    const double u = uniform(rng);
    switch (s.of) {
    case shape::kind::uniform:
        return s.a + (s.b - s.a) * u;
    case shape::kind::linear:
        return s.a + (s.b - s.a) * std::sqrt(1 - u); // not at a, where the density is 0
    case shape::kind::gaussian:
        return s.a + s.b * std::sqrt(-2 * std::log(1 - u)) * std::cos(6.2831853071795865 * uniform(rng));
    }
    return 0;
}
inline double sample(const mixture& density, pcg32& rng) {
    std::size_t i = 0;
    if (density.size() > 1)
        for (double u = uniform(rng); i + 1 < density.size() && u >= density[i].factor; ++i)
            u -= density[i].factor;
    return sample(density[i].of, rng);
}

struct setup {
    std::string name;
    mixture f;
    std::vector<mixture> techniques;
    // Where further techniques are superfluous: the counts with which the first two alone have the same D.
    std::array<double, 2> without{};

    bool is_dependent() const { return without[0] > 0; }
};

inline std::vector<setup> all_setups() {
    using kind = shape::kind;
    const shape uniform{kind::uniform, 0, 1}, left{kind::gaussian, 0.35, 0.15},
        right{kind::gaussian, 0.65, 0.15}, rising{kind::linear, 0, 1};
    const mixture two_peaks{{1, {kind::gaussian, 0.35, 0.08}}, {2, {kind::gaussian, 0.65, 0.08}}};
    const mixture both{{0.5, left}, {0.5, right}};
    return {
        {"gaussians", two_peaks, {{{1, left}}, {{1, right}}}},
        {"step", {{1, {kind::uniform, 0.5, 1}}}, {{{1, uniform}}, {{1, rising}}}},
        {"span", {{0.5, uniform}, {2, left}, {1, rising}}, {{{1, uniform}}, {{1, rising}}, {{1, left}}}},
        {"mixture", two_peaks, {{{1, left}}, {{1, right}}, both}, {1.5, 1.5}},
        {"duplicate", two_peaks, {{{1, left}}, {{1, right}}, {{1, left}}}, {2, 1}},
        {"sign",
         {{1, {kind::gaussian, 0.3, 0.1}}, {-0.6, {kind::gaussian, 0.7, 0.1}}},
         {{{1, left}}, {{1, right}}, {{1, uniform}}}},
    };
}

// ---- The heuristics, in the order of their names ----

constexpr std::array<const char*, 5> heuristic_names{"average", "balance", "power", "cutoff", "maximum"};
constexpr std::size_t balance = 1, power = 2, cutoff = 3, maximum = 4;

// The weights of technique i by all heuristics.
inline std::array<double, heuristic_names.size()> heuristic_weights(const double* densities, int count,
                                                                    int i) {
    return {mis::weight(mis::average, densities, count, i), mis::weight(mis::balance, densities, count, i),
            mis::weight(mis::power, densities, count, i), mis::weight(mis::cutoff, densities, count, i),
            mis::weight(mis::maximum, densities, count, i)};
}

// ---- What is known without sampling ----

struct exact {
    double integral, balance_formula, least; // variance of balance by its own formula; of the optimal weights
    std::array<double, heuristic_names.size()> variance; // of a pass
    Eigen::VectorXd alpha;
};

// By midpoints. Outside of the interval next to nothing is left, and cells end where functions jump.
inline exact integrate(const setup& s, double from = -1, double to = 2) {
    constexpr int cells = 3 << 15;
    const int m = static_cast<int>(s.techniques.size());
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(m, m), means = Eigen::MatrixXd::Zero(m, heuristic_names.size());
    Eigen::VectorXd b = Eigen::VectorXd::Zero(m), p(m);
    exact e{integral_of(s.f), 0, 0, {}, {}};
    double squares = 0;
    const double dx = (to - from) / cells;
    for (int cell = 0; cell < cells; ++cell) {
        const double x = from + (cell + 0.5) * dx, f = value_at(s.f, x);
        for (int k = 0; k < m; ++k)
            p[k] = value_at(s.techniques[static_cast<std::size_t>(k)], x);
        const double d = p.sum();
        if (!(d > 0))
            continue;
        a += p * p.transpose() * (dx / d);
        b += p * (f * dx / d);
        squares += f * f * dx / d;
        for (int i = 0; i < m; ++i)
            for (std::size_t h = 0; p[i] > 0 && h < heuristic_names.size(); ++h) {
                const double weighed = heuristic_weights(p.data(), m, i)[h] * f;
                e.variance[h] += weighed * weighed / p[i] * dx;
                means(i, static_cast<int>(h)) += weighed * dx;
            }
    }
    for (std::size_t h = 0; h < heuristic_names.size(); ++h)
        e.variance[h] -= means.col(static_cast<int>(h)).squaredNorm();
    e.balance_formula = squares - b.squaredNorm();
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> decomposition;
    decomposition.setThreshold(1e-10); // above rounding: dependent techniques must be found dependent
    e.alpha = decomposition.compute(a).solve(b);
    e.least = std::max(0.0, squares - e.alpha.dot(b));
    return e;
}

} // namespace studies
