// SPDX-License-Identifier: MIT
// Floor 0: the library's version; the build and the installed package take theirs from here.
#pragma once

#define MIS_VERSION_MAJOR 0
#define MIS_VERSION_MINOR 1
#define MIS_VERSION_PATCH 0

// One number, so that the preprocessor can compare: 102 is 0.1.2, 20304 is 2.3.4.
#define MIS_VERSION (MIS_VERSION_MAJOR * 10000 + MIS_VERSION_MINOR * 100 + MIS_VERSION_PATCH)

#define MIS_DETAIL_QUOTE(text) #text
#define MIS_DETAIL_QUOTE_VALUE(macro) MIS_DETAIL_QUOTE(macro)

// As text: "0.1.2".
#define MIS_VERSION_STRING                                                                                   \
    MIS_DETAIL_QUOTE_VALUE(MIS_VERSION_MAJOR)                                                                \
    "." MIS_DETAIL_QUOTE_VALUE(MIS_VERSION_MINOR) "." MIS_DETAIL_QUOTE_VALUE(MIS_VERSION_PATCH)
