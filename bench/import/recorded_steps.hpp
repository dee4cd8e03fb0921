// SPDX-License-Identifier: Apache-2.0
#pragma once

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

}  // namespace hotpath::imports
