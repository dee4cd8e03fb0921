// SPDX-License-Identifier: Apache-2.0
// Rejection of runs that cannot succeed, before any process starts.
#include <algorithm>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/input_file.hpp"
#include "hotpath/live/thread_setup.hpp"
#include "live/live_run.hpp"
#include "live/rclcpp_process.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::live {

namespace {

/// Options of a transport or of rclcpp that the run does not use, Fast DDS in a build without it, and more
/// processes than the transport or the graph allows.
void check_transport(const Options& options, const Plan& plan,
                     const std::vector<setup::ExecutorSpec>& executors) {
  const bool dds = is_dds(plan.transport);
  const bool native = std::ranges::count(executors, setup::Stack::native, &setup::ExecutorSpec::stack) > 0;
  const std::string processes = program::concat("--processes ", plan.processes);
  refuse_any({{!options.rmw.empty() && plan.rclcpp.runner.empty(),
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
              {!dds && plan.processes > 1,
               program::concat(processes, " needs --transport fastdds: ", to_string(plan.transport),
                               " stays within one process")},
              {plan.processes > plan.graph->nodes.size(),
               program::concat(processes, ": the graph has only ", plan.graph->nodes.size(), " nodes")}});
}

/// A deployment that contradicts the options, or whose processors or policies this process may not use.
void check_deployment(const Plan& plan, const Deployment& deployment) {
  refuse_any({{plan.processes > 1, program::concat("--processes: deployment ", deployment.name,
                                                   " sets its own processes; leave it out")},
              {plan.executor_policy.has_value(),
               "--executor-policy applies to single executors; a deployment sets its own policies"},
              {deployment.processes.size() > 1 && !is_dds(plan.transport),
               program::concat("deployment ", deployment.name, " has ", deployment.processes.size(),
                               " processes, which need --transport fastdds")}});
  const std::vector<int> available = plan.cpus.empty() ? allowed_cpus() : plan.cpus;
  for (const DeployedExecutor& part : deployment.executors) {
    for (const int processor : part.processors) {
      if (std::ranges::count(available, processor) > 0) continue;
      throw InputError(
          deployment.file, part.line,
          program::concat("executor ", part.name, ": this run may not use processor ", processor),
          "take some of " + program::joined(available));
    }
    if (part.policy == ThreadPolicy{}) continue;
    const std::string refused =
        refusal({part.policy, true, part.processors.empty() ? plan.cpus : part.processors});
    const std::string place = deployment.file.empty() ? "" : program::concat(":", part.line, ": ");
    refuse_any(
        {{!refused.empty(), program::concat(deployment.file, place, "executor ", part.name, ": ", refused)}});
  }
}

}  // namespace

void refuse_any(const std::vector<std::pair<bool, std::string>>& sentences) {
  for (const auto& [applies, sentence] : sentences) {
    if (applies) throw program::UsageError(sentence);
  }
}

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

void check_run(const Options& options, const Plan& plan, const std::vector<setup::ExecutorSpec>& executors) {
  check_transport(options, plan, executors);
  for (const setup::ExecutorSpec& executor : executors) {
    if (!executor.entry) check_deployment(plan, executor.plan);
    if (executor.stack == setup::Stack::rclcpp) check_on_rclcpp(executor, plan);
  }
}

}  // namespace hotpath::live
