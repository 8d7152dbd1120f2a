// SPDX-License-Identifier: MIT
#include "oracle.hpp"
#include "ulp.hpp"

#include <Eigen/Core>
#include <doctest/doctest.h>
#include <glm/glm.hpp>
#include <mis/path.hpp>

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
