// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/exploration.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "explored_paths.hpp"
#include "explored_state.hpp"
#include "met_states.hpp"

namespace hotpath {

namespace {

/// A state has a successor for each subset of the uncertain instants that may be one.
constexpr std::ptrdiff_t kMostAtOnce = 12;
constexpr const char* kTooManyAtOnce = "more than 12 releases, arrivals or ends may come at one instant";

class Exploration final : public JobSink, public ExploredInstant {
 public:
  Exploration(const TaskSet& set, const ExplorationOptions& options, ExplorationObserver& observer)
      : set_(set),
        options_(options),
        observer_(observer),
        met_(set, options.publications),
        executor_of_(set.size(), 0),
        kept_(options.witnesses) {}

  ExplorationResult run(const ExploredScheduler& scheduler, const Workload& workload) {
    // Timers with jitter that are ready when the executor begins.
    std::vector<TaskId> at_once;
    for (TaskId id = 0; id < set_.size(); ++id)
      if (set_[id].release_jitter > Duration{} && set_[id].phase == Duration{}) at_once.push_back(id);
    if (std::ssize(at_once) > kMostAtOnce) throw ExplorationRefused(kTooManyAtOnce);
    for (std::size_t subset = 0; subset < std::size_t{1} << at_once.size(); ++subset) {
      std::vector<TaskId> released;
      for (std::size_t i = 0; i < at_once.size(); ++i)
        if ((subset >> i & 1U) != 0) released.push_back(at_once[i]);
      deliveries_.for_each_choice([&] {
        ExploredState first{simulation_of(scheduler.clone(), workload.clone())};
        before(first, true);
        for (const TaskId timer : released) first.happened.released.emplace_back(timer, Time{});
        first.simulation->begin(released);
        after(first);
        first.begin_to_release(true);
        enter(std::move(first));
      });
    }
    ExplorationResult result;
    try {
      while (std::optional<MetStates::Next> next = met_.next()) {
        if (++expanded_ > options_.max_states) throw too_many(options_.max_states, "states");
        keep_ends(*next->state, std::move(next->place));
        expand(std::move(*next->state));
      }
    } catch (const ExplorationRefused& early) {
      if (early.why == ExplorationRefused::Why::not_covered) throw;
      result.ended_early = early;
    }
    result.states = expanded_;
    for (const auto& edge : kept_)
      result.witnesses.push_back(edge ? std::optional(paths_.witness(*edge)) : std::nullopt);
    return result;
  }

 private:
  /// They take the time of an exploration; a state with samples on their way has many.
  void count_successor() {
    constexpr std::size_t kSuccessorsOfAState = 8, kBetweenStops = 64;
    const std::size_t most = kSuccessorsOfAState * options_.max_states;
    if (++successors_ > most) throw too_many(most, "successors of states");
    if (!options_.stop || successors_ % kBetweenStops != 0) return;
    const std::string why = options_.stop();
    if (!why.empty()) throw ExplorationRefused(why, ExplorationRefused::Why::stopped);
  }

  static ExplorationRefused too_many(std::size_t most, const std::string& what) {
    return ExplorationRefused("there are more than " + std::to_string(most) + " " + what,
                              ExplorationRefused::Why::states);
  }

  std::unique_ptr<ExploredSimulation> simulation_of(std::unique_ptr<ExploredScheduler> scheduler,
                                                    std::unique_ptr<Workload> workload) {
    SimulationOptions options;
    options.platform = options_.platform;
    options.duration = kLongestInstant;
    options.max_backlog = 1000;
    if (options.platform.delivery_delay > Duration{}) options.deliveries = &deliveries_;
    check_simulation(set_, options);
    SimulatedExecutor executor{scheduler.get(), {}, options.platform.other_entities, {}};
    for (const WorkerRole role : scheduler->workers()) {
      const bool raised = role == WorkerRole::timer_management && options.platform.raised_releaser;
      executor.threads.emplace_back().priority = raised ? 1 : 0;
    }
    return std::make_unique<ExploredSimulation>(set_, executor, executor_of_, std::move(scheduler),
                                                std::move(workload), options, this);
  }

  // What happens at one instant of `state`, at which kNow is set: between before() and after().

  void before(ExploredState& state, bool step_ends) {
    current_ = &state;
    step_ends_ = step_ends || state.simulation->several() || !state.busy();
    unsettled_ = false;
    started_.clear();
    before_ = state.executor();
    if (state.simulation->workers().size() > 1) timers_before_ = state.timers();
  }

  void started(const JobRecord& record) override {
    settle();
    const JobRef job = record.job.ref();
    started_.emplace_back(record.worker, job);
    if (!options_.tracked.empty() && options_.tracked[job.task]) current_->track({job});
  }

  void ended(const JobRecord& record) override {
    settle();
    observer_.ended(record, *this);
    unsettled_ = record.outcome == Outcome::ran;
    if (options_.publications && unsettled_ && !set_[record.job.task].feeds.empty()) {
      current_->track({record.job.ref(), JobInstant::Kind::publication});
    }
  }

  void settle() {
    if (std::exchange(unsettled_, false)) observer_.published(*this);
  }

  [[nodiscard]] Duration longest(const Span& span) const override {
    return Duration(current_->zone.most(coordinate_of(span.to, kNow), coordinate_of(span.from, kConstant)));
  }

  [[nodiscard]] std::size_t coordinate_of(const JobInstant& instant, std::size_t otherwise) const {
    if (instant.job.task == kNoTask) return otherwise;
    const std::size_t coordinate = current_->coordinate_of(instant);
    assert(coordinate != kConstant && "a job, or a sample whose publication, is not tracked");
    return coordinate;
  }

  void keep(std::size_t slot, std::span<const Span> spans, Duration at_least) override {
    if (slot >= kept_.size()) return;
    Zone zone = current_->zone;
    for (const Span& span : spans) {
      [[maybe_unused]] const bool any =
          zone.limit(coordinate_of(span.from, kConstant), coordinate_of(span.to, kNow), -at_least.count());
      assert(any && "a bound that no schedule reaches");
    }
    kept_[slot] = ExploredPaths::Edge{std::move(zone), from_, {}, current_->happened};
  }

  /// The ends of the step and of the slice are replaced on the way to the next states, which witnesses need.
  void keep_ends(ExploredState& state, ExploredPaths::End place) {
    if (kept_.empty()) return;
    from_ = std::move(place);
    if (state.simulation->several()) return;  // each end has a coordinate of its own
    for (const std::size_t end : {kEnd, kSlice, kTimers}) {
      std::ranges::replace(from_.coordinates, end, state.zone.add(end));
      state.instants.push_back({{kNoTask, end}});
    }
  }

  /// Several threads run jobs: gives each that began a coordinate for its end.
  void after_several(ExploredState& state) {
    state.from = from_ns(state.zone.lowest(kNow));
    for (const auto& [worker, job] : started_) {
      const SimulatedWorkers::State& thread = state.simulation->workers()[worker];
      if (thread.step != ExploredState::Step::run || !(thread.record.job.ref() == job))
        continue;  // it took no time
      const Task& task = set_[job.task];
      const std::int64_t longest = (thread.until - state.simulation->now()).count();
      const std::size_t end =
          state.track({job, JobInstant::Kind::end}, longest - (task.wcet - task.bcet).count(), longest);
      state.happened.begun.push_back({job.task, end, state.name_of_job(worker)});
    }
  }

  void after(ExploredState& state) {
    settle();
    deliveries_.note(state, options_.platform.delivery_delay);
    if (state.simulation->several()) return after_several(state);
    // If the thread was displaced at the end of a dispatch, the job starts as soon as it has the core again.
    if (state.executor().step != before_.step) step_ends_ = true;
    Zone& zone = state.zone;
    const SimulatedWorkers::State& executor = state.executor();
    const std::int64_t now = to_ns(state.simulation->now());
    const std::int64_t end = to_ns(executor.until);
    state.from = from_ns(zone.lowest(kNow));
    if (step_ends_ && executor.step == ExploredState::Step::run)
      state.happened.begun = {{executor.record.job.task, kEnd}};
    if (state.busy()) {
      if (step_ends_) {
        const Task& task = set_[executor.record.job.task];
        // The workload took the longest time.
        const std::int64_t spread =
            executor.step == ExploredState::Step::run ? (task.wcet - task.bcet).count() : 0;
        zone.assign(kEnd, kNow, end - now - spread, end - now);
      } else if (end != state.end_there) {
        zone.assign(kEnd, kEnd, end - state.end_there);  // it was displaced for so long
      }
      state.end_there = end;
    }
    if (state.simulation->shares_core() && executor.on_core && executor.slice_end != before_.slice_end) {
      const std::int64_t slice = to_ns(executor.slice_end) - now;
      zone.assign(kSlice, kNow, slice);
    }
    note_threads(state);
  }

  /// Whether a sleeping thread was woken at an instant that depends on execution times. It then wakes at the
  /// coordinate `end`.
  void note_sleep(ExploredState& state, const SimulatedWorkers::State& thread,
                  const SimulatedWorkers::State& before, std::size_t end, bool& uncertain) const {
    const bool by_timer =
        thread.wake_at != kNever && thread.until == thread.wake_at + options_.platform.wake_up_latency;
    if (thread.until == kNever || by_timer) {
      uncertain = false;
    } else if (before.step != thread.step || before.until != thread.until) {
      uncertain = !state.zone.fixed(kNow);
      const std::int64_t latency = (thread.until - state.simulation->now()).count();
      if (uncertain) state.zone.assign(end, kNow, latency);
    }
  }

  void note_threads(ExploredState& state) {
    SimulatedWorkers::State& executor = state.executor();
    if (executor.step == ExploredState::Step::asleep) {
      note_sleep(state, executor, before_, kEnd, state.wakes);
    } else {
      state.wakes = false;
    }
    if (state.simulation->workers().size() == 1) return;
    const SimulatedWorkers::State& timers = state.timers();
    const bool was_displaced = before_.step == executor.step && !before_.on_core && !executor.on_core;
    const bool released = state.releases && timers_before_.step == ExploredState::Step::release &&
                          timers_before_.until <= state.simulation->now();
    if (released && was_displaced && state.busy()) {
      executor.until += timers_before_.remaining;
      state.end_there = to_ns(executor.until);
      state.zone.assign(kEnd, kEnd, timers_before_.remaining.count());
    }
    if (timers.step == ExploredState::Step::asleep) {
      note_sleep(state, timers, timers_before_, kTimers, state.releases);
    } else if (timers.step == ExploredState::Step::release) {
      note_release(state);
    } else {
      state.releases = false;
    }
  }

  void note_release(ExploredState& state) const {
    const SimulatedWorkers::State& timers = state.timers();
    if (state.simulation->shares_core() && (!timers.on_core || timers.slice_end <= timers.until))
      throw ExplorationRefused("releases that take longer than a time slice are not explored");
    if (timers_before_.step == timers.step && timers_before_.until == timers.until) return;
    state.releases = !state.zone.fixed(kNow);
    const std::int64_t cost = (timers.until - state.simulation->now()).count();
    if (state.releases) state.zone.assign(kTimers, kNow, cost);
  }

  void expand(ExploredState state) {
    for (;;) {
      const Time next_release = state.begin_to_release();
      Time others = state.next_of_others();
      const std::vector<UncertainInstant> first = state.uncertain();
      if (std::ssize(first) > kMostAtOnce)
        throw ExplorationRefused(kTooManyAtOnce, ExplorationRefused::Why::stopped);
      if (first.empty() && next_release <= others) {
        if (next_release == kNever) return;
        state.from = next_release;
        continue;
      }
      if (first.empty()) {
        state.zone.assign(kNow, kConstant, to_ns(others));
        state.happened = {};
        return happen(std::move(state), Branch{}, others);
      }
      const Time change = state.simulation->scheduler().next_change(state.from);
      // What happens at this timestamp may happen together with the release that it begins.
      if (next_release == change && others == change) others = kNever;
      const std::vector<Branch> branches = state.branches(others, change);
      // What is left happens at or after the timestamp, from which on decisions are other ones.
      const std::int64_t from = to_ns(change);
      const bool goes_on = others > change && std::ranges::all_of(first, [&](const auto& instant) {
                             return state.zone.limit(kConstant, instant.coordinate, -from);
                           });
      const std::size_t copies = branches.size() - (goes_on || branches.empty() ? 0 : 1);
      for (std::size_t i = 0; i < copies; ++i) follow(branches[i], state);
      if (!goes_on) {
        if (copies < branches.size()) follow(branches.back(), std::move(state));
        return;
      }
      state.from = change;
    }
  }

  /// What happens at kNow in the schedules of the branch, of which the simulation follows one.
  void follow(const Branch& branch, ExploredState next) {
    const std::vector<std::int64_t> point = branch.zone.point(kNow);
    next.zone = branch.zone;
    next.happened = {};
    next.move_to(branch, point);
    happen(std::move(next), branch, from_ns(point[kNow]));
  }

  void happen(ExploredState state, const Branch& branch, Time instant) {
    if (options_.platform.delivery_delay == Duration{}) return happen_so(std::move(state), branch, instant);
    deliveries_.for_each_choice([&] { happen_so(state, branch, instant); });
  }

  void happen_so(ExploredState state, const Branch& branch, Time instant) {
    count_successor();
    // The schedule that the simulation followed until now may be another one than the next.
    state.simulation->scheduler().released_by(instant);
    state.simulation->due_by(instant);
    before(state, branch.step_ends);
    for (const TaskId timer : branch.releases) {
      for (const Timer& held : state.simulation->scheduler().timers()) {
        if (held.task() == timer) state.happened.released.emplace_back(timer, held.next_call());
      }
      state.simulation->release(timer, instant);
    }
    state.simulation->advance(instant);
    after(state);
    if (state.simulation->several()) return enter(std::move(state));
    const bool goes_on = !step_ends_ && state.busy() && branch.releases.empty();
    if (state.slice_matters() && state.busy() && state.executor().on_core) {
      // A slice that is over already ends now.
      Zone over = state.zone;
      if (over.limit(kSlice, kNow, -1)) {
        ExploredState other = state;
        over.assign(kSlice, kNow, 0);
        other.zone = std::move(over);
        go_on(std::move(other), goes_on);
      }
      if (!state.zone.limit(kNow, kSlice, 0)) return;
    }
    go_on(std::move(state), goes_on);
  }

  /// While the same step goes on there is nothing to be joined with.
  void go_on(ExploredState state, bool same_step) {
    same_step ? expand(std::move(state)) : enter(std::move(state));
  }

  void enter(ExploredState state) {
    met_.enter(std::move(state), [this](const ExploredState& s, ExploredPaths::End place) {
      if (kept_.empty()) return;
      paths_.add({s.zone, from_, std::move(place), s.happened});
    });
  }

  const TaskSet& set_;
  const ExplorationOptions& options_;
  ExplorationObserver& observer_;
  MetStates met_;
  ExploredDeliveries deliveries_;
  const std::vector<std::uint32_t> executor_of_;  // the only one
  std::size_t expanded_ = 0, successors_ = 0;

  // For witnesses:
  ExploredPaths paths_;
  std::vector<std::optional<ExploredPaths::Edge>> kept_;  // by slot
  ExploredPaths::End from_;                               // the state that is expanded

  // While something happens:
  ExploredState* current_ = nullptr;
  bool step_ends_ = false, unsettled_ = false;
  std::vector<std::pair<Worker, JobRef>> started_;
  SimulatedWorkers::State before_, timers_before_;
};

}  // namespace

ExplorationResult explore(const TaskSet& set, const Scheduler& scheduler, const Workload& workload,
                          const ExplorationOptions& options, ExplorationObserver& observer) {
  try {
    Exploration exploration(set, options, observer);
    return exploration.run(explorable(set, options, scheduler, workload), workload);
  } catch (const SimulationError& error) {
    throw ExplorationRefused(error.what());
  }
}

}  // namespace hotpath
