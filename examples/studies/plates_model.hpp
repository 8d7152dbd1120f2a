// Veach's plates [V97] 9.3.1: four lights of equal power and very different sizes, reflected by four glossy
// plates, from nearly a mirror to rough; and two techniques that find their light at a point, BSDF sampling
// and light sampling.
#pragma once

#include "direct_light.hpp"
#include <optional>
#include <vector>

namespace studies::plates {

using namespace direct_light;

// ---- The scene ----

struct sphere {
    dvec3 center;
    double radius;
    dvec3 radiance;
};

// Seen from its normal's side only; black from the other.
struct rectangle {
    dvec3 center, right, up, normal; // right and up: unit vectors along the edges
    double width, height;
    reflector paint;

    dvec3 to_local(const dvec3& v) const { return {dot(v, right), dot(v, up), dot(v, normal)}; }
    dvec3 to_world(const dvec3& v) const { return v.x * right + v.y * up + v.z * normal; }
};

constexpr std::size_t light_count = 4, plate_count = 4;

struct scene {
    std::array<sphere, light_count> lights;
    std::vector<rectangle> rectangles; // the plates first
    dvec3 eye{0, 2, 15}, forward{0}, right{0}, up{0};
};

inline rectangle make_rectangle(const dvec3& center, const dvec3& normal, double width, double height,
                                const reflector& paint) {
    const dvec3 right(1, 0, 0);
    return {center, right, cross(normal, right), normal, width, height, paint};
}

inline scene make_scene() {
    const std::array<double, light_count> radii{0.033, 0.1, 0.3, 0.9};
    const std::array<dvec3, light_count> colors{dvec3(2.1, 0.5, 0.4), dvec3(1.5, 1.2, 0.3),
                                                dvec3(0.4, 1.9, 0.7), dvec3(0.3, 0.8, 1.9)}; // means are 1
    scene s;
    for (std::size_t i = 0; i < light_count; ++i) // power: 4 pi^2 r^2 L
        s.lights[i] = {dvec3(-3.75 + 2.5 * double(i), 0, 0), radii[i], colors[i] / (radii[i] * radii[i])};
    const std::array<dvec3, plate_count> centers{dvec3(0, -2.4, -0.1), dvec3(0, -3.05, 0.95),
                                                 dvec3(0, -3.55, 2.2), dvec3(0, -3.9, 3.55)};
    const std::array<double, plate_count> roughness{0.001, 0.02, 0.05, 0.1};
    for (std::size_t i = 0; i < plate_count; ++i) {
        // In the middle of each plate the camera sees the mirror image of the lights' row.
        const dvec3 to_eye = normalize(s.eye - centers[i]), to_lights = normalize(-centers[i]);
        s.rectangles.push_back(
            make_rectangle(centers[i], normalize(to_eye + to_lights), 8, 1, {0.8, roughness[i]}));
    }
    s.rectangles.push_back(make_rectangle({0, -4.15, 0}, {0, 1, 0}, 40, 40, {0.25, 0}));
    s.rectangles.push_back(make_rectangle({0, 0, -2}, {0, 0, 1}, 40, 40, {0.25, 0}));
    s.forward = normalize(dvec3(0, -1.95, 2.5) - s.eye);
    s.right = normalize(cross(s.forward, dvec3(0, 1, 0)));
    s.up = cross(s.right, s.forward);
    return s;
}

struct hit {
    double distance = 1e30;
    std::optional<std::size_t> light, rectangle;
};

inline hit intersect(const scene& s, const dvec3& origin, const dvec3& direction) {
    constexpr double nearest = 1e-6; // not the surface itself
    hit h;
    for (std::size_t i = 0; i < s.lights.size(); ++i) {
        const dvec3 to_center = s.lights[i].center - origin;
        const double middle = dot(to_center, direction);
        const dvec3 beside = to_center - middle * direction; // well conditioned for a small, distant sphere
        const double square = s.lights[i].radius * s.lights[i].radius - dot(beside, beside);
        const double distance = middle - std::sqrt(std::max(0.0, square));
        if (square > 0 && distance > nearest && distance < h.distance)
            h = {distance, i, {}};
    }
    for (std::size_t i = 0; i < s.rectangles.size(); ++i) {
        const rectangle& r = s.rectangles[i];
        const double distance = dot(r.center - origin, r.normal) / dot(direction, r.normal);
        if (!(distance > nearest && distance < h.distance))
            continue;
        const dvec3 at = r.to_local(origin + distance * direction - r.center);
        if (std::abs(at.x) < r.width / 2 && std::abs(at.y) < r.height / 2)
            h = {distance, {}, i};
    }
    return h;
}

// ---- Techniques ----

// What a pixel's center shows, if that is a surface.
struct seen_point {
    std::size_t rectangle;
    dvec3 position, from; // from: to the camera, local
};
using seen_points = std::vector<std::optional<seen_point>>;

// The direction through a point of a film of this size, in pixels.
inline dvec3 film_direction(const scene& s, int width, int height, double x, double y) {
    constexpr double slope = 0.25; // of half the height
    const double scale = 2 * slope / height;
    return normalize(s.forward + scale * ((x - width / 2.0) * s.right + (height / 2.0 - y) * s.up));
}

inline seen_points look(const scene& s, int width, int height) {
    seen_points all;
    for (int i = 0; i < width * height; ++i) {
        const dvec3 direction = film_direction(s, width, height, i % width + 0.5, i / width + 0.5);
        const hit h = intersect(s, s.eye, direction);
        all.emplace_back();
        if (h.rectangle)
            all.back() = {*h.rectangle, s.eye + h.distance * direction,
                          s.rectangles[*h.rectangle].to_local(-direction)};
    }
    return all;
}

// 1 - cos of the angle that a sphere's radius fills.
inline double opening(const sphere& l, const dvec3& from) {
    const dvec3 edge = l.center - from;
    const double square = l.radius * l.radius / dot(edge, edge);
    return square / (1 + std::sqrt(1 - square));
}

// The light that is first in a direction; the densities with which both techniques find it there. None: what
// a draw finds has left the domain.
inline draw follow(const scene& s, const seen_point& at, const dvec3& to,
                   std::optional<std::size_t> wanted = {}) {
    const rectangle& r = s.rectangles[at.rectangle];
    const hit h = to.z > 0 ? intersect(s, at.position, r.to_world(to)) : hit{};
    if (!h.light || (wanted && wanted != h.light))
        return {};
    const sphere& l = s.lights[*h.light];
    const double in_cone = 1 / (2 * pi * opening(l, at.position));
    return {l.radiance * reflected(r.paint, at.from, to),
            {bsdf_density(r.paint, at.from, to), in_cone / double(light_count)},
            *h.light};
}

inline draw draw_bsdf(const scene& s, const seen_point& at, pcg32& rng) {
    return follow(s, at, sample_bsdf(s.rectangles[at.rectangle].paint, at.from, rng));
}

inline draw draw_light(const scene& s, const seen_point& at, std::size_t which, pcg32& rng) {
    const sphere& l = s.lights[which];
    const dvec3 direction =
        around(normalize(l.center - at.position), opening(l, at.position) * uniform(rng), rng);
    return follow(s, at, s.rectangles[at.rectangle].to_local(direction), which);
}

} // namespace studies::plates
