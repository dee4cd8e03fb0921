// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/registry.hpp"

#include <algorithm>
#include <array>
#include <thread>

#include "hotpath/core/callback_group_scheduler.hpp"
#include "hotpath/core/events_scheduler.hpp"
#include "hotpath/core/wait_set_scheduler.hpp"

namespace hotpath {

using namespace std::chrono_literals;
using enum RosDistro;

namespace {

using Made = std::unique_ptr<Scheduler>;
using Options = SchedulerOptions;

/// Humble and Iron (rclcpp 16, 21) have Jazzy's order, but ask all waitables when a wait ends.
Made make_default(const TaskSet& set, const Options& options) {
  const Asked asked = options.release < jazzy ? Asked::at_poll : Asked::at_turn;
  return std::make_unique<WaitSetScheduler>(set, 1, Blocked::forgotten, asked, options.entity_order);
}

/// All releases ask at the turn, Humble and Iron in execute_ready_executables().
template <StaticScheduler::Runs runs>
Made make_static(const TaskSet& set, const Options& options) {
  return std::make_unique<StaticScheduler>(set, runs, Asked::at_turn, options.entity_order);
}

unsigned multi_workers(const Options& options, unsigned most = kMaxWorkers) {
  const unsigned wanted =
      options.workers > 0 ? options.workers : std::max(2U, std::thread::hardware_concurrency());
  return std::min(wanted, most);
}

template <Blocked blocked>
Made make_multi(const TaskSet& set, const Options& options) {
  return std::make_unique<WaitSetScheduler>(set, multi_workers(options), blocked, Asked::at_poll,
                                            options.entity_order);
}

Made make_multi_jazzy(const TaskSet& set, const Options& options) {
  return std::make_unique<RebuiltWaitSetScheduler>(set, multi_workers(options), Asked::at_turn,
                                                   options.entity_order);
}

template <Requeue requeue>
Made make_cbg(const TaskSet& set, const Options& options) {
  return make_callback_group_scheduler(set, multi_workers(options, kMaxWorkers - 1), requeue);
}

Made make_stock_ro(const TaskSet& set, const Options& options) {
  // In the middle of a ring, jobs of busy groups are found only by a search.
  const PriorityOrder by_arrival(set, Policy::fifo, options.rule, options.ties);
  auto queue = options.release_only_workers > 1
                   ? std::unique_ptr<EventsQueue>(std::make_unique<PriorityEventsQueue>(by_arrival))
                   : std::make_unique<SimpleEventsQueue>();
  return std::make_unique<ReleaseOnlyScheduler>(
      set, std::move(queue), ReleaseOnlyScheduler::Release::one_by_one, options.release_only_workers);
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
  auto scheduler = std::make_unique<ReleaseOnlyScheduler>(set, make_queue<policy>(set, options),
                                                          ReleaseOnlyScheduler::Release::all_due,
                                                          options.release_only_workers);
  scheduler->limit_service_wait(options.service_wait);
  return scheduler;
}

template <Policy policy>
Made make_re(const TaskSet& set, const Options& options) {
  auto scheduler = std::make_unique<TimerReadyQueueScheduler>(set, make_queue<policy>(set, options),
                                                              make_queue<policy>(set, options));
  scheduler->limit_service_wait(options.service_wait);
  return scheduler;
}

// In the golden traces, consecutive jobs of a snapshot are `dispatch` apart. The cost of a wait is
// fitted to Autoware's hot path without work, whose seven hops need one wait each: 45 us with
// `static`, 80 us with `default`, 138 us with `multi`, with 228 entities. (After jobs of 10 ms,
// with cold caches, the golden traces show 70 to 175 us with seven nodes; Autoware's median
// latencies under load agree with the smaller numbers.) The reference machine raised the timer
// thread of every release-only executor.
constexpr ReferenceCosts kEventsCosts = {
    .cores = 1, .dispatch = 1us, .wake_up = 70us, .wait = 0us, .wait_per_entity = 0us};
constexpr ReferenceCosts kStaticCosts = {
    .cores = 1, .dispatch = 3us, .wake_up = 180us, .wait = 8us, .wait_per_entity = 150ns};
constexpr ReferenceCosts kMultiCosts = {
    .cores = 2, .dispatch = 20us, .wake_up = 190us, .wait = 84us, .wait_per_entity = 150ns};

constexpr ExecutorTraits wait_set(TaskKind first, bool many_workers, bool in_paper,
                                  std::optional<RosDistros> on_rclcpp, ReferenceCosts reference,
                                  std::string_view colour) {
  return {.family = Family::wait_set,
          .timers = TimerHandling::polled,
          .policy = std::nullopt,
          .runs_first = first,
          .many_workers = many_workers,
          .raises_timer_thread = false,
          .compared_by_paper = in_paper,
          .on_rclcpp = on_rclcpp,
          .reference = reference,
          .colour = colour};
}

/// Of an executor with an events queue.
constexpr ExecutorTraits events(TimerHandling timers, Policy policy, bool in_paper,
                                std::optional<RosDistros> on_rclcpp, ReferenceCosts reference,
                                std::string_view colour) {
  const Family family = timers == TimerHandling::marked_ready ? Family::callback_groups
                        : policy == Policy::fifo              ? Family::events
                                                              : Family::priority_events;
  return {.family = family,
          .timers = timers,
          .policy = policy,
          .runs_first = std::nullopt,
          .many_workers = family == Family::callback_groups,
          .raises_timer_thread = family == Family::priority_events,
          .compared_by_paper = in_paper,
          .on_rclcpp = on_rclcpp,
          .reference = reference,
          .colour = colour};
}

/// The paper's executors: release-only, or release-and-execute.
template <Policy policy>
constexpr ExecutorEntry priority_events(std::string_view name, std::string_view description,
                                        TimerHandling timers, std::string_view colour) {
  constexpr bool in_paper = policy == Policy::rm || policy == Policy::edf;
  constexpr bool on_rclcpp = in_paper || policy == Policy::dm || policy == Policy::fp;  // in hotpath_rclcpp
  return {name, "EventsExecutor", description,
          events(timers, policy, in_paper, on_rclcpp ? std::optional(RosDistros{}) : std::nullopt,
                 kEventsCosts, colour),
          timers == TimerHandling::release_only ? make_ro<policy> : make_re<policy>};
}

constexpr auto kRo = TimerHandling::release_only;
constexpr auto kRe = TimerHandling::release_and_execute;

constexpr ExecutorTraits callback_groups(std::optional<RosDistros> on_rclcpp, std::string_view colour) {
  return events(TimerHandling::marked_ready, Policy::fifo, false, on_rclcpp, {1, 2us, 100us, 0us, 0us},
                colour);
}

constexpr std::array kExecutors = {
    ExecutorEntry{
        "default", "SingleThreadedExecutor", "wait set, timers before subscriptions; Humble to Rolling",
        wait_set(TaskKind::timer, false, true, RosDistros{}, {1, 5us, 190us, 41us, 150ns}, "#E08A00"),
        make_default},
    ExecutorEntry{
        "static", "StaticSingleThreadedExecutor",
        "wait set, runs all that is ready, subscriptions first; rclcpp to 26 (Humble, Iron)",
        wait_set(TaskKind::subscription, false, true, RosDistros{.last = jazzy}, kStaticCosts, "#C8502B"),
        make_static<StaticScheduler::Runs::all>},
    ExecutorEntry{
        "static-jazzy", "StaticSingleThreadedExecutor",
        "wait set, waits after each job, subscriptions first; rclcpp 28 (Jazzy)",
        wait_set(TaskKind::subscription, false, false, RosDistros{jazzy, jazzy}, kStaticCosts, "#8C3A22"),
        make_static<StaticScheduler::Runs::one>},
    ExecutorEntry{"multi", "MultiThreadedExecutor",
                  "wait set shared by several threads; rclcpp to 26 (Humble, Iron)",
                  wait_set(TaskKind::timer, true, false, RosDistros{}, kMultiCosts, "#A8882A"),
                  make_multi<Blocked::forgotten>},
    ExecutorEntry{
        "multi-jazzy", "MultiThreadedExecutor", "wait set rebuilt after each job; rclcpp from 28 on (Jazzy)",
        wait_set(TaskKind::timer, true, false, RosDistros{jazzy}, kMultiCosts, "#C9A93E"), make_multi_jazzy},
    ExecutorEntry{"multi-fair", "MultiThreadedExecutor",
                  "multi with the published remedy against starvation (Teper 2024)",
                  wait_set(TaskKind::timer, true, false, std::nullopt, kMultiCosts, "#7C6A1F"),
                  make_multi<Blocked::kept>},
    ExecutorEntry{"cbg", "EventsCBGExecutor",
                  "queue of ready callback groups, several threads; Jazzy on, to rclcpp PR 3178",
                  callback_groups(RosDistros{jazzy}, "#2F8F8F"), make_cbg<Requeue::at_end>},
    ExecutorEntry{"cbg-3178", "EventsCBGExecutor",
                  "cbg after rclcpp PR 3178 (2026): a reentrant group is ready again at once",
                  callback_groups(std::nullopt, "#155A64"), make_cbg<Requeue::at_dispatch>},
    ExecutorEntry{"events-ro", "EventsExecutor", "stock: FIFO events queue, timer thread only releases",
                  events(kRo, Policy::fifo, true, RosDistros{iron}, kEventsCosts, "#0A9A6C"), make_stock_ro},
    ExecutorEntry{"events-re", "EventsExecutor", "stock: FIFO events queue, timer thread runs timers",
                  events(kRe, Policy::fifo, false, RosDistros{iron}, {1, 6us, 110us, 0us, 0us}, "#5FB89B"),
                  make_stock_re},
    priority_events<Policy::rm>("rm-ro", "the paper's: rate monotonic, release-only", kRo, "#2777C4"),
    priority_events<Policy::rm>("rm-re", "the paper's: rate monotonic, release-and-execute", kRe, "#62A8DE"),
    priority_events<Policy::dm>("dm-ro", "the paper's: deadline monotonic, release-only", kRo, "#5B6FC8"),
    priority_events<Policy::dm>("dm-re", "the paper's: deadline monotonic, release-and-execute", kRe,
                                "#8C9BDD"),
    priority_events<Policy::edf>("edf-ro", "the paper's: earliest deadline first, release-only", kRo,
                                 "#8A56B8"),
    priority_events<Policy::edf>("edf-re", "the paper's: earliest deadline first, release-and-execute", kRe,
                                 "#B48BD2"),
    priority_events<Policy::fp>("fp-ro", "the paper's: priorities of the graph file, release-only", kRo,
                                "#C2569B"),
    priority_events<Policy::fp>("fp-re", "the paper's: priorities of the graph file, release-and-execute",
                                kRe, "#DA8FC0"),
};

}  // namespace

std::span<const ExecutorEntry> executors() { return kExecutors; }

std::uint32_t worker_count(const ExecutorEntry& entry, const SchedulerOptions& options) {
  const std::uint32_t timer_managers = entry.traits.timers == TimerHandling::polled ? 0 : 1;
  if (entry.traits.timers == TimerHandling::release_only)
    return timer_managers + options.release_only_workers;
  return timer_managers +
         (entry.traits.many_workers ? multi_workers(options, most_threads(entry.traits)) : 1);
}

const ExecutorEntry* find_executor(std::string_view name) {
  const auto entry = std::ranges::find(kExecutors, name, &ExecutorEntry::name);
  return entry == kExecutors.end() ? nullptr : &*entry;
}

}  // namespace hotpath
