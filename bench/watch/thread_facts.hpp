// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/live/thread_setup.hpp"
#include "hotpath/tracing/system.hpp"

namespace hotpath::watch {

/// A thread by the ids of its process and of itself.
using ThreadKey = std::pair<std::uint32_t, std::uint32_t>;
[[nodiscard]] inline ThreadKey key_of(const tracing::Thread& thread) { return {thread.process, thread.id}; }

/// What the operating system says of a thread at one instant.
struct ThreadFacts {
  std::uint32_t process = 0, thread = 0;  ///< Ids.
  bool timers = false;                    ///< The timer thread of one of hotpath's executors.
  std::string name = {};                  ///< Of the thread (comm).
  char state = 'S';                       ///< As in proc(5): R: runs or could run; T: stopped.
  ThreadPolicy policy = {};
  bool inherited = false;  ///< The policy has a niceness, which is that of the watcher when it began.
  std::vector<int> processors = {};  ///< On which it may run, ascending.
  Duration ran{};                    ///< Since its beginning.
  Duration waited{};                 ///< Ready to run, without a processor.
  int processor = -1;                ///< On which it ran last.
  Duration stolen{};                 ///< Withheld by the hypervisor from that processor.
  std::uint64_t started = 0;         ///< Clock ticks since the boot: ids are used again.
  std::uint64_t throttled = 0;       ///< How often the control group of its process has been throttled.

  [[nodiscard]] ThreadKey key() const { return {process, thread}; }
};

/// The threads of a system at one instant.
struct ThreadReading {
  Time at{};
  /// Without threads that have ended, or are of another pid namespace or user.
  std::vector<ThreadFacts> facts = {};
  /// That have ended, as far as the reading searched for them. Id 0: their process has.
  std::vector<ThreadKey> ended = {};
};

/// Linux counts a wait when it ends. This adds that of a thread which could run, but runs nothing.
class LastingWaits {
 public:
  /// `waited` of the facts, with the wait that has not ended.
  [[nodiscard]] Duration with(const ThreadFacts& facts, Time at);
  void forget(const ThreadKey& ended) { known_.erase(ended); }

 private:
  struct Known {
    std::uint64_t started = 0;
    Duration ran{}, shown{};
    Time since{};  ///< Of the latest facts with another `ran` or state.
  };
  std::map<ThreadKey, Known> known_;
};

/// Reads the threads that run callbacks, and the timer threads of hotpath's executors beside them, from
/// /proc.
class ThreadReader {
 public:
  /// Some microseconds for each thread.
  [[nodiscard]] ThreadReading read(const tracing::System& system, Time at);

 private:
  [[nodiscard]] std::optional<ThreadFacts> facts_of(const ThreadKey& thread, Time at);
  void search(const tracing::System& system, std::vector<ThreadKey>& ended);

  Time searched_{}, stolen_read_{};
  LastingWaits waits_;
  const ThreadPolicy own_ = own_thread_policy();
  std::map<int, Duration> stolen_;  // by processor
  std::set<ThreadKey> timer_threads_;
  std::map<std::uint32_t, std::string> groups_;  // by process: the file of its control group
};

/// Facts from the content of /proc/PID/task/TID/stat and schedstat; false: invalid.
[[nodiscard]] bool parse_stat(const std::string& text, ThreadFacts& facts);
[[nodiscard]] bool parse_schedstat(const std::string& text, ThreadFacts& facts);
/// The file with the throttlings of a control group, from /proc/PID/cgroup, v1 or v2; empty: none.
[[nodiscard]] std::string group_file(const std::string& cgroup);

}  // namespace hotpath::watch
