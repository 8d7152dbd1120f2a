// Estimators of a one-dimensional integral by two techniques, for the studies of heuristics: each technique
// alone, constant weights, the heuristics, optimal weights; their variances by quadrature and by simulation.
// A pass takes one sample of each technique, or two of one.
#pragma once

#include "optimal_model.hpp"
#include "study.hpp"

namespace studies {

// What a sample x of one of two techniques is multiplied by: f(x) times it is what is added up.
struct estimator {
    std::string name;
    // of technique i at x with densities p: how much of f, and what is added for each sample (a control
    // variate)
    double (*factor)(const double* p, int i, const Eigen::VectorXd& alpha);
    bool is_optimal = false;
};

template <std::size_t Heuristic> double by_heuristic(const double* p, int i, const Eigen::VectorXd&) {
    return heuristic_weights(p, 2, i)[Heuristic] / p[i];
}
// Two samples of one technique, for which a pass has time.
template <int Technique> double alone(const double* p, int i, const Eigen::VectorXd&) {
    return i == Technique ? 1 / p[i] : 0;
}

inline const estimator estimators[] = {
    {"first alone", alone<0>},
    {"second alone", alone<1>},
    {"constant 1/2", [](const double* p, int i, const Eigen::VectorXd&) { return 0.5 / p[i]; }},
    {"average", by_heuristic<0>},
    {"balance", by_heuristic<balance>},
    {"power", by_heuristic<power>},
    {"cutoff", by_heuristic<cutoff>},
    {"maximum", by_heuristic<maximum>},
    {"optimal", nullptr, true},
};

// What is added for a sample x of technique i; and what once a pass.
inline double contribution(const estimator& e, const setup& s, const exact& known, double x, int i) {
    const double p[] = {value_at(s.techniques[0], x), value_at(s.techniques[1], x)}, f = value_at(s.f, x);
    if (!e.is_optimal)
        return p[i] > 0 ? f * e.factor(&p[0], i, known.alpha) : 0;
    if (!(p[i] > 0)) // where a quadrature comes by, but no sample
        return 0;
    // [O]: the integral of the part that the densities span is known, only the rest is sampled.
    return (f - known.alpha[0] * p[0] - known.alpha[1] * p[1]) / (p[0] + p[1]) + known.alpha.sum() / 2;
}

// Mean, second and fourth central moment of what one pass adds up to: one sample of each technique, or two of
// one.
struct moments {
    double mean = 0, variance = 0, fourth = 0;
};

inline moments of_sum(const moments& a, const moments& b) {
    return {a.mean + b.mean, a.variance + b.variance, a.fourth + b.fourth + 6 * a.variance * b.variance};
}

inline moments by_quadrature(const estimator& e, const setup& s, const exact& known, double from, double to,
                             int i) {
    constexpr int cells = 400'000;
    const double dx = (to - from) / cells;
    moments m;
    for (int pass = 0; pass < 2; ++pass) { // the mean first
        double sum = 0, squares = 0, fourths = 0;
        for (int cell = 0; cell < cells; ++cell) {
            const double x = from + (cell + 0.5) * dx;
            const double probability = value_at(s.techniques[static_cast<std::size_t>(i)], x) * dx;
            const double off = contribution(e, s, known, x, i) - m.mean;
            sum += off * probability;
            squares += off * off * probability;
            fourths += off * off * off * off * probability;
        }
        if (pass == 0)
            m.mean = sum;
        else
            m.variance = squares, m.fourth = fourths;
    }
    return m;
}

// Which techniques a pass takes its two samples from.
inline std::array<int, 2> techniques_of(const estimator& e) {
    if (e.name == "first alone")
        return {0, 0};
    if (e.name == "second alone")
        return {1, 1};
    return {0, 1};
}
// Two samples of one technique are averaged.
inline double share_of(const estimator& e) { return techniques_of(e)[0] == techniques_of(e)[1] ? 0.5 : 1; }

inline moments of_pass(const estimator& e, const setup& s, const exact& known, double from, double to) {
    const auto [i, k] = techniques_of(e);
    moments m = of_sum(by_quadrature(e, s, known, from, to, i), by_quadrature(e, s, known, from, to, k));
    const double share = share_of(e);
    return {m.mean * share, m.variance * share * share, m.fourth * share * share * share * share};
}

// ---- Simulation beside quadrature ----

struct comparison {
    moments exact;
    double measured, error; // variance, and the standard error that the fourth moment predicts for it
    bool is_seen; // the error is small; else a simulation's rarest samples decide, and it tells nothing

    // Were measured variances normal, one in 16,000 would be further off.
    bool is_confirmed() const { return std::fabs(measured - exact.variance) <= 4 * error + 1e-20; }
};

inline comparison compare(const estimator& e, const setup& s, const exact& known, double from, double to,
                          int passes, pcg32& rng) {
    const double share = share_of(e);
    const auto [i, k] = techniques_of(e);
    double sum = 0;
    for (int pass = 0; pass < passes; ++pass) {
        if (pass % 100'000 == 0)
            show_progress(text("%s, %s: %d of %d passes", s.name.c_str(), e.name.c_str(), pass, passes));
        const auto one = [&](int technique) {
            return contribution(e, s, known, sample(s.techniques[static_cast<std::size_t>(technique)], rng),
                                technique);
        };
        const double off = share * (one(i) + one(k)) - known.integral;
        sum += off * off;
    }
    comparison c{of_pass(e, s, known, from, to), sum / passes, 0, false};
    c.error = std::sqrt(std::max(0.0, c.exact.fourth - c.exact.variance * c.exact.variance) / passes);
    c.is_seen = c.error < 0.1 * c.exact.variance || c.exact.variance < 1e-20;
    return c;
}

// One line, and whether simulation and quadrature agree where they can.
inline bool report_comparison(const estimator& e, const comparison& c) {
    const std::string what = text("%-12s  variance %-10.4g  measured %-10.4g ± %.2g", e.name.c_str(),
                                  c.exact.variance, c.measured, c.error);
    if (c.is_seen)
        return report(c.is_confirmed(), what);
    note(what + ": out of a simulation's sight");
    return true;
}

} // namespace studies
