// SPDX-License-Identifier: Apache-2.0
// Checks of the live executors that hold in real time on any machine: order, counts, no losses.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "hotpath/core/accounting.hpp"
#include "hotpath/live/clock.hpp"
#include "hotpath/live/executor.hpp"
#include "hotpath/live/intra_process_transport.hpp"
#include "schedule_checks.hpp"

namespace hotpath::live_executor_test {

using namespace std::chrono_literals;

void burn(Duration d) {
  const Time until = now() + d;
  while (now() < until) {
  }
}

constexpr TaskId kSlow = 3;

/// A timer of 2 ms, a sequence of two subscriptions to it, and the timer kSlow of 10 ms.
TaskSet two_timers_and_a_sequence() {
  TaskSet set;
  const TaskId fast = test::add_timer(set, 2ms, 0ms, 1ms);
  test::add_subscription(set, {test::add_subscription(set, {fast}, 0ms)}, 0ms);
  test::add_timer(set, 10ms, 0ms, 1ms);
  return set;
}

class Chain final : public JobHandler {
 public:
  explicit Chain(const TaskSet& set) : set_(set), published(set.size()) {}

  void connect(SampleSink& sink) {
    for (TaskId id = 0; id < set_.size(); ++id) {
      if (!set_[id].feeds.empty()) writer_[id] = transport_.add_writer(set_[id].name, 1, 1);
      for (const TaskId fed : set_[id].feeds) transport_.add_reader(set_[id].name, fed, 1, 1, sink);
    }
  }

  void run(const Job& job, Time, Sample sample, Worker) override {
    const bool subscription = set_[job.task].kind == TaskKind::subscription;
    EXPECT_EQ(static_cast<bool>(sample), subscription);
    if (subscription) {
      EXPECT_EQ(sample.as<JobRef>(), job.parent) << "not the sample that the scheduler took";
    }
    burn(job.task == kSlow ? 1500us : 200us);
    if (set_[job.task].feeds.empty()) return;
    JobRef& message = transport_.borrow(writer_[job.task]);
    message = job.ref();
    for (const TaskId fed : set_[job.task].feeds) ++published[fed];
    transport_.publish(writer_[job.task], message, {now(), job.deadline, job.ref()});
  }

 private:
  const TaskSet set_;
  IntraProcessTransport<JobRef> transport_;
  std::map<TaskId, std::uint32_t> writer_;

 public:
  std::vector<std::atomic<std::uint64_t>> published;
};

Trace run(const std::string& executor, const TaskSet& set, Duration length) {
  const ExecutorEntry& entry = *find_executor(executor);
  Chain chain(set);
  auto scheduler = entry.make(set, {});
  const std::size_t workers = scheduler->workers().size();

  constexpr std::uint64_t kCapacity = 4096;
  const std::size_t bytes = (RecordLog<JobRecord>::bytes(kCapacity) + 63) / 64 * 64;
  const auto memory =
      std::unique_ptr<void, decltype(&std::free)>(std::aligned_alloc(64, bytes * (workers + 1)), std::free);
  Executor::Logs logs;
  for (std::size_t i = 0; i <= workers; ++i) {
    logs.push_back(RecordLog<JobRecord>::create(static_cast<char*>(memory.get()) + i * bytes, kCapacity));
  }
  Executor live(set, std::move(scheduler), chain, logs, default_options(entry));
  chain.connect(live);

  Trace trace;
  trace.executor = executor;
  trace.epoch = now() + 50ms;
  live.start(trace.epoch, trace.epoch + length);
  trace.end = live.join();
  live.close(trace.end);
  for (const auto& log : logs) {
    EXPECT_EQ(log.lost(), 0u);
    for (JobRecord r : log.contents()) {
      if (r.outcome == Outcome::ran && r.finish > trace.end) r.outcome = Outcome::running;
      trace.jobs.push_back(r);
    }
  }
  for (const auto& p : chain.published) trace.published.push_back(p.load());
  std::ranges::stable_sort(trace.jobs, {}, &JobRecord::start);
  EXPECT_EQ(test::legal(set, trace, true), "");
  EXPECT_EQ(test::balanced(set, trace), "");
  return trace;
}

class LiveExecutor : public testing::TestWithParam<std::string_view> {};

TEST_P(LiveExecutor, AccountsForEveryTimestampAndSample) {
  const TaskSet set = two_timers_and_a_sequence();
  // The machine may stall for longer than a short run.
  bool all_ran = false;
  for (auto length = 200ms; !all_ran && length < 15s; length *= 4) {
    const Trace trace = run(std::string(GetParam()), set, length);
    all_ran = true;
    for (const TaskAccount& a : account(set, trace)) {
      EXPECT_EQ(a.accounted(), a.expected) << set[a.task].name;
      all_ran &= a[Outcome::ran] > 0;
    }
  }
  EXPECT_TRUE(all_ran);
}

INSTANTIATE_TEST_SUITE_P(Registry, LiveExecutor, testing::ValuesIn(test::executor_names()),
                         [](const auto& executor) { return test::identifier(executor.param); });

// Paper, Section IV: the events queue serves the released job of highest priority; a waiting job is
// never passed over.
TEST(LivePriorityExecutor, NeverStartsAJobWhileOneOfHigherPriorityWaits) {
  const TaskSet set = two_timers_and_a_sequence();
  Trace trace = run("rm-ro", set, 200ms);
  const PriorityOrder order(set, Policy::rm, SubscriptionRule::inherit, Ties::lifo);
  std::erase_if(trace.jobs, [](const JobRecord& r) { return r.outcome != Outcome::ran; });
  for (std::size_t i = 1; i < trace.jobs.size(); ++i) {
    // The decision for this job came after the previous job's finish: all jobs released by then
    // were available.
    const JobRecord& chosen = trace.jobs[i];
    const Time known = trace.jobs[i - 1].finish;
    for (std::size_t k = i + 1; k < trace.jobs.size(); ++k) {
      const JobRecord& waiting = trace.jobs[k];
      const bool passed_over =
          waiting.job.release < known && order.level(waiting.job.task) < order.level(chosen.job.task);
      EXPECT_FALSE(passed_over) << set[waiting.job.task].name << " " << waiting.job.sequence
                                << " waited while " << set[chosen.job.task].name << " " << chosen.job.sequence
                                << " started";
    }
  }
}

}  // namespace hotpath::live_executor_test
