// SPDX-License-Identifier: MIT
// Everything that needs no third-party header.
#pragma once

#include <mis/bias.hpp>
#include <mis/config.hpp>
#include <mis/heuristic.hpp>
#include <mis/measure.hpp>
#include <mis/path.hpp>
#include <mis/subpath.hpp>
#include <mis/techniques.hpp>
#include <mis/throughput.hpp>
