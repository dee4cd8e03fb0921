# SPDX-License-Identifier: Apache-2.0
# Programs with tracepoints, for the tests of the sensor and of the packages that watch them.
if(TARGET traced_program)
  return()
endif()
set(folder ${CMAKE_CURRENT_LIST_DIR})
find_package(Threads REQUIRED)
# A stand-in for tracetools of the same file name, so that LD_LIBRARY_PATH replaces it by the real
# library.
add_library(tracetools_stand_in SHARED ${folder}/tracetools_stand_in.cpp)
set_target_properties(tracetools_stand_in PROPERTIES OUTPUT_NAME tracetools)
foreach(program traced_program traced_system)
  add_executable(${program} ${folder}/${program}.cpp)
  target_link_libraries(${program} PRIVATE tracetools_stand_in Threads::Threads)
endforeach()
add_library(humble_stand_in SHARED ${folder}/humble_stand_in.cpp)
add_executable(humble_program ${folder}/humble_program.cpp)
target_link_libraries(humble_program PRIVATE humble_stand_in)
foreach(target tracetools_stand_in traced_program traced_system humble_stand_in humble_program)
  target_compile_options(${target} PRIVATE -fno-sanitize=all)
  target_link_options(${target} PRIVATE -fno-sanitize=all)
  # They start in the build tree, also where a package links its programs with installed run paths.
  set_target_properties(${target} PROPERTIES BUILD_WITH_INSTALL_RPATH OFF)
  hotpath_warnings(${target})
endforeach()
