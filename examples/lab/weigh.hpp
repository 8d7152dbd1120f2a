// Every weight three ways: by the two-number recursion while rendering, by the complete path's densities, and
// by the throughputs that each technique would have had. The renderer uses the first; here it is compared
// with the others.
#pragma once

#include "path.hpp"
#include <array>
#include <climits>
#include <cstdint>
#include <mis/verify/subpaths.hpp>

namespace lab {

// The counts for one path. Walks that end where they can first be merged are capped there.
template <class Real>
mis::technique_counts<Real> counts_for(const renderer<Real>& r, const seen_path<Real>& path) {
    auto counts = r.weigh.counts;
    for (int i = path.size - 2; r.set.merges_once && i > 0; --i)
        if (can_join(path[i]))
            counts.max_camera_vertices = i + 1;
    return counts;
}

template <class Real> bool is_capped(const mis::technique_counts<Real>& c) {
    return c.max_camera_vertices < INT_MAX || c.max_light_vertices < INT_MAX;
}
// Two numbers know neither all densities at once, as the cutoff heuristic wants them, nor caps on sub-paths.
// Where walks merge once, no path is made in two ways.
template <class Real> bool takes_whole_path(const renderer<Real>& r) {
    const bool is_cutoff = r.weigh.heuristic.kind == heuristic_kind::cutoff;
    return (is_cutoff || is_capped(r.weigh.counts)) && !r.set.merges_once;
}

// A contribution by balance, and the balance weights of all techniques that could have made its path.
struct balanced_sample {
    int pixel, vertices, technique; // its place, as in mis::technique_at
    glm::dvec3 value;               // times its balance weight
    std::array<double, mis::technique_count(longest_path)> weights;
};

template <class Real>
balanced_sample balance(const renderer<Real>& r, const contribution<Real>& c, const seen_path<Real>& path) {
    balanced_sample s{
        c.pixel, path.size, mis::technique_index(path.size, c.technique), glm::dvec3(c.value), {}};
    mis::measured_vertex<double> records[longest_path];
    records_of(path, records);
    for (int i = 1; i + 1 < path.size; ++i) // families are one merge by balance, whatever weighs the image
        if (is_in_medium(path[i]))
            records[i].merge_factor = joined(mis::balance, in_double(path.sizes[i]));
    mis::weights(mis::balance, in_double(counts_for(r, path)), records, path.size, s.weights.data());
    s.value *= s.weights[static_cast<std::size_t>(s.technique)] *
               family_share({heuristic_kind::balance}, path, c.technique);
    return s;
}

// ---- The throughputs of all techniques, each from walking the path anew ----

template <class Real> Real sum(const color<Real>& c) { return c.x + c.y + c.z; }

// The path's edges as its vertices see them: the direction and both cosines at each end, from positions
// alone. Where walks have merged, the edge towards the light is the photon's.
template <class Real> struct path_geometry {
    struct side { // of a vertex
        vec3<Real> to;
        Real shading_cosine = 1, geometric_cosine = 1;
    };
    side to_camera[longest_path], to_light[longest_path];
    Real distance2_to_light[longest_path];
};

template <class Real>
typename path_geometry<Real>::side side_towards(const vertex<Real>& x, const vec3<Real>& to) {
    return {to, shading_cosine(x, to), geometric_cosine(x, to)};
}

template <class Real> path_geometry<Real> geometry_of(const seen_path<Real>& path) {
    path_geometry<Real> g;
    for (int i = 0; i + 1 < path.size; ++i) {
        const vertex<Real>& x = start_of_edge(path, i);
        const vertex<Real>& y = path[i + 1];
        g.to_light[i] = side_towards(x, direction(x, y));
        g.to_camera[i + 1] = side_towards(y, direction(y, x));
        g.distance2_to_light[i] = squared_distance(x, y);
    }
    return g;
}

// f |cos| of scattering at vertex i as a walk multiplies it, and the density that it divides by.
template <class Real>
color<Real> scattered(const seen_path<Real>& path, const path_geometry<Real>& g, int i, walk_kind kind) {
    const vertex<Real>& x = path[i];
    const bool camera = kind == walk_kind::from_camera;
    const auto &from = camera ? g.to_camera[i] : g.to_light[i], &to = camera ? g.to_light[i] : g.to_camera[i];
    const color<Real> f = evaluate(*x.material, x.point, from.to, to.to) * to.shading_cosine;
    return camera ? f
                  : f * mis::shading_normal_factor(from.shading_cosine, from.geometric_cosine,
                                                   to.shading_cosine, to.geometric_cosine);
}
template <class Real>
Real scatter_density(const seen_path<Real>& path, const path_geometry<Real>& g, int i, walk_kind kind) {
    const vertex<Real>& x = path[i];
    const bool camera = kind == walk_kind::from_camera;
    material<Real> m = *x.material;
    if (i == path.merged && !camera)
        m.survival = path.photon->material->survival; // the light walk would go on from there
    const Real p = camera ? density(m, x.point, g.to_camera[i].to, g.to_light[i].to)
                          : density(m, x.point, g.to_light[i].to, g.to_camera[i].to);
    return p * over_survival(path, kind, i);
}

// What a walk multiplies at vertex i of the path.
template <class Real>
color<Real> walk_factor(const seen_path<Real>& path, const path_geometry<Real>& g, int i, walk_kind kind) {
    const vertex<Real>& x = path[i];
    if (!is_dirac(*x.material))
        return scattered(path, g, i, kind) / scatter_density(path, g, i, kind);
    const bool camera = kind == walk_kind::from_camera;
    const vec3<Real>&from = camera ? g.to_camera[i].to : g.to_light[i].to,
          &to = camera ? g.to_light[i].to : g.to_camera[i].to;
    const bool reflects = dot(x.point.normal, from) * dot(x.point.normal, to) > Real(0);
    const dirac_lobe<Real> lobe = dirac_scatter(*x.material, x.point, from, reflects);
    return lobe.value * (radiance_scale(lobe, kind) / (lobe.probability * over_survival(path, kind, i)));
}

// What a walk's throughput is multiplied with along the edge between x_i and x_{i+1}: transmittance over the
// density of the distance. A beam has not sampled how far it goes in its last medium; a short one has passed
// so far.
enum class edge_end { stops, long_beam, short_beam };
template <class Real>
color<Real> edge_factor(const seen_path<Real>& path, int i, walk_kind kind, edge_end end) {
    const flight<Real> f = kind == walk_kind::from_camera ? path.edges[i] : reversed(path.edges[i]);
    const bool in_medium = is_in_medium(path[kind == walk_kind::from_camera ? i + 1 : i]);
    const Real last = end == edge_end::long_beam            ? Real(1)
                      : end == edge_end::stops && in_medium ? f.last.density
                                                            : f.last.pass;
    return f.transmittance / (f.before * last);
}

// One technique's place among the throughputs: those of mis::technique_at, and behind them the four families
// of every vertex in a medium.
constexpr int longest_throughputs = mis::technique_count(longest_path) + 4 * longest_path;
inline int throughput_count(int n) { return mis::technique_count(n) + 4 * n; }
inline int throughput_index(int n, int vertex, mis::merge_family family) {
    return mis::technique_count(n) + 4 * vertex + static_cast<int>(family);
}

// The kernel's share of the throughput of a merge of one light walk, and how many light walks there are.
template <class Real>
std::pair<Real, Real> kernel_and_walks(const renderer<Real>& r, mis::merge_family family, Real sine) {
    const Real walks = static_cast<Real>(r.set.width) * static_cast<Real>(r.set.width),
               step = static_cast<Real>(r.set.media.walks_for_beams),
               beam_walks = std::ceil(walks / step); // number 0, and every so many-th
    const auto& radii = r.set.media.radii;
    const auto cube = [](Real x) { return x * x * x; };
    switch (family) {
    case mis::merge_family::point_point:
        return {3 / (4 * pi<Real> * cube(radii.point_point)), walks};
    case mis::merge_family::point_beam:
        return {1 / (pi<Real> * radii.point_beam * radii.point_beam), walks};
    case mis::merge_family::beam_point:
        return {1 / (pi<Real> * radii.beam_point * radii.beam_point), beam_walks};
    default:
        return {1 / (2 * radii.beam_beam * sine), beam_walks};
    }
}

// S of every technique of a path, for counts of 1; infinite where a technique cannot make it. A merge of one
// light walk estimates a density: its throughput has 1 / (pi r^2). Nothing here looks at the path's records.
template <class Real>
void throughputs_of(const renderer<Real>& r, const seen_path<Real>& path, Real* out, Real* walks) {
    constexpr Real impossible = std::numeric_limits<Real>::infinity();
    constexpr auto from_camera_on = walk_kind::from_camera, from_light_on = walk_kind::from_light;
    const int n = path.size, last = n - 1;
    const auto joinable = [&](int i) { return i == 0 || i == last || !scatters_dirac(path[i]); };
    std::fill(out, out + throughput_count(n), impossible);
    std::fill(walks, walks + throughput_count(n), Real(0));

    const path_geometry<Real> g = geometry_of(path);
    const auto lens = camera_end_point(r.scene.camera, g.to_light[0].to, r.set.width);
    const auto light =
        light_end_point(r.weigh.roulette, r.scene, path[last], g.to_camera[last].to, path[last - 1]);
    const color<Real> radiance = emitted(r.scene, path[last], g.to_camera[last].to);
    const Real cos_light = light.cos.value;
    const Real response = lens.direction.value; // W |cos| over the density of the lens point

    // Throughputs on leaving for x_i, and on arriving there.
    color<Real> to_camera[longest_path], to_light[longest_path], from_camera[longest_path],
        from_light[longest_path];
    to_camera[1] = color<Real>(response / lens.direction.value);
    from_camera[1] = to_camera[1] * edge_factor(path, 0, from_camera_on, edge_end::stops);
    for (int i = 2; i < n; ++i) {
        to_camera[i] = from_camera[i - 1] * walk_factor(path, g, i - 1, from_camera_on);
        from_camera[i] = to_camera[i] * edge_factor(path, i - 1, from_camera_on, edge_end::stops);
    }
    to_light[last - 1] = radiance * (cos_light / (light.position.value * light.direction.value));
    from_light[last - 1] = to_light[last - 1] * edge_factor(path, last - 1, from_light_on, edge_end::stops);
    for (int i = last - 2; i > 0; --i) {
        to_light[i] = from_light[i + 1] * walk_factor(path, g, i + 1, from_light_on);
        from_light[i] = to_light[i] * edge_factor(path, i, from_light_on, edge_end::stops);
    }

    for (int s = 1; s <= n; ++s) {
        color<Real> throughput;
        if (s < n && !(joinable(s - 1) && joinable(s)))
            continue;
        const Real distance2 = s < n ? g.distance2_to_light[s - 1] : Real(1);
        if (s == n)
            throughput = from_camera[last] * radiance;
        else if (n == 2)
            throughput = radiance * (cos_light * response / (light.position.value * distance2));
        else if (s == 1)
            throughput = from_light[1] * scattered(path, g, 1, from_light_on) * (response / distance2);
        else if (s == last)
            throughput = from_camera[s - 1] * scattered(path, g, s - 1, from_camera_on) * radiance *
                         (cos_light / (light.next_event.value * distance2));
        else
            throughput = from_camera[s - 1] * scattered(path, g, s - 1, from_camera_on) *
                         scattered(path, g, s, from_light_on) * from_light[s] / distance2;
        if (s < n)
            throughput *= path.edges[s - 1].transmittance;
        if (s < n || light.hittable)
            out[s] = sum(throughput);
    }
    for (int s = 2; s < n && r.set.merge_radius > Real(0); ++s) {
        const vertex<Real>& x = path[s - 1];
        const auto &in = g.to_light[s - 1], &back = g.to_camera[s - 1];
        if (joinable(s - 1) && !is_in_medium(x))
            out[mis::technique_index(n, {mis::technique_kind::merge, s})] =
                sum(from_camera[s - 1] * evaluate(*x.material, x.point, back.to, in.to) * from_light[s - 1]) *
                in.shading_cosine / (in.geometric_cosine * mis::merge_area(r.set.merge_radius));
    }
    for (int i = 1; i < last; ++i) {
        if (!is_in_medium(path[i]))
            continue;
        const vertex<Real>& x = path[i];
        const vec3<Real>&in = g.to_light[i].to, &back = g.to_camera[i].to;
        const color<Real> f = evaluate(*x.material, x.point, back, in);
        using family = mis::merge_family;
        for (const auto kind :
             {family::point_point, family::point_beam, family::beam_point, family::beam_beam}) {
            if (!(mis::size_of(r.set.media.sizes, kind) > Real(0)))
                continue;
            const bool camera_beam = kind == family::point_beam || kind == family::beam_beam,
                       light_beam = kind == family::beam_point || kind == family::beam_beam;
            const auto end = [](bool is_beam, bool is_long) {
                return !is_beam ? edge_end::stops : is_long ? edge_end::long_beam : edge_end::short_beam;
            };
            const color<Real> camera =
                to_camera[i] *
                edge_factor(path, i - 1, from_camera_on, end(camera_beam, r.set.media.long_camera_beams));
            const color<Real> light_side =
                to_light[i] *
                edge_factor(path, i, from_light_on, end(light_beam, r.set.media.long_light_beams));
            const auto [kernel, light_walks] = kernel_and_walks(r, kind, length(cross(back, in)));
            const auto place = throughput_index(n, i, kind);
            out[place] = sum(camera * f * light_side) * kernel;
            walks[place] = light_walks;
        }
    }
}

// ---- The comparison ----

struct deviation {
    double largest = 0;
    std::int64_t compared = 0, above_1e_5 = 0;

    void add(double a, double b) {
        const double apart = a == b ? 0 : std::abs(a - b) / std::max(a, b);
        largest = std::max(largest, apart);
        above_1e_5 += apart > 1e-5;
        ++compared;
    }
    void add(const deviation& other) {
        largest = std::max(largest, other.largest);
        compared += other.compared;
        above_1e_5 += other.above_1e_5;
    }
};

// Greatest deviations of the weights of all paths seen.
struct weight_checks {
    deviation recursion;              // of the recursion from the multiplied densities, relative
    deviation throughput;             // of the throughput form from the multiplied densities, relative
    double sum = 0;                   // |sum of all weights of a path - 1|: densities
    double recursion_sum = 0;         // the same, all by the recursion: every 16th path
    std::int64_t paths = 0, ties = 0; // maximum: paths whose weight hangs on rounding
    int shortest = longest_path, longest = 0;

    void add(const weight_checks& other) {
        recursion.add(other.recursion);
        throughput.add(other.throughput);
        sum = std::max(sum, other.sum);
        recursion_sum = std::max(recursion_sum, other.recursion_sum);
        paths += other.paths;
        ties += other.ties;
        shortest = std::min(shortest, other.shortest);
        longest = std::max(longest, other.longest);
    }
};

// True where two techniques are so close to the largest density that rounding decides which is the maximum,
// or so close to the cutoff that rounding decides which is kept.
inline bool hangs_on_rounding(const any_heuristic& h, const double* densities, int count, double tolerance) {
    if (h.kind != heuristic_kind::maximum && h.kind != heuristic_kind::cutoff)
        return false;
    const double edge = h.kind == heuristic_kind::maximum ? 1 : h.parameter;
    int close = h.kind == heuristic_kind::maximum ? -1 : 0;
    for (int k = 0; k < count; ++k)
        close += std::abs(densities[k] - edge) < tolerance * edge;
    return close > 0;
}

// The densities of a path's techniques, multiplied out in double, and the weights that follow from them.
struct path_densities {
    double densities[mis::technique_count(longest_path)], weights[mis::technique_count(longest_path)];
};
template <class Real> path_densities densities_of(const renderer<Real>& r, const seen_path<Real>& path) {
    path_densities all;
    mis::measured_vertex<double> records[longest_path];
    records_of(path, records);
    mis::relative_densities(in_double(counts_for(r, path)), records, path.size, all.densities);
    mis::weights(r.weigh.heuristic, all.densities, mis::technique_count(path.size), all.weights);
    return all;
}

// The weight of a path's technique by its throughputs. The throughput form knows counts as they are: a random
// connection is a factor of its throughput, and so is the area of a merge.
template <class Real>
Real weight_by_throughput(const renderer<Real>& r, const seen_path<Real>& path, mis::technique technique) {
    const int n = path.size, count = mis::technique_count(n);
    const auto path_counts = counts_for(r, path);
    Real throughputs[longest_throughputs], counts[longest_throughputs];
    throughputs_of(r, path, throughputs, counts);
    for (int k = 0; k < count; ++k) {
        const mis::technique t = mis::technique_at(n, k);
        const bool picked = t.kind == mis::technique_kind::connection && r.mean_light_vertices > 0;
        const Real factor = picked ? static_cast<Real>(r.mean_light_vertices) : Real(1);
        const Real area = t.kind == mis::technique_kind::merge
                              ? mis::merge_area(r.set.merge_radius) / r.weigh.surface_factor
                              : Real(1);
        const Real count_with_factors = mis::count_of(path_counts, n, t);
        counts[k] = count_with_factors > Real(0) && throughputs[k] < std::numeric_limits<Real>::infinity()
                        ? count_with_factors * factor / area
                        : Real(0);
        throughputs[k] *= factor;
    }
    for (int i = 1; i + 1 < n; ++i) {
        using family = mis::merge_family;
        if (is_in_medium(path[i]) &&
            !mis::is_within_caps(path_counts, n, {mis::technique_kind::merge, i + 1}))
            for (const auto kind :
                 {family::point_point, family::point_beam, family::beam_point, family::beam_beam})
                counts[throughput_index(n, i, kind)] = 0;
    }
    mis::densities_from_throughputs(counts, throughputs, throughput_count(n), throughputs);
    const bool in_medium =
        technique.kind == mis::technique_kind::merge && is_in_medium(path[technique.camera_vertices - 1]);
    return mis::weight(r.weigh.heuristic, throughputs, throughput_count(n),
                       in_medium ? throughput_index(n, technique.camera_vertices - 1, path.family)
                                 : mis::technique_index(n, technique));
}

// The sum of all weights of a path by the recursion.
template <class Real>
Real sum_by_recursion(const renderer<Real>& r, const seen_path<Real>& path,
                      const path_densities& by_density) {
    Real sum = 0;
    for (int k = 0; k < mis::technique_count(path.size); ++k)
        if (by_density.densities[k] > 0)
            sum += mis::weight_in_subpaths(r.weigh.heuristic, r.weigh.counts, path.records, path.size,
                                           mis::technique_at(path.size, k));
    return sum;
}

// Compares one weight with the other two forms.
template <class Real>
void check_weight(const renderer<Real>& r, const seen_path<Real>& path, mis::technique technique, Real weight,
                  weight_checks& checks) {
    const int n = path.size, count = mis::technique_count(n);
    const auto own = static_cast<std::size_t>(mis::technique_index(n, technique));
    ++checks.paths;
    checks.shortest = std::min(checks.shortest, n);
    checks.longest = std::max(checks.longest, n);

    const path_densities by_density = densities_of(r, path);
    double total = -1;
    for (int k = 0; k < count; ++k)
        total += by_density.weights[k];
    checks.sum = std::max(checks.sum, std::abs(total));
    const double tolerance = sizeof(Real) == 4 ? 1e-3 : 1e-9;
    if (hangs_on_rounding(r.weigh.heuristic, by_density.densities, count, tolerance)) {
        ++checks.ties;
        return;
    }
    const double expected = by_density.weights[own] * family_share(r.weigh.heuristic, path, technique);
    checks.recursion.add(static_cast<double>(weight), expected);
    checks.throughput.add(static_cast<double>(weight_by_throughput(r, path, technique)), expected);
    const bool has_recursion = !takes_whole_path(r) && !r.set.merges_once;
    if (checks.paths % 16 == 0 && has_recursion) {
        const double sum = static_cast<double>(sum_by_recursion(r, path, by_density));
        checks.recursion_sum = std::max(checks.recursion_sum, std::abs(sum - 1));
    }
}

} // namespace lab
