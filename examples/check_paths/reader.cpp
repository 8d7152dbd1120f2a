#include "reader.hpp"

#include <cmath>
#include <cstdio>
#include <limits>

namespace check_paths {

namespace {

using simdjson::dom::element;
using simdjson::dom::element_type;

// Why a line is no record.
struct malformed {
    std::string what;
};

[[noreturn]] void fail(std::string what) { throw malformed{std::move(what)}; }

// ---- Words ----

using mis::heuristic_names;
using mis::name_of;
using mis::technique_names;
using mis::vertex_names;

// Text of a file, short and of printable characters, for messages.
std::string quoted(std::string_view text) {
    constexpr std::size_t longest = 40;
    std::string result = "\"";
    for (const char c : text.substr(0, longest))
        result += c >= ' ' && c <= '~' ? c : '?';
    return result + (text.size() > longest ? "...\"" : "\"");
}

const char* type_name(const element& value) {
    switch (value.type()) {
    case element_type::ARRAY:
        return "an array";
    case element_type::OBJECT:
        return "an object";
    case element_type::STRING:
        return "a string";
    case element_type::BOOL:
        return "true or false";
    case element_type::NULL_VALUE:
        return "null";
    default:
        return "a number";
    }
}

[[noreturn]] void fail_type(std::string_view key, const element& value, const char* expected) {
    fail(quoted(key) + " is " + type_name(value) + ", not " + expected);
}

std::string_view string_of(std::string_view key, const element& value) {
    std::string_view text;
    if (value.get(text) != simdjson::SUCCESS)
        fail_type(key, value, "a string");
    return text;
}

// The place of a word in a table of enumerators' names.
template <std::size_t N>
int index_of(std::string_view key, const element& value, const std::array<const char*, N>& names) {
    const std::string_view word = string_of(key, value);
    for (std::size_t i = 0; i < N; ++i)
        if (word == names[i])
            return static_cast<int>(i);
    std::string known;
    for (const char* name : names)
        known += (known.empty() ? "" : ", ") + std::string(name);
    fail(quoted(key) + " is " + quoted(word) + ", not one of " + known);
}

// ---- Numbers ----

// Whether a word means NaN or infinity, with or without a sign, in capitals or not. nan(ind) is what printf
// of one platform writes.
bool is_named_number(std::string_view word, double& number) {
    const bool negative = !word.empty() && word[0] == '-';
    if (!word.empty() && (word[0] == '-' || word[0] == '+'))
        word.remove_prefix(1);
    const auto is = [&](std::string_view name) {
        return word.size() == name.size() &&
               std::equal(word.begin(), word.end(), name.begin(),
                          [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b; });
    };
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (is("nan") || is("nan(ind)") || is("nan(snan)"))
        number = std::numeric_limits<double>::quiet_NaN();
    else if (is("inf") || is("infinity"))
        number = negative ? -infinity : infinity;
    else
        return false;
    return true;
}

double number_of(std::string_view key, const element& value) {
    double number = std::numeric_limits<double>::quiet_NaN();
    std::string_view word;
    if (value.get(number) == simdjson::SUCCESS || value.is_null())
        return number;
    if (value.get(word) == simdjson::SUCCESS && is_named_number(word, number))
        return number;
    fail_type(key, value, "a number");
}

int whole_number_of(std::string_view key, const element& value) {
    const double number = number_of(key, value);
    if (number >= 0 && number <= INT_MAX && number == std::floor(number))
        return static_cast<int>(number);
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", number);
    fail(quoted(key) + " is " + text + ", not a whole number from 0 to 2147483647");
}

bool truth_of(std::string_view key, const element& value) {
    bool truth = false;
    if (value.get(truth) != simdjson::SUCCESS)
        fail_type(key, value, "true or false");
    return truth;
}

// Null is how writers spell a vector that is not there.
std::optional<vec3> vector_of(std::string_view key, const element& value) {
    if (value.is_null())
        return {};
    simdjson::dom::array array;
    if (value.get(array) != simdjson::SUCCESS)
        fail_type(key, value, "an array of 3 numbers");
    vec3 v{};
    std::size_t count = 0;
    for (const element number : array) {
        if (count == v.size())
            fail(quoted(key) + " has more than 3 numbers");
        v[count++] = number_of(key, number);
    }
    if (count < v.size())
        fail(quoted(key) + " has " + std::to_string(count) + (count == 1 ? " number" : " numbers") +
             ", not 3");
    return v;
}

// ---- Vertices ----

// With their lengths, which most keys already differ in.
constexpr auto number_names = [] {
    std::array<std::string_view, mis::recorded_numbers.size()> names{};
    for (std::size_t i = 0; i < names.size(); ++i)
        names[i] = mis::recorded_numbers[i].name;
    return names;
}();

double* find_number_field(mis::recorded_vertex& x, std::string_view key) {
    for (std::size_t i = 0; i < number_names.size(); ++i)
        if (number_names[i] == key)
            return &(x.*mis::recorded_numbers[i].member);
    return nullptr;
}

simdjson::dom::object object_of(std::string_view key, const element& value) {
    simdjson::dom::object object;
    if (value.get(object) != simdjson::SUCCESS)
        fail_type(key, value, "an object");
    return object;
}

bool read_site_field(std::string_view key, const element& value, site& s) {
    if (key == "position")
        s.position = vector_of(key, value);
    else if (key == "normal")
        s.normal = vector_of(key, value);
    else if (key == "shading_normal")
        s.shading_normal = vector_of(key, value);
    else
        return false;
    return true;
}

// The light walk's vertex of a merge.
void read_photon(const element& value, mis::recorded_vertex& x, site& photon) {
    photon = {};
    x.photon_survival = mis::not_given;
    if (value.is_null())
        return;
    for (const auto [key, field] : object_of("photon", value)) {
        if (key == "survival")
            x.photon_survival = number_of(key, field);
        else
            read_site_field(key, field, photon);
    }
}

// [{"distance": 2, "cos": 0.5, "pass_from_camera": 1, "pass_from_light": 0.3}, ...]
void read_boundaries(const element& value, int edge, std::vector<mis::recorded_boundary>& boundaries) {
    simdjson::dom::array array;
    if (value.get(array) != simdjson::SUCCESS)
        fail_type("boundaries", value, "an array");
    while (!boundaries.empty() && boundaries.back().edge == edge) // of duplicate keys
        boundaries.pop_back();
    for (const element one : array) {
        mis::recorded_boundary b;
        b.edge = edge;
        bool has_distance = false, has_cosine = false;
        for (const auto [key, field] : object_of("boundaries", one)) {
            if (key == "distance") {
                b.distance = number_of(key, field);
                has_distance = true;
            } else if (key == "cos") {
                b.cosine = number_of(key, field);
                has_cosine = true;
            } else if (key == "pass_from_camera") {
                b.pass_from_camera = number_of(key, field);
            } else if (key == "pass_from_light") {
                b.pass_from_light = number_of(key, field);
            }
        }
        if (!has_distance || !has_cosine)
            fail(std::string("boundaries: ") + (has_distance ? "\"cos\"" : "\"distance\"") + " is missing");
        boundaries.push_back(b);
    }
}

// A distance is kept squared; a negative one stays negative, to be found.
double signed_square(double x) { return x * std::abs(x); }

void read_vertex(const element& value, mis::path_record& record, vertex_geometry& geometry) {
    const int place = static_cast<int>(record.vertices.size());
    mis::recorded_vertex& x = record.vertices.emplace_back();
    geometry = {};
    std::optional<mis::vertex_kind> kind;
    std::optional<bool> dirac;
    simdjson::dom::object object;
    if (value.get(object) != simdjson::SUCCESS)
        fail(std::string("is ") + type_name(value) + ", not an object");
    for (const auto [key, field] : object) {
        if (double* number = find_number_field(x, key))
            *number = number_of(key, field);
        else if (key == "kind")
            kind = static_cast<mis::vertex_kind>(index_of(key, field, vertex_names));
        else if (key == "distance")
            x.distance2_to_light = signed_square(number_of(key, field));
        else if (key == "dirac")
            dirac = truth_of(key, field);
        else if (key == "direction")
            geometry.direction = vector_of(key, field);
        else if (key == "photon")
            read_photon(field, x, geometry.photon);
        else if (key == "boundaries")
            read_boundaries(field, place, record.boundaries);
        else
            read_site_field(key, field, geometry.own);
    }
    if (!kind)
        fail("\"kind\" is missing");
    x.kind = *kind;
    x.dirac = dirac.value_or(x.kind == mis::vertex_kind::camera);
    if (x.kind == mis::vertex_kind::camera && !mis::is_given(x.pdf_position))
        x.pdf_position = 1;
    if (!geometry.photon.position)
        geometry.photon.position = geometry.own.position;
    if (!geometry.photon.normal)
        geometry.photon.normal = geometry.own.normal;
    if (!geometry.photon.shading_normal)
        geometry.photon.shading_normal = geometry.own.shading_normal;
}

void read_vertices(const element& value, mis::path_record& record, std::vector<vertex_geometry>& geometry) {
    simdjson::dom::array array;
    if (value.get(array) != simdjson::SUCCESS)
        fail_type("vertices", value, "an array");
    record.vertices.clear();
    record.boundaries.clear();
    geometry.clear();
    if (const std::size_t count = array.size(); count > most_vertices)
        fail("a path has at most " + std::to_string(most_vertices) + " vertices, not " +
             std::to_string(count));
    for (const element vertex : array) {
        try {
            read_vertex(vertex, record, geometry.emplace_back());
        } catch (const malformed& error) {
            fail("vertex " + std::to_string(record.vertices.size() - 1) + ": " + error.what);
        }
    }
}

// ---- Records ----

// What a record must have, and what depends on other fields.
struct required {
    std::optional<mis::technique_kind> technique;
    std::optional<int> camera_vertices;
    bool weight = false, counts = false, merge_count = false, family = false, vertices = false;
    double beta = 2, alpha = 0.1;
};

void read_counts(const element& value, mis::technique_counts<double>& counts, required& has) {
    const int camera_cap = counts.max_camera_vertices, light_cap = counts.max_light_vertices;
    counts = {};
    counts.max_camera_vertices = camera_cap;
    counts.max_light_vertices = light_cap;
    has.counts = true;
    has.merge_count = false;
    const auto object = object_of("counts", value);
    try {
        for (const auto [key, field] : object) {
            if (key == "light_hit")
                counts.light_hit = number_of(key, field);
            else if (key == "next_event")
                counts.next_event = number_of(key, field);
            else if (key == "connection")
                counts.connection = number_of(key, field);
            else if (key == "camera_connection")
                counts.camera_connection = number_of(key, field);
            else if (key == "direct")
                counts.direct = number_of(key, field);
            else if (key == "camera_hit")
                counts.camera_hit = number_of(key, field);
            else if (key == "merge") {
                counts.merge = number_of(key, field);
                has.merge_count = true;
            }
        }
    } catch (const malformed& error) {
        fail("counts: " + error.what);
    }
}

// {"point_point": {"count": 16384, "radius": 0.1}, ...}
void read_families(const element& value, mis::path_record& record) {
    record.families = {};
    try {
        for (const auto [name, family] : object_of("families", value)) {
            const auto found = std::find(std::begin(mis::family_names), std::end(mis::family_names), name);
            if (found == std::end(mis::family_names))
                continue;
            auto& f = record.families[static_cast<std::size_t>(found - std::begin(mis::family_names))];
            for (const auto [key, field] : object_of(name, family)) {
                if (key == "count")
                    f.count = number_of(key, field);
                else if (key == "radius")
                    f.radius = number_of(key, field);
            }
        }
    } catch (const malformed& error) {
        fail("families: " + error.what);
    }
}

void read_field(std::string_view key, const element& value, mis::path_record& record,
                std::vector<vertex_geometry>& geometry, required& has) {
    if (key == "technique") {
        has.technique = static_cast<mis::technique_kind>(index_of(key, value, technique_names));
    } else if (key == "camera_vertices") {
        has.camera_vertices = whole_number_of(key, value);
    } else if (key == "weight") {
        record.weight = number_of(key, value);
        has.weight = true;
    } else if (key == "heuristic") {
        record.heuristic = static_cast<mis::heuristic_kind>(index_of(key, value, heuristic_names));
    } else if (key == "beta") {
        has.beta = number_of(key, value);
    } else if (key == "alpha") {
        has.alpha = number_of(key, value);
    } else if (key == "radius") {
        record.radius = number_of(key, value);
    } else if (key == "family") {
        record.family = static_cast<mis::merge_family>(index_of(key, value, mis::family_names));
        has.family = true;
    } else if (key == "families") {
        read_families(value, record);
    } else if (key == "splits_on_arrival") {
        record.splits_on_arrival = truth_of(key, value);
    } else if (key == "max_camera_vertices") {
        record.counts.max_camera_vertices = whole_number_of(key, value);
    } else if (key == "max_light_vertices") {
        record.counts.max_light_vertices = whole_number_of(key, value);
    } else if (key == "counts") {
        read_counts(value, record.counts, has);
    } else if (key == "vertices") {
        read_vertices(value, record, geometry);
        has.vertices = true;
    }
}

void check_kinds(const std::vector<mis::recorded_vertex>& vertices) {
    const std::size_t n = vertices.size();
    if (n < 2)
        fail("a path has at least 2 vertices, not " + std::to_string(n));
    for (std::size_t i = 0; i < n; ++i) {
        const mis::vertex_kind kind = vertices[i].kind;
        const bool is_light = kind == mis::vertex_kind::light || kind == mis::vertex_kind::infinite_light;
        const bool is_camera = kind == mis::vertex_kind::camera;
        const auto fail_kind = [&](const char* why) {
            fail("vertex " + std::to_string(i) + ": \"kind\" is " + name_of(kind) + why);
        };
        if (i == 0 && !is_camera)
            fail_kind(", but a path starts at a camera");
        if (i == n - 1 && !is_light)
            fail_kind(", but a path ends at a light or infinite_light");
        if (i > 0 && i < n - 1 && (is_camera || is_light))
            fail_kind(", which only an end of a path may be");
    }
}

// The number of camera vertices must be one that the technique can have.
void check_technique(const mis::path_record& record, const required& has) {
    const int n = static_cast<int>(record.vertices.size()), s = record.technique.camera_vertices;
    const auto fail_count = [&](const std::string& why) {
        fail("\"camera_vertices\" is " + std::to_string(s) + why);
    };
    if (record.technique.kind == mis::technique_kind::merge) {
        if (n == 2)
            fail_count(", but a path of 2 vertices has no merges");
        if (s < 2 || s > n - 1)
            fail_count(", but a merge on a path of " + std::to_string(n) +
                       " vertices is at none but inner ones: 2 to " + std::to_string(n - 1));
        const bool in_families =
            mis::detail::has_families(record) &&
            record.vertices[static_cast<std::size_t>(s - 1)].kind == mis::vertex_kind::medium;
        if (in_families && !has.family)
            fail("a merge in a medium needs \"family\"");
        if (in_families)
            return;
        if (!mis::is_given(record.radius))
            fail("a merge needs \"radius\"");
        if (!has.merge_count)
            fail("a merge needs \"merge\" in \"counts\"");
    } else if (s > n) {
        fail_count(", but the path has " + std::to_string(n) + " vertices");
    } else if (const auto kind = mis::technique_at(n, s).kind; kind != record.technique.kind) {
        fail_count(std::string(", which is ") + name_of(kind) + " on a path of " + std::to_string(n) +
                   " vertices, not " + name_of(record.technique.kind));
    }
}

void check_required(const required& has) {
    const auto need = [](bool is_there, const char* key) {
        if (!is_there)
            fail(quoted(key) + " is missing");
    };
    need(has.technique.has_value(), "technique");
    need(has.camera_vertices.has_value(), "camera_vertices");
    need(has.weight, "weight");
    need(has.counts, "counts");
    need(has.vertices, "vertices");
}

void clear(mis::path_record& record) {
    auto vertices = std::move(record.vertices);
    vertices.clear();
    record = {};
    record.vertices = std::move(vertices);
}

void read_record(const element& value, mis::path_record& record, std::vector<vertex_geometry>& geometry) {
    clear(record);
    simdjson::dom::object object;
    if (value.get(object) != simdjson::SUCCESS)
        fail(std::string("the line is ") + type_name(value) + ", not an object");
    required has;
    for (const auto [key, field] : object)
        read_field(key, field, record, geometry, has);
    check_required(has);
    record.technique = {*has.technique, *has.camera_vertices};
    if (record.heuristic == mis::heuristic_kind::power)
        record.parameter = has.beta;
    if (record.heuristic == mis::heuristic_kind::cutoff)
        record.parameter = has.alpha;
    check_kinds(record.vertices);
    check_technique(record, has);
    measure(record, geometry);
}

// ---- Lines ----

bool is_long_integer(std::string_view word) {
    if (!word.empty() && word[0] == '-')
        word.remove_prefix(1);
    return word.size() >= 19 && word.find_first_not_of("0123456789") == std::string_view::npos;
}

// Makes JSON of the words that some programs write in place of numbers: NaN and infinity get quotes, integers
// too long for 64 bits a fraction. Returns false where there are none.
bool repair(std::string_view line, std::string& repaired) {
    constexpr auto word_characters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789+-.()";
    bool is_changed = false;
    repaired.clear();
    for (std::size_t i = 0; i < line.size();) {
        std::size_t end = i + 1;
        std::string_view before, after;
        if (line[i] == '"') {
            while (end < line.size() && line[end] != '"')
                end += line[end] == '\\' ? 2 : 1;
            end = std::min(end + 1, line.size());
        } else if (end = std::min(line.find_first_not_of(word_characters, i), line.size()); end > i) {
            const std::string_view word = line.substr(i, end - i);
            double number = 0;
            if (is_named_number(word, number))
                before = after = "\"";
            else if (is_long_integer(word))
                after = ".0";
        } else {
            end = i + 1;
        }
        is_changed |= !after.empty();
        repaired.append(before).append(line.substr(i, end - i)).append(after);
        i = end;
    }
    return is_changed;
}

// The line must be followed by line_padding bytes.
element parse(path_reader& reader, std::string_view line) {
    auto parsed = reader.parser.parse(line.data(), line.size(), false);
    if (parsed.error() != simdjson::SUCCESS && repair(line, reader.repaired)) {
        const std::size_t length = reader.repaired.size();
        reader.repaired.resize(length + line_padding);
        parsed = reader.parser.parse(reader.repaired.data(), length, false);
    }
    if (parsed.error() != simdjson::SUCCESS)
        fail(std::string("not JSON: ") + simdjson::error_message(parsed.error()));
    return parsed.value_unsafe();
}

bool is_blank(std::string_view line) { return line.find_first_not_of(" \t\r") == std::string_view::npos; }

std::string_view without_byte_order_mark(std::string_view line) {
    constexpr std::string_view mark = "\xef\xbb\xbf";
    return line.substr(0, mark.size()) == mark ? line.substr(mark.size()) : line;
}

} // namespace

static_assert(line_padding >= simdjson::SIMDJSON_PADDING);

read_status next_record(path_reader& reader, mis::path_record& record, std::string& error) {
    std::string_view line;
    for (;;) {
        switch (next_line(reader.lines, line)) {
        case line_status::waiting:
            return read_status::waiting;
        case line_status::end:
            return read_status::end;
        case line_status::failed:
            error = reader.lines.failure;
            return read_status::failed;
        case line_status::too_long:
            error = "the line is longer than 16 MiB";
            return read_status::malformed;
        case line_status::line:
            break;
        }
        if (reader.lines.line == 1)
            line = without_byte_order_mark(line);
        if (!is_blank(line))
            break;
    }
    try {
        read_record(parse(reader, line), record, reader.geometry);
    } catch (const malformed& reason) {
        error = reason.what;
        return read_status::malformed;
    }
    record.line = reader.lines.line;
    return read_status::record;
}

} // namespace check_paths
