// SPDX-License-Identifier: Apache-2.0
#include "simulated_workers.hpp"

namespace hotpath {

SimulatedWorkers::SimulatedWorkers(std::span<const WorkerRole> roles, const Platform& platform)
    : cores_(platform.cores),
      slice_(platform.time_slice),
      wake_up_latency_(platform.wake_up_latency),
      wall_clock_work_(platform.wall_clock_work),
      states_(roles.size()) {
  ready_.reserve(roles.size());
  for (Worker w = 0; w < size(); ++w) {
    states_[w].raised = platform.raised_releaser && roles[w] == WorkerRole::timer_management;
  }
}

void SimulatedWorkers::insert(Worker w) {
  const auto place = std::find_if(ready_.begin(), ready_.end(), [&](Worker other) {
    return states_[w].raised && !states_[other].raised;
  });
  ready_.insert(place, w);
}

void SimulatedWorkers::begin_step(Worker w, Step step, Duration length, Time now) {
  State& s = states_[w];
  s.step = step;
  s.until = s.step_end = now + length;
  s.remaining = length;
}

void SimulatedWorkers::make_ready(Worker w, Time now) {
  State& s = states_[w];
  s.step = Step::turn;
  s.remaining = Duration{};
  s.slice_left = slice_;
  insert(w);
  assign_cores(now);
}

void SimulatedWorkers::leave(Worker w, Time now) {
  states_[w].on_core = false;
  ready_.erase(std::find(ready_.begin(), ready_.end(), w));
  assign_cores(now);
}

void SimulatedWorkers::sleep(Worker w, Time wake_at, Time now) {
  states_[w].step = Step::asleep;
  states_[w].until = wake_at == kNever ? kNever : wake_at + wake_up_latency_;
  leave(w, now);
}

void SimulatedWorkers::wake(WorkerSet set, Time now) {
  while (!set.empty()) {
    const Worker w = set.pop_first();
    State& s = states_[w];
    s.woken = true;
    if (s.step != Step::asleep) continue;
    s.until = std::min(s.until, now + wake_up_latency_);
    if (s.until <= now) make_ready(w, now);
  }
}

void SimulatedWorkers::wake_sleepers(Time now) {
  for (Worker w = 0; w < size(); ++w) {
    if (states_[w].step == Step::asleep && states_[w].until <= now) make_ready(w, now);
  }
}

void SimulatedWorkers::unblock(Time now) {
  for (Worker w = 0; w < size(); ++w) {
    if (states_[w].step == Step::blocked) make_ready(w, now);
  }
}

void SimulatedWorkers::assign_cores(Time now) {
  for (std::size_t i = 0; i < ready_.size(); ++i) {
    State& s = states_[ready_[i]];
    const bool gets_core = i < cores_;
    if (s.on_core == gets_core) continue;
    s.on_core = gets_core;
    if (gets_core) {
      s.until = wall_clock_work_ && s.step == Step::run ? std::max(now, s.step_end) : now + s.remaining;
      s.slice_end = now + s.slice_left;
    } else {
      s.remaining = s.until - now;
      s.slice_left = std::max(Duration{}, s.slice_end - now);
    }
  }
}

Time SimulatedWorkers::next_instant(Time now) const {
  Time next = kNever;
  for (const State& s : states_) {
    if (s.on_core || s.step == Step::asleep) next = std::min(next, s.until);
  }
  if (contended()) {
    for (std::size_t i = 0; i < cores_; ++i) {
      if (shares_with_waiting(ready_[i])) next = std::min(next, std::max(now, states_[ready_[i]].slice_end));
    }
  }
  return next;
}

void SimulatedWorkers::rotate_expired(Time now) {
  if (!contended()) return;
  for (std::size_t i = 0; i < cores_ && contended();) {
    const Worker w = ready_[i];
    if (states_[w].slice_end > now || !shares_with_waiting(w)) {
      ++i;
      continue;
    }
    ready_.erase(ready_.begin() + static_cast<std::ptrdiff_t>(i));
    insert(w);
    assign_cores(now);
    states_[w].slice_left = slice_;
  }
}

}  // namespace hotpath
