// SPDX-License-Identifier: MIT
#include "oracle.hpp"
#include "random_paths.hpp"

#include <cstdio>
#include <doctest/doctest.h>
#include <mis/path.hpp>
#include <mis/throughput.hpp>
#ifdef __SSE2__
#include <immintrin.h>
#endif

using namespace test;
using oracle::heuristic_kind;

namespace {

constexpr int paths = 100'000;

// Half of the paths ordinary, half extreme; most of them short.
template <class T> random_path<T> any_path(generator& g) {
    const int n = g.chance(0.7) ? g.integer(2, 8) : g.integer(2, 64);
    return make_path<T>(g, n, g.chance(0.5) ? ordinary : extreme<T>);
}

template <class T, class Vertex>
std::vector<T> densities_of(const mis::technique_counts<T>& counts, const std::vector<Vertex>& path) {
    const int n = static_cast<int>(path.size());
    std::vector<T> q(static_cast<std::size_t>(mis::technique_count(n)));
    mis::relative_densities(counts, path.data(), n, q.data());
    return q;
}

template <class T, class Heuristic, class Vertex>
std::vector<T> weights_of(const Heuristic& h, const mis::technique_counts<T>& counts,
                          const std::vector<Vertex>& path) {
    const int n = static_cast<int>(path.size());
    std::vector<T> w(static_cast<std::size_t>(mis::technique_count(n)));
    mis::weights(h, counts, path.data(), n, w.data());
    return w;
}

template <class T> bool all_zero(const std::vector<T>& x) {
    for (T v : x)
        if (!(v == 0))
            return false;
    return true;
}

// The smallest number that does not count as 0.
template <class T>
const T least = from_bits<T>(subnormals ? oracle::bits_t<T>(1) : oracle::min_normal_bits<T>);

// The relative densities that the documentation promises: a positive one never rounds to 0.
template <class T> double density_error(T computed, const wide& exact) {
    if (!exact.zero() && !(computed > 0))
        return hopeless;
    return bits_of(computed) == bits_of(least<T>) && exact < wide{least<T>} ? 0 : ulp_error(computed, exact);
}

// Weights may be 0. Where subnormal numbers count as 0, one of a smaller density is 0 or the smallest number.
template <class T> double weight_error(T computed, const wide& exact) {
    return subnormals ? ulp_error(computed, exact)
                      : std::min(ulp_error(computed, exact), density_error(computed, exact));
}

struct path_errors {
    worst_case density, weight, unity, single;
};

// Errors over 100,000 paths in ulp divided by n (and by beta for the power heuristic).
template <class T, class Make, class Heuristic>
path_errors errors_of_paths(std::uint64_t seed, int count, const Heuristic& h, oracle::heuristic reference,
                            Make make) {
    path_errors worst;
    generator g(seed);
    const double beta = reference.kind == heuristic_kind::power ? reference.parameter : 1;
    for (int sample = 0; sample < count; ++sample) {
        const auto [vertices, counts] = make(g);
        const int n = static_cast<int>(vertices.size());
        const auto exact = oracle::relative(oracle::densities(counts, oracle::path_of(vertices)));
        const auto exact_weights = oracle::weights(reference, exact);
        const auto q = densities_of(counts, vertices);
        const auto w = weights_of(h, counts, vertices);
        long double sum = 0;
        for (std::size_t k = 0; k < q.size(); ++k) {
            worst.density.see(density_error(q[k], exact[k]) / n, sample);
            worst.weight.see(weight_error(w[k], exact_weights[k]) / (beta * n), sample);
            sum += static_cast<long double>(w[k]);
        }
        worst.unity.see(all_zero(q) ? static_cast<double>(sum) * hopeless : unity_error<T>(sum) / n, sample);
        if (sample % 4 != 0)
            continue;
        const int k = g.integer(0, mis::technique_count(n) - 1);
        const T one = mis::weight(h, counts, vertices.data(), n, mis::technique_at(n, k));
        worst.single.see(weight_error(one, exact_weights[static_cast<std::size_t>(k)]) / (beta * n), sample);
    }
    return worst;
}

template <class T> struct path_of_areas {
    std::vector<mis::area_vertex<T>> vertices;
    mis::technique_counts<T> counts;
};

// Densities per area anywhere in the range of T, 0 now and then.
template <class T> path_of_areas<T> any_path_of_areas(generator& g) {
    path_of_areas<T> path;
    const int n = g.integer(2, 64);
    const auto model = make_path<T>(g, n, ordinary);
    path.counts = model.counts;
    const auto density = [&] { return g.chance(0.01) ? T(0) : g.any_positive<T>(); };
    for (const auto& x : model.vertices) {
        mis::area_vertex<T> y;
        y.kind = x.kind;
        y.dirac = x.dirac;
        y.density_from_camera = density();
        y.density_from_light = density();
        y.next_event = density();
        path.vertices.push_back(y);
    }
    return path;
}

// Every factor anywhere in the range of T, 0 and infinity among them.
template <class T> random_path<T> any_path_of_factors(generator& g) {
    random_path<T> path = make_path<T>(g, g.integer(2, 12), ordinary);
    const bool special = g.chance(0.5);
    const auto change = [&](T& x) {
        if (g.chance(0.5))
            x = special ? g.any<T>() : g.any_positive<T>();
    };
    for (auto& x : path.vertices)
        for (T* factor : {&x.pdf_to_light, &x.pdf_to_camera, &x.pdf_position, &x.pdf_next_event,
                          &x.pdf_distance_from_camera, &x.pdf_distance_from_light, &x.cos_to_camera,
                          &x.cos_to_light, &x.distance2_to_light, &x.merge_factor})
            change(*factor);
    for (T* count : {&path.counts.light_hit, &path.counts.next_event, &path.counts.connection,
                     &path.counts.camera_connection, &path.counts.camera_hit, &path.counts.merge})
        change(*count);
    return path;
}

template <class T> void check(const char* what, const path_errors& e) {
    std::printf("%s, %s: densities %.3f n ulp, weights %.3f beta n ulp, one weight %.3f beta n ulp, sum to 1 "
                "%.3f n eps\n",
                what, sizeof(T) == 4 ? "float" : "double", e.density.error, e.weight.error, e.single.error,
                e.unity.error);
    CAPTURE(what);
    CAPTURE(e.density.sample);
    CAPTURE(e.weight.sample);
    CAPTURE(e.single.sample);
    CHECK(e.density.error <= 4);
    CHECK(e.weight.error <= 4);
    CHECK(e.single.error <= 4);
    CHECK(e.unity.error <= 1);
}

} // namespace

TEST_CASE_TEMPLATE("densities and weights of 100,000 random paths are the products' within 4 beta n ulp", T,
                   float, double) {
    const auto make = [](generator& g) { return any_path<T>(g); };
    check<T>("balance", errors_of_paths<T>(11, paths, mis::balance, {heuristic_kind::balance}, make));
    check<T>("power 2", errors_of_paths<T>(12, paths / 10, mis::power, {heuristic_kind::power, 2}, make));
    check<T>("power 1.5", errors_of_paths<T>(13, paths / 50, mis::power_heuristic{1.5},
                                             {heuristic_kind::power, 1.5}, make));
    check<T>("average", errors_of_paths<T>(14, paths / 20, mis::average, {heuristic_kind::average}, make));
    check<T>("maximum", errors_of_paths<T>(15, paths / 20, mis::maximum, {heuristic_kind::maximum}, make));
    check<T>("cutoff", errors_of_paths<T>(16, paths / 20, mis::cutoff_heuristic{0.125},
                                          {heuristic_kind::cutoff, 0.125}, make));
}

TEST_CASE_TEMPLATE("densities per area from the whole range of the scalar", T, float, double) {
    const auto make = [](generator& g) { return any_path_of_areas<T>(g); };
    check<T>("areas, balance",
             errors_of_paths<T>(21, paths / 20, mis::balance, {heuristic_kind::balance}, make));
    check<T>("areas, power 2",
             errors_of_paths<T>(22, paths / 20, mis::power, {heuristic_kind::power, 2}, make));
}

TEST_CASE_TEMPLATE("factors from the whole range of the scalar, 0 and infinity among them", T, float,
                   double) {
    const auto make = [](generator& g) { return any_path_of_factors<T>(g); };
    check<T>("factors, balance",
             errors_of_paths<T>(23, paths / 5, mis::balance, {heuristic_kind::balance}, make));
    check<T>("factors, average",
             errors_of_paths<T>(24, paths / 20, mis::average, {heuristic_kind::average}, make));
}

TEST_CASE_TEMPLATE("a path of 1,000 vertices neither overflows nor underflows", T, float, double) {
    const auto make = [](generator& g) {
        return make_path<T>(g, 1000, g.chance(0.5) ? ordinary : extreme<T>);
    };
    check<T>("1,000 vertices", errors_of_paths<T>(31, 20, mis::balance, {heuristic_kind::balance}, make));
    // equal densities all along: every technique counts, none dominates
    std::vector<mis::area_vertex<T>> path(1000);
    for (auto& x : path) {
        x.density_from_camera = x.density_from_light = std::numeric_limits<T>::max() / 3;
        x.next_event = x.density_from_camera;
    }
    const auto w = weights_of(mis::balance, mis::bidirectional(T(1)), path);
    for (int s = 1; s <= 1000; ++s)
        CHECK(w[static_cast<std::size_t>(s)] == doctest::Approx(1e-3).epsilon(1e-5));
}

// Exactly 1, however a compiler rounds the quotient: the maximum heuristic counts nothing below.
TEST_CASE_TEMPLATE("the largest relative density is 1; single weights of every heuristic sum to 1", T, float,
                   double) {
    generator g(32);
    worst_case largest, unity, apart;
    const auto look = [&](const auto& h, const auto& counts, const auto& path, int sample) {
        const int n = static_cast<int>(path.size()), count = mis::technique_count(n);
        const auto all = weights_of(h, counts, path);
        long double sum = 0;
        for (int k = 0; k < count; ++k) {
            const T one = mis::weight(h, counts, path.data(), n, mis::technique_at(n, k));
            sum += static_cast<long double>(one);
            apart.see(ulp_distance(one, all[static_cast<std::size_t>(k)]), sample);
        }
        unity.see(unity_error<T>(sum) / n, sample);
    };
    for (int sample = 0; sample < 10'000; ++sample) {
        std::vector<mis::area_vertex<T>> path(static_cast<std::size_t>(g.integer(2, 8)));
        for (auto& x : path) {
            x.density_from_camera = static_cast<T>(g.uniform(0.1, 2));
            x.density_from_light = static_cast<T>(g.uniform(0.1, 2));
            x.next_event = static_cast<T>(g.uniform(0.1, 2));
        }
        const auto counts = mis::connection_and_merging(T(100), T(0.1));
        T most = 0;
        for (const T q : densities_of(counts, path))
            most = std::max(most, q);
        largest.see(most == T(1) ? 0 : hopeless, sample);
        look(mis::average, counts, path, sample);
        look(mis::balance, counts, path, sample);
        look(mis::power, counts, path, sample);
        look(mis::maximum, counts, path, sample);
        look(mis::cutoff_heuristic{0.125}, counts, path, sample);
    }
    CHECK(largest.error == 0);
    CHECK(unity.error <= 1);
    CHECK(apart.error <= 2); // an array of T rounds the shares once more
}

TEST_CASE_TEMPLATE("as many zeros, infinities and extreme factors as the longest path has", T, float,
                   double) {
    const T inf = from_bits<T>(oracle::infinity_bits<T>);
    const auto path_of = [](T from_camera, T from_light) {
        std::vector<mis::measured_vertex<T>> path(10'000);
        for (auto& x : path) {
            x.pdf_to_light = from_camera;
            x.pdf_to_camera = from_light;
            x.pdf_position = x.pdf_next_event = 1;
        }
        return path;
    };
    auto counts = mis::connection_and_merging(T(1), T(1));
    counts.camera_hit = counts.merge = 1;
    const auto positive = [&](std::vector<mis::measured_vertex<T>> path) {
        std::vector<int> result;
        const auto w = weights_of(mis::average, counts, path);
        for (std::size_t k = 0; k < w.size(); ++k)
            if (w[k] > 0)
                result.push_back(static_cast<int>(k));
        return result;
    };
    using list = std::vector<int>;
    const T largest = largest_finite<T>();
    CHECK(positive(path_of(0, 1)) == list{0, 1}); // what needs no step of a camera walk
    CHECK(positive(path_of(1, 0)) == list{9'999, 10'000});
    CHECK(positive(path_of(0, 0)) == list{});
    CHECK(positive(path_of(inf, inf)).size() == 19'999);
    CHECK(positive(path_of(inf, 0)) == list{9'999, 10'000});
    CHECK(positive(path_of(1, inf)).size() == 19'999 - 2);
    CHECK(positive(path_of(least<T>, largest)).size() == 19'999);
    const auto w = weights_of(mis::balance, counts, path_of(least<T>, largest));
    CHECK(w[0] == 1);

    auto infinite = path_of(inf, inf); // in all factors, and one 0 in what all but two techniques need
    for (auto& x : infinite) {
        x.cos_to_camera = x.cos_to_light = inf;
        x.pdf_distance_from_camera = x.pdf_distance_from_light = inf;
        x.distance2_to_light = 0;
    }
    infinite.back().pdf_position = 0;
    CHECK(positive(infinite) == list{9'999, 10'000});
    infinite.front().pdf_position = 0; // and one in what those need
    CHECK(positive(infinite) == list{});

    auto path = path_of(least<T>, least<T>);
    for (auto& x : path) {
        x.cos_to_camera = x.cos_to_light = least<T>;
        x.distance2_to_light = largest;
    }
    const auto v = weights_of(mis::balance, counts, path); // P-> = P<- everywhere
    // a connection leaves out two steps, what a walk makes alone one, a merge none
    CHECK(v[5'000] == doctest::Approx(1.0 / (10'000 - 3)));
    CHECK(v[10'000] == 0);
    CHECK(v[15'000] == 0);
}

TEST_CASE_TEMPLATE("infinite densities share 1; a technique that also has a factor 0 has density 0", T, float,
                   double) {
    const T inf = from_bits<T>(oracle::infinity_bits<T>);
    std::vector<mis::area_vertex<T>> path(5);
    for (auto& x : path)
        x.density_from_camera = x.density_from_light = x.next_event = T(0.5);
    path[2].density_from_camera = inf; // s = 3, 4, 5 and the merges at x_2, x_3 use it
    mis::technique_counts<T> counts = mis::connection_and_merging(T(1), T(1));
    auto w = weights_of(mis::balance, counts, path);
    const T fifth = T(1) / 5;
    const T expected[9] = {0, 0, 0, fifth, fifth, fifth, 0, fifth, fifth};
    for (std::size_t k = 0; k < 9; ++k)
        CHECK(bits_of(w[k]) == bits_of(expected[k]));
    path[3].density_from_light = 0; // and of those s = 3 and both merges use this
    w = weights_of(mis::power, counts, path);
    for (std::size_t k = 0; k < 9; ++k)
        CHECK(w[k] == (k == 4 || k == 5 ? T(0.5) : T(0)));
}

TEST_CASE("caps on the lengths of walks remove techniques at both ends") {
    worst_case worst;
    generator g(41);
    for (int sample = 0; sample < 10'000; ++sample) {
        auto path = make_path<double>(g, g.integer(2, 20), ordinary);
        path.counts.max_camera_vertices = g.integer(0, 12);
        path.counts.max_light_vertices = g.integer(0, 12);
        const auto exact = oracle::weights({heuristic_kind::balance},
                                           oracle::densities(path.counts, oracle::path_of(path.vertices)));
        const auto w = weights_of(mis::balance, path.counts, path.vertices);
        for (std::size_t k = 0; k < w.size(); ++k)
            worst.see(ulp_error(w[k], exact[k]) / path.size(), sample);
    }
    CHECK(worst.error <= 4);

    // n = 10 with at most 8 vertices in either walk, spelled out
    std::vector<mis::area_vertex<double>> path(10);
    for (auto& x : path)
        x.density_from_camera = x.density_from_light = x.next_event = 1;
    auto counts = mis::connection_and_merging(1.0, 1.0);
    counts.camera_hit = 1;
    counts.max_camera_vertices = counts.max_light_vertices = 8;
    const auto q = densities_of(counts, path);
    for (int k = 0; k < 19; ++k) {
        const auto t = mis::technique_at(10, k);
        const int s = t.camera_vertices;
        const bool merge = t.kind == mis::technique_kind::merge;
        const bool exists = merge ? s <= 8 && 10 - s + 1 <= 8 : s >= 2 && s <= 8;
        CAPTURE(k);
        CHECK((q[static_cast<std::size_t>(k)] > 0) == exists);
    }
}

TEST_CASE("the named subsets switch on what they say") {
    std::vector<mis::area_vertex<double>> path(6);
    for (auto& x : path)
        x.density_from_camera = x.density_from_light = x.next_event = 1;
    const auto on = [&](const mis::technique_counts<double>& counts, std::size_t n) {
        std::vector<int> result;
        const auto q = densities_of(counts, std::vector<mis::area_vertex<double>>(
                                                path.begin(), path.begin() + static_cast<std::ptrdiff_t>(n)));
        for (std::size_t k = 0; k < q.size(); ++k)
            if (q[k] > 0)
                result.push_back(static_cast<int>(k));
        return result;
    };
    using list = std::vector<int>;
    CHECK(on(mis::path_tracing<double>(), 6) == list{6});
    CHECK(on(mis::path_tracing_next_event<double>(), 6) == list{5, 6});
    CHECK(on(mis::light_tracing<double>(100), 6) == list{1});
    CHECK(on(mis::light_tracing<double>(100), 2) == list{1});
    CHECK(on(mis::bidirectional<double>(100), 6) == list{1, 2, 3, 4, 5, 6});
    CHECK(on(mis::bidirectional<double>(100), 2) == list{2});
    CHECK(on(mis::photon_mapping<double>(100, 0.1), 6) == list{6, 7, 8, 9, 10});
    CHECK(on(mis::connection_and_merging<double>(100, 0.1), 6) == list{1, 2, 3, 4, 5, 6, 7, 8, 9, 10});
}

TEST_CASE_TEMPLATE("merging: densities times pi r^2 or everything else over it, the same weights", T, float,
                   double) {
    generator g(51);
    worst_case worst;
    for (int sample = 0; sample < 10'000; ++sample) {
        const auto path = make_path<T>(g, g.integer(3, 30), ordinary);
        const T radius = g.log_uniform<T>(-4, 1);
        const auto w = weights_of(mis::power, mis::times_merge_area(path.counts, radius), path.vertices);
        const auto v = weights_of(mis::power, mis::divided_by_merge_area(path.counts, radius), path.vertices);
        for (std::size_t k = 0; k < w.size(); ++k)
            worst.see(ulp_distance(v[k], w[k]), sample);
    }
    CHECK(worst.error <= 16); // rounding of the counts only: the walks' products are the same numbers
}

TEST_CASE_TEMPLATE("camera and light exchanged: the mirror image has the mirrored weights", T, float,
                   double) {
    generator g(61);
    worst_case worst;
    for (int sample = 0; sample < 10'000; ++sample) {
        auto path = any_path<T>(g);
        if (g.chance(0.3)) {
            // not 0: `direct` takes its light point from a light walk and its lens point from none
            path.counts.max_camera_vertices = g.integer(1, 40);
            path.counts.max_light_vertices = g.integer(1, 40);
        }
        const int n = path.size();
        const auto image = mirrored(path);
        const auto w = weights_of(mis::balance, path.counts, path.vertices);
        const auto v = weights_of(mis::balance, image.counts, image.vertices);
        for (int k = 0; k < mis::technique_count(n); ++k)
            worst.see(ulp_distance(v[static_cast<std::size_t>(mirrored_index(n, k))],
                                   w[static_cast<std::size_t>(k)]) /
                          n,
                      sample);
    }
    CHECK(worst.error <= 8); // each side may be 4 n ulp off
}

TEST_CASE_TEMPLATE("sampled throughputs give the densities' weights: theorem 1", T, float, double) {
    generator g(71);
    worst_case worst;
    for (int sample = 0; sample < 10'000; ++sample) {
        auto path = make_path<T>(g, g.integer(2, 8), ordinary);
        const int n = path.size(), m = mis::technique_count(n);
        auto one_each = path.counts;
        one_each.light_hit = one_each.next_event = one_each.connection = one_each.camera_connection =
            one_each.camera_hit = one_each.direct = one_each.merge = 1;
        const auto p = oracle::densities(one_each, oracle::path_of(path.vertices));
        wide middle{1}; // f, chosen so that the throughputs are numbers of T
        for (const wide& x : p)
            if (!x.zero())
                middle = x;
        std::vector<T> counts, throughputs, q(static_cast<std::size_t>(m)), w(q), v;
        bool fits = true;
        for (int k = 0; k < m; ++k) {
            const wide s =
                middle / p[static_cast<std::size_t>(k)]; // infinite where the technique is impossible
            fits = fits && (s.infinite || oracle::in_normal_range<T>(s));
            counts.push_back(mis::count_of(path.counts, n, mis::technique_at(n, k)));
            throughputs.push_back(s.infinite ? from_bits<T>(oracle::infinity_bits<T>)
                                             : static_cast<T>(oracle::to_long_double(s)));
        }
        if (!fits)
            continue;
        mis::densities_from_throughputs(counts.data(), throughputs.data(), m, q.data());
        mis::weights(mis::power, q.data(), m, w.data());
        v = weights_of(mis::power, path.counts, path.vertices);
        for (std::size_t k = 0; k < w.size(); ++k) {
            worst.see(ulp_distance(w[k], v[k]) / n, sample);
            if (counts[k] > 0 && !is_infinite(throughputs[k]) && path.size() == 2)
                worst.see(ulp_error(mis::density_from_throughput(counts[k], throughputs[k]),
                                    wide{counts[k]} / wide{throughputs[k]}),
                          sample);
        }
    }
    CHECK(worst.error <= 2 * 4 + 4);
    CHECK(mis::density_from_throughput(T(0), T(0)) == 0);
    CHECK(is_infinite(mis::density_from_throughput(T(1), T(0))));
}

TEST_CASE("a technique's multiplier enters through its relative density or its count alike") {
    generator g(81);
    worst_case worst;
    for (int sample = 0; sample < 2'000; ++sample) {
        const auto path = make_path<double>(g, g.integer(4, 12), ordinary);
        const double probability = g.uniform(0.1, 1), mean_vertices = g.uniform(1, 10);
        auto q = densities_of(path.counts, path.vertices);
        for (int k = 0; k < static_cast<int>(q.size()); ++k) {
            const auto kind = mis::technique_at(path.size(), k).kind;
            if (kind == mis::technique_kind::connection)
                q[static_cast<std::size_t>(k)] /= mean_vertices;
            if (kind == mis::technique_kind::merge)
                q[static_cast<std::size_t>(k)] *= probability;
        }
        std::vector<double> w(q.size());
        mis::weights(mis::balance, q, w);
        auto counts = mis::random_connection(path.counts, mean_vertices);
        counts.merge *= probability;
        const auto v = weights_of(mis::balance, counts, path.vertices);
        for (std::size_t k = 0; k < w.size(); ++k)
            worst.see(ulp_distance(w[k], v[k]) / path.size(), sample);
    }
    CHECK(worst.error <= 8);
}

TEST_CASE_TEMPLATE("area densities of a measured vertex are P-> and P<-", T, float, double) {
    generator g(91);
    worst_case worst;
    for (int sample = 0; sample < 10'000; ++sample) {
        const auto path = make_path<T>(g, g.integer(2, 10), ordinary);
        const auto exact = oracle::path_of(path.vertices);
        const int i = g.integer(0, path.size() - 1);
        const auto x = mis::area_densities(path.data(), path.size(), i);
        const auto at = static_cast<std::size_t>(i);
        worst.see(ulp_error(x.density_from_camera, exact.from_camera[at]), sample);
        worst.see(ulp_error(x.density_from_light, exact.from_light[at]), sample);
        if (i == 0)
            worst.see(ulp_error(x.next_event, exact.camera_next_event), sample);
        if (i == path.size() - 1)
            worst.see(ulp_error(x.next_event, exact.light_next_event), sample);
    }
    CHECK(worst.error <= 3); // four factors, three roundings
}

#ifdef __SSE2__
// The processor can be told to take subnormal numbers for 0, as a program is that links one -ffast-math
// library.
TEST_CASE_TEMPLATE("no technique is lost where the processor takes subnormal numbers for 0", T, float,
                   double) {
    constexpr unsigned flush = 0x8040; // results and operands
    generator g(93);
    worst_case density, weight, single;
    for (int sample = 0; sample < 5'000; ++sample) {
        const auto path = make_path<T>(g, g.integer(20, 64), spread{extreme<T>.density / 3, 1, 0.1, 0});
        const int n = path.size(), k = g.integer(0, mis::technique_count(n) - 1);
        const auto exact = oracle::relative(oracle::densities(path.counts, oracle::path_of(path.vertices)));
        const auto exact_weights = oracle::weights({heuristic_kind::average}, exact);
        const unsigned before = _mm_getcsr();
        _mm_setcsr(before | flush);
        const auto q = densities_of(path.counts, path.vertices);
        const auto w = weights_of(mis::average, path.counts, path.vertices);
        const T one = mis::weight(mis::average, path.counts, path.data(), n, mis::technique_at(n, k));
        int lost = 0;
        for (std::size_t i = 0; i < q.size(); ++i)
            lost += !exact[i].zero() && !(q[i] > 0);
        _mm_setcsr(before);
        density.see(lost, sample);
        for (std::size_t i = 0; i < q.size(); ++i)
            weight.see(ulp_error(w[i], exact_weights[i]), sample);
        single.see(ulp_error(one, exact_weights[static_cast<std::size_t>(k)]), sample);
    }
    CHECK(density.error == 0);
    CHECK(weight.error <= 4);
    CHECK(single.error <= 4);
}
#endif

TEST_CASE("other scalars: long double, within its own precision") {
    generator g(92);
    worst_case worst;
    for (int sample = 0; sample < 2'000; ++sample) {
        const auto path = make_path<double>(g, g.integer(2, 20), g.chance(0.5) ? ordinary : extreme<double>);
        std::vector<mis::measured_vertex<long double>> vertices;
        for (const auto& x : path.vertices)
            vertices.push_back({x.kind, x.dirac, x.pdf_to_light, x.pdf_to_camera, x.pdf_position,
                                x.pdf_next_event, x.pdf_distance_from_camera, x.pdf_distance_from_light,
                                x.cos_to_camera, x.cos_to_light, x.distance2_to_light, x.merge_factor});
        const auto& c = path.counts;
        const mis::technique_counts<long double> counts{
            c.light_hit, c.next_event, c.connection, c.camera_connection, c.direct, c.camera_hit, c.merge};
        const auto exact =
            oracle::weights({heuristic_kind::balance}, oracle::densities(c, oracle::path_of(path.vertices)));
        const auto w = weights_of(mis::balance, counts, vertices);
        for (std::size_t k = 0; k < w.size(); ++k) {
            const long double apart = std::fabs(w[k] - oracle::to_long_double(exact[k]));
            worst.see(static_cast<double>(apart) / path.size(), sample);
        }
    }
    CHECK(worst.error <= 4 * static_cast<double>(std::numeric_limits<long double>::epsilon()));
}
