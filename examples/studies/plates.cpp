// Study: why combine? After Veach's thesis [V97] 9.3.1: four lights of equal power and very different sizes
// are reflected by four glossy plates, from nearly a mirror to rough. Direct illumination by *BSDF sampling*,
// by *light sampling*, and by both, weighed by each of the heuristics, at the same number of samples. Writes
// plates.csv, plates.jpg and plates-weights.jpg; docs/direct_lighting.md tells what they show.
//
// An estimate has n samples of the light at one point, which a pixel's center shows. A BSDF sample follows a
// direction to whatever light it hits. A light sample is a direction within the cone that a light fills; a
// quarter of the n goes to each light, so that the density of light sampling as a whole is a quarter of that
// in the cone. A combination has n / 2 of each technique. Lights that the camera sees directly are no part of
// an estimate: there is only one technique for them.
#include "panels.hpp"
#include "plates_model.hpp"
#include <array>
#include <atomic>
#include <mis/mis.hpp>
#include <numeric>
#include <thread>

namespace {

using namespace studies;
using namespace studies::plates;

struct options : image_options {
    int samples = 8, runs = 64, reference_samples = 2048;

    options() { size = 448; } // the width
    int height() const { return 3 * size / 4; }
};

// Calls add(pixel, technique, k, draw) for all that n samples of each technique find, rows in parallel. Every
// row has random numbers of its own.
template <class Add>
void sample_image(const scene& s, const options& o, const seen_points& points, int n, std::uint64_t seed,
                  Add&& add) {
    const auto sample_row = [&](int y) {
        std::seed_seq seeds{std::uint32_t(seed), std::uint32_t(seed >> 32), std::uint32_t(y)};
        pcg32 rng(seeds);
        const auto first = std::size_t(y) * std::size_t(o.size);
        for (std::size_t i = first; i < first + std::size_t(o.size); ++i)
            for (int k = 0; points[i] && k < n; ++k)
                for (const technique own : {bsdf, light}) {
                    const draw d = own == bsdf ? draw_bsdf(s, *points[i], rng)
                                               : draw_light(s, *points[i], std::size_t(k) % light_count, rng);
                    if (sum_of(d.f) > 0)
                        add(i, own, k, d);
                }
    };
    std::atomic<int> next{0};
    std::vector<std::thread> pool;
    for (int i = 0; i < o.threads; ++i)
        pool.emplace_back([&] {
            for (int y; (y = next++) < o.height();)
                sample_row(y);
        });
    for (auto& thread : pool)
        thread.join();
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
    estimators
};
constexpr std::array<const char*, estimators> names{
    "BSDF sampling alone", "light sampling alone", "average", "balance", "power", "cutoff", "maximum"};
using weights = std::array<double, estimators>;
using images = std::array<image, estimators>;

// Of a sample that a technique has made. Both techniques take as many, so that the effective densities are in
// proportion to the densities.
weights weights_of(const pair& p, technique own) {
    const double a = p[own], b = p[1 - own];
    return {double(own == bsdf), double(own == light), mis::average(a, b), mis::balance(a, b),
            mis::power(a, b),    mis::cutoff(a, b),    mis::maximum(a, b)};
}

// Of an estimator's n samples: those of each technique that it uses.
int share_of(std::size_t e, int n) { return e < average ? n : n / 2; }

// All from the same samples. off becomes how far both weights of a sample are from 1 in sum, in each pixel at
// most.
images estimate(const scene& s, const options& o, const seen_points& points, std::uint64_t seed,
                std::vector<double>& off) {
    images all;
    all.fill(image(o.size, o.height()));
    sample_image(s, o, points, o.samples, seed, [&](std::size_t i, technique own, int k, const draw& d) {
        const weights w = weights_of(d.p, own), rest = weights_of(d.p, own == bsdf ? light : bsdf);
        for (std::size_t e = 0; e < estimators; ++e) {
            const int count = share_of(e, o.samples);
            if (k < count)
                all[e].pixels[i] += d.f * (w[e] / (count * d.p[own]));
            off[i] = std::max(off[i], std::abs(w[e] + rest[e] - 1));
        }
    });
    return all;
}

// ---- The reference ----

// Of an estimator's samples in a pixel, channels averaged: what their variance follows from.
struct moments {
    double by_bsdf = 0;                         // the part of the integral that BSDF samples add
    std::array<double, light_count> by_light{}; // and light samples, of each light
    double square = 0, largest = 0;             // of w f / p: its expected squares, added over techniques

    // A sample made with a density.
    void add(const draw& d, double density, double w_bsdf, double w_light) {
        const double f = sum_of(d.f) / 3, bsdf_value = w_bsdf * f / d.p[bsdf],
                     light_value = w_light * f / d.p[light];
        by_bsdf += w_bsdf * f / density;
        by_light[d.source] += w_light * f / density;
        square += (bsdf_value * bsdf_value * d.p[bsdf] + light_value * light_value * d.p[light]) / density;
        largest = std::max({largest, bsdf_value, light_value});
    }
    // Of an estimate with one sample of each technique that it uses; a quarter of a sample of each light.
    double variance() const {
        double known = by_bsdf * by_bsdf;
        for (const double x : by_light)
            known += double(light_count) * x * x;
        return std::max(0.0, square - known);
    }
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
    int samples = 0;                                    // in each pixel
};

reference render_reference(const scene& s, const options& o, const seen_points& points) {
    constexpr int passes = 16;
    const int n = std::max(1, o.reference_samples / passes / int(2 * light_count)) * int(light_count);
    reference r{image(o.size, o.height()), {}, {}, 2 * n * passes};
    r.known.resize(points.size());
    image squares = r.mean;
    for (int pass = 0; pass < passes; ++pass) {
        show_progress(text("reference, pass %d of %d", pass + 1, passes));
        image one(o.size, o.height());
        const std::uint64_t seed = ~(o.seed + std::uint64_t(pass)); // no run's
        sample_image(s, o, points, n, seed, [&](std::size_t i, technique, int, const draw& d) {
            const double density = n * (d.p[bsdf] + d.p[light]);
            const weights w_bsdf = weights_of(d.p, bsdf), w_light = weights_of(d.p, light);
            one.pixels[i] += d.f / density;
            for (std::size_t e = 0; e < estimators; ++e)
                r.known[i][e].add(d, passes * density, w_bsdf[e], w_light[e]);
        });
        for (std::size_t i = 0; i < points.size(); ++i) {
            r.mean.pixels[i] += one.pixels[i] / double(passes);
            squares.pixels[i] += one.pixels[i] * one.pixels[i] / double(passes);
        }
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        const dvec3& mean = r.mean.pixels[i];
        r.noise.push_back(sum_of(squares.pixels[i] - mean * mean) / (passes - 1));
    }
    return r;
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

// Plates, then the rest of the image: floor, wall, and lights, where there is no error.
constexpr std::size_t regions = plate_count + 1;
using by_region = std::array<double, regions>;

std::size_t region_of(const std::optional<seen_point>& p) {
    return p ? std::min(p->rectangle, plate_count) : plate_count;
}

// Squared errors, added over pixels and channels; without what the reference's own noise is expected to add.
by_region squared_errors(const image& m, const reference& r, const seen_points& points) {
    by_region sums{};
    for (std::size_t i = 0; i < points.size(); ++i) {
        const dvec3 error = m.pixels[i] - r.mean.pixels[i];
        sums[region_of(points[i])] += dot(error, error) - r.noise[i];
    }
    return sums;
}

// Of all runs.
struct results {
    images means;
    std::array<std::vector<double>, estimators> squared; // errors of each run: means over all values
    std::array<by_region, estimators> by_regions{};      // added over runs
};

void add(results& all, const options& o, const images& found, const reference& r, const seen_points& points) {
    for (std::size_t e = 0; e < estimators; ++e) {
        const by_region sums = squared_errors(found[e], r, points);
        for (std::size_t k = 0; k < regions; ++k)
            all.by_regions[e][k] += sums[k];
        all.squared[e].push_back(std::accumulate(sums.begin(), sums.end(), 0.0) /
                                 (3 * double(points.size())));
        for (std::size_t i = 0; i < points.size(); ++i)
            all.means[e].pixels[i] += found[e].pixels[i] / double(o.runs);
    }
}

// ---- Is every mean right? ----

// The sum of an estimator's errors over some pixels.
struct block {
    double error = 0, variance = 0;
    double largest = 0; // of a single sample's contribution

    // At most: of errors as large as this one, or larger, if the expected error is 0. Bernstein's inequality:
    // it holds where a mean hangs on few bright samples, as a normal distribution does not.
    double chance() const {
        const double bound = 2 * (variance + largest * std::abs(error) / 3);
        return bound > 0 ? 2 * std::exp(-error * error / bound) : 1;
    }
};

constexpr int across = 8, down = 6;
using blocks = std::array<block, std::size_t(across* down)>;

blocks errors_of_blocks(const options& o, const image& mean, std::size_t e, const reference& r) {
    blocks all;
    const double count = share_of(e, o.samples) * double(o.runs);
    for (int y = 0; y < o.height(); ++y)
        for (int x = 0; x < o.size; ++x) {
            const auto i = std::size_t(y * o.size + x);
            block& b = all[std::size_t(y * down / o.height() * across + x * across / o.size)];
            b.error += sum_of(mean.pixels[i] - r.mean.pixels[i]) / 3;
            b.variance += r.known[i][e].variance() / count + r.noise[i] / 3;
            b.largest = std::max(
                {b.largest, r.known[i][e].largest / count, r.known[i][balance].largest / (r.samples / 2)});
        }
    return all;
}

bool check_means(const options& o, const results& all, const reference& r) {
    constexpr double false_alarms = 1e-3, tests = double(estimators) * across * down;
    double least = 1;
    for (std::size_t e = 0; e < estimators; ++e)
        for (const block& b : errors_of_blocks(o, all.means[e], e, r))
            least = std::min(least, b.chance());
    return report(least * tests >= false_alarms,
                  text("means of %d x %d blocks are the reference's, by all estimators: the least chance is "
                       "%.2g (bar: %.2g, false alarms for 1 seed of %.0f)",
                       across, down, least, false_alarms / tests, 1 / false_alarms));
}

// ---- What is written ----

// Keeps the hue of what is brighter than the screen.
dvec3 tone_mapped(const dvec3& radiance) {
    constexpr double exposure = 1.1;
    const double brightest = exposure * std::max({radiance.x, radiance.y, radiance.z});
    return brightest > 0 ? radiance * (exposure * (1 - std::exp(-brightest)) / brightest) : dvec3(0);
}

// With the lights that are seen directly, smooth at their edges.
image to_picture(const scene& s, const options& o, const image& estimated) {
    constexpr int grid = 4; // by as many points in a pixel
    image shown = estimated;
    for (int i = 0; i < o.size * o.height(); ++i) {
        dvec3& pixel = shown.pixels[std::size_t(i)];
        pixel = tone_mapped(pixel);
        for (int k = 0; k < grid * grid; ++k) {
            const double x = i % o.size + (k % grid + 0.5) / grid, y = i / o.size + (k / grid + 0.5) / grid;
            const hit h = intersect(s, s.eye, film_direction(s, o.size, o.height(), x, y));
            if (h.light)
                pixel += tone_mapped(s.lights[*h.light].radiance) / double(grid * grid);
        }
    }
    return shown;
}

// Blue: light sampling, orange: BSDF sampling.
dvec3 weight_color(double bsdf_weight) {
    const dvec3 blue(0.15, 0.33, 0.74), white(0.95), orange(0.91, 0.44, 0.0);
    return bsdf_weight < 0.5 ? mix(blue, white, 2 * bsdf_weight) : mix(white, orange, 2 * bsdf_weight - 1);
}

image weight_picture(const reference& r, estimator e) {
    image shown = r.mean;
    for (std::size_t i = 0; i < shown.pixels.size(); ++i)
        if (sum_of(shown.pixels[i]) > 0)
            shown.pixels[i] = weight_color(r.known[i][e].bsdf_weight());
    return shown;
}

void write_pictures(const scene& s, const options& o, const images& all, const reference& r) {
    write_panels(o.output + "/plates.jpg", {{names[bsdf_alone], to_picture(s, o, all[bsdf_alone])},
                                            {names[light_alone], to_picture(s, o, all[light_alone])},
                                            {"both, power heuristic", to_picture(s, o, all[power])}});
    std::vector<panel> panels;
    for (const estimator e : {balance, power, maximum})
        panels.push_back({names[e], weight_picture(r, e)});
    write_panels(o.output + "/plates-weights.jpg", panels,
                 {weight_color, "all weight to light sampling", "to BSDF sampling"});
}

void print_table(const options& o, const seen_points& points, const results& all) {
    by_region values{};
    for (const auto& p : points)
        values[region_of(p)] += 3.0 * o.runs;
    std::printf("%-21s %9s %9s %12s %13s  %s\n", "", "RMS error", "MSE", "(std. error)", "over balance",
                "MSE by plate, smoothest first; floor and wall");
    for (std::size_t e = 0; e < estimators; ++e) {
        const mean_of m(all.squared[e]);
        std::printf("%-21s %9.3f %9.4g %12.2g %13.2f ", names[e], std::sqrt(std::max(0.0, m.mean)), m.mean,
                    m.standard_error, m.mean / mean_of(all.squared[balance]).mean);
        for (std::size_t k = 0; k < regions; ++k)
            std::printf(" %9.3g", all.by_regions[e][k] / values[k]);
        std::printf("\n");
    }
}

bool check(const options& o, const results& all, const reference& r, double off) {
    bool good = true;
    for (const estimator e : {bsdf_alone, light_alone}) {
        const double over = mean_of(all.squared[e]).mean / mean_of(all.squared[balance]).mean;
        good &= report(over >= 5,
                       text("%s has %.2f times the mean squared error of balance (bar: 5)", names[e], over));
    }
    good &= check_means(o, all, r);
    good &= report(off <= 1e-15, text("both weights of a sample are 1 in sum within %.2g (bar: 1e-15)", off));
    return good;
}

bool run(const options& o) {
    csv_file csv(o.output, "plates.csv", "estimator,samples,seed,mean_squared_error,rms_error,over_balance");
    const scene s = make_scene();
    const seen_points points = look(s, o.size, o.height());
    const reference r = render_reference(s, o, points);
    const double noise = std::accumulate(r.noise.begin(), r.noise.end(), 0.0) / (3 * double(points.size()));
    csv.add(text("reference,%d,,%g,%g,", r.samples, noise, std::sqrt(noise)));

    results all;
    all.means.fill(image(o.size, o.height()));
    std::vector<double> off(points.size());
    for (int k = 0; k < o.runs; ++k) {
        show_progress(text("run %d of %d", k + 1, o.runs));
        const std::uint64_t seed = o.seed + std::uint64_t(k);
        const images found = estimate(s, o, points, seed, off);
        if (k == 0)
            write_pictures(s, o, found, r);
        add(all, o, found, r, points);
        for (std::size_t e = 0; e < estimators; ++e) {
            const double squared = all.squared[e].back();
            csv.add(text("%s,%d,%s,%g,%g,%g", names[e], o.samples, std::to_string(seed).c_str(), squared,
                         std::sqrt(std::max(0.0, squared)), squared / all.squared[balance].back()));
        }
    }
    show_progress("");
    std::printf("%d x %d pixels, %d samples in each, %d runs; the reference, of %d samples, has an RMS error "
                "of %.3f (MSE %.2g)\n",
                o.size, o.height(), o.samples, o.runs, r.samples, std::sqrt(noise), noise);
    print_table(o, points, all);
    return check(o, all, r, *std::max_element(off.begin(), off.end()));
}

} // namespace

int main(int count, char** arguments) {
    CLI::App app{
        std::string("Veach's plates: direct illumination by BSDF sampling, by light sampling, and by both "
                    "with each heuristic; writes plates.csv and pictures.\n") +
        exit_statuses};
    options o;
    const CLI::Validator multiple_of_8(
        [](const std::string& value) {
            int n = 0;
            const bool good = CLI::detail::lexical_cast(value, n) && n > 0 && n % 8 == 0;
            return good ? std::string() : "not a positive multiple of 8: " + value;
        },
        "a multiple of 8");
    add_common(app, o);
    app.add_option("--samples", o.samples, "of each estimator in each pixel")
        ->check(multiple_of_8)
        ->capture_default_str();
    add_number(app, "--runs", o.runs, "images of each estimator", 2, 100000);
    add_number(app, "--reference-samples", o.reference_samples, "in each pixel, at least 128", 1, 100000000);
    return run_study(app, o, count, arguments, [&] { return run(o); });
}
