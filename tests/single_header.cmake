# mis as one file: as users copy it, two copies of it in one program, and two that differ.
cmake_minimum_required(VERSION 3.21)

function(make output)
    execute_process(COMMAND ${CMAKE_COMMAND} -D "HEADERS=${ARGN}" -D OUTPUT=${FOLDER}/${output} -P ${SCRIPT}
                    COMMAND_ERROR_IS_FATAL ANY)
endfunction()
make(mis/mis.hpp mis/mis.hpp)
make(copy.hpp mis/mis.hpp)
make(other.hpp mis/mis.hpp mis/verify.hpp mis/media.hpp mis/roulette.hpp mis/sequence.hpp mis/batch.hpp)

set(compile ${CXX} -std=c++17 -Wall -Wextra -Werror -I ${FOLDER})
execute_process(COMMAND ${compile} ${SOURCE} -o ${FOLDER}/program COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${FOLDER}/program COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${compile} -include copy.hpp -fsyntax-only ${SOURCE} COMMAND_ERROR_IS_FATAL ANY)
file(WRITE ${FOLDER}/other.cpp "#include <other.hpp>\n")
execute_process(COMMAND ${compile} -fsyntax-only ${FOLDER}/other.cpp COMMAND_ERROR_IS_FATAL ANY)

execute_process(COMMAND ${compile} -include other.hpp -fsyntax-only ${SOURCE} RESULT_VARIABLE status ERROR_VARIABLE said)
if(status EQUAL 0 OR NOT said MATCHES "mis: another single header")
    message(FATAL_ERROR "two single headers that differ: status ${status}, ${said}")
endif()
execute_process(COMMAND ${CMAKE_COMMAND} -D HEADERS=mis/none.hpp -D OUTPUT=${FOLDER}/none.hpp -P ${SCRIPT}
                RESULT_VARIABLE status ERROR_VARIABLE said)
if(status EQUAL 0 OR NOT said MATCHES "there is no 'mis/none.hpp'" OR EXISTS ${FOLDER}/none.hpp)
    message(FATAL_ERROR "a header that is not there: status ${status}, ${said}")
endif()
