// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/rebuilt_wait_set_scheduler.hpp"

#include <algorithm>
#include <ranges>

namespace hotpath {

RebuiltWaitSetScheduler::RebuiltWaitSetScheduler(const TaskSet& set, unsigned workers,
                                                 const std::vector<TaskId>& entity_order)
    : WaitSet(set, workers, TaskKind::timer, entity_order),
      waited_timers_(timer_ids()),
      waited_subscriptions_(subscription_ids()),
      is_waited_for_(set.size(), true) {}

Arrival RebuiltWaitSetScheduler::sample_arrived(TaskId task, const SampleInfo& sample, Time) {
  Arrival arrival;
  arrival.overwritten = unread_.add(task, sample);
  if (is_waited_for_[task]) arrival.wake = wait_mutex_.waiting();
  return arrival;
}

WorkerSet RebuiltWaitSetScheduler::joined(TaskId) {
  is_waited_for_.push_back(false);
  interrupted_ = true;  // the wait set is rebuilt before the next wait
  return wait_mutex_.waiting();
}

void RebuiltWaitSetScheduler::left(TaskId task) {
  is_waited_for_[task] = false;
  std::erase(waited_timers_, task);
  std::erase(waited_subscriptions_, task);
}

void RebuiltWaitSetScheduler::rebuild(std::vector<TaskId>& waited, const std::vector<TaskId>& all) {
  std::erase_if(waited, [this](TaskId id) {
    if (group_free(id)) return false;
    is_waited_for_[id] = false;
    return true;
  });
  const auto before = static_cast<std::ptrdiff_t>(waited.size());
  for (const TaskId id : all) {
    if (is_waited_for_[id] || !group_free(id)) continue;
    is_waited_for_[id] = true;
    waited.push_back(id);
  }
  std::sort(waited.begin() + before, waited.end(), std::greater<>());
  std::stable_partition(waited.begin(), waited.end(), [this](TaskId id) { return !set_[id].guaranteed; });
}

void RebuiltWaitSetScheduler::rebuild() {
  needs_rebuild_ = false;
  rebuild(waited_timers_, timer_ids());
  rebuild(waited_subscriptions_, subscription_ids());
}

std::optional<Job> RebuiltWaitSetScheduler::pick(Time now) {
  return take(now, [this](TaskId id) {
    if (group_free(id)) return Pick::run;
    return set_.tasks[id].kind == TaskKind::timer ? Pick::leave : Pick::forget;
  });
}

std::optional<Job> RebuiltWaitSetScheduler::wait(Time now) {
  forget_snapshot();
  for (const TaskId id : waited_timers_) poll_task(id, now);
  for (const TaskId id : waited_subscriptions_) poll_task(id, now);
  if (std::exchange(interrupted_, false)) needs_rebuild_ = true;
  return pick(now);
}

Decision RebuiltWaitSetScheduler::decide(Worker worker, Time now) {
  Decision decision;
  // A worker that slept returns from its wait.
  decision.job = wait_mutex_.enter(worker) ? wait(now) : pick(now);
  while (!decision.job) {
    if (needs_rebuild_) rebuild();
    decision.waited_for = static_cast<std::uint32_t>(waited_timers_.size() + waited_subscriptions_.size());
    decision.job = wait(now);
    if (!needs_rebuild_) break;
  }
  if (decision.job) {
    decision.wake = wait_mutex_.next();
  } else if (wait_mutex_.wait(worker)) {
    decision.wake_at =
        next_timer([this, now](TaskId id) { return is_waited_for_[id] && !is_ready(id, now); });
  } else {
    decision.waited_for = 0;  // it only queues for the mutex of the worker that waits
  }
  return decision;
}

Effect RebuiltWaitSetScheduler::finished(Worker, const Job& job, Time) {
  Effect effect;
  if (set_.groups[set_.tasks[job.task].group] == CallbackGroup::mutually_exclusive) {
    free_group(job.task);
    interrupted_ = true;
    effect.wake = wait_mutex_.waiting();
  }
  return effect;
}

}  // namespace hotpath
