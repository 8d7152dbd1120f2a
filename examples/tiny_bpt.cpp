// SPDX-License-Identifier: MIT
// A renderer around mis, complete in one file: vectors, the scene, how surfaces scatter, lights and camera;
// then the three stages that renderers go through, of which main() chooses one:
//   1. path tracing with next event: two techniques, mis::power(a, b)
//   2. all bidirectional techniques: mis::path_weights, two numbers per vertex
//   3. merging (photon mapping): one more technique, one more count
// g++ -O2 -I include examples/tiny_bpt.cpp -o tiny_bpt && ./tiny_bpt tiny.ppm 16
#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <mis/mis.hpp>
#include <numeric>
#include <optional>
#include <thread>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

using mis::vertex_kind;
constexpr float pi = 3.14159265f, infinity = HUGE_VALF;
constexpr float epsilon = 1e-3f;         // rays start and end this far from surfaces
constexpr std::size_t longest_path = 10; // in vertices, from the camera's to the light's

// ---- Vectors, which are colours too, and random numbers ----

struct vec3 {
    float x = 0, y = 0, z = 0;
};
constexpr vec3 operator+(vec3 a, vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr vec3 operator-(vec3 a, vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr vec3 operator*(vec3 a, vec3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
constexpr vec3 operator*(float a, vec3 b) { return {a * b.x, a * b.y, a * b.z}; }
constexpr vec3& operator+=(vec3& a, vec3 b) { return a = a + b; }
constexpr vec3 operator-(vec3 a) { return {-a.x, -a.y, -a.z}; }
constexpr float sum(vec3 a) { return a.x + a.y + a.z; }
constexpr float dot(vec3 a, vec3 b) { return sum(a * b); }
constexpr vec3 cross(vec3 a, vec3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float length(vec3 a) { return std::sqrt(dot(a, a)); }
inline vec3 unit(vec3 a) { return 1 / length(a) * a; }

// Uniform in [0, 1). Every walk has its own, so that the image is the same on any number of threads.
struct generator {
    std::uint64_t state; // SplitMix64
    float operator()() {
        std::uint64_t z = state += 0x9e3779b97f4a7c15;
        z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9;
        z = (z ^ z >> 27) * 0x94d049bb133111eb;
        return float((z ^ z >> 31) >> 40) * 0x1p-24f;
    }
};

// The direction at this cosine and a random azimuth around an axis.
vec3 around(vec3 axis, float cosine, generator& rng) {
    const vec3 u = unit(cross(axis, std::abs(axis.x) < 0.5f ? vec3{1, 0, 0} : vec3{0, 1, 0}));
    const float phi = 2 * pi * rng(), sine = std::sqrt(std::max(0.f, 1 - cosine * cosine));
    return unit(cosine * axis + sine * (std::cos(phi) * u + std::sin(phi) * cross(axis, u)));
}

// Of density (e + 1) / (2 pi) cos^e around n: uniform on the hemisphere for e = 0, by the cosine for e = 1.
vec3 sample_lobe(vec3 n, float e, generator& rng) { return around(n, std::pow(rng(), 1 / (e + 1)), rng); }
// On a disk around the origin, of density 1 / (pi r^2).
vec3 sample_disk(vec3 n, float r, generator& rng) { return r * std::sqrt(rng()) * around(n, 0, rng); }

// ---- The scene ----

// Diffuse with a glossy lobe around the mirror direction, or glass.
struct material {
    vec3 diffuse{}, glossy{}; // albedos
    float exponent = 0;       // of the lobe
    float bumps = 0;          // how far waves tilt the shading normal
    float eta = 1;            // refractive index of glass
    float survival = 0.8f;    // Russian roulette, by the surface alone: the same for both walks
    vertex_kind kind = vertex_kind::surface; // dirac: glass; light: the lamp
};
// A sphere around `corner` where there is a radius, else the parallelogram corner + [0, 1] u + [0, 1] v.
struct shape {
    material surface;
    vec3 corner, u, v;
    float radius = 0;
};
// A thin lens. At distance 1 its picture begins at `corner` and pixels are the squares right x down.
struct camera {
    vec3 position, forward, corner, right, down;
    float lens_radius, focus; // what is at this distance is sharp
    std::size_t width, height;
};
struct scene {
    std::vector<shape> shapes;  // the first is the lamp, which shines along cross(u, v)
    vec3 lamp, horizon, zenith; // radiances, the last two of the sky
    vec3 center;                // of a ball around all shapes
    float radius;
    float lamp_walks, lamp_next_events; // shares of light walks from, of next events towards the lamp
    camera eye;
};

// Where a ray ends or a walk begins. In the sky, `normal` is the direction towards it.
struct point {
    vertex_kind kind; // camera, or infinite_light (the sky), or the surface's
    vec3 position, normal, shading_normal;
    const material* surface = nullptr;
};
bool is_glass(const point& x) { return x.kind == vertex_kind::dirac; }
bool is_sky(const point& x) { return x.kind == vertex_kind::infinite_light; }
bool is_light(const point& x) { return x.kind == vertex_kind::light || is_sky(x); }

// The first point along a ray; the sky where there is none.
point intersect(const scene& s, vec3 origin, vec3 to, float farthest = infinity) {
    const shape* hit = nullptr;
    for (const shape& a : s.shapes) {
        const vec3 o = origin - a.corner, p = cross(to, a.v), q = cross(o, a.u), beside = o - dot(o, to) * to;
        const float half_chord = std::sqrt(a.radius * a.radius - dot(beside, beside)); // NaN: no hit
        const float near = -dot(o, to) - half_chord, ball = near > epsilon ? near : half_chord - dot(o, to);
        const float scale = 1 / dot(a.u, p), u = scale * dot(o, p), v = scale * dot(to, q);
        const float plane = u >= 0 && u <= 1 && v >= 0 && v <= 1 ? scale * dot(a.v, q) : infinity;
        const float distance = a.radius > 0 ? ball : plane;
        if (distance > epsilon && distance < farthest)
            farthest = distance, hit = &a;
    }
    if (!hit)
        return {vertex_kind::infinite_light, {}, to, to};
    const material& m = hit->surface;
    const vec3 p = origin + farthest * to, q = 14 * p;
    const vec3 waves{std::sin(q.y + q.z), std::sin(q.z + q.x), std::sin(q.x + q.y)};
    vec3 n = unit(hit->radius > 0 ? p - hit->corner : cross(hit->u, hit->v));
    n = m.kind == vertex_kind::surface && dot(n, to) > 0 ? -n : n; // both sides scatter
    return {m.kind, p, n, unit(n + m.bumps * waves), &m};
}

// What turns densities per solid angle into those per area: the *geometric* |cos|, and squared distances.
float cosine(const point& x, vec3 to) { return is_sky(x) ? 1 : std::abs(dot(x.normal, to)); }
float squared_distance(const point& x, const point& y) {
    return is_sky(x) || is_sky(y) ? 1 : dot(y.position - x.position, y.position - x.position);
}
vec3 direction(const point& x, const point& y) {
    return is_sky(y) ? y.normal : unit(y.position - x.position);
}
bool is_visible(const scene& s, const point& x, const point& y) {
    const float distance = is_sky(y) ? infinity : length(y.position - x.position) - epsilon;
    return is_sky(intersect(s, x.position, direction(x, y), distance));
}

// ---- How surfaces scatter. Directions point away from them ----

vec3 mirrored(vec3 from, vec3 normal) { return 2 * dot(normal, from) * normal - from; }
// f, without a cosine.
vec3 bsdf(const point& x, vec3 from, vec3 to) {
    const vec3 n = x.shading_normal;
    if (std::min({dot(x.normal, from), dot(x.normal, to), dot(n, from), dot(n, to)}) <= 0)
        return {};
    const float c = std::max(0.f, dot(mirrored(from, n), to)), e = x.surface->exponent;
    return 1 / pi * x.surface->diffuse + (e + 2) / (2 * pi) * std::pow(c, e) * x.surface->glossy;
}

// The density of going on to `to` for a walk that has come from `from`: survival is a part of it.
float density(const point& x, vec3 from, vec3 to) {
    const float share = sum(x.surface->diffuse) / sum(x.surface->diffuse + x.surface->glossy);
    const float c = std::max(0.f, dot(mirrored(from, x.shading_normal), to)), e = x.surface->exponent;
    const float diffuse = std::max(0.f, dot(x.shading_normal, to)) / pi;
    return x.surface->survival * (share * diffuse + (1 - share) * (e + 1) / (2 * pi) * std::pow(c, e));
}

// The two walks transport different things: that from the camera radiance, that from a light flux.
enum class walk_from { camera, light };

// f |cos| as a walk multiplies it. Flux takes Veach's factor where the shading normal is not the geometric.
vec3 scattered(walk_from end, const point& x, vec3 from, vec3 to) {
    const float in = std::abs(dot(x.shading_normal, from)), out = std::abs(dot(x.shading_normal, to));
    const float k = mis::shading_normal_factor(in, cosine(x, from), out, cosine(x, to));
    return (end == walk_from::light ? k * out : out) * bsdf(x, from, to);
}

// How a walk goes on: where to, what its throughput is multiplied with, the densities (of glass,
// probabilities) of going there and, had it come from there, of going back.
struct step {
    vec3 to, factor;
    float forward, reverse;
};
float eta(const point& x, vec3 to) { return dot(x.normal, to) > 0 ? 1 : x.surface->eta; }

// At glass u chooses one of two ways. Its probability, survival included, is the same in the other direction.
step glass_step(walk_from end, const point& x, vec3 from, float u) {
    const vec3 n = dot(x.normal, from) > 0 ? x.normal : -x.normal;
    const float a = eta(x, from), b = eta(x, -from), ratio = a / b, c = dot(n, from);
    const float sine2 = ratio * ratio * (1 - c * c), d = std::sqrt(std::max(0.f, 1 - sine2));
    const float parallel = (b * c - a * d) / (b * c + a * d), across = (a * c - b * d) / (a * c + b * d);
    const float fresnel = sine2 < 1 ? (parallel * parallel + across * across) / 2 : 1;
    const bool reflects = u < fresnel;
    const float p = x.surface->survival * (reflects ? fresnel : 1 - fresnel);
    const float squeezed = !reflects && end == walk_from::camera ? ratio * ratio : 1; // radiance, not flux
    const vec3 to = reflects ? mirrored(from, n) : ratio * (c * n - from) - d * n;
    return {unit(to), squeezed / x.surface->survival * vec3{1, 1, 1}, p, p};
}

std::optional<step> sample_step(walk_from end, const point& x, vec3 from, generator& rng) {
    const material& m = *x.surface;
    if (rng() >= m.survival)
        return std::nullopt;
    if (is_glass(x))
        return glass_step(end, x, from, rng());
    const bool diffuse = rng() * sum(m.diffuse + m.glossy) < sum(m.diffuse);
    const vec3 axis = diffuse ? x.shading_normal : unit(mirrored(from, x.shading_normal));
    const vec3 to = sample_lobe(axis, diffuse ? 1 : m.exponent, rng), f = scattered(end, x, from, to);
    const float forward = density(x, from, to);
    if (!(sum(f) > 0))
        return std::nullopt;
    return step{to, 1 / forward * f, forward, density(x, to, from)};
}

// ---- The ends of a path: lights and the camera ----

// Radiance that leaves a light.
vec3 emitted(const scene& s, const point& y, vec3 to) {
    if (!is_sky(y))
        return dot(y.normal, to) > 0 ? s.lamp : vec3{};
    const float height = std::sqrt(std::max(0.f, y.normal.y));
    return height > 0 ? (1 - height) * s.horizon + height * s.zenith : vec3{};
}

// The densities of a light's point as the start of a walk and as a next event, and of the walk's direction.
mis::end_point<float> light_end(const scene& s, const point& y, vec3 to) {
    const float lamp = is_sky(y) ? 0 : 1 / length(cross(s.shapes[0].u, s.shapes[0].v));
    const float sky = is_sky(y) && y.normal.y > 0 ? 1 / (2 * pi) : 0, disk = pi * s.radius * s.radius;
    return {mis::pdf_position{s.lamp_walks * lamp + (1 - s.lamp_walks) * sky},
            mis::pdf_next_event{s.lamp_next_events * lamp + (1 - s.lamp_next_events) * sky},
            mis::pdf_direction{is_sky(y) ? 1 / disk : std::max(0.f, dot(y.normal, to)) / pi},
            mis::cosine{cosine(y, to)}, true};
}

// On the lamp with this probability, or in the sky. The position is then where a walk comes in, from a disk.
point sample_light(const scene& s, float lamp_share, generator& rng) {
    const shape& lamp = s.shapes[0];
    const bool on_lamp = rng() < lamp_share;
    const float u = rng(), v = rng();
    const vec3 n = on_lamp ? unit(cross(lamp.u, lamp.v)) : sample_lobe({0, 1, 0}, 0, rng);
    const vec3 on_disk = s.center + s.radius * n + sample_disk(n, s.radius, rng);
    const vec3 p = on_lamp ? lamp.corner + u * lamp.u + v * lamp.v : on_disk;
    return {on_lamp ? vertex_kind::light : vertex_kind::infinite_light, p, n, n};
}

// The densities of the lens: of the direction *per pixel*, so that a pixel's walk counts once and light walks
// count as many as there are, for any may reach it. They do not look for the lens: nothing hits it.
mis::end_point<float> camera_end(const camera& eye, vec3 to) {
    const float lens = 1 / (pi * eye.lens_radius * eye.lens_radius), c = dot(eye.forward, to);
    return {mis::pdf_position{lens}, mis::pdf_next_event{lens},
            mis::pdf_direction{1 / (dot(eye.right, eye.right) * c * c * c)}, mis::cosine{c}, false};
}

point sample_lens(const camera& eye, generator& rng) {
    const vec3 position = eye.position + sample_disk(eye.forward, eye.lens_radius, rng);
    return {vertex_kind::camera, position, eye.forward, eye.forward};
}

// From a point of the lens through a random point of the pixel.
vec3 sample_pixel(const camera& eye, const point& lens, std::size_t pixel, generator& rng) {
    const float x = float(pixel % eye.width) + rng();
    const float y = float(pixel / eye.width) + rng();
    return unit(eye.position + eye.focus * (eye.corner + x * eye.right + y * eye.down) - lens.position);
}

// The inverse: the pixel that sees this direction from a point of the lens.
std::optional<std::size_t> pixel_of(const camera& eye, const point& lens, vec3 to) {
    const float c = dot(eye.forward, to), area = dot(eye.right, eye.right);
    const vec3 film = 1 / eye.focus * (lens.position - eye.position) + 1 / c * to - eye.corner;
    const float x = dot(film, eye.right) / area, y = dot(film, eye.down) / area;
    if (!(c > 0 && x >= 0 && x < float(eye.width) && y >= 0 && y < float(eye.height)))
        return std::nullopt;
    return std::size_t(y) * eye.width + std::size_t(x);
}

// The image, apart for each number of path vertices, because that is how techniques are compared.
using film = std::vector<std::array<vec3, longest_path + 1>>;

// Calls f(pixel, its generator) for all pixels, on all processors.
template <class F> void for_each_pixel(std::size_t pixels, long long pass, F&& f) {
    std::atomic<std::size_t> next{0};
    std::vector<std::thread> threads(std::max(1u, std::thread::hardware_concurrency()));
    for (std::thread& thread : threads)
        thread = std::thread([&] {
            for (std::size_t pixel; (pixel = next++) < pixels;)
                f(pixel, generator{std::uint64_t(pass) * pixels + pixel});
        });
    for (std::thread& thread : threads)
        thread.join();
}

// ---- 1. Path tracing with next event ----

// The density of looking for this light point from x, per solid angle, as those of steps are.
float next_event_density(const scene& s, const point& x, const point& y) {
    const auto e = light_end(s, y, -direction(x, y));
    return mis::to_solid_angle(mis::per_area{e.next_event.value}, e.cos.value, squared_distance(x, y)).value;
}

// Steps may find a light by chance, next events look for it, and both make the same paths: mis::power(a, b)
// is the weight of the first. No next event makes the camera's own edge, or one that glass has chosen.
void trace_paths(const scene& s, long long pass, film& image) {
    for_each_pixel(image.size(), pass, [&](std::size_t pixel, generator rng) {
        point x = sample_lens(s.eye, rng);
        vec3 to = sample_pixel(s.eye, x, pixel, rng), throughput{1, 1, 1};
        float step_density = infinity;
        for (std::size_t n = 2; n <= longest_path; ++n) {
            const point previous = std::exchange(x, intersect(s, x.position, to));
            if (is_light(x)) {
                const float weight = mis::power(step_density, next_event_density(s, previous, x));
                image[pixel][n] += weight * throughput * emitted(s, x, -to);
                return;
            }
            if (!is_glass(x) && n < longest_path) {
                const point y = sample_light(s, s.lamp_next_events, rng);
                const vec3 to_y = direction(x, y), f = scattered(walk_from::camera, x, -to, to_y);
                const vec3 light = throughput * f * emitted(s, y, -to_y);
                const float p = next_event_density(s, x, y);
                if (sum(light) > 0 && is_visible(s, x, y))
                    image[pixel][n + 1] += mis::power(p, density(x, -to, to_y)) / p * light;
            }
            const std::optional<step> next = sample_step(walk_from::camera, x, -to, rng);
            if (!next)
                return;
            throughput = throughput * next->factor;
            step_density = is_glass(x) ? infinity : next->forward;
            to = next->to;
        }
    });
}

// ---- 2. All bidirectional techniques ----

using path_weights = mis::path_weights<mis::power_heuristic<>, float>;

// A vertex of a walk: what any renderer keeps, and the two numbers from which all weights follow.
struct vertex : point {
    vec3 towards_previous{}, throughput{}; // back along the walk; of the walk, up to here
    mis::subpath_state<float> state{};
};
using walk = std::vector<vertex>; // the walk's own end of the path first

// A walk until it leaves the scene, is absorbed, finds a light or is long enough. The state is told of its
// start, of where it arrives, and of how it goes on.
walk trace_walk(walk_from end, const scene& s, const path_weights& weigh, std::size_t pixel, generator& rng) {
    const bool camera = end == walk_from::camera;
    const point first = camera ? sample_lens(s.eye, rng) : sample_light(s, s.lamp_walks, rng);
    walk vertices{{first}};
    vec3 to, throughput{1, 1, 1};
    mis::subpath_state<float> state;
    if (camera) {
        to = sample_pixel(s.eye, first, pixel, rng);
        state = weigh.start_camera(camera_end(s.eye, to));
    } else {
        to = is_sky(first) ? -first.normal : sample_lobe(first.normal, 1, rng);
        const mis::end_point<float> light = light_end(s, first, to);
        throughput = light.cos.value / (light.position.value * light.direction.value) * emitted(s, first, to);
        state = weigh.start_light(light);
    }
    while (vertices.size() < longest_path) {
        vertex x{intersect(s, vertices.back().position, to), -to, throughput};
        if (is_light(x) && !camera)
            break; // lights do not scatter
        const mis::squared_distance distance2{squared_distance(vertices.back(), x)};
        x.state = weigh.arrive(state, distance2, mis::cosine{cosine(x, to)});
        vertices.push_back(x);
        const std::optional<step> next = is_light(x) ? std::nullopt : sample_step(end, x, -to, rng);
        if (!next)
            break;
        const mis::pdf_forward forward{next->forward};
        const mis::pdf_reverse reverse{next->reverse};
        state = is_glass(x) ? weigh.scatter_dirac(x.state, mis::cosine{cosine(x, to)}, forward, reverse,
                                                  mis::eta_in{eta(x, -to)}, mis::eta_out{eta(x, next->to)})
                            : weigh.scatter(x.state, mis::cosine{cosine(x, next->to)}, forward, reverse);
        to = next->to;
        throughput = throughput * next->factor;
    }
    return vertices;
}

// A path: s vertices of a camera walk and t of a light walk. If merged, the last ones are the same.
struct joined_walks {
    const vertex *camera, *light;
    std::size_t s, t, pixel; // the last one sees it
    bool merged = false;
    int size() const { return int(s + t) - merged; }
    int technique() const { return int(s) + (merged ? size() - 1 : 0); } // its place among all of the path
};

// Whether all weights of the path, from densities evaluated anew, sum to 1 and have the one of two numbers.
bool is_right(const scene& s, const path_weights& weigh, const joined_walks& p, float weight) {
    const std::size_t n = p.s + p.t - p.merged;
    mis::measured_vertex<float> path[longest_path]; // from the camera to the light
    vec3 to_camera, to_light;
    for (std::size_t i = 0; i < n; ++i, to_camera = -to_light) {
        const bool by_light = i + p.merged >= p.s; // the edge towards the light is of the light walk
        const vertex& x = i < p.s ? p.camera[i] : p.light[n - 1 - i];
        const vertex& y = by_light ? p.light[n - 1 - i] : x; // another one where walks are merged
        auto& r = path[i];
        r.kind = x.kind;
        r.cos_to_camera = cosine(x, to_camera);
        if (i + 1 < n) {
            const vertex& next = i + 1 < p.s ? p.camera[i + 1] : p.light[n - 2 - i];
            const vec3 across = i + 1 < p.s ? -next.towards_previous : direction(x, next);
            to_light = by_light ? y.towards_previous : across;
            r.cos_to_light = cosine(y, to_light);
            r.distance2_to_light = squared_distance(y, next);
        }
        if (i == 0 || i + 1 == n) {
            const auto end = i == 0 ? camera_end(s.eye, to_light) : light_end(s, x, to_camera);
            r.pdf_position = end.position.value;
            r.pdf_next_event = end.next_event.value;
            r.pdf_to_light = r.pdf_to_camera = end.direction.value;
        } else if (is_glass(x)) {
            const bool reflects = dot(x.normal, to_camera) * dot(x.normal, to_light) > 0;
            const step g =
                glass_step(walk_from::camera, x, i < p.s ? to_camera : to_light, reflects ? 0.f : 1.f);
            r.pdf_to_light = mis::dirac_density(g.forward, eta(x, to_light), r.cos_to_light);
            r.pdf_to_camera = mis::dirac_density(g.reverse, eta(x, to_camera), r.cos_to_camera);
        } else {
            r.pdf_to_light = density(x, to_camera, to_light);
            r.pdf_to_camera = density(x, to_light, to_camera);
        }
    }
    float all[mis::technique_count(longest_path)];
    mis::weights(weigh.heuristic, weigh.counts, path, p.size(), all);
    const float total = std::accumulate(all, all + mis::technique_count(p.size()), 0.f);
    return std::abs(total - 1) < 1e-3f && std::abs(all[p.technique()] - weight) < 1e-3f;
}

// A walk's last vertex x with an edge across: the densities of going there and, from there, of going back.
mis::subpath_end<float> walk_end(const vertex& x, vec3 across) {
    return {x.state, mis::cosine{cosine(x, across)}, mis::pdf_forward{density(x, x.towards_previous, across)},
            mis::pdf_reverse{density(x, across, x.towards_previous)}};
}

// The light of a path: what its technique alone estimates, times the weight. What has no count is off.
vec3 join(const scene& s, const path_weights& weigh, const joined_walks& p) {
    using kind = mis::technique_kind;
    const kind technique = mis::technique_at(p.size(), p.technique()).kind;
    const vertex &x = p.camera[p.s - 1], &y = p.t > 0 ? p.light[p.t - 1] : x;
    if (!(mis::count_of(weigh.counts, technique) > 0) || is_glass(x) || is_glass(y))
        return {};
    const vec3 to = p.t > 0 ? direction(x, y) : -x.towards_previous;
    const mis::squared_distance distance2{squared_distance(x, y)};
    const auto fx = [&] { return x.throughput * scattered(walk_from::camera, x, x.towards_previous, to); };
    const auto fy = [&] { return y.throughput * scattered(walk_from::light, y, y.towards_previous, -to); };
    vec3 light;
    float weight = 0;
    if (technique == kind::light_hit) { // the camera walk has met a light
        light = x.throughput * emitted(s, x, x.towards_previous);
        weight = weigh.light_hit(x.state, light_end(s, x, x.towards_previous));
    } else if (technique == kind::next_event) { // its last vertex is joined to a light point sampled for it
        const mis::end_point<float> end = light_end(s, y, -to);
        light = end.cos.value / (distance2.value * end.next_event.value) * fx() * emitted(s, y, -to);
        weight = weigh.next_event(walk_end(x, to), end, distance2);
    } else if (technique == kind::connection) { // the last vertices of both walks are joined
        light = 1 / distance2.value * fx() * fy();
        weight = weigh.connection(walk_end(x, to), walk_end(y, -to), distance2);
    } else if (technique == kind::camera_connection) { // the light walk's is joined to the lens
        const mis::end_point<float> end = camera_end(s.eye, to);
        light = end.direction.value / (distance2.value * weigh.counts.camera_connection) * fy();
        weight = weigh.camera_connection(end, walk_end(y, -to), distance2);
    } else if (technique == kind::merge) { // 3. the walks meet: a density of flux, with the disk in the count
        const vec3 in = y.towards_previous;
        const float flux = std::abs(dot(y.shading_normal, in)) / (cosine(y, in) * weigh.counts.merge);
        light = flux * x.throughput * bsdf(x, x.towards_previous, in) * y.throughput;
        weight = weigh.merge(x.state, y.state, mis::pdf_to_light{density(x, x.towards_previous, in)},
                             mis::pdf_to_camera{density(x, in, x.towards_previous)});
    }
    if (!(sum(light) > 0) || (p.t > 0 && !p.merged && !is_visible(s, x, y)))
        return {};
    assert(p.pixel % 64 != 0 || is_right(s, weigh, p, weight)); // all weights of the path, for some pixels
    return weight * light;
}

// The cube of a grid that holds a position. Eight cubes hold all that is as near as half their size.
std::uint64_t cube(vec3 position, float size) {
    const auto whole = [&](float x) { return std::uint64_t(std::floor(x / size) + 0x1p20f); };
    return whole(position.x) << 42 | whole(position.y) << 21 | whole(position.z);
}

// One walk from each pixel and as many from lights, joined in all ways. Light walks come first, because each
// camera walk may merge with any. What they bring to other pixels waits, so that threads change no order.
void join_walks(const scene& s, mis::technique_counts<float> counts, float r, long long pass, film& image) {
    const path_weights weigh{mis::power, counts};
    std::vector<walk> light_walks(image.size());
    std::vector<std::vector<std::tuple<std::size_t, std::size_t, vec3>>> splats(image.size());
    for_each_pixel(image.size(), 2 * pass, [&](std::size_t i, generator rng) {
        const walk& light = light_walks[i] = trace_walk(walk_from::light, s, weigh, i, rng);
        for (std::size_t t = 2; t <= light.size() && t < longest_path; ++t) {
            const vertex lens{sample_lens(s.eye, rng)};
            if (const auto pixel = pixel_of(s.eye, lens, direction(lens, light[t - 1])))
                splats[i].emplace_back(*pixel, t + 1, join(s, weigh, {&lens, light.data(), 1, t, *pixel}));
        }
    });
    std::unordered_multimap<std::uint64_t, std::pair<const vertex*, std::size_t>> photons; // by cubes
    for (const walk& light : light_walks)
        for (std::size_t t = 2; r > 0 && t <= light.size(); ++t)
            photons.insert({cube(light[t - 1].position, 2 * r), {light.data(), t}});
    for_each_pixel(image.size(), 2 * pass + 1, [&](std::size_t pixel, generator rng) {
        const walk camera = trace_walk(walk_from::camera, s, weigh, pixel, rng);
        for (std::size_t k = 2; k <= camera.size(); ++k) {
            const vertex& x = camera[k - 1];
            const auto add = [&](const vertex* light, std::size_t t, bool merged) {
                const joined_walks p{camera.data(), light, k, t, pixel, merged};
                if (k + t - merged <= longest_path)
                    image[pixel][k + t - merged] += join(s, weigh, p);
            };
            if (is_light(x))
                return add(nullptr, 0, false);
            const vertex y{sample_light(s, s.lamp_next_events, rng)};
            add(&y, 1, false);
            for (std::size_t t = 2; t <= light_walks[pixel].size(); ++t)
                add(light_walks[pixel].data(), t, false);
            for (int corner = 0; corner < 8 && !photons.empty(); ++corner) {
                const vec3 shift{corner & 1 ? r : -r, corner & 2 ? r : -r, corner & 4 ? r : -r};
                const auto [first, last] = photons.equal_range(cube(x.position + shift, 2 * r));
                for (auto i = first; i != last; ++i) {
                    const auto [light, t] = i->second;
                    if (light[t - 1].surface == x.surface && squared_distance(x, light[t - 1]) < r * r)
                        add(light, t, true);
                }
            }
        }
    });
    for (const auto& from_walk : splats)
        for (const auto& [pixel, vertices, light] : from_walk)
            image[pixel][vertices] += light;
}

// ---- The scene that is shown, and the picture ----

scene make_scene(std::size_t width, std::size_t height) {
    const material clay{{0.6f, 0.58f, 0.55f}}, red{{0.65f, 0.12f, 0.08f}}, blue{{0.08f, 0.3f, 0.4f}};
    const material yellow{{0.75f, 0.7f, 0.2f}}, lamp{{}, {}, 0, 0, 1, 0, vertex_kind::light};
    const material copper{{0.06f, 0.02f, 0.01f}, {0.85f, 0.5f, 0.3f}, 60, 0.06f};
    const material glass{{}, {}, 0, 0, 1.5f, 0.98f, vertex_kind::dirac};
    const std::vector<shape> shapes{
        {lamp, {2.4f, 2.9f, -0.9f}, {0, 0, 0.7f}, {-0.45f, 0.55f, 0}},
        {clay, {-4, 0, -4}, {0, 0, 7.5f}, {9.2f, 0, 0}},
        {red, {-3, 0, -2}, {0.6f, 0, 5}, {0, 1.9f, 0}},
        {blue, {-2.4f, 0, 3}, {7.4f, 0, -0.5f}, {0, 1.8f, 0}},
        {glass, {-0.75f, 0.8f, -0.6f}, {}, {}, 0.8f},
        {copper, {1.1f, 0.9f, 0.7f}, {}, {}, 0.9f},
        {yellow, {0.55f, 0.3f, -1.4f}, {}, {}, 0.3f},
    };
    const auto w = float(width), h = float(height);
    const vec3 position{0, 1.6f, -6}, target{-0.2f, 0.8f, -1.1f}, forward = unit(target - position);
    const vec3 right = 1 / w * unit(cross({0, 1, 0}, forward)), down = cross(right, forward);
    const vec3 corner = forward - 0.5f * (w * right + h * down);
    const camera eye{position, forward, corner, right, down, 0.05f, length(target - position), width, height};
    const vec3 shine{80, 66, 46}, horizon{0.9f, 0.5f, 0.3f}, zenith{0.06f, 0.12f, 0.3f};
    return {shapes, shine, horizon, zenith, {0.5f, 1.5f, 0}, 6.4f, 0.8f, 0.5f, eye};
}

// Writes the mean of all passes over what the file holds: a disk that fills up meanwhile loses nothing.
bool write(std::ofstream& file, const camera& eye, const film& image, long long passes) {
    file.seekp(0);
    file << "P6\n" << eye.width << ' ' << eye.height << "\n255\n";
    for (const auto& lengths : image) {
        const vec3 light = 1 / float(passes) * std::accumulate(lengths.begin(), lengths.end(), vec3{});
        for (const float channel : {light.x, light.y, light.z}) {
            const float x = 1 - std::exp(-channel); // bright light approaches white; then sRGB
            const float encoded = x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f;
            file << char(static_cast<unsigned char>(255 * encoded + 0.5f));
        }
    }
    return bool(file.flush());
}

int main(int argc, char** argv) {
    char* end = nullptr;
    const long long passes = argc == 3 ? std::strtoll(argv[2], &end, 10) : 0;
    if (passes < 1 || *end != '\0') {
        std::cerr << "usage: tiny_bpt IMAGE.ppm SAMPLES, a whole number of samples per pixel, at least 1\n";
        return 2;
    }
    const enum { path_tracing, bidirectional, merging } shown = merging; // which of the three
    const scene s = make_scene(600, 400);
    film image(s.eye.width * s.eye.height);
    std::ofstream file(argv[1], std::ios::binary);
    bool written = write(file, s.eye, image, 1); // before anything is rendered
    for (long long pass = 0; written && pass < passes; ++pass) {
        const float walks = float(image.size()), radius = mis::progressive_radius(0.03f, pass + 1);
        if (shown == path_tracing)
            trace_paths(s, pass, image);
        else if (shown == bidirectional)
            join_walks(s, mis::bidirectional(walks), 0, pass, image);
        else
            join_walks(s, mis::connection_and_merging(walks, radius), radius, pass, image);
        written = write(file, s.eye, image, pass + 1);
    }
    if (!written)
        std::cerr << "tiny_bpt: cannot write " << argv[1] << '\n';
    return written ? 0 : 2;
}
