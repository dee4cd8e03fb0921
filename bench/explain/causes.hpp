// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/trace.hpp"

/// Why an output took as long as it did.
namespace hotpath::explain {

/// A share of one output's latency. The list is closed: the causes of an output sum to its latency.
enum class Cause : std::uint8_t {
  running,
  join,
  executor,
  older_sample,
  snapshot,
  overhead,
  delivery,
  displaced,
  withheld,
  unexplained,
};
constexpr auto enum_texts(Cause) {
  return std::to_array<EnumText<Cause>>({{Cause::running, "running"},
                                         {Cause::join, "join"},
                                         {Cause::executor, "executor"},
                                         {Cause::older_sample, "older_sample"},
                                         {Cause::snapshot, "snapshot"},
                                         {Cause::overhead, "overhead"},
                                         {Cause::delivery, "delivery"},
                                         {Cause::displaced, "displaced"},
                                         {Cause::withheld, "withheld"},
                                         {Cause::unexplained, "unexplained"}});
}
inline constexpr std::size_t kCauses = enum_texts(Cause{}).size();

/// The cause as a phrase of a sentence or a table.
[[nodiscard]] constexpr const char* phrase(Cause cause) {
  constexpr std::array<const char*, kCauses> kPhrases = {"running on the path",
                                                         "waiting for a join's other input or timer",
                                                         "waiting for the executor",
                                                         "queued behind an older sample",
                                                         "a wait set's snapshot taken too early",
                                                         "dispatch, wait and wake-up",
                                                         "delivery",
                                                         "displaced by another thread",
                                                         "processor withheld by the host",
                                                         "unexplained"};
  return kPhrases[static_cast<std::size_t>(cause)];
}

/// The rule of the executor by which another job went first.
enum class Rule : std::uint8_t {
  none,
  already_running,
  before_release,
  earlier_snapshot,
  timers_first,
  subscriptions_first,
  snapshot_order,
  fifo,
  group_order,
  priority,
  deadline,
  tie,
  service_wait,
  same_group,
  recorded,
};
constexpr auto enum_texts(Rule) {
  return std::to_array<EnumText<Rule>>({{Rule::none, ""},
                                        {Rule::already_running, "already running (non-preemptive)"},
                                        {Rule::before_release, "chosen before this job's release"},
                                        {Rule::earlier_snapshot, "in an earlier snapshot"},
                                        {Rule::timers_first, "timers before subscriptions"},
                                        {Rule::subscriptions_first, "subscriptions before timers"},
                                        {Rule::snapshot_order, "earlier in the wait set's snapshot"},
                                        {Rule::fifo, "earlier event (FIFO)"},
                                        {Rule::group_order, "callback group ready earlier (FIFO)"},
                                        {Rule::priority, "higher priority"},
                                        {Rule::deadline, "earlier deadline"},
                                        {Rule::tie, "same priority, ahead by the tie rule"},
                                        {Rule::service_wait, "waited for the service wait"},
                                        {Rule::same_group, "same callback group in use"},
                                        {Rule::recorded, "went first in the recording"}});
}

/// An interval of a latency with one cause.
struct Part {
  Cause cause = Cause::unexplained;
  Rule rule = Rule::none;
  JobRef behind;         ///< The other job, for causes that have one; otherwise without a task.
  std::size_t step = 0;  ///< Index into Explanation::path: the job that ran or waited.
  Duration length{};     ///< > 0.
};

/// The account of one latency.
struct Explanation {
  std::uint32_t repetition = 0;
  Duration latency{};
  /// From the source to the sink, or a single job. Incomplete if jobs are missing in the trace.
  std::vector<JobRecord> path;
  bool complete = true;     ///< The path begins with the source's job.
  std::vector<Part> parts;  ///< In order of time; they sum to the latency.
};

}  // namespace hotpath::explain
