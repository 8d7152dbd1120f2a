// SPDX-License-Identifier: MIT
// Floor 5: a record as one line of a path dump, docs/path_dump.md.
#pragma once

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <mis/verify/record.hpp>
#include <ostream>
#include <string>

namespace mis::verify {

namespace detail {

// In the shortest of two forms that gives the same number back, with a point whatever the locale. NaN and
// infinity, which JSON does not have, as words that readers of dumps know.
inline void append_number(std::string& line, double x) {
    if (!is_number(x)) {
        line += is_nan(x) ? "\"NaN\"" : x < 0 ? "\"-Infinity\"" : "\"Infinity\"";
        return;
    }
    char text[32];
    for (const int digits : {9, 17}) {
        std::snprintf(text, sizeof text, "%.*g", digits, x);
        if (std::strtod(text, nullptr) == x)
            break;
    }
    for (char* c = text; *c; ++c)
        line += *c == ',' ? '.' : *c;
}

inline void append_key(std::string& line, const char* key) {
    if (line.back() != '{')
        line += ',';
    line.append(1, '"').append(key).append("\":");
}
inline void append_number(std::string& line, const char* key, double x) {
    append_key(line, key);
    append_number(line, x);
}
inline void append_word(std::string& line, const char* key, const char* word) {
    append_key(line, key);
    line.append(1, '"').append(word).append(1, '"');
}

// The boundaries that the edge from x_i passes.
inline void append_boundaries(std::string& line, const path_record& record, std::size_t i) {
    bool any = false;
    for (const recorded_boundary& b : record.boundaries) {
        if (b.edge != static_cast<int>(i))
            continue;
        if (!any)
            append_key(line, "boundaries");
        line += any ? ",{" : "[{";
        any = true;
        append_number(line, "distance", b.distance);
        append_number(line, "cos", b.cosine);
        append_number(line, "pass_from_camera", b.pass_from_camera);
        append_number(line, "pass_from_light", b.pass_from_light);
        line += '}';
    }
    line += any ? "]" : "";
}

inline void append_vertex(std::string& line, const path_record& record, std::size_t i) {
    const recorded_vertex& x = record.vertices[i];
    line += '{';
    append_word(line, "kind", name_of(x.kind));
    if (x.dirac != (x.kind == vertex_kind::camera)) {
        append_key(line, "dirac");
        line += x.dirac ? "true" : "false";
    }
    const recorded_vertex plain;
    for (const recorded_number& number : recorded_numbers)
        if (const double value = x.*number.member; is_given(value) && value != plain.*number.member)
            append_number(line, number.name, value);
    if (is_given(x.distance2_to_light))
        append_number(line, "distance", std::sqrt(x.distance2_to_light));
    if (is_given(x.photon_survival)) {
        append_key(line, "photon");
        line += '{';
        append_number(line, "survival", x.photon_survival);
        line += '}';
    }
    append_boundaries(line, record, i);
    line += '}';
}

inline void append_counts(std::string& line, const path_record& record) {
    append_key(line, "counts");
    line += '{';
    for (std::size_t i = 0; i < technique_names.size(); ++i)
        if (const double count = count_of(record.counts, static_cast<technique_kind>(i)); count != 0)
            append_number(line, technique_names[i], count);
    line += '}';
    if (is_given(record.radius))
        append_number(line, "radius", record.radius);
    if (record.counts.max_camera_vertices < INT_MAX)
        append_number(line, "max_camera_vertices", record.counts.max_camera_vertices);
    if (record.counts.max_light_vertices < INT_MAX)
        append_number(line, "max_light_vertices", record.counts.max_light_vertices);
}

inline void append_families(std::string& line, const path_record& record) {
    bool any = false;
    for (const recorded_family& family : record.families)
        any = any || family.count != 0 || family.radius != 0;
    if (!any)
        return;
    append_key(line, "families");
    line += '{';
    for (std::size_t i = 0; i < record.families.size(); ++i) {
        append_key(line, family_names[i]);
        line += '{';
        append_number(line, "count", record.families[i].count);
        append_number(line, "radius", record.families[i].radius);
        line += '}';
    }
    line += '}';
    if (record.technique.kind == technique_kind::merge)
        append_word(line, "family", name_of(record.family));
}

} // namespace detail

// The record as one line of JSON, without its end of line; check_paths reads the same record from it, but for
// `line` and the distance to an infinite light's place. What is not given is left out. The numbers are
// written as they are, whatever they are.
inline std::string to_json(const path_record& record) {
    std::string line = "{";
    detail::append_word(line, "technique", name_of(record.technique.kind));
    detail::append_number(line, "camera_vertices", record.technique.camera_vertices);
    detail::append_number(line, "weight", record.weight);
    detail::append_word(line, "heuristic", name_of(record.heuristic));
    if (record.heuristic == heuristic_kind::power)
        detail::append_number(line, "beta", record.parameter);
    if (record.heuristic == heuristic_kind::cutoff)
        detail::append_number(line, "alpha", record.parameter);
    detail::append_counts(line, record);
    detail::append_families(line, record);
    if (record.splits_on_arrival) {
        detail::append_key(line, "splits_on_arrival");
        line += "true";
    }
    detail::append_key(line, "vertices");
    line += '[';
    for (std::size_t i = 0; i < record.vertices.size(); ++i) {
        line += i ? "," : "";
        detail::append_vertex(line, record, i);
    }
    return line + "]}";
}

// The same with its end of line. The stream says whether it could be written.
inline void write_json(std::ostream& out, const path_record& record) { out << to_json(record) + '\n'; }

} // namespace mis::verify
