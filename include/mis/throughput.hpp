// SPDX-License-Identifier: MIT
// Floor 2: sampled throughputs as a source of relative densities.
//
// A technique with density p returns S = f / p for a path of contribution f. Because f is the same for all
// techniques of one path, n / S is an effective relative density, [J] 6 and theorem 1: any heuristic may be
// put on top. It follows that whatever multiplies a technique's throughput must divide its density ([J] 4):
// roulette survival, the shading-normal factor, the probability of a random connection, 1 / (pi r^2) of a
// merge.
#pragma once

#include <mis/config.hpp>

namespace mis {

// n / S. A technique that takes no samples has density 0, whatever its throughput; one that cannot make the
// path at all has S = +infinity and density 0; S = 0 (a path without contribution) gives +infinity.
template <class T> MIS_HOST_DEVICE constexpr T density_from_throughput(T count, T throughput) {
    detail::expect_real<T>();
    return detail::select(count > T(0), count / throughput, T(0));
}

// The same for all `count` techniques of one path, scaled so that the largest is 1: no finite throughputs
// overflow. `out` may be `counts` or `throughputs`. All zero where no technique takes samples.
template <class T>
MIS_HOST_DEVICE constexpr void densities_from_throughputs(const T* counts, const T* throughputs, int count,
                                                          T* out) {
    detail::expect_real<T>();
    using W = detail::wide_t<T>;
    W least = W(detail::limits<W>::largest);
    for (int i = 0; i < count; ++i) {
        detail::assert_density(counts[i]);
        detail::assert_density(throughputs[i]);
        const W cost = static_cast<W>(throughputs[i]) / static_cast<W>(counts[i]);
        least = detail::select(counts[i] > T(0), detail::smaller(least, cost), least);
    }
    for (int i = 0; i < count; ++i) {
        const W cost = static_cast<W>(throughputs[i]) / static_cast<W>(counts[i]);
        const W density = detail::select(cost > least, least / cost, W(1));
        out[i] = detail::select(counts[i] > T(0), static_cast<T>(density), T(0));
    }
}

} // namespace mis
