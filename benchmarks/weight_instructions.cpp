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
const std::vector<inputs::edge> edges = inputs::edges(repetitions);
const std::vector<mis::measured_vertex<float>> path = inputs::path(2 * walk);
const std::vector<mis::area_vertex<float>> path_densities = [] {
    std::vector<mis::area_vertex<float>> densities_of_path;
    for (int i = 0; i < 2 * walk; ++i)
        densities_of_path.push_back(mis::area_densities(path.data(), 2 * walk, i));
    return densities_of_path;
}();

const auto counts = mis::connection_and_merging(10000.0f, 0.01f);
const mis::path_weights balance{mis::balance, counts};
const mis::path_weights power{mis::power, counts};
const alternatives::three_number_weights three{counts.merge, 1 / counts.merge};

const std::vector<alternatives::loop_vertex> loop_walk = [] {
    std::vector<alternatives::loop_vertex> w;
    for (const inputs::edge& e : inputs::edges(walk))
        w.push_back({e.forward, e.reverse, false});
    return w;
}();

template <class Weights>
mis::subpath_state<float> update(const Weights& weigh, const inputs::edge& e, mis::subpath_state<float> x) {
    x = weigh.arrive(x, mis::squared_distance{e.distance2}, mis::cosine{e.cos_in});
    return weigh.scatter(x, mis::cosine{e.cos_out}, mis::pdf_forward{e.forward}, mis::pdf_reverse{e.reverse});
}
template <class Weights> float connect(const Weights& weigh, const inputs::edge& e) {
    const mis::subpath_state<float> x{e.reverse, e.forward};
    return weigh.connection(
        {x, mis::cosine{e.cos_in}, mis::pdf_forward{e.forward}, mis::pdf_reverse{e.reverse}},
        {x, mis::cosine{e.cos_out}, mis::pdf_forward{e.reverse}, mis::pdf_reverse{e.forward}},
        mis::squared_distance{e.distance2});
}

} // namespace

// One function per alternative: the names that callgrind collects. Each returns a sum, so that nothing is
// removed.
extern "C" {

[[gnu::noinline]] float measure_power() {
    float sum = 0;
    for (std::size_t i = 0; i < repetitions; ++i)
        sum += mis::power(densities[2 * i], densities[2 * i + 1]);
    return sum;
}
[[gnu::noinline]] float measure_power_by_hand() {
    float sum = 0;
    for (std::size_t i = 0; i < repetitions; ++i)
        sum += alternatives::power(densities[2 * i], densities[2 * i + 1]);
    return sum;
}
[[gnu::noinline]] float measure_update_balance() {
    mis::subpath_state<float> x{1, 1};
    for (const inputs::edge& e : edges)
        x = update(balance, e, x);
    return x.a + x.b;
}
[[gnu::noinline]] float measure_update_power() {
    mis::subpath_state<float> x{1, 1};
    for (const inputs::edge& e : edges)
        x = update(power, e, x);
    return x.a + x.b;
}
[[gnu::noinline]] float measure_update_three_numbers() {
    alternatives::three_numbers x{1, 1, 1};
    for (const inputs::edge& e : edges)
        x = three.scatter(three.arrive(x, e.distance2, e.cos_in), e.cos_out, e.forward, e.reverse);
    return x.vcm + x.vc + x.vm;
}
[[gnu::noinline]] float measure_connection_balance() {
    float sum = 0;
    for (const inputs::edge& e : edges)
        sum += connect(balance, e);
    return sum;
}
[[gnu::noinline]] float measure_connection_power() {
    float sum = 0;
    for (const inputs::edge& e : edges)
        sum += connect(power, e);
    return sum;
}
[[gnu::noinline]] float measure_connection_three_numbers() {
    float sum = 0;
    for (const inputs::edge& e : edges) {
        const alternatives::three_numbers x{e.reverse, e.forward, e.cos_in};
        const float inverse = 1 / e.distance2;
        sum += three.connection(x, x, e.reverse * e.cos_in * inverse, e.forward * e.cos_out * inverse,
                                e.reverse, e.forward);
    }
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
        {"power_by_hand", measure_power_by_hand},
        {"power", measure_power},
        {"update_three_numbers", measure_update_three_numbers},
        {"update_balance", measure_update_balance},
        {"update_power", measure_update_power},
        {"connection_three_numbers", measure_connection_three_numbers},
        {"connection_balance", measure_connection_balance},
        {"connection_power", measure_connection_power},
        {"connection_loop", measure_connection_loop},
        {"complete_path_areas", measure_complete_path_areas},
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
