// What is rendered: shapes, materials, lights, a camera. Plain data; Real is float or double.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <glm/gtc/constants.hpp>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace bpt {

template <class Real> using vec3 = glm::vec<3, Real>;
template <class Real> using color = glm::vec<3, Real>;

enum class material_kind { diffuse, glossy, mirror, glass, boundary, phase }; // the last two: of media

template <class Real> struct material {
    material_kind kind = material_kind::diffuse;
    color<Real> diffuse{0};  // diffuse albedo; phase function: scattering coefficient, per length
    color<Real> specular{0}; // albedo of the glossy lobe, the mirror, the glass
    Real exponent = 0;       // of the glossy lobe; phase function: mean cosine
    Real eta = 1;            // refractive index of the inside
    Real survival = 1; // Russian roulette: depends on the vertex alone, so it is the same for both walks
    int inside = -1;   // glass and boundaries: the medium inside, or none
};

template <class Real> struct triangle {
    vec3<Real> a, ab, ac;
    vec3<Real> normal;
    vec3<Real> shading_normals[3]; // at the corners
    int material = 0;
    int light = -1;
};

template <class Real> struct sphere {
    vec3<Real> center;
    Real radius = 1;
    int material = 0;
};

// Triangles first ... first + count lie in a bounding sphere.
template <class Real> struct cluster {
    vec3<Real> center{0};
    Real radius = std::numeric_limits<Real>::max();
    std::size_t first = 0, count = 0;
};

enum class light_kind { area, point, environment };

// Each light may be picked by either walk, with probabilities of their own.
template <class Real> struct light {
    light_kind kind = light_kind::area;
    Real select_emission = 1;   // where a light walk starts
    Real select_next_event = 1; // where a camera vertex looks for light
    color<Real> emission{0};    // area: radiance; point: intensity; environment: radiance at the zenith
    vec3<Real> origin{0}, edge_u{0}, edge_v{0}; // area: a rectangle; point: the origin
    vec3<Real> normal{0};                       // area: the side that emits
    Real area = 0;
    // environment: emission from below to above, and a sun lobe around `normal`; sampled by a mixture of the
    // uniform sphere and the lobe, in which the lobe has these shares
    color<Real> horizon{0}, sun{0};
    Real sun_exponent = 1, lobe_share_emission = 0, lobe_share_next_event = 0;
};

// A pinhole where lens_radius is 0. Film coordinates are in [-1, 1] at half_extent from the axis, at
// distance 1.
template <class Real> struct camera {
    vec3<Real> position{0}, forward{0, 0, 1}, right{1, 0, 0}, up{0, 1, 0};
    Real half_extent = 1;
    Real lens_radius = 0;
    Real focus_distance = 1;
};

template <class Real> struct medium;
template <class Real> struct scene {
    std::string name;
    std::vector<material<Real>> materials;
    std::vector<triangle<Real>> triangles;
    std::vector<cluster<Real>> clusters;
    std::vector<sphere<Real>> spheres;
    std::vector<light<Real>> lights;
    int environment = -1; // its place among the lights
    std::vector<bpt::medium<Real>> media;
    int medium = -1; // the one outside of all objects, where lens and lights are, or none
    bpt::camera<Real> camera;
    vec3<Real> center{0}; // of a sphere around all shapes
    Real radius = 1;
    Real exposure = 1;

    // Rays start and end this far from surfaces.
    Real epsilon() const { return radius * (sizeof(Real) == 4 ? Real(1e-4) : Real(1e-9)); }
};

template <class Real> struct surface_point {
    vec3<Real> position, normal, shading_normal;
    int material = 0;
    int light = -1;
};

namespace detail {

template <class Real>
bool hit_triangle(const triangle<Real>& t, const vec3<Real>& origin, const vec3<Real>& direction,
                  Real nearest, Real& distance, Real& u, Real& v) {
    const vec3<Real> p = cross(direction, t.ac);
    const Real determinant = dot(t.ab, p);
    if (determinant == Real(0))
        return false;
    const Real inverse = Real(1) / determinant;
    const vec3<Real> s = origin - t.a;
    u = dot(s, p) * inverse;
    if (u < Real(0) || u > Real(1))
        return false;
    const vec3<Real> q = cross(s, t.ab);
    v = dot(direction, q) * inverse;
    if (v < Real(0) || u + v > Real(1))
        return false;
    distance = dot(t.ac, q) * inverse;
    return distance > nearest;
}

// The nearest intersection beyond `nearest`, if any.
template <class Real>
bool hit_sphere(const vec3<Real>& center, Real radius, const vec3<Real>& origin, const vec3<Real>& direction,
                Real nearest, Real& distance) {
    const vec3<Real> to_center = center - origin;
    const Real along = dot(to_center, direction);
    const vec3<Real> beside = to_center - along * direction;
    const Real square = radius * radius - dot(beside, beside);
    if (square < Real(0))
        return false;
    const Real half_chord = std::sqrt(square);
    distance = along - half_chord > nearest ? along - half_chord : along + half_chord;
    return distance > nearest;
}

} // namespace detail

// What a ray meets first: a triangle, at a + u ab + v ac, or a sphere, or nothing.
template <class Real> struct ray_hit {
    const bpt::triangle<Real>* triangle = nullptr;
    const bpt::sphere<Real>* sphere = nullptr;
    Real distance = 0, u = 0, v = 0;
};

// Along a ray of unit direction, between `nearest` (or epsilon) and `farthest`.
template <class Real>
ray_hit<Real> find_hit(const scene<Real>& scene, const vec3<Real>& origin, const vec3<Real>& direction,
                       Real farthest = std::numeric_limits<Real>::max(), Real nearest = -1) {
    nearest = nearest < Real(0) ? scene.epsilon() : nearest;
    ray_hit<Real> best;
    best.distance = farthest;
    for (const auto& cluster : scene.clusters) {
        Real distance = 0, u = 0, v = 0;
        const bool may_hit =
            cluster.radius == std::numeric_limits<Real>::max() ||
            detail::hit_sphere(cluster.center, cluster.radius, origin, direction, Real(0), distance);
        for (std::size_t i = 0; may_hit && i < cluster.count; ++i) {
            const auto& t = scene.triangles[cluster.first + i];
            if (detail::hit_triangle(t, origin, direction, nearest, distance, u, v) &&
                distance < best.distance)
                best = {&t, nullptr, distance, u, v};
        }
    }
    for (const auto& s : scene.spheres) {
        Real distance = 0;
        if (detail::hit_sphere(s.center, s.radius, origin, direction, nearest, distance) &&
            distance < best.distance)
            best = {nullptr, &s, distance, 0, 0};
    }
    return best;
}

// The first surface there.
template <class Real>
std::optional<surface_point<Real>>
intersect(const scene<Real>& scene, const vec3<Real>& origin, const vec3<Real>& direction,
          Real farthest = std::numeric_limits<Real>::max(), Real nearest = -1) {
    const ray_hit<Real> hit = find_hit(scene, origin, direction, farthest, nearest);
    if (hit.sphere) {
        const vec3<Real> normal = normalize(origin + hit.distance * direction - hit.sphere->center);
        return surface_point<Real>{hit.sphere->center + hit.sphere->radius * normal, normal, normal,
                                   hit.sphere->material, -1};
    }
    if (!hit.triangle)
        return std::nullopt;
    const auto& t = *hit.triangle;
    const vec3<Real> shading = t.shading_normals[0] * (Real(1) - hit.u - hit.v) +
                               t.shading_normals[1] * hit.u + t.shading_normals[2] * hit.v;
    return surface_point<Real>{t.a + hit.u * t.ab + hit.v * t.ac, t.normal, normalize(shading), t.material,
                               t.light};
}

template <class Real>
bool is_visible(const scene<Real>& scene, const vec3<Real>& from, const vec3<Real>& to) {
    const vec3<Real> edge = to - from;
    const Real distance = length(edge);
    return !intersect(scene, from, edge / distance, distance - scene.epsilon());
}

// Scenes by name; see scenes.cpp. Those that show all that the renderer can do, and those made for a study.
const std::vector<std::string>& scene_names();
const std::vector<std::string>& study_scene_names();
const std::vector<std::string>& media_scene_names();
std::vector<std::string> all_scene_names();
template <class Real> scene<Real> make_scene(const std::string& name);

// The same scene with all lengths times a factor. Its image is the same, and so are all weights.
template <class Real> scene<Real> scaled(scene<Real> s, Real factor);

} // namespace bpt
