// SPDX-License-Identifier: MIT
// Ray bundles, walks and both together have the expectation that the patch problem's definition has.
#include <doctest/doctest.h>
#include <functional>
#include <studies/bundles_model.hpp>

using namespace studies::bundles;

namespace {

// A cube, lit by its whole ceiling and seen from inside: a glossy floor, a red, a green and three white
// walls.
enum material : std::size_t { lamp, white, red, green, glossy, materials };

bpt::scene<real> cube() {
    bpt::scene<real> s;
    s.name = "cube";
    s.materials.resize(materials);
    const auto paint = [&](material m, const rgb& diffuse) {
        s.materials[m].diffuse = diffuse;
        s.materials[m].survival = std::max({diffuse.x, diffuse.y, diffuse.z, 0.2});
    };
    paint(lamp, rgb(0));
    paint(white, rgb(0.75));
    paint(red, {0.7, 0.2, 0.1});
    paint(green, {0.2, 0.6, 0.1});
    s.materials[glossy] = {bpt::material_kind::glossy, rgb(0.2), rgb(0.6), 20, 1, 0.8, -1};
    const auto quad = [&](const vec& a, const vec& b, const vec& d, material m) {
        const vec c = b + d - a, normal = normalize(cross(b - a, d - a));
        const int light = m == lamp ? 0 : -1;
        s.triangles.push_back({a, b - a, c - a, normal, {normal, normal, normal}, int(m), light});
        s.triangles.push_back({a, c - a, d - a, normal, {normal, normal, normal}, int(m), light});
    };
    quad({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, glossy);
    quad({0, 1, 0}, {1, 1, 0}, {0, 1, 1}, lamp);
    quad({0, 0, 0}, {0, 1, 0}, {0, 0, 1}, red);
    quad({1, 0, 0}, {1, 0, 1}, {1, 1, 0}, green);
    quad({0, 0, 1}, {0, 1, 1}, {1, 0, 1}, white);
    quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, white);
    s.clusters.push_back({vec(0), std::numeric_limits<real>::max(), 0, s.triangles.size()});
    bpt::light<real> l;
    l.emission = {1, 0.9, 0.8};
    l.origin = {0, 1, 0}, l.edge_u = {1, 0, 0}, l.edge_v = {0, 0, 1};
    l.normal = {0, -1, 0};
    l.area = 1;
    s.lights.push_back(l);
    s.camera.position = {0.45, 0.55, 0.05};
    s.camera.right = {-1, 0, 0}, s.camera.up = {0, 1, 0};
    s.camera.half_extent = 1.3;
    s.center = vec(0.5);
    return s;
}

// Means over the seen patches of a material.
using by_material = std::array<double, materials>;
by_material means_of(const problem& p, const std::function<rgb(std::size_t)>& of) {
    by_material sums{};
    for (const std::size_t i : p.seen)
        sums[std::size_t(p.patches[i].point.material)] += brightness(of(i));
    for (std::size_t m = 0; m < materials; ++m)
        sums[m] /= std::max(1.0, double(p.seen_by_kind[m]));
    return sums;
}

// Of runs.
struct statistics {
    by_material sum{}, squares{};
    int runs = 0;

    void add(const by_material& x) {
        for (std::size_t m = 0; m < materials; ++m)
            sum[m] += x[m], squares[m] += x[m] * x[m];
        ++runs;
    }
    double mean(std::size_t m) const { return sum[m] / runs; }
    double error2(std::size_t m) const { return (squares[m] / runs - mean(m) * mean(m)) / (runs - 1); }
};

// ---- The definition: directions uniform on the hemisphere, light only where it is hit, no roulette ----

rgb brdf(const bpt::material<real>& m, const vec& n, const vec& from, const vec& to) {
    const double cosine = std::max(0.0, dot(2 * dot(n, from) * n - from, to));
    return m.diffuse / 3.14159265358979 +
           m.specular * ((m.exponent + 2) / (2 * 3.14159265358979) * std::pow(cosine, m.exponent));
}
bool contains(const patch& x, const vec& place) {
    const vec d = place - x.corner, n = cross(x.u, x.v);
    const double square = dot(n, n), a = dot(cross(d, x.v), n) / square, b = dot(cross(x.u, d), n) / square;
    return std::abs(dot(d, n)) < 1e-9 && a >= 0 && b >= 0 && a + b <= 1;
}
vec to_wall(const vec& from, const vec& direction) { // of the cube, from within
    double distance = 1e9;
    for (int k = 0; k < 3; ++k)
        distance = std::min(distance, ((direction[k] > 0 ? 1.0 : 0.0) - from[k]) / direction[k]);
    return from + distance * direction;
}
rgb radiance_by_definition(const problem& p, std::size_t at, pcg32& rng) {
    rgb throughput(1);
    vec from = p.patches[at].to_eye;
    for (int reflections = 0; reflections < p.longest; ++reflections) {
        const patch& x = p.patches[at];
        const vec to = bpt::sample_lobe(x.point.normal, 0.0, rng); // uniform
        const vec start = random_point(x, rng), place = to_wall(start, to);
        throughput *= brdf(*x.material, x.point.normal, from, to) * (dot(x.point.normal, to) * 6.283185307);
        if (place.y > 1 - 1e-9)
            return throughput * p.scene.lights[0].emission;
        for (at = 0; at < p.patches.size() && !contains(p.patches[at], place);)
            ++at;
        if (at == p.patches.size()) // between two
            return rgb(0);
        from = -to;
    }
    return rgb(0);
}

statistics by_definition(const problem& p, int runs) {
    statistics s;
    pcg32 rng(5);
    for (int run = 0; run < runs; ++run)
        s.add(means_of(p, [&](std::size_t i) { return radiance_by_definition(p, i, rng); }));
    return s;
}

// The largest distance of two means, in standard errors.
double largest_z(const statistics& a, const statistics& b) {
    double largest = 0;
    for (const std::size_t m : {white, red, green, glossy}) {
        const double z = (a.mean(m) - b.mean(m)) / std::sqrt(a.error2(m) + b.error2(m));
        largest = std::max(largest, std::abs(z));
    }
    return largest;
}

} // namespace

TEST_CASE("a place tells its patch") {
    problem p(cube());
    make_patches(p, 300, 32);
    pcg32 rng(1);
    for (int k = 0; k < 20'000; ++k) {
        const auto i = std::size_t(std::uniform_int_distribution<std::size_t>(0, p.patches.size() - 1)(rng));
        const vec place = random_point(p.patches[i], rng), n = p.patches[i].point.normal;
        REQUIRE(find_patch(p, place + 0.25 * n, -n) == int(i));
    }
}

TEST_CASE("parallel rays meet what rays meet") {
    problem p(bpt::make_scene<real>("glossy_floor"));
    make_patches(p, 2000, 32);
    pcg32 rng(2);
    int met = 0, apart = 0;
    for (int line = 0; line < 200; ++line) {
        const vec along = bpt::sample_sphere<real>(rng);
        const parallel_rays rays(p, along);
        for (int k = 0; k < 500; ++k) {
            const auto i =
                std::size_t(std::uniform_int_distribution<std::size_t>(0, p.patches.size() - 1)(rng));
            const vec start = random_point(p.patches[i], rng);
            const std::size_t triangle = p.patches[i].triangle;
            const int one = rays.find_patch(triangle, start),
                      other = find_patch(p, start, rays.along(triangle));
            met += one >= 0;
            apart += one != other; // on an edge
        }
    }
    CHECK(met > 50'000);
    CHECK(apart <= 2);
}

// Eye, x, y, lamp; x and y diffuse. The iteration draws the line between x and y; what a walk from x, and one
// from the lamp by y, would have drawn it with is asked of their patches' albedo and cosines alone.
TEST_CASE("bundles know with which densities walks would have made their paths") {
    problem p(cube());
    make_patches(p, 120, 48);
    pcg32 rng(3);
    int paths = 0;
    while (paths < 1000) {
        const auto any = [&] {
            return std::uniform_int_distribution<std::size_t>(0, p.patches.size() - 1)(rng);
        };
        const patch &x = p.patches[any()], &y = p.patches[any()];
        const auto is_diffuse = [](const patch& z) {
            return z.point.material != lamp && z.point.material != glossy;
        };
        const vec edge = random_point(y, rng) - random_point(x, rng), to = normalize(edge);
        if (!is_diffuse(x) || !is_diffuse(y) || dot(x.point.normal, to) < 0.01 ||
            -dot(y.point.normal, to) < 0.01 || dot(x.point.normal, x.to_eye) < 0.01)
            continue;
        ++paths;
        constexpr double pi = 3.14159265358979;
        const direct_light arriving{normalize(y.point.normal + 0.5 * bpt::sample_sphere<real>(rng)), rgb(1),
                                    0.7};
        const node at_y{vec(0), {}, arriving};
        const flow at_x = reflect(p, x, {to, send(p, y, at_y, -to), arriving}, x.to_eye);
        REQUIRE(at_x.terms == 2);
        const auto& lines = at_x.lines[1].relative;
        const double by_walk = x.material->survival * dot(x.point.normal, to) / pi,
                     by_light_walk =
                         0.7 * (y.material->survival / pi) / y.area * x.area * dot(x.point.normal, to);
        CHECK(lines[walk] / lines[bundle] == doctest::Approx(by_walk * 2 * pi).epsilon(1e-5));
        CHECK(lines[light_walk] / lines[bundle] == doctest::Approx(by_light_walk * 2 * pi).epsilon(1e-5));
    }
}

TEST_CASE("bundles, walks and both have the expectation of the definition") {
    problem p(cube());
    p.longest = 5;
    make_patches(p, 120, 48);
    const statistics truth = by_definition(p, 6'000);
    // 28 comparisons: of a right program one of 5,000 seeds fails. Few steps lack long paths; few walks end
    // before they are long; where a material has no walks, the steps are alone.
    struct way {
        std::string name;
        counts n;
        int runs;
    };
    const way ways[] = {
        {"bundles", {40, {0, 0, 0, 0, 0}, 0}, 250},      {"walks", {0, {0, 2, 2, 2, 2}, 0}, 500},
        {"light walks", {0, {0, 0, 0, 0, 0}, 300}, 500}, {"3 steps", {3, {0, 0.7, 0.7, 3, 2}, 0}, 2000},
        {"1 step", {1, {0, 1, 1, 1, 1}, 100}, 2000},     {"some", {30, {0, 0, 0.3, 2, 20}, 500}, 200}};
    std::uint64_t seed = 1;
    for (const auto& way : ways) {
        CAPTURE(way.name);
        statistics s;
        for (int run = 0; run < way.runs; ++run) {
            const solution found = solve(p, way.n, seed++, {1, 3, weighting::each_term});
            s.add(means_of(p, [&](std::size_t i) { return found.of(i); }));
        }
        CHECK(largest_z(s, truth) <= 4.5);
    }
    // Counts that depend on a pilot of the run's own.
    statistics s;
    for (int run = 0; run < 150; ++run) {
        ray_count rays;
        const run_options o{1, 3, weighting::each_term};
        const counts n = find_counts(p, {10, {1, 1, 1, 1, 1}, 0.01}, 200, 6, seed + (1 << 20), o, rays);
        const solution found = solve(p, n, seed++, o);
        s.add(means_of(p, [&](std::size_t i) { return found.of(i); }));
    }
    CHECK(largest_z(s, truth) <= 4.5);
}

TEST_CASE("one weight for all terms, as published, is biased between patches, too") {
    problem p(cube());
    p.scene.materials[glossy].exponent = 100;
    p.longest = 5;
    make_patches(p, 120, 48);
    statistics of[2];
    for (const weighting by : {weighting::each_term, weighting::single})
        for (std::uint64_t run = 0; run < 350; ++run) {
            const solution found =
                solve(p, {80, {0, 12, 12, 12, 12}, 0}, 1000 * std::uint64_t(by) + run, {1, 3, by});
            of[std::size_t(by)].add(means_of(p, [&](std::size_t i) { return found.of(i); }));
        }
    // By chance with one of 400,000 seeds.
    CHECK(largest_z(of[0], of[1]) >= 5);
    CHECK(of[1].mean(glossy) > 1.05 * of[0].mean(glossy));
}
