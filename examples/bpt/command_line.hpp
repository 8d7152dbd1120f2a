// The options of the renderer, for its own command line and others'.
#pragma once

#include "algorithms.hpp"
#include "media_options.hpp"
#include "render.hpp"
#include <tools/command_line.hpp>

namespace bpt {

struct options {
    std::vector<std::string> scenes{"cornell"};
    std::string output = "bpt-output", algorithm = "bpt";
    int samples = 16, size = 128, threads = settings<double>{}.threads, longest = longest_path,
        light_samples = 1;
    double beta = 2, radius = 0.01, radius_alpha = 2.0 / 3; // [H] 20 - 23
    unsigned seed = 1;
    bool random_connection = false, one_light_vertex = false;
    std::string roulette = "albedo";
    int learning_passes = settings<double>{}.learning_passes;
    media_options media;
};

inline const std::map<std::string, roulette_mode>& roulette_modes() {
    static const std::map<std::string, roulette_mode> modes{{"none", roulette_mode::none},
                                                            {"throughput", roulette_mode::throughput},
                                                            {"albedo", roulette_mode::albedo},
                                                            {"adjoint", roulette_mode::adjoint},
                                                            {"efficiency", roulette_mode::efficiency},
                                                            {"per-technique", roulette_mode::per_technique}};
    return modes;
}

inline void add_options(CLI::App& app, options& o) {
    using CLI::Range;
    const auto above_0_to = [](double most) {
        return Range(std::numeric_limits<double>::min(), most) & tools::is_number();
    };
    std::vector<std::string> scenes = all_scene_names();
    scenes.push_back("all");
    app.add_option("--scene", o.scenes, "by name, or all that show what the renderer can do")
        ->check(CLI::IsMember(scenes));
    app.add_option("--samples", o.samples, "passes: camera walks per pixel")->check(Range(1, 1000000));
    app.add_option("--size", o.size, "width and height in pixels")->check(Range(1, 4096));
    app.add_option("--output", o.output, "folder of the images");
    app.add_option("--beta", o.beta, "of the power heuristic; 1: balance")->check(above_0_to(64));
    app.add_option("--algorithm", o.algorithm, "techniques that are on")
        ->check(CLI::IsMember(algorithms<double>(1, 1)));
    app.add_flag("--one-light-vertex", o.one_light_vertex, "no connections to longer light walks");
    app.add_flag("--random-connection", o.random_connection,
                 "join each camera vertex to one light vertex only");
    app.add_option("--light-samples", o.light_samples, "next events at each camera vertex")
        ->check(Range(1, 1024));
    app.add_option("--radius", o.radius, "within which walks merge in pass 1; 1 is the scene's radius")
        ->check(above_0_to(1));
    app.add_option("--radius-alpha", o.radius_alpha,
                   "ppm, sppm, ups, vcm: the radius of pass i is that of pass 1 times i^((alpha - 1) / 2); "
                   "families in media shrink at their own rates, but for alpha = 1")
        ->check(above_0_to(1));
    app.add_option("--roulette", o.roulette,
                   "by what walks end, or go on in several copies; the last three are learned")
        ->check(CLI::IsMember(roulette_modes()));
    app.add_option("--learning-passes", o.learning_passes, "before the first one, by which rates are learned")
        ->check(Range(0, 1000));
    app.add_option("--max-vertices", o.longest, "of a path in all")->check(Range(2, longest_path));
    app.add_option("--threads", o.threads, "the image is the same for any number")->check(Range(1, 1024));
    app.add_option("--seed", o.seed, "of the random numbers");
    add_media_options(app, o.media);
}

// The options as settings for a scene. Throws std::runtime_error where no technique is left.
template <class Real> settings<Real> settings_of(const options& o, const scene<Real>& scene) {
    settings<Real> set;
    set.width = o.size;
    set.passes = o.samples;
    set.threads = o.threads;
    set.longest = o.longest;
    set.seed = o.seed;
    set.merge_radius = static_cast<Real>(o.radius) * scene.radius;
    const Real light_walks = static_cast<Real>(o.size) * static_cast<Real>(o.size);
    const auto algorithm = algorithms(light_walks, set.merge_radius).at(o.algorithm);
    set.counts = o.one_light_vertex ? one_light_vertex(algorithm.counts) : algorithm.counts;
    if (!has_technique(set.counts))
        throw std::runtime_error("--one-light-vertex leaves no technique of --algorithm '" + o.algorithm +
                                 "'");
    set.counts.next_event *= static_cast<Real>(o.light_samples);
    set.merges_once = algorithm.merges_once;
    set.radius_alpha = algorithm.is_progressive ? static_cast<Real>(o.radius_alpha) : Real(1);
    set.random_connection = o.random_connection;
    set.roulette.mode = roulette_modes().at(o.roulette);
    set.learning_passes = o.learning_passes;
    set.media = media_merges_of(o.algorithm, algorithm.counts.merge > Real(0), o.media, o.radius,
                                scene.radius, light_walks);
    return set;
}

inline const std::vector<std::string>& scenes_of(const options& o) {
    return o.scenes == std::vector<std::string>{"all"} ? scene_names() : o.scenes;
}

// Makes the folder --output and renders, as tools::run_program does.
template <class Run>
int run_program(CLI::App& app, const options& o, int count, char** arguments, Run&& run) {
    return tools::run_program(app, count, arguments, [&] {
        tools::make_folder(o.output);
        tools::finish_when_interrupted();
        return run();
    });
}

// One line on a terminal.
inline void show_progress(const std::string& what, int done, int all) {
    const std::string passes = std::to_string(done) + " of " + std::to_string(all) + " passes";
    tools::show_progress(done < all && !tools::interrupted ? what + ": " + passes : "");
}

} // namespace bpt
