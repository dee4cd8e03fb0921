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

#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/find_chains.hpp"
#include "import/chain_option.hpp"
#include "import/ctf_folders.hpp"
#include "import/ctf_reader.hpp"
#include "import/import_page.hpp"
#include "import/interpretation.hpp"
#include "import/trace_assembler.hpp"
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

namespace hotpath {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Rows that are sorted and written together after the window.
constexpr std::size_t kChunk = 20'000;
/// Time between two updates of the progress on a terminal.
constexpr Duration kUpdate = std::chrono::milliseconds(200);
/// Most chains to find if the user names none.
constexpr std::size_t kChainsFound = 5;
/// Share of pairs of tasks that may contradict an order.
constexpr double kSameOrder = 0.01;
/// The simulation begins with the recorded executors, so that no warm-up is needed.
constexpr Duration kWarmUp{};

fs::path output_of(const ImportCtfOptions& options) {
  if (!options.output.empty()) return options.output;
  return fs::path("imports") / fs::path(options.trace).lexically_normal().filename();
}

class CtfImport final : public RecordedJobSink {
 public:
  CtfImport(const ImportCtfOptions& options, const WholePackets& trace)
      : options_(options), trace_(trace), output_(output_of(options)), assembler_(*this) {}

  void run() {
    Progress progress(1, Duration::zero());
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
    reading_ = read_ctf(trace_, assembler_, update);
    assembler_.finish();
    progress.clear();
    if (!learnt_) learn();
    write();
  }

  void ended(RecordedJob&& job) override {
    jobs_.push_back(std::move(job));
    if (!learnt_ && jobs_.size() >= options_.jobs) {
      learn();
    } else if (learnt_ && jobs_.size() >= kChunk) {
      append();
    }
  }

  void lost(std::uint32_t subscription, const RecordedSample& sample, bool queued) override {
    lost_.push_back({subscription, sample, queued});
  }

 private:
  void learn() {
    learnt_ = true;
    const RecordedSystem& system = assembler_.system();
    if (jobs_.empty()) throw UsageError(no_jobs());
    std::ranges::sort(jobs_, {}, &RecordedJob::started);
    const Time last = jobs_.back().ended ? jobs_.back().finish : jobs_.back().start;
    recording_ = std::make_unique<Recording>(Recording{system,
                                                       {},
                                                       {},
                                                       recorded_executors(system, options_.executor),
                                                       std::move(jobs_),
                                                       std::move(lost_),
                                                       last + Duration(1),
                                                       cores(),
                                                       options_.deployment});
    jobs_.clear();
    lost_.clear();
    arrange({});
    interpretations_ = best_interpretation(*recording_, output_created(), kWarmUp);
    if (interpretations_.best.precedence.contradicting > kSameOrder) {
      arrange(service_order(system, recording_->graph, interpretations_.best.precedence));
      const double contradicting = interpretations_.best.precedence.contradicting;
      interpretations_.best = interpret(*recording_, std::vector(interpretations_.best.labels),
                                        interpretations_.best.graph.platform.timer_thread, output_, kWarmUp);
      recording_->graph.notes.push_back(
          text("Nodes and callbacks are in the order in which the executor served them; it contradicts their "
               "order of creation in %.0f %% of pairs.",
               100 * contradicting));
    }
    folder_ = std::make_unique<RunFolder>(output_ / "run");
    append_window();
  }

  /// Makes the graph with nodes and callbacks in that order.
  void arrange(const ServiceOrder& order) {
    Recording& r = *recording_;
    r.graph = make_recorded_graph(r.system, r.jobs, r.executors.of_callback,
                                  fs::path(options_.trace).lexically_normal().filename(), order);
    r.timers = recorded_timers(r.system, r.graph, r.jobs, r.end);
    set_phases();
    find_the_chains();
  }

  std::string no_jobs() const {
    if (!reading_.broken_off.empty() && assembler_.system().nodes.empty())
      return options_.trace + " breaks off " + reading_.broken_off +
             " and has no event of ros2_tracing before; record it again";
    if (assembler_.system().nodes.empty()) {
      return options_.trace +
             " has no events of ros2_tracing; record user-space events `ros2:*` (`lttng enable-event -u "
             "'ros2:*'`, or `ros2 trace`)";
    }
    return options_.trace +
           " has nodes, but no callback runs; record for longer, and enable the events "
           "ros2:callback_start and ros2:callback_end";
  }

  const fs::path& output_created() const {
    create_folder(output_);
    return output_;
  }

  unsigned cores() const {
    if (options_.cores > 0) return options_.cores;
    std::set<std::int32_t> processors;
    for (const RecordedThread& t : assembler_.system().threads)
      for (const std::int32_t processor : usual_processors(t)) processors.insert(processor);
    return std::max<unsigned>(1,
                              static_cast<unsigned>(std::min<std::size_t>(processors.size(), kMaxWorkers)));
  }

  void set_phases() {
    RecordedGraph& graph = recording_->graph;
    for (TaskId id = 0; id < graph.callback_of.size(); ++id) {
      const TaskOrigin& origin = graph.tasks.origin[id];
      Callback& callback = graph.graph.nodes[origin.node].callbacks[origin.callback];
      if (callback.input) continue;
      Duration phase = graph.callback_of[id] != kNone ? recording_->timers.first[id] - graph.epoch
                                                      : *callback.phase - (graph.epoch - Time{});
      if (phase < Duration::zero()) phase -= ((phase + Duration(1)) / callback.period - 1) * callback.period;
      callback.phase = phase;
      if (graph.callback_of[id] == kNone) recording_->timers.first[id] = graph.epoch + phase;
    }
    graph.tasks = make_tasks(graph.graph);
  }

  void find_the_chains() {
    RecordedGraph& graph = recording_->graph;
    for (const std::string& text : options_.chains)
      graph.graph.chains.push_back(chain_of(text, graph.graph, graph.tasks));
    if (options_.chains.empty()) graph.graph.chains = find_chains(graph.graph, graph.tasks, kChainsFound);
  }

  void append_window() {
    const Trace& trace = interpretations_.best.trace;
    Trace rows = trace;
    std::ranges::stable_sort(rows.jobs, {},
                             [](const JobRecord& r) { return std::max(r.start, r.job.timestamp); });
    const Interpretation& best = interpretations_.best;
    rows.chains = counted_chains(trace, measured_chains(best.graph, best.tasks), Time{} + kWarmUp);
    folder_->append(best.tasks.set, chain_names(best.graph), rows);
  }

  /// Appends the jobs after the window.
  void append() {
    std::ranges::sort(jobs_, {}, &RecordedJob::started);
    Trace rows;
    rows.executor = interpretations_.best.trace.executor;
    rows.epoch = recording_->graph.epoch;
    for (const RecordedJob& job : jobs_)
      if (recording_->graph.task(job.ref) != kNoTask)
        rows.jobs.push_back(interpretations_.best.rows->job(job));
    for (const Recording::Lost& l : lost_)
      if (l.subscription < recording_->graph.task_of.size() &&
          recording_->graph.task_of[l.subscription] != kNoTask)
        rows.jobs.push_back(interpretations_.best.rows->lost(l.subscription, l.sample, l.queued));
    later_jobs_ += jobs_.size();
    jobs_.clear();
    lost_.clear();
    folder_->append(interpretations_.best.tasks.set, {}, rows);
  }

  void write() {
    if (!jobs_.empty() || !lost_.empty()) append();
    const Interpretation& best = interpretations_.best;
    const fs::path graph_file = output_ / "graph.yaml";
    write_graph(graph_file, best.graph, import_comments(*recording_, best), write_with_folder);
    write_run(*folder_, graph_file, best.trace, RunKind::recorded);
    if (best.check.failure.empty()) {
      RunFolder simulated(output_ / "simulated");
      simulated.append(best.tasks.set, chain_names(best.graph), best.check.simulated);
      write_run(simulated, graph_file, best.check.simulated, RunKind::simulated);
    }
    const ImportFacts facts{reading_, *recording_, interpretations_, later_jobs_, options_.trace};
    write_whole_file(output_ / "import.json", "--output", import_json(facts));
    draw_figure("import-page", output_);
    print_import(std::cout, facts, output_);
  }

  void write_run(RunFolder& folder, const fs::path& graph_file, const Trace& trace, RunKind kind) {
    const Interpretation& best = interpretations_.best;
    CommonOptions common;
    common.graph = graph_file;
    common.phases = Phases::given;
    common.warm_up_s = to_ms(kWarmUp) / 1000;
    common.duration_s = to_ms(trace.end - Time{} - kWarmUp) / 1000;
    RunRecord record = record_of(common, best.graph, best.tasks.set, {*best.executor});
    record.kind = kind;
    record.simulation = SimulationRecord{.platform = best.graph.platform, .execution_times = "recorded"};
    Repetition repetition;
    repetition.trace = trace;
    repetition.trace.chains =
        counted_chains(trace, measured_chains(best.graph, best.tasks), Time{} + kWarmUp);
    repetition.accounts = account(best.tasks.set, repetition.trace);
    record.runs.push_back(record_of(best.tasks.set, chain_names(best.graph), repetition));
    folder.write("run.json", json(record));
    const Summary summary = summarize(best.tasks.set, {{trace.executor, {repetition}}},
                                      summary_options(common, best.graph, best.tasks));
    folder.close(record, json(summary));
  }

  const ImportCtfOptions& options_;
  const WholePackets& trace_;
  const fs::path output_;
  TraceAssembler assembler_;
  TraceReading reading_;
  std::vector<RecordedJob> jobs_;
  std::vector<Recording::Lost> lost_;
  bool learnt_ = false;
  std::unique_ptr<Recording> recording_;
  Interpretations interpretations_;
  std::unique_ptr<RunFolder> folder_;
  std::uint64_t later_jobs_ = 0;
};

/// Removes the files of a failed import, and the folder if the import created it.
class UnlessDone {
 public:
  explicit UnlessDone(fs::path output) : output_(std::move(output)), is_new_(!fs::exists(output_)) {}
  UnlessDone(const UnlessDone&) = delete;
  UnlessDone& operator=(const UnlessDone&) = delete;
  ~UnlessDone() {
    std::error_code ignored;
    if (done_) return;
    for (const fs::directory_entry& entry : fs::directory_iterator(output_, ignored)) {
      fs::remove_all(entry.path(), ignored);
    }
    if (is_new_) fs::remove(output_, ignored);
  }
  void done() { done_ = true; }

 private:
  const fs::path output_;
  const bool is_new_;
  bool done_ = false;
};

}  // namespace

void import_ctf(const ImportCtfOptions& options) {
  const fs::path output = output_of(options);
  check_output_folder(output);
  const WholePackets trace(ctf_folders(options.trace));
  UnlessDone written(output);
  // Some damaged traces end the process of libbabeltrace2 by an assertion or a division by zero.
  const std::optional<int> status = continue_in_child();
  if (!status) {
    CtfImport(options, trace).run();
    return written.done();
  }
  const std::string problem = "reading " + options.trace + " " + how_it_ended(*status);
  if (WTERMSIG(*status) == SIGKILL) throw RunError(problem + "; memory may have run out");
  throw UsageError(problem +
                   ": the trace is damaged, and libbabeltrace2 does not survive it; record it again");
}

}  // namespace hotpath
