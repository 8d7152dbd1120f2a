// The rendering loop: one camera walk and one light walk per pixel and pass, joined in every way. Where walks
// are merged, all light walks of a pass come first.
#pragma once

#include "dump.hpp"
#include "merge.hpp"
#include "mistaken_weight.hpp"
#include <atomic>
#include <functional>
#include <mis/bias.hpp>
#include <thread>

namespace bpt {

template <class Real> struct settings {
    int width = 128; // and height, in pixels
    int passes = 16; // samples per pixel
    int threads = static_cast<int>(std::thread::hardware_concurrency());
    int longest = longest_path; // the path's vertices in all; caps on its walks are in the counts
    std::uint64_t seed = 1;
    any_heuristic heuristic;
    mistake_set mistakes;
    mis::technique_counts<Real> counts; // light walks per image: width * width
    Real merge_radius = 0;              // of the first pass: that of counts.merge, in the scene's units
    Real radius_alpha = 1;              // of mis::progressive_radius; 1: the radius stays
    bool merges_once = false;           // each camera walk ends where it can first be merged
    bool random_connection = false;
    bool check_weights = true;
    int dump_paths = 0;       // a random choice of them, per image row and pass
    bool balance_all = false; // keep the balance weights of all techniques with each contribution
};

// What one row of one pass has made. Rows are merged in their order, so that results do not depend on
// threads.
template <class Real> struct row_result {
    std::vector<contribution<Real>> contributions;
    std::vector<balanced_sample> samples; // of settings::balance_all: one for each contribution
    weight_checks checks;
    std::vector<std::string> dump;
};

template <class Real> struct pass_result {
    int pass = 0;
    std::vector<row_result<Real>> rows;
};

// Calls f(i) for 0 <= i < count on several threads.
template <class F> void in_parallel(int threads, int count, F&& f) {
    std::atomic<int> next{0};
    std::vector<std::thread> pool;
    for (int i = 0; i < std::max(1, threads); ++i)
        pool.emplace_back([&] {
            for (int k; (k = next++) < count;)
                f(k);
        });
    for (auto& thread : pool)
        thread.join();
}

// A technique that is disabled by mistake_set::disabled_technique is not made: connections.
template <class Real> settings<Real> planted(settings<Real> set) {
    if (set.mistakes.has(mistake::disabled_technique))
        set.counts.connection = 0;
    return set;
}

// The renderer with all that stays the same from sample to sample.
template <class Real> struct renderer {
    const bpt::scene<Real>& scene;
    settings<Real> set;
    weights<Real> weigh;
    double mean_light_vertices = 0; // of light walks, for random connections; 0: all connections

    renderer(const bpt::scene<Real>& s, const settings<Real>& settings)
        : scene(s), set(planted(settings)), weigh(set.heuristic, set.counts, set.mistakes, set.merges_once) {
        if (set.random_connection)
            mean_light_vertices = measure_light_vertices();
        weigh = make_weights();
    }

    weights<Real> make_weights() const {
        const auto counts = set.random_connection
                                ? mis::random_connection(set.counts, static_cast<Real>(mean_light_vertices))
                                : set.counts;
        return {set.heuristic, counts, set.mistakes, set.merges_once};
    }

    // The renderer of one pass: with the pass' radius, and with the weights that follow from it.
    renderer at_pass(int pass) const {
        renderer there = *this;
        const Real shrunk = mis::progressive_radius(Real(1), pass + 1, set.radius_alpha);
        there.set.merge_radius *= shrunk;
        there.set.counts.merge *= shrunk * shrunk;
        there.weigh = there.make_weights();
        return there;
    }

    pcg32 generator(std::uint64_t pass, std::uint64_t pixel) const {
        return {set.seed * 0x9e3779b9u + pass, pixel};
    }

    int longest_camera_walk() const { return std::min(set.longest, set.counts.max_camera_vertices); }
    int longest_light_walk() const { return std::min(set.longest - 1, set.counts.max_light_vertices); }

    bool merges() const { return weigh.counts.merge > Real(0); }

    // Whether somebody looks at the whole path of a merge: at more than the recursion's two numbers.
    bool wants_complete_merges() const {
        return set.check_weights || set.balance_all || set.dump_paths > 0 || set.mistakes.any() ||
               takes_whole_path(weigh);
    }

    // The light walk of a pixel where walks merge, by a generator that the camera walks do not use: the same
    // whenever it is traced.
    void trace_light_walk(int pass, std::size_t pixel, walk<Real>& walk) const {
        const auto width = static_cast<std::size_t>(set.width);
        pcg32 rng = generator(static_cast<std::uint64_t>(pass), width * width + pixel);
        walk_from_light(scene, weigh, longest_light_walk(), walk, rng);
    }

    // The light walks of all pixels.
    light_pass<Real> trace_light_walks(int pass) const {
        const auto width = static_cast<std::size_t>(set.width);
        light_pass<Real> all;
        if (wants_complete_merges())
            all.walks.resize(width * width);
        std::vector<std::vector<photon<Real>>> rows(width);
        in_parallel(set.threads, set.width, [&](int row) {
            const std::size_t first = static_cast<std::size_t>(row) * width;
            walk<Real> light;
            for (std::size_t pixel = first; pixel < first + width; ++pixel) {
                trace_light_walk(pass, pixel, light);
                add_photons(light, pixel, rows[static_cast<std::size_t>(row)]);
                if (!all.walks.empty())
                    all.walks[pixel] = light;
            }
        });
        std::size_t photons = 0;
        for (const auto& row : rows)
            photons += row.size();
        all.photons.reserve(photons);
        for (auto& row : rows) {
            all.photons.insert(all.photons.end(), row.begin(), row.end());
            row = {};
        }
        return all;
    }

    // From walks of their own: weights must not depend on the walk that is weighed.
    double measure_light_vertices() const {
        std::int64_t vertices = 0;
        walk<Real> light;
        constexpr int walks = 10000;
        for (int i = 0; i < walks; ++i) {
            pcg32 rng = generator(~std::uint64_t(0), static_cast<std::uint64_t>(i));
            walk_from_light(scene, weigh, longest_light_walk(), light, rng);
            for (std::size_t k = 1; k < light.size(); ++k)
                vertices += !scatters_dirac(light[k]);
        }
        return std::max(1.0, static_cast<double>(vertices) / walks);
    }

    Real weight_of(const contribution<Real>& c, const complete_path<Real>& path,
                   const std::function<Real()>& weight) const {
        if (has_recursion(weigh))
            return weight();
        if (!takes_whole_path(weigh))
            return Real(1);
        mis::measured_vertex<Real> records[longest_path];
        for (int i = 0; i < path.size; ++i)
            records[i] = path.vertices[i].record;
        return mis::weight(set.heuristic, weigh.counts, records, path.size, c.technique);
    }

    // Makes all paths of one row of one pass; sink(contribution, path) is given each with its weight. With
    // photons, the light walks are those that left them, traced anew.
    template <class Sink>
    void render_row(int pass, int row, Sink&& sink, const photon_map<Real>* photons = nullptr) const {
        sample_pair<Real, weights<Real>> pair{scene, weigh, set.width, 0, set.longest, {}, {}, {}};
        const auto& counts = weigh.counts;
        const bool from_light = counts.connection + counts.camera_connection + counts.direct > Real(0);
        const bool from_camera =
            counts.light_hit + counts.next_event + counts.connection + counts.merge > Real(0);
        const auto weigh_first = [&](contribution<Real> c, const complete_path<Real>& path,
                                     const auto& weight) {
            c.weight = c.right_weight = weight_of(c, path, weight);
            if (set.mistakes.any())
                c.weight = static_cast<Real>(
                    mistaken_weight(set.mistakes, weigh, set.merge_radius, path, c.technique));
            sink(c, path);
        };
        for (int column = 0; column < set.width; ++column) {
            pair.pixel = row * set.width + column;
            pcg32 rng = generator(static_cast<std::uint64_t>(pass), static_cast<std::uint64_t>(pair.pixel));
            const Real x = static_cast<Real>(column) + uniform<Real>(rng),
                       y = static_cast<Real>(row) + uniform<Real>(rng);
            const Real to_film = 2 / static_cast<Real>(set.width);
            pair.camera.clear();
            pair.light.clear();
            if (from_camera)
                walk_from_camera(scene, weigh, set.width, x * to_film - 1, 1 - y * to_film,
                                 longest_camera_walk(), pair.camera, rng);
            if (from_light && photons)
                trace_light_walk(pass, static_cast<std::size_t>(pair.pixel), pair.light);
            else if (from_light)
                walk_from_light(scene, weigh, longest_light_walk(), pair.light, rng);
            connect_all(pair, set.random_connection, rng, weigh_first);
            if (photons)
                merge_all(pair, *photons, set.merge_radius, weigh_first);
        }
    }

    // Keeps a random dump_paths of all lines.
    template <class Line>
    void keep_some(std::vector<std::string>& lines, std::int64_t made, pcg32& chance, Line&& line) const {
        if (static_cast<int>(lines.size()) < set.dump_paths)
            lines.push_back(line());
        else if (const auto k = std::uniform_int_distribution<std::int64_t>(0, made)(chance);
                 k < set.dump_paths)
            lines[static_cast<std::size_t>(k)] = line();
    }

    // Keeps all contributions of a row, compares their weights, writes some of them down.
    row_result<Real> keep_row(int pass, int row, const photon_map<Real>* photons) const {
        row_result<Real> result;
        std::int64_t made = 0;
        pcg32 chance = generator(static_cast<std::uint64_t>(pass), ~static_cast<std::uint64_t>(row));
        const auto keep = [&](const contribution<Real>& c, const complete_path<Real>& path) {
            result.contributions.push_back(c);
            if (set.balance_all)
                result.samples.push_back(balance(weigh, c, path));
            if (set.check_weights)
                check_weight(scene, weigh, mean_light_vertices, set.merge_radius, set.width, path,
                             c.technique, c.right_weight, result.checks);
            keep_some(result.dump, made++, chance,
                      [&] { return to_json_line(scene, weigh, set.merge_radius, c, path); });
        };
        render_row(pass, row, keep, photons);
        return result;
    }
};

// Renders all passes; `on_pass` is given each in turn.
template <class Real, class OnPass>
void render(const scene<Real>& scene, const settings<Real>& settings, OnPass&& on_pass) {
    const renderer<Real> first(scene, settings);
    for (int pass = 0; pass < settings.passes; ++pass) {
        const renderer<Real> renderer = first.at_pass(pass);
        std::optional<photon_map<Real>> photons;
        if (renderer.merges())
            photons.emplace(renderer.trace_light_walks(pass));
        pass_result<Real> result{pass,
                                 std::vector<row_result<Real>>(static_cast<std::size_t>(settings.width))};
        in_parallel(settings.threads, settings.width, [&](int row) {
            result.rows[static_cast<std::size_t>(row)] =
                renderer.keep_row(pass, row, photons ? &*photons : nullptr);
        });
        on_pass(result);
    }
}

} // namespace bpt
