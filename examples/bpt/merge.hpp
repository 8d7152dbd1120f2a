// Merging, or photon mapping: a camera walk meets the light walks of all pixels where they come near.
#pragma once

#include "connect.hpp"
#include <cstdint>
#include <nanoflann.hpp>

namespace bpt {

// What turns f of light from a direction into the light walk's, f*, at the surface it has met: the flux there
// goes with the geometric cosine. f |in.n_s| / |in.n_g|, [V97] 5.3.
template <class Real> Real adjoint_factor(const vertex<Real>& x) {
    const vec3<Real>& in = x.towards_previous;
    return shading_cosine(x, in) / geometric_cosine(x, in);
}

// All that a merge takes of a light walk's vertex.
template <class Real> struct photon {
    vec3<Real> position, towards_previous;
    color<Real> throughput; // of the walk, up to here, times adjoint_factor
    mis::subpath_state<Real> state;
    Real survival;
    std::uint32_t walk; // its number, which is its pixel
    int vertices;       // of the walk, up to here
};
static_assert(sizeof(photon<float>) <= 64, "memory is what limits photon maps");

template <class Real>
void add_photons(const walk<Real>& walk, std::size_t number, std::vector<photon<Real>>& photons) {
    for (std::size_t k = 1; k < walk.size(); ++k) {
        const vertex<Real>& x = walk[k];
        if (can_join(x))
            photons.push_back({x.point.position, x.towards_previous, x.throughput * adjoint_factor(x),
                               x.state, x.material->survival, static_cast<std::uint32_t>(number),
                               static_cast<int>(k) + 1});
    }
}

// What the light walks of one pass leave for merges.
template <class Real> struct light_pass {
    std::vector<photon<Real>> photons;
    std::vector<walk<Real>> walks; // in full, by number; empty where nobody looks at complete paths
};

// A k-d tree over the photons of one pass.
template <class Real> struct photon_map {
    light_pass<Real> light;
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<Real, photon_map>, photon_map, 3> tree;

    explicit photon_map(light_pass<Real> pass) : light(std::move(pass)), tree(3, *this) {}
    photon_map(const photon_map&) = delete; // the tree refers to this map
    photon_map& operator=(const photon_map&) = delete;

    // What the tree asks for.
    std::size_t kdtree_get_point_count() const { return light.photons.size(); }
    Real kdtree_get_pt(std::size_t i, std::size_t axis) const {
        return light.photons[i].position[static_cast<int>(axis)];
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
        f(map.light.photons[match.first]);
}

// A merge joins the camera walk's vertex to the light walk's edge that ends in the photon. Both directions
// are the camera vertex' BSDF's. But the survival in to_camera is the photon's: it is the light walk that
// would have gone on from there.
template <class Real> struct merge_densities {
    mis::pdf_to_light<Real> to_light;
    mis::pdf_to_camera<Real> to_camera;
};
template <class Real>
merge_densities<Real> densities_of_merge(const vertex<Real>& x, const photon<Real>& photon) {
    bpt::material<Real> light_side = *x.material;
    light_side.survival = photon.survival;
    return {mis::pdf_to_light{density(*x.material, x.point, x.towards_previous, photon.towards_previous)},
            mis::pdf_to_camera{density(light_side, x.point, photon.towards_previous, x.towards_previous)}};
}

// The complete path of a merge with the end of a light walk of t vertices. It takes the photon's cosine and
// distance.
template <class Real, class Weights>
void complete_merge(sample_pair<Real, Weights>& pair, int s, const walk<Real>& light, int t,
                    const merge_densities<Real>& densities) {
    const vertex<Real>& photon = light[static_cast<std::size_t>(t - 1)];
    pair.path.join(pair.camera, s, light, t - 1);
    pair.path.photon = &photon;
    pair.path.merged = s - 1;
    vertex<Real>& x = pair.path[s - 1];
    x.record.pdf_to_light = densities.to_light.value;
    x.record.pdf_to_camera = densities.to_camera.value;
    x.record.cos_to_light = photon.record.cos_to_light;
    x.record.distance2_to_light = photon.record.distance2_to_light;
    tell_merge(pair.weigh.mistakes, x, photon);
}

// The end of a camera walk of s vertices is merged with a photon. The sink's path is complete only where the
// map has the walks.
template <class Real, class Weights, class Sink>
void merge(sample_pair<Real, Weights>& pair, int s, const photon_map<Real>& map, const photon<Real>& photon,
           Sink&& sink) {
    const vertex<Real>& x = pair.camera[static_cast<std::size_t>(s - 1)];
    const color<Real> f = evaluate(*x.material, x.point, x.towards_previous, photon.towards_previous);
    if (f == color<Real>(0))
        return;
    const merge_densities<Real> densities = densities_of_merge(x, photon);
    pair.path.size = 0;
    if (!map.light.walks.empty())
        complete_merge(pair, s, map.light.walks[photon.walk], photon.vertices, densities);
    const Real samples = pair.weigh.counts.merge; // light walks times pi r^2: a density estimate
    const color<Real> value = x.throughput * f * photon.throughput / samples;
    sink(made_by(mis::technique_kind::merge, s, s + photon.vertices - 1, pair.pixel, value), pair.path,
         [&] { return pair.weigh.merge(x.state, photon.state, densities.to_light, densities.to_camera); });
}

// All merges of a camera walk. The sink is that of connect_all.
template <class Real, class Weights, class Sink>
void merge_all(sample_pair<Real, Weights>& pair, const photon_map<Real>& map, Real radius, Sink&& sink) {
    for (int s = 2; s <= static_cast<int>(pair.camera.size()); ++s) {
        const vertex<Real>& end = pair.camera[static_cast<std::size_t>(s - 1)];
        if (!can_join(end))
            continue;
        for_each_near(map, end.point.position, radius, [&](const photon<Real>& photon) {
            if (s + photon.vertices - 1 <= pair.longest)
                merge(pair, s, map, photon, sink);
        });
    }
}

} // namespace bpt
