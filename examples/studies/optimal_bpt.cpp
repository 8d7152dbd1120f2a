// Study: do optimal weights help bidirectional path tracing? Images by balance, power and optimal weights
// from the same paths, without merges and with them, against a reference; and by power in the time that
// optimal weights take. Writes optimal_bpt.csv and images. docs/optimal.md tells what it shows.
#include "render_parts.hpp"
#include <bpt/algorithms.hpp>
#include <lab/optimal.hpp>
#include <lab/pictures.hpp>
#include <lab/render.hpp>

namespace {

using namespace studies;
using real = double;

struct options : image_options {
    std::vector<std::string> scenes = bpt::scene_names();
    std::vector<int> tiles{1, 4, 16};
    int passes = 64;
    double reference_seconds = 20, radius = 0.01;
    options() { size = 48; }
};

// Light that is seen directly is found by one technique only, whatever the weights, and would be most of the
// noise.
constexpr int shortest = 3; // vertices

lab::settings<real> make_settings(const bpt::scene<real>& scene, const options& o, bool merging,
                                  std::uint64_t seed) {
    const real walks = static_cast<real>(o.size) * static_cast<real>(o.size);
    auto s = settings_of<lab::settings<real>>(o, seed);
    s.heuristic = {mis::heuristic_kind::power, 2};
    s.check_weights = false;
    s.merge_radius = o.radius * scene.radius;
    s.counts = bpt::algorithms(walks, s.merge_radius).at(merging ? "ups" : "bpt").counts;
    return s;
}

// An image of optimal weights with tiles of one width, and the time they take beside the rendering.
struct optimal_image {
    lab::optimal_weights weights;
    bpt::image sum;
    double seconds = 0;
};

bool is_power_of_2(int n) { return (n & (n - 1)) == 0; }

void add_pass(optimal_image& image, const lab::pass_result<real>& pass, int threads) {
    constexpr int first_solve = 4; // passes
    const double start = processor_seconds();
    for (const auto& row : pass.rows)
        for (const auto& sample : row.samples)
            if (sample.vertices >= shortest)
                image.sum.pixels[static_cast<std::size_t>(sample.pixel)] += image.weights.add(sample);
    image.weights.end_pass();
    if (pass.pass + 1 >= first_solve && is_power_of_2(pass.pass + 1))
        image.weights.solve(threads);
    image.seconds += processor_seconds() - start;
}

struct estimate {
    std::string name;
    int passes;
    double seconds, rms;
};

struct comparison {
    std::vector<estimate> estimates;
    std::vector<lab::labelled_image> images;
};

// Power alone, as fast as it is: until a number of passes or a time.
estimate power_alone(const lab::renderer<real>& renderer, int passes, double seconds, const char* name,
                     const reference& r) {
    parts sum(renderer.set.width);
    sum.shortest = shortest;
    const double start = processor_seconds();
    while (sum.passes < passes || processor_seconds() - start < seconds)
        studies::add_pass(renderer, sum);
    const double spent = processor_seconds() - start;
    return {name, sum.passes, spent, std::sqrt(mean_squared_error(mean_image(sum), 1, r))};
}

comparison compare(const bpt::scene<real>& scene, const options& o, bool merging, const reference& r) {
    auto settings = make_settings(scene, o, merging, o.seed);
    const auto renderer = lab::make_renderer(scene, settings);
    settings.passes = o.passes;
    settings.balance_all = true;
    std::vector<optimal_image> optimal;
    for (const int tile : o.tiles)
        optimal.push_back({{settings.counts, settings.merge_radius, o.size, tile}, bpt::black(o.size), 0});
    bpt::image balance = bpt::black(o.size), power = balance;
    double rendering = 0, since = processor_seconds();
    lab::render(scene, settings, [&](const lab::pass_result<real>& pass) {
        rendering += processor_seconds() - since;
        for (const auto& row : pass.rows)
            for (std::size_t i = 0; i < row.samples.size(); ++i) {
                const auto& c = row.contributions[i];
                if (c.vertices < shortest)
                    continue;
                balance.pixels[static_cast<std::size_t>(c.pixel)] += row.samples[i].value;
                power.pixels[static_cast<std::size_t>(c.pixel)] += c.weight * c.value;
            }
        for (auto& image : optimal)
            add_pass(image, pass, o.threads);
        show_progress(text("%s%s: %d of %d passes", scene.name.c_str(), merging ? ", merging" : "",
                           pass.pass + 1, o.passes));
        since = processor_seconds();
    });

    const double scale = 1.0 / o.passes, exposure = static_cast<double>(scene.exposure);
    const auto rms = [&](const bpt::image& image) { return std::sqrt(mean_squared_error(image, scale, r)); };
    const estimate alone = power_alone(renderer, o.passes, 0, "power", r);
    comparison c;
    c.images = {{"reference", r.mean, exposure}, {"power", power, exposure * scale}};
    c.estimates = {{"balance", o.passes, alone.seconds, rms(balance)},
                   {"power", o.passes, alone.seconds, rms(power)}};
    double longest = 0;
    for (const auto& image : optimal) {
        const std::string name = text("optimal, tile %d", image.weights.tile_width());
        c.estimates.push_back({name, o.passes, rendering + image.seconds, rms(image.sum)});
        c.images.push_back({name, image.sum, exposure * scale});
        longest = std::max(longest, rendering + image.seconds);
        if (image.weights.tile_width() == 1) {
            bpt::image direct = bpt::black(o.size);
            direct.pixels = image.weights.integrals(o.threads);
            c.estimates.push_back({"optimal, direct", o.passes, rendering + image.seconds,
                                   std::sqrt(mean_squared_error(direct, 1, r))});
            c.images.push_back({"optimal, direct", direct, exposure});
        }
    }
    c.estimates.push_back(power_alone(renderer, 1, longest, "power, that time", r));
    return c;
}

void report_scene(const std::string& name, const options& o, csv_file& csv) {
    const auto scene = bpt::make_scene<real>(name);
    for (const bool merging : {false, true}) {
        const reference r = render_reference(
            name, o.reference_seconds,
            [&](std::size_t half) {
                return lab::make_renderer(scene, make_settings(scene, o, merging, o.seed + 1000 + half));
            },
            shortest);
        const comparison c = compare(scene, o, merging, r);
        show_progress("");
        std::printf("%s%s; the reference's own RMS error is %.5f\n", name.c_str(), merging ? ", merging" : "",
                    std::sqrt(r.noise));
        const double power = c.estimates[1].rms;
        for (const estimate& e : c.estimates) {
            std::printf("  %-18s %5d passes %8.2f s   RMS error %.5f, that of power times %.2f\n",
                        e.name.c_str(), e.passes, e.seconds, e.rms, e.rms / power);
            csv.add(text("%s,%s,\"%s\",%d,%g,%g,%g", name.c_str(), merging ? "merging" : "connecting",
                         e.name.c_str(), e.passes, e.seconds, e.rms, e.rms / power));
        }
        lab::write_sheet(o.output + "/optimal_bpt-" + name + (merging ? "-merging" : "") + ".png", c.images,
                         3);
    }
}

bool run(const options& o) {
    csv_file csv(o.output, "optimal_bpt.csv", "scene,algorithm,weights,passes,seconds,rms_error,over_power");
    for (const auto& scene : o.scenes)
        report_scene(scene, o, csv);
    return true;
}

} // namespace

int main(int count, char** arguments) {
    options o;
    command_line app("Bidirectional path tracing by balance, power and optimal weights; writes "
                     "optimal_bpt.csv and images.",
                     o);
    app.add("--scene", o.scenes, "of the reference renderer", bpt::scene_names());
    app.add("--tile", o.tiles, "widths of the tiles of pixels that share a system", 1, 512);
    app.add("--passes", o.passes, "samples per pixel", 1, 1 << 20);
    app.add("--reference-seconds", o.reference_seconds, "processor time of each reference", 1e-3, 1e6);
    app.add("--radius", o.radius, "within which walks merge; 1 is the scene's radius", 1e-6, 1);
    return run_study(app, o, count, arguments, run);
}
