// What renderers write by hand today, from the literature, to compare with. Balance heuristic, float.
#pragma once

#include <cmath>

namespace alternatives {

// Two techniques, power 2, as found in most renderers: squares overflow from 2e19 on.
inline float power(float a, float b) { return a * a / (a * a + b * b); }

// Three numbers per vertex: Georgiev, "Implementing vertex connection and merging", technical report, 2012.
// Power is beta, 1 or 2. Densities are per solid angle, those of a light's point per area, as mis takes them.
struct three_numbers {
    float vcm = 0, vc = 0, vm = 0;
};

template <int Power> struct three_number_weights {
    float merges;         // raised: photons pi r^2, the merges per connection
    float inverse_merges; // 0 where nothing merges
    float light_walks;

    struct end {
        three_numbers state;
        float cos, forward, reverse;
    };
    struct end_point {
        float position, next_event, direction, cos;
        bool hittable;
    };

    static float raise(float x) { return Power == 1 ? x : x * x; }

    three_numbers arrive(three_numbers d, float distance2, float cos_in) const {
        const float inverse = 1 / raise(cos_in);
        return {d.vcm * raise(distance2) * inverse, d.vc * inverse, d.vm * inverse};
    }
    three_numbers scatter(three_numbers d, float cos_out, float forward, float reverse) const {
        const float ratio = raise(cos_out / forward), back = raise(reverse);
        return {raise(1 / forward), ratio * (d.vc * back + d.vcm + merges),
                ratio * (d.vm * back + d.vcm * inverse_merges + 1)};
    }
    three_numbers scatter_dirac(three_numbers d, float cos_out) const {
        return {0, d.vc * raise(cos_out), d.vm * raise(cos_out)};
    }
    float total(const end& x) const { return merges + x.state.vcm + x.state.vc * raise(x.reverse); }
    float connection(const end& camera, const end& light, float distance2) const {
        const float light_from_camera = camera.forward * light.cos / distance2;
        const float camera_from_light = light.forward * camera.cos / distance2;
        return 1 / (raise(light_from_camera) * total(light) + 1 + raise(camera_from_light) * total(camera));
    }
    float next_event(const end& camera, const end_point& l, float distance2) const {
        const float chosen = l.next_event * distance2 / l.cos; // per solid angle
        const float hit = l.hittable ? camera.forward / chosen : 0;
        const float back = l.position * l.direction * camera.cos / (chosen * l.cos);
        return 1 / (raise(hit) + 1 + raise(back) * total(camera));
    }
    float camera_connection(const end_point& lens, const end& light, float distance2) const {
        const float light_from_camera = lens.direction * light.cos / distance2;
        return 1 / (raise(light_from_camera / light_walks) * total(light) + 1);
    }
    float light_hit(three_numbers d, const end_point& l) const {
        return 1 / (1 + raise(l.next_event) * d.vcm + raise(l.position * l.direction) * d.vc);
    }
    float merge(three_numbers camera, three_numbers light, float to_light, float to_camera) const {
        return 1 / (light.vcm * inverse_merges + light.vm * raise(to_light) + 1 +
                    camera.vcm * inverse_merges + camera.vm * raise(to_camera));
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
