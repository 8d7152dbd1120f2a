// Light between patches by two methods, and by both together: bidirectional paths, and an iteration that
// carries the light of all patches along one random direction after another, in ray bundles. After [C]
// Csonka, Szirmay-Kalos, Antal, "Cost-driven multiple importance sampling for Monte-Carlo rendering", 2001,
// sections 4 to 7.
//
// The patch problem, which both solve: surfaces are cut into patches, and wherever light has arrived at a
// patch, it leaves from a new random point of it. So radiance depends on the patch and on the direction
// alone, and a path is a sequence of patches. Wanted is the radiance of each patch that the camera sees
// towards the camera, of paths with up to `longest` reflections. Patches reflect on the side of their
// normals; the other is black.
//
// Terms: that of k reflections is an integral over k - 1 lines between patches and one to a lamp. Paths come
// from the iteration, from walks that the camera sends to the patches that it sees, with a next event at each
// vertex, and from walks that lamps send, which end at each seen patch that they reach. Each path carries,
// for each of its terms, how dense the other two make its lines, relative to its own way.
#pragma once

#include "pixels.hpp"
#include <bpt/vertex.hpp>
#include <mis/allocation.hpp>
#include <mis/sequence.hpp>
#include <stdexcept>

namespace studies::bundles {

using real = double;
using vec = bpt::vec3<real>;
using rgb = bpt::color<real>;

constexpr int most_reflections = 8;

// ---- Patches ----

struct patch {
    vec corner, u, v; // a triangle
    bpt::surface_point<real> point;
    const bpt::material<real>* material = nullptr;
    real area = 0;
    std::size_t triangle = 0; // of the scene
    vec to_eye{0};            // from its centroid, of unit length
};

struct problem {
    bpt::scene<real> scene;
    int longest = most_reflections; // or fewer
    std::vector<patch> patches;
    struct cuts {
        std::size_t first = 0;
        int across = 1;
    };
    std::vector<cuts> of_triangle;         // of the scene: across * across patches, from `first` on
    std::vector<int> view;                 // patches, or -1: places of the image, row by row
    int view_width = 0;                    // and height
    std::vector<char> is_seen;             // of each patch: the camera sees it, and it reflects
    std::vector<std::size_t> seen;         // those
    std::vector<std::size_t> seen_by_kind; // how many of each material

    explicit problem(bpt::scene<real> s) : scene(std::move(s)) {}
    problem(const problem&) = delete; // patches point to materials
    problem& operator=(const problem&) = delete;
};

// Each triangle is cut along its edges into as many parts, so that a place in it tells its patch: row by row
// along ac, in which lower and upper triangles take turns.
inline patch cut(const problem& p, std::size_t triangle, int across, int row, int column, bool is_upper) {
    const auto& t = p.scene.triangles[triangle];
    const real sign = is_upper ? -1 : 1, offset = is_upper ? 1 : 0;
    patch x;
    x.u = sign / across * t.ab;
    x.v = sign / across * t.ac;
    x.corner = t.a + (column + offset) / across * t.ab + (row + offset) / across * t.ac;
    x.point = {x.corner + (x.u + x.v) / real(3), t.normal, t.normal, t.material, t.light};
    x.material = &p.scene.materials[static_cast<std::size_t>(t.material)];
    x.triangle = triangle;
    x.area = length(cross(x.u, x.v)) / 2;
    x.to_eye = normalize(p.scene.camera.position - x.point.position);
    return x;
}
inline int patch_at(const problem& p, std::size_t triangle, real u, real v) {
    const auto& [first, across] = p.of_triangle[triangle];
    const int row = std::min(static_cast<int>(v * across), across - 1),
              column = std::min(static_cast<int>(u * across), across - 1 - row);
    const bool is_upper = column < across - 1 - row && u * across - column + v * across - row > 1;
    return static_cast<int>(first) + row * (2 * across - row) + 2 * column + is_upper;
}

// The patch that a ray meets on the side on which it reflects, or -1; and how far away.
inline int find_patch(const problem& p, const vec& origin, const vec& direction, real* distance = nullptr) {
    const auto hit = bpt::find_hit(p.scene, origin, direction);
    if (distance)
        *distance = hit.distance;
    if (!hit.triangle || dot(hit.triangle->normal, direction) >= 0)
        return -1;
    return patch_at(p, static_cast<std::size_t>(hit.triangle - p.scene.triangles.data()), hit.u, hit.v);
}

// About `count` patches of a scene of triangles, diffuse or glossy ones, lit by rectangles; `view_width`:
// across the image, how many places of it are asked for their patches. Throws std::runtime_error where there
// is anything else in the scene.
inline void make_patches(problem& p, int count, int view_width) {
    bool good = p.scene.spheres.empty() && p.scene.media.empty();
    for (const auto& m : p.scene.materials)
        good = good && (m.kind == bpt::material_kind::diffuse || m.kind == bpt::material_kind::glossy);
    for (const auto& l : p.scene.lights)
        good = good && l.kind == bpt::light_kind::area;
    if (!good)
        throw std::runtime_error("scene '" + p.scene.name + "' has more than patches and area lights");
    real area = 0;
    const auto twice_area = [](const auto& t) { return length(cross(t.ab, t.ac)); };
    for (const auto& t : p.scene.triangles)
        area += twice_area(t);
    for (std::size_t i = 0; i < p.scene.triangles.size(); ++i) {
        const real share = twice_area(p.scene.triangles[i]) / area;
        const int across = std::max(1, static_cast<int>(std::lround(std::sqrt(share * count))));
        p.of_triangle.push_back({p.patches.size(), across});
        for (int row = 0; row < across; ++row)
            for (int k = 0; k < 2 * (across - row) - 1; ++k)
                p.patches.push_back(cut(p, i, across, row, k / 2, k % 2 == 1));
    }
    p.view_width = view_width;
    p.is_seen.resize(p.patches.size());
    const auto place = [&](int k) { return (2 * k + real(1)) / view_width - 1; };
    const auto& camera = p.scene.camera;
    for (int y = 0; y < view_width; ++y)
        for (int x = 0; x < view_width; ++x) {
            const vec through =
                camera.forward + camera.half_extent * (place(x) * camera.right - place(y) * camera.up);
            p.view.push_back(find_patch(p, camera.position, normalize(through)));
            if (const int i = p.view.back(); i >= 0 && p.patches[static_cast<std::size_t>(i)].point.light < 0)
                p.is_seen[static_cast<std::size_t>(i)] = 1;
        }
    p.seen_by_kind.resize(p.scene.materials.size());
    for (std::size_t i = 0; i < p.patches.size(); ++i)
        if (p.is_seen[i]) {
            p.seen.push_back(i);
            ++p.seen_by_kind[static_cast<std::size_t>(p.patches[i].point.material)];
        }
}

inline vec random_point(const patch& x, pcg32& rng) {
    real a = bpt::uniform<real>(rng), b = bpt::uniform<real>(rng);
    if (a + b > 1)
        a = 1 - a, b = 1 - b;
    return x.corner + a * x.u + b * x.v;
}

// ---- What paths carry ----

enum method { bundle, walk, light_walk, methods };
constexpr real bundle_density = 1 / (2 * bpt::pi<real>); // a line along which light goes both ways, [C] 6

// Densities of a path's lines, relative to those of the method that has made it. In float, because memory is
// what a step of the iteration waits for.
using line_densities = mis::sequence_state<float, methods>;
constexpr line_densities no_lines{{1, 1, 1}};

inline line_densities draw(const line_densities& x, method own, real by_bundle, real by_walk,
                           real by_light_walk) {
    const float all[] = {static_cast<float>(by_bundle), static_cast<float>(by_walk),
                         static_cast<float>(by_light_walk)};
    return mis::next_draw(x, all, own);
}

// Light along a ray, term by term: a path with k + 1 reflections has brought light[k].
struct flow {
    int terms = 0;
    glm::vec3 light[most_reflections];
    line_densities lines[most_reflections];
    mis::single_weight_state<real, 2> whole; // what [C]'s single weight makes of all terms
};

inline real brightness(const rgb& c) { return (c.x + c.y + c.z) / 3; }

// Rays that have been cast, of a step's parallel ones and of all others.
struct ray_count {
    std::uint64_t parallel = 0, other = 0;
};

// Light that comes straight from a random point of a lamp; f times the irradiance is reflected. `from_lamp`:
// the density with which lamps send walks along this line, over that of next events.
struct direct_light {
    vec towards{0};
    rgb irradiance{0};
    real from_lamp = 0;
};
inline real from_lamp(const bpt::light<real>& lamp, const patch& x, real cosines, real squared_distance) {
    return lamp.select_emission / lamp.select_next_event * x.area * cosines /
           (bpt::pi<real> * squared_distance);
}
inline direct_light sample_direct(const problem& p, const patch& x, const vec& from, pcg32& rng) {
    const int picked = bpt::pick_light(p.scene, &bpt::light<real>::select_next_event, rng);
    const auto& lamp = p.scene.lights[static_cast<std::size_t>(picked)];
    const vec to = bpt::sample_light_point(p.scene, picked, real(0), rng).point.position;
    const vec edge = to - from, towards = normalize(edge);
    const real cosines =
        std::max(real(0), dot(x.point.normal, towards)) * std::max(real(0), -dot(lamp.normal, towards));
    if (cosines == 0 || !bpt::is_visible(p.scene, from, to))
        return {};
    return {towards, lamp.emission * (cosines / dot(edge, edge) * lamp.area / lamp.select_next_event),
            from_lamp(lamp, x, cosines, dot(edge, edge))};
}

// A line may be drawn at either end. Densities are stated per solid angle where the camera's side is, and
// such is that of a light walk, which leaves patch x for patch y:
//   leaving(x, ..) arrival(y, ..),  p(to) / (area_x |cos_x|)  area_y |cos_y|.
inline real leaving(const patch& x, const vec& from, const vec& to) {
    return bpt::density(*x.material, x.point, from, to) / (x.area * dot(x.point.normal, to));
}
inline real arrival(const patch& x, const vec& from) { return x.area * dot(x.point.normal, from); }

// f |cos|, as either walk multiplies it.
inline rgb scattered(const patch& x, const vec& from, const vec& to) {
    return bpt::evaluate(*x.material, x.point, from, to) * dot(x.point.normal, to);
}

// ---- Walks ----

// A walk from a patch, as if the camera had sent it there: next events at all of its vertices.
inline flow walk_from(const problem& p, std::size_t at, pcg32& rng, ray_count& rays) {
    flow z;
    line_densities lines = no_lines;
    rgb throughput(1);
    real sources[most_reflections], factors[most_reflections], last[methods] = {};
    real densities[most_reflections][2];
    vec from = p.patches[at].to_eye;
    for (;;) {
        const patch& x = p.patches[at];
        // The last line's density as a light walk's is known once it is known where the light comes from.
        const auto lines_with = [&](const vec& towards) {
            return z.terms <= 1 ? lines
                                : draw(lines, walk, last[bundle], last[walk],
                                       last[light_walk] * leaving(x, towards, from));
        };
        const vec place = random_point(x, rng);
        const direct_light lamp = sample_direct(p, x, place, rng);
        const rgb source = bpt::evaluate(*x.material, x.point, from, lamp.towards) * lamp.irradiance;
        const int k = z.terms++;
        ++rays.other;
        z.light[k] = throughput * source;
        z.lines[k] = draw(lines_with(lamp.towards), walk, 1, 1, lamp.from_lamp);
        sources[k] = brightness(source);
        if (z.terms == p.longest || bpt::uniform<real>(rng) >= x.material->survival)
            break;
        const vec to = bpt::sample(*x.material, x.point, from, rng);
        const rgb factor = scattered(x, from, to);
        if (!(brightness(factor) > 0))
            break;
        const int next = find_patch(p, place, to);
        ++rays.other;
        if (next < 0)
            break;
        factors[k] = brightness(factor);
        lines = lines_with(to);
        last[bundle] = densities[k][bundle] = bundle_density;
        last[walk] = densities[k][walk] = bpt::density(*x.material, x.point, from, to);
        last[light_walk] = arrival(x, to);
        throughput *= factor / last[walk];
        from = -to;
        at = static_cast<std::size_t>(next);
    }
    z.whole = mis::end_sequence<real, 2>(sources[z.terms - 1]);
    for (int k = z.terms - 2; k >= 0; --k)
        z.whole = mis::put_in_front(z.whole, sources[k], factors[k], densities[k]);
    return z;
}

// A walk from a lamp: see(patch, term, light towards the eye, lines) at each seen patch.
template <class See> void walk_from_lamp(const problem& p, pcg32& rng, ray_count& rays, See&& see) {
    const int picked = bpt::pick_light(p.scene, &bpt::light<real>::select_emission, rng);
    const auto& lamp = p.scene.lights[static_cast<std::size_t>(picked)];
    vec place = bpt::sample_light_point(p.scene, picked, real(0), rng).point.position;
    vec to = bpt::sample_lobe(lamp.normal, real(1), rng);
    rgb flux = lamp.emission * (bpt::pi<real> * lamp.area / lamp.select_emission);
    line_densities lines = no_lines;
    real left = 0, distance = 0;
    for (int k = 0; k < p.longest; ++k) {
        const int next = find_patch(p, place, to, &distance);
        ++rays.other;
        if (next < 0)
            return;
        const auto at = static_cast<std::size_t>(next);
        const patch& x = p.patches[at];
        const vec from = -to;
        // The last line, as the camera's side makes it, depends on where that is.
        const auto lines_with = [&](const vec& towards_eye) {
            if (k == 0)
                return draw(lines, light_walk, 1, 1,
                            from_lamp(lamp, x, dot(x.point.normal, from) * dot(lamp.normal, to),
                                      distance * distance));
            return draw(lines, light_walk, bundle_density,
                        bpt::density(*x.material, x.point, towards_eye, from), left * arrival(x, from));
        };
        if (p.is_seen[at])
            see(at, k, bpt::evaluate(*x.material, x.point, from, x.to_eye) * flux / x.area,
                lines_with(x.to_eye));
        if (bpt::uniform<real>(rng) >= x.material->survival)
            return;
        const vec out = bpt::sample(*x.material, x.point, from, rng);
        const rgb factor = scattered(x, from, out);
        if (!(brightness(factor) > 0))
            return;
        lines = lines_with(out);
        left = leaving(x, from, out);
        flux *= factor / bpt::density(*x.material, x.point, from, out);
        place = random_point(x, rng);
        to = out;
    }
}

// ---- Ray bundles ----

// Rays along one line, from each triangle of the scene to the side of its normal. Where they meet a triangle,
// and how far away, is linear in where they start: so its corners tell what rays from another one may meet.
// That is what makes bundles cheap.
class parallel_rays {
public:
    parallel_rays(const problem& p, const vec& line) : of(&p), starts(p.scene.triangles.size()) {
        std::vector<plane> planes;
        for (std::size_t i = 0; i < starts.size(); ++i) {
            const auto& t = p.scene.triangles[i];
            const real volume = dot(line, cross(t.ab, t.ac));
            const auto form = [&](const vec& g) { return linear{g / volume, -dot(g, t.a) / volume}; };
            if (volume != 0)
                planes.push_back(
                    {form(cross(t.ac, line)), form(cross(line, t.ab)), form(-cross(t.ab, t.ac)), i});
        }
        for (std::size_t i = 0; i < starts.size(); ++i) {
            const auto& t = p.scene.triangles[i];
            starts[i].along = dot(t.normal, line) > 0 ? line : -line;
            for (plane x : planes) {
                if (starts[i].along != line)
                    x.distance = {-x.distance.gradient, -x.distance.constant};
                const vec corners[] = {t.a, t.a + t.ab, t.a + t.ac};
                real farthest = 0, u = -1, v = -1, rest = -1;
                for (const vec& corner : corners) {
                    farthest = std::max(farthest, x.distance.at(corner));
                    u = std::max(u, x.u.at(corner));
                    v = std::max(v, x.v.at(corner));
                    rest = std::max(rest, 1 - x.u.at(corner) - x.v.at(corner));
                }
                if (farthest > p.scene.epsilon() && u >= 0 && v >= 0 && rest >= 0)
                    starts[i].planes.push_back(x);
            }
        }
    }

    // The direction from a triangle.
    const vec& along(std::size_t triangle) const { return starts[triangle].along; }

    // As the other find_patch() has it.
    int find_patch(std::size_t triangle, const vec& origin) const {
        const real nearest = of->scene.epsilon();
        real best = std::numeric_limits<real>::max(), best_u = 0, best_v = 0;
        std::size_t hit = starts.size();
        for (const plane& x : starts[triangle].planes) {
            const real distance = x.distance.at(origin);
            if (distance <= nearest || distance >= best)
                continue;
            const real u = x.u.at(origin), v = x.v.at(origin);
            if (u >= 0 && v >= 0 && u + v <= 1)
                best = distance, best_u = u, best_v = v, hit = x.triangle;
        }
        if (hit == starts.size() || dot(of->scene.triangles[hit].normal, along(triangle)) >= 0)
            return -1;
        return patch_at(*of, hit, best_u, best_v);
    }

private:
    struct linear {
        vec gradient;
        real constant;
        real at(const vec& x) const { return dot(gradient, x) + constant; }
    };
    struct plane {
        linear u, v, distance;
        std::size_t triangle;
    };
    struct start {
        vec along{0};
        std::vector<plane> planes; // those that rays from there may meet
    };
    const problem* of;
    std::vector<start> starts;
};

// What a patch has after a step: the light that has arrived by the step's direction, and from a lamp.
struct node {
    vec towards{0};
    flow arriving;
    direct_light lamp;
};

// The light that a patch reflects in a direction: a line is put in front of all paths that have arrived.
inline flow reflect(const problem& p, const patch& x, const node& n, const vec& to) {
    flow z;
    z.terms = 1;
    const rgb direct = bpt::evaluate(*x.material, x.point, to, n.lamp.towards) * n.lamp.irradiance;
    z.light[0] = direct;
    z.lines[0] = draw(no_lines, bundle, 1, 1, n.lamp.from_lamp);
    const real source = brightness(direct);
    z.whole = mis::end_sequence<real, 2>(source);
    const rgb factor = scattered(x, to, n.towards);
    if (n.arriving.terms == 0 || !(brightness(factor) > 0))
        return z;
    const real densities[] = {bundle_density, bpt::density(*x.material, x.point, to, n.towards)};
    const glm::vec3 attenuation(factor / bundle_density);
    const real by_light_walk = arrival(x, n.towards);
    for (; z.terms <= n.arriving.terms && z.terms < p.longest; ++z.terms) {
        z.light[z.terms] = attenuation * n.arriving.light[z.terms - 1];
        z.lines[z.terms] =
            draw(n.arriving.lines[z.terms - 1], bundle, bundle_density, densities[walk], by_light_walk);
    }
    z.whole = mis::put_in_front(n.arriving.whole, source, brightness(factor), densities);
    return z;
}

// What then arrives at the patch that it reflects to.
inline flow send(const problem& p, const patch& x, const node& n, const vec& to) {
    flow z = reflect(p, x, n, to);
    const real first = leaving(x, n.lamp.towards, to), later = leaving(x, n.towards, to);
    for (int k = 0; k < z.terms; ++k)
        z.lines[k].relative[light_walk] *= static_cast<float>(k == 0 ? first : later);
    return z;
}

// Steps of the iteration, [C] 6. In each, the light that all patches have reflected is carried to those that
// see them along a random line; light of one reflection more each time. see(patch, flow) gets what each seen
// patch then reflects towards the eye; several calls at once, of different patches. `refresh`: how many steps
// a patch keeps the light of a lamp, for which it needs a ray of its own.
template <class See>
void iterate(const problem& p, int steps, int refresh, int threads, std::uint64_t seed, ray_count& rays,
             See&& see) {
    std::vector<node> nodes(p.patches.size()), next = nodes;
    pcg32 directions(seed);
    constexpr int row = 256;
    const int rows = (static_cast<int>(p.patches.size()) + row - 1) / row;
    std::uint64_t reflecting = 0;
    for (const patch& x : p.patches)
        reflecting += x.point.light < 0;
    for (int step = 0; step < steps; ++step) {
        const vec line = bpt::sample_sphere<real>(directions);
        const parallel_rays bundle_of_rays(p, line);
        const auto in_step = [&](std::uint64_t part, auto&& f) {
            for_each_pixel(row, rows, threads, seed + ((2 * std::uint64_t(step) + part) << 32),
                           [&](std::size_t i, pcg32& rng) {
                               if (i < p.patches.size() && p.patches[i].point.light < 0)
                                   f(i, rng);
                           });
        };
        in_step(0, [&](std::size_t i, pcg32& rng) {
            if (step == 0 || (static_cast<int>(i) + step) % refresh == 0)
                nodes[i].lamp = sample_direct(p, p.patches[i], random_point(p.patches[i], rng), rng);
        });
        in_step(1, [&](std::size_t i, pcg32& rng) {
            const patch& x = p.patches[i];
            node& n = next[i];
            n.towards = bundle_of_rays.along(x.triangle);
            n.lamp = nodes[i].lamp;
            n.arriving.terms = 0;
            if (const int from = bundle_of_rays.find_patch(x.triangle, random_point(x, rng)); from >= 0) {
                const auto j = static_cast<std::size_t>(from);
                n.arriving = send(p, p.patches[j], nodes[j], -n.towards);
            }
            if (p.is_seen[i])
                see(i, reflect(p, x, n, x.to_eye));
        });
        std::swap(nodes, next);
        rays.parallel += reflecting;
        rays.other += step == 0 ? reflecting : reflecting / static_cast<std::uint64_t>(refresh);
    }
}

// The first steps lack long paths: in how many of them there is the term of k + 1 reflections.
inline real steps_with(real steps, int k) { return std::max(real(0), steps - std::max(0, k - 1)); }

// ---- Both together ----

// How many steps, walks from each seen patch of each material, and walks from lamps; expected numbers.
struct counts {
    real steps = 0;
    std::vector<real> walks;
    real light_walks = 0;

    real walks_of(const patch& x) const { return walks[static_cast<std::size_t>(x.point.material)]; }
};

enum class weighting { each_term, single }; // the latter is [C]'s, and biased; it knows no light walks

// The weight of term k over its method's number of samples.
inline real term_factor(const line_densities& lines, method own, const counts& n, const patch& x, int k) {
    const real of_term[] = {steps_with(n.steps, k), n.walks_of(x), n.light_walks};
    line_densities all = lines;
    for (int m = 0; m < methods; ++m)
        all.relative[m] *= static_cast<float>(of_term[m]);
    return mis::term_weight(mis::balance, all, own) / of_term[own];
}

// What a path brings to the mean over all paths of its method.
inline rgb weighted(const flow& z, method own, const counts& n, const patch& x, weighting by) {
    rgb sum(0);
    const real of_two[] = {n.steps, n.walks_of(x)};
    const real whole = by == weighting::single ? mis::single_weight(z.whole, of_two, own) : 0;
    for (int k = 0; k < z.terms; ++k)
        if (const rgb light(z.light[k]); brightness(light) > 0)
            sum += light * (by == weighting::each_term
                                ? term_factor(z.lines[k], own, n, x, k)
                                : whole / (own == bundle ? steps_with(n.steps, k) : of_two[walk]));
    return sum;
}

struct solution {
    std::vector<rgb> by_bundles, by_walks; // of each patch, weighted; the latter: bidirectional paths
    ray_count rays;

    explicit solution(std::size_t patches) : by_bundles(patches, rgb(0)), by_walks(by_bundles) {}
    rgb of(std::size_t i) const { return by_bundles[i] + by_walks[i]; }
};

struct run_options {
    int threads = 1, refresh = 4;
    weighting by = weighting::each_term;
};

// Walks from all seen patches, whole numbers of them at random.
inline void add_walks(const problem& p, const counts& n, std::uint64_t seed, const run_options& o,
                      solution& s) {
    constexpr int row = 64;
    const int rows = (static_cast<int>(p.seen.size()) + row - 1) / row;
    std::vector<ray_count> rays(static_cast<std::size_t>(rows));
    for_each_pixel(row, rows, o.threads, seed, [&](std::size_t k, pcg32& rng) {
        if (k >= p.seen.size())
            return;
        const std::size_t i = p.seen[k];
        const patch& x = p.patches[i];
        const int walks = static_cast<int>(n.walks_of(x) + bpt::uniform<real>(rng));
        for (int w = 0; w < walks; ++w)
            s.by_walks[i] += weighted(walk_from(p, i, rng, rays[k / row]), walk, n, x, o.by);
    });
    for (const ray_count& r : rays)
        s.rays.other += r.other;
}

inline void add_light_walks(const problem& p, const counts& n, std::uint64_t seed, const run_options& o,
                            solution& s) {
    struct find {
        std::size_t patch;
        rgb light;
    };
    constexpr int row = 1024, rows = 64; // at a time
    const auto all = static_cast<std::uint64_t>(n.light_walks);
    for (std::uint64_t first = 0; first < all; first += row * rows) {
        std::vector<std::vector<find>> found(rows);
        std::vector<ray_count> rays(rows);
        for_each_pixel(row, rows, o.threads, seed + (first << 16), [&](std::size_t k, pcg32& rng) {
            if (first + k < all)
                walk_from_lamp(p, rng, rays[k / row],
                               [&](std::size_t i, int term, const rgb& light, const line_densities& lines) {
                                   found[k / row].push_back(
                                       {i, light * term_factor(lines, light_walk, n, p.patches[i], term)});
                               });
        });
        for (std::size_t r = 0; r < rows; ++r) {
            for (const find& f : found[r])
                s.by_walks[f.patch] += f.light;
            s.rays.other += rays[r].other;
        }
    }
}

// One method alone where the others have no samples. Steps and light walks are whole numbers.
inline solution solve(const problem& p, const counts& n, std::uint64_t seed, const run_options& o) {
    solution s(p.patches.size());
    iterate(
        p, static_cast<int>(n.steps), o.refresh, o.threads, seed, s.rays,
        [&](std::size_t i, const flow& z) { s.by_bundles[i] += weighted(z, bundle, n, p.patches[i], o.by); });
    add_walks(p, n, ~seed, o, s);
    add_light_walks(p, n, ~seed ^ (std::uint64_t(1) << 63), o, s);
    return s;
}

// ---- How many of each ----

// In seconds of the processor, say: of a step; of a walk from each of all seen patches of a material; of a
// light walk.
struct costs {
    double step = 0;
    std::vector<double> walks;
    double light_walk = 0;
};

// The counts for a budget in seconds, from a pilot of some steps, [C] 7: those for which the variances of all
// terms, of some seen patches, are least in sum. The pilot is no part of what follows, whose counts depend on
// it.
inline counts find_counts(const problem& p, const costs& c, double budget, int pilot_steps,
                          std::uint64_t seed, const run_options& o, ray_count& rays) {
    constexpr std::size_t most_patches = 200;
    std::vector<std::size_t> kinds; // techniques are steps, light walks, and walks of each of these
    std::vector<double> cost{c.step, c.light_walk};
    for (std::size_t kind = 0; kind < p.seen_by_kind.size(); ++kind)
        if (p.seen_by_kind[kind] > 0) {
            kinds.push_back(kind);
            cost.push_back(c.walks[kind]);
        }
    const std::size_t every = p.seen.size() / most_patches + 1;
    std::vector<int> first(p.patches.size(), -1);
    std::vector<mis::pilot<mis::dynamic>> pilots;
    for (std::size_t k = 0; k < p.seen.size(); k += every) {
        first[p.seen[k]] = static_cast<int>(pilots.size());
        for (int term = 0; term < p.longest; ++term) {
            pilots.emplace_back(static_cast<int>(cost.size()));
            pilots.back().passes = steps_with(pilot_steps, term);
        }
    }
    iterate(p, pilot_steps, o.refresh, o.threads, seed, rays, [&](std::size_t i, const flow& z) {
        if (first[i] < 0)
            return;
        std::vector<double> relative(cost.size());
        relative[0] = 1;
        const auto kind = static_cast<std::size_t>(p.patches[i].point.material);
        const auto own = std::find(kinds.begin(), kinds.end(), kind) - kinds.begin();
        for (int term = 0; term < z.terms; ++term) {
            relative[1] = z.lines[term].relative[light_walk];
            relative[static_cast<std::size_t>(own) + 2] = z.lines[term].relative[walk];
            pilots[static_cast<std::size_t>(first[i] + term)].add_relative(brightness(rgb(z.light[term])),
                                                                           relative, 1.0);
        }
    });
    mis::allocation_options keep;
    keep.least_share = 0.005;
    const std::vector<double> equal(cost.size(), 1);
    const auto found = mis::allocate(pilots.data(), pilots.size(), cost, budget, keep, equal.data());
    counts n{std::max(1.0, std::round(found.counts[0])), std::vector<real>(p.seen_by_kind.size()),
             std::round(found.counts[1])};
    for (std::size_t k = 0; k < kinds.size(); ++k)
        n.walks[kinds[k]] = found.counts[static_cast<int>(k) + 2];
    return n;
}

} // namespace studies::bundles
