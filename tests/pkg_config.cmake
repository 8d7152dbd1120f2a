# What a Makefile does, with mis installed in ${PREFIX}: ${CXX} $(pkg-config --cflags mis)
cmake_minimum_required(VERSION 3.21)
set(ENV{PKG_CONFIG_PATH} ${PREFIX}/share/pkgconfig)
execute_process(COMMAND ${PKG_CONFIG} --modversion mis OUTPUT_VARIABLE version OUTPUT_STRIP_TRAILING_WHITESPACE
                COMMAND_ERROR_IS_FATAL ANY)
if(NOT version STREQUAL VERSION)
    message(FATAL_ERROR "mis.pc has version '${version}', not ${VERSION}")
endif()

# The prefix is the one it was installed in, which is not the one it was configured with.
execute_process(COMMAND ${PKG_CONFIG} --variable=prefix mis OUTPUT_VARIABLE prefix OUTPUT_STRIP_TRAILING_WHITESPACE
                COMMAND_ERROR_IS_FATAL ANY)
file(REAL_PATH "${prefix}" prefix)
file(REAL_PATH ${PREFIX} expected_prefix)
if(NOT prefix STREQUAL expected_prefix)
    message(FATAL_ERROR "mis.pc has prefix ${prefix}, not ${expected_prefix}")
endif()

# Clang 14 and GCC 10 are C++14 where nothing else is said.
execute_process(COMMAND ${PKG_CONFIG} --cflags mis OUTPUT_VARIABLE flags COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(flags UNIX_COMMAND "${flags}")
execute_process(COMMAND ${CXX} -std=c++17 ${flags} ${SOURCE} -o ${PROGRAM} COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${PROGRAM} COMMAND_ERROR_IS_FATAL ANY)
