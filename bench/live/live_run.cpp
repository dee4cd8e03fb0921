// SPDX-License-Identifier: Apache-2.0
#include "live/live_run.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>

#include "live/publishing_effect.hpp"
#include "live/repetition_runner.hpp"
#include "machine/machine.hpp"
#include "machine/release_cost.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/progress.hpp"
#include "program/python_tool.hpp"
#include "results/run_facts.hpp"
#include "results/run_folder.hpp"
#include "results/summary_table.hpp"
#include "setup/run_setup.hpp"

namespace hotpath {

namespace {

using nlohmann::json;

/// What a process needs before its epoch and after its end, for the estimate of the time left.
constexpr Duration kOverhead = std::chrono::milliseconds(400);

class LiveRun {
 public:
  explicit LiveRun(const RunOptions& options) : options_(options) {
    if (options_.quick) {
      options_.duration_s = 2;
      options_.warm_up_s = 0.5;
      options_.repetitions = 1;
    }
    if (!options_.phases_file.empty()) options_.phases = Phases::given;
    graph_ = graph_to_run(options_);
    tasks_ = make_tasks(graph_);
    executors_ = executors_to_run(options_);
    counting_ = summary_options(options_, graph_, tasks_);
    for (const ExecutorSpec& e : executors_) runs_.push_back({e.label, {}});
    check();
  }

  void run() {
    RunFolder folder(output_folder(options_, graph_));
    catch_interrupts();
    for (const std::string& sentence : warnings(machine_)) warn(sentence);
    calibrate_work();
    describe();
    folder.write("run.json", run_);

    measure(folder);
    if (!failures_.empty() && nothing_measured()) {
      throw RunError(runs_planned() == 1
                         ? failures_.front()
                         : "every run failed; there is no result in " + folder.path().string());
    }
    folder.finish();

    const Summary summary = summarize(tasks_.set, runs_, counting_);
    const std::vector<PublishingEffect> effects =
        options_.live_alternate ? publishing_effects(runs_, counting_) : std::vector<PublishingEffect>{};
    json summary_json = to_json(summary);
    if (options_.live_alternate) summary_json["live_publishing"] = to_json(effects);
    folder.write("summary.json", summary_json);
    run_["complete"] = failures_.empty() && !partial_;
    run_["partial"] = partial_;
    run_["failures"] = failures_;
    run_["warnings"] = warnings_;
    folder.write("run.json", run_);
    report(folder, summary, effects);
  }

 private:
  /// Refuses what cannot run, before anything does.
  void check() {
    cpus_ = parse_cpus("--cpus", options_.cpus);
    check_publishing();
    try {
      if (!options_.executor_policy.empty()) executor_policy_ = parse_thread_policy(options_.executor_policy);
      if (!options_.timer_policy.empty()) timer_policy_ = parse_thread_policy(options_.timer_policy);
    } catch (const std::invalid_argument& error) {
      throw UsageError(error.what());
    }
    if (options_.processes > 1 && options_.transport == TransportKind::intra_process) {
      throw UsageError("--processes " + std::to_string(options_.processes) +
                       " needs --transport fastdds: intra_process stays within one process");
    }
    if (options_.processes > graph_.nodes.size()) {
      throw UsageError("--processes " + std::to_string(options_.processes) + ": the graph has only " +
                       std::to_string(graph_.nodes.size()) + " nodes");
    }
    for (const ExecutorSpec& e : executors_) phases_of_repetition(options_, graph_, tasks_, e, 0);
  }

  void check_publishing() {
    publisher_cpus_ = parse_cpus("--live-cpus", options_.live_cpus);
    if (!publisher_cpus_.empty() && !options_.live && !options_.live_alternate) {
      throw UsageError("--live-cpus says where to publish; add --live");
    }
    if (options_.live_alternate && options_.repetitions < 2) {
      throw UsageError("--live-alternate compares repetitions; add --repetitions with 4 or more");
    }
    if (publisher_cpus_.empty() && !cpus_.empty()) {
      const std::vector<int> available = allowed_cpus();
      std::set_difference(available.begin(), available.end(), cpus_.begin(), cpus_.end(),
                          std::back_inserter(publisher_cpus_));
    }
  }

  bool published(std::uint32_t repetition) const {
    return options_.live || (options_.live_alternate && published_by_turns(repetition));
  }

  Publishing publishing() const {
    json facts = run_;
    facts.erase("runs");
    return {publisher_cpus_, seconds(options_.warm_up_s), facts.dump()};
  }

  void calibrate_work() {
    Duration typical{};
    for (const Task& task : make_tasks(graph_).set.tasks) typical = std::max(typical, task.wcet);
    const std::vector<int> before = allowed_cpus();
    if (!cpus_.empty()) pin_to_cpus(cpus_);
    calibration_ = calibrate(typical);
    if (!cpus_.empty()) pin_to_cpus(before);
    if (calibration_.disturbed) {
      warn(
          "No two calibrations of the number cruncher in a row agreed within 2 %: something disturbs this "
          "machine.");
    }
  }

  /// All runs in the order in which they happen.
  std::vector<std::pair<std::uint32_t, std::size_t>> schedule() const {
    std::vector<std::pair<std::uint32_t, std::size_t>> order;
    std::mt19937_64 random(options_.seed);
    for (std::uint32_t r = 0; r < options_.repetitions; ++r) {
      const auto begin = order.size();
      for (std::size_t e = 0; e < executors_.size(); ++e) order.emplace_back(r, e);
      for (std::size_t i = order.size() - 1; i > begin; --i) {
        std::swap(order[i], order[begin + random() % (i - begin + 1)]);
      }
    }
    return order;
  }

  RepetitionPlan plan(std::uint32_t repetition, const ExecutorSpec& executor) const {
    RepetitionPlan p;
    p.graph = &graph_;
    p.tasks = tasks_;
    const std::vector<Duration> phases = phases_of_repetition(options_, graph_, tasks_, executor, repetition);
    for (TaskId id = 0; id < phases.size(); ++id) p.tasks.set.tasks[id].phase = phases[id];
    p.executor = executor;
    p.repetition = repetition;
    p.transport = options_.transport;
    p.fastdds.domain = options_.domain;
    // Keeps runs at the same time on one machine apart.
    p.fastdds.partition = "hotpath-" + std::to_string(getpid());
    p.fastdds.network = options_.network;
    p.fastdds.loopback_only = !options_.all_interfaces;
    p.processes = options_.processes;
    p.cpus = cpus_;
    p.lock_memory = options_.lock_memory;
    p.measure_cpu_time = options_.measure_cpu_time;
    p.executor_policy = executor_policy_;
    p.timer_policy = timer_policy_;
    p.length = seconds(options_.warm_up_s + options_.duration_s);
    p.time_out = seconds(options_.time_out_s);
    p.calibration = calibration_;
    if (published(repetition)) p.publishing = publishing();
    return p;
  }

  void measure(RunFolder& folder) {
    const auto order = schedule();
    const Duration length = seconds(options_.warm_up_s + options_.duration_s);
    Progress progress((length + kOverhead) * static_cast<std::int64_t>(order.size()));
    const std::vector<MeasuredChain> chains = measured_chains(graph_, tasks_);
    for (std::size_t i = 0; i < order.size() && !partial_; ++i) {
      const auto [repetition, e] = order[i];
      progress.begin("[" + std::to_string(i + 1) + "/" + std::to_string(order.size()) + "] " +
                         executors_[e].label + ", repetition " + std::to_string(repetition),
                     (length + kOverhead) * static_cast<std::int64_t>(i));
      const RepetitionPlan p = plan(repetition, executors_[e]);
      RepetitionResult result =
          run_repetition(p, [&](Duration elapsed) { progress.update(elapsed, length); });
      progress.clear();
      partial_ = result.interrupted;
      Trace& trace = result.repetition.trace;
      trace.chains = counted_chains(trace, chains, trace.epoch + counting_.warm_up);
      note(p, result);
      folder.write("run.json", run_);
      if (result.setup_failed) throw RunError(result.failure);
      // A repetition that failed is on record in run.json and counts for nothing.
      if (result.measured) {
        folder.append(p.tasks.set, counting_.chains, trace);
        runs_[e].repetitions.push_back(std::move(result.repetition));
      }
    }
    for (ExecutorRuns& r : runs_) {
      std::sort(r.repetitions.begin(), r.repetitions.end(), [](const Repetition& a, const Repetition& b) {
        return a.trace.repetition < b.trace.repetition;
      });
    }
  }

  std::size_t runs_planned() const { return options_.repetitions * executors_.size(); }

  bool nothing_measured() const {
    return std::all_of(runs_.begin(), runs_.end(),
                       [](const ExecutorRuns& r) { return r.repetitions.empty(); });
  }

  void note(const RepetitionPlan& p, const RepetitionResult& result) {
    for (const std::string& w : result.warnings) warn(w);
    if (!result.failure.empty()) {
      failures_.push_back(result.failure);
      run_["failures"] = failures_;
      if (runs_planned() > 1 && !result.setup_failed) say(result.failure);
    }
    if (!result.measured && result.failure.empty()) return;  // interrupted before it began
    json& run = run_["runs"].emplace_back(repetition_json(p.tasks.set, counting_.chains, result.repetition));
    run.update({{"thread_policies", result.policies},
                {"live", p.publishing.has_value()},
                {"failure", result.failure}});
    const bool wanted_real_time = p.executor.entry->traits.raises_timer_thread && !p.timer_policy;
    if (wanted_real_time && result.timers_are_ordinary && !told_no_real_time_) {
      told_no_real_time_ = true;
      warn(
          "SCHED_FIFO was not permitted: the paper's executors ran their timer management thread under the "
          "ordinary policy. Run as root or with an rtprio limit for the paper's set-up.");
    }
    check_throttling(p);
  }

  /// The paper's release-and-execute runs jobs at SCHED_FIFO, which the kernel stops for the rest of each
  /// period.
  void check_throttling(const RepetitionPlan& p) {
    if (told_throttling_ || machine_.rt_runtime_us < 0 || machine_.rt_period_us <= 0) return;
    const ExecutorOptions defaults = default_options(*p.executor.entry);
    const ThreadPolicy policy = p.timer_policy.value_or(defaults.timer_thread.policy);
    const bool runs_timers = p.executor.entry->traits.timers == TimerHandling::release_and_execute;
    if (policy.scheduling_class == ThreadPolicy::Class::other || !runs_timers) return;
    double timers = 0;
    for (const Task& t : p.tasks.set.tasks) {
      if (t.kind == TaskKind::timer) timers += to_ms(t.wcet) / to_ms(t.period);
    }
    const double limit =
        static_cast<double>(machine_.rt_runtime_us) / static_cast<double>(machine_.rt_period_us);
    if (timers < limit) return;
    told_throttling_ = true;
    warn("Timers alone need " + std::to_string(std::lround(100 * timers)) +
         " % of a core at SCHED_FIFO, and the " + "kernel's real-time throttling allows " +
         std::to_string(std::lround(100 * limit)) +
         " %: jobs will be held up. Raise /proc/sys/kernel/sched_rt_runtime_us or use --timer-policy other.");
  }

  void describe() {
    run_ = common_facts(options_, graph_, tasks_.set, executors_);
    run_.update({{"kind", "live"},
                 {"date", time_stamp("%Y-%m-%dT%H:%M:%S%z")},
                 {"transport", to_string(options_.transport)},
                 {"network", to_string(options_.network)},
                 {"processes", options_.processes},
                 {"cpus", cpus_.empty() ? allowed_cpus() : cpus_},
                 {"calibration",
                  {{"divisions_per_us", calibration_.divisions_per_us},
                   {"spread_percent", calibration_.spread_percent},
                   {"readings", calibration_.readings},
                   {"disturbed", calibration_.disturbed}}},
                 {"machine", to_json(machine_)},
                 {"bounds", bounds_json(graph_, tasks_, executors_, measure_release_cost().p999)},
                 {"warnings", warnings_}});
  }

  void report(const RunFolder& folder, const Summary& summary, const std::vector<PublishingEffect>& effects) {
    if (nothing_measured()) {
      warn("Interrupted before anything was measured.");
      return;
    }
    write_table(std::cout, summary);
    if (options_.live_alternate) write_publishing_effects(std::cout, effects);
    draw(folder, summary);
    if (partial_) warn("Interrupted: what was measured until then is kept and marked as partial.");
    std::cout << "\nResults: " << folder.path().string() << "\n" << std::flush;
    if (!failures_.empty()) {
      throw RunError(std::to_string(failures_.size()) + " of " + std::to_string(runs_planned()) +
                     " runs failed; the rest is in " + folder.path().string());
    }
  }

  static void draw(const RunFolder& folder, const Summary& summary) {
    bool chains = false, outputs = false;
    for (const ExecutorSummary& executor : summary.executors) {
      for (const ChainSummary& chain : executor.chains) {
        chains = true;
        outputs = outputs || chain.hot_path.quantiles.n > 0;
      }
    }
    if (outputs) {
      draw_figure("hot-path", folder.path());
    } else if (!chains) {
      draw_figure("timers-only", folder.path());
    } else {
      say("No output of a chain was counted, so there is no figure; measure longer.");
    }
  }

  static void say(const std::string& sentence) { std::cerr << "note: " << sentence << "\n"; }

  void warn(const std::string& sentence) {
    warnings_.push_back(sentence);
    say(sentence);
  }

  RunOptions options_;
  Graph graph_;
  GraphTasks tasks_;
  std::vector<ExecutorSpec> executors_;
  SummaryOptions counting_;
  std::vector<ExecutorRuns> runs_;
  std::vector<int> cpus_, publisher_cpus_;
  std::optional<ThreadPolicy> executor_policy_, timer_policy_;
  const Machine machine_ = read_machine();
  Calibration calibration_;
  json run_;
  std::vector<std::string> warnings_, failures_;
  bool partial_ = false;
  bool told_no_real_time_ = false, told_throttling_ = false;
};

}  // namespace

void run_live(const RunOptions& options) { LiveRun(options).run(); }

}  // namespace hotpath
