// What is exact at a point of Veach's plates: means, weights and variances by each heuristic and by optimal
// weights, by quadrature. BSDF sampling takes n samples, light sampling m of each light. These are five
// techniques, of which two have a density at any point of a light.
//
// f and the densities of light sampling are 0 but in lights, so each light is integrated by itself, in polar
// coordinates (rho, phi) about the direction that a mirror would reflect the camera to. There lobes of any
// width are smooth functions of asinh(rho / roughness), and where a ray of constant phi enters and leaves a
// light is known. Each ray is cut where weights jump and where something else gets in front of the light.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <mis/heuristic.hpp>
#include <studies/plates_model.hpp>
#include <vector>

namespace exact_plates {

using namespace studies::plates;

enum heuristic : std::size_t { average, balance, power, cutoff, maximum, heuristics };
constexpr std::size_t optimal = heuristics, estimators = heuristics + 1;
constexpr std::array<const char*, estimators> names{"average", "balance", "power",
                                                    "cutoff",  "maximum", "optimal"};

struct setting {
    pair counts{4, 1}; // of BSDF sampling; of light sampling, for each light
    double beta = 2;
};

// Both techniques' densities of one sample, where a light has been found.
inline pair densities(const draw& d) { return {d.p[bsdf], double(light_count) * d.p[light]}; }

// Of both techniques, by each heuristic; q: n_i p_i.
inline std::array<pair, heuristics> weights_of(const setting& s, const pair& q) {
    std::array<pair, heuristics> w;
    mis::weights(mis::average, q, w[average]);
    mis::weights(mis::balance, q, w[balance]);
    mis::weights(mis::power_heuristic{s.beta}, q, w[power]);
    mis::weights(mis::cutoff, q, w[cutoff]);
    mis::weights(mis::maximum, q, w[maximum]);
    return w;
}

// ---- Integrals over a light ----

struct integrals {
    enum number { light, of_bsdf, of_light, bsdf_bsdf, bsdf_light, light_light, f_bsdf, f_light, squares };
    // f; p_i; p_i p_k / D; f p_i / D; f^2 / D; then, of each heuristic, w f of BSDF sampling, and the sum
    // over techniques of w^2 f^2 / (n p). f: mean of channels.
    std::array<double, 9 + 2 * heuristics> sum{};

    double& by_bsdf(std::size_t h) { return sum[9 + h]; }
    double& square(std::size_t h) { return sum[9 + heuristics + h]; }
    double by_bsdf(std::size_t h) const { return sum[9 + h]; }
    double square(std::size_t h) const { return sum[9 + heuristics + h]; }
    integrals& operator+=(const integrals& other) {
        for (std::size_t k = 0; k < sum.size(); ++k)
            sum[k] += other.sum[k];
        return *this;
    }

    void add(const setting& s, double f, const pair& p, double solid_angle) {
        const pair q{s.counts[0] * p[0], s.counts[1] * p[1]};
        const double d = q[0] + q[1];
        if (!(d > 0)) // nobody samples: not above the surface
            return;
        const double part = solid_angle / d;
        sum[light] += f * solid_angle;
        sum[of_bsdf] += p[0] * solid_angle;
        sum[of_light] += p[1] * solid_angle;
        sum[bsdf_bsdf] += p[0] * p[0] * part;
        sum[bsdf_light] += p[0] * p[1] * part;
        sum[light_light] += p[1] * p[1] * part;
        sum[f_bsdf] += f * p[0] * part;
        sum[f_light] += f * p[1] * part;
        sum[squares] += f * f * part;
        const auto w = weights_of(s, q);
        for (std::size_t h = 0; h < heuristics; ++h) {
            by_bsdf(h) += w[h][bsdf] * f * solid_angle;
            for (std::size_t i = 0; i < 2; ++i)
                if (q[i] > 0)
                    square(h) += w[h][i] * w[h][i] * f * f / q[i] * solid_angle;
        }
    }
};
using of_lights = std::array<integrals, light_count>;

// How fine a quadrature is.
struct fineness {
    int nodes;        // of a piece of a ray, or of azimuths
    double piece;     // of a ray, in asinh(rho / roughness), at most
    int azimuths;     // pieces, of which the worst are halved until
    double tolerance; // all and their halves differ by less, relative to the whole
    int most;         // pieces, of all lights
    bool finds_jumps; // of weights, and shadows
};
constexpr fineness fine{10, 1, 4, 1e-8, 400, true}, coarse{4, 2, 2, 0, 0, false};

// Nodes and weights of Gauss and Legendre on [0, 1].
struct rule {
    std::vector<double> x, weight;

    explicit rule(int n) {
        for (int i = 0; i < n; ++i) {
            double z = std::cos(pi * (i + 0.75) / (n + 0.5)), slope = 0;
            for (int step = 0; step < 20; ++step) { // Newton
                double before = 0, p = 1;
                for (int k = 1; k <= n; ++k) {
                    const double next = ((2 * k - 1) * z * p - (k - 1) * before) / k;
                    before = p;
                    p = next;
                }
                slope = n * (z * p - before) / (z * z - 1);
                z -= p / slope;
            }
            x.push_back((1 - z) / 2);
            weight.push_back(1 / ((1 - z * z) * slope * slope));
        }
    }
};

inline const rule& rule_with(int nodes) {
    static const rule of_fine(fine.nodes), of_coarse(coarse.nodes);
    return nodes == fine.nodes ? of_fine : of_coarse;
}

// A light as the point sees it, in polar coordinates about an axis.
class light_quadrature {
public:
    light_quadrature(const scene& of, const seen_point& from, std::size_t of_light, const setting& s,
                     const fineness& how)
        : world(of), at(from), which(of_light), set(s), fineness_of(how), rule_of(rule_with(how.nodes)) {
        const reflector& paint = world.rectangles[at.rectangle].paint;
        is_diffuse = paint.roughness == 0;
        // A diffuse surface has no lobe: there the light's middle is the axis.
        axis = is_diffuse ? normalize(to_center(which)) : dvec3(-at.from.x, -at.from.y, at.from.z);
        scale = is_diffuse ? 1 : paint.roughness;
        const dvec3 center = normalize(to_center(which)), beside = cross(axis, center);
        const dvec3 any = std::abs(axis.x) < 0.5 ? dvec3(1, 0, 0) : dvec3(0, 1, 0);
        const dvec3 other = dot(beside, beside) > 1e-24 ? beside : cross(axis, any);
        up = normalize(other);
        right = cross(up, axis);
        for (std::size_t i = 0; i < light_count; ++i) {
            const dvec3 c = to_center(i);
            disks[i] = {normalize(c), world.lights[i].radius / length(c)};
        }
        if (how.finds_jumps)
            find_edges();
        p_light = 1 / (2 * pi * opening(world.lights[which], at.position));
        sine_between = dot(normalize(center), right);
        is_around = sine_between <= disks[which].sine && dot(axis, center) > 0;
    }

    double first() const { return is_around ? 0 : -pi / 2; }
    double range() const { return is_around ? 2 * pi : pi; }

    // Over a piece of the azimuths.
    integrals integrate(double from, double piece) {
        integrals sum;
        for (std::size_t i = 0; i < rule_of.x.size(); ++i) {
            const double theta = from + piece * rule_of.x[i], w = piece * rule_of.weight[i];
            if (is_around) {
                ray(std::cos(theta) * right + std::sin(theta) * up, w, sum);
                continue;
            }
            // Beside the light: the sine of the azimuth is that of its edge times sin(theta), so that the
            // integrand is smooth at the edges.
            const double edge = disks[which].sine / sine_between;
            const double sine = edge * std::sin(theta), cosine = std::sqrt(1 - sine * sine);
            ray(cosine * right + sine * up, w * edge * std::cos(theta) / cosine, sum);
        }
        return sum;
    }

private:
    struct disk {
        dvec3 center; // direction
        double sine;  // of its angular radius
    };
    struct interval {
        double from, to;
        bool is_empty;
    };

    dvec3 to_center(std::size_t i) const {
        return world.rectangles[at.rectangle].to_local(world.lights[i].center - at.position);
    }
    double rho_of(double t) const { return scale * std::sinh(t); }
    double t_of(double rho) const { return std::asinh(rho / scale); }
    dvec3 direction(const dvec3& side, double rho) const {
        return std::cos(rho) * axis + std::sin(rho) * side;
    }

    // Of what may hide the light: normals of the planes through the point and an edge.
    void find_edges() {
        const rectangle& own = world.rectangles[at.rectangle];
        edges.emplace_back(0, 0, 1); // the horizon
        for (std::size_t i = 0; i < plate_count; ++i) {
            const rectangle& r = world.rectangles[i];
            const dvec3 across = r.width / 2 * r.right, along = r.height / 2 * r.up;
            const dvec3 corners[]{across + along, across - along, -across - along, along - across};
            for (int k = 0; i != at.rectangle && k < 4; ++k)
                edges.push_back(own.to_local(cross(r.center + corners[k] - at.position,
                                                   r.center + corners[(k + 1) % 4] - at.position)));
        }
    }

    // Where a ray from the axis to a side is in a disk.
    static interval inside(const disk& d, const dvec3& axis, const dvec3& side) {
        const double a = dot(d.center, axis), b = dot(d.center, side);
        const dvec3 normal = cross(axis, side);
        const double c = dot(d.center, normal); // sine of the distance from the ray's plane
        const double square = d.sine * d.sine - c * c;
        if (!(square > 0))
            return {0, 0, true};
        const double middle = std::atan2(b, a),
                     half = std::asin(std::min(1.0, std::sqrt(square / (1 - c * c))));
        return {std::max(0.0, middle - half), middle + half, middle + half <= 0};
    }

    // Adds what is on a ray, times a factor.
    void ray(const dvec3& side, double factor, integrals& sum) {
        interval in = inside(disks[which], axis, side);
        if (is_around)
            in.from = 0;
        if (in.is_empty)
            return;
        cuts.assign({t_of(in.from), t_of(in.to)});
        if (fineness_of.finds_jumps)
            find_cuts(side);
        for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
            const double length = cuts[k + 1] - cuts[k];
            const int pieces =
                std::max(1, int(std::ceil(length / fineness_of.piece * std::max(1.0, sharpness()))));
            for (int j = 0; j < pieces; ++j)
                for (std::size_t i = 0; i < rule_of.x.size(); ++i) {
                    const double t = cuts[k] + (j + rule_of.x[i]) * length / pieces, rho = rho_of(t);
                    const draw d = follow(world, at, direction(side, rho), which);
                    if (!is_outside(d))
                        sum.add(set, sum_of(d.f) / 3, densities(d),
                                factor * rule_of.weight[i] * length / pieces * std::sin(rho) * scale *
                                    std::cosh(t));
                }
        }
    }
    // Powers that are steeper need shorter pieces.
    double sharpness() const { return fineness_of.finds_jumps ? set.beta / 2 : 1; }

    // Cuts the ray where weights jump, and where something may begin or end to hide the light.
    void find_cuts(const dvec3& side) {
        const double from = cuts[0], to = cuts[1];
        const auto cut = [&](double t) {
            if (t > from && t < to)
                cuts.push_back(t);
        };
        for (std::size_t i = 0; i < light_count; ++i) {
            const interval shadow = i == which ? interval{0, 0, true} : inside(disks[i], axis, side);
            if (!shadow.is_empty) {
                cut(t_of(shadow.from));
                cut(t_of(shadow.to));
            }
        }
        for (const dvec3& edge : edges)
            if (const double rho = std::atan2(dot(edge, axis), -dot(edge, side)); rho != 0)
                cut(t_of(rho > 0 ? rho : rho + pi));
        if (set.counts[bsdf] > 0 && set.counts[light] > 0)
            find_jumps(side, cut);
        std::sort(cuts.begin(), cuts.end());
    }

    // Calls cut(t) where weights jump: densities are as large as each other, or cutoff's alpha apart.
    template <class Cut> void find_jumps(const dvec3& side, const Cut& cut) {
        const double from = cuts[0], to = cuts[1];
        const int steps = std::max(4, int(std::ceil((to - from) / 0.4)));
        // log of n p of BSDF sampling over that of light sampling.
        const auto ratio = [&](double t) {
            const double p =
                bsdf_density(world.rectangles[at.rectangle].paint, at.from, direction(side, rho_of(t)));
            return std::log(std::max(1e-300, set.counts[bsdf] * p) / (set.counts[light] * p_light));
        };
        double before = from, ratio_before = ratio(from);
        for (int k = 1; k <= steps; ++k) {
            const double here = from + (to - from) * k / steps, ratio_here = ratio(here);
            for (const double jump : {std::log(mis::cutoff.alpha), 0.0, -std::log(mis::cutoff.alpha)})
                if ((ratio_before < jump) != (ratio_here < jump))
                    cut(root([&](double t) { return ratio(t) - jump; }, before, here, ratio_before - jump,
                             ratio_here - jump));
            before = here;
            ratio_before = ratio_here;
        }
    }

    // By secants, of which one end stays unless the other has stayed twice (Illinois).
    template <class G> static double root(const G& g, double a, double b, double at_a, double at_b) {
        int stayed = 0;
        for (int step = 0; step < 60 && b - a > 1e-14 * std::max(1.0, std::abs(a)); ++step) {
            const double x = std::clamp((a * at_b - b * at_a) / (at_b - at_a), a, b), at_x = g(x);
            if (at_x == 0)
                return x;
            if ((at_x < 0) == (at_a < 0)) {
                a = x, at_a = at_x;
                if (stayed == 1)
                    at_b /= 2;
                stayed = 1;
            } else {
                b = x, at_b = at_x;
                if (stayed == -1)
                    at_a /= 2;
                stayed = -1;
            }
            if (std::abs(at_x) < 1e-13)
                return x;
        }
        return (a + b) / 2;
    }

    const scene& world;
    const seen_point& at;
    std::size_t which;
    const setting& set;
    const fineness& fineness_of;
    const rule& rule_of;
    bool is_diffuse = false, is_around = false;
    dvec3 axis{0}, right{0}, up{0}; // right: towards the light
    double scale = 1, p_light = 0, sine_between = 0;
    std::array<disk, light_count> disks;
    std::vector<dvec3> edges;
    std::vector<double> cuts;
};

// Some azimuths of a light, and their halves: how far those are from it tells how far they are from the
// truth.
struct piece {
    std::size_t of;
    double from, length;
    integrals first, second;
    double error = 0; // of the worst integral, relative to the whole
};

inline of_lights integrate(const scene& of, const seen_point& at, const setting& s, const fineness& how) {
    std::vector<light_quadrature> lights;
    for (std::size_t i = 0; i < light_count; ++i)
        lights.emplace_back(of, at, i, s, how);
    of_lights all;
    integrals whole;
    std::vector<piece> pieces;
    for (std::size_t i = 0; i < light_count; ++i)
        for (int k = 0; k < how.azimuths; ++k) {
            const double length = lights[i].range() / how.azimuths, from = lights[i].first() + k * length;
            const integrals one = lights[i].integrate(from, length);
            whole += one;
            if (how.most == 0)
                all[i] += one;
            else
                pieces.push_back({i, from, length, one, {}});
        }
    if (how.most == 0)
        return all;
    const auto less = [](const piece& a, const piece& b) { return a.error < b.error; };
    const auto halve = [&](piece& p, const integrals& one) {
        p.first = lights[p.of].integrate(p.from, p.length / 2);
        p.second = lights[p.of].integrate(p.from + p.length / 2, p.length / 2);
        for (std::size_t k = 0; k < one.sum.size(); ++k)
            if (const double off = std::abs(p.first.sum[k] + p.second.sum[k] - one.sum[k]); off > 0)
                p.error = std::max(p.error, off / std::abs(whole.sum[k]));
    };
    for (piece& p : pieces)
        halve(p, integrals(p.first));
    std::make_heap(pieces.begin(), pieces.end(), less);
    while (pieces.front().error > how.tolerance && int(pieces.size()) < how.most) {
        std::pop_heap(pieces.begin(), pieces.end(), less);
        const piece worst = pieces.back();
        pieces.pop_back();
        for (const bool is_second : {false, true}) {
            piece half{worst.of, worst.from + is_second * worst.length / 2, worst.length / 2, {}, {}};
            halve(half, is_second ? worst.second : worst.first);
            pieces.push_back(half);
            std::push_heap(pieces.begin(), pieces.end(), less);
        }
    }
    for (const piece& p : pieces) {
        all[p.of] += p.first;
        all[p.of] += p.second;
    }
    return all;
}

// ---- What follows from them ----

// alpha of [O], of BSDF sampling and of the sampling of each light.
using coefficients = std::array<double, 1 + light_count>;

// A alpha = b, without techniques that take no sample. What a technique samples outside of lights, or behind
// another one, has no other density and no f.
inline coefficients solve(const setting& s, const of_lights& a, const coefficients& b) {
    constexpr int techniques = 1 + light_count;
    Eigen::Matrix<double, techniques, techniques> matrix = decltype(matrix)::Zero();
    Eigen::Matrix<double, techniques, 1> right = decltype(right)::Zero();
    const double n = s.counts[bsdf], m = s.counts[light];
    if (n > 0) {
        double in_lights = 0;
        for (const integrals& i : a) {
            in_lights += i.sum[integrals::of_bsdf];
            matrix(0, 0) += i.sum[integrals::bsdf_bsdf];
        }
        matrix(0, 0) += (1 - in_lights) / n;
        right[0] = b[0];
    }
    for (int k = 1; m > 0 && k < techniques; ++k) {
        const integrals& i = a[std::size_t(k - 1)];
        matrix(k, k) = i.sum[integrals::light_light] + (1 - i.sum[integrals::of_light]) / m;
        if (n > 0)
            matrix(0, k) = matrix(k, 0) = i.sum[integrals::bsdf_light];
        right[k] = b[std::size_t(k)];
    }
    const Eigen::Matrix<double, techniques, 1> alpha = matrix.completeOrthogonalDecomposition().solve(right);
    coefficients found;
    std::copy(alpha.begin(), alpha.end(), found.begin());
    return found;
}

struct exact {
    double mean = 0;                                          // of channels
    std::array<double, estimators> variance{}, bsdf_weight{}; // bsdf_weight: of what is found, on average
    std::array<coefficients, 3> alpha{};                      // of channels
};

inline exact evaluate(const scene& of, const setting& s, const of_lights& lights) {
    exact e;
    coefficients mean_b{};
    std::array<coefficients, 3> b{};
    for (std::size_t i = 0; i < light_count; ++i) {
        const integrals& l = lights[i];
        const double mean_radiance = sum_of(of.lights[i].radiance) / 3;
        e.mean += l.sum[integrals::light];
        mean_b[0] += l.sum[integrals::f_bsdf];
        mean_b[1 + i] = l.sum[integrals::f_light];
        for (std::size_t c = 0; c < 3; ++c) {
            const double color = of.lights[i].radiance[int(c)] / mean_radiance;
            b[c][0] += color * l.sum[integrals::f_bsdf];
            b[c][1 + i] = color * l.sum[integrals::f_light];
        }
    }
    for (std::size_t c = 0; c < 3; ++c)
        e.alpha[c] = solve(s, lights, b[c]);
    for (std::size_t h = 0; h < heuristics; ++h) {
        double by_bsdf = 0;
        for (const integrals& l : lights) {
            by_bsdf += l.by_bsdf(h);
            e.variance[h] += l.square(h);
            const double by_light = l.sum[integrals::light] - l.by_bsdf(h);
            if (s.counts[light] > 0)
                e.variance[h] -= by_light * by_light / s.counts[light];
        }
        if (s.counts[bsdf] > 0)
            e.variance[h] -= by_bsdf * by_bsdf / s.counts[bsdf];
        e.bsdf_weight[h] = by_bsdf;
    }
    const coefficients alpha = solve(s, lights, mean_b);
    // The integral of w f: alpha p + n p / D (f - sum_k alpha_k p_k).
    double& by_bsdf = e.bsdf_weight[optimal];
    by_bsdf = s.counts[bsdf] * mean_b[0];
    e.variance[optimal] = -alpha[0] * mean_b[0];
    for (std::size_t i = 0; i < light_count; ++i) {
        const auto& sum = lights[i].sum;
        e.variance[optimal] += sum[integrals::squares] - alpha[1 + i] * mean_b[1 + i];
        by_bsdf += alpha[0] * sum[integrals::of_bsdf] -
                   s.counts[bsdf] *
                       (alpha[0] * sum[integrals::bsdf_bsdf] + alpha[1 + i] * sum[integrals::bsdf_light]);
    }
    for (std::size_t h = 0; h < estimators; ++h) {
        e.bsdf_weight[h] = e.mean > 0 ? e.bsdf_weight[h] / e.mean : 0;
        e.variance[h] = std::max(0.0, e.variance[h]); // rounding
    }
    return e;
}

} // namespace exact_plates
