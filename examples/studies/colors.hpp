// Colors of what pictures show.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

namespace studies {

inline double to_srgb(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

// Keeps the hue of what is brighter than the screen.
inline glm::dvec3 tone_mapped(const glm::dvec3& radiance, double exposure) {
    const double brightest = exposure * std::max({radiance.x, radiance.y, radiance.z});
    return brightest > 0 ? radiance * (exposure * (1 - std::exp(-brightest)) / brightest) : glm::dvec3(0);
}

// From blue at 0 by way of white to orange at 1, as the share of one of two techniques is shown.
inline glm::dvec3 blue_to_orange(double x) {
    const glm::dvec3 blue(0.15, 0.33, 0.74), white(0.95), orange(0.91, 0.44, 0.0);
    return x < 0.5 ? mix(blue, white, 2 * x) : mix(white, orange, 2 * x - 1);
}

} // namespace studies
