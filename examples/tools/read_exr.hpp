// OpenEXR files, read.
#pragma once

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace tools {

struct rgb_image {
    int width = 0, height = 0;
    std::vector<float> values; // R, G, B of each pixel, rows from the top
};

// Of an image that is read; a header may claim any number.
constexpr std::int64_t most_pixels = std::int64_t(1) << 27; // 16384 x 8192

// The channels R, G and B. Throws std::runtime_error, one line, where there are none, where the image is too
// large and where the file cannot be read to its end.
inline rgb_image read_exr(const std::string& file) {
    rgb_image image;
    bool has_channels = true;
    std::string too_large;
    try {
        Imf::InputFile in(file.c_str());
        const auto& window = in.header().dataWindow();
        const std::int64_t columns = std::int64_t(window.max.x) - window.min.x + 1,
                           rows = std::int64_t(window.max.y) - window.min.y + 1;
        if (columns > most_pixels / rows) { // the file's header is right: neither is below 1
            too_large = " has " + std::to_string(columns) + " x " + std::to_string(rows) +
                        " pixels, of which at most " + std::to_string(most_pixels) + " can be read";
            throw std::length_error(too_large);
        }
        image.width = static_cast<int>(columns);
        image.height = static_cast<int>(rows);
        const auto width = static_cast<std::size_t>(image.width);
        image.values.resize(3 * width * static_cast<std::size_t>(image.height));
        constexpr std::size_t stride = 3 * sizeof(float);
        const auto first = static_cast<std::ptrdiff_t>(stride) *
                           (window.min.x + static_cast<std::ptrdiff_t>(window.min.y) * image.width);
        Imf::FrameBuffer buffer;
        const char* const names[] = {"R", "G", "B"};
        for (std::size_t channel = 0; channel < 3; ++channel) {
            has_channels = has_channels && in.header().channels().findChannel(names[channel]);
            buffer.insert(names[channel],
                          Imf::Slice(Imf::FLOAT,
                                     reinterpret_cast<char*>(image.values.data() + channel) - first, stride,
                                     stride * width));
        }
        if (has_channels) {
            in.setFrameBuffer(buffer);
            in.readPixels(window.min.y, window.max.y);
        }
    } catch (const std::exception&) {
        if (!too_large.empty())
            throw std::runtime_error(file + too_large);
        throw std::runtime_error("cannot read " + file + " as OpenEXR");
    }
    if (!has_channels)
        throw std::runtime_error(file + " has no channels R, G and B");
    return image;
}

} // namespace tools
