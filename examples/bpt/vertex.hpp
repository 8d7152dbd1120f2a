// A path vertex of the renderer, and the two ends of a path: lights and the camera.
#pragma once

#include "bsdf.hpp"
#include <mis/mis.hpp>

namespace bpt {

// What a renderer keeps of a walk's vertex anyway, and the two numbers that its weights need.
template <class Real> struct vertex {
    mis::vertex_kind kind = mis::vertex_kind::surface;
    mis::subpath_state<Real> state; // once the walk has arrived here

    surface_point<Real> point; // normals and material; point.light: the light that it lies on, or -1
    const bpt::material<Real>* material = nullptr;
    color<Real> throughput{1};      // of the walk, up to here
    vec3<Real> towards_previous{0}; // back along the walk
    int medium = -1;                // through which the walk has come, or none
    Real beam = 0;                  // in a medium: X of the segment that ends here, see mis::beam

    // Walks that split are trees. Their vertices stand in the order in which they have been made.
    int back = 1;  // so many places before this one is the previous vertex
    int depth = 1; // the walk's vertices up to here
    // What is played here, see roulette.hpp.
    int cells[2] = {0, 0};              // of what has been learned, by each kind of walk
    int copies = 0;                     // that leave
    int next_events = -1;               // or -1: as many as there are everywhere
    Real rate = 1, next_event_rate = 1; // of which these are the expectations
};

// The vertex before this one, which is not the walk's first, in the array that it stands in.
template <class Real> const vertex<Real>& previous(const vertex<Real>& x) { return *(&x - x.back); }

enum class walk_kind { from_camera, from_light };
inline std::size_t number_of(walk_kind kind) { return kind == walk_kind::from_camera ? 0 : 1; }
inline walk_kind other(walk_kind kind) {
    return kind == walk_kind::from_camera ? walk_kind::from_light : walk_kind::from_camera;
}

template <class Real> bool is_infinite(const vertex<Real>& x) {
    return x.kind == mis::vertex_kind::infinite_light;
}
template <class Real> bool is_light(const vertex<Real>& x) {
    return x.kind == mis::vertex_kind::light || is_infinite(x);
}
template <class Real> bool scatters_dirac(const vertex<Real>& x) { return x.kind == mis::vertex_kind::dirac; }

template <class Real> bool is_in_medium(const vertex<Real>& x) { return x.kind == mis::vertex_kind::medium; }

// Whether a walk's vertex may be its end in a next event, connection or merge.
template <class Real> bool can_join(const vertex<Real>& x) { return !is_light(x) && !scatters_dirac(x); }

// From a vertex to another one, of unit length. A vertex at infinity has its direction in place of a normal.
template <class Real> vec3<Real> direction(const vertex<Real>& from, const vertex<Real>& to) {
    if (is_infinite(to))
        return to.point.normal;
    if (is_infinite(from))
        return -from.point.normal;
    return normalize(to.point.position - from.point.position);
}
template <class Real> Real squared_distance(const vertex<Real>& a, const vertex<Real>& b) {
    if (is_infinite(a) || is_infinite(b))
        return Real(1);
    const vec3<Real> edge = b.point.position - a.point.position;
    return dot(edge, edge);
}
// |cos| between the geometric normal and a direction; 1 where there is no normal.
template <class Real> Real geometric_cosine(const vertex<Real>& x, const vec3<Real>& to) {
    const bool has_normal = !is_infinite(x) && dot(x.point.normal, x.point.normal) > Real(0);
    return has_normal ? std::abs(dot(x.point.normal, to)) : Real(1);
}
template <class Real> Real shading_cosine(const vertex<Real>& x, const vec3<Real>& to) {
    return is_in_medium(x) ? Real(1) : std::abs(dot(x.point.shading_normal, to));
}

// ---- Lights ----

template <class Real> const light<Real>& light_of(const scene<Real>& scene, const vertex<Real>& x) {
    return scene.lights[static_cast<std::size_t>(x.point.light)];
}

template <class Real> color<Real> sky(const light<Real>& l, const vec3<Real>& towards) {
    const Real height = (towards.y + 1) / 2;
    const Real cosine = std::max(Real(0), dot(l.normal, towards));
    return l.horizon * (1 - height) + l.emission * height + l.sun * std::pow(cosine, l.sun_exponent);
}
template <class Real> Real sky_density(const light<Real>& l, Real lobe_share, const vec3<Real>& towards) {
    return lobe_share * lobe_density(dot(l.normal, towards), l.sun_exponent) +
           (1 - lobe_share) * sphere_density<Real>;
}

// The vertex on light i at a position, or (environment) in the direction of `normal`.
template <class Real>
vertex<Real> light_vertex(const scene<Real>& scene, int i, const vec3<Real>& position,
                          const vec3<Real>& normal) {
    const bool at_infinity = scene.lights[static_cast<std::size_t>(i)].kind == light_kind::environment;
    vertex<Real> x;
    x.kind = at_infinity ? mis::vertex_kind::infinite_light : mis::vertex_kind::light;
    x.point = {position, normal, normal, 0, i};
    return x;
}

// A random point on light i; for an environment, with the given share of the sun's lobe.
template <class Real>
vertex<Real> sample_light_point(const scene<Real>& scene, int i, Real lobe_share, pcg32& rng) {
    const light<Real>& l = scene.lights[static_cast<std::size_t>(i)];
    if (l.kind == light_kind::point)
        return light_vertex(scene, i, l.origin, vec3<Real>(0));
    if (l.kind == light_kind::area) {
        const Real u = uniform<Real>(rng), v = uniform<Real>(rng);
        return light_vertex(scene, i, l.origin + u * l.edge_u + v * l.edge_v, l.normal);
    }
    const bool in_lobe = uniform<Real>(rng) < lobe_share;
    const vec3<Real> towards =
        in_lobe ? sample_lobe(l.normal, l.sun_exponent, rng) : sample_sphere<Real>(rng);
    return light_vertex(scene, i, vec3<Real>(0), towards);
}

template <class Real> int pick_light(const scene<Real>& scene, Real light<Real>::*probability, pcg32& rng) {
    Real u = uniform<Real>(rng);
    int i = 0;
    for (const int last = static_cast<int>(scene.lights.size()) - 1; i < last; ++i) {
        u -= scene.lights[static_cast<std::size_t>(i)].*probability;
        if (u < Real(0))
            break;
    }
    return i;
}

// Radiance (point light: intensity) that leaves the light in a direction.
template <class Real>
color<Real> emitted(const scene<Real>& scene, const vertex<Real>& x, const vec3<Real>& leaving) {
    const light<Real>& l = light_of(scene, x);
    if (l.kind == light_kind::environment)
        return sky(l, x.point.normal);
    const bool is_front = l.kind == light_kind::point || dot(x.point.normal, leaving) > Real(0);
    return is_front ? l.emission : color<Real>(0);
}

// The light as the weights want it, for a first edge in a direction. The position has one density as a light
// walk's start and another as a next event, because each picks lights in its own way.
template <class Real>
mis::end_point<Real> light_end_point(const scene<Real>& scene, const vertex<Real>& x,
                                     const vec3<Real>& leaving) {
    const light<Real>& l = light_of(scene, x);
    Real emission = 1, next_event = 1, pdf_leaving = sphere_density<Real>; // a point light's
    if (l.kind == light_kind::area) {
        emission = next_event = 1 / l.area;
        pdf_leaving = std::max(Real(0), dot(x.point.normal, leaving)) / pi<Real>;
    } else if (l.kind == light_kind::environment) {
        emission = sky_density(l, l.lobe_share_emission, x.point.normal);
        next_event = sky_density(l, l.lobe_share_next_event, x.point.normal);
        pdf_leaving = 1 / (pi<Real> * scene.radius * scene.radius);
    }
    return {mis::pdf_position{l.select_emission * emission},
            mis::pdf_next_event{l.select_next_event * next_event}, mis::pdf_direction{pdf_leaving},
            mis::cosine{geometric_cosine(x, leaving)}, l.kind != light_kind::point};
}

// A direction that leaves the light, with the density that light_end_point() states; and where the ray
// starts.
template <class Real> struct ray { vec3<Real> origin, direction; };
template <class Real> ray<Real> sample_emission(const scene<Real>& scene, const vertex<Real>& x, pcg32& rng) {
    const vec3<Real>& normal = x.point.normal;
    if (is_infinite(x)) {
        const vec3<Real> on_disk = scene.center + scene.radius * sample_disk(normal, rng);
        return {on_disk + scene.radius * normal, -normal};
    }
    if (light_of(scene, x).kind == light_kind::point)
        return {x.point.position, sample_sphere<Real>(rng)};
    return {x.point.position, sample_lobe(normal, Real(1), rng)};
}

// ---- The camera ----

// The camera's vertex, at a random point of the lens.
template <class Real> vertex<Real> sample_lens(const camera<Real>& camera, pcg32& rng) {
    vertex<Real> x;
    x.kind = mis::vertex_kind::camera;
    const vec3<Real> offset =
        camera.lens_radius == Real(0) ? vec3<Real>(0) : camera.lens_radius * sample_disk(camera.forward, rng);
    x.point = {camera.position + offset, camera.forward, camera.forward, 0, -1};
    return x;
}

// The camera as the weights want it, for a first edge in a direction: its density is the one *within its
// pixel*, 1 / (pixel's area at distance 1 · cos³), which is why light walks count per image.
template <class Real>
mis::end_point<Real> camera_end_point(const camera<Real>& camera, const vec3<Real>& leaving, int width) {
    const Real pixel = 2 * camera.half_extent / static_cast<Real>(width);
    const Real cosine = dot(camera.forward, leaving);
    const bool is_pinhole = camera.lens_radius == Real(0);
    const Real position = is_pinhole ? Real(1) : 1 / (pi<Real> * camera.lens_radius * camera.lens_radius);
    return {mis::pdf_position{position}, mis::pdf_next_event{position},
            mis::pdf_direction{1 / (pixel * pixel * cosine * cosine * cosine)}, mis::cosine{cosine},
            !is_pinhole};
}

// The direction from a lens point for film coordinates in [-1, 1]²; both meet in the plane in focus.
template <class Real>
vec3<Real> film_to_direction(const camera<Real>& camera, const vertex<Real>& lens, Real film_x, Real film_y) {
    const vec3<Real> through =
        camera.forward + camera.half_extent * (film_x * camera.right + film_y * camera.up);
    return normalize(camera.position + camera.focus_distance * through - lens.point.position);
}

// The inverse: the pixel that sees a direction from a lens point, or -1.
template <class Real>
int pixel_of(const camera<Real>& camera, const vertex<Real>& lens, const vec3<Real>& leaving, int width) {
    const Real cosine = dot(camera.forward, leaving);
    if (cosine <= Real(0))
        return -1;
    const vec3<Real> in_focus =
        lens.point.position + camera.focus_distance / cosine * leaving - camera.position;
    const Real scale = 1 / (camera.focus_distance * camera.half_extent);
    const Real x = (1 + dot(in_focus, camera.right) * scale) / 2 * static_cast<Real>(width);
    const Real y = (1 - dot(in_focus, camera.up) * scale) / 2 * static_cast<Real>(width);
    const Real w = static_cast<Real>(width);
    return x >= Real(0) && x < w && y >= Real(0) && y < w ? static_cast<int>(y) * width + static_cast<int>(x)
                                                          : -1;
}

} // namespace bpt
