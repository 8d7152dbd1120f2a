// Renders pass by pass into two images: what merges have found, and what all other techniques have.
// References, and errors against them.
#pragma once

#include "study.hpp"
#include <array>
#include <bpt/render.hpp>
#include <ctime>

namespace studies {

// Of studies that compare several runs of each way to render with a reference, in scenes of the reference
// renderer.
struct compared_options : image_options {
    std::vector<std::string> scenes;
    int runs = 1;
    double reference_seconds = 1;
};
inline void add_compared(command_line& app, compared_options& o,
                         const std::vector<std::string>& known_scenes) {
    app.add("--scene", o.scenes, "of the reference renderer", known_scenes);
    app.add("--reference-seconds", o.reference_seconds, "processor time of each scene's reference", 1e-3,
            1e6);
}

// Whether report_scene(name, o, csv) is good for all scenes.
template <class Options, class ReportScene>
bool report_scenes(const Options& o, csv_file csv, ReportScene&& report_scene) {
    bool good = true;
    for (const auto& scene : o.scenes)
        good &= report_scene(scene, o, csv);
    return good;
}

// The renderer's, or the laboratory's.
template <class Settings> Settings settings_of(const image_options& o, std::uint64_t seed) {
    Settings set;
    set.width = o.size;
    set.threads = o.threads;
    set.seed = seed;
    return set;
}
// Of bidirectional path tracing.
template <class Real> bpt::settings<Real> bidirectional_settings(const image_options& o, std::uint64_t seed) {
    auto set = settings_of<bpt::settings<Real>>(o, seed);
    set.counts = mis::bidirectional(static_cast<Real>(o.size) * static_cast<Real>(o.size));
    return set;
}

struct parts {
    bpt::image merged, connected; // sums over passes
    int passes = 0;
    int shortest = 2; // paths of fewer vertices are left out

    explicit parts(int width) : merged(bpt::black(width)), connected(merged) {}
    std::size_t pixels() const { return merged.pixels.size(); }
    glm::dvec3 mean(std::size_t pixel) const {
        return (merged.pixels[pixel] + connected.pixels[pixel]) / static_cast<double>(passes);
    }
};

inline bpt::image mean_image(const parts& p) {
    bpt::image image = p.merged;
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = p.mean(i);
    return image;
}

// The next pass: make(add) calls add(row, contribution) for all rows, in parallel. Light walks, the only ones
// to reach pixels of other rows, wait.
template <class Make> void add_pass_of(int width, parts& sum, Make&& make) {
    struct splat {
        std::size_t pixel;
        glm::dvec3 value;
    };
    std::vector<std::vector<splat>> splats(static_cast<std::size_t>(width));
    make([&](int row, const auto& c) {
        if (c.vertices < sum.shortest)
            return;
        const splat s{static_cast<std::size_t>(c.pixel), glm::dvec3(c.value) * static_cast<double>(c.weight)};
        if (c.technique.kind == mis::technique_kind::merge)
            sum.merged.pixels[s.pixel] += s.value;
        else if (c.technique.camera_vertices == 1)
            splats[static_cast<std::size_t>(row)].push_back(s);
        else
            sum.connected.pixels[s.pixel] += s.value;
    });
    for (const auto& row : splats)
        for (const splat& s : row)
            sum.connected.pixels[s.pixel] += s.value;
    ++sum.passes;
}
template <class Real, class Heuristic>
void add_pass(const bpt::renderer<Real, Heuristic>& first, parts& sum) {
    add_pass_of(first.set.width, sum, [&](auto&& add) {
        bpt::render_pass(
            first, sum.passes, [&](const auto& renderer, const bpt::photon_map<Real>* photons, int row) {
                renderer.render_row(
                    sum.passes, row,
                    [&](const bpt::contribution<Real>& c, const bpt::complete_path<Real>&) { add(row, c); },
                    photons);
            });
    });
}

// Of all threads: a busy machine changes little.
inline double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// Two images that know nothing of each other: how far they are apart tells how far both are from the truth.
struct reference {
    bpt::image mean;
    double noise = 0; // mean squared error of the mean, over pixels and channels
};

// make(half) makes the renderer of each image, with seeds of their own.
template <class Make>
reference render_reference(const std::string& name, double seconds, Make&& make, int shortest = 2) {
    std::array<bpt::image, 2> halves;
    for (std::size_t half = 0; half < 2; ++half) {
        const auto renderer = make(half);
        parts sum(renderer.set.width);
        sum.shortest = shortest;
        const double start = processor_seconds(), most = seconds / 2;
        for (double spent = 0; sum.passes == 0 || spent < most; spent = processor_seconds() - start) {
            show_progress(text("%s: reference, %.0f of %.0f s", name.c_str(),
                               spent + static_cast<double>(half) * most, seconds));
            add_pass(renderer, sum);
        }
        halves[half] = mean_image(sum);
    }
    reference r{halves[0], 0};
    for (std::size_t i = 0; i < r.mean.pixels.size(); ++i) {
        const glm::dvec3 apart = halves[0].pixels[i] - halves[1].pixels[i];
        r.mean.pixels[i] -= apart / 2.0;
        r.noise += dot(apart, apart) / 4 / (3 * static_cast<double>(r.mean.pixels.size()));
    }
    return r;
}

// Over pixels and channels, of an image times a factor; without the reference's own noise.
inline double mean_squared_error(const bpt::image& image, double factor, const reference& r) {
    double squares = 0;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const glm::dvec3 error = factor * image.pixels[i] - r.mean.pixels[i];
        squares += dot(error, error);
    }
    return std::max(0.0, squares / (3 * static_cast<double>(image.pixels.size())) - r.noise);
}

} // namespace studies
