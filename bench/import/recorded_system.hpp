// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/tracing/system.hpp"

namespace hotpath::imports {

using tracing::kNone;

/// What the events of a trace do not tell: texts by kind, in the order of import.json.
enum class Remark : std::uint8_t {
  difference,  ///< Between the graph and the system.
  undecided,   ///< Phrases after `whether`: what has two readings.
  fitted,      ///< What the executors show of the graph.
  missing,     ///< What the graph leaves out or replaces, and what a trace does not show.
  assumed,     ///< What is taken for granted: who calls services.
  delivery,    ///< Orders of delivery that are unknown or do not always hold.
  open,        ///< Phrases: executors, and `whether` two readings differ in effect.
  unmodelled,  ///< What may explain a deviation; unless the light is green also among SelfCheck::reasons.
};
using Remarks = std::map<Remark, std::vector<std::string>>;

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

/// A request and the job that may have sent it: indices into the jobs.
using RequestMatch = std::pair<std::size_t, std::size_t>;

/// A service of which the recording leaves open who calls it.
struct OpenService {
  std::uint32_t topic = kNone;
  std::vector<std::string> callers = {};                ///< The first one is taken.
  std::vector<std::vector<RequestMatch>> matches = {};  ///< By caller.
};

/// The first stage of an import: what the events tell without a graph.
struct RecordedSystem {
  std::vector<tracing::Job> jobs = {};  ///< Of all callbacks, by start.
  std::vector<tracing::LostSample> lost = {};
  std::vector<RecordedExecutor> executors = {};
  std::vector<std::uint32_t> executor_of = {};  ///< By callback; kNone: no thread of an executor ran it.
  unsigned cores = 1;
  tracing::Time end{};
  std::vector<OpenService> open = {};
  Remarks remarks = {};
  tracing::System system = {};

  /// The same system with its first jobs only; fewer than it has.
  [[nodiscard]] RecordedSystem beginning(std::size_t jobs) const;
  /// The same system, in which the service of this number is called by another one of its callers.
  [[nodiscard]] RecordedSystem with_caller(std::size_t open_service, std::size_t caller) const;
  [[nodiscard]] const std::string& topic_of(std::uint32_t callback) const {
    return system.topics[system.callbacks[callback].topic].name;
  }
};

/// `jobs`: at least one, in any order. `cores`: of the recorded machine; 0: as many as ran callbacks.
///
/// Callbacks that ran on one thread share an executor. A trace does not show requests to services. They
/// become publications of the callbacks that sent them at the ends of their jobs: of a node with a client of
/// the service, one of which each n-th job precedes nearly each job of the service, whose thread does not
/// idle in between; of several, the one after which it passes by fewest requests (idles, or begins two rounds
/// of its wait set before it serves them), then that with the smallest n, and then the nearest. Where another
/// one is as good, or most requests would have been passed by, the caller is open.
[[nodiscard]] RecordedSystem recorded_system(tracing::System system, std::vector<tracing::Job> jobs,
                                             std::vector<tracing::LostSample> lost, unsigned cores);

/// The processors on which at least one in a hundred of a thread's jobs ended.
[[nodiscard]] std::vector<std::int32_t> usual_processors(const tracing::Thread& thread);

}  // namespace hotpath::imports
