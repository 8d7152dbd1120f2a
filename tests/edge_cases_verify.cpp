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
