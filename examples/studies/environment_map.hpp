// An environment: radiance by direction, as an equirectangular map, synthesised or from a file; and its
// density for *environment sampling*, plain or compensated.
#pragma once

#include "reflection.hpp"
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <tools/read_exr.hpp>
#include <vector>

namespace studies::direct_light {

// Twice as wide as high; the first row is about the zenith, +y. Radiance is constant within a pixel.
struct environment_map {
    int height = 0;
    std::vector<dvec3> pixels;

    int width() const { return 2 * height; }
    // The pixel's part of the sphere, in solid angle.
    double solid_angle(std::size_t pixel) const {
        const double y = double(pixel / std::size_t(width()));
        return pi / height * (std::cos(pi * y / height) - std::cos(pi * (y + 1) / height));
    }
    std::size_t pixel_of(const dvec3& d) const {
        const double row = std::acos(std::clamp(d.y, -1.0, 1.0)) / pi * height;
        const double column = (std::atan2(d.z, d.x) / (2 * pi) + 0.5) * width();
        return std::size_t(std::min(int(row), height - 1) * width() + std::min(int(column), width() - 1));
    }
    // Uniform within the pixel for uniform u and v.
    dvec3 direction(std::size_t pixel, double u, double v) const {
        const double row = double(pixel / std::size_t(width())), top = std::cos(pi * row / height),
                     bottom = std::cos(pi * (row + 1) / height);
        const double y = top + v * (bottom - top), sine = std::sqrt(std::max(0.0, 1 - y * y));
        const double angle = 2 * pi * ((double(pixel % std::size_t(width())) + u) / width() - 0.5);
        return {sine * std::cos(angle), y, sine * std::sin(angle)};
    }
};

// Radiance where a map's pixel's center is.
template <class Radiance> environment_map make_map(int height, Radiance&& radiance) {
    environment_map m{height, {}};
    for (std::size_t i = 0; i < std::size_t(m.width()) * std::size_t(height); ++i)
        m.pixels.push_back(radiance(m.direction(i, 0.5, 0.5)));
    return m;
}

// ---- Files ----

// Radiance's HDR files, of which the first row is the top and the first column the left. Throws
// std::runtime_error with what is wrong.
inline tools::rgb_image read_hdr(const std::string& bytes) {
    std::size_t at = 0;
    const auto fail = [](const char* what) { throw std::runtime_error(what); };
    const auto line = [&] {
        const std::size_t start = at, end = bytes.find('\n', at);
        if (end == std::string::npos)
            fail("ends within its heading");
        at = end + 1;
        return bytes.substr(start, end - start);
    };
    for (std::string text = line(); !text.empty(); text = line())
        if (text.rfind("FORMAT=", 0) == 0 && text != "FORMAT=32-bit_rle_rgbe")
            fail("has colors that are not RGB");
    tools::rgb_image image;
    if (std::sscanf(line().c_str(), "-Y %d +X %d", &image.height, &image.width) != 2)
        fail("has rows in another order than from the top, from left to right");
    constexpr int most = 1 << 16;
    if (!(image.width > 0 && image.width <= most && image.height > 0 && image.height <= most))
        fail("has no possible size");
    const auto width = std::size_t(image.width);
    const auto byte = [&] {
        if (at == bytes.size())
            fail("is cut off");
        return static_cast<unsigned char>(bytes[at++]);
    };
    std::vector<unsigned char> row(4 * width); // R, G, B and exponent of each pixel
    for (int y = 0; y < image.height; ++y) {
        for (std::size_t k = 0; k < 4; ++k)
            row[k] = byte();
        const bool is_packed = row[0] == 2 && row[1] == 2 && row[2] < 128;
        if (is_packed && std::size_t(row[2]) * 256 + row[3] != width)
            fail("has rows of different lengths");
        for (std::size_t k = 4; !is_packed && k < row.size(); ++k)
            row[k] = byte();
        for (std::size_t channel = 0; is_packed && channel < 4; ++channel)
            for (std::size_t x = 0; x < width;) { // runs of one byte, or of as many as there are
                const unsigned char count = byte();
                const bool is_run = count > 128;
                const std::size_t length = is_run ? count - 128u : count;
                if (length == 0 || x + length > width)
                    fail("has rows that do not end where they should");
                unsigned char value = is_run ? byte() : static_cast<unsigned char>(0);
                for (std::size_t k = 0; k < length; ++k, ++x)
                    row[4 * x + channel] = value = is_run ? value : byte();
            }
        for (std::size_t x = 0; x < width; ++x)
            for (std::size_t channel = 0; channel < 3; ++channel) {
                const int exponent = row[4 * x + 3];
                image.values.push_back(
                    exponent > 0 ? std::ldexp(float(row[4 * x + channel]) + 0.5f, exponent - 136) : 0.0f);
            }
    }
    return image;
}

// An equirectangular OpenEXR or Radiance HDR file. Throws std::runtime_error, one line, where there is none,
// where it is cut off or of another type, and where a pixel is no radiance.
inline environment_map read_environment(const std::string& file) {
    const auto fail = [&](const std::string& what) { throw std::runtime_error("'" + file + "' " + what); };
    std::error_code failure;
    if (std::filesystem::exists(file, failure) && !std::filesystem::is_regular_file(file, failure))
        fail("is no file");
    std::ifstream in(file, std::ios::binary);
    if (!in)
        fail(std::string("cannot be read: ") + std::strerror(errno));
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    tools::rgb_image image;
    if (bytes.rfind("\x76\x2f\x31\x01", 0) == 0) {
        try {
            image = tools::read_exr(file);
        } catch (const std::runtime_error&) {
            fail("is an OpenEXR file that cannot be read: it is cut off, has no channels R, G and B, or more "
                 "than " +
                 std::to_string(tools::most_pixels) + " pixels");
        }
    } else if (bytes.rfind("#?", 0) == 0) {
        try {
            image = read_hdr(bytes);
        } catch (const std::runtime_error& error) {
            fail(std::string("is a Radiance file that cannot be read: it ") + error.what());
        }
    } else {
        fail("is neither an OpenEXR nor a Radiance HDR file");
    }
    if (image.width != 2 * image.height)
        fail("is not equirectangular: it has " + std::to_string(image.width) + " x " +
             std::to_string(image.height) + " pixels, and must be twice as wide as high");
    environment_map m{image.height, {}};
    double sum = 0;
    for (std::size_t i = 0; i < image.values.size(); i += 3) {
        const dvec3 color(image.values[i], image.values[i + 1], image.values[i + 2]);
        for (int c = 0; c < 3; ++c)
            if (!(color[c] >= 0 && color[c] <= double(std::numeric_limits<float>::max())))
                fail("has a pixel that is negative or no finite number: column " +
                     std::to_string(i / 3 % std::size_t(image.width)) + ", row " +
                     std::to_string(i / 3 / std::size_t(image.width)));
        m.pixels.push_back(color);
        sum += sum_of(color);
    }
    if (!(sum > 0))
        fail("is black");
    return m;
}

// ---- Sampling ----

// A density of directions, constant within each pixel.
class environment_density {
public:
    // Proportional to importance(mean of the pixel's channels); to radiance itself where that is 0
    // everywhere.
    template <class Importance>
    environment_density(const environment_map& map, Importance&& importance) : m(&map) {
        build(importance);
        if (!(below.back() > 0))
            build([](double radiance) { return radiance; });
    }

    double operator()(std::size_t pixel) const { return density[pixel]; }
    // By p, per solid angle; into `pixel` goes where it lies.
    dvec3 sample(pcg32& rng, std::size_t& pixel) const {
        const double x = uniform(rng) * below.back();
        const auto found = std::upper_bound(below.begin(), below.end(), x);
        pixel = std::min(std::size_t(found - below.begin()), last);
        const double u = uniform(rng), v = uniform(rng);
        return m->direction(pixel, u, v);
    }

private:
    template <class Importance> void build(Importance&& importance) {
        below.clear();
        density.clear();
        double sum = 0;
        for (std::size_t i = 0; i < m->pixels.size(); ++i) {
            density.push_back(importance(sum_of(m->pixels[i]) / 3));
            if (density.back() > 0)
                last = i;
            below.push_back(sum += density.back() * m->solid_angle(i));
        }
        for (double& p : density)
            p /= sum;
    }

    const environment_map* m;
    std::vector<double> density, below; // below: sums of what is up to each pixel
    std::size_t last = 0;               // that can be found
};

// Of the mean of the channels, over the sphere.
inline double mean_radiance(const environment_map& m) {
    double sum = 0;
    for (std::size_t i = 0; i < m.pixels.size(); ++i)
        sum += sum_of(m.pixels[i]) / 3 * m.solid_angle(i);
    return sum / (4 * pi);
}

inline environment_density plain_density(const environment_map& m) {
    return {m, [](double radiance) { return radiance; }};
}
// MIS compensation: O. Karlík, M. Šik, P. Vévoda, T. Skřivan, J. Křivánek, "MIS Compensation: Optimizing
// Sampling Techniques in Multiple Importance Sampling", 2019. BSDF sampling is taken for uniform on the
// hemisphere: what it covers by its half of the samples is subtracted, max(0, L - mean L).
inline environment_density compensated_density(const environment_map& m) {
    const double mean = mean_radiance(m);
    // A constant environment must not be sampled by its rounding errors.
    return {m, [mean](double radiance) { return radiance > mean * (1 + 1e-9) ? radiance - mean : 0; }};
}

} // namespace studies::direct_light
