// SPDX-License-Identifier: Apache-2.0
#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "program/json_fields.hpp"
#include "program/python_tool.hpp"

namespace hotpath {

namespace {

/// As hotpath_report/trace_events.py takes it.
struct TimelineOptions {
  std::string run, executor, svg, perfetto;
  std::uint32_t repetition = 0;
  double from_ms = 0;
  std::optional<double> to_ms;
};
HOTPATH_JSON_FIELDS(TimelineOptions, run, executor, svg, perfetto, repetition, from_ms, to_ms);

}  // namespace

void add_timeline_command(CLI::App& app) {
  auto [timeline, o] = add_command<TimelineOptions>(
      app, "timeline", "Draw which job ran when, from a live or simulated run",
      "hotpath timeline runs/first --from 1000 --to 1200", [](const TimelineOptions& options) {
        become_python_tool("timeline", {nlohmann::json(options).dump()});
      });
  timeline.add_option("RUN", o.run, "Folder of the run")->required();
  add_text(timeline, "--executor", o.executor, "NAME", "As named there; by default the first");
  add_number(timeline, "--repetition", o.repetition, {0, 1e9}, "N", "Which repetition");
  add_number(timeline, "--from", o.from_ms, {0, 1e12}, "MS", "Begin, after the epoch of the run");
  add_number(timeline, "--to", o.to_ms, {0, 1e12}, "MS",
             "End; by default 500 ms later in the chart, and the end\nof the run in the trace for Perfetto");
  add_output_file(timeline, "--svg", o.svg, "Gantt chart, a .png beside it; by default RUN/timeline.svg");
  add_output_file(timeline, "--perfetto", o.perfetto,
                  "Trace for ui.perfetto.dev, instead of the chart unless both");
}

}  // namespace hotpath
