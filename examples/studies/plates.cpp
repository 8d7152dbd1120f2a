// Study: why combine? After Veach's thesis [V97] 9.3.1: four lights of equal power and very different sizes
// are reflected by four glossy plates, from nearly a mirror to rough. Direct illumination by *BSDF sampling*,
// by *light sampling*, and by both, weighed by each of the heuristics, at the same number of samples. Writes
// plates.csv, plates.jpg and plates-weights.jpg; docs/direct_lighting.md tells what they show.
//
// An estimate has n samples of the light at one point, which a pixel's center shows. A BSDF sample follows a
// direction to whatever light it hits. A light sample is a direction within the cone that a light fills; a
// quarter of the n goes to each light, so that the density of light sampling as a whole is a quarter of that
// in the cone. A combination has n / 2 of each technique. Lights that the camera sees directly are no part of
// an estimate: there is only one technique for them.
#include "direct_image.hpp"
#include "plates_model.hpp"

namespace {

using namespace studies;
using namespace studies::plates;

// Plates, then the rest of the image: floor, wall, and lights, where there is no error.
std::size_t region_of(const std::optional<seen_point>& p) {
    return p ? std::min(p->rectangle, plate_count) : plate_count;
}

model make_model(const scene& s, const seen_points& points) {
    model m;
    m.sources = light_count;
    m.is_seen = [&](std::size_t i) { return points[i].has_value(); };
    m.take = [&](std::size_t i, technique own, std::size_t source, pcg32& rng) {
        return own == bsdf ? draw_bsdf(s, *points[i], rng) : draw_light(s, *points[i], source, rng);
    };
    m.regions = plate_count + 1;
    m.region_of = [&](std::size_t i) { return region_of(points[i]); };
    return m;
}

// ---- What is written ----

constexpr double exposure = 1.1;

// With the lights that are seen directly, smooth at their edges.
image to_picture(const scene& s, const options& o, const image& estimated) {
    constexpr int grid = 4; // by as many points in a pixel
    image shown = estimated;
    for (int i = 0; i < o.size * o.height(); ++i) {
        dvec3& pixel = shown.pixels[std::size_t(i)];
        pixel = tone_mapped(pixel, exposure);
        for (int k = 0; k < grid * grid; ++k) {
            const double x = i % o.size + (k % grid + 0.5) / grid, y = i / o.size + (k / grid + 0.5) / grid;
            const hit h = intersect(s, s.eye, film_direction(s, o.size, o.height(), x, y));
            if (h.light)
                pixel += tone_mapped(s.lights[*h.light].radiance, exposure) / double(grid * grid);
        }
    }
    return shown;
}

image weight_picture(const reference& r, estimator e) {
    image shown = r.mean;
    for (std::size_t i = 0; i < shown.pixels.size(); ++i)
        if (sum_of(shown.pixels[i]) > 0)
            shown.pixels[i] = blue_to_orange(r.known[i][e].bsdf_weight());
    return shown;
}

void write_pictures(const scene& s, const options& o, const images& all, const reference& r) {
    write_panels(o.output + "/plates.jpg", {{names[bsdf_alone], to_picture(s, o, all[bsdf_alone])},
                                            {names[light_alone], to_picture(s, o, all[light_alone])},
                                            {"both, power heuristic", to_picture(s, o, all[power])}});
    std::vector<panel> panels;
    for (const estimator e : {balance, power, maximum})
        panels.push_back({names[e], weight_picture(r, e)});
    write_panels(o.output + "/plates-weights.jpg", panels,
                 {blue_to_orange, "all weight to light sampling", "to BSDF sampling"});
}

bool run(const options& o) {
    csv_file csv(o.output, "plates.csv", "estimator,samples,seed,mean_squared_error,rms_error,over_balance");
    const scene s = make_scene();
    const seen_points points = look(s, o.size, o.height());
    const model m = make_model(s, points);
    const reference r = render_reference(m, o);
    const double noise = mean_squared_error(r);
    csv.add(text("reference,%d,,%g,%g,", r.samples, noise, std::sqrt(noise)));
    const results all = run_all(m, o, r, csv, "");
    write_pictures(s, o, all.first, r);
    std::printf(
        "%d x %d pixels, %d samples in each, %d runs from seed %s; the reference, of %d samples, has an "
        "RMS error of %.3f (MSE %.2g)\n",
        o.size, o.height(), o.samples, o.runs, std::to_string(o.seed).c_str(), r.samples, std::sqrt(noise),
        noise);
    print_table(m, o, all, "plate, smoothest first; floor and wall");
    bool good = true;
    for (const estimator e : {bsdf_alone, light_alone}) {
        const double over = all.error(e) / all.error(balance);
        good &= report(over >= 5,
                       text("%s has %.2f times the mean squared error of balance (bar: 5)", names[e], over));
    }
    good &= check_means(m, o, all, r);
    return check_weights(all) && good;
}

} // namespace

int main(int count, char** arguments) {
    options o;
    o.size = 448;
    command_line app("Veach's plates: direct illumination by BSDF sampling, by light sampling, and by both "
                     "with each heuristic; writes plates.csv and pictures.",
                     o);
    add_samples(app, o);
    return run_study(app, o, count, arguments, run);
}
