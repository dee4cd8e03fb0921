// SPDX-License-Identifier: Apache-2.0
#include "watch/stated_contract.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <map>
#include <optional>
#include <vector>

#include "program/errors.hpp"
#include "setup/deployed_system.hpp"
#include "setup/executor_spec.hpp"
#include "watch/contract.hpp"

namespace hotpath::watch {

namespace {

class StatedContract {
 public:
  explicit StatedContract(const guarantees::AnalyzeOptions& options) {
    if (options.executors.size() != 1 || !options.deployments.empty()) {
      throw program::UsageError(
          "--contract: a contract holds under one executor; name it, for example --executors rm-ro");
    }
    graph_ = setup::graph_to_run(options);
    options.apply_to(graph_.platform);
    if (options.delta_us) graph_.platform.release_cost = from_ms(*options.delta_us / 1000);
    tasks_ = make_tasks(graph_);
    const setup::ExecutorSpec executor = setup::executors_to_run(options, graph_, tasks_).front();
    const auto bounds = setup::guarantees(graph_, tasks_, executor);
    responses_.resize(tasks_.set.size());
    for (TaskId task = 0; bounds && task < tasks_.set.size(); ++task)
      if (bounds->tasks[task]) responses_[task] = Duration(bounds->tasks[task]->ns);
  }

  std::string text() {
    YAML::Emitter out;
    out.SetDoublePrecision(12);
    out << YAML::BeginMap << YAML::Key << "callbacks" << YAML::Value << YAML::BeginSeq;
    std::map<std::uint32_t, std::uint32_t> timers;  // by node
    for (TaskId task = 0; task < tasks_.set.size(); ++task) {
      const TaskOrigin& origin = tasks_.origin[task];
      const Node& node = graph_.nodes[origin.node];
      out << YAML::BeginMap << YAML::Key << "node" << YAML::Value << node.name;
      if (origin.input) {
        out << YAML::Key << "topic" << YAML::Value << node.inputs[*origin.input].topic;
      } else if (const std::uint32_t number = ++timers[origin.node]; number > 1) {
        out << YAML::Key << "timer" << YAML::Value << number;
      }
      write_terms(out, task);
      out << YAML::EndMap;
    }
    out << YAML::EndSeq << YAML::EndMap;
    return std::string(out.c_str()) + "\n";
  }

 private:
  void write_terms(YAML::Emitter& out, TaskId task) {
    const Task& of = tasks_.set[task];
    const Callback& callback = tasks_.callbacks[task];
    const bool measured = callback.measured != nullptr || !callback.quantiles.empty();
    if (of.wcet > Duration::zero())
      write(out, Clause::budget, to_ms(of.wcet), measured ? Origin::measured : Origin::given);
    if (of.kind == TaskKind::timer) {
      write(out, Clause::period, to_ms(of.period), Origin::given);
    } else {
      write(out, Clause::depth, of.depth, Origin::given);
      if (const Duration distance = distance_of(task); distance > Duration::zero())
        write(out, Clause::minimum_distance, to_ms(distance), Origin::derived);
    }
    if (responses_[task]) write(out, Clause::response, to_ms(*responses_[task]), Origin::derived);
  }

  static void write(YAML::Emitter& out, Clause clause, double value, Origin origin) {
    out << YAML::Key << std::string(to_string(clause)) << YAML::Value << YAML::Flow << YAML::BeginMap
        << YAML::Key << "value" << YAML::Value << value << YAML::Key << "from" << YAML::Value
        << std::string(to_string(origin)) << YAML::EndMap;
  }

  /// Least time between two samples of a subscription, 0 if none is known. The only task that
  /// publishes them does so from its timestamp to its response bound.
  Duration distance_of(TaskId subscription) const {
    std::vector<TaskId> publishers;
    for (TaskId task = 0; task < tasks_.set.size(); ++task) {
      const std::vector<TaskId>& feeds = tasks_.set[task].feeds;
      if (std::ranges::find(feeds, subscription) != feeds.end()) publishers.push_back(task);
    }
    if (publishers.size() != 1 || !responses_[publishers.front()]) return Duration::zero();
    const TaskId publisher = publishers.front();
    const Task& of = tasks_.set[publisher];
    const Duration before = of.kind == TaskKind::timer ? of.period : distance_of(publisher);
    return before - *responses_[publisher];
  }

  Graph graph_;
  GraphTasks tasks_;
  std::vector<std::optional<Duration>> responses_;  // bounds, by task
};

}  // namespace

std::string stated_contract(const guarantees::AnalyzeOptions& options) {
  return StatedContract(options).text();
}

}  // namespace hotpath::watch
