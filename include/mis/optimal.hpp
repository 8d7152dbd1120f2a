// SPDX-License-Identifier: MIT
// Floor 4: optimal multiple importance sampling, all of it. Needs Eigen (3.4) in the include path, which
// mis::mis does not bring. A renderer's inner loop, or kernel, needs optimal/estimator.hpp alone, and no
// Eigen.
#pragma once

#include <mis/optimal/allocation.hpp>
#include <mis/optimal/estimator.hpp>
#include <mis/optimal/film.hpp>
#include <mis/optimal/solve.hpp>
