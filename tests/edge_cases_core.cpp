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
