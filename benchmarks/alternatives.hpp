// What renderers write by hand today, from the literature, to compare with. Balance heuristic, float.
#pragma once

#include <cmath>

namespace alternatives {

// Two techniques, power 2, as found in most renderers: squares overflow from 2e19 on.
template <class T> T power(T a, T b) { return a * a / (a * a + b * b); }

// Three numbers per vertex: Georgiev, "Implementing vertex connection and merging", technical report, 2012.
// Power is beta, 1 or 2. Densities are per solid angle, those of a light's point per area, as mis takes them.
template <class T> struct three_numbers { T vcm = 0, vc = 0, vm = 0; };

template <int Power, class T = float> struct three_number_weights {
    T merges;         // raised: photons pi r^2, the merges per connection
    T inverse_merges; // 0 where nothing merges
    T light_walks;

    using state = three_numbers<T>;
    struct end {
        three_numbers<T> state;
        T cos, forward, reverse;
    };
    struct end_point {
        T position, next_event, direction, cos;
        bool hittable;
    };

    static T raise(T x) { return Power == 1 ? x : x * x; }

    state arrive(state d, T distance2, T cos_in) const {
        const T inverse = 1 / raise(cos_in);
        return {d.vcm * raise(distance2) * inverse, d.vc * inverse, d.vm * inverse};
    }
    state scatter(state d, T cos_out, T forward, T reverse) const {
        const T ratio = raise(cos_out / forward), back = raise(reverse);
        return {raise(1 / forward), ratio * (d.vc * back + d.vcm + merges),
                ratio * (d.vm * back + d.vcm * inverse_merges + 1)};
    }
    state scatter_dirac(state d, T cos_out) const {
        return {0, d.vc * raise(cos_out), d.vm * raise(cos_out)};
    }
    T total(const end& x) const { return merges + x.state.vcm + x.state.vc * raise(x.reverse); }
    T connection(const end& camera, const end& light, T distance2) const {
        const T light_from_camera = camera.forward * light.cos / distance2;
        const T camera_from_light = light.forward * camera.cos / distance2;
        return 1 / (raise(light_from_camera) * total(light) + 1 + raise(camera_from_light) * total(camera));
    }
    T next_event(const end& camera, const end_point& l, T distance2) const {
        const T chosen = l.next_event * distance2 / l.cos; // per solid angle
        const T hit = l.hittable ? camera.forward / chosen : 0;
        const T back = l.position * l.direction * camera.cos / (chosen * l.cos);
        return 1 / (raise(hit) + 1 + raise(back) * total(camera));
    }
    T camera_connection(const end_point& lens, const end& light, T distance2) const {
        const T light_from_camera = lens.direction * light.cos / distance2;
        return 1 / (raise(light_from_camera / light_walks) * total(light) + 1);
    }
    T light_hit(state d, const end_point& l) const {
        return 1 / (1 + raise(l.next_event) * d.vcm + raise(l.position * l.direction) * d.vc);
    }
    T merge(state camera, state light, T to_light, T to_camera) const {
        return 1 / (light.vcm * inverse_merges + light.vm * raise(to_light) + 1 +
                    camera.vcm * inverse_merges + camera.vm * raise(to_camera));
    }
};

// A vertex of a walk that keeps its densities per area, in the walk's own direction and against it, and what
// turns densities of directions into them.
template <class T> struct loop_vertex {
    T forward, reverse;
    T cos, distance2; // of the edge to the next vertex; of the edge from the vertex before
    bool dirac;       // a Dirac scatterer
};

template <class T> T or_one(T density) { return density != 0 ? density : 1; }

// A connection's weight by a loop over both walks, of s and t vertices: Veach's thesis, section 10.2.1,
// equation 10.9, as Physically Based Rendering's bidirectional integrator has it. The four densities that the
// connection changes are converted to densities per area first. `camera_end` and `light_end` have densities
// per solid angle.
template <class T>
T loop_connection(const loop_vertex<T>* camera, int s, const loop_vertex<T>* light, int t,
                  const typename three_number_weights<1, T>::end& camera_end,
                  const typename three_number_weights<1, T>::end& light_end, T distance2) {
    const T camera_reverse = light_end.forward * camera_end.cos / distance2;
    const T light_reverse = camera_end.forward * light_end.cos / distance2;
    const auto before = [](const loop_vertex<T>* walk, int n, T reverse) {
        return n > 1 ? reverse * walk[n - 2].cos / walk[n - 1].distance2 : 0;
    };
    const T before_camera = before(camera, s, camera_end.reverse),
            before_light = before(light, t, light_end.reverse);
    const auto one_side = [](const loop_vertex<T>* walk, int n, T last, T last_but_one, int first) {
        T sum = 0, ratio = 1;
        for (int i = n - 1; i >= first; --i) {
            const T reverse = i == n - 1 ? last : i == n - 2 ? last_but_one : walk[i].reverse;
            ratio *= or_one(reverse) / or_one(walk[i].forward);
            if (!walk[i].dirac && (i == 0 || !walk[i - 1].dirac))
                sum += ratio;
        }
        return sum;
    };
    return 1 / (1 + one_side(camera, s, camera_reverse, before_camera, 1) +
                one_side(light, t, light_reverse, before_light, 0));
}

// The same weight by its definition: the product of all densities, for each technique. Per area, along the
// path from the light: vertex i is sampled from the light with from_light[i], from the camera with
// from_camera[i].
template <class T> T product_connection(const T* from_light, const T* from_camera, int n, int t) {
    T sum = 0, own = 0;
    for (int k = 0; k < n;
         ++k) { // k vertices from the light; all from the camera but none from the light alone
        T density = 1;
        for (int i = 0; i < n; ++i)
            density *= i < k ? from_light[i] : from_camera[i];
        sum += density;
        own = k == t ? density : own;
    }
    return own / sum;
}

} // namespace alternatives
