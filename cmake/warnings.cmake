# What this project's own programs are built with; users of mis::mis never see it. The presets turn warnings
# into errors (CMAKE_COMPILE_WARNING_AS_ERROR).
add_library(mis_warnings INTERFACE)
target_compile_options(
    mis_warnings INTERFACE $<$<CXX_COMPILER_ID:GNU,Clang,AppleClang>:-Wall;-Wextra;-Wpedantic;-Wconversion;-Wshadow>)
