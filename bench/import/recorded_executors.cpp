// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_executors.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "hotpath/core/worker.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

bool counts(const tracing::Callback& callback) {
  const bool is_task =
      callback.kind == tracing::CallbackKind::timer || callback.kind == tracing::CallbackKind::subscription;
  return is_task && callback.node != kNone && !callback.threads.empty();
}

/// The kinds of callbacks of a thread, and their nodes.
struct ThreadUse {
  bool timers = false, others = false;
  std::set<std::uint32_t> nodes;
};

}  // namespace

RecordedExecutors recorded_executors(const tracing::System& system) {
  // By thread: threads of one executor have one number.
  std::vector<std::uint32_t> executor_of(system.threads.size());
  std::iota(executor_of.begin(), executor_of.end(), 0U);
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    std::ranges::replace(executor_of, std::uint32_t{executor_of[b]}, std::uint32_t{executor_of[a]});
  };
  std::vector<ThreadUse> uses(system.threads.size());
  for (const tracing::Callback& callback : system.callbacks) {
    if (!counts(callback)) continue;
    for (const auto& [thread, jobs] : callback.threads) {
      ThreadUse& use = uses[thread];
      (callback.kind == tracing::CallbackKind::timer ? use.timers : use.others) = true;
      use.nodes.insert(callback.node);
      join(callback.threads.begin()->first, thread);
    }
  }
  // Release-and-execute: a thread with timers only serves the same nodes as another thread, or
  // both are the only ones of their process.
  std::map<std::uint32_t, int> of_process;
  for (std::uint32_t t = 0; t < uses.size(); ++t)
    if (uses[t].timers || uses[t].others) ++of_process[system.threads[t].process];
  for (std::uint32_t a = 0; a < uses.size(); ++a) {
    for (std::uint32_t b = 0; b < uses.size(); ++b) {
      const bool apart = uses[a].timers && !uses[a].others && uses[b].others && !uses[b].timers;
      if (!apart || system.threads[a].waits + system.threads[b].waits > 0) continue;
      const std::uint32_t process = system.threads[a].process;
      const bool alone = process == system.threads[b].process && of_process[process] == 2;
      if (alone ||
          std::ranges::any_of(uses[a].nodes, [&](std::uint32_t n) { return uses[b].nodes.contains(n); }))
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
      const std::string prefix =
          system.processes.size() > 1 ? program::concat("process_", first.process, "_") : std::string();
      result.executors.push_back({program::concat(prefix, "thread_", first.id), first.process, {}});
    }
    result.executors[at->second].threads.push_back(t);
  }
  for (const tracing::Callback& callback : system.callbacks) {
    // Services and clients do not define executors; their threads may serve none.
    const auto known = std::ranges::find_if(
        callback.threads, [&](const auto& thread) { return index.contains(executor_of[thread.first]); });
    const bool ran = callback.node != kNone && known != callback.threads.end();
    result.of_callback.push_back(ran ? index.at(executor_of[known->first]) : kNone);
  }
  return result;
}

std::vector<std::int32_t> usual_processors(const tracing::Thread& thread) {
  std::vector<std::int32_t> usual;
  for (const auto& [processor, jobs] : thread.processors)
    if (100 * jobs >= thread.jobs) usual.push_back(processor);
  return usual;
}

unsigned cores_of(const tracing::System& system) {
  std::set<std::int32_t> processors;
  for (const tracing::Thread& t : system.threads)
    for (const std::int32_t processor : usual_processors(t)) processors.insert(processor);
  return static_cast<unsigned>(std::clamp<std::size_t>(processors.size(), 1, kMaxWorkers));
}

}  // namespace hotpath::imports
