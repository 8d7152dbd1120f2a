// The edges of walks: how a walk leaves a vertex and arrives at the next one, what is between two vertices,
// and the beams that a walk leaves behind in media.
#pragma once

#include "roulette.hpp"

namespace bpt {

// Merges in media: what one density per volume, area or length stands for (0 where a family is off), and the
// radii. Point-beam: a light walk's point, a camera walk's beam.
template <class Real> struct media_merges {
    mis::family_sizes<Real> sizes;
    mis::family_sizes<Real> radii; // each family has its own
    bool long_camera_beams = true; // that do not end where the walk collides
    bool long_light_beams = false;
    int walks_for_beams = 1; // every so many-th light walk leaves beams

    bool any() const {
        return sizes.point_point + sizes.point_beam + sizes.beam_point + sizes.beam_beam > Real(0);
    }
    bool needs_light_beams() const { return sizes.beam_point + sizes.beam_beam > Real(0); }
    bool needs_camera_beams() const { return sizes.point_beam + sizes.beam_beam > Real(0); }
};

// Their radii, and with them their sizes, shrink from iteration to iteration at the rates of their
// dimensions: 3, 2, 2 and 1.
template <class Real> media_merges<Real> at_iteration(media_merges<Real> m, int iteration) {
    const auto shrunk = [&](int dimensions) {
        return mis::progressive_radius(Real(1), iteration, mis::optimal_alpha_in<Real>(dimensions),
                                       dimensions);
    };
    const Real in_1 = shrunk(1), in_2 = shrunk(2), in_3 = shrunk(3);
    m.radii = {m.radii.point_point * in_3, m.radii.point_beam * in_2, m.radii.beam_point * in_2,
               m.radii.beam_beam * in_1};
    m.sizes = {m.sizes.point_point * (in_3 * in_3 * in_3), m.sizes.point_beam * (in_2 * in_2),
               m.sizes.beam_point * (in_2 * in_2), m.sizes.beam_beam * in_1};
    return m;
}
template <class Real> bool leaves_beams(const media_merges<Real>& m, std::size_t light_walk) {
    return m.needs_light_beams() && light_walk % static_cast<std::size_t>(m.walks_for_beams) == 0;
}

// The weights of one pass, with the rates that they count on. In a scene with media the families of merges
// are one factor of each vertex, in the unit of which counts.merge is 1.
template <class Heuristic, class Real> struct weights_with_media : mis::path_weights<Heuristic, Real> {
    media_merges<Real> media;
    Real surface_factor = 1; // merges on surfaces over counts.merge
    bpt::roulette<Real> roulette;

    explicit weights_with_media(const Heuristic& h, const mis::technique_counts<Real>& c)
        : mis::path_weights<Heuristic, Real>(h, c) {}
    weights_with_media(const Heuristic& h, mis::technique_counts<Real> c, const media_merges<Real>& merges)
        : weights_with_media(h, in_units_of_factors(c)) {
        media = merges;
        surface_factor = c.merge;
    }

    static mis::technique_counts<Real> in_units_of_factors(mis::technique_counts<Real> c) {
        c.merge = 1;
        return c;
    }
    // Samples of a merge on a surface.
    Real surface_samples() const { return this->counts.merge * surface_factor; }
    // X of a piece that ends at a vertex.
    Real beam(walk_kind kind, const mis::distance_density<Real>& piece) const {
        const bool is_long =
            kind == walk_kind::from_camera ? media.long_camera_beams : media.long_light_beams;
        return mis::beam(piece.density, is_long ? Real(1) : piece.pass);
    }
    // How often two vertices are connected, over counts.connection; the camera's side first.
    Real connections(const vertex<Real>&, const vertex<Real>&) const { return 1; }
};

// The squared length of an edge as the weights want it.
template <class Weights, class Real>
mis::squared_distance<Real> edge_between(const Weights& weigh, const vertex<Real>& camera_side,
                                         const vertex<Real>& light_side) {
    return mis::times_connections(mis::squared_distance{squared_distance(camera_side, light_side)},
                                  weigh.connections(camera_side, light_side));
}

// Sizes of the families at a vertex of a walk, given how the walk has come and how the other walk would: from
// `to`, with its X.
template <class Real>
mis::family_sizes<Real> sizes_at(const mis::family_sizes<Real>& sizes, walk_kind kind, const vertex<Real>& x,
                                 const vec3<Real>& to, Real other_beam) {
    const bool camera = kind == walk_kind::from_camera;
    const mis::beams<Real> beams{camera ? x.beam : other_beam, camera ? other_beam : x.beam};
    return mis::at_vertex(sizes, beams, length(cross(x.towards_previous, to)));
}

// The merges at a vertex whose next edge begins with a piece of a medium.
template <class Weights, class Real>
Real merge_factor(const Weights& weigh, walk_kind kind, const vertex<Real>& x, const vec3<Real>& to,
                  const flight<Real>& next) {
    if (!is_in_medium(x) || !weigh.media.any())
        return is_in_medium(x) ? Real(0) : weigh.surface_factor;
    return joined(weigh.heuristic,
                  sizes_at(weigh.media.sizes, kind, x, to, weigh.beam(other(kind), next.first)));
}

// How a walk leaves a vertex: in which direction, with which densities (a Dirac lobe's are probabilities),
// into which medium.
template <class Real> struct departure {
    vec3<Real> origin{0}, to{0};
    color<Real> throughput{1};
    Real forward = 0, reverse = 0;
    Real eta_in = 1, eta_out = 1;
    int medium = -1;
};

// Scatters and arrives. Both in one, once the next vertex is known: in media the merges at a vertex depend on
// the edge that follows. An end point's state is that of the walk's start.
template <class Weights, class Real>
void arrive(const Weights& weigh, walk_kind kind, const vertex<Real>& from, const departure<Real>& leaving,
            const flight<Real>& flight, vertex<Real>& x) {
    const mis::cosine cos_in{geometric_cosine(from, from.towards_previous)};
    const mis::pdf_forward forward{leaving.forward};
    const mis::pdf_reverse reverse{leaving.reverse};
    mis::subpath_state<Real> state = from.state;
    if (scatters_dirac(from))
        state = weigh.scatter_dirac(state, cos_in, forward, reverse, mis::eta_in{leaving.eta_in},
                                    mis::eta_out{leaving.eta_out});
    else if (from.material)
        state = weigh.scatter(state, mis::cosine{geometric_cosine(from, leaving.to)}, forward, reverse,
                              merge_factor(weigh, kind, from, leaving.to, flight));
    x.towards_previous = -leaving.to;
    const mis::pdf_distance_forward distance{flight.forward(is_in_medium(x))};
    x.throughput = leaving.throughput * flight.transmittance / distance.value;
    const mis::squared_distance distance2 =
        kind == walk_kind::from_camera ? edge_between(weigh, from, x) : edge_between(weigh, x, from);
    x.state = weigh.arrive(state, distance2, mis::cosine{geometric_cosine(x, leaving.to)}, distance,
                           mis::pdf_distance_reverse{flight.reverse(is_in_medium(from))});
    if (is_in_medium(x))
        x.beam = weigh.beam(kind, flight.last);
}

// A piece of an edge in a medium, from `begin` to `end`, distances from where the walk has left a vertex: a
// sample of the walk's at each of them. A long one goes on to where the medium ends, a short one to where the
// walk collides.
template <class Real> struct beam {
    vertex<Real> from;
    departure<Real> leaving;
    flight<Real> before; // what lies before this piece
    Real begin = 0, end = 0;
    int medium = -1;
    std::uint32_t walk = 0; // of a light walk
    std::size_t place = 0;  // of `from` in its walk
    int vertices = 0;       // of the walk, one on the beam included
};

// The vertices of a walk, its own end point first; and the beams that it has left, where it is to.
template <class Real> struct walk : std::vector<vertex<Real>> {
    using std::vector<vertex<Real>>::vector;
    std::vector<beam<Real>> beams;
    bool leaves_beams = false;
    Real worth = 1;      // of what it contributes, in roulettes that are learned
    int copies_left = 1; // that it may still split into
};

template <class Weights, class Real>
void start(const Weights& weigh, walk<Real>& walk, vertex<Real> x, const mis::subpath_state<Real>& state,
           int medium) {
    x.state = state;
    x.medium = medium;
    walk.assign(1, x);
    walk.beams.clear();
    walk.copies_left = weigh.roulette.most_copies;
}

// A vertex in a medium, but for what arrive() knows.
template <class Real>
vertex<Real> medium_vertex(const scene<Real>& scene, int medium, const vec3<Real>& position) {
    vertex<Real> x;
    x.kind = mis::vertex_kind::medium;
    x.point = {position, vec3<Real>(0), vec3<Real>(0), 0, -1};
    x.material = &medium_at(scene, medium)->phase;
    x.medium = medium;
    return x;
}

// The vertex that the walk would have, had it collided at a distance of the beam.
template <class Weights, class Real>
vertex<Real> vertex_on(const Weights& weigh, const scene<Real>& scene, walk_kind kind, const beam<Real>& beam,
                       Real distance) {
    vertex<Real> x = medium_vertex(scene, beam.medium, beam.leaving.origin + distance * beam.leaving.to);
    x.depth = beam.vertices;
    weigh.roulette.find_cells(x);
    flight<Real> flight = beam.before;
    add_piece(scene, flight, beam.medium, distance - beam.begin);
    arrive(weigh, kind, beam.from, beam.leaving, flight, x);
    return x;
}

// Flies on from a walk's vertex to the first surface, to where it collides in a medium (then x is the
// vertex there), or to nothing. Leaves the beams of the pieces on its way.
template <class Real>
std::optional<surface_point<Real>> fly(const scene<Real>& scene, bool long_beams, std::size_t place,
                                       const departure<Real>& leaving, walk<Real>& walk, pcg32& rng,
                                       flight<Real>& f, vertex<Real>& x) {
    const vertex<Real>& from = walk[place];
    int& medium = x.medium;
    return follow(
        scene, leaving.origin, leaving.to, place_on_ray<Real>{0, leaving.medium, is_in_medium(from)},
        std::numeric_limits<Real>::max(), [&](const place_on_ray<Real>& at, Real end) {
            medium = at.medium;
            if (!has_media(scene))
                return true;
            const auto* here = medium_at(scene, at.medium);
            const Real distance = here ? sample_distance(*here, rng) : std::numeric_limits<Real>::max();
            const bool collides = distance < end - at.begin;
            const Real stop = collides ? at.begin + distance : end;
            if (here && walk.leaves_beams) {
                // What nothing ends is not followed to where nothing is left.
                const Real last = std::min(long_beams ? end : stop, 1000 * scene.radius);
                walk.beams.push_back({from, leaving, f, at.begin, last, at.medium, 0, place, from.depth + 1});
            }
            add_piece(scene, f, at.medium, stop - at.begin);
            if (collides)
                x = medium_vertex(scene, at.medium, leaving.origin + stop * leaving.to);
            return !collides;
        });
}

// What a walk meets: a surface, a point in a medium, a light (camera walks only: lights do not scatter), or
// nothing.
template <class Real>
std::optional<vertex<Real>> meet(const scene<Real>& scene, walk_kind kind, bool long_beams, std::size_t place,
                                 const departure<Real>& leaving, walk<Real>& walk, pcg32& rng,
                                 flight<Real>& flight) {
    const bool camera = kind == walk_kind::from_camera;
    vertex<Real> x;
    if (const auto hit = fly(scene, long_beams, place, leaving, walk, rng, flight, x)) {
        const bool on_light = hit->light >= 0;
        if (on_light && !camera)
            return std::nullopt;
        x.point = *hit;
        x.material = on_light ? nullptr : &scene.materials[static_cast<std::size_t>(hit->material)];
        x.kind = on_light                ? mis::vertex_kind::light
                 : is_dirac(*x.material) ? mis::vertex_kind::dirac
                                         : mis::vertex_kind::surface;
        return x;
    }
    if (is_in_medium(x))
        return x;
    if (camera && scene.environment >= 0)
        return light_vertex(scene, scene.environment, vec3<Real>(0), leaving.to);
    return std::nullopt;
}

// What lies between two vertices, and whether a surface does, too; x is no end at infinity. The direction is
// x's.
template <class Real>
flight<Real> between(const scene<Real>& scene, const vertex<Real>& x, const vertex<Real>& y,
                     const vec3<Real>& direction, bool& is_blocked) {
    const vec3<Real> to = is_infinite(y) ? x.point.position + 3 * scene.radius * direction : y.point.position;
    flight<Real> f;
    is_blocked = !has_media(scene) && !is_visible(scene, x.point.position, to);
    if (!has_media(scene))
        return f;
    const vec3<Real> edge = to - x.point.position;
    const Real distance = length(edge), looked_at = is_in_medium(y) ? distance : distance - scene.epsilon();
    const auto hit =
        follow(scene, x.point.position, edge / distance, place_on_ray<Real>{0, x.medium, is_in_medium(x)},
               looked_at, [&](const place_on_ray<Real>& place, Real end) {
                   const Real until = end < looked_at ? end : distance;
                   add_piece(scene, f, place.medium, until - place.begin);
                   return true;
               });
    is_blocked = hit.has_value();
    return f;
}
template <class Real>
std::optional<flight<Real>> between(const scene<Real>& scene, const vertex<Real>& x, const vertex<Real>& y,
                                    const vec3<Real>& direction) {
    bool is_blocked = false;
    const flight<Real> f = between(scene, x, y, direction, is_blocked);
    return is_blocked ? std::nullopt : std::optional(f);
}

// The end of a walk, once an edge across to the other walk has been chosen for it.
template <class Weights, class Real>
mis::subpath_end<Real> end_towards(const Weights& weigh, walk_kind kind, const vertex<Real>& x,
                                   const vec3<Real>& across, const flight<Real>& edge) {
    const mis::cosine cosine{geometric_cosine(x, across)};
    const mis::pdf_forward forward{walk_density(weigh.roulette, kind, x, x.towards_previous, across)};
    const mis::pdf_reverse reverse{walk_density(weigh.roulette, other(kind), x, across, x.towards_previous)};
    return {x.state, cosine, forward, reverse, merge_factor(weigh, kind, x, across, edge)};
}

// The densities of an edge's distance, from x on the camera's side to y.
template <class Real>
mis::pdf_distance_to_light<Real> to_light(const flight<Real>& f, const vertex<Real>& y) {
    return mis::pdf_distance_to_light{f.forward(is_in_medium(y))};
}
template <class Real>
mis::pdf_distance_to_camera<Real> to_camera(const flight<Real>& f, const vertex<Real>& x) {
    return mis::pdf_distance_to_camera{f.reverse(is_in_medium(x))};
}

} // namespace bpt
