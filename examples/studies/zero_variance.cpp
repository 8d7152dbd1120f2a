// Study: roulette, splitting and zero-variance choices in a rod whose adjoint is known. Variance and cost of
// walks by each rule over the rod's length, from the equation of their second moment, with simulations beside
// it; and how nu Psi / I goes along the walks. Writes zero_variance.csv and zero_variance_walks.csv;
// zero_variance.gp draws them. docs/roulette.md tells what they show.
#include "study.hpp"
#include "zero_variance_model.hpp"

#include <map>
#include <optional>
#include <pcg_random.hpp>
#include <random>

namespace {

using namespace studies;

struct options : common_options {
    int walks = 100'000, longest = 20;
};

constexpr double survival = 0.5, forward = 0.7;

walk_rules with_window(const char* name, double size, bool directions = false, bool flights = false) {
    const auto window = mis::window_of_size(size);
    return {name, window.lower, window.upper, directions, flights};
}
std::vector<walk_rules> all_rules() {
    return {{"analogue"},
            with_window("exact", 1),
            with_window("window 2", 2),
            with_window("window 5", 5),
            with_window("window 20", 20),
            with_window("directions", 1, true),
            with_window("zero variance", 1, true, true)};
}

// Published for these two lengths: efficiency over the analogue walk.
const std::map<std::string, std::map<int, double>> known_gains{{"exact", {{10, 4.02}, {20, 72.65}}},
                                                               {"directions", {{10, 5.02}, {20, 90.9}}}};

// Of simulated walks: moments of the score over I and of the collisions, and nu Psi / I at collisions.
struct simulated {
    mis::running_statistics<double> score, collisions;
    double fourth = 0;                            // central moment of the score
    double lowest = 1, highest = 1, furthest = 0; // nu Psi / I; |score / I - 1|
    std::vector<std::vector<double>> along;       // nu Psi / I in each mean free path
};

simulated simulate(const rod& s, const walk_rules& rules, int walks, std::uint64_t seed) {
    pcg32 rng(seed);
    const auto uniform = [&] { return std::uniform_real_distribution<double>(0, 1)(rng); };
    simulated result;
    result.along.resize(static_cast<std::size_t>(std::ceil(s.length)));
    std::vector<double> scores;
    for (int i = 0; i < walks; ++i) {
        const walk_result w = walk(s, rules, uniform, [&](double x, direction, double r) {
            result.lowest = std::min(result.lowest, r);
            result.highest = std::max(result.highest, r);
            result.along[static_cast<std::size_t>(x)].push_back(r);
        });
        scores.push_back(w.score);
        result.score.add(w.score);
        result.collisions.add(static_cast<double>(w.collisions));
        result.furthest = std::max(result.furthest, std::abs(w.score - 1));
    }
    for (double x : scores)
        result.fourth += std::pow(x - result.score.mean, 4) / walks;
    return result;
}

struct row {
    rod s;
    walk_rules rules;
    expectation exact;
    double gain = 0;   // efficiency over the analogue walk
    double unseen = 0; // of the second moment, from first flights rarer than one in the simulated walks
    simulated seen;
};

// The standard error of a simulated variance.
double error_of_variance(const simulated& s) {
    const double v = mis::variance(s.score);
    return std::sqrt(std::max(0.0, s.fourth - v * v) / s.score.weight);
}

row compute(const rod& s, const walk_rules& rules, const options& o) {
    row r{s, rules, {}, 0, 0, {}};
    const bool has_nodes = rules.lower < rules.upper;
    moment_equation equation(s, rules, has_nodes ? 10 : 25, 33);
    r.exact = equation.solve();
    if (!is_analogue(rules) && !rules.zero_variance_flights)
        r.unseen = equation.share_of_long_first_flights(std::log(o.walks));
    // Each flight with zero variance is a search; and there is no noise to be averaged.
    const int walks = rules.zero_variance_flights ? std::max(1, o.walks / 20) : o.walks;
    r.seen = simulate(s, rules, walks, o.seed);
    return r;
}

// Lengths 1, 2, 4, 6, ...
std::vector<int> lengths(const options& o) {
    std::vector<int> all{1};
    for (int a = 2; a <= o.longest; a += 2)
        all.push_back(a);
    return all;
}

std::string to_csv(const row& r) {
    return text("%s,%g,%.6e,%.6e,%.6e,%.3e,%.6e,%.6e,%.6e,%.6e", r.rules.name, r.s.length, r.exact.variance,
                r.exact.collisions, r.gain, r.unseen, r.seen.score.mean, mis::variance(r.seen.score),
                error_of_variance(r.seen), r.seen.collisions.mean);
}

// 5 %, 50 % and 95 % of nu Psi / I in each mean free path where there are enough collisions to tell.
void add_along(csv_file& csv, const row& r) {
    for (std::size_t i = 0; i < r.seen.along.size(); ++i) {
        std::vector<double> values = r.seen.along[i];
        if (values.size() < 40)
            continue;
        std::sort(values.begin(), values.end());
        const auto quantile = [&](double p) {
            return values[static_cast<std::size_t>(p * static_cast<double>(values.size() - 1))];
        };
        csv.add(text("%s,%g,%.6e,%.6e,%.6e", r.rules.name, static_cast<double>(i) + 0.5, quantile(0.05),
                     quantile(0.5), quantile(0.95)));
    }
}

// Simulated means against their expectations, in standard errors.
double mean_error(const row& r) {
    return std::abs(r.seen.score.mean - 1) / std::sqrt(r.exact.variance / r.seen.score.weight);
}
double collisions_error(const row& r) {
    // The equation's grid has an error, too.
    return std::abs(r.seen.collisions.mean - r.exact.collisions) /
           (std::sqrt(mis::variance(r.seen.collisions) / r.seen.collisions.weight) +
            1e-3 * r.exact.collisions);
}
double variance_error(const row& r) {
    return std::abs(mis::variance(r.seen.score) - r.exact.variance) /
           (error_of_variance(r.seen) + 1e-3 * r.exact.variance);
}

// All of this is checked within 5 standard errors. Were scores normal, one in 2e6 such comparisons would
// fail; the means of very skewed ones do a little more often, and the seed is fixed.
bool check_simulation(const std::vector<row>& rows) {
    constexpr double longest_seen = 4; // whose variance is not in walks that are too rare to be met
    double mean = 0, collisions = 0, variance = 0;
    for (const row& r : rows) {
        if (r.rules.zero_variance_flights)
            continue;
        const bool is_scored = r.exact.variance < 0.05 * r.seen.score.weight; // analogue walks may all miss
        mean = std::max(mean, is_scored ? mean_error(r) : 0);
        collisions = std::max(collisions, collisions_error(r));
        if (r.s.length <= longest_seen)
            variance = std::max(variance, variance_error(r));
    }
    bool good = report(mean <= 5, text("simulated means are I within %.1f standard errors", mean));
    good &= report(collisions <= 5, text("simulated costs are the equation's within %.1f", collisions));
    return report(variance <= 5, text("simulated variances are the equation's within %.1f, up to length %g",
                                      variance, longest_seen)) &&
           good;
}

bool check_rules(const std::vector<row>& rows) {
    double window = 0, invariant = 0, score = 0;
    for (const row& r : rows) {
        if (is_analogue(r.rules))
            continue;
        window = std::max({window, 1 - r.seen.lowest / r.rules.lower, r.seen.highest / r.rules.upper - 1});
        if (r.rules.zero_variance_flights) {
            invariant = std::max({invariant, std::abs(r.seen.lowest - 1), std::abs(r.seen.highest - 1)});
            score = std::max(score, r.seen.furthest);
        }
    }
    bool good =
        report(window <= 1e-12, text("nu Psi / I is in the window at every collision, but for %.1e", window));
    good &= report(invariant <= 1e-12,
                   text("zero variance: nu Psi is I at every collision within %.1e", invariant));
    return report(score <= 1e-12, text("zero variance: every walk scores I within %.1e", score)) && good;
}

bool check_gains(const std::vector<row>& rows) {
    bool good = true;
    for (const row& r : rows) {
        const auto known = known_gains.find(r.rules.name);
        if (known == known_gains.end())
            continue;
        const auto gain = known->second.find(static_cast<int>(r.s.length));
        if (gain != known->second.end())
            good &= report(std::abs(r.gain / gain->second - 1) <= 0.01,
                           text("%s, length %g: %.4g times as efficient as analogue, known %.4g",
                                r.rules.name, r.s.length, r.gain, gain->second));
    }
    return good;
}

void tell(const row& r) {
    std::string line = text("%s, length %g: ", r.rules.name, r.s.length);
    if (r.rules.zero_variance_flights)
        line += text("%.3f collisions; simulated variance %.1e I^2", r.exact.collisions,
                     mis::variance(r.seen.score));
    else
        line +=
            text("variance %.4g I^2, %.3f collisions, %.4g times as efficient; simulated %.4g I^2, %.3f; ",
                 r.exact.variance, r.exact.collisions, r.gain, mis::variance(r.seen.score),
                 r.seen.collisions.mean);
    if (is_analogue(r.rules))
        line += text("%.3g of the walks should have scored", r.seen.score.weight * adjoint(r.s, 0, right));
    else if (!r.rules.zero_variance_flights)
        line += text("%.0f %% of the second moment is in first flights that one walk in %.0f has",
                     100 * r.unseen, r.seen.score.weight);
    note(line);
}

bool run(const options& o) {
    csv_file csv(o.output, "zero_variance.csv",
                 "walk,length,variance,collisions,gain,unseen,simulated_mean,simulated_variance,"
                 "simulated_error,simulated_collisions");
    csv_file along(o.output, "zero_variance_walks.csv", "walk,depth,low,median,high");
    std::vector<row> rows;
    for (int a : lengths(o)) {
        double analogue = 0;
        for (const walk_rules& rules : all_rules()) {
            show_progress(text("length %d of %d, %s", a, o.longest, rules.name));
            row r = compute({static_cast<double>(a), survival, forward}, rules, o);
            if (is_analogue(rules))
                analogue = efficiency(r.exact);
            // With zero variance what is left is the grid's error.
            r.gain = rules.zero_variance_flights ? 0 : efficiency(r.exact) / analogue;
            csv.add(to_csv(r));
            if (a == lengths(o).back())
                add_along(along, r);
            r.seen.along.clear();
            rows.push_back(std::move(r));
        }
    }
    show_progress("");
    for (const row& r : rows)
        if (r.s.length == 10 || r.s.length == lengths(o).back())
            tell(r);
    bool good = check_gains(rows);
    good &= check_rules(rows);
    good &= check_simulation(rows);
    return good;
}

} // namespace

int main(int count, char** arguments) {
    options o;
    command_line app("Roulette, splitting and zero-variance choices in a rod whose adjoint is known; writes "
                     "zero_variance.csv and zero_variance_walks.csv.",
                     o);
    app.add("--walks", o.walks, "simulated, by each rule and for each length", 1'000, 100'000'000);
    app.add("--longest", o.longest, "length of the rod, in mean free paths", 2, 30);
    return run_study(app, o, count, arguments, run);
}
