// Positions and normals of a path, turned into the cosines and distances of a record.
#pragma once

#include <array>
#include <mis/verify/record.hpp>
#include <optional>
#include <vector>

namespace check_paths {

using vec3 = std::array<double, 3>;

// Where an edge ends, as far as it is known.
struct site {
    std::optional<vec3> position, normal, shading_normal;
};

// The two walks of a merge arrive at different points: edges on the camera's side end at `own`, those on the
// light's side at `photon`. Elsewhere both are the same.
struct vertex_geometry {
    site own, photon;
    std::optional<vec3> direction; // of an infinite light, towards it
};

// Fills in what is not given, by the rules of mis::measure in path.hpp and in double. A light without a
// normal is a point: its cosine is 1. What follows from nothing stays not given.
void measure(mis::path_record& record, const std::vector<vertex_geometry>& geometry);

} // namespace check_paths
