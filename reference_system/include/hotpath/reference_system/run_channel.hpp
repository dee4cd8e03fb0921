// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// What the coordinator and a process of a run tell each other.
struct ChannelMessage {
  enum class Kind : std::uint32_t {
    matched,  ///< Process: all endpoints have met.
    begin,    ///< Coordinator: number[0] is the epoch, number[1] the end.
    begun,  ///< Process: its threads run; text lists their policies; [0]: the timer management thread has the
            ///< ordinary one.
    stop,   ///< Coordinator: end now.
    stopped,  ///< Process: no job runs any more; number[0] is the instant of the end.
    settle,   ///< Coordinator: every process has stopped.
    done,     ///< Process: numbers are its usage.
    failed,   ///< Process: text says why.
    closed,   ///< Nobody: the other end is gone.
  };
  using Numbers = std::array<std::int64_t, 5>;

  ChannelMessage(Kind what, const Numbers& numbers = {}, const std::string& words = "")
      : kind(what), number(numbers) {
    set_text(words);
  }

  Kind kind;
  Numbers number;
  std::array<char, 1024> text{};

  void set_text(const std::string& s);
};

/// One end of a connection between two processes; closes with its owner.
class Channel {
 public:
  Channel() = default;
  explicit Channel(int descriptor) : descriptor_(descriptor) {}
  Channel(Channel&& other) noexcept : descriptor_(other.descriptor_) { other.descriptor_ = -1; }
  Channel& operator=(Channel&& other) noexcept;
  ~Channel();

  /// Two connected ends. Throws std::system_error.
  static std::array<Channel, 2> make_pair();

  /// For a program that this process becomes: the descriptor, which it takes over.
  [[nodiscard]] int for_program() const;

  /// False when the other end is gone.
  bool send(const ChannelMessage& message) const;
  /// The next message, which is `closed` when the other end is gone; none when `until` passes or a signal
  /// interrupts the wait.
  std::optional<ChannelMessage> receive(Time until) const;

 private:
  int descriptor_ = -1;
};

/// A copy of this process that runs `work` at the other end of the channel, and ends with what it returns.
struct ForkedProcess {
  pid_t id = -1;  ///< Negative: it could not be forked; errno says why.
  Channel channel;
};
ForkedProcess fork_process(const std::function<int(const Channel&)>& work);

}  // namespace hotpath
