# Bad input to ${PROGRAM} gets one clear line on standard error and exit status 2.
function(expect_refusal)
    execute_process(COMMAND ${PROGRAM} ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE error)
    if(NOT status EQUAL 2 OR NOT error MATCHES "^[^\n]+\n$")
        list(JOIN ARGN " " arguments)
        message(SEND_ERROR "${PROGRAM} ${arguments}: status ${status}, standard error:\n${error}")
    endif()
endfunction()
