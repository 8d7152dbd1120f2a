// Study: roulette and splitting in the reference renderer. Each mode renders each scene for the same
// processor time, what it needs to learn its rates included, and its variance is compared. Writes
// roulette.csv, images and images of the rates. docs/roulette.md tells what it shows.
#include "panels.hpp"
#include "render_parts.hpp"
#include <bpt/algorithms.hpp>
#include <bpt/command_line.hpp>

namespace {

using namespace studies;
using glm::dvec3;
using real = float;
using mode = bpt::roulette_mode;

struct options : image_options {
    double seconds = 20;
    std::vector<std::string> scenes;
};

// In the order of the modes.
const std::vector<std::string> mode_names{"none",    "throughput", "albedo",
                                          "adjoint", "efficiency", "per-technique"};

struct entry {
    std::string scene, algorithm;
};
const std::vector<entry> entries{{"door", "lt"},     {"door", "bpt"},   {"glint", "bpt"}, {"cornell", "bpt"},
                                 {"caustic", "bpt"}, {"glossy", "bpt"}, {"milk", "bpt"}};

bpt::renderer<real, mis::power_heuristic<>> make_renderer(const bpt::scene<real>& scene, const entry& e,
                                                          mode m, const options& o) {
    bpt::options options;
    options.size = o.size;
    options.threads = o.threads;
    options.algorithm = e.algorithm;
    options.roulette = mode_names[static_cast<std::size_t>(m)];
    options.seed = static_cast<unsigned>(o.seed);
    return {scene, bpt::settings_of(options, scene), mis::power};
}

// What a mode has made in its time.
struct outcome {
    int passes = 0;
    double seconds = 0, cost = 0;     // of all, learning included; of it
    double learning = 0;              // its share of the time, before the first pass
    std::vector<double> sum, squares; // over passes, of the brightness of each pixel
    bpt::film film{1};
    bpt::roulette<real> roulette; // in the end
};

outcome render(const bpt::scene<real>& scene, const entry& e, mode m, const options& o) {
    outcome all;
    const auto pixels = static_cast<std::size_t>(o.size) * static_cast<std::size_t>(o.size);
    all.sum.resize(pixels);
    all.squares.resize(pixels);
    all.film = bpt::film(o.size);
    const double start = processor_seconds();
    auto renderer = make_renderer(scene, e, m, o);
    const double learned = processor_seconds() - start;
    all.cost = renderer.learner ? renderer.learner->cost : 0;
    while (all.passes < 4 || processor_seconds() - start < o.seconds) {
        bpt::pass_rows<real> rows(o.size);
        bpt::render_pass(renderer, all.passes, rows.keep(all.passes, true, bpt::rows_to_learn_from));
        if (renderer.learner)
            bpt::learn(renderer, rows);
        std::vector<double> image(pixels);
        rows.for_each([&](std::size_t pixel, const dvec3& value) {
            image[pixel] += bpt::brightness(value);
            all.film.sum.pixels[pixel] += value;
        });
        for (std::size_t i = 0; i < pixels; ++i) {
            all.sum[i] += image[i];
            all.squares[i] += image[i] * image[i];
        }
        for (const auto& row : rows.visits)
            all.cost += row.cost / static_cast<double>(pixels);
        ++all.passes;
        all.film.passes = all.passes;
        show_progress(text("%s, %s, %s: %d passes, %.0f of %.0f s", e.scene.c_str(), e.algorithm.c_str(),
                           mode_names[static_cast<std::size_t>(m)].c_str(), all.passes,
                           processor_seconds() - start, o.seconds));
    }
    all.seconds = processor_seconds() - start;
    all.learning = learned / all.seconds;
    all.roulette = renderer.weigh.roulette;
    return all;
}

// The mean of 5 x 5 pixels around each.
std::vector<double> blurred(const std::vector<double>& image, int width) {
    std::vector<double> mean(image.size());
    for (int i = 0; i < width * width; ++i) {
        int count = 0;
        for (int y = std::max(0, i / width - 2); y <= std::min(width - 1, i / width + 2); ++y)
            for (int x = std::max(0, i % width - 2); x <= std::min(width - 1, i % width + 2); ++x, ++count)
                mean[static_cast<std::size_t>(i)] += image[static_cast<std::size_t>(y * width + x)];
        mean[static_cast<std::size_t>(i)] /= count;
    }
    return mean;
}

// Variance of one pass over the squared brightness, mean over pixels; pixels darker than a tenth of the image
// count as that. Its standard error is the jackknife's, over 16 interleaved parts of the image's pixels.
struct noise {
    double variance = 0, error = 0;
};
noise noise_of(const outcome& x, const std::vector<double>& expected, int width) {
    double mean = 0;
    for (const double e : expected)
        mean += e / static_cast<double>(expected.size());
    constexpr int across = 4, parts = across * across;
    std::array<double, parts> sums{}, counts{};
    for (std::size_t i = 0; i < expected.size(); ++i) {
        const double average = x.sum[i] / x.passes, scale = std::max(expected[i], 0.1 * mean);
        const double variance = (x.squares[i] - x.passes * average * average) / (x.passes - 1);
        const auto w = static_cast<std::size_t>(width);
        const std::size_t part = i / w % across * across + i % w % across;
        sums[part] += variance / (scale * scale);
        counts[part] += 1;
    }
    noise n;
    for (std::size_t k = 0; k < parts; ++k)
        n.variance += sums[k] / counts[k] / parts;
    for (std::size_t k = 0; k < parts; ++k)
        n.error +=
            (sums[k] / counts[k] - n.variance) * (sums[k] / counts[k] - n.variance) / (parts - 1) / parts;
    n.error = std::sqrt(n.error);
    return n;
}

// ---- Pictures ----

// 1/8 and less, 1, 8 and more: blue, white, red.
dvec3 rate_color(double x) {
    const dvec3 low(0.13, 0.35, 0.7), middle(0.96), high(0.78, 0.13, 0.1);
    return x < 0.5 ? glm::mix(low, middle, 2 * x) : glm::mix(middle, high, 2 * x - 1);
}

// The mean rate of a kind of walk at what the middle of each pixel sees; of all directions that are known.
image rates_of(const bpt::scene<real>& scene, const bpt::roulette<real>& roulette, bpt::walk_kind kind,
               int width) {
    image shown(width, width);
    pcg32 unused;
    const auto lens = bpt::sample_lens(scene.camera, unused);
    for (int row = 0; row < width; ++row)
        for (int column = 0; column < width; ++column) {
            const real to_film = real(2) / static_cast<real>(width);
            const auto direction = bpt::film_to_direction(
                scene.camera, lens, (static_cast<real>(column) + real(0.5)) * to_film - 1,
                1 - (static_cast<real>(row) + real(0.5)) * to_film);
            dvec3& pixel = shown.pixels[static_cast<std::size_t>(row * width + column)];
            pixel = dvec3(0.25);
            const auto hit = bpt::intersect(scene, lens.point.position, direction);
            if (!hit || hit->light >= 0)
                continue;
            bpt::vertex<real> x;
            x.point = *hit;
            x.material = &scene.materials[static_cast<std::size_t>(hit->material)];
            roulette.find_cells(x);
            double sum = 0;
            int known = 0;
            const auto add = [&](const bpt::vec3<real>& from) {
                if (const auto* bin = roulette.bin_at(kind, x, from))
                    sum += static_cast<double>(bin->rate), ++known;
            };
            if (kind == bpt::walk_kind::from_camera)
                add(-direction);
            else
                for (int axis = 0; axis < 3; ++axis)
                    for (const real sign : {real(-1), real(1)}) {
                        bpt::vec3<real> from(0);
                        from[axis] = sign;
                        if (dot(from, hit->normal) * dot(direction, hit->normal) <= 0)
                            add(from);
                    }
            if (known > 0)
                pixel = rate_color(std::clamp(0.5 + std::log2(sum / known) / 6, 0.0, 1.0));
        }
    return shown;
}

image picture_of(const outcome& x, double exposure) {
    image shown(x.film.sum.width, x.film.sum.width);
    for (std::size_t i = 0; i < shown.pixels.size(); ++i)
        for (int c = 0; c < 3; ++c)
            shown.pixels[i][c] = to_srgb(std::clamp(exposure / x.passes * x.film.sum.pixels[i][c], 0.0, 1.0));
    return shown;
}
image enlarged(const image& small, int times) {
    image large(small.width * times, small.height * times);
    for (int y = 0; y < large.height; ++y)
        for (int x = 0; x < large.width; ++x)
            large.pixels[static_cast<std::size_t>(y * large.width + x)] =
                small.pixels[static_cast<std::size_t>(y / times * small.width + x / times)];
    return large;
}

bool run(const options& o) {
    csv_file csv(o.output, "roulette.csv",
                 "scene,algorithm,roulette,passes,seconds,learning,cost_per_pass,variance,standard_error,"
                 "efficiency_by_cost,efficiency_by_time");
    bool good = true;
    std::printf("%-12s %-7s %-14s %7s %9s %9s %12s %18s %18s %18s\n", "scene", "", "roulette", "passes",
                "ms/pass", "learning", "cost/pass", "variance", "efficiency, cost", "efficiency, time");
    for (const auto& e : entries) {
        if (!o.scenes.empty() && std::find(o.scenes.begin(), o.scenes.end(), e.scene) == o.scenes.end())
            continue;
        const auto scene = bpt::make_scene<real>(e.scene);
        std::vector<outcome> outcomes;
        for (std::size_t m = 0; m < mode_names.size(); ++m)
            outcomes.push_back(render(scene, e, static_cast<mode>(m), o));
        show_progress("");
        std::vector<double> expected(outcomes[0].sum.size());
        int passes = 0;
        for (const auto& x : outcomes) {
            passes += x.passes;
            for (std::size_t i = 0; i < expected.size(); ++i)
                expected[i] += x.sum[i];
        }
        for (double& x : expected)
            x /= passes;
        expected = blurred(expected, o.size);
        std::vector<noise> noises;
        std::vector<double> by_cost, by_time; // efficiencies
        for (const auto& x : outcomes) {
            noises.push_back(noise_of(x, expected, o.size));
            by_cost.push_back(x.passes / (noises.back().variance * x.cost));
            by_time.push_back(x.passes / (noises.back().variance * x.seconds));
        }
        const auto throughput = static_cast<std::size_t>(mode::throughput);
        double best = 0, best_by_time = 0;
        std::size_t best_mode = 0;
        for (std::size_t m = 0; m < outcomes.size(); ++m) {
            const auto& x = outcomes[m];
            const double cost = by_cost[m] / by_cost[throughput], time = by_time[m] / by_time[throughput];
            const double error = std::hypot(noises[m].error / noises[m].variance,
                                            noises[throughput].error / noises[throughput].variance);
            std::printf(
                "%-12s %-7s %-14s %7d %9.2f %8.1f%% %12.1f %10.4g ± %4.1f%% %10.3f ± %4.1f%% %18.3f\n",
                e.scene.c_str(), e.algorithm.c_str(), mode_names[m].c_str(), x.passes,
                1e3 * x.seconds / x.passes, 100 * x.learning, x.cost / x.passes, noises[m].variance,
                100 * noises[m].error / noises[m].variance, cost, m == throughput ? 0.0 : 100 * error, time);
            csv.add(text("%s,%s,%s,%d,%.3f,%.4f,%.2f,%.5g,%.2g,%.4f,%.4f", e.scene.c_str(),
                         e.algorithm.c_str(), mode_names[m].c_str(), x.passes, x.seconds, x.learning,
                         x.cost / x.passes, noises[m].variance, noises[m].error, cost, time));
            if (bpt::is_learned(static_cast<mode>(m)) && cost > best)
                best = cost, best_by_time = time, best_mode = m;
        }
        const double bar = e.scene == "door" && e.algorithm == "lt" ? 2 : 0.9;
        good &=
            report(best >= bar, text("%s, %s: the best learned rates, %s, have %.2f times the efficiency of "
                                     "throughput roulette by cost, %.2f by time (bar: %g)",
                                     e.scene.c_str(), e.algorithm.c_str(), mode_names[best_mode].c_str(),
                                     best, best_by_time, bar));
        const double exposure = static_cast<double>(scene.exposure);
        const auto& shown = outcomes[best_mode];
        const int times = std::max(1, 288 / o.size);
        std::vector<panel> panels{
            {"by throughput", enlarged(picture_of(outcomes[throughput], exposure), times)},
            {mode_names[best_mode] + ", same time", enlarged(picture_of(shown, exposure), times)}};
        if (e.algorithm != "lt")
            panels.push_back({"rates, camera walks",
                              rates_of(scene, shown.roulette, bpt::walk_kind::from_camera, times * o.size)});
        panels.push_back({"rates, light walks",
                          rates_of(scene, shown.roulette, bpt::walk_kind::from_light, times * o.size)});
        write_panels(o.output + "/roulette-" + e.scene + "-" + e.algorithm + ".jpg", panels,
                     {rate_color, "1/8", "8 copies"});
        std::fflush(stdout);
    }
    return good;
}

} // namespace

int main(int count, char** arguments) {
    options o;
    command_line app("Roulette and splitting in the reference renderer: each mode in each scene for the "
                     "same time; writes roulette.csv and pictures.",
                     o);
    app.add("--seconds", o.seconds, "of processor time for each image", 0.01, 1e6);
    app.add("--scene", o.scenes, "only these", {"door", "glint", "cornell", "caustic", "glossy", "milk"});
    return run_study(app, o, count, arguments, run);
}
