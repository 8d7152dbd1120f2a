// SPDX-License-Identifier: MIT
// Veach's plates for a page: a picture, the weights in it, and what is exact in one of its pixels.
#include "plates_quadrature.hpp"
#include <emscripten.h>
#include <nlohmann/json.hpp>
#include <studies/colors.hpp>

namespace {

using nlohmann::json;
using namespace exact_plates;

constexpr int width = 240, height = 180;
constexpr double exposure = 1.1;

// ---- What the reader has set ----

scene plates = make_scene();
const seen_points points = look(plates, width, height);
setting set;
std::size_t shown = balance; // of the estimators

// ---- Estimates ----

// Calls add(own, light, draw) for each sample of a pass in a pixel. Both techniques have numbers of their
// own, so that another sample of one changes none of the others.
template <class Add> void sample(std::size_t pixel, int pass, Add&& add) {
    const seen_point& at = *points[pixel];
    for (const technique own : {bsdf, light}) {
        std::seed_seq seed{std::uint32_t(pixel), std::uint32_t(pass), std::uint32_t(own)};
        pcg32 rng(seed);
        for (int k = 0; k < int(set.counts[own]); ++k)
            for (std::size_t i = 0; i < (own == light ? light_count : 1); ++i) {
                const draw d = own == bsdf ? draw_bsdf(plates, at, rng) : draw_light(plates, at, i, rng);
                add(own, own == bsdf ? d.source : i, d);
            }
    }
}

double sum_of(const coefficients& alpha) {
    double sum = 0;
    for (const double a : alpha)
        sum += a;
    return sum;
}

// What a sample adds to sum alpha, by optimal weights.
double optimally(const coefficients& alpha, technique own, std::size_t source, double f, const pair& p) {
    const pair& n = set.counts;
    if (!(p[bsdf] > 0 || p[light] > 0)) // outside: only its own technique has a density there
        return -alpha[own == bsdf ? 0 : 1 + source] / n[own];
    return (f - alpha[0] * p[bsdf] - alpha[1 + source] * p[light]) /
           (n[bsdf] * p[bsdf] + n[light] * p[light]);
}

pair effective(const pair& p) { return {set.counts[bsdf] * p[bsdf], set.counts[light] * p[light]}; }

// A pixel of the picture.
dvec3 estimate(std::size_t pixel, const exact* known) {
    dvec3 sum(0);
    for (std::size_t c = 0; known && c < 3; ++c)
        sum[int(c)] = sum_of(known->alpha[c]);
    sample(pixel, 0, [&](technique own, std::size_t source, const draw& d) {
        const pair p = densities(d), q = effective(p);
        for (std::size_t c = 0; known && c < 3; ++c)
            sum[int(c)] += optimally(known->alpha[c], own, source, d.f[int(c)], p);
        if (!known && !is_outside(d))
            sum += d.f * (weights_of(set, q)[shown][own] / q[own]);
    });
    return sum;
}

// A pass by all estimators, channels averaged.
std::array<double, estimators> estimates(std::size_t pixel, int pass, const coefficients& alpha) {
    std::array<double, estimators> sum{};
    sum[optimal] = sum_of(alpha);
    sample(pixel, pass, [&](technique own, std::size_t source, const draw& d) {
        const pair p = densities(d), q = effective(p);
        const double f = studies::direct_light::sum_of(d.f) / 3;
        sum[optimal] += optimally(alpha, own, source, f, p);
        if (is_outside(d))
            return;
        const auto w = weights_of(set, q);
        for (std::size_t h = 0; h < heuristics; ++h)
            sum[h] += w[h][own] * f / q[own];
    });
    return sum;
}

// ---- Pictures ----

using bytes = std::array<unsigned char, std::size_t(4 * width * height)>; // red, green, blue, opaque
bytes picture, weights;

void put(bytes& b, std::size_t pixel, const dvec3& color) {
    for (std::size_t c = 0; c < 3; ++c)
        b[4 * pixel + c] = static_cast<unsigned char>(255 * std::clamp(color[int(c)], 0.0, 1.0) + 0.5);
    b[4 * pixel + 3] = 255;
}

// The lights that the camera sees, smooth at their edges.
dvec3 seen_lights(std::size_t pixel) {
    constexpr int grid = 4;
    dvec3 sum(0);
    for (int k = 0; k < grid * grid; ++k) {
        const double x = int(pixel) % width + (k % grid + 0.5) / grid;
        const double y = int(pixel) / width + (k / grid + 0.5) / grid;
        const hit h = intersect(plates, plates.eye, film_direction(plates, width, height, x, y));
        if (h.light)
            sum += studies::tone_mapped(plates.lights[*h.light].radiance, exposure) / double(grid * grid);
    }
    return sum;
}

void show(std::size_t pixel, const exact* known) {
    static std::vector<dvec3> lights; // of pixels that have been shown; they never change
    while (lights.size() <= pixel)
        lights.push_back(seen_lights(lights.size()));
    dvec3 color = lights[pixel];
    if (points[pixel])
        color += studies::tone_mapped(max(dvec3(0), estimate(pixel, known)), exposure);
    for (int c = 0; c < 3; ++c)
        color[c] = studies::to_srgb(color[c]);
    put(picture, pixel, color);
}

// ---- A pixel ----

constexpr int passes = 4096, passes_shown = 256;

// Mean, variance of passes, and what that is uncertain by, if they are not too rarely large.
struct moments {
    double mean = 0, variance = 0, uncertain = 0;

    explicit moments(const std::vector<double>& x) {
        const double n = double(x.size());
        for (const double v : x)
            mean += v / n;
        double fourth = 0;
        for (const double v : x) {
            const double square = (v - mean) * (v - mean);
            variance += square / (n - 1);
            fourth += square * square / n;
        }
        uncertain = std::sqrt(std::max(0.0, fourth - variance * variance) / n);
    }
};

json explain(std::size_t pixel) {
    if (!points[pixel])
        return {{"surface", -1}};
    const of_lights lights = integrate(plates, *points[pixel], set, fine);
    const exact e = evaluate(plates, set, lights);
    json result{{"surface", points[pixel]->rectangle},
                {"roughness", plates.rectangles[points[pixel]->rectangle].paint.roughness},
                {"mean", e.mean}};
    coefficients alpha{};
    for (std::size_t k = 0; k < alpha.size(); ++k)
        alpha[k] = (e.alpha[0][k] + e.alpha[1][k] + e.alpha[2][k]) / 3;
    std::array<std::vector<double>, estimators> all;
    for (int pass = 0; pass < passes; ++pass) {
        const auto found = estimates(pixel, pass, alpha);
        for (std::size_t h = 0; h < estimators; ++h)
            all[h].push_back(found[h]);
    }
    for (std::size_t h = 0; h < estimators; ++h) {
        const moments seen(all[h]);
        all[h].resize(passes_shown);
        result["estimators"].push_back({{"name", names[h]},
                                        {"variance", e.variance[h]},
                                        {"weight", e.bsdf_weight[h]},
                                        {"passes", all[h]},
                                        {"seen_mean", seen.mean},
                                        {"seen", seen.variance},
                                        {"uncertain", seen.uncertain}});
    }
    return result;
}

std::string answer;

} // namespace

// {"counts": [of BSDF sampling, of light sampling for each light], "beta", "roughness": a factor of the
// plates', "shown": an estimator}
extern "C" EMSCRIPTEN_KEEPALIVE void set_plates(const char* text) {
    const json j = json::parse(text);
    set = {j.at("counts"), j.at("beta")};
    shown =
        std::size_t(std::find(names.begin(), names.end(), j.at("shown").get<std::string>()) - names.begin());
    const scene original = make_scene();
    for (std::size_t i = 0; i < plate_count; ++i)
        plates.rectangles[i].paint.roughness =
            original.rectangles[i].paint.roughness * j.at("roughness").get<double>();
}

// Both images, of width * height pixels, rows from the top.
extern "C" EMSCRIPTEN_KEEPALIVE const unsigned char* plates_picture() { return picture.data(); }
extern "C" EMSCRIPTEN_KEEPALIVE const unsigned char* plates_weights() { return weights.data(); }

// A row of the picture; for optimal weights it needs what weigh_row computes, and comes with it.
extern "C" EMSCRIPTEN_KEEPALIVE void show_row(int row) {
    for (int x = 0; shown != optimal && x < width; ++x)
        show(std::size_t(row * width + x), nullptr);
}

// A row of the mean weights of BSDF sampling, black where nothing is estimated.
extern "C" EMSCRIPTEN_KEEPALIVE void weigh_row(int row) {
    for (int x = 0; x < width; ++x) {
        const auto pixel = std::size_t(row * width + x);
        exact e;
        if (points[pixel])
            e = evaluate(plates, set, integrate(plates, *points[pixel], set, coarse));
        put(weights, pixel,
            e.mean > 0 ? studies::blue_to_orange(std::clamp(e.bsdf_weight[shown], 0.0, 1.0)) : dvec3(0));
        if (shown == optimal)
            show(pixel, &e);
    }
}

// {"surface", "roughness", "mean", "estimators": [{"name", "variance", "weight", "passes", "seen_mean",
// "seen", "uncertain"}, ..]} of a pixel; surface -1: it shows a light, and nothing is estimated.
extern "C" EMSCRIPTEN_KEEPALIVE const char* explain_pixel(int x, int y) {
    answer = explain(std::size_t(y * width + x)).dump();
    return answer.c_str();
}
