# Every header compiled alone, in the oldest and the newest standard; the objects of one standard are linked into a
# program, so that a function that should be inline, and is not, shows.
file(GLOB_RECURSE headers CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/include/mis/*.hpp)
set(folder ${CMAKE_CURRENT_BINARY_DIR}/headers)
file(CONFIGURE OUTPUT ${folder}/main.cpp CONTENT "int main() {}\n")
set(sources ${folder}/main.cpp)
foreach(header IN LISTS headers)
    file(CONFIGURE OUTPUT ${folder}/${header}.cpp CONTENT "#include <@header@>\n#include <@header@>\n" @ONLY)
    list(APPEND sources ${folder}/${header}.cpp)
endforeach()

# These alone are shown where Eigen is, so that all others are seen to need nothing.
set(headers_that_need_eigen mis/optimal.hpp mis/optimal/allocation.hpp mis/optimal/film.hpp mis/optimal/solve.hpp)
get_target_property(eigen_folders Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
foreach(header IN LISTS headers_that_need_eigen)
    set_source_files_properties(${folder}/${header}.cpp PROPERTIES COMPILE_OPTIONS "-isystem;${eigen_folders}")
endforeach()

foreach(standard 17 23)
    set(target headers_cxx${standard})
    add_executable(${target} ${sources})
    target_link_libraries(${target} PRIVATE mis::mis mis_warnings)
    target_compile_options(${target} PRIVATE -O0) # they are compiled and linked, not run
    set_target_properties(${target} PROPERTIES CXX_STANDARD ${standard} CXX_STANDARD_REQUIRED ON)
    add_test(NAME ${target} COMMAND ${target})
endforeach()

list(JOIN headers_that_need_eigen "," need_eigen)
add_test(NAME header_includes
         COMMAND ${CMAKE_COMMAND} -D INCLUDE=${PROJECT_SOURCE_DIR}/include -D
                 HEADERS_THAT_NEED_EIGEN=${need_eigen} -P
                 ${CMAKE_CURRENT_SOURCE_DIR}/header_includes.cmake)
