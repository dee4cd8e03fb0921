// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/trace.hpp"

/// Why an output took as long as it did.
namespace hotpath::explain {

/// The causes of a latency, which sum to it: the list is closed. Name, also in JSON; phrase of a sentence
/// or a table; colour: those of Okabe and Ito, and others that the colour-blind tell apart.
#define HOTPATH_CAUSES(CAUSE)                                         \
  CAUSE(running, "running on the path", "#0072b2")                    \
  CAUSE(join, "waiting for a join's other input or timer", "#cc79a7") \
  CAUSE(executor, "waiting for the executor", "#e69f00")              \
  CAUSE(older_sample, "queued behind an older sample", "#d55e00")     \
  CAUSE(snapshot, "a wait set's snapshot taken too early", "#f0e442") \
  CAUSE(overhead, "dispatch, wait and wake-up", "#cacaca")            \
  CAUSE(delivery, "delivery", "#56b4e9")                              \
  CAUSE(displaced, "displaced by another thread", "#009e73")          \
  CAUSE(withheld, "processor withheld by the host", "#c055f6")        \
  CAUSE(unexplained, "unexplained", "#ffffff")

/// The rules of executors by which another job went first: name and text.
#define HOTPATH_RULES(RULE)                                                               \
  RULE(none, "")                                                                          \
  RULE(already_running, "already running (non-preemptive)")                               \
  RULE(before_release, "chosen before this job's release")                                \
  RULE(earlier_snapshot, "in an earlier snapshot")                                        \
  RULE(timers_first, "timers before subscriptions")                                       \
  RULE(subscriptions_first, "subscriptions before timers")                                \
  RULE(kinds, "timers, subscriptions, services, clients, waitables: kind by kind")        \
  RULE(static_kinds, "subscriptions, timers, clients, services, waitables: kind by kind") \
  RULE(snapshot_order, "earlier in the wait set's snapshot")                              \
  RULE(fifo, "earlier event (FIFO)")                                                      \
  RULE(group_order, "callback group ready earlier (FIFO)")                                \
  RULE(priority, "higher priority")                                                       \
  RULE(deadline, "earlier deadline")                                                      \
  RULE(tie, "same priority, ahead by the tie rule")                                       \
  RULE(service_wait, "waited for the service wait")                                       \
  RULE(same_group, "same callback group in use")                                          \
  RULE(recorded, "went first in the recording")

#define HOTPATH_NAME(name, ...) name,
enum class Cause : std::uint8_t { HOTPATH_CAUSES(HOTPATH_NAME) };
enum class Rule : std::uint8_t { HOTPATH_RULES(HOTPATH_NAME) };
#undef HOTPATH_NAME

struct CauseText {
  Cause value;
  const char *text, *phrase, *colour;
};
constexpr auto enum_texts(Cause) {
#define HOTPATH_TEXT(name, ...) CauseText{Cause::name, #name, __VA_ARGS__},
  return std::array{HOTPATH_CAUSES(HOTPATH_TEXT)};
#undef HOTPATH_TEXT
}
constexpr auto enum_texts(Rule) {
#define HOTPATH_TEXT(name, text) EnumText<Rule>{Rule::name, text},
  return std::array{HOTPATH_RULES(HOTPATH_TEXT)};
#undef HOTPATH_TEXT
}
/// All causes, in the order of the enumeration.
inline constexpr auto kCauseTexts = enum_texts(Cause{});
[[nodiscard]] constexpr const char* phrase(Cause cause) {
  return kCauseTexts[static_cast<std::size_t>(cause)].phrase;
}

/// One latency to explain.
struct Output {
  std::uint32_t repetition = 0;
  std::uint64_t sequence = 0;  ///< Of the sink's job, or of the task's.
  Duration latency{};          ///< As measured, >= 0.
  TaskId sink = kNoTask;       ///< The task of that job.
};

/// An interval of a latency with one cause.
struct Part {
  Cause cause = Cause::unexplained;
  Rule rule = Rule::none;
  JobRef behind;         ///< The other job, for causes that have one; otherwise without a task.
  std::size_t step = 0;  ///< Index into Explanation::path: the job that ran or waited.
  Duration length{};     ///< > 0.
};

/// A wait of a job on a path for threads or a callback group that other jobs had.
struct ThreadsInWait {
  std::size_t step = 0;  ///< Index into Explanation::path.
  Time from{}, to{};
  std::size_t threads = 0;
  std::string sentence;  ///< What every thread ran in [from, to), in ms from the beginning of the latency.
};

/// The account of one latency.
struct Explanation {
  std::uint32_t repetition = 0;
  Duration latency{};
  /// From the source to the sink, or a single job. Incomplete if jobs are missing in the trace.
  std::vector<JobRecord> path;
  bool complete = true;                   ///< The path begins with the source's job.
  std::vector<Part> parts;                ///< In order of time; they sum to the latency.
  std::vector<ThreadsInWait> waits = {};  ///< In order of time; of executors with several threads.
};

}  // namespace hotpath::explain
