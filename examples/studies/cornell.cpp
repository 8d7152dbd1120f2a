// Study: bidirectional path tracing, photon mapping and both together, at equal time and at equal samples,
// [H] figure 13 and table 2; and on a diffuse scene, [H] figure 12. Time is that of the processor, so that a
// busy machine changes little. Writes cornell.csv and images; cornell.gp draws the table. docs/merging.md
// tells what it shows.
#include "render_parts.hpp"
#include <bpt/algorithms.hpp>
#include <lab/pictures.hpp>
#include <map>

namespace {

using namespace studies;
using real = double;

struct options : compared_options {
    double seconds = 10; // of the processor, for each run of an algorithm
    double radius = 1;   // of the first pass, times that chosen for the scene
    options() { scenes = {"caustic", "diffuse"}, runs = 3, reference_seconds = 120; }
};

// Radius of the first pass, as a part of the scene's: chosen by hand, as in [H] 5.
double radius_of(const std::string& scene) { return scene == "caustic" ? 0.02 : 0.01; }

// The algorithms compared. `ups 1` leaves connections to light walks of two vertices and more out, [H] 6.
const std::vector<std::string> names{"bpt", "ppm", "sppm", "ups", "ups 1"};

bpt::renderer<real> make_renderer(const bpt::scene<real>& scene, const options& o, const std::string& name,
                                  std::uint64_t seed, double radius) {
    const real walks = static_cast<real>(o.size) * static_cast<real>(o.size);
    auto s = settings_of<bpt::settings<real>>(o, seed);
    s.merge_radius = radius * radius_of(scene.name) * scene.radius;
    const auto algorithm = bpt::algorithms(walks, s.merge_radius).at(name.substr(0, name.find(' ')));
    s.counts = name == "ups 1" ? bpt::one_light_vertex(algorithm.counts) : algorithm.counts;
    s.radius_alpha = algorithm.is_progressive ? mis::optimal_alpha<real> : real(1);
    s.merges_once = algorithm.merges_once;
    return {scene, s};
}

// ---- The algorithms ----

struct point {
    int passes;
    double seconds, squared_error; // means over runs
};

struct result {
    std::vector<point> convergence;      // after 1, 2, 4, ... passes and at the end
    double rms = 0, least = 0, most = 0; // at the end; of single runs
    parts sum;                           // of the first run
};

struct measured_run {
    std::vector<point> points;
    parts sum;
};

measured_run measure(const bpt::scene<real>& scene, const options& o, const std::string& name, int run,
                     const reference& r) {
    const auto renderer = make_renderer(scene, o, name, o.seed + static_cast<std::uint64_t>(run), o.radius);
    measured_run m{{}, parts(o.size)};
    int due = 1;
    double spent = 0; // on rendering, not on measuring
    while (m.sum.passes == 0 || spent < o.seconds) {
        const double start = processor_seconds();
        add_pass(renderer, m.sum);
        spent += processor_seconds() - start;
        const bool is_last = spent >= o.seconds;
        if (m.sum.passes == due || is_last)
            m.points.push_back({m.sum.passes, spent, mean_squared_error(mean_image(m.sum), 1, r)});
        if (m.sum.passes == due)
            due *= 2;
        show_progress(text("%s: %s, run %d of %d, %d passes", scene.name.c_str(), name.c_str(), run + 1,
                           o.runs, m.sum.passes));
    }
    return m;
}

// The runs' mean; the end of each counts as one point, whatever the number of its passes.
result measure_all(const bpt::scene<real>& scene, const options& o, const std::string& name,
                   const reference& r) {
    std::vector<measured_run> runs;
    std::size_t shared = std::numeric_limits<std::size_t>::max();
    for (int run = 0; run < o.runs; ++run) {
        runs.push_back(measure(scene, o, name, run, r));
        shared = std::min(shared, runs.back().points.size() - 1);
    }
    result all{{}, 0, std::numeric_limits<double>::max(), 0, runs[0].sum};
    for (std::size_t i = 0; i <= shared; ++i) {
        point mean{0, 0, 0};
        double passes = 0;
        for (const auto& run : runs) {
            const point& p = i < shared ? run.points[i] : run.points.back();
            passes += static_cast<double>(p.passes) / o.runs;
            mean.seconds += p.seconds / o.runs;
            mean.squared_error += p.squared_error / o.runs;
        }
        mean.passes = static_cast<int>(std::lround(passes));
        all.convergence.push_back(mean);
    }
    for (const auto& run : runs) {
        all.least = std::min(all.least, std::sqrt(run.points.back().squared_error));
        all.most = std::max(all.most, std::sqrt(run.points.back().squared_error));
    }
    all.rms = std::sqrt(all.convergence.back().squared_error);
    return all;
}

using results = std::map<std::string, result>;

// The RMS error after as many passes as all algorithms have made.
double rms_at_equal_samples(const result& r, std::size_t common) {
    return std::sqrt(r.convergence[common].squared_error);
}

// ---- What is written ----

void print_table(const results& all) {
    std::size_t common = std::numeric_limits<std::size_t>::max();
    for (const auto& [name, r] : all)
        common = std::min(common, r.convergence.size() - 2);
    const auto& ups = all.at("ups");
    const bool has_common = ups.convergence.size() > 1 && common < ups.convergence.size();
    std::printf("  %-6s %10s  %-17s %8s  %14s %8s  %12s\n", "", "RMS error", "  of single runs", "ups = 1",
                "equal samples", "ups = 1", "samples/min");
    for (const auto& name : names) {
        const result& r = all.at(name);
        const double equal = has_common ? rms_at_equal_samples(r, common) : 0,
                     ups_equal = has_common ? rms_at_equal_samples(ups, common) : 1;
        std::printf("  %-6s %10.5f  %.5f - %.5f %8.2f  %14.5f %8.2f  %12.1f\n", name.c_str(), r.rms, r.least,
                    r.most, r.rms / ups.rms, equal, equal / ups_equal,
                    60 * r.convergence.back().passes / r.convergence.back().seconds);
    }
}

// How fast the error falls with passes, over 1, 2, 4, ... of them.
double slope_of(const result& r) {
    std::vector<int> passes;
    std::vector<double> rms;
    for (const point& p : r.convergence) {
        passes.push_back(p.passes);
        rms.push_back(std::sqrt(p.squared_error));
    }
    return log_log_slope(passes, rms);
}

void write_images(const bpt::scene<real>& scene, const options& o, const results& all, const reference& r) {
    const double exposure = static_cast<double>(scene.exposure);
    std::vector<lab::labelled_image> images{{"reference", r.mean, exposure}};
    for (const auto& name : names)
        images.push_back({name, mean_image(all.at(name).sum), exposure});
    lab::write_sheet(o.output + "/cornell-" + scene.name + ".png", images, 3);

    const parts& ups = all.at("ups").sum;
    const double scale = exposure / ups.passes;
    bpt::image share = ups.merged;
    for (std::size_t i = 0; i < ups.pixels(); ++i) {
        const glm::dvec3 ones(1);
        const double merged = dot(ups.merged.pixels[i], ones), rest = dot(ups.connected.pixels[i], ones);
        share.pixels[i] = lab::false_color(merged > 0 ? merged / (merged + rest) : 0);
    }
    lab::write_sheet(o.output + "/cornell-" + scene.name + "-shares.png",
                     {{"connections", ups.connected, scale},
                      {"merges", ups.merged, scale},
                      {"both", mean_image(ups), exposure},
                      {"share of merges", share, 1, {"0", "1/2", "1", 0}}},
                     4);
}

results compare(const std::string& scene_name, const options& o, csv_file& csv) {
    const auto scene = bpt::make_scene<real>(scene_name);
    const reference r = render_reference(scene_name, o.reference_seconds, [&](std::size_t half) {
        return make_renderer(scene, o, "ups", o.seed + 1000 + half, o.radius / 2); // less radius, less bias
    });
    results all;
    for (const auto& name : names) {
        all.emplace(name, measure_all(scene, o, name, r));
        for (const point& p : all.at(name).convergence)
            csv.add(text("%s,%s,%d,%g,%g", scene_name.c_str(), name.c_str(), p.passes, p.seconds,
                         std::sqrt(p.squared_error)));
    }
    show_progress("");
    std::printf("%s: %.3g s of processor time for each of %d runs; the reference's own RMS error is %.5f\n",
                scene_name.c_str(), o.seconds, o.runs, std::sqrt(r.noise));
    print_table(all);
    note(text("with passes, the error of ups falls as passes^%.2f, that of bpt as passes^%.2f",
              slope_of(all.at("ups")), slope_of(all.at("bpt"))));
    write_images(scene, o, all, r);
    return all;
}

bool run(const options& o) {
    csv_file csv(o.output, "cornell.csv", "scene,algorithm,passes,seconds,rms_error");
    bool good = true;
    for (const auto& scene : o.scenes) {
        const results all = compare(scene, o, csv);
        const auto over = [&](const char* a, const char* b) { return all.at(a).rms / all.at(b).rms; };
        if (scene == "caustic") {
            const double bpt = over("bpt", "ups"), ppm = over("ppm", "ups");
            good &= report(bpt >= 4, text("bpt has %.2f times the error of ups (bar: 4; [H]: 5.95)", bpt));
            good &= report(ppm >= 4, text("ppm has %.2f times the error of ups (bar: 4; [H]: 5.78)", ppm));
        } else {
            const double ups = over("ups", "bpt");
            good &= report(ups <= 1.3, text("ups has %.2f times the error of bpt (bar: 1.3)", ups));
        }
    }
    return good;
}

} // namespace

int main(int count, char** arguments) {
    options o;
    command_line app("Bidirectional path tracing, photon mapping and unified path sampling at equal "
                     "time; writes cornell.csv and images.",
                     o);
    app.add("--seconds", o.seconds, "processor time of each run", 1e-3, 1e6);
    add_compared(app, o, o.scenes);
    app.add("--runs", o.runs, "of each algorithm", 1, 1000);
    app.add("--radius", o.radius, "within which walks merge in pass 1, times that of the scene", 1e-3, 1e3);
    return run_study(app, o, count, arguments, run);
}
