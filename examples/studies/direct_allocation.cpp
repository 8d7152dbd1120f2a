// Study: light or BSDF samples? Direct light in each pixel by BSDF sampling and by light sampling, weighed by
// balance, with as many of each (1:1), and with the counts that mis::allocate finds from a few pilot samples
// of the pixels around. All at the same cost, the pilot's included: a sample of either technique is one ray.
// On Veach's plates and on scenes of the reference renderer. Writes direct_allocation.csv,
// direct_allocation.jpg and direct_allocation-plates.jpg; docs/allocation.md tells what they show.
//
// In each pixel an eighth of the rays are pilots, as many of each technique. The counts of the rest minimise
// the variance summed over a square of pixels around it, those that show the same surface; each technique
// keeps a least share. The pilot's samples are in the image: both estimates are averaged in proportion to
// their cost, which is no choice of the pilot's, so that the mean is unbiased.
#include "panels.hpp"
#include "pixels.hpp"
#include "plates_model.hpp"
#include <bpt/render.hpp>
#include <chrono>
#include <mis/allocation.hpp>

namespace {

using namespace studies;
using glm::dvec3;
using plates::pair, plates::bsdf, plates::light, plates::technique;

struct options : image_options {
    int rays = 64, runs = 16, tile = 4, around = 2;
    double least_share = 0.1;

    options() { size = 200; }
};

// ---- Scenes: what a pixel's center shows, and samples of its direct light ----

// The value and the densities of a sample, per solid angle; f = 0 where no light was found.
struct draw {
    dvec3 f{0};
    pair p{1, 1};
};
class lit_scene {
public:
    virtual ~lit_scene() = default;
    virtual int surface(std::size_t pixel) const = 0; // -1: no direct light to estimate
    virtual draw sample(std::size_t pixel, technique by, pcg32& rng) const = 0;

    std::string name;
    int width = 0, height = 0, surfaces = 0;
    double exposure = 1;
};

class on_plates : public lit_scene {
public:
    explicit on_plates(int size) {
        name = "plates";
        width = size * 3 / 2, height = width * 3 / 4;
        surfaces = static_cast<int>(s.rectangles.size());
        points = plates::look(s, width, height);
    }
    int surface(std::size_t pixel) const override {
        return points[pixel] ? static_cast<int>(points[pixel]->rectangle) : -1;
    }
    draw sample(std::size_t pixel, technique by, pcg32& rng) const override {
        const auto which = static_cast<std::size_t>(4 * plates::uniform(rng)); // of the four lights
        const plates::draw d = by == bsdf ? plates::draw_bsdf(s, *points[pixel], rng)
                                          : plates::draw_light(s, *points[pixel], which, rng);
        return {d.f, d.p};
    }

private:
    plates::scene s = plates::make_scene();
    plates::seen_points points;
};

// The first vertex along a ray, in scenes without media.
std::optional<bpt::vertex<double>> meet(const bpt::scene<double>& s, const dvec3& origin, const dvec3& to) {
    const auto hit = bpt::intersect(s, origin, to);
    if (!hit)
        return s.environment < 0 ? std::nullopt
                                 : std::optional(bpt::light_vertex(s, s.environment, dvec3(0), to));
    if (hit->light >= 0)
        return bpt::light_vertex(s, hit->light, hit->position, hit->normal);
    bpt::vertex<double> x;
    x.point = *hit;
    x.material = &s.materials[static_cast<std::size_t>(hit->material)];
    x.kind = bpt::is_dirac(*x.material) ? mis::vertex_kind::dirac : mis::vertex_kind::surface;
    x.towards_previous = -to;
    return x;
}

class in_renderer : public lit_scene {
public:
    in_renderer(const std::string& of, int size) : s(bpt::make_scene<double>(of)) {
        name = of;
        width = height = size;
        surfaces = static_cast<int>(s.materials.size());
        exposure = s.exposure;
        pcg32 unused;
        const auto lens = bpt::sample_lens(s.camera, unused);
        for (int i = 0; i < size * size; ++i) {
            const dvec3 leaving = bpt::film_to_direction(s.camera, lens, 2 * (i % size + 0.5) / size - 1,
                                                         1 - 2 * (i / size + 0.5) / size);
            const auto x = meet(s, lens.point.position, leaving);
            seen.push_back(x && bpt::can_join(*x) ? x : std::nullopt);
        }
    }
    int surface(std::size_t pixel) const override { return seen[pixel] ? seen[pixel]->point.material : -1; }
    draw sample(std::size_t pixel, technique by, pcg32& rng) const override {
        const vertex& x = *seen[pixel];
        if (by == bsdf) {
            const dvec3 to = bpt::sample(*x.material, x.point, x.towards_previous, rng);
            const auto y = meet(s, x.point.position, to);
            return y && bpt::is_light(*y) ? found(x, *y, to) : draw{};
        }
        const int i = bpt::pick_light(s, &bpt::light<double>::select_next_event, rng);
        const vertex y =
            bpt::sample_light_point(s, i, s.lights[static_cast<std::size_t>(i)].lobe_share_next_event, rng);
        const dvec3 to = bpt::direction(x, y);
        const draw d = found(x, y, to);
        return plates::sum_of(d.f) > 0 && bpt::between(s, x, y, to) ? d : draw{};
    }

private:
    using vertex = bpt::vertex<double>;

    draw found(const vertex& x, const vertex& y, const dvec3& to) const {
        const auto end = bpt::light_end_point(s, y, -to);
        const auto& m = *x.material;
        return {bpt::scattered(x, to, bpt::walk_kind::from_camera) * bpt::emitted(s, y, -to),
                {bpt::density(m, x.point, x.towards_previous, to) / m.survival, // no roulette here
                 end.next_event.value * bpt::squared_distance(x, y) / end.cos.value}};
    }

    bpt::scene<double> s;
    std::vector<std::optional<vertex>> seen;
};

// ---- Estimates ----

// An eighth of the rays, and as many of each technique.
int pilots_of_each(const options& o) { return std::max(1, o.rays / 16); }
constexpr int most_pilots = 64;
using pixel_pilot = mis::pilot<2, 1, float, 2 * most_pilots>;

// As many samples of each technique as `taken` says, weighed by the counts that were expected.
dvec3 combine(const lit_scene& s, std::size_t pixel, const pair& counts, const std::array<int, 2>& taken,
              pcg32& rng, pixel_pilot* pilot = nullptr) {
    dvec3 sum(0);
    for (const technique by : {bsdf, light})
        for (int k = 0; k < taken[by]; ++k) {
            const draw d = s.sample(pixel, by, rng);
            const double value = plates::sum_of(d.f);
            if (!(value > 0))
                continue;
            const double effective = counts[bsdf] * d.p[bsdf] + counts[light] * d.p[light];
            sum += d.f / effective;
            if (pilot)
                pilot->add(static_cast<float>(value), d.p, static_cast<float>(effective));
        }
    if (pilot)
        pilot->passes = 1;
    return sum;
}

// Calls render(pixel, rng) where a surface is seen.
template <class Render>
void for_each_seen(const lit_scene& s, const options& o, std::uint64_t seed, const Render& render) {
    for_each_pixel(s.width, s.height, o.threads, seed, [&](std::size_t pixel, pcg32& rng) {
        if (s.surface(pixel) >= 0)
            render(pixel, rng);
    });
}

image render_equal(const lit_scene& s, const options& o, std::uint64_t seed) {
    image result(s.width, s.height);
    const int half = o.rays / 2;
    for_each_seen(s, o, seed, [&](std::size_t pixel, pcg32& rng) {
        result.pixels[pixel] = combine(s, pixel, {double(half), double(half)}, {half, half}, rng);
    });
    return result;
}

// Counts for the pixels of each tile that show the same surface, from the pilots of these and of those
// around.
void find_counts(const lit_scene& s, const options& o, double budget, const std::vector<pixel_pilot>& pilots,
                 std::vector<pair>& counts) {
    mis::allocation_options keep;
    keep.least_share = o.least_share;
    keep.tolerance = 1e-3;
    const int across = (s.width + o.tile - 1) / o.tile, down = (s.height + o.tile - 1) / o.tile;
    tools::in_parallel(o.threads, across * down, [&](int tile) {
        const int left = tile % across * o.tile, top = tile / across * o.tile;
        const auto for_each_of = [&](int more, int surface, const auto& visit) {
            for (int y = std::max(0, top - more); y < std::min(s.height, top + o.tile + more); ++y)
                for (int x = std::max(0, left - more); x < std::min(s.width, left + o.tile + more); ++x)
                    if (s.surface(std::size_t(y * s.width + x)) == surface)
                        visit(std::size_t(y * s.width + x));
        };
        for (int surface = 0; surface < s.surfaces; ++surface) {
            std::vector<std::size_t> mine;
            for_each_of(0, surface, [&](std::size_t i) { mine.push_back(i); });
            if (mine.empty())
                continue;
            std::vector<pixel_pilot> near;
            for_each_of(o.around, surface, [&](std::size_t i) { near.push_back(pilots[i]); });
            constexpr pair equal{1, 1};
            const auto found = mis::allocate(near.data(), near.size(), equal, budget, keep, equal.data());
            for (const std::size_t i : mine)
                counts[i] = {found.counts[bsdf], found.counts[light]};
        }
    });
}

struct allocated {
    image mean, split;   // split: the share of light samples, in each channel
    double searched = 0; // seconds that the search for counts takes
};

allocated render_allocated(const lit_scene& s, const options& o, std::uint64_t seed) {
    const int each = pilots_of_each(o);
    const double budget = o.rays - 2 * each, part = 2.0 * each / o.rays;
    std::vector<pixel_pilot> pilots(std::size_t(s.width * s.height));
    allocated r{image(s.width, s.height), image(s.width, s.height), 0};
    for_each_seen(s, o, seed, [&](std::size_t pixel, pcg32& rng) {
        r.mean.pixels[pixel] =
            part * combine(s, pixel, {double(each), double(each)}, {each, each}, rng, &pilots[pixel]);
    });
    std::vector<pair> counts(pilots.size());
    const auto before = std::chrono::steady_clock::now();
    find_counts(s, o, budget, pilots, counts);
    r.searched = std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
    for_each_seen(s, o, ~seed, [&](std::size_t pixel, pcg32& rng) {
        const pair& n = counts[pixel];
        std::array<int, 2> taken{};
        mis::round_counts(n, 2, plates::uniform(rng), taken);
        r.mean.pixels[pixel] += (1 - part) * combine(s, pixel, n, taken, rng);
        r.split.pixels[pixel] = dvec3(n[light] / budget);
    });
    return r;
}

// ---- What is written ----

// Of runs: mean and variance of each pixel, channels added.
struct runs {
    std::vector<dvec3> sum;
    std::vector<double> squares;
    int count = 0;

    explicit runs(std::size_t pixels) : sum(pixels, dvec3(0)), squares(pixels) {}
    void add(const image& m) {
        for (std::size_t i = 0; i < sum.size(); ++i) {
            sum[i] += m.pixels[i];
            squares[i] += dot(m.pixels[i], m.pixels[i]);
        }
        ++count;
    }
    double variance(std::size_t i) const {
        return std::max(0.0, (squares[i] - dot(sum[i], sum[i]) / count) / (count - 1));
    }
    double mean_variance() const {
        double total = 0;
        for (std::size_t i = 0; i < sum.size(); ++i)
            total += variance(i) / double(sum.size());
        return total;
    }
};

image to_picture(const lit_scene& s, const image& m) {
    image shown = m;
    for (dvec3& pixel : shown.pixels)
        for (int c = 0; c < 3; ++c)
            pixel[c] = to_srgb(1 - std::exp(-s.exposure * std::max(0.0, pixel[c])));
    return shown;
}
image split_picture(const lit_scene& s, const image& split) {
    image shown = split;
    for (std::size_t i = 0; i < shown.pixels.size(); ++i)
        shown.pixels[i] = s.surface(i) >= 0 ? blue_to_orange(1 - split.pixels[i].x) : dvec3(0.25);
    return shown;
}
image above(const image& top, const image& bottom) {
    image both(top.width, 2 * top.height);
    std::copy(top.pixels.begin(), top.pixels.end(), both.pixels.begin());
    std::copy(bottom.pixels.begin(), bottom.pixels.end(),
              both.pixels.begin() + std::ptrdiff_t(top.pixels.size()));
    return both;
}

struct comparison {
    double ratio, error; // the variance of 1:1 over the allocated one's; its standard error
    double largest;      // how far means of blocks are apart at most, in standard errors
    double light_share;
    double search; // time of the search for counts over that of an image with 1:1
    allocated shown;
    image equal;
};

comparison compare(const lit_scene& s, const options& o) {
    const auto pixels = std::size_t(s.width * s.height);
    constexpr int across = 4;
    runs equal(pixels), learned(pixels), part_equal(pixels), part_learned(pixels);
    comparison c{};
    double seconds = 0, searched = 0;
    std::vector<double> ratios; // of groups of runs
    std::array<std::vector<double>, across * across> apart;
    for (int run = 0; run < o.runs; ++run) {
        show_progress(text("%s: run %d of %d", s.name.c_str(), run + 1, o.runs));
        const std::uint64_t seed = o.seed + 1000 * std::uint64_t(run);
        const auto before = std::chrono::steady_clock::now();
        const image a = render_equal(s, o, seed + 1);
        seconds +=
            o.threads * std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
        const allocated b = render_allocated(s, o, seed + 2);
        searched += o.threads * b.searched;
        for (auto* r : {&equal, &part_equal})
            r->add(a);
        for (auto* r : {&learned, &part_learned})
            r->add(b.mean);
        std::array<double, across * across> off{};
        for (std::size_t i = 0; i < pixels; ++i) {
            const int x = int(i) % s.width * across / s.width, y = int(i) / s.width * across / s.height;
            off[std::size_t(y * across + x)] += plates::sum_of(a.pixels[i] - b.mean.pixels[i]);
        }
        for (std::size_t k = 0; k < off.size(); ++k)
            apart[k].push_back(off[k]);
        if (part_equal.count == 4) {
            ratios.push_back(part_equal.mean_variance() / part_learned.mean_variance());
            part_equal = part_learned = runs(pixels);
        }
        if (run == 0)
            c.shown = b, c.equal = a;
    }
    c.search = searched / seconds;
    c.ratio = equal.mean_variance() / learned.mean_variance();
    double squares = 0, mean = 0;
    for (const double r : ratios)
        mean += r / double(ratios.size());
    for (const double r : ratios)
        squares += (r - mean) * (r - mean);
    c.error = ratios.size() > 1 ? std::sqrt(squares / double(ratios.size() - 1) / double(ratios.size())) : 0;
    for (const auto& block : apart) {
        double sum = 0, square = 0;
        for (const double x : block)
            sum += x / o.runs;
        for (const double x : block)
            square += (x - sum) * (x - sum) / (o.runs - 1);
        if (square > 0)
            c.largest = std::max(c.largest, std::fabs(sum) / std::sqrt(square / o.runs));
    }
    double lit = 0;
    for (std::size_t i = 0; i < pixels; ++i)
        if (s.surface(i) >= 0)
            c.light_share += c.shown.split.pixels[i].x, ++lit;
    c.light_share /= lit;
    return c;
}

bool run(const options& o) {
    csv_file csv(o.output, "direct_allocation.csv",
                 "scene,rays,pilot_rays,variance_of_equal_over_it,standard_error,light_share");
    std::vector<std::unique_ptr<lit_scene>> scenes;
    scenes.push_back(std::make_unique<on_plates>(o.size));
    for (const char* name : {"cornell", "spheres", "glossy", "smooth", "environment"})
        scenes.push_back(std::make_unique<in_renderer>(name, o.size));
    std::vector<panel> panels;
    const color_bar bar{blue_to_orange, "all light samples", "all BSDF samples"};
    bool good = true;
    double product = 1, largest = 0;
    std::printf("%d rays in each pixel, %d of them pilots; %d runs\n", o.rays, 2 * pilots_of_each(o), o.runs);
    for (const auto& s : scenes) {
        const comparison c = compare(*s, o);
        csv.add(text("%s,%d,%d,%.5g,%.2g,%.4f", s->name.c_str(), o.rays, 2 * pilots_of_each(o), c.ratio,
                     c.error, c.light_share));
        good &= report(1 / c.ratio <= 1.05, text("%-12s variance of 1:1 over the allocated: %.3f ± %.3f, "
                                                 "light samples %.0f %% (bar: 1 / 1.05)",
                                                 s->name.c_str(), c.ratio, c.error, 100 * c.light_share));
        note(text("%-12s the search for counts takes %.2g times as long as all rays of an image",
                  s->name.c_str(), c.search));
        product *= c.ratio;
        largest = std::max(largest, c.largest);
        if (s == scenes.front())
            write_panels(o.output + "/direct_allocation-plates.jpg",
                         {{"1:1", to_picture(*s, c.equal)},
                          {"allocated", to_picture(*s, c.shown.mean)},
                          {"the split", split_picture(*s, c.shown.split)}},
                         bar);
        else
            panels.push_back(
                {s->name, above(to_picture(*s, c.shown.mean), split_picture(*s, c.shown.split))});
    }
    write_panels(o.output + "/direct_allocation.jpg", panels, bar);
    const double mean = std::pow(product, 1 / double(scenes.size()));
    good &= report(mean >= 1.3, text("geometric mean over the scenes: %.3f (bar: 1.3)", mean));
    good &= report(largest <= 6, text("means of 4 x 4 blocks of all scenes: at most %.1f standard errors "
                                      "apart (bar: 6, by chance with 2 seeds of 1000 if there are 16 runs)",
                                      largest));
    return good;
}

} // namespace

int main(int count, char** arguments) {
    options o;
    command_line app("Direct light by BSDF and light samples, as many of each and as pilot samples have it; "
                     "writes direct_allocation.csv and pictures.",
                     o);
    app.add("--rays", o.rays, "in each pixel", 8, 16 * most_pilots);
    app.add("--runs", o.runs, "of each image", 8, 100000);
    app.add("--tile", o.tile, "width in pixels that share their counts", 1, 64);
    app.add("--around", o.around, "pixels around a tile, of which the pilots count", 0, 16);
    app.add("--least-share", o.least_share, "of each technique", 0, 0.5);
    return run_study(app, o, count, arguments, run);
}
