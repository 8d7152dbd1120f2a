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

// The mean of all passes as it is; and, as BASE.png and BASE.exr, also brightened, in sRGB (what is above 1
// is clipped): none where there is no pass yet. Throws std::runtime_error with what cannot be written.
void write_exr(const std::string& file, const film& film);
void write_image(const std::string& base, const film& film, double exposure);

} // namespace bpt
