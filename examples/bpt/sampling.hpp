// Random directions and points.
#pragma once

#include "scene.hpp"
#include <pcg_random.hpp>
#include <random>

namespace bpt {

template <class Real> constexpr Real pi = Real(3.14159265358979323846);

template <class Real> Real uniform(pcg32& rng) { return std::uniform_real_distribution<Real>(0, 1)(rng); }

template <class Real> vec3<Real> any_perpendicular(const vec3<Real>& n) {
    const vec3<Real> axis = std::abs(n.x) < Real(0.5) ? vec3<Real>(1, 0, 0) : vec3<Real>(0, 1, 0);
    return normalize(cross(n, axis));
}

// The direction at this cosine and a random azimuth around an axis of unit length.
template <class Real> vec3<Real> around(const vec3<Real>& axis, Real cosine, pcg32& rng) {
    const Real phi = 2 * pi<Real> * uniform<Real>(rng);
    const Real sine = std::sqrt(std::max(Real(0), 1 - cosine * cosine));
    const vec3<Real> u = any_perpendicular(axis);
    return normalize(cosine * axis + sine * (std::cos(phi) * u + std::sin(phi) * cross(axis, u)));
}

// Density (exponent + 1) / (2 pi) cos^exponent: uniform on the hemisphere for 0, cosine for 1.
template <class Real> vec3<Real> sample_lobe(const vec3<Real>& axis, Real exponent, pcg32& rng) {
    return around(axis, std::pow(uniform<Real>(rng), 1 / (exponent + 1)), rng);
}
template <class Real> Real lobe_density(Real cosine, Real exponent) {
    return cosine > Real(0) ? (exponent + 1) / (2 * pi<Real>)*std::pow(cosine, exponent) : Real(0);
}

template <class Real> vec3<Real> sample_sphere(pcg32& rng) {
    return around(vec3<Real>(0, 0, 1), 2 * uniform<Real>(rng) - 1, rng);
}
template <class Real> constexpr Real sphere_density = 1 / (4 * pi<Real>);

// A point of the unit disk perpendicular to an axis.
template <class Real> vec3<Real> sample_disk(const vec3<Real>& axis, pcg32& rng) {
    const Real radius = std::sqrt(uniform<Real>(rng));
    return radius * around(axis, Real(0), rng);
}

} // namespace bpt
