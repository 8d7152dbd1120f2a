# Bad input to the demo program ${BPT} gets one clear line on standard error and exit status 2.
cmake_minimum_required(VERSION 3.21)
function(expect_refusal)
    execute_process(COMMAND ${BPT} ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE error)
    if(NOT status EQUAL 2 OR NOT error MATCHES "^[^\n]+\n$")
        list(JOIN ARGN " " arguments)
        message(SEND_ERROR "bpt ${arguments}: status ${status}, standard error:\n${error}")
    endif()
endfunction()

expect_refusal(--scene no_such_scene)
expect_refusal(--samples 0)
expect_refusal(--samples -3)
expect_refusal(--samples many)
expect_refusal(--heuristic no_such_heuristic)
expect_refusal(--no-such-option)
# A folder below a file cannot be made, not even by root.
expect_refusal(--samples 1 --output ${CMAKE_CURRENT_LIST_FILE}/folder)
