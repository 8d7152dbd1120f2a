// SPDX-License-Identifier: MIT
#include "ulp.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <mis/heuristic.hpp>
#include <mis/measure.hpp>
#include <mis/path.hpp>
#include <mis/throughput.hpp>

using namespace test;

TEST_CASE_TEMPLATE("conversions between measures", T, float, double) {
    generator g(1);
    worst_case area, angle, volume, round_trip;
    for (int sample = 0; sample < 100'000; ++sample) {
        const T p = g.log_uniform<T>(-6, 6), cos = g.log_uniform<T>(-3, 0), d2 = g.log_uniform<T>(-6, 6);
        const T sign = g.chance(0.5) ? T(1) : T(-1); // of the cosine: does not matter
        const auto per_area = mis::to_area(mis::per_solid_angle<T>{p}, sign * cos, d2);
        area.see(ulp_error(per_area.value, wide{p} * wide{cos} / wide{d2}), sample);
        angle.see(ulp_error(mis::to_solid_angle(mis::per_area<T>{p}, sign * cos, d2).value,
                            wide{p} * wide{d2} / wide{cos}),
                  sample);
        round_trip.see(ulp_distance(mis::to_solid_angle(per_area, cos, d2).value, p), sample);
        volume.see(ulp_error(mis::to_volume(mis::per_solid_angle<T>{p}, cos, d2).value,
                             wide{p} * wide{cos} / wide{d2}),
                   sample);
    }
    CHECK(area.error <= 2);
    CHECK(angle.error <= 2);
    CHECK(volume.error <= 2);
    CHECK(round_trip.error <= 4);
    CHECK(is_infinite(mis::to_area(mis::per_solid_angle<T>{T(1)}, T(1), T(0)).value));
    CHECK(is_infinite(mis::to_solid_angle(mis::per_area<T>{T(1)}, T(0), T(1)).value));
}

TEST_CASE("a density integrates to the same probability in either measure") {
    // A uniform direction over the sphere hits a disk of radius R at distance h with probability (1 - cos a)
    // / 2.
    const double radius = 2, height = 1.5, step = 1e-4;
    double probability = 0;
    for (double r = step / 2; r < radius; r += step) {
        const double d2 = r * r + height * height;
        const auto p = mis::to_area(mis::per_solid_angle<double>{1 / (4 * 3.141592653589793)},
                                    height / std::sqrt(d2), d2);
        probability += p.value * 2 * 3.141592653589793 * r * step;
    }
    CHECK(probability == doctest::Approx((1 - height / std::hypot(radius, height)) / 2).epsilon(1e-7));
}

TEST_CASE("basic etendue at a refraction is conserved") {
    // A pencil of directions of solid angle dw around angle t is refracted into dw' with eta^2 cos(t) dw the
    // same (Snell's law, by finite differences): so the density per basic etendue of a lobe chosen with
    // probability q is the same number from both sides.
    const double eta_in = 1, eta_out = 1.5, h = 1e-5;
    for (double t : {0.1, 0.5, 1.0, 1.4}) {
        const auto refracted = [&](double angle) { return std::asin(std::sin(angle) * eta_in / eta_out); };
        const double u = refracted(t);
        const double du = (refracted(t + h) - refracted(t - h)) / (2 * h);
        const double solid_angle_ratio = std::sin(u) * du / std::sin(t); // dw' / dw
        // a density per solid angle p on the inner side becomes p / solid_angle_ratio outside
        const double inside = mis::dirac_density(1.0, eta_in, std::cos(t));
        const double outside = mis::dirac_density(1.0, eta_out, std::cos(u));
        CHECK(outside * solid_angle_ratio == doctest::Approx(inside).epsilon(1e-8));
    }
    CHECK(mis::dirac_density(0.5f, 1.5f, -0.8f) == doctest::Approx(0.9));
}

TEST_CASE("shading-normal factor") {
    CHECK(mis::shading_normal_factor(0.5, 0.25, 0.8, 0.4) == doctest::Approx(0.5 * 0.4 / (0.25 * 0.8)));
    CHECK(mis::shading_normal_factor(-0.5, 0.25, 0.8, -0.4) == doctest::Approx(1.0)); // signs do not matter
    CHECK(mis::shading_normal_factor(0.3f, 0.3f, 0.7f, 0.7f) == doctest::Approx(1.0));
    CHECK(mis::shading_normal_factor(0.0, 0.25, 0.8, 0.4) == 0);
    CHECK(mis::shading_normal_factor(0.5, 0.25, 0.8, 0.0) == 0);
    CHECK(mis::shading_normal_factor(0.0, 0.0, 0.8, 0.4) == 0); // no NaN
}

namespace {

// Four vertices, x_1 and x_2 scattering with shading normals; geometry reduced to cosines.
struct shaded_path {
    double to_light_g[4], to_camera_g[4]; // |cos| with the geometric normal, towards x_{i+1} and x_{i-1}
    double to_light_s[4], to_camera_s[4]; // with the shading normal; ends have one normal
    double d2[4];                         // to x_{i+1}
    double pdf_to_light[4], pdf_to_camera[4];
    double bsdf[4];
    double pdf_lens, pdf_lamp, pdf_next_event;
};

double factor_at(const shaded_path& x, int i) {
    return mis::shading_normal_factor(x.to_light_s[i], x.to_light_g[i], x.to_camera_s[i], x.to_camera_g[i]);
}

// The throughput of each of s = 1 ... 4, walked as a renderer would: f |cos_s| / pdf at each vertex of a
// walk, the light walk's with the factor k and its cosine towards the next vertex, f cos cos / d^2 across
// the connection. Connecting evaluates the light walk's vertex with its k as well.
void throughputs(const shaded_path& x, double* out) {
    const auto camera_walk = [&](int last) { // arrives at x_last
        double t = x.to_light_g[0] / (x.pdf_lens * x.pdf_to_light[0]);
        for (int i = 1; i < last; ++i)
            t *= x.bsdf[i] * x.to_light_s[i] / x.pdf_to_light[i];
        return t;
    };
    const auto light_walk = [&](int last) {
        double t = x.to_camera_g[3] / (x.pdf_lamp * x.pdf_to_camera[3]);
        for (int i = 2; i > last; --i)
            t *= x.bsdf[i] * x.to_camera_s[i] * factor_at(x, i) / x.pdf_to_camera[i];
        return t;
    };
    // s = 1: the light walk's x_1 to the lens point
    out[0] = light_walk(1) * x.bsdf[1] * x.to_camera_s[1] * factor_at(x, 1) * x.to_light_g[0] /
             (x.d2[0] * x.pdf_lens);
    // s = 2
    out[1] = camera_walk(1) * x.bsdf[1] * x.to_light_s[1] / x.d2[1] * x.bsdf[2] * x.to_camera_s[2] *
             factor_at(x, 2) * light_walk(2);
    // s = 3: next event
    out[2] = camera_walk(2) * x.bsdf[2] * x.to_light_s[2] * x.to_camera_g[3] / (x.d2[2] * x.pdf_next_event);
    // s = 4: light hit
    out[3] = camera_walk(3);
}

} // namespace

TEST_CASE("shading normals: both routes of densities, and the sampled throughputs, give the same weights") {
    generator g(2);
    for (int sample = 0; sample < 1'000; ++sample) {
        shaded_path x;
        for (int i = 0; i < 4; ++i) {
            x.to_light_g[i] = g.uniform(0.05, 1);
            x.to_camera_g[i] = g.uniform(0.05, 1);
            const bool end = i == 0 || i == 3;
            x.to_light_s[i] = end ? x.to_light_g[i] : g.uniform(0.05, 1);
            x.to_camera_s[i] = end ? x.to_camera_g[i] : g.uniform(0.05, 1);
            x.d2[i] = g.log_uniform<double>(-2, 2);
            x.pdf_to_light[i] = g.log_uniform<double>(-2, 2);
            x.pdf_to_camera[i] = g.log_uniform<double>(-2, 2);
            x.bsdf[i] = g.uniform(0.1, 1);
        }
        x.pdf_lens = g.uniform(0.1, 2);
        x.pdf_lamp = g.uniform(0.1, 2);
        x.pdf_next_event = g.uniform(0.1, 2);

        mis::technique_counts<double> counts = mis::bidirectional(1.0);
        double w_geometric[7], w_shading[7];

        // route 1: the library's records convert with the geometric cosines
        mis::measured_vertex<double> path[4];
        mis::area_vertex<double> shaded[4];
        for (int i = 0; i < 4; ++i) {
            path[i].kind = i == 0   ? mis::vertex_kind::camera
                           : i == 3 ? mis::vertex_kind::light
                                    : mis::vertex_kind::surface;
            path[i].pdf_to_light = x.pdf_to_light[i];
            path[i].pdf_to_camera = x.pdf_to_camera[i];
            path[i].cos_to_light = x.to_light_g[i];
            path[i].cos_to_camera = x.to_camera_g[i];
            path[i].distance2_to_light = x.d2[i];
        }
        path[0].pdf_position = path[0].pdf_next_event = x.pdf_lens;
        path[3].pdf_position = x.pdf_lamp;
        path[3].pdf_next_event = x.pdf_next_event;
        mis::weights(mis::balance, counts, path, 4, w_geometric);

        double s[4], q[4], w_throughput[4];
        const double ones[4] = {1, 1, 1, 1};
        throughputs(x, s);
        mis::densities_from_throughputs(ones, s, 4, q);
        mis::weights(mis::balance, q, w_throughput);
        for (int k = 0; k < 4; ++k)
            CHECK(w_throughput[k] == doctest::Approx(w_geometric[k + 1]).epsilon(1e-12));

        // route 2: shading cosines in every conversion, and the light walk's densities divided by k. f of the
        // path is evaluated with shading cosines by the camera walk, |cos_s| towards the light; the light
        // walk's own products of shading cosines differ from that by k at every vertex it scatters at.
        for (int i = 0; i < 4; ++i) {
            shaded[i].kind = path[i].kind;
            shaded[i].density_from_camera =
                i == 0 ? x.pdf_lens : x.pdf_to_light[i - 1] * x.to_camera_s[i] / x.d2[i - 1];
            shaded[i].density_from_light =
                i == 3 ? x.pdf_lamp : x.pdf_to_camera[i + 1] * x.to_light_s[i] / x.d2[i];
            const bool scatters = i == 1 || i == 2;
            if (scatters)
                shaded[i].density_from_light /= factor_at(x, i);
        }
        shaded[0].next_event = x.pdf_lens;
        shaded[3].next_event = x.pdf_next_event;
        mis::weights(mis::balance, counts, shaded, 4, w_shading);
        for (int k = 0; k < 7; ++k)
            CHECK(w_shading[k] == doctest::Approx(w_geometric[k]).epsilon(1e-12));
    }
}
