#include "pictures.hpp"
#include <algorithm>
#include <cairo.h>
#include <cmath>
#include <memory>
#include <tools/files.hpp>
#include <tools/read_exr.hpp>

namespace lab {

technique_film::technique_film(int width) : film(width) {
    for (int n = 2; n <= longest_path; ++n)
        for (int s = 0; s <= n; ++s)
            unweighted[n][s] = weighted[n][s] = sum;
}

void technique_film::add_arrays(std::vector<row_array>& arrays, int rows_of_tile) {
    arrays.push_back(rows_of("the image", sum, rows_of_tile));
    for (int n = 2; n <= longest_path; ++n)
        for (int s = 0; s <= n; ++s) {
            const std::string name = "the image of paths of " + std::to_string(n) + " vertices, " +
                                     std::to_string(s) + " of the camera";
            arrays.push_back(rows_of(name + ", unweighted", unweighted[n][s], rows_of_tile));
            arrays.push_back(rows_of(name, weighted[n][s], rows_of_tile));
        }
}

image read_exr(const std::string& file, int width) {
    const tools::rgb_image read = tools::read_exr(file);
    if (read.width != width || read.height != width)
        throw std::runtime_error(file + " is not an RGB image of " + std::to_string(width) + " x " +
                                 std::to_string(width) + " pixels");
    image image{width, {}};
    for (std::size_t i = 0; i < read.values.size(); i += 3)
        image.pixels.emplace_back(read.values[i], read.values[i + 1], read.values[i + 2]);
    return image;
}

double rms_error(const bpt::film& film, const image& reference) {
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

namespace {

using surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

surface make_surface(int width, int height) {
    return {cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height), cairo_surface_destroy};
}

context white_page(const surface& s) {
    context c{cairo_create(s.get()), cairo_destroy};
    cairo_set_source_rgb(c.get(), 1, 1, 1);
    cairo_paint(c.get());
    return c;
}

double to_srgb(double linear) {
    const double x = std::clamp(linear, 0.0, 1.0);
    return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
}

surface to_surface(const labelled_image& tile) {
    const image& image = tile.image;
    const bool is_light = tile.bar.most.empty();
    surface s = make_surface(image.width, image.width);
    unsigned char* const data = cairo_image_surface_get_data(s.get());
    const auto stride = static_cast<std::size_t>(cairo_image_surface_get_stride(s.get()));
    const auto width = static_cast<std::size_t>(image.width);
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        unsigned char* const bgr = data + i / width * stride + i % width * 4;
        for (int channel = 0; channel < 3; ++channel) {
            const double x = image.pixels[i][channel];
            bgr[2 - channel] =
                static_cast<unsigned char>(255 * (is_light ? to_srgb(tile.scale * x) : x) + 0.5);
        }
    }
    cairo_surface_mark_dirty(s.get());
    return s;
}

void draw_image(const context& c, const labelled_image& tile, double x, double y, double width) {
    const surface s = to_surface(tile);
    const double magnified = width / tile.image.width;
    cairo_save(c.get());
    cairo_translate(c.get(), x, y);
    cairo_scale(c.get(), magnified, magnified);
    cairo_set_source_surface(c.get(), s.get(), 0, 0);
    if (magnified >= 1) // pixels stay squares
        cairo_pattern_set_filter(cairo_get_source(c.get()), CAIRO_FILTER_NEAREST);
    cairo_paint(c.get());
    cairo_restore(c.get());
}

// Returns the width of the text.
double draw_text(const context& c, double x, double y, double size, const std::string& text) {
    cairo_select_font_face(c.get(), "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(c.get(), size);
    cairo_set_source_rgb(c.get(), 0, 0, 0);
    cairo_move_to(c.get(), x, y);
    cairo_show_text(c.get(), text.c_str());
    cairo_text_extents_t extents;
    cairo_text_extents(c.get(), text.c_str(), &extents);
    return extents.x_advance;
}

// The bar, and below it what its ends and middle mean.
void draw_color_bar(const context& c, const color_bar& bar, double x, double y, double width,
                    double text_size) {
    constexpr int steps = 64;
    const double height = 0.7 * text_size;
    for (int k = 0; k < steps; ++k) {
        const glm::dvec3 color = false_color(bar.from + (1 - bar.from) * (k + 0.5) / steps);
        cairo_set_source_rgb(c.get(), color.x, color.y, color.z);
        cairo_rectangle(c.get(), x + k * width / steps, y, width / steps + 0.5, height);
        cairo_fill(c.get());
    }
    cairo_set_source_rgb(c.get(), 0, 0, 0);
    cairo_set_line_width(c.get(), 1);
    cairo_rectangle(c.get(), x, y, width, height);
    cairo_stroke(c.get());
    double place = 0; // left, middle, right
    for (const std::string& text : {bar.least, bar.middle, bar.most}) {
        cairo_set_font_size(c.get(), text_size);
        cairo_text_extents_t extents;
        cairo_text_extents(c.get(), text.c_str(), &extents);
        draw_text(c, x + place * (width - extents.x_advance), y + height + 1.1 * text_size, text_size, text);
        place += 0.5;
    }
}

void write(const surface& s, const std::string& file) {
    std::string png;
    const auto append = [](void* to, const unsigned char* bytes, unsigned count) {
        static_cast<std::string*>(to)->append(reinterpret_cast<const char*>(bytes), count);
        return CAIRO_STATUS_SUCCESS;
    };
    if (const auto status = cairo_surface_write_to_png_stream(s.get(), append, &png);
        status != CAIRO_STATUS_SUCCESS)
        throw std::runtime_error("'" + file + "' cannot be drawn: " + cairo_status_to_string(status));
    tools::write_file(file, png);
}

// Text that is read well where a picture of this width is shown across a page.
double text_size_for(double picture_width) {
    constexpr double page_width = 840, on_page = 14;
    return on_page * std::max(1.0, picture_width / page_width);
}

constexpr int least_width = 240; // of an image in a picture

// Pixels stay squares of whole pixels.
int shown_width(int width) { return width * ((least_width - 1) / width + 1); }

// All images in this width; what has no pixels is left white.
void draw_sheet(const std::string& file, const std::vector<labelled_image>& images, int columns, int width) {
    constexpr int gap = 6;
    const int count = static_cast<int>(images.size()), rows = (count + columns - 1) / columns;
    const int all = columns * (width + gap) - gap;
    const double text = text_size_for(all);
    const bool has_bars =
        std::any_of(images.begin(), images.end(), [](const auto& tile) { return !tile.bar.most.empty(); });
    const int below = static_cast<int>((has_bars ? 3.9 : 1.7) * text);
    const surface picture = make_surface(all, rows * (width + below + gap) - gap);
    const context c = white_page(picture);
    for (int i = 0; i < count; ++i) {
        const auto& tile = images[static_cast<std::size_t>(i)];
        if (tile.image.pixels.empty())
            continue;
        const int x = i % columns * (width + gap), y = i / columns * (width + below + gap);
        draw_image(c, tile, x, y, width);
        draw_text(c, x, y + width + 1.2 * text, text, tile.label);
        if (!tile.bar.most.empty())
            draw_color_bar(c, tile.bar, x + 1, y + width + 1.7 * text, width - 2, text);
    }
    write(picture, file);
}

} // namespace

void write_sheet(const std::string& file, const std::vector<labelled_image>& images, int columns) {
    draw_sheet(file, images, columns, shown_width(images.front().image.width));
}

void write_pyramid(const std::string& file, const technique_film& film, double exposure, int longest) {
    const int columns = std::min(longest, 6), shortest = std::min(columns, 3);
    std::vector<labelled_image> images;
    for (int n = shortest; n <= columns; ++n) {
        const double brighter = std::pow(1.6, n - 3); // long paths are dark
        for (const bool weighted : {false, true})
            for (int s = 1; s <= columns; ++s) {
                const std::string technique = "s=" + std::to_string(s) + ", t=" + std::to_string(n - s);
                if (s <= n)
                    images.push_back({technique + (weighted ? ": weighted" : ": alone"),
                                      (weighted ? film.weighted : film.unweighted)[n][s],
                                      exposure * brighter / film.passes});
                else
                    images.emplace_back();
            }
    }
    const int width = film.sum.width;
    draw_sheet(file, images, columns, width > least_width ? least_width : shown_width(width));
}

} // namespace lab
