// Times of one weight beside alternatives written from the literature, in one run: compare the rows, not the
// numbers.
#include "inputs.hpp"
#include <benchmark/benchmark.h>

namespace {

const std::vector<float> densities = inputs::densities(2048);
const std::vector<inputs::edge> edges = inputs::edges(1024);
const auto counts = mis::connection_and_merging(10000.0f, 0.01f);
const mis::path_weights balance{mis::balance, counts};
const mis::path_weights power{mis::power, counts};
const mis::path_weights known{mis::balance, counts, mis::connected_surfaces{}};
const alternatives::three_number_weights<1> three{counts.merge, 1 / counts.merge, counts.camera_connection};

template <class Weight> void two_techniques(benchmark::State& state, Weight weight) {
    for (auto _ : state)
        for (std::size_t i = 0; i < densities.size(); i += 2)
            benchmark::DoNotOptimize(weight(densities[i], densities[i + 1]));
    state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(densities.size() / 2));
}
BENCHMARK_CAPTURE(two_techniques, power_by_hand, alternatives::power<float>);
BENCHMARK_CAPTURE(two_techniques, power, mis::power);
BENCHMARK_CAPTURE(two_techniques, balance, mis::balance);
BENCHMARK_CAPTURE(two_techniques, power_1_5, mis::power_heuristic{1.5});

template <class Heuristic> void many_techniques(benchmark::State& state, Heuristic heuristic) {
    const int count = static_cast<int>(state.range(0));
    std::vector<float> weights(densities.size());
    for (auto _ : state) {
        mis::weights(heuristic, densities.data(), count, weights.data());
        benchmark::DoNotOptimize(weights.data());
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * count);
}
BENCHMARK_CAPTURE(many_techniques, balance, mis::balance)->Arg(4)->Arg(64);
BENCHMARK_CAPTURE(many_techniques, power, mis::power)->Arg(4)->Arg(64);
BENCHMARK_CAPTURE(many_techniques, maximum, mis::maximum)->Arg(4)->Arg(64);

template <class Weights> void vertex_two_numbers(benchmark::State& state, const Weights& weigh) {
    for (auto _ : state)
        for (const inputs::edge& e : edges) {
            const auto x = weigh.arrive({e.forward, e.reverse}, mis::squared_distance{e.distance2},
                                        mis::cosine{e.cos_in});
            benchmark::DoNotOptimize(weigh.scatter(x, mis::cosine{e.cos_out}, mis::pdf_forward{e.forward},
                                                   mis::pdf_reverse{e.reverse}));
        }
    state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(edges.size()));
}
BENCHMARK_CAPTURE(vertex_two_numbers, balance, balance);
BENCHMARK_CAPTURE(vertex_two_numbers, power, power);

void vertex_three_numbers(benchmark::State& state) {
    for (auto _ : state)
        for (const inputs::edge& e : edges) {
            const auto x = three.arrive({e.forward, e.reverse, e.cos_out}, e.distance2, e.cos_in);
            benchmark::DoNotOptimize(three.scatter(x, e.cos_out, e.forward, e.reverse));
        }
    state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(edges.size()));
}
BENCHMARK(vertex_three_numbers);

// Both ends differ, so that the compiler cannot share their work.
template <class Weights> void connection_two_numbers(benchmark::State& state, const Weights& weigh) {
    for (auto _ : state)
        for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
            const inputs::edge &e = edges[i], &f = edges[i + 1];
            benchmark::DoNotOptimize(weigh.connection({{e.reverse, e.forward},
                                                       mis::cosine{e.cos_in},
                                                       mis::pdf_forward{e.forward},
                                                       mis::pdf_reverse{e.reverse}},
                                                      {{f.reverse, f.forward},
                                                       mis::cosine{f.cos_in},
                                                       mis::pdf_forward{f.forward},
                                                       mis::pdf_reverse{f.reverse}},
                                                      mis::squared_distance{e.distance2}));
        }
    state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(edges.size() - 1));
}
BENCHMARK_CAPTURE(connection_two_numbers, balance, balance);
BENCHMARK_CAPTURE(connection_two_numbers, known_balance, known);
BENCHMARK_CAPTURE(connection_two_numbers, power, power);

void connection_three_numbers(benchmark::State& state) {
    for (auto _ : state)
        for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
            const inputs::edge &e = edges[i], &f = edges[i + 1];
            benchmark::DoNotOptimize(three.connection(
                {{e.reverse, e.forward, e.cos_out}, e.cos_in, e.forward, e.reverse},
                {{f.reverse, f.forward, f.cos_out}, f.cos_in, f.forward, f.reverse}, e.distance2));
        }
    state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(edges.size() - 1));
}
BENCHMARK(connection_three_numbers);

// All weights of a complete path at once: the form for tests and studies.
void complete_path(benchmark::State& state) {
    const int n = static_cast<int>(state.range(0));
    const auto path = inputs::path(n);
    std::vector<float> weights(static_cast<std::size_t>(mis::technique_count(n)));
    for (auto _ : state) {
        mis::weights(mis::power, counts, path.data(), n, weights.data());
        benchmark::DoNotOptimize(weights.data());
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * mis::technique_count(n));
}
BENCHMARK(complete_path)->Arg(4)->Arg(8)->Arg(32);

} // namespace

BENCHMARK_MAIN();
