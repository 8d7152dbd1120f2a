// SPDX-License-Identifier: MIT
// Floor 3: complete paths. Every technique's density and weight of one path, in O(n), for any length.
//
// Three records describe a path vertex, from what a tracer has at hand to what the weights need:
//   path_vertex<Vec>    positions, normals and densities per solid angle;
//   measured_vertex<T>  the same with cosines and squared distances in place of vectors;
//   area_vertex<T>      densities per area.
// Every function here takes an array of any of them, from camera to light: x_0 ... x_{n-1}, n >= 2.
//
// "From camera" and "to light" are the camera walk's direction (P->, omega->), "from light" and "to camera"
// the light walk's (P<-, omega<-).
#pragma once

#include <cmath>
#include <mis/config.hpp>
#include <mis/heuristic.hpp>
#include <mis/techniques.hpp>
#include <utility>

namespace mis {

// What a vertex is. A `dirac` vertex scatters by a Dirac distribution (mirror, glass) and cannot be joined or
// merged.
enum class vertex_kind : unsigned char { camera, surface, dirac, medium, light, infinite_light };

namespace detail {

template <class Vec, class = void> struct has_dot_member : std::false_type {};
template <class Vec>
struct has_dot_member<Vec, std::void_t<decltype(std::declval<const Vec&>().dot(std::declval<const Vec&>()))>>
    : std::true_type {};

// a.dot(b) where there is one (Eigen), else dot(a, b) found by argument-dependent lookup (GLM, a renderer's
// own).
template <class Vec> MIS_HOST_DEVICE constexpr auto inner(const Vec& a, const Vec& b) {
    if constexpr (has_dot_member<Vec>::value)
        return a.dot(b);
    else
        return dot(a, b);
}

template <class Vec>
using scalar_of_t = std::decay_t<decltype(inner(std::declval<Vec>(), std::declval<Vec>()))>;

} // namespace detail

// A vertex with its position. Vec is any vector type with a - b and a dot product.
template <class Vec, class T = detail::scalar_of_t<Vec>> struct path_vertex {
    using scalar = T;

    vertex_kind kind = vertex_kind::surface;
    bool dirac = false; // end points only: no walk can hit it (pinhole; point or directional light)
    Vec position{};     // unused for an infinite light
    Vec normal{}; // geometric, of unit length, sign ignored; infinite light: unit direction towards the light

    // Per solid angle, roulette survival at this vertex included: omega-> and omega<-. For kind dirac see
    // dirac_density in measure.hpp. pdf_to_camera of an infinite light is per area of the perpendicular disk.
    T pdf_to_light = 0;
    T pdf_to_camera = 0;

    // End points only, per area; an infinite light's per solid angle. Light selection included.
    T pdf_position = 0;   // of the point as its own walk's start
    T pdf_next_event = 0; // of the point as sampled for the end of the other walk

    // In a medium: per length, of the distance travelled to this vertex. Behind one: probability of reaching
    // it.
    T pdf_distance_from_camera = 1;
    T pdf_distance_from_light = 1;

    // Merges at this vertex over counts.merge: 1 on surfaces, 0 where the renderer does not merge; in a
    // medium the quotient of the kernels' sizes.
    T merge_factor = 1;
};

// A vertex whose geometry the renderer has measured. Positions rounded to float cannot give short edges and
// grazing cosines back; the numbers that the renderer itself used can.
template <class T> struct measured_vertex {
    using scalar = T;

    vertex_kind kind = vertex_kind::surface;
    bool dirac = false;
    T pdf_to_light = 0;
    T pdf_to_camera = 0;
    T pdf_position = 0;
    T pdf_next_event = 0;
    T pdf_distance_from_camera = 1;
    T pdf_distance_from_light = 1;
    // |cos| between the geometric normal and the edges to x_{i-1} and x_{i+1}, and the squared length of the
    // latter. All are 1 at infinity; in a medium the cosines are.
    T cos_to_camera = 1;
    T cos_to_light = 1;
    T distance2_to_light = 1;
    T merge_factor = 1;
};

// A vertex with its densities per area (per solid angle at infinity, per volume in media): P-> and P<-. At
// the camera, density_from_camera is that of the walk's start; at the light, density_from_light.
template <class T> struct area_vertex {
    using scalar = T;

    vertex_kind kind = vertex_kind::surface;
    bool dirac = false;
    T density_from_camera = 0;
    T density_from_light = 0;
    T next_event = 0; // end points only: pdf_next_event of the other records
    T merge_factor = 1;
};

namespace detail {

template <class Vec, class T>
MIS_HOST_DEVICE constexpr T edge_squared(const path_vertex<Vec, T>& a, const path_vertex<Vec, T>& b) {
    if (a.kind == vertex_kind::infinite_light || b.kind == vertex_kind::infinite_light)
        return T(1);
    const Vec edge = b.position - a.position;
    return inner(edge, edge);
}

template <class Vec, class T>
MIS_HOST_DEVICE T cosine_towards(const path_vertex<Vec, T>& from, const path_vertex<Vec, T>& to) {
    using std::sqrt;
    if (from.kind == vertex_kind::medium || from.kind == vertex_kind::infinite_light)
        return T(1);
    if (to.kind == vertex_kind::infinite_light)
        return absolute(inner(from.normal, to.normal));
    const Vec edge = to.position - from.position;
    const T distance2 = inner(edge, edge);
    return distance2 > T(0) ? absolute(inner(from.normal, edge)) / sqrt(distance2) : T(0);
}

} // namespace detail

// Vertex i of a path with its cosines and distance measured from positions and normals.
template <class Vec, class T>
MIS_HOST_DEVICE measured_vertex<T> measure(const path_vertex<Vec, T>* path, int n, int i) {
    const auto& x = path[i];
    measured_vertex<T> m;
    m.kind = x.kind;
    m.dirac = x.dirac;
    m.pdf_to_light = x.pdf_to_light;
    m.pdf_to_camera = x.pdf_to_camera;
    m.pdf_position = x.pdf_position;
    m.pdf_next_event = x.pdf_next_event;
    m.pdf_distance_from_camera = x.pdf_distance_from_camera;
    m.pdf_distance_from_light = x.pdf_distance_from_light;
    m.merge_factor = x.merge_factor;
    if (i > 0)
        m.cos_to_camera = detail::cosine_towards(x, path[i - 1]);
    if (i < n - 1) {
        m.cos_to_light = detail::cosine_towards(x, path[i + 1]);
        m.distance2_to_light = detail::edge_squared(x, path[i + 1]);
    }
    return m;
}
template <class T>
MIS_HOST_DEVICE constexpr measured_vertex<T> measure(const measured_vertex<T>* path, int, int i) {
    return path[i];
}

namespace detail {

// A product of very many factors, each of any size: mantissa 2^exponent 0^zeros inf^infinities. Zeros and
// infinities are counted, so that a factor can be taken out again.
template <class T> struct scaled_product {
    T mantissa = 1; // within moderate sizes, so that two may be multiplied or divided
    int exponent = 0;
    int zeros = 0;
    int infinities = 0;
};

template <class T> MIS_HOST_DEVICE constexpr bool is_moderate(T a) {
    return a > T(0x1p-256) && a < T(0x1p256);
}

// Brings the mantissa into [1/2, 1).
template <class T> MIS_HOST_DEVICE void normalize(scaled_product<T>& p) {
    using std::frexp;
    int shift = 0;
    p.mantissa = frexp(p.mantissa, &shift);
    p.exponent += shift;
}

// A single factor. Zero and infinity are counted, anything else is a mantissa and an exponent.
template <class T, class F> MIS_HOST_DEVICE scaled_product<T> scaled_factor(F factor) {
    assert_density(factor);
    scaled_product<T> p;
    if (!(factor > F(0))) {
        p.zeros = 1;
    } else if (is_infinite(factor)) {
        p.infinities = 1;
    } else {
        p.mantissa = static_cast<T>(factor);
        if (!is_moderate(p.mantissa))
            normalize(p);
    }
    return p;
}

template <class T>
MIS_HOST_DEVICE scaled_product<T> operator*(scaled_product<T> p, const scaled_product<T>& q) {
    p.mantissa *= q.mantissa;
    p.exponent += q.exponent;
    p.zeros += q.zeros;
    p.infinities += q.infinities;
    if (!is_moderate(p.mantissa))
        normalize(p);
    return p;
}

// p / q where q is a factor of p: its zeros and infinities are taken out again.
template <class T>
MIS_HOST_DEVICE scaled_product<T> without(scaled_product<T> p, const scaled_product<T>& q) {
    p.mantissa /= q.mantissa;
    p.exponent -= q.exponent;
    p.zeros -= q.zeros;
    p.infinities -= q.infinities;
    if (!is_moderate(p.mantissa))
        normalize(p);
    return p;
}

// p / q of any two: 1 / 0 is infinite, 1 / infinity is 0.
template <class T>
MIS_HOST_DEVICE scaled_product<T> operator/(const scaled_product<T>& p, scaled_product<T> q) {
    const int zeros = q.zeros;
    q.zeros = -q.infinities;
    q.infinities = -zeros;
    return without(p, q);
}

template <class T> MIS_HOST_DEVICE bool is_less(scaled_product<T> a, scaled_product<T> b) {
    if (a.zeros > 0 || b.zeros > 0)
        return b.zeros == 0;
    if (a.infinities > 0 || b.infinities > 0)
        return a.infinities == 0;
    if (a.exponent != b.exponent) {
        normalize(a);
        normalize(b);
    }
    return a.exponent < b.exponent || (a.exponent == b.exponent && a.mantissa < b.mantissa);
}

// value / largest in [0, 1]. A positive value stays positive. If the largest is infinite, 1 for the infinite
// ones.
template <class Result, class T>
MIS_HOST_DEVICE Result relative_to(const scaled_product<T>& largest, const scaled_product<T>& value) {
    using std::ldexp;
    if (value.zeros > 0)
        return Result(0);
    if (largest.infinities > 0)
        return value.infinities > 0 ? Result(1) : Result(0);
    T ratio = value.mantissa / largest.mantissa;
    if (value.exponent != largest.exponent)
        ratio = ldexp(ratio, value.exponent - largest.exponent);
    return larger(static_cast<Result>(ratio), Result(limits<Result>::least_positive));
}

// P->_i and P<-_i, [J] 2: the sampling density at the neighbour, converted to area at x_i.
template <class T> using path_product = scaled_product<wide_t<T>>;

template <class T> MIS_HOST_DEVICE path_product<T> factor(T value) { return scaled_factor<wide_t<T>>(value); }

template <class Vertex>
MIS_HOST_DEVICE path_product<typename Vertex::scalar> density_from_camera(const Vertex* path, int n, int i) {
    const auto x = measure(path, n, i);
    if (i == 0)
        return factor(x.pdf_position);
    const auto previous = measure(path, n, i - 1);
    return factor(previous.pdf_to_light) * factor(x.cos_to_camera) * factor(x.pdf_distance_from_camera) /
           factor(previous.distance2_to_light);
}
template <class Vertex>
MIS_HOST_DEVICE path_product<typename Vertex::scalar> density_from_light(const Vertex* path, int n, int i) {
    const auto x = measure(path, n, i);
    if (i == n - 1)
        return factor(x.pdf_position);
    return factor(measure(path, n, i + 1).pdf_to_camera) * factor(x.cos_to_light) *
           factor(x.pdf_distance_from_light) / factor(x.distance2_to_light);
}
template <class Vertex>
MIS_HOST_DEVICE path_product<typename Vertex::scalar> next_event_density(const Vertex* path, int i) {
    return factor(path[i].pdf_next_event);
}

template <class T>
MIS_HOST_DEVICE path_product<T> density_from_camera(const area_vertex<T>* path, int, int i) {
    return factor(path[i].density_from_camera);
}
template <class T>
MIS_HOST_DEVICE path_product<T> density_from_light(const area_vertex<T>* path, int, int i) {
    return factor(path[i].density_from_light);
}
template <class T> MIS_HOST_DEVICE path_product<T> next_event_density(const area_vertex<T>* path, int i) {
    return factor(path[i].next_event);
}

// Whether the path itself allows the technique: no joined or merged vertex scatters by a Dirac distribution,
// and no walk hits an end point that cannot be hit.
template <class Vertex> MIS_HOST_DEVICE constexpr bool is_possible(const Vertex* path, int n, technique t) {
    const int s = t.camera_vertices;
    switch (t.kind) {
    case technique_kind::camera_hit:
        return !path[0].dirac;
    case technique_kind::light_hit:
        return !path[n - 1].dirac;
    case technique_kind::merge:
        return path[s - 1].kind != vertex_kind::dirac;
    default:
        return path[s - 1].kind != vertex_kind::dirac && path[s].kind != vertex_kind::dirac;
    }
}

// Effective density of the technique at `index`, given the product of P->_i for i < s and P<-_i for i >= s.
template <class T, class Vertex>
MIS_HOST_DEVICE path_product<T> effective_density(const technique_counts<T>& counts, const Vertex* path,
                                                  int n, int index, path_product<T> joined) {
    const technique t = technique_at(n, index);
    if (t.kind == technique_kind::camera_connection)
        joined = without(joined, density_from_camera(path, n, 0)) * next_event_density(path, 0);
    if (t.kind == technique_kind::next_event)
        joined = without(joined, density_from_light(path, n, n - 1)) * next_event_density(path, n - 1);
    if (t.kind == technique_kind::merge)
        joined = joined * factor(path[t.camera_vertices - 1].merge_factor);
    return joined * factor(is_possible(path, n, t) ? count_of(counts, n, t) : T(0));
}

// Calls visit(index, effective density) for every technique of the path. From s to s + 1 the camera walk
// takes x_s over from the light walk: p(C_{s+1}) / p(C_s) = P->_s / P<-_s, [J] 4. At a merge both walks make
// the vertex.
template <class T, class Vertex, class Visit>
MIS_HOST_DEVICE void for_each_density(const technique_counts<T>& counts, const Vertex* path, int n,
                                      Visit&& visit) {
    path_product<T> joined;
    for (int i = 0; i < n; ++i)
        joined = joined * density_from_light(path, n, i);
    for (int s = 0; s <= n; ++s) {
        visit(s, effective_density(counts, path, n, s, joined));
        if (s == n)
            break;
        const path_product<T> with_both = joined * density_from_camera(path, n, s);
        if (s >= 1 && s <= n - 2)
            visit(n + s, effective_density(counts, path, n, n + s, with_both));
        joined = without(with_both, density_from_light(path, n, s));
    }
}

template <class T> struct largest_density {
    path_product<T>* largest;
    MIS_HOST_DEVICE void operator()(int, const path_product<T>& q) const {
        if (is_less(*largest, q))
            *largest = q;
    }
};
template <class T> struct store_relative {
    path_product<T> largest;
    T* out;
    MIS_HOST_DEVICE void operator()(int index, const path_product<T>& q) const {
        out[index] = relative_to<T>(largest, q);
    }
};

} // namespace detail

// P->_i, P<-_i and the end points' next-event density as numbers of T, which may over- or underflow where the
// path's densities are extreme. Nothing below needs them: they are here to be looked at, stored and dumped.
template <class Vertex>
MIS_HOST_DEVICE area_vertex<typename Vertex::scalar> area_densities(const Vertex* path, int n, int i) {
    using T = typename Vertex::scalar;
    using std::ldexp;
    area_vertex<T> a;
    a.kind = path[i].kind;
    a.dirac = path[i].dirac;
    a.merge_factor = path[i].merge_factor;
    const auto number = [](const detail::path_product<T>& p) {
        if (p.zeros > 0)
            return T(0);
        return p.infinities > 0 ? T(detail::limits<T>::infinity)
                                : static_cast<T>(ldexp(p.mantissa, p.exponent));
    };
    a.density_from_camera = number(detail::density_from_camera(path, n, i));
    a.density_from_light = number(detail::density_from_light(path, n, i));
    if (i == 0 || i == n - 1)
        a.next_event = number(detail::next_event_density(path, i));
    return a;
}

// Effective densities of all technique_count(n) techniques of a path of n >= 2 vertices (places: see
// technique_at in techniques.hpp), divided by the largest one, whatever the sizes of the densities and the
// length of the path.
//   - 0: impossible (a Dirac vertex, a zero density, a switched-off technique), and 0 times infinity;
//   - positive densities stay positive, if only as the smallest number there is;
//   - if some are infinite, those are 1 and the others 0.
// To bring in a multiplier of your own (a throughput, a correlation factor), multiply it into out[k] and call
// weights(heuristic, out, technique_count(n), out).
template <class T, class Vertex>
MIS_HOST_DEVICE void relative_densities(const technique_counts<T>& counts, const Vertex* path, int n,
                                        T* out) {
    assert(n >= 2);
    detail::path_product<T> largest;
    largest.zeros = 1;
    detail::for_each_density(counts, path, n, detail::largest_density<T>{&largest});
    detail::for_each_density(counts, path, n, detail::store_relative<T>{largest, out});
}

// Weights of all technique_count(n) techniques of a path: they sum to 1 unless no technique can make the
// path.
template <class Heuristic, class T, class Vertex>
MIS_HOST_DEVICE void weights(const Heuristic& heuristic, const technique_counts<T>& counts,
                             const Vertex* path, int n, T* out) {
    relative_densities(counts, path, n, out);
    weights(heuristic, out, technique_count(n), out);
}

namespace detail {

template <class T, class Heuristic> struct total_share {
    const Heuristic* heuristic;
    path_product<T> largest;
    wide_t<T>* total;
    int wanted;
    wide_t<T>* share_of_wanted;
    MIS_HOST_DEVICE void operator()(int index, const path_product<T>& q) const {
        const wide_t<T> share = heuristic->share(relative_to<wide_t<T>>(largest, q), wide_t<T>(1));
        *total += share;
        if (index == wanted)
            *share_of_wanted = share;
    }
};

} // namespace detail

// Weight of one technique of a path, without an array for the others.
template <class Heuristic, class T, class Vertex>
MIS_HOST_DEVICE T weight(const Heuristic& heuristic, const technique_counts<T>& counts, const Vertex* path,
                         int n, technique t) {
    using W = detail::wide_t<T>;
    assert(n >= 2);
    detail::path_product<T> largest;
    largest.zeros = 1;
    detail::for_each_density(counts, path, n, detail::largest_density<T>{&largest});
    W total = 0, share = 0;
    const detail::total_share<T, Heuristic> sum{&heuristic, largest, &total, technique_index(n, t), &share};
    detail::for_each_density(counts, path, n, sum);
    return largest.zeros > 0 ? T(0) : static_cast<T>(share / total);
}

} // namespace mis
