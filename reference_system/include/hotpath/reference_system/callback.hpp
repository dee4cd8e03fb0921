// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/task.hpp"

namespace hotpath {

/// When a job publishes.
enum class PublishRule : std::uint8_t {
  always,   ///< Every job.
  all_new,  ///< When each input of a set has a sample that no such message has contained yet.
  every,    ///< Every n-th job.
  last_of,  ///< Every job; adds the newest sample of each input of a set that no message has contained yet.
};

/// A topic that a callback publishes, and when. The message contains the histories of the set's
/// samples and of the sample that the job itself took.
struct Publication {
  std::string topic;
  PublishRule rule = PublishRule::always;
  std::vector<std::uint32_t> of;  ///< all_new, last_of: ascending indices into the node's inputs, >= 1.
  std::uint32_t n = 1;            ///< every: >= 1.
  std::uint32_t first = 0;        ///< every: the job with the first message, in [1, n]; 0: job n.
  double at = 1;                  ///< Share of the execution time before it, in [0, 1]; 1: at the end.
  friend bool operator==(const Publication&, const Publication&) = default;
};

/// Whether two publications of callbacks of one node follow the same rule. If it is all_new, they
/// complete the same set, whose samples enter one message.
[[nodiscard]] bool same_rule(const Publication& a, const Publication& b);

/// A quantile of execution times.
struct DurationQuantile {
  double percent = 0;  ///< In [0, 100].
  Duration time{};     ///< >= 0.
  friend bool operator==(const DurationQuantile&, const DurationQuantile&) = default;
};

/// Two hundred values with these quantiles, linearly interpolated between them; the first and the
/// last are the extremes. `quantiles` are ascending, from 0 to 100 percent.
[[nodiscard]] std::vector<Duration> values_of(const std::vector<DurationQuantile>& quantiles);

/// What a graph states of a timer.
struct StatedTimer : TimerTimes {
  std::optional<Duration> phase;         ///< First timestamp relative to the epoch, for `--phases given`.
  std::optional<std::int64_t> priority;  ///< Given fixed priority; also of subscriptions.
  friend bool operator==(const StatedTimer&, const StatedTimer&) = default;
};

/// A timer or a subscription of a node; it becomes one task.
struct Callback : StatedTimer {
  std::string task;                    ///< Name of the task.
  std::optional<std::uint32_t> input;  ///< Index into the node's inputs; std::nullopt: a timer.
  Duration worst{}, best{};            ///< Execution time, 0 <= best <= worst.
  std::shared_ptr<const std::vector<Duration>> measured;  ///< Within [best, worst], >= 1; nullptr: none.
  std::string measured_file;  ///< Their file, relative to that of the graph; empty: in the graph.
  std::vector<DurationQuantile> quantiles;       ///< The source of `measured`; empty: none.
  std::uint32_t group = 0;                       ///< Index into the node's groups.
  std::vector<Publication> publishes;            ///< Each topic once.
  EntityKind entity = EntityKind::subscription;  ///< Subscriptions; others than these: Graph::service_wait.
  /// Only stores its samples for the messages of other callbacks: publishes nothing and ends no
  /// chain. Set by callbacks_of().
  bool stores_only = false;

  /// Whether each publication waits for a set: a job that completes none takes no time.
  [[nodiscard]] bool waits_for_sets() const;
  /// Whether it publishes before the end of its jobs.
  [[nodiscard]] bool publishes_early() const {
    return std::ranges::any_of(publishes, [](const Publication& p) { return p.at < 1; });
  }
  /// Compares measured values, not their addresses.
  friend bool operator==(const Callback& a, const Callback& b);
};

}  // namespace hotpath
