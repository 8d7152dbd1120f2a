# Removes what the last `cmake --install` of a build wrote: the files that its ${MANIFEST} lists, below $DESTDIR as
# when they were installed, and the folders that held nothing else.
cmake_minimum_required(VERSION 3.16)
if(NOT EXISTS ${MANIFEST})
    message(FATAL_ERROR "Nothing to uninstall: ${MANIFEST}, which `cmake --install` writes, is not there.")
endif()

file(STRINGS ${MANIFEST} files)
set(folders "")
foreach(file IN LISTS files)
    set(file "$ENV{DESTDIR}${file}")
    if(NOT EXISTS "${file}")
        message(STATUS "Not there: ${file}")
        continue()
    endif()
    file(REMOVE "${file}")
    if(EXISTS "${file}")
        message(FATAL_ERROR "Cannot be removed: ${file}")
    endif()
    message(STATUS "Removed: ${file}")
    get_filename_component(folder "${file}" DIRECTORY)
    list(APPEND folders "${folder}")
endforeach()

# Folders after what is in them. That of the pkg-config files is everybody's.
list(REMOVE_DUPLICATES folders)
list(SORT folders ORDER DESCENDING)
foreach(folder IN LISTS folders)
    file(GLOB left LIST_DIRECTORIES true "${folder}/*")
    if(NOT left AND NOT folder MATCHES "/pkgconfig$")
        file(REMOVE_RECURSE "${folder}")
    endif()
endforeach()

# What is at these paths from now on, this build did not write.
file(REMOVE ${MANIFEST})
