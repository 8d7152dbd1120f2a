// What one thread of each kernel does, for the device and, to test it, for the host. Arrays hold one number
// per sample or path; what belongs to vertex j of path k is number j * stride + k, so that neighbouring
// threads read neighbouring numbers.
#pragma once

#include <cstddef>
#include <mis/batch.hpp>
#include <mis/mis.hpp>

namespace threads {

struct copy {
    const float* from;
    float* to;
    static constexpr int floats = 2; // moved by one thread

    MIS_HOST_DEVICE void operator()(std::size_t k) const { to[k] = from[k]; }
};

struct two_techniques {
    const float *a, *b;
    float* weights;
    static constexpr int floats = 3;

    MIS_HOST_DEVICE void operator()(std::size_t k) const {
        weights[k] = mis::power_heuristic<>{}(a[k], b[k]);
    }
};

template <int N, class Heuristic> struct n_techniques {
    const float* densities;
    float* weights;
    std::size_t stride;
    static constexpr int floats = 2 * N;

    MIS_HOST_DEVICE void operator()(std::size_t k) const {
        mis::weights_of_sample<N>(Heuristic{}, densities, stride, k, weights);
    }
};

// A walk's edges, and of one light vertex for each of its vertices what a connection reads.
constexpr int walk_length = 8;
struct walks {
    const float *cos_out, *forward, *reverse, *distance2, *cos_in; // of vertex j's edge to vertex j + 1
    const float *light_a, *light_b, *light_cos, *light_forward, *light_reverse, *light_distance2;
    std::size_t stride;

    MIS_HOST_DEVICE mis::subpath_state<float> start(std::size_t k) const { return {cos_out[k], cos_in[k]}; }
};

// Carries the two numbers along a walk in registers and weighs a connection at each of its vertices.
template <class Use> struct path {
    mis::path_weights<mis::balance_heuristic, float, Use> weigh;
    walks w;
    float* weights;
    static constexpr int floats = 12 * walk_length;

    MIS_HOST_DEVICE void operator()(std::size_t k) const {
        mis::subpath_state<float> x = w.start(k);
        for (int j = 0; j < walk_length; ++j) {
            const std::size_t i = static_cast<std::size_t>(j) * w.stride + k;
            const mis::cosine<float> cos_out(w.cos_out[i]);
            const mis::pdf_forward<float> forward(w.forward[i]);
            const mis::pdf_reverse<float> reverse(w.reverse[i]);
            weights[i] = weigh.connection({x, cos_out, forward, reverse},
                                          {{w.light_a[i], w.light_b[i]},
                                           mis::cosine<float>(w.light_cos[i]),
                                           mis::pdf_forward<float>(w.light_forward[i]),
                                           mis::pdf_reverse<float>(w.light_reverse[i])},
                                          mis::squared_distance<float>(w.light_distance2[i]));
            x = weigh.step(x, mis::cosine_out<float>(cos_out.value), forward, reverse,
                           mis::squared_distance<float>(w.distance2[i]), mis::cosine_in<float>(w.cos_in[i]));
        }
    }
};

} // namespace threads
