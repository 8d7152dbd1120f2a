// How rates of roulette and splitting are learned: what walks have contributed, and cost, from each vertex
// on. Costs are counted, not clocked, and everything is summed in the order of the image's rows: what is
// learned does not depend on threads.
#pragma once

#include "connect.hpp"
#include <functional>

namespace bpt {

// A ray costs 1, and a weighted contribution, beside its ray, this much.
constexpr double cost_of_weight = 0.25;

// What one walk has done from a vertex on: sums over the copies that have left it, as if each had carried 1.
template <class Real> struct visit {
    vec3<Real> position;
    walk_kind kind = walk_kind::from_camera;
    std::size_t bin = 0; // of the direction it has come from
    Real nu = 0;         // what it carried, in units of its pixel's estimate
    Real copies = 0, contribution = 0, square = 0, cost = 0;
    Real next_events = 0, of_next_events = 0, square_of_next_events = 0;
};

// All visits of one row of a pass, and its cost.
template <class Real> struct row_visits {
    const learned<Real>* known = nullptr; // for the worth of pixels; null: 1
    int longest_camera_walk = longest_path, longest_light_walk = longest_path;
    bool keeps_visits = true; // or counts the cost alone
    std::vector<visit<Real>> visits;
    double cost = 0;

    // A contribution of the present pixel's walks.
    template <class Pair>
    void see(const Pair& pair, const contribution<Real>& c, const complete_path<Real>& path) {
        const Real value = brightness(c.value) * c.weight,
                   worth = known ? known->worth[static_cast<std::size_t>(c.pixel)] : Real(1);
        cost += cost_of_weight;
        if (auto* x = at(pair.camera, path.camera, camera)) {
            x->add_own(value, true);
            if (c.technique.kind == mis::technique_kind::next_event) {
                x->of_next_events += value;
                x->square_of_next_events += value * value;
            }
        }
        if (auto* y = at(pair.light, path.light, light))
            y->add_own(value * worth, false);
    }

    // All of the present pixel's paths have been seen.
    template <class Pair> void end(const Pair& pair) {
        count_joins(pair);
        const Real light_samples = pair.weigh.counts.next_event;
        end(pair.camera, walk_kind::from_camera, longest_camera_walk, light_samples, camera);
        end(pair.light, walk_kind::from_light, longest_light_walk, light_samples, light);
    }

private:
    // Of a vertex of the present pixel's walks, as they are.
    struct sums {
        Real own = 0, own_square = 0, cost = 1; // the ray to it
        Real of_next_events = 0, square_of_next_events = 0;
        Real copies = 0, contribution = 0, square = 0, cost_of_copies = 0; // that have met something

        void add_own(Real value, bool by_camera) {
            own += value;
            own_square += by_camera ? Real(0) : value * value;
            cost += static_cast<Real>(cost_of_weight);
        }
        // All that a camera walk contributes goes to one pixel, whose variance it is; a light walk's
        // contributions go to as many pixels, whose variances add up.
        Real square_from_here(bool by_camera) const {
            const Real all = own + contribution;
            return by_camera ? all * all : own_square + square;
        }
    };
    std::vector<sums> camera, light;

    static sums* at(const walk<Real>& walk, const vertex<Real>* x, std::vector<sums>& all) {
        all.resize(walk.size());
        const std::less<const vertex<Real>*> before;
        const bool is_here =
            x && !walk.empty() && !before(x, walk.data()) && before(x, walk.data() + walk.size());
        return is_here ? &all[static_cast<std::size_t>(x - walk.data())] : nullptr;
    }

    // Each end has the whole cost of what joins it: that is what would be saved without it.
    template <class Pair> void count_joins(const Pair& pair) {
        const auto& counts = pair.weigh.counts;
        camera.resize(pair.camera.size());
        light.resize(pair.light.size());
        int of_depth[2][longest_path + 2] = {};
        const auto count = [&](const walk<Real>& walk, int* depths) {
            for (std::size_t i = 1; i < walk.size() && counts.connection > Real(0); ++i)
                depths[walk[i].depth] += can_join(walk[i]);
        };
        count(pair.camera, of_depth[0]);
        count(pair.light, of_depth[1]);
        const auto partners = [&](const vertex<Real>& x, const int* depths) {
            int all = 0;
            for (int d = 2; d + x.depth <= pair.longest; ++d)
                all += depths[d];
            return static_cast<Real>(all);
        };
        for (std::size_t i = 1; i < pair.camera.size(); ++i)
            if (const auto& x = pair.camera[i]; can_join(x)) {
                const Real next_events =
                    x.next_events < 0 ? counts.next_event : static_cast<Real>(x.next_events);
                const Real joins = next_events + partners(x, of_depth[1]);
                camera[i].cost += joins;
                cost += static_cast<double>(joins);
            }
        for (std::size_t i = 1; i < pair.light.size(); ++i)
            if (const auto& y = pair.light[i]; can_join(y)) {
                const Real to_camera = counts.camera_connection > Real(0) ? Real(1) : Real(0);
                light[i].cost += to_camera + partners(y, of_depth[0]);
                cost += static_cast<double>(to_camera);
            }
    }

    // From the last vertex to the first: copies come after the vertex that they have left.
    void end(const walk<Real>& walk, walk_kind kind, int longest, Real light_samples,
             std::vector<sums>& all) {
        const bool by_camera = kind == walk_kind::from_camera;
        for (std::size_t i = walk.size(); i-- > 1;) {
            const vertex<Real>& x = walk[i];
            const sums& s = all[i];
            const bool goes_on = x.material && x.depth < longest;
            const Real escaped = goes_on ? static_cast<Real>(x.copies) - s.copies : Real(0);
            const Real carried = brightness(x.throughput);
            if (keeps_visits && goes_on && !scatters_dirac(x) && carried > Real(0)) {
                const Real scale = x.rate / carried,
                           of_next_event = x.next_event_rate * light_samples / carried;
                visits.push_back({x.point.position, kind, direction_bin(x.towards_previous),
                                  carried * walk.worth, static_cast<Real>(x.copies), scale * s.contribution,
                                  scale * scale * s.square, s.cost_of_copies + escaped,
                                  x.next_events < 0 ? light_samples : static_cast<Real>(x.next_events),
                                  of_next_event * s.of_next_events,
                                  of_next_event * of_next_event * s.square_of_next_events});
            }
            sums& before = all[i - static_cast<std::size_t>(x.back)];
            before.copies += 1;
            before.contribution += s.own + s.contribution;
            before.square += s.square_from_here(by_camera);
            before.cost_of_copies += s.cost + s.cost_of_copies + escaped;
            cost += 1 + static_cast<double>(escaped);
        }
        cost += walk.size() == 1 ? 1 : 0; // nothing met at all
        all.clear();
    }
};

// All that has been learned, from pass to pass.
template <class Real> class learner {
public:
    double cost = 0; // of all passes, over pixels

    learner(const scene<Real>& scene, const roulette<Real>& r, int image_width, Real next_events)
        : played(r), width(image_width), light_samples(next_events),
          brightness_sum(static_cast<std::size_t>(width) * static_cast<std::size_t>(width)),
          brightness_squares(brightness_sum.size()) {
        for (auto& kind : walks) {
            kind.tree.low = scene.center - scene.radius;
            kind.tree.high = scene.center + scene.radius;
        }
    }

    // One more pass: its visits, row by row, and its image. Returns what is known now, null where that is
    // nothing yet.
    std::shared_ptr<const learned<Real>> add(const std::vector<row_visits<Real>>& rows,
                                             const std::vector<double>& image) {
        for (std::size_t i = 0; i < image.size(); ++i) {
            brightness_sum[i] += image[i];
            brightness_squares[i] += image[i] * image[i];
        }
        ++passes;
        for (auto& kind : walks)
            for (auto& cell : kind.cells)
                if (passes <= 4) // other rates were played then
                    cell.scale(Real(0.5));
        for (const auto& row : rows) {
            cost += row.cost / static_cast<double>(image.size());
            for (const auto& v : row.visits)
                cell_of(v).add(v);
        }
        for (auto& kind : walks)
            refine(kind, 0, kind.tree.low, kind.tree.high);
        return summary(rows);
    }

private:
    struct seen_in_bin {
        mis::running_statistics<Real> copies, squares, apart, next_events, squares_of_next_events, rates;

        void add(const visit<Real>& v) {
            copies.add(v.contribution / v.copies, v.cost / v.copies, v.copies);
            squares.add(v.square / v.copies, Real(1), v.copies);
            const Real of_mean = v.contribution * v.contribution / v.copies;
            apart.add((v.square - of_mean) / (v.copies - 1), Real(1), v.copies - 1);
            next_events.add(v.of_next_events / v.next_events, Real(1), v.next_events);
            squares_of_next_events.add(v.square_of_next_events / v.next_events, Real(1), v.next_events);
        }
        template <class F> void for_each(F&& f) {
            for (auto* s : {&copies, &squares, &apart, &next_events, &squares_of_next_events, &rates})
                f(*s);
        }
        void operator+=(const seen_in_bin& other) {
            copies += other.copies;
            squares += other.squares;
            apart += other.apart;
            next_events += other.next_events;
            squares_of_next_events += other.squares_of_next_events;
            rates += other.rates;
        }
    };
    struct seen_in_cell {
        std::array<seen_in_bin, direction_bins> bins;
        mis::running_statistics<Real> next_event_rates;
        Real visits = 0; // since it is a leaf

        void add(const visit<Real>& v) {
            bins[v.bin].add(v);
            visits += 1;
        }
        void scale(Real factor) {
            for (auto& bin : bins)
                bin.for_each([&](auto& s) { s = mis::scaled(s, factor); });
            next_event_rates = mis::scaled(next_event_rates, factor);
        }
    };
    struct seen_of_walks {
        cell_tree<Real> tree;
        std::vector<seen_in_cell> cells{1};
    };

    roulette<Real> played; // its mode and bounds
    int width, passes = 0;
    Real light_samples;
    std::vector<double> brightness_sum, brightness_squares; // of the pixels of all passes
    seen_of_walks walks[2];

    seen_in_cell& cell_of(const visit<Real>& v) {
        auto& kind = walks[number_of(v.kind)];
        return kind.cells[static_cast<std::size_t>(kind.tree.cell_at(v.position))];
    }

    // Halves what has been visited often; both halves begin with what was known of the whole.
    static void refine(seen_of_walks& kind, std::size_t i, const vec3<Real>& low, const vec3<Real>& high) {
        constexpr Real often = 2000;
        constexpr std::size_t most_cells = 1024;
        auto& nodes = kind.tree.nodes;
        if (nodes[i].axis < 0) {
            auto& cell = kind.cells[static_cast<std::size_t>(nodes[i].child)];
            if (cell.visits < often || kind.cells.size() >= most_cells)
                return;
            cell.visits = 0;
            cell.scale(Real(0.5));
            const vec3<Real> size = high - low;
            const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
            const int child = static_cast<int>(nodes.size());
            nodes.push_back({-1, nodes[i].child});
            nodes.push_back({-1, static_cast<int>(kind.cells.size())});
            nodes[i] = {axis, child};
            kind.cells.push_back(seen_in_cell(cell));
            return;
        }
        const auto [axis, child] = nodes[i];
        vec3<Real> lower_end = high, upper_begin = low;
        lower_end[axis] = upper_begin[axis] = (low[axis] + high[axis]) / 2;
        refine(kind, static_cast<std::size_t>(child), low, lower_end);
        refine(kind, static_cast<std::size_t>(child) + 1, upper_begin, high);
    }

    // 1 over the mean of pixels around each, as images of a few passes are noisy; what is dark is worth no
    // more than what is a tenth as bright as the image. Infinite where the image is black.
    std::vector<Real> worth_of_pixels() const {
        constexpr int around = 2;
        double mean = 0;
        for (const double b : brightness_sum)
            mean += b / passes / static_cast<double>(brightness_sum.size());
        std::vector<Real> worth;
        for (int y = 0; y < width; ++y)
            for (int x = 0; x < width; ++x) {
                double sum = 0;
                int count = 0;
                for (int v = std::max(0, y - around); v <= std::min(width - 1, y + around); ++v)
                    for (int u = std::max(0, x - around); u <= std::min(width - 1, x + around); ++u, ++count)
                        sum += brightness_sum[static_cast<std::size_t>(v * width + u)];
                worth.push_back(static_cast<Real>(1 / std::max(sum / count / passes, 0.1 * mean)));
            }
        return worth;
    }

    // Of one pass, relative to the estimates of pixels. Outliers are not left out: those of walks are not.
    mis::image_estimate<Real> estimate_of_image(const std::vector<Real>& worth) const {
        mis::trimmed_mean<Real> variance;
        for (std::size_t i = 0; i < worth.size(); ++i) {
            const double mean = brightness_sum[i] / passes,
                         square = brightness_squares[i] / passes - mean * mean;
            variance.add(static_cast<Real>(square * passes / std::max(1, passes - 1)) * worth[i] * worth[i]);
        }
        return {mis::mean(variance, Real(0)), static_cast<Real>(cost / passes)};
    }

    std::shared_ptr<const learned<Real>> summary(const std::vector<row_visits<Real>>& rows) {
        auto all = std::make_shared<learned<Real>>();
        all->worth = worth_of_pixels();
        all->image = estimate_of_image(all->worth);
        const bool needs_variance = played.mode != roulette_mode::adjoint;
        if (!(all->worth[0] < std::numeric_limits<Real>::max()) || (needs_variance && passes < 2))
            return nullptr;
        for (std::size_t k = 0; k < 2; ++k) {
            all->walks[k].tree = walks[k].tree;
            for (const auto& cell : walks[k].cells)
                all->walks[k].cells.push_back(summary(cell, static_cast<walk_kind>(k)));
        }
        // What will be played, as it would have been in this pass.
        played.learned = all;
        for (const auto& row : rows)
            for (const auto& v : row.visits) {
                const auto& kind = all->walks[number_of(v.kind)];
                const auto& bin = kind.cells[static_cast<std::size_t>(kind.tree.cell_at(v.position))][v.bin];
                if (!bin.is_known)
                    continue;
                auto& cell = cell_of(v);
                cell.bins[v.bin].rates.add(learned_rate(played, bin, v.nu, played.most_copies));
                if (v.kind == walk_kind::from_camera)
                    cell.next_event_rates.add(learned_next_event_rate(played, bin, v.nu));
            }
        played.learned = nullptr;
        const auto set = [](Real& rate, const mis::running_statistics<Real>& rates) {
            rate = rates.weight > Real(0) ? rates.mean : Real(1);
        };
        for (std::size_t k = 0; k < 2; ++k)
            for (std::size_t i = 0; i < walks[k].cells.size(); ++i)
                for (std::size_t bin = 0; bin < direction_bins; ++bin)
                    set(all->walks[k].cells[i][bin].rate, walks[k].cells[i].bins[bin].rates);
        for (const auto& cell : walks[0].cells)
            set(all->next_event_rates.emplace_back(), cell.next_event_rates);
        return all;
    }

    // Bins in which little has been seen have what all bins of the cell have.
    std::array<learned_bin<Real>, direction_bins> summary(const seen_in_cell& cell, walk_kind kind) const {
        constexpr Real little = 32;
        seen_in_bin whole;
        for (const auto& bin : cell.bins)
            whole += bin;
        std::array<learned_bin<Real>, direction_bins> bins;
        for (std::size_t i = 0; i < direction_bins; ++i) {
            const auto& s = cell.bins[i].copies.weight >= little ? cell.bins[i] : whole;
            bins[i].is_known = s.copies.weight >= little;
            bins[i].adjoint = s.copies.mean;
            bins[i].onwards.second_moment = s.squares.mean;
            // Splitting helps against what copies differ by. Those of a camera walk are joined to the same
            // light walk; those of light walks go to other pixels.
            bins[i].onwards.variance =
                kind == walk_kind::from_light ? s.squares.mean : std::max(Real(0), s.apart.mean);
            bins[i].onwards.cost = mis::mean_cost(s.copies);
            const Real next_event = s.next_events.mean;
            bins[i].next_event = {s.squares_of_next_events.mean / light_samples,
                                  std::max(Real(0), s.squares_of_next_events.mean - next_event * next_event) /
                                      light_samples,
                                  light_samples};
        }
        return bins;
    }
};

} // namespace bpt
