// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hotpath/core/timer.hpp"
#include "hotpath/core/trace.hpp"

namespace hotpath {

/// Finaliser of SplitMix64 (Steele, Lea, Flood 2014): every input bit reaches every output bit.
[[nodiscard]] constexpr std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15U;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31);
}

/// The work of jobs in virtual time: the simulator's counterpart of a live run's nodes. All calls
/// come from one thread; `now` never decreases.
///
/// A workload whose messages have content stores them per subscription under the sequence number
/// given to `delivered`, which equals `Job::sequence` of the job that takes the message. The
/// scheduler decides which messages are taken: each number ends in `overwritten`, in the `start` of
/// its job, or unread at the end of the run.
class Workload {
 public:
  virtual ~Workload() = default;

  /// `job` starts; returns its execution time until it publishes or ends, >= 0. Not called for empty
  /// events.
  virtual Duration start(const Job& job, Time now) = 0;

  /// When `job` ends among those that end at one instant. In a round the jobs end, in the order of their
  /// threads, and then threads take their next jobs. n > 0: in the n-th round of that instant which begins
  /// after its start; 0: as soon as its time has passed.
  [[nodiscard]] virtual std::uint32_t end_round(const Job& /*job*/) const { return 0; }

  /// `job` of `task` publishes, and ends unless rest() says otherwise; returns the subset of
  /// `task.feeds` to which it publishes now. The span is valid until the next finish().
  virtual std::span<const TaskId> finish(const Job& job, const Task& task, Time now) = 0;

  /// The execution time until the job of the last finish() publishes again or ends, >= 0; std::nullopt:
  /// it has ended.
  [[nodiscard]] virtual std::optional<Duration> rest() const { return std::nullopt; }

  /// The message published by job `parent` has reached `subscription` with number `sequence` (0, 1,
  /// ...). Messages of one publisher arrive in the order of publication.
  virtual void delivered(TaskId /*subscription*/, std::uint64_t /*sequence*/, const JobRef& /*parent*/) {}

  /// For exploration.hpp. A copy in the same state, which may share what it observes with this one; none: it
  /// is not explored.
  [[nodiscard]] virtual std::unique_ptr<Workload> clone() const { return nullptr; }
  /// Adds all that its later answers depend on, with the data that they hand on, but for the running jobs;
  /// and what those about `job` depend on, which runs.
  virtual void describe(StateWords& /*words*/) const {}
  virtual void describe(const Job& /*job*/, StateWords& /*words*/) const {}

  /// Message `sequence` of `subscription` was never taken; the message delivered next replaces it.
  virtual void overwritten(TaskId /*subscription*/, std::uint64_t /*sequence*/) {}
};

/// Source of delivery delays.
class Deliveries {
 public:
  virtual ~Deliveries() = default;
  /// How long sample `number` (0, 1, ... in the order of publication) of `subscription` is on its way at
  /// least: 0 to `longest`. Samples of one publisher do not overtake each other.
  [[nodiscard]] virtual Duration of(TaskId subscription, std::uint64_t number, Duration longest) const = 0;
};

/// Source of execution times.
class ExecutionTimes {
 public:
  virtual ~ExecutionTimes() = default;
  /// Execution time of `job`, >= 0; the same at every call.
  [[nodiscard]] virtual Duration of(const Job& job) const = 0;
  /// See Workload.
  [[nodiscard]] virtual std::uint32_t end_round(const Job& /*job*/) const { return 0; }
  /// When the jobs of timers with release_jitter become ready (Task::release_delays); none: at their
  /// timestamps.
  [[nodiscard]] virtual const ReleaseDelays* release_delays() const { return releases_.get(); }
  /// How long samples are on their way; none: as long as the platform says.
  [[nodiscard]] virtual const Deliveries* deliveries() const { return nullptr; }
  void set_releases(std::unique_ptr<const ReleaseDelays> releases) { releases_ = std::move(releases); }

 private:
  std::unique_ptr<const ReleaseDelays> releases_;
};

/// `set` with jobs that become ready as `times` says.
[[nodiscard]] TaskSet with_releases(TaskSet set, const ExecutionTimes& times);

/// Every job takes its task's WCET.
class WorstCaseTimes final : public ExecutionTimes {
 public:
  explicit WorstCaseTimes(const TaskSet& set);
  Duration of(const Job& job) const override { return wcet_[job.task]; }

 private:
  std::vector<Duration> wcet_;
};

/// Uniform in [BCET, WCET]. Depends only on seed, task and sequence, so neither the order of calls,
/// nor the executor, nor the number of threads affects the values.
class UniformTimes final : public ExecutionTimes {
 public:
  UniformTimes(const TaskSet& set, std::uint64_t seed);
  Duration of(const Job& job) const override;
  /// The job's pseudo-random number in [0, count); count in [1, 2^63].
  [[nodiscard]] std::uint64_t draw(const Job& job, std::uint64_t count) const;

 private:
  struct Range {
    std::int64_t bcet_ns;
    std::uint64_t count;
  };
  std::vector<Range> range_;
  std::uint64_t seed_;
};

/// Releases drawn uniformly from [0, release_jitter] after their timestamps; depends only on seed, task and
/// sequence.
class UniformReleases final : public ReleaseDelays {
 public:
  UniformReleases(const TaskSet& set, std::uint64_t seed);
  [[nodiscard]] Time due(JobRef job, Time timestamp) const override;

 private:
  std::vector<Duration> jitter_;
  std::uint64_t seed_;
};

/// How a job draws from the measured values of its task.
enum class Draw : std::uint8_t {
  independent,  ///< All values are equally likely.
  in_order,  ///< Cyclically in the measured order, which keeps correlations. The seed sets the start, at the
             ///< same fraction of the values for all tasks.
};

/// Draws from measured values; depends only on seed, task and sequence, like UniformTimes, which
/// serves tasks without values.
class MeasuredTimes final : public ExecutionTimes {
 public:
  /// The values of a task: nullptr for none, otherwise at least one, all >= 0.
  using Values = std::shared_ptr<const std::vector<Duration>>;
  /// `values` are parallel to the tasks.
  MeasuredTimes(const TaskSet& set, std::vector<Values> values, std::uint64_t seed,
                Draw draw = Draw::independent);
  Duration of(const Job& job) const override;

 private:
  std::vector<Values> values_;
  UniformTimes others_;
  Draw draw_;
  std::uint64_t place_;  // share of all values in 2^-64
};

/// The execution times (finish - start) of a trace. A job missing in the trace takes the time of
/// the last earlier job of its task, or else of the first; a task without jobs in the trace takes
/// its WCET.
class ReplayedTimes final : public ExecutionTimes {
 public:
  ReplayedTimes(const TaskSet& set, const Trace& trace);
  Duration of(const Job& job) const override;

 private:
  struct Measured {
    std::uint64_t sequence;
    Duration time;
  };
  std::vector<std::vector<Measured>> measured_;  // per task, by sequence
  std::vector<Duration> wcet_;
};

/// Every job runs for its execution time and publishes at its finish; messages have no content.
class PublishingWorkload final : public Workload {
 public:
  /// `times` must outlive the workload.
  explicit PublishingWorkload(const ExecutionTimes& times) : times_(times) {}
  Duration start(const Job& job, Time) override { return times_.of(job); }
  [[nodiscard]] std::uint32_t end_round(const Job& job) const override { return times_.end_round(job); }
  std::span<const TaskId> finish(const Job&, const Task& task, Time) override { return task.feeds; }
  [[nodiscard]] std::unique_ptr<Workload> clone() const override {
    return std::make_unique<PublishingWorkload>(*this);
  }

 private:
  const ExecutionTimes& times_;
};

}  // namespace hotpath
