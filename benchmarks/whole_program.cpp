// A bidirectional path tracer in a box, whole, with three numbers per vertex and with two, so that valgrind
// can count their instructions. The box is convex: nothing is shadowed and rays cost little, so that the
// weights' share of the program is larger than a renderer's. benchmarks/count_program.sh prints the ratio. 1
// if the images differ.
#include "inputs.hpp"
#include <algorithm>
#include <array>
#include <cstdio>

namespace {

constexpr int pixels = 4096, longest_walk = 5;
constexpr float pi = 3.14159265f, albedo = 0.7f;

struct vec {
    float x, y, z;
};
vec operator+(vec a, vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
vec operator-(vec a, vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
vec operator*(float s, vec a) { return {s * a.x, s * a.y, s * a.z}; }
float dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// What a renderer keeps of its weights, by either scheme.
struct two_numbers {
    using state = mis::subpath_state<float>;
    using end = mis::subpath_end<float>;
    mis::path_weights<mis::balance_heuristic, float, mis::connected_surfaces> weigh{
        {}, mis::bidirectional(float(pixels)), {}};

    static mis::end_point<float> light(float area, float direction, float cos) {
        return {mis::pdf_position{1 / area}, mis::pdf_next_event{1 / area}, mis::pdf_direction{direction},
                mis::cosine{cos}, true};
    }
    state start_camera(float direction, float cos) const {
        return weigh.start_camera({mis::pdf_position{1.f}, mis::pdf_next_event{1.f},
                                   mis::pdf_direction{direction}, mis::cosine{cos}, false});
    }
    state start_light(float area, float direction, float cos) const {
        return weigh.start_light(light(area, direction, cos));
    }
    state arrive(state x, float distance2, float cos) const {
        return weigh.arrive(x, mis::squared_distance{distance2}, mis::cosine{cos});
    }
    state scatter(state x, float cos, float forward, float reverse) const {
        return weigh.scatter(x, mis::cosine{cos}, mis::pdf_forward{forward}, mis::pdf_reverse{reverse});
    }
    static end end_at(state x, float cos, float forward, float reverse) {
        return {x, mis::cosine{cos}, mis::pdf_forward{forward}, mis::pdf_reverse{reverse}};
    }
    float connection(const end& camera, const end& l, float distance2) const {
        return weigh.connection(camera, l, mis::squared_distance{distance2});
    }
    float next_event(const end& camera, float area, float direction, float cos, float distance2) const {
        return weigh.next_event(camera, light(area, direction, cos), mis::squared_distance{distance2});
    }
    float camera_connection(float direction, const end& l, float distance2) const {
        return weigh.camera_connection(mis::pdf_direction{direction}, l, mis::squared_distance{distance2});
    }
    float light_hit(state x, float area, float direction) const {
        return weigh.light_hit(x, light(area, direction, 1));
    }
};

struct three_numbers {
    using scheme = alternatives::three_number_weights<1>;
    using state = scheme::state;
    using end = scheme::end;
    scheme weigh{0, 0, float(pixels)};

    state start_camera(float direction, float) const { return {float(pixels) / direction, 0, 0}; }
    state start_light(float area, float direction, float cos) const {
        return {1 / direction, cos * area / direction, 0};
    }
    state arrive(state x, float distance2, float cos) const { return weigh.arrive(x, distance2, cos); }
    state scatter(state x, float cos, float forward, float reverse) const {
        return weigh.scatter(x, cos, forward, reverse);
    }
    static end end_at(state x, float cos, float forward, float reverse) { return {x, cos, forward, reverse}; }
    float connection(const end& camera, const end& l, float distance2) const {
        return weigh.connection(camera, l, distance2);
    }
    float next_event(const end& camera, float area, float direction, float cos, float distance2) const {
        return weigh.next_event(camera, {1 / area, 1 / area, direction, cos, true}, distance2);
    }
    float camera_connection(float direction, const end& l, float distance2) const {
        return weigh.camera_connection({1, 1, direction, 1, false}, l, distance2);
    }
    float light_hit(state x, float area, float direction) const {
        return weigh.light_hit(x, {1 / area, 1 / area, direction, 1, true});
    }
};

// The box [0, 1]^3, diffuse; a square of its ceiling emits 1.
struct point {
    vec position, normal;
};
const point eye{{0.5f, 0.5f, 0.01f}, {0, 0, 1}};
constexpr float light_from = 0.3f, light_size = 0.4f, light_area = light_size * light_size;
bool emits(const point& x) {
    return x.normal.y < -0.5f && std::fabs(x.position.x - 0.5f) < light_size / 2 &&
           std::fabs(x.position.z - 0.5f) < light_size / 2;
}

point trace(vec from, vec direction) {
    const float origin[] = {from.x, from.y, from.z}, along[] = {direction.x, direction.y, direction.z};
    float nearest = 1e30f;
    int wall = 0;
    for (int i = 0; i < 3; ++i) {
        const float t = ((along[i] > 0 ? 1.f : 0.f) - origin[i]) / along[i];
        if (t > 1e-5f && t < nearest)
            nearest = t, wall = i;
    }
    float normal[3] = {};
    normal[wall] = along[wall] > 0 ? -1.f : 1.f;
    return {from + nearest * direction, {normal[0], normal[1], normal[2]}};
}
vec scattered(const point& x, pcg32& rng) {
    std::uniform_real_distribution<float> uniform;
    const float r2 = uniform(rng), r = std::sqrt(r2), phi = 2 * pi * uniform(rng);
    const float a = r * std::cos(phi), b = r * std::sin(phi), c = std::sqrt(1 - r2);
    const vec n = x.normal;
    const vec u = std::fabs(n.x) > 0.5f ? vec{0, 1, 0} : vec{1, 0, 0};
    const vec v = {n.y * u.z - n.z * u.y, n.z * u.x - n.x * u.z, n.x * u.y - n.y * u.x};
    return a * u + b * v + c * n;
}

template <class Scheme> struct vertex {
    point at;
    float throughput;
    float back; // |cos| of the direction that the walk came from
    typename Scheme::state state;
};
template <class Scheme> using walk = std::array<vertex<Scheme>, longest_walk>;

// From the end point's state on; all vertices but the end point.
template <class Scheme>
void continue_walk(const Scheme& w, typename Scheme::state state, point from, vec direction, float throughput,
                   pcg32& rng, walk<Scheme>& vertices) {
    for (int i = 0; i < longest_walk; ++i) {
        const point x = trace(from.position, direction);
        const vec edge = x.position - from.position;
        const float cos = -dot(direction, x.normal);
        state = w.arrive(state, dot(edge, edge), cos);
        vertices[static_cast<std::size_t>(i)] = {x, throughput, cos, state};
        direction = scattered(x, rng);
        const float out = dot(direction, x.normal);
        state = w.scatter(state, out, out / pi, cos / pi);
        throughput *= albedo;
        from = x;
    }
}

// One sample of each pixel; what all techniques add up to.
template <class Scheme> NOT_INLINED double image(const Scheme& w) {
    pcg32 rng(9);
    std::uniform_real_distribution<float> uniform;
    walk<Scheme> camera, light;
    double sum = 0;
    for (int pixel = 0; pixel < pixels; ++pixel) {
        const vec on_film = {uniform(rng) - 0.5f, uniform(rng) - 0.5f, 1};
        const float cos_eye = 1 / std::sqrt(dot(on_film, on_film));
        const auto film_density = [](float cos) { return 1 / (cos * cos * cos); };
        continue_walk(w, w.start_camera(film_density(cos_eye), cos_eye), eye, cos_eye * on_film, 1, rng,
                      camera);

        const point lamp{{light_from + light_size * uniform(rng), 1, light_from + light_size * uniform(rng)},
                         {0, -1, 0}};
        const vec away = scattered(lamp, rng);
        const float cos_lamp = dot(away, lamp.normal);
        continue_walk(w, w.start_light(light_area, cos_lamp / pi, cos_lamp), lamp, away, pi * light_area, rng,
                      light);

        const auto end_at = [&](const vertex<Scheme>& v, float cos) {
            return Scheme::end_at(v.state, cos, cos / pi, v.back / pi);
        };
        for (std::size_t s = 0; s < longest_walk; ++s) {
            const vertex<Scheme>& x = camera[s];
            if (emits(x.at) && s > 0) // the first edge's weight is 1
                sum += static_cast<double>(x.throughput * w.light_hit(x.state, light_area, x.back / pi));
            { // next event
                const vec edge = lamp.position - x.at.position;
                const float distance2 = dot(edge, edge), inverse = 1 / std::sqrt(distance2);
                const float cos = dot(edge, x.at.normal) * inverse,
                            cos_light = -dot(edge, lamp.normal) * inverse;
                if (cos > 0 && cos_light > 0)
                    sum += static_cast<double>(
                        x.throughput * albedo / pi * cos * cos_light / distance2 * light_area *
                        w.next_event(end_at(x, cos), light_area, cos_light / pi, cos_light, distance2));
            }
            for (const vertex<Scheme>& y : light) { // connections
                const vec edge = y.at.position - x.at.position;
                const float distance2 = dot(edge, edge), inverse = 1 / std::sqrt(distance2);
                const float cos = dot(edge, x.at.normal) * inverse, cos_y = -dot(edge, y.at.normal) * inverse;
                if (cos > 1e-4f && cos_y > 1e-4f)
                    sum += static_cast<double>(x.throughput * y.throughput * albedo * albedo / (pi * pi) *
                                               cos * cos_y / distance2 *
                                               w.connection(end_at(x, cos), end_at(y, cos_y), distance2));
            }
        }
        for (const vertex<Scheme>& y : light) { // camera connections
            const vec edge = y.at.position - eye.position;
            const float distance2 = dot(edge, edge), inverse = 1 / std::sqrt(distance2);
            const float cos = edge.z * inverse, cos_y = -dot(edge, y.at.normal) * inverse;
            if (cos > 0 && cos_y > 0 && std::fabs(edge.x) < 0.5f * edge.z &&
                std::fabs(edge.y) < 0.5f * edge.z)
                sum +=
                    static_cast<double>(y.throughput * albedo / pi * cos_y / distance2 * film_density(cos) *
                                        w.camera_connection(film_density(cos), end_at(y, cos_y), distance2));
        }
    }
    return sum / pixels;
}

} // namespace

int main() {
    const double of_three = image(three_numbers()), of_two = image(two_numbers());
    if (of_two > 0 && std::fabs(of_two / of_three - 1) < 1e-4)
        return 0;
    std::printf("three numbers: %.9g, two: %.9g\n", of_three, of_two);
    return 1;
}
