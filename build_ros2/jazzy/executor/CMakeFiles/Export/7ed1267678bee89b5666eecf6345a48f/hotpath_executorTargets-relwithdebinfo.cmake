#----------------------------------------------------------------
# Generated CMake target import file for configuration "RelWithDebInfo".
#----------------------------------------------------------------

# Commands may need to know the format version.
set(CMAKE_IMPORT_FILE_VERSION 1)

# Import target "hotpath_executor::core" for configuration "RelWithDebInfo"
set_property(TARGET hotpath_executor::core APPEND PROPERTY IMPORTED_CONFIGURATIONS RELWITHDEBINFO)
set_target_properties(hotpath_executor::core PROPERTIES
  IMPORTED_LINK_INTERFACE_LANGUAGES_RELWITHDEBINFO "CXX"
  IMPORTED_LOCATION_RELWITHDEBINFO "${_IMPORT_PREFIX}/lib/libhotpath_executor_core.a"
  )

list(APPEND _cmake_import_check_targets hotpath_executor::core )
list(APPEND _cmake_import_check_files_for_hotpath_executor::core "${_IMPORT_PREFIX}/lib/libhotpath_executor_core.a" )

# Import target "hotpath_executor::live" for configuration "RelWithDebInfo"
set_property(TARGET hotpath_executor::live APPEND PROPERTY IMPORTED_CONFIGURATIONS RELWITHDEBINFO)
set_target_properties(hotpath_executor::live PROPERTIES
  IMPORTED_LINK_INTERFACE_LANGUAGES_RELWITHDEBINFO "CXX"
  IMPORTED_LOCATION_RELWITHDEBINFO "${_IMPORT_PREFIX}/lib/libhotpath_executor_live.a"
  )

list(APPEND _cmake_import_check_targets hotpath_executor::live )
list(APPEND _cmake_import_check_files_for_hotpath_executor::live "${_IMPORT_PREFIX}/lib/libhotpath_executor_live.a" )

# Commands beyond this point should not need to know the version.
set(CMAKE_IMPORT_FILE_VERSION)
