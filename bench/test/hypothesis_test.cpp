// SPDX-License-Identifier: Apache-2.0
// Which executors can have run a recording, and the sentences about those that did.
#include "import/hypothesis.hpp"

#include <gmock/gmock.h>

#include "import/recognition.hpp"

namespace hotpath {
namespace {

using namespace std::chrono_literals;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

/// The labels of the executors that can have run so many threads, which emit their waits.
std::vector<std::string> possible(std::size_t threads, const std::string& rcl_version) {
  imports::RecordedSteps steps;
  steps.own.resize(3);
  steps.has_timers.assign(threads, true);
  steps.has_others.assign(threads, true);
  std::vector<std::string> labels;
  for (const imports::Hypothesis& h : imports::possible_hypotheses(steps, true, rcl_version))
    labels.push_back(h.label);
  return labels;
}

TEST(Hypotheses, AreThoseOfTheRelease) {
  for (const char* version : {"9.2.0", "", "8.0.0", "10.1"})  // 8: the development of Jazzy, whose rcl is 9
    EXPECT_THAT(possible(2, version), Contains("multi-jazzy:2")) << version;
  for (const char* version : {"5.3.7", "6.0.0"})
    EXPECT_THAT(possible(2, version), Not(Contains("multi-jazzy:2"))) << version;
}

TEST(Hypotheses, HaveAtMostTheThreadsOfAnExecutor) {
  EXPECT_THAT(possible(kMaxWorkers, ""), Contains("multi:" + std::to_string(kMaxWorkers)));
  EXPECT_THAT(possible(kMaxWorkers + 1, ""), testing::IsEmpty());
}

TEST(RecognitionSentence, SaysWhenTheBestExecutorFirstBreaks) {
  imports::RecordedGraph graph;
  graph.epoch = from_ns(7'000'000'000);
  graph.tasks.set.tasks.resize(1);
  graph.tasks.set.tasks[0].name = "sensor/timer";
  imports::Recognition r;
  r.verdict = imports::Verdict::none_fits;
  r.ranking.resize(1);
  r.ranking[0].hypothesis.label = "default";
  r.ranking[0].agreement = 0.5;
  r.leading = 1;
  r.contested = 40;
  r.breaks = imports::RecordedStep{.at = graph.epoch + 12500us, .task = 0};
  EXPECT_EQ(imports::sentence(r, graph),
            "No known executor fits: the best one, default, explains 50.0 % of 40 contested decisions. It "
            "first breaks at 12.5 ms, when sensor/timer ran.");
}

/// The order of creation has callback 0 first, which is the second task.
TEST(ServiceOrder, EvidenceIsForTheSmallerTask) {
  tracing::System system;
  system.nodes = {"/n"};
  system.callbacks.resize(2);
  for (tracing::Callback& c : system.callbacks) c.node = 0;
  imports::RecordedGraph graph;
  graph.task_of = {1, 0};
  graph.callback_of = {1, 0};
  const auto callbacks = [&](std::int64_t evidence) {
    return imports::service_order(system, graph, {{{0, 1}, evidence}}).callbacks;
  };
  EXPECT_EQ(callbacks(5), (std::vector<std::uint32_t>{1, 0}));
  EXPECT_EQ(callbacks(-5), (std::vector<std::uint32_t>{0, 1}));
}

}  // namespace
}  // namespace hotpath
