// What all benchmarks share: random numbers of ordinary size to weigh, the same for every alternative.
#pragma once

#include "alternatives.hpp"
#include <mis/mis.hpp>
#include <pcg_random.hpp>
#include <random>
#include <vector>

// For functions whose instructions are counted: neither inlined nor changed for who calls them.
#ifdef __clang__
#define NOT_INLINED [[gnu::noinline]]
#else
#define NOT_INLINED [[gnu::noipa]]
#endif

namespace inputs {

inline float positive(pcg32& rng) { return std::uniform_real_distribution<float>(0.1f, 2.0f)(rng); }

inline std::vector<float> densities(int count) {
    pcg32 rng(1);
    std::vector<float> q(static_cast<std::size_t>(count));
    for (float& x : q)
        x = positive(rng);
    return q;
}

// A path of n vertices from a pinhole to an area light, by its geometry.
inline std::vector<mis::measured_vertex<float>> path(int n) {
    pcg32 rng(3);
    std::vector<mis::measured_vertex<float>> x(static_cast<std::size_t>(n));
    for (auto& v : x) {
        v.pdf_to_light = positive(rng);
        v.pdf_to_camera = positive(rng);
        v.cos_to_camera = positive(rng) / 2;
        v.cos_to_light = positive(rng) / 2;
        v.distance2_to_light = positive(rng);
    }
    x.front().kind = mis::vertex_kind::camera;
    x.front().dirac = true;
    x.front().pdf_position = x.front().pdf_next_event = 1;
    x.back().kind = mis::vertex_kind::light;
    x.back().pdf_position = 0.5f;
    x.back().pdf_next_event = 0.25f;
    return x;
}

} // namespace inputs
