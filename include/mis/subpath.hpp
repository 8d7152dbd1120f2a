// SPDX-License-Identifier: MIT
// Floor 3: one weight in O(1), from two numbers per sub-path vertex.
//
// The two walks of a bidirectional renderer carry a subpath_state each, updated by start, arrive and scatter.
// When a path is completed (a light is hit, two ends are joined, two walks merge), its weight follows from
// the states at the two ends and the densities across the last edge. The result is the weight that path.hpp
// computes from the complete path. docs/recursion.md derives it.
//
// What the numbers are, seen from the camera walk (the light walk is its mirror image), with b(q) = q^beta
// and + for the sum, or b(q) = q and the maximum for the sum. Numbers in parentheses are the equations of
// docs/recursion.md. Relative to the technique that joins x_{s-1} and x_s, all techniques whose edge or merge
// is nearer to the camera have the share
//
//     E_s = b(P<-_{s-1}) T_{s-1}                                                     (4)
//     T_i = m_i + c A_i + b(omega<-_i) B_i      complete once x_{i+1} is known     (7)
//     A_i = 1 / b(P->_i)                                                             (6)
//     B_i = b(|cos_{i-1}| / (omega->_{i-1} |cos_i|)) T_{i-1}                         (6)
//
// where c is the count of the technique that joins x_{i-1} and x_i, and m_i the merge term of x_i. At a
// Dirac vertex m_i and both its joins are missing.
//
// Weights are in [0, 1], and never NaN, whatever the numbers are. They are right as long as no state
// saturates (at a sixteenth of the largest number) or underflows: in float with power 2, while the densities
// of any two techniques are less than about 1e18 apart and the scene is about 1e-5 to 1e2 in size; for other
// sizes, from 1e-6 to 1e6, see for_scene_of_size. path.hpp has no such limit. Under -ffast-math keep
// densities between 1e-8 and 1e8 in float, 1e-60 and 1e60 in double: the compiler may regroup products beyond
// the scalar's range; and weights cost a few instructions more, because NaN then has to be told by its bits.
//
// Sub-path caps cannot be expressed here: cap the path's total length instead, which changes no weight.
#pragma once

#include <mis/config.hpp>
#include <mis/measure.hpp>
#include <mis/techniques.hpp>
#include <type_traits>
#include <utility>

namespace mis {

// Everything that a sub-path vertex must remember. A state that no walk has started has a negative b, which
// is asserted wherever it is used. `a` holds c A: positive while the last edge is the walk's first, negative
// later, because the two have counts of their own and each may be 0.
template <class T> struct subpath_state {
    T a = T(0);
    T b = T(-1);
};
static_assert(sizeof(subpath_state<float>) == 2 * sizeof(float) &&
                  sizeof(subpath_state<double>) == 2 * sizeof(double),
              "the state is two scalars");

// The camera's or the light's end of a path: where a walk starts, what a walk hits, or what a vertex is
// joined to. docs/end_points.md has a table of what to put in for each kind of camera and light.
template <class T> struct end_point {
    pdf_position<T> position;     // of the point as its own walk's start
    pdf_next_event<T> next_event; // of the point as sampled for the end of the other walk
    pdf_direction<T> direction;   // of the walk's first direction
    cosine<T> cos;                // of normal and first edge
    detail::mask_t<T> hittable;   // false for a pinhole, a point light, a directional light
};

// The same for a light whose record is kept, with its two emission densities multiplied once. Not for media.
template <class T> struct kept_end {
    pdf_next_event<T> next_event;
    T emission; // pdf_position times pdf_direction
    cosine<T> cos;
    T hittable; // 1 or 0
};
template <class T> MIS_HOST_DEVICE constexpr kept_end<T> keep(const end_point<T>& end) {
    return {end.next_event, end.position.value * end.direction.value, end.cos,
            detail::select(end.hittable, T(1), T(0))};
}

// A sub-path's last vertex, once the edge across to the other sub-path is known.
template <class T> struct subpath_end {
    subpath_state<T> state; // after arrive
    cosine<T> cos;          // of the edge across
    pdf_forward<T> forward; // of continuing the walk across the edge
    pdf_reverse<T> reverse; // of going back along the walk, coming over the edge
    T merge_factor = T(1);  // of this vertex, see path_vertex
};

// The squared distance of an edge whose ends are connected not counts.connection times but `factor` times
// that (connections that are picked by an importance: the expected number of this one over the count), [J] 4.
// For arrive, step and connection, wherever the edge lies between two vertices that scatter: A and the
// density of the connection itself hold the distance, nothing else does. Both walks give an edge the same
// factor, which the path alone decides. Next events, joins at the camera and hits have none. Positive and
// finite.
template <class T>
MIS_HOST_DEVICE constexpr squared_distance<T> times_connections(squared_distance<T> distance2,
                                                                detail::identity_t<T> factor) {
    detail::assert_density(factor);
    return squared_distance<T>(distance2.value * factor);
}

// What a renderer knows of its techniques when it is compiled. This is nothing; what is known takes
// instructions away (docs/recursion.md says how many).
struct any_techniques {
    // The connection's count is positive, and a path of two vertices is not weighed here: neither a light
    // that is hit by the camera walk's first edge (its weight is 1) nor `direct`.
    static constexpr bool always_connects = false;
    // Not every merge_factor is 1.
    static constexpr bool merge_factors = true;
};
// Bidirectional path tracing, or vertex connection and merging, without media, as most renderers have it.
struct connected_surfaces {
    static constexpr bool always_connects = true;
    static constexpr bool merge_factors = false;
};

namespace detail {

// Heuristics that the recursion can carry along have times, join and against.
template <class Heuristic, class T, class = void> struct has_recursion : std::false_type {};
template <class Heuristic, class T>
struct has_recursion<
    Heuristic, T,
    std::void_t<decltype(std::declval<Heuristic>().template times<T>(std::declval<T>(), std::declval<T>()))>>
    : std::true_type {};

// Asserts what the arguments of a call must be: not negative and not NaN; distances positive.
template <class T> MIS_HOST_DEVICE constexpr void expect(const T& number) { assert_density(number); }
template <class T> MIS_HOST_DEVICE constexpr void expect([[maybe_unused]] const squared_distance<T>& d) {
    assert(!lanes<T>::any(!(d.value > T(0))));
}
template <class T> MIS_HOST_DEVICE constexpr void expect(const end_point<T>& end) {
    expect(end.position.value);
    expect(end.next_event.value);
    expect(end.direction.value);
    expect(end.cos.value);
}
template <class T> MIS_HOST_DEVICE constexpr void expect(const kept_end<T>& end) {
    expect(end.next_event.value);
    assert(!lanes<T>::any(end.emission < T(0))); // NaN where an infinite density met a 0
    expect(end.cos.value);
}
// b is NaN where an infinite density met a 0.
template <class T> MIS_HOST_DEVICE constexpr void expect([[maybe_unused]] const subpath_state<T>& started) {
    assert(!lanes<T>::any(started.b < T(0)));
}
template <class T> MIS_HOST_DEVICE constexpr void expect(const subpath_end<T>& end) {
    expect(end.state);
    expect(end.cos.value);
    expect(end.forward.value);
    expect(end.reverse.value);
    expect(end.merge_factor);
}
template <class Use, class T>
MIS_HOST_DEVICE constexpr void expect_counts([[maybe_unused]] const technique_counts<T>& c) {
    assert(!lanes<T>::any(c.direct > T(0) &&
                          !(c.camera_connection > T(0) && (c.camera_hit == T(0) || c.next_event > T(0)))));
    assert(!Use::always_connects || !lanes<T>::any(!(c.connection > T(0) && c.direct == T(0))));
}
template <class... Arguments> MIS_HOST_DEVICE constexpr void expect_all(const Arguments&... arguments) {
    (expect(arguments), ...);
}

} // namespace detail

// Weights of the paths of one renderer: the heuristic (balance, power, maximum, average; cutoff needs all
// densities at once, see path.hpp) and the counts of the techniques. Make one per pass:
//
//     const mis::path_weights weigh{mis::power, mis::bidirectional(float(pixels))};
//
// The technique `direct` (n = 2) hangs on the state of the walk's first edge, which knows the camera
// connection. It needs camera_connection > 0, with camera_hit on also next_event > 0, and it is weighed right
// where the end point of the walk that hits has one density: pdf_next_event = pdf_position.
//
// The roles of all numbers, and their units, are those of measure.hpp. Cosines and densities that are
// negative or NaN, distances that are not positive, and states that no walk has started are a caller's bug,
// asserted in debug builds.
template <class Heuristic, class T, class Use = any_techniques> struct path_weights {
    static_assert(
        detail::has_recursion<Heuristic, T>::value,
        "mis: the cutoff heuristic needs all densities at once: weigh complete paths, mis::weight()");

    Heuristic heuristic;
    technique_counts<T> counts;

    // All counts are over that of connections (where they are off, another technique's), the unit, and
    // raised. Areas are multiplied by the unit and densities per area divided by it, which changes no weight,
    // and leaves to a common factor of the counts to choose the unit of area: see for_scene_of_size.
    technique_counts<T> relative;
    T unit = T(1), per_unit = T(1), raised_per_unit = T(1);
    T merge_count = T(0);    // b(counts.merge), which is an area
    T later_in_total = T(0); // what T takes of a state's `a` that is negative: -1, or without connections 0
    T light_join = T(0), camera_join = T(0); // next event's and camera connection's share of such an `a`,
    T first_light_join = T(0), first_camera_join = T(0); // and direct's of a first edge's
    T nothing = T(0);                            // numbers in memory, which the compiler does not know, so
    T least = T(-detail::limits<T>::saturation); // that a comparison with them is one instruction

    MIS_HOST_DEVICE constexpr path_weights(const Heuristic& h, const technique_counts<T>& c, Use = {})
        : heuristic(h), counts(c), relative(c) {
        detail::expect_counts<Use>(c);
        if constexpr (detail::has_recursion<Heuristic, T>::value) { // else the assertion above says it all
            const T units[] = {c.camera_hit, c.camera_connection, c.light_hit, c.next_event, c.connection};
            for (const T& count : units)
                unit = detail::select(count > T(0), count, unit);
            T* const all[] = {
                &relative.light_hit, &relative.next_event, &relative.connection, &relative.camera_connection,
                &relative.direct,    &relative.camera_hit, &relative.merge};
            for (T* count : all) {
                detail::assert_density(*count);
                *count = raise(*count / unit);
            }
            per_unit = T(1) / unit;
            if constexpr (Use::always_connects) { // what is known to be on is the unit of areas, too
                merge_count = relative.merge;
                light_join = relative.next_event;
                camera_join = relative.camera_connection;
            } else {
                raised_per_unit = raise(per_unit);
                merge_count = raise(c.merge);
                later_in_total = detail::select(c.connection > T(0), T(-1), T(0));
                light_join = -relative.next_event * raised_per_unit;
                camera_join = -relative.camera_connection * raised_per_unit;
                const T direct = relative.direct * raised_per_unit;
                first_light_join = detail::select(c.direct > T(0), direct / relative.camera_connection, T(0));
                first_camera_join = detail::select(c.direct > T(0) && c.next_event > T(0),
                                                   direct / relative.next_event, T(0));
            }
        }
    }

    // A walk leaves its end point, (8).
    MIS_HOST_DEVICE constexpr subpath_state<T> start_camera(const end_point<T>& camera) const {
        return start(camera, relative.camera_hit, relative.camera_connection);
    }
    MIS_HOST_DEVICE constexpr subpath_state<T> start_light(const end_point<T>& light) const {
        return start(light, relative.light_hit, relative.next_event);
    }

    // The walk reaches a vertex, at |cos| = cos_in, (6). In media, with the densities of the distance: of
    // this walk to this vertex and of the other walk to the previous one.
    MIS_HOST_DEVICE constexpr subpath_state<T>
    arrive(subpath_state<T> x, squared_distance<T> distance2, cosine<T> cos_in,
           pdf_distance_forward<T> distance_forward = pdf_distance_forward<T>(T(1)),
           pdf_distance_reverse<T> distance_reverse = pdf_distance_reverse<T>(T(1))) const {
        detail::expect_all(x, distance2, cos_in.value, distance_forward.value, distance_reverse.value);
        const T inverse = T(1) / (cos_in.value * distance_forward.value);
        return {saturate_signed(heuristic.times(x.a, area(distance2.value) * inverse)),
                detail::saturate(heuristic.times(x.b, distance_reverse.value * inverse))};
    }
    // From an infinite light; at an infinite light.
    MIS_HOST_DEVICE constexpr subpath_state<T>
    arrive_from_infinity(subpath_state<T> x, cosine<T> cos_in,
                         pdf_distance_forward<T> distance_forward = pdf_distance_forward<T>(T(1)),
                         pdf_distance_reverse<T> distance_reverse = pdf_distance_reverse<T>(T(1))) const {
        return arrive(x, squared_distance<T>(T(1)), cos_in, distance_forward, distance_reverse);
    }
    MIS_HOST_DEVICE constexpr subpath_state<T>
    arrive_at_infinity(subpath_state<T> x,
                       pdf_distance_forward<T> distance_forward = pdf_distance_forward<T>(T(1)),
                       pdf_distance_reverse<T> distance_reverse = pdf_distance_reverse<T>(T(1))) const {
        return arrive(x, squared_distance<T>(T(1)), cosine<T>(T(1)), distance_forward, distance_reverse);
    }

    // The walk leaves a vertex that can be joined and merged, (7) and (6): `forward` is the density of the
    // direction just sampled. merge_factor: see path_vertex.
    MIS_HOST_DEVICE constexpr subpath_state<T> scatter(subpath_state<T> x, cosine<T> cos_out,
                                                       pdf_forward<T> forward, pdf_reverse<T> reverse,
                                                       T merge_factor = T(1)) const {
        detail::expect_all(x, cos_out.value, forward.value, reverse.value, merge_factor);
        return leave(total(x, reverse.value, merge_factor), cos_out.value, forward.value);
    }

    // scatter, and then arrive at the next vertex, with one division for both.
    MIS_HOST_DEVICE constexpr subpath_state<T>
    step(subpath_state<T> x, cosine_out<T> cos_out, pdf_forward<T> forward, pdf_reverse<T> reverse,
         squared_distance<T> distance2, cosine_in<T> cos_in, T merge_factor = T(1),
         pdf_distance_forward<T> distance_forward = pdf_distance_forward<T>(T(1)),
         pdf_distance_reverse<T> distance_reverse = pdf_distance_reverse<T>(T(1))) const {
        detail::expect_all(x, cos_out.value, forward.value, reverse.value, distance2, cos_in.value,
                           merge_factor, distance_forward.value, distance_reverse.value);
        const T inverse = T(1) / (forward.value * (cos_in.value * distance_forward.value));
        const T earlier = total(x, reverse.value, merge_factor);
        return {saturate_signed(later_edge(area(distance2.value) * inverse)),
                detail::saturate(heuristic.times(earlier, cos_out.value * distance_reverse.value * inverse))};
    }

    // The walk leaves a Dirac scatterer, (9). cos_in as given to arrive; the probabilities of the lobe;
    // refractive indices, the same for a reflection. Basic etendue makes up for the squeezed solid angle:
    // omega-> = q-> eta_out^2 |cos_out|, omega<- = q<- eta_in^2 |cos_in|, and |cos_out| cancels.
    MIS_HOST_DEVICE constexpr subpath_state<T> scatter_dirac(subpath_state<T> x, cosine<T> cos_in,
                                                             pdf_forward<T> forward, pdf_reverse<T> reverse,
                                                             eta_in<T> in = eta_in<T>(T(1)),
                                                             eta_out<T> out = eta_out<T>(T(1))) const {
        detail::expect_all(x, cos_in.value, forward.value, reverse.value, in.value, out.value);
        const T ratio =
            reverse.value * in.value * in.value * cos_in.value / (forward.value * out.value * out.value);
        return {T(0), heuristic.times(x.b, ratio)};
    }

    // Weight of joining the ends of both walks, (10), its quotient multiplied by the edge's squared distance.
    // In media, with the densities of the distance along the edge.
    MIS_HOST_DEVICE constexpr T
    connection(const subpath_end<T>& camera, const subpath_end<T>& light, squared_distance<T> distance2,
               pdf_distance_to_light<T> distance_to_light = pdf_distance_to_light<T>(T(1)),
               pdf_distance_to_camera<T> distance_to_camera = pdf_distance_to_camera<T>(T(1))) const {
        detail::expect_all(camera, light, distance2, distance_to_light.value, distance_to_camera.value);
        const T nearer_camera =
            heuristic.times(total(camera), light.forward.value * distance_to_camera.value * camera.cos.value);
        const T nearer_light =
            heuristic.times(total(light), camera.forward.value * distance_to_light.value * light.cos.value);
        const T own = Use::always_connects ? raise(distance2.value)
                                           : heuristic.times(relative.connection, area(distance2.value));
        return against(own, heuristic.join(nearer_camera, nearer_light));
    }

    // Weight of joining the camera walk's end to a sampled light point, (11).
    MIS_HOST_DEVICE constexpr T
    next_event(const subpath_end<T>& camera, const end_point<T>& light, squared_distance<T> distance2,
               pdf_distance_to_light<T> distance_to_light = pdf_distance_to_light<T>(T(1)),
               pdf_distance_to_camera<T> distance_to_camera = pdf_distance_to_camera<T>(T(1))) const {
        detail::expect_all(camera, light, distance2, distance_to_light.value, distance_to_camera.value);
        return join_end(camera, light, relative.next_event, relative.light_hit, distance2.value,
                        distance_to_light.value, distance_to_camera.value);
    }
    MIS_HOST_DEVICE constexpr T next_event(const subpath_end<T>& camera, const kept_end<T>& light,
                                           squared_distance<T> distance2) const {
        detail::expect_all(camera, light, distance2);
        const T own = heuristic.times(relative.next_event, light.next_event.value * distance2.value);
        const T earlier = heuristic.times(total(camera), per_area(light.emission) * camera.cos.value);
        const T hit =
            heuristic.times(relative.light_hit, camera.forward.value * light.cos.value * light.hittable);
        return against(own, heuristic.join(earlier, hit));
    }
    // Weight of joining the light walk's end to the camera, (11) seen from the light.
    MIS_HOST_DEVICE constexpr T
    camera_connection(const end_point<T>& camera, const subpath_end<T>& light, squared_distance<T> distance2,
                      pdf_distance_to_light<T> distance_to_light = pdf_distance_to_light<T>(T(1)),
                      pdf_distance_to_camera<T> distance_to_camera = pdf_distance_to_camera<T>(T(1))) const {
        detail::expect_all(camera, light, distance2, distance_to_light.value, distance_to_camera.value);
        return join_end(light, camera, relative.camera_connection, relative.camera_hit, distance2.value,
                        distance_to_camera.value, distance_to_light.value);
    }
    // The same for a pinhole, whose position has density 1 and which no walk hits: only the density of its
    // direction is left. Not for media.
    MIS_HOST_DEVICE constexpr T camera_connection(pdf_direction<T> camera, const subpath_end<T>& light,
                                                  squared_distance<T> distance2) const {
        detail::expect_all(camera.value, light, distance2);
        return against(heuristic.times(relative.camera_connection, distance2.value),
                       heuristic.times(total(light), per_area(camera.value) * light.cos.value));
    }

    // Weight of the camera walk having arrived at a light, (12). The light must be hittable; kept ends are
    // not for where `direct` is on.
    MIS_HOST_DEVICE constexpr T light_hit(subpath_state<T> x, const end_point<T>& light) const {
        return hit(x, light, relative.light_hit, light_join, first_light_join);
    }
    MIS_HOST_DEVICE constexpr T light_hit(subpath_state<T> x, const kept_end<T>& light) const {
        detail::expect_all(x, light);
        assert(!detail::lanes<T>::any(!(light.hittable > T(0) && counts.direct == T(0))));
        const T earlier = heuristic.times(x.b, per_area(light.emission));
        const T joined = heuristic.times(light_join, light.next_event.value) * x.a;
        return against(
            relative.light_hit,
            heuristic.join(Use::always_connects ? joined : detail::larger(nothing, joined), earlier));
    }
    // Weight of the light walk having arrived at the lens, (12) seen from the light.
    MIS_HOST_DEVICE constexpr T camera_hit(subpath_state<T> x, const end_point<T>& camera) const {
        return hit(x, camera, relative.camera_hit, camera_join, first_camera_join);
    }

    // Weight of joining the emission point itself to the lens, n = 2, (14).
    MIS_HOST_DEVICE constexpr T
    direct(const end_point<T>& camera, const end_point<T>& light, squared_distance<T> distance2,
           pdf_distance_to_light<T> distance_to_light = pdf_distance_to_light<T>(T(1)),
           pdf_distance_to_camera<T> distance_to_camera = pdf_distance_to_camera<T>(T(1))) const {
        detail::expect_all(camera, light, distance2, distance_to_light.value, distance_to_camera.value);
        const T light_from_camera =
            camera.direction.value * distance_to_light.value * light.cos.value / distance2.value;
        const T camera_from_light =
            light.direction.value * distance_to_camera.value * camera.cos.value / distance2.value;
        const T hit_light = heuristic.times(relative.light_hit, light_from_camera / light.position.value);
        const T hit_camera = heuristic.times(relative.camera_hit, camera_from_light / camera.position.value);
        return against(relative.direct, heuristic.join(detail::select(light.hittable, hit_light, T(0)),
                                                       detail::select(camera.hittable, hit_camera, T(0))));
    }

    // Weight of a merge of both walks at one vertex, both states after arrive there, (13): to_light is the
    // density of the light walk's incoming edge as a camera walk would sample it, to_camera the other way
    // about.
    MIS_HOST_DEVICE constexpr T merge(subpath_state<T> camera, subpath_state<T> light,
                                      pdf_to_light<T> to_light, pdf_to_camera<T> to_camera,
                                      T merge_factor = T(1)) const {
        detail::expect_all(camera, light, to_light.value, to_camera.value, merge_factor);
        const T edges = heuristic.join(edge_term(camera), edge_term(light));
        const T earlier = heuristic.join(heuristic.times(camera.b, to_camera.value),
                                         heuristic.times(light.b, to_light.value));
        return against(merge_term(merge_factor), heuristic.join(edges, earlier));
    }

    // The pieces of the formulas above. What arrive and step return is saturated: finite and not NaN, so that
    // 0 times it is 0. In between numbers may overflow, and become NaN where something infinite meets a 0;
    // `proper` takes that out of a weight.

    MIS_HOST_DEVICE constexpr T raise(T x) const { return heuristic.times(T(1), x); }
    // An area in the unit of areas; one over an area.
    MIS_HOST_DEVICE constexpr T area(T x) const { return Use::always_connects ? x : x * unit; }
    MIS_HOST_DEVICE constexpr T per_area(T x) const { return Use::always_connects ? x : x * per_unit; }
    MIS_HOST_DEVICE constexpr T against(T own, T others) const {
        return detail::proper(heuristic.against(own, others), own, nothing);
    }

    // What `a` holds of an edge that is not a walk's first, for A = b(x); and what T takes of an `a`, c A.
    MIS_HOST_DEVICE constexpr T later_edge(T x) const { return Use::always_connects ? raise(x) : -raise(x); }
    MIS_HOST_DEVICE constexpr T edge_term(subpath_state<T> x) const {
        return Use::always_connects ? x.a : detail::larger(x.a, later_in_total * x.a);
    }
    MIS_HOST_DEVICE constexpr T saturate_signed(T a) const {
        return detail::saturate(Use::always_connects ? a : detail::larger(least, a));
    }
    // m_i and T_i.
    MIS_HOST_DEVICE constexpr T merge_term(T merge_factor) const {
        return Use::merge_factors ? heuristic.times(merge_count, merge_factor) : merge_count;
    }
    MIS_HOST_DEVICE constexpr T total(subpath_state<T> x, T pdf_back, T merge_factor) const {
        return heuristic.join(heuristic.join(edge_term(x), heuristic.times(x.b, pdf_back)),
                              merge_term(merge_factor));
    }
    MIS_HOST_DEVICE constexpr T total(const subpath_end<T>& end) const {
        return total(end.state, end.reverse.value, end.merge_factor);
    }
    // The next vertex's A and B but for what arrive knows.
    MIS_HOST_DEVICE constexpr subpath_state<T> leave(T total_here, T cos_out, T forward) const {
        const T inverse = T(1) / forward;
        return {later_edge(inverse), heuristic.times(total_here, cos_out * inverse)};
    }
    MIS_HOST_DEVICE constexpr subpath_state<T> start(const end_point<T>& end, T hit_term, T join_term) const {
        detail::expect(end);
        const T inverse = T(1) / end.position.value;
        const T away = T(1) / end.direction.value;
        const T hit = detail::select(end.hittable, heuristic.times(hit_term, area(inverse)), T(0));
        const T join = heuristic.times(join_term, end.next_event.value * inverse);
        return {detail::saturate(heuristic.times(join, away)), heuristic.times(hit, end.cos.value * away)};
    }
    // (11), its quotient multiplied by b(P_nee d^2) of the sampled end.
    MIS_HOST_DEVICE constexpr T join_end(const subpath_end<T>& walk, const end_point<T>& end, T join_term,
                                         T hit_term, T distance2, T distance_to_end,
                                         T distance_to_walk) const {
        const T own = heuristic.times(join_term, end.next_event.value * distance2);
        const T earlier = heuristic.times(total(walk), per_area(end.position.value) * end.direction.value *
                                                           distance_to_walk * walk.cos.value);
        const T hit = heuristic.times(hit_term, walk.forward.value * distance_to_end * end.cos.value);
        return against(own, heuristic.join(earlier, detail::select(end.hittable, hit, T(0))));
    }
    MIS_HOST_DEVICE constexpr T hit(subpath_state<T> x, const end_point<T>& end, T hit_term, T join_term,
                                    T first_join_term) const {
        detail::expect_all(x, end);
        assert(!detail::lanes<T>::any(!end.hittable));
        T emission = raise(end.direction.value * end.position.value);
        if constexpr (!Use::always_connects)
            emission = emission * raised_per_unit;
        const T earlier = emission * x.b;
        T joined = heuristic.times(join_term, end.next_event.value) * x.a;
        if constexpr (!Use::always_connects) { // on a first edge `direct` takes next event's place
            const T first = heuristic.times(first_join_term, end.position.value) * x.a;
            joined = detail::larger(nothing, detail::larger(first, joined));
        }
        return against(hit_term, heuristic.join(joined, earlier));
    }
};

} // namespace mis
