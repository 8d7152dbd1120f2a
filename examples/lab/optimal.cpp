#include "optimal.hpp"
#include <mis/optimal/film.hpp>
#include <tuple>
#include <utility>

namespace lab {
namespace {

// The systems of paths of n vertices.
template <int n> struct length_systems {
    static constexpr int vertices = n, techniques = mis::technique_count(n);
    using row = std::array<double, static_cast<std::size_t>(techniques)>;

    mis::optimal::film<techniques> sums;          // its pixels are tiles
    std::vector<std::array<row, 3>> coefficients; // alpha_k / n_k of each tile, for each channel
};

template <int... k> std::tuple<length_systems<k + 2>...> systems_of(std::integer_sequence<int, k...>);
using all_lengths = decltype(systems_of(std::make_integer_sequence<int, longest_path - 1>()));

} // namespace

struct optimal_weights::systems {
    all_lengths lengths;

    template <class F> void for_each(F&& f) {
        std::apply([&](auto&... s) { (f(s), ...); }, lengths);
    }
};

optimal_weights::optimal_weights(const mis::technique_counts<double>& counts, double merge_radius,
                                 int width_in_pixels, int tile_width)
    : width(width_in_pixels), tile(tile_width), tiles_across((width - 1) / tile + 1),
      of_lengths(std::make_unique<systems>()) {
    auto draws = counts;
    if (counts.merge > 0)
        draws.merge /= mis::merge_area(merge_radius); // the area is a part of the density
    of_lengths->for_each([&](auto& s) {
        for (std::size_t k = 0; k < s.sums.counts.size(); ++k)
            s.sums.counts[k] =
                mis::count_of(draws, s.vertices, mis::technique_at(s.vertices, static_cast<int>(k)));
        s.sums = {tiles_across, tiles_across, s.sums.counts};
        s.coefficients.resize(s.sums.pixels.size());
    });
}
optimal_weights::optimal_weights(optimal_weights&&) noexcept = default;
optimal_weights::~optimal_weights() = default;

glm::dvec3 optimal_weights::add(const balanced_sample& x) {
    glm::dvec3 contributed = x.value;
    of_lengths->for_each([&](auto& s) {
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
void optimal_weights::end_pass() {
    of_lengths->for_each([&](auto& s) {
        for (std::size_t t = 0; t < s.sums.pixels.size(); ++t)
            for (std::size_t k = 0; is_own(t) && k < s.sums.counts.size(); ++k)
                s.sums.pixels[t].add_outside(static_cast<int>(k), s.sums.counts[k] * pixels_of(t));
    });
}

void optimal_weights::add_arrays(std::vector<row_array>& arrays) {
    of_lengths->for_each([&](auto& s) {
        const std::string of_length = " of " + std::to_string(s.vertices) + " vertices";
        arrays.push_back(rows_of("estimators" + of_length, s.sums.pixels, tiles_across, 1));
        arrays.push_back(rows_of("coefficients" + of_length, s.coefficients, tiles_across, 1));
    });
}

void optimal_weights::solve(int threads) {
    of_lengths->for_each([&](auto& s) {
        mis::optimal::for_each_pixel(s.sums, threads, [&](std::size_t t) {
            if (!is_own(t))
                return;
            const auto alpha = mis::optimal::coefficients(s.sums.pixels[t], s.sums.counts);
            for (std::size_t c = 0; c < 3; ++c)
                for (std::size_t k = 0; k < s.sums.counts.size(); ++k)
                    s.coefficients[t][c][k] = s.sums.counts[k] > 0 ? alpha[c][k] / s.sums.counts[k] : 0;
        });
    });
}

std::vector<glm::dvec3> optimal_weights::integrals(int threads) const {
    std::vector<glm::dvec3> all(static_cast<std::size_t>(tiles_across) *
                                static_cast<std::size_t>(tiles_across));
    of_lengths->for_each([&](const auto& s) {
        const auto of_length = mis::optimal::integrals(s.sums, threads);
        for (std::size_t t = 0; t < all.size(); ++t)
            all[t] += glm::dvec3(of_length[t][0], of_length[t][1], of_length[t][2]);
    });
    return all;
}

double optimal_weights::pixels_of(std::size_t t) const {
    const auto extent = [&](int k) { return std::min(tile, width - k * tile); };
    const int index = static_cast<int>(t);
    return static_cast<double>(extent(index / tiles_across)) * extent(index % tiles_across);
}

} // namespace lab
