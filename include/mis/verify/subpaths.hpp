// SPDX-License-Identifier: MIT
// Floor 5: the two-number recursion driven along a complete path.
//
// What a renderer's walks keep while they go is made anew from the record of path.hpp, so that the weights of
// both can be compared. Also in kernels.
#pragma once

#include <mis/path.hpp>
#include <mis/subpath.hpp>

namespace mis {

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
                state = {T(0), weigh.leave(weigh.heuristic.times(state.b, reverse), cos_out, forward).b};
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
// the path from both ends; a renderer keeps the states in its walks instead. 0 where the path does not allow
// the technique. The technique must have a positive density.
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
        return weigh.direct(camera, light, squared_distance<T>(path[0].distance2_to_light),
                            pdf_distance_to_light<T>(path[1].pdf_distance_from_camera),
                            pdf_distance_to_camera<T>(path[0].pdf_distance_from_light));
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
