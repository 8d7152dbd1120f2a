// SPDX-License-Identifier: MIT
// check_paths for a page: the same reader, the same report, and the paths that suspects show as examples.
#include "report.hpp"
#include <emscripten.h>
#include <set>

namespace {

constexpr std::size_t examples_per_suspect = 2;

// Lines of what is to be drawn: the examples of suspects, or the first wrong weights where nothing explains
// them.
std::set<std::int64_t> lines_to_draw(const check_paths::report& r, const mis::finding& found) {
    std::set<std::int64_t> lines;
    for (const mis::suspect& s : found.suspects)
        for (const auto& e : s.examples)
            lines.insert(e.line);
    if (lines.empty())
        for (std::size_t i = 0; i < std::min(examples_per_suspect, r.disagreeing.size()); ++i)
            lines.insert(r.disagreeing[i].line);
    return lines;
}

nlohmann::json to_json(const std::optional<check_paths::vec3>& v) {
    return v ? nlohmann::json(*v) : nlohmann::json();
}

nlohmann::json to_json(const mis::path_record& record,
                       const std::vector<check_paths::vertex_geometry>& geometry) {
    auto vertices = nlohmann::json::array();
    for (std::size_t i = 0; i < record.vertices.size(); ++i)
        vertices.push_back({{"kind", mis::name_of(record.vertices[i].kind)},
                            {"dirac", record.vertices[i].dirac},
                            {"position", to_json(geometry[i].own.position)},
                            {"normal", to_json(geometry[i].own.normal)},
                            {"photon", to_json(geometry[i].photon.position)},
                            {"direction", to_json(geometry[i].direction)}});
    return {{"line", record.line},
            {"technique", mis::name_of(record.technique.kind)},
            {"camera_vertices", record.technique.camera_vertices},
            {"vertices", vertices}};
}

// The file, as the worker hands it over: piece by piece at first, then again from its start.
constexpr const char* handed_over = "/dropped";

// Reads some lines again: their positions are not kept where thousands of records are.
nlohmann::json read_again(const std::set<std::int64_t>& lines) {
    auto paths = nlohmann::json::array();
    check_paths::path_reader reader;
    mis::path_record record;
    std::string text;
    std::string_view skipped;
    if (!check_paths::open_lines(reader.lines, handed_over))
        return paths;
    for (const std::int64_t line : lines) {
        while (reader.lines.line < line - 1)
            if (const auto s = check_paths::next_line(reader.lines, skipped);
                s == check_paths::line_status::end || s == check_paths::line_status::failed)
                return paths;
        if (check_paths::next_record(reader, record, text) == check_paths::read_status::record)
            paths.push_back(to_json(record, reader.geometry));
    }
    return paths;
}

check_paths::report report;
check_paths::path_reader reader;
std::string found_suspects;

} // namespace

// What check_paths does with a file and no options, in three steps.
extern "C" {

// Begins, once, with the file.
EMSCRIPTEN_KEEPALIVE void begin() {
    simdjson::get_active_implementation() = simdjson::builtin_implementation();
    check_paths::open_lines(reader.lines, handed_over);
}

// Checks what is there of the file. Returns whether more is to come.
EMSCRIPTEN_KEEPALIVE bool go_on() {
    check_paths::add_all(report, reader, check_paths::default_most_malformed, [] {});
    return reader.lines.is_waiting;
}

// Prints the report on standard output, one line on standard error where not all could be read, with the
// file's name, and returns the exit status.
EMSCRIPTEN_KEEPALIVE int finish(const char* name) {
    const mis::finding found = check_paths::suspects_in(report, examples_per_suspect);
    check_paths::print(report, found, stdout);
    std::fflush(stdout);
    const nlohmann::json suspects{{"records", report.all.records},
                                  {"suspects", check_paths::to_json(report, found)["suspects"]},
                                  {"paths", read_again(lines_to_draw(report, found))}};
    found_suspects = suspects.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
    if (const std::string why = check_paths::complaint(report, name); !why.empty()) {
        std::fprintf(stderr, "check_paths: %s\n", why.c_str());
        return 2;
    }
    return check_paths::exit_status(report, found);
}

// After that, as JSON: the suspects, and the paths of their examples.
EMSCRIPTEN_KEEPALIVE const char* suspects() { return found_suspects.c_str(); }
}
