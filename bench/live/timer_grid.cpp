// SPDX-License-Identifier: Apache-2.0
#include "live/timer_grid.hpp"

#include <algorithm>
#include <functional>

#include "program/text.hpp"

namespace hotpath::live {

namespace {

/// Above the wake-up latency of an ordinary kernel.
constexpr Duration kLate = std::chrono::milliseconds(1);
constexpr std::size_t kMostNamed = 3;

struct OffGrid {
  std::uint64_t skipped = 0, late = 0, all = 0;
  Duration latest{};
};

bool has_timer_thread(const setup::ExecutorSpec& executor, TaskId task) {
  const setup::ExecutorSpec& part =
      executor.deployment ? executor.deployment->executors[executor.deployment->plan.executor_of[task]]
                          : executor;
  // On rclcpp, the start of a job is the earliest instant known of its own executors' jobs.
  const bool known =
      part.stack != setup::Stack::rclcpp || part.entry->traits.family == Family::priority_events;
  return known && part.entry->traits.timers == TimerHandling::release_only;
}

}  // namespace

std::string left_grid(const TaskSet& set, const setup::ExecutorSpec& executor,
                      const results::Repetition& repetition) {
  std::vector<OffGrid> timers(set.size());
  for (const TaskAccount& a : repetition.accounts) {
    timers[a.task].skipped = a[Outcome::skipped];
    timers[a.task].all = a.accounted();
  }
  for (const JobRecord& r : repetition.trace.jobs) {
    const TaskId id = r.job.task;
    if (set[id].kind != TaskKind::timer || !started(r) || !has_timer_thread(executor, id)) continue;
    const Duration delay = r.job.release - r.job.timestamp;
    timers[id].late += delay > kLate;
    timers[id].latest = std::max(timers[id].latest, delay);
  }
  std::vector<TaskId> off;
  for (TaskId id = 0; id < set.size(); ++id) {
    if (set[id].kind == TaskKind::timer && timers[id].skipped + timers[id].late > 0) off.push_back(id);
  }
  if (off.empty()) return "";
  std::ranges::stable_sort(off, std::greater(),
                           [&](TaskId id) { return timers[id].skipped + timers[id].late; });
  std::string text = program::concat(executor.label, ", repetition ", repetition.trace.repetition,
                                     ": timers left the grid of their given phases:");
  for (std::size_t i = 0; i < std::min(kMostNamed, off.size()); ++i) {
    const OffGrid& timer = timers[off[i]];
    text += program::concat(i > 0 ? ";" : "", " ", set[off[i]].name);
    if (timer.skipped > 0)
      text += program::concat(" skipped ", timer.skipped, " of ", timer.all, " timestamps");
    if (timer.skipped > 0 && timer.late > 0) text += " and";
    if (timer.late > 0) {
      text += program::concat(" was released over ", to_ms(kLate), " ms late ", timer.late,
                              timer.late == 1 ? " time" : " times", ", at most ",
                              program::fixed(to_ms(timer.latest), 1), " ms");
    }
  }
  if (off.size() > kMostNamed) text += program::concat("; and ", off.size() - kMostNamed, " more");
  return text + ". Guarantees for these phases assume that timers are on time.";
}

}  // namespace hotpath::live
