// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "import/recorded_graph.hpp"

namespace hotpath::imports {

/// Threads that share callbacks, and the executors to which they may belong.
struct RecordedExecutor {
  std::string name;
  std::uint32_t process = 0;            ///< Id of its process.
  std::vector<std::uint32_t> threads;   ///< Threads that ran callbacks, as indices into the system's threads.
  std::vector<std::string> candidates;  ///< Labels as on the command line, the likeliest first; >= 1.
  std::string why;                      ///< The evidence in the trace.
};

struct RecordedExecutors {
  std::vector<RecordedExecutor> executors;
  std::vector<std::uint32_t> of_callback;  ///< By callback; kNone: no thread ran it.
};

/// Callbacks that ran on one thread share an executor. `given`: the executor, if the user knows it.
[[nodiscard]] RecordedExecutors recorded_executors(const tracing::System& system, const std::string& given);

/// The processors on which at least one in a hundred of a thread's jobs ended.
[[nodiscard]] std::vector<std::int32_t> usual_processors(const tracing::Thread& thread);

}  // namespace hotpath::imports
