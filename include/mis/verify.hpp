// SPDX-License-Identifier: MIT
// Floor 5: checks for the unit tests of a renderer, in whatever test framework it uses.
//
// Every check returns a `result`: whether it passed, and a message that says what was claimed, what is right
// and where.
//
//     CHECK_MESSAGE(r, r.message)         doctest
//     EXPECT_TRUE(r) << r.message         GoogleTest
//
// A check that calls back asks only for techniques that can make the path. Tolerances are relative. Host
// only, but for subpaths.hpp. Nothing here depends on isnan or isinf, so that it works under -ffast-math.
// docs/unit_tests.md shows every check in use; diagnosis.hpp names the mistake behind weights that are wrong.
//
// Not part of mis.hpp: renderers need none of this, and their tests all of it.
#pragma once

#include <mis/verify/diagnosis.hpp>
#include <mis/verify/dump.hpp>
#include <mis/verify/invariance.hpp>
#include <mis/verify/sampling.hpp>
#include <mis/verify/shadow_walk.hpp>
#include <mis/verify/subpaths.hpp>
#include <mis/verify/weights.hpp>
