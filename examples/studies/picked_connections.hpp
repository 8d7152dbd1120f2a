// Bidirectional path tracing whose camera vertices are joined to a few of *all* light vertices of a pass,
// each picked with a probability: even, or by an importance that is learned from the connections made before.
//
// Vertices are told apart by cells. Let I(a, b) be the root of the mean square of what a connection from cell
// a to cell b has added, and u(a, b) = (1 - even) I(a, b) / Z(a) + even / l, where l is the mean number of
// vertices of a light walk and Z(a) makes the expected sum of u(a, .) over a light walk's vertices 1. A
// camera vertex in a picks each of the pass' light vertices y with a probability P in proportion to u(a,
// b(y)), and its connection counts 1 / (k N P) for k picks among N light walks: so much for the estimate,
// which is right for any u > 0. The weights count k u(a, b) connections, which depends on the path alone, as
// P does not: that is what every technique of the path is told, mis::times_connections.
#pragma once

#include "render_parts.hpp"
#include <algorithm>
#include <numeric>

namespace studies {

// ---- Cells: cubes, and in each of them the six directions that a surface is closest to facing ----

template <class Real> class vertex_cells {
public:
    vertex_cells(const bpt::scene<Real>& scene, Real width)
        : low(scene.center - scene.radius), size(width * scene.radius),
          across(static_cast<int>(std::ceil(2 / width))),
          numbers(static_cast<std::size_t>(across * across * across * kinds)) {}

    // What has not been met, nor found() before, is in cell 0.
    int operator()(const bpt::vertex<Real>& x) const { return numbers[place_of(x)]; }
    void found(const bpt::vertex<Real>& x) {
        int& number = numbers[place_of(x)];
        if (number == 0)
            number = count_++;
    }
    std::size_t count() const { return static_cast<std::size_t>(count_); }

private:
    static constexpr int kinds = 7; // the last one: in a medium

    std::size_t place_of(const bpt::vertex<Real>& x) const {
        using vec = bpt::vec3<Real>;
        // Facing where the walk has come from, which is where it goes to as well.
        const vec& n = x.point.normal;
        const vec facing = dot(n, x.towards_previous) < Real(0) ? -n : n;
        int kind = kinds - 1;
        if (!bpt::is_in_medium(x)) {
            const vec size_of = abs(facing);
            const int axis =
                size_of.x > size_of.y ? (size_of.x > size_of.z ? 0 : 2) : (size_of.y > size_of.z ? 1 : 2);
            kind = facing[axis] > Real(0) ? axis : axis + 3;
        }
        // Not on the side of a cube, where rounding would choose.
        const vec at = (x.point.position + (size / 64) * facing - low) / size;
        const auto index = [&](Real along) { return std::clamp(static_cast<int>(along), 0, across - 1); };
        return static_cast<std::size_t>(
            ((index(at.x) * across + index(at.y)) * across + index(at.z)) * kinds + kind);
    }

    bpt::vec3<Real> low;
    Real size;
    int across;
    int count_ = 1;
    std::vector<int> numbers;
};

// ---- What is learned ----

struct pick_options {
    int picks = 1;            // k, of each camera vertex
    double cell = 0.5;        // width of a cube, as a part of the scene's radius
    double even = 0.2;        // share of the probability that is even
    int first_walks = 2'000;  // of either kind, that find the cells
    bool learns = true;       // else all of it is
    bool weights_know = true; // else they count k / l connections everywhere
};

// k u(a, b) over its mean k / l, for all pairs of cells; a on the camera's side.
template <class Real> struct pick_table {
    std::size_t cells;
    std::vector<Real> over_mean;

    explicit pick_table(std::size_t n) : cells(n), over_mean(n * n, Real(1)) {}
    Real operator()(int a, int b) const {
        return over_mean[static_cast<std::size_t>(a) * cells + static_cast<std::size_t>(b)];
    }
};

// Of connections between two cells.
struct made_connection {
    int from, to;
    float value; // weighted; 0 where nothing arrives
};

// Sums over them.
class learned_importance {
public:
    // Light vertices of each cell in a walk, on average.
    explicit learned_importance(std::vector<double> vertices)
        : mean_vertices(std::move(vertices)), squares(mean_vertices.size() * mean_vertices.size()),
          counts(squares.size()) {}

    void add(const made_connection& c) {
        const std::size_t place = static_cast<std::size_t>(c.from) * cells() + static_cast<std::size_t>(c.to);
        squares[place] += static_cast<double>(c.value) * static_cast<double>(c.value);
        counts[place] += 1;
    }

    template <class Real> void fill(pick_table<Real>& table, double even) const {
        const double mean = std::accumulate(mean_vertices.begin(), mean_vertices.end(), 0.0);
        std::vector<double> importance(cells());
        for (std::size_t a = 0; a < cells(); ++a) {
            const std::size_t row = a * cells();
            const double usual = mean_square(row);
            double sum = 0;
            for (std::size_t b = 0; b < cells(); ++b) {
                // As if some connections of the usual size had been seen before: few say little.
                constexpr double before = 2;
                importance[b] = std::sqrt((squares[row + b] + before * usual) / (counts[row + b] + before));
                sum += mean_vertices[b] * importance[b];
            }
            for (std::size_t b = 0; b < cells(); ++b)
                table.over_mean[row + b] =
                    static_cast<Real>(sum > 0 ? even + (1 - even) * importance[b] * mean / sum : 1);
        }
    }

private:
    std::size_t cells() const { return mean_vertices.size(); }
    // Of connections from a cell to light vertices picked evenly, where any have been made.
    double mean_square(std::size_t row) const {
        double sum = 0, vertices = 0;
        for (std::size_t b = 0; b < cells(); ++b)
            if (counts[row + b] > 0) {
                sum += mean_vertices[b] * squares[row + b] / counts[row + b];
                vertices += mean_vertices[b];
            }
        return vertices > 0 ? sum / vertices : 0;
    }

    std::vector<double> mean_vertices, squares, counts;
};

// ---- The renderer ----

// The weights: those of all connections, and how often each is made.
template <class Heuristic, class Real> struct picking_weights : bpt::weights_with_media<Heuristic, Real> {
    const vertex_cells<Real>* cells;
    const pick_table<Real>* table; // none: as if all pairs of vertices were connected equally often

    picking_weights(const Heuristic& h, const mis::technique_counts<Real>& c, const vertex_cells<Real>& of,
                    const pick_table<Real>* t)
        : bpt::weights_with_media<Heuristic, Real>(h, c), cells(&of), table(t) {}

    // Only between vertices that scatter.
    Real connections(const bpt::vertex<Real>& camera_side, const bpt::vertex<Real>& light_side) const {
        return table && camera_side.material && light_side.material
                   ? (*table)((*cells)(camera_side), (*cells)(light_side))
                   : Real(1);
    }
};

// The light vertices of a pass, by cell.
template <class Real> struct light_vertices {
    struct place {
        std::uint32_t walk;
        std::uint32_t vertices; // of the walk, up to here
    };
    std::vector<bpt::walk<Real>> walks;
    std::vector<place> places; // those of cell b: first[b] ... first[b + 1]
    std::vector<std::size_t> first;
    std::vector<double> cumulative; // for each cell a: sums of over_mean over light vertices up to cell b

    void sort(const vertex_cells<Real>& cells) {
        first.assign(cells.count() + 1, 0);
        for_each_joinable([&](std::size_t, std::size_t, const bpt::vertex<Real>& x) {
            ++first[static_cast<std::size_t>(cells(x)) + 1];
        });
        std::partial_sum(first.begin(), first.end(), first.begin());
        places.resize(first.back());
        std::vector<std::size_t> next(first.begin(), first.end() - 1);
        for_each_joinable([&](std::size_t walk, std::size_t k, const bpt::vertex<Real>& x) {
            places[next[static_cast<std::size_t>(cells(x))]++] = {static_cast<std::uint32_t>(walk),
                                                                  static_cast<std::uint32_t>(k + 1)};
        });
    }
    void weigh(const pick_table<Real>& table) {
        cumulative.resize(table.cells * table.cells);
        for (std::size_t a = 0; a < table.cells; ++a) {
            double sum = 0;
            for (std::size_t b = 0; b < table.cells; ++b) {
                const std::size_t at = a * table.cells + b;
                cumulative[at] = sum +=
                    static_cast<double>(table.over_mean[at]) * static_cast<double>(first[b + 1] - first[b]);
            }
        }
    }

private:
    template <class F> void for_each_joinable(F&& f) const {
        for (std::size_t i = 0; i < walks.size(); ++i)
            for (std::size_t k = 1; k < walks[i].size(); ++k)
                if (bpt::can_join(walks[i][k]))
                    f(i, k, walks[i][k]);
    }
};

template <class Real, class Heuristic> class picking_renderer {
public:
    using weights = picking_weights<Heuristic, Real>;

    // Walks of its own find the cells.
    picking_renderer(const bpt::scene<Real>& s, const bpt::settings<Real>& settings, const pick_options& p,
                     const Heuristic& h)
        : scene(s), set(settings), options(p), cells(s, static_cast<Real>(p.cell)), importance(find_cells(h)),
          table(cells.count()),
          weigh(h, mis::random_connection(set.counts, static_cast<Real>(mean_light_vertices / options.picks)),
                cells, options.weights_know ? &table : nullptr) {}
    picking_renderer(const picking_renderer&) = delete; // the weights refer to cells and table
    picking_renderer& operator=(const picking_renderer&) = delete;

    // The next pass. sink(row, contribution, complete path) is called in parallel for rows.
    template <class Sink> void render_pass(Sink&& sink) {
        const auto width = static_cast<std::size_t>(set.width);
        light.walks.resize(width * width);
        bpt::in_parallel(set.threads, set.width, [&](int row) {
            for (std::size_t i = first_of(row); i < first_of(row) + width; ++i) {
                pcg32 rng = generator(pass, width * width + i);
                bpt::walk_from_light(scene, weigh, set.longest - 1, light.walks[i], rng);
            }
        });
        light.sort(cells);
        light.weigh(table);
        std::vector<std::vector<made_connection>> made(width);
        bpt::in_parallel(set.threads, set.width, [&](int row) {
            render_row(row, made[static_cast<std::size_t>(row)],
                       [&](const bpt::contribution<Real>& c, const bpt::complete_path<Real>& path) {
                           sink(row, c, path);
                       });
        });
        ++pass;
        if (!options.learns)
            return;
        for (const auto& row : made)
            for (const made_connection& c : row)
                importance.add(c);
        if ((pass & (pass - 1)) == 0) // after 1, 2, 4, 8 ... passes
            importance.fill(table, options.even);
    }

    const bpt::scene<Real>& scene;
    bpt::settings<Real> set;
    pick_options options;
    double mean_light_vertices = 1;
    vertex_cells<Real> cells;
    learned_importance importance;
    pick_table<Real> table;
    weights weigh;

private:
    using pair_of_walks = bpt::sample_pair<Real, weights>;

    std::size_t first_of(int row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(set.width);
    }
    pcg32 generator(std::uint64_t of_pass, std::uint64_t pixel) const {
        return {set.seed * 0x9e3779b9u + of_pass, pixel};
    }
    template <class Weights>
    void camera_walk(const Weights& w, std::size_t pixel, bpt::walk<Real>& walk, pcg32& rng) const {
        const auto width = static_cast<std::size_t>(set.width);
        const Real x = static_cast<Real>(pixel % width) + bpt::uniform<Real>(rng),
                   y = static_cast<Real>(pixel / width) + bpt::uniform<Real>(rng),
                   to_film = 2 / static_cast<Real>(set.width);
        walk.clear();
        bpt::walk_from_camera(scene, w, set.width, x * to_film - 1, 1 - y * to_film, {set.longest, false},
                              walk, rng);
    }

    learned_importance find_cells(const Heuristic& h) {
        const bpt::weights_with_media<Heuristic, Real> unused(h, set.counts);
        const auto pixels = first_of(set.width);
        const auto walks = static_cast<std::size_t>(options.first_walks);
        const double share = 1 / static_cast<double>(walks);
        std::vector<double> vertices(1);
        double all = 0;
        bpt::walk<Real> walk;
        for (std::size_t i = 0; i < walks; ++i) {
            pcg32 rng = generator(~std::uint64_t(0), i);
            camera_walk(unused, i * pixels / walks, walk, rng);
            for (std::size_t k = 1; k < walk.size(); ++k)
                if (bpt::can_join(walk[k]))
                    cells.found(walk[k]);
            bpt::walk_from_light(scene, unused, set.longest - 1, walk, rng);
            for (std::size_t k = 1; k < walk.size(); ++k)
                if (bpt::can_join(walk[k])) {
                    cells.found(walk[k]);
                    vertices.resize(cells.count());
                    vertices[static_cast<std::size_t>(cells(walk[k]))] += share;
                    all += share;
                }
        }
        vertices.resize(cells.count());
        mean_light_vertices = std::max(all, share);
        return learned_importance(std::move(vertices));
    }

    template <class Sink> void render_row(int row, std::vector<made_connection>& made, Sink&& sink) const {
        pair_of_walks pair{scene, weigh, set.width, 0, set.longest, {}, {}};
        for (std::size_t i = first_of(row); i < first_of(row + 1); ++i) {
            pair.pixel = static_cast<int>(i);
            pcg32 rng = generator(pass, i);
            camera_walk(weigh, i, pair.camera, rng);
            pair.light = light.walks[i];
            bpt::connect_all(pair, rng, sink,
                             [&](const bpt::vertex<Real>& x) { pick(pair, x, rng, made, sink); });
        }
    }

    // k connections of a camera walk's end.
    template <class Sink>
    void pick(const pair_of_walks& pair, const bpt::vertex<Real>& camera_end, pcg32& rng,
              std::vector<made_connection>& made, Sink&& sink) const {
        const int a = cells(camera_end);
        const auto begin = light.cumulative.begin() +
                           static_cast<std::ptrdiff_t>(static_cast<std::size_t>(a) * table.cells),
                   end = begin + static_cast<std::ptrdiff_t>(table.cells);
        const double sum = end[-1];
        if (!(sum > 0))
            return;
        for (int k = 0; k < options.picks; ++k) {
            const double x = std::min(bpt::uniform<double>(rng) * sum, std::nextafter(sum, 0.0));
            const auto b = static_cast<std::size_t>(std::upper_bound(begin, end, x) - begin);
            const auto place = pick_in(b, rng);
            const Real over_mean = table(a, static_cast<int>(b));
            // 1 / (k N P)
            const Real factor =
                static_cast<Real>(sum / (options.picks * static_cast<double>(light.walks.size()) *
                                         static_cast<double>(over_mean)));
            made_connection one{a, static_cast<int>(b), 0};
            const auto times_factor = [&](bpt::contribution<Real> c, const bpt::complete_path<Real>& path) {
                one.value = static_cast<float>((c.value.x + c.value.y + c.value.z) * c.weight);
                c.value *= factor;
                sink(c, path);
            };
            const bpt::vertex<Real>& light_end = light.walks[place.walk][place.vertices - 1];
            if (camera_end.depth + light_end.depth <= pair.longest)
                bpt::connection(pair, camera_end, light_end, times_factor);
            if (options.learns)
                made.push_back(one);
        }
    }
    typename light_vertices<Real>::place pick_in(std::size_t cell, pcg32& rng) const {
        const std::size_t count = light.first[cell + 1] - light.first[cell];
        const auto k = static_cast<std::size_t>(bpt::uniform<double>(rng) * static_cast<double>(count));
        return light.places[light.first[cell] + std::min(k, count - 1)];
    }

    light_vertices<Real> light;
    std::uint64_t pass = 0;
};

// The next pass, added as render_parts.hpp does.
template <class Real, class Heuristic>
void add_pass(picking_renderer<Real, Heuristic>& renderer, parts& sum) {
    add_pass_of(renderer.set.width, sum, [&](auto&& add) {
        renderer.render_pass(
            [&](int row, const bpt::contribution<Real>& c, const bpt::complete_path<Real>&) { add(row, c); });
    });
}

} // namespace studies
