// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/resource.h>
#include <sys/types.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/time.hpp"
#include "hotpath/live/clock.hpp"
#include "hotpath/live/thread_setup.hpp"
#include "hotpath/reference_system/run_memory.hpp"

namespace hotpath {

/// Version of what the programs of a run share: the dialogue in ChannelMessages, and RunMemory with its
/// records. Each change of one of them raises it.
inline constexpr int kRunLayout = 2;
/// Why programs with different layouts cannot share a run.
inline constexpr const char* kOtherLayout =
    "hotpath and hotpath_rclcpp_runner were built from different versions; build both from one with "
    "launch_scripts/ros2_build.sh, and source its setup.bash";

/// A message between the coordinator and a process of a run.
struct ChannelMessage {
  enum class Kind : std::uint32_t {
    matched,  ///< Process: all endpoints are matched.
    begin,    ///< Coordinator: number[0] is the epoch, number[1] the end.
    begun,  ///< Process: its threads run; text lists their policies; number[0]: whether the timer management
            ///< thread has the ordinary policy.
    stop,   ///< Coordinator: end now.
    stopped,  ///< Process: no job runs any more; number[0] is the instant of the end.
    settle,   ///< Coordinator: every process has stopped; number[0] is the end of the run.
    done,     ///< Process: the numbers are its Usage; publisher: number[0] counts its lost samples.
    leave,    ///< Coordinator: every process is done, and has received what the others published.
    failed,   ///< Process: text is the reason.
    closed,   ///< Not sent: the other end is gone.
  };
  enum Usage : std::size_t { cpu_time_ns, peak_memory_kib, voluntary_switches, involuntary_switches };
  using Numbers = std::array<std::int64_t, 4>;

  ChannelMessage(Kind message_kind, const Numbers& numbers = {}, const std::string& words = "")
      : kind(message_kind), number(numbers) {
    set_text(words);
  }

  Kind kind;
  Numbers number;
  std::array<char, 1024> text{};

  void set_text(const std::string& s);
};

/// One end of a connection between two processes; the destructor closes it.
class Channel {
 public:
  Channel() = default;
  explicit Channel(int descriptor) : descriptor_(descriptor) {}
  Channel(Channel&& other) noexcept : descriptor_(other.descriptor_) { other.descriptor_ = -1; }
  Channel& operator=(Channel&& other) noexcept;
  ~Channel();

  /// Two connected ends. Throws std::system_error.
  static std::array<Channel, 2> make_pair();

  /// Releases the descriptor to a program that this process becomes.
  [[nodiscard]] int for_program() const;

  /// False if the other end is gone.
  bool send(const ChannelMessage& message) const;
  /// The next message; `closed` if the other end is gone, `failed` if it has another layout; std::nullopt
  /// if `until` passes or a signal interrupts the wait.
  std::optional<ChannelMessage> receive(Time until) const;

 private:
  int descriptor_ = -1;
};

/// A copy of this process that runs `work` at the other end of the channel and exits with its
/// result.
struct ForkedProcess {
  pid_t id = -1;  ///< Negative: the fork failed; errno has the reason.
  Channel channel;
};
/// Forks the process; `work` runs in the copy. Throws std::system_error if there is no socket pair.
ForkedProcess fork_process(const std::function<int(const Channel&)>& work);

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
    tell(begun(system.workers()));
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
    tell(done(before, after));
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
  static ChannelMessage begun(const std::vector<WorkerThread>& workers);
  static ChannelMessage done(const rusage& before, const rusage& after);

  const Channel& coordinator_;
};

}  // namespace hotpath
