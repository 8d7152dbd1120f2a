// The laboratory's command line: renders scenes and looks at every path. Prints how far the three ways of
// computing weights are apart; plants mistakes, dumps paths, draws pyramids, weighs optimally.
#include "checkpoint.hpp"
#include "compare.hpp"
#include "optimal.hpp"
#include "share.hpp"
#include <bpt/command_line.hpp>
#include <chrono>
#include <cstdio>
#include <mis/version.hpp>
#include <sstream>

namespace {

struct options : bpt::options {
    std::vector<std::string> mistakes;
    std::string scalar = "double", heuristic = "power", dump, reference;
    int dump_limit = 2000, optimal = 0;
    int max_camera_vertices = INT_MAX, max_light_vertices = INT_MAX;
    double alpha = 0.1, scale = 1, checkpoint = -1;
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
        ->check(Range(0.0, 1.0) & tools::is_number());
    app.add_option("--scale", o.scale, "of all lengths in the scene; the image is the same for any")
        ->check(Range(1e-6, 1e6) & tools::is_number());
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
    app.add_option("--checkpoint", o.checkpoint,
                   "seconds between checkpoints, NAME.checkpoint, from which the same command goes on")
        ->check(Range(0.0, 1e9) & tools::is_number());
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
void check_options(const options& o, const lab::ranks& all) {
    const auto refuse = [](bool is_bad, const char* why) {
        if (is_bad)
            throw std::runtime_error(why);
    };
    refuse(mistakes_of(o).has(lab::mistake::subpath_caps) && o.max_camera_vertices == INT_MAX &&
               o.max_light_vertices == INT_MAX,
           "--mistake subpath_caps needs --max-camera-vertices or --max-light-vertices");
    const bool splits = is_learned(bpt::roulette_modes().at(o.roulette)),
               omits_splits = mistakes_of(o).has(lab::mistake::splitting_omitted);
    refuse(omits_splits && !splits, "--mistake splitting_omitted is planted where walks split: --roulette "
                                    "adjoint, efficiency or per-technique");
    refuse(mistakes_of(o).any() && o.roulette != "albedo" && (!omits_splits || o.mistakes.size() > 1),
           "--mistake is planted where walks end by --roulette albedo");
    refuse(o.optimal > 0 && o.random_connection, "--optimal wants all connections, not --random-connection");
    refuse(o.optimal > 0 && bpt::algorithms(1.0, 1.0).at(o.algorithm).is_progressive && o.radius_alpha < 1,
           "--optimal wants a radius that stays: --radius-alpha 1");
    refuse(o.checkpoint >= 0 && (o.demo || o.snapshots || !o.dump.empty()),
           "--checkpoint keeps images alone: it goes without --demo, --snapshots and --dump");
    refuse(!all.can_exchange(), "built without MPI, this program cannot share its work with others");
    // lab::technique_film
    const double pixels = double(o.size) * o.size,
                 images = 2.0 * (bpt::longest_path + 1) * (bpt::longest_path + 1);
    const double memory = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGESIZE));
    refuse(pixels * images * sizeof(glm::dvec3) * all.on_this_machine > memory,
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

// What an image depends on, and the sums that are kept beside it: one option a line.
std::string settings_text(const options& o, const std::string& scene) {
    std::ostringstream text;
    text << "mis " << MIS_VERSION_MAJOR << '.' << MIS_VERSION_MINOR << '.' << MIS_VERSION_PATCH << '\n';
    const auto add = [&](const char* option, const auto& value) {
        text << option << ' ' << nlohmann::json(value) << '\n';
    };
    add("--scene", scene);
    add("--scalar", o.scalar);
    add("--size", o.size);
    add("--seed", o.seed);
    add("--heuristic", o.heuristic);
    add("--beta", o.beta);
    add("--alpha", o.alpha);
    add("--algorithm", o.algorithm);
    add("--one-light-vertex", o.one_light_vertex);
    add("--random-connection", o.random_connection);
    add("--light-samples", o.light_samples);
    add("--radius", o.radius);
    add("--radius-alpha", o.radius_alpha);
    add("--max-vertices", o.longest);
    add("--max-camera-vertices", o.max_camera_vertices);
    add("--max-light-vertices", o.max_light_vertices);
    add("--radius-3d", o.media.radius_3d);
    add("--radius-2d", o.media.radius_2d);
    add("--radius-1d", o.media.radius_1d);
    add("--beam-walks", o.media.beam_walks);
    add("--long-beams", o.media.long_beams);
    add("--scale", o.scale);
    add("--roulette", o.roulette);
    add("--learning-passes", o.learning_passes);
    add("--no-roulette", o.no_roulette);
    add("--no-checks", o.no_checks);
    add("--optimal", o.optimal);
    add("--mistake", o.mistakes);
    return text.str();
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

    // What has an image; the table has the last pass, too.
    static bool is_due(int passes) { return is_power_of_4(passes); }

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
    // After a pass that is due, or the last one.
    void write(const bpt::film& film) {
        rendered += std::chrono::steady_clock::now() - since;
        tools::attempts both;
        if (is_due(film.passes))
            both.run(
                [&] { bpt::write_image(base + "-passes-" + std::to_string(film.passes), film, exposure); });
        std::ostringstream line;
        line << film.passes << ',' << rendered.count();
        if (reference)
            line << ',' << lab::rms_error(film, *reference);
        table.add(line.str());
        both.run([&] { table.finish(); });
        both.finish();
        since = std::chrono::steady_clock::now();
    }
};

// What --optimal writes: an image by optimal weights, from the paths of the other one.
struct optimal_image {
    lab::optimal_weights weights;
    bpt::film film;
    int threads;

    optimal_image(const options& o, const mis::technique_counts<double>& counts, double merge_radius,
                  const lab::ranks& all)
        : weights(counts, merge_radius, o.size, o.optimal), film(o.size), threads(o.threads) {
        weights.sum_rows(all.rank, all.count);
    }
    void add_arrays(std::vector<lab::row_array>& arrays) {
        arrays.push_back(lab::rows_of("the optimal image", film.sum, weights.tile_width()));
        weights.add_arrays(arrays);
    }
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

    explicit dump_file(const options& o) : most(o.dump_limit) {}
    void open(const std::string& file) {
        if (!file.empty())
            out.emplace(file);
    }
    void add(const std::vector<std::string>& lines) {
        for (const auto& line : lines)
            if (out && written < most)
                out->add(line), ++written;
    }
    void finish() {
        if (out)
            out->finish();
    }
};

struct rendered {
    lab::weight_checks checks; // what the comparison of its weights has found
    bool has_checkpoint;       // or none was wanted
    lab::labelled_image image;
};

// What --checkpoint writes and goes on from: all sums of a scene.
struct checkpoints {
    std::string file, settings;
    double interval; // seconds; below 0: none are wanted
    std::chrono::steady_clock::time_point since = std::chrono::steady_clock::now();
    bool is_due = false, has_failed = false;

    checkpoints(const options& o, const std::string& scene)
        : file(o.output + "/" + scene + ".checkpoint"), settings(settings_text(o, scene)),
          interval(o.checkpoint) {}

    // The passes that are done: their sums are then on the ranks that go on with them.
    int resume(const lab::ranks& all, int most_passes, const std::vector<lab::row_array>& sums) const {
        if (interval < 0)
            return 0;
        int passes = 0;
        lab::on_first(all, [&] { passes = lab::read_checkpoint(file, settings, most_passes, sums); });
        lab::exchange_rows(all, sums, lab::rows_go::to_owners);
        return std::stoi(lab::from_first(all, std::to_string(passes)));
    }
    // By rank 0's clock. All ranks must ask.
    void look_at_clock(const lab::ranks& all) {
        const seconds passed = std::chrono::steady_clock::now() - since;
        is_due = interval >= 0 && !lab::from_first(all, passed.count() >= interval ? "due" : "").empty();
    }
    // A failure is said at once, because a kill may follow, and once; rendering goes on.
    void write(const lab::ranks& all, int passes, const std::vector<lab::row_array>& sums) {
        lab::exchange_rows(all, sums, lab::rows_go::to_first);
        if (all.rank == 0)
            try {
                lab::write_checkpoint(file, settings, passes, sums);
                has_failed = false;
            } catch (const std::exception& error) {
                if (!has_failed)
                    std::fprintf(stderr, "lab: %s\n", error.what());
                has_failed = true;
            }
        since = std::chrono::steady_clock::now();
    }
};

// Whether one of the ranks has been interrupted: then all are.
bool are_interrupted(const lab::ranks& all) {
    if (lab::is_any(all, tools::interrupted != 0))
        tools::interrupted = 1;
    return tools::interrupted != 0;
}

// On a terminal, or, as there is none under mpirun, a line now and then.
void show_progress(const lab::ranks& all, const std::string& name, int done, int of) {
    if (all.rank != 0)
        return;
    bpt::show_progress(name, done, of);
    constexpr seconds between{10};
    static auto since = std::chrono::steady_clock::now();
    if (all.count == 1 || isatty(STDERR_FILENO) || std::chrono::steady_clock::now() - since < between)
        return;
    std::fprintf(stderr, "%s: %d of %d passes\n", name.c_str(), done, of);
    since = std::chrono::steady_clock::now();
}

// Renders one scene, together with the other ranks, and writes its files.
template <class Real>
rendered render_scene(const std::string& name, const options& o, bool write_images, const lab::ranks& all,
                      dump_file& dump) {
    bpt::scene<Real> scene = bpt::scaled(bpt::make_scene<Real>(name), static_cast<Real>(o.scale));
    if (o.no_roulette)
        scene = lab::without_roulette(std::move(scene));
    lab::settings<Real> settings;
    lab::on_all_alike(all, [&] {
        settings = settings_of(o, scene);
        lab::check_heuristic(scene, settings);
    });
    const double exposure = static_cast<double>(scene.exposure);
    const bool takes_snapshots = write_images && o.snapshots;
    std::optional<snapshots> snapshots; // rank 0's
    lab::on_first(all, [&] {
        if (takes_snapshots)
            snapshots.emplace(o, name, exposure);
    });
    std::optional<optimal_image> optimal;
    if (o.optimal > 0)
        optimal.emplace(o, mis::in_double(settings.counts), static_cast<double>(settings.merge_radius), all);
    lab::technique_film film(o.size);
    lab::comparison comparison(o.size);
    std::vector<lab::weight_checks> checks(1); // rank 0's
    const int rows_of_tile = optimal ? optimal->weights.tile_width() : 1;
    std::vector<lab::row_array> sums{lab::rows_of("the checks of weights", checks, 1, 1)};
    film.add_arrays(sums, rows_of_tile);
    comparison.add_arrays(sums, rows_of_tile);
    if (optimal)
        optimal->add_arrays(sums);
    checkpoints checkpoints(o, name);
    film.passes = checkpoints.resume(all, o.samples, sums);
    if (optimal)
        optimal->film.passes = film.passes;
    dump.written = 0;
    tools::attempts files;
    const auto stops = [&] {
        checkpoints.look_at_clock(all);
        return are_interrupted(all);
    };
    const auto add = [&](const lab::pass_result<Real>& result, lab::pass_place place) {
        for (const auto& row : result.rows) {
            for (const auto& c : row.contributions)
                comparison.add(film, c);
            checks[0].add(row.checks);
            dump.add(row.dump);
        }
        comparison.end_pass();
        if (optimal)
            optimal->add(result);
        film.passes = result.pass + 1;
        if (takes_snapshots && (snapshots::is_due(film.passes) || place.is_last)) {
            lab::exchange_rows(all, {lab::rows_of("the image", film.sum, rows_of_tile)},
                               lab::rows_go::to_first);
            if (snapshots)
                files.run([&] { snapshots->write(film); });
        }
        if (place.ends_round && o.checkpoint >= 0 && (checkpoints.is_due || place.is_last))
            checkpoints.write(all, film.passes, sums);
        show_progress(all, name, film.passes, o.samples);
    };
    lab::render(all, rows_of_tile, scene, settings, film.passes, stops, add);
    lab::exchange_rows(all, sums, lab::rows_go::to_first);
    const std::string base = o.output + "/" + name;
    lab::on_first(all, [&] {
        files.run([&] { dump.finish(); });
        if (write_images && film.passes > 0) {
            files.run([&] { bpt::write_image(base, film, exposure); });
            files.run([&] { lab::write_pyramid(base + "-pyramid.png", film, exposure, o.longest); });
            if (optimal)
                files.run([&] { bpt::write_image(base + "-optimal", optimal->film, exposure); });
        }
        if (write_images && settings.mistakes.any() && film.passes > 0) {
            files.run(
                [&] { lab::write_comparison(base + "-mistake.png", film, comparison.right, exposure); });
            std::printf("%s: %s\n", name.c_str(), lab::change_of(comparison, film.passes).c_str());
        }
        if (tools::interrupted)
            tools::report_interruption(name, film.passes, o.samples);
        files.finish();
    });
    return {checks[0], !checkpoints.has_failed, {name, film.sum, exposure / film.passes}};
}

struct outcome {
    bool good = true, complete = true; // all bars are met; all checkpoints are written
    std::int64_t paths = 0;
};

// Renders all scenes asked for; several go on one sheet as well.
outcome run(const options& o, bool write_images, const lab::ranks& all, dump_file& dump) {
    outcome result;
    std::vector<lab::labelled_image> images;
    for (const auto& name : bpt::scenes_of(o)) {
        const bool in_float = o.scalar == "float";
        const rendered r = in_float ? render_scene<float>(name, o, write_images, all, dump)
                                    : render_scene<double>(name, o, write_images, all, dump);
        if (!o.no_checks && all.rank == 0)
            result.good &=
                in_float ? print_checks<float>(name, o, r.checks) : print_checks<double>(name, o, r.checks);
        result.complete &= r.has_checkpoint;
        result.paths += r.checks.paths;
        images.push_back(r.image);
        std::fflush(stdout);
        if (are_interrupted(all))
            return result;
    }
    lab::on_first(all, [&] {
        if (write_images && images.size() > 1)
            lab::write_sheet(o.output + "/scenes.png", images, 4);
    });
    return result;
}

// Every scene in double, with images, and in float.
outcome run_demo(options o, const lab::ranks& all, dump_file& dump) {
    const auto start = std::chrono::steady_clock::now();
    o.scenes = {"all"};
    o.scalar = "double";
    const outcome in_double = run(o, true, all, dump);
    if (are_interrupted(all))
        return in_double;
    o.scalar = "float";
    const outcome in_float = run(o, false, all, dump);
    const seconds taken = std::chrono::steady_clock::now() - start;
    if (all.rank == 0)
        std::printf(
            "%lld paths in double and %lld in float, each weighted three ways, in %.0f s; images are in %s\n",
            static_cast<long long>(in_double.paths), static_cast<long long>(in_float.paths), taken.count(),
            o.output.c_str());
    return {in_double.good && in_float.good, true, in_double.paths};
}

// Ranks of other options would make an image of neither.
void compare_options(const options& o, const lab::ranks& all) {
    std::ostringstream own;
    for (const auto& scene : o.demo ? std::vector<std::string>{"all"} : bpt::scenes_of(o))
        own << settings_text(o, scene);
    own << o.samples << o.demo << o.snapshots << (o.checkpoint < 0) << o.dump.empty() << o.dump_limit;
    if (lab::from_first(all, own.str()) != own.str())
        throw std::runtime_error("its options are not those of rank 0");
}

// The exit status.
int run_checked(const options& o, const lab::ranks& all) {
    lab::on_all_alike(all, [&] { check_options(o, all); });
    compare_options(o, all);
    dump_file dump(o);
    lab::on_first(all, [&] {
        tools::make_folder(o.output);
        dump.open(o.dump);
        if (!o.no_checks)
            print_heading();
    });
    tools::finish_when_interrupted();
    const outcome result = o.demo ? run_demo(o, all, dump) : run(o, true, all, dump);
    return !result.complete ? 2 : result.good ? 0 : 1;
}

// As tools::run_program where all ranks fail alike; where one of them does, it says which, and ends all.
int run_rank(CLI::App& app, options& o, const lab::ranks& all, int count, char** arguments) {
    bool is_parsed = false;
    const auto run = [&] {
        is_parsed = true;
        if (lab::is_any(all, false))
            throw lab::agreed_failure("another rank has another command line");
        if (app.count("--threads") == 0)
            o.threads = std::max(1, o.threads / all.on_this_machine);
        try {
            return run_checked(o, all);
        } catch (const lab::agreed_failure&) {
            throw;
        } catch (const std::exception& error) {
            if (all.count == 1)
                throw;
            std::fprintf(stderr, "lab: rank %d of %d: %s\n", all.rank, all.count, error.what());
            all.end_all(2);
        }
    };
    int status = 0; // rank 0's: the launcher takes any
    if (all.rank == 0)
        status = tools::run_program(app, count, arguments, run);
    else if (all.can_exchange())
        try {
            app.parse(count, arguments);
            run();
        } catch (const CLI::Error&) {
        } catch (const lab::agreed_failure&) {
        }
    if (!is_parsed)
        lab::is_any(all, true);
    return status;
}

} // namespace

int main(int count, char** arguments) {
    CLI::App app{"Renders small scenes with the reference bidirectional path tracer and weighs every path "
                 "three ways.\nExit status: 0 all weights agree, 1 some do not, 2 bad input or output,\n130 "
                 "interrupted: the image is of the "
                 "passes that were done."};
    const lab::ranks all;
    options o;
    add_options(app, o);
    return run_rank(app, o, all, count, arguments);
}
