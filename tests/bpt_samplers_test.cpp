// SPDX-License-Identifier: MIT
// The reference renderer's samplers follow their densities, by the library's own checks. A right sampler
// fails with probability 1e-6; seeds are fixed. What the density gives to directions in which nothing is
// scattered is sampled too: such walks end one step later.
#include <bpt/vertex.hpp>
#include <doctest/doctest.h>
#include <mis/verify.hpp>

namespace {

using vec = bpt::vec3<double>;

bpt::surface_point<double> point_with(const vec& normal, const vec& shading_normal) {
    bpt::surface_point<double> x;
    x.position = vec(0);
    x.normal = normalize(normal);
    x.shading_normal = normalize(shading_normal);
    return x;
}

mis::verify::result check(const bpt::material<double>& m, const bpt::surface_point<double>& x,
                          const vec& from) {
    pcg32 rng(3);
    mis::verify::sampler_options options;
    options.samples = 500'000;
    options.visible_error = 0.03;
    return mis::verify::direction_sampler(
        [&]() -> std::optional<vec> {
            if (bpt::uniform<double>(rng) >= m.survival)
                return std::nullopt;
            return bpt::sample(m, x, from, rng);
        },
        [&](const vec& to) { return bpt::density(m, x, from, to); }, options);
}

} // namespace

TEST_CASE("materials, roulette included, from above and below, with and without a shading normal") {
    std::vector<bpt::material<double>> materials(4);
    materials[0].diffuse = vec(0.7);
    materials[0].survival = 0.7;
    for (std::size_t k = 1; k < 4; ++k) {
        materials[k].kind = bpt::material_kind::glossy;
        materials[k].specular = vec(0.4);
        materials[k].diffuse = vec(k == 3 ? 0.0 : 0.2);
        materials[k].exponent = k == 1 ? 15.0 : k == 2 ? 40.0 : 0.0;
        materials[k].survival = k == 3 ? 0.25 : 0.9;
    }
    for (const auto& m : materials)
        for (const vec& from :
             {normalize(vec(0.3, 0.1, 1)), normalize(vec(1, 0, 0.2)), normalize(vec(0.2, 0.5, -1))})
            for (const vec& shading : {vec(0, 0, 1), vec(0.2, -0.1, 1)}) {
                CAPTURE(m.exponent);
                CAPTURE(from.z);
                const auto r = check(m, point_with({0, 0, 1}, shading), from);
                CHECK_MESSAGE(r, r.message);
            }
}

TEST_CASE("a sampler that forgets its survival is caught") {
    bpt::material<double> m;
    m.diffuse = vec(0.7);
    m.survival = 0.7;
    bpt::material<double> wrong = m;
    wrong.survival = 1;
    const auto x = point_with({0, 0, 1}, {0, 0, 1});
    const vec from(0, 0, 1);
    pcg32 rng(3);
    const auto r = mis::verify::direction_sampler(
        [&]() -> std::optional<vec> {
            if (bpt::uniform<double>(rng) >= m.survival)
                return std::nullopt;
            return bpt::sample(m, x, from, rng);
        },
        [&](const vec& to) { return bpt::density(wrong, x, from, to); });
    CHECK_FALSE(r);
}

TEST_CASE("environments, as light walks and as next events pick their directions") {
    for (const char* name : {"environment", "lens", "mixed"}) {
        const auto scene = bpt::make_scene<double>(name);
        const auto& light = scene.lights[static_cast<std::size_t>(scene.environment)];
        for (const double share : {light.lobe_share_emission, light.lobe_share_next_event}) {
            pcg32 rng(4);
            mis::verify::sampler_options options;
            options.support = 4 * bpt::pi<double>;
            const auto r = mis::verify::direction_sampler(
                [&] {
                    return std::optional<vec>(
                        bpt::sample_light_point(scene, scene.environment, share, rng).point.normal);
                },
                [&](const vec& towards) { return bpt::sky_density(light, share, towards); }, options);
            CAPTURE(name);
            CHECK_MESSAGE(r, r.message);
        }
    }
}

TEST_CASE("directions in which lights emit") {
    for (const char* name : {"cornell", "point"}) {
        const auto scene = bpt::make_scene<double>(name);
        pcg32 rng(5);
        const auto x = bpt::sample_light_point(scene, 0, 0.0, rng);
        const auto r = mis::verify::direction_sampler(
            [&] { return std::optional<vec>(bpt::sample_emission(scene, x, rng).direction); },
            [&](const vec& leaving) { return bpt::light_end_point(scene, x, leaving).direction.value; });
        CAPTURE(name);
        CHECK_MESSAGE(r, r.message);
    }
}
