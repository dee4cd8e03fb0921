// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "import/recorded_window.hpp"

namespace hotpath::imports {

/// One event that an executor's scheduler must know.
struct RecordedStep {
  enum class Kind : std::uint8_t { arrival, start, finish };
  Kind kind = Kind::start;
  bool shows_decision = false;  ///< Start: the executor asked for work at this instant.
  bool contested = false;       ///< Start: another task of the executor could have run as well.
  Time at{};
  TaskId task = kNoTask;      ///< Arrival: the reader.
  std::uint32_t thread = 0;   ///< Start, finish: index into the executor's threads.
  std::uint32_t job = kNone;  ///< Index into the recorded jobs; arrival: of the publishing job, if known.
  Time ready{};               ///< Start: timestamp of the job.
  Time free{};                ///< Start: end of the thread's previous job.
};

/// The part of a recording that decides what one executor runs next. It assumes no executor.
struct RecordedSteps {
  std::vector<RecordedStep> steps;       ///< In the order of events; readers of a message in order of tasks.
  std::vector<std::vector<Time>> ready;  ///< By task: timestamps of its jobs, in the order of starts.
  std::vector<std::vector<Time>> ready_on;  ///< The same by thread.
  /// By task: when the decisions for its jobs fell at the latest, and on which threads.
  std::vector<std::vector<std::pair<Time, std::uint32_t>>> decided;
  std::vector<Time> deadline;  ///< By recorded job: inherited, with each period as the deadline.
  std::vector<bool> own;       ///< By task: the executor serves it.
  std::vector<bool> has_timers, has_others;  ///< By thread: the kinds of its tasks.
  Time epoch{};                              ///< Phases of timers count from here.
  std::size_t starts = 0;
};

/// The first `most` jobs of the executor.
[[nodiscard]] RecordedSteps recorded_steps(const RecordedGraph& graph, const RecordedWindow& window,
                                           std::span<const tracing::LostSample> lost,
                                           const RecordedExecutor& executor, std::size_t most);

/// The level of a timer without a priority.
inline constexpr std::int64_t kLast = std::numeric_limits<std::int64_t>::max();

/// Two threads with equal priorities of SCHED_FIFO on one processor: one runs when the other sleeps.
inline constexpr Duration kUntilIdle = std::chrono::hours(24 * 365);

/// An executor that may have run a recording, with what it leaves open.
struct Hypothesis {
  std::string label;  ///< As on the command line.
  const ExecutorEntry* entry = nullptr;
  SchedulerOptions options;
  /// All tasks in the order of entities, of delivery to the readers of a message, and of ties.
  std::vector<TaskId> order;
  /// By task: the priorities, or relative deadlines, of timers; empty: none are to be fitted.
  std::vector<std::int64_t> levels;
  /// Threads that share a wait set may ask in vain before they sleep, which changes the order of the set.
  bool asks_in_vain = false;
  /// The thread that releases timers waits until the executor's thread sleeps, or for this time: a time slice
  /// of Linux, or kUntilIdle.
  Duration release_delay{};
  bool superseded = false;  ///< The recorded releases have a later executor of this design.

  /// Whether the executor orders timers by numbers that a trace does not contain.
  [[nodiscard]] bool needs_levels() const {
    return entry->traits.policy == Policy::fp || entry->traits.policy == Policy::dm;
  }
};

/// How far the decisions of a hypothesis agree with a recording.
struct Agreement {
  enum class Of : std::uint8_t {
    yes,
    no,
    open,  ///< The job that the scheduler prefers became ready while the thread may have been deciding.
  };
  std::vector<Of> decisions;      ///< By start.
  std::vector<TaskId> preferred;  ///< By start: the task that the scheduler would have run; kNoTask: none.
  /// By start: the scheduler would have run a job that had been ready for too long for a delay.
  std::vector<bool> plain;
  std::size_t contradictions = 0;
  /// How often the first task ran while the scheduler had the second one ahead of it.
  std::map<std::pair<TaskId, TaskId>, std::uint32_t> before;
};

/// Drives the executor's scheduler with the recorded arrivals and makes it run the recorded jobs.
/// Covers the first `starts` decisions and counts contradictions from decision `from` on.
[[nodiscard]] Agreement follow(const TaskSet& set, const RecordedSteps& recorded,
                               const Hypothesis& hypothesis, std::size_t from, std::size_t starts);

/// Whether rclcpp's executor of this kind emits events of its waits: those of class Executor do.
[[nodiscard]] bool emits_waits(const ExecutorTraits& traits);

/// The releases that can have this version of tracetools. A version between those of two releases belongs to
/// the development of the later one, whose rclcpp may still be that of the earlier one. Empty: unknown.
[[nodiscard]] RosDistros releases_of(const std::string& tracetools_version);

/// Whether both are generations or variants of one class of rclcpp.
[[nodiscard]] bool are_of_one_design(const ExecutorEntry& a, const ExecutorEntry& b);

/// The executors of the registry, with their variants, that can have run so many threads in these releases.
[[nodiscard]] std::vector<Hypothesis> possible_hypotheses(const RecordedSteps& recorded, bool waits,
                                                          const RosDistros& releases);

/// Fits the order of the timers' given priorities, or relative deadlines, to the first `starts` decisions by
/// local search from two sides: by period, and all equal.
void fit_levels(const TaskSet& set, const RecordedSteps& steps, Hypothesis& hypothesis, std::size_t starts);

/// The answer to the question which executor ran a recording.
enum class Verdict : std::uint8_t {
  recognised,
  tie,        ///< Several executors explain it equally well.
  undecided,  ///< Too few decisions distinguish the executors.
  none_fits,
};
constexpr auto enum_texts(Verdict) {
  return texts_in_order<Verdict>({"recognised", "tie", "undecided", "none fits"});
}

/// By pair of tasks, the smaller one first: how many more contradictions there are if it comes second.
using OrderEvidence = std::map<std::pair<TaskId, TaskId>, std::int64_t>;

/// How well a hypothesis explains the decisions of the judged part of a recording.
struct Score {
  Hypothesis hypothesis;        ///< Fitted.
  OrderEvidence evidence = {};  ///< Empty: the order of creation explains the recording as well.
  std::size_t contradictions = 0;
  double agreement = 0;  ///< Share of the contested decisions that agree.
  double margin = 0;     ///< Log-likelihood ratio of the best hypothesis to this one.
  /// The kinds of these decisions, by the tasks that ran and that this one would have run.
  std::size_t kinds_against = 0;
  std::size_t against = 0, in_favour = 0;  ///< Decisions that only the best, or only this one explains.
  std::size_t plain_against = 0, plain_in_favour = 0;  ///< Those that timing cannot explain.
  bool unlikely = false;    ///< Not excluded, but the best one is a thousand times as likely.
  Agreement followed = {};  ///< Of the judged part.

  [[nodiscard]] double difference() const {
    return static_cast<double>(against) - static_cast<double>(in_favour);
  }
  [[nodiscard]] std::size_t differing() const { return against + in_favour; }
};

struct Recognition {
  Verdict verdict = Verdict::undecided;
  std::string stated;                        ///< The name that the executor gives itself; empty: none.
  std::vector<Score> ranking;                ///< The best first.
  std::size_t leading = 0;                   ///< The first ones, which the recording cannot tell apart.
  std::size_t decisions = 0, contested = 0;  ///< Of the judged part.
  std::string breaks;  ///< When the best first does not explain a decision, in words; empty: never.

  /// Labels of the leading hypotheses, or of the unlikely ones among them.
  [[nodiscard]] std::vector<std::string> names(bool unlikely_only = false) const;
};

/// Compares all executors that can have run the threads, fitted on the first half of the decisions, and
/// judged on the second half. A hypothesis that the executor `stated` itself is believed.
[[nodiscard]] Recognition recognise(const tracing::System& system, const RecordedGraph& graph,
                                    const RecordedSteps& steps, const std::vector<Hypothesis>& possible,
                                    const std::string& stated = {});

/// Nodes and callbacks in the order that agrees with most evidence; equals in the order of creation.
[[nodiscard]] ServiceOrder service_order(const tracing::System& system, const RecordedGraph& graph,
                                         const OrderEvidence& evidence);

/// One or two sentences: the verdict, its evidence, and what would decide an open one.
[[nodiscard]] std::string sentence(const Recognition& recognition);

}  // namespace hotpath::imports
