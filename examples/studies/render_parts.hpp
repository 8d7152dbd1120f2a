// Renders pass by pass into two images: what merges have found, and what all other techniques have.
#pragma once

#include <film.hpp>
#include <render.hpp>

namespace studies {

struct parts {
    bpt::image merged, connected; // sums over passes
    int passes = 0;

    explicit parts(int width) : merged(bpt::black(width)), connected(merged) {}
    std::size_t pixels() const { return merged.pixels.size(); }
    glm::dvec3 mean(std::size_t pixel) const {
        return (merged.pixels[pixel] + connected.pixels[pixel]) / static_cast<double>(passes);
    }
};

inline bpt::image mean_image(const parts& p) {
    bpt::image image = p.merged;
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = p.mean(i);
    return image;
}

// The next pass. Rows are rendered in parallel: light walks, the only ones to reach pixels of other rows,
// wait.
template <class Real> void add_pass(const bpt::renderer<Real>& first, parts& sum) {
    const int pass = sum.passes++;
    const bpt::renderer<Real> renderer = first.at_pass(pass);
    std::optional<bpt::photon_map<Real>> photons;
    if (renderer.merges())
        photons.emplace(renderer.trace_light_walks(pass));
    struct splat {
        std::size_t pixel;
        glm::dvec3 value;
    };
    std::vector<std::vector<splat>> splats(static_cast<std::size_t>(renderer.set.width));
    bpt::in_parallel(renderer.set.threads, renderer.set.width, [&](int row) {
        const auto add = [&](const bpt::contribution<Real>& c, const bpt::complete_path<Real>&) {
            const splat s{static_cast<std::size_t>(c.pixel),
                          glm::dvec3(c.value) * static_cast<double>(c.weight)};
            if (c.technique.kind == mis::technique_kind::merge)
                sum.merged.pixels[s.pixel] += s.value;
            else if (c.technique.camera_vertices == 1)
                splats[static_cast<std::size_t>(row)].push_back(s);
            else
                sum.connected.pixels[s.pixel] += s.value;
        };
        renderer.render_row(pass, row, add, photons ? &*photons : nullptr);
    });
    for (const auto& row : splats)
        for (const splat& s : row)
            sum.connected.pixels[s.pixel] += s.value;
}

} // namespace studies
