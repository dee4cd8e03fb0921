// SPDX-License-Identifier: Apache-2.0
#include "import/interpretation.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "hotpath/core/platform.hpp"
#include "hotpath/reference_system/find_chains.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "import/recognition.hpp"
#include "import/recorded_executors.hpp"
#include "import/recorded_graph.hpp"
#include "import/recorded_window.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::imports {

namespace {

/// Execution times with a first autocorrelation above this are not independent.
constexpr double kCorrelated = 0.1;

/// Jobs with which executors are tried: the time of comparing orders grows with their square.
constexpr std::size_t kTried = 20'000;

const ExecutorEntry& entry_of(const std::string& label) { return *setup::parse_executor(label, {}).entry; }

class Interpreter {
 public:
  Interpreter(const Recording& recording, const std::vector<std::string>& labels, ThreadPriorities priorities)
      : recording_(recording) {
    result_.labels = labels;
    result_.priorities = priorities;
    result_.graph = recording.graph.graph;
    const bool raised = priorities == ThreadPriorities::raised;
    result_.graph.platform.timer_thread = raised ? TimerThread::raised : TimerThread::by_executor;
  }

  Interpretation interpret() {
    make_records();
    measure_costs();
    result_.tasks = make_tasks(result_.graph);
    make_trace();
    set_times();
    result_.tasks = make_tasks(result_.graph);
    if (times_are_correlated()) result_.graph.platform.execution_times = ExecutionTimeModel::replayed;
    choose_executor();
    std::vector<ChainObservation> observations =
        recorded_chains(recording_.system, recording_.graph, window());
    for (ChainObservation& o : observations) {
      o.sink_start -= recording_.graph.epoch - Time{};
      o.latest_source_start -= recording_.graph.epoch - Time{};
    }
    result_.trace.chains = join_chains(result_.graph, result_.tasks, result_.trace, observations);
    result_.check = self_check(result_.graph, result_.tasks, *result_.executor, result_.trace);
    return std::move(result_);
  }

 private:
  RecordedWindow window() const { return {recording_.jobs, result_.records}; }

  /// The executor of a task; for a task that never ran that of its callback group, or else of its
  /// node, or else the first executor.
  std::uint32_t executor_of(TaskId id) const {
    const GraphTasks& tasks = recording_.graph.tasks;
    const auto recorded = [&](TaskId task) {
      const std::uint32_t c = recording_.graph.callback_of[task];
      return c == kNone ? kNone : recording_.executors.of_callback[c];
    };
    if (recorded(id) != kNone) return recorded(id);
    std::uint32_t of_node = kNone;
    for (TaskId other = 0; other < tasks.set.size(); ++other) {
      if (recorded(other) == kNone || tasks.origin[other].node != tasks.origin[id].node) continue;
      if (tasks.set[other].group == tasks.set[id].group) return recorded(other);
      if (of_node == kNone) of_node = recorded(other);
    }
    return of_node == kNone ? 0 : of_node;
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
    result_.records = result_.rows->jobs(recording_.jobs);
    displacement_ = recorded_displacement(recording_.system, window());
    const bool timers_apart = std::ranges::any_of(result_.labels, [](const std::string& label) {
      return entry_of(label).traits.timers == TimerHandling::release_and_execute;
    });
    if (recording_.executors.executors.size() > 1 || (timers_apart && recording_.cores == 1)) {
      for (std::size_t i = 0; i < result_.records.size(); ++i)
        if (result_.records[i].outcome == Outcome::ran) result_.records[i].cpu_time = displacement_.own[i];
      result_.slices = displacement_.slices;
    }
  }

  void measure_costs() {
    const std::vector<RecordedExecutor>& executors = recording_.executors.executors;
    const auto measure = [&](const MeasuredCost& elsewhere) {
      result_.costs.clear();
      for (std::size_t e = 0; e < executors.size(); ++e)
        result_.costs.push_back(
            recorded_costs(recording_.graph, window(), executors[e], entry_of(result_.labels[e]), elsewhere));
    };
    const auto mean_cost = [&](const auto& cost_of) {
      double sum = 0, jobs = 0;
      for (std::size_t e = 0; e < executors.size(); ++e) {
        const MeasuredCost cost = cost_of(result_.costs[e]);
        for (const std::uint32_t t : executors[e].threads) {
          const double weight = cost.n == 0 ? 0 : static_cast<double>(recording_.system.threads[t].jobs);
          sum += weight * static_cast<double>(cost.median.count());
          jobs += weight;
        }
      }
      return Duration(static_cast<std::int64_t>(jobs > 0 ? sum / jobs : 0));
    };
    measure({});
    if (std::ranges::any_of(result_.costs, [](const RecordedCosts& c) { return c.dispatch.n == 0; }))
      measure({0, mean_cost([](const RecordedCosts& c) { return c.dispatch; }), {}});
    GraphPlatform& platform = result_.graph.platform;
    platform.cores = recording_.cores;
    platform.execution_times = ExecutionTimeModel::measured;
    platform.timer_dispatch_cost =
        mean_cost([](const RecordedCosts& c) { return c.dispatch_of(TaskKind::timer); });
    platform.subscription_dispatch_cost =
        mean_cost([](const RecordedCosts& c) { return c.dispatch_of(TaskKind::subscription); });
    platform.wait_cost = mean_cost([](const RecordedCosts& c) { return c.wait; });
    platform.wake_up = mean_cost([](const RecordedCosts& c) { return c.wake_up; });
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
    for (const tracing::LostSample& lost : recording_.lost)
      if (recording_.graph.task_of[lost.subscription] != kNoTask) add(result_.rows->lost(lost));
    for (const JobRecord& r : result_.rows->due(recording_.end)) add(r);
  }

  /// Sets the execution times from the jobs that really worked, in their order.
  void set_times() {
    std::vector<std::vector<Duration>> times(result_.tasks.set.size());
    for (const JobRecord& r : working_jobs(result_.tasks, result_.trace).jobs)
      times[r.job.task].push_back(r.cpu_time >= Duration{} ? r.cpu_time : r.finish - r.start);
    for (TaskId id = 0; id < times.size(); ++id) {
      if (times[id].empty()) continue;
      Callback& callback = callback_of_task(result_.graph, result_.tasks.origin[id]);
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

  void choose_executor() {
    if (recording_.deployment) {
      result_.executor = setup::deploy(*recording_.deployment, {});
    } else if (result_.labels.size() == 1 && result_.priorities != ThreadPriorities::equal_fifo) {
      result_.executor = setup::parse_executor(result_.labels.front(), {});
    } else {
      result_.executor = setup::deploy(recorded_deployment(), {});
    }
    result_.trace.executor = result_.executor->label;
  }

  /// The recorded threads. A trace has no policies: fifo stands for threads that preempted others.
  Deployment recorded_deployment() const {
    Deployment deployment;
    deployment.name = "recorded";
    deployment.file = recording_.deployment_file;
    deployment.processes.clear();
    std::vector<std::uint32_t> owners, place(result_.labels.size());
    for (TaskId id = 0; id < result_.tasks.set.size(); ++id) owners.push_back(executor_of(id));
    for (std::uint32_t e = 0; e < place.size(); ++e) {
      if (std::ranges::count(owners, e) == 0) continue;
      place[e] = static_cast<std::uint32_t>(deployment.executors.size());
      add_executor(e, deployment);
    }
    for (const std::uint32_t e : owners) deployment.executor_of.push_back(place[e]);
    return deployment;
  }

  void add_executor(std::uint32_t e, Deployment& deployment) const {
    const RecordedExecutor& recorded = recording_.executors.executors[e];
    DeployedExecutor& executor = deployment.executors.emplace_back();
    executor.name = recorded.name;
    executor.executor = result_.labels[e];
    std::set<std::int32_t> processors;
    int level = 0;
    for (const std::uint32_t t : recorded.threads) {
      processors.insert(displacement_.processors[t].begin(), displacement_.processors[t].end());
      level = std::max(level, displacement_.level[t]);
    }
    if (result_.priorities == ThreadPriorities::equal_fifo) level = std::max(level, 1);
    if (level > 0) executor.policy = {ThreadPolicy::Class::fifo, 10 * level};
    const auto most = std::min<std::int64_t>(recording_.cores, kMaxProcessor + 1);
    const bool bound = !processors.empty() && processors.size() < recording_.cores &&
                       *processors.begin() >= 0 && *processors.rbegin() < most;
    if (bound) executor.processors.assign(processors.begin(), processors.end());
    const bool several = recording_.system.processes.size() > 1;
    const std::string process = several ? std::to_string(recorded.process) : std::string();
    std::vector<std::string>& all = deployment.processes;
    if (std::ranges::find(all, process) == all.end()) all.push_back(process);
    executor.process = static_cast<std::uint32_t>(std::ranges::find(all, process) - all.begin());
  }

  const Recording& recording_;
  Displacement displacement_;
  Interpretation result_;
};

/// The recording of the first `jobs` jobs, for trying hypotheses.
Recording beginning(const Recording& all, std::size_t jobs) {
  Recording few = all;
  few.end = all.jobs[jobs].start;
  few.jobs.resize(jobs);
  for (tracing::Job& job : few.jobs) {
    if (!job.ended || job.finish < few.end) continue;
    job.ended = false;
    std::erase_if(job.published, [&](const tracing::Publication& p) { return p.at >= few.end; });
  }
  std::erase_if(few.lost, [&](const tracing::LostSample& l) { return l.sample.published >= few.end; });
  return few;
}

Interpretations best_of(const Recording& recording, const std::vector<std::string>& labels) {
  Interpretations all{Interpreter(recording, labels, ThreadPriorities::by_executor).interpret(), {}};
  // Linux usually lets a thread that has slept preempt a busy one at once.
  const bool may_be_raised = std::ranges::any_of(labels, [](const std::string& label) {
    const ExecutorTraits& traits = entry_of(label).traits;
    return traits.timers != TimerHandling::polled && !traits.raises_timer_thread;
  });
  if (!may_be_raised) return all;
  const auto similarity = [](const Interpretation& i) { return i.check.schedule.similarity; };
  all.tried.emplace_back("timer thread as the executor has it", similarity(all.best));
  using Way = std::pair<ThreadPriorities, const char*>;
  for (const auto& [priorities, name] :
       {Way(ThreadPriorities::raised, "raised timer thread"),
        Way(ThreadPriorities::equal_fifo, "timer thread with the executor's priority of SCHED_FIFO")}) {
    if (recording.deployment && priorities == ThreadPriorities::equal_fifo) continue;
    Interpretation way = Interpreter(recording, labels, priorities).interpret();
    all.tried.emplace_back(name, similarity(way));
    if (similarity(way) > similarity(all.best)) all.best = std::move(way);
  }
  return all;
}

Interpretations best_interpretation(const Recording& recording, const std::vector<std::string>& labels) {
  if (recording.jobs.size() <= kTried) return best_of(recording, labels);
  const Recording few = beginning(recording, kTried);
  Interpretations all = best_of(few, labels);
  all.best = Interpreter(recording, labels, all.best.priorities).interpret();
  return all;
}

void set_phases(Recording& recording) {
  RecordedGraph& graph = recording.graph;
  for (TaskId id = 0; id < graph.callback_of.size(); ++id) {
    Callback& callback = graph.callback(id);
    if (callback.input) continue;
    const bool recorded = graph.callback_of[id] != kNone;
    Duration phase = (recorded ? recording.timers.first[id] : Time{} + *callback.phase) - graph.epoch;
    if (phase < Duration::zero()) phase -= ((phase + Duration(1)) / callback.period - 1) * callback.period;
    callback.phase = phase;
    if (!recorded) recording.timers.first[id] = graph.epoch + phase;
  }
  graph.tasks = make_tasks(graph.graph);
}

/// What recognition found out about the graph.
struct Findings {
  std::vector<std::string> labels;  // by executor
  OrderEvidence order;
  std::map<std::uint32_t, std::int64_t> priorities;  // by callback
};

/// Makes the graph with nodes and callbacks in that order.
void arrange(Recording& r, const ServiceOrder& order, const Findings& findings, const CtfOptions& options) {
  const std::string name = std::filesystem::path(options.trace).lexically_normal().filename();
  r.graph = make_recorded_graph(r.system, r.jobs, r.executors.of_callback, name, order);
  r.graph.graph.delivery = delivery_of_graph(r.deliveries, r.graph);
  for (const auto& [callback, priority] : findings.priorities)
    r.graph.callback(r.graph.task_of[callback]).priority = priority;
  for (const auto& [from, share] : early_publications(r.graph, r.jobs))
    for (Publication& p : r.graph.callback(from.first).publishes)
      if (std::ranges::count(r.graph.topic_names[from.second], p.topic) > 0) p.at = share;
  r.timers = recorded_timers(r.system, r.graph, r.jobs, r.end);
  set_phases(r);
  Graph& graph = r.graph.graph;
  for (const std::string& text : options.chains) graph.chains.push_back(chain_of(text, graph, r.graph.tasks));
  if (options.chains.empty()) graph.chains = recorded_chains_of(graph, r.graph.tasks);
  if (!options.deployment.empty()) r.deployment = find_deployment(options.deployment, graph, r.graph.tasks);
}

/// The name that an executor gives itself, if hotpath knows it, and its hypothesis, with its levels.
std::pair<std::string, std::vector<Hypothesis>> stated_executor(const Recording& recording,
                                                                const RecordedExecutor& executor,
                                                                const RecordedSteps& steps) {
  const RecordedGraph& graph = recording.graph;
  for (const tracing::StatedExecutor& stated : recording.system.stated_executors) {
    if (!executor.is(stated)) continue;
    try {
      const setup::ExecutorSpec spec = setup::parse_executor(stated.name, {});
      // It emits no waits; an executor of rclcpp may have waited on its thread before.
      std::vector<Hypothesis> possible = possible_hypotheses(steps, false, recording.system.rcl_version);
      std::erase_if(possible, [&](const Hypothesis& h) {
        return h.entry != spec.entry || h.options.rule != spec.scheduler.rule ||
               h.options.ties != spec.scheduler.ties;
      });
      for (Hypothesis& hypothesis : possible) {
        if (!hypothesis.needs_levels()) continue;
        hypothesis.levels.assign(graph.tasks.set.size(), kLast);
        for (const auto& [callback, level] : stated.levels)
          if (graph.task_of[callback] != kNoTask) hypothesis.levels[graph.task_of[callback]] = level;
      }
      return {stated.name, std::move(possible)};
    } catch (const program::UsageError&) {  // of a later version
    }
  }
  return {};
}

/// Compares the possible executors of each group of threads with its decisions. An executor that
/// describes itself is believed.
void recognise_executors(Recording& recording) {
  RecordedTrace rows(recording.system, recording.graph, recording.timers, recording.timers.released);
  const std::vector<JobRecord> records = rows.jobs(recording.jobs);
  const RecordedWindow window{recording.jobs, records};
  for (const RecordedExecutor& executor : recording.executors.executors) {
    const RecordedSteps steps = recorded_steps(recording.graph, window, recording.lost, executor, kTried);
    const bool waits = std::ranges::any_of(
        executor.threads, [&](std::uint32_t t) { return recording.system.threads[t].waits > 0; });
    auto [name, possible] = stated_executor(recording, executor, steps);
    const bool believed = possible.size() == 1;
    if (possible.empty()) possible = possible_hypotheses(steps, waits, recording.system.rcl_version);
    Recognition& found =
        recording.recognitions.emplace_back(recognise(recording.system, recording.graph, steps, possible));
    if (!believed) continue;
    found.stated = name;
    found.verdict = Verdict::recognised;
  }
}

/// What the recognised executors, or the given one, say about the graph.
Findings findings_of(const Recording& recording) {
  Findings findings;
  for (const Recognition& recognition : recording.recognitions) {
    const std::vector<Score>& ranking = recognition.ranking;
    const auto score =
        recording.given.empty()
            ? ranking.begin()
            : std::ranges::find(ranking, recording.given, [](const Score& s) { return s.hypothesis.label; });
    if (score == ranking.end()) {
      findings.labels.push_back(recording.given.empty() ? std::string(kBaselineExecutor) : recording.given);
      continue;
    }
    findings.labels.push_back(score->hypothesis.label);
    findings.order.insert(score->evidence.begin(), score->evidence.end());
    if (score->hypothesis.entry->traits.policy != Policy::fp) continue;
    for (TaskId id = 0; id < recording.graph.tasks.set.size(); ++id)
      if (recording.graph.callback_of[id] != kNone && recording.graph.tasks.set[id].kind == TaskKind::timer &&
          score->hypothesis.levels[id] != kLast)
        findings.priorities[recording.graph.callback_of[id]] = score->hypothesis.levels[id];
  }
  return findings;
}

}  // namespace

Interpretations interpret(Recording& recording, const CtfOptions& options) {
  std::ranges::sort(recording.jobs, {}, &tracing::Job::started);
  const tracing::Job& last = recording.jobs.back();
  recording.end = (last.ended ? last.finish : last.start) + Duration(1);
  recording.executors = recorded_executors(recording.system);
  const std::vector<std::string> requests = attribute_requests(recording.system, recording.jobs);
  recording.given = options.executor;
  recording.cores = options.cores > 0 ? options.cores : cores_of(recording.system);
  recording.deliveries = created_deliveries(recording.system);
  arrange(recording, {}, {}, options);
  if (recording.executors.executors.empty())
    throw program::UsageError("the trace shows no executor: record it from the start of the nodes on");
  recording.first_graph = recording.graph;
  recognise_executors(recording);
  const Findings findings = findings_of(recording);
  const Family family = entry_of(findings.labels.front()).traits.family;
  const bool more_deliveries =
      add_started_deliveries(recording.jobs, family, recording.executors.of_callback, recording.deliveries);
  if (more_deliveries || !findings.order.empty() || !findings.priorities.empty()) {
    const ServiceOrder order = findings.order.empty()
                                   ? ServiceOrder{}
                                   : service_order(recording.system, recording.graph, findings.order);
    arrange(recording, order, findings, options);
    if (!findings.order.empty())
      recording.graph.notes.push_back(
          "Nodes and callbacks are in the order in which the executor served them, which is not that of "
          "their creation.");
    const bool stated =
        std::ranges::any_of(recording.recognitions, [](const Recognition& r) { return !r.stated.empty(); });
    if (!findings.priorities.empty() && !stated)
      recording.graph.notes.push_back(
          "The priorities of timers in the graph are fitted to the order of jobs; only their order counts.");
  }
  for (const auto& notes : {requests, unseen_callbacks(recording.system, recording.executors.executors),
                            delivery_notes(recording.system, recording.deliveries)})
    recording.graph.notes.insert(recording.graph.notes.end(), notes.begin(), notes.end());
  std::vector<std::string> missing = unmodelled(recording.system, recording.graph);
  Interpretations all = best_interpretation(recording, findings.labels);
  Recognition& first = recording.recognitions.front();
  if (recording.recognitions.size() == 1)
    first.remedy = distinguishing_load(all.best.graph, all.best.tasks, first.open_names(),
                                       recording.executors.executors.front().threads.size());
  for (const Recognition& recognition : recording.recognitions) {
    if (!recording.given.empty() || recognition.verdict != Verdict::none_fits) continue;
    all.best.check.doubt(sentence(recognition, recording.first_graph));
  }
  if (all.best.slices.unexplained > 0) all.best.check.doubt(unexplained_sentence(all.best.slices));
  if (all.best.slices.threads > 0) missing.push_back(sentence(all.best.slices, recording.graph.epoch));
  // They explain a deviation; of a green reproduction they are remarks.
  std::vector<std::string>& told =
      all.best.check.light == Light::green ? recording.graph.notes : all.best.check.reasons;
  told.insert(told.end(), std::make_move_iterator(missing.begin()), std::make_move_iterator(missing.end()));
  return all;
}

}  // namespace hotpath::imports
