include(CMakeFindDependencyMacro)
find_dependency(hotpath_executor)
find_dependency(yaml-cpp)
include("${CMAKE_CURRENT_LIST_DIR}/hotpath_reference_systemTargets.cmake")
