// Reads records of weighted paths, JSON Lines as docs/path_dump.md describes them.
//
// A line that is no record is reported and skipped. Fields may be missing, as they may in a record, and
// unknown fields are ignored. NaN and infinity are read in the spellings of JSON writers (null, "NaN",
// "-Infinity",
// ...) and of printf (nan, -inf, ...), and are stored as they are, as negative numbers are.
#pragma once

#include "geometry.hpp"
#include "lines.hpp"
#include <mis/verify/record.hpp>
#include <simdjson.h>
#include <string>

namespace check_paths {

// A line with more vertices is no record: thousands of records are kept to search for mistakes in.
inline constexpr std::size_t most_vertices = 1000;

struct path_reader {
    line_reader lines;

    // Reused from line to line.
    simdjson::dom::parser parser;
    std::string repaired;
    std::vector<vertex_geometry> geometry;
};

enum class read_status { record, malformed, waiting, end, failed };

// The next record; blank lines are skipped. `malformed` and `failed` say why in `error`, one line of ASCII,
// and leave the record unspecified, as `waiting` (line_status::waiting) does; after `failed` nothing more can
// be read.
read_status next_record(path_reader& reader, mis::path_record& record, std::string& error);

} // namespace check_paths
