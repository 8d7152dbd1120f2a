// Estimators of a one-dimensional integral by two techniques, for the studies of heuristics: each technique
// alone, constant weights, the heuristics, optimal weights; their variances by quadrature and by simulation.
// A pass takes one sample of each technique, or two of one.
#pragma once

#include "optimal_model.hpp"
#include "study.hpp"

namespace studies {

// What a sample adds to the estimate of a pass: of technique i, at a place where f and the densities p are
// known.
struct estimator {
    std::string name;
    double (*contribution)(const exact& known, double f, const double* p, int i);
    std::array<int, 2> techniques{0, 1}; // of the two samples
};

template <std::size_t Heuristic> double by_heuristic(const exact&, double f, const double* p, int i) {
    return heuristic_weights(p, 2, i)[Heuristic] * f / p[i];
}
inline double by_half(const exact&, double f, const double* p, int i) { return f / p[i] / 2; }
// [O]: the integral of the part that the densities span is known, only the rest is sampled.
inline double optimal(const exact& known, double f, const double* p, int) {
    return (f - known.alpha[0] * p[0] - known.alpha[1] * p[1]) / (p[0] + p[1]) + known.alpha.sum() / 2;
}

inline const estimator estimators[] = {
    {"first alone", by_half, {0, 0}}, {"second alone", by_half, {1, 1}},  {"constant 1/2", by_half},
    {"average", by_heuristic<0>},     {"balance", by_heuristic<balance>}, {"power", by_heuristic<power>},
    {"cutoff", by_heuristic<cutoff>}, {"maximum", by_heuristic<maximum>}, {"optimal", optimal},
};

// What a sample x of technique i adds; 0 where there is none, but a quadrature comes by.
inline double contribution(const estimator& e, const setup& s, const exact& known, double x, int i) {
    const double p[] = {value_at(s.techniques[0], x), value_at(s.techniques[1], x)};
    return p[i] > 0 ? e.contribution(known, value_at(s.f, x), &p[0], i) : 0;
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

inline moments of_pass(const estimator& e, const setup& s, const exact& known, double from, double to) {
    return of_sum(by_quadrature(e, s, known, from, to, e.techniques[0]),
                  by_quadrature(e, s, known, from, to, e.techniques[1]));
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
    double sum = 0;
    for (int pass = 0; pass < passes; ++pass) {
        if (pass % 100'000 == 0)
            show_progress(text("%s, %s: %d of %d passes", s.name.c_str(), e.name.c_str(), pass, passes));
        double off = -known.integral;
        for (const int i : e.techniques)
            off += contribution(e, s, known, sample(s.techniques[static_cast<std::size_t>(i)], rng), i);
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

// ---- The command line of such a study ----

struct pass_options : common_options {
    int passes;
};

// Parses it and runs the study, as run_study does; run(options) tells whether all checks pass.
template <class Run>
int run_with_passes(const std::string& what, int passes, int count, char** arguments, Run&& run) {
    pass_options o{{}, passes};
    command_line app(what, o);
    app.add("--passes", o.passes, "simulated for each variance", 1000, 1'000'000'000);
    return run_study(app, o, count, arguments, run);
}

} // namespace studies
