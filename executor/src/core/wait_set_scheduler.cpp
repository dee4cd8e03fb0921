// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/wait_set_scheduler.hpp"

#include <algorithm>

namespace hotpath {

Arrival WaitSetScheduler::sample_arrived(TaskId task, const SampleInfo& sample, Time) {
  Arrival arrival;
  arrival.overwritten = unread_.add(task, sample);
  if (is_waited_for(task)) arrival.wake = wait_mutex_.waiting();
  return arrival;
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
  Effect effect;
  // The interrupt guard condition ends the wait, so that the next one includes the group again.
  effect.wake = wait_mutex_.waiting();
  return effect;
}

}  // namespace hotpath
