// The laboratory's command line: renders scenes and looks at every path. Prints how far the three ways of
// computing weights are apart; plants mistakes, dumps paths, draws pyramids, weighs optimally.
#include "compare.hpp"
#include "optimal.hpp"
#include <bpt/command_line.hpp>
#include <chrono>
#include <cstdio>
#include <sstream>

namespace {

struct options : bpt::options {
    std::vector<std::string> mistakes;
    std::string scalar = "double", heuristic = "power", dump, reference;
    int dump_limit = 2000, optimal = 0;
    int max_camera_vertices = INT_MAX, max_light_vertices = INT_MAX;
    double alpha = 0.1, scale = 1;
    bool demo = false, no_roulette = false, no_checks = false, snapshots = false;
};

using kind = mis::heuristic_kind;
const std::map<std::string, kind> heuristics{{"average", kind::average},
                                             {"balance", kind::balance},
                                             {"power", kind::power},
                                             {"cutoff", kind::cutoff},
                                             {"maximum", kind::maximum}};

void add_options(CLI::App& app, options& o) {
    using CLI::Range;
    bpt::add_options(app, o);
    app.add_option("--heuristic", o.heuristic, "that weighs the techniques")
        ->check(CLI::IsMember(heuristics));
    app.add_option("--alpha", o.alpha, "threshold of the cutoff heuristic")
        ->check(Range(0.0, 1.0) & tools::is_number);
    app.add_option("--scale", o.scale, "of all lengths in the scene; the image is the same for any")
        ->check(Range(1e-6, 1e6) & tools::is_number);
    app.add_option("--scalar", o.scalar, "of the renderer")->check(CLI::IsMember({"float", "double"}));
    app.add_option("--max-camera-vertices", o.max_camera_vertices,
                   "of a camera walk, its lens point included")
        ->check(CLI::PositiveNumber);
    app.add_option("--max-light-vertices", o.max_light_vertices, "of a light walk, its light point included")
        ->check(CLI::PositiveNumber);
    app.add_option("--optimal", o.optimal,
                   "also an image by optimal weights: width of the tiles of pixels that share them")
        ->check(Range(0, 4096));
    app.add_option("--mistake", o.mistakes, "plant a mistake in the weights, or several")
        ->check(CLI::IsMember(
            std::vector<std::string>(std::begin(lab::mistake_names), std::end(lab::mistake_names))));
    auto* const snapshots =
        app.add_flag("--snapshots", o.snapshots, "images after 1, 4, 16, ... passes, and a table of times");
    app.add_option("--reference", o.reference, "OpenEXR image: the table has the RMS error from it too")
        ->needs(snapshots);
    app.add_option("--dump", o.dump, "file for weighted paths, JSON Lines");
    app.add_option("--dump-limit", o.dump_limit, "paths dumped per scene")->check(Range(1, 1000000000));
    app.add_flag("--no-roulette", o.no_roulette, "walks end only by leaving the scene");
    app.add_flag("--no-checks", o.no_checks, "weigh each path once only");
    app.add_flag("--demo", o.demo, "all scenes, in double and in float");
}

mis::heuristic_kind kind_of(const options& o) { return heuristics.at(o.heuristic); }

lab::mistake_set mistakes_of(const options& o) {
    lab::mistake_set set;
    for (const auto& name : o.mistakes)
        set.planted.set(static_cast<std::size_t>(
            std::find(std::begin(lab::mistake_names), std::end(lab::mistake_names), name) -
            std::begin(lab::mistake_names)));
    return set;
}

// What no single option tells.
void check_options(const options& o) {
    const auto refuse = [](bool is_bad, const char* why) {
        if (is_bad)
            throw std::runtime_error(why);
    };
    refuse(mistakes_of(o).has(lab::mistake::subpath_caps) && o.max_camera_vertices == INT_MAX &&
               o.max_light_vertices == INT_MAX,
           "--mistake subpath_caps needs --max-camera-vertices or --max-light-vertices");
    refuse(o.optimal > 0 && o.random_connection, "--optimal wants all connections, not --random-connection");
    refuse(o.optimal > 0 && bpt::algorithms(1.0, 1.0).at(o.algorithm).is_progressive && o.radius_alpha < 1,
           "--optimal wants a radius that stays: --radius-alpha 1");
    // lab::technique_film
    const double pixels = double(o.size) * o.size,
                 images = 2.0 * (bpt::longest_path + 1) * (bpt::longest_path + 1);
    const double memory = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGESIZE));
    refuse(pixels * images * sizeof(glm::dvec3) > memory,
           "--size needs more memory than this machine has: the images of all techniques");
    refuse(!o.reference.empty() && (o.demo || bpt::scenes_of(o).size() > 1),
           "--reference is the image of one scene");
}

template <class Real> lab::settings<Real> settings_of(const options& o, const bpt::scene<Real>& scene) {
    lab::settings<Real> set;
    static_cast<bpt::settings<Real>&>(set) = bpt::settings_of(o, scene);
    set.heuristic = {kind_of(o), kind_of(o) == mis::heuristic_kind::cutoff ? o.alpha : o.beta};
    set.counts.max_camera_vertices = o.max_camera_vertices;
    set.counts.max_light_vertices = o.max_light_vertices;
    set.mistakes = mistakes_of(o);
    set.check_weights = !o.no_checks;
    set.balance_all = o.optimal > 0;
    // At least one of each row; what is above the limit is left out afterwards.
    const std::int64_t rows = std::int64_t(o.size) * o.samples;
    set.dump_paths = o.dump.empty() ? 0 : static_cast<int>((o.dump_limit - 1) / rows + 1);
    return set;
}

// The bars that the weights must meet, and whether they do.
template <class Real> bool is_good(const lab::weight_checks& c) {
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
bool print_checks(const std::string& scene, const options& o, const lab::weight_checks& c) {
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
    std::optional<lab::image> reference;
    tools::line_file table;
    seconds rendered{0}; // time, without that spent here
    std::chrono::steady_clock::time_point since;

    snapshots(const options& o, const std::string& name, double exposure_of_scene)
        : base(o.output + "/" + name), exposure(exposure_of_scene), reference(reference_of(o)),
          table(base + "-convergence.csv") {
        table.add(std::string("passes,seconds") + (reference ? ",rms_error" : ""));
        table.finish();
        since = std::chrono::steady_clock::now();
    }
    // Before the table, which stays as it is where the reference cannot be read.
    static std::optional<lab::image> reference_of(const options& o) {
        return o.reference.empty() ? std::nullopt : std::optional(lab::read_exr(o.reference, o.size));
    }
    void end_pass(const bpt::film& film, bool is_last) {
        rendered += std::chrono::steady_clock::now() - since;
        tools::attempts both;
        const bool is_due = is_power_of_4(film.passes);
        if (is_due)
            both.run(
                [&] { bpt::write_image(base + "-passes-" + std::to_string(film.passes), film, exposure); });
        if (is_due || is_last) {
            std::ostringstream line;
            line << film.passes << ',' << rendered.count();
            if (reference)
                line << ',' << lab::rms_error(film, *reference);
            table.add(line.str());
            both.run([&] { table.finish(); });
        }
        both.finish();
        since = std::chrono::steady_clock::now();
    }
};

// What --optimal writes: an image by optimal weights, from the paths of the other one.
struct optimal_image {
    lab::optimal_weights weights;
    bpt::film film;
    int threads;

    optimal_image(const options& o, const mis::technique_counts<double>& counts, double merge_radius)
        : weights(counts, merge_radius, o.size, o.optimal), film(o.size), threads(o.threads) {}
    template <class Real> void add(const lab::pass_result<Real>& result) {
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

// What --dump writes: whole lines, at most a number of each scene.
struct dump_file {
    std::optional<tools::line_file> out;
    int most, written = 0; // of a scene

    explicit dump_file(const options& o) : most(o.dump_limit) {
        if (!o.dump.empty())
            out.emplace(o.dump);
    }
    void add(const std::vector<std::string>& lines) {
        for (const auto& line : lines)
            if (written < most)
                out->add(line), ++written;
    }
    void finish() {
        if (out)
            out->finish();
    }
};

struct rendered {
    lab::weight_checks checks; // what the comparison of its weights has found
    lab::labelled_image image;
};

// Renders one scene and writes its files.
template <class Real>
rendered render_scene(const std::string& name, const options& o, bool write_images, dump_file& dump) {
    bpt::scene<Real> scene = bpt::scaled(bpt::make_scene<Real>(name), static_cast<Real>(o.scale));
    if (o.no_roulette)
        for (auto& m : scene.materials)
            m.survival = 1;
    const auto settings = settings_of(o, scene);
    const double exposure = static_cast<double>(scene.exposure);
    std::optional<snapshots> snapshots;
    if (write_images && o.snapshots)
        snapshots.emplace(o, name, exposure);
    std::optional<optimal_image> optimal;
    if (o.optimal > 0)
        optimal.emplace(o, lab::in_double(settings.counts), static_cast<double>(settings.merge_radius));
    lab::technique_film film(o.size);
    lab::comparison comparison(o.size);
    lab::weight_checks checks;
    dump.written = 0;
    tools::attempts files;
    lab::render(scene, settings, [&](const lab::pass_result<Real>& result) {
        for (const auto& row : result.rows) {
            for (const auto& c : row.contributions)
                comparison.add(film, c);
            checks.add(row.checks);
            dump.add(row.dump);
        }
        comparison.end_pass();
        if (optimal)
            optimal->add(result);
        film.passes = result.pass + 1;
        const bool goes_on = tools::interrupted == 0;
        if (snapshots)
            files.run([&] { snapshots->end_pass(film, film.passes == o.samples || !goes_on); });
        bpt::show_progress(name, film.passes, o.samples);
        return goes_on;
    });
    files.run([&] { dump.finish(); });
    const std::string base = o.output + "/" + name;
    if (write_images && film.passes > 0) {
        files.run([&] { bpt::write_image(base, film, exposure); });
        files.run([&] { lab::write_pyramid(base + "-pyramid.png", film, exposure, o.longest); });
        if (optimal)
            files.run([&] { bpt::write_image(base + "-optimal", optimal->film, exposure); });
    }
    if (write_images && settings.mistakes.any() && film.passes > 0) {
        files.run([&] { lab::write_comparison(base + "-mistake.png", film, comparison.right, exposure); });
        std::printf("%s: %s\n", name.c_str(), lab::change_of(comparison, film.passes).c_str());
    }
    if (tools::interrupted)
        tools::report_interruption(name, film.passes, o.samples);
    files.finish();
    return {checks, {name, film.sum, exposure / film.passes}};
}

struct outcome {
    bool good = true; // all bars are met
    std::int64_t paths = 0;
};

// Renders all scenes asked for; several go on one sheet as well.
outcome run(const options& o, bool write_images, dump_file& dump) {
    outcome all;
    std::vector<lab::labelled_image> images;
    for (const auto& name : bpt::scenes_of(o)) {
        const bool in_float = o.scalar == "float";
        const rendered r = in_float ? render_scene<float>(name, o, write_images, dump)
                                    : render_scene<double>(name, o, write_images, dump);
        if (!o.no_checks)
            all.good &=
                in_float ? print_checks<float>(name, o, r.checks) : print_checks<double>(name, o, r.checks);
        all.paths += r.checks.paths;
        images.push_back(r.image);
        std::fflush(stdout);
        if (tools::interrupted)
            return all;
    }
    if (write_images && images.size() > 1)
        lab::write_sheet(o.output + "/scenes.png", images, 4);
    return all;
}

// Every scene in double, with images, and in float.
outcome run_demo(options o, dump_file& dump) {
    const auto start = std::chrono::steady_clock::now();
    o.scenes = {"all"};
    o.scalar = "double";
    const outcome in_double = run(o, true, dump);
    if (tools::interrupted)
        return in_double;
    o.scalar = "float";
    const outcome in_float = run(o, false, dump);
    const seconds taken = std::chrono::steady_clock::now() - start;
    std::printf(
        "%lld paths in double and %lld in float, each weighted three ways, in %.0f s; images are in %s\n",
        static_cast<long long>(in_double.paths), static_cast<long long>(in_float.paths), taken.count(),
        o.output.c_str());
    return {in_double.good && in_float.good, in_double.paths};
}

} // namespace

int main(int count, char** arguments) {
    CLI::App app{"Renders small scenes with the reference bidirectional path tracer and weighs every path "
                 "three ways.\nExit status: 0 all weights agree, 1 some do not, 2 bad input or output,\n130 "
                 "interrupted: the image is of the "
                 "passes that were done."};
    options o;
    add_options(app, o);
    return bpt::run_program(app, o, count, arguments, [&] {
        check_options(o);
        dump_file dump(o);
        if (!o.no_checks)
            print_heading();
        const outcome result = o.demo ? run_demo(o, dump) : run(o, true, dump);
        return result.good ? 0 : 1;
    });
}
