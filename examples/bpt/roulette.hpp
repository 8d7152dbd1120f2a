// How walks end and split. A rate is the expected number of copies in which a walk goes on from a vertex,
// once it has been joined there; the copies' throughput is divided by it. Material's survival is the simplest
// one. Others depend on what the walk carries: then weights, which both walks must compute, have another one
// in their densities, a function of the vertex and of the direction in which the walk arrives.
// docs/roulette.md tells why.
#pragma once

#include "vertex.hpp"
#include <array>
#include <cstdint>
#include <memory>
#include <mis/roulette.hpp>

namespace bpt {

enum class roulette_mode {
    none,         // walks end by leaving the scene, on lights and at the longest path
    throughput,   // by what the walk carries
    albedo,       // by the material's survival
    adjoint,      // by what it carries times what it will contribute: the rest are learned, see learn.hpp
    efficiency,   // by variance and cost of what follows
    per_technique // the same, with rates of their own for scattering and for next events
};
inline bool is_learned(roulette_mode mode) { return mode >= roulette_mode::adjoint; }

// ---- What is learned: a tree over positions, with direction bins at its leaves ----

constexpr int direction_bins = 6;
// By the axis that a direction is nearest to.
template <class Real> std::size_t direction_bin(const vec3<Real>& d) {
    const vec3<Real> a = abs(d);
    const int axis = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
    return static_cast<std::size_t>(2 * axis + (d[axis] < Real(0) ? 1 : 0));
}

// Boxes that are halved where much has been seen.
template <class Real> struct cell_tree {
    struct node {
        int axis = -1, child = 0; // the children are child and child + 1; a leaf, axis -1: child is its cell
    };
    std::vector<node> nodes{node{}};
    vec3<Real> low{0}, high{0}; // of the root; what is outside belongs to the leaf that is nearest
    int cells = 1;

    int cell_at(const vec3<Real>& position) const {
        vec3<Real> from = low, to = high;
        int i = 0;
        for (int axis; (axis = nodes[static_cast<std::size_t>(i)].axis) >= 0;) {
            const Real middle = (from[axis] + to[axis]) / 2;
            const bool above = position[axis] >= middle;
            (above ? from : to)[axis] = middle;
            i = nodes[static_cast<std::size_t>(i)].child + above;
        }
        return nodes[static_cast<std::size_t>(i)].child;
    }
};

// Of walks that arrive in a cell from a direction bin.
template <class Real> struct learned_bin {
    bool is_known = false;
    Real adjoint = 0;                 // what one of weight 1 will contribute from here on
    mis::walk_estimate<Real> onwards; // and the rest of what a copy of weight 1 does
    Real rate = 1;                    // mean of the rates that are played
    mis::walk_estimate<Real> next_event;
};

// All that has been learned before a pass. Each kind of walk has a tree, because few of one kind may come
// where many of the other do.
template <class Real> struct learned {
    struct of_walks {
        cell_tree<Real> tree;
        std::vector<std::array<learned_bin<Real>, direction_bins>> cells;
    } walks[2];
    std::vector<Real> next_event_rates; // of cells of camera walks: mean of the rates that are played
    std::vector<Real> worth;            // 1 over the estimate of each pixel
    mis::image_estimate<Real> image;    // variance of pixels over squared estimates, cost
};

template <class Real> struct roulette {
    roulette_mode mode = roulette_mode::albedo;
    mis::rate_bounds<Real> bounds{Real(1) / 8, Real(16)};
    Real window = 5;           // size of that by the adjoint
    int most_copies = 64;      // of a walk
    bool light_learns = true;  // false where light walks are merged: see bin_at()
    bool tries_copies = false; // camera walks split at random, for what copies differ by: see learn.hpp
    std::shared_ptr<const bpt::learned<Real>> learned;

    bool has_next_event_rates() const { return mode == roulette_mode::per_technique && learned; }
    // To be done before anything is asked about a vertex.
    void find_cells(vertex<Real>& x) const {
        for (std::size_t k = 0; k < 2 && learned; ++k)
            x.cells[k] = learned->walks[k].tree.cell_at(x.point.position);
    }

    // What is known of a walk's vertex, or null. Dirac scatterers have no rates of their own, [V]; nor have
    // light walks that are merged, because what they contribute to other pixels is not learned.
    const learned_bin<Real>* bin_at(walk_kind kind, const vertex<Real>& x, const vec3<Real>& from) const {
        if (!learned || scatters_dirac(x) || (kind == walk_kind::from_light && !light_learns))
            return nullptr;
        const std::size_t k = number_of(kind);
        const auto& bin = learned->walks[k].cells[static_cast<std::size_t>(x.cells[k])][direction_bin(from)];
        return bin.is_known ? &bin : nullptr;
    }

    // The rate in densities of a walk that arrives from a direction, over the survival that densities have
    // already.
    Real over_survival(walk_kind kind, const vertex<Real>& x, const vec3<Real>& from) const {
        if (mode == roulette_mode::none)
            return 1 / x.material->survival;
        const auto* bin = bin_at(kind, x, from);
        return bin ? bin->rate / x.material->survival : Real(1);
    }
    // Of next events, in their density, of a vertex anywhere.
    Real next_event_rate(const vertex<Real>& x) const {
        return has_next_event_rates() && x.kind == mis::vertex_kind::surface
                   ? learned->next_event_rates[static_cast<std::size_t>(x.cells[0])]
                   : Real(1);
    }
};

// The density of leaving a vertex, of a walk of this kind that comes from a direction: with its rate.
template <class Real>
Real walk_density(const roulette<Real>& r, walk_kind kind, const vertex<Real>& x, const vec3<Real>& from,
                  const vec3<Real>& to) {
    return density(*x.material, x.point, from, to) * r.over_survival(kind, x, from);
}

// A light as light_end_point() has it, for a path that arrives there from x: with x's rate of next events.
template <class Real>
mis::end_point<Real> light_end_point(const roulette<Real>& r, const scene<Real>& scene,
                                     const vertex<Real>& light, const vec3<Real>& leaving,
                                     const vertex<Real>& x) {
    mis::end_point<Real> end = light_end_point(scene, light, leaving);
    end.next_event.value *= r.next_event_rate(x);
    return end;
}

// ---- What is played ----

// All channels count alike.
template <class Real> Real brightness(const color<Real>& c) { return (c.x + c.y + c.z) / 3; }

// By what is learned, of a walk that carries nu, in units of its pixel's estimate. At least `most` copies are
// left.
template <class Real>
Real learned_rate(const roulette<Real>& r, const learned_bin<Real>& bin, Real nu, int left) {
    const mis::rate_bounds<Real> bounds{r.bounds.least, std::min(r.bounds.most, static_cast<Real>(left))};
    const auto& image = r.learned->image;
    switch (r.mode) {
    case roulette_mode::adjoint:
        return mis::adjoint_rate(nu, bin.adjoint, Real(1), mis::window_of_size(r.window), bounds);
    case roulette_mode::efficiency:
        return mis::efficiency_rate(nu, bin.onwards, image, bounds);
    default:
        return mis::technique_rate(nu, bin.onwards.variance, bin.onwards.cost, image, bounds);
    }
}
template <class Real>
Real learned_next_event_rate(const roulette<Real>& r, const learned_bin<Real>& bin, Real nu) {
    return mis::technique_rate(nu, bin.next_event.variance, bin.next_event.cost, r.learned->image, r.bounds);
}

// Draws in how many copies a walk goes on from its vertex x; at least one copy of a walk is always left to
// draw for.
template <class Walk, class Real>
int play(const roulette<Real>& r, walk_kind kind, Walk& walk, vertex<Real>& x, pcg32& rng) {
    x.rate = r.mode == roulette_mode::none ? Real(1) : x.material->survival;
    if (r.mode == roulette_mode::throughput)
        x.rate = mis::adjoint_rate(brightness(x.throughput), Real(1), brightness(walk.front().throughput), {},
                                   {r.bounds.least, Real(1)});
    else if (const auto* bin = r.bin_at(kind, x, x.towards_previous))
        x.rate = learned_rate(r, *bin, brightness(x.throughput) * walk.worth, walk.copies_left);
    if (r.tries_copies && kind == walk_kind::from_camera && uniform<Real>(rng) < Real(1) / 8)
        x.rate = std::min(std::max(x.rate, Real(2)), static_cast<Real>(walk.copies_left));
    x.copies = mis::copies(x.rate, uniform<Real>(rng));
    walk.copies_left -= std::max(0, x.copies - 1);
    return x.copies;
}

// And how many next events a camera walk makes at its vertex x, `each` where nothing else is known.
template <class Walk, class Real>
void play_next_events(const roulette<Real>& r, Real each, const Walk& walk, vertex<Real>& x, pcg32& rng) {
    if (!r.has_next_event_rates() || x.kind != mis::vertex_kind::surface)
        return;
    const auto* bin = r.bin_at(walk_kind::from_camera, x, x.towards_previous);
    x.next_event_rate =
        bin ? learned_next_event_rate(r, *bin, brightness(x.throughput) * walk.worth) : r.next_event_rate(x);
    x.next_events = mis::copies(each * x.next_event_rate, uniform<Real>(rng));
}

} // namespace bpt
