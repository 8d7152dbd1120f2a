// The reference renderer: its techniques agree on every scene and path length, and its weights with each other.
#include <array>
#include <doctest/doctest.h>
#include <render.hpp>

namespace {

using real = double;
using namespace bpt;

constexpr int width = 32, blocks_across = 4, blocks = blocks_across * blocks_across;
constexpr int batches = 32, passes_per_batch = 4;

// Which paths a set of techniques can make, told by the path alone.
bool can_make(const mis::technique_counts<real>& counts, const contribution<real>& c) {
    return (counts.light_hit > 0 && c.light_can_be_hit) ||
           (counts.next_event > 0 && c.vertices > 2 && c.light_can_be_joined) ||
           (counts.connection > 0) || (counts.camera_connection > 0 && c.vertices > 2 && c.camera_can_be_joined) ||
           (counts.direct > 0 && c.vertices == 2 && c.light_can_be_hit);
}

// Sums of the image's blocks, and of all of it, for each path length, batch by batch.
struct measurement {
    double sum[longest_path + 1][blocks + 1][batches] = {};

    void add(int batch, const contribution<real>& c) {
        const int x = c.pixel % width * blocks_across / width, y = c.pixel / width * blocks_across / width;
        const double value = bpt::sum(c.value) * c.weight;
        sum[c.vertices][y * blocks_across + x][batch] += value;
        sum[c.vertices][blocks][batch] += value;
    }
};

struct moments {
    double mean = 0, variance_of_mean = 0;
};
moments moments_of(const double (&samples)[batches]) {
    moments m;
    for (const double x : samples)
        m.mean += x / batches;
    for (const double x : samples)
        m.variance_of_mean += (x - m.mean) * (x - m.mean) / (batches - 1) / batches;
    return m;
}

settings<real> settings_for(const mis::technique_counts<real>& counts, heuristic_kind heuristic, std::uint64_t seed) {
    settings<real> s;
    s.width = width;
    s.passes = batches * passes_per_batch;
    s.counts = counts;
    s.heuristic = {heuristic, heuristic == heuristic_kind::cutoff ? 0.1 : 2.0};
    s.seed = seed;
    s.check_weights = false;
    return s;
}

// Renders, and measures the paths that each of `subsets` can make as well.
template <std::size_t N>
std::array<measurement, N> measure(const scene<real>& scene, const settings<real>& settings,
                                   const std::array<mis::technique_counts<real>, N>& subsets) {
    std::array<measurement, N> measured;
    render(scene, settings, [&](const pass_result<real>& result) {
        for (const auto& row : result.rows)
            for (const auto& c : row.contributions)
                for (std::size_t k = 0; k < N; ++k)
                    if (can_make(subsets[k], c))
                        measured[k].add(result.pass / passes_per_batch, c);
    });
    return measured;
}

// The greatest |z| of the differences of two measurements, over all path lengths, blocks and the whole image.
struct comparison {
    double greatest = 0;
    int compared = 0;
};
comparison compare(const measurement& a, const measurement& b) {
    comparison c;
    for (int n = 2; n <= longest_path; ++n)
        for (int block = 0; block <= blocks; ++block) {
            const moments x = moments_of(a.sum[n][block]), y = moments_of(b.sum[n][block]);
            const double variance = x.variance_of_mean + y.variance_of_mean;
            const double z = variance > 0 ? std::abs(x.mean - y.mean) / std::sqrt(variance) : 0;
            CHECK((variance > 0 || x.mean == y.mean));
            c.greatest = std::max(c.greatest, z);
            ++c.compared;
        }
    return c;
}

// 7 scenes times 10 comparisons times 153 numbers: 10,710 values of z, each of a t distribution with 31 to 62 degrees
// of freedom. |t| > 7.5 has a probability of at most 1.9e-8 (31 degrees), so all of them together raise a false alarm
// with a probability below 2e-4 if batch means are normal.
constexpr double threshold = 7.5;

void check_agreement(const char* what, const measurement& a, const measurement& b) {
    const comparison c = compare(a, b);
    MESSAGE(std::string(what), ": greatest |z| of ", c.compared, " is ", c.greatest);
    CHECK(c.greatest < threshold);
}

void check_scene(const std::string& name) {
    const scene<real> scene = make_scene<real>(name);
    const real pixels = width * width;
    const auto all = mis::bidirectional(pixels);
    const std::array<mis::technique_counts<real>, 4> subsets{mis::path_tracing<real>(),
                                                             mis::path_tracing_next_event<real>(),
                                                             mis::light_tracing(pixels), all};
    const char* const names[] = {"path tracing", "path tracing with next event", "light tracing"};
    const auto expected = measure(scene, settings_for(all, heuristic_kind::balance, 1), subsets);
    for (std::size_t k = 0; k < 3; ++k) {
        const auto alone = measure<1>(scene, settings_for(subsets[k], heuristic_kind::balance, 2 + k), {all});
        check_agreement(names[k], alone[0], expected[k]);
    }
    for (const auto kind : {heuristic_kind::power, heuristic_kind::maximum, heuristic_kind::average, heuristic_kind::cutoff}) {
        const auto other = measure<1>(scene, settings_for(all, kind, 10 + static_cast<std::uint64_t>(kind)), {all});
        check_agreement(name_of(kind), other[0], expected[3]);
    }
    {
        auto random = settings_for(all, heuristic_kind::power, 20);
        random.random_connection = true;
        check_agreement("random connections", measure<1>(scene, random, {all})[0], expected[3]);
    }
    {
        auto no_roulette = scene;
        for (auto& m : no_roulette.materials)
            m.survival = 1;
        const auto other = measure<1>(no_roulette, settings_for(all, heuristic_kind::power, 21), {all});
        check_agreement("no roulette", other[0], expected[3]);
    }
    {
        auto with_direct = all;
        with_direct.direct = pixels;
        const auto other = measure<1>(scene, settings_for(with_direct, heuristic_kind::power, 22), {all});
        check_agreement("with direct", other[0], expected[3]);
    }
}

} // namespace

TEST_CASE("all techniques, heuristics and modes agree: cornell") { check_scene("cornell"); }
TEST_CASE("all techniques, heuristics and modes agree: spheres") { check_scene("spheres"); }
TEST_CASE("all techniques, heuristics and modes agree: glossy") { check_scene("glossy"); }
TEST_CASE("all techniques, heuristics and modes agree: smooth") { check_scene("smooth"); }
TEST_CASE("all techniques, heuristics and modes agree: environment") { check_scene("environment"); }
TEST_CASE("all techniques, heuristics and modes agree: point") { check_scene("point"); }
TEST_CASE("all techniques, heuristics and modes agree: lens") { check_scene("lens"); }
