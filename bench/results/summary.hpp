// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <iosfwd>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/analysis/statistics.hpp"
#include "hotpath/core/accounting.hpp"
#include "hotpath/core/trace.hpp"
#include "program/json_record.hpp"
#include "results/measures.hpp"

// nlohmann's library finds these functions by argument-dependent lookup, also for elements of
// vectors and optionals: each stands in the namespace of its type.
namespace hotpath {

inline void to_json(nlohmann::json& j, const Interval& interval) { j = {interval.low, interval.high}; }
HOTPATH_FIELDS(Estimate, value, interval);
HOTPATH_FIELDS(BootstrapOptions, confidence, resamples, seed);
void fields(auto& visit, const Quantiles& part) {
  HOTPATH_VISIT(n, mean)
  for (const QuantileTraits& traits : kQuantiles) visit(traits.key, part.*traits.of);
}

}  // namespace hotpath

namespace hotpath::results {

/// One finished run of one executor.
struct Repetition {
  Trace trace;
  ProcessUsage usage;
  std::vector<std::uint64_t> expected;      ///< expected_jobs(set, trace); empty if it was overloaded.
  std::vector<TaskMeasures> measures = {};  ///< Of jobs that the trace does not keep, by task.
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
  std::array<std::optional<Estimate>, enum_texts(Judged{}).size()> to_default = {};
  std::optional<Estimate> median_minus_default = {};  ///< Difference of the medians in milliseconds.

  [[nodiscard]] Estimate estimate(double Quantiles::*of) const {
    if (std::isnan(low.*of)) return {quantiles.*of, std::nullopt};
    return {quantiles.*of, Interval{low.*of, high.*of}};
  }
};
void fields(auto& visit, const LatencySummary& part) {
  fields(visit, part.quantiles);
  std::map<std::string, std::optional<Interval>> intervals;
  for (const QuantileTraits& traits : kQuantiles)
    if (traits.has_interval) intervals[traits.key] = part.estimate(traits.of).interval;
  visit("interval", intervals);
}

struct ChainSummary {
  std::string chain;
  LatencySummary end_to_end;  ///< The age of the data when the output is there.
  LatencySummary hot_path;    ///< The paper's metric: from the start of the latest source's job.
  Distribution interval_ms;   ///< Between the finishes of consecutive outputs of a repetition.
  Distribution disparity_ms;  ///< Spread of the sources' timestamps in one output.
  std::uint64_t drops = 0;    ///< Samples lost before the counted outputs (upstream's `hot path drops`).

  [[nodiscard]] const LatencySummary& latency(Latency of) const {
    return of == Latency::age ? end_to_end : hot_path;
  }
  /// Adds the outputs of the chain in one repetition.
  void add(const std::vector<const ChainRecord*>& outputs) {
    std::vector<Time> finishes;
    for (const ChainRecord* const r : outputs) {
      drops += r->dropped;
      if (r->disparity.count() >= 0) disparity_ms.add(r->disparity);
      if (r->finish != kNever) finishes.push_back(r->finish);
    }
    std::ranges::sort(finishes);
    for (std::size_t k = 1; k < finishes.size(); ++k) interval_ms.add(finishes[k] - finishes[k - 1]);
  }
  /// Ends the adding of repetitions.
  void settle() {
    interval_ms.settle();
    disparity_ms.settle();
  }
};
void fields(auto& visit, const ChainSummary& part) {
  const LatencySummary &hot_path = part.hot_path, &age = part.end_to_end;
  const auto ratios = [](const LatencySummary& of, auto... which) {
    return nlohmann::json{{which == kMedian ? "median" : traits_of(which).key, of.to_default[which]}...};
  };
  HOTPATH_VISIT(chain, disparity_ms)
  visit("hot_path_latency_ms", hot_path);
  visit("end_to_end_latency_ms", age);
  visit("hot_path_drops", part.drops);
  visit("output_interval_ms", part.interval_ms);
  visit("ratio_to_default", ratios(hot_path, kMedian, kWorst));
  visit("difference_to_default_ms", nlohmann::json{{"median", hot_path.median_minus_default}});
  visit("end_to_end_ratio_to_default", ratios(age, kMedian, kP99, kWorst));
}

/// Whether a task had timestamps or samples, but none of its jobs started.
[[nodiscard]] inline bool never_ran(const TaskAccount& account) {
  return account[Outcome::ran] + account[Outcome::running] == 0 && account.accounted() > 0;
}

struct TaskSummary : TaskMeasures {
  std::string task;
  TaskKind kind = TaskKind::timer;
  bool timers_only = false;  ///< The set has no subscriptions.
  Duration period{};         ///< Timers.
  Duration deadline{};       ///< Timers: relative.
  double busy_share = 0;     ///< Of the runs' time, if each of its jobs takes its worst case.

  /// How much the distance of the starts varies, from the least to the greatest; NaN without two jobs.
  [[nodiscard]] double period_range_ms() const { return period_ms.max - period_ms.min; }

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
void fields(auto& visit, const TaskSummary& part) {
  HOTPATH_VISIT(task, kind)
  fields(visit, part, part.kind, part.timers_only);
  visit("never_ran", part.never_ran());
  const bool timer = part.kind == TaskKind::timer;
  for (const auto& [outcome, name] : enum_texts(Outcome{})) {
    const bool of_timers = outcome == Outcome::skipped;
    const bool of_subscriptions = outcome == Outcome::overwritten || outcome == Outcome::empty;
    if (timer ? !of_subscriptions : !of_timers) visit(name, part.account[outcome]);
  }
  if (timer) visit.ms("deadline_ms", part.deadline);
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

/// Timestamps and samples that no job ever used, also of the warm-up.
struct Losses {
  std::uint64_t skipped = 0, overwritten = 0;

  [[nodiscard]] std::uint64_t lost() const { return skipped + overwritten; }
  void add(const TaskAccount& account) {
    skipped += account[Outcome::skipped];
    overwritten += account[Outcome::overwritten];
  }
};

/// Measures of one repetition.
struct RepetitionMeasures : Losses {
  std::uint32_t repetition = 0;
  std::uint64_t deadline_overruns = 0;  ///< Of timers.
  std::uint64_t never_ran = 0;          ///< Tasks of which no job started, although they had some.
  struct OfChain {
    std::size_t outputs = 0;
    double worst_hot_path_ms = kNoValue, worst_age_ms = kNoValue;
  };
  std::vector<OfChain> chains = {};  ///< In the summary's order.
};
HOTPATH_FIELDS(RepetitionMeasures, repetition, skipped, overwritten);

struct ExecutorSummary : Losses {
  std::string executor;
  std::string overload = {};  ///< Why a simulation of it did not reach its end; then it has no results.
  std::size_t repetitions = 0;
  std::uint64_t executed = 0;  ///< Callbacks that ran to their end.
  std::vector<RepetitionMeasures> each;
  TimerCounts after_warm_up;  ///< Of all timers.
  std::uint64_t lost_records = 0;
  double cpu_per_callback_us = kNoValue;  ///< CPU time of all processes per executed callback.
  ProcessUsage usage;  ///< Summed over repetitions; the memory is the maximum over repetitions.
  std::vector<ChainSummary> chains;
  std::vector<TaskSummary> tasks;
  std::vector<DisturbedRepetition> disturbed;
  std::vector<Imbalance> unbalanced;  ///< Empty: the loss equations hold for every task of every repetition.

  [[nodiscard]] double lost_percent() const { return percent_of(lost(), executed + lost()); }
  [[nodiscard]] std::size_t never_ran() const {
    return static_cast<std::size_t>(std::ranges::count_if(tasks, &TaskSummary::never_ran));
  }
  /// The largest sample of all tasks; NaN: there is none.
  [[nodiscard]] double worst(Distribution TaskMeasures::*of) const {
    double worst = kNoValue;
    for (const TaskSummary& task : tasks) worst = std::fmax(worst, (task.*of).max);
    return worst;
  }
  /// Ends the adding of repetitions: what follows from the measures of the tasks and the usage.
  void settle() {
    for (const TaskSummary& task : tasks) {
      executed += task.account[Outcome::ran];
      add(task.account);
      after_warm_up += task.after_warm_up;
    }
    if (executed > 0 && usage.wall > Duration{})  // a simulation uses no CPU time
      cpu_per_callback_us = static_cast<double>(usage.cpu_time.count()) / 1e3 / static_cast<double>(executed);
  }
};

/// The tasks that starved: `Node/topic never ran`, or `Node/topic ran 3 of 300 times`.
[[nodiscard]] std::vector<std::string> starved(const ExecutorSummary& executor);

void fields(auto& visit, const ExecutorSummary& part) {
  HOTPATH_VISIT(executor, repetitions, skipped, overwritten, after_warm_up, lost_records, cpu_per_callback_us,
                usage, chains, tasks, disturbed, overload)
  visit("callbacks_executed", part.executed);
  visit("losses", part.each);
  visit("deadline_overruns", part.after_warm_up.deadline_overruns);
  visit("starved", starved(part));
  visit("loss_equations", nlohmann::json{{"hold", part.unbalanced.empty()}, {"unbalanced", part.unbalanced}});
}

struct Summary {
  Duration warm_up{};
  BootstrapOptions bootstrap;
  std::vector<ExecutorSummary> executors;  ///< In the order of the input.
};

/// A pure function of the records. All traces refer to `set`; the traces contain only
/// counted chain records (`counted_chains`), and those of an executor have different numbers.
[[nodiscard]] Summary summarize(const TaskSet& set, const std::vector<ExecutorRuns>& runs,
                                const SummaryOptions& options);

/// For each chain with known ages the sentences that a person would say first: under which executor the data
/// is youngest by the 99th percentile of its age, compared with `default` or else with the next best, at what
/// price, and how sure that is; before them the executors that cannot keep up. Executors that starve a task,
/// or that give fewer than 19 of 20 outputs of another one, cannot win.
[[nodiscard]] std::vector<std::string> verdict(const Summary& summary);

/// The tables of a page: title, columns and rows of each that has rows.
[[nodiscard]] nlohmann::json tables(const Summary& summary);

enum class Detail { short_answer, all };

/// Writes the verdict(), then for each chain a table of the ages with a row per executor, each interval below
/// its value; with `all` also its outputs, all jobs and the least regular timers. A graph without chains has
/// a table of jobs. At most ten tasks per executor follow: those starved(), those that never ran, and timers
/// with a job that waited longer than the period; then what could mislead, such as a broken loss equation.
/// Plain ASCII, at most 120 columns if executor names have at most 9 characters and latencies are below 1 s.
/// `-`: not measured.
void write_table(std::ostream& out, const Summary& summary, Detail detail = Detail::all);

/// The content of summary.json. Suffixes of the keys name the units (`_ms`, `_us`, `_s`, `_kib`,
/// `_percent`) of all values below a key; unmeasured values are null.
void fields(auto& visit, const Summary& part) {
  HOTPATH_VISIT(bootstrap, executors)
  visit("version", HOTPATH_VERSION);
  visit("warm_up_s", to_ms(part.warm_up) / 1e3);
  visit("verdict", verdict(part));
  visit("tables", tables(part));
}

}  // namespace hotpath::results
