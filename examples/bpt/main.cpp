// The reference renderer's command line: renders scenes, writes their images and prints how far the three
// ways of computing weights are apart.
#include "algorithms.hpp"
#include "compare.hpp"
#include "optimal.hpp"
#include "render.hpp"
#include <CLI/CLI.hpp>
#include <chrono>
#include <climits>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <unistd.h>

namespace {

struct options {
    std::vector<std::string> scenes{"cornell"}, mistakes;
    std::string output = "bpt-output", scalar = "double", heuristic = "power", algorithm = "bpt", dump,
                reference;
    int samples = 16, size = 128, threads = static_cast<int>(std::thread::hardware_concurrency()),
        longest = 10;
    int dump_limit = 2000, light_samples = 1, optimal = 0;
    int max_camera_vertices = INT_MAX, max_light_vertices = INT_MAX;
    double beta = 2, alpha = 0.1, radius = 0.01, radius_alpha = mis::optimal_alpha<double>, scale = 1;
    unsigned seed = 1;
    bool demo = false, random_connection = false, no_roulette = false, no_checks = false,
         one_light_vertex = false, snapshots = false;
};

[[noreturn]] void fail(const std::string& message) {
    std::fprintf(stderr, "bpt: %s\n", message.c_str());
    std::exit(2);
}

template <class Map> std::string names_in(const Map& map) {
    std::string names;
    for (const auto& entry : map)
        names += (names.empty() ? "" : ", ") + entry.first;
    return names;
}
template <class Map> auto choose(const Map& map, const std::string& name, const std::string& option) {
    const auto found = map.find(name);
    if (found == map.end())
        fail(option + " '" + name + "' is unknown; there are " + names_in(map));
    return found->second;
}

bpt::any_heuristic heuristic_of(const options& o) {
    using kind = bpt::heuristic_kind;
    const std::map<std::string, kind> kinds{{"average", kind::average},
                                            {"balance", kind::balance},
                                            {"power", kind::power},
                                            {"cutoff", kind::cutoff},
                                            {"maximum", kind::maximum}};
    const kind k = choose(kinds, o.heuristic, "--heuristic");
    return {k, k == kind::cutoff ? o.alpha : o.beta};
}

template <class Real> bpt::algorithm<Real> algorithm_of(const options& o, Real merge_radius) {
    const Real pixels = static_cast<Real>(o.size) * static_cast<Real>(o.size);
    auto algorithm = choose(bpt::algorithms(pixels, merge_radius), o.algorithm, "--algorithm");
    auto& counts = algorithm.counts;
    if (o.one_light_vertex)
        counts = bpt::one_light_vertex(counts);
    counts.next_event *= static_cast<Real>(o.light_samples);
    counts.max_camera_vertices = o.max_camera_vertices;
    counts.max_light_vertices = o.max_light_vertices;
    return algorithm;
}

bpt::mistake_set mistakes_of(const options& o) {
    std::map<std::string, std::size_t> places;
    for (std::size_t k = 0; k < bpt::mistake_count; ++k)
        places[bpt::mistake_names[k]] = k;
    bpt::mistake_set set;
    for (const auto& name : o.mistakes)
        set.planted.set(choose(places, name, "--mistake"));
    return set;
}

void show_progress(const std::string& what, int done, int all) {
    if (!isatty(STDERR_FILENO))
        return;
    constexpr int width = 40;
    const int filled = width * done / all;
    std::fprintf(stderr, "\r%-24s [%s%s] %3d %%%s", what.c_str(),
                 std::string(std::size_t(filled), '#').c_str(),
                 std::string(std::size_t(width - filled), ' ').c_str(), 100 * done / all,
                 done == all ? "\r\033[K" : "");
}

// The bars that the weights must meet, and whether they do.
template <class Real> bool is_good(const bpt::weight_checks& c) {
    if (sizeof(Real) == 4)
        return c.recursion.largest <= 1e-4 && c.recursion.above_1e_5 * 10000 <= c.recursion.compared &&
               c.sum <= 1e-12 && c.recursion_sum <= 1e-5;
    return c.recursion.largest <= 1e-9 && c.throughput.largest <= 1e-9 && c.sum <= 1e-12 &&
           c.recursion_sum <= 1e-12;
}

void print_heading() {
    std::printf("%-12s %-7s %-8s %10s  %7s  %10s  %10s  %10s  %10s  %8s\n", "scene", "scalar", "weights",
                "paths", "n", "recursion", "throughput", "sum", "sum (rec.)", "> 1e-5");
}
template <class Real>
bool print_checks(const std::string& scene, const options& o, const bpt::weight_checks& c) {
    const bool good = is_good<Real>(c);
    const bool in_float = sizeof(Real) == 4;
    char throughput[32];
    const char* const format = c.throughput.compared == 0 ? "-" : in_float ? "(%.1e)" : "%.1e";
    std::snprintf(throughput, sizeof throughput, format, c.throughput.largest);
    std::printf(
        "%-12s %-7s %-8s %10lld  %2d ..%2d  %10.1e  %10s  %10.1e  %10.1e  %6.4f %%  %s\n", scene.c_str(),
        in_float ? "float" : "double", o.heuristic.c_str(), static_cast<long long>(c.paths), c.shortest,
        c.longest, c.recursion.largest, throughput, c.sum, c.recursion_sum,
        100.0 * double(c.recursion.above_1e_5) / double(std::max<std::int64_t>(1, c.recursion.compared)),
        good ? "good" : "BAD");
    return good;
}

void write_image(const std::string& base, const bpt::film& film, double exposure) {
    bpt::write_png(base + ".png", film, exposure);
    bpt::write_exr(base + ".exr", film);
}

bool is_power_of_4(int n) {
    while (n % 4 == 0)
        n /= 4;
    return n == 1;
}

using seconds = std::chrono::duration<double>;

// What --snapshots writes: images, and a line of NAME-convergence.csv for each of them and for the last pass.
struct snapshots {
    std::string base;
    double exposure;
    std::optional<bpt::image> reference;
    std::ofstream table;
    seconds rendered{0}; // time, without that spent here
    std::chrono::steady_clock::time_point since;

    snapshots(const options& o, const std::string& name, double exposure_of_scene)
        : base(o.output + "/" + name), exposure(exposure_of_scene) {
        if (!o.reference.empty())
            reference = bpt::read_exr(o.reference, o.size);
        table.open(base + "-convergence.csv");
        table << "passes,seconds" << (reference ? ",rms_error" : "") << std::endl;
        since = std::chrono::steady_clock::now();
    }
    void end_pass(const bpt::film& film, bool is_last) {
        rendered += std::chrono::steady_clock::now() - since;
        const bool is_due = is_power_of_4(film.passes);
        if (is_due)
            write_image(base + "-passes-" + std::to_string(film.passes), film, exposure);
        if (is_due || is_last) {
            table << film.passes << ',' << rendered.count();
            if (reference)
                table << ',' << bpt::rms_error(film, *reference);
            if (!(table << std::endl))
                throw std::runtime_error("cannot write " + base + "-convergence.csv");
        }
        since = std::chrono::steady_clock::now();
    }
};

// What --optimal writes: an image by optimal weights, from the paths of the other one.
struct optimal_image {
    bpt::optimal_weights weights;
    bpt::film film;
    int threads;

    optimal_image(const options& o, const mis::technique_counts<double>& counts, double merge_radius)
        : weights(counts, merge_radius, o.size, o.optimal), film(o.size), threads(o.threads) {}
    template <class Real> void add(const bpt::pass_result<Real>& result) {
        for (const auto& row : result.rows)
            for (const auto& sample : row.samples)
                film.sum.pixels[static_cast<std::size_t>(sample.pixel)] += weights.add(sample);
        weights.end_pass();
        film.passes = result.pass + 1;
        const bool is_power_of_2 = (film.passes & (film.passes - 1)) == 0;
        if (film.passes >= 4 && is_power_of_2)
            weights.solve(threads);
    }
};

struct rendered {
    bpt::weight_checks checks; // what the comparison of its weights has found
    bpt::labelled_image image;
};

// Renders one scene and writes its files.
template <class Real>
rendered render_scene(const std::string& name, const options& o, bool write_images, std::ofstream& dump) {
    bpt::scene<Real> scene = bpt::scaled(bpt::make_scene<Real>(name), static_cast<Real>(o.scale));
    if (o.no_roulette)
        for (auto& m : scene.materials)
            m.survival = 1;
    bpt::settings<Real> settings;
    settings.width = o.size;
    settings.passes = o.samples;
    settings.threads = o.threads;
    settings.longest = o.longest;
    settings.seed = o.seed;
    settings.heuristic = heuristic_of(o);
    settings.merge_radius = static_cast<Real>(o.radius) * scene.radius;
    const auto algorithm = algorithm_of<Real>(o, settings.merge_radius);
    settings.counts = algorithm.counts;
    settings.merges_once = algorithm.merges_once;
    settings.radius_alpha = algorithm.is_progressive ? static_cast<Real>(o.radius_alpha) : Real(1);
    settings.mistakes = mistakes_of(o);
    settings.random_connection = o.random_connection;
    settings.check_weights = !o.no_checks;
    settings.balance_all = o.optimal > 0;
    settings.dump_paths = dump.is_open() ? (o.dump_limit - 1) / (o.size * o.samples) + 1 : 0;

    const double exposure = static_cast<double>(scene.exposure);
    std::optional<snapshots> snapshots;
    if (write_images && o.snapshots)
        snapshots.emplace(o, name, exposure);
    std::optional<optimal_image> optimal;
    if (o.optimal > 0)
        optimal.emplace(o, bpt::in_double(settings.counts), static_cast<double>(settings.merge_radius));
    bpt::film film(o.size);
    bpt::comparison comparison(o.size);
    bpt::weight_checks checks;
    int dumped = 0;
    bpt::render(scene, settings, [&](const bpt::pass_result<Real>& result) {
        for (const auto& row : result.rows) {
            for (const auto& c : row.contributions)
                comparison.add(film, c);
            checks.add(row.checks);
            for (const auto& line : row.dump)
                if (dumped < o.dump_limit)
                    dump << line << '\n', ++dumped;
        }
        comparison.end_pass();
        if (optimal)
            optimal->add(result);
        film.passes = result.pass + 1;
        if (snapshots)
            snapshots->end_pass(film, film.passes == o.samples);
        show_progress(name, film.passes, o.samples);
    });
    if (write_images) {
        const std::string base = o.output + "/" + name;
        write_image(base, film, exposure);
        bpt::write_pyramid(base + "-pyramid.png", film, exposure);
        if (optimal)
            write_image(base + "-optimal", optimal->film, exposure);
    }
    if (write_images && settings.mistakes.any()) {
        bpt::write_comparison(o.output + "/" + name + "-mistake.png", film, comparison.right, exposure);
        std::printf("%s: %s\n", name.c_str(), bpt::change_of(comparison, film.passes).c_str());
    }
    return {checks, {name, film.sum, exposure / film.passes}};
}

std::ofstream open_outputs(const options& o) {
    std::error_code error;
    std::filesystem::create_directories(o.output, error);
    if (error || access(o.output.c_str(), W_OK) != 0)
        fail("--output '" + o.output + "' is no folder that can be written to");
    std::ofstream dump;
    if (!o.dump.empty()) {
        dump.open(o.dump);
        if (!dump)
            fail("--dump '" + o.dump + "' cannot be written");
    }
    return dump;
}

struct outcome {
    bool good = true; // all bars are met
    std::int64_t paths = 0;
};

// Renders all scenes asked for; several go on one sheet as well.
outcome run(const options& o, bool write_images, std::ofstream& dump) {
    outcome all;
    std::vector<bpt::labelled_image> images;
    for (const auto& name : o.scenes) {
        const bool in_float = o.scalar == "float";
        const rendered r = in_float ? render_scene<float>(name, o, write_images, dump)
                                    : render_scene<double>(name, o, write_images, dump);
        if (!o.no_checks)
            all.good &=
                in_float ? print_checks<float>(name, o, r.checks) : print_checks<double>(name, o, r.checks);
        all.paths += r.checks.paths;
        images.push_back(r.image);
        std::fflush(stdout);
    }
    if (write_images && images.size() > 1)
        bpt::write_sheet(o.output + "/scenes.png", images, 4);
    return all;
}

// Every scene in double, with images, and in float.
outcome run_demo(options o, std::ofstream& dump) {
    const auto start = std::chrono::steady_clock::now();
    o.scenes = bpt::scene_names();
    o.scalar = "double";
    const outcome in_double = run(o, true, dump);
    o.scalar = "float";
    const outcome in_float = run(o, false, dump);
    const seconds taken = std::chrono::steady_clock::now() - start;
    std::printf(
        "%lld paths in double and %lld in float, each weighted three ways, in %.0f s; images are in %s\n",
        static_cast<long long>(in_double.paths), static_cast<long long>(in_float.paths), taken.count(),
        o.output.c_str());
    return {in_double.good && in_float.good, in_double.paths};
}

void add_options(CLI::App& app, options& o) {
    app.add_option(
        "--scene", o.scenes,
        "cornell, spheres, glossy, smooth, environment, point, lens, mixed, or all of these; caustic, "
        "diffuse, pool, rooms");
    app.add_option("--samples", o.samples, "passes: camera walks per pixel");
    app.add_option("--size", o.size, "width and height in pixels");
    app.add_option("--output", o.output, "folder of the images");
    app.add_option("--heuristic", o.heuristic, "balance, power, maximum, average, cutoff");
    app.add_option("--beta", o.beta, "exponent of the power heuristic");
    app.add_option("--alpha", o.alpha, "threshold of the cutoff heuristic");
    app.add_option("--algorithm", o.algorithm, "pt, pt-nee, lt, bpt, ppm, sppm, bpm, ups, vcm");
    app.add_flag("--one-light-vertex", o.one_light_vertex, "no connections to longer light walks");
    app.add_option("--radius", o.radius, "within which walks merge in pass 1; 1 is the scene's radius");
    app.add_option("--radius-alpha", o.radius_alpha,
                   "ppm, sppm, ups, vcm: the radius of pass i is that of pass 1 times i^((alpha - 1) / 2)");
    app.add_option("--scale", o.scale, "of all lengths in the scene; the image is the same for any");
    app.add_option("--scalar", o.scalar, "float or double");
    app.add_option("--threads", o.threads, "the image is the same for any number");
    app.add_option("--max-vertices", o.longest, "of a path in all, 2 to 10");
    app.add_option("--max-camera-vertices", o.max_camera_vertices,
                   "of a camera walk, its lens point included");
    app.add_option("--max-light-vertices", o.max_light_vertices, "of a light walk, its light point included");
    app.add_option("--light-samples", o.light_samples, "next events at each camera vertex");
    app.add_option("--optimal", o.optimal,
                   "also an image by optimal weights: width of the tiles of pixels that share them");
    app.add_option("--mistake", o.mistakes, "plant a mistake in the weights, or several");
    app.add_option("--seed", o.seed);
    auto* const snapshots =
        app.add_flag("--snapshots", o.snapshots, "images after 1, 4, 16, ... passes, and a table of times");
    app.add_option("--reference", o.reference, "OpenEXR image: the table has the RMS error from it too")
        ->needs(snapshots);
    app.add_option("--dump", o.dump, "file for weighted paths, JSON Lines");
    app.add_option("--dump-limit", o.dump_limit, "paths dumped per scene");
    app.add_flag("--random-connection", o.random_connection,
                 "join each camera vertex to one light vertex only");
    app.add_flag("--no-roulette", o.no_roulette, "walks end only by leaving the scene");
    app.add_flag("--no-checks", o.no_checks, "weigh each path once only");
    app.add_flag("--demo", o.demo, "all scenes, in double and in float");
}

void check_options(options& o) {
    if (o.scenes == std::vector<std::string>{"all"})
        o.scenes = bpt::scene_names();
    std::map<std::string, int> scenes;
    for (const auto* const names : {&bpt::scene_names(), &bpt::study_scene_names()})
        for (const auto& name : *names)
            scenes[name] = 0;
    for (const auto& name : o.scenes)
        choose(scenes, name, "--scene");
    choose(std::map<std::string, int>{{"float", 0}, {"double", 0}}, o.scalar, "--scalar");
    heuristic_of(o);
    if (!bpt::has_technique(algorithm_of<double>(o, 1).counts))
        fail("--one-light-vertex leaves no technique of --algorithm '" + o.algorithm + "'");
    if (mistakes_of(o).has(bpt::mistake::subpath_caps) && o.max_camera_vertices == INT_MAX &&
        o.max_light_vertices == INT_MAX)
        fail("--mistake subpath_caps needs --max-camera-vertices or --max-light-vertices");
    const auto in_range = [](int value, int least, int most, const char* option) {
        if (value < least || value > most)
            fail(std::string(option) + " must be from " + std::to_string(least) + " to " +
                 std::to_string(most));
    };
    in_range(o.samples, 1, 1000000, "--samples");
    in_range(o.size, 1, 4096, "--size");
    in_range(o.threads, 1, 1024, "--threads");
    in_range(o.longest, 2, bpt::longest_path, "--max-vertices");
    in_range(o.max_camera_vertices, 1, INT_MAX, "--max-camera-vertices");
    in_range(o.max_light_vertices, 1, INT_MAX, "--max-light-vertices");
    in_range(o.light_samples, 1, 1024, "--light-samples");
    in_range(o.optimal, 0, 4096, "--optimal");
    if (o.optimal > 0 && o.random_connection)
        fail("--optimal wants all connections, not --random-connection");
    if (o.optimal > 0 && algorithm_of<double>(o, 1).is_progressive && o.radius_alpha < 1)
        fail("--optimal wants a radius that stays: --radius-alpha 1");
    in_range(o.dump_limit, 1, 1000000000, "--dump-limit");
    if (!(o.radius > 0 && o.radius <= 1))
        fail("--radius must be above 0, up to 1");
    if (!(o.radius_alpha > 0 && o.radius_alpha <= 1))
        fail("--radius-alpha must be above 0, up to 1");
    if (!o.reference.empty() && (o.demo || o.scenes.size() > 1))
        fail("--reference is the image of one scene");
    if (!(o.scale >= 1e-6 && o.scale <= 1e6))
        fail("--scale must be from 1e-6 to 1e6");
    if (!(o.beta > 0 && o.beta <= 64))
        fail("--beta must be above 0, up to 64");
    if (!(o.alpha >= 0 && o.alpha <= 1))
        fail("--alpha must be from 0 to 1");
}

} // namespace

int main(int count, char** arguments) {
    CLI::App app{
        "Reference bidirectional path tracer: renders small scenes and weighs every path three ways."};
    options o;
    add_options(app, o);
    try {
        app.parse(count, arguments);
    } catch (const CLI::CallForHelp& help) {
        return app.exit(help);
    } catch (const CLI::ParseError& error) {
        fail(error.what());
    }
    check_options(o);
    try {
        std::ofstream dump = open_outputs(o);
        if (!o.no_checks)
            print_heading();
        const outcome result = o.demo ? run_demo(o, dump) : run(o, true, dump);
        return result.good ? 0 : 1;
    } catch (const std::exception& error) {
        fail(error.what());
    }
}
