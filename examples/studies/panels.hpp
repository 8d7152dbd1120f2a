// Pictures of a study: labelled images side by side, a colour bar below them. JPEG, because noise is nearly
// incompressible without loss.
#pragma once

#include "colors.hpp"
#include "study.hpp"
#include <algorithm>
#include <cairo.h>
#include <cstdlib>
#include <functional>
#include <jpeglib.h>
#include <memory>

namespace studies {

// Rows from the top; light in linear sRGB, what is above 1 is clipped, or false colours.
struct image {
    int width = 0, height = 0;
    std::vector<glm::dvec3> pixels;

    image() = default;
    image(int w, int h)
        : width(w), height(h),
          pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), glm::dvec3(0)) {}
};

struct panel {
    std::string label;
    image shown;
};

// Colors of 0 ... 1 from the left to the right, and what both ends mean. To be shown as they are: they are no
// light.
struct color_bar {
    std::function<glm::dvec3(double)> color;
    std::string left, right;
};

namespace detail {

using surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

inline surface make_surface(int width, int height) {
    return {cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height), cairo_surface_destroy};
}

// RGB24 has a pixel in 32 bits, 0x00RRGGBB, whatever the order of bytes.
inline std::uint32_t* row_of(const surface& s, int y) {
    unsigned char* const data = cairo_image_surface_get_data(s.get());
    return reinterpret_cast<std::uint32_t*>(data +
                                            std::ptrdiff_t(y) * cairo_image_surface_get_stride(s.get()));
}

inline void draw(const surface& s, int left, int top, const image& shown, bool is_light) {
    const auto byte = [&](double value) {
        const double x = std::clamp(value, 0.0, 1.0);
        return static_cast<unsigned>(255 * (is_light ? to_srgb(x) : x) + 0.5);
    };
    cairo_surface_flush(s.get());
    for (int y = 0; y < shown.height; ++y)
        for (int x = 0; x < shown.width; ++x) {
            const glm::dvec3& c = shown.pixels[static_cast<std::size_t>(y * shown.width + x)];
            row_of(s, top + y)[left + x] = byte(c.x) << 16 | byte(c.y) << 8 | byte(c.z);
        }
    cairo_surface_mark_dirty(s.get());
}

// Ends at x where it is aligned by 1, starts there where by 0.
inline void draw_text(const surface& s, double x, double y, double size, double align,
                      const std::string& text) {
    const context c{cairo_create(s.get()), cairo_destroy};
    cairo_select_font_face(c.get(), "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(c.get(), size);
    cairo_text_extents_t extents;
    cairo_text_extents(c.get(), text.c_str(), &extents);
    cairo_move_to(c.get(), x - align * extents.x_advance, y);
    cairo_show_text(c.get(), text.c_str());
}

// In memory, because libjpeg ends the program where it cannot write. Colours are not subsampled: noise is
// coloured.
inline std::string to_jpeg(const surface& s, int quality) {
    jpeg_compress_struct jpeg;
    jpeg_error_mgr errors;
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    unsigned char* data = nullptr;
    unsigned long size = 0;
    jpeg_mem_dest(&jpeg, &data, &size);
    jpeg.image_width = static_cast<JDIMENSION>(cairo_image_surface_get_width(s.get()));
    jpeg.image_height = static_cast<JDIMENSION>(cairo_image_surface_get_height(s.get()));
    jpeg.input_components = 3;
    jpeg.in_color_space = JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, quality, TRUE);
    jpeg.comp_info[0].h_samp_factor = jpeg.comp_info[0].v_samp_factor = 1;
    jpeg.optimize_coding = TRUE;
    jpeg_start_compress(&jpeg, TRUE);
    cairo_surface_flush(s.get());
    std::vector<unsigned char> row(std::size_t(3) * jpeg.image_width);
    while (jpeg.next_scanline < jpeg.image_height) {
        const std::uint32_t* const pixels = row_of(s, static_cast<int>(jpeg.next_scanline));
        for (std::size_t i = 0; i < row.size(); ++i)
            row[i] = static_cast<unsigned char>(pixels[i / 3] >> (16 - 8 * (i % 3)));
        unsigned char* rows[] = {row.data()};
        jpeg_write_scanlines(&jpeg, &rows[0], 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    std::string bytes(reinterpret_cast<const char*>(data), size);
    std::free(data);
    return bytes;
}

} // namespace detail

// In one row; with a colour bar, of false colours. Text is large enough to be read where the picture is shown
// at two thirds of its size.
inline void write_panels(const std::string& file, const std::vector<panel>& panels,
                         const color_bar& bar = {}) {
    constexpr int gap = 8, line = 34, text_size = 23, base = 25, quality = 88;
    const int width = panels[0].shown.width, height = panels[0].shown.height;
    const int count = static_cast<int>(panels.size()), sheet = count * (width + gap) - gap;
    const auto s = detail::make_surface(sheet, height + (bar.color ? 2 : 1) * line);
    cairo_surface_flush(s.get());
    for (int y = 0; y < cairo_image_surface_get_height(s.get()); ++y)
        std::fill_n(detail::row_of(s, y), sheet, 0xffffff);
    cairo_surface_mark_dirty(s.get());
    for (int i = 0; i < count; ++i) {
        const panel& p = panels[static_cast<std::size_t>(i)];
        detail::draw(s, i * (width + gap), 0, p.shown, !bar.color);
        detail::draw_text(s, i * (width + gap), height + base, text_size, 0, p.label);
    }
    if (bar.color) {
        image gradient(sheet / 3, line - gap);
        for (int i = 0; i < static_cast<int>(gradient.pixels.size()); ++i)
            gradient.pixels[static_cast<std::size_t>(i)] =
                bar.color((i % gradient.width + 0.5) / gradient.width);
        const int left = (sheet - gradient.width) / 2, top = height + line;
        detail::draw(s, left, top + gap / 2, gradient, false);
        detail::draw_text(s, left - gap, top + base, text_size, 1, bar.left);
        detail::draw_text(s, left + gradient.width + gap, top + base, text_size, 0, bar.right);
    }
    tools::write_file(file, detail::to_jpeg(s, quality));
}

} // namespace studies
