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
  std::string name;  ///< Of the thread (comm).
  ThreadPolicy policy;
  std::uint64_t processors = 0;  ///< On which it may run, a bit for each of the first 64.
  Duration ran{};                ///< Since its beginning.
  Duration waited{};             ///< Ready to run, without a processor.
  int processor = -1;            ///< On which it ran last.
  Duration stolen{};             ///< Withheld by the hypervisor from that processor.
};

/// Reads the threads that run callbacks from /proc.
class ThreadReader {
 public:
  /// By thread of the system; std::nullopt: it runs no callbacks, has ended, or is of another pid
  /// namespace or user.
  [[nodiscard]] std::vector<std::optional<ThreadFacts>> read(const tracing::System& system);

 private:
  std::map<int, Duration> stolen_;  // by processor
};

/// The name of a process (comm); empty: it has ended.
[[nodiscard]] std::string process_name(std::uint32_t process);

/// The numbers of the set bits, ascending.
[[nodiscard]] std::vector<int> processor_list(std::uint64_t processors);
/// `0,2`.
[[nodiscard]] std::string shown_processors(std::uint64_t processors);

/// Facts from the content of /proc/PID/task/TID/stat and schedstat and of /proc/stat; false: invalid.
[[nodiscard]] bool parse_stat(const std::string& text, std::string& name, int& processor);
[[nodiscard]] bool parse_schedstat(const std::string& text, Duration& ran, Duration& waited);
[[nodiscard]] std::map<int, Duration> parse_stolen(const std::string& text);

}  // namespace hotpath::watch
