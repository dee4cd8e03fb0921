// SPDX-License-Identifier: Apache-2.0
#include "setup.hpp"

#include <algorithm>
#include <stdexcept>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/suggestion.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/phases.hpp"

namespace hotpath {

namespace {

bool takes_threads(const ExecutorTraits& traits) {
  return traits.many_workers || traits.timers == TimerHandling::release_only;
}

/// All executors except the wait-set executors, which rclcpp has itself.
std::vector<std::string> known_executors() {
  std::vector<std::string> names;
  for (const ExecutorEntry& e : executors()) {
    if (e.traits.family != Family::wait_set) names.emplace_back(e.name);
  }
  return names;
}

const ExecutorEntry& known(const std::string& name) {
  const ExecutorEntry* entry = find_executor(name);
  if (entry == nullptr) {
    throw std::invalid_argument("there is no executor `" + name + "`; " + suggest(name, known_executors()));
  }
  if (entry->traits.family == Family::wait_set) {
    throw std::invalid_argument("executor `" + name + "` is rclcpp's own " + std::string(entry->class_name) +
                                "; PriorityExecutor has " + joined(known_executors(), ", "));
  }
  return *entry;
}

void apply_variant(Setup& setup, const std::string& variant) {
  const bool ordered = setup.executor->traits.family == Family::priority_events;
  if (const auto rule = parse<SubscriptionRule>(variant); ordered && rule) {
    setup.scheduler.rule = *rule;
  } else if (const auto ties = parse<Ties>(variant); ordered && ties) {
    setup.scheduler.ties = *ties;
  } else {
    throw std::invalid_argument("executor `" + setup.name + "` has no variant `" + variant +
                                "`; the paper's executors take first, inherit, fifo or lifo");
  }
}

void check_threads(Setup& setup, unsigned threads) {
  const unsigned most = takes_threads(setup.executor->traits) ? kMaxWorkers - 1 : 1;
  if (threads >= 1 && threads <= most) {
    setup.scheduler.workers = setup.scheduler.release_only_workers = threads;
    return;
  }
  throw std::invalid_argument("executor `" + setup.name + "` cannot have " + std::to_string(threads) +
                              " threads; it takes 1 to " + std::to_string(most) +
                              ". For several threads, use a release-only executor (rm-ro) or cbg");
}

/// A node's timers are known by their periods.
void check_offsets(const Setup& setup) {
  const GraphTasks& tasks = setup.tasks;
  for (TaskId a = 0; a < tasks.set.size(); ++a) {
    for (TaskId b = a + 1; b < tasks.set.size(); ++b) {
      if (tasks.set[a].kind != TaskKind::timer || tasks.set[b].kind != TaskKind::timer) continue;
      if (tasks.origin[a].node != tasks.origin[b].node || tasks.set[a].period != tasks.set[b].period)
        continue;
      if (setup.offsets[a] == setup.offsets[b]) continue;
      throw std::invalid_argument("offsets: timers " + tasks.set[a].name + " and " + tasks.set[b].name +
                                  " have one node and one period, so they cannot be told apart; give both "
                                  "the same offset");
    }
  }
}

ThreadPolicyRequest policy(const std::optional<std::string>& asked, const ThreadPolicy& otherwise) {
  if (asked) return {parse_thread_policy(*asked), true, {}};
  return {otherwise, false, {}};
}

}  // namespace

Setup understand(const PriorityExecutorOptions& options) {
  Setup setup;
  setup.name = options.executor;
  std::size_t colon = std::min(setup.name.find(':'), setup.name.size());
  setup.executor = &known(setup.name.substr(0, colon));
  while (colon < setup.name.size()) {
    const std::size_t next = std::min(setup.name.find(':', colon + 1), setup.name.size());
    apply_variant(setup, setup.name.substr(colon + 1, next - colon - 1));
    colon = next;
  }
  check_threads(setup, options.threads);
  if (!options.graph.empty()) {
    setup.graph = load_graph(find_graph(options.graph));
    setup.tasks = make_tasks(setup.graph);
    for (Task& task : setup.tasks.set.tasks) task.local = false;
  }
  if (!options.offsets.empty()) {
    if (options.graph.empty()) {
      throw std::invalid_argument("offsets (" + options.offsets +
                                  ") need the graph whose timers they name; give the option `graph` too");
    }
    setup.offsets = read_phases(options.offsets, setup.graph, std::string(setup.executor->name));
    check_offsets(setup);
  }
  if (!options.priorities.empty()) {
    if (setup.executor->traits.policy != Policy::fp) {
      throw std::invalid_argument("priorities (" + options.priorities +
                                  ") are only for fp-ro and fp-re; executor `" + setup.name +
                                  "` computes its own order");
    }
    setup.priorities = read_priorities(options.priorities);
    setup.priorities_file = options.priorities;
  }
  if (options.service_wait < std::chrono::nanoseconds::zero() ||
      options.service_wait > std::chrono::hours(24)) {
    throw std::invalid_argument("service_wait is " + std::to_string(options.service_wait.count()) +
                                " ns; it must be from 0 (no limit) to a day");
  }
  if (setup.executor->traits.family == Family::priority_events) {
    setup.scheduler.service_wait = options.service_wait;
  }
  setup.learn = options.learn && options.graph.empty();
  setup.executor_threads = policy(options.executor_threads, {});
  setup.timer_thread = policy(options.timer_thread, setup.executor->traits.raises_timer_thread
                                                        ? raised_above(setup.executor_threads.policy)
                                                        : ThreadPolicy{});
  if (options.middleware_threads) setup.middleware_threads = parse_thread_policy(*options.middleware_threads);
  return setup;
}

}  // namespace hotpath
