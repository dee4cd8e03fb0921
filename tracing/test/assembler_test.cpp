// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "handmade_trace.hpp"

namespace hotpath::tracing::assembler_test {

/// A handmade trace that begins with make_nodes().
class Assembled : public testing::Test, protected Recording {
 protected:
  Assembled() { make_nodes(); }
  const System& system() const { return assembler.system(); }
  const Callback& callback_of(const Job& job) const { return system().callbacks[job.ref.callback]; }
  /// A job of a callback for 2 ns on a thread.
  void run(std::int64_t at_ns, std::uint64_t callback, std::uint64_t intra_process = 0) {
    tell(K::callback_start, at_ns, {callback, intra_process});
    tell(K::callback_end, at_ns + 1, {callback});
  }
  /// A job publishes a sample within the process, and has not ended.
  void publish_within_process() {
    tell(K::buffer_to_ipb, 9, {31, 32});
    tell(K::ipb_to_subscription, 10, {32, 22});
    tell(K::callback_start, 2000, {11});
    tell(K::intra_publish, 2001, {13, 99});
    tell(K::ring_buffer_enqueue, 2002, {31, 4});
  }
  /// Node 1 with a service (callback 31) and node 2 with its client.
  void make_service() {
    tell(K::service_init, 10, {30, 1}, {"/map", ""});
    tell(K::service_callback_added, 11, {30, 31});
    tell(K::client_init, 12, {40, 2}, {"/map", ""});
  }
  static constexpr std::int64_t kLong_ns = 50'000;
};
using Unannounced = Assembled;

TEST_F(Assembled, FindsEntitiesAndWhoCausedWhat) {
  publish(2000, 5002);
  receive(3000, 5002);
  assembler.finish();
  ASSERT_EQ(system().nodes.size(), 2U);
  EXPECT_EQ(system().nodes[1], "/space/sink");
  ASSERT_EQ(system().callbacks.size(), 2U);
  EXPECT_EQ(system().callbacks[0].period, Duration(1000));
  EXPECT_EQ(system().callbacks[0].node, 0U);
  EXPECT_EQ(system().callbacks[1].depth, 1U);
  ASSERT_EQ(jobs.size(), 2U);
  EXPECT_EQ(jobs[0].published.size(), 1U);
  EXPECT_EQ(jobs[1].sample.parent.callback, 0U);
  EXPECT_EQ(jobs[1].sample.published, at(2001));
}

TEST_F(Assembled, OverwritesBeyondTheDepthAndKeepsWhatIsUnread) {
  for (const std::uint64_t i : {0, 1, 2}) publish(static_cast<std::int64_t>(2000 + 1000 * i), 5000 + i);
  receive(6000, 5002);
  publish(7000, 5003);
  assembler.finish();
  EXPECT_EQ(overwritten, (std::vector<std::uint64_t>{0, 1}));
  EXPECT_EQ(jobs[3].sample.parent.number, 2U);
  EXPECT_EQ(unread, (std::vector<std::uint64_t>{3}));
}

TEST(Assembler, KeepsAtMostAThousandSamplesOfASubscriptionThatKeepsAll) {
  Recording recording;
  recording.make_nodes(0);
  for (std::uint64_t i = 0; i < 3000; ++i)
    recording.publish(static_cast<std::int64_t>(2000 + 10 * i), 5000 + i);
  EXPECT_EQ(recording.overwritten.size(), 2000U);
  recording.assembler.finish();
  EXPECT_EQ(recording.unread.size(), 1000U);
  EXPECT_EQ(recording.unread.front(), 2000U);
}

TEST_F(Assembled, TakesTheNearestPublicationWhereNoneHasATimestamp) {
  publish(2'000'000, 0);
  receive(2'100'000, 2'000'500);
  EXPECT_EQ(jobs[1].sample.parent.callback, 0U);
  EXPECT_EQ(system().callbacks[1].strangers, 0U);
}

TEST_F(Assembled, SamplesOfWhatWasNotTracedHaveNoParent) {
  receive(3000, 2500);
  EXPECT_EQ(jobs[0].sample.parent.callback, kNone);
  EXPECT_EQ(system().callbacks[1].strangers, 1U);
}

TEST_F(Assembled, SamplesWithinAProcessGoThroughTheRingBuffer) {
  publish_within_process();
  tell(K::rcl_publish, 2003, {13, 98});  // the same publication, for other processes
  tell(K::callback_end, 2004, {11});
  tell(K::ring_buffer_dequeue, 3000, {31, 4});
  run(3001, 21, 1);
  assembler.finish();
  EXPECT_EQ(system().callbacks[1].samples, 1U);
  EXPECT_EQ(jobs[0].published.size(), 1U);
  EXPECT_EQ(jobs[1].sample.parent.callback, 0U);
  EXPECT_TRUE(unread.empty());
}

TEST_F(Assembled, ASampleThatAnotherThreadTakesAtOnceIsNotDeliveredTwice) {
  publish_within_process();
  tell(K::ring_buffer_dequeue, 2003, {31, 4}, {"", ""}, 2);
  tell(K::rcl_publish, 2004, {13, 98});
  tell(K::callback_end, 2005, {11});
  assembler.finish();
  EXPECT_EQ(system().callbacks[1].samples, 1U);
  EXPECT_TRUE(unread.empty());
}

// In rclcpp's order: the object of an intra-process subscription (24) adds its callback (25) before
// an event says whose it is.
TEST_F(Assembled, IntraProcessCallbacksBelongToTheirSubscription) {
  tell(K::subscription_init, 9, {40, 2, 43, 1}, {"/b", ""});
  tell(K::buffer_to_ipb, 10, {31, 32});
  tell(K::ipb_to_subscription, 11, {32, 24});
  tell(K::subscription_callback_added, 12, {24, 25});
  tell(K::rclcpp_subscription_init, 13, {40, 24});
  tell(K::rclcpp_subscription_init, 14, {40, 42});
  tell(K::subscription_callback_added, 15, {42, 41});
  tell(K::ring_buffer_enqueue, 2000, {31, 4});
  tell(K::ring_buffer_dequeue, 3000, {31, 4});
  run(3001, 25, 1);
  ASSERT_EQ(jobs.size(), 1U);
  EXPECT_EQ(jobs[0].ref.callback, 2U);
  EXPECT_TRUE(jobs[0].has_sample);
  EXPECT_EQ(system().reused_handles, 0U);
  // Another subscription at the same addresses.
  tell(K::subscription_init, 4000, {50, 1, 53, 1}, {"/a", ""});
  tell(K::subscription_callback_added, 4001, {24, 25});
  tell(K::rclcpp_subscription_init, 4002, {50, 24});
  run(5000, 25, 1);
  EXPECT_EQ(jobs[1].ref.callback, 3U);
}

TEST_F(Assembled, CallbacksThatNeverEndCountAsRunning) {
  tell(K::callback_start, 2000, {11});
  tell(K::callback_start, 3000, {11});  // its end was lost
  tell(K::callback_end, 3001, {11});
  tell(K::callback_end, 3002, {11});
  tell(K::callback_start, 4000, {11});
  assembler.finish();
  EXPECT_EQ(system().callbacks[0].jobs, 1U);
  EXPECT_EQ(system().callbacks[0].never_ended, 2U);
  EXPECT_EQ(system().ends_without_start, 1U);
  EXPECT_FALSE(jobs[0].ended);
}

TEST_F(Assembled, HandlesUsedAgainMeanTheLatestCallback) {
  publish(2000, 5000);
  tell(K::timer_init, 3000, {10, 5000});
  tell(K::timer_callback_added, 3001, {10, 11});
  tell(K::timer_link_node, 3002, {10, 2});
  publish(4000, 5001);
  EXPECT_EQ(system().reused_handles, 1U);
  EXPECT_EQ(jobs[0].ref.callback, 0U);
  EXPECT_EQ(jobs[1].ref.callback, 2U);
}

TEST_F(Assembled, ThreadsThatHaveEndedMakeRoomForOthers) {
  for (std::uint32_t thread = 2; thread < 1000; ++thread) {
    tell(K::callback_start, 1000 * thread, {11}, {"", ""}, thread);
    assembler.forget_thread(7, thread);  // its job is open
    tell(K::callback_end, 1000 * thread + 1, {11}, {"", ""}, thread);
    const std::uint32_t index = jobs.back().thread;
    EXPECT_EQ(system().threads[index].id, thread);
    EXPECT_EQ(system().threads[index].jobs, 1U);
    assembler.forget_thread(7, thread);
    EXPECT_EQ(system().threads[index].id, 0U);
  }
  EXPECT_EQ(jobs.size(), 998U);
  EXPECT_LE(system().threads.size(), 2U);
}

TEST_F(Assembled, AServiceIsNoTopicOfThatName) {
  make_service();
  tell(K::publisher_init, 13, {50, 1, 51}, {"/map", ""});
  EXPECT_NE(system().endpoints.back().topic, system().callbacks.back().topic);
  EXPECT_EQ(system().clients.back().service, system().callbacks.back().topic);
}

TEST_F(Unannounced, AQuestionWithoutAWaitFollowsAResponse) {
  make_service();
  tell(K::get_next_ready, 1000, {});
  run(1001, 31);
  tell(K::get_next_ready, 2000, {});
  tell(K::get_next_ready, 2000 + kLong_ns, {});
  tell(K::wait_for_work, 2001 + kLong_ns, {});
  tell(K::get_next_ready, 2001 + 3 * kLong_ns, {});
  ASSERT_EQ(jobs.size(), 2U);
  const Job& response = jobs.back();
  const Callback& client = callback_of(response);
  EXPECT_EQ(client.kind, CallbackKind::client);
  EXPECT_EQ(system().nodes[client.node], "/space/sink");
  EXPECT_EQ(system().topics[client.topic].name, "/map/response");
  EXPECT_EQ(response.start, at(2000));
  EXPECT_EQ(response.finish, at(2000 + kLong_ns));
  EXPECT_EQ(response.sample.published, at(1002));
  EXPECT_EQ(response.sample.parent.callback, jobs.front().ref.callback);
  EXPECT_EQ(jobs.front().published.front().topic, client.topic);
}

TEST_F(Assembled, AJobAnswersTheLastQuestionOfItsThread) {
  tell(K::callback_register, 9, {11}, {"message_filters::Subscriber<M>::cb", ""});
  tell(K::get_next_ready, 1000, {});
  tell(K::wait_for_work, 1001, {});
  tell(K::get_next_ready, 2000, {});
  tell(K::execute, 2001, {10});
  publish(2002, 0);
  publish(2010, 0);
  ASSERT_EQ(jobs.size(), 2U);
  EXPECT_EQ(jobs[0].decided, at(2000));
  EXPECT_LT(jobs[0].question, jobs[0].started);
  EXPECT_EQ(jobs[1].decided, Time{}) << "it has no question";
  EXPECT_EQ(system().callbacks[0].symbol, "message_filters::Subscriber<M>::cb");
}

TEST_F(Unannounced, ShortOrAnnouncedGapsAreNoJobs) {
  for (const K between : {K::execute, K::wait_for_work, K::get_next_ready}) {
    Recording recording;
    recording.make_nodes();
    recording.tell(K::get_next_ready, 1000, {});
    recording.tell(between, 1001, {});
    recording.tell(K::get_next_ready, between == K::get_next_ready ? 1002 : 1001 + kLong_ns, {});
    recording.assembler.finish();
    EXPECT_TRUE(recording.jobs.empty());
  }
}

TEST_F(Unannounced, WithoutAResponseItBelongsToTheThread) {
  tell(K::get_next_ready, 1000, {});
  tell(K::rcl_publish, 1001, {13, 99});  // a waitable may publish
  tell(K::get_next_ready, 1002, {});
  ASSERT_EQ(jobs.size(), 1U);
  const Callback& callback = callback_of(jobs[0]);
  EXPECT_EQ(callback.kind, CallbackKind::unannounced);
  EXPECT_EQ(system().nodes[callback.node], "/clients_and_waitables");
  EXPECT_EQ(jobs[0].published.size(), 1U);
  receive(2000, 0);
  // An action's client takes samples of a subscription without a callback.
  tell(K::subscription_init, 3000, {50, 2, 53, 5}, {"/dock/_action/feedback", ""});
  tell(K::get_next_ready, 3001, {});
  tell(K::rmw_take, 3002, {53, 98, 2900, 1});
  tell(K::wait_for_work, 3003, {});
  EXPECT_TRUE(callback_of(jobs.back()).of_action);
  EXPECT_EQ(jobs.back().start, at(3001));
  EXPECT_EQ(jobs.back().sample.published, at(2900));
}

TEST_F(Unannounced, ThreadsThatWaitForEachOtherTellNothing) {
  for (const bool together : {false, true}) {  // which threads of one executor never do
    Recording r;
    r.make_nodes();
    for (const std::uint32_t thread : {1U, 2U}) {
      r.tell(K::wait_for_work, 500, {}, {"", ""}, thread);
      if (!together) r.tell(K::get_next_ready, 501, {}, {"", ""}, thread);
    }
    r.tell(K::get_next_ready, 1000, {});
    r.tell(K::get_next_ready, 1000 + kLong_ns, {});
    r.assembler.finish();
    EXPECT_EQ(r.jobs.size(), together ? 1U : 0U);
    EXPECT_EQ(r.assembler.system().unclear_callbacks, together ? 0U : 1U);
  }
}

/// The events of a PriorityExecutor (90) as LTTng records them.
TEST_F(Unannounced, AnExecutorStatesClientsAndWaitables) {
  make_service();
  tell(K::executor_init, 100, {90}, {"rm-ro", ""});
  tell(K::executor_callback, 101, {90, 0, 10}, {"timer", "/source"});
  tell(K::executor_callback, 102, {90, 1, 40}, {"client", "/space/sink"});
  tell(K::executor_callback, 103, {90, 2, 0}, {"waitable", "/source"});
  tell(K::executor_job, 200, {90, 1, 150, 160});
  tell(K::executor_end, 220, {90, 1});
  tell(K::executor_job, 230, {90, 2, 210, 211});
  tell(K::executor_end, 260, {90, 2});
  tell(K::executor_job, 300, {90, 0, 270, 271});
  run(301, 11);
  ASSERT_EQ(jobs.size(), 3U);
  EXPECT_EQ(callback_of(jobs[0]).kind, CallbackKind::client);
  EXPECT_EQ(jobs[0].finish - jobs[0].start, Duration(20));
  EXPECT_EQ(jobs[0].sample.published, at(150));
  const Callback& waitable = callback_of(jobs[1]);
  EXPECT_EQ(waitable.kind, CallbackKind::unannounced);
  EXPECT_EQ(system().nodes[waitable.node], "/source");
  EXPECT_EQ(jobs[2].timestamp, at(270));
  EXPECT_EQ(jobs[2].release, at(271));
  EXPECT_TRUE(system().stated_executors.front().states_ends);
}

/// Traces of versions that write no ends.
TEST_F(Unannounced, AStatedJobWithoutEndDoesNotCount) {
  make_service();
  tell(K::executor_init, 100, {90}, {"rm-ro", ""});
  tell(K::executor_callback, 102, {90, 1, 40}, {"client", "/space/sink"});
  for (const std::int64_t start : {200, 300}) tell(K::executor_job, start, {90, 1, 150, 160});
  tell(K::executor_job, 400, {90, 0, 150, 160});
  assembler.finish();
  EXPECT_TRUE(jobs.empty());
}

}  // namespace hotpath::tracing::assembler_test
