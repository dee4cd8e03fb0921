// SPDX-License-Identifier: Apache-2.0
// Runs one repetition of `hotpath run --stack rclcpp`. Its only argument is the plan as JSON.
#include <rclcpp/version.h>
#include <csignal>
#include <iostream>
#include <nlohmann/json.hpp>

#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/run_channel.hpp"
#include "system.hpp"

namespace hotpath {
namespace {

using nlohmann::json;

void run(const json& plan, const Channel& coordinator) {
  if (plan.value("layout", 0) != kRunLayout) throw std::runtime_error(kOtherLayout);
  Graph graph = load_graph(plan.at("graph"));
  if (plan.contains("work")) graph.work = *parse<WorkMode>(plan.at("work").get<std::string>());
  if (plan.contains("load")) scale_to_load(graph, plan.at("load"));
  GraphTasks tasks = make_tasks(graph);
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    tasks.set.tasks[id].phase = Duration(plan.at("phases_ns").at(id).get<std::int64_t>());
  }
  if (const std::vector<int> cpus = plan.at("cpus"); !cpus.empty()) pin_to_cpus(cpus);
  if (plan.at("lock_memory")) lock_memory();
  const json& size = plan.at("memory");
  RunMemory memory(
      {size.at("tasks"), size.at("workers"), size.at("jobs"), size.at("chains"), size.at("executors")},
      size.at("descriptor"));
  RclcppSystem system(graph, tasks, plan, memory);
  const auto settle = [&] {
    // Nothing to wait for: within a process, no sample is in transit; untaken samples are in the
    // middleware.
  };
  RunLife(coordinator)
      .live_through(system, now() + Duration(plan.at("time_out_ns").get<std::int64_t>()), settle);
}

/// Keeps all traffic on this machine. Since Iron, Humble's variable causes a warning.
void stay_on_this_machine() {
#if RCLCPP_VERSION_GTE(21, 0, 0)
  unsetenv("ROS_LOCALHOST_ONLY");
  setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST", 1);
#else
  setenv("ROS_LOCALHOST_ONLY", "1", 1);
#endif
}

}  // namespace
}  // namespace hotpath

int main(int argc, char** argv) {
  using namespace hotpath;
  const json plan = json::parse(argc == 2 ? argv[1] : "", nullptr, /*allow_exceptions=*/false);
  if (!plan.contains("channel") || !plan["channel"].is_number_integer()) {
    std::cerr << "Do not start this program directly: `hotpath run --stack rclcpp` starts it with a plan.\n";
    return 2;
  }
  const Channel coordinator(plan["channel"].get<int>());
  // The coordinator handles signals from the terminal.
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_IGN);
  int code = 1;
  try {
    stay_on_this_machine();
    rclcpp::init(0, nullptr, rclcpp::InitOptions(), rclcpp::SignalHandlerOptions::None);
    rclcpp::get_logger("hotpath_rclcpp").set_level(rclcpp::Logger::Level::Warn);
    run(plan, coordinator);
    code = 0;
  } catch (const CoordinatorGone&) {
  } catch (const std::exception& error) {
    coordinator.send({ChannelMessage::Kind::failed, {}, error.what()});
  }
  rclcpp::shutdown();
  return code;
}
