// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/phases.hpp"

#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <stdexcept>

#include "hotpath/core/csv.hpp"
#include "hotpath/core/golden_trace.hpp"
#include "hotpath/core/suggestion.hpp"
#include "hotpath/reference_system/yaml_file.hpp"

namespace hotpath {

namespace {

/// Uniform in [0, bound), with the same result on every platform, unlike
/// std::uniform_int_distribution.
std::uint64_t uniform(std::mt19937_64& generator, std::uint64_t bound) {
  const std::uint64_t limit = std::numeric_limits<std::uint64_t>::max() / bound * bound;
  std::uint64_t drawn = generator();
  while (drawn >= limit) drawn = generator();
  return drawn % bound;
}

}  // namespace

std::vector<Duration> creation_instants(const Graph& graph, const GraphTasks& tasks,
                                        std::optional<Duration> step) {
  std::vector<Duration> finished;  // end of each node's creation
  Duration now{};
  for (const Node& node : graph.nodes) {
    const auto endpoints = static_cast<std::int64_t>(node.inputs.size() + node.outputs.size());
    now += step.value_or(kNodeCreation + endpoints * kEndpointCreation);
    finished.push_back(now);
  }
  std::vector<Duration> instants(tasks.set.size());
  std::optional<Duration> first;
  for (const TaskId id : tasks.set.timers()) {
    const Duration instant = finished[tasks.origin[id].node];
    if (!first) first = instant;
    instants[id] = instant - *first;
  }
  return instants;
}

std::vector<Duration> make_phases(const Graph& graph, const GraphTasks& tasks, Phases phases,
                                  const PhaseOptions& options) {
  std::vector<Duration> first(tasks.set.size());
  if (phases == Phases::creation) first = creation_instants(graph, tasks, options.step);
  std::mt19937_64 generator(options.seed);
  for (const TaskId id : tasks.set.timers()) {
    const Task& task = tasks.set[id];
    switch (phases) {
      case Phases::creation:
        first[id] += task.period;
        break;
      case Phases::synchronous:
        break;
      case Phases::given:
        if (!tasks.callbacks[id].phase) {
          throw std::invalid_argument("graph " + graph.name + " gives no phase for the timer " + task.name +
                                      "; add `phase_ms` to it, or give a file of phases");
        }
        first[id] = *tasks.callbacks[id].phase;
        break;
      case Phases::random:
        first[id] = Duration(uniform(generator, static_cast<std::uint64_t>(task.period.count())));
        break;
    }
  }
  return first;
}

namespace {

const std::string kWidePrefix = "created_ms_";

/// The first timestamps that a file gives.
class GivenPhases {
 public:
  GivenPhases(const std::string& path, const Graph& graph)
      : path_(path), tasks_(make_tasks(graph)), first_(tasks_.set.size()), lines_(tasks_.set.size(), 0) {
    for (const TaskId id : tasks_.set.timers()) timers_.push_back(tasks_.set[id].name);
  }

  /// A value of the file. `created`: the instant of creation.
  void set(std::size_t line, const std::string& name, const std::string& number, bool created) {
    const auto fail = [&](const std::string& problem, const std::string& remedy) {
      throw InputError(path_, line, problem, remedy);
    };
    TaskId id = 0;
    while (id < tasks_.set.size() && (tasks_.set[id].name != name || tasks_.set[id].kind != TaskKind::timer))
      ++id;
    if (id == tasks_.set.size()) fail("the graph has no timer " + name, suggest(name, timers_));
    if (lines_[id] != 0)
      fail("timer " + name + " has a second phase",
           "keep one (the other is in line " + std::to_string(lines_[id]) + ")");
    const std::optional<Duration> instant = parse_ms(number);
    if (!instant || *instant < Duration::zero())
      fail("the phase of timer " + name + " is `" + number + "`",
           "give decimal milliseconds such as 4.2, not negative");
    first_[id] = *instant + (created ? tasks_.set[id].period : Duration::zero());
    lines_[id] = line;
  }

  /// By task. `last_line`: to which a missing phase would belong.
  std::vector<Duration> all(std::size_t last_line) {
    for (const TaskId id : tasks_.set.timers()) {
      if (lines_[id] != 0) continue;
      throw InputError(path_, last_line, "no phase for the timer of node " + tasks_.set[id].name,
                       "give one for each timer");
    }
    return std::move(first_);
  }

 private:
  const std::string path_;
  const GraphTasks tasks_;
  std::vector<std::string> timers_;
  std::vector<Duration> first_;
  std::vector<std::size_t> lines_;  ///< By task: the line with its phase; 0: none yet.
};

/// Reads the row with the executor's name, or else the first row of the executor under any rule.
void read_executor(CsvReader& rows, const std::string& path, const std::string& executor,
                   GivenPhases& phases) {
  const std::size_t names = rows.column("executor"), header_line = rows.line();
  std::size_t chosen_line = 0;
  std::vector<std::string> chosen, executors;
  while (rows.next()) {
    const std::string name(rows.text(names));
    executors.push_back(name.substr(0, name.find(" (")));
    if (name != executor && (chosen_line > 0 || executors.back() != executor)) continue;
    chosen_line = rows.line();
    chosen.clear();
    for (std::size_t c = 0; c < rows.header().size(); ++c) chosen.emplace_back(rows.text(c));
  }
  if (chosen_line == 0)
    throw InputError(path, header_line, "no row for executor " + executor, suggest(executor, executors));
  for (std::size_t c = 0; c < chosen.size(); ++c) {
    const std::string& column = rows.header()[c];
    if (column.starts_with(kWidePrefix))
      phases.set(chosen_line, column.substr(kWidePrefix.size()), chosen[c], true);
  }
}

}  // namespace

std::vector<Duration> read_phases(const std::string& path, const Graph& graph, const std::string& executor) {
  GivenPhases phases(path, graph);
  std::ifstream in = open_input(path, "give the path of a readable file of phases");
  LineReader lines(in, path);
  if (lines.next() && is_golden_trace(lines.text())) {
    const GoldenTrace trace = read_golden_trace(path);
    std::size_t line = 0;
    for (const Task& task : trace.set.tasks) phases.set(++line, task.name, format_ms(task.phase), false);
    return phases.all(line);
  }
  CsvReader rows(std::filesystem::path(path), CsvLayout::by_hand);
  if (rows.header().empty())
    throw InputError(path, 0, "the file of phases is empty", "begin with the line `task,first_release_ms`");
  using Names = std::vector<std::string>;
  const bool created = rows.header() == Names{"task", "created_ms"};
  if (created || rows.header() == Names{"task", "first_release_ms"}) {
    while (rows.next())
      phases.set(rows.line(), std::string(rows.text(0)), std::string(rows.text(1)), created);
    return phases.all(rows.line());
  }
  if (!rows.find_column("executor"))
    rows.fail("the columns do not describe phases",
              "begin with `task,first_release_ms`, `task,created_ms`, or columns `executor` and "
              "`created_ms_NODE`");
  const std::size_t header = rows.line();
  read_executor(rows, path, executor, phases);
  return phases.all(header);
}

std::string phases_csv(const TaskSet& set, const std::vector<Duration>& first) {
  std::string csv = "task,first_release_ms\n";
  for (const TaskId id : set.timers()) csv += set[id].name + "," + format_ms(first[id]) + "\n";
  return csv;
}

}  // namespace hotpath
