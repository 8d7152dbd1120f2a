// A Metropolis chain over pairs of a camera walk and a light walk, all of whose techniques are weighed as in
// bidirectional path tracing. A proposal exchanges one walk, or both, for a new one; it is accepted with the
// probability a = min(1, T' / T), T being the brightness of all that a pair brings to the image. States then
// have the density T / b over that of independent pairs, b being the mean of T. What a pair brings is thus
// multiplied by b / T, and, where nothing is to be left to chance, the proposal's by a and the present
// state's by 1 - a: multipliers of throughputs, which [J] 4 asks to be told to the weights.
#pragma once

#include "render_parts.hpp"
#include <algorithm>

namespace studies {

// Images of the same pairs.
enum chain_estimate : std::size_t {
    counted,           // states as they are: proposals count where they are accepted
    by_acceptance,     // proposals count a, present states 1 - a
    combined_unaware,  // that, and new pairs as independent samples; weights of T = b
    combined,          // weights that are told b / T, [J] 4
    combined_distinct, // and that of the states only the part that is accepted is new
    chain_estimates
};

struct chain_options {
    int chains = 16;    // on the image
    double both = 0.25; // probability of exchanging both walks; else one of them
};

// How many proposals of each kind there were, and how many are accepted.
struct exchange_counts {
    std::array<double, 3> proposed{}, accepted{}; // of a camera walk, a light walk, both
};

struct chain_images {
    std::array<bpt::image, chain_estimates> images;
    exchange_counts exchanges;

    explicit chain_images(int width) { images.fill(bpt::black(width)); }
};

template <class Real, class Heuristic> class exchange_chain {
public:
    exchange_chain(const bpt::renderer<Real, Heuristic>& r, const chain_options& o, int shortest_path)
        : renderer(r), options(o), shortest(shortest_path), width(static_cast<std::size_t>(r.set.width)) {}

    // Images of passes * width² steps in all, after two passes that find out how bright the image is and
    // where chains start. Unbiased for any number of steps: a chain's start is picked by T from independent
    // pairs, and their mean T is what it is multiplied with. The brightness that the weights are told is that
    // of the first pass, which has no other use.
    chain_images run(int passes, std::uint64_t seed) const {
        const std::size_t pixels = width * width;
        std::vector<double> targets(2 * pixels);
        bpt::in_parallel(renderer.set.threads, static_cast<int>(2 * width), [&](int row) {
            for (std::size_t i = 0; i < width; ++i) {
                const std::size_t k = static_cast<std::size_t>(row) * width + i;
                targets[k] = new_pair(seed, k).target;
            }
        });
        const auto second = targets.begin() + static_cast<std::ptrdiff_t>(pixels);
        const double told = std::accumulate(targets.begin(), second, 0.0) / static_cast<double>(pixels);
        // Of exchanges of both walks: the mean of min(1, T' / T) over states, which are as T.
        double acceptance = 0;
        for (std::size_t k = 0; k + 1 < pixels; ++k)
            acceptance += std::min(targets[k], targets[k + 1]) / (told * static_cast<double>(pixels - 1));
        std::vector<double> sums(pixels);
        std::partial_sum(second, targets.end(), sums.begin());
        const double brightness = sums.back() / static_cast<double>(pixels);

        std::vector<chain_images> parts(static_cast<std::size_t>(options.chains),
                                        chain_images(renderer.set.width));
        const auto all_steps = static_cast<std::size_t>(passes) * pixels;
        bpt::in_parallel(renderer.set.threads, options.chains, [&](int c) {
            pcg32 rng(seed, ~static_cast<std::uint64_t>(c));
            const double x =
                std::min(bpt::uniform<double>(rng) * sums.back(), std::nextafter(sums.back(), 0.0));
            const auto start = std::upper_bound(sums.begin(), sums.end(), x) - sums.begin();
            const auto chains = static_cast<std::size_t>(options.chains), i = static_cast<std::size_t>(c);
            const std::size_t steps = all_steps * (i + 1) / chains - all_steps * i / chains;
            walk_chain(
                new_pair(seed, pixels + static_cast<std::size_t>(start)), steps,
                {told, acceptance, brightness, static_cast<double>(pixels) / static_cast<double>(all_steps)},
                rng, parts[i]);
        });
        chain_images sum(renderer.set.width);
        for (const chain_images& part : parts) {
            for (std::size_t e = 0; e < chain_estimates; ++e)
                for (std::size_t i = 0; i < pixels; ++i)
                    sum.images[e].pixels[i] += part.images[e].pixels[i];
            for (std::size_t k = 0; k < 3; ++k) {
                sum.exchanges.proposed[k] += part.exchanges.proposed[k];
                sum.exchanges.accepted[k] += part.exchanges.accepted[k];
            }
        }
        return sum;
    }

private:
    using pair_of_walks = bpt::sample_pair<Real, typename bpt::renderer<Real, Heuristic>::path_weights>;

    // A state, and what it brings: one pass of the image is the sum of width² independent ones.
    struct pair {
        pair_of_walks walks;
        std::vector<std::pair<std::size_t, glm::dvec3>> splats;
        double target = 0; // T: the sum of all channels
    };
    struct scale {
        double told, acceptance; // b, and the mean acceptance of new pairs, as the weights are told
        double brightness;       // b as it is
        double per_step;         // passes
    };

    void take_camera_walk(pair& p, pcg32& rng) const {
        const Real x = bpt::uniform<Real>(rng), y = bpt::uniform<Real>(rng);
        const auto index = [&](Real u) {
            return std::min(static_cast<int>(u * static_cast<Real>(width)), static_cast<int>(width) - 1);
        };
        p.walks.pixel = index(y) * static_cast<int>(width) + index(x);
        p.walks.camera.clear();
        bpt::walk_from_camera(renderer.scene, renderer.weigh, renderer.set.width, 2 * x - 1, 1 - 2 * y,
                              {renderer.longest_camera_walk(), false}, p.walks.camera, rng);
    }
    void take_light_walk(pair& p, pcg32& rng) const {
        p.walks.light.clear();
        bpt::walk_from_light(renderer.scene, renderer.weigh, renderer.longest_light_walk(), p.walks.light,
                             rng);
    }
    void join(pair& p, pcg32& rng) const {
        p.splats.clear();
        p.target = 0;
        const auto keep = [&](const bpt::contribution<Real>& c, const bpt::complete_path<Real>&) {
            if (c.vertices < shortest)
                return;
            const glm::dvec3 value = glm::dvec3(c.value) * static_cast<double>(c.weight);
            p.splats.emplace_back(static_cast<std::size_t>(c.pixel), value);
            p.target += value.x + value.y + value.z;
        };
        bpt::connect_all(p.walks, rng, keep, [&](const bpt::vertex<Real>& x) {
            bpt::connect_to_own(p.walks, x, false, rng, keep);
        });
    }
    // An independent one, by number.
    pair new_pair(std::uint64_t seed, std::size_t number) const {
        pcg32 rng(seed, number);
        pair p{{renderer.scene, renderer.weigh, renderer.set.width, 0, renderer.set.longest, {}, {}}, {}, 0};
        take_camera_walk(p, rng);
        take_light_walk(p, rng);
        join(p, rng);
        return p;
    }

    static void add(bpt::image& image, const pair& p, double factor) {
        for (const auto& [pixel, value] : p.splats)
            image.pixels[pixel] += factor * value;
    }

    void walk_chain(pair present, std::size_t steps, const scale& s, pcg32& rng, chain_images& to) const {
        pair proposal = present;
        for (std::size_t step = 0; step < steps; ++step) {
            const double u = bpt::uniform<double>(rng);
            const std::size_t kind = u < options.both ? 2 : u < (1 + options.both) / 2 ? 1 : 0;
            proposal.walks.pixel = present.walks.pixel;
            if (kind != 1)
                take_camera_walk(proposal, rng);
            else
                proposal.walks.camera = present.walks.camera;
            if (kind != 0)
                take_light_walk(proposal, rng);
            else
                proposal.walks.light = present.walks.light;
            join(proposal, rng);
            const double acceptance = std::min(1.0, proposal.target / present.target);
            const bool accepted = bpt::uniform<double>(rng) < acceptance;
            to.exchanges.proposed[kind] += 1;
            to.exchanges.accepted[kind] += accepted;
            add_step(present, proposal, kind == 2, acceptance, accepted, s, to);
            if (accepted)
                std::swap(present.splats, proposal.splats), std::swap(present.target, proposal.target),
                    std::swap(present.walks.camera, proposal.walks.camera),
                    std::swap(present.walks.light, proposal.walks.light),
                    std::swap(present.walks.pixel, proposal.walks.pixel);
        }
    }

    void add_step(const pair& present, const pair& proposal, bool is_new, double acceptance, bool accepted,
                  const scale& s, chain_images& to) const {
        // A state's share of the image, per unit of its brightness.
        const auto of_chain = [&](const pair& p) { return s.brightness * s.per_step / p.target; };
        // Weights of the chain against new pairs, of which there are `both` in each step. Relative to their
        // density the chain's is T / b, or 1 where that is not told.
        const double constant = mis::balance(1.0, options.both);
        const auto weight = [&](const pair& p, double part) {
            return mis::balance(part * p.target / s.told, options.both);
        };
        const auto add_state = [&](const pair& p, double probability) {
            if (!(probability > 0))
                return;
            const double share = of_chain(p) * probability;
            add(to.images[by_acceptance], p, share);
            add(to.images[combined_unaware], p, share * constant);
            add(to.images[combined], p, share * weight(p, 1));
            add(to.images[combined_distinct], p, share * weight(p, s.acceptance));
        };
        const pair& next = accepted ? proposal : present;
        add(to.images[counted], next, of_chain(next));
        add_state(proposal, acceptance);
        add_state(present, 1 - acceptance);
        if (is_new) {
            const double share = s.per_step / options.both;
            add(to.images[combined_unaware], proposal, share * (1 - constant));
            add(to.images[combined], proposal, share * (1 - weight(proposal, 1)));
            add(to.images[combined_distinct], proposal, share * (1 - weight(proposal, s.acceptance)));
        }
    }

    const bpt::renderer<Real, Heuristic>& renderer;
    chain_options options;
    int shortest;
    std::size_t width;
};

} // namespace studies
