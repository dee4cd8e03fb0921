// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_executors.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "program/text.hpp"

namespace hotpath::imports {

namespace {

bool counts(const tracing::System& system, std::uint32_t c) {
  const tracing::Callback& callback = system.callbacks[c];
  const bool is_task =
      callback.kind == tracing::CallbackKind::timer || callback.kind == tracing::CallbackKind::subscription;
  return is_task && callback.node != kNone && !callback.threads.empty();
}

/// The kinds of callbacks of a thread, and their nodes.
struct ThreadUse {
  bool timers = false, others = false;
  std::set<std::uint32_t> nodes;
};

std::vector<ThreadUse> uses_of(const tracing::System& system) {
  std::vector<ThreadUse> uses(system.threads.size());
  for (std::uint32_t c = 0; c < system.callbacks.size(); ++c) {
    if (!counts(system, c)) continue;
    for (const auto& [thread, jobs] : system.callbacks[c].threads) {
      (system.callbacks[c].kind == tracing::CallbackKind::timer ? uses[thread].timers : uses[thread].others) =
          true;
      uses[thread].nodes.insert(system.callbacks[c].node);
    }
  }
  return uses;
}

/// rcl 9 belongs to rclcpp 28 (Jazzy), which has other multi-threaded executors.
bool is_jazzy_or_later(const tracing::System& system) { return std::atoi(system.rcl_version.c_str()) >= 9; }

void find_candidates(const tracing::System& system, const std::vector<ThreadUse>& uses,
                     RecordedExecutor& executor) {
  const std::size_t threads = executor.threads.size();
  const bool waits =
      std::ranges::any_of(executor.threads, [&](std::uint32_t t) { return system.threads[t].waits > 0; });
  const bool timers_apart =
      threads == 2 &&
      std::ranges::any_of(executor.threads,
                          [&](std::uint32_t t) { return uses[t].timers && !uses[t].others; }) &&
      std::ranges::any_of(executor.threads, [&](std::uint32_t t) { return !uses[t].timers; });
  if (waits && threads == 1) {
    executor.candidates = {"default"};
    executor.why = "it has the events of rclcpp's waits and one thread runs its callbacks";
  } else if (waits) {
    executor.candidates = {program::concat(is_jazzy_or_later(system) ? "multi-jazzy:" : "multi:", threads)};
    executor.why = program::concat("it has the events of rclcpp's waits and ", threads,
                                   " threads run its callbacks (rcl ", system.rcl_version, ")");
  } else if (timers_apart) {
    executor.candidates = {"events-re"};
    executor.why = "it has no events of waits, and timers run on a separate thread";
  } else if (threads == 1) {
    executor.candidates = {"events-ro", "static", "cbg:1"};
    executor.why = "it has no events of waits and one thread";
  } else {
    const std::string multi = program::concat("multi:", threads), cbg = program::concat("cbg:", threads);
    executor.candidates = is_jazzy_or_later(system) ? std::vector{cbg} : std::vector{multi, cbg};
    executor.why = program::concat("it has no events of waits and ", threads, " threads");
  }
}

}  // namespace

RecordedExecutors recorded_executors(const tracing::System& system, const std::string& given) {
  // By thread: threads of one executor have one number.
  std::vector<std::uint32_t> executor_of(system.threads.size());
  std::iota(executor_of.begin(), executor_of.end(), 0U);
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    std::ranges::replace(executor_of, std::uint32_t{executor_of[b]}, std::uint32_t{executor_of[a]});
  };
  const std::vector<ThreadUse> uses = uses_of(system);
  for (std::uint32_t c = 0; c < system.callbacks.size(); ++c) {
    if (!counts(system, c)) continue;
    const auto& threads = system.callbacks[c].threads;
    for (const auto& [thread, jobs] : threads) join(threads.begin()->first, thread);
  }
  // Release-and-execute: a thread with timers only serves the same nodes as another thread.
  for (std::uint32_t a = 0; a < uses.size(); ++a) {
    for (std::uint32_t b = 0; b < uses.size(); ++b) {
      const bool apart = uses[a].timers && !uses[a].others && uses[b].others && !uses[b].timers;
      if (!apart || system.threads[a].waits + system.threads[b].waits > 0) continue;
      if (std::ranges::any_of(uses[a].nodes, [&](std::uint32_t n) { return uses[b].nodes.contains(n); }))
        join(b, a);
    }
  }
  RecordedExecutors result;
  std::map<std::uint32_t, std::uint32_t> index;
  for (std::uint32_t t = 0; t < system.threads.size(); ++t) {
    if (uses[t].nodes.empty()) continue;
    const auto [at, is_new] =
        index.try_emplace(executor_of[t], static_cast<std::uint32_t>(result.executors.size()));
    if (is_new) {
      // Processes of different containers may have threads with equal ids.
      const tracing::Thread& first = system.threads[t];
      const std::string of_process =
          system.processes.size() > 1 ? program::concat("process_", first.process, "_") : std::string();
      result.executors.push_back(
          {program::concat(of_process, "thread_", first.id), first.process, {}, {}, {}});
    }
    result.executors[at->second].threads.push_back(t);
  }
  for (RecordedExecutor& executor : result.executors) {
    find_candidates(system, uses, executor);
    if (given.empty()) continue;
    executor.candidates = {given};
    executor.why = "it was given with --executor";
  }
  for (std::uint32_t c = 0; c < system.callbacks.size(); ++c) {
    const bool ran = counts(system, c);
    result.of_callback.push_back(ran ? index.at(executor_of[system.callbacks[c].threads.begin()->first])
                                     : kNone);
  }
  return result;
}

std::vector<std::int32_t> usual_processors(const tracing::Thread& thread) {
  std::vector<std::int32_t> usual;
  for (const auto& [processor, jobs] : thread.processors)
    if (100 * jobs >= thread.jobs) usual.push_back(processor);
  return usual;
}

}  // namespace hotpath::imports
