// SPDX-License-Identifier: Apache-2.0
#include "setup/run_setup.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <numeric>
#include <random>
#include <set>

#include "hotpath/core/input_file.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "program/errors.hpp"
#include "program/memory_limit.hpp"
#include "program/text.hpp"
#include "results/executor_label.hpp"

namespace hotpath::setup {

void PlatformOptions::apply_to(GraphPlatform& platform) const {
  platform.cores = cores.value_or(platform.cores);
  platform.timer_thread = timer_thread.value_or(platform.timer_thread);
  for (std::size_t i = 0; i < kPlatformCosts.size(); ++i) {
    if (costs_us[i]) kPlatformCosts[i].set(platform, from_ms(*costs_us[i] / 1000));
  }
}

std::string time_stamp(const char* format) {
  const std::time_t now = std::time(nullptr);
  char text[64];
  std::strftime(text, sizeof(text), format, std::localtime(&now));
  return text;
}

std::string output_folder(const std::string& output, const std::string& name) {
  if (!output.empty()) return output;
  static std::string made;  // a command makes one folder
  static const pid_t process = getpid();
  if (!made.empty()) return made;
  namespace fs = std::filesystem;
  const std::string wanted = "runs/" + time_stamp("%Y%m%d-%H%M%S") + "-" + name;
  made = wanted;
  std::error_code error;
  fs::create_directory("runs", error);
  // Of programs that start at the same instant, one creates it.
  for (int n = 2; !fs::create_directory(made, error) && !error; ++n) made = wanted + "-" + std::to_string(n);
  if (error) return made = wanted;  // whoever writes into it reports why
  std::atexit([] {
    if (getpid() == process) rmdir(made.c_str());  // fails if anything was stored
  });
  return made;
}

namespace {

/// Calls `use`, which may reject the value of the option.
auto use_option(const char* option, const auto& use) try {
  return use();
} catch (const std::invalid_argument& error) {
  throw program::UsageError(program::concat(option, ": ", error.what()));
}

/// The order that --entity-order selects; empty for the order of creation.
std::vector<TaskId> entity_order(const CommonOptions& options, const TaskSet& set) {
  const auto& [reverse, text] = options.entity_order;
  std::vector<TaskId> order;
  const auto task_named = [&](std::string_view name) {  // set.size(): there is none
    return static_cast<TaskId>(std::ranges::find(set.tasks, name, &Task::name) - set.tasks.begin());
  };
  for (const std::string& name : options.entity_tasks)
    if (const TaskId id = task_named(name); id < set.size()) order.push_back(id);
  if (!order.empty()) return order;
  if (reverse) {
    for (TaskId id = set.size(); id-- > 0;) order.push_back(id);
  }
  if (text.empty()) return order;
  std::ifstream file = open_input(text, "give --entity-order creation, reverse, or a file of task names");
  LineReader lines(file, text);
  while (lines.next()) {
    const std::string_view name = lines.text();
    if (name.empty()) continue;
    const auto line = static_cast<std::int64_t>(lines.line());
    const TaskId id = task_named(name);
    if (id == set.size())
      throw InputError(text, line, program::concat("the graph has no task ", name), "give task names");
    if (std::ranges::count(order, id) > 0)
      throw InputError(text, line, program::concat(name, " occurs twice"), "list it once");
    order.push_back(id);
  }
  for (TaskId id = 0; id < set.size(); ++id) {
    if (std::ranges::count(order, id) == 0) order.push_back(id);
  }
  return order;
}

}  // namespace

Graph graph_to_run(const CommonOptions& options) {
  Graph graph = load_graph(find_graph(options.graph), options.set);
  if (options.work) graph.work = *options.work;
  if (options.load_given) use_option("--load", [&] { scale_to_load(graph, *options.load_given); });
  if (options.rate_percent) scale_rates(graph, *options.rate_percent);
  use_option("--copies", [&] { make_copies(graph, options.copies); });
  return graph;
}

SchedulerOptions scheduling_of(const CommonOptions& options, const Graph& graph, const TaskSet& set,
                               unsigned cores) {
  SchedulerOptions all;
  all.rule = options.rule;
  all.ties = options.ties;
  all.workers = cores == 0 ? 0 : std::max(2U, cores);
  all.entity_order = entity_order(options, set);
  all.service_wait = graph.service_wait;
  all.release = graph.release;
  return all;
}

std::vector<ExecutorSpec> executors_to_run(const CommonOptions& options, const Graph& graph,
                                           const GraphTasks& tasks, unsigned cores) {
  const SchedulerOptions defaults = scheduling_of(options, graph, tasks.set, cores);
  std::vector<ExecutorSpec> executors;
  for (const std::string& name : options.executors) executors.push_back(parse_executor(name, defaults));
  for (const std::string& name : options.deployments) {
    executors.push_back(deploy(find_deployment(name, graph, tasks), defaults));
  }
  std::set<std::string> labels;
  for (const ExecutorSpec& e : executors) {
    if (!labels.insert(e.label).second)
      throw program::UsageError("executor or deployment `" + e.label + "` is named twice");
  }
  return executors;
}

std::vector<Duration> phases_of_repetition(const CommonOptions& options, const Graph& graph,
                                           const GraphTasks& tasks, const ExecutorSpec& executor,
                                           std::uint32_t repetition) {
  if (!options.phases_file.empty())
    return read_phases(options.phases_file, graph, results::ExecutorLabel(executor.label).name);
  PhaseOptions phase_options;
  if (options.phase_step_ms) phase_options.step = from_ms(*options.phase_step_ms);
  phase_options.seed = options.seed + repetition;
  return use_option("--phases given",
                    [&] { return make_phases(graph, tasks, options.phases, phase_options); });
}

std::vector<std::pair<std::uint32_t, std::size_t>> interleaved(std::uint32_t repetitions,
                                                               std::size_t subjects, std::uint64_t seed) {
  std::vector<std::pair<std::uint32_t, std::size_t>> order;
  std::mt19937_64 random(seed);
  for (std::uint32_t r = 0; r < repetitions; ++r) {
    const auto begin = order.size();
    for (std::size_t s = 0; s < subjects; ++s) order.emplace_back(r, s);
    for (std::size_t i = order.size() - 1; i > begin; --i) {
      std::swap(order[i], order[begin + random() % (i - begin + 1)]);
    }
  }
  return order;
}

void check_trace_memory(const CommonOptions& options, const GraphTasks& tasks, std::size_t runs, double more,
                        const std::string& remedy) {
  const std::vector<double> rates = activation_rates(tasks);
  const double jobs = std::reduce(rates.begin(), rates.end()) * (options.warm_up_s + options.duration_s) *
                      static_cast<double>(runs);
  program::check_trace_memory(jobs * sizeof(JobRecord) + more,
                              program::text("--duration %.2g", options.duration_s), remedy);
}

void set_phases(TaskSet& set, const std::vector<Duration>& first) {
  for (TaskId id = 0; id < first.size(); ++id) set.tasks[id].phase = first[id];
}

std::vector<std::string> chain_names(const Graph& graph) {
  std::vector<std::string> names;
  for (const Chain& chain : graph.chains) names.push_back(chain.name);
  return names;
}

results::SummaryOptions summary_options(const CommonOptions& options, const Graph& graph) {
  return {chain_names(graph), from_s(options.warm_up_s), {.seed = options.seed}};
}

}  // namespace hotpath::setup
