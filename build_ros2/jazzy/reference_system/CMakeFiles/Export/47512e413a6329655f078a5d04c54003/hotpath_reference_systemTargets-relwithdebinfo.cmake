#----------------------------------------------------------------
# Generated CMake target import file for configuration "RelWithDebInfo".
#----------------------------------------------------------------

# Commands may need to know the format version.
set(CMAKE_IMPORT_FILE_VERSION 1)

# Import target "hotpath_reference_system::graph" for configuration "RelWithDebInfo"
set_property(TARGET hotpath_reference_system::graph APPEND PROPERTY IMPORTED_CONFIGURATIONS RELWITHDEBINFO)
set_target_properties(hotpath_reference_system::graph PROPERTIES
  IMPORTED_LINK_INTERFACE_LANGUAGES_RELWITHDEBINFO "CXX"
  IMPORTED_LOCATION_RELWITHDEBINFO "${_IMPORT_PREFIX}/lib/libhotpath_reference_system_graph.a"
  )

list(APPEND _cmake_import_check_targets hotpath_reference_system::graph )
list(APPEND _cmake_import_check_files_for_hotpath_reference_system::graph "${_IMPORT_PREFIX}/lib/libhotpath_reference_system_graph.a" )

# Import target "hotpath_reference_system::simulated" for configuration "RelWithDebInfo"
set_property(TARGET hotpath_reference_system::simulated APPEND PROPERTY IMPORTED_CONFIGURATIONS RELWITHDEBINFO)
set_target_properties(hotpath_reference_system::simulated PROPERTIES
  IMPORTED_LINK_INTERFACE_LANGUAGES_RELWITHDEBINFO "CXX"
  IMPORTED_LOCATION_RELWITHDEBINFO "${_IMPORT_PREFIX}/lib/libhotpath_reference_system_simulated.a"
  )

list(APPEND _cmake_import_check_targets hotpath_reference_system::simulated )
list(APPEND _cmake_import_check_files_for_hotpath_reference_system::simulated "${_IMPORT_PREFIX}/lib/libhotpath_reference_system_simulated.a" )

# Import target "hotpath_reference_system::work" for configuration "RelWithDebInfo"
set_property(TARGET hotpath_reference_system::work APPEND PROPERTY IMPORTED_CONFIGURATIONS RELWITHDEBINFO)
set_target_properties(hotpath_reference_system::work PROPERTIES
  IMPORTED_LINK_INTERFACE_LANGUAGES_RELWITHDEBINFO "CXX"
  IMPORTED_LOCATION_RELWITHDEBINFO "${_IMPORT_PREFIX}/lib/libhotpath_reference_system_work.a"
  )

list(APPEND _cmake_import_check_targets hotpath_reference_system::work )
list(APPEND _cmake_import_check_files_for_hotpath_reference_system::work "${_IMPORT_PREFIX}/lib/libhotpath_reference_system_work.a" )

# Commands beyond this point should not need to know the version.
set(CMAKE_IMPORT_FILE_VERSION)
