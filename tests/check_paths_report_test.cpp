// SPDX-License-Identifier: MIT
// What check_paths says about dumps: as text, as JSON and by its exit status.
#include "fuzz/temporary_file.hpp"
#include "random_paths.hpp"
#include "report.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <doctest/doctest.h>
#include <string>
#include <vector>

namespace {

using json = nlohmann::json;

struct checked {
    std::string text;
    json as_json;
    int status = -1;
};

checked check_file(const std::string& file) {
    check_paths::path_reader reader;
    const int descriptor = test::temporary_file(file);
    REQUIRE(descriptor >= 0);
    REQUIRE(check_paths::open_lines(reader.lines, descriptor));
    check_paths::report report;
    while (check_paths::add_next(report, reader)) {
    }
    const mis::finding found = check_paths::suspects_in(report, 2);
    checked result;
    char* text = nullptr;
    std::size_t size = 0;
    std::FILE* const out = open_memstream(&text, &size);
    REQUIRE(out);
    check_paths::print(report, found, out);
    std::fclose(out);
    result.text.assign(text, size);
    std::free(text);
    // Through text, as a program that reads it sees it.
    result.as_json = json::parse(check_paths::to_json(report, found).dump());
    result.status = check_paths::exit_status(report, found);
    CHECK(result.as_json["exit_status"] == result.status);
    return result;
}

checked check_records(const std::vector<json>& records) {
    std::string file;
    for (const json& record : records)
        file += record.dump() + "\n";
    return check_file(file);
}

bool has(const checked& c, const std::string& text) {
    const bool found = c.text.find(text) != std::string::npos;
    if (!found)
        MESSAGE("no '" << text << "' in:\n" << c.text);
    return found;
}

// The places in the text where a line begins with a word.
int lines_that_begin(const checked& c, const std::string& word) {
    int count = 0;
    const std::string text = "\n" + c.text;
    for (std::size_t at = 0; (at = text.find("\n" + word, at)) != std::string::npos; ++at)
        ++count;
    return count;
}

// A light hit that competes with one next event: camera, surface, light, at distance 2 from the surface.
struct light_hit {
    double pdf = 0.5, survival = 0.8; // at the surface
    double next_event = 0.2, selection = 0.5;

    double at_light() const { return pdf * 0.5 / 4; } // per area: the cosine is 1/2
    double right_weight() const { return at_light() / (at_light() + next_event); }
};

light_hit random_hit(test::generator& g) {
    return {g.uniform(0.2, 2), g.uniform(0.3, 0.9), g.uniform(0.05, 0.5), g.uniform(0.1, 0.9)};
}

json record_of(const light_hit& x, const json& weight) {
    return {{"technique", "light_hit"},
            {"camera_vertices", 3},
            {"weight", weight},
            {"counts", {{"light_hit", 1}, {"next_event", 1}}},
            {"vertices",
             {{{"kind", "camera"}, {"pdf_to_light", 1}, {"cos_to_light", 1}, {"distance", 1}},
              {{"kind", "surface"},
               {"pdf_to_light", x.pdf},
               {"pdf_to_camera", 0.3},
               {"cos_to_camera", 1},
               {"cos_to_light", 1},
               {"distance", 2},
               {"survival", x.survival}},
              {{"kind", "light"},
               {"pdf_to_camera", 0.4},
               {"cos_to_camera", 0.5},
               {"pdf_position", 0.1},
               {"pdf_next_event", x.next_event},
               {"selection", x.selection}}}}};
}

// So many random hits, with the weights of a renderer.
template <class Weight> std::vector<json> dump_of(int count, Weight&& weight) {
    test::generator g(1);
    std::vector<json> records;
    for (int i = 0; i < count; ++i) {
        const light_hit x = random_hit(g);
        records.push_back(record_of(x, weight(x)));
    }
    return records;
}
double right_weight(const light_hit& x) { return x.right_weight(); }
double without_selection(const light_hit& x) {
    return x.at_light() / (x.at_light() + x.next_event / x.selection);
}
double without_survival(const light_hit& x) {
    return x.at_light() / (x.at_light() + x.next_event * x.survival);
}
double without_both(const light_hit& x) {
    return x.at_light() / (x.at_light() + x.next_event * x.survival / x.selection);
}

// A light hit of five vertices whose density per area is the same at all of them.
json with_area_densities(double density, const char* heuristic, const json& weight) {
    json record{{"technique", "light_hit"},
                {"camera_vertices", 5},
                {"weight", weight},
                {"heuristic", heuristic},
                {"counts", {{"light_hit", 1}, {"next_event", 1}}}};
    for (int i = 0; i < 5; ++i)
        record["vertices"].push_back({{"kind", i == 0   ? "camera"
                                               : i == 4 ? "light"
                                                        : "surface"},
                                      {"density_from_camera", i == 0 ? 1 : density},
                                      {"density_from_light", density}});
    record["vertices"][4]["pdf_next_event"] = density;
    return record;
}

const std::string ordinary = record_of({}, light_hit{}.right_weight()).dump() + "\n";

} // namespace

TEST_CASE("right weights: no suspect, status 0") {
    const checked c = check_records(dump_of(100, right_weight));
    CHECK(c.status == 0);
    CHECK(lines_that_begin(c, "suspect:") == 0);
    CHECK(c.as_json["all"]["records"] == 100);
    CHECK(c.as_json["all"]["agreeing"] == 100);
    CHECK(c.as_json["all"]["largest_error"] < 1e-12);
    CHECK(c.as_json["techniques"][0]["technique"] == "light_hit");
    CHECK(c.as_json["techniques"][0]["vertices"] == 3);
    CHECK(c.as_json["suspects"].empty());
    CHECK(c.as_json["unexplained"] == false);
    CHECK(c.as_json["missing_fields"].empty());
    CHECK(!c.as_json.contains("failure"));
}

TEST_CASE("a mistake in all weights is named, status 1") {
    const checked c = check_records(dump_of(100, without_selection));
    CHECK(c.status == 1);
    CHECK(lines_that_begin(c, "suspect:") == 1);
    CHECK(lines_that_begin(c, "suspect: selection_omitted\n") == 1);
    CHECK(has(c, "  Explains 100 of 100 wrong weights, would change 0 of 0 right ones.\n"));
    CHECK(has(c, "weights that disagree: 100\n  line 1: light_hit of 3 vertices, weight "));
    REQUIRE(c.as_json["suspects"].size() == 1);
    const json& s = c.as_json["suspects"][0];
    CHECK(s["identifier"] == "selection_omitted");
    CHECK(s["changes"] == 100);
    CHECK(has(c, "  " + s["what"].get<std::string>() + "\n"));
    CHECK(has(c, "  " + s["advice"].get<std::string>() + "\n"));
    REQUIRE(s["examples"].size() == 2);
    for (const json& e : s["examples"]) {
        CHECK(e["weight"] == doctest::Approx(e["predicted"].get<double>()).epsilon(1e-9));
        CHECK(e["weight"] != doctest::Approx(e["right"].get<double>()).epsilon(1e-3));
        CHECK(has(c, "  line " + std::to_string(e["line"].get<int>()) + ": weight "));
    }
    CHECK(c.as_json["explained"] == 100);
    CHECK(c.as_json["looked_at"] == 100);
    CHECK(c.as_json["disagreeing"].size() == 5);
}

TEST_CASE("several suspects, and how much they explain together") {
    const checked c = check_records(dump_of(200, without_both));
    CHECK(c.status == 1);
    CHECK(lines_that_begin(c, "suspect:") == 2);
    CHECK(lines_that_begin(c, "suspect: selection_omitted\n") == 1);
    CHECK(lines_that_begin(c, "suspect: roulette_") == 1);
    CHECK(lines_that_begin(c, "  Needed for 200 of 200 wrong weights.") == 2);
    CHECK(has(c, "\nTogether: explain 200 of 200 wrong weights, would change 0 of 0 right ones.\n"));
    REQUIRE(c.as_json["suspects"].size() == 2);
    for (const json& s : c.as_json["suspects"])
        CHECK(lines_that_begin(c, "suspect: " + s["identifier"].get<std::string>() + "\n") == 1);
}

TEST_CASE("of many wrong weights, the suspects are searched in a random sample") {
    const checked c = check_records(dump_of(3000, without_both));
    CHECK(has(c, "\nTogether: explain 2000 of 2000 wrong weights, would change 0 of 0 right ones.\nThese "
                 "numbers are those of a random sample.\n"));
    CHECK(c.as_json["all"]["disagreeing"] == 3000);
    CHECK(c.as_json["looked_at"] == 2000);
}

TEST_CASE("weights that no mistake explains") {
    test::generator g(2);
    const checked c = check_records(dump_of(100, [&](const light_hit&) { return g.uniform(); }));
    CHECK(c.status == 1);
    CHECK(lines_that_begin(c, "suspect:") == 1);
    CHECK(lines_that_begin(c, "suspect: unexplained\n") == 1);
    CHECK(c.as_json["suspects"].empty());
    CHECK(c.as_json["unexplained"] == true);
}

TEST_CASE("fields that would tell more") {
    auto records = dump_of(100, without_survival);
    for (json& record : records)
        record["vertices"][1].erase("survival");
    const checked c = check_records(records);
    CHECK(c.status == 1);
    CHECK(lines_that_begin(c, "suspect: unexplained\n") == 1);
    CHECK(has(c, "\nSome records lack survival. Without it these cannot be told: roulette_omitted, "
                 "roulette_one_sided\n"));
    CHECK(c.as_json["missing_fields"]["survival"] == json{"roulette_omitted", "roulette_one_sided"});
    CHECK(!c.as_json["missing_fields"].contains("selection"));

    // Nothing is left to be told where a suspect explains everything.
    records = dump_of(100, without_selection);
    for (json& record : records)
        record["vertices"][1].erase("survival");
    const checked all = check_records(records);
    CHECK(lines_that_begin(all, "suspect: selection_omitted\n") == 1);
    CHECK(lines_that_begin(all, "Some records lack") == 0);
    CHECK(all.as_json["missing_fields"].empty());
}

TEST_CASE("ties of the maximum heuristic: a suspect without a wrong weight has status 1") {
    const auto ties = [](int count, int first_lost) {
        std::vector<json> records;
        test::generator g(3);
        for (int i = 0; i < count; ++i) {
            light_hit x = random_hit(g);
            x.next_event = x.at_light();
            records.push_back(record_of(x, i < first_lost ? 1 : 0));
            records.back()["heuristic"] = "maximum";
        }
        return check_records(records);
    };
    const checked always = ties(40, 40);
    CHECK(always.status == 1);
    CHECK(always.as_json["all"]["disagreeing"] == 0);
    CHECK(always.as_json["all"]["undecided"] == 40);
    CHECK(lines_that_begin(always, "suspect: maximum_tie\n") == 1);
    CHECK(always.as_json["suspects"][0]["identifier"] == "maximum_tie");
    CHECK(always.as_json["unexplained"] == false);

    const checked by_rounding = ties(40, 20); // 20 won, 20 lost
    CHECK(by_rounding.status == 0);
    CHECK(by_rounding.as_json["all"]["undecided"] == 40);
    CHECK(lines_that_begin(by_rounding, "suspect:") == 0);
}

// ---- Weights that are no numbers ----

TEST_CASE("a weight that is no number, from a density that is none: its line and vertex") {
    for (const char* bad : {"nan", "inf", "-inf"}) {
        json record = record_of({}, bad);
        record["vertices"][2]["pdf_to_camera"] = bad;
        const checked c = check_file(ordinary + "\n" + record.dump());
        CHECK(c.status == 1);
        CHECK(has(c, "\nweights that are no numbers: 1\n  line 3: weight " + std::string(bad) +
                         ", vertex 2: \"pdf_to_camera\" is negative or not finite\n"));
        CHECK(c.as_json["weights_no_numbers"] == 1);
        REQUIRE(c.as_json["no_numbers"].size() == 1);
        CHECK(c.as_json["no_numbers"][0]["line"] == 3);
        CHECK(has(c, c.as_json["no_numbers"][0]["what"].get<std::string>()));
        CHECK(c.as_json["all"]["unusable"] == 1);
        CHECK(c.as_json["unusable"][0]["what"] == "vertex 2: \"pdf_to_camera\" is negative or not finite");
    }
    json first = record_of({}, "nan"); // of several, the one nearest to the camera
    for (std::size_t i = 1; i < 3; ++i)
        first["vertices"][i]["cos_to_camera"] = -1;
    CHECK(has(check_records({first}),
              "line 1: weight nan, vertex 1: \"cos_to_camera\" is negative or not finite\n"));
    json counts = record_of({}, "nan");
    counts["counts"]["next_event"] = "nan";
    CHECK(has(check_records({counts}), "line 1: weight nan, \"counts\" is negative or not finite\n"));
}

TEST_CASE("a weight that is no number, from a product of densities that leaves float") {
    // 1e-10 squared at vertices 1, 2, 3: 1e-20, 1e-40, 1e-60; float ends at 1e-45.
    const checked small = check_records({with_area_densities(1e-10, "power", "nan")});
    CHECK(small.status == 1);
    CHECK(
        has(small,
            "  line 1: weight nan, should be 0.5: from vertex 3 on, the product of densities is 0 or leaves "
            "the range of float\n"));
    CHECK(has(check_records({with_area_densities(1e10, "power", "inf")}),
              "weight inf, should be 0.5: from vertex 2 on"));
    CHECK(has(check_records({with_area_densities(1e-20, "balance", "nan")}),
              "weight nan, should be 0.5: from vertex 3 on"));
}

TEST_CASE("a weight that is no number, from nothing of the record") {
    for (const auto& [weight, text] :
         {std::pair<json, const char*>{"nan", "nan"}, {nullptr, "nan"}, {"inf", "inf"}, {-0.25, "-0.25"}}) {
        const checked c = check_records({with_area_densities(1e-10, "balance", weight)});
        CHECK(c.status == 1);
        CHECK(has(c, "  line 1: weight " + std::string(text) +
                         ", should be 0.5: all densities are ordinary numbers\n"));
        CHECK(c.as_json["all"]["disagreeing"] == 1);
        CHECK(c.as_json["disagreeing"].empty()); // not told twice
    }
}

TEST_CASE("a weight that is no number in a record that lacks a density") {
    json record = record_of({}, "nan");
    record["vertices"][1].erase("pdf_to_light");
    const checked c = check_records({record});
    CHECK(c.status == 2);
    CHECK(has(c, "weight nan, vertex 2: \"density_from_camera\" is missing, or what it follows from\n"));
    CHECK(c.text.find("should be") == std::string::npos);
}

TEST_CASE("a bad density where the weight is a number: unusable, status 1") {
    json record = record_of({}, 0.5);
    record["vertices"][1]["pdf_to_light"] = -1;
    const checked c = check_file(ordinary + record.dump());
    CHECK(c.status == 1);
    CHECK(has(c, "\nrecords whose weight cannot be computed: 1\n  line 2: vertex 1: \"pdf_to_light\" is "
                 "negative or not finite\n"));
    CHECK(c.as_json["weights_no_numbers"] == 0);
}

TEST_CASE("a weight that is no number does not agree with what follows from no number") {
    const auto unusable = [](const char* heuristic, const char* key, const json& value, const char* fault) {
        json record = record_of({}, "nan");
        record["heuristic"] = heuristic;
        record[key] = value;
        const checked c = check_records({record});
        CHECK(c.status == 1);
        CHECK(c.as_json["all"]["agreeing"] == 0);
        CHECK(has(c, "line 1: weight nan, \"" + std::string(key) + "\" is " + fault + "\n"));
    };
    for (const char* bad : {"nan", "inf", "-inf"}) {
        unusable("power", "beta", bad, "negative or not finite");
        unusable("cutoff", "alpha", bad, "not between 0 and 1");
        unusable("balance", "radius", bad, "negative or not finite");
    }
    unusable("power", "beta", -1, "negative or not finite");
    unusable("cutoff", "alpha", 2, "not between 0 and 1");
    unusable("balance", "radius", -0.1, "negative or not finite");
}

TEST_CASE("weights that are all 1 are unweighted; coin flips are unexplained") {
    const checked ones = check_records(dump_of(300, [](const light_hit&) { return 1; }));
    CHECK(lines_that_begin(ones, "suspect:") == 1);
    CHECK(lines_that_begin(ones, "suspect: unweighted\n") == 1);
    test::generator g(4);
    const checked coin = check_records(dump_of(300, [&](const light_hit&) { return g.chance(0.5) ? 1 : 0; }));
    CHECK(lines_that_begin(coin, "suspect: unexplained\n") == 1);
    CHECK(coin.as_json["closest"].empty());
}

TEST_CASE("a mistake of one material is said to be of that one, and one of random paths how often it shows") {
    const auto mixture = [](auto&& is_wrong, bool is_material) {
        test::generator g(6);
        std::vector<json> records;
        for (int i = 0; i < 1000; ++i) {
            const light_hit x = random_hit(g);
            const bool wrong = is_wrong(g);
            records.push_back(record_of(x, wrong ? without_selection(x) : right_weight(x)));
            if (is_material)
                records.back()["vertices"][1]["material"] = wrong ? 7 : g.integer(0, 6);
        }
        return check_records(records);
    };
    const auto tenth = [](test::generator& g) { return g.chance(0.1); };
    const checked material = mixture(tenth, true);
    CHECK(lines_that_begin(material, "suspect: selection_omitted, in paths with material 7 only\n") == 1);
    CHECK(material.as_json["suspects"][0]["where"] == "in paths with material 7 only");
    CHECK(material.as_json["suspects"][0]["prevalence"] == 1);
    CHECK(material.as_json["spoiled"] == 0);
    const checked random = mixture(tenth, false);
    CHECK(lines_that_begin(random, "suspect: selection_omitted\n") == 1);
    CHECK(random.as_json["suspects"][0]["prevalence"].get<double>() == doctest::Approx(0.1).epsilon(0.2));
    CHECK(lines_that_begin(random, "  It shows in ") == 1);
}

TEST_CASE("a count that the records do not have is fitted") {
    const checked c = check_records(dump_of(200, [](const light_hit& x) {
        return x.at_light() / (x.at_light() + 3.7 * x.next_event); // 3.7 next events
    }));
    CHECK(lines_that_begin(c, "suspect: wrong_constant\n") == 1);
    CHECK(has(c, "  The weights follow if next events counted 3.7 instead of 1.\n"));
    CHECK(c.as_json["suspects"][0]["fitted"].get<double>() == doctest::Approx(3.7).epsilon(1e-6));
    CHECK(c.as_json["suspects"][0]["given"] == 1);
}

// ---- Input that cannot be read ----

TEST_CASE("lines that are no records are counted, the first five shown, status 2") {
    std::string file = ordinary;
    for (int i = 0; i < 7; ++i)
        file += "no record\n\n";
    file += ordinary;
    const checked c = check_file(file);
    CHECK(c.status == 2);
    CHECK(has(c, "\nlines that are no records: 7\n  line 2: not JSON: "));
    CHECK(has(c, "\n  line 10: not JSON: "));
    CHECK(c.text.find("line 12:") == std::string::npos);
    CHECK(has(c, "\n  ...\n"));
    CHECK(c.as_json["malformed_lines"] == 7);
    REQUIRE(c.as_json["malformed"].size() == 5);
    CHECK(c.as_json["malformed"][4]["line"] == 10);
    CHECK(c.as_json["all"]["records"] == 2);
    CHECK(c.as_json["all"]["agreeing"] == 2);
}

TEST_CASE("records that lack a density: status 2") {
    json record = record_of({}, 0.5);
    record["vertices"][1].erase("distance");
    const checked c = check_file(ordinary + record.dump());
    CHECK(c.status == 2);
    CHECK(has(c, "  line 2: vertex 2: \"density_from_camera\" is missing, or what it follows from\n"));
    CHECK(c.as_json["all"]["unusable"] == 1);
}

TEST_CASE("no record at all: status 2") {
    for (const char* empty : {"", "\n\n", "no record\n"})
        CHECK(check_file(empty).status == 2);
}

TEST_CASE("input that breaks off: what has been read is reported, with why, status 2") {
    // The header of a gzip file, then a stored block that is cut off.
    std::string file("\x1f\x8b\x08\0\0\0\0\0\0\xff", 10);
    const std::size_t promised = ordinary.size() + 1;
    file += '\1';
    for (const std::size_t length : {promised, ~promised})
        for (const int shift : {0, 8})
            file += static_cast<char>(length >> shift & 0xff);
    const checked c = check_file(file + ordinary);
    CHECK(c.status == 2);
    CHECK(has(c, "\nthe input could not be read to its end: the compressed data is cut off\n"));
    CHECK(c.as_json["failure"] == "the compressed data is cut off");
    CHECK(c.as_json["all"]["records"] == 1);
    CHECK(c.as_json["all"]["agreeing"] == 1);
}
