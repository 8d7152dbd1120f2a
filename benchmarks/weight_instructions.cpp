// Weights of two techniques, of many, and of complete paths, so that valgrind can count their instructions.
// benchmarks/count_weights.sh prints the table.
#include "inputs.hpp"
#include <cstdio>

namespace {

constexpr int repetitions = 1000;
constexpr int n = 8; // vertices of the path

const auto counts = mis::connection_and_merging(10000.0f, 0.01f);

// What is counted, by name.
template <class T> NOT_INLINED T power_by_hand(T a, T b) { return alternatives::power(a, b); }
template <class T> NOT_INLINED T power(T a, T b) { return mis::power(a, b); }
template <class T> NOT_INLINED T balance(T a, T b) { return mis::balance(a, b); }
template <int N, class Heuristic> NOT_INLINED void many(Heuristic h, const float* q, float* w) {
    mis::weights(h, q, N, w);
}
template <class Vertex> NOT_INLINED void complete_path(const Vertex* path, float* w) {
    mis::weights(mis::balance, counts, path, n, w);
}

} // namespace

int main() {
    const std::vector<float> q = inputs::densities(2 * repetitions);
    const std::vector<mis::measured_vertex<float>> measured = inputs::path(n);
    std::vector<mis::area_vertex<float>> areas;
    for (int i = 0; i < n; ++i)
        areas.push_back(mis::area_densities(measured.data(), n, i));
    double sum = 0;
    float w[64];
    static_assert(mis::technique_count(n) <= 64);
    for (std::size_t i = 0; i < repetitions; ++i) {
        const float a = q[2 * i], b = q[2 * i + 1];
        const double c = static_cast<double>(a), d = static_cast<double>(b);
        sum += static_cast<double>(power_by_hand(a, b) + power(a, b) + balance(a, b));
        sum += power_by_hand(c, d) + power(c, d) + balance(c, d);
        const float* const some = &q[i % (q.size() - 64)];
        many<4>(mis::balance, some, w);
        many<64>(mis::balance, some, w);
        many<4>(mis::power, some, w);
        many<64>(mis::power, some, w);
        many<4>(mis::maximum, some, w);
        many<64>(mis::maximum, some, w);
        sum += static_cast<double>(w[n / 2]);
        complete_path(measured.data(), w);
        sum += static_cast<double>(w[n / 2]);
        complete_path(areas.data(), w);
        sum += static_cast<double>(w[n / 2]);
    }
    return std::printf("%g\n", sum) < 0;
}
