# A translation unit that calls every core function on the device, compiled where nvcc is present. It is never
# run, so optimizing it, which takes a minute, is left out.
find_program(MIS_NVCC nvcc HINTS ENV CUDA_PATH PATHS /usr/local/cuda PATH_SUFFIXES bin)
if(MIS_NVCC)
    add_test(NAME cuda_core
             COMMAND ${MIS_NVCC} -std=c++17 -arch=sm_75 -Xcicc -O0 -Xptxas -O0 -Werror all-warnings
                     -Xcompiler=-Wall,-Wextra,-Wconversion,-Wshadow,-Werror -I ${PROJECT_SOURCE_DIR}/include
                     -c ${CMAKE_CURRENT_SOURCE_DIR}/cuda_core.cu -o ${CMAKE_CURRENT_BINARY_DIR}/cuda_core.o)
else()
    message(STATUS "No nvcc: the CUDA translation unit is not compiled")
endif()
