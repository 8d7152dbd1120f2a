// Study: how many samples of each technique, and *multi-sample* against *one-sample* combination [V97] 9.2:
// ten samples, of which each technique takes a fixed number, from 1 and 9 to 9 and 1, or each of which is
// made by a technique picked at random with these probabilities. Variances by quadrature beside those of a
// simulation. Writes splits.csv; splits.gp draws it. docs/heuristics.md tells what it shows.
#include "two_techniques.hpp"

namespace {

using namespace studies;

constexpr int samples = 10;
constexpr double zero = 1e-12; // a variance below is rounding: f may be a sum of the effective densities

struct problem {
    setup s;
    double from, to;
};

std::vector<problem> problems() {
    using kind = shape::kind;
    const shape first{kind::gaussian, -3, 4}, second{kind::gaussian, 3, 4}, peak{kind::gaussian, 0.5, 0.001},
        even{kind::uniform, 0, 1};
    return {{{"gaussians", {{0.3, first}, {0.7, second}}, {{{1, first}}, {{1, second}}}}, -80, 80},
            {{"low variance", {{1, peak}}, {{{0.99, peak}, {0.01, even}}, {{1, even}}}}, 0, 1}};
}

// What a sample of technique i adds, of which there are n_i: fixed, or expected.
double contribution(const setup& s, std::size_t heuristic, const std::array<double, 2>& n, double x, int i) {
    const auto own = static_cast<std::size_t>(i);
    const double p[] = {value_at(s.techniques[0], x), value_at(s.techniques[1], x)};
    const double q[] = {n[0] * p[0], n[1] * p[1]};
    return p[own] > 0 ? heuristic_weights(&q[0], 2, i)[heuristic] * value_at(s.f, x) / q[own] : 0;
}

// Mean, square, cube and fourth power of what a sample adds.
using raw_moments = std::array<double, 4>;

moments central(const raw_moments& r) {
    const double m = r[0];
    return {m, r[1] - m * m, r[3] - 4 * m * r[2] + 6 * m * m * r[1] - 3 * m * m * m * m};
}

std::array<raw_moments, 2> integrate(const problem& at, std::size_t heuristic,
                                     const std::array<double, 2>& n) {
    constexpr int cells = 100'000;
    const double dx = (at.to - at.from) / cells;
    std::array<raw_moments, 2> all{};
    for (std::size_t i = 0; i < 2; ++i)
        for (int cell = 0; cell < cells; ++cell) {
            const double x = at.from + (cell + 0.5) * dx;
            const double value = contribution(at.s, heuristic, n, x, static_cast<int>(i));
            double power_of = value_at(at.s.techniques[i], x) * dx;
            for (double& sum : all[i])
                sum += power_of *= value;
        }
    return all;
}

// Of all samples: fixed numbers of each technique, or each sample of a technique picked at random.
moments multi_sample(const std::array<raw_moments, 2>& raw, const std::array<double, 2>& n) {
    moments sum;
    for (std::size_t i = 0; i < 2; ++i)
        for (int k = 0; k < static_cast<int>(n[i]); ++k)
            sum = of_sum(sum, central(raw[i]));
    return sum;
}
moments one_sample(const std::array<raw_moments, 2>& raw, const std::array<double, 2>& n) {
    raw_moments mixed{};
    for (std::size_t i = 0; i < 2; ++i)
        for (std::size_t k = 0; k < mixed.size(); ++k)
            mixed[k] += n[i] / samples * raw[i][k];
    moments sum;
    for (int k = 0; k < samples; ++k)
        sum = of_sum(sum, central(mixed));
    return sum;
}

double simulate(const problem& at, std::size_t heuristic, const std::array<double, 2>& n, bool is_one_sample,
                int passes, pcg32& rng) {
    double squares = 0;
    for (int pass = 0; pass < passes; ++pass) {
        double off = -1; // the integral
        for (int k = 0; k < samples; ++k) {
            const int i = is_one_sample ? uniform(rng) * samples >= n[0] : k >= static_cast<int>(n[0]);
            const double x = sample(at.s.techniques[static_cast<std::size_t>(i)], rng);
            off += contribution(at.s, heuristic, n, x, i);
        }
        squares += off * off;
    }
    return squares / passes;
}

bool run(const pass_options& o) {
    csv_file csv(
        o.output, "splits.csv",
        "problem,heuristic,first,multi_sample,multi_measured,multi_error,one_sample,one_measured,one_error");
    pcg32 rng(o.seed);
    bool good = true;
    int seen = 0, confirmed = 0, compared = 0;
    double least_gain = 1e30, most_gain = 0,
           best_one = 0; // of multi-sample balance; best_one: over one-sample balance
    for (const problem& at : problems())
        for (std::size_t first = 1; first < samples; ++first) {
            const std::array<double, 2> n{double(first), double(samples - first)};
            double balance_alone = 0;
            for (const std::size_t heuristic : {balance, power, cutoff, maximum}) {
                show_progress(text("%s, %zu of %d samples of the first", at.s.name.c_str(), first, samples));
                const auto raw = integrate(at, heuristic, n);
                std::string line = text("%s,%s,%zu", at.s.name.c_str(), heuristic_names[heuristic], first);
                double variance[2];
                for (const bool is_one : {false, true}) {
                    const moments m = is_one ? one_sample(raw, n) : multi_sample(raw, n);
                    const double measured = simulate(at, heuristic, n, is_one, o.passes, rng);
                    const double error =
                        std::sqrt(std::max(0.0, m.fourth - m.variance * m.variance) / o.passes);
                    good &= std::abs(m.mean - 1) < 1e-6;
                    if (error < 0.1 * m.variance) {
                        ++seen;
                        confirmed += std::abs(measured - m.variance) <= 4 * error;
                    }
                    line += text(",%.6g,%.6g,%.3g", m.variance, measured, error);
                    variance[is_one] = m.variance;
                }
                csv.add(line);
                if (heuristic == balance)
                    balance_alone = variance[1];
                if (heuristic == balance && variance[0] > zero) {
                    least_gain = std::min(least_gain, variance[1] / variance[0]);
                    most_gain = std::max(most_gain, variance[1] / variance[0]);
                }
                if (balance_alone > zero)
                    best_one = std::max(best_one, balance_alone / variance[1]);
                compared += variance[1] < variance[0] - zero;
            }
        }
    good &=
        report(seen > 0 && confirmed == seen,
               text("%d of %d variances that %d passes can see are within 4 standard errors of them, seed %s",
                    confirmed, seen, o.passes, std::to_string(o.seed).c_str()));
    good &=
        report(compared == 0, "no multi-sample combination has more variance than the same as one-sample");
    good &= report(best_one <= 1 + 1e-9,
                   text("one-sample: no heuristic is below balance [V97] 9.2.4: the best has "
                        "%.6f times its inverse variance",
                        best_one));
    note(text("balance as one-sample has %.2f to %.2f times the variance of multi-sample", least_gain,
              most_gain));
    return good;
}

} // namespace

int main(int count, char** arguments) {
    return run_with_passes(
        "Variances by how many of ten samples are the first technique's, fixed or picked at "
        "random; writes splits.csv.",
        20'000, count, arguments, run);
}
