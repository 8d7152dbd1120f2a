// SPDX-License-Identifier: MIT
// Floor 3: one weight in O(1), from two numbers per sub-path vertex.
//
// The two walks of a bidirectional renderer carry a subpath_state each, updated by start, arrive and scatter.
// When a path is completed (a light is hit, two ends are joined, two walks merge), its weight follows from
// the states at the two ends and the densities across the last edge. The result is the weight that path.hpp
// computes from the complete path. docs/recursion.md derives it.
//
// What the numbers are, seen from the camera walk (the light walk is its mirror image), with b(q) = q^beta
// and + for the sum, or b(q) = q and the maximum for the sum. Relative to the technique that joins x_{s-1}
// and x_s, all techniques whose edge or merge is nearer to the camera have the share  b(P<-_{s-1}) T_{s-1},
// where
//
//     T_i = eta_i + c A_i + b(omega<-_i) B_i                complete once x_{i+1} is known
//     A_i = 1 / b(P->_i)                                    c: count of the technique that joins x_{i-1} and
//     x_i B_i = b(|cos_{i-1}| / (omega->_{i-1} |cos_i|)) T_{i-1}
//
// and eta_i is the merge term of x_i. At a Dirac vertex eta_i and both its joins are missing.
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
// joined to.
template <class T> struct end_point {
    T pdf_position;   // of the point as its own walk's start: per area, at infinity per solid angle
    T pdf_next_event; // of the point as sampled for the end of the other walk: same unit
    T pdf_direction;  // of the walk's first direction: per solid angle, at infinity per area of the disk
    T cos;            // |cos| of normal and first edge; 1 for a point light and at infinity
    bool hittable;    // false for a pinhole, a point light, a directional light
};

// A sub-path's last vertex, once the edge across to the other sub-path is known.
template <class T> struct subpath_end {
    subpath_state<T> state; // after arrive
    T cos;                  // |cos| of the geometric normal and the edge across; 1 in a medium
    T pdf_across;       // per solid angle, here: of continuing the walk across the edge, roulette included
    T pdf_back;         // per solid angle, here: of going back along the walk, coming over the edge, likewise
    T merge_factor = 1; // of this vertex, see path_vertex
};

// Weights of the paths of one renderer: the heuristic (balance, power, maximum, average; cutoff needs all
// densities at once, see path.hpp) and the counts of the techniques. Make one per pass:
//
//     const mis::path_weights weigh{mis::power, mis::bidirectional(float(pixels))};
//
// The technique `direct` (n = 2) hangs on the state of the walk's first edge, which knows the camera
// connection. It needs camera_connection > 0, with camera_hit on also next_event > 0, and it is weighed right
// where the end point of the walk that hits has one density: pdf_next_event = pdf_position.
//
// Distances are squared, at infinity 1. Densities are per solid angle and include roulette survival. Cosines
// are those of geometric normals; signs are not wanted.
template <class Heuristic, class T> struct path_weights {
    Heuristic heuristic;
    technique_counts<T> counts;
    technique_counts<T> raised; // b(counts)

    MIS_HOST_DEVICE constexpr path_weights(const Heuristic& h, const technique_counts<T>& c)
        : heuristic(h), counts(c), raised(c) {
        assert(c.direct == T(0) ||
               (c.camera_connection > T(0) && (c.camera_hit == T(0) || c.next_event > T(0))));
        raised.light_hit = h.raise(c.light_hit);
        raised.next_event = h.raise(c.next_event);
        raised.connection = h.raise(c.connection);
        raised.camera_connection = h.raise(c.camera_connection);
        raised.direct = h.raise(c.direct);
        raised.camera_hit = h.raise(c.camera_hit);
        raised.merge = h.raise(c.merge);
    }

    // A walk leaves its end point.
    MIS_HOST_DEVICE constexpr subpath_state<T> start_camera(const end_point<T>& camera) const {
        return start(camera, raised.camera_hit, raised.camera_connection);
    }
    MIS_HOST_DEVICE constexpr subpath_state<T> start_light(const end_point<T>& light) const {
        return start(light, raised.light_hit, raised.next_event);
    }

    // The walk reaches a vertex, over `distance2`, at |cos| = cos_in. In media, the densities of the
    // distance: of this walk to this vertex and of the other walk to the previous one (see
    // path_vertex::pdf_distance_*).
    MIS_HOST_DEVICE constexpr subpath_state<T> arrive(subpath_state<T> x, T distance2, T cos_in,
                                                      T pdf_distance_forward = T(1),
                                                      T pdf_distance_reverse = T(1)) const {
        const T inverse = T(1) / (cos_in * pdf_distance_forward);
        const T a = detail::saturate(x.a * heuristic.raise(distance2 * inverse));
        const T b = detail::saturate(x.b * heuristic.raise(pdf_distance_reverse * inverse));
        return {detail::larger(a, -detail::limits<T>::saturation), b};
    }
    // From an infinite light; at an infinite light.
    MIS_HOST_DEVICE constexpr subpath_state<T> arrive_from_infinity(subpath_state<T> x, T cos_in) const {
        return arrive(x, T(1), cos_in);
    }
    MIS_HOST_DEVICE constexpr subpath_state<T> arrive_at_infinity(subpath_state<T> x) const {
        return arrive(x, T(1), T(1));
    }

    // The walk leaves a vertex that can be joined and merged, at |cos| = cos_out: `forward` is the density of
    // the direction just sampled, `reverse` that of the direction back to the previous vertex, were the next
    // one given. merge_factor: see path_vertex.
    MIS_HOST_DEVICE constexpr subpath_state<T> scatter(subpath_state<T> x, T cos_out,
                                                       per_solid_angle<T> forward, per_solid_angle<T> reverse,
                                                       T merge_factor = T(1)) const {
        return leave(total(x, reverse.value, merge_factor), cos_out, forward.value);
    }

    // The walk leaves a Dirac scatterer. cos_in as given to arrive; the probabilities of the lobe, in this
    // walk's direction and in the other's, roulette included; the refractive indices on the side it came from
    // and on the side it leaves to, the same for a reflection. Basic etendue makes up for the squeezed solid
    // angle: omega-> = q-> eta_out^2 |cos_out|, omega<- = q<- eta_in^2 |cos_in|, and |cos_out| cancels.
    MIS_HOST_DEVICE constexpr subpath_state<T> scatter_dirac(subpath_state<T> x, T cos_in, T forward,
                                                             T reverse, T eta_in = T(1),
                                                             T eta_out = T(1)) const {
        const T ratio = reverse * eta_in * eta_in * cos_in / (forward * eta_out * eta_out);
        return {T(0), detail::saturate(x.b * heuristic.raise(ratio))};
    }

    // Weight of joining the ends of both walks. In media, the densities of the distance along the edge,
    // camera walk's and light walk's.
    MIS_HOST_DEVICE constexpr T connection(const subpath_end<T>& camera, const subpath_end<T>& light,
                                           T distance2, T pdf_distance_to_light = T(1),
                                           T pdf_distance_to_camera = T(1)) const {
        const T inverse = T(1) / distance2;
        const T light_from_camera = camera.pdf_across * pdf_distance_to_light * light.cos * inverse;
        const T camera_from_light = light.pdf_across * pdf_distance_to_camera * camera.cos * inverse;
        const T nearer_camera = heuristic.raise(camera_from_light) * total(camera);
        const T nearer_light = heuristic.raise(light_from_camera) * total(light);
        return heuristic.against(raised.connection, heuristic.join(nearer_camera, nearer_light));
    }

    // Weight of joining the camera walk's end to a sampled light point.
    MIS_HOST_DEVICE constexpr T next_event(const subpath_end<T>& camera, const end_point<T>& light,
                                           T distance2, T pdf_distance_to_light = T(1),
                                           T pdf_distance_to_camera = T(1)) const {
        return join_end(camera, light, raised.next_event, raised.light_hit, distance2, pdf_distance_to_light,
                        pdf_distance_to_camera);
    }
    // Weight of joining the light walk's end to the camera.
    MIS_HOST_DEVICE constexpr T camera_connection(const end_point<T>& camera, const subpath_end<T>& light,
                                                  T distance2, T pdf_distance_to_light = T(1),
                                                  T pdf_distance_to_camera = T(1)) const {
        return join_end(light, camera, raised.camera_connection, raised.camera_hit, distance2,
                        pdf_distance_to_camera, pdf_distance_to_light);
    }

    // Weight of the camera walk having arrived at a light.
    MIS_HOST_DEVICE constexpr T light_hit(subpath_state<T> x, const end_point<T>& light) const {
        const T direct = heuristic.raise(light.pdf_position) * raised.direct / raised.camera_connection;
        return hit(x, light, raised.light_hit, heuristic.raise(light.pdf_next_event) * raised.next_event,
                   detail::select(raised.direct > T(0), direct, T(0)));
    }
    // Weight of the light walk having arrived at the lens.
    MIS_HOST_DEVICE constexpr T camera_hit(subpath_state<T> x, const end_point<T>& camera) const {
        const T direct = heuristic.raise(camera.pdf_position) * raised.direct / raised.next_event;
        return hit(x, camera, raised.camera_hit,
                   heuristic.raise(camera.pdf_next_event) * raised.camera_connection,
                   detail::select(raised.direct > T(0), direct, T(0)));
    }

    // Weight of joining the emission point itself to the lens, n = 2.
    MIS_HOST_DEVICE constexpr T direct(const end_point<T>& camera, const end_point<T>& light,
                                       T distance2) const {
        const T light_from_camera = camera.pdf_direction * light.cos / distance2;
        const T camera_from_light = light.pdf_direction * camera.cos / distance2;
        const T hit_light = raised.light_hit * heuristic.raise(light_from_camera / light.pdf_position);
        const T hit_camera = raised.camera_hit * heuristic.raise(camera_from_light / camera.pdf_position);
        return heuristic.against(raised.direct,
                                 heuristic.join(detail::select(light.hittable, hit_light, T(0)),
                                                detail::select(camera.hittable, hit_camera, T(0))));
    }

    // Weight of a merge of both walks at one vertex, both states after arrive there: pdf_to_light is the
    // density of the light walk's incoming edge as a camera walk would sample it, pdf_to_camera the other way
    // about.
    MIS_HOST_DEVICE constexpr T merge(subpath_state<T> camera, subpath_state<T> light,
                                      per_solid_angle<T> pdf_to_light, per_solid_angle<T> pdf_to_camera,
                                      T merge_factor = T(1)) const {
        const T nearer_camera =
            heuristic.join(edge_term(camera), heuristic.raise(pdf_to_camera.value) * camera.b);
        const T nearer_light =
            heuristic.join(edge_term(light), heuristic.raise(pdf_to_light.value) * light.b);
        return heuristic.against(merge_term(merge_factor), heuristic.join(nearer_camera, nearer_light));
    }

    // The pieces of the formulas above. Whatever raise returns and whatever is stored is saturated, so that
    // products of two such numbers, and sums of products, may be infinite but never NaN.

    // c A_i. The first edge's count is already in `a`, whose sign is set.
    MIS_HOST_DEVICE constexpr T edge_term(subpath_state<T> x) const {
        return detail::larger(-x.a, raised.connection * x.a);
    }
    // eta_i and T_i.
    MIS_HOST_DEVICE constexpr T merge_term(T merge_factor) const {
        return detail::saturate(raised.merge * heuristic.raise(merge_factor));
    }
    MIS_HOST_DEVICE constexpr T total(subpath_state<T> x, T pdf_back, T merge_factor) const {
        const T earlier = heuristic.join(edge_term(x), heuristic.raise(pdf_back) * x.b);
        return detail::saturate(heuristic.join(merge_term(merge_factor), earlier));
    }
    MIS_HOST_DEVICE constexpr T total(const subpath_end<T>& end) const {
        return total(end.state, end.pdf_back, end.merge_factor);
    }
    // The next vertex's A and B but for what arrive knows.
    MIS_HOST_DEVICE constexpr subpath_state<T> leave(T total_here, T cos_out, T forward) const {
        const T inverse = T(1) / forward;
        return {heuristic.raise(inverse), detail::saturate(heuristic.raise(cos_out * inverse) * total_here)};
    }
    MIS_HOST_DEVICE constexpr subpath_state<T> start(const end_point<T>& end, T hit_term, T join_term) const {
        const T inverse = T(1) / end.pdf_position;
        const T hit =
            detail::select(end.hittable, detail::saturate(hit_term * heuristic.raise(inverse)), T(0));
        const T join = detail::saturate(join_term * heuristic.raise(end.pdf_next_event * inverse));
        const subpath_state<T> x = leave(hit, end.cos, end.pdf_direction);
        return {-detail::saturate(x.a * join), x.b};
    }
    MIS_HOST_DEVICE constexpr T join_end(const subpath_end<T>& walk, const end_point<T>& end, T join_term,
                                         T hit_term, T distance2, T pdf_distance_to_end,
                                         T pdf_distance_to_walk) const {
        const T inverse = T(1) / distance2;
        const T chosen = T(1) / end.pdf_next_event;
        const T walk_from_end = end.pdf_direction * pdf_distance_to_walk * walk.cos * inverse;
        const T end_from_walk = walk.pdf_across * pdf_distance_to_end * end.cos * inverse * chosen;
        const T hit = hit_term * heuristic.raise(end_from_walk);
        const T earlier = heuristic.raise(end.pdf_position * chosen * walk_from_end) * total(walk);
        return heuristic.against(join_term, heuristic.join(earlier, detail::select(end.hittable, hit, T(0))));
    }
    MIS_HOST_DEVICE constexpr T hit(subpath_state<T> x, const end_point<T>& end, T hit_term, T join_term,
                                    T first_edge_term) const {
        const T join = detail::select(x.a < T(0), first_edge_term, join_term);
        const T joined = detail::saturate(join) * detail::absolute(x.a);
        const T earlier =
            detail::saturate(heuristic.raise(end.pdf_position) * heuristic.raise(end.pdf_direction)) * x.b;
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
                state = weigh.scatter(state, cos_out, per_solid_angle<T>{forward},
                                      per_solid_angle<T>{reverse}, x.merge_factor);
        }
        const measured_vertex<T>& y = path[i + step];
        state = from_camera ? weigh.arrive(state, x.distance2_to_light, y.cos_to_camera,
                                           y.pdf_distance_from_camera, x.pdf_distance_from_light)
                            : weigh.arrive(state, y.distance2_to_light, y.cos_to_light,
                                           y.pdf_distance_from_light, x.pdf_distance_from_camera);
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
    const auto& c = path[0];
    const auto& l = path[n - 1];
    const end_point<T> camera{c.pdf_position, c.pdf_next_event, c.pdf_to_light, c.cos_to_light, !c.dirac};
    const end_point<T> light{l.pdf_position, l.pdf_next_event, l.pdf_to_camera, l.cos_to_camera, !l.dirac};

    const int s = t.camera_vertices;
    if (t.kind == technique_kind::direct)
        return weigh.direct(camera, light, c.distance2_to_light);
    if (t.kind == technique_kind::merge) {
        const auto from_camera = detail::state_at(weigh, weigh.start_camera(camera), path, 0, s - 1, 1);
        const auto from_light = detail::state_at(weigh, weigh.start_light(light), path, n - 1, s - 1, -1);
        return weigh.merge(from_camera, from_light, per_solid_angle<T>{path[s - 1].pdf_to_light},
                           per_solid_angle<T>{path[s - 1].pdf_to_camera}, path[s - 1].merge_factor);
    }
    if (t.kind == technique_kind::light_hit)
        return weigh.light_hit(detail::state_at(weigh, weigh.start_camera(camera), path, 0, n - 1, 1), light);
    if (t.kind == technique_kind::camera_hit)
        return weigh.camera_hit(detail::state_at(weigh, weigh.start_light(light), path, n - 1, 0, -1),
                                camera);

    const auto& x = path[s - 1]; // joined across the edge x, y
    const auto& y = path[s];
    subpath_end<T> camera_end{{}, x.cos_to_light, x.pdf_to_light, x.pdf_to_camera, x.merge_factor};
    subpath_end<T> light_end{{}, y.cos_to_camera, y.pdf_to_camera, y.pdf_to_light, y.merge_factor};
    const T to_light = y.pdf_distance_from_camera;
    const T to_camera = x.pdf_distance_from_light;
    if (s > 1)
        camera_end.state = detail::state_at(weigh, weigh.start_camera(camera), path, 0, s - 1, 1);
    if (s < n - 1)
        light_end.state = detail::state_at(weigh, weigh.start_light(light), path, n - 1, s, -1);
    if (t.kind == technique_kind::next_event)
        return weigh.next_event(camera_end, light, x.distance2_to_light, to_light, to_camera);
    if (t.kind == technique_kind::camera_connection)
        return weigh.camera_connection(camera, light_end, x.distance2_to_light, to_light, to_camera);
    return weigh.connection(camera_end, light_end, x.distance2_to_light, to_light, to_camera);
}

} // namespace mis
