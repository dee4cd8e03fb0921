// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hotpath/core/state_words.hpp"
#include "hotpath/core/trace.hpp"

namespace hotpath {

/// What jobs do, in virtual time: the simulator's counterpart of the nodes of a live run. All calls come from
/// one thread; `now` never decreases.
///
/// A workload whose messages have content keeps them per subscription by the number that `delivered` gives,
/// which is `Job::sequence` of the job that takes the message. Which messages are ever taken is the
/// scheduler's business: each number meets either `overwritten` or the `start` of its job, or the end.
class Workload {
 public:
  virtual ~Workload() = default;

  /// `job` starts; returns its execution time, >= 0. Not called for empty events.
  virtual Duration start(const Job& job, Time now) = 0;

  /// `job` of `task` finishes; returns the subscriptions that it publishes to, of those in `task.feeds`. The
  /// span is valid until the next finish().
  virtual std::span<const TaskId> finish(const Job& job, const Task& task, Time now) = 0;

  /// The message that job `parent` published has reached `subscription`, as its number `sequence` (0, 1,
  /// ...). Messages of one publisher arrive in the order of their publication.
  virtual void delivered(TaskId subscription, std::uint64_t sequence, JobRef parent) {
    static_cast<void>(subscription);
    static_cast<void>(sequence);
    static_cast<void>(parent);
  }

  /// For exploration.hpp. A copy in the same state, which may share what it observes with this one; none: it
  /// is not explored.
  [[nodiscard]] virtual std::unique_ptr<Workload> clone() const { return nullptr; }
  /// Adds all that its later answers depend on, with the data that they hand on.
  virtual void describe(StateWords& words) const { static_cast<void>(words); }

  /// Message `sequence` of `subscription` gives way, untaken, to the one whose delivery is reported next.
  virtual void overwritten(TaskId subscription, std::uint64_t sequence) {
    static_cast<void>(subscription);
    static_cast<void>(sequence);
  }
};

/// How long jobs take.
class ExecutionTimes {
 public:
  virtual ~ExecutionTimes() = default;
  /// Execution time of `job`, >= 0; the same at every call.
  [[nodiscard]] virtual Duration of(const Job& job) const = 0;
};

/// Every job takes its task's WCET.
class WorstCaseTimes final : public ExecutionTimes {
 public:
  explicit WorstCaseTimes(const TaskSet& set);
  Duration of(const Job& job) const override { return wcet_[job.task]; }

 private:
  std::vector<Duration> wcet_;
};

/// Uniform in [BCET, WCET]. A function of seed, task and sequence alone, so that the order of calls, and with
/// it executor and number of threads, do not matter.
class UniformTimes final : public ExecutionTimes {
 public:
  UniformTimes(const TaskSet& set, std::uint64_t seed);
  Duration of(const Job& job) const override;
  /// The number in [0, count) that a job draws; count in [1, 2^63].
  [[nodiscard]] std::uint64_t draw(const Job& job, std::uint64_t count) const;

 private:
  struct Range {
    std::int64_t bcet_ns;
    std::uint64_t count;
  };
  std::vector<Range> range_;
  std::uint64_t seed_;
};

/// How a job takes one of its task's measured values.
enum class Draw : std::uint8_t {
  independent,  ///< Each as likely as any other.
  in_order,     ///< One after the other as they were measured, round and round, so that what hangs together
                ///< stays so. The seed decides where, for all tasks at the same share of their values.
};

/// Drawn from measured values; a function of seed, task and sequence alone, as UniformTimes, which tasks
/// without values take.
class MeasuredTimes final : public ExecutionTimes {
 public:
  /// The values of a task: nullptr for none, else at least one, all >= 0.
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

/// The execution times (finish - start) of a trace. A job that the trace lacks takes the time of the last
/// earlier job of its task there, or else of the first; a task without any job there takes its WCET.
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

/// Every job runs for its time and publishes at its finish; messages have no content.
class PublishingWorkload final : public Workload {
 public:
  /// `times` must outlive the workload.
  explicit PublishingWorkload(const ExecutionTimes& times) : times_(times) {}
  Duration start(const Job& job, Time) override { return times_.of(job); }
  std::span<const TaskId> finish(const Job&, const Task& task, Time) override { return task.feeds; }

 private:
  const ExecutionTimes& times_;
};

}  // namespace hotpath
