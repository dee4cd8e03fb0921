// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <iostream>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "program/errors.hpp"
#include "program/json_fields.hpp"
#include "program/memory_limit.hpp"
#include "program/python_tool.hpp"
#include "program/shown_text.hpp"
#include "program/whole_file.hpp"
#include "results/stored_run.hpp"
#include "results/trace_window.hpp"
#include "setup/stored_system.hpp"

namespace hotpath::commands {

namespace {

using Names = std::vector<std::string>;

/// The input of hotpath_report/trace_events.py.
struct TimelineOptions {
  std::string run, svg, perfetto, csv;
  Names executors;
  std::vector<std::pair<std::string, Names>> chains;  ///< Name and tasks of each chain of the graph.
  std::uint32_t repetition = 0;
  double from_ms = 0;
  std::optional<double> to_ms;
};
HOTPATH_JSON_FIELDS(TimelineOptions, run, executors, chains, svg, perfetto, repetition, from_ms, to_ms);

void write_csv(const TimelineOptions& o, std::ostream& out) {
  const results::StoredRun run(o.run, "timeline");
  results::TraceWindow window{o.executors.empty() ? "" : o.executors.front(), o.repetition};
  if (window.executor.empty() && !run.executors().empty()) window.executor = run.executors().front();
  static_cast<void>(run.run(window.executor, window.repetition));  // throws if it did not run
  // Widened by a nanosecond, because the figures select jobs in milliseconds.
  window.from = Time{} + from_ms(o.from_ms) - Duration(1);
  if (o.to_ms) window.to = Time{} + from_ms(*o.to_ms) + Duration(1);
  results::write_window(out, run.folder() / "jobs.csv", window);
}

/// Python holds the window and its drawing in memory; a Perfetto trace can be a whole repetition.
void check_memory_of(const TimelineOptions& o) {
  constexpr double kMemoryOfByte = 25;
  const results::StoredRun run(o.run, "timeline");
  std::error_code none;
  const auto size = static_cast<double>(std::filesystem::file_size(run.folder() / "jobs.csv", none));
  if (none || (!o.to_ms && o.perfetto.empty())) return;  // the chart is short by default
  const auto repetitions = static_cast<double>(run.record().runs.size());
  const double length_ms = to_ms(run.length());
  const double share = std::clamp((o.to_ms.value_or(length_ms) - o.from_ms) / length_ms, 0.0, 1.0);
  program::check_memory(size / std::max(1.0, repetitions) * share * kMemoryOfByte, "timeline " + o.run,
                        "this window", "an earlier --to");
}

/// The tasks of the graph's chains, by which the chart colours jobs. Without the graph's file the chart
/// has the colours of the threads.
void add_chains(TimelineOptions& o) {
  try {
    const setup::StoredSystem system = setup::stored_system(results::StoredRun(o.run, "timeline"));
    const std::vector<ChainIndex> indices = index_chains(system.graph, system.tasks);
    for (std::size_t c = 0; c < indices.size(); ++c) {
      Names& tasks = o.chains.emplace_back(system.graph.chains[c].name, Names{}).second;
      for (const std::vector<TaskId>& of_node : indices[c].nodes) {
        for (const TaskId id : of_node) tasks.push_back(system.tasks.set[id].name);
      }
    }
  } catch (const std::exception& error) {
    std::cerr << "note: the chart does not show chains: " << error.what() << "\n";
  }
}

void timeline(TimelineOptions o) {
  if (o.to_ms && *o.to_ms <= o.from_ms) throw program::UsageError("timeline: --to must lie after --from");
  if (o.executors.size() > 1 && !(o.csv.empty() && o.perfetto.empty())) {
    throw program::UsageError("timeline: --csv and --perfetto take one executor; give --executor once");
  }
  if (o.csv.empty()) {
    check_memory_of(o);
    if (o.perfetto.empty() || !o.svg.empty()) add_chains(o);
    program::become_python_tool("timeline", {nlohmann::json(o).dump()});
  }
  if (o.csv == "-") return write_csv(o, program::data_output());
  program::write_output_file(o.csv, "--csv", [&](std::ostream& out) { write_csv(o, out); });
}

}  // namespace

void add_timeline_command(CLI::App& app) {
  auto [command, o] = add_command<TimelineOptions>(
      app, "timeline", "Draw a Gantt chart of a stored run, or export it for Perfetto",
      "hotpath timeline runs/first --from 1000 --to 1200", timeline);
  command.add_option("RUN", o.run, kRunHelp)->type_name("FOLDER")->required();
  add_text(command, "--executor", o.executors, "NAME",
           "Executor of the run, by default its first; several times: charts\nbelow each other on one axis")
      ->allow_extra_args(false);
  add_number(command, "--repetition", o.repetition, {0, 1e9}, "N", kRunRepetitionHelp);
  add_number(command, "--from", o.from_ms, {0, 1e12}, "MS", "Start of the window, after the run's epoch");
  add_number(command, "--to", o.to_ms, {0, 1e12}, "MS",
             "End of the window; by default 500 ms later in the chart, the\n"
             "end of the run in the Perfetto trace");
  CLI::Option* const svg = add_output_file(
      command, "--svg", o.svg, "Gantt chart, with a .png beside it; by default\nRUN/timeline.svg");
  CLI::Option* const perfetto =
      add_output_file(command, "--perfetto", o.perfetto,
                      "Trace for ui.perfetto.dev; replaces the chart unless --svg is\ngiven");
  add_output_file(command, "--csv", o.csv,
                  "Write the window's rows of jobs.csv instead, by default to\n"
                  "the end of the run; `-` is standard output")
      ->excludes(svg)
      ->excludes(perfetto);
}

}  // namespace hotpath::commands
