// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
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

}  // namespace hotpath::watch
