// Connections that are picked by an importance, and a Metropolis chain that weighs with its acceptance: the
// recursion's weights against products over the whole path, and images against those of plain bidirectional
// path tracing.
#include <doctest/doctest.h>
#include <lab/path.hpp>
#include <mutex>
#include <studies/block_means.hpp>
#include <studies/exchange_chain.hpp>
#include <studies/picked_connections.hpp>

namespace {

using real = double;
using namespace studies;

constexpr int width = 16;

bpt::settings<real> settings_of(std::uint64_t seed) {
    bpt::settings<real> set;
    set.width = width;
    set.threads = 2;
    set.seed = seed;
    set.counts = mis::bidirectional(static_cast<real>(width * width));
    return set;
}

// The expected number of connections over their usual one, of the edge between x_{i-1} and x_i; by the table
// and the places alone.
template <class Renderer> real over_mean(const Renderer& r, const lab::seen_path<real>& path, int i) {
    const auto cell = [&](int k) {
        auto x = path[k];
        x.towards_previous = path.to_camera[k]; // whichever walk has made it
        return r.cells(x);
    };
    return r.table(cell(i - 1), cell(i));
}

} // namespace

TEST_CASE("weights are those of densities that are multiplied by each connection's expected number") {
    const std::array<double, 2> betas{1, 2};
    for (const char* name : {"cornell", "mixed", "milk", "doorway"})
        for (const double beta : betas) {
            const auto scene = bpt::make_scene<real>(name);
            picking_renderer renderer(scene, settings_of(3), pick_options{},
                                      mis::power_heuristic<real>{beta});
            for (int pass = 0; pass < 4; ++pass) // so that something is learned
                renderer.render_pass([](int, const auto&, const auto&) {});
            double least = 1, largest = 1;
            for (const real x : renderer.table.over_mean)
                least = std::min(least, x), largest = std::max(largest, x);
            CHECK(least < 0.8);
            CHECK(largest > 2);

            std::mutex only_one;
            double error = 0;
            int connections = 0, others = 0;
            renderer.render_pass(
                [&](int, const bpt::contribution<real>& c, const bpt::complete_path<real>& complete) {
                    const auto path = lab::look_at(scene, width, complete);
                    const int n = path.size;
                    double q[mis::technique_count(bpt::longest_path)];
                    mis::relative_densities(renderer.weigh.counts, path.records, n, q);
                    for (int s = 2; s <= n - 2; ++s)
                        q[s] *= over_mean(renderer, path, s);
                    mis::weights(mis::power_heuristic<real>{beta}, q, mis::technique_count(n), q);
                    const double exact = q[mis::technique_index(n, c.technique)];
                    const std::lock_guard lock(only_one);
                    error = std::max(error, std::abs(c.weight - exact) / exact);
                    (c.technique.kind == mis::technique_kind::connection ? connections : others) += n > 3;
                });
            CAPTURE(name);
            CAPTURE(beta);
            CHECK(error < 1e-7);
            CHECK(connections > 50);
            CHECK(others > 50);
        }
}

namespace {

// Largest differences of blocks and of whole images in standard errors: of runs that know nothing of each
// other, against plain bidirectional path tracing with the power heuristic. Were the runs' means normal, one
// of the 272 differences would be above 6 by chance in 3 of 10,000 programs, by Student's t of 31 degrees.
// Seeds are fixed.
constexpr int runs = 32, passes = 8;
constexpr double most_apart = 6;

block_means plain_blocks(const bpt::scene<real>& scene) {
    block_means blocks;
    for (int run = 0; run < runs; ++run) {
        parts sum(width);
        sum.shortest = 3;
        const bpt::renderer renderer(scene, settings_of(1000 + static_cast<std::uint64_t>(run)),
                                     mis::power_heuristic<>{});
        while (sum.passes < passes)
            add_pass(renderer, sum);
        blocks.add(mean_image(sum));
    }
    return blocks;
}

} // namespace

TEST_CASE("images of picked connections are those of all connections") {
    for (const char* name : {"doorway", "milk"}) {
        const auto scene = bpt::make_scene<real>(name);
        const block_means expected = plain_blocks(scene);
        for (const auto& way : {std::pair(false, true), std::pair(true, false), std::pair(true, true)}) {
            const bool learns = way.first, weights_know = way.second;
            block_means blocks;
            for (int run = 0; run < runs; ++run) {
                pick_options options;
                options.learns = learns;
                options.weights_know = weights_know;
                options.first_walks = 500;
                auto set = settings_of(static_cast<std::uint64_t>(run));
                set.counts.camera_connection = 0; // leaves more to connections
                picking_renderer renderer(scene, set, options, mis::balance_heuristic{});
                parts sum(width);
                sum.shortest = 3;
                while (sum.passes < passes)
                    add_pass(renderer, sum);
                blocks.add(mean_image(sum));
            }
            CAPTURE(name);
            CAPTURE(learns);
            CAPTURE(weights_know);
            CHECK(largest_difference(blocks, expected) < most_apart);
        }
    }
}

TEST_CASE("images of a chain are those of independent pairs, however it is weighed") {
    for (const char* name : {"doorway", "glossy"}) {
        const auto scene = bpt::make_scene<real>(name);
        const block_means expected = plain_blocks(scene);
        std::array<block_means, chain_estimates> blocks;
        for (int run = 0; run < runs; ++run) {
            const bpt::renderer renderer(scene, settings_of(static_cast<std::uint64_t>(run)),
                                         mis::balance_heuristic{});
            // Chains of 8 steps, so that it would be seen if they started anywhere.
            const auto found =
                exchange_chain(renderer, {width * width, 0.25}, 3).run(8, static_cast<std::uint64_t>(run));
            for (std::size_t e = 0; e < chain_estimates; ++e)
                blocks[e].add(found.images[e]);
        }
        for (std::size_t e = 0; e < chain_estimates; ++e) {
            CAPTURE(name);
            CAPTURE(e);
            CHECK(largest_difference(blocks[e], expected) < most_apart);
        }
    }
}
