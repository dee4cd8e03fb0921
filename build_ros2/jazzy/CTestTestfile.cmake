# CMake generated Testfile for 
# Source directory: /work/h/ros2/ros2/hotpath_rclcpp
# Build directory: /work/h/ros2/build_ros2/jazzy
# 
# This file includes the relevant testing commands required for 
# testing this directory and lists subdirectories to be tested as well.
subdirs("executor")
subdirs("reference_system")
