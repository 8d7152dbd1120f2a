// Study: the sum of two Gaussians, of which each technique samples one: the example of the lecture of
// Křivánek and Vorba [K]. What each technique alone, constant weights and the heuristics make of it:
// variances by quadrature beside those of a simulation, where a simulation can see them. Writes gaussians.csv
// and gaussians_curves.csv; gaussians.gp draws them. docs/heuristics.md tells what it shows.
#include "two_techniques.hpp"

namespace {

using namespace studies;

setup gaussians(const std::string& name, double apart, double first_share) {
    using kind = shape::kind;
    const shape first{kind::gaussian, -apart, 4}, second{kind::gaussian, apart, 4};
    return {name, {{first_share, first}, {1 - first_share, second}}, {{{1, first}}, {{1, second}}}};
}

bool study(const setup& s, const pass_options& o, pcg32& rng, csv_file& csv, csv_file& curves) {
    const double from = -80, to = 80;
    const exact known = integrate(s, from, to);
    std::printf("%s\n", s.name.c_str());
    bool good = true;
    for (const estimator& e : estimators) {
        const comparison c = compare(e, s, known, from, to, o.passes, rng);
        good &= report_comparison(e, c) && std::fabs(c.exact.mean - 1) < 1e-6;
        csv.add(text("%s,%s,%.6g,%.6g,%.3g,%d", s.name.c_str(), e.name.c_str(), c.exact.variance, c.measured,
                     c.error, c.is_seen ? 1 : 0));
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

bool run(const pass_options& o) {
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
    return run_with_passes(
        "Variances of heuristics where each technique samples one of two Gaussians; writes "
        "gaussians.csv and gaussians_curves.csv.",
        1'000'000, count, arguments, run);
}
