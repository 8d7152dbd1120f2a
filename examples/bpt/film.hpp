// Images of every technique and of their weighted sum, and the files they are written to.
#pragma once

#include "connect.hpp"

namespace bpt {

struct image {
    int width = 0;
    std::vector<glm::dvec3> pixels;
};

image black(int width);

// The weighted image, and for each path length n and number of camera vertices s what the technique alone has
// estimated (unweighted) and what it has contributed (weighted). A merge counts with the technique of as many
// camera vertices.
struct film {
    int width = 0;
    int passes = 0;
    image sum;
    image unweighted[longest_path + 1][longest_path + 1];
    image weighted[longest_path + 1][longest_path + 1];

    explicit film(int width_in_pixels);
    template <class Real> void add(const contribution<Real>& c) {
        const auto pixel = static_cast<std::size_t>(c.pixel);
        const int n = c.vertices, s = c.technique.camera_vertices;
        const glm::dvec3 value(c.value), part = value * static_cast<double>(c.weight);
        sum.pixels[pixel] += part;
        unweighted[n][s].pixels[pixel] += value;
        weighted[n][s].pixels[pixel] += part;
    }
};

// Each throws std::runtime_error with the file's name when it cannot write.
void write_png(const std::string& file, const film& film, double exposure);
void write_exr(const std::string& file, const film& film);
// The channels R, G and B of a square image of this width. Throws std::runtime_error for any other file.
image read_exr(const std::string& file, int width);
// Root of the mean squared difference from an image of the same width, over all pixels and channels.
double rms_error(const film& film, const image& reference);
// Labelled images side by side.
struct labelled_image {
    std::string label;
    bpt::image image;
    double scale = 1;
};
void write_sheet(const std::string& file, const std::vector<labelled_image>& images, int columns,
                 int magnified = 1);
// False colours: -1 is blue, 0 white, 1 red.
glm::dvec3 false_color(double x);
// One row per path length, one column per s; unweighted on the left, weighted on the right.
void write_pyramid(const std::string& file, const film& film, double exposure);

} // namespace bpt
