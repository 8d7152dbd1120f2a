// Pictures of more than one image: sheets with labels and colour bars, strategy pyramids. And images read
// back.
#pragma once

#include "row_array.hpp"
#include <bpt/connect.hpp>
#include <bpt/film.hpp>

namespace lab {

using bpt::black;
using bpt::image;
using bpt::longest_path;

inline row_array rows_of(const std::string& name, image& image, int rows_of_tile) {
    return rows_of(name, image.pixels, image.width, rows_of_tile);
}

// The weighted image, and for each path length n and number of camera vertices s what the technique alone has
// estimated (unweighted) and what it has contributed (weighted). A merge counts with the technique of as many
// camera vertices.
struct technique_film : bpt::film {
    image unweighted[longest_path + 1][longest_path + 1];
    image weighted[longest_path + 1][longest_path + 1];

    explicit technique_film(int width_in_pixels);
    template <class Real> void add(const bpt::contribution<Real>& c) {
        const auto pixel = static_cast<std::size_t>(c.pixel);
        const int n = c.vertices, s = c.technique.camera_vertices;
        const glm::dvec3 value(c.value), part = value * static_cast<double>(c.weight);
        sum.pixels[pixel] += part;
        unweighted[n][s].pixels[pixel] += value;
        weighted[n][s].pixels[pixel] += part;
    }
    void add_arrays(std::vector<row_array>& arrays, int rows_of_tile);
};

// The channels R, G and B of a square image of this width. Throws std::runtime_error for any other file.
image read_exr(const std::string& file, int width);
// Root of the mean squared difference from an image of the same width, over all pixels and channels.
double rms_error(const bpt::film& film, const image& reference);

// False colours: -1 is blue, 0 white, 1 red. To be shown as they are: they are no light.
glm::dvec3 false_color(double x);

// What the ends and the middle of a bar of false colours mean. Its colours are those of `from` ... 1.
struct color_bar {
    std::string least, middle, most;
    double from = -1;
};

// An image with a line below it. With a colour bar its pixels are false colours; else light, times `scale`.
struct labelled_image {
    std::string label;
    bpt::image image;
    double scale = 1;
    color_bar bar = {};
};
// Labelled images side by side, small ones magnified to 240 pixels or more. Labels are drawn to be read at
// the width of a page.
void write_sheet(const std::string& file, const std::vector<labelled_image>& images, int columns);
// Two rows for each path length from 3 to 6 vertices, `longest` at most: what each technique makes of it
// alone, and its weighted share. One column per s.
void write_pyramid(const std::string& file, const technique_film& film, double exposure, int longest);

} // namespace lab
