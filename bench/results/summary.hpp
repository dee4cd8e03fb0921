// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/accounting.hpp"
#include "hotpath/core/trace.hpp"
#include "results/statistics.hpp"

namespace hotpath {

/// What a run used from its first release to its stop, summed over its processes.
struct ProcessUsage {
  Duration cpu_time{};
  std::int64_t peak_memory_kib = 0;
  std::int64_t voluntary_switches = 0;
  std::int64_t involuntary_switches = 0;
  Duration stolen{};  ///< Time that the hypervisor gave to others, summed over the run's processors.
  Duration wall{};
};

/// One finished run of one executor.
struct Repetition {
  Trace trace;
  ProcessUsage usage;
  std::vector<TaskAccount> accounts;  ///< account(set, trace).
};

struct ExecutorRuns {
  std::string executor;
  std::vector<Repetition> repetitions;
};

/// A chain of the graph; a trace's ChainRecord::chain is its index.
struct MeasuredChain {
  std::string name;
  std::vector<TaskId> sink_tasks;  ///< The tasks of the sink node whose jobs end the chain.
};

/// What a summary must know of the graph and of the experiment.
struct SummaryOptions {
  std::vector<MeasuredChain> chains;
  std::vector<TaskId> cyclic_timers;  ///< Timers of the cyclic nodes, whose period is measured.
  Duration warm_up{};                 ///< >= 0, from the epoch.
  BootstrapOptions bootstrap;
};

/// The chain records that count. One rule decides for jobs and chains alike: a sample belongs to the warm-up
/// when its job's timestamp lies before epoch + warm_up; for a chain that is the sink's job, found by its
/// sequence. Where several sink tasks have a job of that sequence, the earliest timestamp decides. A record
/// whose sink job has no record counts: buffers fill up at the end of a run only.
std::vector<ChainRecord> after_warm_up(const Trace& trace, const std::vector<MeasuredChain>& chains,
                                       Duration warm_up);

/// One latency over all repetitions of an executor, in milliseconds.
struct LatencySummary {
  Quantiles quantiles;
  std::optional<Interval> p50, p99, p999, max;
};

struct ChainSummary {
  std::string chain;
  LatencySummary hot_path;
  LatencySummary end_to_end;
  std::uint64_t drops = 0;  ///< Samples lost on the way to the counted outputs (upstream's `hot path drops`).
  /// This executor's hot-path latency divided by that of `default`; none when `default` was not measured.
  std::optional<Estimate> median_to_default, max_to_default;
  std::optional<Estimate> median_minus_default;  ///< Difference of the medians in milliseconds.
};

/// `ran` to `empty` count the whole run, warm-up included, as the loss equations do; the rest leaves it out.
struct TaskSummary {
  std::string task;
  TaskKind kind = TaskKind::timer;
  std::uint64_t ran = 0, skipped = 0, overwritten = 0, queued = 0, running = 0, empty = 0;
  Quantiles response_ms;
  /// Response time as the paper's authors measure it (their sensor.hpp): finish minus the timer's next call
  /// as read at the start, plus its period. In sets of timers alone, where it follows from the trace.
  std::optional<Quantiles> response_authors_ms;
  std::uint64_t deadline_overruns = 0;  ///< Timers: jobs whose response time exceeds the relative deadline.
  /// Cyclic nodes: distance of the starts of consecutive executed jobs. Upstream divides it by the difference
  /// of its message numbers, which is 1 between executed jobs; a skipped timestamp thus shows as a doubled
  /// period.
  std::optional<Quantiles> period_ms;
};

/// A task of one repetition whose loss equation does not hold.
struct Imbalance {
  std::uint32_t repetition = 0;
  std::string task;
  std::uint64_t accounted = 0;
  std::uint64_t expected = 0;
};

struct ExecutorSummary {
  std::string executor;
  std::size_t repetitions = 0;
  std::uint64_t executed = 0;  ///< Callbacks that ran to their end.
  std::uint64_t skipped = 0;
  std::uint64_t overwritten = 0;
  std::uint64_t deadline_overruns = 0;
  std::uint64_t lost_records = 0;
  double cpu_per_callback_us = kNoValue;  ///< CPU time of all processes per executed callback.
  ProcessUsage usage;  ///< Summed over repetitions; the memory is the largest repetition's.
  std::vector<ChainSummary> chains;
  std::vector<TaskSummary> tasks;
  std::vector<Imbalance> unbalanced;  ///< Empty: the loss equations hold for every task of every repetition.
};

struct Summary {
  Duration warm_up{};
  BootstrapOptions bootstrap;
  std::vector<ExecutorSummary> executors;  ///< In the order of the input.
};

/// A pure function of what was recorded. Every trace and account belongs to `set`.
Summary summarize(const TaskSet& set, const std::vector<ExecutorRuns>& runs, const SummaryOptions& options);

/// The content of summary.json. Units are the endings of keys (`_ms`, `_us`, `_s`, `_kib`, `_percent`) and
/// hold for all that lies below a key; what could not be measured is null.
nlohmann::json to_json(const Summary& summary);

}  // namespace hotpath
