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
#include "hotpath/reference_system/graph_text.hpp"

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
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (tasks.set[id].kind != TaskKind::timer) continue;
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
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    const Task& task = tasks.set[id];
    if (task.kind != TaskKind::timer) continue;
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

class PhasesFile {
 public:
  PhasesFile(const std::string& path, const Graph& graph) : path_(path), tasks_(make_tasks(graph)) {
    for (const Task& task : tasks_.set.tasks) {
      if (task.kind == TaskKind::timer) timers_.push_back(task.name);
    }
    first_.resize(tasks_.set.size());
    known_.resize(tasks_.set.size(), 0);
  }

  std::vector<Duration> read(const std::string& executor) {
    std::ifstream in = open_input(path_, "give the path of a readable file of phases");
    LineReader lines(in, path_);
    if (lines.next() && is_golden_trace(lines.text())) {
      read_golden_header();
    } else {
      read_csv(executor);
    }
    for (TaskId id = 0; id < tasks_.set.size(); ++id) {
      if (tasks_.set[id].kind == TaskKind::timer && known_[id] == 0) {
        throw InputError(path_, last_line_, "no phase for the timer of node " + tasks_.set[id].name,
                         "give one for each timer");
      }
    }
    return std::move(first_);
  }

 private:
  void read_golden_header() {
    const GoldenTrace trace = read_golden_trace(path_);
    for (const Task& task : trace.set.tasks) set(++last_line_, task.name, format_ms(task.phase), false);
  }

  void read_csv(const std::string& executor) {
    using Names = std::vector<std::string>;
    CsvReader rows(std::filesystem::path(path_), CsvLayout::by_hand);
    if (rows.header().empty()) {
      throw InputError(path_, 0, "the file of phases is empty",
                       "begin with the line `task,first_release_ms`");
    }
    const bool created = rows.header() == Names{"task", "created_ms"};
    if (created || rows.header() == Names{"task", "first_release_ms"}) {
      while (rows.next()) set(rows.line(), std::string(rows.text(0)), std::string(rows.text(1)), created);
      last_line_ = rows.line();
    } else if (rows.find_column("executor")) {
      last_line_ = rows.line();  // the line to which a missing column would belong
      read_executor(rows, executor);
    } else {
      rows.fail("the columns do not describe phases",
                "begin with `task,first_release_ms`, `task,created_ms`, or columns `executor` and "
                "`created_ms_NODE`");
    }
  }

  /// Reads the row with the executor's name, or else the first row of the executor under any rule.
  void read_executor(CsvReader& rows, const std::string& executor) {
    using Fields = std::vector<std::string>;
    const std::size_t names = rows.column("executor"), header_line = rows.line();
    std::size_t chosen_line = 0;
    Fields chosen, executors;
    while (rows.next()) {
      const std::string name(rows.text(names));
      executors.push_back(name.substr(0, name.find(" (")));
      if (name != executor && (chosen_line > 0 || executors.back() != executor)) continue;
      chosen_line = rows.line();
      chosen.clear();
      for (std::size_t c = 0; c < rows.header().size(); ++c) chosen.emplace_back(rows.text(c));
    }
    if (chosen_line == 0) {
      throw InputError(path_, header_line, "no row for executor " + executor, suggest(executor, executors));
    }
    for (std::size_t c = 0; c < chosen.size(); ++c) {
      const std::string& column = rows.header()[c];
      if (!column.starts_with(kWidePrefix)) continue;
      set(chosen_line, column.substr(kWidePrefix.size()), chosen[c], true);
    }
  }

  void set(std::size_t line, const std::string& name, const std::string& number, bool created) {
    const auto fail = [&](const std::string& problem, const std::string& remedy) {
      throw InputError(path_, line, problem, remedy);
    };
    TaskId id = 0;
    while (id < tasks_.set.size() && (tasks_.set[id].name != name || tasks_.set[id].kind != TaskKind::timer))
      ++id;
    if (id == tasks_.set.size()) fail("the graph has no timer " + name, suggest(name, timers_));
    if (known_[id] != 0) {
      fail("timer " + name + " has a second phase",
           "keep one (the other is in line " + std::to_string(known_[id]) + ")");
    }
    const std::optional<Duration> instant = parse_ms(number);
    if (!instant || *instant < Duration::zero()) {
      fail("the phase of timer " + name + " is `" + number + "`",
           "give decimal milliseconds such as 4.2, not negative");
    }
    first_[id] = *instant + (created ? tasks_.set[id].period : Duration::zero());
    known_[id] = line;
  }

  std::string path_;
  GraphTasks tasks_;
  std::vector<std::string> timers_;
  std::size_t last_line_ = 0;  ///< The line to which a missing phase would belong.
  std::vector<Duration> first_;
  std::vector<std::size_t> known_;  ///< Line with the phase of each task; 0: none yet.
};

}  // namespace

std::vector<Duration> read_phases(const std::string& path, const Graph& graph, const std::string& executor) {
  return PhasesFile(path, graph).read(executor);
}

std::string phases_csv(const TaskSet& set, const std::vector<Duration>& first) {
  std::string csv = "task,first_release_ms\n";
  for (TaskId id = 0; id < set.size(); ++id) {
    if (set[id].kind == TaskKind::timer) csv += set[id].name + "," + format_ms(first[id]) + "\n";
  }
  return csv;
}

}  // namespace hotpath
