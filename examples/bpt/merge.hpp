// Merging, or photon mapping: a camera walk meets the light walks of all pixels where they come near.
#pragma once

#include "connect.hpp"
#include <nanoflann.hpp>

namespace bpt {

// The light walks of one pass, one per pixel, and a k-d tree over the vertices that can be merged with.
template <class Real> struct photon_map {
    struct photon {
        std::size_t walk, vertex;
    };
    std::vector<walk<Real>> walks;
    std::vector<photon> photons;
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<Real, photon_map>, photon_map, 3> tree;

    explicit photon_map(std::vector<walk<Real>> light_walks)
        : walks(std::move(light_walks)), photons(find_photons()), tree(3, *this) {}
    photon_map(const photon_map&) = delete; // the tree refers to this map
    photon_map& operator=(const photon_map&) = delete;

    std::vector<photon> find_photons() const {
        std::vector<photon> found;
        for (std::size_t i = 0; i < walks.size(); ++i)
            for (std::size_t k = 1; k < walks[i].size(); ++k)
                if (can_join(walks[i][k]))
                    found.push_back({i, k});
        return found;
    }
    const vertex<Real>& vertex_of(const photon& p) const { return walks[p.walk][p.vertex]; }

    // What the tree asks for.
    std::size_t kdtree_get_point_count() const { return photons.size(); }
    Real kdtree_get_pt(std::size_t i, std::size_t axis) const {
        return vertex_of(photons[i]).point.position[static_cast<int>(axis)];
    }
    template <class Box> bool kdtree_get_bbox(Box&) const { return false; } // it measures the box itself
};

// Calls f(photon) for all photons within the radius of a position.
template <class Real, class F>
void for_each_near(const photon_map<Real>& map, const vec3<Real>& position, Real radius, F&& f) {
    std::vector<std::pair<std::size_t, Real>> found;
    nanoflann::RadiusResultSet<Real, std::size_t> within(radius * radius, found);
    map.tree.radiusSearchCustomCallback(&position.x, within);
    for (const auto& match : found)
        f(map.photons[match.first]);
}

// What turns f of light from a direction into the light walk's, f*, at the surface it has met: the flux there
// goes with the geometric cosine. f |in.n_s| / |in.n_g|, [V97] 5.3.
template <class Real> Real adjoint_factor(const vertex<Real>& photon) {
    const vec3<Real>& in = photon.towards_previous;
    return shading_cosine(photon, in) / geometric_cosine(photon, in);
}

// A merge joins the camera walk's vertex to the light walk's edge that ends in the photon, and takes the
// photon's cosine and distance there. Both directions are the camera vertex' BSDF's. But the survival in
// pdf_to_camera is the photon's: it is the light walk that would have gone on from there.
template <class Real> void complete_merge(vertex<Real>& x, const vertex<Real>& photon) {
    bpt::material<Real> light_side = *x.material;
    light_side.survival = photon.material->survival;
    x.record.pdf_to_light = density(*x.material, x.point, x.towards_previous, photon.towards_previous);
    x.record.pdf_to_camera = density(light_side, x.point, photon.towards_previous, x.towards_previous);
    x.record.cos_to_light = photon.record.cos_to_light;
    x.record.distance2_to_light = photon.record.distance2_to_light;
}

// The end of a camera walk of s vertices is merged with the end of a light walk of t vertices.
template <class Real, class Weights, class Sink>
void merge(sample_pair<Real, Weights>& pair, int s, const walk<Real>& light, int t, Sink&& sink) {
    const vertex<Real>& photon = light[static_cast<std::size_t>(t - 1)];
    const vertex<Real>& end = pair.camera[static_cast<std::size_t>(s - 1)];
    const color<Real> f = evaluate(*end.material, end.point, end.towards_previous, photon.towards_previous);
    if (f == color<Real>(0))
        return;
    auto& path = pair.path;
    path.join(pair.camera, s, light, t - 1);
    path.photon = &photon;
    vertex<Real>& x = path[s - 1];
    complete_merge(x, photon);
    tell_merge(pair.weigh.mistakes, x, photon);
    const Real samples = pair.weigh.counts.merge; // light walks times pi r^2: a density estimate
    const color<Real> value = x.throughput * f * photon.throughput * (adjoint_factor(photon) / samples);
    sink(made_by(mis::technique_kind::merge, s, path.size, pair.pixel, value), path, [&] {
        return pair.weigh.merge(x.state, photon.state, mis::per_solid_angle{x.record.pdf_to_light},
                                mis::per_solid_angle{x.record.pdf_to_camera});
    });
}

// All merges of a camera walk. The sink is that of connect_all.
template <class Real, class Weights, class Sink>
void merge_all(sample_pair<Real, Weights>& pair, const photon_map<Real>& map, Real radius, Sink&& sink) {
    for (int s = 2; s <= static_cast<int>(pair.camera.size()); ++s) {
        const vertex<Real>& end = pair.camera[static_cast<std::size_t>(s - 1)];
        if (!can_join(end))
            continue;
        for_each_near(map, end.point.position, radius, [&](const auto& photon) {
            const int t = static_cast<int>(photon.vertex) + 1;
            if (s + t - 1 <= pair.longest)
                merge(pair, s, map.walks[photon.walk], t, sink);
        });
    }
}

} // namespace bpt
