// The reference renderer's optimal weights: they are the weights of the formula, and change no image in the
// mean.
#include <bpt/algorithms.hpp>
#include <doctest/doctest.h>
#include <lab/optimal.hpp>
#include <lab/render.hpp>

namespace {

using real = double;
using namespace lab;
using lab::renderer, lab::settings;

constexpr int width = 16, tile = 4, tiles = width / tile * (width / tile);

settings<real> settings_for(const scene<real>& scene, const char* algorithm, int passes, std::uint64_t seed) {
    settings<real> s;
    s.width = width;
    s.passes = passes;
    s.seed = seed;
    s.check_weights = false;
    s.balance_all = true;
    s.merge_radius = real(0.03) * scene.radius;
    s.counts = algorithms<real>(width * width, s.merge_radius).at(algorithm).counts;
    return s;
}
optimal_weights weights_for(const settings<real>& s) { return {s.counts, s.merge_radius, width, tile}; }

// Calls f(samples) for all passes.
template <class F> void for_each_pass(const scene<real>& scene, const settings<real>& s, F&& f) {
    render(scene, s, [&](const pass_result<real>& result) {
        for (const auto& row : result.rows)
            for (const auto& sample : row.samples)
                f(sample, false);
        f(balanced_sample{}, true);
    });
}

optimal_weights trained(const scene<real>& scene, const char* algorithm, int passes) {
    const auto s = settings_for(scene, algorithm, passes, 1);
    optimal_weights weights = weights_for(s);
    for_each_pass(scene, s, [&](const balanced_sample& sample, bool ends) {
        ends ? weights.end_pass() : void(weights.add(sample));
    });
    weights.solve(2);
    return weights;
}

// What optimal weights add to balance's in a tile and length, pass by pass.
struct difference {
    double sum = 0, square = 0, in_pass = 0;
    int passes_with_any = 0;

    void end_pass() {
        sum += in_pass;
        square += in_pass * in_pass;
        passes_with_any += in_pass != 0;
        in_pass = 0;
    }
    double z(int passes) const {
        const double variance = square - sum * sum / passes;
        return variance > 0 ? sum / std::sqrt(variance) : 0;
    }
};

} // namespace

// Coefficients from some passes, means from others: at most 9 lengths, 16 tiles and 4 scenes. Of a normal
// variable, |z| above 6 has a probability of 2e-9; sums of 400 passes are near enough to normal where at
// least 100 of them are not 0, and heavier tails make z smaller. A false alarm has a probability below 1e-5.
TEST_CASE("optimal weights leave the mean as it is, for every length and tile") {
    for (const std::string name : {"cornell", "spheres", "environment", "mixed"}) {
        const scene<real> scene = make_scene<real>(name);
        optimal_weights weights = trained(scene, "bpt", 32);
        constexpr int passes = 400;
        std::array<std::array<difference, tiles>, longest_path + 1> differences;
        double change = 0, all = 0;
        for_each_pass(scene, settings_for(scene, "bpt", passes, 2), [&](const balanced_sample& x, bool ends) {
            if (ends) {
                for (auto& length : differences)
                    for (auto& d : length)
                        d.end_pass();
                return;
            }
            const glm::dvec3 added = weights.add(x) - x.value;
            differences[static_cast<std::size_t>(x.vertices)][weights.tile_of(x.pixel)].in_pass +=
                added.x + added.y;
            change += std::abs(added.x), all += std::abs(x.value.x);
        });
        double greatest = 0;
        int compared = 0;
        for (const auto& length : differences)
            for (const auto& d : length)
                if (d.passes_with_any >= 100) {
                    greatest = std::max(greatest, std::abs(d.z(passes)));
                    ++compared;
                }
        MESSAGE(name, ": greatest |z| of ", compared, " is ", greatest);
        CHECK(compared > 20);
        CHECK(greatest < 6);
        CHECK(change > 0.02 * all); // not just balance
    }
}

TEST_CASE("the direct estimate is the sum of alpha, and that of the samples by its own weights") {
    for (const char* const algorithm : {"bpt", "ups"}) {
        const scene<real> scene = make_scene<real>("mixed");
        const auto s = settings_for(scene, algorithm, 24, 3);
        optimal_weights weights = weights_for(s);
        std::vector<balanced_sample> samples;
        for_each_pass(scene, s, [&](const balanced_sample& sample, bool ends) {
            if (ends)
                return weights.end_pass();
            weights.add(sample);
            samples.push_back(sample);
        });
        const auto direct = weights.integrals(2);
        weights.solve(2);
        std::vector<glm::dvec3> sums(tiles), balance(tiles);
        for (const auto& sample : samples) {
            const std::size_t t = weights.tile_of(sample.pixel);
            sums[t] += weights.add(sample) / double(tile * tile * s.passes);
            balance[t] += sample.value / double(tile * tile * s.passes);
        }
        double apart = 0, from_balance = 0;
        for (std::size_t t = 0; t < tiles; ++t) {
            const double scale = balance[t].x + balance[t].y + balance[t].z;
            apart = std::max(apart, glm::length(sums[t] - direct[t]) / scale);
            from_balance = std::max(from_balance, glm::length(balance[t] - direct[t]) / scale);
        }
        CAPTURE(algorithm);
        CHECK(apart < 1e-7);
        CHECK(from_balance > 1e-4);
    }
}

TEST_CASE("tiles need not divide the image") {
    const scene<real> scene = make_scene<real>("cornell");
    const auto s = settings_for(scene, "bpt", 1, 4);
    const optimal_weights weights(s.counts, s.merge_radius, width, 5);
    CHECK(weights.tiles_in_row() == 4);
    double pixels = 0;
    for (std::size_t t = 0; t < 16; ++t)
        pixels += weights.pixels_of(t);
    CHECK(pixels == width * width);
    CHECK(weights.pixels_of(weights.tile_of(width * width - 1)) == 1);
    CHECK(weights.tile_of(14) == 2);
    CHECK(weights.tile_of(15) == 3);
}
