// SPDX-License-Identifier: Apache-2.0
#include "import/interpretation.hpp"

#include <algorithm>
#include <set>

#include "hotpath/reference_system/graph_workload.hpp"
#include "import/early_publications.hpp"
#include "import/recorded_chains.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "program/whole_file.hpp"
#include "setup/run_setup.hpp"

namespace hotpath {

namespace {

/// Execution times with a first autocorrelation above this are not independent.
constexpr double kCorrelated = 0.1;

/// Jobs with which executors are tried: the time of comparing orders grows with their square.
constexpr std::size_t kTried = 20'000;

const ExecutorEntry& entry_of(const std::string& label) { return *parse_executor(label, {}).entry; }

class Interpreter {
 public:
  Interpreter(const Recording& recording, const std::vector<std::string>& labels, TimerThread timer_thread)
      : recording_(recording) {
    result_.labels = labels;
    result_.graph = recording.graph.graph;
    result_.graph.platform.timer_thread = timer_thread;
  }

  Interpretation interpret(const std::filesystem::path& folder, Duration warm_up) {
    make_records();
    measure_costs();
    result_.tasks = make_tasks(result_.graph);
    make_trace();
    set_times();
    result_.tasks = make_tasks(result_.graph);
    if (times_are_correlated()) result_.graph.platform.execution_times = ExecutionTimeModel::replayed;
    choose_executor(folder);
    std::vector<ChainObservation> observations =
        recorded_chains(recording_.system, recording_.graph, window());
    for (ChainObservation& o : observations) {
      o.sink_start -= recording_.graph.epoch - Time{};
      o.latest_source_start -= recording_.graph.epoch - Time{};
    }
    result_.trace.chains = join_chains(result_.graph, result_.tasks, result_.trace, observations);
    result_.check = self_check(result_.graph, result_.tasks, *result_.executor, result_.trace, warm_up);
    if (result_.check.light != Light::green) explain();
    return std::move(result_);
  }

 private:
  RecordedWindow window() const { return {recording_.jobs, result_.records}; }

  /// The executor of a task; the first executor if no callback of the task's node ran.
  std::uint32_t executor_of(TaskId id) const {
    const auto& of_callback = recording_.executors.of_callback;
    const std::uint32_t c = recording_.graph.callback_of[id];
    if (c != kNone && of_callback[c] != kNone) return of_callback[c];
    for (TaskId other = 0; other < recording_.graph.callback_of.size(); ++other) {
      const std::uint32_t o = recording_.graph.callback_of[other];
      const bool same_node =
          recording_.graph.tasks.origin[other].node == recording_.graph.tasks.origin[id].node;
      if (same_node && o != kNone && of_callback[o] != kNone) return of_callback[o];
    }
    return 0;
  }

  void make_records() {
    const TaskId count = recording_.graph.tasks.set.size();
    std::vector<bool> release_only;
    for (TaskId id = 0; id < count; ++id) {
      // The jobs decide where they contradict the executor, which may be inferred wrongly.
      const TimerHandling timers = entry_of(result_.labels[executor_of(id)]).traits.timers;
      release_only.push_back(timers == TimerHandling::release_only || recording_.timers.released[id]);
    }
    result_.rows = std::make_unique<RecordedTrace>(recording_.system, recording_.graph, recording_.timers,
                                                   std::move(release_only));
    for (const RecordedJob& job : recording_.jobs) {
      const bool in_graph = recording_.graph.task(job.ref) != kNoTask;
      result_.records.push_back(in_graph ? result_.rows->job(job) : JobRecord{});
    }
    displacement_ = recorded_displacement(recording_.system, window());
    if (recording_.executors.executors.size() > 1) {
      for (std::size_t i = 0; i < result_.records.size(); ++i)
        if (result_.records[i].outcome == Outcome::ran) result_.records[i].cpu_time = displacement_.own[i];
    }
    const bool wait_sets = entry_of(result_.labels.front()).traits.family == Family::wait_set;
    result_.precedence = recorded_precedence(recording_.graph, window(), wait_sets);
  }

  void measure_costs() {
    GraphPlatform& platform = result_.graph.platform;
    platform.cores = recording_.cores;
    platform.execution_times = ExecutionTimeModel::measured;
    double dispatch = 0, wait = 0, wake_up = 0, jobs = 0;
    for (std::size_t e = 0; e < result_.labels.size(); ++e) {
      const RecordedExecutor& executor = recording_.executors.executors[e];
      const RecordedCosts costs =
          recorded_costs(recording_.graph, window(), executor, entry_of(result_.labels[e]));
      result_.costs.push_back(costs);
      double weight = 0;
      for (const std::uint32_t t : executor.threads)
        weight += static_cast<double>(recording_.system.threads[t].jobs);
      const auto add = [&](double& sum, const MeasuredCost& cost) {
        sum += weight * static_cast<double>(cost.median.count());
      };
      add(dispatch, costs.dispatch);
      add(wait, costs.wait);
      add(wake_up, costs.wake_up);
      jobs += weight;
    }
    const auto mean = [&](double sum) {
      return Duration(static_cast<std::int64_t>(jobs > 0 ? sum / jobs : 0));
    };
    platform.dispatch_cost = mean(dispatch);
    platform.wait_cost = mean(wait);
    platform.wake_up = mean(wake_up);
  }

  void make_trace() {
    Trace& trace = result_.trace;
    const Duration epoch = recording_.graph.epoch - Time{};
    trace.end = recording_.end - epoch;
    trace.published.resize(result_.tasks.set.size());
    const auto add = [&](JobRecord r) {
      if (started(r)) r.start -= epoch;
      if (r.outcome == Outcome::ran) r.finish -= epoch;
      r.job.timestamp -= epoch;
      r.job.release -= epoch;
      if (r.job.deadline != kNever) r.job.deadline -= epoch;
      if (result_.tasks.set[r.job.task].kind == TaskKind::subscription) ++trace.published[r.job.task];
      trace.jobs.push_back(r);
    };
    for (const JobRecord& r : result_.records)
      if (r.job.task != kNoTask) add(r);
    for (const Recording::Lost& lost : recording_.lost)
      if (recording_.graph.task_of[lost.subscription] != kNoTask)
        add(result_.rows->lost(lost.subscription, lost.sample, lost.queued));
    for (const JobRecord& r : result_.rows->due(recording_.end)) add(r);
  }

  /// Sets the execution times from the jobs that really worked, in their order.
  void set_times() {
    std::vector<std::vector<Duration>> times(result_.tasks.set.size());
    for (const JobRecord& r : working_jobs(result_.tasks, result_.trace).jobs)
      times[r.job.task].push_back(r.cpu_time >= Duration{} ? r.cpu_time : r.finish - r.start);
    for (TaskId id = 0; id < times.size(); ++id) {
      if (times[id].empty()) continue;
      const TaskOrigin& origin = result_.tasks.origin[id];
      Callback& callback = result_.graph.nodes[origin.node].callbacks[origin.callback];
      const auto [least, most] = std::ranges::minmax(times[id]);
      callback.best = least;
      callback.worst = most;
      callback.measured = std::make_shared<const std::vector<Duration>>(std::move(times[id]));
    }
  }

  /// Whether execution times depend on the previous job of the task, by the first autocorrelation,
  /// weighted by work. Independent draws would lose this.
  bool times_are_correlated() const {
    double correlated = 0, work = 0;
    for (const Callback& callback : result_.tasks.callbacks) {
      if (!callback.measured || callback.measured->size() < 20) continue;
      const std::vector<Duration>& times = *callback.measured;
      double sum = 0, square = 0, next = 0;
      for (const Duration t : times) sum += to_ms(t);
      const double mean = sum / static_cast<double>(times.size());
      for (std::size_t i = 0; i < times.size(); ++i) {
        square += (to_ms(times[i]) - mean) * (to_ms(times[i]) - mean);
        if (i > 0) next += (to_ms(times[i]) - mean) * (to_ms(times[i - 1]) - mean);
      }
      if (square > 0) correlated += sum * next / square;
      work += sum;
    }
    return correlated > kCorrelated * work;
  }

  void choose_executor(const std::filesystem::path& folder) {
    const SchedulerOptions scheduling;
    std::string deployment = recording_.deployment;
    if (deployment.empty() && result_.labels.size() == 1) {
      result_.executor = parse_executor(result_.labels.front(), scheduling);
    } else {
      if (deployment.empty()) {
        deployment = folder / "deployment.yaml";
        result_.deployment_yaml = deployment_yaml();
        write_whole_file(deployment, result_.deployment_yaml);
      }
      result_.executor = deploy(deployment, result_.graph, result_.tasks, scheduling);
    }
    result_.trace.executor = result_.executor->label;
  }

  /// Adds known differences between the system and its simulation.
  void explain() {
    const auto early = early_publications(recording_.graph, recording_.jobs);
    if (early.empty()) return;
    const EarlyPublication& most = early.front();
    const std::string others =
        early.size() == 1 ? "" : concat(" (and ", early.size() - 1, " other tasks also publish early)");
    result_.check.reasons.push_back(
        text("%s publishes %.1f ms before its jobs end%s; the simulation publishes at their ends, so that "
             "its data comes later by this time, and readers on other threads start later.",
             result_.tasks.set[most.task].name.c_str(), to_ms(most.before_end), others.c_str()));
  }

  std::string deployment_yaml() const {
    std::vector<std::set<std::string>> owns(result_.labels.size());
    for (std::uint32_t n = 0; n < result_.graph.nodes.size(); ++n) {
      const Node& node = result_.graph.nodes[n];
      for (TaskId id = 0; id < result_.tasks.set.size(); ++id) {
        if (result_.tasks.origin[id].node != n) continue;
        const Callback& callback = node.callbacks[result_.tasks.origin[id].callback];
        const bool named = callback.group < node.group_names.size();
        owns[executor_of(id)].insert(named ? concat(node.name, "/", node.group_names[callback.group])
                                           : node.name);
      }
    }
    std::string yaml =
        "# The recorded threads. Processors are listed where threads did not run on all of them.\n"
        "# A trace has no policies: fifo stands for threads that preempted others and were not\n"
        "# preempted by them. Correct the policies if you know them.\n"
        "name: recorded\nexecutors:\n";
    for (std::size_t e = 0; e < result_.labels.size(); ++e) {
      const RecordedExecutor& executor = recording_.executors.executors[e];
      if (owns[e].empty()) continue;
      std::set<std::int32_t> processors;
      int level = 0;
      for (const std::uint32_t t : executor.threads) {
        for (const std::int32_t p : usual_processors(recording_.system.threads[t])) processors.insert(p);
        level = std::max(level, displacement_.level[t]);
      }
      yaml += concat("  - {name: ", executor.name, ", executor: \"", result_.labels[e], "\"");
      if (level > 0) yaml += concat(", policy: \"fifo:", 10 * level, "\"");
      const bool bound = !processors.empty() && processors.size() < recording_.cores &&
                         *processors.begin() >= 0 &&
                         static_cast<unsigned>(*processors.rbegin()) < recording_.cores;
      if (bound) yaml += concat(", processors: [", joined(processors), "]");
      if (recording_.system.processes.size() > 1) yaml += concat(", process: \"", executor.process, "\"");
      yaml += concat(", owns: [", joined(owns[e]), "]}\n");
    }
    return yaml;
  }

  const Recording& recording_;
  Displacement displacement_;
  Interpretation result_;
};

}  // namespace

Interpretation interpret(const Recording& recording, const std::vector<std::string>& labels,
                         TimerThread timer_thread, const std::filesystem::path& folder, Duration warm_up) {
  return Interpreter(recording, labels, timer_thread).interpret(folder, warm_up);
}

namespace {

/// The recording of the first `jobs` jobs, for trying hypotheses.
Recording beginning(const Recording& all, std::size_t jobs) {
  Recording few = all;
  few.end = all.jobs[jobs].start;
  few.jobs.resize(jobs);
  for (RecordedJob& job : few.jobs) {
    if (!job.ended || job.finish < few.end) continue;
    job.ended = false;
    std::erase_if(job.published, [&](const RecordedPublication& p) { return p.at >= few.end; });
  }
  std::erase_if(few.lost, [&](const Recording::Lost& l) { return l.sample.published >= few.end; });
  return few;
}

Interpretations best_of(const Recording& recording, const std::filesystem::path& folder, Duration warm_up) {
  std::vector<std::string> labels;
  for (const RecordedExecutor& e : recording.executors.executors) labels.push_back(e.candidates.front());
  if (labels.empty())
    throw UsageError("the trace shows no executor: record it from the start of the nodes on");
  Interpretations all{interpret(recording, labels, TimerThread::by_executor, folder, warm_up), {}};
  const auto similarity = [](const Interpretation& i) { return i.check.schedule.similarity; };
  const auto attempt = [&](const std::vector<std::string>& with, TimerThread timer_thread,
                           const std::string& title) {
    Interpretation attempted = interpret(recording, with, timer_thread, folder, warm_up);
    all.tried.emplace_back(title, similarity(attempted));
    if (similarity(attempted) > similarity(all.best)) all.best = std::move(attempted);
  };
  for (std::size_t e = 0; e < labels.size(); ++e) {
    const std::vector<std::string>& candidates = recording.executors.executors[e].candidates;
    if (candidates.size() > 1) all.tried.emplace_back(candidates.front(), similarity(all.best));
    for (std::size_t c = 1; c < candidates.size(); ++c) {
      std::vector<std::string> other = all.best.labels;
      other[e] = candidates[c];
      attempt(other, TimerThread::by_executor, candidates[c]);
    }
  }
  // Linux usually lets a thread that has slept preempt a busy one at once.
  const bool releases = std::ranges::any_of(all.best.labels, [](const std::string& label) {
    return entry_of(label).traits.timers != TimerHandling::polled;
  });
  if (releases) attempt(std::vector(all.best.labels), TimerThread::raised, "raised timer thread");
  return all;
}

}  // namespace

Interpretations best_interpretation(const Recording& recording, const std::filesystem::path& folder,
                                    Duration warm_up) {
  if (recording.jobs.size() <= kTried) {
    Interpretations all = best_of(recording, folder, warm_up);
    // The last attempt wrote the file, which need not be the best one.
    const std::string& deployment = all.best.deployment_yaml;
    if (!deployment.empty()) write_whole_file(folder / "deployment.yaml", deployment);
    return all;
  }
  const Recording few = beginning(recording, kTried);
  Interpretations all = best_of(few, folder, warm_up);
  all.best = interpret(recording, std::vector(all.best.labels), all.best.graph.platform.timer_thread, folder,
                       warm_up);
  return all;
}

}  // namespace hotpath
