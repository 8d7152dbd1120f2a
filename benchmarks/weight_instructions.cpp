// Runs one way of computing weights 1,000 times, so that valgrind can count its instructions:
//     weight_instructions NAME        (no NAME: prints all names)
// benchmarks/count_instructions.sh runs all of them and prints the table.
#include "inputs.hpp"
#include <cstdio>
#include <cstring>

namespace {

constexpr int repetitions = 1000;
constexpr int walk = 4; // vertices of each joined sub-path, in all loops over vertices

const std::vector<float> densities = inputs::densities(2 * repetitions);
const std::vector<mis::measured_vertex<float>> path = inputs::path(2 * walk);
const std::vector<mis::area_vertex<float>> path_densities = [] {
    std::vector<mis::area_vertex<float>> densities_of_path;
    for (int i = 0; i < 2 * walk; ++i)
        densities_of_path.push_back(mis::area_densities(path.data(), 2 * walk, i));
    return densities_of_path;
}();

const auto counts = mis::connection_and_merging(10000.0f, 0.01f);

const std::vector<alternatives::loop_vertex> loop_walk = [] {
    std::vector<alternatives::loop_vertex> w;
    for (const inputs::edge& e : inputs::edges(walk))
        w.push_back({e.forward, e.reverse, false});
    return w;
}();

} // namespace

// One function per alternative: the names that callgrind collects. Each returns a sum, so that nothing is
// removed.
extern "C" {

// What is called, not what calls: inlined, several would be vectorised together.
[[gnu::noinline]] float call_power(float a, float b) { return mis::power(a, b); }
[[gnu::noinline]] float call_power_by_hand(float a, float b) { return alternatives::power(a, b); }

[[gnu::noinline]] float measure_power() {
    float sum = 0;
    for (std::size_t i = 0; i < repetitions; ++i)
        sum += call_power(densities[2 * i], densities[2 * i + 1]);
    return sum;
}
[[gnu::noinline]] float measure_power_by_hand() {
    float sum = 0;
    for (std::size_t i = 0; i < repetitions; ++i)
        sum += call_power_by_hand(densities[2 * i], densities[2 * i + 1]);
    return sum;
}
[[gnu::noinline]] float measure_connection_loop() {
    float sum = 0;
    for (int i = 0; i < repetitions; ++i)
        sum += alternatives::loop_connection(loop_walk.data(), walk, loop_walk.data(), walk);
    return sum;
}
[[gnu::noinline]] float measure_complete_path() {
    float sum = 0, w[mis::technique_count(2 * walk)];
    for (int i = 0; i < repetitions; ++i) {
        mis::weights(mis::balance, counts, path.data(), 2 * walk, w);
        sum += w[walk];
    }
    return sum;
}
[[gnu::noinline]] float measure_complete_path_areas() {
    float sum = 0, w[mis::technique_count(2 * walk)];
    for (int i = 0; i < repetitions; ++i) {
        mis::weights(mis::balance, counts, path_densities.data(), 2 * walk, w);
        sum += w[walk];
    }
    return sum;
}
}

int main(int count, char** arguments) {
    struct {
        const char* name;
        float (*run)();
    } const alternatives_by_name[] = {
        {"power_by_hand", measure_power_by_hand},     {"power", measure_power},
        {"connection_loop", measure_connection_loop}, {"complete_path_areas", measure_complete_path_areas},
        {"complete_path", measure_complete_path},
    };
    for (const auto& alternative : alternatives_by_name) {
        if (count < 2)
            std::puts(alternative.name);
        else if (std::strcmp(arguments[1], alternative.name) == 0)
            return std::printf("%g\n", static_cast<double>(alternative.run())) < 0;
    }
    return count < 2 ? 0 : 2;
}
