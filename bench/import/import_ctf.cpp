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
#include "import/import_page.hpp"
#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "program/output_target.hpp"
#include "program/python_tool.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "results/run_folder.hpp"
#include "results/summary_table.hpp"
#include "setup/run_setup.hpp"
#include "setup/setup_facts.hpp"

namespace hotpath::imports {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Rows that are sorted and written together after the window.
constexpr std::size_t kChunk = 20'000;
constexpr const char* kDeploymentComment =
    "# The recorded threads. Processors are listed where threads did not run on all of them.\n"
    "# A trace has no policies: fifo stands for threads that preempted others and were not\n"
    "# preempted by them. Correct the policies if you know them.\n";

/// The files of an import; rows of jobs after the first ones follow while the trace is read.
class ImportFolder {
 public:
  ImportFolder(Imported imported, const fs::path& output)
      : imported_(std::move(imported)),
        best_(imported_.best),
        output_(output),
        run_(output / "run"),
        rows_(imported_.recorded.system, imported_.found.graph, imported_.found.timers, best_.release_only) {
    static_cast<void>(rows_.jobs(imported_.recorded.jobs));  // later rows follow these
    Trace rows = best_.trace;
    std::ranges::stable_sort(rows.jobs, {},
                             [](const JobRecord& r) { return std::max(r.start, r.job.timestamp); });
    rows.chains = results::counted_chains(best_.trace, Time{});
    run_.append(best_.tasks.set, setup::chain_names(best_.graph), rows);
  }

  /// Appends later jobs, in any order.
  void append(std::vector<tracing::Job> jobs, const std::vector<tracing::LostSample>& lost) {
    std::ranges::sort(jobs, {}, &tracing::Job::started);
    const RecordedGraph& graph = imported_.found.graph;
    Trace rows;
    rows.executor = best_.trace.executor;
    rows.epoch = graph.epoch;
    for (const tracing::Job& job : jobs)
      if (graph.task(job.ref) != kNoTask) rows.jobs.push_back(rows_.job(job));
    for (const tracing::LostSample& sample : lost)
      if (graph.task({sample.subscription, 0}) != kNoTask) rows.jobs.push_back(rows_.lost(sample));
    later_jobs_ += jobs.size();
    run_.append(best_.tasks.set, {}, rows);
  }

  void write(const tracing::TraceReading& reading, const CtfOptions& options) {
    if (best_.executor.deployment && !imported_.found.deployment) {
      const Deployment& plan = best_.executor.deployment->plan;
      program::write_whole_file(plan.file,
                                kDeploymentComment + deployment_yaml(best_.graph, best_.tasks, plan));
    }
    write_graph(output_ / "graph.yaml", best_.graph, import_comments(imported_), program::write_with_folder);
    write_run(run_, best_.trace, results::RunKind::recorded);
    if (best_.check.failure.empty()) {
      results::RunFolder simulated(output_ / "simulated");
      simulated.append(best_.tasks.set, setup::chain_names(best_.graph), best_.check.simulated);
      write_run(simulated, best_.check.simulated, results::RunKind::simulated);
    }
    const Facts facts{reading, imported_, options, later_jobs_};
    program::write_whole_file(output_ / "import.json", "--output", import_json(facts));
    program::draw_figure("import-page", output_);
    print_import(std::cout, facts, output_);
  }

 private:
  void write_run(results::RunFolder& folder, const Trace& trace, results::RunKind kind) const {
    setup::CommonOptions common;
    common.graph = output_ / "graph.yaml";
    common.phases = Phases::given;
    common.warm_up_s = 0;
    common.duration_s = to_ms(trace.end - Time{}) / 1000;
    const TaskSet& set = best_.tasks.set;
    results::RunRecord record = setup::record_of(common, best_.graph, set, {best_.executor});
    record.kind = kind;
    record.simulation =
        results::SimulationRecord{.platform = best_.graph.platform, .execution_times = "recorded"};
    results::Repetition repetition;
    repetition.trace = trace;
    repetition.trace.chains = results::counted_chains(trace, Time{});
    repetition.accounts = account(set, repetition.trace);
    setup::keep_inputs(folder, common, load_graph(common.graph), record);
    record.runs.push_back(results::record_of(set, setup::chain_names(best_.graph), repetition));
    folder.write("run.json", json(record));
    folder.close(record, json(results::summarize(set, {{trace.executor, {repetition}}},
                                                 setup::summary_options(common, best_.graph))));
  }

  const Imported imported_;
  const Reproduction& best_;
  const fs::path output_;
  results::RunFolder run_;
  RecordedTrace rows_;
  std::uint64_t later_jobs_ = 0;
};

/// Reads the trace. When the first jobs suffice, it interprets them; from then on it writes.
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
    if (!folder_ || !jobs_.empty() || !lost_.empty()) pass_on();
    folder_->write(reading_, options_);
  }

  void ended(tracing::Job&& job) override {
    jobs_.push_back(std::move(job));
    if (jobs_.size() >= (folder_ ? kChunk : options_.jobs)) pass_on();
  }

  void lost(const tracing::LostSample& sample) override { lost_.push_back(sample); }

 private:
  void check_name(std::string_view name, const char* where) const {
    if (is_utf8(name)) return;
    throw program::UsageError(program::concat(options_.trace, " is a damaged CTF trace: a name in `", where,
                                              "` is not valid UTF-8; record it again"));
  }

  /// Interprets the first jobs, or appends later ones.
  void pass_on() {
    std::vector<tracing::Job> jobs = std::exchange(jobs_, {});
    std::vector<tracing::LostSample> lost = std::exchange(lost_, {});
    if (folder_) return folder_->append(std::move(jobs), lost);
    if (jobs.empty()) throw program::UsageError(no_jobs());
    folder_ = std::make_unique<ImportFolder>(
        import_system(recorded_system(assembler_.system(), std::move(jobs), std::move(lost), options_.cores),
                      options_),
        options_.output);
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
  std::vector<tracing::Job> jobs_;  // that were not passed on
  std::vector<tracing::LostSample> lost_;
  std::unique_ptr<ImportFolder> folder_;  // null: the first jobs are not all read
};

/// Removes the files of a failed import, and the folder if the import created it.
void remove_files(const fs::path& output, bool is_new) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(output, ignored))
    fs::remove_all(entry.path(), ignored);
  if (is_new) fs::remove(output, ignored);
}

}  // namespace

void import_ctf(const CtfOptions& given) try {
  CtfOptions options = given;
  if (options.output.empty())
    options.output = fs::path("imports") / fs::path(options.trace).lexically_normal().filename();
  program::check_output_folder(options.output);
  const tracing::CtfTrace trace(options.trace);
  const bool is_new = !fs::exists(options.output);
  // Some damaged traces end the process of libbabeltrace2 by an assertion or a division by zero.
  const std::optional<int> status = program::continue_in_child();
  if (!status) {
    try {
      return CtfImport(options).run(trace);
    } catch (...) {
      remove_files(options.output, is_new);
      throw;
    }
  }
  remove_files(options.output, is_new);
  const std::string problem = "reading " + options.trace + " " + program::how_it_ended(*status);
  if (WTERMSIG(*status) == SIGKILL) throw program::RunError(problem + "; memory may have run out");
  throw program::UsageError(
      problem + ": the trace is damaged, and libbabeltrace2 does not survive it; record it again");
} catch (const tracing::TraceError& error) {
  throw program::UsageError(error.what());
}

}  // namespace hotpath::imports
