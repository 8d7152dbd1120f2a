include(CMakeFindDependencyMacro)
find_dependency(mis 0.1)
include(${CMAKE_CURRENT_LIST_DIR}/shading-targets.cmake)
