# A study, ${PROGRAM}: bad input. ${REFUSED} are options with bad values, --name=value,--name=value,...
cmake_minimum_required(VERSION 3.21)
include(${CMAKE_CURRENT_LIST_DIR}/expect_refusal.cmake)

expect_refusal(--no-such-option)
string(REPLACE "," ";" REFUSED ${REFUSED})
foreach(option IN LISTS REFUSED)
    string(REPLACE "=" ";" option ${option})
    expect_refusal(${option})
endforeach()
# A folder below a file cannot be made, not even by root.
expect_refusal(--output ${CMAKE_CURRENT_LIST_FILE}/folder)
