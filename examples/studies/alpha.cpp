// Study: how fast does unified path sampling converge for each alpha of the progressive radius? [H] figure 7:
// 2/3 is the fastest. In the scene `pool` all light is refracted twice, so that only merges find it, and its
// image is known in closed form. Writes alpha.csv; alpha.gp draws it. docs/merging.md tells what it shows.
#include "study.hpp"
#include <array>
#include <bpt/algorithms.hpp>
#include <bpt/render.hpp>
#include <numeric>

namespace {

using namespace studies;
using real = double;
using bpt::vec3;

struct options : image_options {
    int repetitions = 16, passes = 256;
    double radius = 0.043; // of the first pass, as a part of the scene's
};

// ---- The image in closed form: paths camera, water, floor, water, light ----

struct water {
    real depth, eta, albedo; // of the floor
};
water water_of(const bpt::scene<real>& scene) {
    real depth = 0, eta = 1, albedo = 0;
    for (const auto& t : scene.triangles) {
        const auto& m = scene.materials[static_cast<std::size_t>(t.material)];
        if (m.kind == bpt::material_kind::glass)
            depth = t.a.y, eta = m.eta;
        else
            albedo = m.diffuse.x;
    }
    return {depth, eta, albedo};
}

// Irradiance of the floor at a distance from below a point light of unit intensity: the flux of a ring of
// directions, I T sin(a) da over the area of the ring that it meets.
real irradiance(const water& w, real height_above_water, real distance) {
    const auto met = [&](real angle, real& derivative, real& transmitted) {
        const real cosine = std::cos(angle), sin_below = std::sin(angle) / w.eta;
        real cos_below = 0;
        transmitted = 1 - bpt::fresnel(cosine, real(1), w.eta, cos_below);
        derivative = height_above_water / (cosine * cosine) +
                     w.depth * cosine / (w.eta * cos_below * cos_below * cos_below);
        return height_above_water * std::tan(angle) + w.depth * sin_below / cos_below;
    };
    real low = 0, high = std::acos(real(0)) * (1 - 1e-12), derivative = 0, transmitted = 0;
    for (int k = 0; k < 60; ++k) {
        const real middle = (low + high) / 2;
        (met(middle, derivative, transmitted) < distance ? low : high) = middle;
    }
    const real there = met(high, derivative, transmitted);
    return transmitted * std::sin(high) / (there * derivative);
}

real radiance(const bpt::scene<real>& scene, const water& w, const vec3<real>& from,
              const vec3<real>& towards) {
    const vec3<real> on_water = from + (from.y - w.depth) / -towards.y * towards;
    real cos_below = 0;
    const real transmitted = 1 - bpt::fresnel(-towards.y, real(1), w.eta, cos_below);
    const vec3<real> below(towards.x / w.eta, -cos_below, towards.z / w.eta);
    const vec3<real> floor = on_water + w.depth / cos_below * below;
    real sum = 0;
    for (const auto& light : scene.lights) {
        const real x = floor.x - light.origin.x, z = floor.z - light.origin.z;
        sum += light.emission.x * irradiance(w, light.origin.y - w.depth, std::sqrt(x * x + z * z));
    }
    return sum * w.albedo / bpt::pi<real> * transmitted / (w.eta * w.eta);
}

// Every fourth row only: the light walks of a pass serve all rows, so that fewer rows tell as much in less
// time.
constexpr int row_step = 4;

std::vector<real> exact_image(const bpt::scene<real>& scene, int width) {
    const water w = water_of(scene);
    pcg32 unused;
    const auto lens = bpt::sample_lens(scene.camera, unused);
    constexpr int steps = 3; // midpoints across a pixel
    std::vector<real> image;
    for (int row = 0; row < width; row += row_step)
        for (int column = 0; column < width; ++column) {
            real sum = 0;
            for (int k = 0; k < steps * steps; ++k) {
                const real x = column + (k % steps + real(0.5)) / steps,
                           y = row + (k / steps + real(0.5)) / steps;
                sum += radiance(
                    scene, w, lens.point.position,
                    bpt::film_to_direction(scene.camera, lens, 2 * x / width - 1, 1 - 2 * y / width));
            }
            image.push_back(sum / (steps * steps));
        }
    return image;
}

// ---- Errors ----

constexpr std::array<real, 10> alphas{0.1, 0.2, 0.3, 0.4, 0.5, 0.6, mis::optimal_alpha<real>, 0.7, 0.8, 0.9};

// 1, 4, 16, ...
std::vector<int> iterations(const options& o) {
    std::vector<int> powers;
    for (int n = 1; n <= o.passes; n *= 4)
        powers.push_back(n);
    return powers;
}

bpt::renderer<real> make_renderer(const bpt::scene<real>& scene, const options& o, real alpha,
                                  int repetition) {
    const real walks = static_cast<real>(o.size) * static_cast<real>(o.size);
    bpt::settings<real> s;
    s.width = o.size;
    s.threads = 1;
    s.longest = 5;
    s.seed = o.seed + static_cast<std::uint64_t>(repetition); // the same for all alphas
    s.merge_radius = o.radius * scene.radius;
    s.counts = bpt::algorithms(walks, s.merge_radius).at("ups").counts;
    s.radius_alpha = alpha;
    return {scene, s};
}

// Mean squared errors, over pixels, after 1, 4, 16, ... passes; and the first pass itself.
struct run_result {
    std::vector<real> squared_errors, first_pass;
};

run_result render(const bpt::renderer<real>& first, const std::vector<int>& due,
                  const std::vector<real>& exact) {
    const int width = first.set.width;
    std::vector<real> sum(exact.size());
    run_result result;
    for (int pass = 0; pass < due.back(); ++pass) {
        const auto renderer = first.at_pass(pass);
        const bpt::photon_map<real> photons(bpt::trace_photons(renderer, pass));
        const auto add = [&](const bpt::contribution<real>& c, const bpt::complete_path<real>&) {
            sum[static_cast<std::size_t>(c.pixel / width / row_step * width + c.pixel % width)] +=
                c.weight * c.value.x;
        };
        for (int row = 0; row < width; row += row_step)
            renderer.render_row(pass, row, add, &photons);
        if (pass == 0)
            result.first_pass = sum;
        if (pass + 1 == due[result.squared_errors.size()]) {
            real squares = 0;
            for (std::size_t i = 0; i < sum.size(); ++i)
                squares += (sum[i] / (pass + 1) - exact[i]) * (sum[i] / (pass + 1) - exact[i]);
            result.squared_errors.push_back(squares / static_cast<real>(sum.size()));
        }
    }
    return result;
}

// RMS errors of one alpha, over all repetitions, and the slope of a line through their logarithms.
struct convergence {
    std::vector<real> rms;
    real slope = 0;
};

convergence convergence_of(const std::vector<run_result>& runs, const std::vector<int>& due) {
    convergence c;
    for (std::size_t i = 0; i < due.size(); ++i) {
        real squares = 0;
        for (const auto& run : runs)
            squares += run.squared_errors[i] / static_cast<real>(runs.size());
        c.rms.push_back(std::sqrt(squares));
    }
    c.slope = log_log_slope(due, c.rms);
    return c;
}

// Variance over squared bias of the first pass: the mean over repetitions tells one from the other.
real variance_over_squared_bias(const std::vector<run_result>& runs, const std::vector<real>& exact) {
    const real count = static_cast<real>(runs.size());
    real of_mean = 0, of_runs = 0; // squared errors, summed over pixels
    for (std::size_t i = 0; i < exact.size(); ++i) {
        real mean = 0;
        for (const auto& run : runs) {
            mean += run.first_pass[i] / count;
            of_runs += (run.first_pass[i] - exact[i]) * (run.first_pass[i] - exact[i]) / count;
        }
        of_mean += (mean - exact[i]) * (mean - exact[i]);
    }
    const real variance = (of_runs - of_mean) * count / (count - 1);
    return variance / (of_mean - variance / count);
}

// [H] 19: variance falls as n^-alpha, squared bias as n^-2(1 - alpha); the slower of the two stays.
real predicted_slope(real alpha) { return -std::min(alpha / 2, 1 - alpha); }

bool run(const options& o) {
    csv_file csv(o.output, "alpha.csv", "alpha,passes,rms_error,slope,predicted_slope");
    const auto scene = bpt::make_scene<real>("pool");
    const auto exact = exact_image(scene, o.size);
    const auto due = iterations(o);
    std::array<std::vector<run_result>, alphas.size()> runs;
    for (auto& of_alpha : runs)
        of_alpha.resize(static_cast<std::size_t>(o.repetitions));
    std::atomic<int> done{0};
    bpt::in_parallel(o.threads, o.repetitions, [&](int repetition) {
        for (std::size_t a = 0; a < alphas.size(); ++a) {
            runs[a][static_cast<std::size_t>(repetition)] =
                render(make_renderer(scene, o, alphas[a], repetition), due, exact);
            show_progress(
                text("pool: %d of %d renderings", ++done, o.repetitions * static_cast<int>(alphas.size())));
        }
    });
    show_progress("");

    std::printf("RMS errors of unified path sampling in the scene pool, by passes\n%-6s", "alpha");
    for (const int n : due)
        std::printf(" %9d", n);
    std::printf(" %9s %9s\n", "slope", "[H] 19");
    std::array<convergence, alphas.size()> results;
    std::size_t steepest = 0, optimal = 0;
    for (std::size_t a = 0; a < alphas.size(); ++a) {
        results[a] = convergence_of(runs[a], due);
        steepest = results[a].slope < results[steepest].slope ? a : steepest;
        optimal = alphas[a] == mis::optimal_alpha<real> ? a : optimal;
        std::printf("%-6.3f", alphas[a]);
        for (std::size_t i = 0; i < due.size(); ++i) {
            std::printf(" %9.6f", results[a].rms[i]);
            csv.add(text("%.4f,%d,%g,%g,%g", alphas[a], due[i], results[a].rms[i], results[a].slope,
                         predicted_slope(alphas[a])));
        }
        std::printf(" %9.4f %9.4f\n", results[a].slope, predicted_slope(alphas[a]));
    }
    const real slope = results[optimal].slope, predicted = predicted_slope(alphas[optimal]);
    bool good = report(std::abs(slope / predicted - 1) <= 0.15,
                       text("alpha = 2/3: the slope is %.3f, %+.1f %% from the predicted %.3f (bar: 15 %%)",
                            slope, 100 * (slope / predicted - 1), predicted));
    good &= report(steepest == optimal,
                   text("alpha = 2/3 falls fastest (the fastest is %.3f)", alphas[steepest]));
    const real ratio = o.repetitions > 1 ? variance_over_squared_bias(runs[0], exact) : 0;
    note(ratio > 0 ? text("variance over squared bias of pass 1: %.1f", ratio)
                   : "too few repetitions to tell the bias of pass 1 from its noise");
    return good;
}

} // namespace

int main(int count, char** arguments) {
    options o;
    command_line app("Convergence of unified path sampling for each alpha of the progressive radius; writes "
                     "alpha.csv.",
                     o);
    app.add("--passes", o.passes, "errors are measured after 1, 4, 16, ... passes up to this", 4, 1 << 20);
    app.add("--repetitions", o.repetitions, "renderings of each alpha", 1, 100000);
    app.add("--radius", o.radius, "within which walks merge in pass 1; 1 is the scene's radius", 1e-6, 1);
    return run_study(app, o, count, arguments, run);
}
