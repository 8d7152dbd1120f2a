// Study: the sum of two Gaussians, of which each technique samples one: the example of the lecture of
// Křivánek and Vorba [K]. What each technique alone, constant weights and the heuristics make of it:
// variances by quadrature beside those of a simulation, where a simulation can see them. Writes gaussians.csv
// and gaussians_curves.csv; gaussians.gp draws them. docs/heuristics.md tells what it shows.
#include "optimal_model.hpp"
#include "study.hpp"

namespace {

using namespace studies;

struct options : common_options {
    int passes = 1'000'000;
};

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

const estimator estimators[] = {
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
double contribution(const estimator& e, const setup& s, const exact& known, double x, int i) {
    const double p[] = {value_at(s.techniques[0], x), value_at(s.techniques[1], x)}, f = value_at(s.f, x);
    if (!e.is_optimal)
        return p[i] > 0 ? f * e.factor(&p[0], i, known.alpha) : 0;
    // [O]: the integral of the part that the densities span is known, only the rest is sampled.
    return (f - known.alpha[0] * p[0] - known.alpha[1] * p[1]) / (p[0] + p[1]) + known.alpha.sum() / 2;
}

// Mean, second and fourth central moment of what one pass adds up to: one sample of each technique, or two of
// one.
struct moments {
    double mean = 0, variance = 0, fourth = 0;
};

moments of_sum(const moments& a, const moments& b) {
    return {a.mean + b.mean, a.variance + b.variance, a.fourth + b.fourth + 6 * a.variance * b.variance};
}

moments by_quadrature(const estimator& e, const setup& s, const exact& known, double from, double to, int i) {
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
std::array<int, 2> techniques_of(const estimator& e) {
    if (e.name == "first alone")
        return {0, 0};
    if (e.name == "second alone")
        return {1, 1};
    return {0, 1};
}
// Two samples of one technique are averaged.
double share_of(const estimator& e) { return techniques_of(e)[0] == techniques_of(e)[1] ? 0.5 : 1; }

moments of_pass(const estimator& e, const setup& s, const exact& known, double from, double to) {
    const auto [i, k] = techniques_of(e);
    moments m = of_sum(by_quadrature(e, s, known, from, to, i), by_quadrature(e, s, known, from, to, k));
    const double share = share_of(e);
    return {m.mean * share, m.variance * share * share, m.fourth * share * share * share * share};
}

setup gaussians(const std::string& name, double apart, double first_share) {
    using kind = shape::kind;
    const shape first{kind::gaussian, -apart, 4}, second{kind::gaussian, apart, 4};
    return {name, {{first_share, first}, {1 - first_share, second}}, {{{1, first}}, {{1, second}}}};
}

// Were measured variances normal, one of the 18 rows would fail for 1 seed in 900.
constexpr double standard_errors = 4;

bool study(const setup& s, const options& o, pcg32& rng, csv_file& csv, csv_file& curves) {
    const double from = -80, to = 80;
    const exact known = integrate(s, from, to);
    std::printf("%s\n", s.name.c_str());
    bool good = true;
    for (const estimator& e : estimators) {
        const moments m = of_pass(e, s, known, from, to);
        good &= std::fabs(m.mean - 1) < 1e-6 ||
                report(false, text("%s: the mean is %.9g", e.name.c_str(), m.mean));
        const double share = share_of(e);
        const auto [i, k] = techniques_of(e);
        double sum = 0;
        for (int pass = 0; pass < o.passes; ++pass) {
            if (pass % 100'000 == 0)
                show_progress(
                    text("%s, %s: %d of %d passes", s.name.c_str(), e.name.c_str(), pass, o.passes));
            const auto one = [&](int technique) {
                return contribution(
                    e, s, known, sample(s.techniques[static_cast<std::size_t>(technique)], rng), technique);
            };
            const double off = share * (one(i) + one(k)) - 1;
            sum += off * off;
        }
        const double measured = sum / o.passes;
        const double error = std::sqrt(std::max(0.0, m.fourth - m.variance * m.variance) / o.passes);
        // The simulation's own error must be small, or its rarest samples decide and it tells nothing.
        const bool is_seen = error < 0.1 * m.variance || m.variance < 1e-20;
        const bool is_confirmed = std::fabs(measured - m.variance) <= standard_errors * error + 1e-20;
        const std::string what = text("%-12s  variance %-10.4g  measured %-10.4g ± %.2g", e.name.c_str(),
                                      m.variance, measured, error);
        if (is_seen)
            good &= report(is_confirmed, what);
        else
            note(what + ": out of a simulation's sight");
        csv.add(text("%s,%s,%.6g,%.6g,%.3g,%d", s.name.c_str(), e.name.c_str(), m.variance, measured, error,
                     is_seen ? 1 : 0));
    }
    for (double x = -24; x <= 24; x += 0.25) {
        const double p[] = {value_at(s.techniques[0], x), value_at(s.techniques[1], x)};
        const auto w = heuristic_weights(&p[0], 2, 0);
        std::string line = text("%s,%g,%g,%g,%g", s.name.c_str(), x, value_at(s.f, x), p[0], p[1]);
        for (const double weight : w)
            line += text(",%g", weight);
        // [O]: alpha_i + (f - sum alpha_k p_k) / D, over f / p_i; may be negative or above 1
        const double f = value_at(s.f, x);
        line += text(",%g", p[0] / f *
                                (known.alpha[0] +
                                 (f - known.alpha[0] * p[0] - known.alpha[1] * p[1]) / (p[0] + p[1])));
        curves.add(line);
    }
    return good;
}

bool run(const options& o) {
    csv_file csv(o.output, "gaussians.csv", "setup,estimator,variance,measured,error,seen");
    std::string heading = "setup,x,f,first,second";
    for (const char* name : heuristic_names)
        heading += text(",%s", name);
    csv_file curves(o.output, "gaussians_curves.csv", heading + ",optimal");
    pcg32 rng(o.seed);
    const bool far = study(gaussians("far", 8, 0.5), o, rng, csv, curves);
    const bool near = study(gaussians("near", 3, 0.3), o, rng, csv, curves);
    return far && near;
}

} // namespace

int main(int count, char** arguments) {
    CLI::App app{
        std::string("Variances of heuristics where each technique samples one of two Gaussians; writes "
                    "gaussians.csv and gaussians_curves.csv.\n") +
        exit_statuses};
    options o;
    add_common(app, o);
    add_number(app, "--passes", o.passes, "simulated for each variance", 1000, 1'000'000'000);
    return run_study(app, o, count, arguments, [&] { return run(o); });
}
