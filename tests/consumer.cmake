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
