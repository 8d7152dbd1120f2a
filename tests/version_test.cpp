// SPDX-License-Identifier: MIT
// The macros say what the build says, which reads them with a regular expression, and so the package.
#include <doctest/doctest.h>
#include <mis/config.hpp> // with any header of the library comes the version
#include <string>

static_assert(MIS_VERSION_MAJOR == PROJECT_VERSION_MAJOR);
static_assert(MIS_VERSION_MINOR == PROJECT_VERSION_MINOR);
static_assert(MIS_VERSION_PATCH == PROJECT_VERSION_PATCH);

#if MIS_VERSION != PROJECT_VERSION_MAJOR * 10000 + PROJECT_VERSION_MINOR * 100 + PROJECT_VERSION_PATCH
#error "the number for comparisons is not the version"
#endif
static_assert(MIS_VERSION_MINOR < 100 && MIS_VERSION_PATCH < 100);

TEST_CASE("version") { CHECK(MIS_VERSION_STRING == std::string(PROJECT_VERSION)); }
