// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_graph.hpp"

#include <gmock/gmock.h>

namespace hotpath {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// Nodes /a and /b, each with subscriptions to /x and /y; callback c is task c.
struct Recorded {
  tracing::System system;
  imports::RecordedGraph graph;

  Recorded() {
    system.nodes = {"/a", "/b"};
    system.topics = {{"/x", {}}, {"/y", {}}, {"/out", {}}};
    for (const std::uint32_t node : {0U, 1U}) {
      for (const std::uint32_t topic : {0U, 1U}) {
        tracing::Callback& callback = system.callbacks.emplace_back();
        callback.kind = tracing::CallbackKind::subscription;
        callback.node = node;
        callback.topic = topic;
        callback.symbol = "_ZN4Node8receivedEv";
        graph.task_of.push_back(static_cast<TaskId>(graph.task_of.size()));
      }
    }
  }
  /// A rule by which node /b publishes /out.
  void rule(std::uint64_t jobs, std::uint64_t explained) {
    graph.rules.push_back({.topic = 2, .publishers = {2}, .jobs = jobs, .explained = explained});
  }
  std::vector<std::string> unmodelled() const { return imports::unmodelled(system, graph); }
};

TEST(Unmodelled, ASystemOfPlainCallbacksAndRulesHasNothing) {
  Recorded r;
  r.rule(100, 95);
  EXPECT_THAT(r.unmodelled(), IsEmpty());
}

TEST(Unmodelled, SynchronisersAreNamedByNodeWithTheirTopics) {
  Recorded r;
  for (const std::size_t c : {0U, 1U, 2U})
    r.system.callbacks[c].symbol = "message_filters::Subscriber<Image>::callback";
  EXPECT_THAT(r.unmodelled(), ElementsAre(HasSubstr("Node /a passes /x, /y through message_filters"),
                                          HasSubstr("Node /b passes /x through message_filters")));
}

TEST(Unmodelled, ACallbackOutsideOfTheGraphIsNoSynchroniser) {
  Recorded r;
  r.system.callbacks[0].symbol = "message_filters::Subscriber<Image>::callback";
  r.graph.task_of[0] = kNoTask;
  EXPECT_THAT(r.unmodelled(), IsEmpty());
}

TEST(Unmodelled, ATopicThatNoRuleDescribesIsNamedWithTheBestOne) {
  Recorded r;
  r.rule(100, 94);
  EXPECT_THAT(r.unmodelled(), ElementsAre(AllOf(HasSubstr("topic /out: "), HasSubstr("94 of 100 jobs of /b"),
                                                HasSubstr("lifecycle node"))));
}

}  // namespace
}  // namespace hotpath
