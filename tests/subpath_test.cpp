// SPDX-License-Identifier: MIT
#include "oracle.hpp"
#include "random_paths.hpp"

#include <cstdio>
#include <doctest/doctest.h>
#include <mis/subpath.hpp>

using namespace test;
using mis::technique_kind;
using oracle::heuristic_kind;

static_assert(sizeof(mis::subpath_state<float>) == 8);
static_assert(sizeof(mis::subpath_state<double>) == 16);

namespace {

constexpr int paths = 100'000;

// The recursion in extended range, to know where the scalar's own range ends. A value "fits" if it is 0 or a
// normal number of T with some room above; outside, the states of the library can only saturate.
template <class T> struct exact_recursion {
    oracle::heuristic h;

    static bool fits(const wide& x) {
        return oracle::in_normal_range<T>(x) && x < wide{std::numeric_limits<T>::max() / 32};
    }

    wide raise(const wide& x) const {
        if (h.kind == heuristic_kind::average)
            return x.zero() ? wide{} : wide{1};
        return h.kind == heuristic_kind::power ? oracle::pow(x, h.parameter) : x;
    }
    wide join(const wide& x, const wide& y) const {
        return h.kind == heuristic_kind::maximum ? (x < y ? y : x) : x + y;
    }

    // What a walk from the camera knows at x_i: A_i with its count, B_i, T_i, and whether everything on the
    // way fits.
    struct state {
        wide a, b, total;
        wide edge; // A_i without its count
        bool fits_on_arrival = true, fits = true;
    };

    std::vector<state> camera_walk(const random_path<T>& path) const {
        const auto p = oracle::path_of(path.vertices);
        const auto& x = path.vertices;
        const auto& c = path.counts;
        const std::size_t n = x.size();
        std::vector<state> states(n);
        states[0].total = x[0].dirac ? wide{} : raise(wide{c.camera_hit} / wide{x[0].pdf_position});
        const wide start = wide{1} / wide{x[0].pdf_position};
        states[0].fits = fits(states[0].total) && fits(start) && (x[0].dirac || fits(raise(start))) &&
                         fits(raise(wide{x[0].pdf_next_event} * start));
        for (std::size_t i = 1; i < n; ++i) {
            state& s = states[i];
            const auto& before = x[i - 1];
            const bool joinable = before.kind != vertex_kind::dirac && x[i].kind != vertex_kind::dirac;
            const wide inverse = wide{1} / wide{before.pdf_to_light};
            const wide unit_a = raise(wide{1} / p.from_camera[i]);
            const wide first =
                raise(wide{c.camera_connection} * wide{x[0].pdf_next_event} / wide{x[0].pdf_position});
            s.edge = joinable ? unit_a : wide{};
            s.a = joinable ? (i == 1 ? first : raise(c.connection)) * unit_a : wide{};
            const wide leaving = raise(wide{before.cos_to_light} * inverse) * states[i - 1].total;
            const wide travel = raise(wide{before.pdf_distance_from_light} /
                                      (wide{x[i].cos_to_camera} * wide{x[i].pdf_distance_from_camera}));
            s.b = leaving * travel;
            const wide back = raise(x[i].pdf_to_camera) * s.b;
            const bool dirac = x[i].kind == vertex_kind::dirac;
            s.total = join(join(dirac ? wide{} : raise(wide{c.merge} * wide{x[i].merge_factor}), s.a), back);
            s.fits_on_arrival = states[i - 1].fits && fits(unit_a) && fits(raise(inverse)) && fits(first) &&
                                fits(raise(inverse) * first) && fits(leaving) && fits(travel) && fits(s.a) &&
                                fits(s.b) && fits(raise(wide{before.cos_to_light} * inverse)) &&
                                fits(raise(wide{before.distance2_to_light} /
                                           (wide{x[i].cos_to_camera} * wide{x[i].pdf_distance_from_camera})));
            s.fits = s.fits_on_arrival && fits(raise(wide{c.merge} * wide{x[i].merge_factor})) &&
                     fits(raise(c.connection)) && fits(raise(x[i].pdf_to_camera)) && fits(back) &&
                     fits(s.total);
        }
        return states;
    }

    // For each technique, whether the states it needs and the terms of its weight fit.
    std::vector<bool> fitting(const random_path<T>& path) const {
        const int n = path.size();
        const auto p = oracle::path_of(path.vertices);
        const auto& c = path.counts;
        const auto from_camera = camera_walk(path), from_light = camera_walk(mirrored(path));
        const auto camera = [&](int i) { return from_camera[static_cast<std::size_t>(i)]; };
        const auto light = [&](int i) { return from_light[static_cast<std::size_t>(n - 1 - i)]; };
        const auto to = [&](int i) { return p.from_camera[static_cast<std::size_t>(i)]; };
        const auto back = [&](int i) { return p.from_light[static_cast<std::size_t>(i)]; };
        const auto both = [&](const wide& x, const wide& t) {
            return fits(x) && fits(raise(x)) && fits(raise(x) * t);
        };
        const auto hit = [&](const state& s, const auto& x, const wide& direction, T hits, T joins,
                             bool first_edge) {
            const wide position = raise(x.pdf_position), next = raise(wide{joins} * wide{x.pdf_next_event});
            // on a walk's first edge, A holds the count of its end's technique, which direct's takes the
            // place of
            const wide joined = first_edge ? position * raise(wide{c.direct}) / raise(joins) : next;
            return s.fits_on_arrival && fits(raise(hits)) && fits(next) && fits(joined) &&
                   fits(joined * (first_edge ? s.a : s.edge)) && fits(position) && fits(raise(direction)) &&
                   fits(position * raise(direction)) && fits(position * raise(direction) * s.b);
        };
        const auto& lens = path.vertices.front();
        const auto& lamp = path.vertices.back();
        std::vector<bool> result;
        result.push_back(hit(light(0), lens, lens.pdf_to_light, c.camera_hit,
                             n == 2 ? c.next_event : c.camera_connection, n == 2));
        for (int s = 1; s < n; ++s) {
            const bool ends = camera(s - 1).fits && light(s).fits;
            bool ok = ends && fits(to(s)) && fits(back(s - 1));
            if (n == 2)
                ok = ok && both(wide{c.light_hit} * to(1) / back(1), 1) &&
                     both(wide{c.camera_hit} * back(0) / to(0), 1);
            else if (s == 1)
                ok = fits(to(1)) && both(to(0) * to(1) / p.camera_next_event, light(1).total) &&
                     light(1).fits && fits(back(0)) &&
                     both(wide{c.camera_hit} * back(0) / p.camera_next_event, 1) &&
                     fits(wide{1} / p.camera_next_event) && fits(to(0) / p.camera_next_event) &&
                     fits(raise(c.camera_connection));
            else if (s == n - 1)
                ok = fits(back(n - 2)) &&
                     both(back(n - 1) * back(n - 2) / p.light_next_event, camera(n - 2).total) &&
                     camera(n - 2).fits && fits(to(n - 1)) &&
                     both(wide{c.light_hit} * to(n - 1) / p.light_next_event, 1) &&
                     fits(wide{1} / p.light_next_event) && fits(back(n - 1) / p.light_next_event) &&
                     fits(raise(c.next_event));
            else
                ok = ok && both(back(s - 1), camera(s - 1).total) && both(to(s), light(s).total);
            result.push_back(ok);
        }
        result.push_back(hit(camera(n - 1), lamp, lamp.pdf_to_camera, c.light_hit,
                             n == 2 ? c.camera_connection : c.next_event, n == 2));
        for (int j = 1; j <= n - 2; ++j) {
            const auto& x = path.vertices[static_cast<std::size_t>(j)];
            result.push_back(camera(j).fits && light(j).fits && fits(raise(x.pdf_to_light) * light(j).b) &&
                             fits(raise(x.pdf_to_camera) * camera(j).b));
        }
        return result;
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
                                     oracle::heuristic reference, Make make) {
    recursion_errors e;
    generator g(seed);
    const double beta = reference.kind == heuristic_kind::power ? reference.parameter : 1;
    const exact_recursion<T> recursion{reference};
    for (int sample = 0; sample < count; ++sample) {
        random_path<T> path = make(g);
        unify_ends(path);
        const int n = path.size();
        const auto q = oracle::densities(path.counts, oracle::path_of(path.vertices));
        if (reference.kind == heuristic_kind::maximum && nearly_tied<T>(q))
            continue;
        const auto exact = oracle::weights(reference, q);
        const auto fitting = recursion.fitting(path);
        // all techniques of short paths, half a dozen of long ones
        const int step = std::max(1, mis::technique_count(n) / 6);
        for (int k = g.integer(0, step - 1); k < mis::technique_count(n); k += step) {
            const auto at = static_cast<std::size_t>(k);
            const mis::technique t = mis::technique_at(n, k);
            if (q[at].zero() && mis::count_of(path.counts, t.kind) > 0 &&
                mis::detail::is_possible(path.data(), n, t))
                continue; // possible, but never sampled: no renderer asks for its weight
            const T w = mis::weight_in_subpaths(h, path.counts, path.data(), n, t);
            if (fitting[at] || q[at].zero()) {
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
    check<T>("balance", errors_of_recursion<T>(11, paths, mis::balance, {heuristic_kind::balance}, make), 6);
    check<T>("power 2", errors_of_recursion<T>(12, paths / 10, mis::power, {heuristic_kind::power, 2}, make),
             6);
    check<T>(
        "power 1.5",
        errors_of_recursion<T>(13, paths / 50, mis::power_heuristic{1.5}, {heuristic_kind::power, 1.5}, make),
        6);
    check<T>("average", errors_of_recursion<T>(14, paths / 20, mis::average, {heuristic_kind::average}, make),
             6);
    check<T>("maximum", errors_of_recursion<T>(15, paths / 20, mis::maximum, {heuristic_kind::maximum}, make),
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
struct interface {
    double to_light, to_camera; // discrete probabilities
    double eta_camera_side, eta_light_side;
};

// A path whose Dirac vertices refract or reflect. The records hold their densities in basic etendue.
struct refracting_path {
    random_path<double> path;
    std::vector<interface> interfaces;
};

refracting_path make_refracting_path(generator& g, int n) {
    refracting_path r{make_path<double>(g, n, ordinary), {}};
    for (auto& x : r.path.vertices) {
        interface f {
            g.uniform(0.1, 1), g.uniform(0.1, 1), 1, 1
        };
        if (g.chance(0.7)) {
            f.eta_camera_side = g.uniform(1, 2);
            f.eta_light_side = g.uniform(1, 2);
        }
        if (x.kind == vertex_kind::dirac) {
            x.pdf_to_light = f.to_light * f.eta_light_side * f.eta_light_side * x.cos_to_light;
            x.pdf_to_camera = f.to_camera * f.eta_camera_side * f.eta_camera_side * x.cos_to_camera;
        }
        r.interfaces.push_back(f);
    }
    return r;
}

// A renderer's loops: both walks, state by state, then any technique from the stored states.
template <class Heuristic> struct renderer {
    mis::path_weights<Heuristic, double> weigh;
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
            if (v.kind == vertex_kind::infinite_light && last.pdf_distance_from_light == 1)
                state = weigh.arrive_at_infinity(state);
            else
                state = weigh.arrive(state, mis::squared_distance{last.distance2_to_light},
                                     mis::cosine{v.cos_to_camera},
                                     mis::pdf_distance_forward{v.pdf_distance_from_camera},
                                     mis::pdf_distance_reverse{last.pdf_distance_from_light});
            camera[i] = state;
            const auto& f = r.interfaces[i];
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
            if (last.kind == vertex_kind::infinite_light && v.pdf_distance_from_light == 1)
                state = weigh.arrive_from_infinity(state, mis::cosine{v.cos_to_light});
            else
                state = weigh.arrive(state, mis::squared_distance{v.distance2_to_light},
                                     mis::cosine{v.cos_to_light},
                                     mis::pdf_distance_forward{v.pdf_distance_from_light},
                                     mis::pdf_distance_reverse{last.pdf_distance_from_camera});
            light[i] = state;
            const auto& f = r.interfaces[i];
            if (v.kind == vertex_kind::dirac)
                state = weigh.scatter_dirac(state, mis::cosine{v.cos_to_light}, mis::pdf_forward{f.to_camera},
                                            mis::pdf_reverse{f.to_light}, mis::eta_in{f.eta_light_side},
                                            mis::eta_out{f.eta_camera_side});
            else
                state = weigh.scatter(state, mis::cosine{v.cos_to_camera}, mis::pdf_forward{v.pdf_to_camera},
                                      mis::pdf_reverse{v.pdf_to_light}, v.merge_factor);
        }
    }

    double weight(mis::technique t) const {
        const auto s = static_cast<std::size_t>(t.camera_vertices);
        if (t.kind == technique_kind::light_hit)
            return weigh.light_hit(camera.back(), lamp());
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
            return weigh.direct(lens(), lamp(), d2);
        case technique_kind::next_event:
            return weigh.next_event(camera_end, lamp(), d2, there, back);
        case technique_kind::camera_connection:
            return weigh.camera_connection(lens(), light_end, d2, there, back);
        default:
            return weigh.connection(camera_end, light_end, d2, there, back);
        }
    }
};

template <class Heuristic>
double error_by_hand(const Heuristic& h, oracle::heuristic reference, std::uint64_t seed) {
    generator g(seed);
    worst_case worst;
    for (int sample = 0; sample < 10'000; ++sample) {
        auto r = make_refracting_path(g, g.integer(2, 12));
        unify_ends(r.path);
        const int n = r.path.size();
        const auto q = oracle::densities(r.path.counts, oracle::path_of(r.path.vertices));
        if (reference.kind == heuristic_kind::maximum && nearly_tied<double>(q))
            continue;
        const auto exact = oracle::weights(reference, q);
        const renderer<Heuristic> render(h, r);
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
