// Study: where one technique is nearly perfect by itself, balance is not the best heuristic: Veach's "low
// variance problems" [V97] 9.2.3, [K]. f is a narrow peak; the first technique's density is f but for a share
// of a uniform one, the second is uniform: the smaller the share, the more the first dominates. Variances by
// quadrature beside those of a simulation. Writes low_variance.csv; low_variance.gp draws it.
// docs/heuristics.md tells what it shows.
#include "two_techniques.hpp"

#include <map>

namespace {

using namespace studies;

constexpr double shares[] = {0.1, 0.03, 0.01, 0.003, 0.001, 0.0003, 0.0001};

setup nearly_perfect(double share) {
    using kind = shape::kind;
    const shape peak{kind::gaussian, 0.5, 0.001}, even{kind::uniform, 0, 1};
    return {text("uniform share %g", share), {{1, peak}}, {{{1 - share, peak}, {share, even}}, {{1, even}}}};
}

bool run(const pass_options& o) {
    std::string heading = "share";
    for (const estimator& e : estimators)
        heading += "," + e.name;
    csv_file csv(o.output, "low_variance.csv", heading);
    pcg32 rng(o.seed);
    bool good = true;
    std::map<std::string, double> variance;
    for (const double share : shares) {
        const setup s = nearly_perfect(share);
        const double from = 0, to = 1;
        const exact known = integrate(s, from, to);
        std::printf("%s\n", s.name.c_str());
        std::string line = text("%g", share);
        for (const estimator& e : estimators) {
            const comparison c = compare(e, s, known, from, to, o.passes, rng);
            good &= report_comparison(e, c);
            variance[e.name] = c.exact.variance;
            line += text(",%.6g", c.exact.variance);
        }
        csv.add(line);
    }
    for (const char* other : {"power", "cutoff", "maximum"})
        good &= report(
            variance["balance"] > 3 * variance[other],
            text("where the first is nearly perfect, balance has %.1f times the variance of %s (bar: 3)",
                 variance["balance"] / variance[other], other));
    return good;
}

} // namespace

int main(int count, char** arguments) {
    return run_with_passes(
        "Variances of heuristics where one technique is nearly perfect; writes low_variance.csv.", 300'000,
        count, arguments, run);
}
