// SPDX-License-Identifier: MIT
#pragma once

#include "oracle.hpp"
#include "ulp.hpp"

#include <mis/heuristic.hpp>

// All heuristics beside their oracles, and densities to weigh.

namespace test {

// Calls visit(heuristic of the library, its oracle) for all five.
template <class Visit> void for_each_heuristic(Visit&& visit) {
    visit(mis::average, oracle::heuristic{oracle::heuristic_kind::average});
    visit(mis::balance, oracle::heuristic{oracle::heuristic_kind::balance});
    visit(mis::power, oracle::heuristic{oracle::heuristic_kind::power, 2});
    visit(mis::cutoff_heuristic{0.125}, oracle::heuristic{oracle::heuristic_kind::cutoff, 0.125});
    visit(mis::maximum, oracle::heuristic{oracle::heuristic_kind::maximum});
}

// To which power a heuristic raises densities, and so multiplies their errors.
inline double beta_of(oracle::heuristic h) {
    return h.kind == oracle::heuristic_kind::power ? h.parameter : 1;
}

// Densities of count techniques, now over the whole range, now within a few decades of one another.
template <class T> std::vector<T> random_densities(generator& g, int count) {
    std::vector<T> q;
    const bool close = g.chance(0.6);
    const double middle = g.uniform(-20, 20);
    for (int i = 0; i < count; ++i) {
        const T ordinary = g.chance(0.1) ? T(0) : g.log_uniform<T>(middle - 3, middle + 3);
        q.push_back(close ? ordinary : g.any<T>());
    }
    return q;
}

} // namespace test
