# SPDX-License-Identifier: Apache-2.0
# Settings that every package of hotpath shares.
include_guard(GLOBAL)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE RelWithDebInfo CACHE STRING "Build type" FORCE)
endif()
# Line tables are enough for profiles and backtraces; a debug build keeps everything.
add_compile_options($<$<CONFIG:RelWithDebInfo>:-g1>)
# GCC collects its garbage only from half a GiB on, which saves a tenth of the processor time.
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  add_compile_options(--param=ggc-min-heapsize=524288)
endif()
# A unity build compiles each target at once: most of the time is for headers and templates.
set(CMAKE_UNITY_BUILD_BATCH_SIZE 0)
option(HOTPATH_WARNINGS_AS_ERRORS "Treat compiler warnings as errors" OFF)
# The linker gold compares the source lines (-g1) of functions with the same name; the compiler sees
# one file at a time. Only an unoptimised build without unity has a symbol for each function.
set(HOTPATH_ONE_DEFINITION_FLAGS -g1 -fuse-ld=gold -Wl,--detect-odr-violations -Wl,--fatal-warnings)
option(HOTPATH_ONE_DEFINITION "Reject different definitions of one name; for builds with -O0" OFF)
if(HOTPATH_ONE_DEFINITION)
  add_compile_options(-g1)
  add_link_options(${HOTPATH_ONE_DEFINITION_FLAGS})
endif()
option(BUILD_TESTING "Build the tests" ON)
option(HOTPATH_SOURCE_FILES "Programs find graphs and scripts in the source tree before the installed ones" ON)
option(HOTPATH_FUZZ "Build the fuzz targets: needs clang, and the flags of the preset `fuzz`" OFF)
# The transport fastdds and everything that publishes over it. Off where Fast DDS or its generator
# is missing, and where a ROS 2 is sourced: a process must never load a second Fast DDS beside the
# one of ROS 2.
if(NOT DEFINED HOTPATH_FASTDDS)
  find_program(FASTDDSGEN fastddsgen)
  find_package(fastrtps 2.9 QUIET)
  if(DEFINED ENV{AMENT_PREFIX_PATH})
    set(fastdds_found OFF)
    message(STATUS "left out: the transport fastdds, --live, replay and the bridge, because the sourced ROS 2 "
      "has a Fast DDS of its own")
  elseif(FASTDDSGEN AND fastrtps_FOUND)
    set(fastdds_found ON)
  else()
    set(fastdds_found OFF)
    message(STATUS "left out: the transport fastdds, --live, replay and the bridge, because Fast DDS or its "
      "generator was not found (Debian: apt install libfastrtps-dev fastddsgen)")
  endif()
endif()
option(HOTPATH_FASTDDS "Build the transport fastdds" ${fastdds_found})

# hotpath_final_run_path(): links the programs of this folder with their installed run path. CMake
# pads the run path of a build tree with colons, which it replaces on installation; a trailing colon
# makes the loader search the current folder.
macro(hotpath_final_run_path)
  set(CMAKE_BUILD_WITH_INSTALL_RPATH ON)
  set(CMAKE_INSTALL_RPATH_USE_LINK_PATH ON)
endmacro()

# hotpath_data_folders(name folders...): sets `name` to these folders of the package, separated by
# colons: those of its source tree, then those that it installs into share/PACKAGE.
function(hotpath_data_folders name)
  set(trees ${CMAKE_INSTALL_PREFIX}/share/${PROJECT_NAME})
  if(HOTPATH_SOURCE_FILES)
    list(PREPEND trees ${PROJECT_SOURCE_DIR})
  endif()
  set(folders)
  foreach(tree IN LISTS trees)
    foreach(folder IN LISTS ARGN)
      list(APPEND folders ${tree}/${folder})
    endforeach()
  endforeach()
  list(JOIN folders ":" folders)
  set(${name} ${folders} PARENT_SCOPE)
endfunction()

# Warnings for the project's own code; generated code is compiled without them.
function(hotpath_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion)
  if(HOTPATH_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()

# hotpath_cold(target): compiles with -Og, which takes a fifth less time than -O1, what no job and no
# loop over jobs waits for.
function(hotpath_cold target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:RelWithDebInfo>:-Og>)
endfunction()

# hotpath_precompile(target headers...): precompiles the standard containers and these headers for the
# target; hotpath_precompile(target REUSE_FROM other) takes those of `other`, which must have the same
# compiler flags: GCC silently ignores them otherwise (-Winvalid-pch). A unity build reads the standard
# containers too seldom to precompile them alone.
function(hotpath_precompile target)
  if("${ARGV1}" STREQUAL REUSE_FROM)
    get_target_property(headers ${ARGV2} PRECOMPILE_HEADERS)
    if(headers)
      target_precompile_headers(${target} REUSE_FROM ${ARGV2})
    endif()
  elseif(ARGN OR NOT CMAKE_UNITY_BUILD)
    target_precompile_headers(${target} PRIVATE
      <algorithm> <array> <chrono> <filesystem> <fstream> <functional> <iostream> <map> <memory> <optional>
      <random> <ranges> <set> <sstream> <string> <thread> <unordered_map> <vector> ${ARGN})
  endif()
  target_compile_options(${target} PRIVATE -Winvalid-pch)
endfunction()

# hotpath_add_library(name sources...): target hotpath_<package>_<name>, alias and export
# hotpath_<package>::<name>.
function(hotpath_add_library name)
  set(target ${PROJECT_NAME}_${name})
  add_library(${target} STATIC ${ARGN})
  add_library(${PROJECT_NAME}::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  install(TARGETS ${target} EXPORT ${PROJECT_NAME} ARCHIVE DESTINATION lib COMPONENT development)
endfunction()

# hotpath_library(name sources...): hotpath_add_library with the package's include/ folder and the
# project's warnings.
function(hotpath_library name)
  hotpath_add_library(${name} ${ARGN})
  set(target ${PROJECT_NAME}_${name})
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:include>)
  target_compile_features(${target} PUBLIC cxx_std_20)
  hotpath_warnings(${target})
endfunction()

# hotpath_idl_library(name file.idl): hotpath_add_library with the code that fastddsgen generates
# from the file, without warnings. The headers compile as C++17.
function(hotpath_idl_library name file)
  find_package(fastcdr REQUIRED)
  find_package(fastrtps 2.9 REQUIRED)
  find_program(FASTDDSGEN fastddsgen REQUIRED)
  get_filename_component(file ${file} ABSOLUTE)
  get_filename_component(stem ${file} NAME_WE)
  set(generated ${CMAKE_CURRENT_BINARY_DIR}/idl/${name})
  set(sources ${generated}/${stem}.cxx ${generated}/${stem}PubSubTypes.cxx)
  set(headers ${generated}/${stem}.h ${generated}/${stem}PubSubTypes.h)
  add_custom_command(
    OUTPUT ${sources} ${headers}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${generated}
    COMMAND ${FASTDDSGEN} -replace -d ${generated} ${file} > ${generated}/log
    DEPENDS ${file}
    VERBATIM)
  hotpath_add_library(${name} ${sources})
  set(target ${PROJECT_NAME}_${name})
  # `generated_code` makes what clang-tidy needs to read the sources, and compiles nothing.
  add_custom_target(${target}_code DEPENDS ${headers})
  if(NOT TARGET generated_code)
    add_custom_target(generated_code)
  endif()
  add_dependencies(generated_code ${target}_code)
  target_compile_options(${target} PRIVATE -w)
  target_compile_features(${target} PUBLIC cxx_std_17)
  target_include_directories(${target} SYSTEM PUBLIC
    $<BUILD_INTERFACE:${generated}> $<INSTALL_INTERFACE:include>)
  target_link_libraries(${target} PUBLIC fastrtps fastcdr)
  install(FILES ${headers} DESTINATION include COMPONENT development)
endfunction()

# hotpath_export(dependencies...): headers, targets and a CMake config that finds the dependencies
# again.
function(hotpath_export)
  install(DIRECTORY include/ DESTINATION include)
  install(EXPORT ${PROJECT_NAME} NAMESPACE ${PROJECT_NAME}:: FILE ${PROJECT_NAME}Targets.cmake
    DESTINATION lib/cmake/${PROJECT_NAME})
  set(config "include(CMakeFindDependencyMacro)\n")
  foreach(dependency IN LISTS ARGN)
    string(APPEND config "find_dependency(${dependency})\n")
  endforeach()
  string(APPEND config "include(\"\${CMAKE_CURRENT_LIST_DIR}/${PROJECT_NAME}Targets.cmake\")\n")
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/${PROJECT_NAME}Config.cmake "${config}")
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${PROJECT_NAME}Config.cmake package.xml
    DESTINATION lib/cmake/${PROJECT_NAME})
  install(FILES package.xml DESTINATION share/${PROJECT_NAME})
endfunction()

# hotpath_test(name [SOURCES names...] [SHARDS n] LIBRARIES libs...): test program <name> from
# test/<source>.cpp of each source, by default <name>.cpp; GoogleTest. Each program is one ctest
# test, or n that share its cases: gtest_discover_tests would start a process for each of hundreds of
# millisecond cases, and would repeat costly fixtures. `--gtest_filter` selects cases.
function(hotpath_test name)
  cmake_parse_arguments(arg "" "SHARDS" "SOURCES;LIBRARIES" ${ARGN})
  find_package(GTest REQUIRED)
  if(NOT arg_SOURCES)
    set(arg_SOURCES ${name})
  endif()
  list(TRANSFORM arg_SOURCES REPLACE "(.+)" "${PROJECT_SOURCE_DIR}/test/\\1.cpp")
  set(target ${PROJECT_NAME}_${name})
  add_executable(${target} ${arg_SOURCES})
  target_link_libraries(${target} PRIVATE ${arg_LIBRARIES} GTest::gmock GTest::gtest_main)
  hotpath_cold(${target})  # the libraries do the slow work of a test
  hotpath_warnings(${target})
  if(NOT arg_SHARDS)
    add_test(NAME ${target} COMMAND ${target})
    set_tests_properties(${target} PROPERTIES TIMEOUT 300)
    return()
  endif()
  math(EXPR last "${arg_SHARDS} - 1")
  foreach(shard RANGE ${last})
    add_test(NAME ${target}_${shard} COMMAND ${target})
    set_tests_properties(${target}_${shard} PROPERTIES TIMEOUT 300
      ENVIRONMENT "GTEST_TOTAL_SHARDS=${arg_SHARDS};GTEST_SHARD_INDEX=${shard}")
  endforeach()
endfunction()

# hotpath_fuzz_target(name source libraries...): libFuzzer program fuzz_<name>, one of the target
# `fuzzers`.
function(hotpath_fuzz_target name source)
  add_executable(fuzz_${name} ${source})
  target_include_directories(fuzz_${name} PRIVATE ${CMAKE_SOURCE_DIR}/bench ${CMAKE_SOURCE_DIR}/analysis/include)
  target_link_libraries(fuzz_${name} PRIVATE ${ARGN})
  target_link_options(fuzz_${name} PRIVATE -fsanitize=fuzzer)
  set_target_properties(fuzz_${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/fuzz)
  hotpath_warnings(fuzz_${name})
  if(NOT TARGET fuzzers)
    add_custom_target(fuzzers)
  endif()
  add_dependencies(fuzzers fuzz_${name})
endfunction()
