// docs/edge_cases.md, the core's tables.
#include "edge_cases.hpp"
#include <array>
#include <mis/mis.hpp>

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
    check("Heuristics",
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
            {"nothing is written", [] {
                 return for_all([](auto h) {
                     float out = 7;
                     mis::weights(h, &out, 0, &out);
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
