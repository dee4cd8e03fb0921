// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "commands/commands.hpp"
#include "hotpath/core/trace_csv.hpp"
#include "program/errors.hpp"
#include "program/python_tool.hpp"
#include "program/whole_file.hpp"
#include "results/perfetto.hpp"
#include "setup/option_helpers.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

struct TimelineOptions {
  std::string run, executor, svg, perfetto;
  std::uint32_t repetition = 0;
  double from_ms = 0;
  std::optional<double> to_ms;
};

/// The tasks that a jobs.csv names, so that a trace can be shown without its graph.
TaskSet tasks_of(const fs::path& file) {
  std::ifstream in(file);
  if (!in) throw UsageError(file.string() + " cannot be read; name the folder of a run");
  TaskSet set;
  std::map<std::string, TaskId> ids;
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream fields(line);
    std::string executor, repetition, task, kind;
    std::getline(fields, executor, ',');
    std::getline(fields, repetition, ',');
    std::getline(fields, task, ',');
    std::getline(fields, kind, ',');
    if (!ids.emplace(task, set.size()).second) continue;
    Task& added = set.tasks.emplace_back();
    added.name = task;
    added.kind = kind == "timer" ? TaskKind::timer : TaskKind::subscription;
  }
  return set;
}

/// Timers tell their period by the timestamps of two jobs.
void find_periods(TaskSet& set, const Trace& trace) {
  std::vector<const JobRecord*> last(set.size(), nullptr);
  for (const JobRecord& r : trace.jobs) {
    const JobRecord*& before = last[r.job.task];
    if (before != nullptr && r.job.sequence > before->job.sequence) {
      set.tasks[r.job.task].period = (r.job.timestamp - before->job.timestamp) /
                                     static_cast<std::int64_t>(r.job.sequence - before->job.sequence);
    }
    before = &r;
  }
}

std::string first_executor(const fs::path& run) {
  std::ifstream in(run / "run.json");
  try {
    return nlohmann::json::parse(in).at("executors").at(0).get<std::string>();
  } catch (const nlohmann::json::exception&) {
    throw UsageError((run / "run.json").string() + " is not that of a run; name the folder of a run");
  }
}

void write_perfetto_file(const TimelineOptions& o) {
  const fs::path jobs = fs::path(o.run) / "jobs.csv";
  TaskSet set = tasks_of(jobs);
  std::ifstream in(jobs);
  std::vector<Trace> traces;
  try {
    traces = read_jobs_csv(in, set, jobs.string());
  } catch (const TraceCsvError& error) {
    throw UsageError(error.what());
  }
  const auto trace = std::find_if(traces.begin(), traces.end(), [&](const Trace& t) {
    return t.executor == o.executor && t.repetition == o.repetition;
  });
  if (trace == traces.end()) {
    std::string there_are;
    for (const Trace& t : traces) {
      there_are +=
          (there_are.empty() ? "" : ", ") + t.executor + " (repetition " + std::to_string(t.repetition) + ")";
    }
    throw UsageError("executor " + o.executor + ", repetition " + std::to_string(o.repetition) +
                     " is not in " + jobs.string() + "; there are " + there_are);
  }
  find_periods(set, *trace);
  const Time to = o.to_ms ? Time{} + from_ms(*o.to_ms) : kNever;
  write_whole_file(o.perfetto, "--perfetto", [&](std::ostream& out) {
    write_perfetto(out, set, *trace, Time{} + from_ms(o.from_ms), to);
  });
  std::cout << o.perfetto << "\n";
}

void draw(const TimelineOptions& o) {
  const fs::path svg = o.svg.empty() ? fs::path(o.run) / "timeline.svg" : fs::path(o.svg);
  if (svg.extension() != ".svg") {
    throw UsageError("--svg " + svg.string() + ": the name must end in .svg; a .png is written beside it");
  }
  std::ostringstream from, to;
  from << o.from_ms;
  to << o.to_ms.value_or(o.from_ms + 500);
  require_figure("timeline.py",
                 {o.run, "--executor", o.executor, "--repetition", std::to_string(o.repetition), "--from",
                  from.str(), "--to", to.str(), "--output", svg.string()});
}

void show_timeline(TimelineOptions o) {
  if (o.executor.empty()) o.executor = first_executor(o.run);
  if (o.to_ms && *o.to_ms <= o.from_ms) throw UsageError("--to must lie after --from");
  if (!o.perfetto.empty()) write_perfetto_file(o);
  if (!o.svg.empty() || o.perfetto.empty()) draw(o);
}

}  // namespace

void add_timeline_command(CLI::App& app) {
  auto options = std::make_shared<TimelineOptions>();
  TimelineOptions& o = *options;
  CLI::App* timeline =
      app.add_subcommand("timeline", "Draw which job ran when, from a live or simulated run");
  timeline->add_option("RUN", o.run, "Folder of the run")->required();
  timeline->add_option("--executor", o.executor, "As named there; by default the first")->type_name("NAME");
  add_number(*timeline, "--repetition", o.repetition, 0, 1e9, "N", "Which repetition")->capture_default_str();
  add_number(*timeline, "--from", o.from_ms, 0, 1e12, "MS", "Begin, after the epoch of the run")
      ->capture_default_str();
  add_number(*timeline, "--to", o.to_ms, 0, 1e12, "MS",
             "End; by default 500 ms later in the chart, and the end\nof the run in the trace for Perfetto");
  timeline->add_option("--svg", o.svg, "Gantt chart, a .png beside it; by default RUN/timeline.svg")
      ->type_name("FILE");
  timeline
      ->add_option("--perfetto", o.perfetto, "Trace for ui.perfetto.dev, instead of the chart unless both")
      ->type_name("FILE");
  timeline->footer("Example:  hotpath timeline runs/first --from 1000 --to 1200");
  timeline->callback([options] { show_timeline(*options); });
}

}  // namespace hotpath
