// Study: an area light reflected by a glossy surface, by *BSDF sampling*, by *light sampling*, and by both,
// as the light's size and the surface's roughness vary: where one technique is the better one, where the
// other, and what combining costs and gains. Variances by quadrature beside those of a simulation. Writes
// area_light.csv and area_light_even.csv; area_light.gp draws them. docs/direct_lighting.md tells what it
// shows.
//
// The light is a sphere of radiance 1, seen as a disk, about the direction in which a mirror would reflect
// the camera, and all of it is above the surface. Light sampling is uniform in the cone that it fills. All
// estimates have two samples: a combination one of each technique.
#include "reflection.hpp"
#include "study.hpp"
#include <mis/mis.hpp>
#include <utility>

namespace {

using namespace studies;
using namespace studies::direct_light;

struct options : common_options {
    int steps = 41, passes = 20'000;
};

const dvec3 from = normalize(dvec3(-1, 0, 1)), mirrored(-from.x, 0, from.z);

struct place {
    double below_1; // 1 - cos of the light's radius
    reflector surface;

    double light_density() const { return 1 / (2 * pi * below_1); }
};

enum estimator : std::size_t { bsdf_alone, light_alone, balance, power, estimators };

// What one sample adds, of the first technique (BSDF) or the second: of two samples of one, or one of each.
double contribution(estimator e, bool is_bsdf, double f, double p_bsdf, double p_light) {
    const double own = is_bsdf ? p_bsdf : p_light, other = is_bsdf ? p_light : p_bsdf;
    if (e == balance)
        return mis::balance(own, other) * f / own;
    if (e == power)
        return mis::power(own, other) * f / own;
    return f / own / 2;
}
bool takes(estimator e, bool is_bsdf) { return e >= balance || (e == bsdf_alone) == is_bsdf; }

// ---- By quadrature ----

struct moments {
    double mean = 0, variance = 0, fourth = 0;
};

// Of an estimate: sums of independent samples. Rings about the mirrored direction, as wide as they are far
// out: the lobe is there, however narrow.
moments by_quadrature(const place& at, estimator e) {
    constexpr int rings = 240, azimuths = 64; // the upper half's: the lower is its mirror image
    const double widest = std::acos(1 - at.below_1),
                 narrowest = 1e-4 * std::min(at.surface.roughness, widest);
    moments sum;
    for (const bool is_bsdf : {true, false}) {
        if (!takes(e, is_bsdf))
            continue;
        std::vector<std::pair<double, double>> values; // and their probabilities
        double hit = 0, mean = 0;
        for (int ring = 0; ring < rings; ++ring) {
            const auto edge = [&](int k) {
                return k == 0 ? 0.0 : narrowest * std::pow(widest / narrowest, double(k) / rings);
            };
            const double inner = edge(ring), outer = edge(ring + 1), middle = (inner + outer) / 2;
            const double area = 2 * std::sin(middle) * std::sin((outer - inner) / 2); // cos inner - cos outer
            for (int k = 0; k < azimuths; ++k) {
                const double azimuth = pi * (k + 0.5) / azimuths;
                const dvec3 side(mirrored.z, 0, -mirrored.x);
                const dvec3 to =
                    std::cos(middle) * mirrored +
                    std::sin(middle) * (std::cos(azimuth) * side + std::sin(azimuth) * dvec3(0, 1, 0));
                const double p_bsdf = bsdf_density(at.surface, from, to), p_light = at.light_density();
                const double own = is_bsdf ? p_bsdf : p_light;
                if (!(own > 0))
                    continue;
                const double value =
                    contribution(e, is_bsdf, reflected(at.surface, from, to), p_bsdf, p_light);
                const double probability = own * area * 2 * pi / azimuths;
                values.emplace_back(value, probability);
                hit += probability;
                mean += value * probability;
            }
        }
        // A light sample hits, if only rounding knew.
        values.emplace_back(0, is_bsdf ? std::max(0.0, 1 - hit) : 0);
        double second = 0, fourth = 0;
        for (const auto& [value, probability] : values) {
            const double square = (value - mean) * (value - mean);
            second += square * probability;
            fourth += square * square * probability;
        }
        for (int k = 0; k < (e < balance ? 2 : 1); ++k) {
            sum.fourth += fourth + 6 * sum.variance * second;
            sum.variance += second;
            sum.mean += mean;
        }
    }
    return sum;
}

// ---- By simulation ----

double simulate(const place& at, estimator e, double mean, int passes, pcg32& rng) {
    double squares = 0;
    for (int pass = 0; pass < passes; ++pass) {
        double off = -mean;
        for (int k = 0; k < 2; ++k) {
            const bool is_bsdf = e >= balance ? k == 0 : e == bsdf_alone;
            const dvec3 to = is_bsdf ? sample_bsdf(at.surface, from, rng)
                                     : around(mirrored, at.below_1 * uniform(rng), rng);
            const dvec3 beside = to - mirrored; // well conditioned for a small light
            if (dot(beside, beside) / 2 < at.below_1 && to.z > 0)
                off += contribution(e, is_bsdf, reflected(at.surface, from, to),
                                    bsdf_density(at.surface, from, to), at.light_density());
        }
        squares += off * off;
    }
    return squares / passes;
}

bool run(const options& o) {
    csv_file csv(o.output, "area_light.csv",
                 "radius,roughness,mean,bsdf,light,balance,power,bsdf_over_light,balance_over_better,power_"
                 "over_better");
    csv_file even(o.output, "area_light_even.csv", "radius,roughness");
    pcg32 rng(o.seed);
    int seen = 0, confirmed = 0;
    double worst = 0, most = 0, best = 1e30, apart = 0, farthest = 0;
    double narrow = 1e30, wide = 0; // break-even radii over roughness
    for (int j = 0; j < o.steps; ++j) {
        double previous_degrees = 0, previous = 0;
        for (int i = 0; i < o.steps; ++i) {
            show_progress(text("row %d of %d", j + 1, o.steps));
            // From 0.1 to 40 degrees, and roughness from 0.003 to 1.
            const double degrees = 0.1 * std::pow(400.0, double(i) / (o.steps - 1)),
                         roughness = 0.003 * std::pow(1 / 0.003, double(j) / (o.steps - 1));
            const double half = std::sin(degrees * pi / 360); // of the angle's half
            const place at{2 * half * half, {1, roughness}};
            std::array<moments, estimators> exact;
            for (std::size_t e = 0; e < estimators; ++e) {
                exact[e] = by_quadrature(at, static_cast<estimator>(e));
                apart = std::max(apart, std::abs(exact[e].mean / exact[0].mean - 1));
                if (i % 5 != 0 || j % 5 != 0)
                    continue;
                const double variance = exact[e].variance;
                const double measured = simulate(at, static_cast<estimator>(e), exact[e].mean, o.passes, rng);
                const double error =
                    std::sqrt(std::max(0.0, exact[e].fourth - variance * variance) / o.passes);
                if (error > 0.1 * variance) // its rarest samples decide
                    continue;
                ++seen;
                confirmed += std::abs(measured - variance) <= 4 * error + 1e-6 * variance;
                farthest = std::max(farthest, std::abs(measured - variance) / error);
            }
            const double bsdf = exact[bsdf_alone].variance, light = exact[light_alone].variance,
                         better = std::min(bsdf, light), ratio = exact[balance].variance / better;
            worst = std::max(worst, ratio);
            best = std::min(best, ratio);
            most = std::max(most, std::max(bsdf, light) / better);
            csv.add(text("%g,%g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g", degrees, roughness, exact[0].mean,
                         bsdf, light, exact[balance].variance, exact[power].variance, bsdf / light, ratio,
                         exact[power].variance / better));
            const double logarithm = std::log(bsdf / light);
            if (i > 0 && previous > 0 && logarithm <= 0) { // between this size and the one before
                const double share = previous / (previous - logarithm),
                             break_even = previous_degrees * std::pow(degrees / previous_degrees, share);
                even.add(text("%g,%g", break_even, roughness));
                const double over = break_even * pi / 180 / roughness;
                narrow = std::min(narrow, over);
                wide = std::max(wide, over);
            }
            previous = logarithm;
            previous_degrees = degrees;
        }
    }
    note(text("%d x %d sizes and roughnesses, two samples an estimate; simulations of %d passes, seed %s",
              o.steps, o.steps, o.passes, std::to_string(o.seed).c_str()));
    bool good = report(
        apart < 1e-4, text("all estimators have the same mean by quadrature within %.2g (bar: 1e-4)", apart));
    // Were measured variances normal, one in 16,000 would be further off.
    good &=
        report(seen > 0 && confirmed == seen,
               text("%d of %d variances that a simulation can see are within 4 standard errors of it; the "
                    "farthest is at %.2f",
                    confirmed, seen, farthest));
    note(text(
        "the wrong technique has up to %.2g times the variance of the right one; balance %.2f to %.2f times",
        most, best, worst));
    note(
        text("both alone have the same variance where the light's radius is %.2f to %.2f times the roughness",
             narrow, wide));
    return good;
}

} // namespace

int main(int count, char** arguments) {
    options o;
    command_line app("Variance of BSDF sampling, light sampling and both, by a light's size and a "
                     "surface's roughness; writes area_light.csv and area_light_even.csv.",
                     o);
    app.add("--steps", o.steps, "of size, and of roughness", 2, 1000);
    app.add("--passes", o.passes, "simulated for a variance", 100, 100'000'000);
    return run_study(app, o, count, arguments, run);
}
