// Study: how many samples of each technique? Two peaks and something everywhere, found by a technique for
// each peak and by a uniform one that is cheap; samples for the peaks cost up to 100 times as much. The
// variance of balance over all ways to spend a budget, as a map, with the counts that mis::allocate finds,
// equal counts, and the way from there; and what becomes of them where all that is known are pilot samples.
// Writes allocation.csv, allocation_map.csv, allocation_path.csv and allocation_pilots.csv; allocation.gp
// draws them. docs/allocation.md tells what they show.
#include "optimal_model.hpp"
#include "study.hpp"
#include <mis/optimal/allocation.hpp>

namespace {

using namespace studies;

constexpr int techniques = 3, cells = 800;
constexpr double budget = 100;
constexpr std::array<double, 3> mapped_ratios{1, 10, 100};

struct options : common_options {
    int seeds = 100, steps = 240;
};

using pilot = mis::pilot<techniques>;
using triple = std::array<double, techniques>;

setup two_peaks() {
    using kind = shape::kind;
    return {
        "two peaks",
        {{1, {kind::gaussian, 0.3, 0.025}}, {2, {kind::gaussian, 0.7, 0.04}}, {0.3, {kind::uniform, 0, 1}}},
        {{{1, {kind::gaussian, 0.3, 0.035}}},
         {{1, {kind::gaussian, 0.7, 0.06}}},
         {{1, {kind::uniform, 0, 1}}}}};
}

// On [0, 1], where f is; samples elsewhere miss.
triple densities_at(const setup& s, double x) {
    return {value_at(s.techniques[0], x), value_at(s.techniques[1], x), value_at(s.techniques[2], x)};
}
double f_at(const setup& s, double x) { return x >= 0 && x < 1 ? value_at(s.f, x) : 0; }

// Of all of the domain: its integrals are those of a quadrature.
pilot by_quadrature(const setup& s) {
    pilot all;
    triple inside{};
    for (int i = 0; i < cells; ++i) {
        const double x = (i + 0.5) / cells;
        const triple p = densities_at(s, x);
        all.add(f_at(s, x), p, cells);
        for (std::size_t k = 0; k < techniques; ++k)
            inside[k] += p[k] / cells;
    }
    for (int k = 0; k < techniques; ++k)
        all.add_outside(k, 1, std::max(0.0, 1 - inside[static_cast<std::size_t>(k)]));
    all.passes = 1;
    all.is_quadrature = true;
    return all;
}

// Of as many samples in all, in turns.
pilot by_samples(const setup& s, int samples, pcg32& rng) {
    pilot some;
    for (int i = 0; i < samples; ++i) {
        const double x = sample(s.techniques[static_cast<std::size_t>(i % techniques)], rng);
        const triple p = densities_at(s, x);
        if (x >= 0 && x < 1)
            some.add(f_at(s, x), p, p[0] + p[1] + p[2]);
        else
            some.add_outside(i % techniques, 1);
    }
    some.passes = samples / double(techniques);
    return some;
}

triple costs_of(double ratio) { return {ratio, ratio, 1}; }

triple shares_of(const mis::allocation<techniques>& a, const triple& costs) {
    triple t{};
    for (int k = 0; k < techniques; ++k)
        t[static_cast<std::size_t>(k)] = a.counts[k] * costs[static_cast<std::size_t>(k)] / budget;
    return t;
}
triple counts_of(const triple& shares, const triple& costs) {
    triple n{};
    for (std::size_t k = 0; k < techniques; ++k)
        n[k] = budget * shares[k] / costs[k];
    return n;
}
triple equal_shares(const triple& costs) { // as many samples of each
    const double sum = costs[0] + costs[1] + costs[2];
    return {costs[0] / sum, costs[1] / sum, costs[2] / sum};
}

double variance(const pilot& exact, const triple& shares, const triple& costs) {
    const auto d = mis::variance_of_counts(exact, counts_of(shares, costs));
    return d.covered ? d.value : std::numeric_limits<double>::infinity();
}

// The map; returns the least variance.
double map_variance(const pilot& exact, double ratio, const options& o, csv_file* csv) {
    const triple costs = costs_of(ratio);
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= o.steps; ++i) {
        if (csv)
            show_progress(text("map of cost ratio %g: %d of %d rows", ratio, i, o.steps));
        for (int j = 0; j <= o.steps; ++j) {
            const double a = i / double(o.steps), b = j / double(o.steps);
            const bool inside = i + j <= o.steps;
            const double v = inside ? variance(exact, {a, b, std::max(0.0, 1 - a - b)}, costs) : 0;
            if (inside)
                least = std::min(least, v);
            if (csv)
                csv->add(inside && v < 1e300 ? text("%g,%g,%g,%.6g", ratio, a, b, v)
                                             : text("%g,%g,%g,NaN", ratio, a, b));
        }
    }
    return least;
}

void write_path(const pilot& exact, double ratio, csv_file& csv) {
    const triple costs = costs_of(ratio), equal = equal_shares(costs);
    for (const auto method : {mis::allocation_method::newton, mis::allocation_method::projected_gradient}) {
        const char* const name = method == mis::allocation_method::newton ? "newton" : "gradient";
        mis::allocation_options some;
        some.method = method;
        int last = -1;
        for (some.most_iterations = 0; some.most_iterations <= 60; ++some.most_iterations) {
            const auto a = mis::allocate(exact, costs, budget, some, equal.data());
            if (a.iterations == last)
                break;
            last = a.iterations;
            const triple t = shares_of(a, costs);
            csv.add(text("%g,%s,%d,%.6g,%.6g,%.6g", ratio, name, last, t[0], t[1], a.variance));
        }
    }
    const auto mark = [&](const char* name, const triple& t) {
        csv.add(text("%g,%s,0,%.6g,%.6g,%.6g", ratio, name, t[0], t[1], variance(exact, t, costs)));
    };
    mark("equal", equal);
    mark("found", shares_of(mis::allocate(exact, costs, budget), costs));
}

double quantile(std::vector<double> x, double part) {
    const auto at = static_cast<std::size_t>(part * double(x.size() - 1) + 0.5);
    std::nth_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(at), x.end());
    return x[at];
}

bool run(const options& o) {
    const setup s = two_peaks();
    const pilot exact = by_quadrature(s);
    csv_file table(
        o.output, "allocation.csv",
        "ratio,least_of_grid,found,equal,share_left,share_right,share_uniform,iterations,optimal_found,"
        "optimal_equal,certificate"),
        map(o.output, "allocation_map.csv", "ratio,left,right,variance"),
        path(o.output, "allocation_path.csv", "ratio,what,step,left,right,variance"),
        pilots(o.output, "allocation_pilots.csv", "ratio,samples,least_share,median,most,equal");
    bool good = true;
    std::printf("%5s  %-22s %9s %9s %7s   %s\n", "costs", "shares of the budget", "variance", "of equal",
                "ratio", "by optimal weights, of equal counts, certificate");
    for (const double ratio : {1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0}) {
        const triple costs = costs_of(ratio), equal = equal_shares(costs);
        const bool shown =
            std::find(mapped_ratios.begin(), mapped_ratios.end(), ratio) != mapped_ratios.end();
        const double least = map_variance(exact, ratio, o, shown ? &map : nullptr);
        if (shown)
            write_path(exact, ratio, path);
        const auto balance = mis::allocate(exact, costs, budget);
        const auto optimal = mis::optimal::allocate(exact, costs, budget);
        const double optimal_equal = mis::optimal::variance_of_counts(exact, counts_of(equal, costs)).value;
        const triple t = shares_of(balance, costs);
        const double of_equal = variance(exact, equal, costs);
        show_progress("");
        std::printf("%5g  %6.3f %6.3f %6.3f   %9.4g %9.4g %7.2f   %9.4g %9.4g %9.2g\n", ratio, t[0], t[1],
                    t[2], balance.variance, of_equal, of_equal / balance.variance, optimal.variance,
                    optimal_equal, optimal.gap);
        table.add(text("%g,%.8g,%.8g,%.8g,%.6g,%.6g,%.6g,%d,%.8g,%.8g,%.3g", ratio, least, balance.variance,
                       of_equal, t[0], t[1], t[2], balance.iterations, optimal.variance, optimal_equal,
                       optimal.gap));
        good &= report(balance.variance <= least * (1 + 1e-6),
                       text("cost ratio %g: found over the least of the grid: %.6f (bar: 1.000001)", ratio,
                            balance.variance / least));
        good &= report(
            optimal.converged && optimal.gap <= 1e-6 * optimal.variance,
            text("cost ratio %g: no counts are better for optimal weights by more than %.2g of the variance",
                 ratio, optimal.gap / optimal.variance));
        if (!shown)
            continue;
        pcg32 rng(o.seed);
        for (const double least_share : {0.0, 0.05})
            for (const int samples : {6, 12, 24, 48, 99, 198, 501, 999, 3000}) {
                show_progress(text("cost ratio %g: pilots of %d samples", ratio, samples));
                mis::allocation_options keep;
                keep.least_share = least_share;
                std::vector<double> over;
                for (int seed = 0; seed < o.seeds; ++seed) {
                    const auto a = mis::allocate(by_samples(s, samples, rng), costs, budget, keep);
                    over.push_back(variance(exact, shares_of(a, costs), costs) / balance.variance);
                }
                pilots.add(text("%g,%d,%g,%.6g,%.6g,%.6g", ratio, samples, least_share, quantile(over, 0.5),
                                quantile(over, 0.95), of_equal / balance.variance));
                if (samples == 999 && !(least_share > 0)) // 1000, but for turns
                    good &= report(quantile(over, 0.5) <= 1.01,
                                   text("cost ratio %g, 1000 pilot samples: median of the variance over the "
                                        "least: %.4f (bar: 1.01)",
                                        ratio, quantile(over, 0.5)));
            }
    }
    return good;
}

} // namespace

int main(int count, char** arguments) {
    options o;
    command_line app("How many samples of each technique, for a budget: the variance of balance over all "
                     "counts, and the counts that are found; writes allocation*.csv.",
                     o);
    app.add("--seeds", o.seeds, "pilots of each size", 2, 100000);
    app.add("--steps", o.steps, "of the map, along a side", 4, 2000);
    return run_study(app, o, count, arguments, run);
}
