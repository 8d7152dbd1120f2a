# The laboratory ${PROGRAM} and the renderer ${RENDERER}: bad input gets one clear line on standard error and exit status 2, and --snapshots
# writes what it should.
cmake_minimum_required(VERSION 3.21)
include(${CMAKE_CURRENT_LIST_DIR}/expect_refusal.cmake)

expect_refusal(--scene no_such_scene)
expect_refusal(--samples 0)
expect_refusal(--samples -3)
expect_refusal(--samples many)
expect_refusal(--heuristic no_such_heuristic)
expect_refusal(--no-such-option)
# A folder below a file cannot be made, not even by root.
expect_refusal(--samples 1 --output ${CMAKE_CURRENT_LIST_FILE}/folder)
expect_refusal(--algorithm no_such_algorithm)
expect_refusal(--algorithm lt --one-light-vertex)
expect_refusal(--radius-alpha 0)
expect_refusal(--radius-alpha 1.5)
expect_refusal(--reference image.exr) # without --snapshots
expect_refusal(--optimal -1)
expect_refusal(--optimal 4 --random-connection)
expect_refusal(--optimal 4 --algorithm ups)

# Good input to it.
function(expect_success)
    execute_process(COMMAND ${PROGRAM} ${ARGN} RESULT_VARIABLE status OUTPUT_QUIET ERROR_VARIABLE error)
    if(NOT status EQUAL 0)
        list(JOIN ARGN " " arguments)
        message(SEND_ERROR "${PROGRAM} ${arguments}: status ${status}, standard error:\n${error}")
    endif()
endfunction()
function(expect_same one other)
    file(SHA256 ${one} hash_of_one)
    file(SHA256 ${other} hash_of_other)
    if(NOT hash_of_one STREQUAL hash_of_other)
        message(SEND_ERROR "${one} and ${other} differ")
    endif()
endfunction()

# A snapshot is the image of as many passes, and taking it changes no later pass.
set(folder ${CMAKE_CURRENT_BINARY_DIR}/lab_command_line)
file(REMOVE_RECURSE ${folder})
set(render --scene cornell --size 8 --algorithm ups --no-checks)
foreach(passes 1 4 6)
    expect_success(${render} --samples ${passes} --output ${folder}/${passes})
endforeach()
expect_success(${render} --samples 6 --snapshots --reference ${folder}/6/cornell.exr --output ${folder}/all)
expect_same(${folder}/all/cornell-passes-1.exr ${folder}/1/cornell.exr)
expect_same(${folder}/all/cornell-passes-4.exr ${folder}/4/cornell.exr)
expect_same(${folder}/all/cornell.exr ${folder}/6/cornell.exr)
file(GLOB snapshots RELATIVE ${folder}/all ${folder}/all/*-passes-*)
if(NOT snapshots STREQUAL
   "cornell-passes-1.exr;cornell-passes-1.png;cornell-passes-4.exr;cornell-passes-4.png")
    message(SEND_ERROR "snapshots: ${snapshots}")
endif()

# With less than 4 passes, optimal weights are those of balance.
expect_success(--size 8 --samples 3 --heuristic balance --optimal 4 --output ${folder}/optimal)
expect_same(${folder}/optimal/cornell-optimal.exr ${folder}/optimal/cornell.exr)

# The last image is its own reference, but for the file's floats.
file(READ ${folder}/all/cornell-convergence.csv table)
set(number "[0-9.e+-]+")
set(lines "passes,seconds,rms_error\n1,${number},0\\.[0-9]+\n4,${number},0\\.[0-9]+\n6,${number},")
if(NOT table MATCHES "^${lines}[0-9.]+e-(0[6-9]|1[0-9])\n$")
    message(SEND_ERROR "cornell-convergence.csv:\n${table}")
endif()
# A reference that cannot be read leaves the table as it is.
expect_refusal(--samples 1 --size 9 --snapshots --reference ${folder}/6/cornell.exr --output ${folder}/all)
expect_refusal(--samples 1 --size 8 --snapshots --reference ${CMAKE_CURRENT_LIST_FILE} --output ${folder}/all)
file(READ ${folder}/all/cornell-convergence.csv table_after_refusals)
if(NOT table_after_refusals STREQUAL table)
    message(SEND_ERROR "cornell-convergence.csv after refusals:\n${table_after_refusals}")
endif()
expect_success(${render} --samples 1 --snapshots --output ${folder}/all)
file(STRINGS ${folder}/all/cornell-convergence.csv lines)
list(GET lines 0 heading)
if(NOT heading STREQUAL "passes,seconds")
    message(SEND_ERROR "cornell-convergence.csv without a reference: ${heading}")
endif()

# A disk that is full: the dump is short, and that is said.
if(EXISTS /dev/full)
    expect_refusal(--samples 1 --size 8 --no-checks --output ${folder}/full --dump /dev/full)
endif()

# The renderer's own command line.
set(lab ${PROGRAM})
set(PROGRAM ${RENDERER})
expect_refusal(--scene no_such_scene)
expect_refusal(--samples 0)
expect_refusal(--beta 0)
expect_refusal(--algorithm lt --one-light-vertex)
expect_refusal(--samples 1 --output ${CMAKE_CURRENT_LIST_FILE}/folder)
expect_success(--scene cornell --size 8 --algorithm ups --samples 6 --output ${folder}/renderer)
set(PROGRAM ${lab})
expect_success(${render} --samples 6 --scalar float --output ${folder}/float)
expect_same(${folder}/renderer/cornell.exr ${folder}/float/cornell.exr)

# Several scenes have no common reference.
expect_refusal(--scene all --samples 1 --size 8 --snapshots --reference ${folder}/6/cornell.exr
               --output ${folder}/all)
