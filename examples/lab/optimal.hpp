// Optimal weights for bidirectional paths. The techniques of one path length estimate one integral for each
// pixel, so there is a small system for each length, and for each pixel or tile of pixels that share their
// coefficients.
#pragma once

#include "row_array.hpp"
#include "weigh.hpp"
#include <memory>

namespace lab {

// For passes that all have the same counts.
//
// With optimal weights a sample of technique i contributes w_i f / (n_i p_i) = f / D + alpha_i / n_i -
// sum_k (alpha_k / n_k) u_k, where u_k are its balance weights. A sample with f = 0 is taken to lie in a part
// of the domain that only its own technique reaches, whatever other densities are there: a walk that has
// ended, a connection that is occluded. It contributes nothing, and how many such there were follows from the
// number of passes.
class optimal_weights {
public:
    // merge_radius: that of counts.merge. Widths are in pixels.
    optimal_weights(const mis::technique_counts<double>& counts, double merge_radius, int width,
                    int tile_width);
    optimal_weights(optimal_weights&&) noexcept;
    ~optimal_weights();

    // Adds a sample, and returns what it contributes with the present coefficients.
    glm::dvec3 add(const balanced_sample& sample);
    void end_pass();
    // Of rows of tiles, only number `first` of each `step` are added to and solved: the others are other
    // ranks'.
    void sum_rows(int first, int step) { first_row = first, row_step = step; }
    // What has been added up, and the coefficients.
    void add_arrays(std::vector<row_array>& arrays);
    // From all passes so far, the coefficients of those to come.
    void solve(int threads);
    // The direct estimate of each tile: the mean of its pixels, all lengths together.
    std::vector<glm::dvec3> integrals(int threads) const;

    int tile_width() const { return tile; }
    int tiles_in_row() const { return tiles_across; }
    std::size_t tile_of(int pixel) const {
        return static_cast<std::size_t>(pixel / width / tile * tiles_across + pixel % width / tile);
    }
    // In the tile: fewer at the right and lower edge.
    double pixels_of(std::size_t t) const;

private:
    struct systems; // see optimal.cpp: they take long to compile

    bool is_own(std::size_t t) const { return static_cast<int>(t) / tiles_across % row_step == first_row; }

    int width, tile, tiles_across, first_row = 0, row_step = 1;
    std::unique_ptr<systems> of_lengths;
};

} // namespace lab
