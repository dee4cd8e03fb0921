// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "program/errors.hpp"
#include "program/json_fields.hpp"
#include "program/memory_limit.hpp"
#include "program/python_tool.hpp"
#include "program/shown_text.hpp"
#include "program/whole_file.hpp"
#include "results/stored_run.hpp"
#include "results/trace_window.hpp"

namespace hotpath {

namespace {

/// The input of hotpath_report/trace_events.py.
struct TimelineOptions {
  std::string run, executor, svg, perfetto, csv;
  std::uint32_t repetition = 0;
  double from_ms = 0;
  std::optional<double> to_ms;
};
HOTPATH_JSON_FIELDS(TimelineOptions, run, executor, svg, perfetto, repetition, from_ms, to_ms);

void write_csv(const TimelineOptions& o, std::ostream& out) {
  const StoredRun run(o.run, "timeline");
  TraceWindow window{o.executor, o.repetition};
  if (window.executor.empty() && !run.executors().empty()) window.executor = run.executors().front();
  static_cast<void>(run.run(window.executor, window.repetition));  // throws if it did not run
  // Widened by a nanosecond, because the figures select jobs in milliseconds.
  window.from = Time{} + from_ms(o.from_ms) - Duration(1);
  if (o.to_ms) window.to = Time{} + from_ms(*o.to_ms) + Duration(1);
  write_window(out, run.folder() / "jobs.csv", window);
}

/// Python holds the window and its drawing in memory; a Perfetto trace can be a whole repetition.
void check_memory_of(const TimelineOptions& o) {
  constexpr double kMemoryOfByte = 25;
  const StoredRun run(o.run, "timeline");
  std::error_code none;
  const auto size = static_cast<double>(std::filesystem::file_size(run.folder() / "jobs.csv", none));
  if (none || (!o.to_ms && o.perfetto.empty())) return;  // the chart is short by default
  const auto repetitions = static_cast<double>(run.record().runs.size());
  const double length_ms = to_ms(run.length());
  const double share = std::clamp((o.to_ms.value_or(length_ms) - o.from_ms) / length_ms, 0.0, 1.0);
  check_memory(size / std::max(1.0, repetitions) * share * kMemoryOfByte, "timeline " + o.run, "this window",
               "an earlier --to");
}

void timeline(const TimelineOptions& o) {
  if (o.to_ms && *o.to_ms <= o.from_ms) throw UsageError("timeline: --to must lie after --from");
  if (o.csv.empty()) {
    check_memory_of(o);
    become_python_tool("timeline", {nlohmann::json(o).dump()});
  }
  if (o.csv == "-") return write_csv(o, data_output());
  write_output_file(o.csv, "--csv", [&](std::ostream& out) { write_csv(o, out); });
}

}  // namespace

void add_timeline_command(CLI::App& app) {
  auto [command, o] = add_command<TimelineOptions>(
      app, "timeline", "Draw a Gantt chart of a stored run, or export it for Perfetto",
      "hotpath timeline runs/first --from 1000 --to 1200", timeline);
  command.add_option("RUN", o.run, kRunHelp)->type_name("FOLDER")->required();
  add_text(command, "--executor", o.executor, "NAME", kRunExecutorHelp);
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

}  // namespace hotpath
