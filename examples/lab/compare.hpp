// What planted mistakes do to an image, of which the same paths make the right one.
#pragma once

#include "pictures.hpp"
#include "render.hpp"
#include <mis/verify/record.hpp>
#include <numeric>

namespace lab {

// The brightness of an image and its variance from pass to pass, summed over pixels.
struct noise_meter {
    std::vector<double> pass, sum, square; // of each pixel

    explicit noise_meter(int width)
        : pass(static_cast<std::size_t>(width) * static_cast<std::size_t>(width)), sum(pass), square(pass) {}
    void end_pass() {
        for (std::size_t i = 0; i < pass.size(); ++i) {
            sum[i] += pass[i];
            square[i] += pass[i] * pass[i];
            pass[i] = 0;
        }
    }
    double brightness() const { return std::accumulate(sum.begin(), sum.end(), 0.0); }
    double variance(int passes) const {
        double all = 0;
        for (std::size_t i = 0; i < sum.size(); ++i)
            all += square[i] - sum[i] * sum[i] / passes;
        return all;
    }
};

struct comparison {
    image right;
    noise_meter with_mistakes, without;

    explicit comparison(int width) : right(black(width)), with_mistakes(width), without(width) {}

    // To the film, and with its right weight to the right image. A weight that is no number is left out, as
    // renderers do.
    template <class Real> void add(technique_film& film, const weighed_contribution<Real>& c) {
        const auto pixel = static_cast<std::size_t>(c.pixel);
        const double weight = static_cast<double>(c.weight),
                     right_weight = static_cast<double>(c.right_weight);
        const glm::dvec3 value(c.value);
        const double brightness = value.x + value.y + value.z;
        if (mis::is_number(weight)) {
            film.add(c);
            with_mistakes.pass[pixel] += weight * brightness;
        }
        right.pixels[pixel] += value * right_weight;
        without.pass[pixel] += right_weight * brightness;
    }
    void end_pass() {
        with_mistakes.end_pass();
        without.end_pass();
    }
    void add_arrays(std::vector<row_array>& arrays, int rows_of_tile) {
        arrays.push_back(rows_of("the right image", right, rows_of_tile));
        for (auto* meter : {&with_mistakes, &without})
            for (auto* values : {&meter->sum, &meter->square})
                arrays.push_back(rows_of("brightness", *values, right.width, rows_of_tile));
    }
};

// One line: the change of brightness with the standard error that pixels give, and the factor of the
// variance.
std::string change_of(const comparison& c, int passes);

// Three images: right, with the film's mistakes, and their difference: red where mistakes make it brighter,
// blue where darker.
void write_comparison(const std::string& file, const bpt::film& film, const image& right, double exposure);

} // namespace lab
