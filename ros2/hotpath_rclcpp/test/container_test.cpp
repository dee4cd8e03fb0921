// SPDX-License-Identifier: Apache-2.0
// Tests component_container_hotpath through the services of composition_interfaces.
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <composition_interfaces/srv/list_nodes.hpp>
#include <composition_interfaces/srv/load_node.hpp>
#include <composition_interfaces/srv/unload_node.hpp>
#include <std_msgs/msg/int32.hpp>

#include "executors.hpp"

namespace hotpath::test {
namespace {

using composition_interfaces::srv::ListNodes;
using composition_interfaces::srv::LoadNode;
using composition_interfaces::srv::UnloadNode;

pid_t start_container(const std::string& executor, const std::string& more = "learn:=true") {
  const pid_t id = fork();
  if (id != 0) return id;
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // a failed test leaves no container behind
  const std::string parameter = "executor:=" + executor;
  execl(HOTPATH_CONTAINER, HOTPATH_CONTAINER, "--ros-args", "-p", parameter.c_str(), "-p", more.c_str(),
        nullptr);
  _exit(127);
}

int end_of(pid_t id) {
  int status = 0;
  waitpid(id, &status, 0);
  return status;
}

class Container : public testing::Test {
 protected:
  void SetUp() override {
    rclcpp::init(0, nullptr);
    node = std::make_shared<rclcpp::Node>("asks");
  }
  void TearDown() override {
    node.reset();
    rclcpp::shutdown();
  }
  template <class Service>
  typename Service::Response::SharedPtr call(const std::string& name,
                                             typename Service::Request::SharedPtr request) {
    const auto client = node->create_client<Service>("/ComponentManager/_container/" + name);
    if (!client->wait_for_service(20s)) return nullptr;
    auto answer = client->async_send_request(request);
    if (rclcpp::spin_until_future_complete(node, answer, 20s) != rclcpp::FutureReturnCode::SUCCESS)
      return nullptr;
    return answer.future.get();
  }
  rclcpp::Node::SharedPtr node;
};

TEST_F(Container, LoadsAndUnloadsNodesWhileItRuns) {
  for (const std::string executor : {"rm-ro", "edf-re"}) {
    const pid_t container = start_container(executor);
    std::atomic_int beats{0};
    const auto subscription = node->create_subscription<std_msgs::msg::Int32>(
        "beats", 10, [&](std_msgs::msg::Int32::ConstSharedPtr) { ++beats; });
    const auto load = std::make_shared<LoadNode::Request>();
    load->package_name = "hotpath_rclcpp";
    load->plugin_name = "hotpath::test::Beat";
    const auto loaded = call<LoadNode>("load_node", load);
    ASSERT_TRUE(loaded);
    ASSERT_TRUE(loaded->success) << loaded->error_message;
    EXPECT_TRUE(eventually([&] {
      rclcpp::spin_some(node);
      return beats >= 5;
    }));
    const auto list = call<ListNodes>("list_nodes", std::make_shared<ListNodes::Request>());
    ASSERT_TRUE(list);
    EXPECT_EQ(list->full_node_names, std::vector<std::string>{"/beat"});
    const auto unload = std::make_shared<UnloadNode::Request>();
    unload->unique_id = loaded->unique_id;
    const auto unloaded = call<UnloadNode>("unload_node", unload);
    ASSERT_TRUE(unloaded);
    EXPECT_TRUE(unloaded->success);
    rclcpp::spin_some(node);
    const int before = beats;
    for (int i = 0; i < 10; ++i) {  // samples published before an answer arrive with the answer
      const auto after = call<ListNodes>("list_nodes", std::make_shared<ListNodes::Request>());
      ASSERT_TRUE(after);
      EXPECT_TRUE(after->full_node_names.empty());
      rclcpp::spin_some(node);
    }
    EXPECT_LE(beats - before, 10);  // at most the depth of the history
    kill(container, SIGINT);
    const int status = end_of(container);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << executor << ": " << status;
  }
}

TEST_F(Container, SaysThatThereIsNoSuchExecutor) {
  const int status = end_of(start_container("nonsense"));
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 1);
}

TEST_F(Container, SaysThatItsFileIsMissing) {
  const int status = end_of(start_container("rm-ro", "config:=/nowhere/executor.yaml"));
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 1);
}

TEST_F(Container, SaysThatANumberOfThreadsIsNone) {
  for (const std::string threads : {"threads:=-1", "threads:=0", "threads:=4294967297"}) {
    const int status = end_of(start_container("rm-ro", threads));
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 1) << threads;
  }
}

}  // namespace
}  // namespace hotpath::test
