// Roulette and splitting in the reference renderer: every mode estimates the same light, weights agree in
// three forms, walks never split without an end, whatever has been learned, and nothing depends on threads.
#include "lab_checks.hpp"
#include "lab_paths.hpp"

#include <bpt/algorithms.hpp>
#include <bpt/media_options.hpp>
#include <mis/verify.hpp>

namespace {

using namespace lab;
using lab::renderer, lab::settings;

constexpr roulette_mode modes[] = {roulette_mode::none,       roulette_mode::throughput,
                                   roulette_mode::albedo,     roulette_mode::adjoint,
                                   roulette_mode::efficiency, roulette_mode::per_technique};
std::string name_of_mode(roulette_mode m) {
    constexpr const char* names[] = {"none",    "throughput", "albedo",
                                     "adjoint", "efficiency", "per-technique"};
    return names[static_cast<int>(m)];
}

template <class Real>
settings<Real> settings_for(const scene<Real>& scene, const std::string& algorithm, roulette_mode mode,
                            int width) {
    settings<Real> s;
    s.width = width;
    s.passes = 1;
    s.threads = 2;
    s.heuristic = {heuristic_kind::power, 2.0};
    s.merge_radius = Real(0.05) * scene.radius;
    s.counts = algorithms(static_cast<Real>(width * width), s.merge_radius).at(algorithm).counts;
    s.roulette.mode = mode;
    return s;
}

// ---- Means ----

constexpr int across = 2, blocks = across * across, batches = 32;

// Light of each path length and block of the image, one sum for each batch of passes.
using measurement = std::array<std::array<std::array<double, batches>, blocks>, longest_path + 1>;

measurement measure(const renderer<double>& r, int passes_per_batch) {
    const int width = r.set.width;
    std::vector<measurement> rows(static_cast<std::size_t>(width));
    for (int pass = 0; pass < batches * passes_per_batch; ++pass)
        render_pass(r, pass, [&](const auto& renderer, const auto* photons, int row) {
            const auto add = [&](const contribution<double>& c, const complete_path<double>&) {
                const int block =
                    c.pixel / width * across / width * across + c.pixel % width * across / width;
                rows[static_cast<std::size_t>(row)][static_cast<std::size_t>(c.vertices)]
                    [static_cast<std::size_t>(block)][static_cast<std::size_t>(pass / passes_per_batch)] +=
                    lab::sum(c.value) * c.weight / passes_per_batch;
            };
            renderer.render_row(pass, row, add, photons);
        });
    measurement all{};
    for (const auto& row : rows)
        for (std::size_t n = 0; n < all.size(); ++n)
            for (std::size_t block = 0; block < blocks; ++block)
                for (std::size_t i = 0; i < batches; ++i)
                    all[n][block][i] += row[n][block][i];
    return all;
}

struct mean_and_error {
    double mean = 0, variance = 0;
};
mean_and_error mean_of(const std::array<double, batches>& sums) {
    mean_and_error m;
    for (const double x : sums)
        m.mean += x / batches;
    for (const double x : sums)
        m.variance += (x - m.mean) * (x - m.mean) / (batches - 1) / batches;
    return m;
}

struct z_scores {
    double greatest = 0;
    int compared = 0;

    void compare(const std::array<double, batches>& a, const std::array<double, batches>& b) {
        const auto x = mean_of(a), y = mean_of(b);
        // Light of a few events says nothing of its own variance: at least 64 are wanted of both.
        if (!(x.mean * x.mean > 64 * x.variance && y.mean * y.mean > 64 * y.variance))
            return;
        greatest = std::max(greatest, std::abs(x.mean - y.mean) / std::sqrt(x.variance + y.variance));
        ++compared;
    }
};

// Every path length and block, and every length and all lengths over the whole image.
z_scores compare(const measurement& a, const measurement& b) {
    z_scores z;
    std::array<double, batches> all_a{}, all_b{};
    for (std::size_t n = 2; n < a.size(); ++n) {
        std::array<double, batches> length_a{}, length_b{};
        for (std::size_t block = 0; block < blocks; ++block) {
            z.compare(a[n][block], b[n][block]);
            for (std::size_t i = 0; i < batches; ++i) {
                length_a[i] += a[n][block][i], all_a[i] += a[n][block][i];
                length_b[i] += b[n][block][i], all_b[i] += b[n][block][i];
            }
        }
        z.compare(length_a, length_b);
    }
    z.compare(all_a, all_b);
    return z;
}

// Less than 1000 numbers z are looked at, each the difference of two means of 32 batches in their own
// standard errors. Student's t of 31 degrees of freedom, the worst case, exceeds 7 with a probability of
// 7e-8: less than 1e-4 for a false alarm.
constexpr double threshold = 7;

// Something that may have been learned.
std::shared_ptr<learned<double>> all_learned(int width, double number) {
    auto all = std::make_shared<learned<double>>();
    for (auto& kind : all->walks) {
        kind.cells.resize(1);
        for (auto& bin : kind.cells[0]) {
            bin.is_known = true;
            bin.adjoint = number;
            bin.onwards = bin.next_event = {number, number, number};
        }
    }
    all->next_event_rates = {1};
    all->worth.assign(static_cast<std::size_t>(width * width), 1);
    all->image = {number, number};
    return all;
}

} // namespace

TEST_CASE("every roulette agrees on the light of each path length and block") {
    for (const std::string name : {"mixed", "door", "milk"}) {
        const auto scene = make_scene<double>(name);
        const auto of_mode = [&](roulette_mode mode) {
            auto set = settings_for(scene, "bpt", mode, 12);
            set.counts.direct = set.counts.camera_connection;
            set.seed = 100 + static_cast<std::uint64_t>(mode);
            return measure(make_renderer(scene, set), name == "door" ? 8 : 4);
        };
        const auto expected = of_mode(roulette_mode::none);
        for (const auto mode : modes) {
            if (mode == roulette_mode::none)
                continue;
            const auto z = compare(of_mode(mode), expected);
            MESSAGE(name, ", ", name_of_mode(mode), ": greatest |z| of ", z.compared, " is ", z.greatest);
            CHECK(z.compared > 5);
            CHECK(z.greatest < threshold);
        }
    }
}

TEST_CASE("weights agree in three forms under every roulette") {
    for (const std::string name : {"mixed", "lens", "fog"})
        for (const std::string algorithm : {"bpt", "ups", "upbp"})
            for (const auto mode : modes) {
                CAPTURE(name);
                CAPTURE(algorithm);
                CAPTURE(name_of_mode(mode));
                const auto scene = make_scene<double>(name);
                auto set = settings_for(scene, algorithm, mode, 10);
                set.media = media_merges_of(algorithm, set.counts.merge > 0, media_options{}, 0.05,
                                            scene.radius, 100.0);
                set.learning_passes = 3;
                test::check_agreement(test::checks_of(scene, set));
            }
}

TEST_CASE("walks that split are the same for any number of threads, to the last bit, pass by pass") {
    const auto scene = make_scene<float>("door");
    for (const auto mode : {roulette_mode::efficiency, roulette_mode::per_technique}) {
        const auto image_by = [&](int threads) {
            auto set = settings_for(scene, "bpt", mode, 16);
            set.threads = threads;
            bpt::renderer<float, mis::power_heuristic<>> r(scene, set);
            film image(set.width);
            for (int pass = 0; pass < 3; ++pass)
                add_pass(r, image);
            return image.sum.pixels;
        };
        const auto one = image_by(1);
        CHECK(one != black(16).pixels);
        CHECK(one == image_by(2));
        CHECK(one == image_by(7));
    }
}

TEST_CASE("whatever has been learned, walks have few copies and estimate the same light") {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const double numbers[] = {0, infinity, std::numeric_limits<double>::quiet_NaN()};
    const auto scene = make_scene<double>("mixed");
    constexpr int width = 8;
    const auto expected =
        measure(make_renderer(scene, settings_for(scene, "bpt", roulette_mode::none, width)), 6);
    for (const auto mode : {roulette_mode::adjoint, roulette_mode::efficiency, roulette_mode::per_technique})
        for (const double number : numbers) {
            CAPTURE(name_of_mode(mode));
            CAPTURE(number);
            auto set = settings_for(scene, "bpt", mode, width);
            set.learning_passes = 0;
            set.seed = 7;
            auto r = make_renderer(scene, set);
            r.weigh.roulette.learned = all_learned(width, number);
            walk<double> walk;
            pcg32 rng(1);
            std::size_t most = 0;
            for (int i = 0; i < 1000; ++i) {
                walk.worth = number;
                walk_from_camera(scene, r.weigh, width, 0.0, 0.0, {longest_path}, walk, rng);
                most = std::max(most, walk.size());
            }
            CHECK(most <= static_cast<std::size_t>(set.roulette.most_copies * longest_path));
            const auto z = compare(measure(r, 6), expected);
            CHECK(z.compared > 4);
            CHECK(z.greatest < threshold);
        }
}

TEST_CASE("walks split, and their copies share what there was") {
    const auto scene = make_scene<double>("door");
    auto set = settings_for(scene, "bpt", roulette_mode::adjoint, 8);
    set.learning_passes = 0;
    auto r = make_renderer(scene, set);
    r.weigh.roulette.learned = all_learned(8, 8); // all vertices are worth a few copies
    walk<double> walk;
    pcg32 rng(1);
    int split = 0;
    for (int i = 0; i < 100; ++i) {
        walk_from_camera(scene, r.weigh, 8, 0.0, 0.0, {longest_path}, walk, rng);
        int leaves = 0;
        for (std::size_t k = 1; k < walk.size(); ++k) {
            const auto& x = walk[k];
            CHECK(x.depth == previous(x).depth + 1);
            CHECK(x.depth <= longest_path);
            CHECK(x.copies <= std::ceil(x.rate));
            split += x.copies > 1;
            leaves += std::max(0, x.copies - 1);
        }
        CHECK(leaves < set.roulette.most_copies);
    }
    CHECK(split >= 100);
}

TEST_CASE("the weights of dumped paths follow from what is dumped, splits included") {
    for (const std::string name : {"mixed", "glossy"})
        for (const auto mode : modes) {
            const auto scene = make_scene<double>(name);
            auto set = settings_for(scene, "ups", mode, 12);
            set.check_weights = false;
            set.dump_paths = 30;
            if (is_learned(mode))
                set.counts = algorithms(144.0, 0.0).at("bpt").counts;
            double greatest = 0;
            int splits = 0, paths = 0;
            mis::weight_terms terms;
            for (const auto& record : test::records_of(test::dump_of(scene, set))) {
                mis::terms_of(record, terms);
                const auto expected = mis::weight_of(terms);
                CHECK(expected.missing == -1);
                greatest = std::max(greatest, std::abs(expected.weight / record.weight - 1));
                ++paths;
                for (const auto& x : record.vertices)
                    splits += x.splits != 1;
            }
            CAPTURE(name);
            CAPTURE(name_of_mode(mode));
            CHECK(paths > 20);
            CHECK((splits > 0) == is_learned(mode));
            CHECK(greatest < 1e-9);
        }
}
