// SPDX-License-Identifier: MIT
// All that a renderer needs to weigh by, without third-party headers. Optimal weights (optimal.hpp) and
// checks (verify.hpp) are included by who uses them.
#pragma once

#include <mis/bias.hpp>
#include <mis/config.hpp>
#include <mis/heuristic.hpp>
#include <mis/measure.hpp>
#include <mis/path.hpp>
#include <mis/subpath.hpp>
#include <mis/techniques.hpp>
#include <mis/throughput.hpp>
#include <mis/version.hpp>
