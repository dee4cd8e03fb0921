// SPDX-License-Identifier: Apache-2.0
// The parts of the live executors, one at a time.
#include <gmock/gmock.h>

#include <array>
#include <thread>

#include "hotpath/live/intra_process_transport.hpp"
#include "hotpath/live/parker.hpp"
#include "hotpath/live/record_log.hpp"
#include "hotpath/live/thread_setup.hpp"

namespace hotpath::live_parts_test {

TEST(Parker, DoesNotSleepWhenWokenAfterTheTicketWasRead) {
  Parker parker;
  const std::uint32_t ticket = parker.ticket();
  parker.unpark();
  parker.park_until(ticket, kNever);  // would hang
  EXPECT_NE(parker.ticket(), ticket);
}

TEST(RecordLog, CountsWhatDoesNotFit) {
  alignas(64) std::array<std::byte, RecordLog<int>::bytes(3)> memory{};
  auto log = RecordLog<int>::create(memory.data(), 3);
  for (int i = 0; i < 5; ++i) log.append(i);
  const auto reopened = RecordLog<int>::open(memory.data());
  EXPECT_THAT(reopened.contents(), testing::ElementsAre(0, 1, 2));
  EXPECT_EQ(reopened.lost(), 2u);
}

struct CountingOwner final : SampleOwner {
  void give_back(const void*, std::uintptr_t token) noexcept override { returned.push_back(token); }
  void lend_again(std::uintptr_t token) noexcept override { shared.push_back(token); }
  std::vector<std::uintptr_t> returned, shared;
};

TEST(Sample, GoesBackExactlyOnce) {
  CountingOwner owner;
  const int data = 7;
  {
    Sample first(&data, owner, 1);
    Sample moved = std::move(first);
    EXPECT_FALSE(first);  // NOLINT: moved-from samples are empty by contract
    EXPECT_EQ(moved.as<int>(), 7);
    moved = Sample(&data, owner, 2);
    EXPECT_THAT(owner.returned, testing::ElementsAre(1));
  }
  EXPECT_THAT(owner.returned, testing::ElementsAre(1, 2));
}

struct Collected final : SampleSink {
  void deliver(TaskId task, const SampleInfo& info, Sample sample) override {
    tasks.push_back(task);
    parents.push_back(info.parent);
    samples.push_back(std::move(sample));
  }
  std::vector<TaskId> tasks;
  std::vector<JobRef> parents;
  std::vector<Sample> samples;
};

TEST(IntraProcessTransport, AllReadersShareOneMessageThatOutlivesThePublication) {
  Collected sink;
  IntraProcessTransport<int> transport;
  const auto writer = transport.add_writer("t", 1, 2);
  transport.add_reader("t", 4, 1, 1, sink);
  transport.add_reader("t", 5, 1, 1, sink);
  transport.add_reader("other", 6, 1, 0, sink);

  int& message = transport.borrow(writer);
  message = 42;
  SampleInfo info;
  info.parent = {3, 9};
  transport.publish(writer, message, info);

  EXPECT_THAT(sink.tasks, testing::ElementsAre(4, 5));
  EXPECT_EQ(sink.parents[1], (JobRef{3, 9}));
  EXPECT_EQ(&sink.samples[0].as<int>(), &sink.samples[1].as<int>());
  // The block is not lent again while a reader holds it.
  EXPECT_NE(&transport.borrow(writer), &message);
  sink.samples.pop_back();
  EXPECT_EQ(sink.samples[0].as<int>(), 42);
  sink.samples.clear();
  EXPECT_EQ(&transport.borrow(writer), &message);
}

TEST(ThreadPolicy, IsReadAndWrittenTheSameWay) {
  for (const char* text : {"other", "other:-5", "batch", "idle:19", "fifo:80", "rr:1", "deadline:2.5/10/10",
                           "deadline:0.001024/100000/1000000"})
    EXPECT_EQ(to_string(parse_thread_policy(text)), text);
  for (const char* text : {"", "fifo", "fifo:", "fifo:0", "fifo:100", "fifo:8x", "idles", "other:20",
                           "deadline", "deadline:1", "deadline:1/2", "deadline:1/2/3/4", "deadline:1/2/",
                           "deadline:2/1/3", "deadline:1/3/2", "deadline:-1/2/3", "deadline:0.001/2/3"}) {
    EXPECT_THROW((void)parse_thread_policy(text), std::invalid_argument) << text;
  }
}

TEST(ThreadPolicy, OfADeadlineIsObtainedOrRefusedWithARemedy) {
  const ThreadPolicyRequest request{parse_thread_policy("deadline:1/100/100"), true, {}};
  const std::string refused = refusal(request);
  if (refused.empty()) {
    int obtained = -1;
    std::thread([&] {
      EXPECT_EQ(apply_thread_policy(request), request.policy);
      obtained = sched_getscheduler(0);
      EXPECT_EQ(own_thread_policy(), request.policy);
    }).join();
    EXPECT_EQ(obtained & ~SCHED_RESET_ON_FORK, SCHED_DEADLINE);
  } else {
    EXPECT_NE(refused.find("deadline:1/100/100 was refused"), std::string::npos) << refused;
  }
}

TEST(ThreadPolicy, OfTheOwnThreadIsRead) {
  for (const char* text : {"other:19", "batch:19", "idle:19"}) {
    std::thread([&] {
      static_cast<void>(apply_thread_policy({parse_thread_policy(text), true, {}}));
      EXPECT_EQ(to_string(own_thread_policy()), text);
    }).join();
  }
}

TEST(PinToCpus, RefusesAProcessorThatDoesNotExist) {
  const std::vector<int> before = allowed_cpus();
  EXPECT_THROW(pin_to_cpus({before.back(), 1000}), ThreadSetupError);
  pin_to_cpus({before.back()});
  EXPECT_EQ(allowed_cpus(), std::vector<int>{before.back()});
  pin_to_cpus(before);
}

}  // namespace hotpath::live_parts_test
