// Study: direct light of many lamps by two ways of choosing a lamp, *uniform* among all and *trained*, and
// what each way of weighing makes of the same samples: heuristics, and optimal weights [O]. Lamps are points,
// so that the exact image is a finite sum. Writes direct.csv and direct.png; direct.gp draws the
// table. docs/optimal.md tells what it shows.
//
// The trained technique. The scene is divided into cells: cubes, and in each of them the six directions
// that a normal is closest to. In every cell every lamp is tested a few times, each time from a random point
// that the camera sees there, with a shadow ray. From these tests, and nothing else, two kinds are trained:
//   visibility    the part of the tests in which the lamp was seen, times the lamp's unshadowed contribution
//                 at the very point that is shaded, which costs no ray;
//   contribution  the mean contribution in the cell, shadows included: coarser, the same in the whole cell.
// Both are noisy, and both miss lamps that light a small part of a cell. So that no lamp is missed, some
// share of the probability is spread evenly over all of them, a defensive mixture. Training is done once,
// with random numbers of its own.
//
// Why optimal weights gain. Where training is good, f is nearly p_trained minus some of p_uniform: nearly in
// the span of the two densities, so that optimal weights take out what the share costs. No heuristic can: it
// would need a negative weight.
#include "study.hpp"
#include <array>
#include <bpt/render.hpp>
#include <lab/pictures.hpp>
#include <map>
#include <mis/mis.hpp>
#include <mis/optimal/solve.hpp>

namespace {

using namespace studies;
using glm::dvec3;

struct options : image_options {
    int samples = 20, tests = 16;
    double cell = 0.5;
    options() { size = 256; }
};

double sum_of(const dvec3& color) { return color.x + color.y + color.z; }

std::size_t random_index(std::size_t count, pcg32& rng) {
    const double x = bpt::uniform<double>(rng) * static_cast<double>(count);
    return std::min(static_cast<std::size_t>(x), count - 1);
}

// ---- The integrand: contributions of lamps to a pixel ----

using scene = bpt::scene<double>;

struct seen_point {
    bpt::surface_point<double> surface;
    dvec3 to_camera;
};

// What the camera sees at a point of the film, in pixels.
std::optional<seen_point> look(const scene& s, int size, double x, double y) {
    pcg32 unused;
    const auto lens = bpt::sample_lens(s.camera, unused);
    const dvec3 direction = bpt::film_to_direction(s.camera, lens, 2 * x / size - 1, 1 - 2 * y / size);
    const auto surface = bpt::intersect(s, lens.point.position, direction);
    return surface ? std::optional(seen_point{*surface, -direction}) : std::nullopt;
}

dvec3 unshadowed(const scene& s, const seen_point& at, const bpt::light<double>& lamp) {
    const dvec3 edge = lamp.origin - at.surface.position;
    const double square = dot(edge, edge);
    const dvec3 to_lamp = edge / std::sqrt(square);
    const auto& material = s.materials[static_cast<std::size_t>(at.surface.material)];
    return bpt::evaluate(material, at.surface, at.to_camera, to_lamp) * lamp.emission *
           (std::abs(dot(at.surface.shading_normal, to_lamp)) / square);
}

// What is left of an unshadowed contribution.
dvec3 shadowed(const scene& s, const seen_point& at, const bpt::light<double>& lamp, const dvec3& value) {
    return sum_of(value) > 0 && bpt::is_visible(s, at.surface.position, lamp.origin) ? value : dvec3(0);
}

// ---- Training ----

using cell_key = std::array<int, 4>;

cell_key key_of(const seen_point& at, double size) {
    const dvec3 normal =
        dot(at.surface.normal, at.to_camera) > 0 ? at.surface.normal : -1.0 * at.surface.normal;
    const dvec3 inside = (at.surface.position + 1e-3 * normal) / size; // not on the side of a cube
    int axis = 0;
    for (int k = 1; k < 3; ++k)
        if (std::abs(normal[k]) > std::abs(normal[axis]))
            axis = k;
    const auto index = [&](int k) { return static_cast<int>(std::floor(inside[k])); };
    return {index(0), index(1), index(2), normal[axis] > 0 ? axis : axis + 3};
}

struct cell {
    std::vector<std::size_t> pixels; // whose centers show it
    std::vector<double> visible;     // of each lamp: the part of the tests in which it was seen
    std::vector<double> mean;        // of each lamp: the mean contribution
};
using cells = std::map<cell_key, cell>;

// Tests lamps from random points of the pixels that show the cell; those that fall beside it do not count.
double train(const scene& s, const options& o, const cell_key& key, cell& c, pcg32& rng) {
    double rays = 0;
    for (const auto& lamp : s.lights) {
        double tests = 0, visible = 0, sum = 0;
        for (int k = 0; k < o.tests; ++k) {
            const auto pixel = static_cast<int>(c.pixels[random_index(c.pixels.size(), rng)]);
            const double x = pixel % o.size + bpt::uniform<double>(rng),
                         y = pixel / o.size + bpt::uniform<double>(rng);
            const auto point = look(s, o.size, x, y);
            if (!point || key_of(*point, o.cell) != key)
                continue;
            const double value = sum_of(shadowed(s, *point, lamp, unshadowed(s, *point, lamp)));
            visible += value > 0;
            sum += value;
            ++tests;
        }
        c.visible.push_back(tests > 0 ? visible / tests : 0);
        c.mean.push_back(tests > 0 ? sum / tests : 0);
        rays += tests;
    }
    return rays;
}

// ---- Techniques ----

// Of lamps.
struct distribution {
    std::vector<double> probability, cumulative;

    // Proportional to the importance, but for the share that is spread evenly: all, where nothing is known.
    distribution(const std::vector<double>& importance, double share) {
        double sum = 0, below = 0;
        for (const double x : importance)
            sum += x;
        for (const double x : importance) {
            const double even = 1 / static_cast<double>(importance.size());
            probability.push_back(sum > 0 ? share * even + (1 - share) * x / sum : even);
            cumulative.push_back(below += probability.back());
        }
    }
    std::size_t sample(pcg32& rng) const {
        const double x = bpt::uniform<double>(rng) * cumulative.back();
        const auto found = std::upper_bound(cumulative.begin(), cumulative.end(), x);
        return std::min(static_cast<std::size_t>(found - cumulative.begin()), cumulative.size() - 1);
    }
};

enum technique : std::size_t { uniform, trained };
using pair = std::array<double, 2>; // of both techniques

struct draw {
    dvec3 f;
    pair p;
};
// Of both techniques, twice as many as samples: the second half is another pass, or what a technique alone
// may have.
using draws = std::array<std::vector<draw>, 2>;

draws take(const std::vector<dvec3>& f, const distribution& learned, int count, pcg32& rng) {
    draws all;
    const auto add = [&](technique by, std::size_t lamp) {
        all[by].push_back({f[lamp], {1 / static_cast<double>(f.size()), learned.probability[lamp]}});
    };
    for (int k = 0; k < count; ++k) {
        add(uniform, random_index(f.size(), rng));
        add(trained, learned.sample(rng));
    }
    return all;
}

// ---- Estimates: all from the same first n draws of each technique ----

using parts = std::array<dvec3, 2>; // what each technique's samples add

template <class Heuristic> parts weighed(const Heuristic& heuristic, const draws& all, std::size_t n) {
    parts sums{dvec3(0), dvec3(0)};
    for (const technique own : {uniform, trained})
        for (std::size_t k = 0; k < n; ++k) {
            const draw& d = all[own][k];
            sums[own] += d.f * (heuristic(d.p[own], d.p[1 - own]) / (static_cast<double>(n) * d.p[own]));
        }
    return sums;
}

dvec3 alone(technique own, const draws& all) {
    dvec3 sum(0);
    for (const draw& d : all[own])
        sum += d.f / d.p[own];
    return sum / static_cast<double>(all[own].size());
}

dvec3 to_color(const std::array<double, 3>& rgb) { return {rgb[0], rgb[1], rgb[2]}; }

// Calls add(f, densities) for draws first ... last of both techniques.
template <class Sums>
void add(Sums& sums, const draws& all, std::size_t first, std::size_t last, double count) {
    for (std::size_t k = first; k < last; ++k)
        for (const technique by : {uniform, trained}) {
            const draw& d = all[by][k];
            const double densities[]{count * d.p[uniform], count * d.p[trained]};
            sums.add(d.f, densities);
        }
}

struct optimal_estimate {
    dvec3 direct;
    parts of_techniques;
};

// The direct estimator, and what it takes from each technique's samples: the sums of w_i f / (n_i p_i), which
// exist where f = 0 too.
optimal_estimate weighed_optimally(const draws& all, std::size_t n) {
    const double count = static_cast<double>(n);
    const double counts[]{count, count};
    mis::optimal::estimator<2> sums;
    add(sums, all, 0, n, count);
    const auto alpha = mis::optimal::coefficients(sums, counts);
    optimal_estimate e{to_color(mis::optimal::integral(sums, counts)), {dvec3(0), dvec3(0)}};
    for (const technique own : {uniform, trained})
        for (std::size_t k = 0; k < n; ++k) {
            const draw& d = all[own][k];
            for (std::size_t c = 0; c < 3; ++c) {
                const int channel = static_cast<int>(c);
                const double control = alpha[c][uniform] * d.p[uniform] + alpha[c][trained] * d.p[trained];
                e.of_techniques[own][channel] +=
                    alpha[c][own] / count + (d.f[channel] - control) / count / (d.p[uniform] + d.p[trained]);
            }
        }
    return e;
}

// Unbiased: one sample of each technique is a pass, alpha is made of the passes of all batches before. Four
// batches, because alpha made of a pass or two is worse than none.
dvec3 progressively(const draws& all, std::size_t n) {
    const std::size_t batch = std::max(n / 4, std::size_t(1));
    const double counts[]{1, 1};
    mis::optimal::progressive<2> p;
    for (std::size_t first = 0; first < n; first += batch) {
        const std::size_t last = std::min(first + batch, n);
        add(p, all, first, last, 1);
        mis::optimal::end_batch(p, counts, static_cast<double>(last - first), {1, 0});
    }
    return to_color(mis::optimal::integral(p));
}

// Unbiased: alpha is made of the other half of the draws, as if they were the pass before.
dvec3 in_second_pass(const draws& all, std::size_t n) {
    const double count = static_cast<double>(n);
    const double counts[]{count, count};
    mis::optimal::progressive<2> p;
    add(p, all, n, 2 * n, count);
    mis::optimal::end_batch(p, counts, 1, {1, 0});
    const dvec3 first = to_color(mis::optimal::integral(p));
    add(p, all, 0, n, count);
    mis::optimal::end_batch(p, counts, 1, {1, 0});
    return 2.0 * to_color(mis::optimal::integral(p)) - first;
}

// The rows of the table.
enum row : std::size_t {
    only_uniform,
    only_trained,
    average,
    balance,
    power,
    cutoff,
    maximum,
    optimal,
    progressive,
    second_pass,
    rows
};
const std::array<const char*, rows> names{"uniform alone", "trained alone", "average", "balance",
                                          "power",         "cutoff",        "maximum", "optimal",
                                          "progressive",   "second pass"};

struct estimates {
    std::array<dvec3, rows> image;
    parts by_power, by_optimal;
};

estimates estimate(const draws& all, std::size_t n) {
    const auto total = [&](const auto& heuristic) {
        const parts p = weighed(heuristic, all, n);
        return p[uniform] + p[trained];
    };
    const optimal_estimate best = weighed_optimally(all, n);
    return {{alone(uniform, all), alone(trained, all), total(mis::average), total(mis::balance),
             total(mis::power), total(mis::cutoff), total(mis::maximum), best.direct, progressively(all, n),
             in_second_pass(all, n)},
            weighed(mis::power, all, n),
            best.of_techniques};
}

// ---- Setups ----

const std::array<std::string, 2> kinds{"visibility", "contribution"};
constexpr std::array<double, 4> shares{0, 0.25, 0.5, 0.75};
constexpr std::size_t shown = 2; // the share in the pictures and the bar's

struct result {
    std::array<bpt::image, rows> images;
    std::array<double, rows> rms{}; // errors over pixels and channels
    // Mean weights in each pixel, every lamp counted by its contribution: the part of the image that the
    // technique's samples add.
    std::array<bpt::image, 2> power_weights, optimal_weights;

    explicit result(int size) {
        images.fill(bpt::black(size));
        power_weights.fill(images[0]);
        optimal_weights.fill(images[0]);
    }
    double gain(std::size_t row) const { return rms[power] / rms[row]; }
};
using results = std::array<std::array<result, shares.size()>, kinds.size()>;

void add_pixel(result& r, std::size_t pixel, const estimates& e, const dvec3& exact) {
    for (std::size_t row = 0; row < rows; ++row) {
        r.images[row].pixels[pixel] = e.image[row];
        r.rms[row] += dot(e.image[row] - exact, e.image[row] - exact); // so far squares
    }
    for (const technique by : {uniform, trained}) {
        const auto mean = [&](const parts& p) {
            constexpr double deepest = 2; // of weights shown: see write_images
            return lab::false_color(sum_of(exact) > 0 ? sum_of(p[by]) / sum_of(exact) / deepest : 0);
        };
        r.power_weights[by].pixels[pixel] = mean(e.by_power);
        r.optimal_weights[by].pixels[pixel] = mean(e.by_optimal);
    }
}

void write_images(const scene& s, const options& o, const result& defensive, const result& plain,
                  const bpt::image& exact) {
    const lab::color_bar bar{"-2", "0", "2"};
    lab::write_sheet(o.output + "/direct.png",
                     {{"power", defensive.images[power], s.exposure},
                      {"optimal", defensive.images[optimal], s.exposure},
                      {"exact", exact, s.exposure},
                      {"power, no even share", plain.images[power], s.exposure},
                      {"power: weight of trained", defensive.power_weights[trained], 1, bar},
                      {"power: weight of uniform", defensive.power_weights[uniform], 1, bar},
                      {"optimal: weight of trained", defensive.optimal_weights[trained], 1, bar},
                      {"optimal: weight of uniform", defensive.optimal_weights[uniform], 1, bar}},
                     4);
}

void print_table(const results& all) {
    for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
        std::printf("trained by %s: RMS error (and that of power over it), by the share spread evenly\n%-14s",
                    kinds[kind].c_str(), "");
        for (const double share : shares)
            std::printf(" %17.2f", share);
        std::printf("\n");
        for (std::size_t row = 0; row < rows; ++row) {
            std::printf("%-14s", names[row]);
            for (const result& r : all[kind])
                std::printf("  %8.5f (%5.2f)", r.rms[row], r.gain(row));
            std::printf("\n");
        }
    }
}

// What the pixels' centers see.
std::vector<std::optional<seen_point>> look(const scene& s, int size) {
    std::vector<std::optional<seen_point>> points;
    for (int i = 0; i < size * size; ++i)
        points.push_back(look(s, size, i % size + 0.5, i / size + 0.5));
    return points;
}

struct training {
    cells cache;
    double shadow_rays = 0;
};

training train(const scene& s, const options& o, const std::vector<std::optional<seen_point>>& points) {
    training t;
    pcg32 rng(o.seed, 1);
    for (std::size_t i = 0; i < points.size(); ++i)
        if (points[i])
            t.cache[key_of(*points[i], o.cell)].pixels.push_back(i);
    for (auto& [key, c] : t.cache) {
        t.shadow_rays += train(s, o, key, c, rng);
        show_progress(text("training: %.3g shadow rays", t.shadow_rays));
    }
    return t;
}

// The contributions of all lamps to a pixel, and how important each lamp is there, by kind.
struct pixel_lamps {
    std::vector<dvec3> f;
    std::array<std::vector<double>, kinds.size()> importance;
    dvec3 exact{0}, missed{0}; // all light; that of lamps that training has not seen

    pixel_lamps(const scene& s, const seen_point& at, const cell& c) {
        importance[1] = c.mean;
        for (const auto& lamp : s.lights) {
            const dvec3 value = unshadowed(s, at, lamp);
            importance[0].push_back(c.visible[f.size()] * sum_of(value));
            f.push_back(shadowed(s, at, lamp, value));
            exact += f.back();
            if (!(importance[0].back() > 0))
                missed += f.back();
        }
    }
};

bool run(const options& o) {
    csv_file csv(o.output, "direct.csv", "trained_by,share,estimator,rms_error,power_over_it,variance_ratio");
    const auto s = bpt::make_scene<double>("rooms");
    const auto points = look(s, o.size);
    const training learned = train(s, o, points);

    const result nothing(o.size);
    results all{{{nothing, nothing, nothing, nothing}, {nothing, nothing, nothing, nothing}}};
    bpt::image exact = bpt::black(o.size);
    double pixels = 0, mean = 0, missed = 0;
    pcg32 rng(o.seed, 2);
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!points[i])
            continue;
        const pixel_lamps lamps(s, *points[i], learned.cache.at(key_of(*points[i], o.cell)));
        for (std::size_t kind = 0; kind < kinds.size(); ++kind)
            for (std::size_t k = 0; k < shares.size(); ++k) {
                const distribution lamp(lamps.importance[kind], shares[k]);
                const draws taken = take(lamps.f, lamp, 2 * o.samples, rng);
                add_pixel(all[kind][k], i, estimate(taken, static_cast<std::size_t>(o.samples)), lamps.exact);
            }
        exact.pixels[i] = lamps.exact;
        mean += sum_of(lamps.exact) / 3;
        missed += sum_of(lamps.missed) / 3;
        if (++pixels; i % 256 == 0)
            show_progress(text("%zu of %zu pixels", i, points.size()));
    }
    for (std::size_t kind = 0; kind < kinds.size(); ++kind)
        for (std::size_t k = 0; k < shares.size(); ++k) {
            result& r = all[kind][k];
            for (double& squares : r.rms)
                squares = std::sqrt(squares / (3 * pixels));
            for (std::size_t row = 0; row < rows; ++row)
                csv.add(text("%s,%g,%s,%g,%g,%g", kinds[kind].c_str(), shares[k], names[row], r.rms[row],
                             r.gain(row), r.gain(row) * r.gain(row)));
        }
    show_progress("");
    std::printf("%zu lamps, %.0f pixels, %d samples of each technique; the image's mean is %.4f\n",
                s.lights.size(), pixels, o.samples, mean / pixels);
    print_table(all);
    write_images(s, o, all[0][shown], all[0][0], exact);
    note(text("training: %zu cells, %.3g shadow rays; the samples of one image: %.3g; the exact image: %.3g",
              learned.cache.size(), learned.shadow_rays, 2 * pixels * o.samples,
              pixels * static_cast<double>(s.lights.size())));
    note(text("training misses %.2g %% of the light; without an even share, trained alone does, too",
              100 * missed / mean));
    const double gain = all[0][shown].gain(optimal);
    return report(gain >= 9.6, text("power has %.2f times the error of optimal weights, %.0f times the "
                                    "variance, at a share of %.2f (bar: 9.6, [O])",
                                    gain, gain * gain, shares[shown]));
}

} // namespace

int main(int count, char** arguments) {
    options o;
    command_line app("Direct light of many lamps, chosen uniformly and by a trained distribution, by all "
                     "heuristics and by optimal weights; writes direct.csv and pictures.",
                     o);
    app.add("--samples", o.samples, "of each technique in each pixel", 1, 1000000);
    app.add("--tests", o.tests, "of each lamp in each cell, to train by", 1, 1000000);
    app.add("--cell", o.cell, "width of the cells; a room's is 4", 0.01, 100);
    return run_study(app, o, count, arguments, run);
}
