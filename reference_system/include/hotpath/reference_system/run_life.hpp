// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/resource.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "hotpath/live/clock.hpp"
#include "hotpath/live/thread_setup.hpp"
#include "hotpath/reference_system/run_channel.hpp"
#include "hotpath/reference_system/run_memory.hpp"

namespace hotpath {

/// Thrown when the coordinator of a run is gone: the process ends in an orderly way.
struct CoordinatorGone {};

/// The life of a run's process, from matched endpoints to its end, and its dialogue with the
/// coordinator.
class RunLife {
 public:
  explicit RunLife(const Channel& coordinator) : coordinator_(coordinator) {}

  /// `System` is LiveSystem or a type with the same functions. `settle` waits, for a bounded time,
  /// until all samples published for this process have arrived. Throws their exceptions and
  /// CoordinatorGone.
  template <class System>
  void live_through(System& system, Time match_limit, const std::function<void()>& settle) const {
    system.wait_until_matched(match_limit);
    tell(Kind::matched);
    const ChannelMessage begin = expect(Kind::begin);
    const Time epoch = from_ns(begin.number[0]), end = from_ns(begin.number[1]);
    system.start(epoch, end);
    tell({Kind::begun, {timers_are_ordinary(system.workers())}, as_text(system.workers())});
    const bool goes_on = wait(epoch, system);
    const rusage before = own_usage();
    if (goes_on) wait(end, system);
    const Time ended = system.join();
    const rusage after = own_usage();
    tell({Kind::stopped, {to_ns(ended)}});

    const Time end_of_run = from_ns(expect(Kind::settle).number[0]);
    settle();
    // Other processes may have stopped later: what became ready here until then belongs to the run.
    system.close(std::max(ended, end_of_run));
    ChannelMessage done(Kind::done);
    done.number[ChannelMessage::cpu_time_ns] = (cpu_time(after) - cpu_time(before)).count();
    done.number[ChannelMessage::peak_memory_kib] = after.ru_maxrss;
    done.number[ChannelMessage::voluntary_switches] = after.ru_nvcsw - before.ru_nvcsw;
    done.number[ChannelMessage::involuntary_switches] = after.ru_nivcsw - before.ru_nivcsw;
    tell(done);
    expect(Kind::leave);  // a writer that goes takes samples with it that another process still awaits
  }

 private:
  using Kind = ChannelMessage::Kind;

  /// Waits until `end`; returns false if the coordinator requests an earlier end.
  template <class System>
  bool wait(Time end, System& system) const {
    while (now() < end) {
      const auto message = receive(end);
      if (message && message->kind == Kind::stop) {
        system.stop();
        return false;
      }
    }
    return true;
  }

  [[nodiscard]] std::optional<ChannelMessage> receive(Time limit) const;
  ChannelMessage expect(Kind kind) const;
  void tell(const ChannelMessage& message) const;

  static rusage own_usage();
  static Duration cpu_time(const rusage& usage);
  static std::string as_text(const std::vector<WorkerThread>& workers);
  /// Whether the timer management thread runs under the ordinary policy.
  static bool timers_are_ordinary(const std::vector<WorkerThread>& workers);

  const Channel& coordinator_;
};

}  // namespace hotpath
