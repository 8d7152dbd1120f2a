// Images whose pixels have random numbers that do not depend on threads.
#pragma once

#include <cstdint>
#include <pcg_random.hpp>
#include <random>
#include <tools/parallel.hpp>

namespace studies {

// Calls f(pixel, rng) for every pixel, rows in parallel. Every row has random numbers of its own.
template <class F> void for_each_pixel(int width, int height, int threads, std::uint64_t seed, F&& f) {
    tools::in_parallel(threads, height, [&](int y) {
        std::seed_seq seeds{std::uint32_t(seed), std::uint32_t(seed >> 32), std::uint32_t(y)};
        pcg32 rng(seeds);
        const auto first = std::size_t(y) * std::size_t(width);
        for (std::size_t i = first; i < first + std::size_t(width); ++i)
            f(i, rng);
    });
}

} // namespace studies
