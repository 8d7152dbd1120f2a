// SPDX-License-Identifier: MIT
// Floor 2: which techniques exist for a path of n vertices, and how many samples each takes.
//
// Vertices are numbered from the camera, x_0, to the light, x_{n-1}. A technique is named by what it joins
// and by s, the number of vertices on the camera's side, [V97] 10, [J] 3:
//
//   light_hit          s = n       the camera walk hits the light
//   next_event         s = n - 1   the camera walk's end is joined to a light point sampled for it
//   connection         2 <= s <= n - 2   the ends of both walks are joined
//   camera_connection  s = 1       the light walk's end is joined to the camera (light tracing)
//   direct             s = 1, n = 2   the emission point itself is joined to the camera
//   camera_hit         s = 0       the light walk hits the lens
//   merge              s = j + 1   both walks reach x_j, 1 <= j <= n - 2 (photon mapping)
#pragma once

#include <climits>
#include <cmath>
#include <mis/config.hpp>

namespace mis {

enum class technique_kind : unsigned char {
    camera_hit,
    camera_connection,
    direct,
    connection,
    next_event,
    light_hit,
    merge
};

struct technique {
    technique_kind kind;
    int camera_vertices; // s; a merge counts its vertex, so it is at x_{s-1}
};

MIS_HOST_DEVICE constexpr bool operator==(technique a, technique b) {
    return a.kind == b.kind && a.camera_vertices == b.camera_vertices;
}
MIS_HOST_DEVICE constexpr bool operator!=(technique a, technique b) { return !(a == b); }

// How many techniques can make a path of n >= 2 vertices: s = 0 .. n, and n - 2 merges.
MIS_HOST_DEVICE constexpr int technique_count(int n) { return 2 * n - 1; }

// The technique at a place of the arrays of technique_count(n) densities or weights: places 0 .. n are s, and
// place n + j is the merge at x_j.
MIS_HOST_DEVICE constexpr technique technique_at(int n, int index) {
    const technique_kind kind = index > n        ? technique_kind::merge
                                : index == n     ? technique_kind::light_hit
                                : index == 0     ? technique_kind::camera_hit
                                : n == 2         ? technique_kind::direct
                                : index == 1     ? technique_kind::camera_connection
                                : index == n - 1 ? technique_kind::next_event
                                                 : technique_kind::connection;
    return {kind, index > n ? index - n + 1 : index};
}

// The inverse of technique_at.
MIS_HOST_DEVICE constexpr int technique_index(int n, technique t) {
    return t.kind == technique_kind::merge ? n + t.camera_vertices - 1 : t.camera_vertices;
}

// Effective number of samples of each technique: the n_i of the heuristics. 0 switches a technique off.
//
// Counts are real numbers, because whatever else multiplies a technique's density (a probability of trying
// it, an expected number of splits, the area of a merge) is multiplied in here. Multiplying all counts by one
// positive factor changes no weight.
template <class T> struct technique_counts {
    static_assert(!std::is_integral_v<T>,
                  "mis: counts are real numbers: write mis::bidirectional(float(pixels)), not (pixels)");

    T light_hit = T(0);         // camera walks per pixel, as are next_event's and connection's
    T next_event = T(0);        // light points sampled at each camera vertex
    T connection = T(0);        // light vertices of each depth joined to each camera vertex
    T camera_connection = T(0); // light walks per image, where the camera's densities are per pixel
    T direct = T(0);            // as camera_connection
    T camera_hit = T(0);        // light walks per image, only for a lens of finite size
    T merge = T(0);             // photons times pi r^2, see times_merge_area

    // Longest walks, counted in their own vertices, the walk's end point included: techniques that need a
    // longer one do not exist. Path-length limits need no entry here. Only the O(n) weights honour these
    // caps.
    int max_camera_vertices = INT_MAX;
    int max_light_vertices = INT_MAX;
};

template <class T>
MIS_HOST_DEVICE constexpr T count_of(const technique_counts<T>& counts, technique_kind kind) {
    switch (kind) {
    case technique_kind::camera_hit:
        return counts.camera_hit;
    case technique_kind::camera_connection:
        return counts.camera_connection;
    case technique_kind::direct:
        return counts.direct;
    case technique_kind::connection:
        return counts.connection;
    case technique_kind::next_event:
        return counts.next_event;
    case technique_kind::light_hit:
        return counts.light_hit;
    case technique_kind::merge:
        return counts.merge;
    }
    return T(0);
}

// Whether the caps allow a technique for paths of n vertices. The light point of a next event and the lens
// point of a camera connection are not vertices of a walk.
template <class T>
MIS_HOST_DEVICE constexpr bool is_within_caps(const technique_counts<T>& counts, int n, technique t) {
    const bool merges = t.kind == technique_kind::merge;
    const int camera = t.camera_vertices == 1 && !merges ? 0 : t.camera_vertices;
    const int light = t.kind == technique_kind::next_event ? 0 : n - t.camera_vertices + (merges ? 1 : 0);
    return camera <= counts.max_camera_vertices && light <= counts.max_light_vertices;
}

// The count of a technique for paths of n vertices, 0 where a cap forbids one of its walks.
template <class T>
MIS_HOST_DEVICE constexpr T count_of(const technique_counts<T>& counts, int n, technique t) {
    return is_within_caps(counts, n, t) ? count_of(counts, t.kind) : T(0);
}

// Every count times a factor; the caps stay.
template <class T>
MIS_HOST_DEVICE constexpr technique_counts<T> scaled(technique_counts<T> counts, T factor) {
    counts.light_hit *= factor;
    counts.next_event *= factor;
    counts.connection *= factor;
    counts.camera_connection *= factor;
    counts.direct *= factor;
    counts.camera_hit *= factor;
    counts.merge *= factor;
    return counts;
}

// The same counts, up to a common factor, for a scene of this size (a typical distance between vertices, in
// the scene's units). The recursion's state is the counts times squared lengths, raised to beta: with these
// counts it is about 1 whether a scene is measured in micrometres or in light years. The factor is a power of
// two, so that no weight changes by a bit where none over- or underflows. `size` positive and finite.
template <class T>
MIS_HOST_DEVICE technique_counts<T> for_scene_of_size(const technique_counts<T>& counts,
                                                      detail::identity_t<T> size) {
    using std::frexp;
    using std::ldexp;
    assert(size > T(0) && !detail::is_infinite(size));
    int exponent = 0;
    (void)frexp(size, &exponent);
    return scaled(counts, static_cast<T>(ldexp(T(1), -2 * exponent)));
}

// Merging, in the two ways it has been derived; the relative densities, and so all weights, are the same.
// `merge` is the number of light walks that a camera vertex may merge with, [H] 3.2.5.

// pi r^2, the area of the query disk.
template <class T> MIS_HOST_DEVICE constexpr T merge_area(T radius) {
    return T(detail::scalar_t<T>(3.14159265358979323846264338327950288L)) * radius * radius;
}

// [G]: a merge is a connection whose last light vertex may lie anywhere in the disk; its density times pi
// r^2.
template <class T>
MIS_HOST_DEVICE constexpr technique_counts<T> times_merge_area(technique_counts<T> counts, T radius) {
    counts.merge *= merge_area(radius);
    return counts;
}

// [H] 6, 7: everything else is a merge path whose extra vertex is uniform in the disk; its density over pi
// r^2.
template <class T>
MIS_HOST_DEVICE constexpr technique_counts<T> divided_by_merge_area(technique_counts<T> counts, T radius) {
    const T merge = counts.merge;
    counts = scaled(counts, T(1) / merge_area(radius));
    counts.merge = merge;
    return counts;
}

// One random connection instead of all: of the vertices of light walks with `mean_vertices` joinable vertices
// on average, each camera vertex is joined to one picked uniformly. A light vertex is then picked with the
// probability 1 / mean_vertices, [J] 4.
template <class T>
MIS_HOST_DEVICE constexpr technique_counts<T> random_connection(technique_counts<T> counts, T mean_vertices) {
    counts.connection /= mean_vertices;
    return counts;
}

// The well-known algorithms are sets of counts, [H] 4.4, in the scalar of their arguments; path_tracing(),
// which has none, in float. Light walks are counted per image, with densities of
// the camera's directions per pixel and one camera walk per pixel; any other ratio may be set afterwards.
template <class T = float> MIS_HOST_DEVICE constexpr technique_counts<T> path_tracing() {
    technique_counts<T> counts;
    counts.light_hit = T(1);
    return counts;
}

// Path tracing that also samples lights at every vertex.
template <class T = float>
MIS_HOST_DEVICE constexpr technique_counts<T> path_tracing_next_event(T light_samples = T(1)) {
    technique_counts<T> counts;
    counts.light_hit = T(1);
    counts.next_event = light_samples;
    return counts;
}

template <class T> MIS_HOST_DEVICE constexpr technique_counts<T> light_tracing(T light_walks) {
    technique_counts<T> counts;
    counts.camera_connection = light_walks;
    counts.direct = light_walks;
    return counts;
}

// Each pixel's camera walk is joined to the vertices of one light walk; `direct` is off, as in most
// renderers.
template <class T> MIS_HOST_DEVICE constexpr technique_counts<T> bidirectional(T light_walks) {
    technique_counts<T> counts;
    counts.light_hit = T(1);
    counts.next_event = T(1);
    counts.connection = T(1);
    counts.camera_connection = light_walks;
    return counts;
}

// Merges at every vertex, and light hits.
template <class T>
MIS_HOST_DEVICE constexpr technique_counts<T> photon_mapping(T light_walks, detail::identity_t<T> radius) {
    technique_counts<T> counts;
    counts.light_hit = T(1);
    counts.merge = light_walks;
    return times_merge_area(counts, radius);
}

// Vertex connection and merging [G], unified path sampling [H].
template <class T>
MIS_HOST_DEVICE constexpr technique_counts<T> connection_and_merging(T light_walks,
                                                                     detail::identity_t<T> radius) {
    technique_counts<T> counts = bidirectional(light_walks);
    counts.merge = light_walks;
    return times_merge_area(counts, radius);
}

} // namespace mis
