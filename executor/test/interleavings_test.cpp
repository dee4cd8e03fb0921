// SPDX-License-Identifier: Apache-2.0
// The live executor's loop (lock, park, unpark, deliver, stop, close) under a scheduler that tries
// interleavings of its threads. Of each executor: a short run with at most HOTPATH_PREEMPTIONS (default 1)
// preemptions, all of them or the first HOTPATH_INTERLEAVINGS (default 2000); then as many of a longer run at
// random. What is true of simulated schedules must be true of each, and no thread may sleep while something
// waits for it. With HOTPATH_RELIABILITY, a folder, the counts are written to its interleavings.json.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <random>

#include "../src/live/executor_threads.hpp"
#include "controlled_threads.hpp"
#include "schedule_checks.hpp"

namespace hotpath::test {
namespace {

using namespace std::chrono_literals;

/// All choices with at most so many preemptions, one after another.
class AllChoices final : public Choices {
 public:
  explicit AllChoices(std::size_t most_preemptions) : left_(most_preemptions), most_(most_preemptions) {}

  std::size_t choose(std::size_t options, std::size_t free) override {
    if (at_ == path_.size()) path_.push_back({left_ == 0 ? free : options, 0});
    const std::size_t chosen = path_[at_++].chosen;
    if (chosen >= free) --left_;
    return chosen;
  }

  /// Goes to the next interleaving; false: there is none.
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
    // Mostly without: many steps in one go reach states that a switch at each step does not.
    return random_() % (random_() % 4 != 0 ? free : options);
  }

 private:
  std::mt19937_64 random_;
};

/// timer -> a, and b, whose samples come from outside; three callback groups.
TaskSet timer_and_two_subscriptions() {
  TaskSet set;
  set.tasks.resize(3);
  set.groups.assign(3, CallbackGroup::mutually_exclusive);
  for (TaskId id = 0; id < 3; ++id) {
    set.tasks[id].group = id;
    set.tasks[id].depth = 10;
  }
  set.tasks[0].name = "timer";
  set.tasks[0].period = set.tasks[0].deadline = 400ns;
  set.tasks[0].phase = 100ns;
  set.tasks[0].feeds = {1};
  for (TaskId id : {1, 2}) set.tasks[id].kind = TaskKind::subscription;
  set.tasks[1].name = "a/timer";
  set.tasks[2].name = "b/outside";
  return set;
}

/// Samples are their own numbers; nobody has to give them back.
class NoOwner final : public SampleOwner {
 public:
  void give_back(const void*, std::uintptr_t) noexcept override {}
  void lend_again(std::uintptr_t) noexcept override {}
};

/// One run of an executor in a world.
class ControlledRun final : public JobHandler {
 public:
  struct Plan {
    Duration length;
    int outside = 0;  ///< Samples from outside, every 300 ns.
    Duration stop_at;
  };

  ControlledRun(const std::string& executor, World& world, const Plan& plan)
      : set_(timer_and_two_subscriptions()), world_(world), plan_(plan) {
    auto scheduler = find_executor(executor)->make(set_, {.workers = 2});
    for (std::size_t i = 0; i <= scheduler->workers().size(); ++i) {
      memory_.emplace_back(
          new std::max_align_t[RecordLog<JobRecord>::bytes(kCapacity) / sizeof(std::max_align_t) + 1]);
      logs_.push_back(RecordLog<JobRecord>::create(memory_.back().get(), kCapacity));
    }
    executor_.emplace(set_, std::move(scheduler), *this, logs_, ExecutorOptions{});
    next_[0] = Time{} + kEpoch + set_[0].phase;
    world_.when_idle = [this] { check_nothing_waits(); };
  }

  /// What is wrong; empty: nothing.
  std::string run() {
    trace_.epoch = Time{} + kEpoch;
    const Time end = trace_.epoch + plan_.length;
    executor_->start(trace_.epoch, end);
    ControlledSync::Thread outside([this] {
      for (int i = 0; i < plan_.outside; ++i) {
        world_.wait([] { return false; }, trace_.epoch + 150ns + i * 300ns);
        deliver(2, {});
      }
    });
    world_.wait([] { return false; }, trace_.epoch + plan_.stop_at);
    executor_->stop();
    trace_.end = executor_->join();
    ended_ = true;
    outside.join();
    executor_->close(trace_.end);
    collect();
    if (world_.defect.empty()) world_.defect = legal(set_, trace_, true);
    if (world_.defect.empty()) world_.defect = balanced(set_, trace_);
    return world_.defect;
  }

  void run(const Job& job, Time, Sample, Worker) override {
    world_.step();
    if (set_[job.task].kind == TaskKind::timer) {
      next_[job.task] = job.timestamp + (1 + job.skipped) * set_[job.task].period;
    } else {
      ++started_[job.task];
    }
    for (const TaskId fed : set_[job.task].feeds) deliver(fed, job.ref());
  }

 private:
  static constexpr std::uint64_t kCapacity = 64;
  static constexpr Duration kEpoch = 1000ns;

  void deliver(TaskId task, JobRef parent) {
    static NoOwner nobody;
    ++published_[task];
    executor_->deliver(task, {world_.now(), kNever, parent}, Sample(&nobody, nobody, 0));
    ++delivered_[task];
  }

  /// Everybody sleeps: then nothing that was delivered waits, and no timer is due.
  void check_nothing_waits() {
    const Time now = world_.now();
    if (ended_ || !world_.defect.empty() || now >= trace_.epoch + std::min(plan_.length, plan_.stop_at))
      return;
    for (TaskId id : {1, 2}) {
      if (started_[id] < delivered_[id])
        world_.defect = "all sleep while a sample of " + set_[id].name + " waits";
    }
    if (next_[0] <= now) world_.defect = "all sleep while the timer is due";
  }

  void collect() {
    for (const auto& log : logs_)
      trace_.jobs.insert(trace_.jobs.end(), log.contents().begin(), log.contents().end());
    for (JobRecord& r : trace_.jobs) {
      if (r.outcome == Outcome::ran && r.finish > trace_.end) r.outcome = Outcome::running;
    }
    std::erase_if(trace_.jobs, [](const JobRecord& r) { return r.outcome == Outcome::empty; });
    std::ranges::stable_sort(trace_.jobs, {}, &JobRecord::start);
    trace_.published.assign(std::begin(published_), std::end(published_));
  }

  const TaskSet set_;
  World& world_;
  const Plan plan_;
  std::vector<std::unique_ptr<std::max_align_t[]>> memory_;
  BasicExecutor<ControlledSync>::Logs logs_;
  std::optional<BasicExecutor<ControlledSync>> executor_;
  Trace trace_;
  Time next_[1]{};
  std::uint64_t published_[3]{}, delivered_[3]{}, started_[3]{};
  bool ended_ = false;
};

constexpr ControlledRun::Plan kShort{300ns, 1, 250ns}, kLong{1500ns, 4, 1400ns};

constexpr std::uint64_t kDefaultCount = 2000;

std::uint64_t number(const char* variable, std::uint64_t otherwise) {
  const char* given = std::getenv(variable);
  return given == nullptr ? otherwise : std::strtoull(given, nullptr, 10);
}

struct Explored {
  std::uint64_t interleavings = 0;
  bool complete = false;  ///< All that there are.
  std::string defect;     ///< Of the first that has one.
};

Explored explore_all(const std::string& executor, std::size_t preemptions, Fault fault = Fault::none) {
  Explored explored;
  AllChoices choices(preemptions);
  const std::uint64_t most = number("HOTPATH_INTERLEAVINGS", kDefaultCount);
  do {
    World world(choices, fault);
    explored.defect = ControlledRun(executor, world, kShort).run();
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
    explored.defect = ControlledRun(executor, world, kLong).run();
  }
  return explored;
}

std::uint64_t total_systematic = 0, total_random = 0, complete = 0;

class Interleavings : public testing::TestWithParam<std::string_view> {};

TEST_P(Interleavings, ThoseWithFewPreemptionsAreAccepted) {
  const Explored explored = explore_all(std::string(GetParam()), number("HOTPATH_PREEMPTIONS", 1));
  EXPECT_EQ(explored.defect, "") << "in interleaving " << explored.interleavings;
  EXPECT_GT(explored.interleavings, 20u);
  total_systematic += explored.interleavings;
  complete += explored.complete;
}

TEST_P(Interleavings, RandomOnesAreAccepted) {
  const Explored explored =
      explore_at_random(std::string(GetParam()), number("HOTPATH_INTERLEAVINGS", kDefaultCount));
  EXPECT_EQ(explored.defect, "") << "with seed " << explored.interleavings;
  total_random += explored.interleavings;
}

std::vector<std::string_view> names() {
  std::vector<std::string_view> all;
  for (const ExecutorEntry& e : executors()) all.push_back(e.name);
  return all;
}

INSTANTIATE_TEST_SUITE_P(Registry, Interleavings, testing::ValuesIn(names()), [](const auto& p) {
  std::string name(p.param);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

// The check finds what it is for.
TEST(BrokenExecutor, ThatWakesNobodyIsFound) {
  EXPECT_NE(explore_all("events-ro", 2, Fault::lost_unpark).defect, "");
}

TEST(BrokenExecutor, ThatSleepsThoughItWasWokenJustBeforeIsFound) {
  const Explored explored = explore_all("events-ro", 2, Fault::ticket_ignored);
  EXPECT_NE(explored.defect, "");
  EXPECT_GT(explored.interleavings, 1u) << "a run without preemption must not show it";
}

class Publish final : public testing::Environment {
  void TearDown() override {
    const char* folder = std::getenv("HOTPATH_RELIABILITY");
    if (folder == nullptr) return;
    std::ofstream(std::string(folder) + "/interleavings.json")
        << "{\n  \"preemptions\": " << number("HOTPATH_PREEMPTIONS", 1)
        << ",\n  \"systematic\": " << total_systematic << ",\n  \"complete\": " << complete
        << ",\n  \"random\": " << total_random << ",\n  \"executors\": " << executors().size() << "\n}\n";
  }
};
const auto* const publish = testing::AddGlobalTestEnvironment(new Publish);

}  // namespace
}  // namespace hotpath::test
