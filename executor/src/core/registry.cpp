// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/registry.hpp"

#include <algorithm>
#include <array>
#include <thread>

#include "hotpath/core/priority_events_queue.hpp"
#include "hotpath/core/release_and_execute_scheduler.hpp"
#include "hotpath/core/release_only_scheduler.hpp"
#include "hotpath/core/simple_events_queue.hpp"
#include "hotpath/core/static_scheduler.hpp"
#include "hotpath/core/timer_ready_queue_scheduler.hpp"
#include "hotpath/core/wait_set_scheduler.hpp"

namespace hotpath {

namespace {

using Made = std::unique_ptr<Scheduler>;
using Options = SchedulerOptions;

Made make_default(const TaskSet& set, const Options&) { return std::make_unique<WaitSetScheduler>(set, 1); }

Made make_static(const TaskSet& set, const Options&) { return std::make_unique<StaticScheduler>(set); }

Made make_multi(const TaskSet& set, const Options& options) {
  const unsigned workers = options.workers > 0
                               ? options.workers
                               : std::clamp(std::thread::hardware_concurrency(), 2U, kMaxWorkers);
  return std::make_unique<WaitSetScheduler>(set, workers);
}

Made make_stock_ro(const TaskSet& set, const Options&) {
  return std::make_unique<ReleaseOnlyScheduler>(set, std::make_unique<SimpleEventsQueue>(),
                                                ReleaseOnlyScheduler::Release::one_by_one);
}

Made make_stock_re(const TaskSet& set, const Options&) {
  return std::make_unique<ReleaseAndExecuteScheduler>(set, std::make_unique<SimpleEventsQueue>());
}

template <Policy policy>
std::unique_ptr<EventsQueue> make_queue(const TaskSet& set, const Options& options) {
  return std::make_unique<PriorityEventsQueue>(PriorityOrder(set, policy, options.rule, options.ties));
}

template <Policy policy>
Made make_ro(const TaskSet& set, const Options& options) {
  return std::make_unique<ReleaseOnlyScheduler>(set, make_queue<policy>(set, options),
                                                ReleaseOnlyScheduler::Release::all_due);
}

template <Policy policy>
Made make_re(const TaskSet& set, const Options& options) {
  return std::make_unique<TimerReadyQueueScheduler>(set, make_queue<policy>(set, options),
                                                    make_queue<policy>(set, options));
}

constexpr std::array kExecutors = {
    ExecutorEntry{"default", "SingleThreadedExecutor", "wait set, timers before subscriptions", false,
                  make_default},
    ExecutorEntry{"static", "StaticSingleThreadedExecutor",
                  "wait set, all ready per wait, subscriptions first", false, make_static},
    ExecutorEntry{"multi", "MultiThreadedExecutor", "wait set shared by several threads", false, make_multi},
    ExecutorEntry{"events-ro", "EventsExecutor", "stock: FIFO events queue, timers released only", false,
                  make_stock_ro},
    ExecutorEntry{"events-re", "EventsExecutor", "stock: FIFO events queue, timer thread runs timers", false,
                  make_stock_re},
    ExecutorEntry{"rm-ro", "EventsExecutor", "the paper's: rate monotonic, release-only", true,
                  make_ro<Policy::rm>},
    ExecutorEntry{"rm-re", "EventsExecutor", "the paper's: rate monotonic, release-and-execute", true,
                  make_re<Policy::rm>},
    ExecutorEntry{"dm-ro", "EventsExecutor", "the paper's: deadline monotonic, release-only", true,
                  make_ro<Policy::dm>},
    ExecutorEntry{"dm-re", "EventsExecutor", "the paper's: deadline monotonic, release-and-execute", true,
                  make_re<Policy::dm>},
    ExecutorEntry{"edf-ro", "EventsExecutor", "the paper's: earliest deadline first, release-only", true,
                  make_ro<Policy::edf>},
    ExecutorEntry{"edf-re", "EventsExecutor", "the paper's: earliest deadline first, release-and-execute",
                  true, make_re<Policy::edf>},
    ExecutorEntry{"fp-ro", "EventsExecutor", "the paper's: priorities of the graph file, release-only", true,
                  make_ro<Policy::fp>},
    ExecutorEntry{"fp-re", "EventsExecutor", "the paper's: priorities of the graph file, release-and-execute",
                  true, make_re<Policy::fp>},
};

}  // namespace

std::span<const ExecutorEntry> executors() { return kExecutors; }

const ExecutorEntry* find_executor(std::string_view name) {
  const auto found = std::find_if(kExecutors.begin(), kExecutors.end(),
                                  [&](const ExecutorEntry& e) { return e.name == name; });
  return found == kExecutors.end() ? nullptr : &*found;
}

}  // namespace hotpath
