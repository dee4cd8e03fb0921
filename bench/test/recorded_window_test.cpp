// SPDX-License-Identifier: Apache-2.0
// What the recorded jobs of a window tell: costs, preemption, decisions, timestamps and early
// publications.
#include "import/recorded_window.hpp"

#include <gmock/gmock.h>

#include "hotpath/core/registry.hpp"
#include "import/recorded_steps.hpp"
#include "import/recorded_trace.hpp"

namespace hotpath {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;

/// A recording, callback by callback: callback c is task c.
struct Recorded {
  tracing::System system;
  imports::RecordedGraph graph;
  std::vector<tracing::Job> jobs;
  std::vector<JobRecord> records;

  Recorded() { graph.tasks.set.groups.clear(); }

  /// A task in a callback group of its own, or in that of the task before it.
  void task(TaskKind kind, Duration period = {}, bool same_group = false) {
    TaskSet& set = graph.tasks.set;
    Task& task = set.tasks.emplace_back();
    task.kind = kind;
    task.period = task.deadline = period;
    if (!same_group) set.groups.push_back(CallbackGroup::mutually_exclusive);
    task.group = static_cast<std::uint32_t>(set.groups.size() - 1);
    tracing::Callback& callback = system.callbacks.emplace_back();
    callback.kind =
        kind == TaskKind::timer ? tracing::CallbackKind::timer : tracing::CallbackKind::subscription;
    callback.period = period;
    graph.task_of.push_back(set.size() - 1);
    graph.callback_of.push_back(set.size() - 1);
  }

  /// Each thread has a processor of its own, unless they share processor 0.
  tracing::Job& job(TaskId task, std::uint32_t thread, Duration ready, Duration start, Duration finish,
                    bool shared = false) {
    tracing::Job& job = jobs.emplace_back();
    job.ref = {task, 0};
    job.thread = thread;
    job.processor = shared ? 0 : static_cast<std::int32_t>(thread);
    job.start = Time{} + start;
    job.finish = Time{} + finish;
    job.started = 2 * jobs.size();
    job.finished = 1000 + job.started;
    JobRecord& record = records.emplace_back();
    record.job.task = task;
    record.job.timestamp = Time{} + ready;
    return job;
  }

  imports::RecordedWindow window() const { return {jobs, records}; }
};

TEST(RecordedDisplacement, OnlyTheInnermostJobHadTheProcessor) {
  Recorded r;
  r.system.threads.resize(3);
  for (int i = 0; i < 3; ++i) r.task(TaskKind::timer, 100ms);
  r.job(0, 0, 0ms, 0ms, 10ms, true);
  r.job(1, 1, 2ms, 2ms, 8ms, true);
  r.job(2, 2, 3ms, 3ms, 4ms, true);
  EXPECT_THAT(imports::recorded_displacement(r.system, r.window()).own, ElementsAre(4ms, 5ms, 1ms));
}

TEST(RecordedCosts, AReleaserWakesTheThreadOfItsTimer) {
  Recorded r;
  r.task(TaskKind::timer, 10ms);
  for (int i = 0; i < 3; ++i) r.job(0, 0, i * 10ms, i * 10ms + 100us, i * 10ms + 1ms);
  const imports::RecordedExecutor executor{"e", 0, {0}};
  const auto wake_up = [&](const char* name) {
    return imports::recorded_costs(r.graph, r.window(), executor, *find_executor(name)).wake_up.median;
  };
  EXPECT_EQ(wake_up("default"), 100us);
  EXPECT_EQ(wake_up("rm-ro"), 50us) << "two wake-ups";
}

/// Jobs of a timer that start 1 us after the job before them, and of a subscription after 5 us.
TEST(RecordedCosts, DispatchByKindNeedsEnoughJobs) {
  for (const int jobs : {90, 110}) {
    Recorded r;
    r.task(TaskKind::timer, 1ms);
    r.task(TaskKind::subscription);
    Duration at{};
    for (int i = 0; i < jobs; ++i) {
      r.job(0, 0, 0ms, at + 1us, at + 100us);
      r.job(1, 0, 0ms, at + 105us, at + 200us);
      at += 200us;
    }
    r.job(1, 0, 0ms, at + 5us, at + 100us);  // so that most dispatches are of subscriptions
    r.job(1, 0, 0ms, at + 105us, at + 200us);
    const auto costs =
        imports::recorded_costs(r.graph, r.window(), {"e", 0, {0}}, *find_executor("events-ro"));
    EXPECT_EQ(costs.dispatch.median, 5us);
    EXPECT_EQ(costs.dispatch_of(TaskKind::subscription).median, 5us);
    EXPECT_EQ(costs.dispatch_of(TaskKind::timer).median, jobs < 100 ? 5us : 1us);
  }
}

TEST(RecordedCosts, WaitingForACallbackGroupIsNoCost) {
  for (const bool same_group : {false, true}) {
    Recorded r;
    r.task(TaskKind::timer, 10ms);
    r.task(TaskKind::timer, 10ms, same_group);
    r.job(1, 1, 0ms, 0ms, 500us);
    r.job(0, 0, 500us, 600us, 5ms);
    r.job(1, 1, 1ms, 5050us, 6ms);
    const imports::RecordedExecutor executor{"e", 0, {0, 1}};
    const auto costs = imports::recorded_costs(r.graph, r.window(), executor, *find_executor("multi"));
    EXPECT_EQ(costs.wake_up.n, same_group ? 0U : 1U);
  }
}

TEST(RecordedSteps, ATaskWhoseGroupIsBusyContestsNothing) {
  for (const bool same_group : {false, true}) {
    Recorded r;
    r.task(TaskKind::timer, 100ms);
    r.task(TaskKind::timer, 100ms, same_group);
    r.task(TaskKind::timer, 100ms);
    r.job(0, 0, 0ms, 0ms, 10ms);
    r.job(2, 1, 4ms, 5ms, 6ms);
    r.job(1, 0, 3ms, 11ms, 12ms);
    const auto steps = imports::recorded_steps(r.graph, r.window(), {}, {"e", 0, {0, 1}}, 10);
    ASSERT_EQ(steps.starts, 3U);
    for (const imports::RecordedStep& step : steps.steps) {
      if (step.kind != imports::RecordedStep::Kind::start) continue;
      EXPECT_EQ(step.contested, step.task == 2 && !same_group) << "task " << step.task;
    }
  }
}

TEST(RecordedSteps, SamplesInheritTheDeadlineOfTheTimerThatCausedThem) {
  Recorded r;
  r.task(TaskKind::timer, 10ms);
  r.task(TaskKind::subscription);
  r.job(0, 0, 2ms, 2ms, 3ms);
  for (const std::uint32_t parent : {0U, imports::kNone}) {
    tracing::Job& job = r.job(1, 0, 3ms, 4ms, 5ms);
    job.has_sample = true;
    job.sample = {0, Time{} + 3ms, {parent, 0}};
  }
  const auto steps = imports::recorded_steps(r.graph, r.window(), {}, {"e", 0, {0}}, 10);
  EXPECT_THAT(steps.deadline, ElementsAre(Time{} + 12ms, Time{} + 12ms, kNever));
}

TEST(RecordedTimers, TheEventOfACreationComesSlightlyAfterIt) {
  Recorded r;
  r.task(TaskKind::timer, 10ms);
  r.system.callbacks[0].created = Time{} + 1ms;
  const auto first = [&](Duration start) {
    r.jobs.clear();
    r.job(0, 0, 0ms, start, start + 1ms);
    return imports::recorded_timers(r.system, r.graph, r.jobs, Time{} + 20ms).first.at(0) - Time{};
  };
  EXPECT_EQ(first(11200us), 11ms);
  EXPECT_EQ(first(10700us), 10700us);
}

TEST(RecordedTrace, SamplesThatWereNotTakenAreQueuedOrOverwritten) {
  Recorded r;
  r.task(TaskKind::subscription);
  const imports::RecordedTimers timers{{Time{}}, {}, {false}};
  const imports::RecordedTrace trace(r.system, r.graph, timers, {false});
  tracing::LostSample lost{0, {3, Time{} + 4ms, {}}, false};
  EXPECT_EQ(trace.lost(lost).outcome, Outcome::overwritten);
  lost.queued = true;
  EXPECT_EQ(trace.lost(lost).outcome, Outcome::queued);
  EXPECT_EQ(trace.lost(lost).job.sequence, 3U);
}

/// The topics that a task publishes early, if each of its jobs of this length publishes at these
/// instants.
std::size_t early(Duration length, const std::vector<Duration>& instants) {
  Recorded r;
  r.system.topics = {{"/a", {}}};
  r.task(TaskKind::timer, 100ms);
  for (int i = 0; i < 5; ++i) {
    tracing::Job& job = r.job(0, 0, i * 100ms, i * 100ms, i * 100ms + length);
    for (const Duration at : instants) job.published.push_back({0, job.start + at, 0});
  }
  return imports::early_publications(r.system, r.graph, r.jobs).size();
}

TEST(EarlyPublications, AreLongBeforeTheEndByShareAndByTime) {
  EXPECT_EQ(early(10ms, {2ms}), 1U);
  EXPECT_EQ(early(10ms, {2ms, 9950us}), 0U) << "the last message counts";
  EXPECT_EQ(early(10ms, {9500us}), 0U);
  EXPECT_EQ(early(500us, {420us}), 0U) << "80 us before the end";
}

}  // namespace
}  // namespace hotpath
