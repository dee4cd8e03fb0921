// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <iostream>

#include "commands/commands.hpp"
#include "commands/option_helpers.hpp"
#include "program/errors.hpp"
#include "program/python_tool.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "results/perfetto.hpp"
#include "results/stored_run.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

struct TimelineOptions {
  std::string run, executor, svg, perfetto;
  std::uint32_t repetition = 0;
  double from_ms = 0;
  std::optional<double> to_ms;
};

void write_perfetto_file(const StoredRun& run, const TimelineOptions& o) {
  const Trace& trace = run.trace(o.executor, o.repetition);
  const Time to = o.to_ms ? Time{} + from_ms(*o.to_ms) : kNever;
  write_whole_file(o.perfetto, "--perfetto", [&](std::ostream& out) {
    write_perfetto(out, run.tasks(), trace, Time{} + from_ms(o.from_ms), to);
  });
  std::cout << o.perfetto << "\n";
}

void draw(const TimelineOptions& o) {
  const fs::path svg = o.svg.empty() ? fs::path(o.run) / "timeline.svg" : fs::path(o.svg);
  if (svg.extension() != ".svg") {
    throw UsageError("--svg " + svg.string() + ": the name must end in .svg; a .png is written beside it");
  }
  become_python_tool("timeline", {o.run, "--executor", o.executor, "--repetition",
                                  std::to_string(o.repetition), "--from", text("%g", o.from_ms), "--to",
                                  text("%g", o.to_ms.value_or(o.from_ms + 500)), "--output", svg.string()});
}

void show_timeline(TimelineOptions o) {
  if (o.to_ms && *o.to_ms <= o.from_ms) throw UsageError("--to must lie after --from");
  StoredRun run(o.run, "timeline");
  if (o.executor.empty() && !run.executors().empty()) o.executor = run.executors().front();
  if (!o.perfetto.empty()) {
    run.load();
    write_perfetto_file(run, o);
  }
  if (!o.svg.empty() || o.perfetto.empty()) draw(o);
}

}  // namespace

void add_timeline_command(CLI::App& app) {
  auto [timeline, o] =
      add_command<TimelineOptions>(app, "timeline", "Draw which job ran when, from a live or simulated run",
                                   "hotpath timeline runs/first --from 1000 --to 1200", show_timeline);
  timeline.add_option("RUN", o.run, "Folder of the run")->required();
  add_text(timeline, "--executor", o.executor, "NAME", "As named there; by default the first");
  add_number(timeline, "--repetition", o.repetition, 0, 1e9, "N", "Which repetition");
  add_number(timeline, "--from", o.from_ms, 0, 1e12, "MS", "Begin, after the epoch of the run");
  add_number(timeline, "--to", o.to_ms, 0, 1e12, "MS",
             "End; by default 500 ms later in the chart, and the end\nof the run in the trace for Perfetto");
  add_text(timeline, "--svg", o.svg, "FILE", "Gantt chart, a .png beside it; by default RUN/timeline.svg");
  add_text(timeline, "--perfetto", o.perfetto, "FILE",
           "Trace for ui.perfetto.dev, instead of the chart unless both");
}

}  // namespace hotpath
