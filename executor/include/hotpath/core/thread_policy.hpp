// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/time.hpp"

namespace hotpath {

/// A thread's scheduling class: the ordinary policy, SCHED_BATCH or SCHED_IDLE with a nice value in [-20,
/// 19], SCHED_FIFO or SCHED_RR with a priority in [1, 99], or SCHED_DEADLINE with a budget.
struct ThreadPolicy {
  enum class Class : std::uint8_t { other, batch, idle, fifo, rr, deadline };
  Class scheduling_class = Class::other;
  int priority = 0;  ///< Real-time priority; for other, batch and idle the nice value.
  /// SCHED_DEADLINE: 1024 ns <= runtime <= deadline <= period.
  Duration runtime{}, deadline{}, period{};

  /// Whether the policy ranks below all real-time policies.
  [[nodiscard]] constexpr bool ordinary() const {
    return scheduling_class != Class::fifo && scheduling_class != Class::rr &&
           scheduling_class != Class::deadline;
  }
  friend bool operator==(const ThreadPolicy&, const ThreadPolicy&) = default;
};

constexpr auto enum_texts(ThreadPolicy::Class) {
  return texts_in_order<ThreadPolicy::Class>({"other", "batch", "idle", "fifo", "rr", "deadline"});
}

inline constexpr int kHighestPriority = 99;

/// The smallest runtime that Linux accepts for SCHED_DEADLINE.
inline constexpr Duration kLeastRuntime{1024};

/// The policy of a timer management thread raised above executor threads of policy `executor`:
/// SCHED_FIFO 90, or one above `executor` if that is higher. Nothing ranks above kHighestPriority
/// or SCHED_DEADLINE.
[[nodiscard]] constexpr ThreadPolicy raised_above(const ThreadPolicy& executor) {
  const int above = executor.ordinary() ? 0 : executor.priority + 1;
  return {ThreadPolicy::Class::fifo, std::min(kHighestPriority, std::max(90, above))};
}

/// `other`, `other:-5`, `fifo:80`, `deadline:2.5/10/10` (runtime, deadline and period in ms).
[[nodiscard]] std::string to_string(const ThreadPolicy& policy);
/// Throws std::invalid_argument with the valid forms.
[[nodiscard]] ThreadPolicy parse_thread_policy(const std::string& text);
/// Checks the budget of a SCHED_DEADLINE policy; throws std::invalid_argument.
void check_budget(const ThreadPolicy& policy);

}  // namespace hotpath
