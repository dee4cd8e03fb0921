// SPDX-License-Identifier: Apache-2.0
// What the recorded jobs of a window tell: costs, preemption, decisions, timestamps and early
// publications.
#include "import/recorded_window.hpp"

#include <gmock/gmock.h>

#include "hotpath/reference_system/graph_workload.hpp"
#include "recorded.hpp"
#include "reference_nodes.hpp"

namespace hotpath::recorded_window_test {

using namespace std::chrono_literals;
using testing::Each;
using testing::ElementsAre;

TEST(RecordedDisplacement, OnlyTheInnermostJobHadTheProcessor) {
  Recorded r;
  r.system.threads.resize(3);
  r.tasks(3, 100ms);
  r.job(0, 0, 0ms, 0ms, 10ms, true);
  r.job(1, 1, 2ms, 2ms, 8ms, true);
  r.job(2, 2, 3ms, 3ms, 4ms, true);
  EXPECT_THAT(r.displacement().own, ElementsAre(4ms, 5ms, 1ms));
}

/// The first thread has the processor from 0 to 3 ms and from 6 to 8 ms.
TEST(RecordedDisplacement, ThreadsThatOverlapShareTheProcessorInTimeSlices) {
  Recorded r;
  r.threads(2);
  r.tasks(2, 100ms);
  r.job(0, 0, 0ms, 0ms, 8ms, true);
  r.job(1, 1, 1ms, 3ms, 9ms, true);
  EXPECT_THAT(r.displacement().own, ElementsAre(5ms, 4ms));
  EXPECT_EQ(r.displacement().slices.threads, 2U);
}

/// On two processors, the time slices of the first two threads end at 3 ms, when the third one waits: the
/// first thread goes to the end and, since the slice of the second one is over as well, continues at once.
TEST(RecordedDisplacement, SeveralProcessorsGoRoundAmongThreads) {
  Recorded r;
  r.threads(3, 2, {0, 1});
  r.tasks(3, 100ms);
  r.job(0, 0, 0ms, 0ms, 8ms);
  r.job(1, 1, 0ms, 0ms, 10ms);
  r.job(2, 2, 1ms, 3ms, 5ms, true);
  imports::Displacement displacement = r.displacement();
  EXPECT_THAT(displacement.own, ElementsAre(8ms, 8ms, 2ms));
  EXPECT_THAT(displacement.processors, Each(ElementsAre(0, 1)));
  EXPECT_EQ(displacement.slices.displaced, 1U);
  EXPECT_EQ(displacement.slices.early, 0U);
  r.jobs[2].start = Time{} + 2ms;  // before a slice of 3 ms ends: such slices explain nothing
  displacement = r.displacement();
  EXPECT_EQ(displacement.slices.threads, 0U);
  EXPECT_EQ(displacement.slices.unexplained, 3U);
  EXPECT_THAT(displacement.own, ElementsAre(5ms, 10ms, 3ms)) << "the third job within the first one";
}

/// Of threads that take turns on two processors, the last one is always on the second one, and starts 4 ms
/// after it got the first one.
TEST(RecordedDisplacement, ThreadsOfDifferentProcessorsKeepThem) {
  for (const Duration late : {Duration{}, Duration(4ms)}) {
    Recorded r;
    r.threads(4, 20, {0, 1});
    r.system.threads[3].processors = {{1, 20}};
    r.tasks(4, 50ms);
    for (int i = 0; i < 20; ++i) {
      const Duration begin = i * 50ms;
      r.job(0, 0, begin, begin, begin + 8ms);
      r.job(1, 1, begin, begin, begin + 10ms);
      r.job(2, 2, begin + 1ms, begin + 3ms, begin + 5ms);
      r.job(3, 3, begin + 20ms, begin + 20ms + late, begin + 29ms);
    }
    EXPECT_EQ(r.displacement().slices.threads, late == Duration{} ? 4U : 0U);
    EXPECT_EQ(r.displacement().processors[3].size(), late == Duration{} ? 2U : 1U);
  }
}

/// Within 100 ns, the third thread runs two jobs and the first one gets its processor back.
TEST(RecordedDisplacement, AJobOfAnInstantEndsAfterItsStart) {
  Recorded r;
  r.threads(3);
  r.tasks(3, 100ms);
  r.job(0, 0, 0ms, 0ms, 4ms, true);
  r.job(2, 2, 1ms, 3ms, 3ms + 50ns, true);
  r.job(2, 2, 3ms + 60ns, 3ms + 70ns, 3ms + 90ns, true);
  EXPECT_THAT(r.displacement().own, ElementsAre(4ms - 60ns, 50ns, 20ns));
}

/// Two threads take turns, while a thread of SCHED_FIFO runs for 1 ms in every 50 ms.
TEST(RecordedDisplacement, AThreadOfSchedFifoKeepsItAmongThreadsThatTakeTurns) {
  Recorded r;
  r.threads(3, 20);
  r.tasks(3, 50ms);
  for (int i = 0; i < 20; ++i) {
    const Duration begin = i * 50ms;
    r.job(0, 0, begin, begin, begin + 20ms, true);
    r.job(1, 1, begin, begin + 3ms, begin + 21ms, true);
    r.job(2, 2, begin + 4ms, begin + 4ms, begin + 5ms, true);
  }
  const imports::Displacement displacement = r.displacement();
  EXPECT_THAT(displacement.level, ElementsAre(0, 0, 1));
  EXPECT_EQ(displacement.slices.early, 0U);
  EXPECT_EQ(displacement.slices.threads, 3U);
  for (std::size_t i = 0; i < displacement.own.size(); i += 3) {
    EXPECT_EQ(displacement.own[i] + displacement.own[i + 1], 20ms);
    EXPECT_EQ(displacement.own[i + 2], 1ms);
  }
}

/// Short jobs of the second thread lie within long ones of the first: it preempts if they begin at once.
TEST(RecordedDisplacement, AThreadThatWaitsForATimeSliceHasNoPriority) {
  for (const Duration late : {Duration(20us), Duration(2ms)}) {
    Recorded r;
    r.threads(2, 5);
    r.tasks(2, 20ms);
    for (int i = 0; i < 5; ++i) {
      const Duration begin = i * 20ms;
      r.job(0, 0, begin, begin, begin + 12ms, true);
      r.job(1, 1, begin + 1ms, begin + 1ms + late, begin + 2ms + late, true);
    }
    EXPECT_EQ(r.displacement().level[1], late < 1ms ? 1 : 0);
  }
}

TEST(RecordedCosts, AReleaserWakesTheThreadOfItsTimer) {
  Recorded r;
  r.tasks(1, 10ms);
  for (int i = 0; i < 3; ++i) r.job(0, 0, i * 10ms, i * 10ms + 100us, i * 10ms + 1ms);
  EXPECT_EQ(r.costs("default").wake_up.median, 100us);
  EXPECT_EQ(r.costs("rm-ro").wake_up.median, 50us) << "two wake-ups";
}

/// Jobs of a timer that start 1 us after the job before them, and of a subscription after 5 us.
TEST(RecordedCosts, DispatchByKindNeedsEnoughJobs) {
  for (const int jobs : {90, 110}) {
    Recorded r;
    r.tasks(1, 1ms, 1);
    Duration at{};
    for (int i = 0; i < jobs; ++i, at += 200us) {
      r.job(0, 0, 0ms, at + 1us, at + 100us);
      r.job(1, 0, 0ms, at + 105us, at + 200us);
    }
    r.job(1, 0, 0ms, at + 5us, at + 100us);  // so that most dispatches are of subscriptions
    r.job(1, 0, 0ms, at + 105us, at + 200us);
    const imports::RecordedCosts costs = r.costs("events-ro");
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
    EXPECT_EQ(r.costs("multi", 2).wake_up.n, same_group ? 0U : 1U);
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
    const imports::RecordedSteps steps = r.steps(2);
    ASSERT_EQ(steps.starts, 3U);
    for (const imports::RecordedStep& step : steps.steps) {
      if (step.kind != imports::RecordedStep::Kind::start) continue;
      EXPECT_EQ(step.contested, step.task == 2 && !same_group) << "task " << step.task;
    }
  }
}

/// The second thread begins its callback first, although it asked for work after the first one.
TEST(RecordedSteps, ThreadsDecideInTheOrderOfTheirQuestions) {
  Recorded r;
  r.tasks(2, 100ms);
  r.job(1, 1, 10ms, 10150us, 12ms).decided = Time{} + 10100us;
  r.job(0, 0, 10ms, 10200us, 12ms).decided = Time{} + 10050us;
  const imports::RecordedSteps steps = r.steps(2);
  EXPECT_EQ(steps.steps.at(0).task, 0U);
  EXPECT_EQ(steps.steps.at(0).at, Time{} + 10050us);
  EXPECT_EQ(steps.steps.at(1).task, 1U);
}

TEST(RecordedSteps, SamplesInheritTheDeadlineOfTheTimerThatCausedThem) {
  Recorded r;
  r.tasks(1, 10ms, 1);
  r.job(0, 0, 2ms, 2ms, 3ms);
  for (const std::uint32_t parent : {0U, imports::kNone}) {
    tracing::Job& job = r.job(1, 0, 3ms, 4ms, 5ms);
    job.has_sample = true;
    job.sample = {0, Time{} + 3ms, {parent, 0}};
  }
  EXPECT_THAT(r.steps().deadline, ElementsAre(Time{} + 12ms, Time{} + 12ms, kNever));
}

TEST(RecordedTimers, TheEventOfACreationComesSlightlyAfterIt) {
  for (const auto& [start, first] : {std::pair(11200us, 11000us), std::pair(10700us, 10700us)}) {
    Recorded r;
    r.tasks(1, 10ms);
    r.system.callbacks[0].created = Time{} + 1ms;
    r.job(0, 0, 0ms, start, start + 1ms);
    EXPECT_EQ(imports::recorded_timers(r.system, r.graph, r.jobs, Time{} + 20ms).first.at(0), Time{} + first);
  }
}

TEST(RecordedTimers, AnExecutorThatStatesInstantsGivesTheGrid) {
  for (const Duration stated : {0ms, 33ms}) {
    Recorded r;
    r.timer(10ms, 10ms);
    r.job(0, 0, {}, 35ms, 36ms).timestamp = Time{} + stated;
    const imports::RecordedTimers timers = imports::recorded_timers(r.system, r.graph, r.jobs, Time{} + 1s);
    EXPECT_EQ(timers.first[0], Time{} + (stated > 0ms ? 13ms : 10ms));
  }
}

TEST(RecordedTrace, SamplesThatWereNotTakenAreQueuedOrOverwritten) {
  Recorded r;
  r.tasks(0, {}, 1);
  for (const bool queued : {false, true}) {
    const imports::RecordedSystem system{.lost = {{0, {3, Time{} + 4ms, {}}, queued}}};
    const JobRecord lost =
        imports::recorded_rows(system, r.graph, {{Time{}}, {}, {false}}, {false}).others.at(0);
    EXPECT_EQ(lost.outcome, queued ? Outcome::queued : Outcome::overwritten);
    EXPECT_EQ(lost.job.sequence, 3U);
  }
}

/// The topics that a task publishes early, if each of its jobs of this length publishes at these
/// instants.
std::size_t early(Duration length, const std::vector<Duration>& instants) {
  Recorded r;
  r.system.topics = {{"/a", {}}};
  r.tasks(1, 100ms);
  for (int i = 0; i < 5; ++i) {
    tracing::Job& job = r.job(0, 0, i * 100ms, i * 100ms, i * 100ms + length);
    for (const Duration at : instants) job.published.push_back({0, job.start + at, 0});
  }
  return imports::early_publications(r.jobs).size();
}

TEST(EarlyPublications, AreLongBeforeTheEndByShareAndByTime) {
  EXPECT_EQ(early(10ms, {2ms}), 1U);
  EXPECT_EQ(early(10ms, {2ms, 9950us}), 0U) << "the last message counts";
  EXPECT_EQ(early(10ms, {9500us}), 0U);
  EXPECT_EQ(early(500us, {420us}), 0U) << "80 us before the end";
}

/// Two timers, a node that joins their samples, and two sinks of the result; one chain from the
/// first timer to each sink. Tasks 0 and 1 are the timers, 2 and 3 the inputs, 4 and 5 the sinks.
class RecordedChains : public testing::Test {
 protected:
  RecordedChains() {
    Graph& graph = r_.graph.graph;
    for (const char* name : {"a", "b"})
      graph.nodes.push_back(reference_node(name, NodeType::sensor, {}, 10ms));
    graph.nodes.push_back(reference_node("join", NodeType::fusion, {{"a", 1, {}}, {"b", 1, {}}}));
    for (const char* sink : {"sink", "other"}) {
      graph.nodes.push_back(reference_node(sink, NodeType::command, {{"join", 1, {}}}));
      graph.chains.push_back({sink, {"a", "join", sink}, {"a"}, sink});
    }
    r_.graph.tasks = make_tasks(graph);
    for (const std::uint32_t topic : {tracing::kNone, tracing::kNone, 0U, 1U, 2U, 2U}) {
      r_.graph.task_of.push_back(static_cast<TaskId>(r_.system.callbacks.size()));
      r_.graph.callback_of.push_back(r_.graph.task_of.back());
      r_.system.callbacks.emplace_back().topic = topic;
    }
    r_.system.topics.resize(3);
    r_.graph.rules = {{.topic = 2, .publishers = {2, 3}, .rule = PublishRule::all_new, .of = {2, 3}}};
  }

  /// Adds a job with events of its own; it takes the latest sample of its topic, if it reads one.
  tracing::Job& job(TaskId task) {
    tracing::Job& job = r_.job(task, 0, 0ms, events_ * 1ms, events_ * 1ms);
    job.ref.number = jobs_of_[task]++;
    r_.records.back().job.sequence = job.ref.number;
    job.started = ++events_;
    job.finished = events_ + 2;
    const std::uint32_t topic = r_.system.callbacks[task].topic;
    job.has_sample = topic != tracing::kNone;
    if (job.has_sample) job.sample.parent = published_.at(topic);
    return job;
  }
  void publish(tracing::Job& job, std::uint32_t topic) {
    job.published.push_back({topic, job.start, ++events_});
    ++events_;
    published_[topic] = job.ref;
  }
  /// By chain: the number of outputs at its sink.
  std::vector<std::size_t> outputs() const {
    std::vector<std::size_t> outputs(2, 0);
    for (const ChainObservation& o : imports::recorded_chains(r_.system, r_.graph, r_.window()))
      ++outputs.at(o.chain);
    return outputs;
  }

 private:
  Recorded r_;
  std::uint64_t events_ = 0;
  std::map<TaskId, std::uint64_t> jobs_of_;
  std::map<std::uint32_t, tracing::JobRef> published_;
};

TEST_F(RecordedChains, EveryReaderOfAMessageFollowsIt) {
  publish(job(0), 0);
  job(2);
  publish(job(1), 1);
  publish(job(3), 2);
  job(4);
  job(5);
  EXPECT_THAT(outputs(), ElementsAre(1, 1));
}

TEST_F(RecordedChains, AJoinUsesASampleOnce) {
  publish(job(0), 0);
  job(2);
  for (int i = 0; i < 2; ++i) {
    publish(job(1), 1);
    publish(job(3), 2);
    job(4);
  }
  EXPECT_THAT(outputs(), ElementsAre(1, 0)) << "the second message has no data of the first timer";
}

}  // namespace hotpath::recorded_window_test
