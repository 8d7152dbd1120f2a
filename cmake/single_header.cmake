# mis in one file, for who copies it into a renderer:
#     cmake -P cmake/single_header.cmake                                          writes mis.hpp here
#     cmake -D "HEADERS=mis/mis.hpp;mis/roulette.hpp" -D OUTPUT=path/mis.hpp -P cmake/single_header.cmake
# HEADERS are what users would include; they and all headers of mis that they include are put one after the other.
cmake_minimum_required(VERSION 3.16)
get_filename_component(include "${CMAKE_CURRENT_LIST_DIR}/../include" ABSOLUTE)
if(NOT HEADERS)
    set(HEADERS mis/mis.hpp)
endif()
if(NOT OUTPUT)
    set(OUTPUT mis.hpp)
endif()

# In the preprocessor's order: the first include that is left is replaced by what it includes, or by nothing if that has
# come before.
set(text "#include <mis/version.hpp>\n")
foreach(header IN LISTS HEADERS)
    if(NOT EXISTS "${include}/${header}" OR IS_DIRECTORY "${include}/${header}")
        message(FATAL_ERROR "single_header: there is no '${header}' in ${include}")
    endif()
    string(APPEND text "#include <${header}>\n")
endforeach()
set(seen "")
while(text MATCHES "#include <(mis/[a-z_/]+\\.hpp)>\n")
    set(line "${CMAKE_MATCH_0}")
    set(name "${CMAKE_MATCH_1}")
    set(content "")
    if(NOT name IN_LIST seen)
        list(APPEND seen "${name}")
        file(READ "${include}/${name}" content)
        string(REPLACE "// SPDX-License-Identifier: MIT\n" "// ---- ${name} ----\n" content "${content}")
        string(REPLACE "#pragma once\n" "" content "${content}")
    endif()
    string(FIND "${text}" "${line}" at)
    string(LENGTH "${line}" length)
    math(EXPR rest "${at} + ${length}")
    string(SUBSTRING "${text}" 0 ${at} before)
    string(SUBSTRING "${text}" ${rest} -1 after)
    string(CONCAT text "${before}" "${content}" "${after}")
endwhile()

file(READ "${include}/../LICENSE" license)
string(REGEX REPLACE "\n" "\n// " license "// ${license}")
string(REGEX REPLACE " +\n" "\n" license "${license}\n")

# Parts of a program may each have brought one along: the same is no harm, two that differ would be.
string(MD5 content "${text}")
string(SUBSTRING ${content} 0 8 content)
file(WRITE "${OUTPUT}" "// SPDX-License-Identifier: MIT\n"
                       "// Made of the headers of mis by cmake/single_header.cmake: ${HEADERS}\n//\n${license}"
                       "#ifdef MIS_SINGLE_HEADER\n#if MIS_SINGLE_HEADER != 0x${content}\n"
                       "#error \"mis: another single header, of other headers or another version, has come before\"\n"
                       "#endif\n#else\n#define MIS_SINGLE_HEADER 0x${content}\n\n${text}\n#endif\n")
