// Many weights at once, for this machine: loops over arrays, which compilers vectorise, packets of eight, and
// batches beyond the caches. Prints times beside those of what they are compared with, taken in turns, and
// fails where a ratio misses its bar, or where two ways to a weight disagree.
#include "inputs.hpp"
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <experimental/simd>
#include <mis/batch.hpp>
#include <mis/packet.hpp>
#include <string>
#include <type_traits>

namespace {

namespace stdx = std::experimental;
using packet = stdx::simd<float, stdx::simd_abi::deduce_t<float, 8>>;
constexpr int lanes = 8;
constexpr std::size_t count = 1024; // arrays of as many: in the first cache
constexpr int rounds = 400;

using array = std::vector<float>;

// Longer than `count`, by what a walk reads ahead.
array random(pcg32& rng) {
    array x(count + 9 * lanes);
    for (float& number : x)
        number = inputs::positive(rng);
    return x;
}

// Keeps a weight in a register of its own, and so the loop around it from being vectorised.
void alone(float& x) { asm volatile("" : "+x"(x)); }
void written(const void* memory) { asm volatile("" : : "r"(memory) : "memory"); }

// The shortest of many times, in nanoseconds: what else runs on the machine only adds.
struct stopwatch {
    double least = 1e30;

    template <class F> void time(F&& f) {
        const auto start = std::chrono::steady_clock::now();
        f();
        const auto end = std::chrono::steady_clock::now();
        least = std::min(least, std::chrono::duration<double, std::nano>(end - start).count());
    }
};

bool missed = false, failed = false;

// What time(one) / time(other) is allowed to be: at least, at most, or anything.
struct bar {
    double at_least = 0, at_most = 0;
};

std::string text(bar allowed) {
    char limit[32] = "";
    if (allowed.at_least > 0)
        std::snprintf(limit, sizeof limit, ", at least %.1f", allowed.at_least);
    if (allowed.at_most > 0)
        std::snprintf(limit, sizeof limit, ", at most %.1f", allowed.at_most);
    return limit;
}

// `one` and `other` fill an array of weights; `same`: with the same ones.
template <class One, class Other>
[[gnu::noinline]] void compare(const char* what, const char* one_name, const char* other_name, bool same,
                               bar allowed, One&& one, Other&& other) {
    array of_one(count), of_other(count);
    stopwatch time_of_one, time_of_other;
    for (int k = 0; k < rounds; ++k) {
        time_of_one.time([&] { one(of_one.data()), written(of_one.data()); });
        time_of_other.time([&] { other(of_other.data()), written(of_other.data()); });
    }
    double apart = 0;
    for (std::size_t i = 0; i < count; ++i)
        apart =
            std::max(apart, std::fabs(static_cast<double>(of_one[i]) / static_cast<double>(of_other[i]) - 1));
    const double ratio = time_of_one.least / time_of_other.least, calls = count;
    const bool is_fast = ratio >= allowed.at_least && (!(allowed.at_most > 0) || ratio <= allowed.at_most);
    const bool is_right = !same || apart <= 1e-5;
    missed = missed || !is_fast;
    failed = failed || !is_right;
    std::printf("| %s | %s | %.2f | %s | %.2f | %.2f%s%s%s |\n", what, one_name, time_of_one.least / calls,
                other_name, time_of_other.least / calls, ratio, text(allowed).c_str(),
                is_fast ? "" : " MISSED", is_right ? "" : " FAILED: the weights differ");
}

// The bytes per second of `weigh`, which moves `bytes` of them, over those of a copy of as many numbers as
// all of the arrays hold.
template <class Weigh>
[[gnu::noinline]] void compare_with_copy(const char* what, const array& from, array& to, std::size_t bytes,
                                         Weigh&& weigh) {
    stopwatch time_of_weights, time_of_copy;
    for (int k = 0; k < 15; ++k) {
        time_of_weights.time([&] { weigh(), written(to.data()); });
        time_of_copy.time(
            [&] { std::memcpy(to.data(), from.data(), from.size() * sizeof(float)), written(to.data()); });
    }
    const double speed = static_cast<double>(bytes) / time_of_weights.least;
    const double of_copy = 2 * static_cast<double>(from.size() * sizeof(float)) / time_of_copy.least;
    const bar allowed{0.8, 0};
    const bool is_fast = speed / of_copy >= allowed.at_least;
    missed = missed || !is_fast;
    std::printf("| %s | %.1f | %.1f | %.2f%s%s |\n", what, speed, of_copy, speed / of_copy,
                text(allowed).c_str(), is_fast ? "" : " MISSED");
}

// The numbers of connections, or of the edges of walks, as arrays.
struct ends {
    array a, b, third, cos, forward, reverse;

    explicit ends(pcg32& rng)
        : a(random(rng)), b(random(rng)), third(random(rng)), cos(random(rng)), forward(random(rng)),
          reverse(random(rng)) {}
};

// Either one number of an array, or eight.
float load(const array& x, std::size_t i, float) { return x[i]; }
packet load(const array& x, std::size_t i, packet) { return packet(&x[i], stdx::element_aligned); }

template <class T> mis::subpath_end<T> end_at(const ends& e, std::size_t i) {
    return {{load(e.a, i, T()), load(e.b, i, T())},
            mis::cosine<T>(load(e.cos, i, T())),
            mis::pdf_forward<T>(load(e.forward, i, T())),
            mis::pdf_reverse<T>(load(e.reverse, i, T()))};
}
alternatives::three_number_weights<1>::end three_at(const ends& e, std::size_t i) {
    return {{e.third[i], e.a[i], e.b[i]}, e.cos[i], e.forward[i], e.reverse[i]};
}

template <class Weights, class T = decltype(Weights::counts.merge)>
T connection(const Weights& weigh, const ends& camera, const ends& light, const array& distance2,
             std::size_t i) {
    return weigh.connection(end_at<T>(camera, i), end_at<T>(light, i),
                            mis::squared_distance<T>(load(distance2, i, T())));
}

template <class Weights>
[[gnu::noinline]] void connect_arrays(const Weights& weigh, const ends& camera, const ends& light,
                                      const array& distance2, float* __restrict w) {
    for (std::size_t i = 0; i < count; ++i)
        w[i] = connection(weigh, camera, light, distance2, i);
}

// A walk of eight vertices behind its end point, and the weight of its last vertex's connection.
template <class Weights, class T = decltype(Weights::counts.merge)>
T walk(const Weights& weigh, const ends& edges, const ends& light, const array& distance2, std::size_t i) {
    const auto at = [&](const array& x, std::size_t k) { return load(x, i + lanes * k, T()); };
    mis::subpath_state<T> x{at(edges.a, 0), at(edges.b, 0)};
    for (std::size_t k = 0; k < 8; ++k)
        x = weigh.step(x, mis::cosine_out<T>(at(edges.cos, k)), mis::pdf_forward<T>(at(edges.forward, k)),
                       mis::pdf_reverse<T>(at(edges.reverse, k)), mis::squared_distance<T>(at(distance2, k)),
                       mis::cosine_in<T>(at(edges.third, k)));
    const mis::subpath_end<T> end{x, mis::cosine<T>(at(edges.cos, 8)),
                                  mis::pdf_forward<T>(at(edges.forward, 8)),
                                  mis::pdf_reverse<T>(at(edges.reverse, 8))};
    return weigh.connection(end, end_at<T>(light, i), mis::squared_distance<T>(at(distance2, 8)));
}

// All of an array's weights, one after the other or eight at a time.
template <class T, class Weight> [[gnu::noinline]] void fill(float* w, const Weight& weight) {
    if constexpr (std::is_same_v<T, float>) {
        for (std::size_t i = 0; i < count; ++i)
            alone(w[i] = weight(i));
    } else {
        for (std::size_t i = 0; i < count; i += lanes)
            weight(i).copy_to(w + i, stdx::element_aligned);
    }
}

} // namespace

int main() {
    pcg32 rng(5);
    const ends camera(rng), light(rng);
    const array p = random(rng), q = random(rng), distance2 = random(rng);
    const mis::technique_counts<float> counts = mis::bidirectional(1e4f);
    const mis::path_weights any{mis::balance, counts};
    const mis::path_weights known{mis::balance, counts, mis::connected_surfaces{}};
    const mis::path_weights eight{mis::balance, mis::bidirectional(packet(1e4f)), mis::connected_surfaces{}};
    const alternatives::three_number_weights<1> three{0, 0, counts.camera_connection};

    std::printf(
        "| what | | nanoseconds | beside | nanoseconds | ratio |\n| --- | --- | --- | --- | --- | --- |\n");
    const auto by_hand = [&](float* __restrict w) {
        for (std::size_t i = 0; i < count; ++i)
            w[i] = alternatives::power(p[i], q[i]);
    };
    compare(
        "two techniques", "mis::power, arrays", "by hand, overflows", true, {},
        [&](float* __restrict w) {
            for (std::size_t i = 0; i < count; ++i)
                w[i] = mis::power(p[i], q[i]);
        },
        by_hand);
    compare(
        "two techniques", "mis::power, packets", "by hand, overflows", true, {},
        [&](float* __restrict w) {
            fill<packet>(
                w, [&](std::size_t i) { return mis::power(load(p, i, packet()), load(q, i, packet())); });
        },
        by_hand);
    const auto connections = [&](const auto& weigh) {
        return [&](float* w) { connect_arrays(weigh, camera, light, distance2, w); };
    };
    const auto three_numbers = [&](float* __restrict w) {
        for (std::size_t i = 0; i < count; ++i)
            w[i] = three.connection(three_at(camera, i), three_at(light, i), distance2[i]);
    };
    compare("connection", "any techniques, arrays", "three numbers, arrays", false, {}, connections(any),
            three_numbers);
    compare("connection", "surfaces, arrays", "three numbers, arrays", false, {0, 1.1}, connections(known),
            three_numbers);
    // weight(path_weights, place in the arrays), as a number or as eight
    const auto one_by_one_and_eight = [&](const char* what, double at_least, const auto& weight) {
        compare(
            what, "surfaces, one by one", "surfaces, packets", true, {at_least, 0},
            [&](float* w) { fill<float>(w, [&](std::size_t i) { return weight(known, i); }); },
            [&](float* w) { fill<packet>(w, [&](std::size_t i) { return weight(eight, i); }); });
    };
    one_by_one_and_eight("connection", 3.3, [&](const auto& weigh, std::size_t i) {
        return connection(weigh, camera, light, distance2, i);
    });
    one_by_one_and_eight("walk of 8, and connection", 5, [&](const auto& weigh, std::size_t i) {
        return walk(weigh, camera, light, distance2, i);
    });

    // Of 64 MiB each way: in no cache.
    constexpr std::size_t many = std::size_t(1) << 22;
    array from(4 * many), to(4 * many);
    for (std::size_t i = 0; i < from.size(); ++i)
        from[i] = p[i % count];
    std::printf("\n| batches beyond the caches | GB/s | a copy's | ratio |\n| --- | --- | --- | --- |\n");
    compare_with_copy("mis::weights_of_first, two techniques", from, to, 3 * many * sizeof(float), [&] {
        mis::weights_of_first(mis::power, from.data(), from.data() + many, many, to.data());
    });
    compare_with_copy("mis::weights_of_arrays, 4 techniques, power", from, to, 8 * many * sizeof(float),
                      [&] { mis::weights_of_arrays(mis::power, from.data(), 4, many, many, to.data()); });
    compare_with_copy("mis::weights_of_arrays, 4 techniques, balance", from, to, 8 * many * sizeof(float),
                      [&] { mis::weights_of_arrays(mis::balance, from.data(), 4, many, many, to.data()); });
    // Times are the machine's: where that is not one of ours, they may be reported alone.
    return failed || (missed && !std::getenv("MIS_TIMES_ARE_REPORTED")) ? 1 : 0;
}
