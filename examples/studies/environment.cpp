// Study: a scene lit by its environment alone, as the lecture of Křivánek and Vorba [K] has it: light by
// *BSDF sampling*, by *environment sampling*, and by both, weighed by each of the heuristics and by optimal
// weights, at the same number of samples; and what MIS compensation adds, that is environment sampling whose
// density is lowered where BSDF sampling serves. Environments are synthesised, one with a small bright sun,
// or a file that the user names. Writes environment.csv and environment.jpg; docs/direct_lighting.md tells
// what they show.
//
// An estimate has n samples of the light at one point, which a pixel's center shows; a combination has n / 2
// of each technique. Environment sampling picks a pixel of the map in proportion to its mean radiance, times
// its solid angle, and a direction in it uniformly. All densities are exact.
#include "direct_image.hpp"
#include "environment_map.hpp"
#include <optional>

namespace {

using namespace studies;
using namespace studies::direct_light;

struct environment_options : options {
    std::string map; // a file; empty: all that are synthesised
};

// ---- Environments ----

dvec3 sky(const dvec3& d) { // brighter towards the horizon; the ground below
    return d.y < 0 ? dvec3(0.16, 0.14, 0.12)
                   : mix(dvec3(0.75, 0.78, 0.8), dvec3(0.2, 0.38, 0.75), std::sqrt(d.y));
}
dvec3 sunny(const dvec3& d) {
    const dvec3 to_sun = normalize(dvec3(-0.55, 0.6, 0.58));
    return sky(d) + (dot(d, to_sun) > std::cos(1.5 * pi / 180) ? dvec3(3400, 3000, 2300) : dvec3(0));
}
dvec3 overcast(const dvec3& d) { return dvec3(d.y < 0 ? 0.15 : 0.3 + 0.6 * d.y); }
dvec3 window(const dvec3& d) { // in a dim room
    const bool is_in = d.x > 0.4 && std::abs(d.z / d.x) < 0.5 && d.y / d.x > 0.1 && d.y / d.x < 0.8;
    return is_in ? dvec3(4.5, 5, 5.5) : dvec3(0.12, 0.1, 0.08);
}
dvec3 even(const dvec3&) { return dvec3(0.7); }

struct named_map {
    std::string name;
    environment_map map;
};

std::vector<named_map> maps_of(const environment_options& o) {
    if (!o.map.empty())
        return {{"file", read_environment(o.map)}};
    constexpr int height = 256;
    return {{"sun", make_map(height, sunny)},
            {"overcast", make_map(height, overcast)},
            {"window", make_map(height, window)},
            {"even", make_map(height, even)}};
}

// ---- The scene: four balls on the ground, from nearly a mirror to diffuse ----

constexpr std::size_t ball_count = 4;
constexpr std::array<double, ball_count> roughness{0.04, 0.1, 0.3, 0};
constexpr double ball_radius = 0.9, ground_radius = 9;

dvec3 center_of(std::size_t ball) { return {2.1 * (double(ball) - 1.5), ball_radius, 0}; }

struct hit {
    double distance = 1e30;
    std::size_t surface = ball_count + 1; // a ball, the ground, or nothing
};

hit intersect(const dvec3& origin, const dvec3& direction) {
    constexpr double nearest = 1e-6;
    hit h;
    for (std::size_t i = 0; i < ball_count; ++i) {
        const dvec3 to_center = center_of(i) - origin;
        const double middle = dot(to_center, direction);
        const dvec3 beside = to_center - middle * direction;
        const double square = ball_radius * ball_radius - dot(beside, beside);
        const double distance = middle - std::sqrt(std::max(0.0, square)); // nobody is inside of a ball
        if (square > 0 && distance > nearest && distance < h.distance)
            h = {distance, i};
    }
    const double distance = -origin.y / direction.y;
    if (distance > nearest && distance < h.distance) {
        const dvec3 at = origin + distance * direction;
        if (at.x * at.x + at.z * at.z < ground_radius * ground_radius)
            h = {distance, ball_count};
    }
    return h;
}
bool is_open(const dvec3& origin, const dvec3& direction) {
    return intersect(origin, direction).surface > ball_count;
}

struct seen_point {
    std::size_t surface;
    reflector paint;
    dvec3 position, right, up, normal, from; // from: to the camera, local

    dvec3 to_local(const dvec3& v) const { return {dot(v, right), dot(v, up), dot(v, normal)}; }
    dvec3 to_world(const dvec3& v) const { return v.x * right + v.y * up + v.z * normal; }
};
using seen_points = std::vector<std::optional<seen_point>>;

// The camera, for a point of the film in pixels.
const dvec3 eye(0, 3, 11);
dvec3 film_direction(const options& o, double x, double y) {
    constexpr double slope = 0.28; // of half the height
    const dvec3 forward = normalize(dvec3(0, 0.75, 0) - eye), right(1, 0, 0), up = cross(right, forward);
    const double scale = 2 * slope / o.height();
    return normalize(forward + scale * ((x - o.size / 2.0) * right + (o.height() / 2.0 - y) * up));
}

seen_points look(const options& o) {
    seen_points all;
    for (int i = 0; i < o.size * o.height(); ++i) {
        const dvec3 direction = film_direction(o, i % o.size + 0.5, i / o.size + 0.5);
        const hit h = intersect(eye, direction);
        all.emplace_back();
        if (h.surface > ball_count)
            continue;
        const bool is_ball = h.surface < ball_count;
        seen_point p{h.surface, {is_ball ? 0.8 : 0.4, is_ball ? roughness[h.surface] : 0}, {}, {}, {}, {},
                     {}};
        p.position = eye + h.distance * direction;
        p.normal = is_ball ? (p.position - center_of(h.surface)) / ball_radius : dvec3(0, 1, 0);
        if (is_ball) // on it, however far away the camera is
            p.position = center_of(h.surface) + ball_radius * p.normal;
        p.right = normalize(cross(std::abs(p.normal.x) < 0.5 ? dvec3(1, 0, 0) : dvec3(0, 1, 0), p.normal));
        p.up = cross(p.normal, p.right);
        p.from = p.to_local(-direction);
        all.back() = p;
    }
    return all;
}

// ---- Techniques ----

// What a direction brings, and the densities of both techniques. Below the surface only environment sampling
// gets, and there is nothing to be found: such a draw has left the domain.
draw follow(const environment_map& map, const environment_density& density, const seen_point& at,
            const dvec3& local, const dvec3& world, std::size_t pixel) {
    if (!(local.z > 0))
        return {};
    const double p = bsdf_density(at.paint, at.from, local);
    const dvec3 f =
        is_open(at.position, world) ? map.pixels[pixel] * reflected(at.paint, at.from, local) : dvec3(0);
    return {f, {p, density(pixel)}, 0};
}

model make_model(const environment_map& map, const environment_density& density, const seen_points& points) {
    model m;
    m.is_seen = [&](std::size_t i) { return points[i].has_value(); };
    m.take = [&](std::size_t i, technique own, std::size_t, pcg32& rng) {
        const seen_point& at = *points[i];
        if (own == light) {
            std::size_t pixel = 0;
            const dvec3 world = density.sample(rng, pixel);
            return follow(map, density, at, at.to_local(world), world, pixel);
        }
        const dvec3 local = sample_bsdf(at.paint, at.from, rng), world = at.to_world(local);
        return follow(map, density, at, local, world, map.pixel_of(world));
    };
    m.regions = ball_count + 1;
    m.region_of = [&](std::size_t i) { return points[i] ? points[i]->surface : ball_count; };
    return m;
}

// ---- Checks ----

// The reference against a sum over the map's pixels, which knows no densities: both for the mean of some
// image pixels.
bool check_reference(const environment_map& map, const options& o, const seen_points& points,
                     const reference& r) {
    const int fine = std::max(2, 512 / std::max(1, map.height)); // points in a map's pixel, squared
    const int pixels = std::max(1, o.size / 5);
    pcg32 rng(o.seed);
    double sum = 0, found = 0, noise = 0;
    for (int k = 0; k < pixels;) {
        const auto i = std::size_t(uniform(rng) * double(points.size()));
        // A mirror's lobe is narrower than a map's pixel.
        if (!points[i] || points[i]->surface == 0)
            continue;
        show_progress(text("the reference, pixel %d of %d", ++k, pixels));
        const seen_point& at = *points[i];
        for (std::size_t pixel = 0; pixel < map.pixels.size(); ++pixel)
            for (int j = 0; j < fine * fine; ++j) {
                const dvec3 world = map.direction(pixel, (j % fine + 0.5) / fine, (j / fine + 0.5) / fine);
                const double f = reflected(at.paint, at.from, at.to_local(world));
                if (f > 0 && is_open(at.position, world))
                    sum += f * sum_of(map.pixels[pixel]) * map.solid_angle(pixel) / (fine * fine);
            }
        found += sum_of(r.mean.pixels[i]);
        noise += 3 * r.noise[i]; // at least: channels are not independent
    }
    const double apart = std::abs(found / sum - 1), bound = 0.005 + 4 * std::sqrt(noise) / sum;
    return report(apart < bound,
                  text("%d pixels of the reference are a sum over the map within %.2g %% (bar: "
                       "%.2g %%, 4 standard errors and 0.5 %%)",
                       pixels, 100 * apart, 100 * bound));
}

// ---- What is written ----

image to_picture(const environment_map& map, const options& o, const seen_points& points,
                 const image& estimated) {
    constexpr double exposure = 0.9;
    image shown = estimated;
    for (int i = 0; i < o.size * o.height(); ++i) {
        const auto k = std::size_t(i);
        const dvec3 direction = film_direction(o, i % o.size + 0.5, i / o.size + 0.5);
        shown.pixels[k] =
            tone_mapped(points[k] ? estimated.pixels[k] : map.pixels[map.pixel_of(direction)], exposure);
    }
    return shown;
}

bool study(const named_map& e, const environment_options& o, const seen_points& points, csv_file& csv) {
    const environment_density plain = plain_density(e.map), compensated = compensated_density(e.map);
    const model m = make_model(e.map, plain, points);
    model with_compensation = make_model(e.map, compensated, points);
    with_compensation.light_is_enough = false; // it misses what is dark
    const reference r = render_reference(m, o);
    const double noise = mean_squared_error(r);
    csv.add(text("%s,plain,reference,%d,,%g,%g,", e.name.c_str(), r.samples, noise, std::sqrt(noise)));
    reference by_compensation = render_reference(with_compensation, o);
    by_compensation.mean = r.mean; // what it is compared with is the same
    by_compensation.noise = r.noise;
    by_compensation.largest = r.largest;
    const results all = run_all(m, o, r, csv, e.name + ",plain,");
    const results better = run_all(with_compensation, o, by_compensation, csv, e.name + ",compensated,");
    if (e.name == "sun" || e.name == "file")
        write_panels(o.output + "/environment.jpg",
                     {{"BSDF sampling", to_picture(e.map, o, points, all.first[bsdf_alone])},
                      {"environment", to_picture(e.map, o, points, all.first[light_alone])},
                      {"both, balance", to_picture(e.map, o, points, all.first[balance])},
                      {"compensated", to_picture(e.map, o, points, better.first[balance])}});
    std::printf("%s: the reference, of %d samples, has an MSE of %.2g\n", e.name.c_str(), r.samples, noise);
    const std::string regions = "ball, smoothest first; ground";
    print_table(m, o, all, regions);
    std::printf("%s, compensated\n", e.name.c_str());
    print_table(with_compensation, o, better, regions);

    bool good = check_means(m, o, all, r);
    good &= check_means(with_compensation, o, better, by_compensation);
    good &= check_reference(e.map, o, points, r);
    good &= check_weights(all);
    const double gain = all.error(balance) / better.error(balance);
    const std::string line =
        text("plain balance has %.3f times the mean squared error of compensated balance", gain);
    if (e.name == "file")
        note(line);
    else
        good &= e.name == "sun" ? report(gain >= 1.2, line + " (bar: 1.2)")
                                : report(gain >= 1 / 1.02, line + " (bar: 1 / 1.02)");
    return good;
}

bool run(const environment_options& o) {
    const std::vector<named_map> maps = maps_of(o);
    csv_file csv(o.output, "environment.csv",
                 "environment,density,estimator,samples,seed,mean_squared_error,rms_error,over_balance");
    const seen_points points = look(o);
    std::printf("%d x %d pixels, %d samples in each, %d runs from seed %s\n", o.size, o.height(), o.samples,
                o.runs, std::to_string(o.seed).c_str());
    bool good = true;
    for (const named_map& e : maps)
        good &= study(e, o, points, csv);
    return good;
}

} // namespace

int main(int count, char** arguments) {
    environment_options o;
    o.size = 288;
    o.runs = 16;
    o.reference_samples = 1024;
    command_line app("Light of an environment by BSDF sampling, by environment sampling, plain and "
                     "compensated, and by both with each heuristic; writes environment.csv and a "
                     "picture.",
                     o);
    add_samples(app, o);
    app.add("--map", o.map,
            "OpenEXR or Radiance HDR file of an environment, equirectangular, up is "
            "the first row; else four that are synthesised",
            {});
    return run_study(app, o, count, arguments, run);
}
