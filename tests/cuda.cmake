# Translation units that call every core function, and the estimators of optimal weights, on the device, and the
# benchmark of kernels, compiled where nvcc is present. They are never run, so optimizing them, which takes a minute, is left out.
find_program(MIS_NVCC nvcc HINTS ENV CUDA_PATH PATHS /usr/local/cuda PATH_SUFFIXES bin)
if(MIS_NVCC)
    set(cuda_core ${CMAKE_CURRENT_SOURCE_DIR}/cuda_core.cu)
    set(cuda_optimal ${CMAKE_CURRENT_SOURCE_DIR}/cuda_optimal.cu)
    set(cuda_benchmark ${PROJECT_SOURCE_DIR}/benchmarks/cuda/weights_benchmark.cu)
    foreach(test cuda_core cuda_optimal cuda_benchmark)
        add_test(NAME ${test}
                 COMMAND ${MIS_NVCC} -std=c++17 -arch=sm_75 -Xcicc -O0 -Xptxas -O0 -Werror all-warnings
                         -Xcompiler=-Wall,-Wextra,-Wconversion,-Wshadow,-Werror -I ${PROJECT_SOURCE_DIR}/include
                         -c ${${test}} -o ${CMAKE_CURRENT_BINARY_DIR}/${test}.o)
    endforeach()
else()
    message(STATUS "No nvcc: the CUDA translation units are not compiled")
endif()
