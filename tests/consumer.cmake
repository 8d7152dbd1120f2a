# A small project that uses the library, configured, built and run in each of the ways a user can get it.
set(prefix ${CMAKE_CURRENT_BINARY_DIR}/consumer/prefix)
add_test(NAME install COMMAND ${CMAKE_COMMAND} --install ${PROJECT_BINARY_DIR} --prefix ${prefix})
set_tests_properties(install PROPERTIES FIXTURES_SETUP installed)

foreach(way add_subdirectory fetch_content find_package)
    set(folder ${CMAKE_CURRENT_BINARY_DIR}/consumer/${way})
    add_test(
        NAME consumer_${way}
        COMMAND
            ${CMAKE_CTEST_COMMAND} --build-and-test ${CMAKE_CURRENT_SOURCE_DIR}/consumer ${folder}
            --build-generator ${CMAKE_GENERATOR} --build-options -DCONSUME=${way}
            -DMIS_SOURCE=${PROJECT_SOURCE_DIR} -DCMAKE_PREFIX_PATH=${prefix}
            -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER} --test-command ${folder}/consumer)
endforeach()
set_tests_properties(consumer_find_package PROPERTIES FIXTURES_REQUIRED installed)
