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
// The state saturates at a sixteenth of the largest number, which keeps everything branch-free and without
// NaN. A weight is right as long as no state saturates or underflows: in float with power 2, while the
// densities of any two techniques are less than about 1e18 apart. path.hpp has no such limit. Under
// -ffast-math, keep densities between 1e-8 and 1e8 in float, 1e-60 and 1e60 in double: the compiler may
// regroup products beyond the scalar's range.
//
// Sub-path caps cannot be expressed here: cap the path's total length instead, which changes no weight.
#pragma once

#include <mis/config.hpp>
#include <mis/measure.hpp>
#include <mis/path.hpp>
#include <mis/techniques.hpp>
#include <type_traits>
#include <utility>

namespace mis {

// Everything that a sub-path vertex must remember. The sign of `a` is set while the last edge is the walk's
// first.
template <class T> struct subpath_state {
    T a = 0;
    T b = 0;
};
static_assert(sizeof(subpath_state<float>) == 2 * sizeof(float) &&
                  sizeof(subpath_state<double>) == 2 * sizeof(double),
              "the state is two scalars");

// The camera's or the light's end of a path: where a walk starts, what a walk hits, or what a vertex is
// joined to. docs/bidirectional.md has a table of what to put in for each kind of camera and light.
template <class T> struct end_point {
    pdf_position<T> position;     // of the point as its own walk's start
    pdf_next_event<T> next_event; // of the point as sampled for the end of the other walk
    pdf_direction<T> direction;   // of the walk's first direction
    cosine<T> cos;                // of normal and first edge
    bool hittable;                // false for a pinhole, a point light, a directional light
};

// A sub-path's last vertex, once the edge across to the other sub-path is known.
template <class T> struct subpath_end {
    subpath_state<T> state; // after arrive
    cosine<T> cos;          // of the edge across
    pdf_forward<T> forward; // of continuing the walk across the edge
    pdf_reverse<T> reverse; // of going back along the walk, coming over the edge
    T merge_factor = 1;     // of this vertex, see path_vertex
};

namespace detail {

// Heuristics that the recursion can carry along have raise, join and against.
template <class Heuristic, class T, class = void> struct has_recursion : std::false_type {};
template <class Heuristic, class T>
struct has_recursion<Heuristic, T, std::void_t<decltype(std::declval<Heuristic>().raise(std::declval<T>()))>>
    : std::true_type {};

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
// The roles of all numbers, and their units, are those of measure.hpp; cosines and densities are not
// negative.
template <class Heuristic, class T> struct path_weights {
    Heuristic heuristic;
    technique_counts<T> counts;
    technique_counts<T> raised; // b(counts)

    static_assert(
        detail::has_recursion<Heuristic, T>::value,
        "mis: the cutoff heuristic needs all densities at once: weigh complete paths, mis::weight()");

    MIS_HOST_DEVICE constexpr path_weights(const Heuristic& h, const technique_counts<T>& c)
        : heuristic(h), counts(c), raised(c) {
        assert(c.direct == T(0) ||
               (c.camera_connection > T(0) && (c.camera_hit == T(0) || c.next_event > T(0))));
        if constexpr (detail::has_recursion<Heuristic, T>::value) { // else the assertion above says it all
            raised.light_hit = h.raise(c.light_hit);
            raised.next_event = h.raise(c.next_event);
            raised.connection = h.raise(c.connection);
            raised.camera_connection = h.raise(c.camera_connection);
            raised.direct = h.raise(c.direct);
            raised.camera_hit = h.raise(c.camera_hit);
            raised.merge = h.raise(c.merge);
        }
    }

    // A walk leaves its end point, (8).
    MIS_HOST_DEVICE constexpr subpath_state<T> start_camera(const end_point<T>& camera) const {
        return start(camera, raised.camera_hit, raised.camera_connection);
    }
    MIS_HOST_DEVICE constexpr subpath_state<T> start_light(const end_point<T>& light) const {
        return start(light, raised.light_hit, raised.next_event);
    }

    // The walk reaches a vertex, at |cos| = cos_in, (6). In media, with the densities of the distance: of
    // this walk to this vertex and of the other walk to the previous one.
    MIS_HOST_DEVICE constexpr subpath_state<T>
    arrive(subpath_state<T> x, squared_distance<T> distance2, cosine<T> cos_in,
           pdf_distance_forward<T> distance_forward = pdf_distance_forward<T>(T(1)),
           pdf_distance_reverse<T> distance_reverse = pdf_distance_reverse<T>(T(1))) const {
        const T inverse = T(1) / (cos_in.value * distance_forward.value);
        const T a = detail::saturate(x.a * heuristic.raise(distance2.value * inverse));
        const T b = detail::saturate(x.b * heuristic.raise(distance_reverse.value * inverse));
        return {detail::larger(a, -detail::limits<T>::saturation), b};
    }
    // From an infinite light; at an infinite light.
    MIS_HOST_DEVICE constexpr subpath_state<T> arrive_from_infinity(subpath_state<T> x,
                                                                    cosine<T> cos_in) const {
        return arrive(x, squared_distance<T>(T(1)), cos_in);
    }
    MIS_HOST_DEVICE constexpr subpath_state<T> arrive_at_infinity(subpath_state<T> x) const {
        return arrive(x, squared_distance<T>(T(1)), cosine<T>(T(1)));
    }

    // The walk leaves a vertex that can be joined and merged, (7) and (6): `forward` is the density of the
    // direction just sampled. merge_factor: see path_vertex.
    MIS_HOST_DEVICE constexpr subpath_state<T> scatter(subpath_state<T> x, cosine<T> cos_out,
                                                       pdf_forward<T> forward, pdf_reverse<T> reverse,
                                                       T merge_factor = T(1)) const {
        return leave(total(x, reverse.value, merge_factor), cos_out.value, forward.value);
    }

    // The walk leaves a Dirac scatterer, (9). cos_in as given to arrive; the probabilities of the lobe;
    // refractive indices, the same for a reflection. Basic etendue makes up for the squeezed solid angle:
    // omega-> = q-> eta_out^2 |cos_out|, omega<- = q<- eta_in^2 |cos_in|, and |cos_out| cancels.
    MIS_HOST_DEVICE constexpr subpath_state<T> scatter_dirac(subpath_state<T> x, cosine<T> cos_in,
                                                             pdf_forward<T> forward, pdf_reverse<T> reverse,
                                                             eta_in<T> in = eta_in<T>(T(1)),
                                                             eta_out<T> out = eta_out<T>(T(1))) const {
        const T ratio =
            reverse.value * in.value * in.value * cos_in.value / (forward.value * out.value * out.value);
        return {T(0), detail::saturate(x.b * heuristic.raise(ratio))};
    }

    // Weight of joining the ends of both walks, (10). In media, with the densities of the distance along the
    // edge.
    MIS_HOST_DEVICE constexpr T
    connection(const subpath_end<T>& camera, const subpath_end<T>& light, squared_distance<T> distance2,
               pdf_distance_to_light<T> distance_to_light = pdf_distance_to_light<T>(T(1)),
               pdf_distance_to_camera<T> distance_to_camera = pdf_distance_to_camera<T>(T(1))) const {
        const T inverse = T(1) / distance2.value;
        const T light_from_camera =
            camera.forward.value * distance_to_light.value * light.cos.value * inverse;
        const T camera_from_light =
            light.forward.value * distance_to_camera.value * camera.cos.value * inverse;
        const T nearer_camera = heuristic.raise(camera_from_light) * total(camera);
        const T nearer_light = heuristic.raise(light_from_camera) * total(light);
        return heuristic.against(raised.connection, heuristic.join(nearer_camera, nearer_light));
    }

    // Weight of joining the camera walk's end to a sampled light point, (11).
    MIS_HOST_DEVICE constexpr T
    next_event(const subpath_end<T>& camera, const end_point<T>& light, squared_distance<T> distance2,
               pdf_distance_to_light<T> distance_to_light = pdf_distance_to_light<T>(T(1)),
               pdf_distance_to_camera<T> distance_to_camera = pdf_distance_to_camera<T>(T(1))) const {
        return join_end(camera, light, raised.next_event, raised.light_hit, distance2.value,
                        distance_to_light.value, distance_to_camera.value);
    }
    // Weight of joining the light walk's end to the camera, (11) seen from the light.
    MIS_HOST_DEVICE constexpr T
    camera_connection(const end_point<T>& camera, const subpath_end<T>& light, squared_distance<T> distance2,
                      pdf_distance_to_light<T> distance_to_light = pdf_distance_to_light<T>(T(1)),
                      pdf_distance_to_camera<T> distance_to_camera = pdf_distance_to_camera<T>(T(1))) const {
        return join_end(light, camera, raised.camera_connection, raised.camera_hit, distance2.value,
                        distance_to_camera.value, distance_to_light.value);
    }

    // Weight of the camera walk having arrived at a light, (12).
    MIS_HOST_DEVICE constexpr T light_hit(subpath_state<T> x, const end_point<T>& light) const {
        const T direct = heuristic.raise(light.position.value) * raised.direct / raised.camera_connection;
        return hit(x, light, raised.light_hit, heuristic.raise(light.next_event.value) * raised.next_event,
                   detail::select(raised.direct > T(0), direct, T(0)));
    }
    // Weight of the light walk having arrived at the lens, (12) seen from the light.
    MIS_HOST_DEVICE constexpr T camera_hit(subpath_state<T> x, const end_point<T>& camera) const {
        const T direct = heuristic.raise(camera.position.value) * raised.direct / raised.next_event;
        return hit(x, camera, raised.camera_hit,
                   heuristic.raise(camera.next_event.value) * raised.camera_connection,
                   detail::select(raised.direct > T(0), direct, T(0)));
    }

    // Weight of joining the emission point itself to the lens, n = 2, (14).
    MIS_HOST_DEVICE constexpr T direct(const end_point<T>& camera, const end_point<T>& light,
                                       squared_distance<T> distance2) const {
        const T light_from_camera = camera.direction.value * light.cos.value / distance2.value;
        const T camera_from_light = light.direction.value * camera.cos.value / distance2.value;
        const T hit_light = raised.light_hit * heuristic.raise(light_from_camera / light.position.value);
        const T hit_camera = raised.camera_hit * heuristic.raise(camera_from_light / camera.position.value);
        return heuristic.against(raised.direct,
                                 heuristic.join(detail::select(light.hittable, hit_light, T(0)),
                                                detail::select(camera.hittable, hit_camera, T(0))));
    }

    // Weight of a merge of both walks at one vertex, both states after arrive there, (13): to_light is the
    // density of the light walk's incoming edge as a camera walk would sample it, to_camera the other way
    // about.
    MIS_HOST_DEVICE constexpr T merge(subpath_state<T> camera, subpath_state<T> light,
                                      pdf_to_light<T> to_light, pdf_to_camera<T> to_camera,
                                      T merge_factor = T(1)) const {
        const T nearer_camera =
            heuristic.join(edge_term(camera), heuristic.raise(to_camera.value) * camera.b);
        const T nearer_light = heuristic.join(edge_term(light), heuristic.raise(to_light.value) * light.b);
        return heuristic.against(merge_term(merge_factor), heuristic.join(nearer_camera, nearer_light));
    }

    // The pieces of the formulas above. Whatever raise returns and whatever is stored is saturated, so that
    // products of two such numbers, and sums of products, may be infinite but never NaN.

    // c A_i. The first edge's count is already in `a`, whose sign is set.
    MIS_HOST_DEVICE constexpr T edge_term(subpath_state<T> x) const {
        return detail::larger(-x.a, raised.connection * x.a);
    }
    // m_i and T_i.
    MIS_HOST_DEVICE constexpr T merge_term(T merge_factor) const {
        return detail::saturate(raised.merge * heuristic.raise(merge_factor));
    }
    MIS_HOST_DEVICE constexpr T total(subpath_state<T> x, T pdf_back, T merge_factor) const {
        const T earlier = heuristic.join(edge_term(x), heuristic.raise(pdf_back) * x.b);
        return detail::saturate(heuristic.join(merge_term(merge_factor), earlier));
    }
    MIS_HOST_DEVICE constexpr T total(const subpath_end<T>& end) const {
        return total(end.state, end.reverse.value, end.merge_factor);
    }
    // The next vertex's A and B but for what arrive knows.
    MIS_HOST_DEVICE constexpr subpath_state<T> leave(T total_here, T cos_out, T forward) const {
        const T inverse = T(1) / forward;
        return {heuristic.raise(inverse), detail::saturate(heuristic.raise(cos_out * inverse) * total_here)};
    }
    MIS_HOST_DEVICE constexpr subpath_state<T> start(const end_point<T>& end, T hit_term, T join_term) const {
        const T inverse = T(1) / end.position.value;
        const T hit =
            detail::select(end.hittable, detail::saturate(hit_term * heuristic.raise(inverse)), T(0));
        const T join = detail::saturate(join_term * heuristic.raise(end.next_event.value * inverse));
        const subpath_state<T> x = leave(hit, end.cos.value, end.direction.value);
        return {-detail::saturate(x.a * join), x.b};
    }
    MIS_HOST_DEVICE constexpr T join_end(const subpath_end<T>& walk, const end_point<T>& end, T join_term,
                                         T hit_term, T distance2, T distance_to_end,
                                         T distance_to_walk) const {
        const T inverse = T(1) / distance2;
        const T chosen = T(1) / end.next_event.value;
        const T walk_from_end = end.direction.value * distance_to_walk * walk.cos.value * inverse;
        const T end_from_walk = walk.forward.value * distance_to_end * end.cos.value * inverse * chosen;
        const T hit = hit_term * heuristic.raise(end_from_walk);
        const T earlier = heuristic.raise(end.position.value * chosen * walk_from_end) * total(walk);
        return heuristic.against(join_term, heuristic.join(earlier, detail::select(end.hittable, hit, T(0))));
    }
    MIS_HOST_DEVICE constexpr T hit(subpath_state<T> x, const end_point<T>& end, T hit_term, T join_term,
                                    T first_edge_term) const {
        const T join = detail::select(x.a < T(0), first_edge_term, join_term);
        const T joined = detail::saturate(join) * detail::absolute(x.a);
        const T earlier =
            detail::saturate(heuristic.raise(end.position.value) * heuristic.raise(end.direction.value)) *
            x.b;
        return detail::select(end.hittable, heuristic.against(hit_term, heuristic.join(joined, earlier)),
                              T(0));
    }
};

namespace detail {

// Walks along a complete path from one end to x_last and returns the state there, after arrive. `step` is +1
// for the camera walk, -1 for the light walk.
template <class Weights, class T>
MIS_HOST_DEVICE subpath_state<T> state_at(const Weights& weigh, subpath_state<T> state,
                                          const measured_vertex<T>* path, int first, int last, int step) {
    const bool from_camera = step > 0;
    for (int i = first;; i += step) {
        const measured_vertex<T>& x = path[i];
        if (i != first) {
            const T cos_out = from_camera ? x.cos_to_light : x.cos_to_camera;
            const T forward = from_camera ? x.pdf_to_light : x.pdf_to_camera;
            const T reverse = from_camera ? x.pdf_to_camera : x.pdf_to_light;
            if (x.kind == vertex_kind::dirac) // densities as recorded: etendue, or plain q for a reflection
                state = {
                    T(0),
                    weigh.leave(detail::saturate(weigh.heuristic.raise(reverse) * state.b), cos_out, forward)
                        .b};
            else
                state = weigh.scatter(state, cosine<T>(cos_out), pdf_forward<T>(forward),
                                      pdf_reverse<T>(reverse), x.merge_factor);
        }
        const measured_vertex<T>& y = path[i + step];
        const auto arrive = [&](T distance2, T cos_in, T forward, T reverse) {
            return weigh.arrive(state, squared_distance<T>(distance2), cosine<T>(cos_in),
                                pdf_distance_forward<T>(forward), pdf_distance_reverse<T>(reverse));
        };
        state = from_camera ? arrive(x.distance2_to_light, y.cos_to_camera, y.pdf_distance_from_camera,
                                     x.pdf_distance_from_light)
                            : arrive(y.distance2_to_light, y.cos_to_light, y.pdf_distance_from_light,
                                     x.pdf_distance_from_camera);
        if (i + step == last)
            return state;
    }
}

} // namespace detail

// The weight of technique t of a complete path as the two-number recursion computes it, by driving it along
// the path from both ends. For tests and debugging: a renderer keeps the states in its walks instead. 0 where
// the path does not allow the technique. The technique must have a positive density.
template <class Heuristic, class T>
MIS_HOST_DEVICE T weight_in_subpaths(const Heuristic& heuristic, const technique_counts<T>& counts,
                                     const measured_vertex<T>* path, int n, technique t) {
    if (!detail::is_possible(path, n, t))
        return T(0);
    const path_weights<Heuristic, T> weigh(heuristic, counts);
    const auto end = [](const measured_vertex<T>& x, T direction, T cos) {
        return end_point<T>{pdf_position<T>(x.pdf_position), pdf_next_event<T>(x.pdf_next_event),
                            pdf_direction<T>(direction), cosine<T>(cos), !x.dirac};
    };
    const end_point<T> camera = end(path[0], path[0].pdf_to_light, path[0].cos_to_light);
    const end_point<T> light = end(path[n - 1], path[n - 1].pdf_to_camera, path[n - 1].cos_to_camera);

    const int s = t.camera_vertices;
    if (t.kind == technique_kind::direct)
        return weigh.direct(camera, light, squared_distance<T>(path[0].distance2_to_light));
    if (t.kind == technique_kind::merge) {
        const auto from_camera = detail::state_at(weigh, weigh.start_camera(camera), path, 0, s - 1, 1);
        const auto from_light = detail::state_at(weigh, weigh.start_light(light), path, n - 1, s - 1, -1);
        return weigh.merge(from_camera, from_light, pdf_to_light<T>(path[s - 1].pdf_to_light),
                           pdf_to_camera<T>(path[s - 1].pdf_to_camera), path[s - 1].merge_factor);
    }
    if (t.kind == technique_kind::light_hit)
        return weigh.light_hit(detail::state_at(weigh, weigh.start_camera(camera), path, 0, n - 1, 1), light);
    if (t.kind == technique_kind::camera_hit)
        return weigh.camera_hit(detail::state_at(weigh, weigh.start_light(light), path, n - 1, 0, -1),
                                camera);

    const auto& x = path[s - 1]; // joined across the edge x, y
    const auto& y = path[s];
    const squared_distance<T> distance2(x.distance2_to_light);
    const pdf_distance_to_light<T> to_light(y.pdf_distance_from_camera);
    const pdf_distance_to_camera<T> to_camera(x.pdf_distance_from_light);
    subpath_end<T> camera_end{{},
                              cosine<T>(x.cos_to_light),
                              pdf_forward<T>(x.pdf_to_light),
                              pdf_reverse<T>(x.pdf_to_camera),
                              x.merge_factor};
    subpath_end<T> light_end{{},
                             cosine<T>(y.cos_to_camera),
                             pdf_forward<T>(y.pdf_to_camera),
                             pdf_reverse<T>(y.pdf_to_light),
                             y.merge_factor};
    if (s > 1)
        camera_end.state = detail::state_at(weigh, weigh.start_camera(camera), path, 0, s - 1, 1);
    if (s < n - 1)
        light_end.state = detail::state_at(weigh, weigh.start_light(light), path, n - 1, s, -1);
    if (t.kind == technique_kind::next_event)
        return weigh.next_event(camera_end, light, distance2, to_light, to_camera);
    if (t.kind == technique_kind::camera_connection)
        return weigh.camera_connection(camera, light_end, distance2, to_light, to_camera);
    return weigh.connection(camera_end, light_end, distance2, to_light, to_camera);
}

} // namespace mis
