// SPDX-License-Identifier: Apache-2.0
#include "bounds/bounds.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "hotpath/reference_system/graph_workload.hpp"
#include "program/interrupt.hpp"
#include "program/memory_limit.hpp"
#include "program/text.hpp"

namespace hotpath::bounds {

namespace {

/// Keeps the worst of what an exploration meets.
class WorstCases final : public ExplorationObserver {
 public:
  WorstCases(const GraphTasks& tasks, std::vector<BoundedChain> chains, GraphBounds& bounds)
      : tasks_(tasks), chains_(std::move(chains)), bounds_(bounds) {
    bounds_.tasks.resize(tasks.set.size());
    bounds_.chains.resize(chains_.size());
    bounds_.no_chain_bound.assign(chains_.size(), "no data of its sources ever reach its sink");
    tracked_.resize(tasks.set.size());
    for (const BoundedChain& chain : chains_) {
      for (const TaskId source : chain.sources) tracked_[source] = true;
      for (const TaskId sink : chain.sink_tasks) tracked_[sink] = true;
    }
  }

  [[nodiscard]] const std::vector<bool>& tracked() const { return tracked_; }
  [[nodiscard]] std::vector<ChainObservation>* observations() { return &observations_; }

  void ended(const JobRecord& record, ExploredInstant& instant) override {
    if (record.outcome != Outcome::ran) return;
    const TaskId task = record.job.task;
    if (keeps_timestamps && is_of_timer(record.job) && record.job.skipped > 0) {
      throw ExplorationRefused("timer " + tasks_.set[task].name +
                               " may skip timestamps, which ones depends on the exact phases");
    }
    if (of_subscriptions == is_of_timer(record.job)) return;
    const Span until_now =
        of_subscriptions ? Span{{record.job.parent, JobInstant::Kind::publication}} : Span{};
    const Time begin = of_subscriptions ? Time{} : record.job.timestamp;
    if (raise(bounds_.tasks[task], (Time{} + instant.longest(until_now) - begin).count()))
      instant.keep_longest(task, until_now);
  }

  void published(ExploredInstant& instant) override {
    for (const ChainObservation& observation : observations_) add(observation, instant);
    observations_.clear();
  }

  bool of_subscriptions = false;  ///< Keeps only the response times of subscriptions.
  bool keeps_timestamps = false;  ///< Refuses a schedule that skips timestamps of timers.

  /// Slots of witnesses: response times by task, then of each chain its age and its hot path.
  [[nodiscard]] std::size_t witnesses() const { return tasks_.set.size() + 2 * chains_.size(); }

  [[nodiscard]] std::vector<ReachedWorstCase> reached(std::vector<std::optional<Witness>> witnesses) const {
    std::vector<ReachedWorstCase> all;
    for (std::uint32_t slot = 0; slot < witnesses.size(); ++slot) {
      if (!witnesses[slot]) continue;
      Witness& witness = *witnesses[slot];
      if (slot < tasks_.set.size()) {
        all.push_back({Latency::response, slot, *bounds_.tasks[slot], std::move(witness)});
        continue;
      }
      const std::size_t row = (slot - tasks_.set.size()) / 2;
      const ChainAge& age = *bounds_.chains[row];
      const bool hot_path = slot_of_hot_path(row) == slot;
      all.push_back({hot_path ? Latency::hot_path : Latency::age, chains_[row].number,
                     hot_path ? *age.hot_path : age.latency, std::move(witness)});
    }
    return all;
  }

 private:
  using Span = ExploredInstant::Span;

  static bool raise(std::optional<std::int64_t>& worst, std::int64_t value) {
    if (worst && value <= *worst) return false;
    worst = value;
    return true;
  }
  [[nodiscard]] std::size_t slot_of_age(std::size_t row) const { return tasks_.set.size() + 2 * row; }
  [[nodiscard]] std::size_t slot_of_hot_path(std::size_t row) const { return slot_of_age(row) + 1; }

  void add(const ChainObservation& observation, ExploredInstant& instant) {
    const auto chain = std::ranges::find(chains_, observation.chain, &BoundedChain::number);
    if (chain == chains_.end()) return;
    const std::vector<TaskId>& sources = chain->sources;
    const auto row = static_cast<std::size_t>(chain - chains_.begin());
    Time oldest = kNever;
    std::vector<Span> from_sources;
    // The latest source is another one in other schedules. Some schedule attains this in all its spans: they
    // end alike, so that bounds below two of them never contradict each other.
    Duration hot_path = Duration::max();
    for (std::size_t i = 0; i < sources.size(); ++i) {
      if ((observation.sources_seen >> i & 1U) == 0) continue;
      const Task& timer = tasks_.set[sources[i]];
      const auto sequence = static_cast<std::int64_t>(observation.source_sequence[i]);
      oldest = std::min(oldest, Time{} + timer.phase + timer.period * sequence);
      from_sources.push_back({{{sources[i], observation.source_sequence[i]}}, {observation.sink}});
      hot_path = std::min(hot_path, instant.longest(from_sources.back()));
    }
    if (oldest == kNever) return;
    std::optional<ChainAge>& worst = bounds_.chains[row];
    const std::int64_t age = (instant.latest() - oldest).count();
    if (!worst || age > worst->latency) {
      if (!worst) worst.emplace();
      worst->latency = worst->response = age;
      instant.keep_longest(slot_of_age(row), {});
    }
    if (raise(worst->hot_path, hot_path.count())) instant.keep(slot_of_hot_path(row), from_sources, hot_path);
  }

  const GraphTasks& tasks_;
  const std::vector<BoundedChain> chains_;  // by row of bounds_
  GraphBounds& bounds_;
  std::vector<bool> tracked_;
  std::vector<ChainObservation> observations_;
};

/// Why an exploration has to end.
std::string why_to_stop() {
  static const std::uint64_t most = program::memory_limit() / 2;
  if (program::interrupted() != 0) return "it was interrupted";
  if (program::memory_in_use() <= most) return "";
  return program::text("its states take more than half of the memory (%.1f GB)",
                       static_cast<double>(most) / 1e9);
}

/// Each phase becomes the earliest possible one, and the difference to the latest one a release jitter: the
/// schedules include those in which all jobs of a timer are late by the same time. All phases are
/// later by `uncertainty`, so that none precedes the beginning.
void near_phases(TaskSet& set, Duration uncertainty) {
  if (uncertainty == Duration{}) return;
  for (const TaskId id : set.timers()) {
    Task& task = set.tasks[id];
    task.release_jitter += 2 * uncertainty;
    if (task.release_jitter < task.period) continue;
    throw ExplorationRefused("timer " + task.name +
                             " may be off by its period: release jitter and twice the phase uncertainty");
  }
}

/// Throws ExplorationRefused for what is not covered.
void check(const Graph& graph, const GraphTasks& tasks, const BoundedSystem& system, bool uncertain_phases) {
  using A = Assumption;
  if (const auto unknown = unknown_deliveries(graph); !unknown.empty()) {
    throw ExplorationRefused("it needs the order in which samples of topic " + unknown.front() +
                             " reach its subscribers (`delivery` under `topics` in the graph)");
  }
  const auto early = std::ranges::find_if(tasks.callbacks, &Callback::publishes_early);
  if (early != tasks.callbacks.end()) {
    throw ExplorationRefused("it does not cover callback " + early->task +
                             ", which publishes before the end of its jobs");
  }
  const ExecutorTraits& traits = system.executor.traits;
  const bool woken = traits.timers == TimerHandling::marked_ready;
  if (uncertain_phases && woken) {
    throw ExplorationRefused(
        "it does not cover uncertain phases under a timer thread that the end of each timer's job wakes up");
  }
  if (uncertain_phases && by_deadline(traits_of(traits.queue_order()).levels))
    throw ExplorationRefused(
        "it does not cover uncertain phases under an order by deadlines, which follow the phases");
  const std::uint32_t present = assumptions_of(system);
  const bool woken_late = woken && (present & bits({A::release_jitter})) != 0;
  std::uint32_t covers = kAnyOrder | bits({A::subscriptions, A::several_threads, A::shifted_phases, A::costs,
                                           A::release_costs, A::wake_up, A::late_releases, A::delivery_delay,
                                           A::woken_by_jobs, A::release_jitter});
  if (woken_late) covers &= ~bits({A::late_releases, A::woken_by_jobs});
  if ((present & ~covers) != 0)
    throw ExplorationRefused((woken_late ? "with release jitter, " : "") + not_covered(present & ~covers));
}

/// Explores every schedule; with `observer.of_subscriptions` for response times of subscriptions alone, which
/// need the publications of unread samples in each state.
void explore_graph(Graph graph, const GraphTasks& tasks, const Scheduler& scheduler,
                   ExplorationOptions options, WorstCases& observer, std::vector<ReachedWorstCase>* reached) {
  const WorstCaseTimes times(tasks.set);
  if (observer.of_subscriptions) graph.chains.clear();
  GraphWorkload workload(graph, tasks, times, observer.observations());
  options.stop = why_to_stop;
  options.publications = observer.of_subscriptions;
  if (observer.of_subscriptions) workload.describe_publications();
  if (!observer.of_subscriptions) options.tracked = observer.tracked();
  if (reached != nullptr) options.witnesses = observer.witnesses();
  ExplorationResult result = explore(tasks.set, scheduler, workload, options, observer);
  if (reached != nullptr)
    std::ranges::move(observer.reached(std::move(result.witnesses)), std::back_inserter(*reached));
  if (result.ended_early) throw ExplorationRefused(*result.ended_early);
}

/// The ages in the schedules that an exploration met before it ended early.
std::string at_least(const Graph& graph, const std::vector<BoundedChain>& chains, const GraphBounds& met) {
  std::string text;
  for (std::size_t row = 0; row < met.chains.size(); ++row) {
    if (!met.chains[row]) continue;
    text += text.empty() ? "; lower bounds on the ages, from the schedules that it met: " : ", ";
    text += program::text("%.3f ms", to_ms(Duration(met.chains[row]->latency))) + " in " +
            graph.chains[chains[row].number].name;
  }
  return text;
}

/// Response times of subscriptions, by an exploration of their own.
void add_subscriptions(const Graph& graph, const GraphTasks& tasks, const Scheduler& scheduler,
                       const ExplorationOptions& options, GraphBounds& bounds,
                       std::vector<ReachedWorstCase>* reached) {
  if (tasks.set.timers().size() == tasks.set.size()) return;
  GraphBounds responses;
  try {
    WorstCases worst(tasks, {}, responses);
    worst.of_subscriptions = true;
    explore_graph(graph, tasks, scheduler, options, worst, reached);
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      if (responses.tasks[id]) bounds.tasks[id] = responses.tasks[id];
    }
  } catch (const ExplorationRefused& error) {
    bounds.left_out = std::string("response times of subscriptions: ") + error.what();
  }
}

}  // namespace

GraphBounds exact_worst_cases(const Graph& graph, const GraphTasks& given, const ExecutorEntry& executor,
                              const SchedulerOptions& scheduling, const ExactOptions& exact,
                              std::vector<ReachedWorstCase>* reached) {
  const bool uncertain = exact.phase_uncertainty > Duration{};
  GraphBounds bounds{.method = uncertain ? kNearPhasesMethod : kExactMethod};
  ExplorationOptions options;
  options.max_states = exact.max_states;
  options.platform = make_platform(graph, executor);
  GraphTasks tasks = given;
  const std::vector<BoundedChain> chains = bounded_chains(graph, tasks);
  try {
    near_phases(tasks.set, exact.phase_uncertainty);
    CallbackGraph activations;  // for assumptions_of(): without joins and reads
    activations.set = tasks.set;
    activations.phases_known = true;
    activations.delivery_known = unknown_deliveries(graph).empty();
    check(graph, tasks, {activations, executor, scheduling, options.platform}, uncertain);
    const HeldReleases by_exploration;
    for (Task& task : tasks.set.tasks) {
      if (task.release_jitter > Duration{}) task.release_delays = &by_exploration;
    }
    const std::unique_ptr<const Scheduler> scheduler = executor.make(tasks.set, scheduling);
    WorstCases worst(tasks, chains, bounds);
    worst.keeps_timestamps = uncertain;
    explore_graph(graph, tasks, *scheduler, options, worst, reached);
    add_subscriptions(graph, tasks, *scheduler, options, bounds, reached);
  } catch (const ExplorationRefused& error) {
    const bool too_many = error.why == ExplorationRefused::Why::states;
    return {.method = bounds.method,
            .refusal = program::concat(error.what(), too_many ? exact.more_states : "",
                                       at_least(graph, chains, bounds))};
  }
  return bounds;
}

}  // namespace hotpath::bounds
