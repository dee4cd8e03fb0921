# SPDX-License-Identifier: Apache-2.0
# Debian packages by CPack: `hotpath`, and `hotpath-ros1-bridge` where the bridge is built.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME hotpath)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX ${CMAKE_INSTALL_PREFIX})
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL hotpath)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_MAINTAINER "hotpath maintainers <maintainers@hotpath.example.org>")
set(CPACK_DEBIAN_HOTPATH_PACKAGE_NAME hotpath)
set(CPACK_DEBIAN_HOTPATH_PACKAGE_SECTION science)
set(CPACK_DEBIAN_HOTPATH_PACKAGE_DEPENDS
  "python3-jinja2, python3-matplotlib, python3-numpy, python3-tqdm, util-linux")
set(CPACK_DEBIAN_HOTPATH_PACKAGE_RECOMMENDS "graphviz")
set(CPACK_COMPONENT_HOTPATH_DESCRIPTION "Latency of a robot's node graph under ROS executors
 Measures, simulates, bounds and explains how long data take along the hot
 path of a node graph, predicts it from traces of real systems, and compares
 executors.")
install(FILES LICENSE DESTINATION share/doc/hotpath RENAME copyright COMPONENT hotpath)
if(TARGET hotpath_ros1_bridge)
  list(APPEND CPACK_COMPONENTS_ALL bridge)
  set(CPACK_DEBIAN_BRIDGE_PACKAGE_NAME hotpath-ros1-bridge)
  set(CPACK_DEBIAN_BRIDGE_PACKAGE_SECTION science)
  set(CPACK_DEBIAN_BRIDGE_PACKAGE_RECOMMENDS "hotpath, python3-roslaunch, rosout, rviz")
  set(CPACK_COMPONENT_BRIDGE_DESCRIPTION "Shows a running hotpath benchmark in ROS 1
 Receives the telemetry of a benchmark over Fast DDS and publishes ROS 1
 topics: latencies, markers of the graph, diagnostics.")
  install(FILES LICENSE DESTINATION share/doc/hotpath-ros1-bridge RENAME copyright COMPONENT bridge)
endif()
include(CPack)
