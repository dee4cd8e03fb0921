// SPDX-License-Identifier: Apache-2.0
#include "live/live_run.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>

#include "live/collected_trace.hpp"
#include "live/rclcpp_process.hpp"
#include "live/repetition_runner.hpp"
#include "machine/machine.hpp"
#include "machine/release_cost.hpp"
#include "program/errors.hpp"
#include "program/interrupt.hpp"
#include "program/json_output.hpp"
#include "program/progress.hpp"
#include "program/python_tool.hpp"
#include "program/text.hpp"
#include "results/executor_label.hpp"
#include "results/run_folder.hpp"
#include "results/summary.hpp"
#include "setup/run_setup.hpp"
#include "setup/setup_facts.hpp"
#include "setup/utilisation.hpp"

namespace hotpath::live {

namespace {

using nlohmann::json;

/// Time of a process before its epoch and after its end, for the estimate of the time left.
constexpr Duration kOverhead = std::chrono::milliseconds(400);

constexpr const char* kOrdinary =
    "SCHED_FIFO was not permitted: the paper's executors ran their timer management thread under the "
    "ordinary policy. For the paper's set-up run as root or with an rtprio limit.";

/// A name that nobody guesses.
std::string random_name() {
  std::random_device random;
  return program::text("run-%08x%08x%08x%08x", random(), random(), random(), random());
}

void say(const std::string& sentence) { std::cerr << "note: " << sentence << "\n"; }

class LiveRun {
 public:
  explicit LiveRun(const Options& options) : options_(options), plan_(options.plan) {
    if (options_.quick) {
      options_.duration_s = 2;
      options_.warm_up_s = 0.5;
      options_.repetitions = 1;
    }
    if (!options_.phases_of.empty()) {
      throw program::UsageError("--phases " + options_.phases_of +
                                ": a live run cannot repeat the phases of a run; simulate takes them");
    }
    graph_ = setup::graph_to_run(options_);
    plan_.graph = &graph_;
    plan_.tasks = make_tasks(graph_);
    name_stacks();
    executors_ = setup::executors_to_run(options_, graph_, plan_.tasks);
    counting_ = setup::summary_options(options_, graph_);
    for (const setup::ExecutorSpec& e : executors_) runs_.push_back({e.label, {}});
    check();
  }

  void run() {
    results::RunFolder folder(setup::output_folder(options_.output, graph_.name));
    program::catch_interrupts();
    for (const std::string& sentence : setup::idle_options(options_, executors_)) say(sentence);
    if (plan_.tasks.set.has_release_jitter()) {
      say("release_jitter_ms of the graph changes nothing: live timers have the jitter of the machine");
    }
    const auto polls = [](const setup::ExecutorSpec& part) {
      return part.entry->traits.timers == TimerHandling::polled;
    };
    if (plan_.timer_policy && std::ranges::all_of(executors_, [&](const setup::ExecutorSpec& e) {
          return std::ranges::all_of(setup::parts(e), polls);
        })) {
      say("--timer-policy changes nothing: none of these executors has a timer management thread");
    }
    for (const std::string& sentence : machine::warnings(machine_)) warn(sentence);
    warn_of_load();
    prepare_work();
    describe();
    setup::keep_inputs(folder, options_, graph_, run_);
    folder.write("run.json", json(run_));

    measure(folder);
    if (!run_.failures.empty() && nothing_measured()) {
      throw program::RunError(runs_planned() == 1
                                  ? run_.failures.front()
                                  : "every run failed; there is no result in " + folder.path().string());
    }

    const results::Summary summary = results::summarize(plan_.tasks.set, runs_, counting_);
    run_.partial = partial_;
    folder.close(run_, summary);
    report(folder, summary);
    program::show_json(summary);
  }

 private:
  Duration length() const { return from_s(options_.warm_up_s + options_.duration_s); }

  /// Marks executors on rclcpp in their labels; each stack adds all executors.
  void name_stacks() {
    std::vector<std::string> stacks, labels;
    for (const setup::Stack stack : options_.stacks) {
      if (stack == setup::Stack::native) {
        stacks.emplace_back();
        continue;
      }
      plan_.rclcpp = rclcpp_plan(options_, plan_);
      if (options_.rmw.empty()) stacks.emplace_back(results::kRclcppStack);
      for (const std::string& rmw : options_.rmw)
        stacks.push_back(program::concat(results::kRclcppStack, "-", rmw));
    }
    for (const std::string& stack : stacks) {
      for (const std::string& name : options_.executors) {
        results::ExecutorLabel label(name);
        if (!stack.empty()) label.stack = stack;
        labels.push_back(label.text());
      }
    }
    options_.executors = labels;
  }

  /// Rejects a run that cannot succeed, before any process starts.
  void check() {
    plan_.fastdds.loopback_only = !plan_.all_interfaces;
    // Keep out other programs and simultaneous runs. Readers of --live receive only the prefix.
    plan_.fastdds.partition = random_name();
    plan_.fastdds.topic_prefix = random_name() + "/";
    plan_.length = length();
    plan_.time_out = from_s(options_.time_out_s);
    check_run(options_, plan_, executors_);
    // The publishing process runs on the processors that --cpus leaves free.
    if (!plan_.cpus.empty())
      std::ranges::set_difference(allowed_cpus(), plan_.cpus, std::back_inserter(plan_.live_cpus));
    double buffers = 0;  // of one repetition
    for (const setup::ExecutorSpec& e : executors_) {
      const Plan p = plan(0, e);
      double own = 0;
      for (std::uint32_t process = 0; process < p.processes; ++process) {
        own += static_cast<double>(RunMemory::bytes(memory_size(p, process)));
      }
      buffers = std::max(buffers, own);
    }
    setup::check_trace_memory(options_, plan_.tasks, runs_planned(), buffers,
                              "a shorter --duration or fewer --repetitions");
  }

  /// Calibrates a fixed amount of work. Work in CPU time reads the clock anyway, so that the CPU time
  /// of each job costs little.
  void prepare_work() {
    Duration longest{};
    for (const Task& task : plan_.tasks.set.tasks) longest = std::max(longest, task.wcet);
    if (longest == Duration{}) return;
    if (graph_.work == WorkMode::cpu_time)
      plan_.cpu_time |= std::ranges::count(executors_, setup::Stack::native, &setup::ExecutorSpec::stack) > 0;
    if (graph_.work != WorkMode::fixed) return;
    const std::vector<int> before = allowed_cpus();
    if (!plan_.cpus.empty()) pin_to_cpus(plan_.cpus);
    plan_.calibration = calibrate(longest);
    if (!plan_.cpus.empty()) pin_to_cpus(before);
    if (plan_.calibration->disturbed)
      warn(
          "No two consecutive calibrations of the number cruncher agreed within 2 %: something disturbs this "
          "machine.");
  }

  Plan plan(std::uint32_t repetition, const setup::ExecutorSpec& executor) const {
    Plan p = plan_;
    p.executor = executor;
    if (!executor.entry) p.processes = static_cast<std::uint32_t>(executor.plan.processes.size());
    setup::set_phases(p.tasks.set,
                      setup::phases_of_repetition(options_, graph_, plan_.tasks, executor, repetition));
    p.repetition = repetition;
    if (options_.live) p.published = &run_;
    return p;
  }

  void measure(results::RunFolder& folder) {
    const auto order = setup::interleaved(options_.repetitions, executors_.size(), options_.seed);
    const Duration each = length() + kOverhead;
    const auto total =
        std::chrono::ceil<std::chrono::seconds>(each * static_cast<std::int64_t>(order.size()));
    if (total >= std::chrono::seconds(10)) {
      say(program::concat("measuring ", order.size(), " repetitions takes about ", total.count(), " s"));
    }
    program::Progress progress(order.size(), each);
    for (std::size_t i = 0; i < order.size() && !partial_; ++i) {
      const auto [repetition, e] = order[i];
      progress.begin(program::concat(executors_[e].label, ", repetition ", repetition));
      measure_one(folder, progress, e, repetition);
    }
  }

  void measure_one(results::RunFolder& folder, program::Progress& progress, std::size_t e,
                   std::uint32_t repetition) {
    const setup::ExecutorSpec& executor = executors_[e];
    const Plan p = plan(repetition, executor);
    Result result = run_repetition(p, [&](Duration elapsed) { progress.update(elapsed, length()); });
    progress.clear();
    partial_ = result.interrupted;
    Trace& trace = result.repetition.trace;
    trace.chains = results::counted_chains(trace, trace.epoch + counting_.warm_up);
    // A failed repetition is recorded in run.json only. Rows are stored before the record that
    // names them, so that a killed run can be recovered.
    if (result.measured) folder.append(p.tasks.set, counting_.chains, trace);
    note(p, result);
    const bool on_grid = !result.measured || options_.phases != Phases::given;
    const std::string off_grid = on_grid ? "" : left_grid(p.tasks.set, executor, result.repetition);
    if (!off_grid.empty()) warn(off_grid);
    folder.write("run.json", json(run_));
    if (result.setup_failed) throw program::RunError(result.failure);
    if (result.measured) runs_[e].repetitions.push_back(std::move(result.repetition));
  }

  std::size_t runs_planned() const { return options_.repetitions * executors_.size(); }

  bool nothing_measured() const {
    return std::ranges::all_of(runs_, [](const results::ExecutorRuns& r) { return r.repetitions.empty(); });
  }

  void note(const Plan& p, const Result& result) {
    for (const std::string& w : result.warnings) warn(w);
    if (!result.failure.empty()) {
      run_.failures.push_back(result.failure);
      if (runs_planned() > 1 && !result.setup_failed) say(result.failure);
    }
    if (!result.measured && result.failure.empty()) return;  // interrupted before it began
    results::RepetitionRecord& run =
        run_.runs.emplace_back(results::record_of(p.tasks.set, counting_.chains, result.repetition));
    run.thread_policies = result.policies;
    run.published = p.published != nullptr;
    run.failure = result.failure;
    const auto raises = [](const setup::ExecutorSpec& e) { return e.entry->traits.raises_timer_thread; };
    const bool wanted_real_time = std::ranges::any_of(setup::parts(p.executor), raises) && !p.timer_policy;
    if (wanted_real_time && result.timers_are_ordinary && std::ranges::count(run_.warnings, kOrdinary) == 0)
      warn(kOrdinary);
  }

  void warn_of_load() {
    Graph here = graph_;
    here.platform = {};
    here.platform.cores =
        static_cast<unsigned>(plan_.cpus.empty() ? allowed_cpus().size() : plan_.cpus.size());
    const setup::LiveThreads threads{machine_, plan_.executor_policy, plan_.timer_policy};
    for (const setup::ExecutorSpec& e : executors_) {
      for (const std::string& sentence : setup::utilisation(here, plan_.tasks, &e, &threads).warnings)
        warn(sentence);
    }
  }

  void describe() {
    Graph bounded = graph_;
    bounded.platform.release_cost = machine::measure_release_cost().p999;
    std::vector<std::string> warnings = std::move(run_.warnings), stacks;
    for (const setup::Stack stack : options_.stacks) stacks.emplace_back(to_string(stack));
    const auto text = [](const auto& policy) { return policy ? to_string(*policy) : ""; };
    run_ = setup::record_of(options_, graph_, plan_.tasks.set, executors_);
    run_.kind = results::RunKind::live;
    run_.bounds = setup::timer_bounds(bounded, plan_.tasks, executors_);
    run_.warnings = std::move(warnings);
    run_.live = results::LiveRecord{plan_,
                                    setup::time_stamp("%Y-%m-%dT%H:%M:%S%z"),
                                    stacks,
                                    text(plan_.executor_policy),
                                    text(plan_.timer_policy),
                                    machine_};
    if (plan_.cpus.empty()) run_.live->cpus = allowed_cpus();
  }

  void report(const results::RunFolder& folder, const results::Summary& summary) {
    if (nothing_measured()) return warn("Interrupted before anything was measured.");
    folder.show([&] {
      results::write_table(std::cout, summary);
      draw(folder, summary);
      if (partial_) warn("Interrupted: the measurements until then are kept and marked as partial.");
    });
    if (!run_.failures.empty()) {
      throw program::RunError(program::concat(run_.failures.size(), " of ", runs_planned(),
                                              " runs failed; the rest is in ", folder.path().string()));
    }
  }

  void draw(const results::RunFolder& folder, const results::Summary& summary) const {
    const bool outputs = std::ranges::any_of(summary.executors, [](const results::ExecutorSummary& executor) {
      return std::ranges::any_of(executor.chains,
                                 [](const results::ChainSummary& c) { return c.hot_path.quantiles.n > 0; });
    });
    if (outputs) {
      program::draw_figure("hot-path", folder.path());
    } else if (!graph_.chains.empty()) {
      say("No output of a chain was counted, so there is no figure; measure longer.");
    }
  }

  void warn(const std::string& sentence) {
    run_.warnings.push_back(sentence);
    say(sentence);
  }

  Options options_;
  Plan plan_;
  Graph graph_;
  std::vector<setup::ExecutorSpec> executors_;
  results::SummaryOptions counting_;
  std::vector<results::ExecutorRuns> runs_;
  const machine::Machine machine_ = machine::read_machine();
  results::RunRecord run_;
  bool partial_ = false;
};

}  // namespace

void run_live(const Options& options) { LiveRun(options).run(); }

}  // namespace hotpath::live
