// SPDX-License-Identifier: Apache-2.0
#include "bounded_queue.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace hotpath::bounded_queue_test {

using namespace std::chrono_literals;

const auto kNow = std::chrono::steady_clock::time_point{};

TEST(BoundedQueue, GivesBackInOrder) {
  BoundedQueue<int> queue(3, 100);
  EXPECT_TRUE(queue.push(1, 1));
  EXPECT_TRUE(queue.push(2, 1));
  EXPECT_EQ(queue.pop(kNow), 1);
  EXPECT_EQ(queue.pop(kNow), 2);
  EXPECT_EQ(queue.pop(kNow), std::nullopt);
}

TEST(BoundedQueue, RefusesWhatIsTooMany) {
  BoundedQueue<int> queue(2, 100);
  EXPECT_TRUE(queue.push(1, 1));
  EXPECT_TRUE(queue.push(2, 1));
  EXPECT_FALSE(queue.push(3, 1));
  EXPECT_TRUE(queue.push(4, 1, true));
  EXPECT_EQ(queue.pop(kNow), 1);
  EXPECT_FALSE(queue.push(5, 1));
  EXPECT_EQ(queue.pop(kNow), 2);
  EXPECT_TRUE(queue.push(6, 1));
}

TEST(BoundedQueue, TakesTwiceAsMuchOfWhatIsRare) {
  BoundedQueue<int> queue(3, 100);
  EXPECT_TRUE(queue.push(1, 100));
  EXPECT_FALSE(queue.push(2, 1));
  EXPECT_TRUE(queue.push(3, 100, true));
  EXPECT_FALSE(queue.push(4, 1, true));
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(queue.push(5, 0, true));
  EXPECT_FALSE(queue.push(6, 0, true));
}

TEST(BoundedQueue, RefusesTooManyBytesUnlessAlone) {
  BoundedQueue<int> queue(10, 100);
  EXPECT_TRUE(queue.push(1, 1000));
  EXPECT_FALSE(queue.push(2, 1));
  EXPECT_EQ(queue.pop(kNow), 1);
  EXPECT_TRUE(queue.push(3, 60));
  EXPECT_FALSE(queue.push(4, 41));
  EXPECT_TRUE(queue.push(5, 40));
}

TEST(BoundedQueue, WakesWhoWaits) {
  BoundedQueue<int> queue(1, 100);
  std::thread sender([&] { queue.push(7, 1); });
  EXPECT_EQ(queue.pop(std::chrono::steady_clock::now() + 60s), 7);
  sender.join();
}

}  // namespace hotpath::bounded_queue_test
