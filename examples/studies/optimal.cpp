// Study: the optimal weights of Kondapaneni et al., "Optimal multiple importance sampling", 2019 [O], beside
// the heuristics, on integrals of one dimension, over the number of samples: RMS errors, and the bias of the
// direct estimator. What the heuristics and the best alpha do is known without sampling. Writes optimal.csv;
// optimal.gp draws it. docs/optimal.md tells what it shows.
#include "optimal_model.hpp"
#include "study.hpp"

#include <mis/optimal/solve.hpp>

namespace {

using namespace studies;

struct options : common_options {
    int largest = 1024, repetitions = 20'000;
};

// ---- Estimators ----

// After the heuristics: the optimal weights with the exact alpha; the direct estimator; and the progressive
// one, whose first alpha is made after 1 pass or after 16. Until then it is balance.
constexpr std::size_t count_of_heuristics = heuristic_names.size(), known = count_of_heuristics,
                      direct = known + 1, progressive = known + 2, progressive_16 = known + 3;
constexpr std::array<const char*, known + 4> names{
    "average", "balance", "power", "cutoff", "maximum", "known", "direct", "progressive", "progressive_16"};
constexpr std::size_t count_of_known = known + 1; // the estimators whose variance is known

using estimates = std::array<double, names.size()>;

// One repetition: all estimators see the same samples. They are asked after 1, 2, 4, ... passes.
template <std::size_t M> struct repetition {
    static constexpr int m = static_cast<int>(M);

    const setup& s;
    const exact& e;
    double counts[M];
    std::array<double, count_of_heuristics> weighed{};
    double residual = 0; // sum (f - sum alpha_k p_k) / D with the exact alpha
    mis::optimal::progressive<m, 1> early, late;
    mis::optimal::estimator<2, 1> without; // superfluous techniques

    repetition(const setup& of, const exact& all) : s(of), e(all) { std::fill_n(&counts[0], M, 1.0); }

    void add_pass(pcg32& rng) {
        for (std::size_t i = 0; i < M; ++i)
            add(sample(s.techniques[i], rng), i);
    }

    void add(double x, std::size_t technique) {
        double p[M], d = 0, controlled = 0;
        for (std::size_t k = 0; k < M; ++k) {
            p[k] = value_at(s.techniques[k], x);
            d += p[k];
            controlled += e.alpha[static_cast<int>(k)] * p[k];
        }
        const double f = value_at(s.f, x);
        const auto w = heuristic_weights(&p[0], m, static_cast<int>(technique));
        for (std::size_t h = 0; h < count_of_heuristics; ++h)
            weighed[h] += w[h] * f / p[technique];
        residual += (f - controlled) / d;
        early.add(f, p);
        late.add(f, p);
        if (s.is_dependent()) {
            const double both[] = {s.without[0] * p[0], s.without[1] * p[1]};
            without.add(f, both);
        }
    }

    estimates estimate(int passes) {
        constexpr int first_batch = 16;
        estimates result{};
        for (std::size_t h = 0; h < count_of_heuristics; ++h)
            result[h] = weighed[h] / passes;
        result[known] = e.alpha.sum() + residual / passes;
        result[direct] = integral(early.sums, counts)[0];
        end_batch(early, counts, passes - early.passes, {2, 0});
        result[progressive] = integral(early)[0];
        if (passes >= first_batch)
            end_batch(late, counts, passes - late.passes);
        result[progressive_16] = passes >= first_batch ? integral(late)[0] : result[balance];
        return result;
    }

    double direct_without() const { return integral(without, s.without.data())[0]; }
};

// ---- What is found about them ----

struct moments {
    double count = 0, sum = 0, squares = 0, fourths = 0;

    void add(double x) {
        ++count;
        sum += x;
        squares += x * x;
        fourths += x * x * x * x;
    }
    double mean() const { return sum / count; }
    double mean_square() const { return squares / count; }
    double rms() const { return std::sqrt(mean_square()); }
    // Standard errors.
    double error_of_mean() const { return deviation(mean_square(), mean()); }
    double error_of_mean_square() const { return deviation(fourths / count, mean_square()); }

private:
    double deviation(double square, double of_mean) const {
        return std::sqrt(std::max(0.0, square - of_mean * of_mean) / count);
    }
};

// All repetitions after some passes. Errors are relative to the integral. The distances from the estimate
// with the exact alpha, which is unbiased, tell an estimator's bias far more sharply than its errors do.
struct row {
    int passes;
    std::array<moments, names.size()> error, from_known;
    double worst_direct = 0;  // relative error
    double worst_without = 0; // relative distance of the direct estimates with and without all techniques

    void add(const estimates& all, double integral) {
        for (std::size_t k = 0; k < all.size(); ++k) {
            error[k].add(all[k] / integral - 1);
            from_known[k].add((all[k] - all[known]) / integral);
        }
        worst_direct = std::max(worst_direct, std::fabs(all[direct] / integral - 1));
    }
};

template <std::size_t M>
std::vector<row> simulate(const setup& s, const exact& e, const options& o, pcg32& rng) {
    std::vector<row> rows;
    for (int n = 1; n <= o.largest; n *= 2)
        rows.push_back({n, {}, {}});
    for (int k = 0; k < o.repetitions; ++k) {
        if (k % 100 == 0)
            show_progress(text("%s: %d of %d repetitions", s.name.c_str(), k, o.repetitions));
        repetition<M> one(s, e);
        int passes = 0;
        for (row& r : rows) {
            for (; passes < r.passes; ++passes)
                one.add_pass(rng);
            const estimates all = one.estimate(passes);
            r.add(all, e.integral);
            if (s.is_dependent())
                r.worst_without =
                    std::max(r.worst_without, std::fabs(one.direct_without() / all[direct] - 1));
        }
    }
    show_progress("");
    return rows;
}

// RMS error, relative to the integral, of an estimator whose variance is known.
double exact_rms(const exact& e, std::size_t estimator, int passes) {
    const double variance = estimator == known ? e.least : e.variance[estimator];
    return std::sqrt(variance / passes) / std::fabs(e.integral);
}

// ---- Checks ----

// Were mean squares normal, one of the 330 comparisons of the whole study would fail for 2 seeds in 10,000.
constexpr double standard_errors = 5;

// The simulated mean squared error within 5 of its standard errors.
bool is_confirmed(const row& r, const exact& e, std::size_t estimator) {
    const double predicted = std::pow(exact_rms(e, estimator, r.passes), 2), rounding = 1e-24;
    return std::fabs(r.error[estimator].mean_square() - predicted) <=
           standard_errors * r.error[estimator].error_of_mean_square() + rounding;
}

bool are_confirmed(const std::vector<row>& rows, const exact& e, std::size_t estimator) {
    return std::all_of(rows.begin(), rows.end(), [&](const row& r) { return is_confirmed(r, e, estimator); });
}

double bias_in_standard_errors(const row& r, std::size_t estimator) {
    const moments& m = r.from_known[estimator];
    return std::fabs(m.mean()) / m.error_of_mean();
}

// From how many samples on an estimator's errors are below a heuristic's on the same samples, for good; 0:
// not at the end. Where they are the same they differ by rounding.
int below_from(const std::vector<row>& rows, std::size_t estimator, std::size_t heuristic) {
    int from = 0;
    for (auto r = rows.rbegin(); r != rows.rend(); ++r) {
        if (!(r->error[estimator].rms() < (1 - 1e-6) * r->error[heuristic].rms()))
            break;
        from = r->passes;
    }
    return from;
}

bool check_variances(const std::vector<row>& rows, const exact& e) {
    const bool same = std::fabs(e.variance[balance] - e.balance_formula) <= 1e-9 * e.balance_formula;
    bool good = report(same && are_confirmed(rows, e, balance),
                       "balance's variance is the formula's, within 5 standard errors");
    // Not average: it divides by densities that are next to nothing, and its rarest samples decide.
    const std::size_t others[] = {power, cutoff, maximum, known};
    good &= report(std::all_of(std::begin(others), std::end(others),
                               [&](std::size_t k) { return are_confirmed(rows, e, k); }),
                   "so are those of power, cutoff, maximum and of the exact alpha");
    const double least = *std::min_element(e.variance.begin(), e.variance.end());
    good &=
        report(e.least <= least,
               text("the exact alpha has the least variance, %.3f of the best heuristic's", e.least / least));
    const row& last = rows.back();
    // Not progressive from n = 1, whose variance need not be finite: as many samples as techniques can leave
    // the matrix nearly singular, and alpha without a bound.
    for (const std::size_t k : {direct, progressive_16})
        good &=
            report(last.error[k].mean_square() <= std::pow(exact_rms(e, balance, last.passes), 2) +
                                                      standard_errors * last.error[k].error_of_mean_square(),
                   text("%s at n = %d: variance not above balance's", names[k], last.passes));
    return good;
}

// The largest of some relative distances; those after so few samples that the matrix is often nearly singular
// only get a note.
bool report_distance(const std::vector<row>& rows, double row::*distance, const char* what, double bar) {
    constexpr int enough = 4;
    double worst = 0;
    for (const row& r : rows)
        if (r.passes < enough)
            note(text("%s at n = %d: at most %.1e", what, r.passes, r.*distance));
        else
            worst = std::max(worst, r.*distance);
    return report(worst <= bar,
                  text("%s from n = %d on: at most %.1e (bar: %.0e)", what, enough, worst, bar));
}

bool check_direct(const setup& s, const std::vector<row>& rows, const exact& e) {
    const bool good =
        !s.is_dependent() ||
        report_distance(rows, &row::worst_without, "direct with and without superfluous techniques", 1e-10);
    if (!(e.least > 0))
        return report_distance(rows, &row::worst_direct, "error of direct", 1e-12) && good;
    const row& last = rows.back();
    const double ratio = last.error[direct].mean_square() / std::pow(exact_rms(e, known, last.passes), 2);
    return report(std::fabs(ratio - 1) <= 0.1,
                  text("direct at n = %d: %.3f of the least variance (bar: 10 %%)", last.passes, ratio)) &&
           good;
}

// The direct estimator's, from where its first terms have settled.
bool check_bias_of_direct(const std::vector<row>& rows) {
    std::vector<double> samples, bias;
    for (const row& r : rows)
        if (r.passes >= 8 && bias_in_standard_errors(r, direct) > 4) {
            samples.push_back(r.passes);
            bias.push_back(std::fabs(r.from_known[direct].mean()));
        }
    if (samples.size() < 3) {
        note("direct's bias: too small to tell how it falls");
        return true;
    }
    const double slope = log_log_slope(samples, bias);
    return report(slope <= -0.8,
                  text("direct's bias falls as n^%.2f, fitted to %zu n", slope, samples.size()));
}

// Were distances normal, one of the 132 comparisons of the whole study would fail for less than 1 % of all
// seeds.
bool check_bias_of_progressive(const std::vector<row>& rows) {
    double worst = 0;
    for (const row& r : rows)
        for (const std::size_t k : {progressive, progressive_16})
            worst = std::max(worst, bias_in_standard_errors(r, k));
    return report(worst <= 4, text("progressive's bias: at most %.2f standard errors (bar: 4)", worst));
}

void note_where_below(const std::vector<row>& rows) {
    for (const std::size_t k : {direct, progressive, progressive_16}) {
        std::string line = text("%s is below", names[k]);
        for (const std::size_t heuristic : {balance, power}) {
            const int from = below_from(rows, k, heuristic);
            line += from > 0 ? text(" %s from n = %d,", names[heuristic], from)
                             : text(" %s nowhere up to %d,", names[heuristic], rows.back().passes);
        }
        line.pop_back();
        note(line);
    }
}

bool check(const setup& s, const std::vector<row>& rows, const exact& e) {
    std::printf("%s\n", s.name.c_str());
    bool good = check_variances(rows, e);
    good &= check_direct(s, rows, e);
    good &= !(e.least > 0) || check_bias_of_direct(rows);
    good &= check_bias_of_progressive(rows);
    note_where_below(rows);
    return good;
}

// ---- The table ----

std::string heading() {
    std::string line = "setup,samples";
    for (const char* name : names)
        line += text(",%s", name);
    for (std::size_t k = 0; k < count_of_known; ++k)
        line += text(",%s_exact", names[k]);
    for (const std::size_t k : {direct, progressive, progressive_16})
        line += text(",%s_bias,%s_bias_error", names[k], names[k]);
    return line;
}

std::string to_csv(const setup& s, const row& r, const exact& e) {
    std::string line = text("%s,%d", s.name.c_str(), r.passes);
    for (const moments& m : r.error)
        line += text(",%.5g", m.rms());
    for (std::size_t k = 0; k < count_of_known; ++k)
        line += text(",%.5g", exact_rms(e, k, r.passes));
    for (const std::size_t k : {direct, progressive, progressive_16})
        line += text(",%.4g,%.2g", r.from_known[k].mean(), r.from_known[k].error_of_mean());
    return line;
}

bool run(const options& o) {
    csv_file csv(o.output, "optimal.csv", heading());
    bool good = true;
    pcg32 rng(o.seed);
    for (const setup& s : all_setups()) {
        const exact e = integrate(s);
        const auto rows = s.techniques.size() == 2 ? simulate<2>(s, e, o, rng) : simulate<3>(s, e, o, rng);
        for (const row& r : rows)
            csv.add(to_csv(s, r, e));
        good &= check(s, rows, e);
    }
    return good;
}

} // namespace

int main(int count, char** arguments) {
    options o;
    command_line app("Errors of optimal weights and of the heuristics over the number of samples; writes "
                     "optimal.csv.",
                     o);
    app.add("--largest", o.largest, "samples of each technique are 1, 2, 4, ... up to this", 1, 1 << 20);
    app.add("--repetitions", o.repetitions, "independent estimates", 2, 10'000'000);
    return run_study(app, o, count, arguments, run);
}
