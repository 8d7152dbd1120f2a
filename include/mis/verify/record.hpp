// SPDX-License-Identifier: MIT
// Floor 5: one weighted contribution of a renderer, as written down for checking. docs/path_dump.md describes
// the same as JSON.
//
// A record holds what a renderer claims, its weight, and what the weight should follow from. Unlike the
// records of path.hpp it may be incomplete: densities may be given per solid angle with their geometry or per
// area, and some fields are only needed to tell one mistake from another.
//
// For tests and tools on the host; it allocates, and everything is in double.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <mis/media.hpp>
#include <mis/path.hpp>
#include <vector>

namespace mis {

// Stands for a number that a record does not have.
inline constexpr double not_given = -(std::numeric_limits<double>::max)();

constexpr bool is_given(double x) { return x != not_given; }

// What techniques, heuristics and vertices are called in files, in the order of their enumerations.
inline constexpr std::array<const char*, 7> technique_names{
    "camera_hit", "camera_connection", "direct", "connection", "next_event", "light_hit", "merge"};
inline constexpr std::array<const char*, 5> heuristic_names{"average", "balance", "power", "cutoff",
                                                            "maximum"};
inline constexpr std::array<const char*, 6> vertex_names{"camera", "surface", "dirac",
                                                         "medium", "light",   "infinite_light"};
inline constexpr std::array<const char*, 4> family_names{"point_point", "point_beam", "beam_point",
                                                         "beam_beam"};

constexpr const char* name_of(technique_kind kind) { return technique_names[static_cast<std::size_t>(kind)]; }
constexpr const char* name_of(heuristic_kind kind) { return heuristic_names[static_cast<std::size_t>(kind)]; }
constexpr const char* name_of(merge_family family) { return family_names[static_cast<std::size_t>(family)]; }
constexpr const char* name_of(vertex_kind kind) { return vertex_names[static_cast<std::size_t>(kind)]; }

// A vertex x_i of a path, from camera to light. Units as in path.hpp: densities per solid angle with roulette
// survival and light selection included, cosines with geometric normals.
struct recorded_vertex {
    vertex_kind kind = vertex_kind::surface;
    bool dirac = false; // end points only: no walk can hit it

    double pdf_to_light = not_given;
    double pdf_to_camera = not_given;
    double pdf_position = not_given;   // end points only
    double pdf_next_event = not_given; // end points only; pdf_position where not given
    double pdf_distance_from_camera = 1;
    double pdf_distance_from_light = 1;
    double merge_factor = 1;

    // In a medium, where families of merges are on: X-> and X<- of the segments that end here, and the sine
    // of the angle between them, see media.hpp.
    double beam_from_camera = not_given;
    double beam_from_light = not_given;
    double sin_angle = not_given;

    // The edges to x_{i-1} and x_{i+1}; in media and at infinity the cosines are 1. The squared distance is
    // that to x_{i+1}, at infinity 1.
    double cos_to_camera = not_given;
    double cos_to_light = not_given;
    double distance2_to_light = not_given;

    // P-> and P<- per area, for renderers that keep those. They take precedence over all of the above.
    double density_from_camera = not_given;
    double density_from_light = not_given;

    // Only to tell mistakes apart.
    double survival = not_given;             // roulette, already inside this vertex's densities
    double photon_survival = not_given;      // merges: that of the light walk's vertex
    double splits = 1;                       // expected copies of a walk, inside this vertex's densities, too
    double splits_to_camera = not_given;     // that of the light walk; `splits` where not given
    double selection = not_given;            // light selection, already inside pdf_position
    double selection_next_event = not_given; // that inside pdf_next_event; `selection` where not given
    double eta_to_camera = not_given;        // refractive indices on both sides of a Dirac vertex
    double eta_to_light = not_given;
    double shading_cos_to_camera = not_given; // with the shading normal; as cos_to_* where not given
    double shading_cos_to_light = not_given;
    double distance2_at_infinity = not_given; // infinite light: to the point where the renderer places it
    double material = not_given;              // any number by which mistakes of one material are told
    double pass_from_camera = not_given; // in a medium: of passing its last segment up to here, Pr(t > d)
    double pass_from_light = not_given;
};

// An index-matched boundary that an edge passes. It is no vertex, because no direction changes there: only to
// tell mistakes apart.
struct recorded_boundary {
    int edge = 0;                                     // from x_i to x_{i+1}: i
    double distance = 0;                              // from x_i
    double cosine = 1;                                // |cos| between the edge and the boundary's normal
    double pass_from_camera = 1, pass_from_light = 1; // of coming so far, from x_i and from x_{i+1}
};

// Fields that files hold as numbers, by their names there. The distance is kept squared, and is not among
// them.
struct recorded_number {
    const char* name;
    double recorded_vertex::*member;
};
inline constexpr std::array<recorded_number, 26> recorded_numbers{
    {{"pdf_position", &recorded_vertex::pdf_position},
     {"pdf_next_event", &recorded_vertex::pdf_next_event},
     {"pdf_to_camera", &recorded_vertex::pdf_to_camera},
     {"pdf_to_light", &recorded_vertex::pdf_to_light},
     {"density_from_camera", &recorded_vertex::density_from_camera},
     {"density_from_light", &recorded_vertex::density_from_light},
     {"cos_to_camera", &recorded_vertex::cos_to_camera},
     {"cos_to_light", &recorded_vertex::cos_to_light},
     {"shading_cos_to_camera", &recorded_vertex::shading_cos_to_camera},
     {"shading_cos_to_light", &recorded_vertex::shading_cos_to_light},
     {"survival", &recorded_vertex::survival},
     {"pdf_distance_from_camera", &recorded_vertex::pdf_distance_from_camera},
     {"pdf_distance_from_light", &recorded_vertex::pdf_distance_from_light},
     {"merge_factor", &recorded_vertex::merge_factor},
     {"beam_from_camera", &recorded_vertex::beam_from_camera},
     {"beam_from_light", &recorded_vertex::beam_from_light},
     {"sin_angle", &recorded_vertex::sin_angle},
     {"splits", &recorded_vertex::splits},
     {"splits_to_camera", &recorded_vertex::splits_to_camera},
     {"selection", &recorded_vertex::selection},
     {"selection_next_event", &recorded_vertex::selection_next_event},
     {"eta_to_camera", &recorded_vertex::eta_to_camera},
     {"eta_to_light", &recorded_vertex::eta_to_light},
     {"material", &recorded_vertex::material},
     {"pass_from_camera", &recorded_vertex::pass_from_camera},
     {"pass_from_light", &recorded_vertex::pass_from_light}}};

// Numbers of samples in double, as they are.
template <class T> technique_counts<double> in_double(const technique_counts<T>& counts) {
    technique_counts<double> c;
    c.light_hit = static_cast<double>(counts.light_hit);
    c.next_event = static_cast<double>(counts.next_event);
    c.connection = static_cast<double>(counts.connection);
    c.camera_connection = static_cast<double>(counts.camera_connection);
    c.direct = static_cast<double>(counts.direct);
    c.camera_hit = static_cast<double>(counts.camera_hit);
    c.merge = static_cast<double>(counts.merge);
    c.max_camera_vertices = counts.max_camera_vertices;
    c.max_light_vertices = counts.max_light_vertices;
    return c;
}

// A family of merges in media: how many light walks leave its points or beams, and the radius. Kernels are
// constant over spheres, disks and intervals of this radius.
struct recorded_family {
    double count = 0;
    double radius = 0;
};

struct path_record {
    std::int64_t line = 0; // where it has been read, for messages
    mis::technique technique{};
    double weight = 0; // as claimed
    heuristic_kind heuristic = heuristic_kind::balance;
    double parameter = 2; // beta of power, alpha of cutoff

    // Numbers of samples; `merge` is a number of light walks, without the area of the disk. The caps are
    // those of sub-paths.
    technique_counts<double> counts;
    double radius = not_given;                 // of merges
    std::array<recorded_family, 4> families{}; // of merges in media, by merge_family; none where all are 0
    merge_family family{};                     // of a merge in a medium
    bool splits_on_arrival = false; // before a vertex is joined: splits are inside the densities of arriving
    std::vector<recorded_vertex> vertices;
    std::vector<recorded_boundary> boundaries; // of all edges, from camera to light
};

namespace detail {

template <class T> recorded_vertex recorded(const measured_vertex<T>& m) {
    recorded_vertex x;
    x.kind = m.kind;
    x.dirac = m.dirac;
    x.pdf_to_light = static_cast<double>(m.pdf_to_light);
    x.pdf_to_camera = static_cast<double>(m.pdf_to_camera);
    x.pdf_position = static_cast<double>(m.pdf_position);
    x.pdf_next_event = static_cast<double>(m.pdf_next_event);
    x.pdf_distance_from_camera = static_cast<double>(m.pdf_distance_from_camera);
    x.pdf_distance_from_light = static_cast<double>(m.pdf_distance_from_light);
    x.merge_factor = static_cast<double>(m.merge_factor);
    x.cos_to_camera = static_cast<double>(m.cos_to_camera);
    x.cos_to_light = static_cast<double>(m.cos_to_light);
    x.distance2_to_light = static_cast<double>(m.distance2_to_light);
    return x;
}
template <class Vertex> recorded_vertex recorded(const Vertex* path, int n, int i) {
    return recorded(measure(path, n, i));
}
template <class T> recorded_vertex recorded(const area_vertex<T>* path, int n, int i) {
    recorded_vertex x;
    x.kind = path[i].kind;
    x.dirac = path[i].dirac;
    x.merge_factor = static_cast<double>(path[i].merge_factor);
    x.density_from_camera = static_cast<double>(path[i].density_from_camera);
    x.density_from_light = static_cast<double>(path[i].density_from_light);
    if (i == 0 || i == n - 1)
        x.pdf_next_event = static_cast<double>(path[i].next_event);
    return x;
}

} // namespace detail

// The record of a path in any of the forms of path.hpp. The count of merges includes their area pi r^2, as
// everywhere but in records; with the radius given, it is taken apart. Fields that only tell mistakes apart
// may be filled in afterwards.
template <class T, class Vertex>
path_record record_of(const technique_counts<T>& counts, const Vertex* path, int n, technique t,
                      double weight, double radius = not_given) {
    path_record r;
    r.technique = t;
    r.weight = weight;
    r.counts = in_double(counts);
    r.radius = radius;
    if (is_given(radius))
        r.counts.merge /= merge_area(radius);
    for (int i = 0; i < n; ++i)
        r.vertices.push_back(detail::recorded(path, n, i));
    return r;
}

// ---- Numbers that are none ----

// Both look at the bits, because under -ffast-math comparisons may not tell.
inline bool is_number(double x) { // neither NaN nor infinite
    std::uint64_t bits = 0;
    std::memcpy(&bits, &x, sizeof x);
    return (bits >> 52 & 0x7ff) != 0x7ff;
}
inline bool is_nan(double x) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &x, sizeof x);
    return !is_number(x) && (bits << 12) != 0;
}

// A field of a record: of a vertex, or (-1) of the record itself. `field` is null where there is none.
struct record_place {
    int vertex = -1;
    const char* field = nullptr;
};

namespace detail {

inline bool is_measure(double x) { return is_number(x) && x >= 0; }

// Fields of the record itself from which no weight follows.
inline const char* first_bad_field(const path_record& record) {
    const int n = static_cast<int>(record.vertices.size());
    if (n < 2)
        return "vertices";
    const technique t = record.technique;
    const int place = technique_index(n, t);
    if (t.camera_vertices < 0 || place < 0 || place >= technique_count(n) || technique_at(n, place) != t)
        return "technique";
    if (record.heuristic == heuristic_kind::power && !is_measure(record.parameter))
        return "beta";
    if (record.heuristic == heuristic_kind::cutoff &&
        !(is_measure(record.parameter) && record.parameter <= 1))
        return "alpha";
    for (int kind = 0; kind <= static_cast<int>(technique_kind::merge); ++kind)
        if (!is_measure(count_of(record.counts, static_cast<technique_kind>(kind))))
            return "counts";
    if (is_given(record.radius) && !is_measure(record.radius))
        return "radius";
    for (const recorded_family& family : record.families)
        if (!is_measure(family.count) || !is_measure(family.radius))
            return "families";
    return nullptr;
}
inline bool is_good(const recorded_boundary& b, int n) {
    return b.edge >= 0 && b.edge < n - 1 && is_measure(b.distance) && is_measure(b.cosine) &&
           is_measure(b.pass_from_camera) && is_measure(b.pass_from_light);
}

} // namespace detail

// The first field of a record from which no weight follows: fewer than 2 vertices, a technique that paths of
// its length do not have, a beta that is NaN, infinite or negative, an alpha outside [0, 1], or another
// number that is NaN, infinite or negative. Where it is 0, a count or a radius switches its technique off.
inline record_place first_bad_number(const path_record& record) {
    if (const char* bad = detail::first_bad_field(record))
        return {-1, bad};
    const auto is_bad = [](double x) { return is_given(x) && !detail::is_measure(x); };
    for (std::size_t i = 0; i < record.vertices.size(); ++i) {
        const recorded_vertex& x = record.vertices[i];
        for (const auto& [name, member] : recorded_numbers)
            if (is_bad(x.*member))
                return {static_cast<int>(i), name};
        if (is_bad(x.distance2_to_light))
            return {static_cast<int>(i), "distance"};
        if (is_bad(x.photon_survival))
            return {static_cast<int>(i), "photon.survival"};
        if (is_bad(x.distance2_at_infinity))
            return {static_cast<int>(i), "position"};
    }
    for (const recorded_boundary& b : record.boundaries)
        if (!detail::is_good(b, static_cast<int>(record.vertices.size())))
            return {b.edge, "boundaries"};
    return {};
}

// ---- The weight that follows from a record ----

// Everything here is the logarithm of a density, so that products of any length are sums and a factor that
// is forgotten, or too many, is a difference. Three numbers stand for what has no logarithm; they add up as
// they should: 0 times anything is 0, and infinity times what is not given is not given.
namespace log_density {
inline constexpr double zero = -1e24;
inline constexpr double infinite = 1e10;
inline constexpr double missing = 1e17;

constexpr bool is_zero(double q) { return q < -1e23; }
constexpr bool is_missing(double q) { return q > 9e16; }
constexpr bool is_infinite(double q) { return q > 1e9 && !is_missing(q); }
} // namespace log_density

inline double log_of(double x) {
    if (!is_given(x))
        return log_density::missing;
    if (!(x > 0))
        return log_density::zero;
    return is_number(x) ? std::log(x) : log_density::infinite;
}

inline double log_of_inverse(double x) {
    if (!is_given(x))
        return log_density::missing;
    return x > 0 ? (is_number(x) ? -std::log(x) : log_density::zero) : log_density::infinite;
}

// How a renderer computes q^beta / sum q^beta; anything but `exact` is a mistake.
enum class weight_arithmetic : unsigned char {
    exact,
    float_products,   // q^beta in float, of densities of whole paths
    float_area,       // of the last densities per area: a path tracer's light hit against next event
    float_solid_angle // of the same per solid angle
};

// What the maximum heuristic gives to densities that tie.
enum class tie_rule : unsigned char { shared, all_win, all_lose };

// What one weight is computed from: densities, counts, rules. The edges' geometry is in the densities.
struct weight_terms {
    technique made_by{};
    heuristic_kind heuristic = heuristic_kind::balance;
    double parameter = 2;
    weight_arithmetic arithmetic = weight_arithmetic::exact;
    tie_rule ties = tie_rule::shared;
    double constant = not_given; // a weight that follows from no density

    std::vector<double> from_camera, from_light; // P-> and P<- of each vertex
    std::vector<double> merge_factors;
    std::vector<unsigned char> can_connect, can_merge; // 0 at Dirac scatterers
    // Merges in media: each family's count times its kernel, and X->, X<- and the sine at each vertex (empty
    // where no family is on).
    struct medium_place {
        bool in_medium = false;
        double from_camera = 0, from_light = 0, sin_angle = 0;
    };
    std::array<double, 4> families{};
    std::vector<medium_place> media;
    merge_family family{};        // that made_by is of, in a medium
    double next_event = 0;        // of the light point
    double camera_connection = 0; // of the lens point
    bool light_can_be_hit = true, camera_can_be_hit = false;

    std::array<double, 7> counts{}; // by technique_kind; merges without their area
    double merge_area = 0;
    double last_to_area = 0;       // |cos| / d^2 at the light
    technique_counts<double> caps; // max_camera_vertices, max_light_vertices; counts unused

    double& count(technique_kind kind) { return counts[static_cast<std::size_t>(kind)]; }
    double count(technique_kind kind) const { return counts[static_cast<std::size_t>(kind)]; }
};

inline int size_of(const weight_terms& terms) { return static_cast<int>(terms.from_camera.size()); }

namespace detail {

// P-> of x_i, or P<-: the density at the neighbour, converted to area.
inline double log_from_camera(const path_record& record, std::size_t i) {
    const recorded_vertex& x = record.vertices[i];
    if (is_given(x.density_from_camera))
        return log_of(x.density_from_camera);
    if (i == 0)
        return is_given(x.pdf_position) ? log_of(x.pdf_position) : 0.0;
    const recorded_vertex& previous = record.vertices[i - 1];
    return log_of(previous.pdf_to_light) + log_of(x.cos_to_camera) + log_of(x.pdf_distance_from_camera) +
           log_of_inverse(previous.distance2_to_light);
}
inline double log_from_light(const path_record& record, std::size_t i) {
    const recorded_vertex& x = record.vertices[i];
    if (is_given(x.density_from_light))
        return log_of(x.density_from_light);
    if (i + 1 == record.vertices.size())
        return log_of(x.pdf_position);
    return log_of(record.vertices[i + 1].pdf_to_camera) + log_of(x.cos_to_light) +
           log_of(x.pdf_distance_from_light) + log_of_inverse(x.distance2_to_light);
}

// A family's kernel, constant over a sphere, disk or interval: 4/3 pi r^3, pi r^2 or 2 r.
constexpr int dimensions_of(merge_family f) {
    return f == merge_family::point_point ? 3 : f == merge_family::beam_beam ? 1 : 2;
}
inline double log_kernel(merge_family f, double radius) {
    constexpr double pi = 3.14159265358979323846;
    const int dimensions = dimensions_of(f);
    return dimensions * log_of(radius) + std::log(dimensions == 3 ? pi * 4 / 3 : dimensions == 2 ? pi : 2.0);
}
inline const recorded_family& family_of(const path_record& record, merge_family f) {
    return record.families[static_cast<std::size_t>(f)];
}
inline bool is_on(const recorded_family& family) { return family.count > 0 && family.radius > 0; }
inline bool has_families(const path_record& record) {
    for (const recorded_family& family : record.families)
        if (is_on(family))
            return true;
    return false;
}

} // namespace detail

// The terms of the right weight. `terms` is reused: nothing is allocated once it has held a longer path.
inline void terms_of(const path_record& record, weight_terms& terms) {
    const std::size_t n = record.vertices.size();
    terms.made_by = record.technique;
    terms.heuristic = record.heuristic;
    terms.parameter = record.parameter;
    terms.arithmetic = weight_arithmetic::exact;
    terms.ties = tie_rule::shared;
    terms.constant = not_given;
    terms.from_camera.resize(n);
    terms.from_light.resize(n);
    terms.merge_factors.resize(n);
    terms.can_connect.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
        terms.from_camera[i] = detail::log_from_camera(record, i);
        terms.from_light[i] = detail::log_from_light(record, i);
        terms.merge_factors[i] = log_of(record.vertices[i].merge_factor);
        terms.can_connect[i] = record.vertices[i].kind != vertex_kind::dirac;
    }
    terms.can_merge = terms.can_connect;
    terms.family = record.family;
    terms.media.clear();
    if (detail::has_families(record)) {
        for (std::size_t f = 0; f < terms.families.size(); ++f) {
            const recorded_family& family = record.families[f];
            terms.families[f] =
                detail::is_on(family)
                    ? log_of(family.count) + detail::log_kernel(static_cast<merge_family>(f), family.radius)
                    : log_density::zero;
        }
        for (const recorded_vertex& x : record.vertices)
            terms.media.push_back({x.kind == vertex_kind::medium, log_of(x.beam_from_camera),
                                   log_of(x.beam_from_light), log_of(x.sin_angle)});
    }
    const recorded_vertex &camera = record.vertices.front(), &light = record.vertices.back();
    terms.next_event =
        is_given(light.pdf_next_event) ? log_of(light.pdf_next_event) : terms.from_light[n - 1];
    terms.camera_connection =
        is_given(camera.pdf_next_event) ? log_of(camera.pdf_next_event) : terms.from_camera[0];
    terms.light_can_be_hit = !light.dirac;
    terms.camera_can_be_hit = !camera.dirac;
    for (std::size_t kind = 0; kind < terms.counts.size(); ++kind)
        terms.counts[kind] = log_of(count_of(record.counts, static_cast<technique_kind>(kind)));
    terms.merge_area = is_given(record.radius) ? log_of(merge_area(record.radius)) : 0.0;
    const double last = record.vertices[n - 2].pdf_to_light;
    terms.last_to_area = is_given(last) ? terms.from_camera[n - 1] - log_of(last) : 0.0;
    terms.caps = record.counts;
}

// Whether a path's vertices allow a technique, and whether it is switched on and within the caps.
inline bool is_on(const weight_terms& terms, technique t) {
    const std::size_t s = static_cast<std::size_t>(t.camera_vertices);
    if (log_density::is_zero(terms.count(t.kind)) || !is_within_caps(terms.caps, size_of(terms), t))
        return false;
    switch (t.kind) {
    case technique_kind::camera_hit:
        return terms.camera_can_be_hit;
    case technique_kind::light_hit:
        return terms.light_can_be_hit;
    case technique_kind::merge:
        return terms.can_merge[s - 1] != 0;
    default:
        return terms.can_connect[s - 1] != 0 && terms.can_connect[s] != 0;
    }
}

// A weight as it follows from its terms.
struct expected_weight {
    double weight = 0;
    bool undecided = false; // hangs on the rounding of densities: maximum and cutoff
    int tied = 1;           // maximum: techniques that share the largest density, but for rounding
    int missing = -1;       // place of a technique whose density is not given, see technique_at
};

namespace detail {

// Whether merges at x_i are those of families in media; the size of one there, as by at_vertex in media.hpp
// (what is off, 0, needs no beam); and its place, behind those of technique_at.
inline bool has_families_at(const weight_terms& terms, std::size_t i) {
    return !terms.media.empty() && terms.media[i].in_medium;
}
inline double log_size_at(const weight_terms& terms, std::size_t i, int family) {
    const weight_terms::medium_place& x = terms.media[i];
    const double size = terms.families[static_cast<std::size_t>(family)];
    switch (static_cast<merge_family>(family)) {
    case merge_family::point_point:
        return size;
    case merge_family::point_beam:
        return size + x.from_camera;
    case merge_family::beam_point:
        return size + x.from_light;
    case merge_family::beam_beam:
        break;
    }
    return size + (x.from_camera + x.from_light + x.sin_angle);
}
constexpr int family_place(int n, int i, int family) { return technique_count(n) + 4 * i + family; }
// The place of the technique that made the path; and the place of a technique, or of the merge that a family
// is of.
inline int place_made_by(const weight_terms& terms) {
    const int i = terms.made_by.camera_vertices - 1;
    return terms.made_by.kind == technique_kind::merge && has_families_at(terms, static_cast<std::size_t>(i))
               ? family_place(size_of(terms), i, static_cast<int>(terms.family))
               : technique_index(size_of(terms), terms.made_by);
}
constexpr int technique_place(int n, int place) {
    return place < technique_count(n) ? place : n + (place - technique_count(n)) / 4;
}
// The number of samples of the technique at a place, or its size.
inline double log_samples(const weight_terms& terms, int place) {
    const int n = size_of(terms), families = place - technique_count(n);
    if (families >= 0)
        return log_size_at(terms, static_cast<std::size_t>(families / 4), families % 4);
    const technique t = technique_at(n, place);
    const bool merges = t.kind == technique_kind::merge;
    return terms.count(t.kind) +
           (merges ? terms.merge_factors[static_cast<std::size_t>(t.camera_vertices - 1)] + terms.merge_area
                   : 0.0);
}

// Calls visit(place, effective density) for every technique that is on: products of P-> up to the edge or
// vertex, and of P<- from there.
template <class Visit> void for_each_log_density(const weight_terms& terms, Visit&& visit) {
    const int n = size_of(terms);
    double behind[256];
    std::vector<double> long_path;
    double* from_light = behind; // the light walk's product up to x_i
    if (n >= 256) {
        long_path.resize(static_cast<std::size_t>(n) + 1);
        from_light = long_path.data();
    }
    from_light[n] = 0;
    for (int i = n - 1; i >= 0; --i)
        from_light[i] = from_light[i + 1] + terms.from_light[static_cast<std::size_t>(i)];
    double from_camera = 0;
    for (int s = 0; s <= n; ++s) {
        const technique t = technique_at(n, s);
        if (is_on(terms, t)) {
            double q = from_camera + from_light[s];
            if (t.kind == technique_kind::camera_connection)
                q = terms.camera_connection + from_light[1];
            if (t.kind == technique_kind::next_event)
                q = from_camera + terms.next_event;
            visit(s, q + terms.count(t.kind));
        }
        if (s == n)
            break;
        const std::size_t i = static_cast<std::size_t>(s);
        from_camera += terms.from_camera[i];
        if (s < 1 || s > n - 2)
            continue;
        if (has_families_at(terms, i)) {
            for (int f = 0; f < 4 && is_within_caps(terms.caps, n, {technique_kind::merge, s + 1}); ++f)
                if (const double size = log_size_at(terms, i, f); !log_density::is_zero(size))
                    visit(family_place(n, s, f), from_camera + from_light[s] + size);
        } else if (is_on(terms, {technique_kind::merge, s + 1}))
            visit(n + s, from_camera + from_light[s] + log_samples(terms, n + s));
    }
}

// Two sums of logarithms that are closer are the same density.
inline constexpr double rounding_of_sums = 1e-11;

inline double log_product(const std::vector<double>& densities, int count) {
    double sum = 0;
    for (int i = 0; i < count; ++i)
        sum += densities[static_cast<std::size_t>(i)];
    return sum;
}

// The weight with q^beta and its sum in float, and so with all that overflows and underflows there.
inline double weight_in_float(const weight_terms& terms) {
    const int n = size_of(terms);
    const double common = // what a path tracer leaves out of both its densities
        terms.arithmetic == weight_arithmetic::float_products
            ? 0.0
            : log_product(terms.from_camera, n - 1) +
                  (terms.arithmetic == weight_arithmetic::float_solid_angle ? terms.last_to_area : 0.0);
    const float beta = static_cast<float>(terms.parameter);
    float sum = 0, own = 0;
    for_each_log_density(terms, [&](int place, double q) {
        const float density = static_cast<float>(std::exp(q - common));
        const float raised = terms.parameter == 2.0 ? density * density : std::pow(density, beta);
        sum += raised;
        if (place == place_made_by(terms))
            own = raised;
    });
    return static_cast<double>(own / sum);
}

// b(q) over that of the largest density.
inline double log_share(const weight_terms& terms, double q, double largest) {
    switch (terms.heuristic) {
    case heuristic_kind::balance:
        return std::exp(q - largest);
    case heuristic_kind::power:
        return std::exp(terms.parameter * (q - largest));
    case heuristic_kind::cutoff:
        return q < largest + std::log(terms.parameter) ? 0.0 : std::exp(q - largest);
    case heuristic_kind::maximum:
        return q < largest - rounding_of_sums ? 0.0 : 1.0;
    case heuristic_kind::average:
        break;
    }
    return 1;
}

// True where a density is so close to the largest, or to the cutoff, that a renderer's rounding decides. An
// exact tie is decided.
inline bool hangs_on_rounding(const weight_terms& terms, double q, double largest) {
    const double off = terms.heuristic == heuristic_kind::cutoff    ? q - largest - std::log(terms.parameter)
                       : terms.heuristic == heuristic_kind::maximum ? q - largest
                                                                    : 1;
    const bool exact = terms.heuristic == heuristic_kind::maximum && off >= -rounding_of_sums;
    return !exact && std::abs(off) < 1e-4;
}

} // namespace detail

// The weight of the technique that made the path: the heuristic over all techniques' effective densities,
// products of P-> and P<-, [V97] 9.2, [J] 3. The same as mis::weight in path.hpp, which tests compare.
inline expected_weight weight_of(const weight_terms& terms) {
    expected_weight result;
    if (is_given(terms.constant)) {
        result.weight = terms.constant;
        return result;
    }
    if (terms.arithmetic != weight_arithmetic::exact) {
        result.weight = detail::weight_in_float(terms);
        return result;
    }
    const int own_place = detail::place_made_by(terms);
    constexpr int usual = 64;
    double kept[usual]; // densities: paths of up to 32 vertices are multiplied out once
    int visited = 0;
    const auto clamped = [](double q) { return log_density::is_infinite(q) ? log_density::infinite : q; };
    double largest = log_density::zero, own = log_density::zero;
    detail::for_each_log_density(terms, [&](int place, double density) {
        if (log_density::is_missing(density))
            result.missing = detail::technique_place(size_of(terms), place);
        const double q = clamped(density);
        if (visited < usual)
            kept[visited] = q;
        ++visited;
        largest = (std::max)(largest, q);
        if (place == own_place)
            own = q;
    });
    if (log_density::is_zero(own) || result.missing >= 0)
        return result;
    double sum = 0;
    int tied = 0;
    const auto add = [&](double q) {
        if (log_density::is_zero(q))
            return;
        sum += detail::log_share(terms, q, largest);
        tied += q >= largest - detail::rounding_of_sums;
        result.undecided |= detail::hangs_on_rounding(terms, q, largest);
    };
    if (visited <= usual)
        std::for_each(kept, kept + visited, add);
    else
        detail::for_each_log_density(terms, [&](int, double density) { add(clamped(density)); });
    result.weight = detail::log_share(terms, own, largest) / sum;
    if (terms.heuristic == heuristic_kind::maximum && result.weight > 0) {
        result.tied = tied;
        if (tied > 1 && terms.ties != tie_rule::shared)
            result.weight = terms.ties == tie_rule::all_win ? 1 : 0;
    }
    return result;
}

// Where q^beta of a technique first leaves the range of float, multiplied vertex by vertex from the camera: a
// renderer in float gets 0, infinity or NaN from there on. -1: nowhere. The technique that made the path is
// looked at first.
inline int first_float_overflow(const weight_terms& terms) {
    const int n = size_of(terms);
    const double beta = terms.heuristic == heuristic_kind::power ? terms.parameter : 1.0;
    const auto overflows = [&](int place) {
        const technique t = technique_at(n, detail::technique_place(n, place));
        const bool merges = t.kind == technique_kind::merge;
        double product = detail::log_samples(terms, place);
        for (int i = 0; i < n; ++i) {
            const std::size_t at = static_cast<std::size_t>(i);
            product += i < t.camera_vertices ? terms.from_camera[at] : 0.0;
            product += i >= t.camera_vertices - (merges ? 1 : 0) ? terms.from_light[at] : 0.0;
            if (beta * product < std::log(1e-45) || beta * product > std::log(3.4e38))
                return i;
        }
        return -1;
    };
    const int own_place = detail::place_made_by(terms);
    int own = -1, first = -1;
    detail::for_each_log_density(terms, [&](int place, double) {
        if (place == own_place)
            own = overflows(place);
        else if (first < 0)
            first = overflows(place);
    });
    return own >= 0 ? own : first;
}

} // namespace mis
