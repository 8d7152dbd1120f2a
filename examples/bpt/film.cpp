#include "film.hpp"
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <cairo.h>
#include <memory>
#include <stdexcept>

namespace bpt {

image black(int width) {
    return {width,
            std::vector<glm::dvec3>(static_cast<std::size_t>(width) * static_cast<std::size_t>(width))};
}

film::film(int width_in_pixels) : width(width_in_pixels), sum(black(width)) {
    for (int n = 2; n <= longest_path; ++n)
        for (int s = 0; s <= n; ++s)
            unweighted[n][s] = weighted[n][s] = sum;
}

namespace {

using surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

surface make_surface(int width, int height) {
    return {cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height), cairo_surface_destroy};
}

unsigned char to_srgb(double linear) {
    const double x = std::clamp(linear, 0.0, 1.0);
    const double encoded = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
    return static_cast<unsigned char>(255 * encoded + 0.5);
}

surface to_surface(const image& image, double scale) {
    surface s = make_surface(image.width, image.width);
    unsigned char* const data = cairo_image_surface_get_data(s.get());
    const auto stride = static_cast<std::size_t>(cairo_image_surface_get_stride(s.get()));
    const auto width = static_cast<std::size_t>(image.width);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        unsigned char* const bgr = data + i / width * stride + i % width * 4;
        for (int channel = 0; channel < 3; ++channel)
            bgr[2 - channel] = to_srgb(scale * image.pixels[i][channel]);
    }
    cairo_surface_mark_dirty(s.get());
    return s;
}

void write(const surface& s, const std::string& file) {
    if (cairo_surface_write_to_png(s.get(), file.c_str()) != CAIRO_STATUS_SUCCESS)
        throw std::runtime_error("cannot write " + file);
}

void draw_text(const context& c, double x, double y, double size, const std::string& text) {
    cairo_select_font_face(c.get(), "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(c.get(), size);
    cairo_set_source_rgb(c.get(), 0, 0, 0);
    cairo_move_to(c.get(), x, y);
    cairo_show_text(c.get(), text.c_str());
}

} // namespace

void write_png(const std::string& file, const film& film, double exposure) {
    write(to_surface(film.sum, exposure / film.passes), file);
}

namespace {

// A frame buffer over 3 floats per pixel.
Imf::FrameBuffer rgb_buffer(std::vector<float>& data, int width) {
    const char* const names[] = {"R", "G", "B"};
    constexpr std::size_t stride = 3 * sizeof(float);
    Imf::FrameBuffer buffer;
    for (std::size_t channel = 0; channel < 3; ++channel)
        buffer.insert(names[channel], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(data.data() + channel),
                                                 stride, stride * static_cast<std::size_t>(width)));
    return buffer;
}

bool is_square_rgb(const Imf::Header& header, int width) {
    const auto& window = header.dataWindow();
    const auto& channels = header.channels();
    return window.min.x == 0 && window.min.y == 0 && window.max.x == width - 1 && window.max.y == width - 1 &&
           channels.findChannel("R") && channels.findChannel("G") && channels.findChannel("B");
}

} // namespace

void write_exr(const std::string& file, const film& film) {
    std::vector<float> data;
    for (const glm::dvec3& pixel : film.sum.pixels)
        for (int channel = 0; channel < 3; ++channel)
            data.push_back(static_cast<float>(pixel[channel] / film.passes));
    Imf::Header header(film.width, film.width);
    for (const char* const channel : {"R", "G", "B"})
        header.channels().insert(channel, Imf::Channel(Imf::FLOAT));
    try {
        Imf::OutputFile out(file.c_str(), header);
        out.setFrameBuffer(rgb_buffer(data, film.width));
        out.writePixels(film.width);
    } catch (const std::exception&) {
        throw std::runtime_error("cannot write " + file);
    }
}

image read_exr(const std::string& file, int width) {
    const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(width);
    std::vector<float> data(3 * pixels);
    bool fits = false;
    try {
        Imf::InputFile in(file.c_str());
        fits = is_square_rgb(in.header(), width);
        if (fits) {
            in.setFrameBuffer(rgb_buffer(data, width));
            in.readPixels(0, width - 1);
        }
    } catch (const std::exception&) {
        throw std::runtime_error("cannot read " + file + " as OpenEXR");
    }
    if (!fits)
        throw std::runtime_error(file + " is not an RGB image of " + std::to_string(width) + " x " +
                                 std::to_string(width) + " pixels");
    image image{width, {}};
    for (std::size_t i = 0; i < pixels; ++i)
        image.pixels.emplace_back(data[3 * i], data[3 * i + 1], data[3 * i + 2]);
    return image;
}

double rms_error(const film& film, const image& reference) {
    double squares = 0;
    for (std::size_t i = 0; i < reference.pixels.size(); ++i) {
        const glm::dvec3 error = film.sum.pixels[i] / double(film.passes) - reference.pixels[i];
        squares += dot(error, error);
    }
    return std::sqrt(squares / (3 * static_cast<double>(reference.pixels.size())));
}

glm::dvec3 false_color(double x) {
    const double rest = 1 - std::min(1.0, std::abs(x));
    return x > 0 ? glm::dvec3(1, rest, rest) : glm::dvec3(rest, rest, 1);
}

void write_sheet(const std::string& file, const std::vector<labelled_image>& images, int columns,
                 int magnified) {
    constexpr int gap = 6, label = 18;
    const int count = static_cast<int>(images.size()), rows = (count + columns - 1) / columns;
    const int width = magnified * images.front().image.width;
    const surface picture = make_surface(columns * (width + gap) - gap, rows * (width + label + gap) - gap);
    const context c{cairo_create(picture.get()), cairo_destroy};
    cairo_set_source_rgb(c.get(), 1, 1, 1);
    cairo_paint(c.get());
    for (int i = 0; i < count; ++i) {
        const auto& tile = images[static_cast<std::size_t>(i)];
        const int x = i % columns * (width + gap), y = i / columns * (width + label + gap);
        const surface s = to_surface(tile.image, tile.scale);
        cairo_save(c.get());
        cairo_translate(c.get(), x, y);
        cairo_scale(c.get(), magnified, magnified);
        cairo_set_source_surface(c.get(), s.get(), 0, 0);
        cairo_pattern_set_filter(cairo_get_source(c.get()), CAIRO_FILTER_NEAREST);
        cairo_paint(c.get());
        cairo_restore(c.get());
        draw_text(c, x, y + width + 13, 12, tile.label);
    }
    write(picture, file);
}

void write_pyramid(const std::string& file, const film& film, double exposure) {
    constexpr int tile = 60, gap = 4, label = 14, header = 40, longest_shown = 6, margin = 44;
    constexpr int block = longest_shown * (tile + gap);
    const surface picture =
        make_surface(2 * (block + margin), header + (longest_shown - 1) * (tile + label + gap));
    const context c{cairo_create(picture.get()), cairo_destroy};
    cairo_set_source_rgb(c.get(), 1, 1, 1);
    cairo_paint(c.get());
    draw_text(c, margin, 16, 14, "unweighted: each technique alone");
    draw_text(c, 2 * margin + block, 16, 14, "weighted: its share of the image");
    for (int n = 2; n <= longest_shown; ++n) {
        const double brighter = std::pow(1.6, n - 3); // long paths are dark
        const int y = header + (n - 2) * (tile + label + gap);
        draw_text(c, 4, y + tile / 2, 11, "n = " + std::to_string(n));
        for (int s = 1; s <= n; ++s)
            for (const bool weighted : {false, true}) {
                const image& image = (weighted ? film.weighted : film.unweighted)[n][s];
                const int x = margin + (weighted ? block + margin : 0) + (s - 1) * (tile + gap);
                const surface s_image = to_surface(image, exposure * brighter / film.passes);
                cairo_save(c.get());
                cairo_translate(c.get(), x, y);
                cairo_scale(c.get(), double(tile) / film.width, double(tile) / film.width);
                cairo_set_source_surface(c.get(), s_image.get(), 0, 0);
                cairo_paint(c.get());
                cairo_restore(c.get());
                draw_text(c, x + 2, y + tile + 11, 10,
                          "s=" + std::to_string(s) + "  t=" + std::to_string(n - s));
            }
    }
    write(picture, file);
}

} // namespace bpt
