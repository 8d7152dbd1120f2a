// Which families of merges in media an algorithm has, and the options that set them.
#pragma once

#include "beam.hpp"
#include <algorithm>
#include <string>
#include <vector>

namespace bpt {

// Numbers of a family: all have names.
inline const std::vector<std::string>& family_names() {
    static const std::vector<std::string> names{"point-point", "point-beam", "beam-point", "beam-beam"};
    return names;
}

struct media_options {
    double radius_3d = 0, radius_2d = 0, radius_1d = 0; // of points, point and beam, beams; 0: --radius
    int beam_walks = 200;
    std::string long_beams = "camera";
};

template <class App> void add_media_options(App& app, media_options& o) {
    const auto is_radius = [](const std::string& text) {
        const double r = std::atof(text.c_str());
        return r > 0 && r <= 1 ? std::string() : "radius " + text + " not in (0, 1]";
    };
    app.add_option("--radius-3d", o.radius_3d, "as --radius, of points with points in media")
        ->check(is_radius);
    app.add_option("--radius-2d", o.radius_2d, "of points with beams")->check(is_radius);
    app.add_option("--radius-1d", o.radius_1d, "of beams with beams")->check(is_radius);
    app.add_option("--beam-walks", o.beam_walks, "about how many light walks of a pass leave beams")
        ->check([](const std::string& text) {
            return std::atoi(text.c_str()) > 0 ? std::string() : "no number of walks: " + text;
        });
    app.add_option("--long-beams", o.long_beams, "that do not end where a walk collides")
        ->check([](const std::string& text) {
            const bool known = text == "none" || text == "camera" || text == "light" || text == "both";
            return known ? std::string() : text + " not in {none,camera,light,both}";
        });
}

// The families of an algorithm: all of upbp, the one that it is named after, or that of photon maps where it
// merges at all. Radii are parts of the scene's.
template <class Real>
media_merges<Real> media_merges_of(const std::string& algorithm, bool merges, const media_options& o,
                                   double radius, Real scene_radius, Real light_walks) {
    media_merges<Real> m;
    m.long_camera_beams = o.long_beams == "camera" || o.long_beams == "both";
    m.long_light_beams = o.long_beams == "light" || o.long_beams == "both";
    m.walks_for_beams = std::max(1, static_cast<int>(light_walks) / o.beam_walks);
    const auto radius_of = [&](double own) {
        return static_cast<Real>(own > 0 ? own : radius) * scene_radius;
    };
    m.radii = {radius_of(o.radius_3d), radius_of(o.radius_2d), radius_of(o.radius_2d),
               radius_of(o.radius_1d)};
    // Walks 0, k, 2k, ...
    const Real beam_walks = std::ceil(light_walks / static_cast<Real>(m.walks_for_beams));
    const mis::family_sizes<Real> sizes{mis::point_point_size(light_walks, m.radii.point_point),
                                        mis::point_beam_size(light_walks, m.radii.point_beam),
                                        mis::beam_point_size(beam_walks, m.radii.beam_point),
                                        mis::beam_beam_size(beam_walks, m.radii.beam_beam)};
    const auto is_on = [&](std::size_t family) {
        const auto& names = family_names();
        const bool is_one = std::find(names.begin(), names.end(), algorithm) != names.end();
        return algorithm == "upbp" || (is_one ? algorithm == names[family] : merges && family == 0);
    };
    m.sizes = {is_on(0) ? sizes.point_point : Real(0), is_on(1) ? sizes.point_beam : Real(0),
               is_on(2) ? sizes.beam_point : Real(0), is_on(3) ? sizes.beam_beam : Real(0)};
    return m;
}

} // namespace bpt
