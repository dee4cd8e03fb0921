// SPDX-License-Identifier: Apache-2.0
// A composable node that publishes on `beats`, for container_test.cpp.
#include <rclcpp_components/register_node_macro.hpp>
#include <std_msgs/msg/int32.hpp>

#include <rclcpp/rclcpp.hpp>

namespace hotpath::test {

class Beat : public rclcpp::Node {
 public:
  explicit Beat(const rclcpp::NodeOptions& options)
      : Node("beat", options),
        publisher_(create_publisher<std_msgs::msg::Int32>("beats", 10)),
        timer_(create_wall_timer(std::chrono::milliseconds(5),
                                 [this] { publisher_->publish(std_msgs::msg::Int32()); })) {}

 private:
  rclcpp::Publisher<std_msgs::msg::Int32>::SharedPtr publisher_;
  rclcpp::TimerBase::SharedPtr timer_;
};

}  // namespace hotpath::test

RCLCPP_COMPONENTS_REGISTER_NODE(hotpath::test::Beat)
