// Surfaces that reflect, for studies of direct light: diffuse, or a GGX distribution of microfacets.
// Directions are local, z is the normal.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <pcg_random.hpp>
#include <random>

namespace studies::direct_light {

using glm::dvec3;

constexpr double pi = 3.14159265358979323846;

inline double sum_of(const dvec3& color) { return color.x + color.y + color.z; }
inline double uniform(pcg32& rng) { return std::uniform_real_distribution<double>(0, 1)(rng); }

struct reflector {
    double reflectance;
    double roughness; // alpha of the GGX distribution; 0: diffuse
};

// The GGX distribution of microfacets: E. Heitz, "Understanding the Masking-Shadowing Function", 2014, and
// "Sampling the GGX Distribution of Visible Normals", 2018.
inline double facets(const dvec3& h, double alpha) {
    const double square = alpha * alpha, x = square * h.z * h.z + h.x * h.x + h.y * h.y;
    return square / (pi * x * x);
}
inline double masking(const dvec3& v, double alpha) { // Lambda
    return (std::sqrt(1 + alpha * alpha * (v.x * v.x + v.y * v.y) / (v.z * v.z)) - 1) / 2;
}

// The BSDF times the cosine.
inline double reflected(const reflector& r, const dvec3& from, const dvec3& to) {
    if (!(from.z > 0 && to.z > 0))
        return 0;
    if (r.roughness == 0)
        return r.reflectance * to.z / pi;
    const double shadowing = 1 / (1 + masking(from, r.roughness) + masking(to, r.roughness));
    return r.reflectance * facets(normalize(from + to), r.roughness) * shadowing / (4 * from.z);
}

inline double bsdf_density(const reflector& r, const dvec3& from, const dvec3& to) {
    if (!(from.z > 0 && to.z > 0))
        return 0;
    if (r.roughness == 0)
        return to.z / pi;
    return facets(normalize(from + to), r.roughness) / (4 * from.z * (1 + masking(from, r.roughness)));
}

// May lie below the surface.
inline dvec3 sample_bsdf(const reflector& r, const dvec3& from, pcg32& rng) {
    const double radius = std::sqrt(uniform(rng)), angle = 2 * pi * uniform(rng);
    const double x = radius * std::cos(angle), y = radius * std::sin(angle);
    if (r.roughness == 0)
        return {x, y, std::sqrt(1 - radius * radius)};
    // A visible normal: a point of the hemisphere's projection along `from`, all stretched to roughness 1.
    const dvec3 stretched = normalize(dvec3(r.roughness * from.x, r.roughness * from.y, from.z));
    const double beside = std::hypot(stretched.x, stretched.y);
    const dvec3 side = beside > 0 ? dvec3(-stretched.y, stretched.x, 0) / beside : dvec3(1, 0, 0);
    const double visible = (1 + stretched.z) / 2;
    const double moved = (1 - visible) * std::sqrt(1 - x * x) + visible * y;
    const dvec3 n = x * side + moved * cross(stretched, side) +
                    std::sqrt(std::max(0.0, 1 - x * x - moved * moved)) * stretched;
    const dvec3 h = normalize(dvec3(r.roughness * n.x, r.roughness * n.y, std::max(0.0, n.z)));
    return 2 * dot(from, h) * h - from;
}

// A direction at this angle from an axis of unit length, given as 1 - its cosine, and a random azimuth.
inline dvec3 around(const dvec3& axis, double below_1, pcg32& rng) {
    const double angle = 2 * pi * uniform(rng);
    const dvec3 side = normalize(cross(axis, std::abs(axis.x) < 0.5 ? dvec3(1, 0, 0) : dvec3(0, 1, 0)));
    const double sine = std::sqrt(below_1 * (2 - below_1));
    return (1 - below_1) * axis + sine * (std::cos(angle) * side + std::sin(angle) * cross(axis, side));
}

} // namespace studies::direct_light
