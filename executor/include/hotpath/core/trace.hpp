// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/job.hpp"

namespace hotpath {

/// The record of one job. The outcome determines which instants are set: `ran` both, `running` only
/// the start, `empty` both and equal, `queued` and `overwritten` neither.
struct JobRecord {
  Job job{};  ///< `job.skipped` counts further timestamps, each a row `skipped` of jobs.csv.
  Time start{};
  Time finish{};
  Duration cpu_time{-1};  ///< CPU time of the thread over the job; -1: not measured.
  Outcome outcome = Outcome::ran;
  std::uint16_t worker = 0;  ///< Unique in the run, across all its executors.
  std::uint16_t process = 0;
  std::int16_t cpu = -1;  ///< Processor on which the job finished; -1: unknown.

  [[nodiscard]] bool started() const { return outcome == Outcome::ran || outcome == Outcome::running; }
  [[nodiscard]] Duration response_time() const { return finish - job.timestamp; }  ///< Of a job that ran.
  [[nodiscard]] Duration duration() const { return finish - start; }               ///< Of a job that ran.
  [[nodiscard]] Duration lateness() const { return start - job.timestamp; }        ///< Of a started job.
};

/// What is measured: the age of the data in a chain's output when it is there (end-to-end latency), the
/// paper's hot-path latency of that output, or the response time of a task's job.
enum class Latency : std::uint8_t { age, hot_path, response };
constexpr auto enum_texts(Latency) { return texts_in_order<Latency>({"age", "hot path", "response"}); }

/// One output of a chain's sink.
struct ChainRecord {
  std::uint32_t chain = 0;     ///< Index into the graph's chains.
  std::uint64_t sequence = 0;  ///< Sequence of the sink's job.
  /// Samples lost on the way, as counted in the message (upstream's `hot path drops`).
  std::uint32_t dropped = 0;
  /// Start of the sink's job minus the latest start of a source job in its data.
  Duration hot_path_latency{};
  /// Finish of the sink's job minus the oldest source timestamp; -1: unknown.
  Duration end_to_end_latency{-1};
  TaskId sink = kNoTask;  ///< Task of the sink's job; kNoTask: unknown.
  Time finish = kNever;   ///< Of the sink's job; kNever: unknown.
  /// Latest minus oldest timestamp of the sources in the data; -1: unknown.
  Duration disparity{-1};

  /// The age or the hot-path latency; std::nullopt: unknown.
  [[nodiscard]] std::optional<Duration> latency(Latency of) const {
    if (of == Latency::age && end_to_end_latency < Duration{}) return std::nullopt;
    return of == Latency::age ? end_to_end_latency : hot_path_latency;
  }
};

/// Everything recorded in one run of one executor, live or simulated.
struct Trace {
  std::string executor;
  std::uint32_t repetition = 0;
  Time epoch{};
  Time end{};  ///< No job starts at or after this instant.
  std::vector<JobRecord> jobs;
  std::vector<ChainRecord> chains;
  std::vector<std::uint64_t> published;  ///< Per subscription: samples published for it. Timers: 0.
  std::uint64_t lost_records = 0;        ///< Records lost because the buffers were full.
};

}  // namespace hotpath
