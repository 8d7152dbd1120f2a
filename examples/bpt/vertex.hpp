// A path vertex of the renderer, and the two ends of a path: lights and the camera.
#pragma once

#include "bsdf.hpp"
#include <mis/mis.hpp>

namespace bpt {

// The renderer's own vertex carries what the weights need: a record of its densities, cosines and distances,
// for looking at whole paths, and the two numbers of the recursion, which is all that the weights themselves
// take.
template <class Real> struct vertex {
    mis::measured_vertex<Real> record;
    mis::measured_vertex<Real> told; // in place of the record where mistakes are planted, see mistakes.hpp
    mis::subpath_state<Real> state;  // once the walk has arrived here

    surface_point<Real> point; // normals and material; point.light: the light that it lies on, or -1
    const bpt::material<Real>* material = nullptr;
    color<Real> throughput{1};      // of the walk, up to here
    vec3<Real> towards_previous{0}; // back along the walk
    Real eta_to_camera = 1, eta_to_light = 1;
};

enum class walk_kind { from_camera, from_light };

template <class Real> bool is_infinite(const vertex<Real>& x) {
    return x.record.kind == mis::vertex_kind::infinite_light;
}
template <class Real> bool is_light(const vertex<Real>& x) {
    return x.record.kind == mis::vertex_kind::light || is_infinite(x);
}
template <class Real> bool scatters_dirac(const vertex<Real>& x) {
    return x.record.kind == mis::vertex_kind::dirac;
}

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
    return std::abs(dot(x.point.shading_normal, to));
}

// The end points as the weights want them.
template <class Real> mis::end_point<Real> camera_end_point(const vertex<Real>& x) {
    const auto& r = x.record;
    return {mis::pdf_position{r.pdf_position}, mis::pdf_next_event{r.pdf_next_event},
            mis::pdf_direction{r.pdf_to_light}, mis::cosine{r.cos_to_light}, !r.dirac};
}
template <class Real> mis::end_point<Real> light_end_point(const vertex<Real>& x) {
    const auto& r = x.record;
    return {mis::pdf_position{r.pdf_position}, mis::pdf_next_event{r.pdf_next_event},
            mis::pdf_direction{r.pdf_to_camera}, mis::cosine{r.cos_to_camera}, !r.dirac};
}

// ---- Lights ----

template <class Real> color<Real> sky(const light<Real>& l, const vec3<Real>& towards) {
    const Real height = (towards.y + 1) / 2;
    const Real cosine = std::max(Real(0), dot(l.normal, towards));
    return l.horizon * (1 - height) + l.emission * height + l.sun * std::pow(cosine, l.sun_exponent);
}
template <class Real> Real sky_density(const light<Real>& l, Real lobe_share, const vec3<Real>& towards) {
    return lobe_share * lobe_density(dot(l.normal, towards), l.sun_exponent) +
           (1 - lobe_share) * sphere_density<Real>;
}

// The vertex on light i at a position, or (environment) in the direction of `normal`, with both densities of
// the position: as a light walk's start and as a next event. Selection probabilities included.
template <class Real>
vertex<Real> light_vertex(const scene<Real>& scene, int i, const vec3<Real>& position,
                          const vec3<Real>& normal) {
    const light<Real>& l = scene.lights[static_cast<std::size_t>(i)];
    vertex<Real> x;
    x.point = {position, normal, normal, 0, i};
    x.record.kind =
        l.kind == light_kind::environment ? mis::vertex_kind::infinite_light : mis::vertex_kind::light;
    x.record.dirac = l.kind == light_kind::point;
    Real emission = 1, next_event = 1;
    if (l.kind == light_kind::area) {
        emission = next_event = 1 / l.area;
    } else if (l.kind == light_kind::environment) {
        emission = sky_density(l, l.lobe_share_emission, normal);
        next_event = sky_density(l, l.lobe_share_next_event, normal);
    }
    x.record.pdf_position = l.select_emission * emission;
    x.record.pdf_next_event = l.select_next_event * next_event;
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

// Emitted radiance (point light: intensity) in a direction that leaves the light vertex; sets the density of
// a light walk's taking that direction, and the cosine.
template <class Real> color<Real> emit(const scene<Real>& scene, vertex<Real>& x, const vec3<Real>& leaving) {
    const light<Real>& l = scene.lights[static_cast<std::size_t>(x.point.light)];
    x.record.cos_to_camera = geometric_cosine(x, leaving);
    switch (l.kind) {
    case light_kind::point:
        x.record.pdf_to_camera = sphere_density<Real>;
        return l.emission;
    case light_kind::environment:
        x.record.pdf_to_camera = 1 / (pi<Real> * scene.radius * scene.radius);
        return sky(l, x.point.normal);
    case light_kind::area:
        break;
    }
    const Real cosine = dot(x.point.normal, leaving);
    x.record.pdf_to_camera = std::max(Real(0), cosine) / pi<Real>;
    return cosine > Real(0) ? l.emission : color<Real>(0);
}

// A direction that leaves the light, with the density that emit() states; and where the ray starts.
template <class Real> struct ray { vec3<Real> origin, direction; };
template <class Real> ray<Real> sample_emission(const scene<Real>& scene, const vertex<Real>& x, pcg32& rng) {
    const vec3<Real>& normal = x.point.normal;
    if (is_infinite(x)) {
        const vec3<Real> on_disk = scene.center + scene.radius * sample_disk(normal, rng);
        return {on_disk + scene.radius * normal, -normal};
    }
    if (x.record.dirac)
        return {x.point.position, sample_sphere<Real>(rng)};
    return {x.point.position, sample_lobe(normal, Real(1), rng)};
}

// ---- The camera ----

// The camera's vertex, at a random point of the lens.
template <class Real> vertex<Real> sample_lens(const camera<Real>& camera, pcg32& rng) {
    vertex<Real> x;
    x.record.kind = mis::vertex_kind::camera;
    x.record.dirac = camera.lens_radius == Real(0);
    const vec3<Real> offset =
        x.record.dirac ? vec3<Real>(0) : camera.lens_radius * sample_disk(camera.forward, rng);
    x.point = {camera.position + offset, camera.forward, camera.forward, 0, -1};
    x.record.pdf_position =
        x.record.dirac ? Real(1) : 1 / (pi<Real> * camera.lens_radius * camera.lens_radius);
    x.record.pdf_next_event = x.record.pdf_position;
    return x;
}

// Density of a camera ray's direction *within its pixel*: 1 / (pixel's area at distance 1 · cos³). Sets the
// cosine.
template <class Real>
void aim(const camera<Real>& camera, vertex<Real>& x, const vec3<Real>& leaving, int width) {
    const Real pixel = 2 * camera.half_extent / static_cast<Real>(width);
    const Real cosine = dot(camera.forward, leaving);
    x.record.cos_to_light = cosine;
    x.record.pdf_to_light = 1 / (pixel * pixel * cosine * cosine * cosine);
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
