// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "hotpath/core/csv.hpp"
#include "hotpath/core/golden_trace.hpp"
#include "hotpath/core/trace_csv.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "program/errors.hpp"
#include "results/stored_run.hpp"
#include "setup/run_setup.hpp"
#include "simulated/own_times.hpp"
#include "validation/validation.hpp"
#include "validation/validation_parts.hpp"

namespace hotpath {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

/// First releases that differ by more than this are not the same phases.
constexpr double kSamePhases_ms = 0.1;
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

double largest_difference_ms(const TaskSet& a, const std::vector<Duration>& first) {
  double largest = 0;
  for (TaskId id = 0; id < a.size(); ++id) {
    largest = std::max(largest, std::abs(to_ms(a[id].phase - first[id])));
  }
  return largest;
}

bool same_timers(const TaskSet& a, const TaskSet& b) {
  return std::equal(a.tasks.begin(), a.tasks.end(), b.tasks.begin(), b.tasks.end(),
                    [](const Task& x, const Task& y) { return x.name == y.name && x.period == y.period; });
}

/// Share of the time until the last finish in which jobs ran.
double busy_percent(const Schedule& schedule) {
  Duration busy{};
  Time end{};
  for (const ExecutedJob& job : schedule.jobs) {
    if (!job.finished()) continue;
    busy += job.finish - job.start;
    end = std::max(end, job.finish);
  }
  return end > Time{} ? 100 * to_ms(busy) / to_ms(end - Time{}) : 0;
}

/// How well a run meets the real stack, and why not better.
std::string golden_verdict(const ScheduleComparison& c, const Schedule& real, const Schedule& live,
                           double phases_differ_ms, const fs::path& file) {
  const std::string order =
      text("order %.3f alike, lost jobs within %.1f points", c.similarity, c.largest_loss_difference());
  if (phases_differ_ms > kSamePhases_ms) {
    return order +
           text("; the phases differ by up to %.1f ms, and they decide the order: give the run ",
                phases_differ_ms) +
           "`--phases-file " + file.filename().string() + "`";
  }
  if (agrees(c)) return order;
  if (c.similarity_by_period == 1) return order + "; the same but for the order among equal periods";
  return order +
         text(
             "; jobs ran %.1f %% of the time there and %.1f %% here: execution times, costs and noise of "
             "this machine put timers into another window, and all that follows shifts",
             busy_percent(real), busy_percent(live));
}

/// One run's folder against simulations with its phases and execution times, and against the reference.
class RunValidation {
 public:
  RunValidation(const fs::path& run, const fs::path& reference)
      : folder_(run), reference_(reference), measured_(run, "RUN") {
    read_facts();
    tasks_ = make_tasks(graph_);
    measured_.load(tasks_.set);
  }

  json validate() const {
    json all = json::array();
    for (const Trace& trace : measured_.traces()) all.push_back(validate(trace));
    return all;
  }

 private:
  void read_facts() {
    try {
      const json& facts = measured_.facts();
      graph_ = load_graph(find_graph(facts.at("graph").at("file").get<std::string>()));
      graph_.work = facts.at("work") == "wall" ? WorkMode::wall : WorkMode::fixed;
      if (facts.contains("platform")) graph_.platform = platform_from_json(facts.at("platform"));
      graph_.platform.cores = measured_.cores();
      scheduling_ = {facts.at("rule") == to_string(SubscriptionRule::first) ? SubscriptionRule::first
                                                                            : SubscriptionRule::inherit,
                     facts.at("ties") == to_string(Ties::fifo) ? Ties::fifo : Ties::lifo, 2};
      load_percent_ = facts.at("load_percent").get<double>();
      warm_up_ = seconds(facts.at("warm_up_s").get<double>());
      length_ = warm_up_ + seconds(facts.at("duration_s").get<double>());
      executors_ = facts.at("executors").get<std::vector<std::string>>();
    } catch (const json::exception& error) {
      throw UsageError(folder_.string() + ": its run.json is not one of `hotpath run`: " + error.what());
    }
  }

  json validate(const Trace& trace) const {
    GraphTasks tasks = tasks_;
    const auto first = measured_.first_timestamps(tasks.set, trace.executor, trace.repetition);
    for (TaskId id = 0; id < first.size(); ++id) tasks.set.tasks[id].phase = first[id];
    const ExecutorSpec executor = parse_executor(trace.executor, scheduling_);
    SimulationOptions options;
    options.platform = make_platform(graph_, *executor.entry);
    options.duration = length_;
    const auto times = replayed_times(measured_, graph_, tasks, trace.executor, trace.repetition);
    const Prediction p = predict(graph_, tasks, executor, *times, options, warm_up_);
    const Schedule live = schedule_of(tasks.set, trace);
    const ScheduleComparison c = compare(live, schedule_of(tasks.set, p.trace));
    json j = {{"run", folder_.string()},
              {"executor", trace.executor},
              {"repetition", trace.repetition},
              {"comparison", comparison_json(c, "measured", "simulated")}};
    const std::vector<double> measured =
        graph_.chains.empty() ? std::vector<double>{} : latencies_ms(measured_, trace, graph_);
    if (!measured.empty()) {
      add_latencies(j, latency_json(measured), latency_json(p.latencies_ms.at(0)));
      add_real_latencies(j, trace.executor, first);
    } else {
      j["verdict"] = agrees(c) ? "the schedule agrees with the simulation"
                               : "it parts from the simulation where a release and the end of a job almost "
                                 "coincide";
      add_golden_trace(j, live, *executor.entry);
    }
    return j;
  }

  static void add_latencies(json& j, const json& live, const json& simulated) {
    j["measured_ms"] = live;
    j["simulated_ms"] = simulated;
    if (live.at("n") == 0 || simulated.at("n") == 0) {
      j["verdict"] = "no output after the warm-up to compare";
      return;
    }
    j["verdict"] = median_verdict(live.at("p50"), simulated.at("p50"), 0.05,
                                  "latencies come in steps of one job, and a job that starts a little later "
                                  "than predicted finds another order and moves an output by a step");
  }

  /// The real stack's latencies, for Autoware at the same load.
  void add_real_latencies(json& j, const std::string& label, const std::vector<Duration>& first) const {
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
      j["real_ms"] = real_latency_json(row);
      const auto theirs = read_phases(file, graph_, label_there);
      TaskSet set = tasks_.set;
      for (TaskId id = 0; id < theirs.size(); ++id) set.tasks[id].phase = theirs[id];
      j["phases_differ_ms"] = largest_difference_ms(set, first);
      return;
    }
  }

  /// The real stack's schedule of the same task set under the same executor, if there is one.
  void add_golden_trace(json& j, const Schedule& live, const ExecutorEntry& executor) const {
    const std::string set = graph_.name.substr(0, graph_.name.find("_authors"));
    const fs::path file = reference_ / "traces" / (set + "." + std::string(executor.name) + ".csv");
    if (!fs::exists(file)) return;
    const bool release_only = executor.traits.timers == TimerHandling::release_only;
    const Schedule real = schedule_of(read_golden_trace(file), release_only);
    if (!same_timers(real.set, live.set)) return;
    std::vector<Duration> first;
    for (const Task& task : live.set.tasks) first.push_back(task.phase);
    const double phases_differ_ms = largest_difference_ms(real.set, first);
    const ScheduleComparison c = compare(real, live);
    j["golden"] = {{"set", set},
                   {"phases_differ_ms", phases_differ_ms},
                   {"busy_percent", {{"real", busy_percent(real)}, {"live", busy_percent(live)}}},
                   {"comparison", comparison_json(c, "real", "live")},
                   {"verdict", golden_verdict(c, real, live, phases_differ_ms, file)}};
  }

  const fs::path folder_, reference_;
  StoredRun measured_;
  Graph graph_;
  GraphTasks tasks_;
  SchedulerOptions scheduling_;
  double load_percent_ = 0;
  Duration length_{}, warm_up_{};
  std::vector<std::string> executors_;
};

}  // namespace

json validate_run(const fs::path& run, const fs::path& reference) {
  return RunValidation(run, reference).validate();
}

}  // namespace hotpath
