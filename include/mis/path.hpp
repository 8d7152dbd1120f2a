// SPDX-License-Identifier: MIT
// Floor 3: complete paths. Every technique's density and weight of one path, in O(n), for any length.
//
// Three records describe a path vertex, from what a tracer has at hand to what the weights need:
//   path_vertex<Vec>    positions, normals and densities per solid angle;
//   measured_vertex<T>  the same with cosines and squared distances in place of vectors;
//   area_vertex<T>      densities per area.
// Every function here takes an array of any of them, from camera to light: x_0 ... x_{n-1}, 2 <= n <= 10,000.
// Relative densities and weights are within 4 beta n ulp of T, whatever the sizes of the densities; in
// kernels floats are multiplied as floats.
//
// "From camera" and "to light" are the camera walk's direction (P->, omega->), "from light" and "to camera"
// the light walk's (P<-, omega<-).
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
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
using scalar_of_t = std::decay_t<decltype(detail::inner(std::declval<Vec>(), std::declval<Vec>()))>;

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
    return detail::inner(edge, edge);
}

template <class Vec, class T>
MIS_HOST_DEVICE T cosine_towards(const path_vertex<Vec, T>& from, const path_vertex<Vec, T>& to) {
    using std::sqrt;
    if (from.kind == vertex_kind::medium || from.kind == vertex_kind::infinite_light)
        return T(1);
    if (to.kind == vertex_kind::infinite_light)
        return absolute(detail::inner(from.normal, to.normal));
    const Vec edge = to.position - from.position;
    const T distance2 = detail::inner(edge, edge);
    return distance2 > T(0) ? absolute(detail::inner(from.normal, edge)) / sqrt(distance2) : T(0);
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

// A product of very many factors, each of any size: mantissa 2^exponent. A factor 0 is 2^zero_exponent, an
// infinite one 2^infinite_exponent. As exponents add, zeros and infinities are counted, so that they can be
// taken out again; as they are so far apart, a product with a zero is less than any without, and one with
// infinities greater. There is room for those of paths of up to longest_path vertices.
constexpr int longest_path = 10000;
constexpr long long zero_exponent = -(1LL << 48), infinite_exponent = 1LL << 32;

template <class T> struct scaled_product {
    T mantissa = 1; // moderate
    long long exponent = 0;
};
template <class T> MIS_HOST_DEVICE constexpr bool is_zero(const scaled_product<T>& p) {
    return p.exponent < zero_exponent / 2;
}
template <class T> MIS_HOST_DEVICE constexpr bool is_infinite(const scaled_product<T>& p) {
    return p.exponent > infinite_exponent / 2;
}

// Whether a is within 2^-e and 2^e, e an eighth of the largest exponent (of double: 128): no product or
// quotient of up to seven such numbers over- or underflows, in whatever order. Floats and doubles are told by
// their bits, so that 0, infinity and NaN are never moderate, whatever -ffast-math assumes of comparisons.
template <class T> constexpr int moderate_exponent = std::numeric_limits<T>::max_exponent / 8;
template <class T> MIS_HOST_DEVICE inline bool is_moderate(T a) {
    using std::ldexp;
    constexpr int e = moderate_exponent<T>;
    if constexpr (has_bits<T> && std::numeric_limits<T>::is_iec559) {
        constexpr int mantissa_bits = std::numeric_limits<T>::digits - 1;
        constexpr int bias = std::numeric_limits<T>::max_exponent - 1;
        bits_t<T> bits = 0;
        std::memcpy(&bits, &a, sizeof a);
        return bits - (bits_t<T>(bias - e) << mantissa_bits) < bits_t<T>(2 * e) << mantissa_bits;
    } else {
        return a > ldexp(T(1), -e) && a < ldexp(T(1), e);
    }
}

// mantissa 2^exponent, with a moderate mantissa.
template <class T> MIS_HOST_DEVICE inline scaled_product<T> rescaled(T mantissa, long long exponent) {
    using std::frexp;
    int shift = 0;
    if (!is_moderate(mantissa))
        mantissa = frexp(mantissa, &shift);
    return {mantissa, exponent + shift};
}

template <class T, class F> MIS_HOST_DEVICE scaled_product<T> scaled_factor(F factor) {
    assert_density(factor);
    if (!(factor > F(0)))
        return {1, zero_exponent};
    return is_infinite(factor) ? scaled_product<T>{1, infinite_exponent}
                               : rescaled(static_cast<T>(factor), 0);
}

template <class T>
MIS_HOST_DEVICE inline scaled_product<T> operator*(scaled_product<T> p, scaled_product<T> q) {
    return rescaled(p.mantissa * q.mantissa, p.exponent + q.exponent);
}
// p / q where q is a factor of p: its zeros and infinities are taken out again.
template <class T>
MIS_HOST_DEVICE inline scaled_product<T> without(scaled_product<T> p, scaled_product<T> q) {
    return rescaled(p.mantissa / q.mantissa, p.exponent - q.exponent);
}

template <class T> MIS_HOST_DEVICE inline bool is_less(scaled_product<T> a, scaled_product<T> b) {
    using std::ldexp;
    const long long apart = b.exponent - a.exponent;
    if (apart == 0)
        return a.mantissa < b.mantissa;
    return absolute(apart) < 2 * moderate_exponent<T>
               ? a.mantissa < ldexp(b.mantissa, static_cast<int>(apart))
               : apart > 0;
}

// A positive number that has been rounded to 0 becomes the smallest number; the smallest normal one where the
// processor takes others for 0.
template <class T> MIS_HOST_DEVICE inline T keep_positive(T a) {
    a = larger(a, T(limits<T>::least_positive));
    return a > T(0) ? a : T(limits<T>::least_normal);
}

// value / largest in [0, 1]. A positive value stays positive. If the largest is infinite, 1 for the infinite
// ones.
template <class T> MIS_HOST_DEVICE inline T relative_to(scaled_product<T> largest, scaled_product<T> value) {
    using std::ldexp;
    const T ratio = value.mantissa / largest.mantissa;
    const long long apart = value.exponent - largest.exponent;
    if (is_infinite(largest))
        return is_infinite(value) ? T(1) : T(0);
    if (apart == 0)
        return value.mantissa < largest.mantissa ? ratio : T(1); // however the quotient is rounded
    return is_zero(value) ? T(0) : keep_positive(ldexp(ratio, static_cast<int>(apart)));
}

template <class T> using path_product = scaled_product<weighing_t<T>>;

// A density by its factors: a b c / below.
template <class T> struct path_density { T a, b = 1, c = 1, below = 1; };

template <class T> MIS_HOST_DEVICE path_product<T> product(path_density<T> p) {
    using W = weighing_t<T>;
    scaled_product<W> below = scaled_factor<W>(p.below);
    if (is_zero(below)) // 1 / 0 is infinite, 1 / infinity is 0
        below.exponent = -infinite_exponent;
    else if (is_infinite(below))
        below.exponent = -zero_exponent;
    const auto q = without(scaled_factor<W>(p.a) * scaled_factor<W>(p.b) * scaled_factor<W>(p.c), below);
    return {q.mantissa, is_zero(q) ? zero_exponent : is_infinite(q) ? infinite_exponent : q.exponent};
}

// The same as a plain number if it surely is one, else as anything that is not moderate.
template <class T> MIS_HOST_DEVICE inline weighing_t<T> plain_product(path_density<T> p) {
    using W = weighing_t<T>;
    assert_density(p.a);
    assert_density(p.b);
    assert_density(p.c);
    assert_density(p.below);
    const W front = W(p.a) * W(p.b), back = W(p.c) / W(p.below);
    if constexpr (!std::is_same_v<T, W>)
        return front * back; // in double, where those of floats have room
    else
        return is_moderate(front) && is_moderate(back) ? front * back : W(0);
}

template <class T> MIS_HOST_DEVICE inline path_product<T> operator*(path_product<T> p, path_density<T> q) {
    const weighing_t<T> mantissa = p.mantissa * plain_product(q);
    return is_moderate(mantissa) ? path_product<T>{mantissa, p.exponent} : p * product(q);
}
// Adds the exponent that it takes out to `taken`.
template <class T>
MIS_HOST_DEVICE inline path_product<T> without(path_product<T> p, path_density<T> q, long long& taken) {
    const weighing_t<T> mantissa = p.mantissa / plain_product(q);
    if (is_moderate(mantissa))
        return {mantissa, p.exponent};
    const path_product<T> any_size = product(q);
    taken += any_size.exponent;
    return without(p, any_size);
}

// P->_i and P<-_i, [J] 2: the sampling density at the neighbour, converted to area at x_i.
template <class Vertex> MIS_HOST_DEVICE inline auto density_from_camera(const Vertex* path, int n, int i) {
    using result = path_density<typename Vertex::scalar>;
    const auto x = mis::measure(path, n, i);
    if (i == 0)
        return result{x.pdf_position};
    const auto previous = mis::measure(path, n, i - 1);
    return result{previous.pdf_to_light, x.cos_to_camera, x.pdf_distance_from_camera,
                  previous.distance2_to_light};
}
template <class Vertex> MIS_HOST_DEVICE inline auto density_from_light(const Vertex* path, int n, int i) {
    using result = path_density<typename Vertex::scalar>;
    const auto x = mis::measure(path, n, i);
    if (i == n - 1)
        return result{x.pdf_position};
    return result{mis::measure(path, n, i + 1).pdf_to_camera, x.cos_to_light, x.pdf_distance_from_light,
                  x.distance2_to_light};
}
template <class Vertex> MIS_HOST_DEVICE inline auto next_event_density(const Vertex* path, int i) {
    return path_density<typename Vertex::scalar>{path[i].pdf_next_event};
}

template <class T>
MIS_HOST_DEVICE inline path_density<T> density_from_camera(const area_vertex<T>* path, int, int i) {
    return {path[i].density_from_camera};
}
template <class T>
MIS_HOST_DEVICE inline path_density<T> density_from_light(const area_vertex<T>* path, int, int i) {
    return {path[i].density_from_light};
}
template <class T>
MIS_HOST_DEVICE inline path_density<T> next_event_density(const area_vertex<T>* path, int i) {
    return {path[i].next_event};
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

// Effective density of a technique, given the product of its walks' densities.
template <technique_kind kind, class T, class Vertex>
MIS_HOST_DEVICE inline path_product<T> effective_density(const technique_counts<T>& counts,
                                                         const Vertex* path, int n, int s,
                                                         path_product<T> joined, T factor = T(1)) {
    const technique t{kind, s};
    const T count = count_of(counts, kind);
    assert_density(count);
    if (!(count > T(0)) || !detail::is_possible(path, n, t) || !is_within_caps(counts, n, t))
        return {1, zero_exponent};
    return joined * path_density<T>{count, factor};
}

// Calls visit(index, effective density) for every technique of the path. From s to s + 1 the camera walk
// takes x_s over from the light walk: p(C_{s+1}) / p(C_s) = P->_s / P<-_s, [J] 4. At a merge both walks make
// the vertex.
//
// All densities are over that of the light walk alone, which they share. Its exponent is returned: only to
// those who give it back the second time, zeros and infinities are such.
template <class T, class Vertex, class Visit>
MIS_HOST_DEVICE long long for_each_density(const technique_counts<T>& counts, const Vertex* path, int n,
                                           long long exponent, Visit&& visit) {
    using kind = technique_kind;
    const int last = n - 1;
    long long taken = 0;
    path_product<T> joined{1, exponent};
    visit(0, detail::effective_density<kind::camera_hit>(counts, path, n, 0, joined));
    joined = without(joined, detail::density_from_light(path, n, 0), taken);
    if (n > 2)
        visit(1, detail::effective_density<kind::camera_connection>(
                     counts, path, n, 1, joined * detail::next_event_density(path, 0)));
    joined = joined * detail::density_from_camera(path, n, 0);
    if (n == 2)
        visit(1, detail::effective_density<kind::direct>(counts, path, n, 1, joined));
    for (int s = 1; s < last; ++s) {
        joined = joined * detail::density_from_camera(path, n, s);
        visit(n + s,
              detail::effective_density<kind::merge>(counts, path, n, s + 1, joined, path[s].merge_factor));
        joined = without(joined, detail::density_from_light(path, n, s), taken);
        if (s + 1 < last)
            visit(s + 1, detail::effective_density<kind::connection>(counts, path, n, s + 1, joined));
    }
    joined = without(joined, detail::density_from_light(path, n, last), taken);
    if (n > 2)
        visit(last, detail::effective_density<kind::next_event>(
                        counts, path, n, last, joined * detail::next_event_density(path, last)));
    visit(n, detail::effective_density<kind::light_hit>(counts, path, n, n,
                                                        joined * detail::density_from_camera(path, n, last)));
    return taken;
}

// Calls visit(index, effective density over the largest one) for every technique of the path: exactly 1 for
// the largest, all 0 if none can make the path. Two sweeps: arrays of any length would be needed for one.
template <class T, class Vertex, class Visit>
MIS_HOST_DEVICE void for_each_relative(const technique_counts<T>& counts, const Vertex* path, int n,
                                       Visit&& visit) {
    assert(n >= 2 && n <= longest_path);
    using W = weighing_t<T>;
    path_product<T> largest{1, longest_path * zero_exponent};
    int place = 0; // by its place, because -ffast-math lets the second sweep round otherwise
    const long long exponent =
        detail::for_each_density(counts, path, n, 0, [&](int index, const path_product<T>& q) {
            if (is_less(largest, q)) {
                largest = q;
                place = index;
            }
        });
    largest.exponent += exponent;
    const bool none = is_zero(largest);
    detail::for_each_density(counts, path, n, exponent, [&](int index, const path_product<T>& q) {
        visit(index, none ? W(0) : index == place ? W(1) : relative_to(largest, q));
    });
}

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
    const auto number = [](detail::path_product<T> p) {
        if (is_zero(p))
            return T(0);
        return is_infinite(p) ? T(detail::limits<T>::infinity)
                              : static_cast<T>(ldexp(p.mantissa, static_cast<int>(p.exponent)));
    };
    a.density_from_camera = number(detail::product(detail::density_from_camera(path, n, i)));
    a.density_from_light = number(detail::product(detail::density_from_light(path, n, i)));
    if (i == 0 || i == n - 1)
        a.next_event = number(detail::product(detail::next_event_density(path, i)));
    return a;
}

// Effective densities of all technique_count(n) techniques of a path of n >= 2 vertices (places: see
// technique_at in techniques.hpp), divided by the largest one, whatever the sizes of the densities and the
// length of the path.
//   - 0: impossible (a Dirac vertex, a zero density, a switched-off technique), and 0 times infinity;
//   - positive densities stay positive, if only as the smallest number there is (where subnormal numbers
//     count as 0, as under -ffast-math, the smallest normal one);
//   - if some are infinite, those are 1 and the others 0.
// To bring in a multiplier of your own (a throughput, a correlation factor), multiply it into out[k] and call
// weights(heuristic, out, technique_count(n), out).
template <class T, class Vertex>
MIS_HOST_DEVICE void relative_densities(const technique_counts<T>& counts, const Vertex* path, int n,
                                        T* out) {
    detail::for_each_relative(counts, path, n, [&](int index, const detail::weighing_t<T>& q) {
        out[index] = q > T(0) ? detail::keep_positive(static_cast<T>(q)) : T(0);
    });
}

// Weights of all technique_count(n) techniques of a path: they sum to 1 unless no technique can make the
// path.
template <class Heuristic, class T, class Vertex>
MIS_HOST_DEVICE void weights(const Heuristic& heuristic, const technique_counts<T>& counts,
                             const Vertex* path, int n, T* out) {
    using W = detail::weighing_t<T>;
    W total = 0;
    detail::for_each_relative(counts, path, n, [&](int index, const W& q) {
        const W share = heuristic.share(q, W(1));
        total += share;
        out[index] = static_cast<T>(share);
    });
    for (int k = 0; k < technique_count(n); ++k)
        out[k] = total > W(0) ? static_cast<T>(static_cast<W>(out[k]) / total) : T(0);
}

// Weight of one technique of a path, without an array for the others.
template <class Heuristic, class T, class Vertex>
MIS_HOST_DEVICE T weight(const Heuristic& heuristic, const technique_counts<T>& counts, const Vertex* path,
                         int n, technique t) {
    using W = detail::weighing_t<T>;
    const int wanted = technique_index(n, t);
    W total = 0, own = 0;
    detail::for_each_relative(counts, path, n, [&](int index, const W& q) {
        const W share = heuristic.share(q, W(1));
        total += share;
        if (index == wanted)
            own = share;
    });
    return total > W(0) ? static_cast<T>(own / total) : T(0);
}

} // namespace mis
