# Installs what is configured in ${BUILD}, below ${FOLDER}, and uninstalls it: nothing is left of it, and what others
# have put there stays.
cmake_minimum_required(VERSION 3.21)
file(REMOVE_RECURSE ${FOLDER})
set(prefix ${FOLDER}/prefix)
set(stage ${FOLDER}/stage)

function(install)
    execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix} OUTPUT_QUIET
                    COMMAND_ERROR_IS_FATAL ANY)
endfunction()
function(uninstall)
    execute_process(COMMAND ${CMAKE_COMMAND} --build ${BUILD} --target uninstall OUTPUT_QUIET
                    COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# Everything below a folder is what is listed.
function(expect_left folder)
    file(GLOB_RECURSE left LIST_DIRECTORIES true RELATIVE ${folder} ${folder}/*)
    list(SORT left)
    if(NOT left STREQUAL "${ARGN}")
        list(JOIN left "\n  " left)
        message(SEND_ERROR "left in ${folder}, instead of ${ARGN}:\n  ${left}")
    endif()
endfunction()

# As packages are made: another one of the same prefix stays where it is.
install()
file(GLOB_RECURSE installed ${prefix}/*)
list(LENGTH installed count)
if(count LESS 10 OR NOT EXISTS ${prefix}/include/mis/mis.hpp)
    message(FATAL_ERROR "installed in ${prefix}: ${installed}")
endif()
set(ENV{DESTDIR} ${stage})
install()
if(NOT EXISTS ${stage}${prefix}/include/mis/mis.hpp)
    message(FATAL_ERROR "not installed in ${stage}")
endif()
uninstall()
set(ENV{DESTDIR})
expect_left(${stage}${prefix} include share share/cmake share/doc share/pkgconfig)
foreach(file IN LISTS installed)
    if(NOT EXISTS ${file})
        message(SEND_ERROR "uninstalled from ${prefix}, not from ${stage}: ${file}")
    endif()
endforeach()

# Others' files, beside and among those of mis; one of those of mis is gone already.
install()
file(TOUCH ${prefix}/include/other.hpp ${prefix}/include/mis/optimal/.other)
file(REMOVE ${prefix}/include/mis/mis.hpp)
uninstall()
expect_left(${prefix} include include/mis include/mis/optimal include/mis/optimal/.other include/other.hpp share
            share/cmake share/doc share/pkgconfig)

execute_process(COMMAND ${CMAKE_COMMAND} --build ${BUILD} --target uninstall RESULT_VARIABLE status
                OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(status EQUAL 0 OR NOT output MATCHES "Nothing to uninstall:")
    message(SEND_ERROR "uninstalled twice: status ${status}, ${output}")
endif()
