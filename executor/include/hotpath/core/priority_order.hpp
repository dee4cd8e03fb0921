// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <compare>
#include <vector>

#include "hotpath/core/job.hpp"

namespace hotpath {

/// The order of released jobs.
enum class Policy : std::uint8_t {
  fifo,  ///< Order of activation (the stock events queue).
  rm,    ///< Rate monotonic: smaller period first.
  dm,    ///< Deadline monotonic: smaller relative deadline first.
  fp,    ///< Fixed priorities given in the task set, smaller first.
  edf,   ///< Earliest absolute deadline first.
};

/// What a policy orders by.
enum class Levels : std::uint8_t {
  arrival,
  fixed,
  deadline,
  other,  ///< Deadlines, to which the policy adds something: no analysis knows the order.
};

constexpr bool by_deadline(Levels levels) { return levels == Levels::deadline || levels == Levels::other; }

/// The source of a subscription's priority.
enum class SubscriptionRule : std::uint8_t {
  inherit,  ///< Fixed priority: the highest of the timers upstream; EDF: the absolute deadline of the
            ///< publishing job (paper, Section VII-C).
  first,    ///< Ahead of every timer (the authors' published artifact).
};

/// Order at equal priority.
enum class Ties : std::uint8_t {
  lifo,  ///< Subscriptions before timers, most recently activated first; timers by task, then timestamp.
  fifo,  ///< By activation.
};

inline constexpr std::int64_t kLowestLevel = std::numeric_limits<std::int64_t>::max();

/// All that distinguishes a policy.
struct PolicyTraits {
  Policy value;
  const char* text;
  Levels levels;
  std::int64_t (*own)(const Task&);  ///< Fixed levels: a timer's. Deadlines: what is added, in ns, at most 0.
};
constexpr auto enum_texts(Policy) {
  constexpr auto zero = [](const Task&) { return std::int64_t{0}; };
  return std::to_array<PolicyTraits>(
      {{Policy::fifo, "fifo", Levels::arrival, zero},
       {Policy::rm, "rm", Levels::fixed, [](const Task& task) { return task.period.count(); }},
       {Policy::dm, "dm", Levels::fixed, [](const Task& task) { return task.deadline.count(); }},
       {Policy::fp, "fp", Levels::fixed,
        [](const Task& task) { return task.priority.value_or(kLowestLevel); }},
       {Policy::edf, "edf", Levels::deadline, zero}});
}
inline constexpr auto kPolicies = enum_texts(Policy{});
constexpr const PolicyTraits& traits_of(Policy policy) {
  return *std::ranges::find(kPolicies, policy, &PolicyTraits::value);
}
constexpr auto enum_texts(SubscriptionRule) { return texts_in_order<SubscriptionRule>({"inherit", "first"}); }
constexpr auto enum_texts(Ties) { return texts_in_order<Ties>({"lifo", "fifo"}); }

/// Position of a released job in the ready queue; smaller runs first. Two jobs never have equal keys.
struct PriorityKey {
  std::int64_t priority = 0;
  std::uint64_t tie = 0;
  friend auto operator<=>(const PriorityKey&, const PriorityKey&) = default;
};

/// The priority order of a task set, shared by executors, simulator and analysis.
class PriorityOrder {
 public:
  PriorityOrder(const TaskSet& set, Policy policy, SubscriptionRule rule, Ties ties);

  /// Recomputes the levels after tasks have joined or left.
  void update(const TaskSet& set);

  /// `activation` counts the scheduler's releases and arrivals. Policy `fifo` orders by
  /// `activation` alone.
  [[nodiscard]] PriorityKey key(const Job& job, std::uint64_t activation) const;

  /// Whether subscriptions are ordered by the deadlines of the jobs that published.
  [[nodiscard]] bool by_inherited_deadline() const {
    return by_deadline(traits_->levels) && rule_ == SubscriptionRule::inherit;
  }

  /// Fixed policies: the number that `key` compares first. Under `rm` it is the (inherited) period
  /// in ns.
  [[nodiscard]] std::int64_t level(TaskId task) const { return level_[task]; }

 private:
  const PolicyTraits* traits_;
  Ties ties_;
  SubscriptionRule rule_;
  std::vector<std::int64_t> level_;
  std::vector<TaskKind> kind_;
  std::vector<bool> always_due_;
};

/// Fixed-priority level of every task. A timer has its own level under `policy`: period, relative
/// deadline or given priority. A subscription has its given priority (`fp` only) or else the
/// highest (smallest) level among the timers upstream along `Task::feeds`. A subscription without a
/// timer upstream gets the largest value.
std::vector<std::int64_t> inherited_levels(const TaskSet& set, Policy policy);

/// By task: the timer from which a subscription inherits its level, kNoTask if there is none. A
/// timer maps to itself.
std::vector<TaskId> most_urgent_timers(const TaskSet& set, Policy policy);

}  // namespace hotpath
