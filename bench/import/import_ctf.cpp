// SPDX-License-Identifier: Apache-2.0
#include "import/import_ctf.hpp"

#include <sys/wait.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "hotpath/core/utf8.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/tracing/assembler.hpp"
#include "import/stages.hpp"
#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "results/run_folder.hpp"
#include "results/summary.hpp"
#include "setup/run_setup.hpp"
#include "setup/setup_facts.hpp"

namespace hotpath::imports {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kDeploymentComment =
    "# The recorded threads. Processors are listed where threads did not run on all of them.\n"
    "# A trace has no policies: fifo stands for threads that preempted others and were not\n"
    "# preempted by them. Correct the policies if you know them.\n";

/// Stores a run of the imported graph, which is written already. `name`: of the run's folder in `output`.
void write_run(const Imported& imported, const fs::path& output, const char* name, const Trace& rows,
               results::RunKind kind) {
  const Reproduction& best = imported.best;
  setup::CommonOptions common;
  common.graph = output / "graph.yaml";
  common.phases = Phases::given;
  common.warm_up_s = 0;
  common.duration_s = to_s(rows.end - Time{});
  const TaskSet& set = best.tasks.set;
  results::RunRecord record = setup::record_of(common, best.graph, set, {best.executor});
  record.kind = kind;
  record.simulation =
      results::SimulationRecord{.platform = best.graph.platform, .execution_times = "recorded"};
  results::Repetition repetition;
  repetition.trace = rows;
  repetition.trace.chains = results::counted_chains(rows, Time{});
  repetition.expected = expected_jobs(set, rows);
  results::RunFolder folder(output / name);
  folder.append(set, setup::chain_names(best.graph), repetition.trace);
  setup::keep_inputs(folder, common, load_graph(common.graph), record);
  record.runs.push_back(results::record_of(set, setup::chain_names(best.graph), repetition));
  folder.write("run.json", json(record));
  folder.close(record, json(results::summarize(set, {{rows.executor, {repetition}}},
                                               setup::summary_options(common, best.graph))));
}

/// Writes the files of an import.
void write(const Imported& imported) {
  const Reproduction& best = imported.best;
  const fs::path output = imported.options.output;
  program::create_folder(output);
  write_graph(output / "graph.yaml", best.graph, import_comments(imported), program::write_with_folder);
  if (!best.executor.entry && !imported.found.deployment) {
    const Deployment& plan = best.executor.plan;
    program::write_whole_file(plan.file, kDeploymentComment + deployment_yaml(best.graph, best.tasks, plan));
  }
  Trace recorded = best.trace;
  std::ranges::stable_sort(recorded.jobs, {},
                           [](const JobRecord& r) { return std::max(r.start, r.job.timestamp); });
  write_run(imported, output, "run", recorded, results::RunKind::recorded);
  if (best.check.failure.empty())
    write_run(imported, output, "simulated", best.check.simulated, results::RunKind::simulated);
  program::write_whole_file(output / "import.json", "--output", import_json(imported));
  program::draw_figure("import-page", output, true);
  print_import(std::cout, imported);
}

/// Reads the trace. When the first jobs suffice, it interprets them, and counts the others.
class CtfImport final : public tracing::Sink {
 public:
  explicit CtfImport(const CtfOptions& options) : options_(options) {}

  void run(const tracing::CtfTrace& trace) {
    reading_ = trace.read([&](const tracing::Event& e) {
      for (const char* const text : e.text) check_name(text, tracing::format_of(e.kind).name);
      assembler_.event(e);
    });
    for (const auto& [name, count] : reading_.events) check_name(name, "metadata");
    assembler_.finish();
    if (!imported_) interpret();
    imported_->system = assembler_.system();
    imported_->reading = std::move(reading_);
    write(*imported_);
  }

  void ended(tracing::Job&& job) override {
    if (imported_) {
      ++imported_->later_jobs;
      return;
    }
    jobs_.push_back(std::move(job));
    if (jobs_.size() >= options_.jobs) interpret();
  }

  void lost(const tracing::LostSample& sample) override {
    if (!imported_) lost_.push_back(sample);
  }

 private:
  void check_name(std::string_view name, const char* where) const {
    if (is_utf8(name)) return;
    throw program::UsageError(program::concat(options_.trace, " is a damaged CTF trace: a name in `", where,
                                              "` is not valid UTF-8; record it again"));
  }

  void interpret() {
    if (jobs_.empty()) throw program::UsageError(no_jobs());
    imported_.emplace(import_system(
        recorded_system(assembler_.system(), std::move(jobs_), std::move(lost_), options_.cores), options_));
  }

  std::string no_jobs() const {
    if (!assembler_.system().nodes.empty())
      return options_.trace +
             " has nodes, but no callback runs; record for longer, and enable the events "
             "ros2:callback_start and ros2:callback_end";
    if (!reading_.broken_off.empty())
      return options_.trace + " has no event of ros2_tracing before it breaks off (" + reading_.broken_off +
             "); record it again";
    return options_.trace +
           " has no events of ros2_tracing; record user-space events `ros2:*` (`lttng enable-event -u "
           "'ros2:*'`, or `ros2 trace`)";
  }

  const CtfOptions& options_;
  tracing::Assembler assembler_{*this};
  tracing::TraceReading reading_;
  std::vector<tracing::Job> jobs_;  // the first ones
  std::vector<tracing::LostSample> lost_;
  std::optional<Imported> imported_;  // none: the first jobs are not all read
};

}  // namespace

void import_ctf(const CtfOptions& given) try {
  CtfOptions options = given;
  if (options.output.empty())
    options.output = fs::path("imports") / fs::path(options.trace).lexically_normal().filename();
  program::check_output_folder(options.output);
  const tracing::CtfTrace trace(options.trace);
  // Some damaged traces end the process of libbabeltrace2 by an assertion or a division by zero.
  const std::optional<int> status = program::continue_in_child();
  if (!status) return CtfImport(options).run(trace);
  const std::string problem = "reading " + options.trace + " " + program::how_it_ended(*status);
  if (WTERMSIG(*status) == SIGKILL) throw program::RunError(problem + "; memory may have run out");
  throw program::UsageError(
      problem + ": the trace is damaged, and libbabeltrace2 does not survive it; record it again");
} catch (const tracing::TraceError& error) {
  throw program::UsageError(error.what());
}

}  // namespace hotpath::imports
