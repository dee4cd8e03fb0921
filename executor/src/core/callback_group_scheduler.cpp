// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/callback_group_scheduler.hpp"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "hotpath/core/events_queue.hpp"
#include "hotpath/core/explored_scheduler.hpp"
#include "hotpath/core/timers_manager.hpp"

namespace hotpath {

namespace {

class CallbackGroupScheduler final : public ExploredScheduler {
 public:
  CallbackGroupScheduler(const TaskSet& set, unsigned workers, Requeue requeue)
      : ExploredScheduler(set, workers, true), requeue_(requeue), groups_(set.groups.size()) {
    ready_groups_.reserve(set.groups.size());
  }

  void begin(Time epoch) override { timers_.begin(set_, epoch); }
  Effect release_timers(Worker worker, Time now) override {
    Effect effect;
    if (worker != timer_manager()) return effect;
    for (; timers_.due(now); ++effect.released) effect.wake |= add_event(timers_.take_head(), now);
    return effect;
  }
  Arrival sample_arrived(TaskId task, const SampleInfo& sample, Time now) override {
    Arrival arrival;
    arrival.overwritten = unread_.push(task, next_sample(task, sample));
    arrival.wake = add_event(task, now);
    return arrival;
  }
  Decision decide(Worker worker, Time now) override {
    Decision decision;
    if (worker == timer_manager()) {
      decision.wake_at = timers_.next_due();
      return decision;
    }
    if (woken_ == worker) woken_.reset();
    const Job* const event = next_event();
    if (event == nullptr) {
      idle_.insert(worker);
      return decision;
    }
    idle_.erase(worker);
    decision.job = take(*event, now);
    if (requeue_ == Requeue::at_end) return decision;
    const std::uint32_t group = set_.tasks[event->task].group;
    if (set_.groups[group] == CallbackGroup::reentrant && !groups_[group].events.empty())
      ready_groups_.push_back(group);
    if (!ready_groups_.empty()) decision.wake = wake_one();
    return decision;
  }
  Effect finished(Worker, const Job& job, Time now) override {
    Effect effect;
    const Task& task = set_.tasks[job.task];
    if (task.kind == TaskKind::timer && task.local) {  // not removed meanwhile
      if (task.always_due) timers_.ended(job.task, now);
      timers_.wait(job.task);
      if (timers_.must_look_for(job.task)) effect.wake.insert(timer_manager());
    }
    Group& group = groups_[task.group];
    if (group.events.empty()) {
      group.idle = true;
    } else if (requeue_ == Requeue::at_end || std::ranges::count(ready_groups_, task.group) == 0) {
      effect.wake |= queue_group(task.group);
    }
    return effect;
  }
  Joined add_task(const JoiningTask& joining, Time now) override {
    const TaskId id = join_set(joining);
    groups_.resize(set_.groups.size());
    ready_groups_.reserve(set_.groups.size());
    if (set_[id].kind == TaskKind::subscription || !set_[id].local) return {id, {}};
    timers_.add(id, set_[id], now);
    return {id, timers_.must_look_for(id) ? WorkerSet::of(timer_manager()) : WorkerSet{}};
  }
  void remove_task(TaskId task, Time now, const Visitor& dropped) override {
    if (set_[task].kind == TaskKind::timer && set_[task].local) visit_due(timers_.remove(task), now, dropped);
    drop_unread(task, dropped);
    leave(changed_set(), task);
    const std::uint32_t index = set_[task].group;
    Group& group = groups_[index];
    group.events.erase(task, [](const Job&) {});
    // A running group notices it at the end of its job.
    if (group.events.empty() && std::erase(ready_groups_, index) > 0) group.idle = true;
  }
  [[nodiscard]] std::unique_ptr<ExploredScheduler> clone() const override {
    return std::make_unique<CallbackGroupScheduler>(*this);
  }
  void describe(StateWords& words) const override {
    timers_.describe(words);
    timers_.describe_waiting(words);
    for (TaskId id = 0; id < unread_.tasks(); ++id) words.add(unread_.count(id));
    for (const Group& group : groups_) {
      group.events.for_each([&](const Job& event) { words.add(event.task); });
      words.add(group.idle ? -1 : -2);
    }
    words.add(static_cast<std::int64_t>(ready_groups_.size()));
    for (const std::uint32_t group : ready_groups_) words.add(group);
    words.add(static_cast<std::int64_t>(idle_.bits()));
    words.add(woken_ ? static_cast<std::int64_t>(*woken_) : -1);
  }
  [[nodiscard]] std::span<const Timer> timers() const override { return timers_.timers(); }
  void release_at(TaskId timer, Time due) override { timers_.release_at(timer, due); }
  void released_by(Time now) override { timers_.released_by(now); }

 private:
  struct Group {
    SimpleEventsQueue events{16};
    bool idle = true;  ///< An event makes it ready: it is not, and no job ended after the last event.
  };

  [[nodiscard]] Worker timer_manager() const { return static_cast<Worker>(workers().size() - 1); }
  /// Queues an event of `task`; returns the worker to wake, if any.
  WorkerSet add_event(TaskId task, Time now) {
    const std::uint32_t index = set_.tasks[task].group;
    Group& group = groups_[index];
    Job event;
    event.task = task;
    event.release = now;
    group.events.push(event);
    if (!std::exchange(group.idle, false)) return {};
    return queue_group(index);
  }
  WorkerSet queue_group(std::uint32_t group) {
    ready_groups_.push_back(group);
    return wake_one();
  }
  /// The worker to wake for a ready group, if any.
  WorkerSet wake_one() {
    if (idle_.empty() || woken_) return {};
    const Worker worker = idle_.pop_first();
    if (requeue_ == Requeue::at_dispatch) woken_ = worker;
    return WorkerSet::of(worker);
  }
  Job take(const Job& event, Time now) {
    Job job = event;
    if (set_.tasks[event.task].kind == TaskKind::timer) {
      job = timers_.call(event.task, now);
    } else if (unread_.count(event.task) > 0) {
      job = unread_.pop(event.task);
    } else {
      job.empty = true;
    }
    job.release = std::max(event.release, job.timestamp);
    return job;
  }
  /// Removes the event that runs next from its group, and the group from the ready groups.
  const Job* next_event() {
    if (ready_groups_.empty()) return nullptr;
    const Job* event = nullptr;
    if (!follows()) {
      event = &groups_[ready_groups_.front()].events.pop();
      ready_groups_.erase(ready_groups_.begin());
      return event;
    }
    // The first event of each group, and only if none may run a later one.
    for (const bool later : {false, true}) {
      const auto take_from = [&](std::uint32_t group) {
        bool first = true;
        event = groups_[group].events.pop_first(
            [&](const Job& job) { return (std::exchange(first, false) || later) && may_run(job.task); });
        return event != nullptr;
      };
      const auto group = std::ranges::find_if(ready_groups_, take_from);
      if (group == ready_groups_.end()) continue;
      ready_groups_.erase(group);
      break;
    }
    return event;
  }

  const Requeue requeue_;
  TimersManager timers_;
  std::vector<Group> groups_;
  std::vector<std::uint32_t> ready_groups_;  // in the order in which workers take them; each at most once
  WorkerSet idle_;                           // found nothing to run and have not been woken since
  std::optional<Worker> woken_;              // Requeue::at_dispatch: has not looked for a group yet
};

}  // namespace

std::unique_ptr<Scheduler> make_callback_group_scheduler(const TaskSet& set, unsigned workers,
                                                         Requeue requeue) {
  return std::make_unique<CallbackGroupScheduler>(set, workers, requeue);
}

}  // namespace hotpath
