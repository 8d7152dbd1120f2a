// SPDX-License-Identifier: MIT
// The reader of path dumps: what it takes from a line, and what it says about lines that it cannot take.
#include "fuzz/temporary_file.hpp"
#include "reader.hpp"
#include "ulp.hpp"

#include <chrono>
#include <cmath>
#include <doctest/doctest.h>
#include <fcntl.h>
#include <mis/verify/dump.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

namespace {

using check_paths::read_status;
using json = nlohmann::json;

// All that a file gives: records, and the other lines' numbers with their errors.
struct contents {
    std::vector<mis::path_record> records;
    std::vector<std::pair<std::int64_t, std::string>> malformed;
    std::string failure;
};

// Reads as far as it goes; false where the reader is waiting.
bool read_on(check_paths::path_reader& reader, contents& c) {
    mis::path_record record;
    std::string error;
    for (;;) {
        const read_status status = check_paths::next_record(reader, record, error);
        CHECK(reader.lines.is_waiting == (status == read_status::waiting));
        switch (status) {
        case read_status::record:
            c.records.push_back(record);
            break;
        case read_status::malformed:
            c.malformed.emplace_back(reader.lines.line, error);
            break;
        case read_status::waiting:
            return false;
        case read_status::failed:
            c.failure = error;
            return true;
        case read_status::end:
            return true;
        }
    }
}

contents read_all(const std::string& file) {
    check_paths::path_reader reader;
    const int descriptor = test::temporary_file(file);
    REQUIRE(descriptor >= 0);
    REQUIRE(check_paths::open_lines(reader.lines, descriptor));
    contents c;
    REQUIRE(read_on(reader, c));
    return c;
}

mis::path_record read_one(const std::string& line) {
    const contents c = read_all(line);
    CAPTURE(line);
    if (!c.malformed.empty())
        FAIL(c.malformed[0].second);
    REQUIRE(c.records.size() == 1);
    return c.records[0];
}
mis::path_record read_one(const json& record) { return read_one(record.dump()); }

// Why a line is no record.
std::string error_of(const std::string& line) {
    const contents c = read_all(line);
    CAPTURE(line);
    CHECK(c.records.empty());
    REQUIRE(c.malformed.size() == 1);
    return c.malformed[0].second;
}
std::string error_of(const json& record) { return error_of(record.dump()); }

json vertex(const char* kind) { return {{"kind", kind}}; }

// camera, n - 2 surfaces, light, without anything that is not required.
json plain_record(const char* technique, int camera_vertices, int n) {
    json record{{"technique", technique},
                {"camera_vertices", camera_vertices},
                {"weight", 0.25},
                {"counts", json::object()},
                {"vertices", json::array({vertex("camera")})}};
    for (int i = 2; i < n; ++i)
        record["vertices"].push_back(vertex("surface"));
    record["vertices"].push_back(vertex("light"));
    return record;
}
json plain_record() { return plain_record("light_hit", 3, 3); }

// The same line with one text in place of another.
std::string replaced(std::string line, const std::string& from, const std::string& to) {
    const std::size_t at = line.find(from);
    REQUIRE(at != std::string::npos);
    return line.replace(at, from.size(), to);
}

std::string compressed(const std::string& text) {
    z_stream stream{};
    constexpr int with_gzip_header = 15 + 16;
    REQUIRE(deflateInit2(&stream, Z_BEST_SPEED, Z_DEFLATED, with_gzip_header, 8, Z_DEFAULT_STRATEGY) == Z_OK);
    std::string result(deflateBound(&stream, text.size()), '\0');
    stream.next_in = reinterpret_cast<unsigned char*>(const_cast<char*>(text.data()));
    stream.avail_in = static_cast<unsigned>(text.size());
    stream.next_out = reinterpret_cast<unsigned char*>(result.data());
    stream.avail_out = static_cast<unsigned>(result.size());
    REQUIRE(deflate(&stream, Z_FINISH) == Z_STREAM_END);
    result.resize(stream.total_out);
    deflateEnd(&stream);
    return result;
}

bool is_nan(double x) { return std::isnan(x); }

} // namespace

TEST_CASE("the fields of a record") {
    json j = plain_record("connection", 2, 5);
    j["weight"] = 0.31;
    j["heuristic"] = "power";
    j["beta"] = 1.5;
    j["alpha"] = 0.7;
    j["radius"] = 0.01;
    j["max_camera_vertices"] = 8;
    j["max_light_vertices"] = 7;
    j["counts"] = {{"light_hit", 1}, {"next_event", 2},   {"connection", 3}, {"camera_connection", 65536},
                   {"direct", 4},    {"camera_hit", 5.5}, {"merge", 6},      {"unknown", "ignored"}};
    j["throughput"] = {1, 2, 3};
    const mis::path_record r = read_one(j);
    CHECK(r.line == 1);
    CHECK(r.technique == mis::technique{mis::technique_kind::connection, 2});
    CHECK(r.weight == 0.31);
    CHECK(r.heuristic == mis::heuristic_kind::power);
    CHECK(r.parameter == 1.5);
    CHECK(r.radius == 0.01);
    CHECK(r.counts.max_camera_vertices == 8);
    CHECK(r.counts.max_light_vertices == 7);
    CHECK(r.counts.light_hit == 1);
    CHECK(r.counts.next_event == 2);
    CHECK(r.counts.connection == 3);
    CHECK(r.counts.camera_connection == 65536);
    CHECK(r.counts.direct == 4);
    CHECK(r.counts.camera_hit == 5.5);
    CHECK(r.counts.merge == 6);
    CHECK(r.vertices.size() == 5);
}

TEST_CASE("the defaults of a record, after one that has everything") {
    json full = plain_record("merge", 2, 3);
    full["heuristic"] = "power";
    full["beta"] = 3;
    full["radius"] = 1;
    full["counts"] = {{"merge", 6}, {"light_hit", 1}};
    full["max_light_vertices"] = 7;
    full["splits_on_arrival"] = true;
    full["vertices"][1]["survival"] = 0.5;
    full["vertices"][1]["splits"] = 2;
    const contents c = read_all(full.dump() + "\n" + plain_record().dump());
    REQUIRE(c.records.size() == 2);
    CHECK(c.records[0].splits_on_arrival);
    CHECK(c.records[0].vertices[1].splits == 2);
    const mis::path_record& r = c.records[1];
    CHECK(r.line == 2);
    CHECK(!r.splits_on_arrival);
    CHECK(r.heuristic == mis::heuristic_kind::balance);
    CHECK(r.parameter == 2);
    CHECK(!mis::is_given(r.radius));
    CHECK(r.counts.merge == 0);
    CHECK(r.counts.light_hit == 0);
    CHECK(r.counts.max_camera_vertices == INT_MAX);
    CHECK(r.counts.max_light_vertices == INT_MAX);
    CHECK(!mis::is_given(r.vertices[1].survival));
}

TEST_CASE("every technique with its numbers of camera vertices, and no other") {
    const std::vector<std::string> names{"camera_hit", "camera_connection", "direct",
                                         "connection", "next_event",        "light_hit"};
    for (int n = 2; n <= 6; ++n)
        for (int s = 0; s <= n + 1; ++s)
            for (std::size_t kind = 0; kind < names.size(); ++kind) {
                const json j = plain_record(names[kind].c_str(), s, n);
                const bool fits = s <= n && static_cast<std::size_t>(mis::technique_at(n, s).kind) == kind;
                const contents c = read_all(j.dump());
                CAPTURE(j.dump());
                REQUIRE(c.records.size() == (fits ? 1 : 0));
                if (fits)
                    CHECK(c.records[0].technique == mis::technique_at(n, s));
            }
    CHECK(error_of(plain_record("next_event", 2, 5)) ==
          "\"camera_vertices\" is 2, which is connection on a path of 5 vertices, not next_event");
    CHECK(error_of(plain_record("light_hit", 6, 5)) ==
          "\"camera_vertices\" is 6, but the path has 5 vertices");
}

TEST_CASE("merges") {
    const auto merge = [](int s, int n) {
        json j = plain_record("merge", s, n);
        j["counts"]["merge"] = 100;
        j["radius"] = 0.1;
        return j;
    };
    for (int s = 0; s <= 6; ++s) {
        CAPTURE(s);
        CHECK(read_all(merge(s, 5).dump()).records.size() == (s >= 2 && s <= 4 ? 1 : 0));
    }
    CHECK(error_of(merge(1, 5)) == "\"camera_vertices\" is 1, but a merge on a path of 5 vertices is at none "
                                   "but inner ones: 2 to 4");
    CHECK(error_of(merge(1, 2)) == "\"camera_vertices\" is 1, but a path of 2 vertices has no merges");
    json without_radius = merge(2, 3), without_count = merge(2, 3);
    without_radius.erase("radius");
    without_count["counts"].erase("merge");
    CHECK(error_of(without_radius) == "a merge needs \"radius\"");
    CHECK(error_of(without_count) == "a merge needs \"merge\" in \"counts\"");
}

TEST_CASE("heuristics and their parameters") {
    const std::vector<std::pair<const char*, mis::heuristic_kind>> heuristics{
        {"average", mis::heuristic_kind::average},
        {"balance", mis::heuristic_kind::balance},
        {"power", mis::heuristic_kind::power},
        {"cutoff", mis::heuristic_kind::cutoff},
        {"maximum", mis::heuristic_kind::maximum}};
    for (const auto& [name, kind] : heuristics) {
        json j = plain_record();
        j["heuristic"] = name;
        CHECK(read_one(j).heuristic == kind);
        CHECK(read_one(j).parameter == (kind == mis::heuristic_kind::cutoff ? 0.1 : 2));
    }
    json j = plain_record();
    j["heuristic"] = "cutoff";
    j["alpha"] = 0.5;
    j["beta"] = 7;
    CHECK(read_one(j).parameter == 0.5);
}

TEST_CASE("each number of a vertex goes to its own place") {
    using x = mis::recorded_vertex;
    const std::vector<std::pair<const char*, double x::*>> fields{
        {"pdf_to_light", &x::pdf_to_light},
        {"pdf_to_camera", &x::pdf_to_camera},
        {"pdf_position", &x::pdf_position},
        {"pdf_next_event", &x::pdf_next_event},
        {"pdf_distance_from_camera", &x::pdf_distance_from_camera},
        {"pdf_distance_from_light", &x::pdf_distance_from_light},
        {"merge_factor", &x::merge_factor},
        {"cos_to_camera", &x::cos_to_camera},
        {"cos_to_light", &x::cos_to_light},
        {"density_from_camera", &x::density_from_camera},
        {"density_from_light", &x::density_from_light},
        {"survival", &x::survival},
        {"splits", &x::splits},
        {"splits_to_camera", &x::splits_to_camera},
        {"selection", &x::selection},
        {"selection_next_event", &x::selection_next_event},
        {"eta_to_camera", &x::eta_to_camera},
        {"eta_to_light", &x::eta_to_light},
        {"beam_from_camera", &x::beam_from_camera},
        {"beam_from_light", &x::beam_from_light},
        {"sin_angle", &x::sin_angle},
        {"pass_from_camera", &x::pass_from_camera},
        {"pass_from_light", &x::pass_from_light}};
    for (const auto& [name, member] : fields) {
        json j = plain_record();
        j["vertices"][1][name] = 0.375;
        const mis::path_record r = read_one(j), none = read_one(plain_record());
        for (const auto& field : fields) {
            const double expected = field.second == member ? 0.375 : none.vertices[1].*field.second;
            INFO("field ", field.first);
            CHECK(r.vertices[1].*field.second == expected);
        }
        j["vertices"][1][name] = {1};
        CHECK(error_of(j) == "vertex 1: \"" + std::string(name) + "\" is an array, not a number");
    }
    json j = plain_record();
    j["vertices"][1]["distance"] = 3;
    j["vertices"][1]["photon"] = {{"survival", 0.25}};
    CHECK(read_one(j).vertices[1].distance2_to_light == 9);
    CHECK(read_one(j).vertices[1].photon_survival == 0.25);
    CHECK(!mis::is_given(read_one(j).vertices[1].survival));
    j["vertices"][1]["distance"] = -3;
    CHECK(read_one(j).vertices[1].distance2_to_light == -9);
}

TEST_CASE("the defaults of vertices") {
    const mis::path_record r = read_one(plain_record());
    const mis::recorded_vertex &camera = r.vertices[0], &surface = r.vertices[1], &light = r.vertices[2];
    CHECK(camera.kind == mis::vertex_kind::camera);
    CHECK(camera.dirac);
    CHECK(camera.pdf_position == 1);
    CHECK(!mis::is_given(camera.pdf_next_event));
    CHECK(surface.kind == mis::vertex_kind::surface);
    CHECK(!surface.dirac);
    CHECK(!mis::is_given(surface.pdf_position));
    CHECK(surface.pdf_distance_from_camera == 1);
    CHECK(surface.pdf_distance_from_light == 1);
    CHECK(surface.merge_factor == 1);
    CHECK(surface.splits == 1);
    CHECK(!mis::is_given(surface.splits_to_camera));
    CHECK(light.kind == mis::vertex_kind::light);
    CHECK(!light.dirac);
    CHECK(!mis::is_given(light.pdf_position));
    json j = plain_record();
    j["vertices"][0]["dirac"] = false;
    j["vertices"][2]["dirac"] = true;
    CHECK(!read_one(j).vertices[0].dirac);
    CHECK(read_one(j).vertices[2].dirac);
}

TEST_CASE("boundaries that edges pass") {
    json j = plain_record("connection", 2, 5);
    j["vertices"][0]["boundaries"] = {{{"distance", 2}, {"cos", 0.5}}};
    j["vertices"][3]["boundaries"] = {{{"distance", 1}, {"cos", 0.25}, {"pass_from_light", 0.125}},
                                      {{"distance", 3}, {"cos", 1}, {"pass_from_camera", 0.75}}};
    const contents c = read_all(j.dump() + "\n" + plain_record().dump());
    REQUIRE(c.records.size() == 2);
    const auto& found = c.records[0].boundaries;
    REQUIRE(found.size() == 3);
    CHECK(found[0].edge == 0);
    CHECK(found[0].distance == 2);
    CHECK(found[0].cosine == 0.5);
    CHECK(found[0].pass_from_camera == 1);
    CHECK(found[0].pass_from_light == 1);
    CHECK(found[1].edge == 3);
    CHECK(found[1].pass_from_light == 0.125);
    CHECK(found[2].edge == 3);
    CHECK(found[2].distance == 3);
    CHECK(found[2].pass_from_camera == 0.75);
    CHECK(c.records[1].boundaries.empty());
    const auto error_with = [&](const json& boundaries) {
        json bad = plain_record();
        bad["vertices"][1]["boundaries"] = boundaries;
        return error_of(bad);
    };
    CHECK(error_with(1) == "vertex 1: \"boundaries\" is a number, not an array");
    CHECK(error_with({1}) == "vertex 1: \"boundaries\" is a number, not an object");
    CHECK(error_with({{{"cos", 1}}}) == "vertex 1: boundaries: \"distance\" is missing");
    CHECK(error_with({{{"distance", 1}}}) == "vertex 1: boundaries: \"cos\" is missing");
    CHECK(error_with({{{"distance", "far"}, {"cos", 1}}}) ==
          "vertex 1: \"distance\" is a string, not a number");
    CHECK(read_one(replaced(j.dump(), R"("kind":"camera")",
                            R"("boundaries":[{"distance":1,"cos":1}],"kind":"camera")"))
              .boundaries.size() == 3); // of duplicate keys the last
}

TEST_CASE("kinds of vertices, and where they may be") {
    json j = plain_record("light_hit", 5, 5);
    j["vertices"][1]["kind"] = "dirac";
    j["vertices"][2]["kind"] = "medium";
    j["vertices"][4]["kind"] = "infinite_light";
    const mis::path_record r = read_one(j);
    CHECK(r.vertices[1].kind == mis::vertex_kind::dirac);
    CHECK(r.vertices[2].kind == mis::vertex_kind::medium);
    CHECK(r.vertices[4].kind == mis::vertex_kind::infinite_light);
    const auto with_kind = [](int i, const char* kind) {
        json k = plain_record();
        k["vertices"][static_cast<std::size_t>(i)]["kind"] = kind;
        return k;
    };
    CHECK(error_of(with_kind(0, "surface")) ==
          "vertex 0: \"kind\" is surface, but a path starts at a camera");
    CHECK(error_of(with_kind(2, "medium")) ==
          "vertex 2: \"kind\" is medium, but a path ends at a light or infinite_light");
    for (const char* kind : {"camera", "light", "infinite_light"})
        CHECK(error_of(with_kind(1, kind)) ==
              "vertex 1: \"kind\" is " + std::string(kind) + ", which only an end of a path may be");
    CHECK(error_of(with_kind(1, "mirror")) == "vertex 1: \"kind\" is \"mirror\", not one of camera, surface, "
                                              "dirac, medium, light, infinite_light");
}

TEST_CASE("what is missing") {
    for (const char* key : {"technique", "camera_vertices", "weight", "counts", "vertices"}) {
        json j = plain_record();
        j.erase(key);
        CHECK(error_of(j) == "\"" + std::string(key) + "\" is missing");
    }
    json j = plain_record();
    j["vertices"][2].erase("kind");
    CHECK(error_of(j) == "vertex 2: \"kind\" is missing");
    j["vertices"] = json::array({vertex("camera")});
    CHECK(error_of(j) == "a path has at least 2 vertices, not 1");
    CHECK(error_of(std::string("{}")) == "\"technique\" is missing");
}

TEST_CASE("wrong types and values") {
    const auto with = [](const char* key, const json& value) {
        json j = plain_record();
        j[key] = value;
        return error_of(j);
    };
    CHECK(with("technique", 1) == "\"technique\" is a number, not a string");
    CHECK(with("technique", "photon") ==
          "\"technique\" is \"photon\", not one of camera_hit, camera_connection, direct, connection, "
          "next_event, light_hit, merge");
    CHECK(with("technique", "a\nb\x1b") ==
          "\"technique\" is \"a?b?\", not one of camera_hit, camera_connection, direct, connection, "
          "next_event, light_hit, merge");
    CHECK(with("heuristic", nullptr) == "\"heuristic\" is null, not a string");
    CHECK(with("heuristic", "best") ==
          "\"heuristic\" is \"best\", not one of average, balance, power, cutoff, maximum");
    CHECK(with("camera_vertices", "3") == "\"camera_vertices\" is a string, not a number");
    CHECK(with("camera_vertices", 2.5) ==
          "\"camera_vertices\" is 2.5, not a whole number from 0 to 2147483647");
    CHECK(with("camera_vertices", nullptr) ==
          "\"camera_vertices\" is nan, not a whole number from 0 to 2147483647");
    CHECK(with("max_light_vertices", -1) ==
          "\"max_light_vertices\" is -1, not a whole number from 0 to 2147483647");
    CHECK(with("weight", true) == "\"weight\" is true or false, not a number");
    CHECK(with("weight", "0.5") == "\"weight\" is a string, not a number");
    CHECK(with("counts", {1, 2}) == "\"counts\" is an array, not an object");
    CHECK(with("counts", {{"merge", {1}}}) == "counts: \"merge\" is an array, not a number");
    CHECK(with("vertices", {{"kind", "camera"}}) == "\"vertices\" is an object, not an array");
    CHECK(with("vertices", {1, 2}) == "vertex 0: is a number, not an object");
    const auto with_field = [](const char* key, const json& value) {
        json j = plain_record();
        j["vertices"][1][key] = value;
        return error_of(j);
    };
    CHECK(with_field("kind", 3) == "vertex 1: \"kind\" is a number, not a string");
    CHECK(with_field("pdf_to_light", "much") == "vertex 1: \"pdf_to_light\" is a string, not a number");
    CHECK(with_field("dirac", 1) == "vertex 1: \"dirac\" is a number, not true or false");
    CHECK(with_field("position", {{"x", 1}}) ==
          "vertex 1: \"position\" is an object, not an array of 3 numbers");
    CHECK(with_field("normal", json::array({1})) == "vertex 1: \"normal\" has 1 number, not 3");
    CHECK(with_field("direction", {1, 2, 3, 4}) == "vertex 1: \"direction\" has more than 3 numbers");
    CHECK(with_field("shading_normal", {1, 2, "up"}) ==
          "vertex 1: \"shading_normal\" is a string, not a number");
    CHECK(with_field("photon", 1) == "vertex 1: \"photon\" is a number, not an object");
    CHECK(error_of(std::string("[1]")) == "the line is an array, not an object");
    CHECK(error_of(std::string("true")) == "the line is true or false, not an object");
}

TEST_CASE("spellings of NaN and infinity") {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const std::string line = replaced(plain_record().dump(), "0.25", "@");
    const auto weight = [&](const std::string& spelling) {
        return read_one(replaced(line, "@", spelling)).weight;
    };
    for (const char* word : {"nan", "-nan", "NaN", "NAN", "nan(ind)", "-nan(ind)", "nan(snan)"}) {
        CAPTURE(word);
        CHECK(is_nan(weight(word)));
        CHECK(is_nan(weight("\"" + std::string(word) + "\"")));
    }
    CHECK(is_nan(weight("null")));
    for (const char* word : {"inf", "INF", "+inf", "infinity", "Infinity"}) {
        CAPTURE(word);
        CHECK(weight(word) == infinity);
        CHECK(weight("-" + std::string(word).substr(word[0] == '+')) == -infinity);
        CHECK(weight("\"" + std::string(word) + "\"") == infinity);
    }
    CHECK(error_of(replaced(line, "@", "nano")).rfind("not JSON: ", 0) == 0);
    CHECK(error_of(replaced(line, "@", "\"-\"")) == "\"weight\" is a string, not a number");
    CHECK(weight("-0.5") == -0.5);

    // Words inside strings stay, whatever quotes they have around them.
    const std::string comment = R"({"comment":"nan, \"inf\", \\",)";
    const mis::path_record r = read_one(replaced(replaced(line, "{", comment), "@", "nan"));
    CHECK(is_nan(r.weight));
    json j = plain_record();
    j["vertices"][1]["position"] = {nullptr, 1, 2};
    j["vertices"][2]["position"] = {0, 0, 0};
    CHECK(is_nan(read_one(j).vertices[1].distance2_to_light));
}

TEST_CASE("numbers as writers write them") {
    const std::string line = replaced(plain_record().dump(), "0.25", "@");
    const auto weight = [&](const std::string& number) {
        return read_one(replaced(line, "@", number)).weight;
    };
    CHECK(weight("100000000000000000000000") == 1e23);
    CHECK(weight("-100000000000000000000000") == -1e23);
    CHECK(weight("18446744073709551615") == 18446744073709551615.0);
    CHECK(weight("1e-400") == 0);
    CHECK(weight("4.9e-324") == 4.9e-324);
    CHECK(error_of(replaced(line, "@", "1e400")) == "not JSON: Problem while parsing a number");
    CHECK(read_one(replaced(plain_record().dump(), "\"camera_vertices\":3", "\"camera_vertices\":3.0"))
              .technique.camera_vertices == 3);
}

TEST_CASE("of duplicate keys the last wins") {
    const std::string line = plain_record().dump();
    CHECK(read_one(replaced(line, "{", R"({"weight":7,)")).weight == 0.25);
    const auto counts =
        read_one(replaced(line, "\"counts\":{}", R"("counts":{"merge":3,"direct":1},"counts":{"direct":2})"))
            .counts;
    CHECK(counts.merge == 0);
    CHECK(counts.direct == 2);
    json merge = plain_record("merge", 2, 3);
    merge["radius"] = 1;
    CHECK(error_of(replaced(merge.dump(), "{", R"({"counts":{"merge":1},)")) ==
          "a merge needs \"merge\" in \"counts\"");
    CHECK(read_one(replaced(line, "{", R"({"vertices":[{"kind":"camera"},{"kind":"light"}],)"))
              .vertices.size() == 3);
}

TEST_CASE("line ends, blank lines, byte order mark, no final newline") {
    const std::string line = plain_record().dump();
    const contents c = read_all("\xef\xbb\xbf" + line + "\r\n\r\n \t\nx\r\n" + line);
    REQUIRE(c.records.size() == 2);
    CHECK(c.records[0].line == 1);
    CHECK(c.records[1].line == 5);
    REQUIRE(c.malformed.size() == 1);
    CHECK(c.malformed[0].first == 4);
    CHECK(c.failure.empty());
    CHECK(read_all(line + "\n").records.size() == 1);
    for (const char* empty : {"", "\n", "\r\n\r\n", " "}) {
        const contents nothing = read_all(empty);
        CHECK(nothing.records.empty());
        CHECK(nothing.malformed.empty());
        CHECK(nothing.failure.empty());
    }
}

TEST_CASE("lines that are no JSON") {
    const std::string line = plain_record().dump();
    for (std::size_t length = 1; length < line.size(); ++length)
        CHECK(error_of(line.substr(0, length)).rfind("not JSON: ", 0) == 0);
    CHECK(error_of(std::string("{\"a\":\"\xff\xfe\"}")) == "not JSON: The input is not valid UTF-8");
    CHECK(error_of(std::string("a\0b", 3)).rfind("not JSON: ", 0) == 0);
    CHECK(error_of(line + line).rfind("not JSON: ", 0) == 0);
    CHECK(error_of(replaced(line, "0.25", "0.25 \"nan")).rfind("not JSON: ", 0) == 0);
    const std::string open(5000, '['), closed(5000, ']');
    for (const std::string& nested : {open, open + closed, "{\"weight\":" + open + closed + "}"})
        CHECK(error_of(nested).rfind("not JSON: ", 0) == 0);
}

TEST_CASE("lines longer than the buffer, and longer than may be") {
    const std::string line = plain_record().dump();
    const auto padded = [&](std::size_t length) {
        const std::string around = replaced(line, "{", "{\"comment\":\"\",");
        return replaced(around, "\"comment\":\"",
                        "\"comment\":\"" + std::string(length - around.size(), '.'));
    };
    constexpr std::size_t mebibyte = 1 << 20, buffer = mebibyte / 4;
    for (const std::size_t length : {buffer - 1, buffer, buffer + 1, mebibyte, 16 * mebibyte}) {
        CAPTURE(length);
        const std::string text = padded(length);
        REQUIRE(text.size() == length);
        const contents c = read_all(line + "\n" + text + "\n" + line);
        CHECK(c.records.size() == 3);
        CHECK(c.malformed.empty());
    }
    for (const std::size_t length : {16 * mebibyte + 1, 16 * mebibyte + 300000, 40 * mebibyte}) {
        const std::string text = padded(length);
        for (const contents& c : {read_all(line + "\n" + text + "\n" + line), read_all(line + "\n" + text)}) {
            CAPTURE(length);
            REQUIRE(c.malformed.size() == 1);
            CHECK(c.malformed[0].first == 2);
            CHECK(c.malformed[0].second == "the line is longer than 16 MiB");
        }
        const contents c = read_all(line + "\n" + text + "\n" + line);
        REQUIRE(c.records.size() == 2);
        CHECK(c.records[1].line == 3);
    }
    CHECK(read_all(padded(17 * mebibyte)).malformed.size() == 1); // ends where a part that is skipped ends
}

TEST_CASE("paths of more vertices than may be") {
    const auto path = [](int n) { return plain_record("light_hit", n, n); };
    CHECK(read_one(path(1000)).vertices.size() == 1000);
    CHECK(error_of(path(1001)) == "a path has at most 1000 vertices, not 1001");
    const std::string line = plain_record().dump();
    CHECK(read_all(line + "\n" + path(1001).dump() + "\n" + line).records.size() == 2);
}

TEST_CASE("a line without an end is given up") {
    // a file with a hole: it takes no disk
    std::FILE* const file = std::tmpfile();
    REQUIRE(file);
    REQUIRE(ftruncate(fileno(file), (off_t(1) << 30) + (off_t(64) << 20)) == 0);
    check_paths::path_reader reader;
    REQUIRE(check_paths::open_lines(reader.lines, dup(fileno(file))));
    std::fclose(file);
    mis::path_record record;
    std::string error;
    CHECK(check_paths::next_record(reader, record, error) == read_status::failed);
    CHECK(error == "a line is longer than 1 GiB");
    CHECK(check_paths::next_record(reader, record, error) == read_status::failed);
    CHECK(reader.lines.buffer.size() < std::size_t(40) << 20);
}

TEST_CASE("lines that are skipped are not added up") {
    std::FILE* const file = std::tmpfile();
    REQUIRE(file);
    REQUIRE(ftruncate(fileno(file), off_t(1200) << 20) == 0);
    REQUIRE(pwrite(fileno(file), "\n", 1, off_t(600) << 20) == 1);
    check_paths::path_reader reader;
    REQUIRE(check_paths::open_lines(reader.lines, dup(fileno(file))));
    std::fclose(file);
    contents c;
    CHECK(read_on(reader, c));
    CHECK(c.failure.empty());
    REQUIRE(c.malformed.size() == 2);
    CHECK(c.malformed[1].second == "the line is longer than 16 MiB");
}

TEST_CASE("text of two or four bytes per character is called by its name") {
    const std::string line = plain_record().dump() + "\n";
    const auto widened = [&](std::size_t before, std::size_t after) {
        std::string wide;
        for (const char c : line)
            wide += std::string(before, '\0') + c + std::string(after, '\0');
        return wide;
    };
    const std::string utf16 = "the text is UTF-16, not UTF-8", utf32 = "the text is UTF-32, not UTF-8";
    for (const auto& [text, name] : {std::pair{widened(0, 1), utf16},
                                     {"\xff\xfe" + widened(0, 1), utf16},
                                     {widened(1, 0), utf16},
                                     {"\xfe\xff" + widened(1, 0), utf16},
                                     {widened(0, 3), utf32},
                                     {widened(3, 0), utf32},
                                     {std::string("\xff\xfe\0\0", 4) + widened(0, 3), utf32},
                                     {std::string("\0\0\xfe\xff", 4) + widened(3, 0), utf32}}) {
        for (const contents& c : {read_all(text), read_all(compressed(text))}) {
            CHECK(c.failure == name);
            CHECK(c.records.empty());
            CHECK(c.malformed.empty());
        }
    }
}

TEST_CASE("memory stays bounded, however long the line") {
    check_paths::path_reader reader;
    REQUIRE(check_paths::open_lines(reader.lines,
                                    test::temporary_file(std::string(std::size_t(100) << 20, 'x'))));
    mis::path_record record;
    std::string error;
    CHECK(check_paths::next_record(reader, record, error) == read_status::malformed);
    CHECK(check_paths::next_record(reader, record, error) == read_status::end);
    CHECK(reader.lines.buffer.size() < std::size_t(40) << 20);
}

TEST_CASE("compressed files give the same as plain ones, and say when they are cut off or damaged") {
    test::generator g(1);
    std::string plain;
    for (int i = 0; i < 3000; ++i) {
        json j = plain_record();
        j["weight"] = g.uniform();
        plain += j.dump() + "\n";
    }
    const std::string packed = compressed(plain);
    const contents expected = read_all(plain), c = read_all(packed);
    REQUIRE(expected.records.size() == 3000);
    REQUIRE(c.records.size() == expected.records.size());
    for (std::size_t i = 0; i < c.records.size(); ++i)
        CHECK(c.records[i].weight == expected.records[i].weight);
    CHECK(c.failure.empty());
    CHECK(read_all(packed + packed).records.size() == 6000);
    std::string many; // members begin at all places of a buffer, and lines go on in the next member
    const std::string line = plain_record().dump() + "\n", first = compressed(line.substr(0, 7)),
                      second = compressed(line.substr(7)), nothing = compressed("");
    for (int i = 0; i < 4000; ++i)
        many += i % 100 == 0 ? nothing + first + second : first + second;
    REQUIRE(many.size() > std::size_t(2) << 18);
    const contents pieces = read_all(many);
    CHECK(pieces.records.size() == 4000);
    CHECK(pieces.failure.empty());
    CHECK(read_all(nothing).failure.empty());
    CHECK(read_all(nothing).records.empty());
    for (const std::string& more :
         {std::string("x"), std::string("\n"), line, std::string(9, '\0'), std::string("\x1f"),
          std::string("\x1f\x8c"), std::string(600'000, '.')}) {
        const contents c_and_more = read_all(packed + more);
        CHECK(c_and_more.records.size() == 3000);
        CHECK(c_and_more.failure == "something else follows the compressed data");
    }
    CHECK(read_all(packed + packed.substr(0, 2)).failure == "the compressed data is cut off");

    for (const std::size_t length : {packed.size() - 1, packed.size() / 2, std::size_t(12)}) {
        const contents cut = read_all(packed.substr(0, length));
        CAPTURE(length);
        CHECK(cut.failure == "the compressed data is cut off");
        CHECK(cut.malformed.empty());
        CHECK((cut.records.size() > 0) == (length > 12));
    }
    std::string damaged = packed;
    damaged[damaged.size() - 6] = static_cast<char>(~damaged[damaged.size() - 6]); // of the checksum
    CHECK(!read_all(damaged).failure.empty());
}

namespace {

// A pipe, of which only the reading end does not block.
struct pipe_ends {
    int reading = -1, writing = -1;
};
pipe_ends open_pipe() {
    int ends[2];
    REQUIRE(pipe(ends) == 0);
    REQUIRE(fcntl(ends[0], F_SETFL, O_NONBLOCK) == 0);
    return {ends[0], ends[1]};
}

// Reads a file that comes in pieces, and waits between them.
contents read_pieces(const std::string& file, test::generator& g, std::size_t longest) {
    check_paths::path_reader reader;
    pipe_ends ends = open_pipe();
    REQUIRE(check_paths::open_lines(reader.lines, ends.reading));
    contents c;
    std::size_t written = 0;
    while (!read_on(reader, c)) {
        REQUIRE(ends.writing >= 0); // nothing waits at the end
        const auto drawn = static_cast<std::size_t>(g.uniform() * static_cast<double>(longest + 1));
        const std::size_t length = std::min(drawn, file.size() - written);
        REQUIRE(write(ends.writing, file.data() + written, length) == static_cast<ssize_t>(length));
        written += length;
        if (written == file.size()) {
            close(ends.writing);
            ends.writing = -1;
        }
    }
    if (ends.writing >= 0)
        close(ends.writing);
    return c;
}

} // namespace

TEST_CASE("a file that comes in pieces is read as if it were there at once") {
    test::generator g(5);
    const std::string line = plain_record().dump() + "\n";
    std::string plain = "\n" + line + "{\n\n" + line.substr(1);
    for (int i = 0; i < 60; ++i) {
        json j = plain_record();
        j["weight"] = g.uniform();
        plain += j.dump() + (i % 7 == 0 ? "\r\n" : "\n");
    }
    const std::string packed = compressed(plain), nothing = compressed("");
    std::string members;
    for (int i = 0; i < 20; ++i)
        members += compressed(line.substr(0, 9)) + nothing + compressed(line.substr(9));
    std::string damaged = packed;
    damaged[damaged.size() - 6] = static_cast<char>(~damaged[damaged.size() - 6]);
    using namespace std::string_literals;
    std::string much; // that takes little: one piece is more than a buffer
    for (int i = 0; i < 5000; ++i)
        much += line;
    const std::string long_line = line + std::string(check_paths::longest_line + 1, 'x') + "\n" + line;
    const std::vector<std::string> files{"",
                                         "\n",
                                         "{",
                                         "\x1f",
                                         "\xef\xbb\xbf" + plain,
                                         plain,
                                         plain.substr(0, plain.size() - 1),
                                         packed,
                                         members,
                                         nothing,
                                         damaged,
                                         packed.substr(0, packed.size() / 2),
                                         packed.substr(0, 1),
                                         packed + "x",
                                         packed + "\x1f",
                                         packed + packed,
                                         "{\0\"\0"s,
                                         "\xff\xfe{\0"s,
                                         "\n{\0\"\0"s,
                                         compressed("{\0\"\0"s),
                                         "\0\0\0{"s + plain,
                                         long_line,
                                         compressed(long_line),
                                         compressed(much)};
    for (std::size_t i = 0; i < files.size(); ++i) {
        const contents expected = read_all(files[i]);
        for (const std::size_t longest : {1u, 7u, 1000u, 60'000u}) {
            if (files[i].size() / longest > 10'000)
                continue;
            CAPTURE(i);
            CAPTURE(longest);
            const contents c = read_pieces(files[i], g, longest);
            CHECK(c.failure == expected.failure);
            CHECK(c.malformed == expected.malformed);
            REQUIRE(c.records.size() == expected.records.size());
            for (std::size_t k = 0; k < c.records.size(); ++k) {
                CHECK(c.records[k].weight == expected.records[k].weight);
                CHECK(c.records[k].line == expected.records[k].line);
            }
        }
    }
}

TEST_CASE("a line without an end is given up in pieces, too") {
    const std::string piece(60'000, '\0');
    const pipe_ends ends = open_pipe();
    check_paths::path_reader reader;
    REQUIRE(check_paths::open_lines(reader.lines, ends.reading));
    contents c;
    std::size_t written = 0;
    for (; !read_on(reader, c); written += piece.size()) {
        REQUIRE(written <= check_paths::longest_skipped);
        REQUIRE(write(ends.writing, piece.data(), piece.size()) == static_cast<ssize_t>(piece.size()));
    }
    close(ends.writing);
    CHECK(c.failure == "a line is longer than 1 GiB");
    CHECK(written > check_paths::longest_skipped);
    CHECK(!check_paths::wait_for_more(reader.lines));
}

TEST_CASE("where a reader waits, it can be waited for") {
    const std::string line = plain_record().dump() + "\n";
    const pipe_ends ends = open_pipe();
    check_paths::path_reader reader;
    REQUIRE(check_paths::open_lines(reader.lines, ends.reading));
    CHECK(!check_paths::wait_for_more(reader.lines));
    std::thread writer([&] {
        for (int i = 0; i < 20; ++i) {
            std::this_thread::sleep_for(std::chrono::milliseconds(i % 3));
            const ssize_t half = static_cast<ssize_t>(line.size() / 2);
            CHECK(write(ends.writing, line.data(), line.size() / 2) == half);
            CHECK(write(ends.writing, line.data() + half, line.size() - line.size() / 2) ==
                  static_cast<ssize_t>(line.size()) - half);
        }
        close(ends.writing);
    });
    contents c;
    while (!read_on(reader, c))
        CHECK(check_paths::wait_for_more(reader.lines));
    writer.join();
    CHECK(c.records.size() == 20);
    CHECK(c.malformed.empty());
    CHECK(!check_paths::wait_for_more(reader.lines));
}

TEST_CASE("files that cannot be read") {
    check_paths::path_reader reader;
    CHECK(!check_paths::open_lines(reader.lines, std::string("no/such/file")));
    CHECK(reader.lines.failure == "No such file or directory");
    REQUIRE(check_paths::open_lines(reader.lines, std::string("/")));
    mis::path_record record;
    std::string error;
    CHECK(check_paths::next_record(reader, record, error) == read_status::failed);
    CHECK(error == "Is a directory");
}

// ---- Geometry ----

namespace {

struct vec {
    double x = 0, y = 0, z = 0;
};
vec operator-(const vec& a, const vec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
double dot(const vec& a, const vec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
json to_json(const vec& v) { return {v.x, v.y, v.z}; }

vec random_vector(test::generator& g) { return {g.uniform(-1, 1), g.uniform(-1, 1), g.uniform(-1, 1)}; }
vec random_normal(test::generator& g) {
    for (;;) {
        const vec v = random_vector(g);
        const double length = std::sqrt(dot(v, v));
        if (length > 0.1 && length < 1)
            return {v.x / length, v.y / length, v.z / length};
    }
}

std::vector<mis::path_vertex<vec>> random_path(test::generator& g, int n) {
    using mis::vertex_kind;
    std::vector<mis::path_vertex<vec>> path(static_cast<std::size_t>(n));
    for (auto& x : path) {
        x.position = random_vector(g);
        x.normal = random_normal(g);
        x.kind = g.chance(0.3)   ? vertex_kind::dirac
                 : g.chance(0.3) ? vertex_kind::medium
                                 : vertex_kind::surface;
    }
    path.front().kind = vertex_kind::camera;
    path.back().kind = g.chance(0.5) ? vertex_kind::light : vertex_kind::infinite_light;
    return path;
}

json record_of(const std::vector<mis::path_vertex<vec>>& path) {
    const int n = static_cast<int>(path.size());
    json j = plain_record("light_hit", n, n);
    for (std::size_t i = 0; i < path.size(); ++i) {
        json& v = j["vertices"][i];
        v["kind"] = mis::name_of(path[i].kind);
        if (path[i].kind == mis::vertex_kind::infinite_light) {
            v["direction"] = to_json(path[i].normal);
        } else {
            v["position"] = to_json(path[i].position);
            v["normal"] = to_json(path[i].normal);
        }
    }
    return j;
}

// The reader's arithmetic is that of measure() up to rounding.
bool is_close(double a, double b) { return std::abs(a - b) <= 1e-14 * (1 + std::abs(b)); }

} // namespace

TEST_CASE("cosines and distances are those of mis::measure") {
    test::generator g(2);
    for (int k = 0; k < 2000; ++k) {
        const int n = g.integer(2, 8);
        const auto path = random_path(g, n);
        const mis::path_record r = read_one(record_of(path));
        for (int i = 0; i < n; ++i) {
            const auto expected = mis::measure(path.data(), n, i);
            const mis::recorded_vertex& x = r.vertices[static_cast<std::size_t>(i)];
            if (i > 0)
                CHECK(is_close(x.cos_to_camera, expected.cos_to_camera));
            else
                CHECK(!mis::is_given(x.cos_to_camera));
            if (i < n - 1) {
                CHECK(is_close(x.cos_to_light, expected.cos_to_light));
                CHECK(is_close(x.distance2_to_light, expected.distance2_to_light));
            } else {
                CHECK(!mis::is_given(x.cos_to_light));
                CHECK(!mis::is_given(x.distance2_to_light));
            }
            CHECK(!mis::is_given(x.shading_cos_to_camera));
            CHECK(!mis::is_given(x.distance2_at_infinity));
        }
    }
}

TEST_CASE("edges on the light's side of a merge start at the photon") {
    test::generator g(3);
    for (int k = 0; k < 500; ++k) {
        const int n = g.integer(3, 8), j = g.integer(1, n - 2);
        const auto at = static_cast<std::size_t>(j);
        auto path = random_path(g, n), moved = path;
        path[at].kind = moved[at].kind = mis::vertex_kind::surface;
        moved[at].position = random_vector(g);
        moved[at].normal = random_normal(g);
        json record = record_of(path);
        record["technique"] = "merge";
        record["camera_vertices"] = j + 1;
        record["radius"] = 0.1;
        record["counts"]["merge"] = 1;
        const bool has_normal = g.chance(0.5); // that of the camera walk's vertex otherwise
        record["vertices"][at]["photon"] = {{"position", to_json(moved[at].position)}};
        if (has_normal)
            record["vertices"][at]["photon"]["normal"] = to_json(moved[at].normal);
        else
            moved[at].normal = path[at].normal;
        const mis::path_record r = read_one(record);
        for (int i = 0; i < n; ++i) {
            const mis::recorded_vertex& x = r.vertices[static_cast<std::size_t>(i)];
            const auto own = mis::measure(path.data(), n, i), photon = mis::measure(moved.data(), n, i);
            if (i > 0)
                CHECK(is_close(x.cos_to_camera, (i == j + 1 ? photon : own).cos_to_camera));
            if (i < n - 1) {
                CHECK(is_close(x.cos_to_light, (i == j ? photon : own).cos_to_light));
                CHECK(is_close(x.distance2_to_light, (i == j ? photon : own).distance2_to_light));
            }
        }
    }
}

TEST_CASE("geometry that the renderer gives wins over positions") {
    test::generator g(4);
    auto path = random_path(g, 4);
    path[1].kind = path[2].kind = mis::vertex_kind::surface;
    path[3].kind = mis::vertex_kind::light;
    json j = record_of(path);
    const double before = read_one(j).vertices[1].cos_to_light;
    j["vertices"][1]["cos_to_camera"] = 0.5;
    j["vertices"][2]["cos_to_light"] = 0.25;
    j["vertices"][1]["distance"] = 10;
    const mis::path_record r = read_one(j);
    CHECK(r.vertices[1].cos_to_camera == 0.5);
    CHECK(r.vertices[2].cos_to_light == 0.25);
    CHECK(r.vertices[1].distance2_to_light == 100);
    CHECK(r.vertices[1].cos_to_light == before);
}

TEST_CASE("what geometry lacks stays not given") {
    test::generator g(5);
    auto path = random_path(g, 4);
    path[1].kind = path[2].kind = mis::vertex_kind::surface;
    path[3].kind = mis::vertex_kind::light;
    json j = record_of(path);
    j["vertices"][1].erase("position");
    j["vertices"][2].erase("normal");
    const auto x = read_one(j).vertices;
    CHECK(!mis::is_given(x[0].distance2_to_light));
    CHECK(!mis::is_given(x[0].cos_to_light));
    CHECK(!mis::is_given(x[1].cos_to_camera));
    CHECK(!mis::is_given(x[1].distance2_to_light));
    CHECK(!mis::is_given(x[2].cos_to_camera));
    CHECK(!mis::is_given(x[2].cos_to_light));
    CHECK(mis::is_given(x[2].distance2_to_light));
    CHECK(mis::is_given(x[3].cos_to_camera));

    // Points without a surface need no normal.
    j["vertices"][3]["normal"] = nullptr;
    CHECK(read_one(j).vertices[3].cos_to_camera == 1);
    j["vertices"][2]["kind"] = "medium";
    CHECK(read_one(j).vertices[2].cos_to_camera == 1);
    CHECK(read_one(j).vertices[2].cos_to_light == 1);
}

TEST_CASE("infinite lights: distance 1, cosine with their direction, and the place where they are put") {
    json j = plain_record();
    j["vertices"][2] = {{"kind", "infinite_light"}, {"direction", {0, 0.6, 0.8}}};
    j["vertices"][1]["normal"] = {0, 0, -1};
    mis::path_record r = read_one(j); // no position is needed
    CHECK(r.vertices[1].cos_to_light == 0.8);
    CHECK(r.vertices[1].distance2_to_light == 1);
    CHECK(r.vertices[2].cos_to_camera == 1);
    CHECK(!mis::is_given(r.vertices[2].distance2_at_infinity));
    j["vertices"][1]["position"] = {1, 2, 3};
    j["vertices"][2]["position"] = {1, 5, 7};
    r = read_one(j);
    CHECK(r.vertices[1].cos_to_light == 0.8);
    CHECK(r.vertices[1].distance2_to_light == 1);
    CHECK(r.vertices[2].distance2_at_infinity == 25);
}

TEST_CASE("shading normals give their own cosines") {
    json j = plain_record();
    j["vertices"][0]["position"] = {0, 0, 2};
    j["vertices"][1]["position"] = {0, 0, 0};
    j["vertices"][1]["normal"] = {0, 0, 1};
    j["vertices"][1]["shading_normal"] = {0.6, 0, -0.8};
    j["vertices"][2]["position"] = {3, 0, 0};
    const auto x = read_one(j).vertices;
    CHECK(x[1].cos_to_camera == 1);
    CHECK(x[1].cos_to_light == 0);
    CHECK(x[1].shading_cos_to_camera == doctest::Approx(0.8).epsilon(1e-15));
    CHECK(x[1].shading_cos_to_light == doctest::Approx(0.6).epsilon(1e-15));
    CHECK(!mis::is_given(x[0].shading_cos_to_light));
    CHECK(!mis::is_given(x[2].shading_cos_to_camera));
}

TEST_CASE("vertices at the same place have cosine 0, as in mis::measure") {
    json j = plain_record();
    for (auto& v : j["vertices"]) {
        v["position"] = {1, 2, 3};
        v["normal"] = {0, 0, 1};
    }
    const auto x = read_one(j).vertices;
    CHECK(x[0].cos_to_light == 0);
    CHECK(x[1].distance2_to_light == 0);
    CHECK(x[2].cos_to_camera == 0);
}

TEST_CASE("records that are written are read again, number for number") {
    test::generator g(1);
    const auto any_number = [&] {
        switch (g.integer(0, 9)) {
        case 0:
            return 0.0;
        case 1:
            return std::numeric_limits<double>::infinity();
        case 2:
            return -1.5;
        case 3: // rounding has to be undone
            return g.log_uniform<double>(-300, 300);
        default:
            return static_cast<double>(g.log_uniform<float>(-30, 30));
        }
    };
    for (int sample = 0; sample < 2'000; ++sample) {
        const int n = g.integer(2, 8);
        mis::path_record r;
        r.technique = mis::technique_at(n, g.integer(0, mis::technique_count(n) - 1));
        r.weight = any_number();
        r.heuristic = static_cast<mis::heuristic_kind>(g.integer(0, 4));
        r.parameter = r.heuristic == mis::heuristic_kind::cutoff ? 0.3 : 2;
        if (r.heuristic == mis::heuristic_kind::power)
            r.parameter = any_number();
        r.counts.light_hit = any_number();
        r.counts.next_event = any_number();
        r.counts.connection = any_number();
        r.counts.camera_connection = any_number();
        r.counts.direct = any_number();
        r.counts.camera_hit = any_number();
        if (g.chance(0.5)) {
            r.counts.merge = g.log_uniform<double>(0, 6);
            r.radius = g.log_uniform<double>(-3, 0);
        }
        if (r.technique.kind == mis::technique_kind::merge)
            r.counts.merge = r.radius = 1;
        if (g.chance(0.2))
            r.counts.max_camera_vertices = g.integer(0, 9);
        r.splits_on_arrival = g.chance(0.2);
        if (g.chance(0.3)) {
            r.families[static_cast<std::size_t>(g.integer(0, 3))] = {any_number(), any_number()};
            r.families[1] = {5, 0.1};
            if (r.technique.kind == mis::technique_kind::merge)
                r.family = static_cast<mis::merge_family>(g.integer(0, 3));
        }
        for (int i = 0; i < n; ++i) {
            mis::recorded_vertex x;
            x.kind = i == 0       ? mis::vertex_kind::camera
                     : i == n - 1 ? mis::vertex_kind::infinite_light
                                  : static_cast<mis::vertex_kind>(g.integer(1, 3));
            x.dirac = (i == 0 || i == n - 1) && g.chance(0.5);
            for (const mis::recorded_number& number : mis::recorded_numbers)
                if (g.chance(0.5))
                    x.*number.member = any_number();
            // What the reader makes up where it is not given.
            x.pdf_position = x.cos_to_camera = x.cos_to_light = g.uniform();
            x.distance2_to_light = std::pow(g.integer(0, 100) / 4.0, 2); // kept squared
            if (g.chance(0.5))
                x.photon_survival = 0.75;
            r.vertices.push_back(x);
            for (int k = g.integer(0, 5); i + 1 < n && k < 2; ++k)
                r.boundaries.push_back({i, any_number(), any_number(), any_number(), any_number()});
        }
        const std::string line = mis::verify::to_json(r);
        CAPTURE(line);
        const mis::path_record read = read_one(line);
        CHECK(read.technique == r.technique);
        CHECK(read.weight == r.weight);
        CHECK(read.heuristic == r.heuristic);
        if (r.heuristic == mis::heuristic_kind::power || r.heuristic == mis::heuristic_kind::cutoff)
            CHECK(read.parameter == r.parameter);
        for (int kind = 0; kind < 7; ++kind)
            CHECK(mis::count_of(read.counts, static_cast<mis::technique_kind>(kind)) ==
                  mis::count_of(r.counts, static_cast<mis::technique_kind>(kind)));
        CHECK(read.counts.max_camera_vertices == r.counts.max_camera_vertices);
        CHECK(read.counts.max_light_vertices == r.counts.max_light_vertices);
        CHECK(read.radius == r.radius);
        CHECK(read.splits_on_arrival == r.splits_on_arrival);
        CHECK(read.family == r.family);
        for (std::size_t i = 0; i < r.families.size(); ++i) {
            CHECK(read.families[i].count == r.families[i].count);
            CHECK(read.families[i].radius == r.families[i].radius);
        }
        REQUIRE(read.vertices.size() == r.vertices.size());
        for (std::size_t i = 0; i < r.vertices.size(); ++i) {
            const mis::recorded_vertex &x = r.vertices[i], &y = read.vertices[i];
            CHECK(y.kind == x.kind);
            CHECK(y.dirac == x.dirac);
            for (const mis::recorded_number& number : mis::recorded_numbers)
                CHECK_MESSAGE(y.*number.member == x.*number.member, number.name);
            CHECK(y.distance2_to_light == x.distance2_to_light);
            CHECK(y.photon_survival == x.photon_survival);
        }
        REQUIRE(read.boundaries.size() == r.boundaries.size());
        for (std::size_t i = 0; i < r.boundaries.size(); ++i) {
            const mis::recorded_boundary &a = r.boundaries[i], &b = read.boundaries[i];
            CHECK(b.edge == a.edge);
            CHECK(b.distance == a.distance);
            CHECK(b.cosine == a.cosine);
            CHECK(b.pass_from_camera == a.pass_from_camera);
            CHECK(b.pass_from_light == a.pass_from_light);
        }
    }
}
