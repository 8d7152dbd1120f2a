// Optimal weights for bidirectional paths. The techniques of one path length estimate one integral for each
// pixel, so there is a small system for each length, and for each pixel or tile of pixels that share their
// coefficients.
#pragma once

#include "weigh.hpp"
#include <mis/optimal_film.hpp>
#include <tuple>
#include <utility>

namespace bpt {

// The systems of paths of n vertices.
template <int n> struct length_systems {
    static constexpr int vertices = n, techniques = mis::technique_count(n);
    using row = std::array<double, static_cast<std::size_t>(techniques)>;

    mis::optimal::film<techniques> sums;          // its pixels are tiles
    std::vector<std::array<row, 3>> coefficients; // alpha_k / n_k of each tile, for each channel
};

namespace detail {
template <int... k> std::tuple<length_systems<k + 2>...> systems_of(std::integer_sequence<int, k...>);
} // namespace detail

// For passes that all have the same counts.
//
// With optimal weights a sample of technique i contributes w_i f / (n_i p_i) = f / D + alpha_i / n_i -
// sum_k (alpha_k / n_k) u_k, where u_k are its balance weights. A sample with f = 0 is taken to lie in a part
// of the domain that only its own technique reaches, whatever other densities are there: a walk that has
// ended, a connection that is occluded. It contributes nothing, and how many such there were follows from the
// number of passes.
struct optimal_weights {
    int width, tile, tiles_across; // of the image, of a tile, in pixels; tiles in a row
    decltype(detail::systems_of(std::make_integer_sequence<int, longest_path - 1>())) systems;

    // merge_radius: that of counts.merge.
    optimal_weights(mis::technique_counts<double> counts, double merge_radius, int width_in_pixels,
                    int tile_width)
        : width(width_in_pixels), tile(tile_width), tiles_across((width - 1) / tile + 1) {
        if (counts.merge > 0)
            counts.merge /= mis::merge_area(merge_radius); // draws; the area is a part of the density
        for_each_length([&](auto& s) {
            for (std::size_t k = 0; k < s.sums.counts.size(); ++k)
                s.sums.counts[k] =
                    mis::count_of(counts, s.vertices, mis::technique_at(s.vertices, static_cast<int>(k)));
            s.sums = {tiles_across, tiles_across, s.sums.counts};
            s.coefficients.resize(s.sums.pixels.size());
        });
    }

    // Adds a sample, and returns what it contributes with the present coefficients.
    glm::dvec3 add(const balanced_sample& x) {
        glm::dvec3 contributed = x.value;
        for_each_length([&](auto& s) {
            if (s.vertices != x.vertices)
                return;
            const std::size_t t = tile_of(x.pixel), own = static_cast<std::size_t>(x.technique);
            s.sums.pixels[t].add_weighted(x.value, x.weights);
            s.sums.pixels[t].add_outside(x.technique, -1); // not outside: see end_pass
            for (std::size_t c = 0; c < 3; ++c) {
                const auto& row = s.coefficients[t][c];
                double controlled = -row[own];
                for (std::size_t k = 0; k < row.size(); ++k)
                    controlled += row[k] * x.weights[k];
                contributed[static_cast<int>(c)] -= controlled;
            }
        });
        return contributed;
    }

    // All draws of a pass were outside, but for those that have been added.
    void end_pass() {
        for_each_length([&](auto& s) {
            for (std::size_t t = 0; t < s.sums.pixels.size(); ++t)
                for (std::size_t k = 0; k < s.sums.counts.size(); ++k)
                    s.sums.pixels[t].add_outside(static_cast<int>(k), s.sums.counts[k] * pixels_of(t));
        });
    }

    // From all passes so far, the coefficients of those to come.
    void solve(int threads) {
        for_each_length([&](auto& s) {
            mis::optimal::for_each_pixel(s.sums, threads, [&](std::size_t t) {
                const auto alpha = mis::optimal::coefficients(s.sums.pixels[t], s.sums.counts);
                for (std::size_t c = 0; c < 3; ++c)
                    for (std::size_t k = 0; k < s.sums.counts.size(); ++k)
                        s.coefficients[t][c][k] = s.sums.counts[k] > 0 ? alpha[c][k] / s.sums.counts[k] : 0;
            });
        });
    }

    // The direct estimate of each tile: the mean of its pixels, all lengths together.
    std::vector<glm::dvec3> integrals(int threads) const {
        std::vector<glm::dvec3> all(static_cast<std::size_t>(tiles_across) *
                                    static_cast<std::size_t>(tiles_across));
        std::apply(
            [&](const auto&... s) {
                const auto add = [&](const auto& of_length) {
                    for (std::size_t t = 0; t < all.size(); ++t)
                        all[t] += glm::dvec3(of_length[t][0], of_length[t][1], of_length[t][2]);
                };
                (add(mis::optimal::integrals(s.sums, threads)), ...);
            },
            systems);
        return all;
    }

    template <class F> void for_each_length(F&& f) {
        std::apply([&](auto&... s) { (f(s), ...); }, systems);
    }
    std::size_t tile_of(int pixel) const {
        return static_cast<std::size_t>(pixel / width / tile * tiles_across + pixel % width / tile);
    }
    // In the tile: fewer at the right and lower edge.
    double pixels_of(std::size_t t) const {
        const auto extent = [&](int k) { return std::min(tile, width - k * tile); };
        const int t_int = static_cast<int>(t);
        return static_cast<double>(extent(t_int / tiles_across)) * extent(t_int % tiles_across);
    }
};

} // namespace bpt
