// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/run_channel.hpp"

#include <gmock/gmock.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

namespace hotpath::channel_test {

using Kind = ChannelMessage::Kind;
using ::testing::Eq;
using ::testing::StrEq;

Time soon() { return std::chrono::steady_clock::now() + std::chrono::seconds(30); }

ChannelMessage message(Kind kind, std::int64_t number = 0) { return ChannelMessage(kind, {number}); }

TEST(Channel, DeliversMessagesWholeAndInOrder) {
  const auto [a, b] = Channel::make_pair();
  const ChannelMessage sent(Kind::done, {-5, 0, 0, 7}, "executor other");
  ASSERT_TRUE(a.send(sent));
  ASSERT_TRUE(a.send(message(Kind::stop)));

  const auto first = b.receive(soon());
  ASSERT_TRUE(first);
  EXPECT_EQ(first->kind, Kind::done);
  EXPECT_EQ(first->number, sent.number);
  EXPECT_THAT(first->text.data(), StrEq("executor other"));
  EXPECT_EQ(b.receive(soon())->kind, Kind::stop);

  ASSERT_EQ(send(a.for_program(), std::string(2000, 'x').data(), 2000, 0), 2000);
  const auto strange = b.receive(soon());
  EXPECT_EQ(strange->kind, Kind::failed);
  EXPECT_THAT(strange->text.data(), StrEq(kOtherLayout));
}

TEST(Channel, TextThatIsTooLongIsCutAndStaysTerminated) {
  ChannelMessage m = message(Kind::failed);
  m.set_text(std::string(5000, 'x'));
  EXPECT_THAT(std::string(m.text.data()), Eq(std::string(m.text.size() - 1, 'x')));
  m.set_text("short");
  EXPECT_THAT(m.text.data(), StrEq("short"));
}

TEST(Channel, TakesOnlyWhatHasArrivedOnceTheInstantHasPassed) {
  const auto [a, b] = Channel::make_pair();
  const Time passed = std::chrono::steady_clock::now() - std::chrono::seconds(1);
  EXPECT_FALSE(b.receive(passed));
  ASSERT_TRUE(a.send(message(Kind::matched)));
  EXPECT_TRUE(b.receive(passed));
}

TEST(Channel, ClosedEndIsNoticedAfterItsLastMessage) {
  auto [a, b] = Channel::make_pair();
  ASSERT_TRUE(a.send(message(Kind::failed)));
  a = Channel();
  EXPECT_EQ(b.receive(soon())->kind, Kind::failed);
  EXPECT_EQ(b.receive(soon())->kind, Kind::closed);
  EXPECT_FALSE(b.send(message(Kind::stop))) << "and no SIGPIPE";
}

TEST(Channel, SignalEndsTheWaitWithoutClosingIt) {
  const auto [a, b] = Channel::make_pair();
  struct sigaction action {};
  action.sa_handler = [](int) {};
  sigaction(SIGALRM, &action, nullptr);
  // Repeated, since the first signal might come before the wait begins.
  const itimerval often{{0, 1000}, {0, 1000}};
  setitimer(ITIMER_REAL, &often, nullptr);
  EXPECT_FALSE(b.receive(soon()));
  const itimerval never{};
  setitimer(ITIMER_REAL, &never, nullptr);
}

}  // namespace hotpath::channel_test
