// SPDX-License-Identifier: Apache-2.0
#include "import/import_ctf.hpp"

#include <sys/wait.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "hotpath/core/utf8.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/tracing/assembler.hpp"
#include "hotpath/tracing/ctf_trace.hpp"
#include "import/import_page.hpp"
#include "import/interpretation.hpp"
#include "program/child_process.hpp"
#include "program/errors.hpp"
#include "program/output_target.hpp"
#include "program/progress.hpp"
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
/// Time between two updates of the progress on a terminal.
constexpr Duration kUpdate = std::chrono::milliseconds(200);
constexpr const char* kDeploymentComment =
    "# The recorded threads. Processors are listed where threads did not run on all of them.\n"
    "# A trace has no policies: fifo stands for threads that preempted others and were not\n"
    "# preempted by them. Correct the policies if you know them.\n";

fs::path output_of(const CtfOptions& options) {
  if (!options.output.empty()) return options.output;
  return fs::path("imports") / fs::path(options.trace).lexically_normal().filename();
}

/// Reads the trace. When the first jobs suffice, it interprets them; from then on it writes.
class CtfImport final : public tracing::Sink {
 public:
  explicit CtfImport(const CtfOptions& options) : options_(options), output_(output_of(options)) {}

  void run(const tracing::CtfTrace& trace) {
    program::Progress progress(1, Duration::zero());
    const auto began = std::chrono::steady_clock::now();
    progress.begin("reading " + options_.trace);
    const auto update = [&, updated = Duration::zero()](double share) mutable {
      const Duration elapsed = std::chrono::steady_clock::now() - began;
      if (elapsed < updated + kUpdate) return;
      updated = elapsed;
      const auto total =
          Duration(static_cast<std::int64_t>(static_cast<double>(elapsed.count()) / std::max(share, 0.001)));
      progress.update(elapsed, total);
    };
    const auto visit = [&](const tracing::Event& e) {
      const char* const name = tracing::format_of(e.kind).name;
      for (const char* const text : e.text) check_name(text, name);
      assembler_.event(e);
    };
    reading_ = trace.read(visit, update);
    for (const auto& [name, count] : reading_.events) check_name(name, "metadata");
    assembler_.finish();
    progress.clear();
    if (!recording_) interpret_jobs();
    write();
  }

  void ended(tracing::Job&& job) override {
    jobs_.push_back(std::move(job));
    if (!recording_ && jobs_.size() >= options_.jobs) {
      interpret_jobs();
    } else if (recording_ && jobs_.size() >= kChunk) {
      append();
    }
  }

  void lost(const tracing::LostSample& sample) override { lost_.push_back(sample); }

 private:
  void check_name(std::string_view name, const char* where) const {
    if (is_utf8(name)) return;
    throw program::UsageError(program::concat(options_.trace, " is a damaged CTF trace: a name in `", where,
                                              "` is not valid UTF-8; record it again"));
  }

  void interpret_jobs() {
    if (jobs_.empty()) throw program::UsageError(no_jobs());
    recording_ = std::make_unique<Recording>(Recording{.system = assembler_.system(),
                                                       .jobs = std::exchange(jobs_, {}),
                                                       .lost = std::exchange(lost_, {}),
                                                       .deployment_file = output_ / "deployment.yaml"});
    interpretations_ = interpret(*recording_, options_);
    folder_ = std::make_unique<results::RunFolder>(output_ / "run");
    const Interpretation& best = interpretations_.best;
    Trace rows = best.trace;
    std::ranges::stable_sort(rows.jobs, {},
                             [](const JobRecord& r) { return std::max(r.start, r.job.timestamp); });
    rows.chains = results::counted_chains(best.trace, Time{});
    folder_->append(best.tasks.set, setup::chain_names(best.graph), rows);
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

  /// Appends the jobs after the window.
  void append() {
    std::ranges::sort(jobs_, {}, &tracing::Job::started);
    Trace rows;
    rows.executor = interpretations_.best.trace.executor;
    rows.epoch = recording_->graph.epoch;
    for (const tracing::Job& job : jobs_)
      if (recording_->graph.task(job.ref) != kNoTask)
        rows.jobs.push_back(interpretations_.best.rows->job(job));
    for (const tracing::LostSample& lost : lost_)
      if (recording_->graph.task({lost.subscription, 0}) != kNoTask)
        rows.jobs.push_back(interpretations_.best.rows->lost(lost));
    later_jobs_ += jobs_.size();
    jobs_.clear();
    lost_.clear();
    folder_->append(interpretations_.best.tasks.set, {}, rows);
  }

  void write() {
    if (!jobs_.empty() || !lost_.empty()) append();
    const Interpretation& best = interpretations_.best;
    if (best.executor->deployment && !recording_->deployment) {
      const Deployment& plan = best.executor->deployment->plan;
      program::write_whole_file(plan.file,
                                kDeploymentComment + deployment_yaml(best.graph, best.tasks, plan));
    }
    write_graph(output_ / "graph.yaml", best.graph, import_comments(*recording_, best),
                program::write_with_folder);
    write_run(*folder_, best.trace, results::RunKind::recorded);
    if (best.check.failure.empty()) {
      results::RunFolder simulated(output_ / "simulated");
      simulated.append(best.tasks.set, setup::chain_names(best.graph), best.check.simulated);
      write_run(simulated, best.check.simulated, results::RunKind::simulated);
    }
    const Facts facts{reading_, *recording_, interpretations_, later_jobs_, options_.trace};
    program::write_whole_file(output_ / "import.json", "--output", import_json(facts));
    program::draw_figure("import-page", output_);
    print_import(std::cout, facts, output_);
  }

  void write_run(results::RunFolder& folder, const Trace& trace, results::RunKind kind) {
    const Interpretation& best = interpretations_.best;
    setup::CommonOptions common;
    common.graph = output_ / "graph.yaml";
    common.phases = Phases::given;
    common.warm_up_s = 0;
    common.duration_s = to_ms(trace.end - Time{}) / 1000;
    results::RunRecord record = setup::record_of(common, best.graph, best.tasks.set, {*best.executor});
    record.kind = kind;
    record.simulation =
        results::SimulationRecord{.platform = best.graph.platform, .execution_times = "recorded"};
    results::Repetition repetition;
    repetition.trace = trace;
    repetition.trace.chains = results::counted_chains(trace, Time{});
    repetition.accounts = account(best.tasks.set, repetition.trace);
    setup::keep_inputs(folder, common, load_graph(common.graph), record);
    record.runs.push_back(results::record_of(best.tasks.set, setup::chain_names(best.graph), repetition));
    folder.write("run.json", json(record));
    const results::Summary summary = results::summarize(best.tasks.set, {{trace.executor, {repetition}}},
                                                        setup::summary_options(common, best.graph));
    folder.close(record, json(summary));
  }

  const CtfOptions& options_;
  const fs::path output_;
  tracing::Assembler assembler_{*this};
  tracing::TraceReading reading_;
  std::vector<tracing::Job> jobs_;
  std::vector<tracing::LostSample> lost_;
  std::unique_ptr<Recording> recording_;  // null: the first jobs are not all read
  Interpretations interpretations_;
  std::unique_ptr<results::RunFolder> folder_;
  std::uint64_t later_jobs_ = 0;
};

/// Removes the files of a failed import, and the folder if the import created it.
void remove_files(const fs::path& output, bool is_new) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(output, ignored))
    fs::remove_all(entry.path(), ignored);
  if (is_new) fs::remove(output, ignored);
}

}  // namespace

void import_ctf(const CtfOptions& options) {
  const fs::path output = output_of(options);
  program::check_output_folder(output);
  const tracing::CtfTrace trace(options.trace);
  const bool is_new = !fs::exists(output);
  // Some damaged traces end the process of libbabeltrace2 by an assertion or a division by zero.
  const std::optional<int> status = program::continue_in_child();
  if (!status) {
    try {
      return CtfImport(options).run(trace);
    } catch (...) {
      remove_files(output, is_new);
      throw;
    }
  }
  remove_files(output, is_new);
  const std::string problem = "reading " + options.trace + " " + program::how_it_ended(*status);
  if (WTERMSIG(*status) == SIGKILL) throw program::RunError(problem + "; memory may have run out");
  throw program::UsageError(
      problem + ": the trace is damaged, and libbabeltrace2 does not survive it; record it again");
}

}  // namespace hotpath::imports
