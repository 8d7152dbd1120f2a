// Renders, and looks at every path: weights in three forms, planted mistakes, dumps, balance weights of all
// techniques.
#pragma once

#include "dump.hpp"
#include "mistakes.hpp"

namespace lab {

template <class Real> struct settings : bpt::settings<Real> {
    any_heuristic heuristic;
    mistake_set mistakes;
    bool check_weights = true;
    int dump_paths = 0;       // a random choice of them, per image row and pass
    bool balance_all = false; // keep the balance weights of all techniques with each contribution
};

// With the weight that it should have, where mistakes are planted.
template <class Real> struct weighed_contribution : contribution<Real> { Real right_weight = 0; };

// What one row of one pass has made. Rows are merged in their order, so that results do not depend on
// threads.
template <class Real> struct row_result {
    std::vector<weighed_contribution<Real>> contributions;
    std::vector<balanced_sample> samples; // of settings::balance_all: one for each contribution
    weight_checks checks;
    std::vector<std::string> dump;
};

template <class Real> struct pass_result {
    int pass = 0;
    std::vector<row_result<Real>> rows;
};

// Walks of this scene end only by leaving it.
template <class Real> scene<Real> without_roulette(scene<Real> scene) {
    for (auto& m : scene.materials)
        m.survival = 1;
    for (auto& m : scene.media)
        m.phase.survival = 1;
    return scene;
}

// Throws std::runtime_error where a heuristic cannot weigh what is merged.
template <class Real> void check_heuristic(const scene<Real>& scene, const settings<Real>& set) {
    if (has_media(scene) && set.media.any() && !has_joined(set.heuristic))
        throw std::runtime_error("the " + std::string(name_of(set.heuristic.kind)) +
                                 " heuristic cannot weigh merges in media");
}

// A technique that is disabled by mistake_set::disabled_technique is not made: connections.
template <class Real> renderer<Real> make_renderer(const scene<Real>& scene, settings<Real> set) {
    if (set.mistakes.has(mistake::disabled_technique))
        set.counts.connection = 0;
    check_heuristic(scene, set);
    return {scene, set, set.heuristic};
}

// Whether somebody looks at whole paths: at more than the recursion's two numbers.
template <class Real> bool looks_at_paths(const renderer<Real>& r, const settings<Real>& set) {
    return set.check_weights || set.balance_all || set.dump_paths > 0 || set.mistakes.any() ||
           takes_whole_path(r);
}

// The light walks of all pixels, which merges know by their photons alone.
template <class Real> std::vector<walk<Real>> trace_light_walks(const renderer<Real>& r, int pass) {
    std::vector<walk<Real>> walks(static_cast<std::size_t>(r.set.width) *
                                  static_cast<std::size_t>(r.set.width));
    in_parallel(r.set.threads, r.set.width, [&](int row) {
        const auto width = static_cast<std::size_t>(r.set.width),
                   first = static_cast<std::size_t>(row) * width;
        for (std::size_t pixel = first; pixel < first + width; ++pixel) {
            r.trace_light_walk(pass, pixel, walks[pixel]);
            walks[pixel].beams = {}; // photons know theirs
        }
    });
    return walks;
}

template <class Real>
Real weight_by_records(const renderer<Real>& r, const seen_path<Real>& path, mis::technique t) {
    return mis::weight(r.weigh.heuristic, r.weigh.counts, path.records, path.size, t) *
           static_cast<Real>(family_share(r.weigh.heuristic, path, t));
}

// Keeps a random `most` of all lines, of which `made` came before.
template <class Line>
void keep_some(std::vector<std::string>& lines, int most, std::int64_t made, pcg32& chance, Line&& line) {
    if (static_cast<int>(lines.size()) < most)
        lines.push_back(line());
    else if (const auto k = std::uniform_int_distribution<std::int64_t>(0, made)(chance); k < most)
        lines[static_cast<std::size_t>(k)] = line();
}

// One row of a pass, looked at.
template <class Real>
row_result<Real> render_row(const renderer<Real>& r, const settings<Real>& set, int pass, int row,
                            const photon_map<Real>* photons, const std::vector<walk<Real>>& light_walks) {
    row_result<Real> result;
    std::int64_t made = 0;
    pcg32 chance = r.generator(static_cast<std::uint64_t>(pass), ~static_cast<std::uint64_t>(row));
    const bool looks = looks_at_paths(r, set);
    const auto keep = [&](const contribution<Real>& made_by_renderer, const complete_path<Real>& complete) {
        weighed_contribution<Real> c{made_by_renderer, made_by_renderer.weight};
        if (looks) {
            const seen_path<Real> path = look_at(r, c, complete, light_walks);
            if (takes_whole_path(r))
                c.weight = c.right_weight = weight_by_records(r, path, c.technique);
            if (set.mistakes.any())
                c.weight = static_cast<Real>(mistaken_weight(set.mistakes, r, path, c.technique));
            if (set.balance_all)
                result.samples.push_back(balance(r, c, path));
            if (set.check_weights)
                check_weight(r, path, c.technique, c.right_weight, result.checks);
            keep_some(result.dump, set.dump_paths, made++, chance, [&] { return to_json_line(r, c, path); });
        }
        result.contributions.push_back(c);
    };
    r.render_row(pass, row, keep, photons);
    return result;
}

// Renders one pass.
template <class Real>
pass_result<Real> make_pass(const renderer<Real>& first, const settings<Real>& set, int pass) {
    std::vector<walk<Real>> light_walks;
    if (first.merges() && looks_at_paths(first, set))
        light_walks = trace_light_walks(first.at_pass(pass), pass);
    pass_result<Real> result{pass, std::vector<row_result<Real>>(static_cast<std::size_t>(set.width))};
    render_pass(first, pass, [&](const renderer<Real>& r, const photon_map<Real>* photons, int row) {
        result.rows[static_cast<std::size_t>(row)] = render_row(r, set, pass, row, photons, light_walks);
    });
    return result;
}

// Renders all passes; `on_pass` is given each in turn.
template <class Real, class OnPass>
void render(const scene<Real>& scene, const settings<Real>& set, OnPass&& on_pass) {
    const renderer<Real> first = make_renderer(scene, set);
    for (int pass = 0; pass < set.passes; ++pass)
        on_pass(make_pass(first, set, pass));
}

} // namespace lab
