# Bad input to the study ${STUDY} gets one clear line on standard error and exit status 2.
cmake_minimum_required(VERSION 3.21)
function(expect_refusal)
    execute_process(COMMAND ${STUDY} ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE error)
    if(NOT status EQUAL 2 OR NOT error MATCHES "^[^\n]+\n$")
        list(JOIN ARGN " " arguments)
        message(SEND_ERROR "${STUDY} ${arguments}: status ${status}, standard error:\n${error}")
    endif()
endfunction()

expect_refusal(--largest 0)
expect_refusal(--largest many)
expect_refusal(--per-decade -1)
expect_refusal(--repetitions 0)
expect_refusal(--seed x)
expect_refusal(--no-such-option)
# A folder below a file cannot be made, not even by root.
expect_refusal(--largest 1 --output ${CMAKE_CURRENT_LIST_FILE}/folder)
