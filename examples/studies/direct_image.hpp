// Images of direct light by two techniques, *BSDF sampling* and *light sampling*, for studies: each technique
// alone, weighed by every heuristic and by optimal weights, all from the same samples; a reference; mean
// squared errors; and whether every mean is right. Light that the camera sees directly is no part of it.
#pragma once

#include "direct_light.hpp"
#include "panels.hpp"
#include "pixels.hpp"
#include <mis/mis.hpp>
#include <mis/optimal/solve.hpp>
#include <numeric>

namespace studies::direct_light {

struct options : image_options {
    int samples = 8, runs = 64, reference_samples = 2048;

    int height() const { return 3 * size / 4; } // size: the width
};

inline void add_samples(command_line& app, options& o) {
    app.add_multiple("--samples", o.samples, "of each estimator in each pixel", 8);
    app.add("--runs", o.runs, "images of each estimator", 2, 100000);
    app.add("--reference-samples", o.reference_samples, "in each pixel, at least 128", 1, 100000000);
}

// ---- What is estimated ----

// Light at one point in each pixel.
struct model {
    // Light samples are spread evenly over this many sources, in turn.
    std::size_t sources = 1;
    std::function<bool(std::size_t pixel)> is_seen; // a surface
    std::function<draw(std::size_t pixel, technique own, std::size_t source, pcg32& rng)> take;
    // Tables have errors by region, too.
    std::size_t regions = 1;
    std::function<std::size_t(std::size_t pixel)> region_of;
    // Whether light sampling alone finds all light.
    bool light_is_enough = true;
};
constexpr std::size_t most_sources = 4;

// Calls add(pixel, technique, k, draw) for n samples of each technique, rows in parallel.
template <class Add>
void sample_image(const model& m, const options& o, int n, std::uint64_t seed, Add&& add) {
    for_each_pixel(o.size, o.height(), o.threads, seed, [&](std::size_t i, pcg32& rng) {
        for (int k = 0; m.is_seen(i) && k < n; ++k)
            for (const technique own : {bsdf, light})
                add(i, own, k, m.take(i, own, std::size_t(k) % m.sources, rng));
    });
}

// ---- Estimators ----

// One technique alone, then combinations.
enum estimator : std::size_t {
    bsdf_alone,
    light_alone,
    average,
    balance,
    power,
    cutoff,
    maximum,
    optimal,
    estimators
};
constexpr std::array<const char*, estimators> names{"BSDF sampling alone",
                                                    "light sampling alone",
                                                    "average",
                                                    "balance",
                                                    "power",
                                                    "cutoff",
                                                    "maximum",
                                                    "optimal"};
using weights = std::array<double, optimal>; // those that depend on densities alone
using images = std::array<image, estimators>;
using coefficients = std::array<pair, 3>; // alpha of [O], of each channel

inline bool uses(const model& m, std::size_t e) { return e != light_alone || m.light_is_enough; }

// Of a sample that a technique has made. Both techniques take as many, so that the effective densities are in
// proportion to the densities.
inline weights weights_of(const pair& p, technique own) {
    const double a = p[own], b = p[1 - own];
    return {double(own == bsdf), double(own == light), mis::average(a, b), mis::balance(a, b),
            mis::power(a, b),    mis::cutoff(a, b),    mis::maximum(a, b)};
}

// What a sample would add by optimal weights, were it the only one of its technique. Half of the integral
// that is known already is each technique's.
inline dvec3 optimally(const draw& d, technique own, const coefficients& alpha) {
    dvec3 sum(0);
    for (int c = 0; c < 3; ++c) {
        const pair& a = alpha[std::size_t(c)];
        sum[c] = (a[bsdf] + a[light]) / 2 +
                 (is_outside(d)
                      ? -a[own]
                      : (d.f[c] - a[bsdf] * d.p[bsdf] - a[light] * d.p[light]) / (d.p[bsdf] + d.p[light]));
    }
    return sum;
}

// Of an estimator's n samples: those of each technique that it uses.
inline int share_of(std::size_t e, int n) { return e < average ? n : n / 2; }

// All from the same samples. off becomes how far both weights of a sample are from 1 in sum, in each pixel at
// most.
inline images estimate(const model& m, const options& o, const std::vector<coefficients>& alpha,
                       std::uint64_t seed, std::vector<double>& off) {
    images all;
    all.fill(image(o.size, o.height()));
    sample_image(m, o, o.samples, seed, [&](std::size_t i, technique own, int k, const draw& d) {
        const int half = share_of(optimal, o.samples);
        if (k < half)
            all[optimal].pixels[i] += optimally(d, own, alpha[i]) / double(half);
        if (!(sum_of(d.f) > 0))
            return;
        const weights w = weights_of(d.p, own), rest = weights_of(d.p, own == bsdf ? light : bsdf);
        for (std::size_t e = 0; e < optimal; ++e) {
            const int count = share_of(e, o.samples);
            if (k < count)
                all[e].pixels[i] += d.f * (w[e] / (count * d.p[own]));
            off[i] = std::max(off[i], std::abs(w[e] + rest[e] - 1));
        }
    });
    return all;
}

// ---- The reference ----

// The coefficients of optimal weights in each pixel, from n samples of each technique.
inline std::vector<coefficients> learn(const model& m, const options& o, int n, std::uint64_t seed) {
    show_progress("learning optimal weights");
    const auto pixels = std::size_t(o.size) * std::size_t(o.height());
    std::vector<mis::optimal::estimator<2>> sums(pixels);
    sample_image(m, o, n, seed, [&](std::size_t i, technique own, int, const draw& d) {
        if (is_outside(d))
            sums[i].add_outside(int(own));
        else
            sums[i].add(d.f, d.p);
    });
    std::vector<coefficients> all(pixels);
    for (std::size_t i = 0; i < pixels; ++i)
        if (m.is_seen(i)) {
            const double counts[]{1, 1};
            const auto alpha = mis::optimal::coefficients(sums[i], counts);
            for (std::size_t c = 0; c < 3; ++c)
                all[i][c] = {alpha[c][bsdf], alpha[c][light]};
        }
    return all;
}

// Of an estimator's samples in a pixel, channels averaged: what their variance follows from. A value is what
// a sample would add, were it the only one of its technique.
struct moments {
    double by_bsdf = 0;                          // the part of the integral that BSDF samples add
    std::array<double, most_sources> by_light{}; // and light samples, of each source
    double square = 0;                           // of values: expected, added over techniques
    double least = 0, largest = 0;               // of values

    // A sample that stands for so many of one technique's.
    void add(technique own, std::size_t source, double value, double samples) {
        (own == bsdf ? by_bsdf : by_light[source]) += value * samples;
        square += value * value * samples;
        least = std::min(least, value);
        largest = std::max(largest, value);
    }
    // Of an estimate with one sample of each technique that it uses; the light sample is spread over sources.
    double variance(std::size_t sources) const {
        double known = by_bsdf * by_bsdf;
        for (const double x : by_light)
            known += double(sources) * x * x;
        return std::max(0.0, square - known);
    }
    double range() const { return largest - least; }
    double bsdf_weight() const {
        const double by_lights = std::accumulate(by_light.begin(), by_light.end(), 0.0);
        return by_bsdf / (by_bsdf + by_lights);
    }
};

// Balance with many samples, in passes: how far they are apart tells how far their mean is from the truth.
struct reference {
    image mean;
    std::vector<double> noise; // of pixels: expected squared errors of the mean, added over channels
    std::vector<std::array<moments, estimators>> known; // of pixels
    std::vector<coefficients> alpha;                    // of pixels
    int samples = 0;                                    // in each pixel
    std::vector<double> largest;                        // of pixels: contributions of a single sample to mean
};

inline reference render_reference(const model& m, const options& o) {
    constexpr int passes = 16;
    const int sources = int(m.sources);
    const int n = std::max(1, o.reference_samples / passes / (2 * sources)) * sources;
    // Seeds that no run has.
    reference r{image(o.size, o.height()),
                {},
                {},
                learn(m, o, passes * n / 4, ~(o.seed + passes)),
                2 * n * passes,
                {}};
    r.known.resize(r.mean.pixels.size());
    image squares = r.mean;
    for (int pass = 0; pass < passes; ++pass) {
        show_progress(text("reference, pass %d of %d", pass + 1, passes));
        image one(o.size, o.height());
        sample_image(m, o, n, ~(o.seed + std::uint64_t(pass)),
                     [&](std::size_t i, technique own, int, const draw& d) {
                         auto& known = r.known[i];
                         if (is_outside(d)) {
                             known[optimal].add(own, d.source, sum_of(optimally(d, own, r.alpha[i])) / 3,
                                                1.0 / (passes * n));
                             return;
                         }
                         // Whoever has made it stands for both techniques' samples here.
                         const double density = n * (d.p[bsdf] + d.p[light]), f = sum_of(d.f) / 3;
                         one.pixels[i] += d.f / density;
                         const double best = sum_of(optimally(d, own, r.alpha[i])) / 3;
                         for (const technique t : {bsdf, light}) {
                             if (!(d.p[t] > 0))
                                 continue;
                             const double samples = d.p[t] / (passes * density);
                             known[optimal].add(t, d.source, best, samples);
                             if (!(f > 0))
                                 continue;
                             const weights w = weights_of(d.p, t);
                             for (std::size_t e = 0; e < optimal; ++e)
                                 known[e].add(t, d.source, w[e] * f / d.p[t], samples);
                         }
                     });
        for (std::size_t i = 0; i < r.mean.pixels.size(); ++i) {
            r.mean.pixels[i] += one.pixels[i] / double(passes);
            squares.pixels[i] += one.pixels[i] * one.pixels[i] / double(passes);
        }
    }
    for (std::size_t i = 0; i < r.mean.pixels.size(); ++i) {
        const dvec3& mean = r.mean.pixels[i];
        r.noise.push_back(sum_of(squares.pixels[i] - mean * mean) / (passes - 1));
        r.largest.push_back(r.known[i][balance].largest / (passes * n));
    }
    return r;
}

inline double mean_squared_error(const reference& r) {
    return std::accumulate(r.noise.begin(), r.noise.end(), 0.0) / (3 * double(r.noise.size()));
}

// ---- Errors ----

struct mean_of {
    double mean = 0, standard_error = 0;

    explicit mean_of(const std::vector<double>& x) {
        const double n = double(x.size());
        double squares = 0;
        for (const double v : x)
            mean += v / n;
        for (const double v : x)
            squares += (v - mean) * (v - mean);
        standard_error = std::sqrt(squares / (n * (n - 1)));
    }
};

using by_region = std::vector<double>;

// Squared errors, added over pixels and channels; without what the reference's own noise is expected to add.
inline by_region squared_errors(const model& m, const image& found, const reference& r) {
    by_region sums(m.regions);
    for (std::size_t i = 0; i < found.pixels.size(); ++i) {
        const dvec3 error = found.pixels[i] - r.mean.pixels[i];
        sums[m.region_of(i)] += dot(error, error) - r.noise[i];
    }
    return sums;
}

// Of all runs.
struct results {
    images first; // of the first run
    images means;
    std::array<std::vector<double>, estimators> squared; // errors of each run: means over all values
    std::array<by_region, estimators> by_regions;        // added over runs
    double off = 0; // how far both weights of a sample are from 1 in sum, at most

    double error(std::size_t e) const { return mean_of(squared[e]).mean; }
};

// Adds a line to the table for each run and estimator; `name` comes first in the line.
inline results run_all(const model& m, const options& o, const reference& r, csv_file& csv,
                       const std::string& name) {
    results all;
    all.means.fill(image(o.size, o.height()));
    all.by_regions.fill(by_region(m.regions));
    std::vector<double> off(r.mean.pixels.size());
    for (int k = 0; k < o.runs; ++k) {
        show_progress(text("run %d of %d", k + 1, o.runs));
        const std::uint64_t seed = o.seed + std::uint64_t(k);
        const images found = estimate(m, o, r.alpha, seed, off);
        if (k == 0)
            all.first = found;
        for (std::size_t e = 0; e < estimators; ++e) {
            const by_region sums = squared_errors(m, found[e], r);
            double sum = 0;
            for (std::size_t region = 0; region < m.regions; ++region) {
                all.by_regions[e][region] += sums[region];
                sum += sums[region];
            }
            all.squared[e].push_back(sum / (3 * double(r.mean.pixels.size())));
            for (std::size_t i = 0; i < r.mean.pixels.size(); ++i)
                all.means[e].pixels[i] += found[e].pixels[i] / double(o.runs);
        }
        for (std::size_t e = 0; e < estimators; ++e)
            if (uses(m, e)) {
                const double squared = all.squared[e].back();
                csv.add(text("%s%s,%d,%s,%g,%g,%g", name.c_str(), names[e], o.samples,
                             std::to_string(seed).c_str(), squared, std::sqrt(std::max(0.0, squared)),
                             squared / all.squared[balance].back()));
            }
    }
    all.off = *std::max_element(off.begin(), off.end());
    show_progress("");
    return all;
}

// Errors over all pixels, then by region.
inline void print_table(const model& m, const options& o, const results& all, const std::string& regions) {
    by_region values(m.regions);
    for (std::size_t i = 0; i < all.means[0].pixels.size(); ++i)
        values[m.region_of(i)] += 3.0 * o.runs;
    std::printf("%-21s %9s %9s %12s %13s  MSE by %s\n", "", "RMS error", "MSE", "(std. error)",
                "over balance", regions.c_str());
    for (std::size_t e = 0; e < estimators; ++e) {
        if (!uses(m, e))
            continue;
        const mean_of squared(all.squared[e]);
        std::printf("%-21s %9.3g %9.4g %12.2g %13.2f ", names[e], std::sqrt(std::max(0.0, squared.mean)),
                    squared.mean, squared.standard_error, squared.mean / all.error(balance));
        for (std::size_t k = 0; k < m.regions; ++k)
            std::printf(" %9.3g", all.by_regions[e][k] / values[k]);
        std::printf("\n");
    }
}

// ---- Is every mean right? ----

// The sum of an estimator's errors over some pixels.
struct block {
    double error = 0, variance = 0;
    double largest = 0; // range of a single sample's contribution

    // At most: of errors as large as this one, or larger, if the expected error is 0. Bernstein's inequality:
    // it holds where a mean hangs on few bright samples, as a normal distribution does not.
    double chance() const {
        const double bound = 2 * (variance + largest * std::abs(error) / 3);
        return bound > 0 ? 2 * std::exp(-error * error / bound) : 1;
    }
};

constexpr int across = 8, down = 6;
using blocks = std::array<block, std::size_t(across* down)>;

inline blocks errors_of_blocks(const model& m, const options& o, const image& mean, std::size_t e,
                               const reference& r) {
    blocks all;
    const double count = share_of(e, o.samples) * double(o.runs);
    for (int y = 0; y < o.height(); ++y)
        for (int x = 0; x < o.size; ++x) {
            const auto i = std::size_t(y * o.size + x);
            block& b = all[std::size_t(y * down / o.height() * across + x * across / o.size)];
            b.error += sum_of(mean.pixels[i] - r.mean.pixels[i]) / 3;
            b.variance += r.known[i][e].variance(m.sources) / count + r.noise[i] / 3;
            b.largest = std::max({b.largest, r.known[i][e].range() / count, r.largest[i]});
        }
    return all;
}

inline bool check_means(const model& m, const options& o, const results& all, const reference& r) {
    constexpr double false_alarms = 1e-3, tests = double(estimators) * across * down;
    double least = 1;
    for (std::size_t e = 0; e < estimators; ++e)
        if (uses(m, e))
            for (const block& b : errors_of_blocks(m, o, all.means[e], e, r))
                least = std::min(least, b.chance());
    return report(least * tests >= false_alarms,
                  text("means of %d x %d blocks are the reference's, by all estimators: the least chance is "
                       "%.2g (bar: %.2g, false alarms for 1 seed of %.0f)",
                       across, down, least, false_alarms / tests, 1 / false_alarms));
}

inline bool check_weights(const results& all) {
    return report(all.off <= 1e-15,
                  text("both weights of a sample are 1 in sum within %.2g (bar: 1e-15)", all.off));
}

} // namespace studies::direct_light
