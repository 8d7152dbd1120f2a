// SPDX-License-Identifier: MIT
// Floor 5: for renderers that keep no path. A shadow walk goes along with a walk and notes what a record of
// its paths needs: where its vertices lie and what it has been sampled with.
//
// Its calls stand beside those of the recursion and have their names. Cosines and distances are measured
// from positions and normals, so that what the weights have been told of them is checked, too. Densities are
// what the renderer says: say what the sampler does, not what the weights are given. docs/wrong_weights.md
// shows a renderer with it.
//
//     shadow_walk<Vec, dumps> where dumps is false notes nothing and takes no instruction
//
// Host only; it allocates.
#pragma once

#include <mis/subpath.hpp>
#include <mis/verify/record.hpp>
#include <vector>

namespace mis::verify {

// The walk of one sub-path so far, in the renderer's own vectors: any type with a - b and a dot product, of
// which Vec() is the null vector.
template <class Vec, bool Notes = true> class shadow_walk {
public:
    using scalar = mis::detail::scalar_of_t<Vec>;
    using end = end_point<scalar>;

    // The walk leaves its end point: `position`, with its geometric unit normal, Vec() at a point light. An
    // infinite light's position is not used, its normal is the unit direction towards it. The same for a
    // single point that is joined to, such as a next event's; end.direction then is that of the edge across.
    void start_camera(const Vec& position, const Vec& normal, const end& camera) {
        start(true, vertex_kind::camera, position, normal, camera);
    }
    void start_light(const Vec& position, const Vec& normal, const end& light,
                     vertex_kind kind = vertex_kind::light) {
        start(false, kind, position, normal, light);
    }

    // It reaches a vertex. In media with the densities of the distance, as path_weights::arrive has them.
    void arrive(vertex_kind kind, const Vec& position, const Vec& normal,
                pdf_distance_forward<scalar> forward = pdf_distance_forward<scalar>(scalar(1)),
                pdf_distance_reverse<scalar> reverse = pdf_distance_reverse<scalar>(scalar(1))) {
        assert(!vertices.empty());
        (from_camera ? vertices.back().pdf_distance_from_light : vertices.back().pdf_distance_from_camera) =
            static_cast<double>(reverse.value);
        add(kind, position, normal);
        (from_camera ? vertices.back().pdf_distance_from_camera : vertices.back().pdf_distance_from_light) =
            static_cast<double>(forward.value);
    }

    // Its last vertex scatters along the walk's next edge, or across the edge of a join, or (camera walks) of
    // a merge along the light walk's last edge: densities per solid angle with survival in them, of this walk
    // along the edge and of the other walk back. Each call replaces the one before at this vertex.
    void scatter(pdf_forward<scalar> forward, pdf_reverse<scalar> reverse, scalar merge_factor = scalar(1)) {
        assert(!vertices.empty());
        forward_field(vertices.back()) = static_cast<double>(forward.value);
        reverse_field(vertices.back()) = static_cast<double>(reverse.value);
        vertices.back().merge_factor = static_cast<double>(merge_factor);
    }
    // The same at mirrors and glass, with the probabilities of the lobe and the refractive indices.
    void scatter_dirac(pdf_forward<scalar> forward, pdf_reverse<scalar> reverse,
                       eta_in<scalar> in = eta_in<scalar>(scalar(1)),
                       eta_out<scalar> out = eta_out<scalar>(scalar(1))) {
        scatter(forward, reverse);
        recorded_vertex& x = vertices.back();
        x.eta_to_camera = static_cast<double>(from_camera ? in.value : out.value);
        x.eta_to_light = static_cast<double>(from_camera ? out.value : in.value);
    }

    // Its last vertex is the other end of the path: a light that has been hit (or the lens).
    void hit(const end& other_end) {
        assert(!vertices.empty());
        set_end(other_end, !from_camera);
    }

    // A field of the last vertex that only tells one mistake from another: survival, selection, material ...
    void note(double recorded_vertex::*field, double value) { vertices.back().*field = value; }

    int size() const { return static_cast<int>(vertices.size()); }

    // What has been noted: of the records all but the geometry, and where the vertices lie.
    std::vector<recorded_vertex> vertices;
    std::vector<path_vertex<Vec>> places;

private:
    bool from_camera = true;

    double& forward_field(recorded_vertex& x) const { return from_camera ? x.pdf_to_light : x.pdf_to_camera; }
    double& reverse_field(recorded_vertex& x) const { return from_camera ? x.pdf_to_camera : x.pdf_to_light; }

    void add(vertex_kind kind, const Vec& position, const Vec& normal) {
        path_vertex<Vec> place;
        place.kind = kind;
        place.position = position;
        place.normal = normal;
        places.push_back(place);
        recorded_vertex x;
        x.kind = kind;
        vertices.push_back(x);
    }
    void set_end(const end& e, bool is_camera) {
        recorded_vertex& x = vertices.back();
        x.pdf_position = static_cast<double>(e.position.value);
        x.pdf_next_event = static_cast<double>(e.next_event.value);
        (is_camera ? x.pdf_to_light : x.pdf_to_camera) = static_cast<double>(e.direction.value);
        x.dirac = !e.hittable;
    }
    void start(bool is_camera, vertex_kind kind, const Vec& position, const Vec& normal, const end& e) {
        from_camera = is_camera;
        vertices.clear();
        places.clear();
        add(kind, position, normal);
        set_end(e, is_camera);
    }
};

template <class Vec> class shadow_walk<Vec, false> {
public:
    template <class... Ignored> void start_camera(const Ignored&...) {}
    template <class... Ignored> void start_light(const Ignored&...) {}
    template <class... Ignored> void arrive(const Ignored&...) {}
    template <class... Ignored> void scatter(const Ignored&...) {}
    template <class... Ignored> void scatter_dirac(const Ignored&...) {}
    template <class... Ignored> void hit(const Ignored&...) {}
    template <class... Ignored> void note(const Ignored&...) {}
};

namespace detail {

// |cos| of the normal and the edge to a neighbour; a point light has no normal.
template <class Vec> double cosine_towards(const path_vertex<Vec>& from, const path_vertex<Vec>& to) {
    if (from.kind == vertex_kind::light && !(mis::detail::inner(from.normal, from.normal) > 0))
        return 1;
    return static_cast<double>(mis::detail::cosine_towards(from, to));
}

// The geometry of the edge between two neighbours.
template <class Vec>
void set_edge(const path_vertex<Vec>& near_camera, const path_vertex<Vec>& near_light, recorded_vertex& x,
              recorded_vertex& y) {
    x.cos_to_light = cosine_towards(near_camera, near_light);
    x.distance2_to_light = static_cast<double>(mis::detail::edge_squared(near_camera, near_light));
    y.cos_to_camera = cosine_towards(near_light, near_camera);
}

inline void set_etendue(recorded_vertex& x) {
    if (x.kind != vertex_kind::dirac)
        return;
    x.pdf_to_light = dirac_density(x.pdf_to_light, x.eta_to_light, x.cos_to_light);
    x.pdf_to_camera = dirac_density(x.pdf_to_camera, x.eta_to_camera, x.cos_to_camera);
}

} // namespace detail

// The record of a path that two walks have made, each as far as its last vertex. `light` is empty for a light
// hit, `camera` for a camera hit; a next event's light point and a camera connection's lens point are walks
// of one vertex; those of a merge end where they merge. Before a join or a merge, scatter() of each last
// vertex that has more than the end point's own direction. In media with the densities of the distance across
// the joined edge.
//
// As everywhere but in records, counts.merge includes the merges' area pi r^2. The heuristic is balance: set
// `heuristic` and `parameter` of the result to the renderer's. `weight` is what it has computed. Of walks
// that note nothing, an empty record, so that `if (dumps)` compiles either way.
template <class T, class Vec>
path_record record_of(technique_kind kind, const technique_counts<T>& counts, const shadow_walk<Vec>& camera,
                      const shadow_walk<Vec>& light, double weight, double radius = not_given,
                      double pdf_distance_to_light = 1, double pdf_distance_to_camera = 1) {
    const bool merges = kind == technique_kind::merge;
    assert(!merges || (camera.size() > 1 && light.size() > 1));
    path_record r = mis::record_of(counts, static_cast<const measured_vertex<double>*>(nullptr), 0,
                                   {kind, camera.size()}, weight, radius);
    r.vertices = camera.vertices;
    std::vector<path_vertex<Vec>> places = camera.places;
    const auto joined = static_cast<std::size_t>(camera.size());
    std::size_t k = light.vertices.size();
    if (merges) {
        --k;
        r.vertices.back().pdf_distance_from_light = light.vertices[k].pdf_distance_from_light;
        r.vertices.back().beam_from_light = light.vertices[k].beam_from_light;
        r.vertices.back().photon_survival = light.vertices[k].survival;
    }
    while (k-- > 0) {
        r.vertices.push_back(light.vertices[k]);
        places.push_back(light.places[k]);
    }
    for (std::size_t i = 0; i + 1 < places.size(); ++i) {
        const bool from_photon = merges && i + 1 == joined;
        detail::set_edge(from_photon ? light.places.back() : places[i], places[i + 1], r.vertices[i],
                         r.vertices[i + 1]);
    }
    if (!merges && joined > 0 && joined < places.size()) {
        r.vertices[joined].pdf_distance_from_camera = pdf_distance_to_light;
        r.vertices[joined - 1].pdf_distance_from_light = pdf_distance_to_camera;
    }
    for (recorded_vertex& x : r.vertices)
        detail::set_etendue(x);
    return r;
}

template <class T, class Vec, class... Numbers>
path_record record_of(technique_kind, const technique_counts<T>&, const shadow_walk<Vec, false>&,
                      const shadow_walk<Vec, false>&, double, const Numbers&...) {
    return {};
}

} // namespace mis::verify
