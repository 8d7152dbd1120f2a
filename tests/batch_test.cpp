// SPDX-License-Identifier: MIT
#include "heuristics.hpp"

#include <cstdio>
#include <doctest/doctest.h>
#include <mis/batch.hpp>

using namespace test;
using oracle::heuristic_kind;

namespace {

// Of arrays of `techniques` times `stride` numbers: what stands beside the samples must not be touched.
template <class T> struct arrays {
    int techniques;
    std::size_t samples, stride;
    std::vector<T> densities;

    const T& at(int i, std::size_t k) const { return densities[static_cast<std::size_t>(i) * stride + k]; }
};

template <class T> T marker() { return T(-7); }

template <class T> arrays<T> random_arrays(generator& g, int techniques, std::size_t samples) {
    arrays<T> a{techniques, samples, samples + static_cast<std::size_t>(g.integer(0, 9)), {}};
    a.densities.assign(static_cast<std::size_t>(techniques) * a.stride, marker<T>());
    for (std::size_t k = 0; k < samples; ++k) {
        const auto q = g.chance(0.05) ? std::vector<T>(static_cast<std::size_t>(techniques))
                                      : random_densities<T>(g, techniques);
        for (std::size_t i = 0; i < q.size(); ++i)
            a.densities[i * a.stride + k] = q[i];
    }
    return a;
}

// Numbers of samples around those that are taken at once.
std::size_t random_samples(generator& g) {
    const int around[] = {0, 1, 63, 64, 65, 127, 128, 200};
    return static_cast<std::size_t>(around[g.integer(0, 7)]);
}

// And one whose beta is known at run time alone.
template <class Visit> void for_each_and_cubes(Visit&& visit) {
    for_each_heuristic(visit);
    visit(mis::power_heuristic{3}, oracle::heuristic{heuristic_kind::power, 3});
}

// -ffast-math: compilers may multiply by an approximate reciprocal, in ulp.
constexpr double approximation = subnormals ? 0 : 2;

// They may round it off where the product is small: then an error of 1 in 1,000 counts as one ulp.
template <class T> double error_of(T weight, const wide& exact) {
    const double e = static_cast<double>(oracle::to_long_double(exact));
    if (!subnormals && sizeof(T) == 4 && e < 1e-29)
        return std::fabs(static_cast<double>(weight) - e) / (1e-3 * e + 1.2e-38);
    return error_of_two(weight, exact);
}

} // namespace

TEST_CASE_TEMPLATE("arrays of N techniques: within N + beta ulp, whatever the number of samples", T, float,
                   double) {
    for_each_and_cubes([](const auto& heuristic, oracle::heuristic reference) {
        generator g(11);
        worst_case error, in_place, of_one;
        bool kept_the_rest = true;
        for (int run = 0; run < 300; ++run) {
            const int n = g.integer(1, 12);
            const arrays<T> a = random_arrays<T>(g, n, random_samples(g));
            arrays<T> w = a, same = a, single = a;
            w.densities.assign(a.densities.size(), marker<T>());
            mis::weights_of_arrays(heuristic, a.densities.data(), n, a.samples, a.stride, w.densities.data());
            mis::weights_of_arrays(heuristic, same.densities.data(), n, a.samples, a.stride,
                                   same.densities.data());
            const bool is_of_three = n == 3;
            std::vector<T> q(static_cast<std::size_t>(n));
            for (std::size_t k = 0; k < a.stride; ++k) {
                for (int i = 0; i < n; ++i) {
                    q[static_cast<std::size_t>(i)] = a.at(i, k);
                    if (k >= a.samples)
                        kept_the_rest = kept_the_rest && bits_of(w.at(i, k)) == bits_of(marker<T>());
                }
                if (k >= a.samples)
                    continue;
                if (is_of_three)
                    mis::weights_of_sample<3>(heuristic, single.densities.data(), a.stride, k,
                                              single.densities.data());
                const auto exact = oracle::weights(reference, q.data(), n);
                const double bound = n + beta_of(reference) + approximation;
                for (int i = 0; i < n; ++i) {
                    const auto& weight = exact[static_cast<std::size_t>(i)];
                    error.see(error_of(w.at(i, k), weight) / bound, run);
                    in_place.see(ulp_distance(same.at(i, k), w.at(i, k)), run);
                    if (is_of_three)
                        of_one.see(error_of_two(single.at(i, k), weight) / bound, run);
                }
            }
        }
        std::printf("arrays, %s, heuristic %d: %.3f (N + beta) ulp\n", sizeof(T) == 4 ? "float" : "double",
                    static_cast<int>(reference.kind), error.error);
        CAPTURE(static_cast<int>(reference.kind));
        CHECK(error.error <= 1);
        CHECK(in_place.error <=
              approximation); // a loop of its own, where compilers ask whether arrays overlap
        CHECK(of_one.error <= 1);
        CHECK(kept_the_rest);
    });
}

TEST_CASE_TEMPLATE("arrays of two techniques: the same weights as one by one", T, float, double) {
    for_each_and_cubes([](const auto& heuristic, oracle::heuristic reference) {
        generator g(12);
        worst_case error;
        for (int run = 0; run < 300; ++run) {
            const arrays<T> a = random_arrays<T>(g, 2, random_samples(g));
            const T *first = a.densities.data(), *second = first + a.stride;
            std::vector<T> w(a.stride, marker<T>());
            mis::weights_of_first(heuristic, first, second, a.samples, w.data());
            for (std::size_t k = 0; k < a.stride; ++k) {
                if (k >= a.samples) {
                    CHECK(bits_of(w[k]) == bits_of(marker<T>()));
                    continue;
                }
                const T q[] = {first[k], second[k]};
                error.see(error_of_two(w[k], oracle::weights(reference, q, 2)[0]), run);
            }
        }
        CAPTURE(static_cast<int>(reference.kind));
        CHECK(error.error <= 2 + beta_of(reference) + approximation);
    });
}
