// docs/edge_cases.md, the tables of verification.
#include "edge_cases.hpp"
#include <mis/verify.hpp>
#include <random>

using namespace edge_cases;

namespace {

using mis::verify::point;
using mis::verify::result;
using mis::verify::sampler_options;
using vec3 = std::array<double, 3>;
using uniform = std::uniform_real_distribution<double>;

constexpr double tiny = std::numeric_limits<double>::denorm_min();

sampler_options few_samples() {
    sampler_options o;
    o.samples = 20'000;
    o.visible_error = 0.1;
    return o;
}

// The uniform sampler of the square, but that one sample in a hundred is `odd`, or has this density.
result with_sample(std::optional<point> odd, const sampler_options& o = few_samples()) {
    std::mt19937_64 g(1);
    const auto sample = [&] {
        return uniform()(g) < 0.01 ? odd : std::optional(point{uniform()(g), uniform()(g)});
    };
    return mis::verify::square_sampler(
        sample, [](point) { return 1.0; }, o);
}
result with_density(double odd) {
    std::mt19937_64 g(1);
    const auto density = [&](point p) { return p.x < 0.01 ? odd : 1.0; };
    return mis::verify::square_sampler(
        [&] {
            return std::optional(point{uniform()(g), uniform()(g)});
        },
        density, few_samples());
}
result with_direction(std::optional<vec3> odd) {
    std::mt19937_64 g(1);
    const auto sample = [&] {
        const double z = uniform(-1, 1)(g), phi = 2 * mis::verify::detail::pi * uniform()(g);
        const double r = std::sqrt(1 - z * z);
        return uniform()(g) < 1e-4 ? odd : std::optional(vec3{r * std::cos(phi), r * std::sin(phi), z});
    };
    return mis::verify::direction_sampler(
        sample, [](const vec3&) { return 0.25 / mis::verify::detail::pi; }, few_samples());
}
template <class T> result with_option(T sampler_options::*option, T value) {
    sampler_options o = few_samples();
    o.*option = value;
    return with_sample(point{0.5, 0.5}, o);
}
bool real_options_are_undecided(double value) {
    return with_option(&sampler_options::false_alarm, value).undecided &&
           with_option(&sampler_options::visible_error, value).undecided;
}

bool fails(const result& r) { return !r.passed && !r.undecided; }

// Two estimates of 100 samples each, of these two values.
result estimates(double a, double b) {
    mis::verify::running_mean mean;
    for (int k = 0; k < 50; ++k) {
        add(mean, a);
        add(mean, b);
    }
    return mis::verify::estimates_agree({{"a", 2, mean}, {"b", 2, mean}});
}

} // namespace

TEST_CASE("Edge cases of samplers and estimates") {
    check("Samplers and estimates",
          {{"mis::verify::square_sampler(sample, pdf)",
            {"fails, where one sample in 10,000 has density 0", [] { return fails(with_density(0)); }},
            {"fails", [] { return fails(with_density(infinity)); }},
            {"fails", [] { return fails(with_density(not_a_number)); }},
            {"fails", [] { return fails(with_density(-1)); }},
            {"as any other", [] { return fails(with_density(tiny)); }},
            {"all lost: fails; undecided where the density is 0",
             [] {
                 const auto lost = [] { return std::optional<point>(); };
                 return fails(mis::verify::square_sampler(
                            lost, [](point) { return 1.0; }, few_samples())) &&
                        mis::verify::square_sampler(
                            lost, [](point) { return 0.0; }, few_samples())
                            .undecided;
             }}},
           {"sample()` of a square, `(x, y)",
            {"as any other",
             [] {
                 return fails(with_sample(point{0, 0}));
             }},
            {"fails",
             [] {
                 return fails(with_sample(point{infinity, 0.5}));
             }},
            {"fails",
             [] {
                 return fails(with_sample(point{0.5, not_a_number}));
             }},
            {"fails",
             [] {
                 return fails(with_sample(point{-0.1, 0.5}));
             }},
            {"as any other",
             [] {
                 return fails(with_sample(point{tiny, tiny}));
             }},
            {"lost", [] { return fails(with_sample({})); }}},
           {"mis::verify::direction_sampler(sample, pdf)",
            {"fails: not of length 1",
             [] {
                 return fails(with_direction(vec3{0, 0, 0}));
             }},
            {"fails",
             [] {
                 return fails(with_direction(vec3{0, infinity, 0}));
             }},
            {"fails",
             [] {
                 return fails(with_direction(vec3{0, 0, not_a_number}));
             }},
            {"as any other",
             [] {
                 return with_direction(vec3{0, 0, -1}).passed;
             }},
            {"as any other",
             [] {
                 return with_direction(vec3{tiny, -tiny, 1}).passed;
             }},
            {"lost", [] { return with_direction({}).passed; }}},
           {"mis::verify::sampler_options",
            {"undecided; not as refinement or support",
             [] {
                 return real_options_are_undecided(0) &&
                        with_option(&sampler_options::samples, 0).undecided &&
                        with_option(&sampler_options::bins, 0).undecided &&
                        !with_option(&sampler_options::refinement, 0).undecided &&
                        !with_option(&sampler_options::support, 0.0).undecided;
             }},
            {"undecided",
             [] {
                 return real_options_are_undecided(infinity) &&
                        with_option(&sampler_options::support, double(infinity)).undecided &&
                        with_option(&sampler_options::bins, INT_MAX).undecided &&
                        with_option(&sampler_options::refinement, INT_MAX).undecided;
             }},
            {"undecided",
             [] {
                 return real_options_are_undecided(not_a_number) &&
                        with_option(&sampler_options::support, double(not_a_number)).undecided;
             }},
            {"undecided",
             [] {
                 return real_options_are_undecided(-1) &&
                        with_option(&sampler_options::samples, -1).undecided &&
                        with_option(&sampler_options::bins, -1).undecided &&
                        with_option(&sampler_options::refinement, -1).undecided &&
                        with_option(&sampler_options::support, -1.0).undecided;
             }},
            {"undecided; as support fails",
             [] {
                 return with_option(&sampler_options::false_alarm, tiny).undecided &&
                        fails(with_option(&sampler_options::support, tiny));
             }},
            none()},
           {"mis::verify::estimates_agree(estimates)",
            {"never hit; undecided where all are 0", [] { return estimates(0, 0).undecided; }},
            {"fails", [] { return fails(estimates(infinity, 1)); }},
            {"fails", [] { return fails(estimates(not_a_number, 1)); }},
            {"as any other", [] { return estimates(-1, -1.1).passed; }},
            {"as any other", [] { return estimates(tiny, tiny).passed; }},
            {"undecided", [] {
                 return mis::verify::estimates_agree({}).undecided &&
                        mis::verify::estimates_agree({{"a", 2, {}}, {"b", 2, {}}}).undecided;
             }}}});
}

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double nan_double = std::numeric_limits<double>::quiet_NaN();

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
    return {"fails", [w] { return fails(unity(w)); }};
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
    return {"fails", [w] { return fails(claimed(w)); }};
}
mis::verify::result invariance(double w) {
    const mis::area_vertex<double> path[3] = {
        corner(mis::vertex_kind::camera), corner(mis::vertex_kind::surface), corner(mis::vertex_kind::light)};
    mis::technique_counts<double> counts;
    counts.light_hit = counts.next_event = 1;
    const auto f = [w](const auto&, const auto*, int, mis::technique) { return w; };
    return mis::verify::count_invariance(f, counts, path, 3);
}
cell never_invariant(double w) {
    return {"fails", [w] { return fails(invariance(w)); }};
}
mis::verify::result splitting(double w, int count = 2) {
    const double densities[] = {1, 1};
    return mis::verify::splitting_invariance([w](const double*, int, int) { return w; }, densities, count);
}
cell never_splits(double w) {
    return {"fails", [w] { return fails(splitting(w)); }};
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
            {"undecided",
             [] { return mis::verify::partition_of_unity([](int) { return 1.0; }, 0).undecided; }}},
           {"mis::verify::weight(heuristic, counts, path, n, t, claimed), of what is claimed",
            {"as any other", [] { return !claimed(0); }},
            claim_fails(inf),
            claim_fails(nan_double),
            claim_fails(-0.5),
            {"as 0", [] { return !claimed(tiny); }},
            none()},
           {"mis::verify::count_invariance(f, counts, path, n), of what f returns",
            {"undecided", [] { return invariance(0).undecided; }},
            never_invariant(inf),
            never_invariant(nan_double),
            never_invariant(-1),
            {"as any other", [] { return bool(invariance(tiny)); }},
            none()},
           {"mis::verify::splitting_invariance(f, densities, count), of what f returns",
            {"undecided", [] { return splitting(0).undecided; }},
            never_splits(inf),
            never_splits(nan_double),
            never_splits(-1),
            {"as any other", [] { return bool(splitting(tiny)); }},
            {"undecided", [] { return splitting(1, 0).undecided; }}}});
}
