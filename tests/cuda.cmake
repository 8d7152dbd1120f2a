# Translation units that call every core function, and the estimators of optimal weights, on the device, compiled
# where nvcc is present. They are never run, so optimizing them, which takes a minute, is left out.
find_program(MIS_NVCC nvcc HINTS ENV CUDA_PATH PATHS /usr/local/cuda PATH_SUFFIXES bin)
if(MIS_NVCC)
    foreach(test cuda_core cuda_optimal)
        add_test(NAME ${test}
                 COMMAND ${MIS_NVCC} -std=c++17 -arch=sm_75 -Xcicc -O0 -Xptxas -O0 -Werror all-warnings
                         -Xcompiler=-Wall,-Wextra,-Wconversion,-Wshadow,-Werror -I ${PROJECT_SOURCE_DIR}/include
                         -c ${CMAKE_CURRENT_SOURCE_DIR}/${test}.cu -o ${CMAKE_CURRENT_BINARY_DIR}/${test}.o)
    endforeach()
else()
    message(STATUS "No nvcc: the CUDA translation units are not compiled")
endif()
