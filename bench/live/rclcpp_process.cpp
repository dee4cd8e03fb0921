// SPDX-License-Identifier: Apache-2.0
#include "live/rclcpp_process.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "hotpath/reference_system/graph_file.hpp"
#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "results/executor_label.hpp"

namespace hotpath::live {

namespace {

using nlohmann::json;

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

/// The first file of this path below the prefixes of the sourced ROS 2 that can be accessed so; empty: none.
std::string find_in_ros(const std::string& path, int mode) {
  std::istringstream prefixes(environment("AMENT_PREFIX_PATH"));
  for (std::string prefix; std::getline(prefixes, prefix, ':');) {
    std::string file = std::filesystem::path(prefix) / path;
    if (access(file.c_str(), mode) == 0) return file;
  }
  return "";
}

json plan_json(const Plan& plan, const RunMemory& memory, const Channel& coordinator) {
  const RunMemory::Size size = memory_size(plan, 0);
  json phases = json::array();
  for (const Task& task : plan.tasks.set.tasks) phases.push_back(task.phase.count());
  fcntl(memory.descriptor(), F_SETFD, 0);
  json settings = {{"layout", kRunLayout},
                   {"graph", plan.rclcpp.graph_file},
                   {"executor", setup::name_with_rules(*plan.executor.entry, plan.executor.scheduler)},
                   {"threads", setup::job_threads(plan.executor)},
                   {"phases_ns", phases},
                   {"work", to_string(plan.graph->work)},
                   {"divisions_per_us", plan.calibration.value_or(Calibration{}).divisions_per_us},
                   {"namespace", "/hotpath_" + std::to_string(getppid())},
                   {"cpus", plan.cpus},
                   {"lock_memory", plan.lock_memory},
                   {"time_out_ns", set_up_limit(plan).count()},
                   {"channel", coordinator.for_program()},
                   {"memory",
                    {{"descriptor", memory.descriptor()},
                     {"tasks", size.tasks},
                     {"workers", size.workers},
                     {"jobs", size.jobs},
                     {"chains", size.chains},
                     {"executors", size.executors}}}};
  if (plan.rclcpp.load_percent) settings["load"] = *plan.rclcpp.load_percent;
  if (plan.executor_policy) settings["executor_policy"] = to_string(*plan.executor_policy);
  if (plan.timer_policy) settings["timer_policy"] = to_string(*plan.timer_policy);
  return settings;
}

/// Throws UsageError with a remedy.
std::string find_rclcpp_runner() {
  std::string path = environment("HOTPATH_ROS2_RUNNER");
  if (environment("AMENT_PREFIX_PATH").empty()) {
    throw program::UsageError(
        "--stack rclcpp needs ROS 2: source /opt/ros/DISTRO/setup.bash, and install/setup.bash of the "
        "workspace with hotpath_rclcpp_system (launch_scripts/ros2_build.sh)");
  }
  if (!path.empty()) {
    if (access(path.c_str(), X_OK) == 0) return path;
    throw program::UsageError(program::concat("--stack rclcpp: there is no executable program ", path));
  }
  std::string found = find_in_ros("lib/hotpath_rclcpp_system/hotpath_rclcpp_runner", X_OK);
  if (!found.empty()) return found;
  throw program::UsageError(
      "no sourced ROS 2 workspace has hotpath_rclcpp_system: build it with launch_scripts/ros2_build.sh "
      "and source its setup.bash, or name the program in $HOTPATH_ROS2_RUNNER");
}

}  // namespace

RclcppPlan rclcpp_plan(const Options& options, const Plan& plan) {
  RclcppPlan rclcpp{find_rclcpp_runner(), std::filesystem::absolute(find_graph(options.graph)),
                    options.load_given};
  std::vector<std::pair<bool, std::string>> unsupported = {
      {plan.processes > 1 || !options.deployments.empty(),
       "runs one executor in one process; leave --processes and --deployments out"},
      {options.rate_percent || options.copies > 1 || !options.set.empty(),
       "takes the graph's nodes and periods as they are; leave --copies, --rate and --set out"},
      {!is_dds(plan.transport), "carries messages over the middleware of ROS 2; leave --transport out"},
      {options.entity_order != setup::EntityOrder{},
       "orders its entities by their addresses; leave --entity-order out"},
      {plan.fastdds.network != FastDdsOptions{}.network,
       "carries messages over the middleware of ROS 2; leave --network out"},
      {std::ranges::any_of(plan.tasks.set.tasks, &Task::service),
       "has subscriptions in place of the graph's services; take `service: true` out of the graph"}};
  for (auto& [given, sentence] : unsupported) sentence.insert(0, "--stack rclcpp ");
  refuse_any(unsupported);
  for (const std::string& rmw : options.rmw) {
    refuse_any({{find_in_ros(program::concat("lib/librmw_", rmw, "_cpp.so"), R_OK).empty(),
                 program::concat("--rmw ", rmw, ": the sourced ROS 2 has no package rmw_", rmw,
                                 "_cpp; install it, or name another middleware, such as "
                                 "fastrtps or cyclonedds")}});
  }
  return rclcpp;
}

void check_on_rclcpp(const setup::ExecutorSpec& executor, const Plan& plan) {
  const std::string name = environment("ROS_DISTRO");
  const std::optional<RosDistro> sourced = parse<RosDistro>(name);
  const auto available = [&](const ExecutorTraits& traits) {
    return traits.on_rclcpp && (!sourced || traits.on_rclcpp->overlap({*sourced, *sourced}));
  };
  const ExecutorTraits& traits = executor.entry->traits;
  if (available(traits)) {
    const bool own_timers =
        traits.family == Family::priority_events || traits.timers == TimerHandling::polled;
    if (own_timers || !plan.timer_policy) return;
    throw program::UsageError(
        program::concat("--timer-policy: the timer thread of ", executor.label,
                        " belongs to rclcpp and takes the policy of --executor-policy; leave it out"));
  }
  std::string others;
  for (const ExecutorEntry& e : executors()) {
    if (available(e.traits)) others += program::concat(others.empty() ? "" : ", ", e.name);
  }
  throw program::UsageError(program::concat("executor `", executor.label,
                                            "`: ", sourced ? "ROS 2 " + name : "rclcpp",
                                            " has no such executor; rclcpp has ", others));
}

int become_rclcpp_runner(const Plan& plan, const RunMemory& memory, const Channel& coordinator) {
  std::vector<std::string> words = {plan.rclcpp.runner, plan_json(plan, memory, coordinator).dump()};
  // rclcpp has no partitions: the namespace keeps out other programs of this machine, and the
  // runner keeps out other machines.
  const results::ExecutorLabel label(plan.executor.label);
  if (!label.middleware().empty())
    setenv("RMW_IMPLEMENTATION", program::concat("rmw_", label.middleware(), "_cpp").c_str(), 1);
  setenv("ROS_DOMAIN_ID", std::to_string(plan.fastdds.domain).c_str(), 1);
  execv(words.front().c_str(), program::argument_list(words).data());
  coordinator.send({ChannelMessage::Kind::failed,
                    {},
                    program::concat(words.front(), " cannot be started: ", std::strerror(errno))});
  return 1;
}

}  // namespace hotpath::live
