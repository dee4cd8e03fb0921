// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "handmade_trace.hpp"

namespace hotpath::tracing {
namespace {

TEST(Assembler, FindsEntitiesAndWhoCausedWhat) {
  Recording recording;
  recording.make_nodes();
  recording.publish(2000, 5002);
  recording.receive(3000, 5002);
  recording.assembler.finish();
  const System& system = recording.assembler.system();
  ASSERT_EQ(system.nodes.size(), 2U);
  EXPECT_EQ(system.nodes[1], "/space/sink");
  ASSERT_EQ(system.callbacks.size(), 2U);
  EXPECT_EQ(system.callbacks[0].period, Duration(1000));
  EXPECT_EQ(system.callbacks[0].node, 0U);
  EXPECT_EQ(system.callbacks[1].depth, 1U);
  ASSERT_EQ(recording.jobs.size(), 2U);
  EXPECT_EQ(recording.jobs[0].published.size(), 1U);
  EXPECT_EQ(recording.jobs[1].sample.parent.callback, 0U);
  EXPECT_EQ(recording.jobs[1].sample.published, at(2001));
}

TEST(Assembler, OverwritesBeyondTheDepthAndKeepsWhatIsUnread) {
  Recording recording;
  recording.make_nodes();
  for (const std::uint64_t i : {0, 1, 2})
    recording.publish(static_cast<std::int64_t>(2000 + 1000 * i), 5000 + i);
  recording.receive(6000, 5002);
  recording.publish(7000, 5003);
  recording.assembler.finish();
  EXPECT_EQ(recording.overwritten, (std::vector<std::uint64_t>{0, 1}));
  EXPECT_EQ(recording.jobs[3].sample.parent.number, 2U);
  EXPECT_EQ(recording.unread, (std::vector<std::uint64_t>{3}));
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

TEST(Assembler, TakesTheNearestPublicationWhereNoneHasATimestamp) {
  Recording recording;
  recording.make_nodes();
  recording.publish(2'000'000, 0);
  recording.receive(2'100'000, 2'000'500);
  EXPECT_EQ(recording.jobs[1].sample.parent.callback, 0U);
  EXPECT_EQ(recording.assembler.system().callbacks[1].strangers, 0U);
}

TEST(Assembler, SamplesOfWhatWasNotTracedHaveNoParent) {
  Recording recording;
  recording.make_nodes();
  recording.receive(3000, 2500);
  EXPECT_EQ(recording.jobs[0].sample.parent.callback, kNone);
  EXPECT_EQ(recording.assembler.system().callbacks[1].strangers, 1U);
}

/// A job publishes a sample within the process, and has not ended.
void publish_within_process(Recording& recording) {
  recording.make_nodes();
  recording.tell(K::buffer_to_ipb, 9, {31, 32});
  recording.tell(K::ipb_to_subscription, 10, {32, 22});
  recording.tell(K::callback_start, 2000, {11});
  recording.tell(K::intra_publish, 2001, {13, 99});
  recording.tell(K::ring_buffer_enqueue, 2002, {31, 4});
}

TEST(Assembler, SamplesWithinAProcessGoThroughTheRingBuffer) {
  Recording recording;
  publish_within_process(recording);
  recording.tell(K::rcl_publish, 2003, {13, 98});  // the same publication, for other processes
  recording.tell(K::callback_end, 2004, {11});
  recording.tell(K::ring_buffer_dequeue, 3000, {31, 4});
  recording.tell(K::callback_start, 3001, {21, 1});
  recording.tell(K::callback_end, 3002, {21});
  recording.assembler.finish();
  EXPECT_EQ(recording.assembler.system().callbacks[1].samples, 1U);
  EXPECT_EQ(recording.jobs[0].published.size(), 1U);
  EXPECT_EQ(recording.jobs[1].sample.parent.callback, 0U);
  EXPECT_TRUE(recording.unread.empty());
}

TEST(Assembler, ASampleThatAnotherThreadTakesAtOnceIsNotDeliveredTwice) {
  Recording recording;
  publish_within_process(recording);
  recording.tell(K::ring_buffer_dequeue, 2003, {31, 4}, {"", ""}, 2);
  recording.tell(K::rcl_publish, 2004, {13, 98});
  recording.tell(K::callback_end, 2005, {11});
  recording.assembler.finish();
  EXPECT_EQ(recording.assembler.system().callbacks[1].samples, 1U);
  EXPECT_TRUE(recording.unread.empty());
}

// In rclcpp's order: the object of an intra-process subscription (24) adds its callback (25) before
// an event says whose it is.
TEST(Assembler, IntraProcessCallbacksBelongToTheirSubscription) {
  Recording recording;
  recording.make_nodes();
  recording.tell(K::subscription_init, 9, {40, 2, 43, 1}, {"/b", ""});
  recording.tell(K::buffer_to_ipb, 10, {31, 32});
  recording.tell(K::ipb_to_subscription, 11, {32, 24});
  recording.tell(K::subscription_callback_added, 12, {24, 25});
  recording.tell(K::rclcpp_subscription_init, 13, {40, 24});
  recording.tell(K::rclcpp_subscription_init, 14, {40, 42});
  recording.tell(K::subscription_callback_added, 15, {42, 41});
  recording.tell(K::ring_buffer_enqueue, 2000, {31, 4});
  recording.tell(K::ring_buffer_dequeue, 3000, {31, 4});
  recording.tell(K::callback_start, 3001, {25, 1});
  recording.tell(K::callback_end, 3002, {25});
  ASSERT_EQ(recording.jobs.size(), 1U);
  EXPECT_EQ(recording.jobs[0].ref.callback, 2U);
  EXPECT_TRUE(recording.jobs[0].has_sample);
  EXPECT_EQ(recording.assembler.system().reused_handles, 0U);
  // Another subscription at the same addresses.
  recording.tell(K::subscription_init, 4000, {50, 1, 53, 1}, {"/a", ""});
  recording.tell(K::subscription_callback_added, 4001, {24, 25});
  recording.tell(K::rclcpp_subscription_init, 4002, {50, 24});
  recording.tell(K::callback_start, 5000, {25, 1});
  recording.tell(K::callback_end, 5001, {25});
  EXPECT_EQ(recording.jobs[1].ref.callback, 3U);
}

TEST(Assembler, CallbacksThatNeverEndCountAsRunning) {
  Recording recording;
  recording.make_nodes();
  recording.tell(K::callback_start, 2000, {11});
  recording.tell(K::callback_start, 3000, {11});  // its end was lost
  recording.tell(K::callback_end, 3001, {11});
  recording.tell(K::callback_end, 3002, {11});
  recording.tell(K::callback_start, 4000, {11});
  recording.assembler.finish();
  EXPECT_EQ(recording.assembler.system().callbacks[0].jobs, 1U);
  EXPECT_EQ(recording.assembler.system().callbacks[0].never_ended, 2U);
  EXPECT_EQ(recording.assembler.system().ends_without_start, 1U);
  EXPECT_FALSE(recording.jobs[0].ended);
}

TEST(Assembler, HandlesUsedAgainMeanTheLatestCallback) {
  Recording recording;
  recording.make_nodes();
  recording.publish(2000, 5000);
  recording.tell(K::timer_init, 3000, {10, 5000});
  recording.tell(K::timer_callback_added, 3001, {10, 11});
  recording.tell(K::timer_link_node, 3002, {10, 2});
  recording.publish(4000, 5001);
  EXPECT_EQ(recording.assembler.system().reused_handles, 1U);
  EXPECT_EQ(recording.jobs[0].ref.callback, 0U);
  EXPECT_EQ(recording.jobs[1].ref.callback, 2U);
}

/// Node 1 with a service (callback 31) and node 2 with its client.
void make_service(Recording& recording) {
  recording.make_nodes();
  recording.tell(K::service_init, 10, {30, 1}, {"/map", ""});
  recording.tell(K::service_callback_added, 11, {30, 31});
  recording.tell(K::client_init, 12, {40, 2}, {"/map", ""});
}

TEST(Assembler, ThreadsThatHaveEndedMakeRoomForOthers) {
  Recording recording;
  recording.make_nodes();
  const System& system = recording.assembler.system();
  for (std::uint32_t thread = 2; thread < 1000; ++thread) {
    recording.tell(K::callback_start, 1000 * thread, {11}, {"", ""}, thread);
    recording.assembler.forget_thread(7, thread);  // its job is open
    recording.tell(K::callback_end, 1000 * thread + 1, {11}, {"", ""}, thread);
    const std::uint32_t index = recording.jobs.back().thread;
    EXPECT_EQ(system.threads[index].id, thread);
    EXPECT_EQ(system.threads[index].jobs, 1U);
    recording.assembler.forget_thread(7, thread);
    EXPECT_EQ(system.threads[index].id, 0U);
  }
  EXPECT_EQ(recording.jobs.size(), 998U);
  EXPECT_LE(system.threads.size(), 2U);
}

TEST(Assembler, AServiceIsNoTopicOfThatName) {
  Recording recording;
  make_service(recording);
  recording.tell(K::publisher_init, 13, {50, 1, 51}, {"/map", ""});
  const System& system = recording.assembler.system();
  EXPECT_NE(system.endpoints.back().topic, system.callbacks.back().topic);
  EXPECT_EQ(system.clients.back().service, system.callbacks.back().topic);
}

void answer(Recording& recording, std::int64_t at_ns) {
  recording.tell(K::get_next_ready, at_ns, {});
  recording.tell(K::callback_start, at_ns + 1, {31});
  recording.tell(K::callback_end, at_ns + 2, {31});
}

constexpr std::int64_t kLong_ns = 50'000;

TEST(Unannounced, AQuestionWithoutAWaitFollowsAResponse) {
  Recording recording;
  make_service(recording);
  answer(recording, 1000);
  recording.tell(K::get_next_ready, 2000, {});
  recording.tell(K::get_next_ready, 2000 + kLong_ns, {});
  recording.tell(K::wait_for_work, 2001 + kLong_ns, {});
  recording.tell(K::get_next_ready, 2001 + 3 * kLong_ns, {});
  ASSERT_EQ(recording.jobs.size(), 2U);
  const Job& response = recording.jobs.back();
  const System& system = recording.assembler.system();
  const Callback& client = system.callbacks[response.ref.callback];
  EXPECT_EQ(client.kind, CallbackKind::client);
  EXPECT_EQ(system.nodes[client.node], "/space/sink");
  EXPECT_EQ(system.topics[client.topic].name, "/map/response");
  EXPECT_EQ(response.start, at(2000));
  EXPECT_EQ(response.finish, at(2000 + kLong_ns));
  EXPECT_EQ(response.sample.published, at(1002));
  EXPECT_EQ(response.sample.parent.callback, recording.jobs.front().ref.callback);
  EXPECT_EQ(recording.jobs.front().published.front().topic, client.topic);
}

TEST(Assembler, AJobAnswersTheLastQuestionOfItsThread) {
  Recording recording;
  recording.make_nodes();
  recording.tell(K::callback_register, 9, {11}, {"message_filters::Subscriber<M>::cb", ""});
  recording.tell(K::get_next_ready, 1000, {});
  recording.tell(K::wait_for_work, 1001, {});
  recording.tell(K::get_next_ready, 2000, {});
  recording.tell(K::execute, 2001, {10});
  recording.publish(2002, 0);
  recording.publish(2010, 0);
  ASSERT_EQ(recording.jobs.size(), 2U);
  EXPECT_EQ(recording.jobs[0].decided, at(2000));
  EXPECT_LT(recording.jobs[0].question, recording.jobs[0].started);
  EXPECT_EQ(recording.jobs[1].decided, Time{}) << "it has no question";
  EXPECT_EQ(recording.assembler.system().callbacks[0].symbol, "message_filters::Subscriber<M>::cb");
}

TEST(Unannounced, ShortOrAnnouncedGapsAreNoJobs) {
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

TEST(Unannounced, WithoutAResponseItBelongsToTheThread) {
  Recording recording;
  recording.make_nodes();
  recording.tell(K::get_next_ready, 1000, {});
  recording.tell(K::rcl_publish, 1001, {13, 99});  // a waitable may publish
  recording.tell(K::get_next_ready, 1002, {});
  ASSERT_EQ(recording.jobs.size(), 1U);
  const System& system = recording.assembler.system();
  const Callback& callback = system.callbacks[recording.jobs[0].ref.callback];
  EXPECT_EQ(callback.kind, CallbackKind::unannounced);
  EXPECT_EQ(system.nodes[callback.node], "/clients_and_waitables");
  EXPECT_EQ(recording.jobs[0].published.size(), 1U);
  recording.receive(2000, 0);
}

TEST(Unannounced, ThreadsThatWaitForEachOtherTellNothing) {
  Recording recording;
  recording.make_nodes();
  for (const std::uint32_t thread : {1U, 2U}) recording.tell(K::wait_for_work, 500, {}, {"", ""}, thread);
  recording.tell(K::get_next_ready, 1000, {});
  recording.tell(K::get_next_ready, 1000 + kLong_ns, {});
  recording.assembler.finish();
  EXPECT_TRUE(recording.jobs.empty());
  EXPECT_EQ(recording.assembler.system().unclear_callbacks, 1U);
}

/// The events of a PriorityExecutor (90) as LTTng records them.
TEST(Unannounced, AnExecutorStatesClientsAndWaitables) {
  Recording recording;
  make_service(recording);
  recording.tell(K::executor_init, 100, {90}, {"rm-ro", ""});
  recording.tell(K::executor_callback, 101, {90, 0, 10}, {"timer", "/source"});
  recording.tell(K::executor_callback, 102, {90, 1, 40}, {"client", "/space/sink"});
  recording.tell(K::executor_callback, 103, {90, 2, 0}, {"waitable", "/source"});
  recording.tell(K::executor_job, 200, {90, 1, 150, 160});
  recording.tell(K::executor_end, 220, {90, 1});
  recording.tell(K::executor_job, 230, {90, 2, 210, 211});
  recording.tell(K::executor_end, 260, {90, 2});
  recording.tell(K::executor_job, 300, {90, 0, 270, 271});
  recording.tell(K::callback_start, 301, {11});
  recording.tell(K::callback_end, 302, {11});
  const System& system = recording.assembler.system();
  ASSERT_EQ(recording.jobs.size(), 3U);
  EXPECT_EQ(system.callbacks[recording.jobs[0].ref.callback].kind, CallbackKind::client);
  EXPECT_EQ(recording.jobs[0].finish - recording.jobs[0].start, Duration(20));
  EXPECT_EQ(recording.jobs[0].sample.published, at(150));
  const Callback& waitable = system.callbacks[recording.jobs[1].ref.callback];
  EXPECT_EQ(waitable.kind, CallbackKind::unannounced);
  EXPECT_EQ(system.nodes[waitable.node], "/source");
  EXPECT_EQ(recording.jobs[2].timestamp, at(270));
  EXPECT_EQ(recording.jobs[2].release, at(271));
  EXPECT_TRUE(system.stated_executors.front().states_ends);
}

/// Traces of versions that write no ends.
TEST(Unannounced, AStatedJobWithoutEndDoesNotCount) {
  Recording recording;
  make_service(recording);
  recording.tell(K::executor_init, 100, {90}, {"rm-ro", ""});
  recording.tell(K::executor_callback, 102, {90, 1, 40}, {"client", "/space/sink"});
  for (const std::int64_t start : {200, 300}) recording.tell(K::executor_job, start, {90, 1, 150, 160});
  recording.tell(K::executor_job, 400, {90, 0, 150, 160});
  recording.assembler.finish();
  EXPECT_TRUE(recording.jobs.empty());
}

}  // namespace
}  // namespace hotpath::tracing
