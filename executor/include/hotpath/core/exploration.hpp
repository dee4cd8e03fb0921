// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/core/platform.hpp"
#include "hotpath/core/workload.hpp"

namespace hotpath {

/// A system that is not explored, or whose exploration ended early; the message says why.
struct ExplorationRefused : std::runtime_error {
  enum class Why : std::uint8_t { not_covered, states, stopped };
  explicit ExplorationRefused(const std::string& text, Why reason = Why::not_covered)
      : std::runtime_error(text), why(reason) {}
  Why why;
};

/// Adds the publication of a job, which a workload with unread samples of it describes for
/// ExplorationOptions::publications, and which of the instants before it is the same.
void describe_publication(JobRef job, StateWords& words);

/// What one instant of an exploration stands for: all schedules that reach it by the same decisions.
class ExploredInstant {
 public:
  virtual ~ExploredInstant() = default;
  /// From the start of the job `from` to that of `to`. Without `from`: from time 0 on; without `to`: up to
  /// this instant. Both are jobs of ExplorationOptions::tracked, `to` ends at this instant, and a message in
  /// the system has data of `from`. Or `from` is the publication of a job: from its end on, while its sample
  /// is unread, or taken by a job that has not published yet.
  struct Span {
    JobInstant from{}, to{};
  };
  /// The span in the schedule in which it takes longest.
  [[nodiscard]] virtual Duration longest(const Span& span) const = 0;
  /// Makes a schedule in which each of the spans takes at least so long the witness of `slot`, below
  /// ExplorationOptions::witnesses; otherwise without effect. `at_least` is at most longest() of each, and
  /// all spans have one end, so that such a schedule exists.
  virtual void keep(std::size_t slot, std::span<const Span> spans, Duration at_least) = 0;
  void keep_longest(std::size_t slot, const Span& span) { keep(slot, {&span, 1}, longest(span)); }
  /// The instant, in the schedule in which it comes last.
  [[nodiscard]] Time latest() const { return Time{} + longest({}); }
};

class ExplorationObserver {
 public:
  virtual ~ExplorationObserver() = default;
  /// What became of a job, as JobSink::ended() is told. Of the instants in `record`, only the timestamp of a
  /// timer's job is that of all schedules.
  virtual void ended(const JobRecord& record, ExploredInstant& instant) = 0;
  /// The workload's finish() of the job that ended last is done.
  virtual void published(ExploredInstant& /*instant*/) {}
};

struct ExplorationOptions {
  Platform platform;
  std::vector<bool> tracked;  ///< By task: its jobs' starts matter to longest(). Empty: none does.
  bool publications = false;  ///< Keeps what longest() needs of publications, if the workload describes them.
  std::size_t max_states = 100'000;
  std::function<std::string()> stop = nullptr;  ///< Asked now and then: why to give up; empty: go on.
  std::size_t witnesses = 0;  ///< Slots for schedules; with any, it needs several times the memory.
};

/// One of the explored schedules, up to an instant. Only its execution times and the delays of releases and
/// samples are free, and the order of ends at one instant; all else follows.
struct Witness {
  struct Started {
    TaskId task;
    Duration time;
    std::uint32_t end_round = 0;  ///< See Workload.
  };
  std::vector<Started> jobs;  ///< Those that take time, in the order of their starts.
  /// Of the jobs of timers with release_jitter, by timer in the order of their timestamps.
  std::vector<std::pair<TaskId, Duration>> delays;
  /// How long samples were on their way, by subscription in the order of publication. Empty without delivery.
  std::vector<std::pair<TaskId, Duration>> deliveries;
  Time instant{};
};

/// What a schedule fixes of a job.
struct GivenJob {
  std::optional<Duration> time;            ///< How long it works.
  std::optional<Duration> delay;           ///< From its timestamp until it is ready; of timers.
  std::optional<std::uint32_t> end_round;  ///< See Workload.
  /// How long the sample of this number is on its way, in the order of publication; of subscriptions.
  std::optional<Duration> delivery;
};
using GivenJobs = std::map<std::pair<TaskId, std::uint64_t>, GivenJob>;  ///< By task and sequence.

/// The execution times and releases of a witness, for one simulation of the explored system; later jobs take
/// the worst case, and become ready as late as possible.
class WitnessTimes final : public ExecutionTimes, public ReleaseDelays, public Deliveries {
 public:
  /// The arguments must outlive it.
  WitnessTimes(const TaskSet& set, const Witness& witness);
  /// A job is asked for when it starts. Throws std::logic_error if the simulated system is another one.
  [[nodiscard]] Duration of(const Job& job) const override;
  [[nodiscard]] std::uint32_t end_round(const Job& job) const override;
  [[nodiscard]] Time due(JobRef job, Time timestamp) const override;
  [[nodiscard]] Duration of(TaskId subscription, std::uint64_t number, Duration longest) const override;
  [[nodiscard]] const ReleaseDelays* release_delays() const override { return this; }
  [[nodiscard]] const Deliveries* deliveries() const override {
    return witness_.deliveries.empty() ? nullptr : this;
  }
  /// What it has given so far, and all deliveries.
  [[nodiscard]] const GivenJobs& given() const { return given_; }

 private:
  const TaskSet& set_;
  const Witness& witness_;
  mutable std::vector<std::deque<Duration>> delays_left_;  // by task
  mutable std::size_t started_ = 0;                        // of the witness's jobs
  mutable GivenJobs given_;
};

struct ExplorationResult {
  std::size_t states = 0;
  std::vector<std::optional<Witness>> witnesses;  ///< By slot.
  /// Why it ended early: the observer met some of the schedules only.
  std::optional<ExplorationRefused> ended_early;
};

/// Meets every schedule of `set` for the phases that it has, any execution times between `bcet` and `wcet`,
/// any releases up to `release_jitter` after their timestamps, and any delivery that takes up to the
/// platform's delay, from 0 on for ever, at least once, and no other: until no state appears that has not
/// been met, shifted by hyperperiods. What a job does, and how long it takes, is that of the simulator (see
/// simulation.hpp), which this drives: with the longest execution time, of which the shorter ones are parts.
///
/// Between two timestamps of timers the decisions of one executor thread do not depend on the time. A state
/// therefore has, in place of the end of its running job, all ends that lie between two timestamps, as a
/// Zone together with the starts of the jobs whose data it holds; each zone is split at timestamps, and
/// states that are equal but for their zones are joined where the union is a zone. The release of a timer
/// with jitter is a coordinate from its timestamp until it happens. (After Nasri and Brandenburg 2017, "An
/// Exact and Sustainable Analysis of Non-Preemptive Scheduling".)
///
/// Several executor threads, each with a core, have a coordinate each for the end of their jobs; nothing else
/// may take time then. Jobs that end at one instant end in any number of rounds (Workload::end_round()), and
/// before or after a timer wakes a thread there.
///
/// `scheduler` and `workload` must have a clone(). Timers with release_jitter must have HeldReleases as their
/// release_delays. `workload` takes the longest execution times. Throws
/// ExplorationRefused for what is not covered.
ExplorationResult explore(const TaskSet& set, const Scheduler& scheduler, const Workload& workload,
                          const ExplorationOptions& options, ExplorationObserver& observer);

}  // namespace hotpath
