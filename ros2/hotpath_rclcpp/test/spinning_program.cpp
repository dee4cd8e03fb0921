// SPDX-License-Identifier: Apache-2.0
// A program that knows nothing of hotpath. Its node spins with rclcpp::spin(), gets a subscription
// and a second timer while it spins, and ends after both ran; exit code 0 if a thread of the process
// is called hotpath_timers, 3 otherwise.
#include <filesystem>
#include <fstream>
#include <rclcpp/rclcpp.hpp>
#include <std_msgs/msg/int32.hpp>

namespace {

bool has_thread(const std::string& name) {
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string found;
    std::ifstream(thread.path() / "comm") >> found;
    if (found == name) return true;
  }
  return false;
}

class Program : public rclcpp::Node {
 public:
  Program() : Node("program") {
    first_ = create_wall_timer(std::chrono::milliseconds(10), [this] { add_more(); });
  }
  bool found = false;

 private:
  void add_more() {
    first_->cancel();
    publisher_ = create_publisher<std_msgs::msg::Int32>("program_topic", 10);
    subscription_ = create_subscription<std_msgs::msg::Int32>("program_topic", 10,
                                                              [this](std_msgs::msg::Int32::ConstSharedPtr) {
                                                                found = has_thread("hotpath_timers");
                                                                rclcpp::shutdown();
                                                              });
    second_ = create_wall_timer(std::chrono::milliseconds(10),
                                [this] { publisher_->publish(std_msgs::msg::Int32()); });
  }
  rclcpp::TimerBase::SharedPtr first_, second_;
  rclcpp::Publisher<std_msgs::msg::Int32>::SharedPtr publisher_;
  rclcpp::Subscription<std_msgs::msg::Int32>::SharedPtr subscription_;
};

}  // namespace

int main(int argc, char** argv) {
  rclcpp::init(argc, argv);
  const auto program = std::make_shared<Program>();
  rclcpp::spin(program);
  return program->found ? 0 : 3;
}
