// Study: how far from the best is balance? Veach's bound [V97] 9.2, [H] 12: no weights have a variance that
// is less than balance's by more than (1 / min n_i - 1 / sum n_i) times the square of the integral. Checked
// against the best of many random weightings, all by quadrature; and what optimal weights, which may be
// negative and are not bound so, make of it. Writes bound.csv. docs/heuristics.md tells what it shows.
//
// A weighting is the weight of the first technique in each of 200 cells, which are made of points with alike
// weights by balance, and have as much of the integral each; the other technique's weight is the rest. The
// first half of all is drawn blindly, in different ways; each of the second half is the best so far, changed
// in some cells: blind ones are hardly ever near to the best in 200 dimensions.
#include "optimal_model.hpp"
#include "study.hpp"

namespace {

using namespace studies;

struct options : common_options {
    int weightings = 10'000;
};

constexpr std::size_t cells = 200;

struct problem {
    setup s;
    double from, to;
    std::array<double, 2> counts;
};

std::vector<problem> problems() {
    using kind = shape::kind;
    const shape first{kind::gaussian, -3, 4}, second{kind::gaussian, 3, 4}, peak{kind::gaussian, 0.5, 0.001},
        even{kind::uniform, 0, 1}, step{kind::uniform, 0.4, 0.5};
    const setup gaussians{"gaussians", {{0.3, first}, {0.7, second}}, {{{1, first}}, {{1, second}}}},
        low{"low variance", {{1, peak}}, {{{0.99, peak}, {0.01, even}}, {{1, even}}}},
        span{"difference", {{1, step}}, {{{1, even}}, {{0.9, even}, {0.1, step}}}};
    return {{gaussians, -80, 80, {1, 1}}, {gaussians, -80, 80, {1, 9}}, {low, 0, 1, {1, 1}},
            {low, 0, 1, {9, 1}},          {low, 0, 1, {1, 9}},          {span, 0, 1, {1, 1}}};
}

// Per cell what a weighting's variance follows from: V = sum_cells s_i w_i^2 over techniques, less sum_i
// m_i^2 / n_i with m_i the sum of w_i f.
struct table {
    std::array<double, cells> f{}, first{}, second{},
        balance{}; // integrals of f, f^2/(n p); balance: its weight
    std::array<double, 2> counts;

    double variance(const std::array<double, cells>& w) const {
        double squares = 0, mean[2] = {};
        for (std::size_t k = 0; k < cells; ++k) {
            squares += w[k] * w[k] * first[k] + (1 - w[k]) * (1 - w[k]) * second[k];
            mean[0] += w[k] * f[k];
            mean[1] += (1 - w[k]) * f[k];
        }
        return squares - mean[0] * mean[0] / counts[0] - mean[1] * mean[1] / counts[1];
    }
};

// Cells hold points whose weights by balance are alike: sorted by that weight, each has as much of f.
table tabulate(const problem& at) {
    constexpr int points = 400'000;
    struct point {
        double weight, f, first, second;
    };
    std::vector<point> all;
    const double dx = (at.to - at.from) / points;
    for (int k = 0; k < points; ++k) {
        const double x = at.from + (k + 0.5) * dx, f = value_at(at.s.f, x) * dx;
        const double q[] = {at.counts[0] * value_at(at.s.techniques[0], x),
                            at.counts[1] * value_at(at.s.techniques[1], x)};
        if (f > 0)
            all.push_back({mis::weight(mis::balance, q, 2, 0), f, f * f / dx / q[0], f * f / dx / q[1]});
    }
    std::sort(all.begin(), all.end(), [](const point& a, const point& b) { return a.weight < b.weight; });
    table t;
    t.counts = at.counts;
    double below = 0;
    for (const point& p : all) {
        const auto k = std::min(cells - 1, static_cast<std::size_t>(below * cells));
        below += p.f;
        t.f[k] += p.f;
        t.first[k] += p.first;
        t.second[k] += p.second;
    }
    for (std::size_t k = 0; k < cells; ++k) // within a cell: that of its sums
        t.balance[k] = t.first[k] + t.second[k] > 0 ? t.second[k] / (t.first[k] + t.second[k]) : 0;
    return t;
}

std::array<double, cells> draw_weights(const table& t, pcg32& rng) {
    std::array<double, cells> w{};
    const int way = static_cast<int>(4 * uniform(rng));
    const double exponent = std::exp(4 * uniform(rng) - 2), factor = std::exp(6 * uniform(rng) - 3),
                 blend = uniform(rng);
    const double phase = uniform(rng) * 6.2831853, cycles = 10 * uniform(rng);
    for (std::size_t k = 0; k < cells; ++k) {
        const double b = t.balance[k];
        const double powered =
            std::pow(b, exponent) / (std::pow(b, exponent) + factor * std::pow(1 - b, exponent) + 1e-300);
        w[k] =
            way == 0   ? uniform(rng) // anything
            : way == 1 ? powered      // any power, any factor
            : way == 2
                ? (1 - blend) * b + blend * uniform(rng) // about balance
                : std::clamp(powered + 0.3 * blend * std::sin(phase + cycles * double(k) / cells * 6.2831853),
                             0.0, 1.0);
    }
    return w;
}

bool run(const options& o) {
    csv_file csv(o.output, "bound.csv",
                 "problem,first_count,second_count,weightings,balance,best_blind,best,optimal,bound");
    pcg32 rng(o.seed);
    bool good = true;
    double nearest = 0;
    std::printf("%-14s %7s %11s %11s %11s %11s %11s\n", "", "n", "balance", "best blind", "best", "optimal",
                "bound of gap");
    for (const problem& at : problems()) {
        show_progress(at.s.name);
        const table t = tabulate(at);
        const double of_balance = t.variance(t.balance);
        double best = 1e300, best_blind = 0;
        std::array<double, cells> best_weights{};
        for (int k = 0; k < o.weightings; ++k) {
            if (k == o.weightings / 2)
                best_blind = best;
            std::array<double, cells> w = best_weights;
            if (k < o.weightings / 2) {
                w = draw_weights(t, rng);
            } else {
                const double size = std::exp(-6 * uniform(rng)), middle = uniform(rng) * cells,
                             width = cells * std::pow(uniform(rng), 2) + 1, change = 2 * uniform(rng) - 1;
                for (std::size_t c = 0; c < cells; ++c)
                    if (std::abs(double(c) - middle) < width)
                        w[c] = std::clamp(w[c] + size * change, 0.0, 1.0);
            }
            const double variance = t.variance(w);
            if (variance < best)
                best = variance, best_weights = w;
        }
        const double n[] = {at.counts[0], at.counts[1]};
        // [O]: the least of all, by quadrature.
        double a[3] = {}, b[2] = {}, squares = 0;
        constexpr int points = 400'000;
        const double dx = (at.to - at.from) / points;
        for (int k = 0; k < points; ++k) {
            const double x = at.from + (k + 0.5) * dx, f = value_at(at.s.f, x);
            const double p[] = {value_at(at.s.techniques[0], x), value_at(at.s.techniques[1], x)},
                         d = n[0] * p[0] + n[1] * p[1];
            if (!(d > 0))
                continue;
            a[0] += p[0] * p[0] / d * dx, a[1] += p[0] * p[1] / d * dx, a[2] += p[1] * p[1] / d * dx;
            b[0] += f * p[0] / d * dx, b[1] += f * p[1] / d * dx;
            squares += f * f / d * dx;
        }
        const double determinant = a[0] * a[2] - a[1] * a[1];
        const double of_optimal = std::max(
            0.0, squares - (a[2] * b[0] * b[0] - 2 * a[1] * b[0] * b[1] + a[0] * b[1] * b[1]) / determinant);
        const double bound = 1 / std::min(n[0], n[1]) - 1 / (n[0] + n[1]); // the integral is 1
        std::printf("%-14s %3.0f:%-3.0f %11.4g %11.4g %11.4g %11.4g %11.4g\n", at.s.name.c_str(), n[0], n[1],
                    of_balance, best_blind, best, of_optimal, bound);
        csv.add(text("%s,%g,%g,%d,%.6g,%.6g,%.6g,%.6g,%.6g", at.s.name.c_str(), n[0], n[1], o.weightings,
                     of_balance, best_blind, best, of_optimal, bound));
        nearest = std::max(nearest, (of_balance - best) / bound);
        good &= report(
            of_balance - best <= bound && best >= of_optimal - 1e-9,
            text("%s, %g:%g: the best of %d weightings is below balance by %.3g, of at most %.3g; optimal "
                 "weights by %.3g",
                 at.s.name.c_str(), n[0], n[1], o.weightings, of_balance - best, bound,
                 of_balance - of_optimal));
    }
    note(text("seed %s; the nearest is at %.2f of the bound", std::to_string(o.seed).c_str(), nearest));
    return good;
}

} // namespace

int main(int count, char** arguments) {
    options o;
    command_line app("Balance against the best of many random weightings, and Veach's bound; writes "
                     "bound.csv.",
                     o);
    app.add("--weightings", o.weightings, "tried", 2, 100'000'000);
    return run_study(app, o, count, arguments, run);
}
