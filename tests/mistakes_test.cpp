// SPDX-License-Identifier: MIT
// Every mistake that the reference renderer can make is planted in it, alone and in pairs, and must be named
// from at most 2,000 of the paths that it writes down.
#include "lab_paths.hpp"

#include <map>
#include <mis/verify/diagnosis.hpp>
#include <mutex>

namespace {

using test::dump_of;
using test::records_of;

using lab::mistake;
using lab::mistake_set;

constexpr int width = 48, lines_per_row = 41; // 1,968 paths

mistake_set set_of(std::initializer_list<std::size_t> mistakes) {
    mistake_set set;
    for (const std::size_t k : mistakes)
        set.planted.set(k);
    return set;
}

// Whether mistakes of media are among them: these show in a scene with media.
bool are_of_media(const mistake_set& mistakes) { return (mistakes.planted >> lab::first_of_media).any(); }
// Shows nothing but that the scene shall be one with media.
const mistake_set in_media = set_of({lab::first_of_media});

// A scene and techniques in which all mistakes show, but for two that need rules of their own.
lab::settings<double> settings_for(const lab::scene<double>& scene, const mistake_set& shown) {
    lab::settings<double> s;
    s.width = width;
    s.passes = 1;
    s.threads = 1;
    s.check_weights = false;
    s.dump_paths = lines_per_row;
    s.heuristic = {lab::heuristic_kind::power, 2};
    if (shown.has(mistake::maximum_tie))
        s.heuristic.kind = lab::heuristic_kind::maximum;
    // Merges with another material, and of ties, are many where the radius is large.
    const bool merges = shown.has(mistake::maximum_tie) || shown.has(mistake::merge_roulette);
    s.merge_radius = (merges ? 0.06 : 0.01) * scene.radius;
    s.counts = mis::connection_and_merging<double>(width * width, s.merge_radius);
    if (shown.has(mistake::splitting_omitted)) { // light walks that are merged do not split
        s.roulette.mode = bpt::roulette_mode::adjoint;
        s.counts = mis::bidirectional<double>(width * width);
    }
    s.counts.next_event = 2;
    if (shown.has(mistake::subpath_caps))
        s.counts.max_camera_vertices = s.counts.max_light_vertices = 4;
    if (are_of_media(shown))
        s.media = test::all_families(scene, width);
    return s;
}

mis::finding diagnose(const std::vector<mis::path_record>& records) {
    mis::diagnosis d;
    for (const auto& record : records)
        mis::judge(d, record);
    return mis::suspects_of(d);
}

// Paths with these mistakes, in a setting in which those of `shown` can show: in units in which densities are
// about 1, but in millimetres for floats to overflow.
std::vector<mis::path_record> paths_with(const mistake_set& planted, const mistake_set& shown) {
    const double scale = shown.has(mistake::power_overflow) ? 1 : 0.01;
    const auto scene = lab::scaled(lab::make_scene<double>(are_of_media(shown) ? "milk" : "mixed"), scale);
    auto settings = settings_for(scene, shown);
    settings.mistakes = planted;
    return records_of(dump_of(scene, settings));
}

// Paths with one mistake, in a setting in which it shows: rendered once for all tests.
const std::vector<mis::path_record>& paths_with_alone(std::size_t k) {
    static std::array<std::vector<mis::path_record>, lab::mistake_count> known;
    if (known[k].empty())
        known[k] = paths_with(set_of({k}), set_of({k}));
    return known[k];
}

} // namespace

TEST_CASE("every mistake has its name in the library, and the other way about") {
    for (const char* name : lab::mistake_names)
        CHECK(std::any_of(std::begin(mis::mistakes), std::end(mis::mistakes),
                          [&](const mis::mistake& m) { return std::string(m.identifier) == name; }));
    for (const mis::mistake& m : mis::mistakes)
        CHECK(std::any_of(std::begin(lab::mistake_names), std::end(lab::mistake_names),
                          [&](const char* name) { return std::string(m.identifier) == name; }));
}

namespace {

// All mistakes that are named for each that is planted alone, from records changed by `change`.
template <class Change> std::vector<std::string> names_of_singles(Change&& change) {
    std::vector<std::string> names(lab::mistake_count);
    std::printf("%-24s %8s %8s   %s\n", "planted", "wrong", "explained", "named");
    for (std::size_t k = 0; k < lab::mistake_count; ++k) {
        auto records = paths_with_alone(k);
        CHECK(records.size() > 1900);
        CHECK(records.size() <= 2000);
        for (auto& record : records)
            change(record);
        const auto f = diagnose(records);
        std::string all;
        for (const auto& s : f.suspects)
            all += (all.empty() ? "" : ", ") + std::string(s.mistake->identifier);
        names[k] = all.empty() ? "unexplained" : all;
        std::printf("%-24s %8d %8d   %s\n", lab::mistake_names[k], static_cast<int>(f.disagreeing),
                    static_cast<int>(f.explained), names[k].c_str());
    }
    return names;
}

// P-> and P<- in place of the densities of directions.
void keep_area_densities(mis::path_record& record) {
    std::vector<double> from_camera, from_light;
    for (std::size_t i = 0; i < record.vertices.size(); ++i) {
        from_camera.push_back(std::exp(mis::detail::log_from_camera(record, i)));
        from_light.push_back(std::exp(mis::detail::log_from_light(record, i)));
    }
    for (std::size_t i = 0; i < record.vertices.size(); ++i) {
        auto& x = record.vertices[i];
        x.density_from_camera = from_camera[i];
        x.density_from_light = from_light[i];
        x.pdf_to_light = x.pdf_to_camera = x.pdf_position = mis::not_given;
    }
}
void drop_geometry(mis::path_record& record) {
    for (auto& x : record.vertices)
        x.cos_to_camera = x.cos_to_light = x.distance2_to_light = x.shading_cos_to_camera =
            x.shading_cos_to_light = mis::not_given;
}

} // namespace

// ---- Splitting ----

namespace {

// By which expected numbers of copies a renderer with these materials might split its camera and light walks.
double splits_of(const mis::recorded_vertex& x) {
    return std::array{1.0, 2.5, 4.0}[std::size_t(x.material) % 3];
}
double splits_to_camera_of(const mis::recorded_vertex& x) {
    return std::array{3.0, 1.5, 1.0, 2.0}[std::size_t(x.material) % 4];
}

// Multiplies into the densities of a path whose walks split: at vertex i, the number of the camera walk's
// copies to what the copies go on to, to what is joined and merged at the vertex, or to both; and of the
// light walk's.
struct split_densities {
    bool camera = true, light = true, joins = true;
};
void split(mis::path_record& r, std::size_t i, const split_densities& into) {
    mis::recorded_vertex& x = r.vertices[i];
    const double camera = into.camera ? splits_of(x) : 1, light = into.light ? splits_to_camera_of(x) : 1;
    if (r.splits_on_arrival && into.joins) {
        x.pdf_distance_from_camera *= camera;
        x.pdf_distance_from_light *= light;
    } else {
        x.pdf_to_light *= camera;
        x.pdf_to_camera *= light;
    }
}

// The weight as it should be, of ties that is shared.
double right_weight(const mis::path_record& r) {
    mis::weight_terms terms;
    mis::terms_of(r, terms);
    return mis::weight_of(terms).weight;
}

// Paths of a renderer that splits, and whose weights see of it what `into` says of a record and a vertex.
template <class Into> std::vector<mis::path_record> split_paths(bool on_arrival, Into&& into) {
    auto records = paths_with({}, {});
    for (auto& record : records) {
        record.splits_on_arrival = on_arrival;
        mis::path_record told = record;
        for (std::size_t i = 1; i + 1 < record.vertices.size(); ++i) {
            split(told, i, into(record, static_cast<int>(i)));
            split(record, i, {});
            auto& x = record.vertices[i];
            x.splits = splits_of(x);
            x.splits_to_camera = splits_to_camera_of(x);
        }
        record.weight = right_weight(told);
    }
    return records;
}

} // namespace

TEST_CASE("splitting that weights leave out is named, in each way of leaving it out") {
    using mis::path_record, mis::technique_kind;
    const auto is_camera_walks = [](const path_record& r, int i) { return i < r.technique.camera_vertices; };
    const auto only_in = [](technique_kind kind) {
        return [kind](const path_record& r, int) {
            const bool all = r.technique.kind != kind;
            return split_densities{all, all};
        };
    };
    const auto named = [](bool on_arrival, const char* what, auto&& into) {
        const auto f = diagnose(split_paths(on_arrival, into));
        CAPTURE(what);
        CAPTURE(on_arrival);
        std::printf("splitting_omitted, %s%s: %d wrong, %d explained\n", what,
                    on_arrival ? ", on arrival" : "", static_cast<int>(f.disagreeing),
                    static_cast<int>(f.explained));
        CHECK(f.disagreeing > 20);
        REQUIRE(f.suspects.size() == 1);
        CHECK(std::string(f.suspects[0].mistake->identifier) == "splitting_omitted");
        CHECK(f.explained == f.disagreeing);
        CHECK(f.spoiled == 0);
    };
    for (const bool on_arrival : {false, true}) {
        mis::diagnosis right;
        for (const auto& record :
             split_paths(on_arrival, [](const path_record&, int) { return split_densities{}; }))
            mis::judge(right, record);
        CHECK(right.records > 1900);
        CHECK(right.agreeing == right.records);
        named(on_arrival, "everywhere", [](const path_record&, int) {
            return split_densities{false, false};
        });
        named(on_arrival, "camera walk", [](const path_record&, int) {
            return split_densities{false, true};
        });
        named(on_arrival, "light walk", [](const path_record&, int) { return split_densities{true, false}; });
        named(on_arrival, "reverse", [&](const path_record& r, int i) {
            return split_densities{is_camera_walks(r, i), !is_camera_walks(r, i)};
        });
        named(on_arrival, "forward", [&](const path_record& r, int i) {
            return split_densities{!is_camera_walks(r, i), is_camera_walks(r, i)};
        });
        named(on_arrival, "light hits", only_in(technique_kind::light_hit));
        named(on_arrival, "next events", only_in(technique_kind::next_event));
        named(on_arrival, "connections", only_in(technique_kind::connection));
        named(on_arrival, "camera connections", only_in(technique_kind::camera_connection));
        named(on_arrival, "merges", only_in(technique_kind::merge));
    }
    named(true, "joins", [](const path_record&, int) { return split_densities{true, true, false}; });
}

TEST_CASE("each mistake alone is named, and nothing else") {
    const auto names = names_of_singles([](mis::path_record&) {});
    for (std::size_t k = 0; k < lab::mistake_count; ++k)
        CHECK(names[k] == lab::mistake_names[k]);
}

TEST_CASE("each mistake alone is named from area densities and geometry") {
    const auto names = names_of_singles(keep_area_densities);
    for (std::size_t k = 0; k < lab::mistake_count; ++k)
        CHECK(names[k] == lab::mistake_names[k]);
}

TEST_CASE("from area densities alone, each mistake is named that is not in the geometry itself") {
    const auto names = names_of_singles([](mis::path_record& record) {
        keep_area_densities(record);
        drop_geometry(record);
    });
    for (std::size_t k = 0; k < lab::mistake_count; ++k) {
        const auto m = static_cast<mistake>(k);
        const bool is_geometry = m == mistake::shading_normal || m == mistake::dirac_etendue ||
                                 m == mistake::environment_measure || m == mistake::solid_angle_as_area ||
                                 m == mistake::reverse_is_forward || m == mistake::boundary_vertex;
        CHECK(names[k] == (is_geometry ? "unexplained" : lab::mistake_names[k]));
    }
}

namespace {

// 2,500 paths of a renderer without mistakes; without merges in float.
template <class Real>
std::vector<mis::path_record> right_paths(const std::string& name, lab::heuristic_kind kind) {
    const auto scene = lab::make_scene<Real>(name);
    lab::settings<Real> s;
    s.width = 50;
    s.passes = 1;
    s.check_weights = false;
    s.dump_paths = 50;
    s.heuristic = {kind, kind == lab::heuristic_kind::cutoff ? 0.1 : 2.0};
    s.merge_radius = Real(0.01) * scene.radius;
    s.counts = std::is_same_v<Real, float> ? mis::bidirectional<Real>(2500)
                                           : mis::connection_and_merging<Real>(2500, s.merge_radius);
    std::vector<std::string> lines;
    lab::render(scene, s, [&](const lab::pass_result<Real>& result) {
        for (const auto& row : result.rows)
            lines.insert(lines.end(), row.dump.begin(), row.dump.end());
    });
    return records_of(lines);
}

constexpr lab::heuristic_kind heuristics[] = {lab::heuristic_kind::average, lab::heuristic_kind::balance,
                                              lab::heuristic_kind::power, lab::heuristic_kind::cutoff,
                                              lab::heuristic_kind::maximum};

} // namespace

TEST_CASE("the renderer's own weights all agree: every scene and heuristic, in double and float") {
    std::int64_t records = 0, agreeing = 0, undecided = 0;
    for (const auto& name : lab::scene_names())
        for (const auto kind :
             {lab::heuristic_kind::average, lab::heuristic_kind::balance, lab::heuristic_kind::power,
              lab::heuristic_kind::cutoff, lab::heuristic_kind::maximum})
            for (const bool in_float : {false, true}) {
                mis::diagnosis d;
                for (const auto& record :
                     in_float ? right_paths<float>(name, kind) : right_paths<double>(name, kind))
                    mis::judge(d, record);
                CAPTURE(name);
                CAPTURE(lab::name_of(kind));
                CAPTURE(in_float);
                CHECK(d.disagreeing == 0);
                CHECK(d.unusable == 0);
                CHECK(mis::suspects_of(d).suspects.empty());
                records += d.records, agreeing += d.agreeing, undecided += d.undecided;
            }
    std::printf("%lld paths, %lld weights agree, %lld hang on rounding\n", static_cast<long long>(records),
                static_cast<long long>(agreeing), static_cast<long long>(undecided));
    CHECK(records >= 100'000);
    CHECK(agreeing + undecided == records);
    CHECK(undecided * 20 < records);
}

TEST_CASE("weights with noise of 1 % are unexplained: every scene and heuristic") {
    pcg32 rng(5);
    for (const auto& name : lab::scene_names())
        for (const auto kind : heuristics) {
            CAPTURE(name);
            CAPTURE(lab::name_of(kind));
            auto records = right_paths<double>(name, kind);
            for (auto& record : records)
                record.weight *= 1 + 0.01 * std::normal_distribution<double>()(rng);
            const auto f = diagnose(records);
            CHECK(f.disagreeing > 800);
            CHECK(f.suspects.empty());
        }
}

namespace {

// Whether a mistake shows in a record: also where a tie has been decided.
bool shows(const mis::path_record& record) { return !mis::agree(record.weight, right_weight(record), 1e-4); }

std::string names_of(const mis::finding& f) {
    std::string all;
    for (const auto& s : f.suspects)
        all += (all.empty() ? "" : ", ") + std::string(s.mistake->identifier);
    return all.empty() ? "unexplained" : all;
}

// A random choice of at most so many.
std::vector<mis::path_record> some_of(std::vector<mis::path_record> records, std::size_t most,
                                      unsigned seed) {
    std::shuffle(records.begin(), records.end(), pcg32(seed));
    records.resize(std::min(records.size(), most));
    return records;
}

} // namespace

// Of mistakes that predict the same for all of these paths, one is named and the others are listed.
TEST_CASE("each mistake alone is named from 100 records of paths on which it shows") {
    for (std::size_t k = 0; k < lab::mistake_count; ++k) {
        std::vector<mis::path_record> records;
        for (const auto& record : paths_with_alone(k))
            if (shows(record))
                records.push_back(record);
        const std::string planted = lab::mistake_names[k];
        CAPTURE(planted);
        CAPTURE(records.size());
        const auto f = diagnose(some_of(records, 100, 1));
        CHECK(f.suspects.size() == 1);
        const bool is_listed = std::any_of(f.equivalent.begin(), f.equivalent.end(),
                                           [&](const mis::mistake* m) { return m->identifier == planted; });
        CHECK((names_of(f) == planted || is_listed));
    }
}

namespace {

// All places in which the path of some record is.
std::vector<mis::confinement> places_of(const std::vector<mis::path_record>& records) {
    mis::detail::search s;
    mis::detail::add_records(s, records);
    mis::detail::find_places(s);
    return {s.places.begin() + 1, s.places.end()};
}

// Makes a mistake in a place only: the number of records in which it then shows.
int confine(std::vector<mis::path_record>& records, const mis::confinement& where) {
    int count = 0;
    for (auto& record : records) {
        if (!mis::contains(where, record))
            record.weight = right_weight(record);
        count += shows(record);
    }
    return count;
}

} // namespace

TEST_CASE("each mistake alone, in a place of about 10 % of the paths, is named with a place in which all its "
          "wrong weights are, and no right one that it would change") {
    int in_that_place = 0;
    for (std::size_t k = 0; k < lab::mistake_count; ++k) {
        const auto& everywhere = paths_with_alone(k);
        const auto aim = static_cast<int>(everywhere.size() / 10);
        mis::confinement place;
        std::vector<mis::path_record> records;
        int wrong = INT_MAX;
        for (const mis::confinement& where : places_of(everywhere)) {
            auto confined = everywhere;
            const int count = confine(confined, where);
            const bool is_tie = static_cast<mistake>(k) == mistake::maximum_tie;
            if (count >= (is_tie ? 24 : 10) && std::abs(count - aim) < std::abs(wrong - aim)) {
                place = where;
                records = confined;
                wrong = count;
            }
        }
        const auto f = diagnose(records);
        CAPTURE(mis::describe(place));
        CAPTURE(wrong);
        CHECK(names_of(f) == lab::mistake_names[k]);
        CHECK(f.explained == f.disagreeing);
        CHECK(f.spoiled == 0);
        if (f.suspects.size() != 1)
            continue;
        const mis::confinement& named = f.suspects[0].where;
        CHECK(f.suspects[0].prevalence > 0.999);
        for (const auto& record : records)
            if (shows(record))
                CHECK(mis::contains(named, record));
        in_that_place += named.what == place.what && named.value == place.value;
        std::printf("%-24s %5d wrong %s: named %s\n", lab::mistake_names[k], wrong,
                    mis::describe(place).c_str(), mis::describe(named).c_str());
    }
    std::printf("%d of %zu are named with the very place\n", in_that_place, lab::mistake_count);
    CHECK(in_that_place >= 15); // others show nowhere but in a part of that place
}

TEST_CASE("each mistake alone in a random tenth of the weights is named, and how often it shows") {
    for (std::size_t k = 0; k < lab::mistake_count; ++k) {
        const auto m = static_cast<mistake>(k);
        if (m == mistake::maximum_tie || m == mistake::unweighted || m == mistake::average_of_techniques)
            continue; // ties that rounding decides; constants by chance
        CAPTURE(std::string(lab::mistake_names[k]));
        auto records = paths_with_alone(k);
        pcg32 rng(k);
        int wrong = 0;
        for (auto& record : records) {
            if (std::uniform_real_distribution<double>()(rng) > 0.1)
                record.weight = right_weight(record);
            wrong += shows(record);
        }
        if (wrong < 5)
            continue;
        const auto f = diagnose(records);
        CHECK(names_of(f) == lab::mistake_names[k]);
        CHECK(f.explained == f.disagreeing);
        if (f.suspects.size() == 1 && f.suspects[0].where.what == mis::confinement::by::nothing)
            CHECK(f.suspects[0].prevalence < 0.3);
    }
}

TEST_CASE("the size of the file does not change the suspects") {
    // A tenth of the paths has a mistake; five times the paths have it in the same tenth.
    for (const mistake m :
         {mistake::roulette_omitted, mistake::selection_omitted, mistake::reverse_is_forward}) {
        const mistake_set planted = set_of({static_cast<std::size_t>(m)});
        std::vector<std::string> names;
        for (const int lines : {57, 285}) { // 2,736 and 13,680 records
            const auto scene = lab::scaled(lab::make_scene<double>("mixed"), 0.01);
            auto settings = settings_for(scene, planted);
            settings.mistakes = planted;
            settings.passes = lines == 57 ? 1 : 5;
            settings.dump_paths = 57;
            auto records = records_of(dump_of(scene, settings));
            pcg32 rng(3);
            for (auto& record : records)
                if (std::uniform_real_distribution<double>()(rng) > 0.1)
                    record.weight = right_weight(record);
            const auto f = diagnose(records);
            std::printf("%zu records: %s, which shows in %.1f %% of the weights that it would change\n",
                        records.size(), names_of(f).c_str(),
                        f.suspects.empty() ? 0.0 : 100 * f.suspects[0].prevalence);
            names.push_back(names_of(f));
        }
        CHECK(names[0] == lab::mistake_names[static_cast<std::size_t>(m)]);
        CHECK(names[0] == names[1]);
    }
}

TEST_CASE("few wrong weights, 1 in 1,000, get the closest mistake, or its name") {
    for (std::size_t k = 0; k < lab::mistake_count; ++k) {
        auto records = paths_with_alone(k);
        if (static_cast<mistake>(k) == mistake::maximum_tie)
            continue; // 16 ties are the fewest that tell
        CAPTURE(std::string(lab::mistake_names[k]));
        int left = 2;
        for (auto& record : records)
            if (shows(record) && --left < 0)
                record.weight = right_weight(record);
        const auto f = diagnose(records);
        CHECK(f.disagreeing == 2);
        CHECK(f.suspects.size() + f.closest.size() > 0);
    }
}

TEST_CASE("mistakes of surfaces are named among merges in media, too") {
    int shown = 0;
    for (std::size_t k = 0; k < lab::of_splitting; ++k) {
        const auto records = some_of(paths_with(set_of({k}), in_media), 700, 1);
        const auto wrong = std::count_if(records.begin(), records.end(), shows);
        const auto f = diagnose(records);
        std::printf("%-24s %5d wrong in media: %s\n", lab::mistake_names[k], static_cast<int>(wrong),
                    wrong == 0 ? "does not show" : names_of(f).c_str());
        if (wrong < 10)
            continue;
        ++shown;
        CHECK(names_of(f) == lab::mistake_names[k]);
        CHECK(f.explained == f.disagreeing);
    }
    CHECK(shown >= 15);
}

// The renderer plants one way of making each; here the weights are those that each predicts.
TEST_CASE("every way of making a mistake in media is named, or listed where these paths tell no difference") {
    const auto right = some_of(paths_with({}, in_media), 600, 1);
    int ways = 0, hidden = 0;
    for (const mis::mistake& m : mis::mistakes) {
        const bool is_of_media =
            std::any_of(std::begin(lab::mistake_names) + lab::first_of_media, std::end(lab::mistake_names),
                        [&](const char* name) { return std::string(m.identifier) == name; });
        const std::string what = m.what, identifier = m.identifier;
        if (!is_of_media && what.find("merges") == std::string::npos)
            continue;
        auto records = right;
        int wrong = 0;
        mis::weight_terms terms;
        for (auto& record : records) {
            mis::terms_of(record, terms);
            REQUIRE(m.plant(terms, record) != mis::planted::unknown);
            record.weight = mis::weight_of(terms).weight;
            wrong += shows(record);
        }
        ++ways;
        hidden += wrong < 5;
        if (wrong < 5)
            continue;
        const auto f = diagnose(records);
        CAPTURE(what);
        const bool is_listed =
            std::any_of(f.equivalent.begin(), f.equivalent.end(),
                        [&](const mis::mistake* e) { return e->identifier == identifier; });
        CHECK((names_of(f) == identifier || is_listed));
        CHECK(f.explained == f.disagreeing);
        CHECK(f.spoiled == 0);
    }
    std::printf("%d ways, %d hardly show\n", ways, hidden);
    CHECK(ways > 60);
    CHECK(hidden < 12);
}

namespace {

struct pair_result {
    std::size_t a = 0, b = 0;
    bool visible = false; // both change weights, in the presence of the other
    bool both_named = false;
    std::string named;
};

// Records of the same paths whose weights differ.
int differing(const std::vector<mis::path_record>& a, const std::vector<double>& b) {
    int count = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        count += !mis::agree(a[i].weight, b[i], 1e-4);
    return count;
}

// The weights with one mistake alone. Of the mistakes shown, only those that have settings of their own
// matter, so that many pairs share them.
const std::vector<double>& weights_with(std::size_t k, const mistake_set& shown) {
    static std::mutex mutex;
    static std::map<std::pair<std::size_t, unsigned long>, std::vector<double>> known;
    mistake_set special;
    for (const mistake m :
         {mistake::power_overflow, mistake::maximum_tie, mistake::merge_roulette, mistake::subpath_caps})
        special.planted.set(static_cast<std::size_t>(m), shown.has(m));
    special.planted.set(lab::first_of_media, are_of_media(shown));
    const std::lock_guard<std::mutex> lock(mutex);
    auto& weights = known[{k, special.planted.to_ulong()}];
    if (weights.empty())
        for (const auto& record : paths_with(set_of({k}), special))
            weights.push_back(record.weight);
    return weights;
}

// Of the mistakes from `first` to `last`: both are named in 90 % of the pairs that do not mask each other, of
// which there are at least so many.
void check_pairs(std::size_t first, std::size_t last, int fewest_visible) {
    std::vector<pair_result> pairs;
    for (std::size_t a = first; a < last; ++a)
        for (std::size_t b = a + 1; b < last; ++b)
            pairs.push_back({a, b, false, false, {}});
    const int threads = static_cast<int>(std::thread::hardware_concurrency());
    lab::in_parallel(threads, static_cast<int>(pairs.size()), [&](int i) {
        pair_result& p = pairs[static_cast<std::size_t>(i)];
        const mistake_set both = set_of({p.a, p.b});
        const auto records = paths_with(both, both);
        constexpr int fewest = 10; // of 1,968 records
        p.visible = differing(records, weights_with(p.a, both)) >= fewest &&
                    differing(records, weights_with(p.b, both)) >= fewest;
        if (!p.visible)
            return;
        const mis::finding f = diagnose(first == 0 ? records : some_of(records, 700, 1));
        int found = 0;
        for (const auto& s : f.suspects) {
            p.named += (p.named.empty() ? "" : ", ") + std::string(s.mistake->identifier);
            for (const std::size_t k : {p.a, p.b})
                found += std::string(s.mistake->identifier) == lab::mistake_names[k];
        }
        p.both_named = found == 2;
    });
    int visible = 0, named = 0;
    for (const pair_result& p : pairs) {
        visible += p.visible;
        named += p.both_named;
        if (p.visible && !p.both_named)
            std::printf("%s and %s: named %s\n", lab::mistake_names[p.a], lab::mistake_names[p.b],
                        p.named.empty() ? "unexplained" : p.named.c_str());
        if (!p.visible)
            std::printf("%s masks %s\n", lab::mistake_names[p.a], lab::mistake_names[p.b]);
    }
    std::printf("%d of %zu pairs do not mask each other; both are named in %d of them\n", visible,
                pairs.size(), named);
    CHECK(visible >= fewest_visible);
    CHECK(named >= 0.9 * visible);
}

} // namespace

TEST_CASE("mistakes in pairs are both named, in 90 % of the pairs that do not mask each other") {
    check_pairs(0, lab::of_splitting, 200);
}

TEST_CASE("mistakes in pairs in media: the same") {
    check_pairs(lab::first_of_media, lab::mistake_count, 20);
}
