// SPDX-License-Identifier: Apache-2.0
// Runs the live executor's loop (lock, park, unpark, deliver, stop, close) under a scheduler that
// explores interleavings of its threads. For each executor there are two short runs; in the second,
// two tasks share a callback group. The test explores these runs with at most HOTPATH_PREEMPTIONS
// (default 1) preemptions or spurious wake-ups: all interleavings, or the first
// HOTPATH_INTERLEAVINGS (default 2000). Then it runs the same number of random interleavings,
// alternating between two longer runs. The invariants of simulated schedules must hold for each,
// and no thread may sleep while work waits for it. The counts are properties of the test program;
// launch_scripts/nightly.sh stores them.
#include <gtest/gtest.h>

#include <random>

#include "controlled_run.hpp"

namespace hotpath::test::interleavings_test {

/// Enumerates all choices with at most this many preemptions.
class AllChoices final : public Choices {
 public:
  explicit AllChoices(std::size_t most_preemptions) : left_(most_preemptions), most_(most_preemptions) {}

  std::size_t choose(std::size_t options, std::size_t free) override {
    if (at_ == path_.size()) path_.push_back({left_ == 0 ? free : options, 0});
    const std::size_t chosen = path_[at_++].chosen;
    if (chosen >= free) --left_;
    return chosen;
  }

  /// Advances to the next interleaving; false if there is none.
  bool next() {
    at_ = 0;
    left_ = most_;
    while (!path_.empty() && path_.back().chosen + 1 >= path_.back().options) path_.pop_back();
    if (path_.empty()) return false;
    ++path_.back().chosen;
    return true;
  }

 private:
  struct Choice {
    std::size_t options, chosen;
  };
  std::vector<Choice> path_;
  std::size_t at_ = 0, left_, most_;
};

class RandomChoices final : public Choices {
 public:
  explicit RandomChoices(std::uint64_t seed) : random_(seed) {}
  std::size_t choose(std::size_t options, std::size_t free) override {
    // Preempts rarely: many consecutive steps reach states that a switch at each step does not.
    return random_() % (random_() % 4 != 0 ? free : options);
  }

 private:
  std::mt19937_64 random_;
};

constexpr ControlledRun::Plan kShort[] = {{300ns, 1, 250ns}, {300ns, 1, 250ns, true}};
constexpr ControlledRun::Plan kLong[] = {{1500ns, 4, 1400ns}, {1500ns, 4, 1400ns, true}};

constexpr std::uint64_t kDefaultCount = 2000;

struct Explored {
  std::uint64_t interleavings = 0;
  bool complete = false;          ///< Whether all interleavings were explored.
  std::size_t notifications = 0;  ///< Largest number in one run.
  std::string defect;             ///< Defect of the first faulty interleaving; empty if there is none.
};

struct Broken {
  Fault fault = Fault::none;
  std::size_t lost = 0;         ///< Number of the lost notification.
  std::size_t preemptions = 0;  ///< Additional preemptions.
};

Explored explore_all(const std::string& executor, const ControlledRun::Plan& plan, Broken broken = {}) {
  Explored explored;
  AllChoices choices(from_environment("HOTPATH_PREEMPTIONS", 1) + broken.preemptions);
  const std::uint64_t most = from_environment("HOTPATH_INTERLEAVINGS", kDefaultCount);
  do {
    World world(choices, broken.fault, broken.lost);
    explored.defect = ControlledRun(executor, world, plan).run();
    explored.notifications = std::max(explored.notifications, world.notifications());
    ++explored.interleavings;
    explored.complete = !choices.next();
  } while (explored.defect.empty() && !explored.complete && explored.interleavings < most);
  return explored;
}

Explored explore_at_random(const std::string& executor, std::uint64_t count) {
  Explored explored;
  while (explored.defect.empty() && explored.interleavings < count) {
    RandomChoices choices(++explored.interleavings);
    World world(choices, Fault::none);
    explored.defect = ControlledRun(executor, world, kLong[explored.interleavings % 2]).run();
  }
  return explored;
}

std::uint64_t total_systematic = 0, total_random = 0, complete = 0, lost_and_found = 0;

class Interleavings : public testing::TestWithParam<std::string_view> {};

TEST_P(Interleavings, ThoseWithFewPreemptionsAreAccepted) {
  bool all = true;
  for (const auto& plan : kShort) {
    const Explored explored = explore_all(std::string(GetParam()), plan);
    EXPECT_EQ(explored.defect, "") << "in interleaving " << explored.interleavings;
    EXPECT_GT(explored.interleavings, 20u);
    total_systematic += explored.interleavings;
    all &= explored.complete;
  }
  complete += all;
}

TEST_P(Interleavings, RandomOnesAreAccepted) {
  const Explored explored =
      explore_at_random(std::string(GetParam()), from_environment("HOTPATH_INTERLEAVINGS", kDefaultCount));
  EXPECT_EQ(explored.defect, "") << "with seed " << explored.interleavings;
  total_random += explored.interleavings;
}

// No notification is redundant: without it the waiter may wait for ever, or stop() may take the
// worker that missed it for awake.
TEST_P(Interleavings, EveryLostNotificationIsDetected) {
  for (const auto& plan : kShort) {
    for (std::size_t lost = 1;; ++lost) {
      const Explored explored = explore_all(std::string(GetParam()), plan, {.lost = lost});
      if (explored.notifications < lost) break;  // no run has this many notifications
      EXPECT_NE(explored.defect, "") << "without notification " << lost;
      ++lost_and_found;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Registry, Interleavings, testing::ValuesIn(executor_names()),
                         [](const auto& executor) { return identifier(executor.param); });

// These tests prove that the check detects the defects.
TEST(BrokenExecutor, ThatSleepsAfterBeingWokenOrTrustsASpuriousWakeUpIsDetected) {
  for (const Broken& broken : {Broken{Fault::ticket_ignored, 0, 1}, Broken{Fault::early_is_due}}) {
    const Explored explored = explore_all("events-ro", kShort[0], broken);
    EXPECT_NE(explored.defect, "");
    EXPECT_GT(explored.interleavings, 1u) << "a run without preemption or spurious wake-up must not show it";
  }
}

TEST(BrokenExecutor, ThatIgnoresASharedGroupIsDetected) {
  const Explored explored = explore_all("multi", kShort[1], {Fault::group_ignored});
  EXPECT_EQ(explored.defect.rfind("its group is busy", 0), 0u) << explored.defect;
}

class Counts final : public testing::Environment {
  void TearDown() override {
    const auto record = [](const char* name, std::uint64_t count) {
      testing::Test::RecordProperty(name, std::to_string(count));
    };
    record("preemptions", from_environment("HOTPATH_PREEMPTIONS", 1));
    record("systematic", total_systematic);
    record("complete", complete);
    record("random", total_random);
    record("lost_and_found", lost_and_found);
    record("executors", executors().size());
  }
};
const auto* const counts = testing::AddGlobalTestEnvironment(new Counts);

}  // namespace hotpath::test::interleavings_test
