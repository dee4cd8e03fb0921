// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "import/recorded_graph.hpp"

namespace hotpath::imports {

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

struct RecordedExecutors {
  std::vector<RecordedExecutor> executors;
  std::vector<std::uint32_t> of_callback;  ///< By callback; kNone: no thread ran it.
};

/// Callbacks that ran on one thread share an executor.
[[nodiscard]] RecordedExecutors recorded_executors(const tracing::System& system);

/// The processors on which at least one in a hundred of a thread's jobs ended.
[[nodiscard]] std::vector<std::int32_t> usual_processors(const tracing::Thread& thread);

/// The number of processors that the threads usually ran on, in [1, kMaxWorkers].
[[nodiscard]] unsigned cores_of(const tracing::System& system);

/// Attributes requests to the callbacks that sent them, as publications at the ends of their jobs,
/// because a trace shows neither. A callback of a node with a client of the service is the caller
/// if it ran about as often as the service, and nearly all jobs of the service follow one job each
/// of it; of several, the one whose jobs end closest before. `jobs` are in the order of starts.
/// Returns one sentence for each service with a caller.
[[nodiscard]] std::vector<std::string> attribute_requests(const tracing::System& system,
                                                          std::vector<tracing::Job>& jobs);

/// Sentences about callbacks of clients and waitables that the trace does not show.
[[nodiscard]] std::vector<std::string> unseen_callbacks(const tracing::System& system,
                                                        const std::vector<RecordedExecutor>& executors);

}  // namespace hotpath::imports
