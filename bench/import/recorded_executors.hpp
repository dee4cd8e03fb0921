// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "import/recorded_graph.hpp"

namespace hotpath::imports {

/// Threads that share callbacks.
struct RecordedExecutor {
  std::string name;
  std::uint32_t process = 0;           ///< Id of its process.
  std::vector<std::uint32_t> threads;  ///< Threads that ran callbacks, as indices into the system's threads.
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

}  // namespace hotpath::imports
