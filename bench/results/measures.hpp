// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "hotpath/analysis/statistics.hpp"
#include "hotpath/core/accounting.hpp"
#include "hotpath/core/trace.hpp"
#include "program/json_record.hpp"
#include "results/schedule.hpp"

namespace hotpath::results {

/// Whether a timer's job exceeded its relative deadline. Subscriptions only inherit deadlines,
/// under EDF, and never overrun.
[[nodiscard]] inline bool overruns_deadline(const Task& task, Duration response) {
  return task.kind == TaskKind::timer && response > task.deadline;
}

/// The same for a job that may still wait or run at the end of the run.
[[nodiscard]] inline bool misses_deadline(const Task& task, const JobRecord& r, Time end) {
  if (r.outcome == Outcome::ran) return overruns_deadline(task, r.response_time());
  const bool unfinished = r.outcome == Outcome::queued || r.outcome == Outcome::running;
  return unfinished && overruns_deadline(task, end - r.job.timestamp);
}

/// The period jitter of one pair of consecutive jobs of a timer that ran: how far the distance of their
/// starts is from the period. A skipped timestamp between them adds a period to the distance.
[[nodiscard]] inline Duration period_deviation(const Task& timer, Duration start_to_start) {
  return std::chrono::abs(start_to_start - timer.period);
}

/// The distances between the starts of consecutive counted jobs of a timer in one repetition. Jobs that end
/// out of order wait for the earlier ones.
class StartDistances {
 public:
  /// Adds a job that ran, and passes on the distances that become known.
  void add(const JobRecord& r, bool counted, const auto& use) {
    const Started job{r.start, r.job.sequence + 1 + r.job.skipped, counted};
    if (waiting_.empty() && r.job.sequence <= next_) return take(job, use);
    waiting_.emplace(r.job.sequence, job);
    while (!waiting_.empty() && waiting_.begin()->first <= next_) take_first(use);
  }
  /// A job that still waits or runs at the end is left out.
  void end(const auto& use) {
    while (!waiting_.empty()) take_first(use);
  }

 private:
  struct Started {
    Time start;
    std::uint64_t next = 0;  // sequence of the next job
    bool counted = false;
  };
  void take_first(const auto& use) { take(waiting_.extract(waiting_.begin()).mapped(), use); }
  void take(const Started& job, const auto& use) {
    next_ = job.next;
    if (!job.counted) return;
    if (before_) use(job.start - *before_);
    before_ = job.start;
  }

  std::map<std::uint64_t, Started> waiting_;  // by sequence
  std::optional<Time> before_;
  std::uint64_t next_ = 0;
};

/// Whether the set has no subscriptions.
[[nodiscard]] inline bool timers_only(const TaskSet& set) {
  return std::ranges::count(set.tasks, TaskKind::subscription, &Task::kind) == 0;
}

/// Whether a job counts: it ran, and its timestamp is at or after the end of the warm-up.
[[nodiscard]] inline bool counts(const JobRecord& r, Time counted_from) {
  return r.outcome == Outcome::ran && r.job.timestamp >= counted_from;
}

/// The waiting time of a job: from its timestamp to its start, or to the end of the run if it is
/// still queued. If the wait began in the warm-up, only the part after the warm-up counts; it must
/// count, because a task that starves from the warm-up on has no later job. 0 for samples that were
/// never taken.
[[nodiscard]] inline Duration wait_of(const JobRecord& r, Time counted_from, Time end) {
  if (!r.started() && r.outcome != Outcome::queued) return Duration::zero();
  return std::max(Duration::zero(), (r.started() ? r.start : end) - std::max(r.job.timestamp, counted_from));
}

/// Share of a count in percent; 0 of nothing.
[[nodiscard]] inline double percent_of(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0 : 100 * static_cast<double>(part) / static_cast<double>(whole);
}

/// The outcomes of a timer's timestamps after the warm-up.
struct TimerCounts {
  std::uint64_t reached = 0;  ///< All timestamps, with any outcome.
  std::uint64_t ran = 0;
  std::uint64_t skipped = 0;
  std::uint64_t deadline_overruns = 0;  ///< misses_deadline().

  /// Adds a job of the timer `task` and the timestamps that its call skipped. The run ends at `end`.
  void add(const Task& task, const JobRecord& r, Time counted_from, Time end) {
    for (std::uint32_t k = 0; k <= r.job.skipped; ++k) {
      if (r.job.timestamp + k * task.period < counted_from) continue;
      ++reached;
      skipped += k > 0;
    }
    if (r.job.timestamp < counted_from) return;
    ran += r.outcome == Outcome::ran;
    deadline_overruns += misses_deadline(task, r, end);
  }

  TimerCounts& operator+=(const TimerCounts& other) {
    reached += other.reached;
    ran += other.ran;
    skipped += other.skipped;
    deadline_overruns += other.deadline_overruns;
    return *this;
  }

  /// Share of the reached timestamps that were skipped (the paper's *dropped jobs*); 0 without
  /// timestamps.
  [[nodiscard]] double dropped_percent() const { return percent_of(skipped, reached); }
};
void fields(auto& visit, const TimerCounts& part) {
  HOTPATH_VISIT(reached, ran, skipped, deadline_overruns)
  visit("dropped_percent", part.dropped_percent());
}

/// Samples in milliseconds.
struct Samples {
  /// None: not kept; then there are only their number, mean and extremes.
  std::optional<std::deque<double>> samples = std::deque<double>();
  double sum_ms = 0;  ///< Of samples that were not kept.
};

/// Samples and, after settle(), their quantiles. What a sample that is not kept changes stands together.
struct Distribution : Samples, Quantiles {
  using Quantiles::operator=;
  void add(Duration sample) {
    const double ms = to_ms(sample);
    if (samples) return samples->push_back(ms);
    ++n;
    if (!(ms >= min)) min = ms;  // also if there was none
    if (!(ms <= max)) max = ms;
    sum_ms += ms;
  }
  /// Adds the samples of a later repetition.
  void add(Distribution&& later) {
    if (later.samples) {
      if (samples->empty()) samples->swap(*later.samples);
      samples->insert(samples->end(), later.samples->begin(), later.samples->end());
    }
    if (later.n == 0) return;
    sum_ms = later.sum_ms + (n > 0 ? mean * static_cast<double>(n) : 0);
    n += later.n;
    min = std::fmin(min, later.min);
    max = std::fmax(max, later.max);
    mean = sum_ms / static_cast<double>(n);
  }
  void settle() {
    if (samples && !samples->empty()) *this = quantiles({samples->begin(), samples->end()});
    samples.reset();
  }
};

/// The measures of a task's jobs. `account` covers the whole run with its warm-up, like the loss equations;
/// the others exclude the warm-up. What each job changes takes few lines of the cache.
struct alignas(64) TaskMeasures {
  Duration longest_wait{};  ///< wait_of() of its jobs.
  TaskAccount account;
  Distribution response_ms;
  TimerCounts after_warm_up;  ///< Timers.
  /// Response time as the paper's authors measure it (their sensor.hpp): finish minus the timer's
  /// next call as read at the start, plus its period. Only for sets without subscriptions, where
  /// the trace determines it.
  Distribution response_authors_ms;
  /// Timers: time between the starts of consecutive counted jobs. Upstream divides it by the
  /// difference of the message numbers, which is 1 between executed jobs, so a skipped timestamp
  /// doubles the period.
  Distribution period_ms;
  Distribution period_deviation_ms;  ///< Timers: period_deviation() of the same pairs of jobs.

  [[nodiscard]] std::array<Distribution*, 4> distributions() {
    return {&response_ms, &response_authors_ms, &period_ms, &period_deviation_ms};
  }
  /// Adds a job of a repetition that ends at `end`; `counted`: counts() of it.
  void add(const Task& task, const JobRecord& r, bool counted, Time counted_from, Time end) {
    account.add(r);
    longest_wait = std::max(longest_wait, wait_of(r, counted_from, end));
    if (counted) response_ms.add(r.response_time());
    if (task.kind == TaskKind::timer) after_warm_up.add(task, r, counted_from, end);
  }
  void add_period(const Task& timer, Duration period) {
    period_ms.add(period);
    period_deviation_ms.add(period_deviation(timer, period));
  }
  /// Adds those of a later repetition.
  void add(TaskMeasures&& later) {
    auto& sum = account.count;
    std::ranges::transform(sum, later.account.count, sum.begin(), std::plus());
    after_warm_up += later.after_warm_up;
    longest_wait = std::max(longest_wait, later.longest_wait);
    const auto all = distributions(), more = later.distributions();
    for (std::size_t i = 0; i < all.size(); ++i) all[i]->add(std::move(*more[i]));
  }
};
/// The keys in summary.json.
void fields(auto& visit, const TaskMeasures& part, TaskKind kind, bool timers_only) {
  HOTPATH_VISIT(response_ms)
  visit.ms("longest_wait_ms", part.longest_wait);
  if (timers_only) visit("response_authors_ms", part.response_authors_ms);
  if (kind != TaskKind::timer) return;
  HOTPATH_VISIT(period_ms, period_deviation_ms, after_warm_up)
  visit("deadline_overruns", part.after_warm_up.deadline_overruns);
}

/// The measures of the jobs of one repetition, job by job: in 8 bytes per counted job, 16 more per counted
/// job of a timer, and 32 more in sets without subscriptions.
class JobMeasures {
 public:
  /// Without the samples (`keeps_samples`) there are no quantiles.
  JobMeasures(const TaskSet& set, Time counted_from, Time end, bool keeps_samples = true);

  void add(const JobRecord& job);
  /// Ends the repetition: the measures by task.
  [[nodiscard]] std::vector<TaskMeasures> result();

 private:
  const TaskSet& set_;
  const Time counted_from_, end_;
  std::vector<TaskMeasures> tasks_;
  std::vector<StartDistances> starts_;                       // by task
  std::optional<NextCalls> next_calls_;                      // for sets without subscriptions
  std::vector<std::vector<std::pair<Time, Time>>> counted_;  // with them: starts and finishes by task
};

/// The counted chain records of a run. The same rule holds for jobs and chains: a sample belongs to
/// the warm-up if its job's timestamp is before `counted_from`. A chain uses the sink's job. A record
/// without a recorded sink job counts, because buffers fill up only at the end of a run.
[[nodiscard]] inline std::vector<ChainRecord> counted_chains(const Trace& trace, Time counted_from) {
  std::unordered_map<TaskId, std::unordered_set<std::uint64_t>> early;  // by sink: sequences of the warm-up
  for (const ChainRecord& r : trace.chains) early[r.sink];
  for (const JobRecord& r : trace.jobs) {
    if (r.outcome != Outcome::ran || r.job.timestamp >= counted_from) continue;
    if (const auto sink = early.find(r.job.task); sink != early.end()) sink->second.insert(r.job.sequence);
  }
  std::vector<ChainRecord> counted = trace.chains;
  std::erase_if(counted, [&](const ChainRecord& r) { return early[r.sink].contains(r.sequence); });
  return counted;
}

/// The known latencies of a chain in ms, in the order of the records.
[[nodiscard]] inline std::vector<double> latencies_ms(const std::vector<ChainRecord>& records,
                                                      std::size_t chain, Latency of) {
  std::vector<double> samples;
  for (const ChainRecord& r : records) {
    const auto latency = r.latency(of);
    if (r.chain == chain && latency) samples.push_back(to_ms(*latency));
  }
  return samples;
}

/// The quantiles that judgements of latencies are about.
enum Judged : std::uint8_t { kMedian, kP99, kWorst };
constexpr auto enum_texts(Judged) { return texts_in_order<Judged>({"median", "p99", "worst"}); }
[[nodiscard]] constexpr const QuantileTraits& traits_of(Judged judged) {
  constexpr std::array kOf = {&Quantiles::p50, &Quantiles::p99, &Quantiles::max};
  return *std::ranges::find(kQuantiles, kOf[static_cast<std::size_t>(judged)], &QuantileTraits::of);
}

/// A latency in words, beside to_string(): in sentences, in tables of bounds and as their `kind`, and as the
/// beginning of a limit of `--require`.
struct LatencyWords {
  const char *phrase, *bound, *kind, *limit;
};
inline constexpr LatencyWords kLatencyWords[] = {{"age of the data", "end to end", "chain", "age"},
                                                 {"hot-path latency", "hot path", "hot_path", "latency"},
                                                 {"response time", "", "task", ""}};
[[nodiscard]] constexpr const LatencyWords& words_of(Latency latency) {
  return kLatencyWords[static_cast<std::size_t>(latency)];
}

/// Resource usage of a run from its first release to its stop, summed over its processes.
struct ProcessUsage {
  Duration cpu_time{};
  std::int64_t peak_memory_kib = 0;
  std::int64_t voluntary_switches = 0;
  std::int64_t involuntary_switches = 0;
  Duration stolen{};     ///< Time withheld by the hypervisor, summed over the run's CPUs.
  Duration throttled{};  ///< Time lost to a quota of CPU time or to overheating, likewise.
  Duration others{};     ///< CPU time of other processes, divided by the number of the run's CPUs.
  Duration wall{};

  /// A time in percent of the length.
  [[nodiscard]] double percent(Duration time) const {
    return 100.0 * static_cast<double>(time.count()) / static_cast<double>(wall.count());
  }
  /// Adds the usage of another run, except memory: the maximum counts.
  ProcessUsage& operator+=(const ProcessUsage& other) {
    using Usage = ProcessUsage;
    for (const auto time :
         {&Usage::cpu_time, &Usage::stolen, &Usage::throttled, &Usage::others, &Usage::wall})
      this->*time += other.*time;
    peak_memory_kib = std::max(peak_memory_kib, other.peak_memory_kib);
    voluntary_switches += other.voluntary_switches;
    involuntary_switches += other.involuntary_switches;
    return *this;
  }
};

/// What disturbed a repetition with this usage, by the counters of the kernel: a phrase for each of
/// `stolen`, `throttled` and `others` that exceeds its limit. A disturbed repetition is marked and
/// counts like any other.
[[nodiscard]] std::vector<std::string> disturbances(const ProcessUsage& usage);

/// Suffixes of the keys name the units.
void fields(auto& visit, program::MaybeConst<ProcessUsage> auto& part) {
  constexpr double kMost_ms = 9e8;  // ten days, so that the sum over 10000 repetitions does not overflow
  constexpr std::int64_t kMost = 1'000'000'000'000;
  visit.ms("cpu_time_ms", part.cpu_time, kMost_ms);
  visit.ms("wall_ms", part.wall, kMost_ms);
  visit("cpu_use_percent",
        part.wall > Duration() ? std::optional(part.percent(part.cpu_time)) : std::nullopt);
  visit.up_to(kMost, "peak_memory_kib", part.peak_memory_kib);
  visit.up_to(kMost, "voluntary_context_switches", part.voluntary_switches);
  visit.up_to(kMost, "involuntary_context_switches", part.involuntary_switches);
  visit.ms("stolen_ms", part.stolen, kMost_ms);
  visit.ms("throttled_ms", part.throttled, kMost_ms);
  visit.ms("others_ms", part.others, kMost_ms);
}

}  // namespace hotpath::results
