// Study: what does it gain to join a camera vertex to a few of all light vertices, picked by an importance,
// in place of one of its own light walk's, picked at random? And what do weights gain that are told how often
// each pair is picked: a probability that multiplies the throughput is to be told to the weights, [J] 4. All
// in the same processor time, training included. Writes probabilistic_connections.csv and a picture for each
// scene. docs/multipliers.md tells what they show.
#include "block_means.hpp"
#include "picked_connections.hpp"
#include <lab/render.hpp>

namespace {

using namespace studies;
using real = float;

struct options : compared_options {
    double seconds = 2; // of the processor, for each image
    bool no_roulette = false;
    pick_options pick;
    options() { size = 48, scenes = {"doorway", "door", "cornell"}, runs = 6, reference_seconds = 20; }
};

// Light that is seen directly is found by one technique only, whatever is connected.
constexpr int shortest = 3; // vertices

enum estimate : std::size_t { all_of_own, one_of_own, even, untold, told, estimates };
constexpr std::array<const char*, estimates> names{"all of its own light walk", "one of its own, at random",
                                                   "k of all, at random", "k of all, weights untold",
                                                   "k of all, by importance"};

// Passes until the time is over; the renderer is made in it, too.
template <class Make> parts render_for(double seconds, int width, Make&& make) {
    parts sum(width);
    sum.shortest = shortest;
    const double start = processor_seconds();
    auto renderer = make();
    do
        add_pass(renderer, sum);
    while (processor_seconds() - start < seconds);
    return sum;
}

parts render(const bpt::scene<real>& scene, const options& o, std::size_t e, std::uint64_t seed) {
    const mis::balance_heuristic balance;
    auto set = bidirectional_settings<real>(o, seed);
    if (e == all_of_own || e == one_of_own) {
        set.random_connection = e == one_of_own;
        return render_for(o.seconds, o.size, [&] { return bpt::renderer<real>(scene, set, balance); });
    }
    pick_options pick = o.pick;
    pick.learns = e != even;
    pick.weights_know = e == told;
    return render_for(o.seconds, o.size, [&] { return picking_renderer(scene, set, pick, balance); });
}

// Mean over pixels of the squared error over the square of the reference: dark parts of an image count as
// much as bright ones.
double relative_error(const bpt::image& image, const reference& r) {
    double sum = 0;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const glm::dvec3 error = image.pixels[i] - r.mean.pixels[i];
        const double square = dot(r.mean.pixels[i], r.mean.pixels[i]);
        sum += square > 0 ? dot(error, error) / square : 0;
    }
    return sum / static_cast<double>(image.pixels.size());
}

bool report_scene(const std::string& name, const options& o, csv_file& csv) {
    const auto scene =
        o.no_roulette ? lab::without_roulette(bpt::make_scene<real>(name)) : bpt::make_scene<real>(name);
    const auto r = render_sampled_reference(name, o.reference_seconds, shortest, [&](std::size_t k) {
        return bpt::renderer<real>(scene, bidirectional_settings<real>(o, o.seed + 1000 + k));
    });
    repeated_estimates all(r, estimates);
    std::array<mean_error, estimates> relative_errors;
    std::array<double, estimates> passes{};
    for (int run = 0; run < o.runs; ++run)
        for (std::size_t e = 0; e < estimates; ++e) {
            show_progress(text("%s: run %d of %d, %s", name.c_str(), run + 1, o.runs, names[e]));
            const parts sum = render(scene, o, e, o.seed + static_cast<std::uint64_t>(run));
            const bpt::image image = mean_image(sum);
            all.add(e, image);
            relative_errors[e].squared.push_back(relative_error(image, r));
            passes[e] += static_cast<double>(sum.passes) / o.runs;
        }

    auto random = bidirectional_settings<real>(o, o.seed);
    random.random_connection = true;
    const double vertices = bpt::renderer<real>(scene, random).mean_light_vertices;
    show_progress("");
    std::printf("%s: %.2f light vertices on average; %d runs of %g s, the reference's RMS error is %.3g\n",
                name.c_str(), vertices, o.runs, o.seconds, std::sqrt(r.noise));
    for (std::size_t e = 0; e < estimates; ++e) {
        const auto over = ratio(all.errors[e], all.errors[one_of_own]),
                   relative = ratio(relative_errors[e], relative_errors[one_of_own]);
        const mean_error& error = all.errors[e];
        std::printf("  %-26s %8.1f passes   MSE %9.3g +- %7.2g, that of one at random times %.3f +- %.3f; "
                    "relative MSE %9.3g, times %.3f +- %.3f\n",
                    names[e], passes[e], error.mean(), error.standard_error(), over[0], over[1],
                    relative_errors[e].mean(), relative[0], relative[1]);
        csv.add(text("%s,%.3f,\"%s\",%d,%g,%g,%.1f,%g,%g,%g,%g,%g,%g,%g,%g", name.c_str(), vertices, names[e],
                     o.runs, o.seconds, static_cast<double>(o.seed), passes[e], error.mean(),
                     error.standard_error(), std::sqrt(error.mean()), over[0], over[1],
                     relative_errors[e].mean(), relative[0], relative[1]));
    }
    all.write_sheet(o.output + "/probabilistic_connections-" + name + ".png", names.data(),
                    static_cast<double>(scene.exposure), 3);
    bool good = all.check();
    const auto over = ratio(all.errors[told], all.errors[one_of_own]);
    if (vertices > 4)
        good &= report(over[0] < 1,
                       text("by importance below one at random: %.3f +- %.3f (bar: 1)", over[0], over[1]));
    return good;
}

bool run(const options& o) {
    return report_scenes(
        o,
        csv_file(
            o.output, "probabilistic_connections.csv",
            "scene,light_vertices,connections,runs,seconds,seed,passes,mse,standard_error,rms_error,"
            "over_random,standard_error_of_ratio,relative_mse,relative_over_random,standard_error_of_that"),
        report_scene);
}

} // namespace

int main(int count, char** arguments) {
    options o;
    command_line app("Connections to a few of all light vertices, picked by an importance; writes "
                     "probabilistic_connections.csv and pictures.",
                     o);
    add_compared(app, o, bpt::all_scene_names());
    app.add("--runs", o.runs, "images of each estimate", 2, 100000);
    app.add("--seconds", o.seconds, "processor time of each image", 1e-3, 1e6);
    app.add("--picks", o.pick.picks, "connections of each camera vertex", 1, 1024);
    app.add("--even", o.pick.even, "share of the probability that is even", 1e-3, 1);
    app.add("--cell", o.pick.cell, "width of a cell, as a part of the scene's radius", 0.05, 1);
    app.add("--no-roulette", o.no_roulette, "walks end where they leave the scene, and by their length");
    return run_study(app, o, count, arguments, run);
}
