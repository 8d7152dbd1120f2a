// The image, and the files it is written to.
#pragma once

#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace bpt {

struct image {
    int width = 0; // and height
    std::vector<glm::dvec3> pixels;
};

image black(int width);

// What all passes have added up to.
struct film {
    image sum;
    int passes = 0;

    explicit film(int width) : sum(black(width)) {}
};

// The mean of all passes, brightened, as sRGB (what is above 1 is clipped); and as it is. Each throws
// std::runtime_error with the file's name when it cannot write.
void write_png(const std::string& file, const film& film, double exposure);
void write_exr(const std::string& file, const film& film);

} // namespace bpt
