// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/analysis/statistics.hpp"
#include "hotpath/core/accounting.hpp"
#include "hotpath/core/trace.hpp"
#include "program/json_record.hpp"
#include "results/measures.hpp"
#include "results/process_usage.hpp"

namespace hotpath::results {

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

/// The properties of graph and run that a summary needs.
struct SummaryOptions {
  std::vector<std::string> chains;  ///< Names; a trace's ChainRecord::chain is an index into them.
  Duration warm_up{};               ///< >= 0, from the epoch.
  BootstrapOptions bootstrap;
};

/// One latency over all repetitions of an executor, in milliseconds.
struct LatencySummary {
  Quantiles quantiles;
  Quantiles low, high;  ///< The limits of the confidence intervals; without an interval NaN.
  /// Ratios to `default` on the same stack; nullopt if `default` was not measured.
  std::optional<Estimate> median_to_default = {}, p99_to_default = {}, max_to_default = {};
  std::optional<Estimate> median_minus_default = {};  ///< Difference of the medians in milliseconds.

  [[nodiscard]] Estimate estimate(double Quantiles::*of) const {
    if (std::isnan(low.*of)) return {quantiles.*of, std::nullopt};
    return {quantiles.*of, Interval{low.*of, high.*of}};
  }
};

struct ChainSummary {
  std::string chain;
  LatencySummary end_to_end;  ///< The age of the data when the output is there.
  LatencySummary hot_path;    ///< The paper's metric: from the start of the latest source's job.
  Quantiles interval_ms;      ///< Between the finishes of consecutive outputs of a repetition.
  Quantiles disparity_ms;     ///< Spread of the sources' timestamps in one output.
  std::uint64_t drops = 0;    ///< Samples lost before the counted outputs (upstream's `hot path drops`).

  [[nodiscard]] const LatencySummary& latency(Latency of) const {
    return of == Latency::age ? end_to_end : hot_path;
  }
};

/// Whether a task had timestamps or samples, but none of its jobs started.
[[nodiscard]] inline bool never_ran(const TaskAccount& account) {
  return account[Outcome::ran] + account[Outcome::running] == 0 && account.accounted() > 0;
}

/// `account` covers the whole run with its warm-up, like the loss equations; the other members
/// exclude the warm-up.
struct TaskSummary : TaskTotals {
  std::string task;
  TaskKind kind = TaskKind::timer;
  TaskAccount account;
  Duration period{};      ///< Timers.
  Duration deadline{};    ///< Timers: relative.
  double busy_share = 0;  ///< Of the runs' time, if each of its jobs takes its worst case.
  Quantiles response_ms;
  /// Response time as the paper's authors measure it (their sensor.hpp): finish minus the timer's
  /// next call as read at the start, plus its period. Only for sets without subscriptions, where
  /// the trace determines it.
  std::optional<Quantiles> response_authors_ms;
  /// Timers: time between the starts of consecutive counted jobs. Upstream divides it by the
  /// difference of the message numbers, which is 1 between executed jobs, so a skipped timestamp
  /// doubles the period.
  std::optional<Quantiles> period_ms;
  std::optional<Quantiles> period_deviation_ms;  ///< Timers: period_deviation() of the same pairs of jobs.

  /// How much the distance of the starts varies, from the least to the greatest; NaN without two jobs.
  [[nodiscard]] double period_range_ms() const {
    return period_ms && period_ms->n > 0 ? period_ms->max - period_ms->min : kNoValue;
  }

  /// Whether the task had timestamps or samples in any repetition, but none of its jobs started.
  [[nodiscard]] bool never_ran() const { return results::never_ran(account); }
  /// Whether it never ran or, as a timer, waited for more than a period.
  [[nodiscard]] bool late() const { return never_ran() || (period > Duration{} && longest_wait > period); }
  /// Whether at most one of twenty jobs started, although the task's own work left time for more.
  [[nodiscard]] bool starved() const {
    return 20 * (account[Outcome::ran] + account[Outcome::running]) <= account.accounted() &&
           account.accounted() > 0 && busy_share < 0.5;
  }
};
/// The keys of a task in summary.json.
void fields(auto& visit, const TaskSummary& task) {
  const bool timer = task.kind == TaskKind::timer;
  visit("task", task.task);
  visit("kind", task.kind);
  visit("response_ms", task.response_ms);
  visit.ms("longest_wait_ms", task.longest_wait);
  visit("never_ran", task.never_ran());
  visit.if_any("response_authors_ms", task.response_authors_ms);
  visit.if_any("period_ms", task.period_ms);
  visit.if_any("period_deviation_ms", task.period_deviation_ms);
  for (const auto& [outcome, name] : enum_texts(Outcome{})) {
    const bool of_timers = outcome == Outcome::skipped;
    const bool of_subscriptions = outcome == Outcome::overwritten || outcome == Outcome::empty;
    if (timer ? !of_subscriptions : !of_timers) visit(name, task.account[outcome]);
  }
  if (!timer) return;
  visit.ms("deadline_ms", task.deadline);
  visit("deadline_overruns", task.after_warm_up.deadline_overruns);
  visit("after_warm_up", task.after_warm_up);
}

/// A task of one repetition whose loss equation does not hold.
struct Imbalance {
  std::uint32_t repetition = 0;
  std::string task;
  std::uint64_t accounted = 0;
  std::uint64_t expected = 0;
};
HOTPATH_FIELDS(Imbalance, repetition, task, accounted, expected);

/// A live repetition that something disturbed.
struct DisturbedRepetition {
  std::uint32_t repetition = 0;
  std::vector<std::string> marks;  ///< disturbances().
};
HOTPATH_FIELDS(DisturbedRepetition, repetition, marks);

/// Measures of one repetition. Losses include those of its warm-up.
struct RepetitionMeasures {
  std::uint32_t repetition = 0;
  std::uint64_t skipped = 0, overwritten = 0;
  std::uint64_t deadline_overruns = 0;  ///< Of timers.
  std::uint64_t never_ran = 0;          ///< Tasks of which no job started, although they had some.
  struct OfChain {
    std::size_t outputs = 0;
    double worst_hot_path_ms = kNoValue, worst_age_ms = kNoValue;
  };
  std::vector<OfChain> chains = {};  ///< In the summary's order.
  [[nodiscard]] std::uint64_t lost() const { return skipped + overwritten; }
};
HOTPATH_FIELDS(RepetitionMeasures, repetition, skipped, overwritten);

struct ExecutorSummary {
  std::string executor;
  std::string overload = {};  ///< Why a simulation of it did not reach its end; then it has no results.
  std::size_t repetitions = 0;
  std::uint64_t executed = 0;  ///< Callbacks that ran to their end.
  std::uint64_t skipped = 0;
  std::uint64_t overwritten = 0;
  std::vector<RepetitionMeasures> each;
  TimerCounts after_warm_up;  ///< Of all timers.
  std::uint64_t lost_records = 0;
  double cpu_per_callback_us = kNoValue;  ///< CPU time of all processes per executed callback.
  ProcessUsage usage;  ///< Summed over repetitions; the memory is the maximum over repetitions.
  std::vector<ChainSummary> chains;
  std::vector<TaskSummary> tasks;
  std::vector<DisturbedRepetition> disturbed;
  std::vector<Imbalance> unbalanced;  ///< Empty: the loss equations hold for every task of every repetition.

  /// Timestamps and samples that no job ever used.
  [[nodiscard]] std::uint64_t lost() const { return skipped + overwritten; }
  [[nodiscard]] double lost_percent() const { return percent_of(lost(), executed + lost()); }
  [[nodiscard]] std::size_t never_ran() const {
    return static_cast<std::size_t>(std::ranges::count_if(tasks, &TaskSummary::never_ran));
  }
};

struct Summary {
  Duration warm_up{};
  BootstrapOptions bootstrap;
  std::vector<ExecutorSummary> executors;  ///< In the order of the input.
};

/// A pure function of the records. All traces and accounts refer to `set`; the traces contain only
/// counted chain records (`counted_chains`), and those of an executor have different numbers.
[[nodiscard]] Summary summarize(const TaskSet& set, const std::vector<ExecutorRuns>& runs,
                                const SummaryOptions& options);

/// The tasks that starved: `Node/topic never ran`, or `Node/topic ran 3 of 300 times`.
[[nodiscard]] std::vector<std::string> starved(const ExecutorSummary& executor);

/// The content of summary.json. Suffixes of the keys name the units (`_ms`, `_us`, `_s`, `_kib`,
/// `_percent`) of all values below a key; unmeasured values are null.
void to_json(nlohmann::json& j, const Summary& summary);

}  // namespace hotpath::results

namespace hotpath {

void to_json(nlohmann::json& j, const Quantiles& quantiles);
void to_json(nlohmann::json& j, const Interval& interval);
HOTPATH_FIELDS(Estimate, value, interval);

}  // namespace hotpath
