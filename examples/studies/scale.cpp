// Do weights depend on the units of the scene? Merges are weighed in three ways, [H] figure 6: with their
// density times pi r^2 [G], with all others' divided by pi r^2 [H], and without the area, which is wrong.
#include "study.hpp"
#include <lab/render.hpp>
#include <mis/verify/invariance.hpp>
#include <mis/verify/subpaths.hpp>

namespace {

struct options : studies::image_options {
    std::string scene = "glossy";
    options() { size = 32; }
};

enum form { georgiev, hachisuka, without_area };

template <class Real> struct weighed_path {
    std::vector<mis::measured_vertex<Real>> vertices;
    mis::technique technique;
};

// All paths of one pass with connections and merges, and the counts they are weighed with.
template <class Real> struct paths {
    std::vector<weighed_path<Real>> all;
    mis::technique_counts<Real> counts; // with the area of merges
    Real radius = 0;
};

template <class Real> paths<Real> render_paths(const std::string& name, int width, std::uint64_t seed) {
    const auto scene = bpt::make_scene<Real>(name);
    paths<Real> result;
    result.radius = Real(0.01) * scene.radius;
    result.counts =
        mis::connection_and_merging(static_cast<Real>(width) * static_cast<Real>(width), result.radius);
    lab::settings<Real> set;
    set.width = width;
    set.seed = seed;
    set.merge_radius = result.radius;
    set.counts = result.counts;
    const auto renderer = lab::make_renderer(scene, set);
    const bpt::photon_map<Real> photons(bpt::trace_photons(renderer, 0));
    const auto light_walks = lab::trace_light_walks(renderer, 0);
    for (int row = 0; row < width; ++row)
        renderer.render_row(
            0, row,
            [&](const bpt::contribution<Real>& c, const bpt::complete_path<Real>& complete) {
                const auto path = lab::look_at(scene, width, complete, light_walks);
                result.all.push_back({{path.records, path.records + path.size}, c.technique});
            },
            &photons);
    return result;
}

// The weight of a path in a scene of another size, by the recursion.
template <class Real>
Real weight_at(const paths<Real>& p, const weighed_path<Real>& path, Real scale, form f) {
    const int n = static_cast<int>(path.vertices.size());
    const auto there = mis::verify::scaled(p.counts, path.vertices.data(), n, scale);
    const Real radius = scale * p.radius;
    auto counts = there.counts;
    counts.merge = p.counts.merge / mis::merge_area(p.radius);
    if (f == georgiev)
        counts = mis::times_merge_area(counts, radius);
    if (f == hachisuka)
        counts = mis::divided_by_merge_area(counts, radius);
    return mis::weight_in_subpaths(mis::balance, counts, there.vertices.data(), n, path.technique);
}

struct summary {
    double mean_merge = 0;     // mean weight of merges
    double largest_change = 0; // of any weight, from that at size 1
};

template <class Real> summary summarize(const paths<Real>& p, Real scale, form f) {
    summary s;
    int merges = 0;
    for (const auto& path : p.all) {
        const double weight = static_cast<double>(weight_at(p, path, scale, f));
        const double at_one = static_cast<double>(weight_at(p, path, Real(1), f));
        s.largest_change = std::max(s.largest_change, std::abs(weight - at_one));
        if (path.technique.kind == mis::technique_kind::merge) {
            s.mean_merge += weight;
            ++merges;
        }
    }
    s.mean_merge /= std::max(1, merges);
    return s;
}

template <class Real> bool run(const options& o, const char* scalar, studies::csv_file& csv) {
    const auto p = render_paths<Real>(o.scene, o.size, o.seed);
    double worst = 0;
    for (const double scale : {1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3}) {
        std::string line = studies::text("%s,%g", scalar, scale);
        for (const form f : {georgiev, hachisuka, without_area}) {
            const summary s = summarize(p, static_cast<Real>(scale), f);
            line += studies::text(",%g,%g", s.mean_merge, s.largest_change);
            if (f != without_area)
                worst = std::max(worst, s.largest_change);
        }
        csv.add(line);
    }
    return studies::report(worst < 1e-5,
                           studies::text("%s, %zu paths at 7 sizes: weights with the area change by %.1e at "
                                         "most (bar: 1e-5)",
                                         scalar, p.all.size(), worst));
}

bool run_both(const options& o) {
    studies::csv_file csv(o.output, "scale.csv",
                          "scalar,scale,merges times area,largest change,others divided by area,largest "
                          "change,without area,largest change");
    const bool in_double = run<double>(o, "double", csv);
    return run<float>(o, "float", csv) && in_double;
}

} // namespace

int main(int count, char** arguments) {
    options o;
    studies::command_line app(
        "Weights under scaling of the scene, with and without the area of merges; writes scale.csv.", o);
    app.add("--scene", o.scene, "of the reference renderer", bpt::scene_names());
    return studies::run_study(app, o, count, arguments, run_both);
}
