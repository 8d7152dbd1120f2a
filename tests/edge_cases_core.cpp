// docs/edge_cases.md, the core's tables.
#include "edge_cases.hpp"
#include <array>
#include <cmath>
#include <mis/batch.hpp>
#include <mis/media.hpp>
#include <mis/mis.hpp>
#include <mis/roulette.hpp>
#include <mis/sequence.hpp>
#include <vector>

using namespace edge_cases;

namespace {

// Weights of three techniques, the first of them with density q.
template <class Heuristic> std::array<float, 3> three(const Heuristic& heuristic, float q) {
    const std::array<float, 3> densities{q, 1, 1};
    std::array<float, 3> w{};
    mis::weights(heuristic, densities, w);
    for (int i = 0; i < 3; ++i)
        if (mis::weight(heuristic, densities, i) != w[std::size_t(i)])
            return {-1, -1, -1};
    return w;
}

// Of two techniques and more samples than are weighed at once, all alike: the first technique's weight, in
// arrays, of each. -1 where they differ.
template <class Heuristic> float in_arrays(const Heuristic& heuristic, float q, float other) {
    constexpr int samples = 100;
    std::vector<float> densities(2 * samples, q), w(2 * samples, -1), of_first(samples, -1);
    std::fill(densities.begin() + samples, densities.end(), other);
    mis::weights_of_arrays(heuristic, densities.data(), 2, samples, samples, w.data());
    mis::weights_of_first(heuristic, densities.data(), densities.data() + samples, samples, of_first.data());
    for (std::size_t k = 0; k < samples; ++k)
        if (w[k] != w[0] || of_first[k] != w[0])
            return -1;
    return w[0];
}

// The same for each heuristic, with as many calls of f.
template <class F> bool for_all(F f) {
    return f(mis::average) && f(mis::balance) && f(mis::power) && f(mis::power_heuristic<float>{1.5f}) &&
           f(mis::cutoff) && f(mis::maximum);
}

} // namespace

TEST_CASE("Edge cases of heuristics") {
    const auto asserted_by_all = [](float q) {
        return cell{"asserted",
                    [q] { return for_all([q](auto h) { return asserts([h, q] { use(three(h, q)); }); }); }};
    };
    const auto pair_asserted_by_all = [](float q) {
        return cell{"asserted", [q] {
                        return for_all([q](auto h) {
                            return asserts([h, q] { use(h(q, 1.f)); }) && asserts([h, q] { use(h(1.f, q)); });
                        });
                    }};
    };
    const auto arrays_asserted_by_all = [](float q) {
        return cell{"asserted", [q] {
                        return for_all([q](auto h) { return asserts([h, q] { use(in_arrays(h, q, 1)); }); });
                    }};
    };
    check(
        "Heuristics",
        {{"mis::power(a, b)",
          {"weight 0", [] { return for_all([](auto h) { return h(0.f, 1.f) == 0 && h(0.f, 0.f) == 0; }); }},
          {"1; two share equally",
           [] {
               return for_all([](auto h) {
                   return h(infinity, 1.f) == 1 && h(1.f, infinity) == 0 && h(infinity, infinity) == 0.5f;
               });
           }},
          pair_asserted_by_all(not_a_number),
          pair_asserted_by_all(-1),
          {"as any other", [] { return for_all([](auto h) { return h(subnormal, subnormal) == 0.5f; }); }},
          none()},
         {"mis::weights(heuristic, densities, n, out)",
          {"weight 0; all 0 where all are",
           [] {
               return for_all([](auto h) {
                   float w[2] = {0, 0};
                   mis::weights(h, {0.f, 0.f}, w);
                   return three(h, 0)[0] == 0 && w[0] == 0 && w[1] == 0;
               });
           }},
          {"1, shared equally; all others 0",
           [] {
               return for_all([](auto h) {
                   float w[3] = {0, 0, 0};
                   mis::weights(h, {infinity, 1.f, infinity}, w);
                   return w[0] == 0.5f && w[1] == 0 && w[2] == 0.5f;
               });
           }},
          asserted_by_all(not_a_number),
          asserted_by_all(-1),
          {"as any other",
           [] {
               return for_all([](auto h) {
                   float w[2] = {0, 0};
                   mis::weights(h, {subnormal, subnormal}, w);
                   return w[0] == 0.5f && w[1] == 0.5f;
               });
           }},
          {"nothing is written",
           [] {
               return for_all([](auto h) {
                   float out = 7;
                   mis::weights(h, &out, 0, &out);
                   return out == 7;
               });
           }}},
         {"mis::weights_of_arrays, mis::weights_of_first",
          {"weight 0; all 0 where all are",
           [] { return for_all([](auto h) { return in_arrays(h, 0, 1) == 0 && in_arrays(h, 0, 0) == 0; }); }},
          {"1, shared equally; all others 0",
           [] {
               return for_all([](auto h) {
                   return in_arrays(h, infinity, 1) == 1 && in_arrays(h, 1, infinity) == 0 &&
                          in_arrays(h, infinity, infinity) == 0.5f;
               });
           }},
          arrays_asserted_by_all(not_a_number),
          arrays_asserted_by_all(-1),
          {"as any other",
           [] { return for_all([](auto h) { return in_arrays(h, subnormal, subnormal) == 0.5f; }); }},
          {"nothing is written", [] {
               return for_all([](auto h) {
                   float out = 7;
                   mis::weights_of_arrays(h, &out, 0, 1, 1, &out);
                   mis::weights_of_arrays(h, &out, 1, 0, 1, &out);
                   mis::weights_of_first(h, &out, &out, 0, &out);
                   return out == 7;
               });
           }}}});
}

namespace {

// Four vertices, one density: that of the camera walk's step to x_1, which techniques 2, 3, 4 and both merges
// need, 5 and 6.
struct four {
    mis::area_vertex<float> path[4];
    mis::technique_counts<float> counts;

    explicit four(float q) {
        for (auto& x : path)
            x.density_from_camera = x.density_from_light = x.next_event = 1;
        path[1].density_from_camera = q;
        counts.light_hit = counts.next_event = counts.connection = 1;
        counts.camera_connection = counts.camera_hit = counts.merge = 1;
    }
};
using seven = std::array<float, 7>;

template <class Heuristic> seven weights_of(const Heuristic& heuristic, const four& x) {
    seven w{};
    mis::weights(heuristic, x.counts, x.path, 4, w.data());
    for (int k = 0; k < 7; ++k)
        if (mis::weight(heuristic, x.counts, x.path, 4, mis::technique_at(4, k)) != w[std::size_t(k)])
            return {-1};
    return w;
}
seven relative(const four& x) {
    seven q{};
    mis::relative_densities(x.counts, x.path, 4, q.data());
    return q;
}
four without_any() {
    four x(0);
    x.counts.camera_hit = x.counts.camera_connection = 0;
    return x;
}
four counted(float count) {
    four x(1);
    x.counts.merge = count;
    return x;
}

mis::area_vertex<float> area_of(float pdf, float cosine, float distance2) {
    mis::measured_vertex<float> path[3];
    path[0].pdf_to_light = pdf;
    path[1].cos_to_camera = cosine;
    path[0].distance2_to_light = distance2;
    return mis::area_densities(path, 3, 1);
}

struct vec {
    float x, y, z;
};
vec operator-(vec a, vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
float dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

mis::measured_vertex<float> measured(float pdf, float distance) {
    mis::path_vertex<vec> path[2];
    path[0].normal = path[1].normal = path[1].position = {0, 0, 1};
    path[0].position = {0, 0, 1 - distance};
    path[0].pdf_to_light = pdf;
    return mis::measure(path, 2, 0);
}

} // namespace

TEST_CASE("Edge cases of complete paths") {
    const auto weights_asserted = [](float q) {
        return cell{"asserted", [q] {
                        return for_all([q](auto h) {
                            return asserts([h, q] { use(weights_of(h, four(q))); }) &&
                                   asserts([h, q] { use(weights_of(h, counted(q))); });
                        });
                    }};
    };
    const auto too_short = [](auto f) {
        return cell{"asserted",
                    [f] { return asserts([f] { f(four(1), 1); }) && asserts([f] { f(four(1), 0); }); }};
    };
    const auto passed_on = [](float q) {
        return cell{"passed on", [q] {
                        const float seen = measured(q, 1).pdf_to_light;
                        return seen == q || (seen != seen && q != q);
                    }};
    };
    check("Complete paths",
          {{"mis::weights(heuristic, counts, path, n, out)",
            {"weight 0 of what needs it; all 0 where all do",
             [] {
                 return for_all([](auto h) {
                     return weights_of(h, four(0)) == seven{0.5f, 0.5f, 0, 0, 0, 0, 0} &&
                            weights_of(h, without_any()) == seven{};
                 });
             }},
            {"1, shared equally by what needs it; all others 0",
             [] {
                 return for_all([](auto h) {
                     return weights_of(h, four(infinity)) == seven{0, 0, 0.2f, 0.2f, 0.2f, 0.2f, 0.2f} &&
                            weights_of(h, counted(infinity)) == seven{0, 0, 0, 0, 0, 0.5f, 0.5f};
                 });
             }},
            weights_asserted(not_a_number),
            weights_asserted(-1),
            {"as any other",
             [] {
                 return weights_of(mis::average, four(subnormal)) ==
                            seven{1 / 7.f, 1 / 7.f, 1 / 7.f, 1 / 7.f, 1 / 7.f, 1 / 7.f, 1 / 7.f} &&
                        weights_of(mis::balance, four(2 * subnormal)) ==
                            seven{0.5f, 0.5f, subnormal, subnormal, subnormal, subnormal, subnormal};
             }},
            too_short([](const four& x, int n) {
                seven w{};
                mis::weights(mis::power, x.counts, x.path, n, w.data());
            })},
           {"mis::relative_densities(counts, path, n, out)",
            {"0 of what needs it; all 0 where all do",
             [] {
                 return relative(four(0)) == seven{1, 1, 0, 0, 0, 0, 0} && relative(without_any()) == seven{};
             }},
            {"1 of what needs it; all others 0",
             [] {
                 return relative(four(infinity)) == seven{0, 0, 1, 1, 1, 1, 1} &&
                        relative(counted(infinity)) == seven{0, 0, 0, 0, 0, 1, 1};
             }},
            asserted([] { return relative(four(not_a_number)); }),
            asserted([] { return relative(four(-1)); }),
            {"as any other; no positive density becomes 0",
             [] {
                 four x(subnormal);
                 const bool exact =
                     relative(x) == seven{1, 1, subnormal, subnormal, subnormal, subnormal, subnormal};
                 x.path[1].density_from_light = 1e20f;
                 return exact && relative(x)[4] == subnormal;
             }},
            too_short([](const four& x, int n) {
                seven q{};
                mis::relative_densities(x.counts, x.path, n, q.data());
            })},
           {"mis::area_densities(path, n, i)",
            {"0; ∞ over a distance of 0",
             [] {
                 return area_of(0, 1, 1).density_from_camera == 0 &&
                        area_of(1, 0, 1).density_from_camera == 0 &&
                        area_of(0, 1, 0).density_from_camera == 0 &&
                        area_of(1, 1, 0).density_from_camera == infinity;
             }},
            {"∞; 0 where another factor is 0",
             [] {
                 return area_of(infinity, 1, 1).density_from_camera == infinity &&
                        area_of(infinity, 0, 1).density_from_camera == 0 &&
                        area_of(infinity, 1, infinity).density_from_camera == 0;
             }},
            asserted([] { return area_of(not_a_number, 1, 1); }),
            asserted([] { return area_of(-1, -1, 1); }),
            {"as any other", [] { return area_of(subnormal, 1, 0.5f).density_from_camera == 2 * subnormal; }},
            none()},
           {"mis::measure(path, n, i)",
            {"cosine 0 over a distance of 0",
             [] { return measured(1, 0).cos_to_light == 0 && measured(1, 0).distance2_to_light == 0; }},
            passed_on(infinity),
            passed_on(not_a_number),
            passed_on(-1),
            passed_on(subnormal),
            none()}});
}

namespace {

constexpr mis::technique_counts<float> all_techniques() {
    auto c = mis::connection_and_merging(100.f, 0.1f);
    c.camera_hit = 1;
    return c;
}
template <class F> bool for_recursive(F f) {
    return f(mis::balance) && f(mis::power) && f(mis::power_heuristic<float>{1.5f}) && f(mis::average) &&
           f(mis::maximum);
}
bool is_weight(float w) { return w >= 0 && w <= 1; }
bool is_finite(mis::subpath_state<float> x) {
    return std::fabs(x.a) < infinity && x.b >= 0 && x.b < infinity;
}

// A call with 1 for each of `Numbers` arguments but one, which is q; f(weigh, arguments) makes it.
template <int Numbers, class F> bool for_each_argument(float q, F f) {
    return for_recursive([&](auto h) {
        const mis::path_weights weigh{h, all_techniques()};
        for (int k = 0; k < Numbers; ++k) {
            std::array<float, Numbers> x;
            x.fill(1);
            x[std::size_t(k)] = q;
            if (!f(weigh, x))
                return false;
        }
        return true;
    });
}

using state = mis::subpath_state<float>;

mis::end_point<float> end_of(const float* x, bool hittable = true) {
    return {mis::pdf_position{x[0]}, mis::pdf_next_event{x[1]}, mis::pdf_direction{x[2]}, mis::cosine{x[3]},
            hittable};
}
mis::subpath_end<float> walk_of(state x, const float* y) {
    return {x, mis::cosine{y[0]}, mis::pdf_forward{y[1]}, mis::pdf_reverse{y[2]}, y[3]};
}
const state started{1, 1}, never_started;
constexpr float ones[4] = {1, 1, 1, 1};

template <class W> state arrive(const W& weigh, state x) {
    return weigh.arrive(x, mis::squared_distance{1.f}, mis::cosine{1.f});
}

// A row: Numbers arguments, the first `Distances` of which are squared distances; f makes the call with a
// state and tells whether its result is right.
template <int Numbers, int Distances, class F>
row recursion_row(const std::string& call, const std::string& fine, F f) {
    const auto holds = [f](float q, int first) {
        return for_each_argument<Numbers>(q, [&](const auto& weigh, std::array<float, Numbers> x) {
            for (int k = 0; k < first; ++k)
                if (!(x[std::size_t(k)] > 0))
                    return true; // said apart
            return f(weigh, x, started);
        });
    };
    const auto asserts_each = [f](float q) {
        return for_each_argument<Numbers>(q, [&](const auto& weigh, std::array<float, Numbers> x) {
            return asserts([&] { use(f(weigh, x, started)); });
        });
    };
    const auto asserts_distance = [f] {
        return Distances == 0 || for_recursive([&](auto h) {
                   const mis::path_weights weigh{h, all_techniques()};
                   std::array<float, Numbers> x;
                   x.fill(1);
                   x[0] = 0;
                   return asserts([&] { use(f(weigh, x, started)); });
               });
    };
    const auto asserts_start = [f] {
        return for_recursive([&](auto h) {
            const mis::path_weights weigh{h, all_techniques()};
            std::array<float, Numbers> x;
            x.fill(1);
            return asserts([&] { use(f(weigh, x, never_started)); });
        });
    };
    return {call,
            {fine + (Distances > 0 ? "; a distance: asserted" : ""),
             [=] { return holds(0, Distances) && asserts_distance(); }},
            {fine, [=] { return holds(infinity, 0); }},
            {"asserted", [=] { return asserts_each(not_a_number); }},
            {"asserted", [=] { return asserts_each(-1); }},
            {fine, [=] { return holds(subnormal, 0); }},
            {"asserted", asserts_start}};
}
row without_empty(row r) {
    r.empty = none();
    return r;
}

} // namespace

TEST_CASE("Edge cases of the recursion") {
    const auto with_count = [](float q) {
        auto c = all_techniques();
        c.next_event = q;
        return c;
    };
    const auto every_weight = [](auto h, const mis::technique_counts<float>& c, auto is) {
        const mis::path_weights weigh{h, c};
        const auto lamp = end_of(ones);
        const auto x = arrive(weigh, weigh.start_camera(lamp)), y = arrive(weigh, weigh.start_light(lamp));
        const mis::squared_distance d{1.f};
        return is(weigh.connection(walk_of(x, ones), walk_of(y, ones), d)) &&
               is(weigh.next_event(walk_of(x, ones), lamp, d)) &&
               is(weigh.camera_connection(lamp, walk_of(y, ones), d)) && is(weigh.light_hit(x, lamp)) &&
               is(weigh.camera_hit(y, lamp)) && is(weigh.direct(lamp, lamp, d)) &&
               is(weigh.merge(x, y, mis::pdf_to_light{1.f}, mis::pdf_to_camera{1.f}));
    };
    const std::string then_arrive = "then arrive: finite";
    check(
        "The recursion",
        {{"mis::path_weights{heuristic, counts}",
          {"technique off; all 0: every weight 0",
           [=] {
               return for_recursive([&](auto h) {
                   const mis::path_weights weigh{h, with_count(0)};
                   return weigh.next_event(walk_of(started, ones), end_of(ones),
                                           mis::squared_distance{1.f}) == 0 &&
                          every_weight(h, mis::technique_counts<float>{}, [](float w) { return w == 0; });
               });
           }},
          {"weights in [0, 1]",
           [=] {
               return for_recursive([&](auto h) { return every_weight(h, with_count(infinity), is_weight); });
           }},
          {"asserted",
           [=] {
               return for_recursive([&](auto h) {
                   return asserts([&] { use(mis::path_weights{h, with_count(not_a_number)}); });
               });
           }},
          {"asserted",
           [=] {
               return for_recursive([&](auto h) {
                   return asserts([&] { use(mis::path_weights{h, with_count(-1)}); });
               });
           }},
          {"as any other",
           [=] {
               return for_recursive(
                   [&](auto h) { return every_weight(h, with_count(subnormal), is_weight); });
           }},
          none()},
         without_empty(recursion_row<4, 0>("weigh.start_camera(end)", then_arrive,
                                           [](const auto& weigh, auto x, state) {
                                               return is_finite(
                                                   arrive(weigh, weigh.start_camera(end_of(x.data()))));
                                           })),
         recursion_row<2, 1>("weigh.arrive(state, distance2, cos_in)", "finite",
                             [](const auto& weigh, auto x, state s) {
                                 return is_finite(
                                     weigh.arrive(s, mis::squared_distance{x[0]}, mis::cosine{x[1]}));
                             }),
         recursion_row<4, 0>("weigh.scatter(state, cos_out, forward, reverse)", then_arrive,
                             [](const auto& weigh, auto x, state s) {
                                 return is_finite(
                                     arrive(weigh, weigh.scatter(s, mis::cosine{x[0]}, mis::pdf_forward{x[1]},
                                                                 mis::pdf_reverse{x[2]}, x[3])));
                             }),
         recursion_row<5, 0>("weigh.scatter_dirac(state, cos_in, forward, reverse)", then_arrive,
                             [](const auto& weigh, auto x, state s) {
                                 return is_finite(arrive(
                                     weigh, weigh.scatter_dirac(s, mis::cosine{x[0]}, mis::pdf_forward{x[1]},
                                                                mis::pdf_reverse{x[2]}, mis::eta_in{x[3]},
                                                                mis::eta_out{x[4]})));
                             }),
         recursion_row<6, 1>("weigh.step(state, cos_out, forward, reverse, distance2, cos_in)", "finite",
                             [](const auto& weigh, auto x, state s) {
                                 return is_finite(weigh.step(
                                     s, mis::cosine_out{x[1]}, mis::pdf_forward{x[2]}, mis::pdf_reverse{x[3]},
                                     mis::squared_distance{x[0]}, mis::cosine_in{x[4]}, x[5]));
                             }),
         recursion_row<9, 1>("weigh.connection(camera_end, light_end, distance2)", "in [0, 1]",
                             [](const auto& weigh, auto x, state s) {
                                 return is_weight(weigh.connection(walk_of(s, &x[1]), walk_of(s, &x[5]),
                                                                   mis::squared_distance{x[0]}));
                             }),
         recursion_row<9, 1>("weigh.next_event(camera_end, light, distance2)", "in [0, 1]",
                             [](const auto& weigh, auto x, state s) {
                                 return is_weight(weigh.next_event(walk_of(s, &x[1]), end_of(&x[5]),
                                                                   mis::squared_distance{x[0]}));
                             }),
         recursion_row<9, 1>("weigh.camera_connection(camera, light_end, distance2)", "in [0, 1]",
                             [](const auto& weigh, auto x, state s) {
                                 return is_weight(weigh.camera_connection(end_of(&x[5]), walk_of(s, &x[1]),
                                                                          mis::squared_distance{x[0]}));
                             }),
         recursion_row<4, 0>("weigh.light_hit(state, light)", "in [0, 1]",
                             [](const auto& weigh, auto x, state s) {
                                 return is_weight(weigh.light_hit(s, end_of(x.data())));
                             }),
         recursion_row<3, 0>("weigh.merge(camera_state, light_state, to_light, to_camera)", "in [0, 1]",
                             [](const auto& weigh, auto x, state s) {
                                 return is_weight(weigh.merge(s, s, mis::pdf_to_light{x[0]},
                                                              mis::pdf_to_camera{x[1]}, x[2]));
                             }),
         without_empty(recursion_row<9, 1>(
             "weigh.direct(camera, light, distance2)", "in [0, 1]", [](const auto& weigh, auto x, state) {
                 return is_weight(weigh.direct(end_of(&x[1]), end_of(&x[5]), mis::squared_distance{x[0]}));
             }))});
    for_recursive([&](auto h) {
        const mis::path_weights weigh{h, all_techniques()};
        CHECK(asserts([&] { use(weigh.light_hit(started, end_of(ones, false))); }));
        return true;
    });
}

TEST_CASE("Edge cases of measures and sources of densities") {
    const auto area = [](float p, float cosine, float distance2) {
        return mis::to_area(mis::per_solid_angle<float>{p}, cosine, distance2).value;
    };
    const auto from = [](float count, float throughput) {
        const float counts[2] = {count, 1}, throughputs[2] = {throughput, 1};
        std::array<float, 2> out{};
        mis::densities_from_throughputs(counts, throughputs, 2, out.data());
        return out;
    };
    using two = std::array<float, 2>;
    const auto biased = [](float q, float r, float a) { return mis::bias_aware_density(q, r, a); };
    const auto asserted_each = [](auto f, float q) {
        return cell{"asserted", [f, q] {
                        return asserts([f, q] { use(f(q, 1.f, 1.f)); }) &&
                               asserts([f, q] { use(f(1.f, q, 1.f)); }) &&
                               asserts([f, q] { use(f(1.f, 1.f, q)); });
                    }};
    };
    const auto asserted_pair = [=](float q) {
        return cell{"asserted",
                    [=] { return asserts([=] { use(from(q, 1)); }) && asserts([=] { use(from(1, q)); }); }};
    };
    const auto sized = [](float size) {
        return mis::for_scene_of_size(mis::bidirectional(1.f), size).connection;
    };
    const auto connected = [](float factor) {
        return mis::times_connections(mis::squared_distance{4.f}, factor).value;
    };
    check(
        "Measures and sources of densities",
        {{"mis::to_area(p, cos, distance2)",
          {"0; ∞ over a distance of 0",
           [=] { return area(0, 1, 1) == 0 && area(1, 0, 1) == 0 && area(1, 1, 0) == infinity; }},
          {"∞", [=] { return area(infinity, 1, 1) == infinity; }},
          {"NaN", [=] { return area(not_a_number, 1, 1) != area(not_a_number, 1, 1); }},
          {"a cosine's sign is ignored", [=] { return area(1, -0.5f, 1) == 0.5f; }},
          {"as any other", [=] { return area(subnormal, 1, 0.5f) == 2 * subnormal; }},
          none()},
         {"mis::shading_normal_factor(…)",
          {"0 above: 0; only below: ∞",
           [] {
               return mis::shading_normal_factor(0.f, 0.f, 0.f, 0.f) == 0 &&
                      mis::shading_normal_factor(1.f, 0.f, 1.f, 1.f) == infinity;
           }},
          {"∞", [] { return mis::shading_normal_factor(infinity, 1.f, 1.f, 1.f) == infinity; }},
          {"0 above: NaN counts as 0",
           [] { return mis::shading_normal_factor(not_a_number, 1.f, 1.f, 1.f) == 0; }},
          {"signs are ignored", [] { return mis::shading_normal_factor(-0.5f, 1.f, -1.f, 1.f) == 0.5f; }},
          {"as any other", [] { return mis::shading_normal_factor(subnormal, subnormal, 1.f, 1.f) == 1; }},
          none()},
         {"mis::densities_from_throughputs(counts, throughputs, n, out)",
          {"a count: 0; a throughput: 1, all others 0",
           [=] {
               return from(0, 1) == two{0, 1} && from(1, 0) == two{1, 0};
           }},
          {"a throughput: 0",
           [=] {
               return from(1, infinity) == two{0, 1};
           }},
          asserted_pair(not_a_number),
          asserted_pair(-1),
          {"as any other",
           [=] {
               return from(1, subnormal)[0] == 1 && from(subnormal, 1) == two{subnormal, 1};
           }},
          {"nothing is written",
           [] {
               float out = 7;
               mis::densities_from_throughputs(&out, &out, 0, &out);
               return out == 7;
           }}},
         {"mis::bias_aware_density(density, relative_bias, measure)",
          {"density 0: 0; bias 0: the density", [=] { return biased(0, 1, 1) == 0 && biased(3, 0, 1) == 3; }},
          {"density: 1 / (A r²); bias or measure: 0",
           [=] {
               return biased(infinity, 2, 4) == 0.0625f && biased(1, infinity, 1) == 0 &&
                      biased(1, 1, infinity) == 0;
           }},
          asserted_each(biased, not_a_number),
          asserted_each(biased, -1),
          {"as any other", [=] { return biased(4 * subnormal, 1, 1) == subnormal; }},
          none()},
         {"mis::for_scene_of_size(counts, size)",
          asserted([=] { return sized(0); }),
          asserted([=] { return sized(infinity); }),
          asserted([=] { return sized(not_a_number); }),
          asserted([=] { return sized(-1); }),
          {"as any other", [=] { return sized(1e-10f) > 1e19f; }},
          none()},
         {"mis::times_connections(distance2, factor)",
          {"0, which is no distance", [=] { return connected(0) == 0; }},
          {"∞", [=] { return connected(infinity) == infinity; }},
          asserted([=] { return connected(not_a_number); }),
          asserted([=] { return connected(-1); }),
          {"as any other", [=] { return connected(subnormal) == 4 * subnormal; }},
          none()}});
}

TEST_CASE("Edge cases of roulette and splitting") {
    constexpr float least = mis::rate_bounds<float>{}.least;
    const auto by_adjoint = [](float weight, float adjoint, float estimate) {
        return mis::adjoint_rate(weight, adjoint, estimate);
    };
    const auto by_efficiency = [](float weight, float moments, float cost, float variance_of_image,
                                  float cost_of_image) {
        return mis::efficiency_rate(weight, {2 * moments, moments, cost}, {variance_of_image, cost_of_image});
    };
    const auto of_technique = [](float weight, float variance, float cost, float variance_of_image,
                                 float cost_of_image) {
        return mis::technique_rate(weight, variance, cost, {variance_of_image, cost_of_image});
    };
    // Whether the rate is this one, whichever argument is x and all others are 1.
    const auto is_three = [=](float x, float rate) {
        return by_adjoint(x, 1, 1) == rate && by_adjoint(1, x, 1) == rate && by_adjoint(1, 1, x) == rate;
    };
    const auto is_five = [](auto f, float x, float rate) {
        return f(x, 1, 1, 1, 1) == rate && f(1, x, 1, 1, 1) == rate && f(1, 1, x, 1, 1) == rate &&
               f(1, 1, 1, x, 1) == rate && f(1, 1, 1, 1, x) == rate;
    };
    const auto are_left_out = [](float x) {
        mis::running_statistics<float> s;
        s.add(x), s.add(1, x), s.add(1, 1, x);
        return s.weight == 0;
    };
    const auto mean_of = [](float x, float weight) {
        mis::trimmed_mean<float> t;
        t.add(1), t.add(x, weight);
        return mis::mean(t, 0.f);
    };
    using two = std::array<float, 2>;
    const auto probabilities = [](two kernel, two adjoint) {
        two out{7, 7};
        mis::zero_variance_probabilities(kernel, adjoint, 2, out.data());
        return out;
    };
    const auto kernel_or_adjoint = [=](float x) {
        return probabilities({x, 1}, {1, 1}) == two{0, 1} &&
               probabilities({1, 3}, {x, 1}) == two{0.25f, 0.75f};
    };
    check("Roulette and splitting",
          {{"mis::adjoint_rate(weight, adjoint, estimate)",
            {"the least rate; an estimate: 1",
             [=] {
                 return by_adjoint(0, 1, 1) == least && by_adjoint(1, 0, 1) == least &&
                        by_adjoint(1, 1, 0) == 1;
             }},
            {"1", [=] { return is_three(infinity, 1); }},
            {"1", [=] { return is_three(not_a_number, 1); }},
            {"as without the sign", [=] { return by_adjoint(-2, 1, 1) == 2 && by_adjoint(2, -1, -1) == 2; }},
            {"as any other", [=] { return by_adjoint(2 * subnormal, 1, subnormal) == 2; }},
            none()},
           {"mis::efficiency_rate(weight, here, image)",
            {"a weight, moments: the least rate; a cost, the image's: 1",
             [=] {
                 return by_efficiency(0, 1, 1, 1, 1) == least && by_efficiency(1, 0, 1, 1, 1) == least &&
                        by_efficiency(1, 1, 0, 1, 1) == 1 && by_efficiency(1, 1, 1, 0, 1) == 1 &&
                        by_efficiency(1, 1, 1, 1, 0) == 1;
             }},
            {"1", [=] { return is_five(by_efficiency, infinity, 1); }},
            {"1", [=] { return is_five(by_efficiency, not_a_number, 1); }},
            {"as without the sign",
             [=] { return is_five(by_efficiency, -1, 1) && by_efficiency(-4, 1, 1, 1, 1) == 4; }},
            {"as any other", [=] { return by_efficiency(4, 1, subnormal, 1, subnormal) == 4; }},
            none()},
           {"mis::technique_rate(weight, variance, cost, image)",
            {"a weight, a variance: the least rate; a cost, the image's: 1",
             [=] {
                 return of_technique(0, 1, 1, 1, 1) == least && of_technique(1, 0, 1, 1, 1) == least &&
                        of_technique(1, 1, 0, 1, 1) == 1 && of_technique(1, 1, 1, 0, 1) == 1 &&
                        of_technique(1, 1, 1, 1, 0) == 1;
             }},
            {"1", [=] { return is_five(of_technique, infinity, 1); }},
            {"1", [=] { return is_five(of_technique, not_a_number, 1); }},
            {"as without the sign",
             [=] { return is_five(of_technique, -1, 1) && of_technique(-4, 1, 1, 1, 1) == 4; }},
            {"as any other", [=] { return of_technique(4, 1, subnormal, 1, subnormal) == 4; }},
            none()},
           {"mis::copies(rate, u)",
            {"0 copies", [] { return mis::copies(0.f, 0.f) == 0; }},
            asserted([] { return mis::copies(infinity, 0.f); }),
            asserted([] { return mis::copies(not_a_number, 0.f); }),
            asserted([] { return mis::copies(-1.f, 0.f); }),
            {"as any other",
             [] { return mis::copies(subnormal, 0.f) == 1 && mis::copies(subnormal, 0.5f) == 0; }},
            none()},
           {"statistics.add(value, cost, weight)",
            {"a weight: left out", [=] { return mean_of(5, 0) == 1; }},
            {"left out", [=] { return are_left_out(infinity); }},
            {"left out", [=] { return are_left_out(not_a_number); }},
            {"a weight: left out",
             [] {
                 mis::running_statistics<float> s;
                 s.add(1, 1, -1);
                 return s.weight == 0;
             }},
            {"as any other",
             [] {
                 mis::running_statistics<float> s;
                 s.add(subnormal);
                 return s.mean == subnormal;
             }},
            {"variance 0",
             [] {
                 return mis::variance(mis::running_statistics<float>{}) == 0 &&
                        mis::mean_cost(mis::running_statistics<float>{}) == 0;
             }}},
           {"trimmed_mean.add(value, weight)",
            {"a weight: left out", [=] { return mean_of(5, 0) == 1 && mean_of(0, 1) == 0.5f; }},
            {"left out", [=] { return mean_of(infinity, 1) == 1 && mean_of(5, infinity) == 1; }},
            {"left out", [=] { return mean_of(not_a_number, 1) == 1 && mean_of(5, not_a_number) == 1; }},
            {"left out", [=] { return mean_of(-5, 1) == 1 && mean_of(5, -1) == 1; }},
            {"as any other", [=] { return mean_of(subnormal, 1) == 0.5f; }},
            {"mean 0", [] { return mis::mean(mis::trimmed_mean<float>{}, 0.f) == 0; }}},
           {"mis::zero_variance_probabilities(kernel, adjoint, n, out)",
            {"0; all adjoints: by the kernel alone",
             [=] {
                 return probabilities({0, 1}, {1, 1}) == two{0, 1} &&
                        probabilities({1, 1}, {0, 1}) == two{0, 1} &&
                        probabilities({1, 3}, {0, 0}) == two{0.25f, 0.75f} &&
                        probabilities({0, 0}, {1, 1}) == two{0, 0};
             }},
            {"a kernel: 0; an adjoint: by the kernel alone", [=] { return kernel_or_adjoint(infinity); }},
            {"a kernel: 0; an adjoint: by the kernel alone", [=] { return kernel_or_adjoint(not_a_number); }},
            {"as without the sign",
             [=] {
                 return probabilities({-1, 3}, {1, -1}) == two{0.25f, 0.75f};
             }},
            {"as any other",
             [=] {
                 return probabilities({subnormal, subnormal}, {1, 3}) == two{0.25f, 0.75f};
             }},
            {"nothing is written",
             [] {
                 float out = 7;
                 mis::zero_variance_probabilities(&out, &out, 0, &out);
                 return out == 7;
             }}},
           {"mis::zero_variance_survival(reflected, emitted)",
            {"0 where nothing is reflected, 1 where nothing at all",
             [] {
                 return mis::zero_variance_survival(0.f, 1.f) == 0 &&
                        mis::zero_variance_survival(0.f, 0.f) == 1;
             }},
            {"1",
             [] {
                 return mis::zero_variance_survival(infinity, 1.f) == 1 &&
                        mis::zero_variance_survival(1.f, infinity) == 1;
             }},
            {"1",
             [] {
                 return mis::zero_variance_survival(not_a_number, 1.f) == 1 &&
                        mis::zero_variance_survival(1.f, not_a_number) == 1;
             }},
            {"1",
             [] {
                 return mis::zero_variance_survival(-1.f, 1.f) == 1 &&
                        mis::zero_variance_survival(1.f, -1.f) == 1;
             }},
            {"as any other", [] { return mis::zero_variance_survival(subnormal, subnormal) == 0.5f; }},
            none()}});
}

TEST_CASE("Edge cases of media") {
    using sizes = mis::family_sizes<float>;
    const auto joined = [](float k) { // by all three, with another family of size 1
        const sizes s{k, 1, 0, 0};
        return std::array<float, 3>{mis::joined(mis::balance, s), mis::joined(mis::power, s),
                                    mis::joined(mis::maximum, s)};
    };
    const auto share = [](float k, float other) {
        return mis::family_share(mis::power, sizes{k, other, 0, 0}, mis::merge_family::point_point);
    };
    const auto distance = [](float extinction, float t) {
        return mis::distance_in_medium(&extinction, 1, t);
    };
    check(
        "Media",
        {{"mis::beam(distance, pass)",
          {"0", [] { return mis::beam(0.f) == 0 && mis::beam(1.f, 0.f) == 0; }},
          {"a distance: 0; a pass: ∞",
           [] { return mis::beam(infinity) == 0 && mis::beam(1.f, infinity) == infinity; }},
          asserted([] { return mis::beam(not_a_number) + mis::beam(1.f, not_a_number); }),
          asserted([] { return mis::beam(-1.f); }),
          {"a distance: ∞", [] { return mis::beam(subnormal) == infinity; }},
          none()},
         {"mis::at_vertex(sizes, beams, sin_angle)",
          {"0, also times ∞",
           [=] {
               const sizes off = mis::at_vertex(sizes{}, {infinity, infinity}, 1);
               const sizes aligned = mis::at_vertex(sizes{1, 1, 1, 1}, {infinity, infinity}, 0);
               return off.point_point == 0 && off.point_beam == 0 && off.beam_point == 0 &&
                      off.beam_beam == 0 && aligned.beam_beam == 0 &&
                      mis::at_vertex(sizes{0, infinity, 0, 0}, {0, 1}, 1).point_beam == 0;
           }},
          {"∞",
           [=] {
               const sizes all = mis::at_vertex(sizes{infinity, infinity, infinity, infinity}, {1, 1}, 1);
               return all.point_point == infinity && all.point_beam == infinity &&
                      all.beam_point == infinity && all.beam_beam == infinity &&
                      mis::at_vertex(sizes{1, 1, 1, 1}, {infinity, 1}, 1).point_beam == infinity;
           }},
          {"unspecified", [] { return true; }},
          {"unspecified", [] { return true; }},
          {"as any other",
           [=] {
               return mis::at_vertex(sizes{0, subnormal, 0, 0}, {1, 1}, 1).point_beam == subnormal;
           }},
          none()},
         {"mis::joined(heuristic, sizes)",
          {"counts for nothing; 0 where all are",
           [=] {
               return joined(0) == std::array<float, 3>{1, 1, 1} && mis::joined(mis::balance, sizes{}) == 0 &&
                      mis::joined(mis::power, sizes{}) == 0 && mis::joined(mis::maximum, sizes{}) == 0;
           }},
          {"∞",
           [=] {
               return joined(infinity) == std::array<float, 3>{infinity, infinity, infinity};
           }},
          asserted([=] { return joined(not_a_number)[1]; }),
          asserted([=] { return joined(-1)[1]; }),
          {"as any other",
           [=] {
               return mis::joined(mis::power, sizes{subnormal, 0, 0, 0}) == subnormal;
           }},
          none()},
         {"mis::family_share(heuristic, sizes, family)",
          {"0, where all are, too", [=] { return share(0, 1) == 0 && share(0, 0) == 0; }},
          {"1, shared equally", [=] { return share(infinity, 1) == 1 && share(infinity, infinity) == 0.5f; }},
          asserted([=] { return share(not_a_number, 1); }),
          asserted([=] { return share(-1, 1); }),
          {"as any other", [=] { return share(subnormal, subnormal) == 0.5f; }},
          none()},
         {"mis::distance_in_medium(extinction, channels, t)",
          {"no extinction: density 0, pass 1",
           [=] { return distance(0, 1).density == 0 && distance(0, 1).pass == 1; }},
          {"of the channel: pass 0", [=] { return distance(infinity, 1).pass == 0; }},
          asserted([=] { return distance(not_a_number, 1).pass; }),
          asserted([=] { return distance(-1, 1).pass; }),
          {"as any other", [=] { return distance(subnormal, 1).density == subnormal; }},
          asserted([=] { return mis::distance_in_medium(&infinity, 0, 1.f).pass; })}});
}

TEST_CASE("Edge cases of sequences") {
    const auto weight_at_start = [](float count) {
        const float counts[] = {count, 1};
        return mis::term_weight(mis::balance, mis::start_sequence(counts), 0);
    };
    const auto drawn = [](float other, float own = 1) { // the weight of the second
        const float counts[] = {1, 1}, densities[] = {other, own};
        return mis::term_weight(mis::balance, mis::next_draw(mis::start_sequence(counts), densities, 1), 1);
    };
    const auto single = [](float count, float source = 1) {
        const float counts[] = {count, 1};
        return mis::single_weight(mis::end_sequence<float, 2>(source), counts, 0);
    };
    check("Sequences",
          {{"mis::start_sequence(counts)",
            {"a method that is off", [=] { return weight_at_start(0) == 0; }},
            {"those share 1 equally", [=] { return weight_at_start(infinity) == 1; }},
            asserted([=] { return weight_at_start(not_a_number); }),
            asserted([=] { return weight_at_start(-1); }),
            {"as any other", [=] { return weight_at_start(subnormal) < 1e-30f; }},
            none()},
           {"mis::next_draw(state, densities, own)",
            {"another's: it is out from there on; its own: asserted",
             [=] { return drawn(0) == 1 && asserts([=] { use(drawn(1, 0)); }); }},
            {"another's: as the largest number",
             [=] { return drawn(infinity) < 1e-30f && drawn(infinity) >= 0; }},
            asserted([=] { return drawn(not_a_number); }),
            asserted([=] { return drawn(-1); }),
            {"as any other", [=] { return drawn(subnormal) == 1 && drawn(1, subnormal) < 1e-30f; }},
            none()},
           {"mis::single_weight(state, counts, own)",
            {"a count: 0; all sums: 0", [=] { return single(0) == 0 && single(1, 0) == 0; }},
            {"those share 1 equally", [=] { return single(infinity) == 1; }},
            asserted([=] { return single(not_a_number); }),
            asserted([=] { return single(-1); }),
            {"as any other", [=] { return single(subnormal) < 1e-30f; }},
            none()}});
}
