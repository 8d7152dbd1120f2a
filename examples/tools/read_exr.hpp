// OpenEXR files, read.
#pragma once

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <stdexcept>
#include <string>
#include <vector>

namespace tools {

struct rgb_image {
    int width = 0, height = 0;
    std::vector<float> values; // R, G, B of each pixel, rows from the top
};

// The channels R, G and B. Throws std::runtime_error, one line, where there are none and where the file
// cannot be read to its end.
inline rgb_image read_exr(const std::string& file) {
    rgb_image image;
    bool has_channels = true;
    try {
        Imf::InputFile in(file.c_str());
        const auto& window = in.header().dataWindow();
        image.width = window.max.x - window.min.x + 1;
        image.height = window.max.y - window.min.y + 1;
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
        throw std::runtime_error("cannot read " + file + " as OpenEXR");
    }
    if (!has_channels)
        throw std::runtime_error(file + " has no channels R, G and B");
    return image;
}

} // namespace tools
