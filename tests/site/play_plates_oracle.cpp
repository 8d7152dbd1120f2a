// SPDX-License-Identifier: MIT
// What the page of Veach's plates must show of a pixel, from the formulas that it prints alone:
//     play_plates_oracle X Y  N M  BETA ROUGHNESS
// pixel, counts of BSDF samples and of light samples for each light, beta, a factor of the plates' roughness.
// Prints the mean, then names, variances of a pass and parts that BSDF samples find.
//
// Each light by itself, over the unit square of its cone's (radius, azimuth). Squares are quartered until
// they are small beside their distance from the direction of the mirror image, or beside the lobe, and then
// some more where weights jump or the light's edge is hidden.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <vector>

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr int lights = 4;

struct vec {
    double x, y, z;
};
vec operator+(vec a, vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
vec operator-(vec a, vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
vec operator*(double s, vec a) { return {s * a.x, s * a.y, s * a.z}; }
double dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
vec cross(vec a, vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
double length(vec a) { return std::sqrt(dot(a, a)); }
vec unit(vec a) { return (1 / length(a)) * a; }

// ---- The scene ----

const std::array<double, lights> radius{0.033, 0.1, 0.3, 0.9};
vec light_center(int i) { return {-3.75 + 2.5 * i, 0, 0}; }
double radiance(int i) { return 1 / (radius[std::size_t(i)] * radius[std::size_t(i)]); } // mean of channels

struct plane {
    vec center, normal;
    double width, depth; // depth: across x
    double reflectance, alpha;
};
const vec eye{0, 2, 15};

std::vector<plane> make_planes(double factor) {
    const std::array<vec, 4> centers{{{0, -2.4, -0.1}, {0, -3.05, 0.95}, {0, -3.55, 2.2}, {0, -3.9, 3.55}}};
    const std::array<double, 4> alpha{0.001, 0.02, 0.05, 0.1};
    std::vector<plane> all;
    for (std::size_t i = 0; i < 4; ++i)
        all.push_back({centers[i], unit(unit(eye - centers[i]) + unit(vec{0, 0, 0} - centers[i])), 8, 1, 0.8,
                       factor * alpha[i]});
    all.push_back({{0, -4.15, 0}, {0, 1, 0}, 40, 40, 0.25, 0});
    all.push_back({{0, 0, -2}, {0, 0, 1}, 40, 40, 0.25, 0});
    return all;
}
std::vector<plane> planes;

// What a ray meets first: 0 .. 3 a light, 4 .. a plane, -1 nothing.
int first(vec from, vec to, double& distance) {
    int found = -1;
    distance = 1e9;
    for (int i = 0; i < lights; ++i) {
        const vec c = light_center(i) - from;
        const double along = dot(c, to), r = radius[std::size_t(i)];
        const vec off = c - along * to;
        if (const double square = r * r - dot(off, off); square > 0) {
            const double t = along - std::sqrt(square);
            if (t > 1e-6 && t < distance)
                found = i, distance = t;
        }
    }
    for (std::size_t i = 0; i < planes.size(); ++i) {
        const plane& p = planes[i];
        const double t = dot(p.center - from, p.normal) / dot(to, p.normal);
        const vec at = from + t * to - p.center;
        const double along_depth = dot(at, cross(p.normal, {1, 0, 0}));
        if (t > 1e-6 && t < distance && std::fabs(at.x) < p.width / 2 && std::fabs(along_depth) < p.depth / 2)
            found = 4 + int(i), distance = t;
    }
    return found;
}

// ---- The point that the pixel's center shows ----

vec point, normal, to_eye;
double reflectance, alpha;

bool look(double x, double y) {
    const vec forward = unit(vec{0, -1.95, 2.5} - eye), right = unit(cross(forward, {0, 1, 0})),
              up = cross(right, forward);
    const double scale = 0.25 / 90;
    const vec to = unit(forward + (scale * (x + 0.5 - 120)) * right + (scale * (90 - y - 0.5)) * up);
    double distance;
    const int found = first(eye, to, distance);
    if (found < 4)
        return false;
    const plane& p = planes[std::size_t(found - 4)];
    point = eye + distance * to;
    normal = p.normal;
    to_eye = -1 * to;
    reflectance = p.reflectance;
    alpha = p.alpha;
    return dot(normal, to_eye) > 0;
}

// ---- BSDF: diffuse, or GGX with Smith's masking ----

double lambda(double cosine) {
    const double tangent = std::sqrt(std::max(0.0, 1 - cosine * cosine)) / cosine;
    return (std::sqrt(1 + alpha * alpha * tangent * tangent) - 1) / 2;
}
// D of the half vector, by the tangent of its angle.
double distribution(vec to) {
    const vec h = unit(to + to_eye),
              across = cross(h, normal); // its length is the sine, without cancellation
    const double cosine = dot(h, normal), tangent_square = dot(across, across) / (cosine * cosine);
    const double a = alpha * alpha, root = 1 + tangent_square / a;
    return 1 / (pi * a * cosine * cosine * cosine * cosine * root * root);
}
// BSDF times cosine, and density.
void scatter(vec to, double& value, double& density) {
    const double in = dot(to, normal), out = dot(to_eye, normal);
    value = density = 0;
    if (!(in > 0))
        return;
    if (alpha == 0) {
        value = reflectance * in / pi;
        density = in / pi;
        return;
    }
    const double d = distribution(to);
    value = reflectance * d / (4 * out * (1 + lambda(out) + lambda(in)));
    density = d / (4 * out * (1 + lambda(out)));
}

// ---- Integrals over a light's cone ----

double n, m, beta;

struct sample {
    bool is_seen;
    double f, p_bsdf, p_light;
};
using heuristic = std::function<double(double, double)>; // share of q, of the largest q
const std::array<heuristic, 5> shares{[](double q, double) { return q > 0 ? 1.0 : 0.0; },
                                      [](double q, double) { return q; },
                                      [](double q, double largest) { return std::pow(q / largest, beta); },
                                      [](double q, double largest) { return q < 0.1 * largest ? 0 : q; },
                                      [](double q, double largest) { return q == largest ? 1.0 : 0.0; }};
const std::array<const char*, 5> names{"average", "balance", "power", "cutoff", "maximum"};

struct sums {
    double f = 0, p_bsdf = 0, p_light = 0, bb = 0, bl = 0, ll = 0, fb = 0, fl = 0, ff = 0;
    std::array<double, 5> w{}, second{}; // w f, w^2 f^2 / q

    void add(const sample& s, double weight) {
        const double q[2] = {n * s.p_bsdf, m * s.p_light}, d = q[0] + q[1];
        if (!s.is_seen || !(d > 0))
            return;
        f += weight * s.f;
        p_bsdf += weight * s.p_bsdf;
        p_light += weight * s.p_light;
        bb += weight * s.p_bsdf * s.p_bsdf / d;
        bl += weight * s.p_bsdf * s.p_light / d;
        ll += weight * s.p_light * s.p_light / d;
        fb += weight * s.f * s.p_bsdf / d;
        fl += weight * s.f * s.p_light / d;
        ff += weight * s.f * s.f / d;
        for (std::size_t h = 0; h < shares.size(); ++h) {
            const double largest = std::max(q[0], q[1]);
            const double a = shares[h](q[0], largest), b = shares[h](q[1], largest);
            w[h] += weight * a / (a + b) * s.f;
            for (int i = 0; i < 2; ++i)
                if (const double own = (i == 0 ? a : b) / (a + b); q[i] > 0)
                    second[h] += weight * own * own * s.f * s.f / q[i];
        }
    }
};

struct cone {
    int light;
    vec axis, right, up, mirrored;
    double below_1, size; // 1 - cosine; sine

    explicit cone(int i) : light(i) {
        const vec c = light_center(i) - point;
        axis = unit(c);
        right = unit(cross(axis, std::fabs(axis.x) < 0.6 ? vec{1, 0, 0} : vec{0, 1, 0}));
        up = cross(axis, right);
        size = radius[std::size_t(i)] / length(c);
        below_1 = size * size / (1 + std::sqrt(1 - size * size));
        mirrored = 2 * dot(to_eye, normal) * normal - to_eye;
    }
    vec direction(double r, double azimuth) const {
        const double b = below_1 * r * r, sine = r * std::sqrt(below_1 * (2 - b));
        return (1 - b) * axis + sine * (std::cos(2 * pi * azimuth) * right + std::sin(2 * pi * azimuth) * up);
    }
    sample at(vec to) const {
        sample s{};
        double distance;
        s.is_seen = dot(to, normal) > 0 && first(point, to, distance) == light;
        scatter(to, s.f, s.p_bsdf);
        s.f *= radiance(light);
        s.p_light = 1 / (2 * pi * below_1);
        return s;
    }
    // What must not change within a cell.
    int state(const sample& s) const {
        const double a = n * s.p_bsdf, b = m * s.p_light;
        return !s.is_seen ? 0 : n * m == 0 ? 1 : 1 + (a > b) + 2 * (a > 0.1 * b) + 4 * (b > 0.1 * a);
    }

    // The cell [r, r + e] x [azimuth, azimuth + g]; `more`: by how many quarterings jumps may be followed.
    void add(double r, double azimuth, double e, double g, int more, sums& sum) const {
        constexpr int points = 6;
        static const double x[points]{0.0337652428984240, 0.1693953067668678, 0.3806904069584016,
                                      0.6193095930415985, 0.8306046932331322, 0.9662347571015760};
        static const double weight[points]{0.0856622461895852, 0.1803807865240693, 0.2339569672863455,
                                           0.2339569672863455, 0.1803807865240693, 0.0856622461895852};
        const auto quarter = [&](int left) {
            for (int k = 0; k < 4; ++k)
                add(r + (k % 2) * e / 2, azimuth + (k / 2) * g / 2, e / 2, g / 2, left, sum);
        };
        // In angles.
        const double extent = std::max(e * size, 2 * pi * g * (r + e) * size);
        const double apart = length(direction(r + e / 2, azimuth + g / 2) - mirrored);
        if (alpha > 0 && extent > 0.4 * std::max(alpha, apart - extent))
            return quarter(more);
        if (e > 0.07 || g > 0.035) // so that no shadow is overlooked
            return quarter(more);
        std::array<sample, points * points + 9> all;
        for (int k = 0; k < 9; ++k)
            all[std::size_t(points * points + k)] =
                at(direction(std::clamp(r + (k % 3) * e / 2, 1e-9, 1 - 1e-9), azimuth + (k / 3) * g / 2));
        for (int k = 0; k < points * points; ++k)
            all[std::size_t(k)] = at(direction(r + x[k % points] * e, azimuth + x[k / points] * g));
        double least = 1e300, most = -1e300;
        bool jumps = false;
        for (const sample& s : all) {
            jumps |= state(s) != state(all[0]);
            const double ratio = n * m > 0 ? std::log(std::max(1e-300, n * s.p_bsdf) / (m * s.p_light)) : 0;
            least = std::min(least, ratio), most = std::max(most, ratio);
        }
        const bool is_steep = beta * (most - least) > 1.5 && beta * least < 30 && beta * most > -30;
        if (more > 0 && (jumps || is_steep))
            return quarter(more - 1);
        for (int k = 0; k < points * points; ++k) {
            const double here = r + x[k % points] * e;
            const double solid_angle = 4 * pi * below_1 * here * e * g; // 1 - cosine is below_1 r^2
            sum.add(all[std::size_t(k)], weight[k % points] * weight[k / points] * solid_angle);
        }
    }
};

} // namespace

int main(int count, char** arguments) {
    if (count != 7)
        return 2;
    const auto given = [&](int i) { return std::atof(arguments[i]); };
    planes = make_planes(given(6));
    n = given(3), m = given(4), beta = given(5);
    if (!look(given(1), given(2)))
        return 1;
    std::array<sums, lights> all;
    for (int i = 0; i < lights; ++i)
        cone(i).add(0, 0, 1, 1, 7, all[std::size_t(i)]);

    double mean = 0;
    for (const sums& s : all)
        mean += s.f;
    std::printf("mean %.17g 0\n", mean);
    for (std::size_t h = 0; h < names.size(); ++h) {
        double by_bsdf = 0, variance = 0;
        for (const sums& s : all) {
            by_bsdf += s.w[h];
            variance += s.second[h];
            if (m > 0)
                variance -= (s.f - s.w[h]) * (s.f - s.w[h]) / m;
        }
        if (n > 0)
            variance -= by_bsdf * by_bsdf / n;
        std::printf("%s %.17g %.17g\n", names[h], variance, by_bsdf / mean);
    }

    // A alpha = b. Light samplings do not meet each other, only BSDF sampling: alpha of each light follows
    // from that of BSDF sampling, which is left in one equation.
    double own = 0, right = 0, in_lights = 0;
    for (const sums& s : all) {
        own += s.bb;
        right += s.fb;
        in_lights += s.p_bsdf;
    }
    own += n > 0 ? (1 - in_lights) / n : 1;
    const auto diagonal = [](const sums& s) { return s.ll + (1 - s.p_light) / m; };
    for (const sums& s : all)
        if (m > 0) {
            own -= s.bl * s.bl / diagonal(s);
            right -= s.bl * s.fl / diagonal(s);
        }
    const double of_bsdf = n > 0 ? right / own : 0;
    double least = 0, by_bsdf = 0; // the integral of (f - sum alpha p)^2 / D, lights or not
    if (n > 0)
        least += of_bsdf * of_bsdf * (1 - in_lights) / n;
    for (const sums& s : all) {
        const double of_light = m > 0 ? (s.fl - of_bsdf * s.bl) / diagonal(s) : 0;
        least += s.ff - 2 * of_bsdf * s.fb - 2 * of_light * s.fl + of_bsdf * of_bsdf * s.bb +
                 2 * of_bsdf * of_light * s.bl + of_light * of_light * s.ll;
        if (m > 0)
            least += of_light * of_light * (1 - s.p_light) / m;
        by_bsdf += of_bsdf * s.p_bsdf + n * (s.fb - of_bsdf * s.bb - of_light * s.bl);
    }
    std::printf("optimal %.17g %.17g\n", least, by_bsdf / mean);
}
