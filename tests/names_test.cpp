// SPDX-License-Identifier: MIT
// Names that are not mis': windows.h defines min and max (and near and far and more) as macros; a renderer
// has functions of its own for its vectors, called what the headers' own helpers are called; and some write
// `using namespace` for all.
#include <doctest/doctest.h>

// The standard library first, whose own headers may not see the macros.
#include <algorithm>
#include <array>
#include <cassert>
#include <cfloat>
#include <climits>
#include <clocale>
#include <cmath>
#include <complex>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <exception>
#include <fstream>
#include <functional>
#include <future>
#include <initializer_list>
#include <iomanip>
#include <iostream>
#include <istream>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <numeric>
#include <optional>
#include <ostream>
#include <random>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <tuple>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include <Eigen/Dense>

#define min(a, b) (((a) < (b)) ? (a) : (b))
#define max(a, b) (((a) > (b)) ? (a) : (b))
#define near
#define far
#define small char
#define interface struct
#define IN
#define OUT
#define ERROR 0

#include <mis/batch.hpp>
#include <mis/media.hpp>
#include <mis/mis.hpp>
#include <mis/optimal.hpp>
#include <mis/roulette.hpp>
#include <mis/sequence.hpp>
#include <mis/verify.hpp>

#undef min
#undef max
#undef near
#undef far
#undef small
#undef interface
#undef ERROR

namespace renderer {

struct vec {
    double x, y, z;
};
constexpr vec operator-(vec a, vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr double dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// Better matches than the headers' own for all that takes vectors; whoever picks one up does not compile.
void inner(vec, vec) = delete;
void absolute(vec) = delete;
template <class... T> void measure(const T&...) = delete;
template <class... T> void edge_squared(const T&...) = delete;
template <class... T> void cosine_towards(const T&...) = delete;
template <class... T> void density_from_camera(const T&...) = delete;
template <class... T> void density_from_light(const T&...) = delete;
template <class... T> void next_event_density(const T&...) = delete;
template <class... T> void is_possible(const T&...) = delete;
template <class... T> void product(const T&...) = delete;
template <class... T> void select(const T&...) = delete;
template <class... T> void expect(const T&...) = delete;
template <class... T> void weights(const T&...) = delete;
template <class... T> void weight(const T&...) = delete;
template <class... T> void relative_densities(const T&...) = delete;

// A heuristic of its own.
struct heuristic : mis::balance_heuristic {};

} // namespace renderer

TEST_CASE("a renderer's own functions are not taken for the headers'") {
    mis::path_vertex<renderer::vec> path[3];
    path[0].kind = mis::vertex_kind::camera;
    path[0].position = {0, 0, 1};
    path[2].kind = mis::vertex_kind::light;
    path[2].position = {1, 0, 1};
    for (auto& x : path) {
        x.normal = {0, 0, 1};
        x.pdf_to_light = x.pdf_to_camera = x.pdf_position = x.pdf_next_event = 1;
    }
    double w[5], q[5];
    mis::weights(renderer::heuristic{}, mis::bidirectional(1.0), path, 3, w);
    mis::relative_densities(mis::bidirectional(1.0), path, 3, q);
    CHECK(w[0] + w[1] + w[2] + w[3] + w[4] == doctest::Approx(1));
    CHECK(mis::weight(renderer::heuristic{}, mis::bidirectional(1.0), path, 3, mis::technique_at(3, 2)) ==
          doctest::Approx(w[2]));
    CHECK(mis::area_densities(path, 3, 1).density_from_camera == doctest::Approx(1));
    const double densities[2] = {1, 3};
    CHECK(mis::weight(renderer::heuristic{}, densities, 1) == 0.75);
}

namespace everything {
using namespace std;
using namespace mis;
using namespace mis::verify;

double share() {
    int first = 0, second = 0;
    tie(first, second) = make_pair(1, 3);
    return power(double(first), double(second));
}
} // namespace everything

TEST_CASE("using namespace std, mis and mis::verify together") {
    CHECK(everything::share() == doctest::Approx(0.1));
}

TEST_CASE("beta below 1 does not lift tiny weights") {
    // relative density 1e-110, which float does not have: to the 0.1 it is 1e-11
    mis::area_vertex<float> path[4];
    for (auto& x : path)
        x.density_from_camera = x.density_from_light = x.next_event = 1;
    for (int i = 0; i < 4; ++i)
        path[i].density_from_camera = i < 3 ? 1e-37f : 1;
    mis::technique_counts<float> counts;
    counts.light_hit = 1;
    counts.camera_hit = 1;
    const mis::power_heuristic<float> heuristic{0.1f};
    float w[7];
    mis::weights(heuristic, counts, path, 4, w);
    CHECK(w[4] == doctest::Approx(std::pow(10.0, -11.1)).epsilon(1e-4));
    CHECK(mis::weight(heuristic, counts, path, 4, mis::technique_at(4, 4)) == doctest::Approx(w[4]));
}
