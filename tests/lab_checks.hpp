// SPDX-License-Identifier: MIT
// How far the reference renderer's three ways to a weight are apart.
#pragma once

#include <doctest/doctest.h>
#include <lab/render.hpp>

namespace test {

template <class Real>
lab::weight_checks checks_of(const lab::scene<Real>& scene, const lab::settings<Real>& set) {
    lab::weight_checks checks;
    lab::render(scene, set, [&](const lab::pass_result<Real>& result) {
        for (const auto& row : result.rows)
            checks.add(row.checks);
    });
    return checks;
}

// In double.
inline void check_agreement(const lab::weight_checks& d) {
    CHECK(d.paths > 100);
    CHECK(d.throughput.compared > 50); // those that do not hang on rounding
    CHECK(d.recursion.largest <= 1e-9);
    CHECK(d.throughput.largest <= 1e-9);
    CHECK(d.sum <= 1e-12);
    CHECK(d.recursion_sum <= 1e-12);
}

} // namespace test
