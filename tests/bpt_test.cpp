// The reference renderer: all techniques, heuristics and modes estimate the same light, for every scene and
// path length.
#include <array>
#include <doctest/doctest.h>
#include <lab/render.hpp>
#include <nlohmann/json.hpp>

namespace {

using real = double;
using namespace lab;
using lab::renderer, lab::settings;

constexpr int width = 32, blocks_across = 4, blocks = blocks_across * blocks_across;
constexpr int batches = 32;
constexpr real pixels = width * width;

int block_of(int pixel) {
    return pixel / width * blocks_across / width * blocks_across + pixel % width * blocks_across / width;
}

// The light of one block of the image and one path length: a sum per batch of passes; and the second moment
// of one pass, as the *reference* render predicts it. Of a path tracer that should hit a small light once in
// a million walks, but has not, the sample's own variance says nothing.
struct cell {
    std::array<double, batches> sum{};
    double second_moment = 0;

    void add(const cell& other) {
        for (std::size_t i = 0; i < batches; ++i)
            sum[i] += other.sum[i];
        second_moment += other.second_moment;
    }
    double mean() const {
        double total = 0;
        for (const double x : sum)
            total += x;
        return total / batches;
    }
    // The larger of the predicted variance, which knows rare paths, and the batches' own, which knows that
    // the contributions of one pair of walks depend on each other.
    double variance_of_mean(int passes) const {
        double squares = 0;
        for (const double x : sum)
            squares += (x - mean()) * (x - mean());
        return std::max(squares / (batches - 1) / batches, second_moment / passes);
    }
};
using measurement = std::array<std::array<cell, blocks>, longest_path + 1>;

void add(measurement& to, const measurement& from) {
    for (std::size_t n = 0; n < to.size(); ++n)
        for (std::size_t block = 0; block < blocks; ++block)
            to[n][block].add(from[n][block]);
}

settings<real> settings_for(const mis::technique_counts<real>& counts, any_heuristic heuristic,
                            std::uint64_t seed, int passes_per_batch) {
    settings<real> s;
    s.width = width;
    s.passes = batches * passes_per_batch;
    s.counts = counts;
    s.heuristic = heuristic;
    s.seed = seed;
    return s;
}

// A way of rendering that is to agree with the reference.
struct estimator {
    std::string name;
    mis::technique_counts<real> counts;
    any_heuristic heuristic;
    int passes_per_batch;
    bool random_connection = false, roulette = true;
};

// Paths that the estimator can make, as the reference has found them, and what they predict.
struct expectation {
    measurement light;     // the reference's, with the reference's second moment
    measurement predicted; // the estimator's second moment
};

// Second moment of an estimator, by paths of the reference: a path of contribution f makes a technique with
// effective density q_t return w_t f / q_t with density q_t, in sum  f^2 (sum_t w_t^2 / q_t). The reference
// has made the path with a contribution whose expectation is f; `own` is its density, so that value = f /
// own.
double squared_per_contribution(const any_heuristic& heuristic, const mis::technique_counts<real>& counts,
                                const mis::measured_vertex<double>* records, int n, const double* densities,
                                double own) {
    double weights[mis::technique_count(longest_path)];
    mis::weights(heuristic, counts, records, n, weights);
    double moment = 0;
    for (int k = 0; k < mis::technique_count(n); ++k)
        if (weights[k] > 0)
            moment += weights[k] * weights[k] * own / densities[k];
    return moment;
}

// Renders the reference, all techniques with the balance heuristic, once for all estimators.
std::vector<expectation> render_reference(const scene<real>& scene, const std::vector<estimator>& estimators,
                                          int passes_per_batch) {
    auto everything = mis::bidirectional(pixels);
    everything.direct = pixels;
    const any_heuristic balance{heuristic_kind::balance, 2};
    const auto set = settings_for(everything, balance, 1, passes_per_batch);
    const auto renderer = make_renderer(scene, set);
    std::vector<expectation> total(estimators.size());
    std::vector<std::vector<expectation>> rows(width, total);
    in_parallel(set.threads, width, [&](int row) {
        auto& expected = rows[static_cast<std::size_t>(row)];
        for (int pass = 0; pass < set.passes; ++pass)
            renderer.render_row(
                pass, row, [&](const contribution<real>& c, const complete_path<real>& complete) {
                    const auto path = look_at(scene, width, complete);
                    const int n = path.size;
                    mis::measured_vertex<double> records[longest_path];
                    records_of(path, records);
                    double densities[mis::technique_count(longest_path)];
                    mis::relative_densities(everything, records, n, densities);
                    const double own = densities[mis::technique_index(n, c.technique)];
                    const double value = lab::sum(c.value), weighted = value * c.weight;
                    const double squared =
                        weighted * value *
                        squared_per_contribution(balance, everything, records, n, densities, own);
                    for (std::size_t k = 0; k < estimators.size(); ++k) {
                        const double moment = squared_per_contribution(
                            estimators[k].heuristic, estimators[k].counts, records, n, densities, own);
                        if (moment == 0)
                            continue; // cannot make this path
                        cell& light = expected[k].light[static_cast<std::size_t>(n)]
                                                       [static_cast<std::size_t>(block_of(c.pixel))];
                        cell& predicted = expected[k].predicted[static_cast<std::size_t>(n)]
                                                               [static_cast<std::size_t>(block_of(c.pixel))];
                        light.sum[static_cast<std::size_t>(pass / passes_per_batch)] +=
                            weighted / passes_per_batch;
                        light.second_moment += squared / set.passes;
                        predicted.second_moment += weighted * value * moment / set.passes;
                    }
                });
    });
    for (const auto& row : rows)
        for (std::size_t k = 0; k < estimators.size(); ++k) {
            add(total[k].light, row[k].light);
            add(total[k].predicted, row[k].predicted);
        }
    return total;
}

measurement render_estimator(scene<real> scene, const estimator& e, std::uint64_t seed) {
    if (!e.roulette)
        scene = without_roulette(scene);
    auto set = settings_for(e.counts, e.heuristic, seed, e.passes_per_batch);
    set.random_connection = e.random_connection;
    const auto renderer = make_renderer(scene, set);
    std::vector<measurement> rows(width);
    in_parallel(set.threads, width, [&](int row) {
        for (int pass = 0; pass < set.passes; ++pass)
            renderer.render_row(pass, row, [&](const contribution<real>& c, const complete_path<real>& path) {
                const real weight =
                    takes_whole_path(renderer)
                        ? weight_by_records(renderer, look_at(scene, width, path), c.technique)
                        : c.weight;
                cell& light = rows[static_cast<std::size_t>(row)][static_cast<std::size_t>(c.vertices)]
                                  [static_cast<std::size_t>(block_of(c.pixel))];
                light.sum[static_cast<std::size_t>(pass / e.passes_per_batch)] +=
                    lab::sum(c.value) * weight / e.passes_per_batch;
            });
    });
    measurement total{};
    for (const auto& row : rows)
        add(total, row);
    return total;
}

struct comparison {
    int measured_passes, expected_passes;
    double greatest = 0;
    int compared = 0, pooled_lengths = 0;

    // Whether the expected light is worth at least 16 independent events in both, so that z means something.
    bool is_well_sampled(const cell& measured, const cell& expected) const {
        const double square = expected.mean() * expected.mean();
        return square > 0 && square >= 16 * measured.variance_of_mean(measured_passes) &&
               square >= 16 * expected.variance_of_mean(expected_passes);
    }
    void compare(const cell& measured, const cell& expected) {
        const double variance =
            measured.variance_of_mean(measured_passes) + expected.variance_of_mean(expected_passes);
        greatest = std::max(greatest, std::abs(measured.mean() - expected.mean()) / std::sqrt(variance));
        ++compared;
    }
};

cell whole(const std::array<cell, blocks>& all) {
    cell sum;
    for (const cell& c : all)
        sum.add(c);
    return sum;
}

// Compares every path length over the whole image and, where there are enough samples, each block. Lengths
// too sparse for that (a path tracer hardly ever hits a small light after eight bounces) are compared in one
// sum, to which well sampled lengths are added until it is well sampled too. So no light escapes.
comparison compare(measurement measured, const expectation& expected, int measured_passes,
                   int expected_passes) {
    comparison c{measured_passes, expected_passes};
    add(measured, expected.predicted);
    cell measured_rest, expected_rest;
    for (std::size_t n = longest_path; n >= 2; --n) {
        for (std::size_t block = 0; block < blocks; ++block)
            if (c.is_well_sampled(measured[n][block], expected.light[n][block]))
                c.compare(measured[n][block], expected.light[n][block]);
        const cell m = whole(measured[n]), e = whole(expected.light[n]);
        if (m.mean() == 0 && e.mean() == 0)
            continue;
        const bool good = c.is_well_sampled(m, e);
        if (good)
            c.compare(m, e);
        c.pooled_lengths += !good;
        if (!good || (expected_rest.mean() + measured_rest.mean() > 0 &&
                      !c.is_well_sampled(measured_rest, expected_rest))) {
            measured_rest.add(m);
            expected_rest.add(e);
        }
    }
    if (measured_rest.mean() > 0 || expected_rest.mean() > 0)
        c.compare(measured_rest, expected_rest);
    return c;
}

// 10 scenes, 10 estimators, at most 17 numbers for each of 9 path lengths: at most 15,300 values of z. A
// normal variable exceeds 7 with a probability of 2.6e-12, a Poisson variable of mean 16 with 6.3e-9: a false
// alarm has a probability below 1e-4.
constexpr double threshold = 7;

void check_scene(const std::string& name) {
    const scene<real> scene = make_scene<real>(name);
    const auto all = mis::bidirectional(pixels);
    auto with_direct = all;
    with_direct.direct = pixels;
    const any_heuristic balance{heuristic_kind::balance, 2}, power{heuristic_kind::power, 2};
    const std::vector<estimator> estimators{
        {"path tracing", mis::path_tracing<real>(), balance, 8},
        {"path tracing with next event", mis::path_tracing_next_event<real>(), balance, 4},
        {"light tracing", mis::light_tracing(pixels), balance, 4},
        {"bidirectional, power", all, power, 2},
        {"bidirectional, maximum", all, {heuristic_kind::maximum, 2}, 2},
        {"bidirectional, average", all, {heuristic_kind::average, 2}, 2},
        {"bidirectional, cutoff", all, {heuristic_kind::cutoff, 0.1}, 2},
        {"bidirectional, power, direct", with_direct, power, 2},
        {"bidirectional, power, random connections", all, power, 2, true},
        {"bidirectional, power, no roulette", all, power, 2, false, false},
    };
    constexpr int reference_passes_per_batch = 2;
    const auto expected = render_reference(scene, estimators, reference_passes_per_batch);
    for (std::size_t k = 0; k < estimators.size(); ++k) {
        const estimator& e = estimators[k];
        const measurement measured = render_estimator(scene, e, 2 + k);
        const comparison c = compare(measured, expected[k], e.passes_per_batch * batches,
                                     reference_passes_per_batch * batches);
        MESSAGE(name, ", ", e.name, ": greatest |z| of ", c.compared, " is ", c.greatest, "; ",
                c.pooled_lengths, " lengths pooled");
        CHECK(c.greatest < threshold);
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
TEST_CASE("all techniques, heuristics and modes agree: mixed") { check_scene("mixed"); }
TEST_CASE("all techniques, heuristics and modes agree in media: fog") { check_scene("fog"); }
TEST_CASE("all techniques, heuristics and modes agree in media: milk") { check_scene("milk"); }
