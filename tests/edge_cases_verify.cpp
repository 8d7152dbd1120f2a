// docs/edge_cases.md, the tables of verification.
#include "edge_cases.hpp"
#include <mis/verify.hpp>

using namespace edge_cases;

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double nan_double = std::numeric_limits<double>::quiet_NaN();
constexpr double tiny = std::numeric_limits<double>::denorm_min();

// A light hit of camera, surface and light against one next event; q is the density of hitting the light.
mis::path_record record_with(double q, double weight) {
    mis::path_record r;
    r.technique = {mis::technique_kind::light_hit, 3};
    r.counts.light_hit = r.counts.next_event = 1;
    for (const auto kind : {mis::vertex_kind::camera, mis::vertex_kind::surface, mis::vertex_kind::light}) {
        mis::recorded_vertex x;
        x.kind = kind;
        x.density_from_camera = x.density_from_light = 1;
        r.vertices.push_back(x);
    }
    r.vertices.back().density_from_camera = q;
    r.weight = weight;
    return r;
}
mis::verdict judged(const mis::path_record& r) {
    mis::diagnosis d;
    return mis::judge(d, r).verdict;
}
cell is_bad(double q) {
    return {"bad_numbers", [q] {
                return judged(record_with(q, 0.5)) == mis::verdict::bad_numbers &&
                       judged(record_with(q, nan_double)) == mis::verdict::bad_numbers;
            }};
}
cell is_named_bad(double q) {
    return {"its place", [q] {
                const mis::record_place bad = mis::first_bad_number(record_with(q, 1));
                return bad.vertex == 2 && std::string(bad.field) == "density_from_camera";
            }};
}
cell has_log(const char* text, double x, double log, double log_of_inverse) {
    return {text, [=] { return mis::log_of(x) == log && mis::log_of_inverse(x) == log_of_inverse; }};
}
mis::area_vertex<double> corner(mis::vertex_kind kind) {
    mis::area_vertex<double> x;
    x.kind = kind;
    x.density_from_camera = x.density_from_light = x.next_event = 1;
    return x;
}
mis::verify::result unity(double w) {
    const double weights[] = {w, 1.0};
    return mis::verify::partition_of_unity(weights, 2);
}
cell unity_fails(double w) {
    return {"fails", [w] { return !unity(w); }};
}
// Camera, surface and light, each with densities of 1: two techniques, of weight 1/2.
mis::verify::result claimed(double w) {
    const mis::area_vertex<double> path[3] = {
        corner(mis::vertex_kind::camera), corner(mis::vertex_kind::surface), corner(mis::vertex_kind::light)};
    mis::technique_counts<double> counts;
    counts.light_hit = counts.next_event = 1;
    return mis::verify::weight(mis::balance, counts, path, 3, {mis::technique_kind::light_hit, 3}, w);
}
cell claim_fails(double w) {
    return {"fails", [w] { return !claimed(w); }};
}
bool invariant(double w) {
    const mis::area_vertex<double> path[3] = {
        corner(mis::vertex_kind::camera), corner(mis::vertex_kind::surface), corner(mis::vertex_kind::light)};
    mis::technique_counts<double> counts;
    counts.light_hit = counts.next_event = 1;
    const auto f = [w](const auto&, const auto*, int, mis::technique) { return w; };
    return bool(mis::verify::count_invariance(f, counts, path, 3));
}
cell never_invariant(double w) {
    return {"fails", [w] { return !invariant(w); }};
}
bool splits(double w, int count = 2) {
    const double densities[] = {1, 1};
    return bool(
        mis::verify::splitting_invariance([w](const double*, int, int) { return w; }, densities, count));
}
cell never_splits(double w) {
    return {"fails", [w] { return !splits(w); }};
}
mis::finding suspects_with(double weight) {
    mis::diagnosis d;
    for (int i = 0; i < 20; ++i)
        mis::judge(d, record_with(1 + i, weight));
    return mis::suspects_of(d);
}

} // namespace

TEST_CASE("Edge cases of records and their diagnosis") {
    check(
        "Records and their diagnosis",
        {{"mis::first_bad_number(record)",
          {"nothing", [] { return !mis::first_bad_number(record_with(0, 1)).field; }},
          is_named_bad(inf),
          is_named_bad(nan_double),
          is_named_bad(-1),
          {"nothing", [] { return !mis::first_bad_number(record_with(tiny, 1)).field; }},
          {"\"vertices\"", [] { return std::string(mis::first_bad_number({}).field) == "vertices"; }}},
         {"mis::log_of(x)",
          has_log("zero", 0, mis::log_density::zero, mis::log_density::infinite),
          has_log("infinite", inf, mis::log_density::infinite, mis::log_density::zero),
          {"zero", [] { return mis::log_density::is_zero(mis::log_of(nan_double)); }},
          {"zero", [] { return mis::log_density::is_zero(mis::log_of(-1)); }},
          {"as any other", [] { return std::abs(mis::log_of(tiny) + 744.44) < 0.01; }},
          {"not given: missing", [] { return mis::log_density::is_missing(mis::log_of(mis::not_given)); }}},
         {"mis::agree(a, b, tolerance)",
          {"with all below 1e-30", [] { return mis::agree(0, 1e-31, 1e-4) && !mis::agree(0, 1e-20, 1e-4); }},
          {"with infinities", [] { return mis::agree(inf, -inf, 1e-4) && !mis::agree(inf, 1, 1e-4); }},
          {"with NaN alone",
           [] {
               return mis::agree(nan_double, nan_double, 1e-4) && !mis::agree(nan_double, inf, 1e-4) &&
                      !mis::agree(nan_double, 0, 1e-4);
           }},
          {"as any other", [] { return mis::agree(-1, -1.00001, 1e-4) && !mis::agree(-1, 1, 1e-4); }},
          {"as 0", [] { return mis::agree(tiny, 0, 1e-4); }},
          none()},
         {"mis::judge(d, record), of a density",
          {"weight 0", [] { return judged(record_with(0, 0)) == mis::verdict::agrees; }},
          is_bad(inf),
          is_bad(nan_double),
          is_bad(-1),
          {"as any other", [] { return judged(record_with(tiny, tiny)) == mis::verdict::agrees; }},
          {"bad_numbers", [] { return judged({}) == mis::verdict::bad_numbers; }}},
         {"mis::judge(d, record), of the weight",
          {"as any other", [] { return judged(record_with(1, 0)) == mis::verdict::disagrees; }},
          {"disagrees", [] { return judged(record_with(1, inf)) == mis::verdict::disagrees; }},
          {"disagrees", [] { return judged(record_with(1, nan_double)) == mis::verdict::disagrees; }},
          {"disagrees", [] { return judged(record_with(1, -0.5)) == mis::verdict::disagrees; }},
          {"as 0", [] { return judged(record_with(0, tiny)) == mis::verdict::agrees; }},
          none()},
         {"mis::suspects_of(d), of weights",
          {"unexplained", [] { return suspects_with(0).suspects.empty(); }},
          {"unexplained", [] { return suspects_with(inf).suspects.empty(); }},
          {"unexplained", [] { return suspects_with(nan_double).suspects.empty(); }},
          {"unexplained", [] { return suspects_with(-1).suspects.empty(); }},
          {"unexplained", [] { return suspects_with(tiny).suspects.empty(); }},
          {"no suspects", [] { return mis::suspects_of({}).suspects.empty(); }}}});
}

TEST_CASE("Edge cases of checks in unit tests") {
    check("Checks in unit tests",
          {{"mis::verify::partition_of_unity(weights, n)",
            {"as any other", [] { return bool(unity(0)); }},
            unity_fails(inf),
            unity_fails(nan_double),
            unity_fails(-1),
            {"as any other", [] { return bool(unity(tiny)); }},
            {"passes", [] { return bool(mis::verify::partition_of_unity([](int) { return 1.0; }, 0)); }}},
           {"mis::verify::weight(heuristic, counts, path, n, t, claimed), of what is claimed",
            {"as any other", [] { return !claimed(0); }},
            claim_fails(inf),
            claim_fails(nan_double),
            claim_fails(-0.5),
            {"as 0", [] { return !claimed(tiny); }},
            none()},
           {"mis::verify::count_invariance(f, counts, path, n), of what f returns",
            {"as any other", [] { return invariant(0); }},
            never_invariant(inf),
            never_invariant(nan_double),
            never_invariant(-1),
            {"as any other", [] { return invariant(tiny); }},
            none()},
           {"mis::verify::splitting_invariance(f, densities, count), of what f returns",
            {"as any other", [] { return splits(0); }},
            never_splits(inf),
            never_splits(nan_double),
            never_splits(-1),
            {"as 0", [] { return splits(tiny); }},
            {"passes", [] { return splits(1, 0); }}}});
}
