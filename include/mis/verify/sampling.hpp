// SPDX-License-Identifier: MIT
// Floor 5: statistical checks, for a renderer's unit tests: samplers against their densities, estimates
// against each other. See verify.hpp.
#pragma once

#include <mis/verify/weights.hpp>

namespace mis::verify {

namespace detail {

// Regularized upper incomplete gamma function Q(a, x): the series of the lower one for small x, else the
// continued fraction by the modified Lentz method. About 12 digits for a below 1e5.
inline double upper_gamma(double a, double x) {
    if (!(x > 0))
        return 1;
    const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
    if (x < a + 1) {
        double term = 1 / a, sum = term;
        for (int k = 1; k < 100'000 && term > sum * 1e-17; ++k)
            sum += term *= x / (a + k);
        return std::max(0.0, 1 - front * sum);
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

} // namespace detail

// A point of the unit square.
struct point {
    double x, y;
};

struct sampler_options {
    int samples = 100'000;
    int bins = 16; // along each axis
    double false_alarm = 1e-6;
    int refinement = 2; // each bin is cut at least this many times into four where the density is integrated
    double support = 0; // measure of the set where the density is positive; 0: not known
};

namespace detail {

struct cell {
    double x, y, size;

    cell quarter(int k) const {
        const double half = size / 2;
        return {x + (k & 1 ? half : 0), y + (k & 2 ? half : 0), half};
    }
};

template <class F> double two_point_gauss(F& f, const cell& c) {
    constexpr double offset = 0.28867513459481288225; // 1 / (2 sqrt 3)
    const double low = (0.5 - offset) * c.size, high = (0.5 + offset) * c.size;
    return (f(point{c.x + low, c.y + low}) + f(point{c.x + high, c.y + low}) +
            f(point{c.x + low, c.y + high}) + f(point{c.x + high, c.y + high})) *
           c.size * c.size / 4;
}

struct quadrature {
    double absolute;    // error that does not matter
    int least, at_most; // how often a cell is cut
};

template <class F> double integrate(F& f, const cell& c, double coarse, const quadrature& q, int depth = 0) {
    double parts[4], fine = 0;
    for (int k = 0; k < 4; ++k)
        fine += parts[k] = two_point_gauss(f, c.quarter(k));
    const bool settled = std::fabs(fine - coarse) <= std::max(q.absolute, 1e-4 * std::fabs(fine));
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

// Calls of a density, and the first result that no density may have.
template <class Pdf> struct watched_density {
    Pdf& pdf;
    std::optional<point> faulty = {};
    double fault = 0;

    double operator()(point at) {
        const double p = static_cast<double>(pdf(at));
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
template <class Place> struct domain {
    double measure; // of the whole square
    const char* unit;
    const char* outside;
    Place place;
};

inline std::string interval(const char* name, double from, double to) {
    return std::string(name) + " in [" + text(from) + ", " + text(to) + ")";
}

template <class Place> std::string place_of_bin(const Place& place, const cell& c) {
    return interval("u", c.x, c.x + c.size) + ", " + interval("v", c.y, c.y + c.size) +
           place(point{c.x + c.size / 2, c.y + c.size / 2});
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
    return (b.observed - b.expected) / std::sqrt(std::max(b.expected, 1e-300));
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

inline std::string percent_of_samples(double mass) { return text(100 * mass) + "% of the samples"; }

constexpr double least_expected = 10;     // samples per bin of the chi-squared test
constexpr double quadrature_error = 1e-4; // of the density's integral

// What is expected of a sampler and what it does.
struct tally {
    double support; // its share of the square
    inverse_density inverse;
    std::vector<bin> bins = {};
    double mass = 0;       // integral of the density
    double beyond_cap = 0; // what the cap takes away from the mean of 1 / p
    double lost = 0, impossible = 0;
    point impossible_at{0, 0};
};

template <class Pdf, class Place>
void integrate_bins(watched_density<Pdf>& density, const sampler_options& o, const Place& place, tally& t) {
    // Each leaf of the quadrature may be wrong by a thousandth of a sample.
    const quadrature rule{1e-3 / o.samples, o.refinement, o.refinement + 7};
    auto capped_part = [&](point at) {
        const double p = density(at);
        return p > 0 ? std::max(0.0, 1 - t.inverse.cap * p) : 0.0;
    };
    const double size = 1.0 / o.bins;
    for (int k = 0; k < o.bins * o.bins; ++k) {
        const int row = k / o.bins, column = k % o.bins;
        const cell c{size * column, size * row, size};
        t.bins.push_back({integrate(density, c, 0, rule), 0, place_of_bin(place, c)});
        t.mass += t.bins.back().expected;
        if (o.support > 0)
            t.beyond_cap += integrate(capped_part, c, 0, rule);
    }
}

// False if a sample is outside the square.
template <class Sample, class Pdf>
bool count_samples(Sample& sample, watched_density<Pdf>& density, const sampler_options& o, tally& t) {
    const auto along = [&](double x) { return std::min(static_cast<int>(x * o.bins), o.bins - 1); };
    for (int k = 0; k < o.samples; ++k) {
        const std::optional<point> p = sample();
        if (!p) {
            t.lost += 1;
            continue;
        }
        if (!is_number(p->x) || !is_number(p->y) || !(p->x >= 0 && p->x <= 1 && p->y >= 0 && p->y <= 1))
            return false;
        t.bins[static_cast<std::size_t>(along(p->y) * o.bins + along(p->x))].observed += 1;
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

// Whether the mean of 1 / p is the measure of the support, in standard errors. The integral of what the cap
// takes away may be as wrong as that of the density.
inline double support_deviation(const tally& t, double samples) {
    const double mean = t.inverse.sum / samples;
    const double variance = std::max(0.0, t.inverse.sum_of_squares / samples - mean * mean) / samples;
    const double difference = mean + t.beyond_cap - t.support;
    const double beyond_quadrature = std::max(0.0, std::fabs(difference) - quadrature_error * t.support);
    return std::copysign(beyond_quadrature, difference) / (std::sqrt(variance) + 1e-3 * quadrature_error);
}

// Lost samples are a bin of the chi-squared test if enough are expected, else they have a Poisson test of
// their own.
template <class Place> result judge(const tally& t, const sampler_options& o, const domain<Place>& where) {
    const double samples = o.samples;
    const double expected_lost = std::max(0.0, 1 - t.mass) * samples;
    const bool lost_is_a_bin = expected_lost >= std::max(least_expected, 10 * quadrature_error * samples);
    const double total = lost_is_a_bin ? samples : (samples - t.lost) / t.mass;
    std::vector<bin> bins = t.bins;
    for (bin& b : bins)
        b.expected *= total;
    bins = pooled(bins, least_expected);
    if (lost_is_a_bin)
        bins.push_back({expected_lost, t.lost, "samples lost"});

    const chi_squared_test chi = chi_squared(bins);
    const double z = o.support > 0 ? support_deviation(t, samples) : 0;
    const double lost_p_value =
        lost_is_a_bin ? 1 : poisson_tail(t.lost, expected_lost + quadrature_error * samples);
    const int tests = 1 + (lost_is_a_bin ? 0 : 1) + (o.support > 0 ? 1 : 0);
    const double threshold = o.false_alarm / tests;
    const bool fits = chi.p_value >= threshold, loses_right = lost_p_value >= threshold,
               covers = normal_tails(z) >= threshold;

    std::string message = "chi-squared " + text(chi.statistic) + " with " + text(chi.degrees) +
                          " degrees of freedom, p-value " + text(chi.p_value);
    if (!fits)
        message += " is below " + text(threshold) +
                   ", the sampler does not have this density\n  worst: " + chi.worst.place + ", " +
                   text(chi.worst.observed) + " samples, expected " + text(chi.worst.expected);
    if (!loses_right)
        message += "\n  " + percent_of_samples(t.lost / samples) +
                   " are lost, though the density integrates to " + text(t.mass);
    if (!covers)
        message += "\n  the mean of 1/p is " +
                   text((t.inverse.sum / samples + t.beyond_cap) * where.measure) + where.unit +
                   ", the support measures " + text(t.support * where.measure) + where.unit +
                   " (z = " + text(z) + ")";
    return {fits && loses_right && covers, message};
}

// Everything about a sampler whose domain has been mapped to the unit square, area-preserving but for the
// constant factor domain.measure.
template <class Sample, class Pdf, class Place>
result check_sampler(Sample& sample, Pdf& pdf, const sampler_options& o, const domain<Place>& where) {
    const auto at = [&](point p) { return "(" + text(p.x) + ", " + text(p.y) + ")" + where.place(p); };
    const double support = (o.support > 0 ? o.support : where.measure) / where.measure;
    watched_density<Pdf> density{pdf};
    tally t{support, {10 * support}};
    integrate_bins(density, o, where.place, t);
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
//   - chi-squared over bins x bins equal squares, whose expectations are integrals of the density; those with
//     less than 10 expected samples are pooled, lost samples are a bin of their own;
//   - if the support is given, the mean of 1 / p against its measure (1 / p is capped at ten supports,
//     and what the cap takes away is integrated);
//   - samples where the density is 0 fail beyond one in 10,000, as rounding may make a few.
//
// A right sampler fails with probability false_alarm in all. Peaks narrower than a bin / 2^refinement may be
// missed by the integration: raise `bins` or `refinement`.
template <class Sample, class Pdf>
result square_sampler(Sample&& sample, Pdf&& pdf, const sampler_options& options = {}) {
    const auto nothing_to_add = [](point) { return std::string(); };
    const detail::domain<decltype(nothing_to_add)> square{1, "", "a sample is outside the unit square",
                                                          nothing_to_add};
    return detail::check_sampler(sample, pdf, options, square);
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
        const double sine = std::sqrt(std::max(0.0, 1 - z * z));
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
        return point{std::min(1.0, std::max(0.0, (1 - z) / 2)), turn < 0 ? turn + 1 : turn};
    };
    const auto density = [&](point at) { return sphere * static_cast<double>(pdf(direction(at))); };
    const auto place = [&](point at) {
        const Vec d = direction(at);
        return " about direction (" + detail::text(static_cast<double>(d[0])) + ", " +
               detail::text(static_cast<double>(d[1])) + ", " + detail::text(static_cast<double>(d[2])) + ")";
    };
    const detail::domain<decltype(place)> unit_sphere{sphere, " sr", "a sampled direction is not of length 1",
                                                      place};
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
    return std::max(0.0, spread) / ((m.count - 1) * m.count);
}

struct named_estimate {
    std::string subset; // of techniques, for the message
    int path_length;    // estimates are compared with those of the same length
    running_mean value;
};

// All estimates of one path length have one mean, whatever techniques they come from: every pair by a z-test,
// with the false-alarm rate of the whole table (Bonferroni). Means closer than `rounding` times their size
// agree, whatever the variance.
//
// An estimate whose samples are all the same, as where a subset has never hit, counts as exact: two such
// agree if they are equal, and the message says so where one disagrees with another. Either its techniques
// are missing something or it needs more samples. Estimates of less than two samples and tables without a
// pair to compare fail.
inline result estimates_agree(const std::vector<named_estimate>& estimates, double false_alarm = 1e-6,
                              double rounding = 1e-6) {
    std::vector<std::string> complaints;
    std::vector<std::pair<const named_estimate*, const named_estimate*>> pairs;
    for (std::size_t i = 0; i < estimates.size(); ++i) {
        const auto& e = estimates[i];
        const std::string name = e.subset + ", path length " + std::to_string(e.path_length);
        if (e.value.count < 2)
            complaints.push_back(name + ": fewer than two samples");
        else if (!is_number(e.value.sum) || !is_number(e.value.sum_of_squares))
            complaints.push_back(name + ": a sample is NaN or infinite");
        for (std::size_t j = 0; j < i; ++j)
            if (estimates[j].path_length == e.path_length)
                pairs.emplace_back(&estimates[j], &e);
    }
    if (!complaints.empty())
        return {false, "estimates cannot be compared:" + detail::list(complaints)};
    if (pairs.empty())
        return {false, "estimates cannot be compared: no two have the same path length"};

    const double threshold = false_alarm / static_cast<double>(pairs.size());
    for (const auto& [a, b] : pairs) {
        const double difference = std::fabs(mean(a->value) - mean(b->value));
        const double forgiven = rounding * std::max(std::fabs(mean(a->value)), std::fabs(mean(b->value)));
        const double error = std::sqrt(variance_of_mean(a->value) + variance_of_mean(b->value));
        const bool both_exact = !(error > 0);
        const double z = both_exact ? 0 : difference / error;
        if (difference <= forgiven || (!both_exact && detail::normal_tails(z) >= threshold))
            continue;
        std::string line = "path length " + std::to_string(a->path_length) + ": ";
        for (const auto* e : {a, b})
            line += e->subset + " " + detail::text(mean(e->value)) + " +- " +
                    detail::text(std::sqrt(variance_of_mean(e->value))) +
                    (variance_of_mean(e->value) > 0                          ? ""
                     : std::fabs(e->value.sum) + e->value.sum_of_squares > 0 ? " (all samples the same)"
                                                                             : " (never hit)") +
                    (e == a ? ", " : "");
        complaints.push_back(line + (both_exact ? "" : ", z = " + detail::text(z)));
    }
    const std::string pairs_text = std::to_string(pairs.size()) + " pairs of estimates";
    if (complaints.empty())
        return {true, pairs_text + " agree"};
    return {false, std::to_string(complaints.size()) + " of " + pairs_text + " disagree (false alarm " +
                       detail::text(false_alarm) + " in all):" + detail::list(complaints)};
}

} // namespace mis::verify
