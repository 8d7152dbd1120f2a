// The rendering loop: one camera walk and one light walk per pixel and pass, joined in every way. Where walks
// are merged, all light walks of a pass come first.
#pragma once

#include "film.hpp"
#include "learn.hpp"
#include "merge_media.hpp"
#include <stdexcept>

namespace bpt {

template <class Real> struct settings {
    int width = 128; // and height, in pixels
    int passes = 16; // samples per pixel
    int threads = static_cast<int>(std::thread::hardware_concurrency());
    int longest = longest_path; // the path's vertices in all
    std::uint64_t seed = 1;
    mis::technique_counts<Real> counts; // light walks per image: width * width. Caps end the walks
    Real merge_radius = 0;              // of the first pass: that of counts.merge, in the scene's units
    Real radius_alpha = 1;              // of mis::progressive_radius; 1: the radius stays
    bool merges_once = false;           // each camera walk ends where it can first be merged; weights are 1
    bool random_connection = false;
    media_merges<Real> media; // of the first pass
    bpt::roulette<Real> roulette;
    int learning_passes = 4; // before the first one, where rates are learned
};

// The renderer with all that stays the same from sample to sample. Heuristic: the library's or one's own.
template <class Real, class Heuristic = mis::balance_heuristic> struct renderer {
    using scalar = Real;
    using path_weights = weights_with_media<Heuristic, Real>;

    const bpt::scene<Real>& scene;
    settings<Real> set;
    path_weights weigh;
    double mean_light_vertices = 0;              // of light walks, for random connections; 0: all connections
    std::shared_ptr<bpt::learner<Real>> learner; // of rates, where they are learned

    renderer(const bpt::scene<Real>& s, const settings<Real>& settings, const Heuristic& heuristic = {})
        : scene(s), set(settings), weigh(heuristic, set.counts) {
        if (scene.environment >= 0 && scene.medium >= 0)
            throw std::runtime_error("scene '" + scene.name +
                                     "': no light of an environment comes through a medium without end");
        weigh.roulette = set.roulette;
        weigh.roulette.light_learns = !merges();
        if (set.random_connection)
            mean_light_vertices = measure_light_vertices();
        weigh = make_weights();
        if (is_learned(set.roulette.mode)) {
            learn_before_first_pass(*this);
            if (set.random_connection) // which now have other lengths
                mean_light_vertices = measure_light_vertices();
            weigh = make_weights();
        }
    }

    path_weights make_weights() const {
        const auto counts = set.random_connection
                                ? mis::random_connection(set.counts, static_cast<Real>(mean_light_vertices))
                                : set.counts;
        path_weights made = has_media(scene) ? path_weights(weigh.heuristic, counts, set.media)
                                             : path_weights(weigh.heuristic, counts);
        made.roulette = weigh.roulette;
        return made;
    }

    // The renderer of one pass: with the pass' radii, and with the weights that follow from them.
    renderer at_pass(int pass) const {
        renderer there = *this;
        const Real shrunk = mis::progressive_radius(Real(1), pass + 1, set.radius_alpha);
        there.set.merge_radius *= shrunk;
        there.set.counts.merge *= shrunk * shrunk;
        if (set.radius_alpha != Real(1))
            there.set.media = at_iteration(set.media, pass + 1);
        there.weigh = there.make_weights();
        return there;
    }

    pcg32 generator(std::uint64_t pass, std::uint64_t pixel) const {
        return {set.seed * 0x9e3779b9u + pass, pixel};
    }

    int longest_camera_walk() const { return std::min(set.longest, set.counts.max_camera_vertices); }
    int longest_light_walk() const { return std::min(set.longest - 1, set.counts.max_light_vertices); }

    bool merges() const { return set.counts.merge > Real(0) || (has_media(scene) && set.media.any()); }

    bool connects_light_walks() const {
        const auto& counts = weigh.counts;
        return counts.connection + counts.camera_connection + counts.direct > Real(0);
    }

    // The light walk of a pixel where walks merge, by a generator that the camera walks do not use: the same
    // whenever it is traced.
    void trace_light_walk(int pass, std::size_t pixel, walk<Real>& walk) const {
        const auto width = static_cast<std::size_t>(set.width);
        pcg32 rng = generator(static_cast<std::uint64_t>(pass), width * width + pixel);
        walk.leaves_beams = leaves_beams(set.media, pixel);
        walk_from_light(scene, weigh, longest_light_walk(), walk, rng);
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

    // Makes all paths of one row of one pass: sink(contribution, complete path). With photons, the light
    // walks are those that left them, traced anew where they have not been kept. With visits, these tell what
    // the row's walks have done.
    template <class Sink>
    void render_row(int pass, int row, Sink&& sink, const photon_map<Real>* photons = nullptr,
                    row_visits<Real>* visits = nullptr) const {
        sample_pair<Real, path_weights> pair{scene, weigh, set.width, 0, set.longest, {}, {}};
        const auto& counts = weigh.counts;
        const bool from_light = connects_light_walks();
        const bool from_camera =
            counts.light_hit + counts.next_event + counts.connection > Real(0) || merges();
        const auto weighed = [&](contribution<Real> c, const complete_path<Real>& path) {
            if (set.merges_once) // no path is made in two ways
                c.weight = 1;
            if (visits)
                visits->see(pair, c, path);
            sink(c, path);
        };
        const auto& learned = weigh.roulette.learned;
        if (visits) {
            visits->known = learned.get();
            visits->longest_camera_walk = longest_camera_walk();
            visits->longest_light_walk = longest_light_walk();
        }
        for (int column = 0; column < set.width; ++column) {
            pair.pixel = row * set.width + column;
            pcg32 rng = generator(static_cast<std::uint64_t>(pass), static_cast<std::uint64_t>(pair.pixel));
            const Real x = static_cast<Real>(column) + uniform<Real>(rng),
                       y = static_cast<Real>(row) + uniform<Real>(rng);
            const Real to_film = 2 / static_cast<Real>(set.width);
            pair.camera.clear();
            pair.light.clear();
            pair.camera.worth = learned ? learned->worth[static_cast<std::size_t>(pair.pixel)] : Real(1);
            pair.camera.leaves_beams = photons && photons->media && set.media.needs_camera_beams();
            if (from_camera)
                walk_from_camera(scene, weigh, set.width, x * to_film - 1, 1 - y * to_film,
                                 {longest_camera_walk(), set.merges_once}, pair.camera, rng);
            if (from_light && photons && photons->media)
                pair.light = photons->media->walks[static_cast<std::size_t>(pair.pixel)];
            else if (from_light && photons)
                trace_light_walk(pass, static_cast<std::size_t>(pair.pixel), pair.light);
            else if (from_light)
                walk_from_light(scene, weigh, longest_light_walk(), pair.light, rng);
            connect_all(pair, rng, weighed, [&](const vertex<Real>& end) {
                connect_to_own(pair, end, set.random_connection, rng, weighed);
            });
            if (photons)
                merge_all(pair, *photons, set.merge_radius, weighed);
            if (photons && photons->media)
                merge_all_in_media(pair, *photons->media, weighed);
            if (visits)
                visits->end(pair);
        }
    }
};

// One pass of a renderer as it is: row(renderer, photons, row number) is called for each row, in parallel.
template <class Real, class Heuristic, class Row>
void render_rows(const renderer<Real, Heuristic>& renderer, int pass, Row&& row) {
    std::optional<photon_map<Real>> photons;
    if (renderer.merges()) {
        auto left = trace_all_light_walks(renderer, pass);
        photons.emplace(concatenated(left, &left_by_light<Real>::photons));
        if (has_media(renderer.scene))
            photons->media = make_media_map(left, renderer.set.media, renderer.scene.radius);
    }
    in_parallel(renderer.set.threads, renderer.set.width,
                [&](int i) { row(renderer, photons ? &*photons : nullptr, i); });
}
// One pass, with its radii.
template <class Real, class Heuristic, class Row>
void render_pass(const renderer<Real, Heuristic>& first, int pass, Row&& row) {
    render_rows(first.at_pass(pass), pass, row);
}

// What a pass has made, row by row.
template <class Real> struct pass_rows {
    std::vector<std::vector<contribution<Real>>> contributions;
    std::vector<row_visits<Real>> visits;

    explicit pass_rows(int width)
        : contributions(static_cast<std::size_t>(width)), visits(contributions.size()) {}

    // For render_rows() and render_pass(). Where somebody learns from it: from every so many-th row.
    auto keep(int pass, bool learns, int step = 1) {
        return [this, pass, learns, step](const auto& renderer, const photon_map<Real>* photons, int row) {
            const auto i = static_cast<std::size_t>(row);
            visits[i].keeps_visits = row % step == pass % step;
            const auto add = [&](const contribution<Real>& c, const complete_path<Real>&) {
                contributions[i].push_back(c);
            };
            renderer.render_row(pass, row, add, photons, learns ? &visits[i] : nullptr);
        };
    }
    // f(pixel, weighted value), in the order of the rows.
    template <class F> void for_each(F&& f) const {
        for (const auto& row : contributions)
            for (const auto& c : row)
                f(static_cast<std::size_t>(c.pixel), glm::dvec3(c.value) * static_cast<double>(c.weight));
    }
};

// Of passes of the image: every fourth row teaches enough, and takes a quarter of the time.
constexpr int rows_to_learn_from = 4;

// What one more pass teaches the renderer.
template <class Real, class Heuristic>
void learn(renderer<Real, Heuristic>& renderer, const pass_rows<Real>& rows) {
    const auto width = static_cast<std::size_t>(renderer.set.width);
    std::vector<double> image(width * width);
    rows.for_each([&](std::size_t pixel, const glm::dvec3& value) { image[pixel] += brightness(value); });
    renderer.weigh.roulette.learned = renderer.learner->add(rows.visits, image);
}

// Passes that are no part of the image, with random numbers of their own.
template <class Real, class Heuristic> void learn_before_first_pass(renderer<Real, Heuristic>& renderer) {
    const auto& set = renderer.set;
    renderer.learner = std::make_shared<learner<Real>>(renderer.scene, renderer.weigh.roulette, set.width,
                                                       set.counts.next_event);
    renderer.weigh.roulette.tries_copies = true;
    for (int k = 0; k < set.learning_passes; ++k) {
        pass_rows<Real> rows(set.width);
        render_rows(renderer, -2 - k, rows.keep(-2 - k, true));
        learn(renderer, rows);
    }
    renderer.weigh.roulette.tries_copies = false;
}

// The next pass, added to the film: row by row, so that the image is the same for any number of threads.
// Rates that are learned are those of all passes before.
template <class Real, class Heuristic> void add_pass(renderer<Real, Heuristic>& first, film& film) {
    pass_rows<Real> rows(film.sum.width);
    render_pass(first, film.passes, rows.keep(film.passes, first.learner != nullptr, rows_to_learn_from));
    rows.for_each([&](std::size_t pixel, const glm::dvec3& value) { film.sum.pixels[pixel] += value; });
    ++film.passes;
    if (first.learner)
        learn(first, rows);
}

} // namespace bpt
