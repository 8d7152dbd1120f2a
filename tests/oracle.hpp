// SPDX-License-Identifier: MIT
#pragma once

#include "wide.hpp"

#include <mis/path.hpp>
#include <vector>

// What the weights should be, written as slowly and plainly as the definitions: every technique's density is
// the product of its factors, every weight a quotient of sums. Shares with the library only the plain
// records.

namespace oracle {

enum class heuristic_kind { average, balance, power, cutoff, maximum };

struct heuristic {
    heuristic_kind kind;
    double parameter = 0; // beta of power, alpha of cutoff
};

// What a technique with effective density q gets for its share, `largest` being the largest density.
inline wide share(heuristic h, const wide& q, const wide& largest) {
    if (q.zero())
        return {};
    if (largest.infinite)
        return q.infinite ? wide{1} : wide{};
    switch (h.kind) {
    case heuristic_kind::average:
        return wide{1};
    case heuristic_kind::balance:
        return q;
    case heuristic_kind::power:
        return pow(q, h.parameter);
    case heuristic_kind::cutoff:
        return q < wide{h.parameter} * largest ? wide{} : q;
    case heuristic_kind::maximum:
        return q == largest ? wide{1} : wide{};
    }
    return {};
}

// Weights of techniques with effective densities q.
inline std::vector<wide> weights(heuristic h, const std::vector<wide>& q) {
    wide largest, sum;
    for (const wide& x : q)
        if (largest < x)
            largest = x;
    for (const wide& x : q)
        sum = sum + share(h, x, largest);
    std::vector<wide> result;
    for (const wide& x : q)
        result.push_back(sum.zero() ? wide{} : share(h, x, largest) / sum);
    return result;
}

template <class T> std::vector<wide> weights(heuristic h, const T* q, int count) {
    return weights(h, std::vector<wide>(q, q + count));
}

// A path from camera to light, as its densities per area and what may be joined or hit.
struct path {
    std::vector<wide> from_camera, from_light; // P-> and P<-
    wide camera_next_event, light_next_event;  // of the end points, for the other walk's end
    std::vector<bool> dirac_scatterer;
    std::vector<wide> merge_factor;
    bool camera_can_be_hit = true, light_can_be_hit = true;

    int size() const { return static_cast<int>(from_camera.size()); }
};

template <class Vertex> path flags_of(const Vertex* x, int n) {
    path p;
    for (int i = 0; i < n; ++i)
        p.dirac_scatterer.push_back(x[i].kind == mis::vertex_kind::dirac),
            p.merge_factor.push_back(x[i].merge_factor);
    p.camera_can_be_hit = !x[0].dirac;
    p.light_can_be_hit = !x[n - 1].dirac;
    return p;
}

// P->_i = omega->_{i-1} |cos_i| / d^2, times the density of the distance; the end points have their own.
template <class T> path path_of(const mis::measured_vertex<T>* x, int n) {
    path p = flags_of(x, n);
    for (int i = 0; i < n; ++i) {
        if (i == 0)
            p.from_camera.push_back(x[0].pdf_position);
        else
            p.from_camera.push_back(wide{x[i - 1].pdf_to_light} * wide{x[i].cos_to_camera} *
                                    wide{x[i].pdf_distance_from_camera} / wide{x[i - 1].distance2_to_light});
        if (i == n - 1)
            p.from_light.push_back(x[n - 1].pdf_position);
        else
            p.from_light.push_back(wide{x[i + 1].pdf_to_camera} * wide{x[i].cos_to_light} *
                                   wide{x[i].pdf_distance_from_light} / wide{x[i].distance2_to_light});
    }
    p.camera_next_event = x[0].pdf_next_event;
    p.light_next_event = x[n - 1].pdf_next_event;
    return p;
}

template <class T> path path_of(const mis::area_vertex<T>* x, int n) {
    path p = flags_of(x, n);
    for (int i = 0; i < n; ++i) {
        p.from_camera.push_back(x[i].density_from_camera);
        p.from_light.push_back(x[i].density_from_light);
    }
    p.camera_next_event = x[0].next_event;
    p.light_next_event = x[n - 1].next_event;
    return p;
}

template <class T> path path_of(const std::vector<T>& x) {
    return path_of(x.data(), static_cast<int>(x.size()));
}

// Product of P->_i for i < s and P<-_i for i >= t.
inline wide walks(const path& p, int s, int t) {
    wide product{1};
    for (int i = 0; i < s; ++i)
        product = product * p.from_camera[static_cast<std::size_t>(i)];
    for (int i = t; i < p.size(); ++i)
        product = product * p.from_light[static_cast<std::size_t>(i)];
    return product;
}

inline bool can_be_joined(const path& p, int i) { return !p.dirac_scatterer[static_cast<std::size_t>(i)]; }

// Effective densities of all techniques in the library's order: s = 0 ... n camera vertices without merging,
// then the merges at x_1 ... x_{n-2}. The caps count the vertices of walks; a point sampled for a next event
// or on the lens for a camera connection (or direct) belongs to no walk.
template <class T> std::vector<wide> densities(const mis::technique_counts<T>& counts, const path& p) {
    const int n = p.size();
    const auto within_caps = [&](int camera_walk, int light_walk) {
        return camera_walk <= counts.max_camera_vertices && light_walk <= counts.max_light_vertices;
    };
    std::vector<wide> q;
    // light tracing into the lens, s = 0
    q.push_back(p.camera_can_be_hit && within_caps(0, n) ? wide{counts.camera_hit} * walks(p, 0, 0) : wide{});
    // one edge joins x_{s-1} and x_s
    for (int s = 1; s < n; ++s) {
        const bool joined = can_be_joined(p, s - 1) && can_be_joined(p, s);
        wide density;
        if (n == 2) {
            if (within_caps(0, 1))
                density = wide{counts.direct} * walks(p, 1, 1);
        } else if (s == 1) {
            if (within_caps(0, n - 1))
                density = wide{counts.camera_connection} * p.camera_next_event * walks(p, 0, 1);
        } else if (s == n - 1) {
            if (within_caps(n - 1, 0))
                density = wide{counts.next_event} * walks(p, n - 1, n) * p.light_next_event;
        } else if (within_caps(s, n - s)) {
            density = wide{counts.connection} * walks(p, s, s);
        }
        q.push_back(joined ? density : wide{});
    }
    // path tracing into the light, s = n
    q.push_back(p.light_can_be_hit && within_caps(n, 0) ? wide{counts.light_hit} * walks(p, n, n) : wide{});
    // both walks make x_j
    for (int j = 1; j <= n - 2; ++j)
        q.push_back(can_be_joined(p, j) && within_caps(j + 1, n - j)
                        ? wide{counts.merge} * p.merge_factor[static_cast<std::size_t>(j)] *
                              walks(p, j + 1, j)
                        : wide{});
    return q;
}

// The densities over the largest of them; infinite ones are 1 and the others then 0.
inline std::vector<wide> relative(const std::vector<wide>& q) {
    wide largest;
    for (const wide& x : q)
        if (largest < x)
            largest = x;
    std::vector<wide> result;
    for (const wide& x : q)
        result.push_back(largest.infinite ? wide{x.infinite ? 1 : 0} : x / largest);
    return result;
}

} // namespace oracle
