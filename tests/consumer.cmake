# What users do, in each of the ways there are: mis, or a small project that uses it, configured, built and run.
set(consumers ${CMAKE_CURRENT_BINARY_DIR}/consumer)

# mis_test_build(NAME SOURCE OPTIONS... COMMAND...): SOURCE is configured with the OPTIONS and built in
# ${consumers}/NAME, then the COMMAND is run.
function(mis_test_build name source)
    cmake_parse_arguments(PARSE_ARGV 2 arg "" "" "OPTIONS;COMMAND")
    add_test(
        NAME ${name}
        COMMAND
            ${CMAKE_CTEST_COMMAND} --build-and-test ${source} ${consumers}/${name} --build-generator ${CMAKE_GENERATOR}
            --build-options -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER} ${arg_OPTIONS} --test-command ${arg_COMMAND})
endfunction()

# mis_test_consumer(NAME WAYS OPTIONS...): the ways are separated by commas.
function(mis_test_consumer name ways)
    mis_test_build(consumer_${name} ${CMAKE_CURRENT_SOURCE_DIR}/consumer
                   OPTIONS -DCONSUME=${ways} -DMIS_SOURCE=${PROJECT_SOURCE_DIR} ${ARGN}
                   COMMAND ${consumers}/consumer_${name}/consumer)
endfunction()

# mis_test_library(NAME OPTIONS...): built and installed
function(mis_test_library name)
    set(library ${consumers}/library_${name})
    mis_test_build(library_${name} ${CMAKE_CURRENT_SOURCE_DIR}/library OPTIONS -DCONSUME=${name} ${ARGN}
                   COMMAND ${CMAKE_COMMAND} --install ${library} --prefix ${library}/prefix)
    set_tests_properties(library_${name} PROPERTIES FIXTURES_SETUP library_${name})
endfunction()

# From a build of its own, so that what was installed by hand from the one with the tests can still be uninstalled.
set(prefix ${consumers}/prefix)
mis_test_build(install ${PROJECT_SOURCE_DIR}
               OPTIONS -DMIS_BUILD_TESTS=OFF -DMIS_BUILD_EXAMPLES=OFF -DMIS_BUILD_BENCHMARKS=OFF
               COMMAND ${CMAKE_COMMAND} --install ${consumers}/install --prefix ${prefix})
set_tests_properties(install PROPERTIES FIXTURES_SETUP installed)

mis_test_consumer(add_subdirectory add_subdirectory)
mis_test_consumer(fetch_content fetch_content)
mis_test_consumer(find_package find_package -Dmis_ROOT=${prefix})
mis_test_consumer(added_twice add_subdirectory,add_subdirectory,fetch_content,find_package -Dmis_ROOT=${prefix})
mis_test_consumer(fetched_twice fetch_content,add_subdirectory)
mis_test_consumer(found_twice find_package,add_subdirectory,fetch_content -Dmis_ROOT=${prefix})
mis_test_consumer(two_versions add_subdirectory,another_version)
set_tests_properties(consumer_find_package consumer_added_twice consumer_found_twice PROPERTIES FIXTURES_REQUIRED
                                                                                                installed)
set_tests_properties(consumer_two_versions PROPERTIES PASS_REGULAR_EXPRESSION
                                                      "mis ${PROJECT_VERSION} was added first.* sum 1")

# A library that links mis, and who uses it: installed, with mis of its own, or beside mis; and where it was built.
mis_test_library(add_subdirectory -DMIS_SOURCE=${PROJECT_SOURCE_DIR} -DCMAKE_INSTALL_INCLUDEDIR=headers)
mis_test_consumer(library_with_mis library -Dshading_ROOT=${consumers}/library_add_subdirectory/prefix)
mis_test_consumer(library_not_installed library -Dshading_ROOT=${consumers}/library_add_subdirectory
                  -Dmis_ROOT=${consumers}/library_add_subdirectory/mis)
set_tests_properties(consumer_library_with_mis consumer_library_not_installed
                     PROPERTIES FIXTURES_REQUIRED library_add_subdirectory)

mis_test_library(find_package -Dmis_ROOT=${prefix})
mis_test_consumer(library_beside_mis library -Dshading_ROOT=${consumers}/library_find_package/prefix
                  -Dmis_ROOT=${prefix})
set_tests_properties(library_find_package PROPERTIES FIXTURES_REQUIRED installed)
set_tests_properties(consumer_library_beside_mis PROPERTIES FIXTURES_REQUIRED "installed;library_find_package")

find_program(MIS_PKG_CONFIG NAMES pkg-config pkgconf)
if(MIS_PKG_CONFIG)
    add_test(NAME consumer_pkg_config
             COMMAND ${CMAKE_COMMAND} -D PKG_CONFIG=${MIS_PKG_CONFIG} -D CXX=${CMAKE_CXX_COMPILER}
                     -D PREFIX=${prefix} -D VERSION=${PROJECT_VERSION}
                     -D SOURCE=${CMAKE_CURRENT_SOURCE_DIR}/consumer/main.cpp
                     -D PROGRAM=${consumers}/consumer_pkg_config -P ${CMAKE_CURRENT_SOURCE_DIR}/pkg_config.cmake)
    set_tests_properties(consumer_pkg_config PROPERTIES FIXTURES_REQUIRED installed)
else()
    message(STATUS "No pkg-config: its file is not tested")
endif()

add_test(NAME consumer_single_header
         COMMAND ${CMAKE_COMMAND} -D SCRIPT=${PROJECT_SOURCE_DIR}/cmake/single_header.cmake -D CXX=${CMAKE_CXX_COMPILER}
                 -D FOLDER=${consumers}/single_header -D SOURCE=${CMAKE_CURRENT_SOURCE_DIR}/consumer/main.cpp -P
                 ${CMAKE_CURRENT_SOURCE_DIR}/single_header.cmake)

add_test(NAME uninstall COMMAND ${CMAKE_COMMAND} -D BUILD=${consumers}/install -D FOLDER=${consumers}/uninstall -P
                                ${CMAKE_CURRENT_SOURCE_DIR}/uninstall.cmake)
set_tests_properties(uninstall PROPERTIES FIXTURES_REQUIRED installed)
