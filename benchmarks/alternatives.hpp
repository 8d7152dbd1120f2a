// What renderers write by hand today, from the literature, to compare with. Balance heuristic, float.
#pragma once

#include <cmath>

namespace alternatives {

// Two techniques, power 2, as found in most renderers: squares overflow from 2e19 on.
inline float power(float a, float b) { return a * a / (a * a + b * b); }

// Three numbers per vertex: Georgiev, "Implementing vertex connection and merging", technical report, 2012.
struct three_numbers {
    float vcm = 0, vc = 0, vm = 0;
};

struct three_number_weights {
    float eta;         // merges per connection: photons pi r^2
    float inverse_eta; // 0 where nothing merges

    three_numbers arrive(three_numbers d, float distance2, float cos_in) const {
        d.vcm *= distance2 / cos_in;
        d.vc /= cos_in;
        d.vm /= cos_in;
        return d;
    }
    three_numbers scatter(three_numbers d, float cos_out, float forward, float reverse) const {
        const float ratio = cos_out / forward;
        return {1 / forward, ratio * (d.vc * reverse + d.vcm + eta),
                ratio * (d.vm * reverse + d.vcm * inverse_eta + 1)};
    }
    // The four densities: of each end from the other per area, and at each end back along its walk.
    float connection(three_numbers camera, three_numbers light, float camera_from_light,
                     float light_from_camera, float camera_back, float light_back) const {
        const float w_camera = camera_from_light * (eta + camera.vcm + camera.vc * camera_back);
        const float w_light = light_from_camera * (eta + light.vcm + light.vc * light_back);
        return 1 / (w_light + 1 + w_camera);
    }
};

// A loop over all vertices for each weight, with both area densities stored at every vertex: Veach's thesis,
// section 10.2.1, equation 10.9, as Physically Based Rendering's bidirectional integrator has it.
struct loop_vertex {
    float forward, reverse;
    bool dirac;
};

inline float or_one(float density) { return density != 0 ? density : 1; }

// camera[s - 1] and light[t - 1] are joined; each walk's densities are seen in its own direction.
inline float loop_connection(const loop_vertex* camera, int s, const loop_vertex* light, int t) {
    float sum = 0;
    float ratio = 1;
    for (int i = s - 1; i > 0; --i) {
        ratio *= or_one(camera[i].reverse) / or_one(camera[i].forward);
        if (!camera[i].dirac && !camera[i - 1].dirac)
            sum += ratio;
    }
    ratio = 1;
    for (int i = t - 1; i >= 0; --i) {
        ratio *= or_one(light[i].reverse) / or_one(light[i].forward);
        if (!light[i].dirac && (i == 0 || !light[i - 1].dirac))
            sum += ratio;
    }
    return 1 / (1 + sum);
}

} // namespace alternatives
