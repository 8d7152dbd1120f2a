// SPDX-License-Identifier: MIT
// Floor 5: statistical checks, for a renderer's unit tests: samplers against their densities, estimates
// against each other. See verify.hpp.
#pragma once

#include <functional>
#include <limits>
#include <mis/verify/weights.hpp>

namespace mis::verify {

namespace detail {

// Regularized upper incomplete gamma function Q(a, x): the series of the lower one for small x, else the
// continued fraction by the modified Lentz method. About 12 digits for a below 1e5.
inline double upper_gamma(double a, double x) {
    if (!(x > 0))
        return 1;
    if (!is_number(x))
        return 0;
    const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
    if (x < a + 1) {
        double term = 1 / a, sum = term;
        for (int k = 1; k < 100'000 && term > sum * 1e-17; ++k)
            sum += term *= x / (a + k);
        return (std::max)(0.0, 1 - front * sum);
    }
    double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
    for (int k = 1; k < 100'000; ++k) {
        const double numerator = k * (a - k);
        b += 2;
        const auto away_from_0 = [](double y) { return std::fabs(y) < 1e-300 ? 1e-300 : y; };
        d = 1 / away_from_0(numerator * d + b);
        c = away_from_0(b + numerator / c);
        h *= d * c;
        if (std::fabs(d * c - 1) < 1e-15)
            break;
    }
    return front * h;
}

// Probability that a chi-squared variable is larger, that a standard normal one is farther from 0, and that a
// Poisson variable is at least `count`.
inline double chi_squared_tail(double statistic, double degrees) {
    return upper_gamma(degrees / 2, statistic / 2);
}
inline double normal_tails(double z) { return std::erfc(std::fabs(z) / std::sqrt(2.0)); }
inline double poisson_tail(double count, double mean) { return count > 0 ? 1 - upper_gamma(count, mean) : 1; }

// Regularized incomplete beta function I_x(a, b) by its continued fraction, for x below (a + 1) / (a + b +
// 2). y: 1 - x, which x may have lost.
inline double lower_beta(double a, double b, double x, double y) {
    const auto away_from_0 = [](double z) { return std::fabs(z) < 1e-300 ? 1e-300 : z; };
    double c = 1, d = 1 / away_from_0(1 - (a + b) * x / (a + 1)), h = d;
    const auto step = [&](double numerator) {
        d = 1 / away_from_0(1 + numerator * d);
        c = away_from_0(1 + numerator / c);
        h *= c * d;
    };
    for (int m = 1; m < 100'000; ++m) {
        step(m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)));
        step(-(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1)));
        if (std::fabs(c * d - 1) < 1e-15)
            break;
    }
    const double front = std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b);
    return h / a * std::exp(front + a * std::log(x) + b * std::log(y));
}

// Probability that a variable of Student's t distribution is farther from 0. Normal from 1e7 degrees of
// freedom on, where tails down to 1e-12 differ by less than 1e-4 of themselves.
inline double student_tails(double t, double degrees) {
    if (!(t * t > 0))
        return 1;
    if (!is_number(t * t) || degrees > 1e7)
        return normal_tails(t);
    const double x = degrees / (degrees + t * t), y = t * t / (degrees + t * t), a = degrees / 2;
    return x < (a + 1) / (a + 2.5) ? lower_beta(a, 0.5, x, y) : 1 - lower_beta(0.5, a, y, x);
}

// Where a falling function of x > 0 passes a value.
template <class F> double where_falls_to(double value, F&& f) {
    double low = 0, high = 1;
    for (; high < 1e150 && f(high) > value; high *= 2)
        low = high;
    for (int k = 0; k < 60; ++k) {
        const double middle = low + (high - low) / 2;
        (f(middle) > value ? low : high) = middle;
    }
    return high;
}

// An error is called visible where at most one run in ten misses it.
constexpr double may_be_missed = 0.1;

// The noncentrality of a chi-squared variable that is visible. Patnaik's approximation, Biometrika 36, 1949:
// for false alarms of 1e-3 and below, the share of runs that miss it is right to 1%.
inline double visible_noncentrality(double degrees, double false_alarm) {
    const double least = where_falls_to(false_alarm, [&](double x) { return chi_squared_tail(x, degrees); });
    return where_falls_to(may_be_missed, [&](double noncentrality) {
        const double of_mean = degrees + noncentrality, of_variance = degrees + 2 * noncentrality;
        return 1 - chi_squared_tail(least * of_mean / of_variance, of_mean * of_mean / of_variance);
    });
}

} // namespace detail

// A point of the unit square.
struct point {
    double x, y;
};

struct sampler_options {
    int samples = 4'000'000;
    int bins = 8; // along each axis
    double false_alarm = 1e-6;
    int refinement = 3; // each bin is cut at least this many times into four where the density is integrated
    double support = 0; // measure of the set where the density is positive; 0: not known
    double visible_error = 0.01; // of the density, that must be seen in 9 runs of 10: see square_sampler
};

namespace detail {

struct cell {
    double x, y, width, height;

    cell quarter(int k) const {
        const double w = width / 2, h = height / 2;
        return {x + (k & 1 ? w : 0), y + (k & 2 ? h : 0), w, h};
    }
    // Left and right, or lower and upper.
    cell half(bool along_x, bool second) const {
        const double w = along_x ? width / 2 : width, h = along_x ? height : height / 2;
        return {x + (along_x && second ? w : 0), y + (!along_x && second ? h : 0), w, h};
    }
    point middle() const { return {x + width / 2, y + height / 2}; }
};

// What is checked, by calls that cost little beside a sample: so all of this is compiled once, and not for
// each sampler.
using sample_function = std::function<std::optional<point>()>;
using density_function = std::function<double(point)>;

inline double two_point_gauss(const density_function& f, const cell& c) {
    constexpr double offset = 0.28867513459481288225; // 1 / (2 sqrt 3)
    const double low = 0.5 - offset, high = 0.5 + offset;
    const auto at = [&](double u, double v) { return f(point{c.x + u * c.width, c.y + v * c.height}); };
    return (at(low, low) + at(high, low) + at(low, high) + at(high, high)) * c.width * c.height / 4;
}

struct quadrature {
    double absolute;    // error that does not matter
    int least, at_most; // how often a cell is cut
};

inline double integrate(const density_function& f, const cell& c, double coarse, const quadrature& q,
                        int depth = 0) {
    double parts[4], fine = 0;
    for (int k = 0; k < 4; ++k)
        fine += parts[k] = two_point_gauss(f, c.quarter(k));
    const bool settled = std::fabs(fine - coarse) <= (std::max)(q.absolute, 1e-4 * std::fabs(fine));
    if (depth + 1 >= q.at_most || (settled && depth + 1 >= q.least))
        return fine;
    fine = 0;
    for (int k = 0; k < 4; ++k)
        fine += integrate(f, c.quarter(k), parts[k], q, depth + 1);
    return fine;
}

struct bin {
    double expected = 0; // as a probability first, then as a count
    double observed = 0;
    std::string place;
};

// A cell of the grid, or a half of another node.
struct bin_node {
    cell where;
    double mass;     // integral of the density
    int halves = -1; // place of the first; the second follows. None: it is a bin
    bool along_x = true;
};

// Calls of a density, and the first result that no density may have.
struct watched_density {
    const density_function& pdf;
    std::optional<point> faulty = {};
    double fault = 0;

    double operator()(point at) {
        const double p = pdf(at);
        if (fault_of(p).empty())
            return p;
        if (!faulty) {
            faulty = at;
            fault = p;
        }
        return 0;
    }
};

// The mean of min(1 / p, cap). 1 / p itself may have no variance, and its mean is far from normally
// distributed: with a cap of 100 supports instead of 10, four times too many right samplers failed.
struct inverse_density {
    double cap, sum = 0, sum_of_squares = 0;

    void add(double p) {
        const double x = p * cap > 1 ? 1 / p : cap;
        sum += x;
        sum_of_squares += x * x;
    }
};

// What a domain other than the unit square says about itself.
struct domain {
    double measure; // of the whole square
    const char* unit;
    const char* outside;
    std::function<std::string(point)> place;
};

inline std::string interval(const char* name, double from, double to) {
    return std::string(name) + " in [" + text(from) + ", " + text(to) + ")";
}

inline std::string place_of_bin(const domain& where, const cell& c) {
    return interval("u", c.x, c.x + c.width) + ", " + interval("v", c.y, c.y + c.height) +
           where.place(c.middle());
}

// Puts all bins with less than `least` expected counts into one, and that one, if still too small, into the
// largest.
inline std::vector<bin> pooled(const std::vector<bin>& bins, double least) {
    std::vector<bin> kept;
    bin rest{0, 0, "bins of small expectation"};
    for (const bin& b : bins) {
        if (b.expected >= least) {
            kept.push_back(b);
        } else {
            rest.expected += b.expected;
            rest.observed += b.observed;
        }
    }
    if (rest.expected >= least || kept.empty()) {
        kept.push_back(rest);
        return kept;
    }
    auto largest = std::max_element(kept.begin(), kept.end(),
                                    [](const bin& a, const bin& b) { return a.expected < b.expected; });
    largest->expected += rest.expected;
    largest->observed += rest.observed;
    return kept;
}

inline double deviation(const bin& b) {
    return (b.observed - b.expected) / std::sqrt((std::max)(b.expected, 1e-300));
}

struct chi_squared_test {
    double statistic = 0, degrees = 0, p_value = 1;
    bin worst;
};

inline chi_squared_test chi_squared(const std::vector<bin>& bins) {
    chi_squared_test test;
    test.degrees = static_cast<double>(bins.size()) - 1;
    for (const bin& b : bins) {
        test.statistic += deviation(b) * deviation(b);
        if (std::fabs(deviation(b)) >= std::fabs(deviation(test.worst)))
            test.worst = b;
    }
    if (test.degrees > 0)
        test.p_value = chi_squared_tail(test.statistic, test.degrees);
    return test;
}

inline std::string percent(double share) { return text(100 * share) + "%"; }
inline std::string percent_of_samples(double mass) { return percent(mass) + " of the samples"; }

constexpr double least_expected = 10;     // samples per bin of the chi-squared test
constexpr double quadrature_error = 1e-4; // of the density's integral

// What is expected of a sampler and what it does.
struct tally {
    double support; // its share of the square
    inverse_density inverse;
    std::vector<bin_node> nodes = {};  // the grid's first
    std::vector<double> observed = {}; // of each node that is a bin
    double mass = 0;                   // integral of the density
    double beyond_cap = 0;             // what the cap takes away from the mean of 1 / p
    double lost = 0, impossible = 0;
    point impossible_at{0, 0};
};

// Halves a node across the axis along which the density changes most, so that each half has its own share of
// a peak's flank; where it changes little, across the longer side.
inline void halve(std::vector<bin_node>& nodes, std::size_t k, const density_function& density,
                  const quadrature& rule) {
    const cell c = nodes[k].where;
    double q[4];
    for (int i = 0; i < 4; ++i)
        q[i] = integrate(density, c.quarter(i), 0, rule);
    const double left = q[0] + q[2], right = q[1] + q[3], low = q[0] + q[1], high = q[2] + q[3];
    const double across_x = std::fabs(left - right), across_y = std::fabs(low - high);
    const bool is_even = std::fabs(across_x - across_y) < 0.05 * (left + right);
    const bool along_x = is_even ? c.width >= c.height : across_x > across_y;
    nodes[k].along_x = along_x;
    nodes[k].halves = static_cast<int>(nodes.size());
    nodes.push_back({c.half(along_x, false), along_x ? left : low});
    nodes.push_back({c.half(along_x, true), along_x ? right : high});
}

// The bins: a grid, and heavy cells of it halved until none has much more than a bin's share of the samples,
// so that a density with a narrow peak has no less to be compared than a flat one.
inline void make_bins(const density_function& density, const sampler_options& o, tally& t) {
    // Each leaf of the quadrature may be wrong by a thousandth of a sample.
    const quadrature rule{1e-3 / o.samples, o.refinement, o.refinement + 7};
    const density_function capped_part = [&](point at) {
        const double p = density(at);
        return p > 0 ? (std::max)(0.0, 1 - t.inverse.cap * p) : 0.0;
    };
    const double size = 1.0 / o.bins;
    for (int k = 0; k < o.bins * o.bins; ++k) {
        const int row = k / o.bins, column = k % o.bins;
        const cell c{size * column, size * row, size, size};
        t.nodes.push_back({c, integrate(density, c, 0, rule)});
        if (o.support > 0)
            t.beyond_cap += integrate(capped_part, c, 0, rule);
    }
    constexpr double heavy = 1.5, smallest = 1e-12; // share of a bin; area of a cell that may be halved
    for (std::size_t k = 0; k < t.nodes.size(); ++k) {
        const bin_node node = t.nodes[k];
        if (node.mass > heavy * size * size && node.where.width * node.where.height > smallest)
            halve(t.nodes, k, density, rule);
        else
            t.mass += node.mass;
    }
    t.observed.resize(t.nodes.size());
}

inline std::size_t bin_of(const std::vector<bin_node>& nodes, int grid, point p) {
    const auto along = [&](double x) { return (std::min)(static_cast<int>(x * grid), grid - 1); };
    const auto row = static_cast<std::size_t>(along(p.y)), column = static_cast<std::size_t>(along(p.x));
    std::size_t k = row * static_cast<std::size_t>(grid) + column;
    while (nodes[k].halves >= 0) {
        const point middle = nodes[k].where.middle();
        const bool second = nodes[k].along_x ? p.x >= middle.x : p.y >= middle.y;
        k = static_cast<std::size_t>(nodes[k].halves) + second;
    }
    return k;
}

// False if a sample is outside the square.
inline bool count_samples(const sample_function& sample, watched_density& density, const sampler_options& o,
                          tally& t) {
    for (int k = 0; k < o.samples; ++k) {
        const std::optional<point> p = sample();
        if (!p) {
            t.lost += 1;
            continue;
        }
        if (!is_number(p->x) || !is_number(p->y) || !(p->x >= 0 && p->x <= 1 && p->y >= 0 && p->y <= 1))
            return false;
        t.observed[bin_of(t.nodes, o.bins, *p)] += 1;
        const double d = density(*p);
        if (d > 0) {
            t.inverse.add(d);
        } else {
            t.impossible += 1;
            t.impossible_at = *p;
        }
    }
    return true;
}

// How far the mean of 1 / p is from the measure of the support, and how far it may be by chance. The integral
// of what the cap takes away may be as wrong as that of the density. 1 / p is between 0 and the cap and far
// from normal, so the bound is one for any such distribution: the empirical Bernstein bound, A. Maurer and
// M. Pontil 2009, theorem 4.
struct support_test {
    double difference = 0, bound = 0;
    bool passes() const { return std::fabs(difference) <= bound; }
};
inline support_test compare_support(const tally& t, double samples, double false_alarm) {
    const double mean = t.inverse.sum / samples, log = std::log(4 / false_alarm);
    const double variance =
        (std::max)(0.0, t.inverse.sum_of_squares - samples * mean * mean) / (std::max)(1.0, samples - 1);
    const double by_chance = std::sqrt(2 * variance * log / samples) +
                             7 * t.inverse.cap * log / (3 * (std::max)(1.0, samples - 1));
    return {mean + t.beyond_cap - t.support, by_chance + quadrature_error * t.support};
}

// All bins with what is expected of them in `total` samples.
inline std::vector<bin> bins_of(const tally& t, double total, const domain& where) {
    std::vector<bin> bins;
    for (std::size_t k = 0; k < t.nodes.size(); ++k)
        if (t.nodes[k].halves < 0)
            bins.push_back({t.nodes[k].mass * total, t.observed[k], place_of_bin(where, t.nodes[k].where)});
    return bins;
}

// The smallest error of a density that the test sees: relative, root mean square over all samples that are in
// bins of their own. Infinite where there is nothing to see it by.
inline double visible_error(const std::vector<bin>& bins, double degrees, double false_alarm) {
    double samples = 0;
    for (const bin& b : bins)
        samples += b.expected >= least_expected ? b.expected : 0;
    return degrees > 0 && samples > 0 ? std::sqrt(visible_noncentrality(degrees, false_alarm) / samples)
                                      : std::numeric_limits<double>::infinity();
}

// Lost samples are a bin of the chi-squared test if enough are expected, else they have a Poisson test of
// their own.
inline result judge(const tally& t, const sampler_options& o, const domain& where) {
    const double samples = o.samples;
    const double expected_lost = (std::max)(0.0, 1 - t.mass) * samples;
    const bool lost_is_a_bin = expected_lost >= (std::max)(least_expected, 10 * quadrature_error * samples);
    const double total = lost_is_a_bin ? samples : (samples - t.lost) / t.mass;
    const int tests = 1 + (lost_is_a_bin ? 0 : 1) + (o.support > 0 ? 1 : 0);
    const double threshold = o.false_alarm / tests;

    const std::vector<bin> all = bins_of(t, total, where);
    std::vector<bin> bins = pooled(all, least_expected);
    const double degrees =
        static_cast<double>(bins.size()) - 1; // without a bin of lost samples, which tells no shape
    const double visible = visible_error(all, degrees, threshold);
    if (lost_is_a_bin)
        bins.push_back({expected_lost, t.lost, "samples lost"});

    const chi_squared_test chi = chi_squared(bins);
    const support_test support = o.support > 0 ? compare_support(t, samples, threshold) : support_test{};
    const double lost_p_value =
        lost_is_a_bin ? 1 : poisson_tail(t.lost, expected_lost + quadrature_error * samples);
    const bool fits = chi.p_value >= threshold, loses_right = lost_p_value >= threshold;

    std::string message = "chi-squared " + text(chi.statistic) + " with " + text(chi.degrees) +
                          " degrees of freedom, p-value " + text(chi.p_value);
    if (!fits)
        message += " is below " + text(threshold) +
                   ", the sampler does not have this density\n  worst: " + chi.worst.place + ", " +
                   text(chi.worst.observed) + " samples, expected " + text(chi.worst.expected);
    if (!fits && t.mass < 0.9 * (1 - t.lost / samples))
        message += "\n  the density integrates to " + text(t.mass) +
                   ": if it is known to be right, raise refinement, a peak has been missed";
    if (!loses_right)
        message += "\n  " + percent_of_samples(t.lost / samples) +
                   " are lost, though the density integrates to " + text(t.mass);
    if (!support.passes())
        message += "\n  the mean of 1/p is " +
                   text((t.inverse.sum / samples + t.beyond_cap) * where.measure) + where.unit +
                   ", the support measures " + text(t.support * where.measure) + where.unit +
                   " (by chance they differ by " + text(support.bound * where.measure) + " at most)";
    if (!fits || !loses_right || !support.passes())
        return {false, message};
    if (degrees < 1)
        return undecided(message + "; all samples are expected in one bin, nothing is compared");
    if (!(visible <= o.visible_error)) {
        const double times = visible / o.visible_error, enough = 1.1 * samples * times * times;
        return undecided(message + "; an error of " + percent(visible) + " could be missed. To see " +
                         percent(o.visible_error) + ", take " +
                         std::to_string(static_cast<long long>((std::min)(enough, 1e18))) +
                         " samples, or fewer bins");
    }
    return {true, message + "; an error of " + percent(visible) + " would be seen"};
}

// Where it is 0, or as good as 0, everything passes.
inline bool is_false_alarm(double x) { return is_number(x) && x >= 1e-100 && x < 1; }

// Why options let nothing be decided; empty if they are all right.
inline std::string fault_of(const sampler_options& o) {
    const double bins = o.bins, samples = o.samples, least = least_expected * bins * bins;
    if (o.bins < 1)
        return "no bins (bins is " + text(bins) + ")";
    if (samples < least || o.samples < 1)
        return text(samples) + " samples are too few for " + text(bins) + " x " + text(bins) +
               " bins, which need " + text(least) + " and more";
    if (!is_false_alarm(o.false_alarm))
        return "false_alarm is " + text(o.false_alarm) + ", not from 1e-100 to below 1";
    if (!is_number(o.visible_error) || !(o.visible_error > 0))
        return "visible_error is " + text(o.visible_error) + ", not a positive number";
    if (!is_number(o.support) || !(o.support >= 0))
        return "support is " + text(o.support) + ", neither a measure nor 0";
    if (o.refinement < 0 || o.refinement > 10)
        return "refinement is " + text(o.refinement) + ", not from 0 to 10";
    return "";
}

// Everything about a sampler whose domain has been mapped to the unit square, area-preserving but for the
// constant factor domain.measure.
inline result check_sampler(const sample_function& sample, const density_function& pdf,
                            const sampler_options& o, const domain& where) {
    if (const std::string fault = fault_of(o); !fault.empty())
        return undecided(fault);
    const auto at = [&](point p) { return "(" + text(p.x) + ", " + text(p.y) + ")" + where.place(p); };
    const double support = (o.support > 0 ? o.support : where.measure) / where.measure;
    watched_density density{pdf};
    tally t{support, {10 * support}};
    make_bins(std::ref(density), o, t);
    if (!count_samples(sample, density, o, t))
        return {false, where.outside};
    if (density.faulty)
        return {false, "the density is " + text(density.fault) + " at " + at(*density.faulty)};
    if (t.mass > 1 + 10 * quadrature_error)
        return {false, "the density integrates to " + text(t.mass) + ", more than 1"};
    if (t.impossible > 1e-4 * o.samples)
        return {false, percent_of_samples(t.impossible / o.samples) +
                           " are where the density is 0, the last at " + at(t.impossible_at)};
    return judge(t, o, where);
}

} // namespace detail

// A sampler of the unit square against its density. sample() returns std::optional<point>, empty where it
// makes no sample (absorption, a direction below the surface), and pdf(point) its density per unit area,
// whose integral may be less than 1 by what is lost so.
//
//   - chi-squared over bins x bins equal squares, whose expectations are integrals of the density. Those with
//     more than 1.5 of 1 / bins^2 are halved until none has, those with less than 10 expected samples are
//     pooled; lost samples are a bin of their own;
//   - if the support is given, the mean of 1 / p against its measure (1 / p is capped at ten supports,
//     and what the cap takes away is integrated);
//   - samples where the density is 0 fail beyond one in 10,000, as rounding may make a few.
//
// A right sampler fails with probability false_alarm in all. A density that is wrong by visible_error
// (relative, root mean square over the samples, from bin to bin) passes with probability 1/10 at most: what
// could not see as much is undecided, and the message says how many samples would. Half the error takes four
// times the samples; with 8 x 8 bins of like expectation, 1.1 million see 1%, and the default of 4 million
// sees 0.5%, as of a slope of 1% from the middle to the edge. More bins see finer structure, and need more
// samples for errors of the same size; one bin compares nothing.
//
// Peaks narrower than 1 / bins / 2^refinement may be missed by the integration, which shows as a density that
// integrates to less than 1: raise `refinement`.
template <class Sample, class Pdf>
result square_sampler(Sample&& sample, Pdf&& pdf, const sampler_options& options = {}) {
    const detail::domain square{1, "", "a sample is outside the unit square",
                                [](point) { return std::string(); }};
    return detail::check_sampler([&]() -> std::optional<point> { return sample(); },
                                 [&](point at) { return static_cast<double>(pdf(at)); }, options, square);
}

// The same for unit vectors and densities per solid angle. sample() returns an optional of any vector type
// with operator[], made from three numbers in braces (GLM, Eigen, std::array); pdf takes it. The bins are
// equal in z and azimuth; `support` is in steradians, 2 pi for a hemisphere.
template <class Sample, class Pdf>
result direction_sampler(Sample&& sample, Pdf&& pdf, const sampler_options& options = {}) {
    using Vec = typename std::decay_t<decltype(sample())>::value_type;
    using T = std::decay_t<decltype(std::declval<const Vec&>()[0])>;
    const double sphere = 4 * detail::pi;
    const auto direction = [](point at) {
        const double z = 1 - 2 * at.x, azimuth = 2 * detail::pi * at.y;
        const double sine = std::sqrt((std::max)(0.0, 1 - z * z));
        return Vec{static_cast<T>(sine * std::cos(azimuth)), static_cast<T>(sine * std::sin(azimuth)),
                   static_cast<T>(z)};
    };
    const auto on_square = [&]() -> std::optional<point> {
        const std::optional<Vec> d = sample();
        if (!d)
            return std::nullopt;
        const double x = static_cast<double>((*d)[0]), y = static_cast<double>((*d)[1]),
                     z = static_cast<double>((*d)[2]);
        const double length2 = x * x + y * y + z * z;
        if (!is_number(length2) || std::fabs(length2 - 1) > 1e-3)
            return point{-1, -1};
        const double turn = std::atan2(y, x) / (2 * detail::pi);
        return point{(std::min)(1.0, (std::max)(0.0, (1 - z) / 2)), turn < 0 ? turn + 1 : turn};
    };
    const auto density = [&](point at) { return sphere * static_cast<double>(pdf(direction(at))); };
    const auto place = [&](point at) {
        const Vec d = direction(at);
        return " about direction (" + detail::text(static_cast<double>(d[0])) + ", " +
               detail::text(static_cast<double>(d[1])) + ", " + detail::text(static_cast<double>(d[2])) + ")";
    };
    const detail::domain unit_sphere{sphere, " sr", "a sampled direction is not of length 1", place};
    return detail::check_sampler(on_square, density, options, unit_sphere);
}

// The mean of samples. Give it pixels, images or batches of samples rather than single contributions where
// those are rare and large: the checks take means to be normally distributed.
struct running_mean {
    double count = 0, sum = 0, sum_of_squares = 0;

    running_mean& operator+=(const running_mean& other) {
        count += other.count;
        sum += other.sum;
        sum_of_squares += other.sum_of_squares;
        return *this;
    }
};

inline void add(running_mean& m, double sample) { m += {1, sample, sample * sample}; }
inline double mean(const running_mean& m) { return m.count > 0 ? m.sum / m.count : 0; }

// The squared standard error of the mean, 0 below two samples.
inline double variance_of_mean(const running_mean& m) {
    if (m.count < 2)
        return 0;
    const double spread = m.sum_of_squares - m.sum * m.sum / m.count;
    return (std::max)(0.0, spread) / ((m.count - 1) * m.count);
}

namespace detail {

// Two means, compared. Both exact: the samples of neither vary.
struct mean_test {
    double error = 0, t = 0,
           degrees = 0; // of the difference: standard error, in such errors; see estimates_agree

    bool is_exact() const { return !(error > 0); }
    // Of the means, that shows at this false-alarm rate in nine runs of ten.
    double visible_difference(double false_alarm) const {
        const auto tails = [&](double x) { return student_tails(x, degrees); };
        return error * (where_falls_to(false_alarm, tails) + where_falls_to(2 * may_be_missed, tails));
    }
};
inline mean_test test_of(const running_mean& a, const running_mean& b) {
    const double variance_a = variance_of_mean(a), variance_b = variance_of_mean(b);
    mean_test test;
    test.error = std::sqrt(variance_a + variance_b);
    if (test.is_exact())
        return test;
    test.t = (mean(a) - mean(b)) / test.error;
    const double fewest = !(variance_a > 0)   ? b.count
                          : !(variance_b > 0) ? a.count
                                              : (std::min)(a.count, b.count);
    test.degrees = fewest - 1;
    return test;
}

} // namespace detail

struct named_estimate {
    std::string subset; // of techniques, for the message
    int path_length;    // estimates are compared with those of the same length
    running_mean value;
};

// All estimates of one path length have one mean, whatever techniques they come from: every pair by Welch's
// t-test, with the false-alarm rate of the whole table (Bonferroni). The degrees of freedom are those of the
// estimate with fewer samples, with which the test is never too strict for normal samples, however few and
// however different in variance: M. R. Mickey and M. B. Brown, Annals of Mathematical Statistics 37, 1966.
// Means closer than `rounding` times their size agree, whatever the variance.
//
// An estimate whose samples are all the same, as where a subset has never hit, counts as exact: two such
// agree if they are equal, and the message says so where one disagrees with another. Either its techniques
// are missing something or it needs more samples.
//
// Undecided, unless a pair disagrees: a table with an estimate of less than two samples, without a pair to
// compare or only with pairs of which neither has ever hit, or with a pair that would agree in more than one
// run of ten although its means differ by visible_error of the larger.
inline result estimates_agree(const std::vector<named_estimate>& estimates, double false_alarm = 1e-6,
                              double rounding = 1e-6, double visible_error = 0.1) {
    std::vector<std::string> faults, too_few, complaints;
    std::vector<std::pair<const named_estimate*, const named_estimate*>> pairs;
    for (std::size_t i = 0; i < estimates.size(); ++i) {
        const auto& e = estimates[i];
        const std::string name = e.subset + ", path length " + std::to_string(e.path_length);
        if (!is_number(e.value.count) || !is_number(e.value.sum) || !is_number(e.value.sum_of_squares))
            faults.push_back(name + ": a sample is NaN or infinite");
        else if (e.value.count < 2)
            too_few.push_back(name + ": fewer than two samples");
        for (std::size_t j = 0; j < i; ++j)
            if (estimates[j].path_length == e.path_length)
                pairs.emplace_back(&estimates[j], &e);
    }
    if (!faults.empty())
        return {false, "estimates cannot be compared:" + detail::list(faults)};
    if (!too_few.empty())
        return detail::undecided("estimates cannot be compared:" + detail::list(too_few));
    if (pairs.empty())
        return detail::undecided("estimates cannot be compared: no two have the same path length");
    if (!detail::is_false_alarm(false_alarm))
        return detail::undecided("false_alarm is " + detail::text(false_alarm) +
                                 ", not from 1e-100 to below 1");

    const double threshold = false_alarm / static_cast<double>(pairs.size());
    std::size_t dark = 0;
    for (const auto& [a, b] : pairs) {
        const double larger = (std::max)(std::fabs(mean(a->value)), std::fabs(mean(b->value)));
        const double difference = std::fabs(mean(a->value) - mean(b->value));
        const detail::mean_test test = detail::test_of(a->value, b->value);
        const std::string names = "path length " + std::to_string(a->path_length) + ": ";
        dark += !(larger > 0) && test.is_exact();
        const bool is_close = difference <= rounding * larger;
        if (is_close || (!test.is_exact() && detail::student_tails(test.t, test.degrees) >= threshold)) {
            if (const double visible = test.is_exact() ? 0 : test.visible_difference(threshold);
                !(visible <= visible_error * larger))
                too_few.push_back(names + a->subset + " and " + b->subset + ", means of " +
                                  detail::text(mean(a->value)) + " and " + detail::text(mean(b->value)) +
                                  ", could differ by " + detail::text(visible) + " unseen");
            continue;
        }
        std::string line = names;
        for (const auto* e : {a, b})
            line += e->subset + " " + detail::text(mean(e->value)) + " +- " +
                    detail::text(std::sqrt(variance_of_mean(e->value))) +
                    (variance_of_mean(e->value) > 0                          ? ""
                     : std::fabs(e->value.sum) + e->value.sum_of_squares > 0 ? " (all samples the same)"
                                                                             : " (never hit)") +
                    (e == a ? ", " : "");
        complaints.push_back(line + (test.is_exact() ? "" : ", t = " + detail::text(test.t)));
    }
    const std::string pairs_text = std::to_string(pairs.size()) + " pairs of estimates";
    if (!complaints.empty())
        return {false, std::to_string(complaints.size()) + " of " + pairs_text + " disagree (false alarm " +
                           detail::text(false_alarm) + " in all):" + detail::list(complaints)};
    if (dark == pairs.size())
        return detail::undecided("no estimate has ever hit, nothing is compared");
    if (!too_few.empty())
        return detail::undecided(pairs_text + " agree, but a difference of " +
                                 detail::percent(visible_error) +
                                 " might not be seen:" + detail::list(too_few));
    return {true, pairs_text + " agree" +
                      (dark > 0 ? ", in " + std::to_string(dark) + " of them neither has ever hit" : "")};
}

} // namespace mis::verify
