#----------------------------------------------------------------
# Generated CMake target import file for configuration "RelWithDebInfo".
#----------------------------------------------------------------

# Commands may need to know the format version.
set(CMAKE_IMPORT_FILE_VERSION 1)

# Import target "hotpath_rclcpp::hotpath_rclcpp" for configuration "RelWithDebInfo"
set_property(TARGET hotpath_rclcpp::hotpath_rclcpp APPEND PROPERTY IMPORTED_CONFIGURATIONS RELWITHDEBINFO)
set_target_properties(hotpath_rclcpp::hotpath_rclcpp PROPERTIES
  IMPORTED_LINK_DEPENDENT_LIBRARIES_RELWITHDEBINFO "rcpputils::rcpputils"
  IMPORTED_LOCATION_RELWITHDEBINFO "${_IMPORT_PREFIX}/lib/libhotpath_rclcpp.so"
  IMPORTED_SONAME_RELWITHDEBINFO "libhotpath_rclcpp.so"
  )

list(APPEND _cmake_import_check_targets hotpath_rclcpp::hotpath_rclcpp )
list(APPEND _cmake_import_check_files_for_hotpath_rclcpp::hotpath_rclcpp "${_IMPORT_PREFIX}/lib/libhotpath_rclcpp.so" )

# Commands beyond this point should not need to know the version.
set(CMAKE_IMPORT_FILE_VERSION)
