// SPDX-License-Identifier: Apache-2.0
// Finds slow CPUs in synthetic traces, with time and factor, and reports none in undisturbed
// traces.
#include "results/processor_speed.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <random>

namespace hotpath {
namespace {

using namespace std::chrono_literals;
using testing::IsEmpty;
using testing::SizeIs;

constexpr Time kEpoch = from_ns(7'000'000'000);
constexpr TaskId kWork = 0, kStore = 1, kSmall = 2;

/// Tasks with jobs of 4 ms, with jobs of 4 ms that may only store a sample, and without work.
TaskSet set() {
  TaskSet s;
  for (const Duration wcet : {4ms, 4ms, 0ms}) {
    Task& task = s.tasks.emplace_back();
    task.period = 10ms;
    task.wcet = wcet;
  }
  return s;
}

/// A repetition of one thread on one CPU, which is slower by `pace` throughout, and also by
/// `factor` from `begin` to `end`.
struct Host {
  double pace = 1;
  Duration begin{}, end{};
  double factor = 1;
  double load = 0.8;
  double noise = 0;
  Duration length = 30s;
  std::uint32_t seed = 1;

  [[nodiscard]] Trace run() const {
    Trace trace;
    trace.epoch = kEpoch;
    trace.end = kEpoch + length;
    std::mt19937 random(seed);
    std::exponential_distribution<double> more(1);
    Duration now{};
    for (std::uint64_t i = 0; now < length; ++i) {
      const bool slow = now >= begin && now < end;
      const double took = pace * (slow ? factor : 1) * (1 + noise * more(random));
      const TaskId task = i % 5 == 4 ? kStore : kWork;
      const Duration work = task == kStore ? Duration(20us) : Duration(4050us);
      append(trace, task, now, now + from_ms(to_ms(work) * took));
      now = std::max(trace.jobs.back().finish - kEpoch, now + from_ms(to_ms(work) / load));
    }
    return trace;
  }

  static void append(Trace& trace, TaskId task, Duration begin, Duration end, std::uint16_t worker = 0,
                     std::int16_t cpu = 1) {
    JobRecord& r = trace.jobs.emplace_back();
    r.job.task = task;
    r.start = kEpoch + begin;
    r.finish = kEpoch + end;
    r.worker = worker;
    r.cpu = cpu;
  }
};

std::vector<results::SlowPeriod> slow_in(Trace trace, const std::vector<Trace>& others = {},
                                         Duration warm_up = {}) {
  static const TaskSet kSet = set();
  std::ranges::stable_sort(trace.jobs, {}, &JobRecord::start);
  std::vector<std::vector<results::SpeedWindow>> all = {results::speed_windows(kSet, trace, warm_up)};
  for (const Trace& other : others) all.push_back(results::speed_windows(kSet, other, warm_up));
  const auto usual = results::usual_pace({all.begin(), all.end()});
  return usual ? results::slow_periods(all[0], *usual) : std::vector<results::SlowPeriod>();
}

void expect_one(const std::vector<results::SlowPeriod>& slow, Duration begin, Duration end, double factor) {
  ASSERT_THAT(slow, SizeIs(1));
  EXPECT_EQ(slow[0].cpu, 1);
  EXPECT_NEAR(to_ms(slow[0].begin), to_ms(begin), to_ms(results::SpeedWatch::kWindow));
  EXPECT_NEAR(to_ms(slow[0].end), to_ms(end), to_ms(results::SpeedWatch::kWindow));
  EXPECT_NEAR(slow[0].factor, factor, 0.05 * factor);
}

TEST(ProcessorSpeed, FindsWhenAndByHowMuch) {
  for (const double factor : {1.28, 1.5, 2.0, 5.0}) {
    for (const Duration length : {1s, 6s, 15s}) {
      for (const double noise : {0.0, 0.01}) {
        const Host host{.begin = 12s, .end = 12s + length, .factor = factor, .noise = noise};
        expect_one(slow_in(host.run()), host.begin, host.end, factor);
      }
    }
  }
}

TEST(ProcessorSpeed, FindsItAtLowLoadInLongerWindows) {
  const Host host{.begin = 10s, .end = 20s, .factor = 1.3, .load = 0.1};
  const std::vector<results::SlowPeriod> slow = slow_in(host.run());
  ASSERT_THAT(slow, SizeIs(1));
  EXPECT_NEAR(to_ms(slow[0].end - slow[0].begin), 10e3, 3e3);
  EXPECT_NEAR(slow[0].factor, 1.3, 0.1);
}

TEST(ProcessorSpeed, MarksNothingThatIsUndisturbed) {
  for (std::uint32_t seed = 0; seed < 50; ++seed) {
    for (const double load : {0.05, 0.2, 0.8, 1.0}) {
      EXPECT_THAT(slow_in(Host{.load = load, .noise = 0.03, .seed = seed}.run()), IsEmpty()) << seed;
    }
  }
}

TEST(ProcessorSpeed, ForgivesOnePreemptionAndNotManyOfThem) {
  Trace once = Host().run();
  for (JobRecord& r : once.jobs) r.cpu = 1;
  auto late = std::ranges::find_if(once.jobs, [](const JobRecord& r) { return r.start > kEpoch + 5s; });
  late->finish += 15ms;
  for (auto next = late + 1; next != once.jobs.end() && next->start < (next - 1)->finish; ++next) {
    const Duration behind = (next - 1)->finish - next->start;
    next->start += behind;
    next->finish += behind;
  }
  EXPECT_THAT(slow_in(once), IsEmpty());

  // A quota withholds 30 of every 100 ms, from whichever job runs then.
  Trace often;
  often.epoch = kEpoch;
  Duration now{};
  for (int i = 0; now < 20s; ++i) {
    const bool held_up = now >= 8s && now < 14s && i % 17 == 0;
    Host::append(often, kWork, now, now + 4050us + (held_up ? 30ms : 0ms));
    now = often.jobs.back().finish - kEpoch + 100us;
  }
  expect_one(slow_in(often), 8s, 14s, 100 / 70.0);
}

TEST(ProcessorSpeed, JobsThatPreemptEachOtherAreNoSlowness) {
  // A timer thread preempts the executor thread on one CPU: each executor job lasts 4 ms longer.
  Trace nested;
  nested.epoch = kEpoch;
  for (Duration now{}; now < 10s; now += 10ms) {
    const bool preempts = now >= 4s && now < 7s;
    Host::append(nested, kWork, now, now + (preempts ? 8100us : 4050us), 0);
    if (preempts) Host::append(nested, kWork, now + 1ms, now + 1ms + 4050us, 1);
  }
  EXPECT_THAT(slow_in(nested), IsEmpty());

  // Two threads of equal priority share a CPU for some seconds.
  Trace shared;
  shared.epoch = kEpoch;
  for (Duration now{}; now < 10s; now += 10ms) {
    const bool both = now >= 4s && now < 7s;
    Host::append(shared, kWork, now, now + (both ? 8100us : 4050us), 0);
    if (both) Host::append(shared, kWork, now, now + 8100us, 1);
  }
  EXPECT_THAT(slow_in(shared), IsEmpty());
}

/// A thread preempts another one on processor 1, which is slow by a factor of 1.4 from 9 to 15 s.
/// `first_cpu`: of the preempting thread in the first second.
Trace preempted_on_a_slow_processor(std::int16_t first_cpu) {
  Trace nested;
  nested.epoch = kEpoch;
  for (Duration now{}; now < 20s; now += 15ms) {
    const double pace = now >= 9s && now < 15s ? 1.4 : 1;
    const auto took = [&](Duration work) { return from_ms(to_ms(work) * pace); };
    Host::append(nested, kWork, now, now + took(8100us), 0);
    Host::append(nested, kWork, now + 1ms, now + 1ms + took(4050us), 1, now < 1s ? first_cpu : 1);
  }
  return nested;
}

TEST(ProcessorSpeed, ASlowProcessorIsFoundUnderThreadsThatPreemptEachOther) {
  expect_one(slow_in(preempted_on_a_slow_processor(1)), 9s, 15s, 1.4);
}

TEST(ProcessorSpeed, AThreadMayHaveChangedProcessorsInTheWarmUp) {
  expect_one(slow_in(preempted_on_a_slow_processor(0), {}, 2s), 9s, 15s, 1.4);
}

TEST(ProcessorSpeed, ThreadsThatChangeProcessorsTellItWhereTheyAreAlone) {
  const auto trace = [](double factor, bool meet) {
    Trace t;
    t.epoch = kEpoch;
    for (Duration now{}; now < 20s; now += 10ms) {
      const double pace = now >= 9s && now < 15s ? factor : 1;
      const std::int16_t cpu = now / 10ms % 2 == 0 ? 0 : 1;
      Host::append(t, kWork, now, now + from_ms(4.05 * pace), 0, cpu);
      // For some seconds they overlap on one CPU for a while, and finish on two.
      if (meet && now >= 9s && now < 15s) {
        t.jobs.back().finish += 2ms;
        Host::append(t, kWork, now + 1ms, now + 7ms, 1, static_cast<std::int16_t>(1 - cpu));
      }
    }
    return t;
  };
  EXPECT_THAT(slow_in(trace(1, true)), IsEmpty());
  // For a second each thread finishes on its own CPU.
  Trace settled = trace(1, true);
  for (JobRecord& r : settled.jobs) {
    if (r.start >= kEpoch + 11s && r.start < kEpoch + 12s) r.cpu = static_cast<std::int16_t>(r.worker);
  }
  EXPECT_THAT(slow_in(settled), IsEmpty());
  EXPECT_THAT(slow_in(trace(1.3, false)), SizeIs(2)) << "one for each processor";
}

TEST(ProcessorSpeed, TheWholeRepetitionIsSlowAgainstOthersOrTheCalibration) {
  const Host quick, slow{.pace = 1.28};
  EXPECT_THAT(slow_in(quick.run(), {slow.run(), slow.run()}), IsEmpty());
  expect_one(slow_in(slow.run(), {quick.run()}), 0s, 30s, 1.28);
  expect_one(slow_in(slow.run()), 0s, 30s, 1.28);  // against the calibration
  // The calibration was slow, and one repetition is equally slow.
  expect_one(slow_in(quick.run(), {Host{.pace = 0.78}.run()}), 0s, 30s, 1.28);
}

TEST(ProcessorSpeed, IgnoresTheWarmUp) {
  const Host host{.begin = 0s, .end = 3s, .factor = 2};
  EXPECT_THAT(slow_in(host.run()), SizeIs(1));
  EXPECT_THAT(slow_in(host.run(), {}, 4s), IsEmpty());
}

TEST(ProcessorSpeed, TwoPeriodsWithQuickTimeBetweenThemAreTwo) {
  Trace twice = Host{.begin = 8s, .end = 11s, .factor = 1.5}.run();
  const Trace later = Host{.begin = 18s, .end = 21s, .factor = 1.5}.run();
  std::erase_if(twice.jobs, [](const JobRecord& r) { return r.start >= kEpoch + 15s; });
  std::ranges::copy_if(later.jobs, std::back_inserter(twice.jobs),
                       [](const JobRecord& r) { return r.start >= kEpoch + 15s; });
  const std::vector<results::SlowPeriod> slow = slow_in(twice);
  ASSERT_THAT(slow, SizeIs(2));
  EXPECT_LT(slow[0].end, 12s);
  EXPECT_GT(slow[1].begin, 17s);
}

TEST(ProcessorSpeed, TellsNothingWithoutJobsOfKnownWork) {
  Trace trace;
  trace.epoch = kEpoch;
  for (Duration now{}; now < 10s; now += 10ms) Host::append(trace, kSmall, now, now + 5ms);
  EXPECT_THAT(results::speed_windows(set(), trace, {}), IsEmpty());
  trace.jobs.clear();
  for (Duration now{}; now < 10s; now += 10ms) Host::append(trace, kWork, now, now + 9ms, 0, -1);
  EXPECT_THAT(results::speed_windows(set(), trace, {}), IsEmpty()) << "on unknown processors";
  EXPECT_EQ(results::usual_pace({}), std::nullopt);
  trace.jobs.clear();
  Host::append(trace, kWork, 0s, 9000s);
  Host::append(trace, kWork, 1s, 1s + 8ms);
  const auto windows = results::speed_windows(set(), trace, {});
  EXPECT_EQ(results::usual_pace({windows}), std::nullopt) << "too little work";
}

TEST(ProcessorSpeed, SaysWhenAndByHowMuch) {
  const std::vector<results::SlowPeriod> slow(5, {1, 12s, 18s, 1.284});
  EXPECT_EQ(results::describe(std::span(slow).first(1)),
            "from 12.0 to 18.0 s processor 1 was slow by a factor of 1.28");
  EXPECT_THAT(results::describe(slow), testing::EndsWith(", and 2 times more"));
  EXPECT_NEAR(to_ms(results::lost_time(slow)), 5 * 6e3 * (1 - 1 / 1.284), 1);
  EXPECT_EQ(results::slow_time(slow), 30s);
  EXPECT_EQ(
      results::slow_time(std::vector<results::SlowPeriod>{{0, 0s, 5s, 2}, {1, 0s, 3s, 2}, {1, 4s, 7s, 2}}),
      6s);
  EXPECT_EQ(results::slow_time({}), 0s);
}

}  // namespace
}  // namespace hotpath
