// SPDX-License-Identifier: Apache-2.0
#include "live/live_checks.hpp"

#include <algorithm>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/input_file.hpp"
#include "hotpath/live/thread_setup.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::live {

namespace {

/// Reports a policy that the system does not permit.
void check_policy(const Plan& plan, const Deployment& deployment, const DeployedExecutor& executor) {
  if (executor.policy == ThreadPolicy{}) return;
  const auto& processors = executor.processors.empty() ? plan.cpus : executor.processors;
  const std::string refused = refusal({executor.policy, true, processors});
  if (refused.empty()) return;
  throw program::UsageError(program::concat(
      deployment.file, deployment.file.empty() ? "" : program::concat(":", executor.line, ": "), "executor ",
      executor.name, ": ", refused));
}

}  // namespace

std::vector<int> parse_cpus(const std::string& text) {
  const auto refuse = [&](const auto&... words) {
    throw program::UsageError(program::concat("--cpus ", text, ": ", words...));
  };
  std::set<int> cpus;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const std::string_view range = part;
    const int first = parse<int>(range.substr(0, range.find('-'))).value_or(-1);
    const int last = parse<int>(range.substr(range.find('-') + 1)).value_or(-1);
    if (first < 0 || last < first || last > 4095) {
      refuse("`", part, "` is not a processor number or a range like 2-3");
    }
    for (int cpu = first; cpu <= last; ++cpu) cpus.insert(cpu);
  }
  const std::vector<int> available = allowed_cpus();
  for (const int cpu : cpus) {
    if (std::ranges::find(available, cpu) != available.end()) continue;
    refuse("this process may not use processor ", cpu, "; it may use ", program::joined(available, ","));
  }
  return {cpus.begin(), cpus.end()};
}

ThreadPolicy parse_policy(const std::string& text) try {
  return parse_thread_policy(text);
} catch (const std::invalid_argument& error) {
  throw program::UsageError(error.what());
}

void check_rclcpp_options(const Options& options, const Plan& plan) {
  const std::pair<bool, const char*> unsupported[] = {
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
  for (const auto& [given, sentence] : unsupported) {
    if (given) throw program::UsageError(program::concat("--stack rclcpp ", sentence));
  }
}

void check_transport(const Options& options, const Plan& plan,
                     const std::vector<setup::ExecutorSpec>& executors) {
  const bool dds = is_dds(plan.transport);
  const bool native = std::ranges::count(executors, setup::Stack::native, &setup::ExecutorSpec::stack) > 0;
  const std::string processes = program::concat("--processes ", plan.processes);
  const std::pair<bool, std::string> refused[] = {
      {!options.rmw.empty() && plan.rclcpp.runner.empty(),
       "--rmw needs --stack rclcpp; add it, or leave --rmw out"},
      {!dds && plan.fastdds.network != FastDdsOptions{}.network,
       "--network needs --transport fastdds; leave it out"},
      {!dds && plan.all_interfaces && !options.live,
       "--all-interfaces needs --transport fastdds; leave it out"},
      {!dds && plan.fastdds.domain != FastDdsOptions{}.domain && !options.live,
       "--domain needs --transport fastdds; leave it out"},
      {!has_fastdds() && native && dds,
       "this hotpath was built without Fast DDS: take --transport intra_process"},
      {!has_fastdds() && options.live,
       "--live needs Fast DDS, and this hotpath was built without it; leave --live out"},
      {!dds && plan.processes > 1, program::concat(processes, " needs --transport fastdds: ",
                                                   to_string(plan.transport), " stays within one process")},
      {plan.processes > plan.graph->nodes.size(),
       program::concat(processes, ": the graph has only ", plan.graph->nodes.size(), " nodes")}};
  for (const auto& [given, sentence] : refused) {
    if (given) throw program::UsageError(sentence);
  }
}

void check_deployment(const Plan& plan, const setup::ExecutorSpec& executor) {
  if (executor.entry) return;
  const Deployment& deployment = executor.plan;
  if (plan.processes > 1) {
    throw program::UsageError(program::concat("--processes: deployment ", deployment.name,
                                              " sets its own processes; leave it out"));
  }
  if (plan.executor_policy) {
    throw program::UsageError(
        "--executor-policy applies to single executors; a deployment sets its own policies");
  }
  if (deployment.processes.size() > 1 && !is_dds(plan.transport)) {
    throw program::UsageError(program::concat("deployment ", deployment.name, " has ",
                                              deployment.processes.size(),
                                              " processes, which need --transport fastdds"));
  }
  const std::vector<int> available = plan.cpus.empty() ? allowed_cpus() : plan.cpus;
  for (const DeployedExecutor& part : deployment.executors) {
    for (const int processor : part.processors) {
      if (std::ranges::count(available, processor) > 0) continue;
      throw InputError(
          deployment.file, part.line,
          program::concat("executor ", part.name, ": this run may not use processor ", processor),
          "take some of " + program::joined(available));
    }
    check_policy(plan, deployment, part);
  }
}

}  // namespace hotpath::live
