#include "compare.hpp"
#include <cstdio>

namespace lab {

std::string change_of(const comparison& c, int passes) {
    const auto &wrong = c.with_mistakes.sum, &right = c.without.sum;
    double change = 0, square = 0;
    for (std::size_t i = 0; i < right.size(); ++i) {
        change += wrong[i] - right[i];
        square += (wrong[i] - right[i]) * (wrong[i] - right[i]);
    }
    const double error =
        std::sqrt(std::max(0.0, square - change * change / static_cast<double>(right.size())));
    const double percent = 100 / c.without.brightness();
    char text[160];
    std::snprintf(text, sizeof text,
                  "the mistake changes the brightness by %+.2f %% (standard error %.2f %%)", percent * change,
                  percent * error);
    std::string line = text;
    if (passes > 1) {
        std::snprintf(text, sizeof text, ", the variance by a factor of %.2f",
                      c.with_mistakes.variance(passes) / c.without.variance(passes));
        line += text;
    }
    return line;
}

void write_comparison(const std::string& file, const bpt::film& film, const image& right, double exposure) {
    constexpr int magnified = 8;
    const std::string change = "1/" + std::to_string(magnified); // of what is shown as white
    const double scale = exposure / film.passes;
    image difference = right;
    for (std::size_t i = 0; i < right.pixels.size(); ++i) {
        const glm::dvec3 apart = film.sum.pixels[i] - right.pixels[i];
        difference.pixels[i] = false_color(magnified * scale * (apart.x + apart.y + apart.z) / 3);
    }
    write_sheet(file,
                {{"right", right, scale},
                 {"with the mistake", film.sum, scale},
                 {"difference", difference, 1, {"darker by " + change, "0", "brighter by " + change}}},
                3);
}

} // namespace lab
