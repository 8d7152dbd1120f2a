// The rod: walkers on a line of some length, in mean free paths. At a collision a walker survives with some
// probability and then goes on forward or back. It scores 1 when it leaves at the far end. Everything that
// governs roulette and splitting is known in closed form, and the variance of a walk under any rules is the
// solution of one integral equation: its second moment.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <mis/roulette.hpp>
#include <vector>

namespace studies {

struct rod {
    double length = 10, survival = 0.5, forward = 0.7;
};
enum direction { right, left };

// The expected score of a walker at x, 0 <= x <= length, that moves right or left. With a = 1 - survival
// forward, b = survival (1 - forward) and k^2 = a^2 - b^2 it is the solution of Psi+' = a Psi+ - b Psi-,
// Psi-' = b Psi+ - a Psi-, with Psi+ = 1 at the far end and Psi- = 0 at the near one.
inline double adjoint(const rod& s, double x, direction d) {
    const double a = 1 - s.survival * s.forward, b = s.survival * (1 - s.forward),
                 k = std::sqrt((a - b) * (a + b)); // 0 if nothing is absorbed, however it is rounded
    const auto odd = [&](double t) { return k > 0 ? std::sinh(k * t) / k : t; };
    const double all = a * odd(s.length) + std::cosh(k * s.length);
    return (d == right ? a * odd(x) + std::cosh(k * x) : b * odd(x)) / all;
}
inline direction opposite(direction d) { return d == right ? left : right; }

// That of one that has moved right or left and collides at x: the reflected adjoint.
inline double reflected(const rod& s, double x, direction d) {
    return s.survival * (s.forward * adjoint(s, x, d) + (1 - s.forward) * adjoint(s, x, opposite(d)));
}

// The rules of a walk. Without a window it is analogue: it survives a collision as it does in nature, and its
// score is 1. With one it multiplies its weight by the survival, and roulette and splitting keep
// nu Psi^r / I in the window.
struct walk_rules {
    const char* name = "";
    double lower = 0, upper = 0; // the window; {1, 1}: exact rates
    bool zero_variance_directions = false, zero_variance_flights = false;
};
inline bool is_analogue(const walk_rules& rules) { return rules.upper == 0; }

// Of the score over I of a walker that starts at 0, moving right; and its cost, in collisions.
struct expectation {
    double mean = 0, variance = 0, collisions = 0;
};
inline double efficiency(const expectation& e) { return 1 / (e.variance * e.collisions); }

// The integral equations of a walk's moments, on a grid. A state is a walker that has arrived at a cell,
// moving right or left, and has been played: with some r = nu Psi^r / I in the window, of which there are
// some nodes. Unknown are the second moment of what it scores over I, whose mean is r, and its further
// collisions.
//
// Independent of mis/roulette.hpp: rates and moments of a number of copies are written out here.
class moment_equation {
public:
    moment_equation(const rod& of, const walk_rules& by, int cells_per_length, int nodes_in_window)
        : s(of), rules(by), cells(static_cast<int>(std::ceil(of.length * cells_per_length))),
          nodes(by.lower < by.upper ? nodes_in_window : 1), step(of.length / cells),
          estimate(adjoint(of, 0, right)) {
        for (direction d : {right, left}) {
            for (int i = 0; i < cells; ++i) {
                psi[d].push_back(adjoint(s, position(i), d));
                psi_reflected[d].push_back(reflected(s, position(i), d));
            }
            second[d].assign(psi[d].size() * index(nodes), 0);
            further[d] = second[d];
        }
        // Walkers are in the middle of a cell, and only half of it is ahead of them.
        for (int i = 0; i < cells; ++i)
            reach.push_back(i == 0 ? -std::expm1(-step / 2) : std::exp(-i * step) * 2 * std::sinh(step / 2));
        for (int m = 0; m < nodes; ++m)
            r_of.push_back(nodes == 1 ? rules.lower
                                      : rules.lower + (rules.upper - rules.lower) * m / (nodes - 1));
    }

    // By iteration, one more collision each time.
    expectation solve() {
        const auto is_settled = [](double now, double before) {
            return std::abs(now - before) <= 1e-10 * (1 + std::abs(now));
        };
        expectation now;
        for (int k = 0; k < 10'000; ++k) {
            const expectation before = now;
            iterate();
            now = of_start();
            if (k > 5 && is_settled(now.variance, before.variance) &&
                is_settled(now.collisions, before.collisions))
                break;
        }
        return now;
    }

    // Once solved: the share of the second moment that is from walks whose first flight is longer than
    // `least`, as one in e^least is.
    double share_of_long_first_flights(double least) const {
        const int first = std::min(static_cast<int>(std::ceil(least / step)), cells);
        return fly(-1, right, 1 / estimate, first).second / fly(-1, right, 1 / estimate).second;
    }

private:
    struct moments {
        double mean = 0, second = 0, further = 0;
    };

    static std::size_t index(int i) { return static_cast<std::size_t>(i); }
    double position(int i) const { return (i + 0.5) * step; }

    // What is unknown, at r: linear between two nodes.
    double interpolated(const std::vector<double>& of, int cell, double r) const {
        const double* const first = &of[index(cell) * index(nodes)];
        if (nodes == 1)
            return *first;
        const double place = (r - rules.lower) / (rules.upper - rules.lower) * (nodes - 1);
        const int m = std::clamp(static_cast<int>(place), 0, nodes - 2);
        const double t = std::clamp(place - m, 0.0, 1.0);
        return (1 - t) * first[m] + t * first[m + 1];
    }

    // A walker arrives at a cell with r and is played. Its copies are independent of one another.
    moments arrive(int cell, direction d, double r) const {
        if (is_analogue(rules))
            return {r, 0, 1 + further[d][index(cell)]};
        const double rate = r < rules.lower ? r / rules.lower : r > rules.upper ? r / rules.upper : 1;
        const double whole = std::floor(rate);
        const double pairs = whole * (whole - 1) + 2 * (rate - whole) * whole; // E[N (N - 1)]
        const double played = r / rate;
        return {r, rate * interpolated(second[d], cell, played) + pairs * played * played,
                1 + rate * interpolated(further[d], cell, played)};
    }

    // A walker of weight nu / I leaves a cell's middle, or 0, where i is -1. Only cells from `first` on
    // count.
    moments fly(int i, direction d, double weight, int first = 0) const {
        const bool starts = i < 0;
        const double psi_here = starts ? estimate : psi[d][index(i)];
        moments sum;
        const auto add = [&](double probability, const moments& m) {
            sum.mean += probability * m.mean;
            sum.second += probability * m.second;
            sum.further += probability * m.further;
        };
        const int end = d == right ? cells : -1;
        for (int j = starts ? first : i; j != end; j += d == right ? 1 : -1) {
            const double analogue =
                starts ? std::exp(-j * step) * -std::expm1(-step) : reach[index(std::abs(j - i))];
            const double psi_there = psi_reflected[d][index(j)];
            if (rules.zero_variance_flights)
                add(analogue * psi_there / psi_here, arrive(j, d, weight * psi_here));
            else
                add(analogue, arrive(j, d, weight * psi_there));
        }
        if (d == right) {
            const double analogue = std::exp((starts ? 0 : position(i)) - s.length);
            const double change = rules.zero_variance_flights ? psi_here : 1;
            add(analogue / change, {weight * change, weight * change * weight * change, 0});
        }
        return sum;
    }

    // A walker that has been played scatters and flies.
    moments scatter(int i, direction d, double r) const {
        moments sum;
        const double weight = r / psi_reflected[d][index(i)];
        for (direction e : {right, left}) {
            const double analogue = e == d ? s.forward : 1 - s.forward;
            const double share = is_analogue(rules) ? s.survival * analogue
                                 : rules.zero_variance_directions
                                     ? s.survival * analogue * psi[e][index(i)] / psi_reflected[d][index(i)]
                                     : analogue;
            if (share == 0)
                continue;
            const moments m = fly(i, e, is_analogue(rules) ? 1 : weight * s.survival * analogue / share);
            sum.second += share * m.second;
            sum.further += share * m.further;
        }
        return sum;
    }

    void iterate() {
        std::array<std::vector<double>, 2> next_second = second, next_further = further;
        for (direction d : {right, left})
            for (int i = 0; i < cells; ++i)
                for (int m = 0; m < nodes; ++m) {
                    const std::size_t k = index(i) * index(nodes) + index(m);
                    const moments next = scatter(i, d, r_of[index(m)]);
                    next_second[d][k] = next.second;
                    next_further[d][k] = next.further;
                }
        second = next_second;
        further = next_further;
    }

    expectation of_start() const {
        const moments all = fly(-1, right, 1 / estimate);
        const double variance = is_analogue(rules) ? 1 / estimate - 1 : all.second - all.mean * all.mean;
        return {all.mean, variance, all.further};
    }

    rod s;
    walk_rules rules;
    int cells, nodes;
    double step, estimate;                                 // I
    std::array<std::vector<double>, 2> psi, psi_reflected; // by direction and cell
    std::array<std::vector<double>, 2> second, further;    // by direction, cell and node
    std::vector<double> reach; // probability of colliding in the cell that is so many cells away
    std::vector<double> r_of;  // of each node
};

// ---- Simulation, by mis/roulette.hpp ----

// Rates are bounded only far out, so that windows are kept exactly.
constexpr mis::rate_bounds<double> wide_bounds{1e-9, 1e6};

// A flight from x in direction d, to y, or out of the rod: y < 0 or y > length. Returns what it multiplies
// the weight by.
template <class Uniform>
double fly(const rod& s, const walk_rules& rules, double x, direction d, Uniform&& uniform, double& y) {
    const double sign = d == right ? 1 : -1, u = uniform();
    if (!rules.zero_variance_flights) {
        y = x - sign * std::log1p(-u);
        return 1;
    }
    // Past y without a collision: e^-|y - x| Psi(y) / Psi(x), because e^-|y - x| Psi^r(y) is its derivative.
    // Where that does not fall to 1 - u in the rod, the walker leaves, on the right, where Psi is 1.
    const double here = adjoint(s, x, d);
    const auto is_past = [&](double t) {
        return std::exp(-std::abs(t - x)) * adjoint(s, t, d) > (1 - u) * here;
    };
    double begin = x, end = d == right ? s.length : 0;
    if (is_past(end)) {
        y = 2 * s.length;
        return here;
    }
    while (true) {
        y = (begin + end) / 2;
        if (!(y > std::min(begin, end) && y < std::max(begin, end)))
            break;
        (is_past(y) ? begin : end) = y;
    }
    const double analogue = std::exp(-std::abs(y - x));
    return analogue / mis::zero_variance_density(analogue, reflected(s, y, d), here);
}

struct walk_result {
    double score = 0; // over I
    long long collisions = 0;
};

// One walk and all its copies. see(x, d, nu Psi^r / I) is called for each collision whose walker goes on,
// after it has been played; analogue: before it may be absorbed.
template <class Uniform, class See>
walk_result walk(const rod& s, const walk_rules& rules, Uniform&& uniform, See&& see) {
    struct walker {
        double x;
        direction d;
        double weight; // nu
        int copies;
    };
    const double estimate = adjoint(s, 0, right);
    const mis::weight_window<double> window{rules.lower, rules.upper};
    walk_result result;
    std::vector<walker> waiting{{0, right, 1, 1}}; // to fly
    while (!waiting.empty()) {
        walker w = waiting.back();
        if (--waiting.back().copies == 0)
            waiting.pop_back();
        double y = 0;
        w.weight *= fly(s, rules, w.x, w.d, uniform, y);
        if (!(y > 0 && y < s.length)) {
            result.score += y > 0 ? w.weight / estimate : 0;
            continue;
        }
        ++result.collisions;
        const double psi = reflected(s, y, w.d);
        // With zero variance nothing is left to be played: its weights are seen as they are.
        const double rate = is_analogue(rules) ? s.survival
                            : rules.zero_variance_flights
                                ? 1
                                : mis::adjoint_rate(w.weight, psi, estimate, window, wide_bounds);
        if (!is_analogue(rules))
            w.weight /= rate;
        const int copies = mis::copies(rate, uniform());
        if (is_analogue(rules) || copies > 0)
            see(y, w.d, w.weight * psi / estimate);
        for (int i = 0; i < copies; ++i) {
            const double analogue[] = {s.forward, 1 - s.forward};
            const double ahead[] = {adjoint(s, y, w.d), adjoint(s, y, opposite(w.d))};
            double share[] = {analogue[0], analogue[1]};
            if (rules.zero_variance_directions)
                mis::zero_variance_probabilities(analogue, ahead, 2, share);
            const int turned = mis::pick(share, 2, uniform());
            const double survival = is_analogue(rules) ? 1 : s.survival;
            waiting.push_back(
                {y, turned ? opposite(w.d) : w.d, w.weight * survival * analogue[turned] / share[turned], 1});
        }
    }
    return result;
}

} // namespace studies
