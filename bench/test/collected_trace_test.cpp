// SPDX-License-Identifier: Apache-2.0
// The records of a run that ends early: its processes stop at different instants.
#include "live/collected_trace.hpp"

#include <gmock/gmock.h>

#include "graph_fixture.hpp"
#include "hotpath/core/accounting.hpp"
#include "hotpath/core/schedule_check.hpp"
#include "hotpath/reference_system/run_channel.hpp"

namespace hotpath::collected_trace_test {

using std::chrono::hours;
using std::chrono::milliseconds;
using ::testing::ElementsAre;

constexpr Time kEpoch = Time{} + hours(1);
constexpr Time kPlanned = kEpoch + milliseconds(400);

Time at(int ms) { return kEpoch + milliseconds(ms); }

JobRecord job(TaskId timer, std::uint64_t sequence, Time start, Outcome outcome) {
  JobRecord record;
  record.job.task = timer;
  record.job.sequence = sequence;
  record.job.timestamp = record.job.release = kEpoch + milliseconds(20) * static_cast<int>(sequence);
  record.outcome = outcome;
  if (outcome == Outcome::ran) record.start = start, record.finish = start + milliseconds(1);
  return record;
}

/// Of two timers of 20 ms, each in a process of its own.
class CollectedTrace : public ::testing::Test {
 protected:
  CollectedTrace() {
    plan.graph = &graph;
    plan.tasks = make_tasks(graph);
    plan.executor = setup::parse_executor("events-ro", {});
    plan.processes = 2;
    for (std::uint32_t p = 0; p < 2; ++p) memories.emplace_back(live::memory_size(plan, p));
  }

  /// Writes the records of a timer that runs at each timestamp before `stop`, and is queued from then on
  /// until the end of the run.
  void record(std::uint32_t process, Time stop, Time end) {
    RecordLog<JobRecord> log = memories[process].jobs().front();
    std::uint64_t next = 0;
    for (Time t = kEpoch; t < end; t += milliseconds(20), ++next) {
      log.append(job(process, next, t, t < stop ? Outcome::ran : Outcome::queued));
    }
  }

  /// The first rule of schedules, or the first loss equation, that the trace violates.
  std::string violation(const Trace& trace) const {
    ScheduleCheck check(plan.tasks.set, trace.epoch, trace.end, true);
    for (const JobRecord& r : trace.jobs) {
      if (std::string wrong = check.add(r); !wrong.empty()) return wrong;
    }
    return check.lost(expected_jobs(plan.tasks.set, trace));
  }

  const Graph graph = load(
      "name: g\nnodes:\n- {name: A, type: sensor, period_ms: 20}\n"
      "- {name: B, type: sensor, period_ms: 20}\n");
  live::Plan plan;
  std::deque<RunMemory> memories;
};

TEST_F(CollectedTrace, AProcessThatStopsLaterRunsJobsBehindTheFirstStop) {
  const Time first = at(95), last = at(130);  // the timers are due every 20 ms
  const Time end = live::end_of_run(std::max(first, last), kPlanned, memories);
  EXPECT_EQ(end, last);
  record(0, first, end);
  record(1, last, end);
  const Trace trace = live::collected_trace(plan, memories, kEpoch, end);
  EXPECT_EQ(violation(trace), "");
  EXPECT_EQ(trace.jobs.size(), 14U);
  EXPECT_EQ(std::ranges::count(trace.jobs, Outcome::ran, &JobRecord::outcome), 12);
  // With the first stop as the end, the jobs of the other process would start after the run.
  EXPECT_NE(violation(live::collected_trace(plan, memories, kEpoch, first)), "");
}

TEST_F(CollectedTrace, ARunThatEndsEarlyEndsBehindTheLastStart) {
  RecordLog<JobRecord> log = memories[1].jobs().front();
  log.append(job(1, 0, at(51), Outcome::ran));
  EXPECT_EQ(live::end_of_run(at(50), kPlanned, memories), at(51) + Duration(1));
  EXPECT_EQ(live::end_of_run(at(60), kPlanned, memories), at(60));
}

TEST_F(CollectedTrace, APlannedEndStays) {
  // The thread decided for the job before the end, and lost the processor until after it.
  const Time start = kPlanned + milliseconds(3);
  record(0, kPlanned, kPlanned);
  RecordLog<JobRecord> log = memories[1].jobs().front();
  for (std::uint64_t i = 0; i < 19; ++i) log.append(job(1, i, at(20 * static_cast<int>(i)), Outcome::ran));
  JobRecord late = job(1, 19, start, Outcome::ran);
  late.finish = start;
  late.cpu_time = milliseconds(1);
  log.append(late);
  EXPECT_EQ(live::end_of_run(kPlanned, kPlanned, memories), kPlanned);
  const Trace trace = live::collected_trace(plan, memories, kEpoch, kPlanned);
  EXPECT_EQ(trace.end, kPlanned);
  EXPECT_EQ(trace.jobs.back().outcome, Outcome::running);
  EXPECT_EQ(trace.jobs.back().cpu_time, Duration(-1)) << "some of it from after the run";
  EXPECT_EQ(violation(trace), "");
}

/// What RunLife asks of a process's system.
struct FakeSystem {
  Time stopped{};
  std::vector<Time> closed;

  void wait_until_matched(Time) {}
  void start(Time, Time end) { stopped = end; }
  void stop() {}
  [[nodiscard]] std::vector<WorkerThread> workers() const { return {}; }
  [[nodiscard]] Time join() const { return stopped; }
  void close(Time end) { closed.push_back(end); }
};

/// The instants until which a process that stops at `stop` records what is unfinished, if the coordinator
/// says that the run ended at `end`. Without `leave`, the coordinator then vanishes.
std::vector<Time> closed_at(Time stop, Time end, bool leave = true) {
  using Kind = ChannelMessage::Kind;
  auto [coordinator, process] = Channel::make_pair();
  FakeSystem system;
  coordinator.send({Kind::begin, {to_ns(stop), to_ns(stop)}});
  coordinator.send({Kind::settle, {to_ns(end)}});
  if (leave) coordinator.send(Kind::leave);
  if (!leave) coordinator = Channel();
  RunLife(process).live_through(system, stop, [] {});
  return system.closed;
}

TEST(RunLife, EveryProcessRecordsWhatIsUnfinishedUntilTheEndOfTheRun) {
  const Time stop = Time{} + milliseconds(5), end = stop + milliseconds(7);  // long ago: nothing waits
  EXPECT_THAT(closed_at(stop, end), ElementsAre(end));
  EXPECT_THAT(closed_at(stop, stop - milliseconds(1)), ElementsAre(stop));
  EXPECT_THROW(closed_at(stop, end, false), CoordinatorGone) << "it keeps its writers until all are done";
}

}  // namespace hotpath::collected_trace_test
