// Study: media by connections alone, by each family of merges alone, and by all of them, at equal time; in
// four scenes, and in a box of fog over mean free paths. Time is that of the processor, so that a busy
// machine changes little. Lights that the camera sees directly are left out: all algorithms find them in the
// same way, and at their edges pixels are noisier than all else. Writes media.csv and pictures; media.gp
// draws the table. docs/media.md tells what it shows.
#include "render_parts.hpp"
#include <bpt/algorithms.hpp>
#include <bpt/media_options.hpp>
#include <lab/pictures.hpp>
#include <map>

namespace {

using namespace studies;
using real = double;

struct options : compared_options {
    double seconds = 10;                                     // of the processor, for each run of an algorithm
    double radius = 0.01;                                    // of the first pass, as a part of the scene's
    std::vector<double> mean_free_paths{0.1, 0.3, 1, 3, 10}; // in sizes of the box
    options() { scenes = bpt::media_scene_names(), runs = 2, reference_seconds = 120; }
};

constexpr int shortest = 3; // paths of fewer vertices are lights that the camera sees
const std::vector<std::string> names{"bpt", "point-point", "point-beam", "beam-point", "beam-beam", "upbp"};

bpt::renderer<real, mis::power_heuristic<>> make_renderer(const bpt::scene<real>& scene, const options& o,
                                                          const std::string& name, std::uint64_t seed,
                                                          double radius) {
    const real walks = static_cast<real>(o.size) * static_cast<real>(o.size);
    auto s = settings_of<bpt::settings<real>>(o, seed);
    s.merge_radius = radius * scene.radius;
    s.counts = bpt::algorithms(walks, s.merge_radius).at(name).counts;
    s.media =
        bpt::media_merges_of(name, s.counts.merge > 0, bpt::media_options{}, radius, scene.radius, walks);
    s.radius_alpha = mis::optimal_alpha<real>;
    return {scene, s};
}

struct result {
    double squared_error = 0, passes = 0; // means over runs
    bpt::image mean;                      // of the first
    double rms() const { return std::sqrt(squared_error); }
};
using results = std::map<std::string, result>;

result measure(const bpt::scene<real>& scene, const options& o, const std::string& name, const reference& r) {
    result all;
    for (int run = 0; run < o.runs; ++run) {
        const auto renderer =
            make_renderer(scene, o, name, o.seed + static_cast<std::uint64_t>(run), o.radius);
        parts sum(o.size);
        sum.shortest = shortest;
        const double start = processor_seconds();
        while (sum.passes == 0 || processor_seconds() - start < o.seconds) {
            add_pass(renderer, sum);
            show_progress(text("%s: %s, run %d of %d, %d passes", scene.name.c_str(), name.c_str(), run + 1,
                               o.runs, sum.passes));
        }
        all.squared_error += mean_squared_error(mean_image(sum), 1, r) / o.runs;
        all.passes += static_cast<double>(sum.passes) / o.runs;
        if (run == 0)
            all.mean = mean_image(sum);
    }
    return all;
}

reference reference_of(const bpt::scene<real>& scene, const options& o) {
    const auto make = [&](std::size_t half) {
        return make_renderer(scene, o, "upbp", o.seed + 1000 + half, o.radius / 2); // less radius, less bias
    };
    return render_reference(scene.name, o.reference_seconds, make, shortest);
}

results compare(const bpt::scene<real>& scene, const options& o, const reference& r, csv_file& csv,
                double mean_free_path) {
    results all;
    for (const auto& name : names) {
        const result& one = all[name] = measure(scene, o, name, r);
        csv.add(
            text("%s,%g,%s,%g,%g", scene.name.c_str(), mean_free_path, name.c_str(), one.passes, one.rms()));
    }
    show_progress("");
    std::printf("%s%s: the reference's own RMS error is %.5f\n", scene.name.c_str(),
                mean_free_path > 0 ? text(", mean free path %g", mean_free_path).c_str() : "",
                std::sqrt(r.noise));
    for (const auto& name : names)
        std::printf("  %-12s RMS error %8.5f, %6.2f times that of upbp, %8.1f passes\n", name.c_str(),
                    all.at(name).rms(), all.at(name).rms() / all.at("upbp").rms(), all.at(name).passes);
    return all;
}

// Who makes a path: connections, merges on surfaces, or a family of merges in media.
const std::vector<std::string> makers{"joined",     "surfaces",   "point-point",
                                      "point-beam", "beam-point", "beam-beam"};
std::size_t maker_of(const bpt::contribution<real>& c, const bpt::complete_path<real>& path) {
    if (c.technique.kind != mis::technique_kind::merge)
        return 0;
    return bpt::is_in_medium(*path.camera) ? 2 + static_cast<std::size_t>(c.family) : 1;
}

// What each maker of upbp's paths estimates alone, and weighted.
void write_makers(const bpt::scene<real>& scene, const options& o, int passes) {
    struct made {
        std::size_t maker, pixel;
        glm::dvec3 value;
        double weight;
    };
    std::vector<bpt::image> alone(makers.size(), bpt::black(o.size)), weighted = alone;
    const auto first = make_renderer(scene, o, "upbp", o.seed, o.radius);
    std::vector<std::vector<made>> rows(static_cast<std::size_t>(o.size));
    for (int pass = 0; pass < passes; ++pass) {
        bpt::render_pass(first, pass, [&](const auto& renderer, const auto* photons, int row) {
            auto& kept = rows[static_cast<std::size_t>(row)];
            kept.clear();
            const auto keep = [&](const bpt::contribution<real>& c, const bpt::complete_path<real>& path) {
                if (c.vertices >= shortest)
                    kept.push_back({maker_of(c, path), static_cast<std::size_t>(c.pixel),
                                    glm::dvec3(c.value) / static_cast<double>(passes), c.weight});
            };
            renderer.render_row(pass, row, keep, photons);
        });
        for (const auto& row : rows)
            for (const made& m : row) {
                alone[m.maker].pixels[m.pixel] += m.value;
                weighted[m.maker].pixels[m.pixel] += m.value * m.weight;
            }
        show_progress(text("%s: pictures, %d of %d passes", scene.name.c_str(), pass + 1, passes));
    }
    std::vector<lab::labelled_image> sheet;
    const double exposure = static_cast<double>(scene.exposure);
    for (const auto* images : {&alone, &weighted})
        for (std::size_t k = 0; k < makers.size(); ++k)
            sheet.push_back({images == &alone ? makers[k] : "weighted", (*images)[k], exposure});
    lab::write_sheet(o.output + "/media-" + scene.name + "-families.png", sheet,
                     static_cast<int>(makers.size()));
}

void write_pictures(const bpt::scene<real>& scene, const options& o, const results& all, const reference& r) {
    const double exposure = static_cast<double>(scene.exposure);
    std::vector<lab::labelled_image> images{{"reference", r.mean, exposure}};
    for (const auto& name : names)
        images.push_back({name, all.at(name).mean, exposure});
    lab::write_sheet(o.output + "/media-" + scene.name + ".png", images, 7);
    write_makers(scene, o, o.runs * std::max(1, static_cast<int>(all.at("upbp").passes)));
}

// A box with a light below its ceiling, in it a ball of fog that scatters forward, as wide as the box. The
// mean free path is in sizes of the box.
bpt::scene<real> box_of_fog(double mean_free_path) {
    auto scene = bpt::make_scene<real>("cornell");
    scene.name = "box";
    const real size = 540;
    bpt::medium<real> fog;
    fog.extinction = bpt::color<real>(1 / (mean_free_path * size));
    fog.phase.kind = bpt::material_kind::phase;
    fog.phase.diffuse = 0.95 * fog.extinction;
    fog.phase.exponent = 0.7;
    fog.phase.survival = 0.95;
    bpt::material<real> boundary;
    boundary.kind = bpt::material_kind::boundary;
    boundary.inside = 0;
    scene.media.push_back(fog);
    scene.materials.push_back(boundary);
    scene.spheres.push_back({scene.center, size / 2, static_cast<int>(scene.materials.size()) - 1});
    return scene;
}

bool run(const options& o) {
    csv_file csv(o.output, "media.csv", "scene,mean_free_path,algorithm,passes,rms_error");
    bool good = true;
    std::map<std::string, double> log_sum; // of errors over those of upbp
    for (const auto& name : o.scenes) {
        const auto scene = bpt::make_scene<real>(name);
        const reference r = reference_of(scene, o);
        const results all = compare(scene, o, r, csv, 0);
        double best = std::numeric_limits<double>::max();
        for (const auto& [algorithm, one] : all) {
            log_sum[algorithm] += std::log(one.rms() / all.at("upbp").rms());
            if (algorithm != "upbp")
                best = std::min(best, one.rms());
        }
        const double over = all.at("upbp").rms() / best;
        good &= report(over <= 1.5, text("upbp has %.2f times the error of the best alone (bar: 1.5)", over));
        write_pictures(scene, o, all, r);
    }
    for (const auto& name : names) {
        if (name == "upbp" || o.scenes.empty())
            continue;
        const double over = std::exp(log_sum[name] / static_cast<double>(o.scenes.size()));
        good &= report(over >= 2, text("%s has %.2f times the error of upbp over all scenes (bar: 2)",
                                       name.c_str(), over));
    }
    for (const double mean_free_path : o.mean_free_paths) {
        const auto scene = box_of_fog(mean_free_path);
        compare(scene, o, reference_of(scene, o), csv, mean_free_path);
    }
    return good;
}

} // namespace

int main(int count, char** arguments) {
    options o;
    command_line app("Media by connections, by each family of merges and by all, at equal time; writes "
                     "media.csv and images.",
                     o);
    app.add("--seconds", o.seconds, "processor time of each run", 1e-3, 1e6);
    add_compared(app, o, bpt::media_scene_names());
    app.add("--runs", o.runs, "of each algorithm", 1, 1000);
    app.add("--radius", o.radius, "of the first pass, as a part of the scene's", 1e-6, 1);
    app.add("--mean-free-path", o.mean_free_paths, "of a box of fog, in its sizes", 1e-3, 1e3);
    return run_study(app, o, count, arguments, run);
}
