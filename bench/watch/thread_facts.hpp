// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/thread_policy.hpp"
#include "hotpath/tracing/system.hpp"

namespace hotpath::watch {

/// What the operating system says of a thread at one instant.
struct ThreadFacts {
  std::uint32_t process = 0, thread = 0;  ///< Ids.
  bool timers = false;                    ///< The timer thread of one of hotpath's executors.
  std::string name = {};                  ///< Of the thread (comm).
  ThreadPolicy policy = {};
  std::uint64_t processors = 0;  ///< On which it may run, a bit for each of the first 64.
  Duration ran{};                ///< Since its beginning.
  Duration waited{};             ///< Ready to run, without a processor.
  int processor = -1;            ///< On which it ran last.
  Duration stolen{};             ///< Withheld by the hypervisor from that processor.
};

/// Reads the threads that run callbacks, and the timer threads of hotpath's executors beside them, from
/// /proc.
class ThreadReader {
 public:
  /// Without threads that have ended, or are of another pid namespace or user. Some microseconds for
  /// each thread.
  [[nodiscard]] std::vector<ThreadFacts> read(const tracing::System& system);

 private:
  /// Processes are searched for timer threads at every n-th reading.
  static constexpr std::uint64_t kSearch = 5;
  [[nodiscard]] std::optional<ThreadFacts> read(std::uint32_t process, std::uint32_t thread) const;
  void search(const tracing::System& system);

  std::uint64_t readings_ = 0;
  std::map<int, Duration> stolen_;                        // by processor
  std::map<std::uint32_t, std::uint32_t> timer_threads_;  // their processes, by thread
};

/// The name of a process (comm); empty: it has ended.
[[nodiscard]] std::string process_name(std::uint32_t process);

/// The numbers of the set bits, ascending.
[[nodiscard]] std::vector<int> processor_list(std::uint64_t processors);
/// `0,2`.
[[nodiscard]] std::string shown_processors(std::uint64_t processors);

/// Facts from the content of /proc/PID/task/TID/stat and schedstat; false: invalid.
[[nodiscard]] bool parse_stat(const std::string& text, std::string& name, int& processor);
[[nodiscard]] bool parse_schedstat(const std::string& text, Duration& ran, Duration& waited);

}  // namespace hotpath::watch
