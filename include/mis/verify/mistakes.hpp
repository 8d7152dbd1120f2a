// SPDX-License-Identifier: MIT
// Floor 5: the mistakes that renderers make in their weights, each as a change to the terms of a weight.
//
// A mistake leaves a factor out of a density, or puts one in, or changes a count or a rule. Given a record of
// a path, it therefore predicts the wrong weight that a renderer with that mistake would have claimed.
// Comparing predictions with claims tells which mistake has been made: diagnosis.hpp. docs/wrong_weights.md
// explains each of them to the author of a renderer.
#pragma once

#include <iterator>
#include <mis/verify/record.hpp>

namespace mis {

// What planting a mistake in the terms of one record has done.
enum class planted : unsigned char {
    nothing, // the mistake cannot show in this path
    changed,
    unknown // the record lacks the field that `needs` names
};

// One way of making a mistake. Several ways share an identifier.
struct mistake {
    const char* identifier;
    const char* what;   // what is wrong, a sentence
    const char* advice; // what to change
    const char* needs;  // the field without which it cannot be told, or an empty string
    planted (*plant)(weight_terms& terms, const path_record& record);
};

namespace detail {

// Whether the camera walk, or the light walk, has made vertex i of the path: both, at a merge.
inline bool is_on_camera_walk(const path_record& r, int i) { return i < r.technique.camera_vertices; }
inline bool is_on_light_walk(const path_record& r, int i) {
    const bool merges = r.technique.kind == technique_kind::merge;
    return i >= r.technique.camera_vertices - (merges ? 1 : 0);
}

inline int size_of(const path_record& r) { return static_cast<int>(r.vertices.size()); }
inline const recorded_vertex& vertex(const path_record& r, int i) {
    return r.vertices[static_cast<std::size_t>(i)];
}
inline double& from_camera(weight_terms& terms, int i) {
    return terms.from_camera[static_cast<std::size_t>(i)];
}
inline double& from_light(weight_terms& terms, int i) {
    return terms.from_light[static_cast<std::size_t>(i)];
}
inline bool is_dirac(const path_record& r, int i) { return vertex(r, i).kind == vertex_kind::dirac; }
inline bool is_infinite_light(const path_record& r) {
    return r.vertices.back().kind == vertex_kind::infinite_light;
}

// Adds to a logarithm; reports whether that is a change.
inline planted multiply(double& density, double factor) {
    if (log_density::is_missing(factor) || log_density::is_missing(-factor))
        return planted::unknown;
    density += factor;
    return factor == 0 ? planted::nothing : planted::changed;
}
inline planted set(double& term, double value) {
    const bool same = term == value;
    term = value;
    return same ? planted::nothing : planted::changed;
}
// What several changes have done together.
inline planted operator|(planted a, planted b) {
    if (a == planted::unknown || b == planted::unknown)
        return planted::unknown;
    return a == planted::changed || b == planted::changed ? planted::changed : planted::nothing;
}

// Whether the path has been made by merging in a medium, by a family; and whether that has merged with the
// camera walk's beam, or the light walk's.
inline bool is_merge_in_medium(const path_record& r) {
    return r.technique.kind == technique_kind::merge && has_families(r) &&
           vertex(r, r.technique.camera_vertices - 1).kind == vertex_kind::medium;
}
inline bool has_camera_beam(merge_family f) {
    return f == merge_family::point_beam || f == merge_family::beam_beam;
}
inline bool has_light_beam(merge_family f) {
    return f == merge_family::beam_point || f == merge_family::beam_beam;
}

// Adds change(family, what the record says of it) to the size of every family that is on.
template <class Change> planted change_families(weight_terms& terms, const path_record& r, Change&& change) {
    planted done = planted::nothing;
    for (std::size_t f = 0; f < terms.families.size() && !terms.media.empty(); ++f)
        if (!log_density::is_zero(terms.families[f]))
            done = done | multiply(terms.families[f], change(static_cast<merge_family>(f), r.families[f]));
    return done;
}

// ---- Roulette and splitting ----

// Takes a vertex' survival out of the density of the camera walk's next vertex, or of the light walk's.
struct survival_of_vertex {
    static planted forget_to_light(weight_terms& terms, const path_record& r, int i) {
        return multiply(from_camera(terms, i + 1), log_of_inverse(vertex(r, i).survival));
    }
    static planted forget_to_camera(weight_terms& terms, const path_record& r, int i) {
        const recorded_vertex& x = vertex(r, i);
        return multiply(from_light(terms, i - 1),
                        log_of_inverse(is_given(x.photon_survival) ? x.photon_survival : x.survival));
    }
};
// The same of the number of copies, which on arrival is in the density of the vertex itself.
struct splits_of_vertex {
    static double log_to_camera(const recorded_vertex& x) {
        return log_of_inverse(is_given(x.splits_to_camera) ? x.splits_to_camera : x.splits);
    }
    static planted forget_to_light(weight_terms& terms, const path_record& r, int i) {
        return multiply(from_camera(terms, r.splits_on_arrival ? i : i + 1),
                        log_of_inverse(vertex(r, i).splits));
    }
    static planted forget_to_camera(weight_terms& terms, const path_record& r, int i) {
        return multiply(from_light(terms, r.splits_on_arrival ? i : i - 1), log_to_camera(vertex(r, i)));
    }
};

enum class forgotten { both, to_light, to_camera, reverse, forward };
template <class Factor, forgotten Which, bool AtDirac>
planted forget_factor(weight_terms& terms, const path_record& r) {
    planted done = planted::nothing;
    for (int i = 1; i < size_of(r) - 1; ++i) {
        if (!AtDirac && is_dirac(r, i))
            continue;
        const bool camera = is_on_camera_walk(r, i); // as is the merged vertex, where it is evaluated
        const bool to_light = Which == forgotten::both || Which == forgotten::to_light ||
                              (Which == forgotten::reverse && !camera) ||
                              (Which == forgotten::forward && camera);
        const bool to_camera = Which == forgotten::both || Which == forgotten::to_camera ||
                               (Which == forgotten::reverse && camera) ||
                               (Which == forgotten::forward && !camera);
        if (to_light)
            done = done | Factor::forget_to_light(terms, r, i);
        if (to_camera)
            done = done | Factor::forget_to_camera(terms, r, i);
    }
    return done;
}
template <class Factor, technique_kind Kind>
planted forget_factor_in(weight_terms& terms, const path_record& r) {
    return r.technique.kind == Kind ? forget_factor<Factor, forgotten::both, true>(terms, r)
                                    : planted::nothing;
}
template <forgotten Which, bool AtDirac> planted forget_survival(weight_terms& terms, const path_record& r) {
    return forget_factor<survival_of_vertex, Which, AtDirac>(terms, r);
}
template <technique_kind Kind> planted forget_survival_in(weight_terms& terms, const path_record& r) {
    return forget_factor_in<survival_of_vertex, Kind>(terms, r);
}
template <forgotten Which> planted forget_splits(weight_terms& terms, const path_record& r) {
    return forget_factor<splits_of_vertex, Which, true>(terms, r);
}
template <technique_kind Kind> planted forget_splits_in(weight_terms& terms, const path_record& r) {
    return forget_factor_in<splits_of_vertex, Kind>(terms, r);
}
// Splits on arrival that count for what a walk goes on to, and not for what is joined or merged at the
// vertex.
inline planted forget_splits_at_joins(weight_terms& terms, const path_record& r) {
    planted done = planted::nothing;
    for (int i = 1; i < size_of(r) - 1 && r.splits_on_arrival; ++i) {
        const double to_light = log_of_inverse(vertex(r, i).splits);
        const double to_camera = splits_of_vertex::log_to_camera(vertex(r, i));
        done = done | multiply(from_camera(terms, i), to_light) |
               multiply(from_camera(terms, i + 1), -to_light) | multiply(from_light(terms, i), to_camera) |
               multiply(from_light(terms, i - 1), -to_camera);
    }
    return done;
}

constexpr const char* how_to_count_splits =
    "Where walks split, multiply the expected number of copies into the density of what they go on to, of "
    "both walks; where they do so before they are joined, into that of arriving.";

// The survival of the other walk's vertex, at a merge.
enum class exchanged { to_camera, to_light, both };
template <exchanged Which> planted exchange_survival(weight_terms& terms, const path_record& r) {
    if (r.technique.kind != technique_kind::merge)
        return planted::nothing;
    const int j = r.technique.camera_vertices - 1;
    const double ratio = log_of(vertex(r, j).survival) + log_of_inverse(vertex(r, j).photon_survival);
    planted done = planted::nothing;
    if (Which != exchanged::to_light)
        done = done | multiply(from_light(terms, j - 1), ratio);
    if (Which != exchanged::to_camera)
        done = done | multiply(from_camera(terms, j + 1), -ratio);
    return done;
}

// ---- Geometry ----

enum class direction { both, from_camera, from_light };
constexpr bool includes(direction all, direction one) { return all == direction::both || all == one; }

template <direction Which> planted use_shading_cosines(weight_terms& terms, const path_record& r) {
    planted done = planted::nothing;
    for (int i = 1; i < size_of(r) - 1; ++i) {
        const recorded_vertex& x = vertex(r, i);
        if (includes(Which, direction::from_camera) && is_given(x.shading_cos_to_camera))
            done = done | multiply(from_camera(terms, i),
                                   log_of(x.shading_cos_to_camera) + log_of_inverse(x.cos_to_camera));
        if (includes(Which, direction::from_light) && is_given(x.shading_cos_to_light))
            done = done | multiply(from_light(terms, i),
                                   log_of(x.shading_cos_to_light) + log_of_inverse(x.cos_to_light));
    }
    return done;
}

// |cos| / d^2 of the edge x_{i-1}, x_i at its far end, as seen by each walk, and 1 / d^2 alone.
inline double log_to_area_from_camera(const path_record& r, int i) {
    return log_of(vertex(r, i).cos_to_camera) + log_of_inverse(vertex(r, i - 1).distance2_to_light);
}
inline double log_to_area_from_light(const path_record& r, int i) {
    return log_of(vertex(r, i).cos_to_light) + log_of_inverse(vertex(r, i).distance2_to_light);
}

template <direction Which> planted leave_solid_angle(weight_terms& terms, const path_record& r) {
    planted done = planted::nothing;
    for (int i = 1; i < size_of(r); ++i) {
        if (includes(Which, direction::from_camera))
            done = done | multiply(from_camera(terms, i), -log_to_area_from_camera(r, i));
        if (includes(Which, direction::from_light))
            done = done | multiply(from_light(terms, i - 1), -log_to_area_from_light(r, i - 1));
    }
    return done;
}
// A recursion that does not convert on arrival loses the distance of the edge in both directions, and the
// cosine at its far end.
inline planted leave_solid_angle_in_walks(weight_terms& terms, const path_record& r) {
    planted done = planted::nothing;
    for (int i = 1; i < size_of(r); ++i) { // the edge x_{i-1}, x_i
        const double distance2 = log_of(vertex(r, i - 1).distance2_to_light);
        if (is_on_camera_walk(r, i))
            done = done | multiply(from_camera(terms, i), -log_to_area_from_camera(r, i)) |
                   multiply(from_light(terms, i - 1), distance2);
        if (is_on_light_walk(r, i - 1))
            done = done | multiply(from_light(terms, i - 1), -log_to_area_from_light(r, i - 1)) |
                   multiply(from_camera(terms, i), distance2);
    }
    return done;
}
inline planted leave_solid_angle_at_light(weight_terms& terms, const path_record& r) {
    const int last = size_of(r) - 1;
    return multiply(from_camera(terms, last), -log_to_area_from_camera(r, last));
}
inline planted next_event_in_solid_angle(weight_terms& terms, const path_record& r) {
    return multiply(terms.next_event, -log_to_area_from_camera(r, size_of(r) - 1));
}

inline planted forget_cosine_at_infinity(weight_terms& terms, const path_record& r) {
    const int i = size_of(r) - 2;
    if (!is_infinite_light(r) || i == 0)
        return planted::nothing;
    return multiply(from_light(terms, i), log_of_inverse(vertex(r, i).cos_to_light));
}
template <direction Which> planted use_distance_at_infinity(weight_terms& terms, const path_record& r) {
    if (!is_infinite_light(r))
        return planted::nothing;
    const int last = size_of(r) - 1;
    const double factor = log_of_inverse(vertex(r, last).distance2_at_infinity);
    planted done = planted::nothing;
    if (includes(Which, direction::from_camera))
        done = done | multiply(from_camera(terms, last), factor);
    if (includes(Which, direction::from_light) && last > 1)
        done = done | multiply(from_light(terms, last - 1), factor);
    return done;
}

// ---- Dirac scatterers ----

// What a walk's Dirac choice leads to has density 1: nothing of the edge behind it is left.
template <bool AndInto> planted drop_dirac_geometry(weight_terms& terms, const path_record& r) {
    planted done = planted::nothing;
    for (int i = 1; i < size_of(r) - 1; ++i)
        if (is_dirac(r, i)) {
            done = done | set(from_camera(terms, i + 1), 0) | set(from_light(terms, i - 1), 0);
            if (AndInto)
                done = done | set(from_camera(terms, i), 0) | set(from_light(terms, i), 0);
        }
    return done;
}
// The probability of the lobe stays, without cosine and distance of the edge behind.
inline planted drop_dirac_conversion(weight_terms& terms, const path_record& r) {
    planted done = planted::nothing;
    for (int i = 1; i < size_of(r) - 1; ++i)
        if (is_dirac(r, i))
            done = done | multiply(from_camera(terms, i + 1), -log_to_area_from_camera(r, i + 1)) |
                   multiply(from_light(terms, i - 1), -log_to_area_from_light(r, i - 1));
    return done;
}
// At a reflection the factors cancel, unless the vertex also counts as connectible.
template <bool AndCosines> planted forget_etendue(weight_terms& terms, const path_record& r) {
    planted done = planted::nothing;
    for (int i = 1; i < size_of(r) - 1; ++i) {
        const recorded_vertex& x = vertex(r, i);
        if (x.kind != vertex_kind::dirac)
            continue;
        const double cos_to_light = AndCosines ? log_of_inverse(x.cos_to_light) : 0.0;
        const double cos_to_camera = AndCosines ? log_of_inverse(x.cos_to_camera) : 0.0;
        done = done | multiply(from_camera(terms, i + 1), 2 * log_of_inverse(x.eta_to_light) + cos_to_light) |
               multiply(from_light(terms, i - 1), 2 * log_of_inverse(x.eta_to_camera) + cos_to_camera);
    }
    return done;
}
template <bool Connections, bool Merges> planted join_dirac(weight_terms& terms, const path_record& r) {
    planted done = planted::nothing;
    for (int i = 1; i < size_of(r) - 1; ++i)
        if (is_dirac(r, i)) {
            if (Connections)
                terms.can_connect[static_cast<std::size_t>(i)] = 1;
            if (Merges)
                terms.can_merge[static_cast<std::size_t>(i)] = 1;
            done = planted::changed;
        }
    return done;
}

// ---- Lights ----

inline planted hit_dirac_light(weight_terms& terms, const path_record& r) {
    terms.light_can_be_hit = true;
    return r.vertices.back().dirac ? planted::changed : planted::nothing;
}
template <bool NextEvent, bool Emission> planted forget_selection(weight_terms& terms, const path_record& r) {
    const recorded_vertex& light = r.vertices.back();
    planted done = planted::nothing;
    if (NextEvent)
        done = done | multiply(terms.next_event, log_of_inverse(is_given(light.selection_next_event)
                                                                    ? light.selection_next_event
                                                                    : light.selection));
    if (Emission)
        done = done | multiply(from_light(terms, size_of(r) - 1), log_of_inverse(light.selection));
    return done;
}
inline planted next_event_is_emission(weight_terms& terms, const path_record& r) {
    return set(terms.next_event, from_light(terms, size_of(r) - 1));
}
inline planted emission_is_next_event(weight_terms& terms, const path_record& r) {
    return set(from_light(terms, size_of(r) - 1), terms.next_event);
}

// ---- Forward and reverse ----

// The logarithm of an inverse; that of what is missing is missing.
inline double over(double logarithm) { return log_density::is_missing(logarithm) ? logarithm : -logarithm; }

// Densities of directions, also where only those per area are given.
inline double log_to_light(const path_record& r, int i) {
    const double density = vertex(r, i).pdf_to_light;
    return is_given(density)
               ? log_of(density)
               : log_of(vertex(r, i + 1).density_from_camera) + over(log_to_area_from_camera(r, i + 1));
}
inline double log_to_camera(const path_record& r, int i) {
    const double density = vertex(r, i).pdf_to_camera;
    return is_given(density)
               ? log_of(density)
               : log_of(vertex(r, i - 1).density_from_light) + over(log_to_area_from_light(r, i - 1));
}

enum class turned { reverse, inner_reverse, swapped, all_to_light, all_to_camera };
template <turned Which> planted turn_densities(weight_terms& terms, const path_record& r) {
    planted done = planted::nothing;
    for (int i = 1; i < size_of(r) - 1; ++i) {
        const bool camera = is_on_camera_walk(r, i), light = is_on_light_walk(r, i);
        const bool merged = camera && light;
        const bool inner = Which != turned::inner_reverse ||
                           (i != r.technique.camera_vertices && i != r.technique.camera_vertices - 1);
        if (is_dirac(r, i) || merged || !inner)
            continue;
        const double ratio = log_to_light(r, i) + over(log_to_camera(r, i));
        const bool by_walk = Which == turned::reverse || Which == turned::inner_reverse;
        const bool swapped = Which == turned::swapped;
        if ((by_walk && camera) || swapped || Which == turned::all_to_light)
            done = done | multiply(from_light(terms, i - 1), ratio);
        if ((by_walk && light) || swapped || Which == turned::all_to_camera)
            done = done | multiply(from_camera(terms, i + 1), -ratio);
    }
    return done;
}
// The same for records of area densities.
inline planted take_area_density_of_other_walk(weight_terms& terms, const path_record& r) {
    planted done = planted::nothing;
    for (int i = 1; i < size_of(r) - 1; ++i)
        if (is_given(vertex(r, i).density_from_camera) && is_given(vertex(r, i).density_from_light))
            done = done | (is_on_camera_walk(r, i) ? set(from_light(terms, i), from_camera(terms, i))
                                                   : set(from_camera(terms, i), from_light(terms, i)));
    return done;
}

// ---- Media ----

constexpr const char* how_to_count_distances =
    "Multiply the density of the distance into the density of each vertex in a medium, and the probability "
    "of passing into that of a vertex behind one: once, and of both walks. A beam's size undoes it.";
constexpr const char* how_to_count_beams =
    "A beam has 1 over the density of the distance samples, where it is short times the probability of "
    "passing: multiply that into the sizes of merges with it, and nothing else. mis::beam gives it.";
constexpr const char* how_to_use_the_sine =
    "Multiply the size of beam-beam merges by the sine of the angle between the beams: their estimate is "
    "divided by it.";
constexpr const char* how_to_number_beams =
    "Each family has its own number of light walks: of those that leave beams, where it merges with beams.";
constexpr const char* how_to_take_radii =
    "Each family has its own radius and kernel: 4/3 pi r^3 of points, pi r^2 of points and beams, 2 r of "
    "beams.";
constexpr const char* how_to_pass_boundaries =
    "A boundary where directions do not change is no vertex: the edge goes on, with the product of the "
    "probabilities of passing its pieces.";

// Where densities of distances are wrong. At a merge in a medium: those of the vertex that merges.
enum class distance_place { everywhere, in_media, outside, at_merge };
inline bool is_there(distance_place place, const path_record& r, int i) {
    const bool in_medium = vertex(r, i).kind == vertex_kind::medium;
    return place == distance_place::everywhere ? true
           : place == distance_place::at_merge ? is_merge_in_medium(r) && i == r.technique.camera_vertices - 1
                                               : in_medium == (place == distance_place::in_media);
}
// Of which walks: the reverse ones are those that have not made the vertex.
enum class distance_walk { both, camera, light, reverse };
template <distance_walk Which> bool is_of_camera(const path_record& r, int i) {
    return Which == distance_walk::reverse ? !is_on_camera_walk(r, i) : Which != distance_walk::light;
}
template <distance_walk Which> bool is_of_light(const path_record& r, int i) {
    return Which == distance_walk::reverse ? !is_on_light_walk(r, i) : Which != distance_walk::camera;
}

// Densities of distances, over which P-> and P<- are divided, or with which they are multiplied once more.
// Splits on arrival, which stand in the same fields, are no distances.
enum class used { never, twice };
template <used Often> double log_of_distance(double pdf_distance, double splits) {
    return Often == used::twice ? log_of(pdf_distance) + log_of_inverse(splits)
                                : log_of_inverse(pdf_distance) + log_of(splits);
}
template <used Often, distance_place Place, distance_walk Which>
planted count_distances(weight_terms& terms, const path_record& r) {
    planted done = planted::nothing;
    for (int i = 0; i < size_of(r); ++i) {
        if (!is_there(Place, r, i))
            continue;
        const recorded_vertex& x = vertex(r, i);
        const double to_camera = is_given(x.splits_to_camera) ? x.splits_to_camera : x.splits;
        if (i > 0 && is_of_camera<Which>(r, i))
            done = done | multiply(from_camera(terms, i),
                                   log_of_distance<Often>(x.pdf_distance_from_camera,
                                                          r.splits_on_arrival ? x.splits : 1));
        if (i + 1 < size_of(r) && is_of_light<Which>(r, i))
            done = done | multiply(from_light(terms, i),
                                   log_of_distance<Often>(x.pdf_distance_from_light,
                                                          r.splits_on_arrival ? to_camera : 1));
    }
    return done;
}

// Calls change(X, Pr(t > d)) for the beams of all vertices in media, X-> or X<-, where a family needs them.
template <distance_walk Which, class Change>
planted change_beams(weight_terms& terms, const path_record& r, Change&& change) {
    planted done = planted::nothing;
    const auto is_on = [&](auto&& has_beam) {
        bool any = false;
        for (std::size_t f = 0; f < terms.families.size(); ++f)
            any |= has_beam(static_cast<merge_family>(f)) && !log_density::is_zero(terms.families[f]);
        return any;
    };
    const bool camera = Which != distance_walk::light && !terms.media.empty() && is_on(has_camera_beam),
               light = Which != distance_walk::camera && !terms.media.empty() && is_on(has_light_beam);
    for (std::size_t i = 0; i < terms.media.size(); ++i) {
        weight_terms::medium_place& x = terms.media[i];
        if (!x.in_medium)
            continue;
        if (camera)
            done = done | change(x.from_camera, r.vertices[i].pass_from_camera);
        if (light)
            done = done | change(x.from_light, r.vertices[i].pass_from_light);
    }
    return done;
}
template <distance_walk Which> planted forget_beams(weight_terms& terms, const path_record& r) {
    return change_beams<Which>(terms, r, [](double& x, double) { return set(x, 0); });
}
inline planted pass_in_beams(weight_terms& terms, const path_record& r) {
    return change_beams<distance_walk::both>(terms, r, [](double& x, double pass) {
        return is_given(pass) ? set(x, log_of_inverse(pass)) : planted::unknown;
    });
}
template <distance_walk Which> planted lengthen_beams(weight_terms& terms, const path_record& r) {
    return change_beams<Which>(terms, r,
                               [](double& x, double pass) { return multiply(x, log_of_inverse(pass)); });
}
template <distance_walk Which> planted shorten_beams(weight_terms& terms, const path_record& r) {
    return change_beams<Which>(terms, r, [](double& x, double pass) { return multiply(x, log_of(pass)); });
}
// Where a merge is on a beam: P of that walk has the beam's samples, the probability of passing or 1, in the
// place of the density of the distance, and the size has none.
template <distance_walk Which> planted move_beam_into_density(weight_terms& terms, const path_record& r) {
    if (!is_merge_in_medium(r))
        return planted::nothing;
    const int j = r.technique.camera_vertices - 1;
    weight_terms::medium_place& x = terms.media[static_cast<std::size_t>(j)];
    planted done = planted::nothing;
    const auto move = [&](double& density, double& of_beam) {
        done = done | multiply(density, of_beam);
        of_beam = 0;
    };
    if (Which != distance_walk::light && has_camera_beam(r.family))
        move(from_camera(terms, j), x.from_camera);
    if (Which != distance_walk::camera && has_light_beam(r.family))
        move(from_light(terms, j), x.from_light);
    return done;
}

template <bool Divided> planted mistake_sine(weight_terms& terms, const path_record& r) {
    planted done = planted::nothing;
    if (!is_on(family_of(r, merge_family::beam_beam)))
        return done;
    for (std::size_t i = 0; i < terms.media.size(); ++i)
        if (terms.media[i].in_medium)
            done =
                done | set(terms.media[i].sin_angle, Divided ? log_of_inverse(r.vertices[i].sin_angle) : 0.0);
    return done;
}

// The number of light walks that leave points: that of all of them.
inline double number_of_points(const path_record& r) {
    double most = (std::max)(r.counts.merge, r.counts.camera_connection);
    for (const auto f : {merge_family::point_point, merge_family::point_beam})
        most = (std::max)(most, family_of(r, f).count);
    return most;
}
template <bool (*Of)(merge_family)> planted count_beams_as_points(weight_terms& terms, const path_record& r) {
    const double points = number_of_points(r);
    return change_families(terms, r, [&](merge_family f, const recorded_family& family) {
        return Of(f) ? log_of(points) + log_of_inverse(family.count) : 0.0;
    });
}
inline bool has_two_beams(merge_family f) { return f == merge_family::beam_beam; }
inline planted count_points_as_beams(weight_terms& terms, const path_record& r) {
    const double beams =
        (std::max)(family_of(r, merge_family::beam_point).count, family_of(r, merge_family::beam_beam).count);
    return change_families(terms, r, [&](merge_family f, const recorded_family& family) {
        return beams > 0 && !has_light_beam(f) ? log_of(beams) + log_of_inverse(family.count) : 0.0;
    });
}

// One family's radius in the kernel of another, or of all; with its kernel, too.
enum class taken { radius, kernel };
template <taken What>
planted take_radius(weight_terms& terms, const path_record& r, std::size_t f, merge_family from) {
    const double own = r.families[f].radius, other = family_of(r, from).radius;
    if (terms.media.empty() || log_density::is_zero(terms.families[f]) || !(other > 0))
        return planted::nothing;
    const auto of = static_cast<merge_family>(f);
    return multiply(terms.families[f],
                    log_kernel(What == taken::kernel ? from : of, other) - log_kernel(of, own));
}
template <merge_family Of, merge_family From>
planted take_radius_of(weight_terms& terms, const path_record& r) {
    return take_radius<taken::radius>(terms, r, static_cast<std::size_t>(Of), From);
}
template <taken What, merge_family From> planted take_one_for_all(weight_terms& terms, const path_record& r) {
    planted done = planted::nothing;
    for (std::size_t f = 0; f < terms.families.size(); ++f)
        done = done | take_radius<What>(terms, r, f, From);
    return done;
}
inline planted take_radius_of_surfaces(weight_terms& terms, const path_record& r) {
    if (!is_given(r.radius) || !(r.radius > 0))
        return planted::nothing;
    return change_families(terms, r, [&](merge_family f, const recorded_family& family) {
        return log_kernel(f, r.radius) - log_kernel(f, family.radius);
    });
}

// The boundaries on the edges that walks have gone become vertices of the terms; those on the edge that joins
// the walks nobody has seen. To be planted after what goes by the record's vertices.
//
// Of an edge of length d, P of its far end was omega |cos| D / d^2, D of the distance. With boundaries each
// piece has its own such factor, and omega leads to the first of them, which leads straight on with
// probability 1.
inline planted insert_boundaries(weight_terms& terms, const path_record& r, std::size_t first,
                                 std::size_t end, bool connects, bool merges) {
    struct site {
        double distance, cosine, from_camera, from_light; // the last three as logarithms
    };
    const int i = r.boundaries[first].edge, count = static_cast<int>(end - first);
    const recorded_vertex &x = vertex(r, i), &y = vertex(r, i + 1);
    std::vector<site> sites{{0, log_of(x.cos_to_light), 0, log_of(x.pdf_distance_from_light)}};
    for (std::size_t k = first; k < end; ++k) {
        const recorded_boundary& b = r.boundaries[k];
        sites.push_back(
            {b.distance, log_of(b.cosine), log_of(b.pass_from_camera), log_of(b.pass_from_light)});
    }
    sites.push_back({is_given(x.distance2_to_light) ? std::sqrt(x.distance2_to_light) : not_given,
                     log_of(y.cos_to_camera), log_of(y.pdf_distance_from_camera), 0});
    const site &nearest = sites.front(), &farthest = sites.back();
    if (!is_given(farthest.distance) || log_density::is_missing(nearest.cosine) ||
        log_density::is_missing(farthest.cosine))
        return planted::unknown;
    const auto inverse = [](double q) { return log_density::is_zero(q) ? log_density::infinite : -q; };
    const auto to_area = [&](const site& a, const site& b) { // 1 / d^2 of a piece; of one to infinity, 1
        const bool is_infinite = &b == &farthest && y.kind == vertex_kind::infinite_light;
        return is_infinite ? 0.0 : 2 * log_of_inverse(b.distance - a.distance);
    };

    const auto at = static_cast<std::ptrdiff_t>(i) + 1;
    const auto several = static_cast<std::size_t>(count);
    for (auto* numbers : {&terms.from_camera, &terms.from_light, &terms.merge_factors})
        numbers->insert(numbers->begin() + at, several, 0.0);
    terms.can_connect.insert(terms.can_connect.begin() + at, several, connects);
    terms.can_merge.insert(terms.can_merge.begin() + at, several, merges);
    if (!terms.media.empty())
        terms.media.insert(terms.media.begin() + at, several, weight_terms::medium_place{});

    // What the densities of the whole edge have beside the conversion of its distance and cosine.
    const double whole = 2 * log_of(farthest.distance);
    const double to_light = from_camera(terms, i + count + 1) + inverse(farthest.cosine) +
                            inverse(farthest.from_camera) + whole,
                 to_camera =
                     from_light(terms, i) + inverse(nearest.cosine) + inverse(nearest.from_light) + whole;
    for (int k = 0; k <= count; ++k) {
        const site &a = sites[static_cast<std::size_t>(k)], &b = sites[static_cast<std::size_t>(k) + 1];
        from_camera(terms, i + k + 1) =
            (k == 0 ? to_light : 0.0) + b.cosine + b.from_camera + inverse(a.from_camera) + to_area(a, b);
        from_light(terms, i + k) =
            (k == count ? to_camera : 0.0) + a.cosine + a.from_light + inverse(b.from_light) + to_area(a, b);
    }
    return planted::changed;
}
template <bool Connects, bool Merges> planted join_boundaries(weight_terms& terms, const path_record& r) {
    const bool merges = r.technique.kind == technique_kind::merge;
    const int s = r.technique.camera_vertices, joined = merges ? -1 : s - 1;
    planted done = planted::nothing;
    for (std::size_t end = r.boundaries.size(); end > 0;) { // from the last edge on: places before it stay
        std::size_t first = end;
        const int edge = r.boundaries[end - 1].edge;
        while (first > 0 && r.boundaries[first - 1].edge == edge)
            --first;
        if (edge != joined) {
            done = done | insert_boundaries(terms, r, first, end, Connects, Merges);
            if (done == planted::unknown)
                break;
            terms.made_by.camera_vertices += edge < s - 1 ? static_cast<int>(end - first) : 0;
        }
        end = first;
    }
    return done;
}

// ---- Counts ----

template <technique_kind Kind> planted forget_count(weight_terms& terms, const path_record&) {
    double& count = terms.count(Kind);
    return log_density::is_zero(count) ? planted::nothing : set(count, 0);
}
inline planted forget_light_paths(weight_terms& terms, const path_record& r) {
    return forget_count<technique_kind::camera_connection>(terms, r) |
           forget_count<technique_kind::direct>(terms, r);
}
template <int Power> planted raise_light_paths(weight_terms& terms, const path_record&) {
    planted done = planted::nothing;
    for (const auto kind : {technique_kind::camera_connection, technique_kind::direct})
        if (double& count = terms.count(kind); !log_density::is_zero(count))
            done = done | set(count, Power * count);
    return done;
}
inline planted forget_all_counts(weight_terms& terms, const path_record& r) {
    return forget_count<technique_kind::light_hit>(terms, r) |
           forget_count<technique_kind::next_event>(terms, r) |
           forget_count<technique_kind::connection>(terms, r);
}
// Of which merges: on surfaces, or those of families in media. Records without families have no
// `on_surfaces`, which would be the same as `all`.
enum class merging { all, on_surfaces, in_media };
template <merging Which> planted forget_photons(weight_terms& terms, const path_record& r) {
    if (Which == merging::on_surfaces && terms.media.empty())
        return planted::nothing;
    planted done = planted::nothing;
    if (Which != merging::in_media)
        done = done | forget_count<technique_kind::merge>(terms, r);
    if (Which != merging::on_surfaces)
        done = done | change_families(terms, r, [](merge_family, const recorded_family& family) {
                   return log_of_inverse(family.count);
               });
    return done;
}
template <merging Which> planted forget_merge_area(weight_terms& terms, const path_record& r) {
    if (Which == merging::on_surfaces && terms.media.empty())
        return planted::nothing;
    planted done = planted::nothing;
    if (Which != merging::in_media && !log_density::is_zero(terms.count(technique_kind::merge)))
        done = set(terms.merge_area, 0);
    if (Which != merging::on_surfaces)
        done = done | change_families(terms, r, [](merge_family f, const recorded_family& family) {
                   return -log_kernel(f, family.radius);
               });
    return done;
}

// What a technique that is off would count, as far as the others tell.
inline double likely_count(const weight_terms& terms, technique_kind kind) {
    if (kind == technique_kind::light_hit || kind == technique_kind::next_event ||
        kind == technique_kind::connection)
        return 0;
    double light_walks = 0;
    for (const auto other :
         {technique_kind::camera_connection, technique_kind::direct, technique_kind::merge})
        light_walks = (std::max)(light_walks, terms.count(other));
    return light_walks;
}
template <technique_kind Kind> planted keep_disabled(weight_terms& terms, const path_record& r) {
    if (!log_density::is_zero(terms.count(Kind)))
        return planted::nothing;
    if (Kind == technique_kind::merge && !is_given(r.radius))
        return planted::nothing;
    return set(terms.count(Kind), likely_count(terms, Kind));
}
// A technique that others do not know of still weighs itself against them.
template <technique_kind Kind> planted leave_out(weight_terms& terms, const path_record& r) {
    if (r.technique.kind == Kind || log_density::is_zero(terms.count(Kind)))
        return planted::nothing;
    return set(terms.count(Kind), log_density::zero);
}
// The same of merges, with those in media, or of these alone, and of one family.
template <merging Which> planted leave_out_merges(weight_terms& terms, const path_record& r) {
    if (Which == merging::in_media ? is_merge_in_medium(r) || terms.media.empty()
                                   : r.technique.kind == technique_kind::merge)
        return planted::nothing;
    if (!terms.media.empty())
        terms.families.fill(log_density::zero);
    const planted done = terms.media.empty() ? planted::nothing : planted::changed;
    return Which == merging::in_media ? done : done | leave_out<technique_kind::merge>(terms, r);
}
template <merge_family Family> planted leave_out_family(weight_terms& terms, const path_record& r) {
    double& size = terms.families[static_cast<std::size_t>(Family)];
    if (terms.media.empty() || log_density::is_zero(size) || (is_merge_in_medium(r) && r.family == Family))
        return planted::nothing;
    return set(size, log_density::zero);
}
inline planted ignore_caps(weight_terms& terms, const path_record& r) {
    terms.caps = {};
    const bool capped = r.counts.max_camera_vertices != INT_MAX || r.counts.max_light_vertices != INT_MAX;
    return capped ? planted::changed : planted::nothing;
}

// ---- Heuristics ----

template <heuristic_kind Kind, int TwiceBeta = 0>
planted use_heuristic(weight_terms& terms, const path_record&) {
    const double parameter = TwiceBeta > 0 ? TwiceBeta / 2.0 : terms.parameter;
    const bool one = terms.heuristic == heuristic_kind::balance ||
                     (terms.heuristic == heuristic_kind::power && terms.parameter == 1);
    const bool same = (terms.heuristic == Kind && (TwiceBeta == 0 || terms.parameter == parameter)) ||
                      (one && (Kind == heuristic_kind::balance || TwiceBeta == 2));
    terms.heuristic = Kind;
    terms.parameter = parameter;
    return same ? planted::nothing : planted::changed;
}
template <weight_arithmetic Arithmetic> planted overflow(weight_terms& terms, const path_record& r) {
    const technique_kind kind = r.technique.kind;
    const bool path_tracing = log_density::is_zero(terms.count(technique_kind::connection)) &&
                              log_density::is_zero(terms.count(technique_kind::camera_connection)) &&
                              log_density::is_zero(terms.count(technique_kind::merge));
    const bool fits =
        Arithmetic == weight_arithmetic::float_products ||
        (path_tracing && (kind == technique_kind::light_hit || kind == technique_kind::next_event));
    if (terms.heuristic != heuristic_kind::power || !fits)
        return planted::nothing;
    terms.arithmetic = Arithmetic;
    return planted::changed;
}
template <tie_rule Ties> planted break_ties(weight_terms& terms, const path_record&) {
    terms.ties = Ties;
    return terms.heuristic == heuristic_kind::maximum ? planted::changed : planted::nothing;
}

// ---- Weights without densities ----

inline planted weigh_by_one(weight_terms& terms, const path_record&) { return set(terms.constant, 1); }
inline planted share_among_all(weight_terms& terms, const path_record& r) {
    return set(terms.constant, 1.0 / technique_count(size_of(r)));
}
// Those that are switched on, whether or not the vertices allow them.
inline planted share_among_counted(weight_terms& terms, const path_record& r) {
    const int n = size_of(r);
    int on = 0, families = 0;
    for (const double size : terms.families)
        families += !log_density::is_zero(size);
    for (int place = 0; place < technique_count(n); ++place) {
        const technique t = technique_at(n, place);
        const bool in_families = t.kind == technique_kind::merge && !terms.media.empty() &&
                                 vertex(r, t.camera_vertices - 1).kind == vertex_kind::medium;
        const int each = in_families ? families : !log_density::is_zero(terms.count(t.kind));
        on += is_within_caps(terms.caps, n, t) ? each : 0;
    }
    return on > 0 ? set(terms.constant, 1.0 / on) : planted::nothing;
}

} // namespace detail

// All of them. Planted together, they are planted in this order: factors of densities first, then what
// replaces densities, then what exists, counts, and the heuristic. What goes by the record's vertices comes
// before boundary_vertex, which adds some.
//
// Most were found in published renderers; [J] 4 gives the rule behind most of them: what multiplies the
// sampled throughput must divide the density.
inline constexpr mistake mistakes[] = {
    {"roulette_omitted", "Survival probabilities are left out of the densities.",
     "Multiply the survival probability of a vertex into every density of a direction that leaves it, "
     "forward and reverse, wherever the walk's throughput is divided by it.",
     "survival", detail::forget_survival<detail::forgotten::both, true>},
    {"roulette_omitted", "Survival probabilities are left out of the densities, except at Dirac vertices.",
     "Multiply the survival probability of a vertex into every density of a direction that leaves it, "
     "forward and reverse, wherever the walk's throughput is divided by it.",
     "survival", detail::forget_survival<detail::forgotten::both, false>},
    {"roulette_one_sided", "Survival probabilities are left out of the reverse densities.",
     "The density of the other walk through a vertex includes the survival there as well: multiply it in.",
     "survival", detail::forget_survival<detail::forgotten::reverse, true>},
    {"roulette_one_sided",
     "Survival probabilities are left out of the reverse densities, except at Dirac vertices.",
     "The density of the other walk through a vertex includes the survival there as well: multiply it in.",
     "survival", detail::forget_survival<detail::forgotten::reverse, false>},
    {"roulette_one_sided", "Survival probabilities are left out of the forward densities.",
     "The density that a walk has sampled with includes the probability that it went on: multiply it in.",
     "survival", detail::forget_survival<detail::forgotten::forward, true>},
    {"roulette_one_sided", "Survival probabilities are left out of the camera walk's densities.",
     "Multiply survival into the densities towards the light, as into those towards the camera.", "survival",
     detail::forget_survival<detail::forgotten::to_light, true>},
    {"roulette_one_sided", "Survival probabilities are left out of the light walk's densities.",
     "Multiply survival into the densities towards the camera, as into those towards the light.", "survival",
     detail::forget_survival<detail::forgotten::to_camera, true>},
    {"roulette_one_sided", "Survival probabilities are left out of the weights of light hits only.",
     "All techniques must use the same densities: include survival in the weight of this one too.",
     "survival", detail::forget_survival_in<technique_kind::light_hit>},
    {"roulette_one_sided", "Survival probabilities are left out of the weights of next events only.",
     "All techniques must use the same densities: include survival in the weight of this one too.",
     "survival", detail::forget_survival_in<technique_kind::next_event>},
    {"roulette_one_sided", "Survival probabilities are left out of the weights of connections only.",
     "All techniques must use the same densities: include survival in the weight of this one too.",
     "survival", detail::forget_survival_in<technique_kind::connection>},
    {"roulette_one_sided", "Survival probabilities are left out of the weights of camera connections only.",
     "All techniques must use the same densities: include survival in the weight of this one too.",
     "survival", detail::forget_survival_in<technique_kind::camera_connection>},
    {"roulette_one_sided", "Survival probabilities are left out of the weights of merges only.",
     "All techniques must use the same densities: include survival in the weight of this one too.",
     "survival", detail::forget_survival_in<technique_kind::merge>},
    {"splitting_omitted", "Numbers of copies are left out of the densities.", detail::how_to_count_splits, "",
     detail::forget_splits<detail::forgotten::both>},
    {"splitting_omitted", "Numbers of copies are left out of the reverse densities.",
     detail::how_to_count_splits, "", detail::forget_splits<detail::forgotten::reverse>},
    {"splitting_omitted", "Numbers of copies are left out of the forward densities.",
     detail::how_to_count_splits, "", detail::forget_splits<detail::forgotten::forward>},
    {"splitting_omitted", "Numbers of copies are left out of the camera walk's densities.",
     detail::how_to_count_splits, "", detail::forget_splits<detail::forgotten::to_light>},
    {"splitting_omitted", "Numbers of copies are left out of the light walk's densities.",
     detail::how_to_count_splits, "", detail::forget_splits<detail::forgotten::to_camera>},
    {"splitting_omitted", "Numbers of copies are left out of the weights of light hits only.",
     detail::how_to_count_splits, "", detail::forget_splits_in<technique_kind::light_hit>},
    {"splitting_omitted", "Numbers of copies are left out of the weights of next events only.",
     detail::how_to_count_splits, "", detail::forget_splits_in<technique_kind::next_event>},
    {"splitting_omitted", "Numbers of copies are left out of the weights of connections only.",
     detail::how_to_count_splits, "", detail::forget_splits_in<technique_kind::connection>},
    {"splitting_omitted", "Numbers of copies are left out of the weights of camera connections only.",
     detail::how_to_count_splits, "", detail::forget_splits_in<technique_kind::camera_connection>},
    {"splitting_omitted", "Numbers of copies are left out of the weights of merges only.",
     detail::how_to_count_splits, "", detail::forget_splits_in<technique_kind::merge>},
    {"splitting_omitted",
     "Copies that are made on arrival are left out of what is joined and merged at a vertex.",
     detail::how_to_count_splits, "", detail::forget_splits_at_joins},
    {"merge_roulette",
     "At a merge, the density towards the camera has the survival of the camera walk's vertex instead of the "
     "photon's.",
     "At a merge, the light walk would go on from the photon's vertex and the camera walk from the camera's: "
     "each density takes the survival of its own.",
     "photon.survival", detail::exchange_survival<detail::exchanged::to_camera>},
    {"merge_roulette",
     "At a merge, the density towards the light has the survival of the photon's vertex instead of the "
     "camera walk's.",
     "At a merge, the light walk would go on from the photon's vertex and the camera walk from the camera's: "
     "each density takes the survival of its own.",
     "photon.survival", detail::exchange_survival<detail::exchanged::to_light>},
    {"merge_roulette", "At a merge, the survivals of the two walks' vertices are exchanged.",
     "At a merge, the light walk would go on from the photon's vertex and the camera walk from the camera's: "
     "each density takes the survival of its own.",
     "photon.survival", detail::exchange_survival<detail::exchanged::both>},
    {"shading_normal", "Densities are converted to area with the shading normal's cosine.",
     "Convert densities to area with the cosine of the geometric normal; or, with shading cosines, divide "
     "the light walk's densities by Veach's factor.",
     "", detail::use_shading_cosines<detail::direction::both>},
    {"shading_normal", "The camera walk's densities are converted to area with the shading normal's cosine.",
     "Convert densities to area with the cosine of the geometric normal; or, with shading cosines, divide "
     "the light walk's densities by Veach's factor.",
     "", detail::use_shading_cosines<detail::direction::from_camera>},
    {"shading_normal", "The light walk's densities are converted to area with the shading normal's cosine.",
     "Convert densities to area with the cosine of the geometric normal; or, with shading cosines, divide "
     "the light walk's densities by Veach's factor.",
     "", detail::use_shading_cosines<detail::direction::from_light>},
    {"solid_angle_as_area",
     "Walks do not convert densities to area on arrival: distance and cosine are missing.",
     "Multiply a density per solid angle by |cos| / distance^2 at the vertex that the direction arrives at.",
     "cos_to_camera, cos_to_light and distance, or positions and normals",
     detail::leave_solid_angle_in_walks},
    {"solid_angle_as_area", "Densities per solid angle stand for densities per area in both directions.",
     "Multiply a density per solid angle by |cos| / distance^2 at the vertex that the direction arrives at.",
     "cos_to_camera, cos_to_light and distance, or positions and normals",
     detail::leave_solid_angle<detail::direction::both>},
    {"solid_angle_as_area", "The camera walk's densities per solid angle stand for densities per area.",
     "Multiply a density per solid angle by |cos| / distance^2 at the vertex that the direction arrives at.",
     "cos_to_camera, cos_to_light and distance, or positions and normals",
     detail::leave_solid_angle<detail::direction::from_camera>},
    {"solid_angle_as_area", "The light walk's densities per solid angle stand for densities per area.",
     "Multiply a density per solid angle by |cos| / distance^2 at the vertex that the direction arrives at.",
     "cos_to_camera, cos_to_light and distance, or positions and normals",
     detail::leave_solid_angle<detail::direction::from_light>},
    {"solid_angle_as_area", "The density of hitting the light stays per solid angle.",
     "Convert it to area, or the light sampler's density to solid angle, before the two are compared.",
     "cos_to_camera, cos_to_light and distance, or positions and normals",
     detail::leave_solid_angle_at_light},
    {"solid_angle_as_area", "The next-event density is per solid angle where the others are per area.",
     "Convert it to area: multiply by |cos| / distance^2 at the light.",
     "cos_to_camera, cos_to_light and distance, or positions and normals", detail::next_event_in_solid_angle},
    {"environment_measure", "The cosine is missing where a light walk arrives from an infinite light.",
     "At an infinite light, densities of positions are per solid angle: no cosine, no distance. The light "
     "walk's first vertex has |cos|, and no distance.",
     "cos_to_light, or a normal", detail::forget_cosine_at_infinity},
    {"environment_measure", "A distance is applied to densities at an infinite light.",
     "At an infinite light, densities of positions are per solid angle: no cosine, no distance. The light "
     "walk's first vertex has |cos|, and no distance.",
     "position of the infinite light", detail::use_distance_at_infinity<detail::direction::both>},
    {"environment_measure", "A distance is applied where a camera walk leaves for an infinite light.",
     "At an infinite light, densities of positions are per solid angle: no cosine, no distance. The light "
     "walk's first vertex has |cos|, and no distance.",
     "position of the infinite light", detail::use_distance_at_infinity<detail::direction::from_camera>},
    {"environment_measure", "A distance is applied where a light walk arrives from an infinite light.",
     "At an infinite light, densities of positions are per solid angle: no cosine, no distance. The light "
     "walk's first vertex has |cos|, and no distance.",
     "position of the infinite light", detail::use_distance_at_infinity<detail::direction::from_light>},
    {"dirac_etendue",
     "At Dirac refractions eta^2 and the cosines are left out. The image is right, but its variance is "
     "higher.",
     "At a refraction the discrete probabilities are those of basic etendue: multiply each by eta^2 |cos| of "
     "the side it leaves to.",
     "eta_to_camera and eta_to_light", detail::forget_etendue<true>},
    {"dirac_etendue",
     "At Dirac refractions eta^2 is left out. The image is right, but its variance is higher.",
     "At a refraction the discrete probabilities are those of basic etendue: multiply each by eta^2 |cos| of "
     "the side it leaves to.",
     "eta_to_camera and eta_to_light", detail::forget_etendue<false>},
    {"distance_omitted", "Densities of distances in media, and probabilities of passing them, are left out.",
     detail::how_to_count_distances, "",
     detail::count_distances<detail::used::never, detail::distance_place::everywhere,
                             detail::distance_walk::both>},
    {"distance_omitted", "Densities of distances are left out at vertices in media.",
     detail::how_to_count_distances, "",
     detail::count_distances<detail::used::never, detail::distance_place::in_media,
                             detail::distance_walk::both>},
    {"distance_omitted", "Probabilities of passing media are left out.", detail::how_to_count_distances, "",
     detail::count_distances<detail::used::never, detail::distance_place::outside,
                             detail::distance_walk::both>},
    {"distance_omitted",
     "Densities of distances, and probabilities of passing, are left out of the camera walk's densities.",
     detail::how_to_count_distances, "",
     detail::count_distances<detail::used::never, detail::distance_place::everywhere,
                             detail::distance_walk::camera>},
    {"distance_omitted",
     "Densities of distances, and probabilities of passing, are left out of the light walk's densities.",
     detail::how_to_count_distances, "",
     detail::count_distances<detail::used::never, detail::distance_place::everywhere,
                             detail::distance_walk::light>},
    {"distance_omitted",
     "Densities of distances, and probabilities of passing, are left out of the reverse densities.",
     detail::how_to_count_distances, "",
     detail::count_distances<detail::used::never, detail::distance_place::everywhere,
                             detail::distance_walk::reverse>},
    {"distance_omitted", "Densities of distances are left out of the reverse densities at vertices in media.",
     detail::how_to_count_distances, "",
     detail::count_distances<detail::used::never, detail::distance_place::in_media,
                             detail::distance_walk::reverse>},
    {"distance_omitted", "At a merge in a medium, both densities of distances are left out.",
     detail::how_to_count_distances, "",
     detail::count_distances<detail::used::never, detail::distance_place::at_merge,
                             detail::distance_walk::both>},
    {"distance_omitted", "At a merge in a medium, the density of the camera walk's distance is left out.",
     detail::how_to_count_distances, "",
     detail::count_distances<detail::used::never, detail::distance_place::at_merge,
                             detail::distance_walk::camera>},
    {"distance_omitted", "At a merge in a medium, the density of the light walk's distance is left out.",
     detail::how_to_count_distances, "",
     detail::count_distances<detail::used::never, detail::distance_place::at_merge,
                             detail::distance_walk::light>},
    {"distance_twice", "Densities of distances are applied twice at vertices in media.",
     detail::how_to_count_distances, "",
     detail::count_distances<detail::used::twice, detail::distance_place::in_media,
                             detail::distance_walk::both>},
    {"distance_twice",
     "Densities of distances are applied twice in the reverse densities at vertices in media.",
     detail::how_to_count_distances, "",
     detail::count_distances<detail::used::twice, detail::distance_place::in_media,
                             detail::distance_walk::reverse>},
    {"distance_twice", "At a merge in a medium, both densities of distances are applied twice.",
     detail::how_to_count_distances, "",
     detail::count_distances<detail::used::twice, detail::distance_place::at_merge,
                             detail::distance_walk::both>},
    {"distance_twice", "At a merge in a medium, the density of the camera walk's distance is applied twice.",
     detail::how_to_count_distances, "",
     detail::count_distances<detail::used::twice, detail::distance_place::at_merge,
                             detail::distance_walk::camera>},
    {"distance_twice", "At a merge in a medium, the density of the light walk's distance is applied twice.",
     detail::how_to_count_distances, "",
     detail::count_distances<detail::used::twice, detail::distance_place::at_merge,
                             detail::distance_walk::light>},
    {"reverse_is_forward", "Forward densities stand for reverse ones.",
     "The reverse density at a vertex is that of going back the way the walk came, given that it came from "
     "where it goes: evaluate the sampler with the two directions exchanged.",
     "pdf_to_camera and pdf_to_light", detail::turn_densities<detail::turned::reverse>},
    {"reverse_is_forward",
     "Forward densities stand for reverse ones where a walk goes on, but not at its last vertex.",
     "The reverse density at a vertex is that of going back the way the walk came, given that it came from "
     "where it goes: evaluate the sampler with the two directions exchanged.",
     "pdf_to_camera and pdf_to_light", detail::turn_densities<detail::turned::inner_reverse>},
    {"reverse_is_forward", "Forward and reverse densities are exchanged.",
     "The reverse density at a vertex is that of going back the way the walk came, given that it came from "
     "where it goes: evaluate the sampler with the two directions exchanged.",
     "pdf_to_camera and pdf_to_light", detail::turn_densities<detail::turned::swapped>},
    {"reverse_is_forward", "Densities towards the light stand for those towards the camera.",
     "The reverse density at a vertex is that of going back the way the walk came, given that it came from "
     "where it goes: evaluate the sampler with the two directions exchanged.",
     "pdf_to_camera and pdf_to_light", detail::turn_densities<detail::turned::all_to_light>},
    {"reverse_is_forward", "Densities towards the camera stand for those towards the light.",
     "The reverse density at a vertex is that of going back the way the walk came, given that it came from "
     "where it goes: evaluate the sampler with the two directions exchanged.",
     "pdf_to_camera and pdf_to_light", detail::turn_densities<detail::turned::all_to_camera>},
    {"reverse_is_forward", "A walk's density at a vertex stands for that of the other walk.",
     "The reverse density at a vertex is that of going back the way the walk came, given that it came from "
     "where it goes: evaluate the sampler with the two directions exchanged.",
     "", detail::take_area_density_of_other_walk},
    {"selection_omitted", "The probability of picking the light is left out of the next-event density.",
     "The probability of picking the light belongs to the density of every point on it, for next events and "
     "for the light walk's start.",
     "selection", detail::forget_selection<true, false>},
    {"selection_omitted",
     "The probability of picking the light is left out of the next-event and the emission density.",
     "The probability of picking the light belongs to the density of every point on it, for next events and "
     "for the light walk's start.",
     "selection", detail::forget_selection<true, true>},
    {"selection_omitted", "The probability of picking the light is left out of the emission density.",
     "The probability of picking the light belongs to the density of every point on it, for next events and "
     "for the light walk's start.",
     "selection", detail::forget_selection<false, true>},
    {"next_event_is_emission", "The emission density stands where the next-event density belongs.",
     "Next events and light walks may sample lights differently: keep two densities for a point on a light, "
     "pdf_next_event and pdf_position.",
     "", detail::next_event_is_emission},
    {"next_event_is_emission", "The next-event density stands where the emission density belongs.",
     "Next events and light walks may sample lights differently: keep two densities for a point on a light, "
     "pdf_next_event and pdf_position.",
     "", detail::emission_is_next_event},
    {"dirac_geometry",
     "Densities of what a Dirac choice leads to are replaced by 1, which drops cosines and distances.",
     "Keep the geometry: densities on both sides of a Dirac vertex are converted to area as everywhere. Only "
     "joining or merging at it is impossible.",
     "", detail::drop_dirac_geometry<false>},
    {"dirac_geometry",
     "All densities around a Dirac vertex are replaced by 1, which drops cosines and distances.",
     "Keep the geometry: densities on both sides of a Dirac vertex are converted to area as everywhere. Only "
     "joining or merging at it is impossible.",
     "", detail::drop_dirac_geometry<true>},
    {"dirac_geometry",
     "The probability of a Dirac choice is not converted to area: cosine and distance of the edge behind are "
     "missing.",
     "Keep the geometry: densities on both sides of a Dirac vertex are converted to area as everywhere. Only "
     "joining or merging at it is impossible.",
     "cos_to_camera, cos_to_light and distance, or positions and normals", detail::drop_dirac_conversion},
    {"dirac_light", "A point or directional light is weighted as if a walk could hit it.",
     "Set the light-hit term to 0 for lights that no walk can hit.", "", detail::hit_dirac_light},
    {"dirac_connectible", "Dirac vertices count as connectible and mergeable.",
     "A Dirac vertex cannot be joined to anything: leave out the techniques that would.", "",
     detail::join_dirac<true, true>},
    {"dirac_connectible", "Dirac vertices count as connectible.",
     "A Dirac vertex cannot be joined to anything: leave out the techniques that would.", "",
     detail::join_dirac<true, false>},
    {"dirac_connectible", "Dirac vertices count as mergeable.",
     "A Dirac vertex cannot be joined to anything: leave out the techniques that would.", "",
     detail::join_dirac<false, true>},
    {"pass_is_density",
     "Where a merge is on a beam, the density of that walk has the probability of passing in the place of "
     "the density of the distance.",
     detail::how_to_count_beams, "", detail::move_beam_into_density<detail::distance_walk::both>},
    {"pass_is_density",
     "Where a merge is on a camera beam, the camera walk's density has the probability of passing in the "
     "place of the density of the distance.",
     detail::how_to_count_beams, "", detail::move_beam_into_density<detail::distance_walk::camera>},
    {"pass_is_density",
     "Where a merge is on a light beam, the light walk's density has the probability of passing in the place "
     "of the density of the distance.",
     detail::how_to_count_beams, "", detail::move_beam_into_density<detail::distance_walk::light>},
    {"pass_is_density", "Beams count as points: one sample for each density of the distance.",
     detail::how_to_count_beams, "", detail::forget_beams<detail::distance_walk::both>},
    {"pass_is_density", "Camera beams count as points: one sample for each density of the distance.",
     detail::how_to_count_beams, "", detail::forget_beams<detail::distance_walk::camera>},
    {"pass_is_density", "Light beams count as points: one sample for each density of the distance.",
     detail::how_to_count_beams, "", detail::forget_beams<detail::distance_walk::light>},
    {"pass_is_density",
     "The samples of long beams are 1 over the probability of passing instead of 1 over the density of the "
     "distance.",
     detail::how_to_count_beams, "pass_from_camera and pass_from_light", detail::pass_in_beams},
    {"short_is_long", "Short beams count as long ones: the probability of passing is left out.",
     detail::how_to_count_beams, "pass_from_camera and pass_from_light",
     detail::lengthen_beams<detail::distance_walk::both>},
    {"short_is_long", "Short camera beams count as long ones: the probability of passing is left out.",
     detail::how_to_count_beams, "pass_from_camera and pass_from_light",
     detail::lengthen_beams<detail::distance_walk::camera>},
    {"short_is_long", "Short light beams count as long ones: the probability of passing is left out.",
     detail::how_to_count_beams, "pass_from_camera and pass_from_light",
     detail::lengthen_beams<detail::distance_walk::light>},
    {"short_is_long", "Long beams count as short ones: the probability of passing is applied.",
     detail::how_to_count_beams, "pass_from_camera and pass_from_light",
     detail::shorten_beams<detail::distance_walk::both>},
    {"short_is_long", "Long camera beams count as short ones: the probability of passing is applied.",
     detail::how_to_count_beams, "pass_from_camera and pass_from_light",
     detail::shorten_beams<detail::distance_walk::camera>},
    {"short_is_long", "Long light beams count as short ones: the probability of passing is applied.",
     detail::how_to_count_beams, "pass_from_camera and pass_from_light",
     detail::shorten_beams<detail::distance_walk::light>},
    {"beam_sine", "The sine of the angle between the beams is left out of beam-beam merges.",
     detail::how_to_use_the_sine, "", detail::mistake_sine<false>},
    {"beam_sine", "Beam-beam merges are divided by the sine of the angle between the beams.",
     detail::how_to_use_the_sine, "", detail::mistake_sine<true>},
    {"beam_count", "Beam-beam merges have the number of light walks that leave points.",
     detail::how_to_number_beams, "", detail::count_beams_as_points<detail::has_two_beams>},
    {"beam_count", "Merges with light beams have the number of light walks that leave points.",
     detail::how_to_number_beams, "", detail::count_beams_as_points<detail::has_light_beam>},
    {"beam_count", "Merges with light points have the number of light walks that leave beams.",
     detail::how_to_number_beams, "", detail::count_points_as_beams},
    {"family_radius", "Point-point merges have the radius of point-beam ones.", detail::how_to_take_radii, "",
     detail::take_radius_of<merge_family::point_point, merge_family::point_beam>},
    {"family_radius", "Point-point merges have the radius of beam-point ones.", detail::how_to_take_radii, "",
     detail::take_radius_of<merge_family::point_point, merge_family::beam_point>},
    {"family_radius", "Point-point merges have the radius of beam-beam ones.", detail::how_to_take_radii, "",
     detail::take_radius_of<merge_family::point_point, merge_family::beam_beam>},
    {"family_radius", "Point-beam merges have the radius of point-point ones.", detail::how_to_take_radii, "",
     detail::take_radius_of<merge_family::point_beam, merge_family::point_point>},
    {"family_radius", "Point-beam merges have the radius of beam-point ones.", detail::how_to_take_radii, "",
     detail::take_radius_of<merge_family::point_beam, merge_family::beam_point>},
    {"family_radius", "Point-beam merges have the radius of beam-beam ones.", detail::how_to_take_radii, "",
     detail::take_radius_of<merge_family::point_beam, merge_family::beam_beam>},
    {"family_radius", "Beam-point merges have the radius of point-point ones.", detail::how_to_take_radii, "",
     detail::take_radius_of<merge_family::beam_point, merge_family::point_point>},
    {"family_radius", "Beam-point merges have the radius of point-beam ones.", detail::how_to_take_radii, "",
     detail::take_radius_of<merge_family::beam_point, merge_family::point_beam>},
    {"family_radius", "Beam-point merges have the radius of beam-beam ones.", detail::how_to_take_radii, "",
     detail::take_radius_of<merge_family::beam_point, merge_family::beam_beam>},
    {"family_radius", "Beam-beam merges have the radius of point-point ones.", detail::how_to_take_radii, "",
     detail::take_radius_of<merge_family::beam_beam, merge_family::point_point>},
    {"family_radius", "Beam-beam merges have the radius of point-beam ones.", detail::how_to_take_radii, "",
     detail::take_radius_of<merge_family::beam_beam, merge_family::point_beam>},
    {"family_radius", "Beam-beam merges have the radius of beam-point ones.", detail::how_to_take_radii, "",
     detail::take_radius_of<merge_family::beam_beam, merge_family::beam_point>},
    {"family_radius", "All families have the radius of point-point merges.", detail::how_to_take_radii, "",
     detail::take_one_for_all<detail::taken::radius, merge_family::point_point>},
    {"family_radius", "All families have the radius of point-beam merges.", detail::how_to_take_radii, "",
     detail::take_one_for_all<detail::taken::radius, merge_family::point_beam>},
    {"family_radius", "All families have the radius of beam-beam merges.", detail::how_to_take_radii, "",
     detail::take_one_for_all<detail::taken::radius, merge_family::beam_beam>},
    {"family_radius", "All families have the radius of merges on surfaces.", detail::how_to_take_radii, "",
     detail::take_radius_of_surfaces},
    {"family_radius", "All families have the kernel of point-point merges: its dimension and its radius.",
     detail::how_to_take_radii, "",
     detail::take_one_for_all<detail::taken::kernel, merge_family::point_point>},
    {"family_radius", "All families have the kernel of point-beam merges: its dimension and its radius.",
     detail::how_to_take_radii, "",
     detail::take_one_for_all<detail::taken::kernel, merge_family::point_beam>},
    {"family_radius", "All families have the kernel of beam-beam merges: its dimension and its radius.",
     detail::how_to_take_radii, "", detail::take_one_for_all<detail::taken::kernel, merge_family::beam_beam>},
    {"boundary_vertex", "Index-matched boundaries of media count as vertices that can be joined and merged.",
     detail::how_to_pass_boundaries, "cos_to_camera, cos_to_light and distance, or positions and normals",
     detail::join_boundaries<true, true>},
    {"boundary_vertex", "Index-matched boundaries of media count as vertices that can be joined.",
     detail::how_to_pass_boundaries, "cos_to_camera, cos_to_light and distance, or positions and normals",
     detail::join_boundaries<true, false>},
    {"boundary_vertex", "Index-matched boundaries of media count as vertices that can be merged.",
     detail::how_to_pass_boundaries, "cos_to_camera, cos_to_light and distance, or positions and normals",
     detail::join_boundaries<false, true>},
    {"boundary_vertex",
     "Index-matched boundaries of media count as Dirac vertices: what joins walks across them is left out.",
     detail::how_to_pass_boundaries, "cos_to_camera, cos_to_light and distance, or positions and normals",
     detail::join_boundaries<false, false>},
    {"light_paths_missing", "The number of light paths is left out of the camera connection.",
     "Multiply the camera connection's density by the number of light walks per image.", "",
     detail::forget_light_paths},
    {"light_paths_twice", "The number of light paths is applied twice to the camera connection.",
     "Apply it once: to the density, or inside it, but not both.", "", detail::raise_light_paths<2>},
    {"light_paths_twice", "The camera connection is divided by the number of light paths.",
     "Multiply its density by it. A crop window changes the number of camera walks, not that of light walks.",
     "", detail::raise_light_paths<-1>},
    {"counts_omitted", "The number of next-event samples is left out.",
     "A technique that takes n samples has n times the density: multiply it in, in every weight.", "",
     detail::forget_count<technique_kind::next_event>},
    {"counts_omitted", "The count of connections is left out.",
     "A technique that takes n samples has n times the density: multiply it in, in every weight.", "",
     detail::forget_count<technique_kind::connection>},
    {"counts_omitted", "The counts of all techniques that start at the camera are left out.",
     "A technique that takes n samples has n times the density: multiply it in, in every weight.", "",
     detail::forget_all_counts},
    {"photon_count", "The number of photons is left out of merges.",
     "Every camera vertex may merge with all light walks: multiply the merge's density by their number.", "",
     detail::forget_photons<detail::merging::all>},
    {"photon_count", "The number of photons is left out of merges on surfaces.",
     "Every camera vertex may merge with all light walks: multiply the merge's density by their number.", "",
     detail::forget_photons<detail::merging::on_surfaces>},
    {"photon_count", "The number of photons, or beams, is left out of merges in media.",
     "Every camera vertex may merge with all light walks: multiply the merge's density by their number.", "",
     detail::forget_photons<detail::merging::in_media>},
    {"merge_area", "The area of the query disk is left out of merges.",
     "Multiply the merge's density by pi r^2: without it, weights change with the scale of the scene.", "",
     detail::forget_merge_area<detail::merging::all>},
    {"merge_area", "The area of the query disk is left out of merges on surfaces.",
     "Multiply the merge's density by pi r^2: without it, weights change with the scale of the scene.", "",
     detail::forget_merge_area<detail::merging::on_surfaces>},
    {"merge_area", "The kernel's volume, area or length is left out of merges in media.",
     "Multiply the merge's density by 4/3 pi r^3, pi r^2 or 2 r, after the family.", "",
     detail::forget_merge_area<detail::merging::in_media>},
    {"disabled_technique", "Light hits are switched off but still stand in the denominator.",
     "Set the count of a technique that is off to 0 in every weight.", "",
     detail::keep_disabled<technique_kind::light_hit>},
    {"disabled_technique", "Next events are switched off but still stand in the denominator.",
     "Set the count of a technique that is off to 0 in every weight.", "",
     detail::keep_disabled<technique_kind::next_event>},
    {"disabled_technique", "Connections are switched off but still stand in the denominator.",
     "Set the count of a technique that is off to 0 in every weight.", "",
     detail::keep_disabled<technique_kind::connection>},
    {"disabled_technique", "Camera connections are switched off but still stand in the denominator.",
     "Set the count of a technique that is off to 0 in every weight.", "",
     detail::keep_disabled<technique_kind::camera_connection>},
    {"disabled_technique",
     "Direct connections of light and lens are switched off but still stand in the denominator.",
     "Set the count of a technique that is off to 0 in every weight.", "",
     detail::keep_disabled<technique_kind::direct>},
    {"disabled_technique", "Merges are switched off but still stand in the denominator.",
     "Set the count of a technique that is off to 0 in every weight.", "",
     detail::keep_disabled<technique_kind::merge>},
    {"disabled_technique", "Hits of the lens are switched off but still stand in the denominator.",
     "Set the count of a technique that is off to 0 in every weight.", "",
     detail::keep_disabled<technique_kind::camera_hit>},
    {"missing_technique", "Light hits are missing in the other techniques' weights.",
     "Add the technique to the denominator of all weights of paths that it can make.", "",
     detail::leave_out<technique_kind::light_hit>},
    {"missing_technique", "Next events are missing in the other techniques' weights.",
     "Add the technique to the denominator of all weights of paths that it can make.", "",
     detail::leave_out<technique_kind::next_event>},
    {"missing_technique", "Connections are missing in the other techniques' weights.",
     "Add the technique to the denominator of all weights of paths that it can make.", "",
     detail::leave_out<technique_kind::connection>},
    {"missing_technique", "Camera connections are missing in the other techniques' weights.",
     "Add the technique to the denominator of all weights of paths that it can make.", "",
     detail::leave_out<technique_kind::camera_connection>},
    {"missing_technique",
     "Direct connections of light and lens are missing in the other techniques' weights.",
     "Add the technique to the denominator of all weights of paths that it can make.", "",
     detail::leave_out<technique_kind::direct>},
    {"missing_technique", "Merges are missing in the other techniques' weights.",
     "Add the technique to the denominator of all weights of paths that it can make.", "",
     detail::leave_out_merges<detail::merging::all>},
    {"missing_technique", "Merges in media are missing in the other techniques' weights.",
     "Add the technique to the denominator of all weights of paths that it can make.", "",
     detail::leave_out_merges<detail::merging::in_media>},
    {"missing_technique", "Point-point merges are missing in the other techniques' weights.",
     "Add the technique to the denominator of all weights of paths that it can make.", "",
     detail::leave_out_family<merge_family::point_point>},
    {"missing_technique", "Point-beam merges are missing in the other techniques' weights.",
     "Add the technique to the denominator of all weights of paths that it can make.", "",
     detail::leave_out_family<merge_family::point_beam>},
    {"missing_technique", "Beam-point merges are missing in the other techniques' weights.",
     "Add the technique to the denominator of all weights of paths that it can make.", "",
     detail::leave_out_family<merge_family::beam_point>},
    {"missing_technique", "Beam-beam merges are missing in the other techniques' weights.",
     "Add the technique to the denominator of all weights of paths that it can make.", "",
     detail::leave_out_family<merge_family::beam_beam>},
    {"subpath_caps", "The caps of sub-path lengths are ignored.",
     "Leave out the techniques whose sub-paths would be longer than the caps; or cap the path's total length "
     "instead, which changes no weight.",
     "", detail::ignore_caps},
    {"wrong_heuristic", "The weights are those of the balance heuristic.",
     "Use the heuristic that is claimed, or claim the one that is used.", "",
     detail::use_heuristic<heuristic_kind::balance>},
    {"wrong_heuristic", "The weights are those of the power heuristic with beta = 2.",
     "Use the heuristic that is claimed, or claim the one that is used.", "",
     detail::use_heuristic<heuristic_kind::power, 4>},
    {"wrong_heuristic", "The weights are those of the power heuristic with beta = 1.5.",
     "Use the heuristic that is claimed, or claim the one that is used.", "",
     detail::use_heuristic<heuristic_kind::power, 3>},
    {"wrong_heuristic", "The weights are those of the power heuristic with beta = 1/2.",
     "Use the heuristic that is claimed, or claim the one that is used.", "",
     detail::use_heuristic<heuristic_kind::power, 1>},
    {"wrong_heuristic", "The weights are those of the power heuristic with beta = 3.",
     "Use the heuristic that is claimed, or claim the one that is used.", "",
     detail::use_heuristic<heuristic_kind::power, 6>},
    {"wrong_heuristic", "The weights are those of the power heuristic with beta = 4.",
     "Use the heuristic that is claimed, or claim the one that is used.", "",
     detail::use_heuristic<heuristic_kind::power, 8>},
    {"wrong_heuristic", "The weights are those of the maximum heuristic.",
     "Use the heuristic that is claimed, or claim the one that is used.", "",
     detail::use_heuristic<heuristic_kind::maximum>},
    {"average_of_techniques", "All techniques that can make the path weigh the same: 1 over their number.",
     "Weigh by densities: an average of estimators has the noise of the worst of them.", "",
     detail::use_heuristic<heuristic_kind::average>},
    {"power_overflow", "q^beta leaves the range of float.",
     "Divide all densities by the largest before they are raised to the power, or work in double.", "",
     detail::overflow<weight_arithmetic::float_products>},
    {"power_overflow", "The two squared densities per area leave the range of float.",
     "Divide all densities by the largest before they are raised to the power, or work in double.", "",
     detail::overflow<weight_arithmetic::float_area>},
    {"power_overflow", "The two squared densities per solid angle leave the range of float.",
     "Divide all densities by the largest before they are raised to the power, or work in double.", "",
     detail::overflow<weight_arithmetic::float_solid_angle>},
    {"maximum_tie", "Each of several techniques that tie for the largest density has weight 1.",
     "Techniques that tie for the largest density share 1 equally.", "",
     detail::break_ties<tie_rule::all_win>},
    {"maximum_tie", "None of several techniques that tie for the largest density has weight 1.",
     "Techniques that tie for the largest density share 1 equally.", "",
     detail::break_ties<tie_rule::all_lose>},
    {"average_of_techniques",
     "All techniques that are on weigh the same, also those that cannot make the path: 1 over their number.",
     "Weigh by densities. Techniques that cannot make the path, at Dirac vertices for one, must not be "
     "counted.",
     "", detail::share_among_counted},
    {"average_of_techniques",
     "The weight of a path of n vertices is 1 / (2 n - 1), whichever techniques are on.",
     "Weigh by densities; techniques that are off, or cannot make the path, must not be counted.", "",
     detail::share_among_all},
    {"unweighted", "The weight is 1: contributions of several techniques are added up without weights.",
     "Multiply each contribution by its weight; without weights, every path that two techniques can make "
     "counts "
     "twice.",
     "", detail::weigh_by_one},
};
inline constexpr std::size_t mistake_count = std::size(mistakes);

} // namespace mis
