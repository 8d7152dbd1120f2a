// Study: the light between patches by walks, by ray bundles and by both together, as many of each as a pilot
// has it, at equal time; [C] figure 3. Time is that of the processor, so that a busy machine changes little.
// And what [C]'s single weight makes of it; and how far patches are from what they are cut from. Writes
// bundles.csv and pictures; bundles.gp draws the table. docs/sequences.md tells what it shows.
#include "bundles_model.hpp"
#include "panels.hpp"
#include "render_parts.hpp"
#include <bpt/algorithms.hpp>

namespace {

using namespace studies;
using namespace studies::bundles;

struct options : image_options {
    int patches = 4000, runs = 8;
    double pilot_share = 0.05;                                        // of the time
    double seconds = 8, reference_seconds = 240, smooth_seconds = 40; // of the processor
    std::vector<std::string> scenes{"glossy_floor"};
    options() { size = 256; }
};

run_options settings_of(const options& o) { return {o.threads, 4, weighting::each_term}; }

constexpr int places = 3; // of the image, across each pixel, that are asked for their patches

std::unique_ptr<problem> make_problem(const std::string& scene, const options& o, int patches) {
    auto p = std::make_unique<problem>(bpt::make_scene<real>(scene));
    make_patches(*p, patches, places * o.size);
    return p;
}

// ---- Pictures ----

// Radiance of patches, or what stands for it; `lamps`: as lamps are to be seen.
template <class Of> image to_image(const problem& p, Of&& of, bool lamps = true) {
    const int size = p.view_width / places;
    image m(size, size);
    for (int y = 0; y < p.view_width; ++y)
        for (int x = 0; x < p.view_width; ++x) {
            const int seen = p.view[static_cast<std::size_t>(y * p.view_width + x)];
            if (seen < 0)
                continue;
            const auto i = static_cast<std::size_t>(seen);
            const int lamp = p.patches[i].point.light;
            const glm::dvec3 value = lamp < 0 ? glm::dvec3(of(i))
                                     : lamps  ? p.scene.lights[static_cast<std::size_t>(lamp)].emission
                                              : glm::dvec3(0);
            m.pixels[static_cast<std::size_t>(y / places * size + x / places)] +=
                value / double(places * places);
        }
    return m;
}
image exposed(image m, double exposure) {
    for (auto& pixel : m.pixels)
        pixel *= exposure;
    return m;
}

// ---- Errors ----

struct patch_reference {
    std::vector<rgb> mean;
    double noise = 0; // mean squared error of the mean
};

double mean_square(const problem& p, const std::vector<rgb>& a, const std::vector<rgb>& b) {
    double sum = 0;
    for (const std::size_t i : p.seen)
        sum += dot(a[i] - b[i], a[i] - b[i]);
    return sum / (3 * static_cast<double>(p.seen.size()));
}

std::vector<rgb> sum_of(const solution& s) {
    std::vector<rgb> all = s.by_bundles;
    for (std::size_t i = 0; i < all.size(); ++i)
        all[i] += s.by_walks[i];
    return all;
}

double root_of_mean_square(const problem& p, const std::vector<rgb>& a) {
    return std::sqrt(mean_square(p, a, std::vector<rgb>(a.size(), rgb(0))));
}

// Of bidirectional paths, one for each seen patch.
double seconds_of_all_walks(const problem& p, const costs& c) {
    double sum = static_cast<double>(p.seen.size()) * c.light_walk;
    for (const double x : c.walks)
        sum += x;
    return sum;
}

counts all_steps(const problem& p, double steps) {
    return {steps, std::vector<real>(p.seen_by_kind.size()), 0};
}
counts all_walks(const problem& p, double each) {
    return {0, std::vector<real>(p.seen_by_kind.size(), each),
            std::round(each * static_cast<double>(p.seen.size()))};
}

costs measure_costs(const problem& p, const options& o) {
    constexpr int repetitions = 16;
    const auto seconds_of = [&](const counts& n) {
        const double start = processor_seconds();
        solve(p, n, 1, settings_of(o));
        return processor_seconds() - start;
    };
    costs c{seconds_of(all_steps(p, repetitions)) / repetitions, {}, 0};
    for (std::size_t kind = 0; kind < p.seen_by_kind.size(); ++kind) {
        counts n = all_steps(p, 0);
        n.walks[kind] = repetitions;
        c.walks.push_back(p.seen_by_kind[kind] > 0 ? seconds_of(n) / repetitions : 0);
    }
    counts n = all_steps(p, 0);
    n.light_walks = repetitions * static_cast<double>(p.seen.size());
    c.light_walk = seconds_of(n) / n.light_walks;
    return c;
}

// Walks alone, in two halves that know nothing of each other.
patch_reference make_reference(const problem& p, const options& o, const costs& c) {
    std::array<std::vector<rgb>, 2> halves;
    constexpr int parts = 8;
    const double each =
        std::max(1.0, std::round(o.reference_seconds / seconds_of_all_walks(p, c) / (2 * parts)));
    for (std::size_t half = 0; half < 2; ++half) {
        halves[half].resize(p.patches.size(), rgb(0));
        for (int part = 0; part < parts; ++part) {
            show_progress(text("%s: reference, part %d of %d", p.scene.name.c_str(),
                               int(half) * parts + part + 1, 2 * parts));
            const auto s = sum_of(solve(p, all_walks(p, each),
                                        o.seed + 10000 + half * parts + std::size_t(part), settings_of(o)));
            for (std::size_t i = 0; i < s.size(); ++i)
                halves[half][i] += s[i] / double(parts);
        }
    }
    patch_reference r{halves[0], mean_square(p, halves[0], halves[1]) / 4};
    for (std::size_t i = 0; i < r.mean.size(); ++i)
        r.mean[i] = (halves[0][i] + halves[1][i]) / 2.0;
    return r;
}

// ---- Methods at equal time ----

enum contestant : std::size_t { bundles_alone, walks_alone, together, contestants };
constexpr std::array<const char*, contestants> names{"bundles", "paths", "both"};

struct measured {
    double seconds = 0, rays = 0, squared = 0;    // means over runs
    double steps = 0, walks = 0, light_walks = 0; // walks: of each seen patch
    std::vector<std::vector<rgb>> found;          // of runs
    std::unique_ptr<solution> first;
};

constexpr std::uint64_t pilot_seed(std::uint64_t seed) { return seed + (1 << 20); }

counts counts_for(const problem& p, const options& o, const costs& c, contestant who, double seconds,
                  std::uint64_t seed, ray_count& rays) {
    if (who == bundles_alone)
        return all_steps(p, std::max(1.0, std::round(seconds / c.step)));
    if (who == walks_alone)
        return all_walks(p, seconds / seconds_of_all_walks(p, c));
    const int steps = std::max(8, static_cast<int>(o.pilot_share * seconds / c.step));
    const counts n = find_counts(p, c, std::max(0.5 * seconds, seconds - steps * c.step), steps,
                                 pilot_seed(seed), settings_of(o), rays);
    return n;
}

measured measure(const problem& p, const options& o, const costs& c, const patch_reference& r, contestant who,
                 double seconds) {
    measured m;
    for (int run = 0; run < o.runs; ++run) {
        show_progress(
            text("%s: %.3g s, %s, run %d of %d", p.scene.name.c_str(), seconds, names[who], run + 1, o.runs));
        const std::uint64_t seed = o.seed + 100 * who + std::uint64_t(run);
        const double start = processor_seconds();
        ray_count rays;
        const counts n = counts_for(p, o, c, who, seconds, seed, rays);
        auto s = std::make_unique<solution>(solve(p, n, seed, settings_of(o)));
        m.seconds += (processor_seconds() - start) / o.runs;
        m.rays += double(rays.parallel + rays.other + s->rays.parallel + s->rays.other) / o.runs;
        m.found.push_back(sum_of(*s));
        m.squared += (mean_square(p, m.found.back(), r.mean) - r.noise) / o.runs;
        m.steps += n.steps / o.runs;
        m.light_walks += n.light_walks / o.runs;
        for (std::size_t kind = 0; kind < n.walks.size(); ++kind)
            m.walks += n.walks[kind] * double(p.seen_by_kind[kind]) / double(p.seen.size()) / o.runs;
        if (run == 0) {
            m.first = std::move(s);
            for (std::size_t kind = 0; who == together && kind < n.walks.size(); ++kind)
                if (p.seen_by_kind[kind] > 0 && seconds == o.seconds)
                    note(text("material %zu: %zu patches, %.2f walks each", kind, p.seen_by_kind[kind],
                              n.walks[kind]));
        }
    }
    return m;
}

// How far means of blocks of patches are from the reference at most, in standard errors.
double largest_distance(const problem& p, const std::vector<std::vector<rgb>>& runs,
                        const patch_reference& r) {
    const std::size_t blocks = std::min<std::size_t>(64, p.seen.size()), size = p.seen.size() / blocks;
    const double count = static_cast<double>(runs.size());
    double largest = 0;
    for (std::size_t block = 0; block < blocks; ++block) {
        double sum = 0, squares = 0;
        for (const auto& found : runs) {
            double apart = 0;
            for (std::size_t k = block * size; k < (block + 1) * size; ++k)
                apart += brightness(found[p.seen[k]] - r.mean[p.seen[k]]) / static_cast<double>(size);
            sum += apart, squares += apart * apart;
        }
        const double mean = sum / count, variance = (squares / count - mean * mean) / (count - 1);
        largest =
            std::max(largest, std::abs(mean) / std::sqrt(variance + r.noise / static_cast<double>(size)));
    }
    return largest;
}

std::vector<rgb> mean_of(const std::vector<std::vector<rgb>>& runs) {
    std::vector<rgb> mean(runs[0].size(), rgb(0));
    for (const auto& found : runs)
        for (std::size_t i = 0; i < mean.size(); ++i)
            mean[i] += found[i] / static_cast<double>(runs.size());
    return mean;
}

// ---- What is written ----

using by_contestant = std::array<measured, contestants>;

void write_pictures(const problem& p, const options& o, const by_contestant& little,
                    const by_contestant& much) {
    const std::string base = o.output + "/bundles-" + p.scene.name;
    const auto shown = [&](const std::vector<rgb>& of, bool lamps = true) {
        return exposed(to_image(
                           p, [&](std::size_t i) { return of[i]; }, lamps),
                       p.scene.exposure);
    };
    write_panels(base + ".jpg", {{"ray bundles", shown(little[bundles_alone].found[0])},
                                 {"bidirectional paths", shown(little[walks_alone].found[0])},
                                 {"both", shown(little[together].found[0])}});
    const solution& s = *much[together].first;
    write_panels(base + "-parts.jpg", {{"weighted bundles", shown(s.by_bundles, false)},
                                       {"weighted paths", shown(s.by_walks, false)},
                                       {"their sum", shown(sum_of(s))}});
}

// [C]'s single weight, half of the time for walks and half for bundles, so that both are weighed; and a
// weight for each term of the same paths.
void show_single_weight(const problem& p, const options& o, const costs& c, const patch_reference& r) {
    constexpr double most = 0.1; // what the colours reach to
    const counts n{std::round(o.seconds / 2 / c.step),
                   all_walks(p, o.seconds / 2 / seconds_of_all_walks(p, c)).walks, 0};
    const auto mean_by = [&](weighting by) {
        std::vector<std::vector<rgb>> runs;
        run_options set = settings_of(o);
        set.by = by;
        for (int run = 0; run < o.runs; ++run) {
            show_progress(text("%s: single weights, run %d of %d", p.scene.name.c_str(), run + 1, o.runs));
            runs.push_back(sum_of(solve(p, n, o.seed + 5000 + std::uint64_t(run), set)));
        }
        return mean_of(runs);
    };
    const auto too_bright = [&](const std::vector<rgb>& found, const std::vector<rgb>& right) {
        return to_image(p, [&](std::size_t i) {
            const double part = brightness(found[i]) / brightness(right[i]) - 1;
            return blue_to_orange(std::clamp(0.5 + part / (2 * most), 0.0, 1.0));
        });
    };
    const std::vector<rgb> each = mean_by(weighting::each_term), single = mean_by(weighting::single);
    for (std::size_t kind = 0; kind < p.seen_by_kind.size(); ++kind) {
        double sums[] = {0, 0, 0};
        for (const std::size_t i : p.seen)
            if (static_cast<std::size_t>(p.patches[i].point.material) == kind) {
                sums[0] += brightness(r.mean[i]);
                sums[1] += brightness(each[i]);
                sums[2] += brightness(single[i]);
            }
        if (p.seen_by_kind[kind] > 0)
            note(text(
                "material %zu: %.2f %% too bright with a weight for each term, with one for all %.2f %%; "
                "one over each %.2f %%",
                kind, 100 * (sums[1] / sums[0] - 1), 100 * (sums[2] / sums[0] - 1),
                100 * (sums[2] / sums[1] - 1)));
    }
    write_panels(o.output + "/bundles-" + p.scene.name + "-single.jpg",
                 {{"a weight per term", too_bright(each, r.mean)},
                  {"one weight", too_bright(single, r.mean)},
                  {"one over per term", too_bright(single, each)}},
                 {blue_to_orange, text("%.0f %% darker", 100 * most), text("%.0f %% brighter", 100 * most)});
}

// Images of patches against one of the smooth scene; lamps are left out. Half as large as others, so that
// there is little noise.
void compare_with_smooth(const std::string& scene, options o) {
    o.size /= 2;
    const auto smooth = bpt::make_scene<real>(scene);
    constexpr int without_lamps = 3; // vertices of a path, at least
    const auto truth = render_reference(
        scene + ", smooth", o.smooth_seconds,
        [&](std::size_t half) {
            bpt::settings<real> set;
            set.width = o.size;
            set.threads = o.threads;
            set.seed = o.seed + half;
            set.counts = bpt::algorithms<real>(real(o.size) * o.size, 1).at("bpt").counts;
            return bpt::renderer<real>(smooth, set);
        },
        without_lamps);
    image shown(o.size, o.size);
    shown.pixels = truth.mean.pixels;
    double level = 0;
    for (const auto& pixel : shown.pixels)
        level += dot(pixel, pixel);
    level = std::sqrt(level / (3 * static_cast<double>(shown.pixels.size())));
    std::vector<panel> panels{{"smooth", exposed(shown, smooth.exposure)}};
    for (const int patches : {1000, 4000, 30000}) {
        const auto p = make_problem(scene, o, patches);
        const costs c = measure_costs(*p, o);
        ray_count rays;
        const counts n =
            find_counts(*p, c, o.smooth_seconds / 2, 16, pilot_seed(o.seed), settings_of(o), rays);
        const auto found = sum_of(solve(*p, n, o.seed, settings_of(o)));
        bpt::image m = bpt::black(o.size);
        m.pixels = to_image(
                       *p, [&](std::size_t i) { return found[i]; }, false)
                       .pixels;
        note(text("%s: %zu patches are %.3f of the radiance from the smooth scene (its noise: %.3f)",
                  scene.c_str(), p->patches.size(), std::sqrt(mean_squared_error(m, 1, truth)) / level,
                  std::sqrt(truth.noise) / level));
        shown.pixels = m.pixels;
        panels.push_back({text("%zu", p->patches.size()), exposed(shown, smooth.exposure)});
    }
    write_panels(o.output + "/bundles-patches.jpg", panels);
}

bool run(const options& o) {
    csv_file csv(o.output, "bundles.csv", "scene,method,seconds,rays,rms_error,steps,walks,light_walks");
    bool good = true;
    for (const std::string& name : o.scenes) {
        const auto p = make_problem(name, o, o.patches);
        const costs c = measure_costs(*p, o);
        std::printf("%s: %zu patches, %zu seen; a step %.3g s, walks from all %.3g s\n", name.c_str(),
                    p->patches.size(), p->seen.size(), c.step, seconds_of_all_walks(*p, c));
        const patch_reference r = make_reference(*p, o, c);
        const double level = root_of_mean_square(*p, r.mean);
        note(text("radiance has the root mean square %.4g, the reference the error %.2g of it", level,
                  std::sqrt(r.noise) / level));
        by_contestant first, all;
        double ratio = 0;
        for (const double seconds : {o.seconds / 16, o.seconds / 4, o.seconds}) {
            for (const contestant who : {bundles_alone, walks_alone, together}) {
                measured& m = all[who] = measure(*p, o, c, r, who, seconds);
                const double error = std::sqrt(std::max(0.0, m.squared)) / level;
                show_progress("");
                std::printf(
                    "  %-8s %7.3f s  %10.4g rays  error %.5f  %8.1f steps, %7.2f walks, %9.0f light walks\n",
                    names[who], m.seconds, m.rays, error, m.steps, m.walks, m.light_walks);
                csv.add(text("%s,%s,%g,%g,%g,%g,%g,%g", name.c_str(), names[who], m.seconds, m.rays, error,
                             m.steps, m.walks, m.light_walks));
            }
            const auto at_equal_time = [&](contestant who) { return all[who].squared * all[who].seconds; };
            ratio = std::sqrt(at_equal_time(together) /
                              std::min(at_equal_time(bundles_alone), at_equal_time(walks_alone)));
            note(text("%s, %.3g s: the error of both is %.3f of the better one's alone", name.c_str(),
                      seconds, ratio));
            if (seconds < o.seconds / 8)
                first = std::move(all);
        }
        if (name == "glossy_floor")
            good &= report(ratio <= 0.85, text("%s: the error of both is %.3f of the better one's alone at "
                                               "equal time (bar: 0.85)",
                                               name.c_str(), ratio));
        const double apart = largest_distance(*p, all[together].found, r);
        good &=
            report(apart <= 8, text("%s: means of 64 blocks are up to %.1f standard errors from the "
                                    "reference (bar: 8, by chance with at most 6 seeds of 1000 if there are "
                                    "8 runs)",
                                    name.c_str(), apart));
        write_pictures(*p, o, first, all);
        if (name == "glossy_floor") {
            show_single_weight(*p, o, c, r);
            compare_with_smooth(name, o);
        }
    }
    return good;
}

} // namespace

int main(int count, char** arguments) {
    options o;
    command_line app("Light between patches by ray bundles, by walks and by both at equal time; writes "
                     "bundles.csv and pictures.",
                     o);
    app.add("--patches", o.patches, "of a scene, about", 100, 100000);
    app.add("--seconds", o.seconds, "processor time of each run", 1e-3, 1e6);
    app.add("--runs", o.runs, "of each method", 2, 1000);
    app.add("--pilot-share", o.pilot_share, "of the time, for steps before counts are chosen", 0, 0.5);
    app.add("--reference-seconds", o.reference_seconds, "processor time of a scene's reference", 1e-3, 1e6);
    app.add("--smooth-seconds", o.smooth_seconds, "processor time of the smooth scene's image", 1e-3, 1e6);
    app.add("--scene", o.scenes, "of triangles and rectangular lamps", {});
    return run_study(app, o, count, arguments, run);
}
