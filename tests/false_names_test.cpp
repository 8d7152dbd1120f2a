// SPDX-License-Identifier: MIT
// Weights that have nothing to do with densities are not given the name of a mistake: ten kinds of them,
// 2,000 random paths of five scenes each time, 200 seeds and more, so that at most 1 answer of 1,000 is
// false. What the search has computed of the paths is used again for all of them.
#include "lab_paths.hpp"

#include <atomic>
#include <map>
#include <mis/verify/diagnosis.hpp>
#include <mutex>
#include <numeric>

namespace {

namespace detail = mis::detail;

struct setting {
    const char* scene;
    lab::heuristic_kind heuristic;
    bool merges, in_media;
    int first_seed, seeds, step;
};
constexpr int more_seeds = 10; // in media, where more can be wrong and the search is longer
constexpr setting settings[] = {{"milk", lab::heuristic_kind::power, true, true, 0, more_seeds, 1},
                                {"mixed", lab::heuristic_kind::power, true, false, 0, 200, 4},
                                {"cornell", lab::heuristic_kind::balance, false, false, 1, 200, 4},
                                {"spheres", lab::heuristic_kind::power, true, false, 2, 200, 4},
                                {"environment", lab::heuristic_kind::power, false, false, 3, 200, 4}};

// 3,000 paths of a scene, with their right weights.
std::vector<mis::path_record> paths_of(const setting& of) {
    constexpr int width = 50;
    const auto scene = lab::make_scene<double>(of.scene);
    lab::settings<double> s;
    s.width = width;
    s.passes = 1;
    s.threads = 1;
    s.check_weights = false;
    s.dump_paths = 60;
    s.heuristic = {of.heuristic, 2};
    s.merge_radius = 0.01 * scene.radius;
    s.counts = of.merges ? mis::connection_and_merging<double>(width * width, s.merge_radius)
                         : mis::bidirectional<double>(width * width);
    if (of.in_media)
        s.media = test::all_families(scene, width);
    return test::records_of(test::dump_of(scene, s));
}

enum kind { ones, coin, one_over_n, uniform, shuffled, clamped, float16, squared, dropped, previous, kinds };
constexpr const char* kind_names[] = {"all 1",   "coin flips", "1/n",     "uniform", "shuffled",
                                      "clamped", "float16",    "squared", "dropped", "of the previous depth"};

// As 11 bits of a half store it.
double in_half(double x) {
    int exponent = 0;
    std::frexp(x, &exponent);
    const double quantum = std::ldexp(1, std::max(exponent - 11, -24));
    return std::nearbyint(x / quantum) * quantum;
}

void change(std::vector<detail::sampled>& records, const std::vector<std::size_t>& used, kind made,
            pcg32& rng) {
    const auto uniform_number = [&] { return std::uniform_real_distribution<double>()(rng); };
    const auto any_of = [&](const std::vector<std::size_t>& some) {
        return some[std::uniform_int_distribution<std::size_t>(0, some.size() - 1)(rng)];
    };
    const double least = 0.02 + 0.3 * uniform_number(); // of the clamped
    const auto out = records[any_of(used)].record->technique.kind;
    std::map<std::size_t, std::vector<std::size_t>> by_length;
    for (const std::size_t i : used)
        by_length[records[i].record->vertices.size()].push_back(i);
    std::vector<std::size_t> order = used;
    std::shuffle(order.begin(), order.end(), rng);
    for (std::size_t k = 0; k < used.size(); ++k) {
        detail::sampled& r = records[used[k]];
        const std::size_t n = r.record->vertices.size();
        switch (made) {
        case ones:
            r.claimed = 1;
            break;
        case coin:
            r.claimed = uniform_number() < 0.5;
            break;
        case one_over_n:
            r.claimed = 1.0 / mis::technique_count(static_cast<int>(n));
            break;
        case uniform:
            r.claimed = uniform_number();
            break;
        case shuffled:
            r.claimed = records[order[k]].right;
            break;
        case clamped:
            r.claimed = std::min(std::max(r.right, least), 1 - least);
            break;
        case float16:
            r.claimed = in_half(r.right);
            break;
        case squared:
            r.claimed = r.right * r.right;
            break;
        case dropped:
            r.claimed = r.record->technique.kind == out ? 0 : r.right;
            break;
        case previous:
            r.claimed = records[any_of(by_length[by_length.count(n - 1) ? n - 1 : n])].right;
            break;
        case kinds:
            break;
        }
    }
}

// What may be said of these weights.
const char* true_name(kind made) {
    return made == ones ? "unweighted" : made == one_over_n ? "average_of_techniques" : "";
}

struct tally {
    int answers = 0, named = 0, false_names = 0, closest = 0;
};

} // namespace

TEST_CASE("of weights of ten kinds that no mistake makes, at most 1 answer in 1,000 is a false name") {
    constexpr int seeds = 200 + more_seeds;
    std::array<tally, kinds> tallies{};
    std::mutex mutex;
    lab::in_parallel(
        static_cast<int>(std::thread::hardware_concurrency()), static_cast<int>(std::size(settings)),
        [&](int at) {
            const auto paths = paths_of(settings[at]);
            detail::search s;
            s.tolerance = 1e-4;
            detail::add_records(s, paths);
            detail::find_places(s);
            for (int seed = settings[at].first_seed; seed < settings[at].seeds; seed += settings[at].step)
                for (int k = 0; k < kinds; ++k) {
                    pcg32 rng(static_cast<std::uint64_t>(seed), static_cast<std::uint64_t>(k));
                    std::vector<std::size_t> used(s.records.size());
                    std::iota(used.begin(), used.end(), 0);
                    std::shuffle(used.begin(), used.end(), rng);
                    used.resize(2000);
                    change(s.records, used, static_cast<kind>(k), rng);
                    std::vector<bool> is_used(s.records.size());
                    double wrong = 0;
                    const auto disagrees = [&](std::size_t i) {
                        return !mis::agree(s.records[i].claimed, s.records[i].right, s.tolerance);
                    };
                    for (const std::size_t i : used) {
                        is_used[i] = true;
                        wrong += disagrees(i);
                    }
                    if (wrong == 0) { // nothing but what is right already
                        const std::lock_guard<std::mutex> lock(mutex);
                        ++tallies[static_cast<std::size_t>(k)].answers;
                        continue;
                    }
                    detail::set_claims(s, (2000 - wrong) / wrong, disagrees,
                                       [&](std::size_t i) { return is_used[i]; });
                    const detail::scored best = detail::best_set(s);
                    const bool is_named = detail::is_named(s, best);
                    const std::lock_guard<std::mutex> lock(mutex);
                    tally& t = tallies[static_cast<std::size_t>(k)];
                    ++t.answers;
                    t.closest += !is_named && best.score > 0;
                    if (!is_named)
                        continue;
                    ++t.named;
                    const bool is_true =
                        best.set.size() == 1 &&
                        std::string(detail::identifier_of(best.set[0])) == true_name(static_cast<kind>(k));
                    t.false_names += !is_true;
                    for (const auto& m : best.set)
                        if (!is_true)
                            std::printf("%s, %s: %s %s, explains %.0f of %.0f\n", kind_names[k],
                                        settings[at].scene, detail::identifier_of(m),
                                        mis::describe(s.places[m.place]).c_str(), best.sums.explained, wrong);
                }
        });
    int answers = 0, false_names = 0;
    std::printf("%-22s %8s %8s %8s %8s\n", "weights", "answers", "named", "falsely", "closest");
    for (int k = 0; k < kinds; ++k) {
        const tally& t = tallies[static_cast<std::size_t>(k)];
        std::printf("%-22s %8d %8d %8d %8d\n", kind_names[k], t.answers, t.named, t.false_names, t.closest);
        answers += t.answers;
        false_names += t.false_names;
    }
    CHECK(answers == seeds * kinds);
    CHECK(tallies[ones].named == seeds);
    CHECK(tallies[one_over_n].named == seeds);
    CHECK(false_names * 1000 <= answers);
}
