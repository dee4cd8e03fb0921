// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "hotpath/tracing/system.hpp"

namespace hotpath::imports {

using tracing::kNone;

/// Threads that share callbacks.
struct RecordedExecutor {
  std::string name;
  std::uint32_t process = 0;           ///< Id of its process.
  std::vector<std::uint32_t> threads;  ///< Threads that ran callbacks, as indices into the system's threads.

  [[nodiscard]] bool has(std::uint32_t thread) const { return std::ranges::count(threads, thread) > 0; }
  [[nodiscard]] bool is(const tracing::StatedExecutor& stated) const {
    return std::ranges::any_of(threads, [&](std::uint32_t t) { return stated.threads.contains(t); });
  }
};

/// The first stage of an import: what the events tell without a graph.
struct RecordedSystem {
  std::vector<tracing::Job> jobs = {};  ///< Of all callbacks, by start.
  std::vector<tracing::LostSample> lost = {};
  std::vector<RecordedExecutor> executors = {};
  std::vector<std::uint32_t> executor_of = {};  ///< By callback; kNone: no thread of an executor ran it.
  unsigned cores = 1;
  tracing::Time end{};
  std::vector<std::string> notes = {};    ///< Sentences about what is taken for granted.
  std::vector<std::string> missing = {};  ///< Sentences about what a trace does not show.
  tracing::System system = {};

  /// The same system with its first jobs only; fewer than it has.
  [[nodiscard]] RecordedSystem beginning(std::size_t jobs) const;
};

/// `jobs`: at least one, in any order. Requests to services become publications of the callbacks that sent
/// them. `cores`: of the recorded machine; 0: as many as ran callbacks.
[[nodiscard]] RecordedSystem recorded_system(tracing::System system, std::vector<tracing::Job> jobs,
                                             std::vector<tracing::LostSample> lost, unsigned cores);

/// Callbacks that ran on one thread share an executor.
[[nodiscard]] std::vector<RecordedExecutor> recorded_executors(const tracing::System& system);

/// By callback: whether it overlapped others of its node, with which it shares no exclusive group, or itself.
struct Overlaps {
  std::vector<bool> others, itself;
};
[[nodiscard]] Overlaps overlaps_of(const RecordedSystem& recorded, const std::vector<bool>& is_task);

/// The processors on which at least one in a hundred of a thread's jobs ended.
[[nodiscard]] std::vector<std::int32_t> usual_processors(const tracing::Thread& thread);

/// Attributes requests, which a trace does not show, to the callbacks that sent them at the ends of their
/// jobs: of a node with a client of the service, one of which each n-th job precedes nearly each job of the
/// service, whose thread does not idle in between; of several, the one with the smallest n, and then the
/// nearest. `jobs` are in the order of starts. Returns one sentence for each service with a caller.
[[nodiscard]] std::vector<std::string> attribute_requests(const tracing::System& system,
                                                          std::vector<tracing::Job>& jobs);

}  // namespace hotpath::imports
