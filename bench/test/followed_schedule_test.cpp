// SPDX-License-Identifier: Apache-2.0
// Executors that can have run a recording: which they are, how they follow its decisions, and what
// recognition concludes.
#include <gmock/gmock.h>

#include "hotpath/core/platform.hpp"
#include "import/recognition.hpp"
#include "recorded.hpp"

namespace hotpath::followed_schedule_test {

using namespace std::chrono_literals;
using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;
using Of = imports::Agreement::Of;

TEST(FollowedSchedule, AJobThatWasReadyBeforeTheThreadWasFreeContradicts) {
  Recorded r;
  r.timer(10ms, 2ms);
  r.timer(20ms, 1ms);
  r.timer(40ms, 0ms);
  r.job(2, 0, 0ms, 0ms, 5ms);
  r.job(1, 0, 1ms, 5050us, 6ms);
  r.job(0, 0, 2ms, 6050us, 7ms);
  EXPECT_THAT(r.follow(r.hypothesis("rm-ro")).decisions, ElementsAre(Of::yes, Of::no, Of::yes));
}

TEST(FollowedSchedule, AJobThatRanBeforeItsReleaseDoesNotRunAgain) {
  Recorded r;
  r.timer(10ms, 10ms);
  r.timer(20ms, 11ms);
  r.job(0, 0, 9900us, 9900us, 10500us);
  r.job(1, 0, 11ms, 12ms, 13ms);
  EXPECT_THAT(r.follow(r.hypothesis("rm-ro")).decisions, ElementsAre(Of::no, Of::yes));
}

/// A releaser without a priority displaces the job at 5 ms, whose time slice is over, and at 8 ms, when the
/// next one is: the sample of 7.5 ms is queued before the timer of 7 ms.
TEST(FollowedSchedule, ADisplacedThreadGetsANewTimeSlice) {
  Recorded r;
  for (const Duration phase : {0ms, 5ms, 7ms}) r.timer(100ms, phase);
  r.task(TaskKind::subscription);
  r.job(0, 0, 0ms, 0ms, 10ms);
  r.job(1, 0, 5ms, 10010us, 11ms);
  tracing::Job& job = r.job(3, 0, 7500us, 11010us, 12ms);
  job.has_sample = true;
  job.sample.published = Time{} + 7500us;
  r.job(2, 0, 7ms, 12010us, 13ms);
  imports::Hypothesis h = r.hypothesis("events-ro");
  h.release_delay = Platform{}.time_slice;
  EXPECT_EQ(r.follow(h).contradictions, 0U);
}

/// At 11 ms the first thread waits without the group that the second thread keeps busy until 13 ms:
/// the rebuilt wait set has task 2, of that group, behind the others.
TEST(FollowedSchedule, AThreadThatFinishedAskedInVain) {
  Recorded r;
  r.timer(100ms, 10ms);
  r.timer(100ms, 10ms);
  r.task(TaskKind::timer, 100ms, true).phase = 10ms;
  r.timer(100ms, 12ms);
  r.job(0, 0, 10ms, 10ms, 11ms);
  r.job(1, 1, 10ms, 10001us, 13ms);
  r.job(3, 0, 12ms, 13020us, 14ms);
  r.job(2, 1, 10ms, 13050us, 15ms);
  imports::Hypothesis h = r.hypothesis("multi-jazzy");
  h.asks_in_vain = true;
  EXPECT_EQ(r.follow(h, 2).contradictions, 0U);
}

TEST(FittedLevels, FollowThePeriodsIfNoDecisionContradicts) {
  Recorded r;
  r.timer(20ms, 0ms);
  r.timer(10ms, 5ms);
  r.job(0, 0, 0ms, 0ms, 1ms);
  r.job(1, 0, 5ms, 5ms, 6ms);
  imports::Hypothesis h = r.hypothesis("fp-ro");
  imports::fit_levels(r.graph.tasks.set, r.steps(), h, r.jobs.size());
  EXPECT_THAT(h.levels, ElementsAre(4, 2));
}

/// In each cycle of 20 ms, a timer keeps the thread busy for 5 ms, and two others become ready
/// `waited` before it ends. The one with the longer period is ready first and runs first.
std::size_t leading(Duration waited) {
  Recorded r;
  r.timer(10ms, 5ms - waited + 1us);
  r.timer(20ms, 5ms - waited);
  r.timer(20ms, 0ms);
  for (int i = 0; i < 100; ++i) {
    const Duration at = i * 20ms, busy = at + 5ms;
    r.job(2, 0, at, at, busy);
    r.job(1, 0, busy - waited, busy + 1us, busy + 1ms);
    r.job(0, 0, busy - waited + 1us, busy + 1001us, busy + 2ms);
    r.job(0, 0, busy - waited + 1us + 10ms, busy + 10ms, busy + 11ms);
  }
  const imports::Recognition found =
      imports::recognise(r.system, r.graph, r.steps(), {r.hypothesis("events-ro"), r.hypothesis("rm-ro")});
  EXPECT_EQ(found.names().front(), "events-ro");
  return found.leading;
}

TEST(Recognition, DecisionsOfOneKindExcludeAnExecutorOnlyIfTimingCannotExplainThem) {
  EXPECT_EQ(leading(900us), 2U);
  EXPECT_EQ(leading(4ms), 1U);
}

TEST(Recognition, AFittedOrderRemovesAtLeastThreeContradictions) {
  for (const int cycles : {2, 3}) {
    Recorded r;
    for (int i = 0; i < 2; ++i) r.timer(10ms, 0ms);
    for (int i = 0; i < 2 * cycles; ++i) {  // the order is fitted to the first half
      r.job(1, 0, i * 10ms, i * 10ms, i * 10ms + 1ms);
      r.job(0, 0, i * 10ms, i * 10ms + 1ms, i * 10ms + 2ms);
    }
    const imports::Recognition found =
        imports::recognise(r.system, r.graph, r.steps(), {r.hypothesis("default")});
    EXPECT_EQ(found.ranking.at(0).evidence.size(), cycles == 3 ? 1U : 0U) << cycles << " swapped pairs";
  }
}

TEST(Recognition, PrefersTheGenerationOfTheRelease) {
  Recorded r;
  r.tasks(2, 10ms);
  for (const TaskId id : {0U, 1U}) r.job(id, id, 0ms, 0ms, 1ms);
  const auto best = [&](const char* version) {
    return imports::recognise(r.system, r.graph, r.steps(2),
                              imports::possible_hypotheses(r.steps(2), true, imports::releases_of(version)))
        .names();
  };
  EXPECT_THAT(best("4.1.1"), ElementsAre("multi:2", "multi-fair:2"));
  EXPECT_THAT(best("8.0.0"), ElementsAre("multi:2", "multi-jazzy:2", "multi-fair:2"));
  EXPECT_THAT(best("8.2.2"), ElementsAre("multi-jazzy:2", "multi:2", "multi-fair:2"));
}

/// While timer 0 runs, timer 1 becomes due. Its job begins after the subscription to what timer 0
/// publishes at its end: the thread that releases it had to wait until the other one slept.
TEST(FollowedSchedule, TimersOfEqualPrioritiesAreReleasedWhenTheExecutorSleeps) {
  Recorded r;
  r.task(TaskKind::timer, 100ms);
  r.task(TaskKind::timer, 100ms, true);
  r.task(TaskKind::subscription, {}, true);
  r.graph.tasks.set.tasks[0].feeds = {2};
  r.graph.tasks.set.tasks[1].phase = 1ms;
  for (std::uint64_t i = 0; i < 10; ++i) {
    const Duration at = i * 100ms;
    r.job(0, 0, at, at, at + 4ms).ref.number = i;
    tracing::Job& reader = r.job(2, 0, at + 4ms, at + 4ms, at + 8ms);
    reader.ref.number = i;
    reader.has_sample = true;
    reader.sample = {i, Time{} + at + 4ms, {0, i}};
    r.job(1, 0, at + 1ms, at + 8ms, at + 9ms).ref.number = i;
  }
  for (const Duration delay : {Duration{}, imports::kUntilIdle}) {
    imports::Hypothesis h = r.hypothesis("events-ro");
    h.release_delay = delay;
    EXPECT_EQ(r.follow(h).contradictions, delay > Duration{} ? 0U : 10U);
  }
}

/// The labels of the executors that can have run so many threads, which emit their waits.
std::vector<std::string> possible(std::size_t threads, const std::string& version) {
  imports::RecordedSteps steps;
  steps.own.resize(3);
  steps.has_timers.assign(threads, true);
  steps.has_others.assign(threads, true);
  std::vector<std::string> labels;
  for (const imports::Hypothesis& h :
       imports::possible_hypotheses(steps, true, imports::releases_of(version)))
    labels.push_back(h.label);
  return labels;
}

TEST(Hypotheses, AreThoseOfTheRelease) {
  for (const char* version : {"8.2.2", "", "8.0.0", "8.9"})  // 8.0: the development of Jazzy
    EXPECT_THAT(possible(2, version), Contains("multi-jazzy:2")) << version;
  for (const char* version : {"4.1.1", "6.3.2"})
    EXPECT_THAT(possible(2, version), Not(Contains("multi-jazzy:2"))) << version;
}

TEST(Hypotheses, HaveAtMostTheThreadsOfAnExecutor) {
  EXPECT_THAT(possible(kMaxWorkers, ""), Contains("multi:" + std::to_string(kMaxWorkers)));
  EXPECT_THAT(possible(kMaxWorkers + 1, ""), IsEmpty());
}

TEST(RecognitionSentence, SaysWhenTheBestExecutorFirstBreaks) {
  imports::Recognition r;
  r.verdict = imports::Verdict::none_fits;
  r.ranking.resize(1);
  r.ranking[0].hypothesis.label = "default";
  r.ranking[0].agreement = 0.5;
  r.leading = 1;
  r.contested = 40;
  r.breaks = "at 12.5 ms, when sensor/timer ran";
  EXPECT_EQ(imports::sentence(r),
            "No known executor fits: the best one, default, explains 50.0 % of 40 contested decisions. It "
            "first breaks at 12.5 ms, when sensor/timer ran.");
}

/// The order of creation has callback 0 first, which is the second task.
TEST(ServiceOrder, EvidenceIsForTheSmallerTask) {
  Recorded r;
  r.tasks(2, 10ms);
  r.graph.task_of = r.graph.callback_of = {1, 0};
  const auto callbacks = [&](std::int64_t evidence) {
    return imports::service_order(r.system, r.graph, {{{0, 1}, evidence}}).callbacks;
  };
  EXPECT_EQ(callbacks(5), (std::vector<std::uint32_t>{1, 0}));
  EXPECT_EQ(callbacks(-5), (std::vector<std::uint32_t>{0, 1}));
}

}  // namespace hotpath::followed_schedule_test
