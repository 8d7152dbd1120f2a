// SPDX-License-Identifier: MIT
#include "oracle.hpp"
#include "ulp.hpp"

#include <Eigen/Core>
#include <doctest/doctest.h>
#include <glm/glm.hpp>
#include <mis/path.hpp>
#include <mis/verify/shadow_walk.hpp>

using namespace test;
using mis::vertex_kind;
using oracle::heuristic_kind;

// A renderer's own vectors: a - b and a dot product found by argument-dependent lookup, nothing else.
namespace own {
struct vec {
    double x, y, z;
};
vec operator-(const vec& a, const vec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
double dot(const vec& a, const vec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
} // namespace own

namespace {

using point = mis::path_vertex<own::vec>;

own::vec scaled(const own::vec& a, double k) { return {a.x * k, a.y * k, a.z * k}; }

own::vec random_unit(generator& g) {
    for (;;) {
        const own::vec v{g.uniform(-1, 1), g.uniform(-1, 1), g.uniform(-1, 1)};
        const double length2 = own::dot(v, v);
        if (length2 > 0.01 && length2 < 1)
            return scaled(v, 1 / std::sqrt(length2));
    }
}

// |cos| from positions, straight from the definition and in long double.
long double cosine(const point& from, const point& to) {
    if (from.kind == vertex_kind::medium || from.kind == vertex_kind::infinite_light)
        return 1;
    const own::vec edge = to.kind == vertex_kind::infinite_light ? to.normal : to.position - from.position;
    const long double x = edge.x, y = edge.y, z = edge.z;
    return std::fabs(from.normal.x * x + from.normal.y * y + from.normal.z * z) /
           std::sqrt(x * x + y * y + z * z);
}

long double distance2(const point& a, const point& b) {
    if (b.kind == vertex_kind::infinite_light)
        return 1;
    const own::vec e = b.position - a.position;
    return static_cast<long double>(e.x) * e.x + static_cast<long double>(e.y) * e.y +
           static_cast<long double>(e.z) * e.z;
}

// The densities per area of a path of positions, from their definition, [J] 2.
oracle::path path_of(const std::vector<point>& x) {
    oracle::path p = oracle::flags_of(x.data(), static_cast<int>(x.size()));
    for (std::size_t i = 0; i < x.size(); ++i) {
        p.from_camera.push_back(i == 0 ? wide{x[0].pdf_position}
                                       : wide{x[i - 1].pdf_to_light} * wide{cosine(x[i], x[i - 1])} *
                                             wide{x[i].pdf_distance_from_camera} /
                                             wide{distance2(x[i - 1], x[i])});
        p.from_light.push_back(
            i == x.size() - 1 ? wide{x[i].pdf_position}
                              : wide{x[i + 1].pdf_to_camera} * wide{cosine(x[i], x[i + 1])} *
                                    wide{x[i].pdf_distance_from_light} / wide{distance2(x[i], x[i + 1])});
    }
    p.camera_next_event = x.front().pdf_next_event;
    p.light_next_event = x.back().pdf_next_event;
    return p;
}

// Vertices in a box, with normals that no edge grazes: rounding of positions must not decide.
std::vector<point> random_positions(generator& g, int n, bool media) {
    std::vector<point> x(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) {
        point& v = x[static_cast<std::size_t>(i)];
        const double u = g.uniform();
        v.kind = i == 0       ? vertex_kind::camera
                 : i == n - 1 ? (u < 0.4 ? vertex_kind::infinite_light : vertex_kind::light)
                 : u < 0.2    ? vertex_kind::dirac
                 : u < 0.4    ? (media ? vertex_kind::medium : vertex_kind::surface)
                              : vertex_kind::surface;
        v.dirac = (i == 0 || i == n - 1) && g.chance(0.3);
        v.position = {g.uniform(-1, 1) + 2 * i, g.uniform(-1, 1), g.uniform(-1, 1)};
        v.pdf_to_light = g.log_uniform<double>(-2, 2);
        v.pdf_to_camera = g.log_uniform<double>(-2, 2);
        v.pdf_position = g.log_uniform<double>(-2, 2);
        v.pdf_next_event = g.log_uniform<double>(-2, 2);
        if (v.kind == vertex_kind::medium) {
            v.pdf_distance_from_camera = g.log_uniform<double>(-1, 1);
            v.pdf_distance_from_light = g.log_uniform<double>(-1, 1);
        }
    }
    for (std::size_t i = 0; i < x.size(); ++i)
        do
            x[i].normal = random_unit(g);
        while (
            (i > 0 && x[i].kind != vertex_kind::infinite_light && cosine(x[i], x[i - 1]) < 0.1L) ||
            (i + 1 < x.size() && cosine(x[i], x[i + 1]) < 0.1L) ||
            (i + 1 < x.size() && x[i + 1].kind == vertex_kind::infinite_light &&
             cosine(x[i], x[i + 1]) < 0.1L) ||
            (i + 1 == x.size() && x[i].kind == vertex_kind::infinite_light && cosine(x[i - 1], x[i]) < 0.1L));
    return x;
}

mis::technique_counts<double> all_counts() {
    mis::technique_counts<double> c = mis::connection_and_merging(100.0, 0.1);
    c.direct = 50;
    c.camera_hit = 20;
    return c;
}

template <class T> mis::technique_counts<T> converted(const mis::technique_counts<double>& c) {
    mis::technique_counts<T> r;
    r.camera_hit = static_cast<T>(c.camera_hit);
    r.camera_connection = static_cast<T>(c.camera_connection);
    r.direct = static_cast<T>(c.direct);
    r.connection = static_cast<T>(c.connection);
    r.next_event = static_cast<T>(c.next_event);
    r.light_hit = static_cast<T>(c.light_hit);
    r.merge = static_cast<T>(c.merge);
    return r;
}

template <class Vec, class T> mis::path_vertex<Vec> converted(const point& v, T) {
    const auto vector = [](const own::vec& a) {
        const T x = static_cast<T>(a.x), y = static_cast<T>(a.y), z = static_cast<T>(a.z);
        if constexpr (sizeof(Vec) == 4 * sizeof(T))
            return Vec(x, y, z, T(0)); // the vectors with an alignment of their own
        else
            return Vec(x, y, z);
    };
    mis::path_vertex<Vec> r;
    r.kind = v.kind;
    r.dirac = v.dirac;
    r.position = vector(v.position);
    r.normal = vector(v.normal);
    r.pdf_to_light = static_cast<T>(v.pdf_to_light);
    r.pdf_to_camera = static_cast<T>(v.pdf_to_camera);
    r.pdf_position = static_cast<T>(v.pdf_position);
    r.pdf_next_event = static_cast<T>(v.pdf_next_event);
    r.pdf_distance_from_camera = static_cast<T>(v.pdf_distance_from_camera);
    r.pdf_distance_from_light = static_cast<T>(v.pdf_distance_from_light);
    return r;
}

// Largest relative difference, above weights of 1e-12, from the weights of the products.
template <class T> double difference(const std::vector<T>& w, const std::vector<wide>& exact) {
    double worst = 0;
    for (std::size_t k = 0; k < w.size(); ++k) {
        const double e = static_cast<double>(oracle::to_long_double(exact[k]));
        worst = std::max(worst, std::fabs(static_cast<double>(w[k]) - e) / (e + 1e-12));
    }
    return worst;
}

template <class Vec, class T> double difference_of_records(std::uint64_t seed) {
    generator g(seed);
    double worst = 0;
    for (int sample = 0; sample < 3'000; ++sample) {
        const int n = g.integer(2, 10);
        const auto positions = random_positions(g, n, true);
        const auto counts = all_counts();
        const auto exact =
            oracle::weights({heuristic_kind::balance}, oracle::densities(counts, path_of(positions)));
        std::vector<mis::path_vertex<Vec>, Eigen::aligned_allocator<mis::path_vertex<Vec>>> path;
        for (const point& v : positions)
            path.push_back(converted<Vec>(v, T()));
        std::vector<T> w(static_cast<std::size_t>(mis::technique_count(n)));
        mis::weights(mis::balance, converted<T>(counts), path.data(), n, w.data());
        worst = std::max(worst, difference(w, exact));

        // measured once, then used as the other two records
        std::vector<mis::measured_vertex<T>> measured;
        std::vector<mis::area_vertex<T>> areas;
        for (int i = 0; i < n; ++i) {
            measured.push_back(mis::measure(path.data(), n, i));
            areas.push_back(mis::area_densities(path.data(), n, i));
        }
        mis::weights(mis::balance, converted<T>(counts), measured.data(), n, w.data());
        worst = std::max(worst, difference(w, exact));
        mis::weights(mis::balance, converted<T>(counts), areas.data(), n, w.data());
        worst = std::max(worst, difference(w, exact));
    }
    return worst;
}

} // namespace

TEST_CASE("records with any vector type have the weights of the products") {
    // In float, the positions (up to 20) and normals are rounded before anything is computed: 1e-4.
    CHECK(difference_of_records<glm::dvec3, double>(1) < 1e-12);
    CHECK(difference_of_records<Eigen::Vector3d, double>(1) < 1e-12);
    CHECK(difference_of_records<Eigen::Vector4d, double>(1) < 1e-12);
    CHECK(difference_of_records<glm::vec3, float>(1) < 1e-4);
    CHECK(difference_of_records<Eigen::Vector3f, float>(1) < 1e-4);
    CHECK(difference_of_records<Eigen::Vector4f, float>(1) < 1e-4);
}

TEST_CASE("conversions of a record, one by one") {
    // camera at the origin, a surface 2 away seen at 60 degrees, a medium vertex 3 away, an infinite light
    // above
    point x[4];
    x[0].kind = vertex_kind::camera;
    x[0].position = {0, 0, 0};
    x[0].normal = {0, 0, 1};
    x[0].pdf_position = 7;
    x[0].pdf_next_event = 11;
    x[0].pdf_to_light = 10;
    x[1].position = {0, 0, 2};
    x[1].normal = {std::sqrt(0.75), 0, -0.5};
    x[1].pdf_to_light = 5;
    x[1].pdf_to_camera = 4;
    x[2].kind = vertex_kind::medium;
    x[2].position = {3, 0, 2};
    x[2].normal = {0, 0, 1}; // unused
    x[2].pdf_to_light = 0.3;
    x[2].pdf_to_camera = 0.2;
    x[2].pdf_distance_from_camera = 0.9;
    x[2].pdf_distance_from_light = 0.8;
    x[3].kind = vertex_kind::infinite_light;
    x[3].normal = {0, 1, 0};
    x[3].pdf_to_camera = 0.6;
    x[3].pdf_position = 0.05;
    x[3].pdf_next_event = 0.06;

    const auto area = [&](int i) { return mis::area_densities(x, 4, i); };
    CHECK(area(0).density_from_camera == 7);
    CHECK(area(0).next_event == 11);
    CHECK(area(0).density_from_light == doctest::Approx(4.0 * 1 / 4));
    CHECK(area(1).density_from_camera == doctest::Approx(10 * 0.5 / 4));
    CHECK(area(1).density_from_light == doctest::Approx(0.2 * std::sqrt(0.75) / 9));
    CHECK(area(2).density_from_camera == doctest::Approx(5 * 0.9 / 9)); // per volume: no cosine
    CHECK(area(2).density_from_light == doctest::Approx(0.6 * 0.8)); // from infinity: no distance, no cosine
    CHECK(area(3).density_from_camera == doctest::Approx(0.3));      // per solid angle
    CHECK(area(3).density_from_light == 0.05);
    CHECK(area(3).next_event == 0.06);

    x[2].kind = vertex_kind::surface; // now with |cos| towards the light's direction
    x[2].normal = {0, 0.25, std::sqrt(1 - 0.0625)};
    CHECK(area(2).density_from_light == doctest::Approx(0.6 * 0.8 * 0.25));
}

TEST_CASE("scaling the scene, radius included, changes no weight; without the radius merges change") {
    generator g(2);
    double worst = 0, unscaled_radius = 0;
    for (int sample = 0; sample < 3'000; ++sample) {
        const int n = g.integer(3, 10);
        auto path = random_positions(g, n, false); // in media, merges are weighed with volumes instead
        const double scale = g.log_uniform<double>(-3, 3), radius = 0.1;
        std::vector<double> before(static_cast<std::size_t>(mis::technique_count(n))), after(before),
            wrong(before);
        mis::weights(mis::power, mis::connection_and_merging(100.0, radius), path.data(), n, before.data());
        for (point& v : path) {
            v.position = scaled(v.position, scale);
            const double per_area = 1 / (scale * scale);
            if (v.kind == vertex_kind::infinite_light) {
                v.pdf_to_camera *= per_area; // of the disk; pdf_position is per solid angle
            } else {
                v.pdf_position *= per_area;
                v.pdf_next_event *= per_area;
            }
        }
        mis::weights(mis::power, mis::connection_and_merging(100.0, radius * scale), path.data(), n,
                     after.data());
        mis::weights(mis::power, mis::connection_and_merging(100.0, radius), path.data(), n, wrong.data());
        for (std::size_t k = 0; k < before.size(); ++k) {
            worst = std::max(worst, std::fabs(after[k] - before[k]) / (before[k] + 1e-12));
            unscaled_radius = std::max(unscaled_radius, std::fabs(wrong[k] - before[k]));
        }
    }
    CHECK(worst < 1e-12);
    CHECK(unscaled_radius > 0.5);
}

// ---- Shadow walks ----

namespace {

using shadow = mis::verify::shadow_walk<own::vec>;

mis::end_point<double> end_of(const point& x, double direction) {
    return {mis::pdf_position{x.pdf_position}, mis::pdf_next_event{x.pdf_next_event},
            mis::pdf_direction{direction}, mis::cosine{0.5}, !x.dirac}; // positions tell its cosine
}

// What a renderer says of vertex i when a walk leaves it; survival of a half in all of it.
void leave(const std::vector<point>& path, std::size_t i, bool from_camera, shadow& walk) {
    const point& x = path[i];
    const double forward = from_camera ? x.pdf_to_light : x.pdf_to_camera;
    const double reverse = from_camera ? x.pdf_to_camera : x.pdf_to_light;
    if (x.kind != vertex_kind::dirac) {
        walk.scatter(mis::pdf_forward{forward}, mis::pdf_reverse{reverse}, x.merge_factor);
    } else { // from air into water, seen from the camera; the probabilities that give these densities
        const auto to_camera = static_cast<double>(cosine(x, path[i - 1]));
        const auto to_light = static_cast<double>(cosine(x, path[i + 1]));
        const double in = from_camera ? 1 : 1.33, out = from_camera ? 1.33 : 1;
        walk.scatter_dirac(mis::pdf_forward{forward / (out * out * (from_camera ? to_light : to_camera))},
                           mis::pdf_reverse{reverse / (in * in * (from_camera ? to_camera : to_light))},
                           mis::eta_in{in}, mis::eta_out{out});
    }
    walk.note(&mis::recorded_vertex::survival, 0.5);
}

// Along the path from its end to x_last, which it has left for a join.
shadow walk_along(const std::vector<point>& path, bool from_camera, std::size_t last) {
    const std::size_t n = path.size();
    shadow walk;
    const point &camera = path[0], &light = path[n - 1];
    if (from_camera)
        walk.start_camera(camera.position, camera.normal, end_of(camera, camera.pdf_to_light));
    else
        walk.start_light(light.position, light.normal, end_of(light, light.pdf_to_camera), light.kind);
    for (std::size_t i = from_camera ? 0 : n - 1; i != last;) {
        const point& x = path[i];
        const point& y = path[i = from_camera ? i + 1 : i - 1];
        walk.arrive(
            y.kind, y.position, y.normal,
            mis::pdf_distance_forward{from_camera ? y.pdf_distance_from_camera : y.pdf_distance_from_light},
            mis::pdf_distance_reverse{from_camera ? x.pdf_distance_from_light : x.pdf_distance_from_camera});
        if (i > 0 && i < n - 1)
            leave(path, i, from_camera, walk);
    }
    return walk;
}

// The record that two shadow walks make of a path, as technique t has made it.
mis::path_record shadow_record(const std::vector<point>& path, mis::technique t,
                               const mis::technique_counts<double>& counts, double radius) {
    const std::size_t n = path.size();
    const auto s = static_cast<std::size_t>(t.camera_vertices);
    const bool merges = t.kind == mis::technique_kind::merge;
    shadow camera, light;
    if (s > 0)
        camera = walk_along(path, true, s - 1);
    if (s < n)
        light = walk_along(path, false, merges ? s - 1 : s);
    if (s == n)
        camera.hit(end_of(path[n - 1], path[n - 1].pdf_to_camera));
    if (s == 0)
        light.hit(end_of(path[0], path[0].pdf_to_light));
    const bool joined = s > 0 && s < n && !merges;
    return mis::verify::record_of(t.kind, counts, camera, light, 0.25, radius,
                                  joined ? path[s].pdf_distance_from_camera : 1,
                                  joined ? path[s - 1].pdf_distance_from_light : 1);
}

double relative_difference(double a, double b) { return a == b ? 0 : std::fabs(a - b) / std::fabs(b); }

} // namespace

TEST_CASE("shadow walks note the records of their paths, whoever makes them") {
    generator g(3);
    const auto counts = all_counts();
    int compared = 0;
    double worst = 0;
    for (int sample = 0; sample < 300; ++sample) {
        const int n = g.integer(2, 9);
        std::vector<point> path = random_positions(g, n, true);
        for (point& x : path)
            x.merge_factor = g.log_uniform<double>(-1, 1);
        for (int k = 0; k < mis::technique_count(n); ++k) {
            const mis::technique t = mis::technique_at(n, k);
            if (!mis::detail::is_possible(path.data(), n, t))
                continue;
            const mis::path_record exact = mis::record_of(counts, path.data(), n, t, 0.25, 0.1);
            const mis::path_record noted = shadow_record(path, t, counts, 0.1);
            ++compared;
            REQUIRE(noted.vertices.size() == exact.vertices.size());
            REQUIRE(noted.technique == exact.technique);
            REQUIRE(noted.counts.merge == exact.counts.merge);
            REQUIRE(noted.radius == 0.1);
            REQUIRE(noted.weight == 0.25);
            for (std::size_t i = 0; i < exact.vertices.size(); ++i) {
                const mis::recorded_vertex &x = exact.vertices[i], &y = noted.vertices[i];
                const bool first = i == 0, last = i + 1 == exact.vertices.size();
                REQUIRE(x.kind == y.kind);
                REQUIRE(x.dirac == y.dirac);
                const auto compare = [&](double mis::recorded_vertex::*field) {
                    worst = std::max(worst, relative_difference(y.*field, x.*field));
                };
                if (first || last) {
                    compare(&mis::recorded_vertex::pdf_position);
                    compare(&mis::recorded_vertex::pdf_next_event);
                }
                if (!first) {
                    compare(&mis::recorded_vertex::cos_to_camera);
                    compare(&mis::recorded_vertex::pdf_to_camera);
                    compare(&mis::recorded_vertex::pdf_distance_from_camera);
                }
                if (!last) {
                    compare(&mis::recorded_vertex::cos_to_light);
                    compare(&mis::recorded_vertex::distance2_to_light);
                    compare(&mis::recorded_vertex::pdf_to_light);
                    compare(&mis::recorded_vertex::pdf_distance_from_light);
                }
                if (!first && !last) {
                    if (x.kind != vertex_kind::dirac)
                        compare(&mis::recorded_vertex::merge_factor);
                    CHECK(y.survival == 0.5);
                }
                if (x.kind == vertex_kind::dirac)
                    CHECK((y.eta_to_camera == 1 && y.eta_to_light == 1.33));
            }
        }
    }
    CHECK(compared > 1000);
    CHECK(worst < 4e-15); // a Dirac vertex' densities are divided by their etendue, and multiplied
}

TEST_CASE("shadow walks: merged photons, point lights, and walks that start anew") {
    using mis::cosine;
    const mis::end_point<double> end{mis::pdf_position{2.0}, mis::pdf_next_event{3.0},
                                     mis::pdf_direction{5.0}, cosine{1.0}, false};
    shadow camera, light;
    camera.start_camera({0, 0, 9}, {0, 0, 1}, end); // of the pixel before
    camera.arrive(vertex_kind::surface, {1, 1, 1}, {0, 0, 1});
    camera.start_camera({0, 0, 2}, {0, 0, 1}, end);
    camera.arrive(vertex_kind::surface, {0, 0, 0}, {0, 0, 1});
    camera.scatter(mis::pdf_forward{0.7}, mis::pdf_reverse{0.6});
    camera.note(&mis::recorded_vertex::survival, 0.9);
    light.start_light({3, 0, 4}, {0, 0, 0}, end);
    light.arrive(vertex_kind::surface, {0.5, 0, 0.5}, {0.6, 0, 0.8}); // 0.7 away from the camera's vertex
    light.note(&mis::recorded_vertex::survival, 0.8);
    const auto r = mis::verify::record_of(mis::technique_kind::merge, mis::connection_and_merging(100.0, 1.0),
                                          camera, light, 0.5, 1.0);
    REQUIRE(r.vertices.size() == 3);
    CHECK(r.technique == mis::technique{mis::technique_kind::merge, 2});
    CHECK(r.counts.merge == doctest::Approx(100));
    CHECK(r.vertices[0].distance2_to_light == 4);
    CHECK(r.vertices[1].distance2_to_light == doctest::Approx(2.5 * 2.5 + 3.5 * 3.5)); // from the photon
    CHECK(r.vertices[1].cos_to_camera == 1);
    CHECK(r.vertices[1].cos_to_light ==
          doctest::Approx((0.6 * 2.5 + 0.8 * 3.5) / std::sqrt(2.5 * 2.5 + 3.5 * 3.5)));
    CHECK(r.vertices[1].pdf_to_light == 0.7);
    CHECK(r.vertices[1].pdf_to_camera == 0.6);
    CHECK(r.vertices[1].survival == 0.9);
    CHECK(r.vertices[1].photon_survival == 0.8);
    CHECK(r.vertices[2].cos_to_camera == 1); // a point has no normal
    CHECK(r.vertices[2].pdf_to_camera == 5);
    CHECK(r.vertices[2].dirac);

    mis::verify::shadow_walk<own::vec, false> off; // compiles, and does nothing
    off.start_camera(own::vec{0, 0, 2}, own::vec{0, 0, 1}, end);
    off.arrive(vertex_kind::surface, own::vec{}, own::vec{});
    off.scatter(mis::pdf_forward{0.7}, mis::pdf_reverse{0.6});
    off.note(&mis::recorded_vertex::survival, 0.9);
    CHECK(sizeof off == 1);
}
