// SPDX-License-Identifier: Apache-2.0
#include "live/timer_grid.hpp"

#include <algorithm>

#include "program/text.hpp"

namespace hotpath::live {

namespace {

/// Above the wake-up latency of an ordinary kernel.
constexpr Duration kLate = std::chrono::milliseconds(1);

struct OffGrid {
  std::uint64_t skipped = 0, late = 0, all = 0;
  Duration latest{};
  [[nodiscard]] std::uint64_t times() const { return skipped + late; }
};

bool has_timer_thread(const setup::ExecutorSpec& executor, TaskId task) {
  const setup::ExecutorSpec& part = setup::parts(executor)[executor_of(executor, task)];
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
    if (set[id].kind != TaskKind::timer || !r.started() || !has_timer_thread(executor, id)) continue;
    const Duration delay = r.job.release - r.job.timestamp;
    timers[id].late += delay > kLate;
    timers[id].latest = std::max(timers[id].latest, delay);
  }
  const auto worst = std::ranges::max_element(timers, {}, &OffGrid::times);
  if (worst == timers.end() || worst->times() == 0) return "";
  const auto task = static_cast<TaskId>(worst - timers.begin());
  std::string text = program::concat(
      executor.label, ", repetition ", repetition.trace.repetition,
      ": timers left the grid of their given phases: ", set[task].name, " skipped ", worst->skipped, " of ",
      worst->all, " timestamps and was released over ", to_ms(kLate), " ms late ", worst->late, " times");
  if (worst->late > 0) text += program::concat(", at most ", program::fixed(to_ms(worst->latest), 1), " ms");
  if (const auto off = std::ranges::count_if(timers, &OffGrid::times); off > 1)
    text += program::concat("; and ", off - 1, " more");
  return text + ". Guarantees for these phases assume that timers are on time.";
}

}  // namespace hotpath::live
