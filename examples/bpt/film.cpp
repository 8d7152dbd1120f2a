#include "film.hpp"
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <algorithm>
#include <cmath>
#include <png.h>
#include <tools/files.hpp>

namespace bpt {

image black(int width) {
    return {width,
            std::vector<glm::dvec3>(static_cast<std::size_t>(width) * static_cast<std::size_t>(width))};
}

namespace {

unsigned char to_srgb(double linear) {
    const double x = std::clamp(linear, 0.0, 1.0);
    const double encoded = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
    return static_cast<unsigned char>(255 * encoded + 0.5);
}

void write_png(const std::string& file, const film& film, double exposure) {
    std::vector<unsigned char> rgb;
    for (const glm::dvec3& pixel : film.sum.pixels)
        for (int channel = 0; channel < 3; ++channel)
            rgb.push_back(to_srgb(exposure / film.passes * pixel[channel]));
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    png.width = png.height = static_cast<png_uint_32>(film.sum.width);
    png.format = PNG_FORMAT_RGB;
    if (!png_image_write_to_file(&png, file.c_str(), 0, rgb.data(), 0, nullptr))
        throw std::runtime_error("'" + file + "' cannot be written: " + png.message);
}

} // namespace

// By way of memory: OpenEXR does not tell of an error in the last bytes.
void write_exr(const std::string& file, const film& film) {
    const int width = film.sum.width;
    std::vector<float> data; // R, G, B of each pixel
    for (const glm::dvec3& pixel : film.sum.pixels)
        for (int channel = 0; channel < 3; ++channel)
            data.push_back(static_cast<float>(pixel[channel] / film.passes));
    Imf::Header header(width, width);
    Imf::FrameBuffer buffer;
    const char* const names[] = {"R", "G", "B"};
    constexpr std::size_t stride = 3 * sizeof(float);
    for (std::size_t channel = 0; channel < 3; ++channel) {
        header.channels().insert(names[channel], Imf::Channel(Imf::FLOAT));
        buffer.insert(names[channel], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(data.data() + channel),
                                                 stride, stride * static_cast<std::size_t>(width)));
    }
    Imf::StdOSStream memory;
    {
        Imf::OutputFile out(memory, header);
        out.setFrameBuffer(buffer);
        out.writePixels(width);
    }
    tools::write_file(file, memory.str());
}

void write_image(const std::string& base, const film& film, double exposure) {
    tools::attempts both;
    if (film.passes > 0) {
        both.run([&] { write_png(base + ".png", film, exposure); });
        both.run([&] { write_exr(base + ".exr", film); });
    }
    both.finish();
}

} // namespace bpt
