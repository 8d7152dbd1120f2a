// Direct light at a point, as two techniques find it: *BSDF sampling* and *light sampling*.
#pragma once

#include "reflection.hpp"
#include <array>
#include <cstddef>

namespace studies::direct_light {

enum technique : std::size_t { bsdf, light };
using pair = std::array<double, 2>; // of both techniques

struct draw {
    dvec3 f{0};
    pair p{};               // densities per solid angle, of one sample each; 0: it has left the domain
    std::size_t source = 0; // of the light, where light samples are spread over several
};

inline bool is_outside(const draw& d) { return !(d.p[bsdf] > 0 || d.p[light] > 0); }

} // namespace studies::direct_light
