// SPDX-License-Identifier: MIT
// What a thread of the CUDA benchmark does, on the host: against three numbers per vertex, carried along by
// hand.
#include "../benchmarks/alternatives.hpp"
#include "../benchmarks/cuda/threads.hpp"
#include "ulp.hpp"

#include <array>
#include <doctest/doctest.h>

using namespace test;

TEST_CASE("a thread carries a walk and weighs its connections as three numbers per vertex do") {
    constexpr int n = threads::walk_length;
    constexpr std::size_t stride = 70;
    std::vector<std::vector<float>> numbers(11, std::vector<float>(n * stride));
    generator g(21);
    for (auto& array : numbers)
        for (float& x : array)
            x = g.log_uniform<float>(-1, 1);
    threads::walks w{};
    const float** const parts[] = {&w.cos_out,       &w.forward,       &w.reverse,        &w.distance2,
                                   &w.cos_in,        &w.light_a,       &w.light_b,        &w.light_cos,
                                   &w.light_forward, &w.light_reverse, &w.light_distance2};
    for (std::size_t i = 0; i < numbers.size(); ++i)
        *parts[i] = numbers[i].data();
    w.stride = stride;

    // With connections alone the schemes agree for any state: T = A + b(back) B, and no merges.
    std::vector<float> weights(n * stride, -1);
    const mis::path_weights weigh{mis::balance, mis::bidirectional(1.f), mis::connected_surfaces{}};
    const threads::path<mis::connected_surfaces> thread{weigh, w, weights.data()};
    const alternatives::three_number_weights<1, double> three{0, 0, 1};
    double worst = 0;
    for (std::size_t k = 0; k < stride; ++k) {
        thread(k);
        const auto at = [&](const float* x, int j) {
            return static_cast<double>(x[static_cast<std::size_t>(j) * stride + k]);
        };
        alternatives::three_numbers<double> x{at(w.cos_out, 0), at(w.cos_in, 0), 0};
        for (int j = 0; j < n; ++j) {
            const double expected =
                three.connection({x, at(w.cos_out, j), at(w.forward, j), at(w.reverse, j)},
                                 {{at(w.light_a, j), at(w.light_b, j), 0},
                                  at(w.light_cos, j),
                                  at(w.light_forward, j),
                                  at(w.light_reverse, j)},
                                 at(w.light_distance2, j));
            const double weight = static_cast<double>(weights[static_cast<std::size_t>(j) * stride + k]);
            worst = std::max(worst, std::fabs(weight / expected - 1));
            x = three.arrive(three.scatter(x, at(w.cos_out, j), at(w.forward, j), at(w.reverse, j)),
                             at(w.distance2, j), at(w.cos_in, j));
        }
    }
    CHECK(worst < 5e-6);
}

TEST_CASE("a thread weighs one sample of an array") {
    const std::vector<float> q = {1, 2, 3, 4, 5, 6, 7, 8}; // of two samples
    std::vector<float> w(8, -1);
    threads::n_techniques<4, mis::balance_heuristic>{q.data(), w.data(), 2}(1);
    CHECK(w == std::vector<float>{-1, 2.f / 20, -1, 4.f / 20, -1, 6.f / 20, -1, 8.f / 20});
    threads::two_techniques{q.data(), q.data() + 4, w.data()}(0);
    CHECK(w[0] == doctest::Approx(1 / 26.));
}
