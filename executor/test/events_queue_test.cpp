// SPDX-License-Identifier: Apache-2.0
// Order of the events queues: first in first out (stock), and the priority order with its ties and rules.
#include <gtest/gtest.h>

#include <random>

#include "hotpath/core/events_queue.hpp"
#include "task_sets.hpp"

namespace hotpath::test::events_queue_test {

Job job(TaskId task, std::uint64_t sequence = 0, Time deadline = kNever) {
  return {.task = task, .sequence = sequence, .deadline = deadline};
}

std::vector<JobRef> drain(EventsQueue& queue) {
  std::vector<JobRef> order;
  while (!queue.empty()) order.push_back(queue.pop().ref());
  return order;
}

std::vector<JobRef> order(const TaskSet& set, Policy policy, const std::vector<Job>& pushed) {
  PriorityEventsQueue queue(PriorityOrder(set, policy, SubscriptionRule::inherit, Ties::lifo));
  for (const Job& j : pushed) queue.push(j);
  EXPECT_EQ(queue.size(), pushed.size());
  return drain(queue);
}

TEST(SimpleEventsQueue, IsFirstInFirstOutAcrossGrowthAndWrapAround) {
  SimpleEventsQueue queue;
  std::uint64_t pushed = 0, popped = 0;
  for (int round = 0; round < 50; ++round) {
    for (int i = 0; i < 13; ++i) queue.push(job(0, pushed++));
    for (int i = 0; i < 7; ++i) ASSERT_EQ(queue.pop().sequence, popped++);
  }
  EXPECT_EQ(queue.size(), 300U);
  std::uint64_t visited = 0;
  queue.for_each([&](const Job& j) { EXPECT_EQ(j.sequence, popped + visited++); });
  EXPECT_EQ(visited, 300U);
  while (!queue.empty()) ASSERT_EQ(queue.pop().sequence, popped++);
  EXPECT_EQ(popped, pushed);
}

TEST(SimpleEventsQueue, GivesTheFirstThatMayRunAndKeepsTheOrderOfTheOthers) {
  SimpleEventsQueue queue;
  for (TaskId id = 0; id < 4; ++id) queue.push(job(id));
  EXPECT_EQ(queue.pop_first([](const Job& j) { return j.task >= 2; })->task, 2U);
  EXPECT_FALSE(queue.pop_first([](const Job& j) { return j.task > 3; }));
  const std::vector<JobRef> rest = {{0, 0}, {1, 0}, {3, 0}};
  EXPECT_EQ(drain(queue), rest);
}

/// The scheduler's use with several workers: at most one job of a group runs at a time.
TEST(PriorityEventsQueue, WithBusyGroupsGivesTheSameJobsAsASearch) {
  TaskSet set;
  constexpr TaskId kTasks = 12;
  for (TaskId id = 0; id < kTasks; ++id) {
    add_timer(set, (10 + id % 5) * 1ms, 1ms);
    set.tasks[id].group = id % 4;
  }
  std::mt19937 random(7);
  const auto draw = [&](std::uint32_t below) { return static_cast<std::uint32_t>(random() % below); };
  PriorityEventsQueue queue(PriorityOrder(set, Policy::rm, SubscriptionRule::inherit, Ties::fifo));
  PriorityEventsQueue searched = queue;
  std::vector<bool> busy(4, false);
  std::uint64_t sequence = 0, taken = 0;
  for (int step = 0; step < 20000; ++step) {
    if (draw(3) == 0) {
      const Job pushed = job(draw(kTasks), sequence++);
      queue.push(pushed);
      searched.push(pushed);
    }
    if (const std::uint32_t group = draw(4); busy[group] && draw(2) == 0) {
      busy[group] = false;
      queue.group_freed(group);
    }
    if (draw(500) == 0) {  // a task leaves, and a search takes a job of one task
      const TaskId gone = draw(kTasks), wanted = draw(kTasks);
      queue.erase(gone, [](const Job&) {});
      searched.erase(gone, [](const Job&) {});
      const auto of_task = [&](const Job& j) { return j.task == wanted; };
      ASSERT_EQ(queue.pop_first(of_task) == nullptr, searched.pop_first(of_task) == nullptr);
    }
    const Job* const next = queue.pop_free(set, busy);
    const Job* const expected = searched.pop_first([&](const Job& j) { return !busy[set[j.task].group]; });
    ASSERT_EQ(next == nullptr, expected == nullptr) << step;
    ASSERT_EQ(queue.size(), searched.size());
    if (next == nullptr) continue;
    ASSERT_EQ(next->ref(), expected->ref()) << step;
    busy[set[next->task].group] = true;
    ++taken;
  }
  EXPECT_GT(taken, 1000U);
  StateWords a(Time{}), b(Time{});
  queue.describe(a);
  searched.describe(b);
  EXPECT_EQ(a.take_words(), b.take_words());
}

/// Timers 0 (30 ms), 1 (10 ms), 2 (10 ms); subscriptions 3 (fed by 0), 4 (by 1), 5 (by 0 and 1), 6
/// (by none).
class PriorityOrderTest : public testing::Test {
 protected:
  PriorityOrderTest() {
    add_timer(set, 30ms, 1ms);
    add_timer(set, 10ms, 1ms);
    add_timer(set, 10ms, 1ms);
    add_subscription(set, {0}, 1ms);
    add_subscription(set, {1}, 1ms);
    add_subscription(set, {0, 1}, 1ms);
    add_subscription(set, {}, 1ms);
  }
  TaskSet set;
};

TEST_F(PriorityOrderTest, LevelsFollowTasksThatComeAndGo) {
  PriorityOrder order(set, Policy::rm, SubscriptionRule::inherit, Ties::lifo);
  EXPECT_EQ(order.level(3), to_ns(at(30ms)));
  JoiningTask faster;
  faster.task.period = 5ms;
  faster.task.feeds = {3};
  const TaskId id = join(set, faster);
  order.update(set);
  EXPECT_EQ(order.level(3), to_ns(at(5ms)));
  EXPECT_EQ(order.level(id), to_ns(at(5ms)));
  leave(set, id);
  leave(set, 1);
  order.update(set);
  EXPECT_EQ(order.level(3), to_ns(at(30ms)));
  EXPECT_EQ(order.level(5), to_ns(at(30ms)));  // was task 1's level
}

TEST_F(PriorityOrderTest, InheritanceReachesThroughChainsAndAcrossCycles) {
  set.tasks[4].feeds = {6};
  set.tasks[6].feeds = {4};
  const std::vector<std::int64_t> level = inherited_levels(set, Policy::rm);
  EXPECT_EQ(level[6], Duration(10ms).count());
}

/// The other ties and the rule that puts subscriptions first: bench/test/independent/.
TEST_F(PriorityOrderTest, OrdersJobs) {
  set.tasks[0].deadline = 5ms;
  set.tasks[0].priority = 1;
  set.tasks[2].priority = -4;
  const auto due = [](TaskId task, Duration deadline) { return job(task, 0, at(deadline)); };
  struct Case {
    const char* what;
    Policy policy;
    std::vector<Job> pushed;
    std::vector<JobRef> popped;
  };
  for (const Case& c : std::vector<Case>{
           {"the shorter period", Policy::rm, {job(0), job(1)}, {{1, 0}, {0, 0}}},
           {"the shorter relative deadline", Policy::dm, {job(1), job(0)}, {{0, 0}, {1, 0}}},
           {"the smaller number, none last", Policy::fp, {job(1), job(0), job(2)}, {{2, 0}, {0, 0}, {1, 0}}},
           {"the earlier absolute deadline",
            Policy::edf,
            {due(1, 20ms), due(0, 19ms), due(3, 18ms)},
            {{3, 0}, {0, 0}, {1, 0}}},
           {"no period", Policy::fifo, {job(0), job(1), job(4)}, {{0, 0}, {1, 0}, {4, 0}}},
           {"at equal priority subscriptions, the youngest first",
            Policy::rm,
            {job(1), job(4, 0), job(4, 1), job(5), job(2)},
            {{5, 0}, {4, 1}, {4, 0}, {1, 0}, {2, 0}}},
           {"at equal priority timers by task, then by timestamp",
            Policy::rm,
            {job(2, 0), job(1, 8), job(2, 1), job(1, 7)},
            {{1, 7}, {1, 8}, {2, 0}, {2, 1}}},
           {"equal deadlines are ties",
            Policy::edf,
            {due(2, 9ms), job(1, 5, at(9ms)), due(3, 9ms)},
            {{3, 0}, {1, 5}, {2, 0}}},
       }) {
    EXPECT_EQ(order(set, c.policy, c.pushed), c.popped) << c.what;
  }
  set.tasks[2].always_due = true;
  EXPECT_EQ(order(set, Policy::fp, {job(0), job(2)}), (std::vector<JobRef>{{2, 0}, {0, 0}}));
}

}  // namespace hotpath::test::events_queue_test
