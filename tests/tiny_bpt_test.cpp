// SPDX-License-Identifier: MIT
// The renderer of one file: whatever techniques it has, it finds the same light, per path length and block of
// the image. Its own check of complete paths is on, whatever the build.
#undef NDEBUG
#define main tiny_bpt_main
#include "../examples/tiny_bpt.cpp" // NOLINT(bugprone-suspicious-include): it is a program
#undef main
#include <doctest/doctest.h>
#include <functional>
#include <string>

namespace {

constexpr std::size_t width = 24, height = 16, block_size = 8;
constexpr std::size_t blocks = width * height / (block_size * block_size);
constexpr float pixels = width * height;
constexpr int batches = 40;

std::size_t block_of(std::size_t pixel) {
    return pixel / width / block_size * (width / block_size) + pixel % width / block_size;
}

// The light of one path length in one block, or of several such: one mean per batch of passes.
struct cell {
    std::array<double, batches> light{};

    void add(const cell& other) {
        for (std::size_t i = 0; i < batches; ++i)
            light[i] += other.light[i];
    }
    double mean() const { return std::accumulate(light.begin(), light.end(), 0.0) / batches; }
    double variance_of_mean() const {
        double squares = 0;
        for (const double x : light)
            squares += (x - mean()) * (x - mean());
        return squares / (batches - 1) / batches;
    }
    // Worth at least 64 independent events.
    bool is_well_sampled() const { return mean() > 0 && mean() * mean() >= 64 * variance_of_mean(); }
};
using measurement = std::array<std::array<cell, blocks>, longest_path + 1>;

cell whole(const std::array<cell, blocks>& all) {
    cell sum;
    for (const cell& c : all)
        sum.add(c);
    return sum;
}

// A way of rendering: adds one pass to an image.
struct estimator {
    std::string name;
    int passes_per_batch;
    std::function<void(long long, film&)> add_pass;
    double bias = 0;          // that it may have, relative
    std::size_t shortest = 2; // path that it can make
};

estimator with_counts(const char* name, int passes_per_batch, const scene& s,
                      const mis::technique_counts<float>& counts, float radius = 0) {
    return {name, passes_per_batch, [&s, counts, radius](long long pass, film& image) {
                join_walks(s, counts, radius, pass, image);
            }};
}

// Each estimator has passes, and so random numbers, of its own.
measurement render(const estimator& e, long long number) {
    measurement m{};
    for (std::size_t batch = 0; batch < batches; ++batch) {
        film image(width * height);
        const long long first = 1'000'000 * number + static_cast<long long>(batch) * e.passes_per_batch;
        for (int i = 0; i < e.passes_per_batch; ++i)
            e.add_pass(first + i, image);
        for (std::size_t pixel = 0; pixel < image.size(); ++pixel)
            for (std::size_t n = 2; n <= longest_path; ++n)
                m[n][block_of(pixel)].light[batch] +=
                    static_cast<double>(sum(image[pixel][n])) / e.passes_per_batch;
    }
    return m;
}

struct comparison {
    double bias = 0, greatest = 0;
    int compared = 0;

    void compare(const cell& a, const cell& b) {
        const double difference = std::max(0.0, std::abs(a.mean() - b.mean()) - bias * b.mean());
        greatest = std::max(greatest, difference / std::sqrt(a.variance_of_mean() + b.variance_of_mean()));
        ++compared;
    }
};

// Each path length over the whole image and, where there are enough samples, in each block. Lengths that are
// too sparse are compared in one sum.
comparison compare(const estimator& e, const measurement& measured, const measurement& expected) {
    comparison c;
    c.bias = e.bias;
    cell measured_rest, expected_rest;
    for (std::size_t n = e.shortest; n <= longest_path; ++n) {
        for (std::size_t block = 0; block < blocks; ++block)
            if (measured[n][block].is_well_sampled() && expected[n][block].is_well_sampled())
                c.compare(measured[n][block], expected[n][block]);
        const cell m = whole(measured[n]), x = whole(expected[n]);
        if (m.is_well_sampled() && x.is_well_sampled()) {
            c.compare(m, x);
        } else {
            measured_rest.add(m);
            expected_rest.add(x);
        }
    }
    if (measured_rest.mean() > 0 && expected_rest.mean() > 0)
        c.compare(measured_rest, expected_rest);
    return c;
}

// The program's scene with a lamp nine times as large and as dim. Of the small one path tracing finds so
// little, and so rarely, that the few events in a test say nothing of their variance.
scene make_test_scene() {
    scene s = make_scene(width, height);
    s.lamp = 1 / 9.f * s.lamp;
    s.shapes[0].u = 3 * s.shapes[0].u;
    s.shapes[0].v = 3 * s.shapes[0].v;
    return s;
}

// 11 comparisons of at most 64 values of z. If the batches' means were normal, a difference of means over its
// estimated error would follow Student's distribution with at least 39 degrees of freedom, which exceeds 6
// with a probability of 5e-7: a false alarm has one below 4e-4. Seeds are fixed.
constexpr double threshold = 6;

// All estimators against the first.
void check(const std::vector<estimator>& estimators) {
    const measurement expected = render(estimators[0], 0);
    for (std::size_t k = 1; k < estimators.size(); ++k) {
        const estimator& e = estimators[k];
        const comparison c = compare(e, render(e, static_cast<long long>(k)), expected);
        MESSAGE(e.name, ": greatest |z| of ", c.compared, " is ", c.greatest);
        CHECK(c.compared > 20);
        CHECK(c.greatest < threshold);
    }
}

} // namespace

TEST_CASE("path tracing, all bidirectional techniques, some of them, and merging agree") {
    const scene s = make_test_scene();
    auto without_next_event = mis::bidirectional(pixels), by_light = without_next_event;
    without_next_event.next_event = 0;
    by_light.next_event = by_light.connection = 0;
    constexpr float radius = 0.1f;
    std::vector<estimator> estimators{
        with_counts("bidirectional", 40, s, mis::bidirectional(pixels)),
        {"path tracing with next event, by two weights", 80,
         [&s](long long pass, film& image) { trace_paths(s, pass, image); }},
        with_counts("path tracing", 80, s, mis::path_tracing()),
        with_counts("path tracing with next event", 60, s, mis::path_tracing_next_event()),
        with_counts("light tracing and path tracing", 50, s, by_light),
        with_counts("without next event", 40, s, without_next_event),
        with_counts("merging and path tracing", 50, s, mis::photon_mapping(pixels, radius), radius),
        with_counts("all", 40, s, mis::connection_and_merging(pixels, radius), radius),
    };
    // A disk of radius r blurs light over r, and loses some at the edges of surfaces. Where light changes
    // over lengths L the relative bias is r^2 / (8 L^2): 0.5 % for L = 0.5, the size of the smallest thing
    // but the caustic, which is far from its block's border.
    estimators[6].bias = estimators[7].bias = 0.02;
    check(estimators);
}

// Without glass, light tracing alone makes all paths that do not go from light to camera directly.
TEST_CASE("light tracing alone agrees where there is no glass") {
    scene s = make_test_scene();
    for (shape& a : s.shapes) {
        if (a.surface.kind == vertex_kind::dirac)
            a.surface = s.shapes[1].surface;
        a.surface.exponent = std::min(a.surface.exponent, 10.f); // what it rarely meets it knows badly
    }
    auto light_tracing = mis::light_tracing(pixels);
    light_tracing.direct = 0;
    std::vector<estimator> estimators{
        with_counts("bidirectional", 40, s, mis::bidirectional(pixels)),
        with_counts("light tracing", 60, s, light_tracing),
    };
    estimators[1].shortest = 3;
    check(estimators);
}
