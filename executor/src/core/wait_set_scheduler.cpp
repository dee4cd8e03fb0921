// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/wait_set_scheduler.hpp"

#include <algorithm>

namespace hotpath {

Arrival WaitSetScheduler::sample_arrived(TaskId task, const SampleInfo& sample, Time) {
  return {is_waited_for(task) ? wait_mutex_.waiting() : WorkerSet{}, add_unread(task, sample)};
}

std::optional<Job> WaitSetScheduler::pick(Time now) {
  return take(now, [this](TaskId id) { return group_free(id) ? Pick::run : Pick::leave; });
}

Decision WaitSetScheduler::decide(Worker worker, Time now) {
  Decision decision;
  // A recorded schedule shows who had the mutex, and when waits ended.
  const bool shared = workers().size() > 1 && !follows();
  if (shared && wait_mutex_.blocks(worker)) {
    decision.blocked = true;
    return decision;
  }
  const bool slept = wait_mutex_.enter(worker);
  if (slept) poll(now, [this](TaskId id) { return is_waited_for(id); });
  decision.job = pick(now);
  if (!decision.job && shared) return begin_wait(worker, now);
  if (!decision.job) {
    if (blocked_ == Blocked::forgotten) forget_snapshot();
    const std::uint32_t tasks = poll(now, [this](TaskId id) { return group_free(id); });
    decision.job = pick(now);
    if (decision.job && !slept) decision.waited_for = tasks;
  }
  if (decision.job) {
    decision.wake = wait_mutex_.next();
  } else if (wait_mutex_.wait(worker)) {
    decision.wake_at = next_timer([this](TaskId id) { return group_free(id); });
  }
  return decision;
}

Decision WaitSetScheduler::begin_wait(Worker worker, Time now) {
  if (blocked_ == Blocked::forgotten) forget_snapshot();
  wait_mutex_.wait(worker);
  left_out_ = busy_groups();
  const auto in_free_group = [this](TaskId id) { return group_free(id); };
  Decision decision;
  decision.waited_for = static_cast<std::uint32_t>(timer_ids().size() + subscription_ids().size());
  const bool has_sample = std::ranges::any_of(
      subscription_ids(), [&](TaskId id) { return unread_.count(id) > 0 && group_free(id); });
  decision.wake_at = has_sample ? now : next_timer(in_free_group);
  return decision;
}

Effect WaitSetScheduler::finished(Worker, const Job& job, Time) {
  free_group(job.task);
  return {wait_mutex_.waiting()};  // as joined(), so that the next wait includes the group again
}

Arrival StaticScheduler::sample_arrived(TaskId task, const SampleInfo& sample, Time) {
  return {WorkerSet::of(0), add_unread(task, sample)};
}

std::optional<Job> StaticScheduler::next_ready(Time now) {
  return take(now, [this, now](TaskId id) {
    // rclcpp checks a timer again, although no other thread calls it.
    return is_ready(id, now) ? Pick::run : Pick::leave;
  });
}

Decision StaticScheduler::decide(Worker, Time now) {
  Decision decision;
  decision.job = next_ready(now);
  if (!decision.job) {
    forget_snapshot();
    const std::uint32_t tasks = poll(now, [](TaskId) { return true; });
    decision.job = next_ready(now);
    if (!sleeps_ && decision.job) decision.waited_for = tasks;
  }
  sleeps_ = !decision.job;
  if (sleeps_) decision.wake_at = next_timer([](TaskId) { return true; });
  return decision;
}

RebuiltWaitSetScheduler::RebuiltWaitSetScheduler(const TaskSet& set, unsigned workers,
                                                 const std::vector<TaskId>& entity_order)
    : WaitSet(set, workers, TaskKind::timer, entity_order),
      waited_timers_(timer_ids()),
      waited_subscriptions_(subscription_ids()),
      is_waited_for_(set.size(), true) {}

void RebuiltWaitSetScheduler::describe(StateWords& words) const {
  WaitSet::describe(words);
  wait_mutex_.describe(words);
  words.add((interrupted_ ? 1 : 0) + (needs_rebuild_ ? 2 : 0));
  for (const std::vector<TaskId>& waited : {waited_timers_, waited_subscriptions_}) {
    words.add(static_cast<std::int64_t>(waited.size()));
    for (const TaskId id : waited) words.add(id);
  }
}

Arrival RebuiltWaitSetScheduler::sample_arrived(TaskId task, const SampleInfo& sample, Time) {
  return {is_waited_for_[task] ? wait_mutex_.waiting() : WorkerSet{}, add_unread(task, sample)};
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
  std::ranges::stable_sort(waited, {},
                           [this](TaskId id) { return place_of_kind(set_[id], TaskKind::timer); });
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
  if (set_.groups[set_.tasks[job.task].group] == CallbackGroup::reentrant) return {};
  free_group(job.task);
  interrupted_ = true;
  return {wait_mutex_.waiting()};
}

}  // namespace hotpath
