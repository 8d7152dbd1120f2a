# The study of bias, ${PROGRAM}: bad input.
cmake_minimum_required(VERSION 3.21)
include(${CMAKE_CURRENT_LIST_DIR}/expect_refusal.cmake)

expect_refusal(--largest 0)
expect_refusal(--largest many)
expect_refusal(--per-decade -1)
expect_refusal(--repetitions 0)
expect_refusal(--seed x)
expect_refusal(--no-such-option)
# A folder below a file cannot be made, not even by root.
expect_refusal(--largest 1 --output ${CMAKE_CURRENT_LIST_FILE}/folder)
