// SPDX-License-Identifier: Apache-2.0
// Explores every reachable schedule of small sporadic sets in integer time: the exact analyses must
// be exact.
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <unordered_set>

#include "hotpath/analysis/bedarkar_2022.hpp"
#include "hotpath/analysis/davis_2007.hpp"
#include "hotpath/analysis/spuri_1996.hpp"
#include "reference_simulation.hpp"

namespace hotpath::exhaustive_test {

constexpr std::size_t kMost = 3;

/// Sporadic non-preemptive scheduling as a finite automaton with one step per time unit. At each
/// instant any task whose last release is at least T ago may release a job. A free processor then
/// starts the first job by the rule, with ties either way, for any execution time in [1, C].
class Automaton {
 public:
  Automaton(const PeriodicTasks& tasks, Rule rule) : tasks_(tasks), rule_(rule) {}

  /// Whether every job finishes at most its task's `limit` after its release; `largest` then holds
  /// the largest response times.
  bool explore(const std::vector<std::int64_t>& limit, std::vector<std::int64_t>& largest) {
    largest.assign(tasks_.size(), 0);
    std::unordered_set<std::uint64_t> seen;
    std::vector<State> open{State{}};
    seen.insert(open.back().packed());
    while (!open.empty()) {
      const State state = open.back();
      open.pop_back();
      for (unsigned released = 0; released < 1U << tasks_.size(); ++released) {
        State s = state;
        if (!release(s, released)) continue;
        for (State next : starts(s)) {
          if (!pass(next, limit, largest)) return false;
          if (seen.insert(next.packed()).second) open.push_back(next);
        }
      }
    }
    return true;
  }

 private:
  struct Slot {
    std::int8_t wait = 0;  // until the next release is allowed
    std::int8_t age = -1;  // of the unfinished job; -1: no job
  };
  struct State {
    std::array<Slot, kMost> slot;
    std::int8_t running = -1, left = 0;
    std::uint64_t packed() const {
      std::uint64_t bits = static_cast<std::uint64_t>(running + 1) << 6 | static_cast<std::uint64_t>(left);
      for (const Slot& s : slot) {
        bits = bits << 14 | static_cast<std::uint64_t>(s.wait) << 7 | static_cast<std::uint64_t>(s.age + 1);
      }
      return bits;
    }
  };

  bool release(State& s, unsigned which) const {
    for (std::size_t i = 0; i < tasks_.size(); ++i) {
      if (!((which >> i) & 1U)) continue;
      if (s.slot[i].wait > 0 || s.slot[i].age >= 0) return false;
      s.slot[i] = {static_cast<std::int8_t>(tasks_[i].period), 0};
    }
    return true;
  }

  std::int64_t urgency(const State& s, std::size_t i) const {
    switch (rule_) {
      case Rule::fixed_priority:
        return static_cast<std::int64_t>(i);
      case Rule::edf:
        return tasks_[i].deadline - s.slot[i].age;
      case Rule::fifo:
        break;
    }
    return -s.slot[i].age;
  }

  std::vector<State> starts(const State& s) const {
    if (s.running >= 0) return {s};
    std::int64_t first = std::numeric_limits<std::int64_t>::max();
    for (std::size_t i = 0; i < tasks_.size(); ++i) {
      if (s.slot[i].age >= 0) first = std::min(first, urgency(s, i));
    }
    std::vector<State> started;
    for (std::size_t i = 0; i < tasks_.size(); ++i) {
      if (s.slot[i].age < 0 || urgency(s, i) != first) continue;
      for (std::int64_t c = 1; c <= tasks_[i].wcet; ++c) {
        started.push_back(s);
        started.back().running = static_cast<std::int8_t>(i);
        started.back().left = static_cast<std::int8_t>(c);
      }
    }
    if (started.empty()) started.push_back(s);
    return started;
  }

  /// Advances by one time unit; false if a job is late.
  bool pass(State& s, const std::vector<std::int64_t>& limit, std::vector<std::int64_t>& largest) const {
    for (std::size_t i = 0; i < tasks_.size(); ++i) {
      if (s.slot[i].wait > 0) --s.slot[i].wait;
      if (s.slot[i].age >= 0) ++s.slot[i].age;
    }
    if (s.running >= 0 && --s.left == 0) {
      const std::size_t running = static_cast<unsigned char>(s.running);
      Slot& done = s.slot[running];
      largest[running] = std::max<std::int64_t>(largest[running], done.age);
      if (done.age > limit[running]) return false;
      done.age = -1;
      s.running = -1;
    }
    for (std::size_t i = 0; i < tasks_.size(); ++i) {
      if (s.slot[i].age >= limit[i]) return false;  // unfinished at its limit
    }
    return true;
  }

  const PeriodicTasks& tasks_;
  Rule rule_;
};

std::vector<std::int64_t> deadlines(const PeriodicTasks& tasks) {
  std::vector<std::int64_t> d;
  for (const PeriodicTask& t : tasks) d.push_back(t.deadline);
  return d;
}

RandomSet tiny(RandomStream& random) {
  RandomSet parameters;
  parameters.max_tasks = kMost;
  parameters.periods = {2, 3, 4, 5, 6, 7, 8, 9, 10};
  parameters.max_wcet_share = 0.6;
  parameters.constrained = random.below(2) == 0;
  return parameters;
}

constexpr int kSets = 1500;

/// Expects that `bounds_of` finds the largest response times, and which sets miss deadlines.
void expect_exact(std::uint64_t seed, Rule rule,
                  const std::function<ResponseTimes(const PeriodicTasks&)>& bounds_of) {
  RandomStream random(seed, {0});
  int passed = 0;
  for (int set = 0; set < kSets; ++set) {
    const PeriodicTasks tasks = random_tasks(random, tiny(random));
    const ResponseTimes bounds = bounds_of(tasks);
    std::vector<std::int64_t> largest;
    const bool in_time = Automaton(tasks, rule).explore(deadlines(tasks), largest);
    ASSERT_EQ(schedulable(tasks, bounds), in_time) << as_graph(tasks);
    if (!in_time) continue;
    ++passed;
    for (std::size_t k = 0; k < tasks.size(); ++k)
      ASSERT_EQ(*bounds[k], largest[k]) << "task " << k << as_graph(tasks);
  }
  EXPECT_GT(passed, kSets / 10);
  EXPECT_LT(passed, kSets * 9 / 10);
}

TEST(Exhaustive, DavisIsExactForSporadicNonPreemptiveFp) {
  expect_exact(31, Rule::fixed_priority,
               [](const auto& tasks) { return davis_2007(tasks, TimeModel::discrete); });
}

TEST(Exhaustive, WcrtIsExactForSporadicNonPreemptiveEdf) {
  expect_exact(32, Rule::edf, [](const PeriodicTasks& tasks) {
    exact::Utilisation load;
    for (const PeriodicTask& t : tasks) load.add(t.wcet, t.period);
    return load.compare_to_one() > 0 ? ResponseTimes(tasks.size()) : spuri_1996(tasks, TimeModel::discrete);
  });
}

TEST(Exhaustive, FifoBoundIsReached) {
  RandomStream random(33, {0});
  int compared = 0;
  for (int set = 0; set < kSets; ++set) {
    const PeriodicTasks tasks = random_tasks(random, tiny(random));
    if (utilisation(tasks) > 0.999) continue;
    const std::int64_t bound = bedarkar_2022(tasks);
    if (bound > tasks.front().period) continue;  // the automaton represents at most one job of each task
    ++compared;
    std::vector<std::int64_t> largest;
    ASSERT_TRUE(Automaton(tasks, Rule::fifo).explore(std::vector<std::int64_t>(tasks.size(), bound), largest))
        << as_graph(tasks);
    ASSERT_EQ(*std::max_element(largest.begin(), largest.end()), bound) << as_graph(tasks);
  }
  EXPECT_GT(compared, kSets / 20);
}

}  // namespace hotpath::exhaustive_test
