// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/phases.hpp"

#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <random>
#include <stdexcept>

#include "hotpath/core/csv.hpp"
#include "hotpath/core/enum_text.hpp"
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

/// A timer's phase as a file states it.
struct PhaseRow {
  std::size_t line = 0;
  std::string timer, ms;
  bool created = false;  ///< The instant of creation.
};

/// By task. `last_line`: to which a missing phase would belong.
std::vector<Duration> phases_of(const Graph& graph, const std::vector<PhaseRow>& rows,
                                const std::string& path, std::size_t last_line) {
  const TaskSet set = make_tasks(graph).set;
  std::map<std::string, TaskId> timers;
  std::vector<std::string> names;
  for (const TaskId id : set.timers()) {
    timers.emplace(set[id].name, id);
    names.push_back(set[id].name);
  }
  std::vector<Duration> first(set.size());
  std::map<TaskId, std::size_t> lines;
  for (const auto& [line, name, ms, created] : rows) {
    const auto fail = [&, line = line](const std::string& problem, const std::string& remedy) {
      throw InputError(path, static_cast<std::int64_t>(line), problem, remedy);
    };
    if (!timers.contains(name)) fail("the graph has no timer " + name, suggest(name, names));
    const TaskId id = timers[name];
    const auto [previous, is_new] = lines.emplace(id, line);
    if (!is_new)
      fail("timer " + name + " has a second phase",
           "keep one (the other is in line " + std::to_string(previous->second) + ")");
    const std::optional<Duration> instant = parse_ms(ms);
    if (!instant || *instant < Duration::zero())
      fail(concat("the phase of timer ", name, " is `", ms, "`"),
           "give decimal milliseconds such as 4.2, not negative");
    first[id] = *instant + (created ? set[id].period : Duration::zero());
  }
  for (const TaskId id : set.timers())
    if (!lines.contains(id))
      throw InputError(path, static_cast<std::int64_t>(last_line),
                       "no phase for the timer of node " + set[id].name, "give one for each timer");
  return first;
}

/// The row with the executor's name, or else the first row of the executor under any rule.
std::vector<PhaseRow> rows_of(const std::string& executor, CsvReader& csv, const std::string& path) {
  constexpr std::string_view kPrefix = "created_ms_";
  const std::size_t names = csv.column("executor"), header_line = csv.line();
  std::optional<std::vector<PhaseRow>> chosen;
  std::vector<std::string> executors;
  while (csv.next()) {
    const std::string name(csv.text(names));
    executors.push_back(name.substr(0, name.find(" (")));
    if (name != executor && (chosen || executors.back() != executor)) continue;
    chosen.emplace();
    for (std::size_t c = 0; c < csv.header().size(); ++c) {
      const std::string& column = csv.header()[c];
      if (column.starts_with(kPrefix))
        chosen->push_back({csv.line(), column.substr(kPrefix.size()), std::string(csv.text(c)), true});
    }
  }
  if (chosen) return *std::move(chosen);
  throw InputError(path, static_cast<std::int64_t>(header_line), "no row for executor " + executor,
                   suggest(executor, executors));
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

std::vector<Duration> read_phases(const std::string& path, const Graph& graph, const std::string& executor) {
  std::ifstream in = open_input(path, "give the path of a readable file of phases");
  LineReader lines(in, path);
  std::vector<PhaseRow> rows;
  if (lines.next() && is_golden_trace(lines.text())) {
    const GoldenTrace trace = read_golden_trace(path);
    for (const Task& task : trace.set.tasks)
      rows.push_back({rows.size() + 1, task.name, format_ms(task.phase)});
    return phases_of(graph, rows, path, rows.size());
  }
  CsvReader csv(std::filesystem::path(path), CsvLayout::by_hand);
  if (csv.header().empty())
    throw InputError(path, 0, "the file of phases is empty", "begin with the line `task,first_release_ms`");
  using Names = std::vector<std::string>;
  const bool created = csv.header() == Names{"task", "created_ms"};
  if (created || csv.header() == Names{"task", "first_release_ms"}) {
    while (csv.next())
      rows.push_back({csv.line(), std::string(csv.text(0)), std::string(csv.text(1)), created});
    return phases_of(graph, rows, path, csv.line());
  }
  if (!csv.find_column("executor"))
    csv.fail("the columns do not describe phases",
             "begin with `task,first_release_ms`, `task,created_ms`, or columns `executor` and "
             "`created_ms_NODE`");
  const std::size_t header = csv.line();
  return phases_of(graph, rows_of(executor, csv, path), path, header);
}

std::string phases_csv(const TaskSet& set, const std::vector<Duration>& first) {
  std::string csv = "task,first_release_ms\n";
  for (const TaskId id : set.timers()) csv += set[id].name + "," + format_ms(first[id]) + "\n";
  return csv;
}

}  // namespace hotpath
