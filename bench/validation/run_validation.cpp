// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <nlohmann/json.hpp>

#include "hotpath/core/csv.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "results/stored_run.hpp"
#include "setup/run_setup.hpp"
#include "setup/setup_facts.hpp"
#include "simulated/own_times.hpp"
#include "validation/validation.hpp"

namespace hotpath {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr double kSameLoad_percent = 2;
/// The reference's crunch of 4.22 ms at 190 crunches a second.
constexpr double kReferenceLoad_percent = 80.2;

/// Hot-path latencies of the graph's first chain in one repetition.
std::vector<double> latencies_ms(const StoredRun& run, const Trace& trace, const Graph& graph) {
  std::vector<double> latencies;
  for (const ChainRecord& r : trace.chains) {
    if (run.chains()[r.chain] == graph.chains.front().name) latencies.push_back(to_ms(r.hot_path_latency));
  }
  return latencies;
}

/// One run's folder against simulations with its phases and execution times, and against the reference.
class ValidatedRun {
 public:
  ValidatedRun(const fs::path& run, const fs::path& reference)
      : reference_(reference), measured_(run, "RUN") {
    measured_.check([this] {
      const json& facts = measured_.facts();
      graph_ = load_graph(find_graph(facts.at("graph").at("file").get<std::string>()));
      graph_.work = word<WorkMode>(facts, "work");
      if (facts.contains("platform")) graph_.platform = platform_from_json(facts.at("platform"));
      graph_.platform.cores = measured_.cores();
      scheduling_ = {word<SubscriptionRule>(facts, "rule"), word<Ties>(facts, "ties"), 2};
      load_percent_ = facts.at("load_percent").get<double>();
    });
    tasks_ = make_tasks(graph_);
    measured_.load(tasks_.set);
  }

  std::vector<RunValidation> validate() const {
    std::vector<RunValidation> all;
    for (const Trace& trace : measured_.traces()) all.push_back(validate(trace));
    return all;
  }

 private:
  /// Of a key of run.json, whose first word is the default of runs that do not know it.
  template <class Enum>
  static Enum word(const json& facts, const char* key) {
    return parse<Enum>(facts.at(key).get<std::string>()).value_or(Enum{});
  }

  RunValidation validate(const Trace& trace) const {
    GraphTasks tasks = tasks_;
    const auto first = measured_.first_timestamps(tasks.set, trace.executor, trace.repetition);
    set_phases(tasks.set, first);
    if (find_executor(trace.executor.substr(0, trace.executor.find_first_of(":@"))) == nullptr) {
      throw UsageError(concat(measured_.folder().string(), ": ", trace.executor,
                              " is a deployment; validate compares runs of single executors"));
    }
    const ExecutorSpec executor = parse_executor(trace.executor, scheduling_);
    SimulationOptions options;
    options.platform = make_platform(graph_, *executor.entry);
    options.duration = measured_.length();
    if (!measured_.facts().contains("platform")) {  // live
      const OwnCosts costs = own_costs(trace, options.platform.cores);
      options.platform.dispatch_cost = costs.dispatch;
      options.platform.wake_up_latency = costs.wake_up;
    }
    const auto times = replayed_times(measured_, graph_, tasks, trace.executor, trace.repetition);
    const SimulatedOutcome p = predict(graph_, tasks, executor, *times, options, measured_.warm_up());
    const Schedule schedule = schedule_of(tasks.set, trace);
    RunValidation v{measured_.folder().string(),
                    trace.executor,
                    trace.repetition,
                    {{"dispatch", 1e3 * to_ms(options.platform.dispatch_cost)},
                     {"wake_up", 1e3 * to_ms(options.platform.wake_up_latency)}},
                    compare_schedules(schedule, schedule_of(tasks.set, p.trace)),
                    {},
                    {}};
    const std::vector<double> measured =
        graph_.chains.empty() ? std::vector<double>{} : latencies_ms(measured_, trace, graph_);
    if (!measured.empty()) {
      v.latencies = {latency_quantiles(measured), latency_quantiles(p.latencies_ms.at(0)), {}, {}, false};
      v.latencies->agrees = medians_agree(v.latencies->measured_ms, v.latencies->simulated_ms, 0.05);
      add_real_latencies(*v.latencies, trace.executor, first);
    } else {
      v.golden = against_golden(reference_, graph_.name, schedule, *executor.entry);
    }
    return v;
  }

  /// The real stack's latencies, for Autoware at the same load.
  void add_real_latencies(RunLatencies& latencies, const std::string& label,
                          const std::vector<Duration>& first) const {
    if (graph_.name != "autoware") return;
    if (std::abs(load_percent_ - kReferenceLoad_percent) > kSameLoad_percent) return;
    const fs::path file = reference_ / "rclcpp_autoware_phases.csv";
    for (CsvReader row(file); row.next();) {
      // `rm-ro (first)` there is `rm-ro:first` here.
      const std::string label_there(row.text("executor"));
      std::string name = label_there;
      const bool subscriptions_first = name.ends_with(" (first)");
      if (subscriptions_first) name.resize(name.find(' '));
      const bool ours_first = label.ends_with(":first") || scheduling_.rule == SubscriptionRule::first;
      if (label.substr(0, label.find(':')) != name || subscriptions_first != ours_first) continue;
      latencies.real_ms = real_latencies(row);
      const auto theirs = read_phases(file, graph_, label_there);
      TaskSet set = tasks_.set;
      set_phases(set, theirs);
      latencies.phases_differ_ms = largest_phase_difference_ms(set, first);
      return;
    }
  }

  const fs::path reference_;
  StoredRun measured_;
  Graph graph_;
  GraphTasks tasks_;
  SchedulerOptions scheduling_;
  double load_percent_ = 0;
};

}  // namespace

std::vector<RunValidation> validate_run(const fs::path& run, const fs::path& reference) {
  return ValidatedRun(run, reference).validate();
}

}  // namespace hotpath
