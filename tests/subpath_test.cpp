// SPDX-License-Identifier: MIT
#include "oracle.hpp"
#include "random_paths.hpp"
#include "ranged.hpp"

#include <cstdio>
#include <doctest/doctest.h>
#include <mis/verify/subpaths.hpp>

using namespace test;
using mis::technique_kind;
using oracle::heuristic_kind;

static_assert(sizeof(mis::subpath_state<float>) == 8);
static_assert(sizeof(mis::subpath_state<double>) == 16);

namespace {

constexpr int paths = 100'000;

// The path with another scalar.
template <class U, class T>
std::vector<mis::measured_vertex<U>> converted(const std::vector<mis::measured_vertex<T>>& path) {
    std::vector<mis::measured_vertex<U>> result;
    for (const auto& x : path)
        result.push_back({x.kind, x.dirac, U(x.pdf_to_light), U(x.pdf_to_camera), U(x.pdf_position),
                          U(x.pdf_next_event), U(x.pdf_distance_from_camera), U(x.pdf_distance_from_light),
                          U(x.cos_to_camera), U(x.cos_to_light), U(x.distance2_to_light), U(x.merge_factor)});
    return result;
}
template <class U, class T> mis::technique_counts<U> converted(const mis::technique_counts<T>& c) {
    return {U(c.light_hit),  U(c.next_event), U(c.connection),       U(c.camera_connection), U(c.direct),
            U(c.camera_hit), U(c.merge),      c.max_camera_vertices, c.max_light_vertices};
}

// Whether every number that the recursion meets on its way to a technique's weight fits into T. Outside, the
// states of the library can only saturate.
template <class T, class Heuristic> struct range_of_recursion {
    Heuristic heuristic;
    mis::technique_counts<ranged<T>> counts;
    std::vector<mis::measured_vertex<ranged<T>>> path;

    range_of_recursion(const Heuristic& h, const random_path<T>& p)
        : heuristic(h), counts(converted<ranged<T>>(p.counts)), path(converted<ranged<T>>(p.vertices)) {}

    bool fits(mis::technique t) const {
        ranged<T>::escaped = false;
        (void)mis::weight_in_subpaths(heuristic, counts, path.data(), static_cast<int>(path.size()), t);
        return !ranged<T>::escaped;
    }
};

struct recursion_errors {
    worst_case weight;          // in ulp over beta n, where everything fits
    long long checked = 0;      // weights compared
    long long out_of_range = 0; // weights whose states cannot be expressed in T
    long long improper = 0;     // of those, NaN or outside [0, 1]
    long long wrong = 0;        // of those, further than 1e-4 from the exact weight
};

// `direct` is weighed with pdf_next_event in the O(1) hits: as documented, the two densities must agree
// there.
template <class T> void unify_ends(random_path<T>& path) {
    if (path.size() == 2)
        for (auto& x : path.vertices)
            x.pdf_next_event = x.pdf_position;
}

// Whether the two largest densities are too close to tell in T which is larger.
template <class T> bool nearly_tied(const std::vector<wide>& q) {
    int close = 0;
    for (const wide& x : oracle::relative(q))
        close += oracle::to_long_double(x) >
                 1 - 4096 * static_cast<long double>(std::numeric_limits<T>::epsilon());
    return close > 1;
}

// Visits each technique of random paths that has a positive density with its weight by the recursion.
template <class T, class Heuristic, class Make>
recursion_errors errors_of_recursion(std::uint64_t seed, int count, const Heuristic& h,
                                     oracle::heuristic reference, Make make, double decades = 0) {
    recursion_errors e;
    generator g(seed);
    const double beta = reference.kind == heuristic_kind::power ? reference.parameter : 1;
    // Where the compiler may regroup products, each number must be able to take another factor, of up to so
    // many decades, and another count.
    const bool regroups = !subnormals && decades > 0;
    ranged<T>::margin = regroups ? oracle::pow(wide{10}, std::floor(beta * decades + 6)) : wide{1};
    for (int sample = 0; sample < count; ++sample) {
        random_path<T> path = make(g);
        unify_ends(path);
        const int n = path.size();
        const auto q = oracle::densities(path.counts, oracle::path_of(path.vertices));
        if (reference.kind == heuristic_kind::maximum && nearly_tied<T>(q))
            continue;
        const auto exact = oracle::weights(reference, q);
        const range_of_recursion<T, Heuristic> range(h, path);
        // all techniques of short paths, half a dozen of long ones
        const int step = std::max(1, mis::technique_count(n) / 6);
        for (int k = g.integer(0, step - 1); k < mis::technique_count(n); k += step) {
            const auto at = static_cast<std::size_t>(k);
            const mis::technique t = mis::technique_at(n, k);
            if (q[at].zero() && mis::count_of(path.counts, t.kind) > 0 &&
                mis::detail::is_possible(path.data(), n, t))
                continue; // possible, but never sampled: no renderer asks for its weight
            const T w = mis::weight_in_subpaths(h, path.counts, path.data(), n, t);
            if (q[at].zero() || range.fits(t)) {
                ++e.checked;
                e.weight.see(ulp_error(w, exact[at]) / (beta * n), sample);
            } else {
                ++e.out_of_range;
                e.improper += is_nan(w) || oracle::is_negative(w) || !(w <= 1);
                e.wrong += !(std::fabs(static_cast<double>(w) -
                                       static_cast<double>(oracle::to_long_double(exact[at]))) <= 1e-4);
            }
        }
    }
    return e;
}

template <class T> void check(const char* what, const recursion_errors& e, double bound) {
    std::printf("%s, %s: %.3f beta n ulp over %lld weights; %lld out of range, %lld of them wrong by 1e-4\n",
                what, sizeof(T) == 4 ? "float" : "double", e.weight.error, e.checked, e.out_of_range,
                e.wrong);
    CAPTURE(what);
    CAPTURE(e.weight.sample);
    CHECK(e.weight.error <= bound);
    CHECK(e.improper == 0);
}

template <class T> random_path<T> any_path(generator& g) {
    const int n = g.chance(0.7) ? g.integer(2, 8) : g.integer(2, 64);
    return make_path<T>(g, n, g.chance(0.7) ? ordinary : extreme<T>);
}

} // namespace

TEST_CASE_TEMPLATE("weights of 100,000 random paths are the products'", T, float, double) {
    const auto make = [](generator& g) { return any_path<T>(g); };
    check<T>(
        "balance",
        errors_of_recursion<T>(11, paths, mis::balance, {heuristic_kind::balance}, make, extreme<T>.density),
        6);
    check<T>("power 2",
             errors_of_recursion<T>(12, paths / 10, mis::power, {heuristic_kind::power, 2}, make,
                                    extreme<T>.density),
             6);
    check<T>("power 1.5",
             errors_of_recursion<T>(13, paths / 50, mis::power_heuristic{1.5}, {heuristic_kind::power, 1.5},
                                    make, extreme<T>.density),
             6);
    check<T>("average",
             errors_of_recursion<T>(14, paths / 20, mis::average, {heuristic_kind::average}, make,
                                    extreme<T>.density),
             6);
    check<T>("maximum",
             errors_of_recursion<T>(15, paths / 20, mis::maximum, {heuristic_kind::maximum}, make,
                                    extreme<T>.density),
             0);
}

TEST_CASE("where a renderer's densities lie, float suffices") {
    // Densities and squared distances anywhere in 1e-3 ... 1e3, cosines down to 0.01, paths of up to 8
    // vertices: under balance every state fits into float. Under power 2 a state in a few hundred may under-
    // or overflow, where its technique hardly matters: no weight is wrong by 1e-4. On longer paths of such
    // independent factors (60 of them span more decades than float has) weights do go wrong now and then:
    // path.hpp is for those.
    for (int longest : {8, 64}) {
        const auto make = [&](generator& g) { return make_path<float>(g, g.integer(2, longest), ordinary); };
        const int count = longest == 8 ? 20'000 : 2'000;
        const auto balance =
            errors_of_recursion<float>(21, count, mis::balance, {heuristic_kind::balance}, make);
        const auto power =
            errors_of_recursion<float>(22, count, mis::power, {heuristic_kind::power, 2}, make);
        std::printf("ordinary densities, up to %d vertices\n", longest);
        check<float>("  balance", balance, 6);
        check<float>("  power 2", power, 6);
        if (longest == 8) {
            CHECK(balance.out_of_range == 0);
            CHECK(power.wrong == 0);
        }
    }
}

namespace {

// What a renderer knows at a Dirac vertex: probabilities of the lobe and refractive indices of the two
// sides.
struct boundary {
    double to_light, to_camera; // discrete probabilities
    double eta_camera_side, eta_light_side;
};

// A path whose Dirac vertices refract or reflect. The records hold their densities in basic etendue.
struct refracting_path {
    random_path<double> path;
    std::vector<boundary> boundaries;
};

refracting_path make_refracting_path(generator& g, int n) {
    refracting_path r{make_path<double>(g, n, ordinary), {}};
    for (auto& x : r.path.vertices) {
        boundary f{g.uniform(0.1, 1), g.uniform(0.1, 1), 1, 1};
        if (g.chance(0.7)) {
            f.eta_camera_side = g.uniform(1, 2);
            f.eta_light_side = g.uniform(1, 2);
        }
        if (x.kind == vertex_kind::dirac) {
            x.pdf_to_light = f.to_light * f.eta_light_side * f.eta_light_side * x.cos_to_light;
            x.pdf_to_camera = f.to_camera * f.eta_camera_side * f.eta_camera_side * x.cos_to_camera;
        }
        r.boundaries.push_back(f);
    }
    return r;
}

// A renderer's loops: both walks, state by state, then any technique from the stored states.
template <class Heuristic, class Use = mis::any_techniques> struct renderer {
    mis::path_weights<Heuristic, double, Use> weigh;
    const refracting_path& r;
    std::vector<mis::subpath_state<double>> camera, light; // after arrive at x_i

    renderer(const Heuristic& h, const refracting_path& refracting)
        : weigh(h, refracting.path.counts), r(refracting), camera(x().size()), light(x().size()) {
        walk_from_camera();
        walk_from_light();
    }

    const std::vector<mis::measured_vertex<double>>& x() const { return r.path.vertices; }

    mis::end_point<double> lens() const {
        const auto& e = x().front();
        return {mis::pdf_position{e.pdf_position}, mis::pdf_next_event{e.pdf_next_event},
                mis::pdf_direction{e.pdf_to_light}, mis::cosine{e.cos_to_light}, !e.dirac};
    }
    mis::end_point<double> lamp() const {
        const auto& e = x().back();
        return {mis::pdf_position{e.pdf_position}, mis::pdf_next_event{e.pdf_next_event},
                mis::pdf_direction{e.pdf_to_camera}, mis::cosine{e.cos_to_camera}, !e.dirac};
    }

    void walk_from_camera() {
        auto state = weigh.start_camera(lens());
        for (std::size_t i = 1; i < x().size(); ++i) {
            const auto &v = x()[i], &last = x()[i - 1];
            if (v.kind == vertex_kind::infinite_light)
                state = weigh.arrive_at_infinity(state, mis::pdf_distance_forward{v.pdf_distance_from_camera},
                                                 mis::pdf_distance_reverse{last.pdf_distance_from_light});
            else
                state = weigh.arrive(state, mis::squared_distance{last.distance2_to_light},
                                     mis::cosine{v.cos_to_camera},
                                     mis::pdf_distance_forward{v.pdf_distance_from_camera},
                                     mis::pdf_distance_reverse{last.pdf_distance_from_light});
            camera[i] = state;
            const auto& f = r.boundaries[i];
            if (v.kind == vertex_kind::dirac)
                state = weigh.scatter_dirac(state, mis::cosine{v.cos_to_camera}, mis::pdf_forward{f.to_light},
                                            mis::pdf_reverse{f.to_camera}, mis::eta_in{f.eta_camera_side},
                                            mis::eta_out{f.eta_light_side});
            else
                state = weigh.scatter(state, mis::cosine{v.cos_to_light}, mis::pdf_forward{v.pdf_to_light},
                                      mis::pdf_reverse{v.pdf_to_camera}, v.merge_factor);
        }
    }

    void walk_from_light() {
        auto state = weigh.start_light(lamp());
        for (std::size_t i = x().size() - 1; i-- > 0;) {
            const auto &v = x()[i], &last = x()[i + 1];
            if (last.kind == vertex_kind::infinite_light)
                state = weigh.arrive_from_infinity(state, mis::cosine{v.cos_to_light},
                                                   mis::pdf_distance_forward{v.pdf_distance_from_light},
                                                   mis::pdf_distance_reverse{last.pdf_distance_from_camera});
            else
                state = weigh.arrive(state, mis::squared_distance{v.distance2_to_light},
                                     mis::cosine{v.cos_to_light},
                                     mis::pdf_distance_forward{v.pdf_distance_from_light},
                                     mis::pdf_distance_reverse{last.pdf_distance_from_camera});
            light[i] = state;
            const auto& f = r.boundaries[i];
            if (v.kind == vertex_kind::dirac)
                state = weigh.scatter_dirac(state, mis::cosine{v.cos_to_light}, mis::pdf_forward{f.to_camera},
                                            mis::pdf_reverse{f.to_light}, mis::eta_in{f.eta_light_side},
                                            mis::eta_out{f.eta_camera_side});
            else
                state = weigh.scatter(state, mis::cosine{v.cos_to_camera}, mis::pdf_forward{v.pdf_to_camera},
                                      mis::pdf_reverse{v.pdf_to_light}, v.merge_factor);
        }
    }

    // Whether the calls for kept records and pinholes serve: without media on the edge.
    static bool keeps(const mis::measured_vertex<double>& end, const mis::measured_vertex<double>& other) {
        return other.kind != vertex_kind::medium && end.pdf_distance_from_camera == 1 &&
               end.pdf_distance_from_light == 1 && other.pdf_distance_from_camera == 1 &&
               other.pdf_distance_from_light == 1;
    }

    double weight(mis::technique t) const {
        const auto s = static_cast<std::size_t>(t.camera_vertices);
        if (t.kind == technique_kind::light_hit)
            return weigh.counts.direct == 0 ? weigh.light_hit(camera.back(), mis::keep(lamp()))
                                            : weigh.light_hit(camera.back(), lamp());
        if (t.kind == technique_kind::camera_hit)
            return weigh.camera_hit(light.front(), lens());
        if (t.kind == technique_kind::merge)
            return weigh.merge(camera[s - 1], light[s - 1], mis::pdf_to_light{x()[s - 1].pdf_to_light},
                               mis::pdf_to_camera{x()[s - 1].pdf_to_camera}, x()[s - 1].merge_factor);
        const auto &a = x()[s - 1], &b = x()[s];
        const mis::squared_distance d2{a.distance2_to_light};
        const mis::pdf_distance_to_light there{b.pdf_distance_from_camera};
        const mis::pdf_distance_to_camera back{a.pdf_distance_from_light};
        const mis::subpath_end<double> camera_end{camera[s - 1], mis::cosine{a.cos_to_light},
                                                  mis::pdf_forward{a.pdf_to_light},
                                                  mis::pdf_reverse{a.pdf_to_camera}, a.merge_factor};
        const mis::subpath_end<double> light_end{light[s], mis::cosine{b.cos_to_camera},
                                                 mis::pdf_forward{b.pdf_to_camera},
                                                 mis::pdf_reverse{b.pdf_to_light}, b.merge_factor};
        switch (t.kind) {
        case technique_kind::direct:
            return weigh.direct(lens(), lamp(), d2, there, back);
        case technique_kind::next_event:
            return keeps(b, a) ? weigh.next_event(camera_end, mis::keep(lamp()), d2)
                               : weigh.next_event(camera_end, lamp(), d2, there, back);
        case technique_kind::camera_connection:
            return a.dirac && keeps(a, b) && a.pdf_next_event == 1 && a.pdf_position == 1
                       ? weigh.camera_connection(mis::pdf_direction{a.pdf_to_light}, light_end, d2)
                       : weigh.camera_connection(lens(), light_end, d2, there, back);
        default:
            return weigh.connection(camera_end, light_end, d2, there, back);
        }
    }
};

template <class Use = mis::any_techniques, class Heuristic>
double error_by_hand(const Heuristic& h, oracle::heuristic reference, std::uint64_t seed) {
    generator g(seed);
    worst_case worst;
    for (int sample = 0; sample < 10'000; ++sample) {
        auto r = make_refracting_path(g, g.integer(Use::always_connects ? 3 : 2, 12));
        unify_ends(r.path);
        auto& c = r.path.counts;
        auto& lens = r.path.vertices.front();
        if (lens.dirac && g.chance(0.7))
            lens.pdf_position = lens.pdf_next_event = 1;
        if (Use::always_connects || g.chance(0.3))
            c.direct = 0;
        if (Use::always_connects && !(c.connection > 0))
            c.connection = g.log_uniform<double>(-1, 1);
        if (!Use::merge_factors)
            for (auto& x : r.path.vertices)
                x.merge_factor = 1;
        const int n = r.path.size();
        const auto q = oracle::densities(c, oracle::path_of(r.path.vertices));
        if (reference.kind == heuristic_kind::maximum && nearly_tied<double>(q))
            continue;
        const auto exact = oracle::weights(reference, q);
        const renderer<Heuristic, Use> render(h, r);
        for (std::size_t k = 0; k < q.size(); ++k)
            if (!q[k].zero())
                worst.see(ulp_error(render.weight(mis::technique_at(n, static_cast<int>(k))), exact[k]) / n,
                          sample);
    }
    return worst.error;
}

} // namespace

TEST_CASE("the calls of a renderer's own loops, with refracting Dirac vertices") {
    CHECK(error_by_hand(mis::balance, {heuristic_kind::balance}, 31) <= 6);
    CHECK(error_by_hand(mis::power, {heuristic_kind::power, 2}, 32) <= 12);
    CHECK(error_by_hand(mis::average, {heuristic_kind::average}, 33) <= 1);
    CHECK(error_by_hand(mis::maximum, {heuristic_kind::maximum}, 34) == 0);
}

TEST_CASE("the same where it is known that connections are on and surfaces alone merge") {
    using known = mis::connected_surfaces;
    CHECK(error_by_hand<known>(mis::balance, {heuristic_kind::balance}, 35) <= 6);
    CHECK(error_by_hand<known>(mis::power, {heuristic_kind::power, 2}, 36) <= 12);
    CHECK(error_by_hand<known>(mis::average, {heuristic_kind::average}, 37) <= 1);
    CHECK(error_by_hand<known>(mis::maximum, {heuristic_kind::maximum}, 38) == 0);
}

namespace {

// Numbers of every kind that a renderer may get from a degenerate scene.
template <class T> T any_number(generator& g) {
    using limits = std::numeric_limits<T>;
    switch (g.integer(0, 11)) {
    case 0:
        return 0;
    case 1:
        return limits::infinity();
    case 2:
        return limits::denorm_min();
    case 3:
        return limits::min();
    case 4:
        return limits::max();
    case 5:
        return limits::max() / 16;
    case 6:
        return static_cast<T>(std::ldexp(1.0, g.integer(limits::min_exponent, limits::max_exponent - 1)));
    case 7:
        return static_cast<T>(std::ldexp(1.0, g.integer(-30, 30)));
    default:
        return g.log_uniform<T>(-1, 1);
    }
}

template <class T> bool is_proper(T w) {
    return !is_nan(w) && !oracle::is_negative(w) && bits_of(w) <= bits_of(T(1));
}

// Walks over anything, and every weight of what they leave: how many are not in [0, 1], and how many states
// are not finite.
template <class T, class Use, class Heuristic>
std::pair<int, int> improper(const Heuristic& h, std::uint64_t seed) {
    generator g(seed);
    const auto any = [&] { return any_number<T>(g); };
    const auto any_or_1 = [&] { return g.chance(0.5) ? any() : T(1); };
    const auto distance2 = [&] {
        return mis::squared_distance<T>(std::max(any(), std::numeric_limits<T>::min()));
    };
    const auto end = [&](bool hittable) {
        return mis::end_point<T>{mis::pdf_position<T>(any()), mis::pdf_next_event<T>(any()),
                                 mis::pdf_direction<T>(any()), mis::cosine<T>(any()), hittable};
    };
    int weights = 0, states = 0;
    for (int sample = 0; sample < 20'000; ++sample) {
        auto c = random_counts<T>(g);
        if (Use::always_connects) {
            c.connection = std::max(c.connection, T(0.25));
            c.direct = 0;
        }
        const mis::path_weights<Heuristic, T, Use> weigh(h, c);
        const auto walk = [&](mis::subpath_state<T> x) {
            for (int k = g.integer(0, 3);; --k) {
                x = weigh.arrive(x, distance2(), mis::cosine<T>(any()),
                                 mis::pdf_distance_forward<T>(any_or_1()),
                                 mis::pdf_distance_reverse<T>(any_or_1()));
                if (g.chance(0.3))
                    x = weigh.step(x, mis::cosine_out<T>(any()), mis::pdf_forward<T>(any()),
                                   mis::pdf_reverse<T>(any()), distance2(), mis::cosine_in<T>(any()),
                                   any_or_1());
                states += !is_finite(x.a) || !is_finite(x.b);
                if (k == 0)
                    return x;
                x = g.chance(0.3) ? weigh.scatter_dirac(x, mis::cosine<T>(any()), mis::pdf_forward<T>(any()),
                                                        mis::pdf_reverse<T>(any()))
                                  : weigh.scatter(x, mis::cosine<T>(any()), mis::pdf_forward<T>(any()),
                                                  mis::pdf_reverse<T>(any()), any_or_1());
            }
        };
        const auto camera = end(g.chance(0.5)), light = end(g.chance(0.5));
        const auto hittable_camera = end(true), hittable_light = end(true);
        const auto x = walk(weigh.start_camera(camera)), y = walk(weigh.start_light(light));
        const mis::subpath_end<T> a{x, mis::cosine<T>(any()), mis::pdf_forward<T>(any()),
                                    mis::pdf_reverse<T>(any()), any_or_1()};
        const mis::subpath_end<T> b{y, mis::cosine<T>(any()), mis::pdf_forward<T>(any()),
                                    mis::pdf_reverse<T>(any()), any_or_1()};
        const T results[] = {
            weigh.connection(a, b, distance2()),
            weigh.next_event(a, light, distance2()),
            weigh.next_event(a, mis::keep(light), distance2()),
            weigh.camera_connection(camera, b, distance2()),
            weigh.camera_connection(camera.direction, b, distance2()),
            weigh.light_hit(x, hittable_light),
            c.direct > 0 ? T(0) : weigh.light_hit(x, mis::keep(hittable_light)),
            weigh.camera_hit(y, hittable_camera),
            weigh.direct(camera, light, distance2()),
            weigh.merge(x, y, mis::pdf_to_light<T>(any()), mis::pdf_to_camera<T>(any()), any_or_1())};
        for (const T w : results)
            weights += !is_proper(w);
    }
    return {weights, states};
}

} // namespace

TEST_CASE_TEMPLATE("whatever goes in, weights are in [0, 1] and states finite", T, float, double) {
    const auto check_counts = [](std::pair<int, int> counts) {
        CHECK(counts.first == 0);
        if (subnormals) // -ffast-math may leave NaN in a state; no weight shows it
            CHECK(counts.second == 0);
    };
    const auto check_both = [&](auto h, std::uint64_t seed) {
        check_counts(improper<T, mis::any_techniques>(h, seed));
        check_counts(improper<T, mis::connected_surfaces>(h, seed + 1));
    };
    check_both(mis::balance, 61);
    check_both(mis::power, 63);
    check_both(mis::power_heuristic{T(1.5)}, 65);
    check_both(mis::average, 67);
    check_both(mis::maximum, 69);
}

namespace {

// The path in a scene that is 2^exponent times as large.
template <class T> random_path<T> in_larger_units(random_path<T> path, int exponent) {
    const T area = std::ldexp(T(1), 2 * exponent), length = std::ldexp(T(1), exponent);
    path.counts.merge *= area; // pi r^2
    for (std::size_t i = 0; i < path.vertices.size(); ++i) {
        auto& x = path.vertices[i];
        const bool edge_is_finite =
            i + 1 < path.vertices.size() && path.vertices[i + 1].kind != vertex_kind::infinite_light;
        if (edge_is_finite)
            x.distance2_to_light *= area;
        if (x.kind == vertex_kind::infinite_light)
            x.pdf_to_camera /= area; // of the perpendicular disk
        else if (i + 1 == path.vertices.size() || i == 0) {
            x.pdf_position /= area;
            x.pdf_next_event /= area;
        }
        if (x.kind == vertex_kind::medium) {
            x.pdf_distance_from_camera /= length;
            x.pdf_distance_from_light /= length;
            x.merge_factor *= length; // a kernel's volume over a disk's area
        }
    }
    return path;
}

} // namespace

TEST_CASE("weights do not depend on the unit of length: counts for the scene's size") {
    // Power 2 in float is the narrowest. Whoever says how large the scene is gets the unscaled path's weights
    // whether it is in micrometres or in thousands of kilometres; who does not, from 1e-5 to 1e2 of what the
    // densities are.
    if (!subnormals)
        return; // densities of 1e-12 to 1e12, where -ffast-math allows 1e-8 to 1e8
    generator g(81);
    double with_size = 0, without_within = 0, without_beyond = 0;
    for (int sample = 0; sample < 4'000; ++sample) {
        auto path = make_path<float>(g, g.integer(2, 6), {2, 2, 1e-1, 0});
        path.counts.direct = 0;
        const int n = path.size();
        for (const int exponent : {-20, -17, -13, 7, 13, 20}) { // 2^20 is 1e6
            double& without = exponent >= -17 && exponent <= 7 ? without_within : without_beyond;
            const auto larger = in_larger_units(path, exponent);
            const auto counts = mis::for_scene_of_size(larger.counts, std::ldexp(1.f, exponent));
            for (int k = 0; k < mis::technique_count(n); ++k) {
                const auto weight = [&](const auto& c, const auto& p) {
                    return static_cast<double>(
                        mis::weight_in_subpaths(mis::power, c, p.data(), n, mis::technique_at(n, k)));
                };
                const double exact = weight(path.counts, path);
                with_size = std::max(with_size, std::fabs(weight(counts, larger) - exact));
                without = std::max(without, std::fabs(weight(larger.counts, larger) - exact));
            }
        }
    }
    std::printf("scenes of 1e-6 to 1e6: weights differ by %.2g; where the size is not told, by %.2g from "
                "1e-5 to 1e2, "
                "beyond by %.2g\n",
                with_size, without_within, without_beyond);
    CHECK(with_size <= 1e-9);
    CHECK(without_within <= 1e-6);
    CHECK(without_beyond > 0.1);
}

TEST_CASE_TEMPLATE("connections that are made more or less often than their count", T, float, double) {
    // Each inner edge's connection has a factor of its own: in the products the density's, in the recursion
    // the distance's.
    generator g(61);
    worst_case worst;
    double changed = 0; // by the factors
    const auto compare = [&](const auto& heuristic, oracle::heuristic reference, int sample) {
        auto path = make_path<T>(g, g.integer(4, 10), {1, 1, 0.1, 0});
        const int n = path.size();
        auto q = oracle::densities(path.counts, oracle::path_of(path.vertices));
        const auto without = oracle::weights(reference, q);
        for (int s = 2; s <= n - 2; ++s) {
            const T factor = g.log_uniform<T>(-2, 2);
            auto& distance2 = path.vertices[static_cast<std::size_t>(s - 1)].distance2_to_light;
            distance2 = mis::times_connections(mis::squared_distance{distance2}, factor).value;
            q[static_cast<std::size_t>(s)] = q[static_cast<std::size_t>(s)] * wide{factor};
        }
        const auto exact = oracle::weights(reference, q);
        for (int k = 0; k < mis::technique_count(n); ++k) {
            const auto at = static_cast<std::size_t>(k);
            const T w =
                mis::weight_in_subpaths(heuristic, path.counts, path.data(), n, mis::technique_at(n, k));
            worst.see(ulp_error(w, exact[at]) / n, sample);
            changed += std::fabs(static_cast<double>(oracle::to_long_double(exact[at])) -
                                 static_cast<double>(oracle::to_long_double(without[at])));
        }
    };
    constexpr int samples = 5'000;
    for (int sample = 0; sample < samples; ++sample) {
        compare(mis::balance, {heuristic_kind::balance}, sample);
        compare(mis::power, {heuristic_kind::power, 2}, sample);
    }
    CAPTURE(worst.sample);
    CHECK(worst.error <= 16);
    CHECK(changed > 0.1 * samples);
}

TEST_CASE_TEMPLATE("step is scatter and arrive", T, float, double) {
    generator g(71);
    worst_case worst;
    const auto compare = [&](const auto& weigh, int sample) {
        const auto number = [&] { return g.log_uniform<T>(-3, 3); };
        const mis::subpath_state<T> x{number(), number()};
        const T cos_out = number(), forward = number(), reverse = number(), distance2 = number(),
                cos_in = number(), merge_factor = number(), there = number(), back = number();
        const auto one =
            weigh.step(x, mis::cosine_out{cos_out}, mis::pdf_forward{forward}, mis::pdf_reverse{reverse},
                       mis::squared_distance{distance2}, mis::cosine_in{cos_in}, merge_factor,
                       mis::pdf_distance_forward{there}, mis::pdf_distance_reverse{back});
        const auto two = weigh.arrive(weigh.scatter(x, mis::cosine{cos_out}, mis::pdf_forward{forward},
                                                    mis::pdf_reverse{reverse}, merge_factor),
                                      mis::squared_distance{distance2}, mis::cosine{cos_in},
                                      mis::pdf_distance_forward{there}, mis::pdf_distance_reverse{back});
        CHECK((one.a < 0) == (two.a < 0));
        worst.see(ulp_distance(std::fabs(one.a), std::fabs(two.a)), sample);
        worst.see(ulp_distance(one.b, two.b), sample);
    };
    for (int sample = 0; sample < 10'000; ++sample) {
        auto c = random_counts<T>(g);
        compare(mis::path_weights{mis::balance, c}, sample);
        c.connection = 1;
        c.direct = 0;
        compare(mis::path_weights{mis::balance, c, mis::connected_surfaces{}}, sample);
    }
    CHECK(worst.error <= 8);
}

TEST_CASE_TEMPLATE("maximum: two techniques exactly tied get one half each", T, float, double) {
    // Densities and geometry are powers of 4, so that nothing rounds; each pair of techniques is made to tie
    // by the count of one of them.
    if (!subnormals)
        return; // -ffast-math does not keep ties
    int tied = 0;
    worst_case worst;
    generator g(41);
    for (int sample = 0; sample < 2'000; ++sample) {
        auto path = make_path<T>(g, g.integer(3, 7), ordinary);
        const auto power_of_4 = [&] { return static_cast<T>(std::ldexp(1.0, 2 * g.integer(-3, 3))); };
        for (auto& x : path.vertices) {
            x.pdf_to_light = power_of_4();
            x.pdf_to_camera = power_of_4();
            x.pdf_position = power_of_4();
            x.pdf_next_event = power_of_4();
            x.pdf_distance_from_camera = x.pdf_distance_from_light = 1;
            x.merge_factor = 1;
            x.cos_to_camera = x.cos_to_light = T(0.25);
            x.distance2_to_light = power_of_4();
        }
        auto& c = path.counts;
        c.light_hit = c.next_event = c.connection = c.camera_connection = c.camera_hit = c.merge = 1;
        const auto exact =
            oracle::weights({heuristic_kind::maximum}, oracle::densities(c, oracle::path_of(path.vertices)));
        const auto largest = std::max_element(exact.begin(), exact.end());
        if (!(*largest == wide{0.5}))
            continue;
        ++tied;
        for (int k = 0; k < mis::technique_count(path.size()); ++k) {
            const T w = mis::weight_in_subpaths(mis::maximum, c, path.data(), path.size(),
                                                mis::technique_at(path.size(), k));
            worst.see(ulp_error(w, exact[static_cast<std::size_t>(k)]), sample);
        }
    }
    CHECK(worst.error == 0);
    CHECK(tied > 100);
}

TEST_CASE_TEMPLATE("techniques that are switched off, or that a Dirac vertex forbids, have weight 0", T,
                   float, double) {
    generator g(51);
    int nonzero = 0;
    for (int sample = 0; sample < 2'000; ++sample) {
        auto path = make_path<T>(g, g.integer(2, 12), ordinary);
        unify_ends(path);
        const auto q = oracle::densities(path.counts, oracle::path_of(path.vertices));
        for (int k = 0; k < mis::technique_count(path.size()); ++k)
            if (q[static_cast<std::size_t>(k)].zero())
                nonzero += mis::weight_in_subpaths(mis::power, path.counts, path.data(), path.size(),
                                                   mis::technique_at(path.size(), k)) != 0;
    }
    CHECK(nonzero == 0);
}

TEST_CASE("0 times infinity is 0 wherever a technique is switched off") {
    // The density of hitting the lens overflows float, and no one counts it.
    mis::technique_counts<float> counts;
    counts.camera_connection = 37;
    counts.next_event = 1;
    mis::measured_vertex<float> lens, x, lamp;
    lens.kind = vertex_kind::camera;
    lens.pdf_position = lens.pdf_to_light = 1;
    lens.pdf_next_event = 1e-17f;
    lens.distance2_to_light = 1e-4f;
    x.pdf_to_camera = 1e19f;
    x.pdf_to_light = 1;
    lamp.kind = vertex_kind::light;
    lamp.pdf_position = lamp.pdf_next_event = lamp.pdf_to_camera = 1;
    const mis::measured_vertex<float> path[] = {lens, x, lamp};
    const auto exact =
        oracle::weights({heuristic_kind::balance}, oracle::densities(counts, oracle::path_of(path, 3)));
    CHECK(ulp_error(mis::weight_in_subpaths(mis::balance, counts, path, 3, mis::technique_at(3, 1)),
                    exact[1]) <= 18);
}
