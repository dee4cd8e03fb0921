// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "live/publisher_process.hpp"

namespace hotpath {

/// The process that publishes a repetition, as the coordinator sees it. Whatever becomes of it, the
/// repetition goes on.
class Publisher {
 public:
  /// `process` runs run_publisher_process(); negative when it could not be forked.
  Publisher(pid_t process, Channel channel) : process_(process), channel_(std::move(channel)) {}

  /// Waits until it can publish or never will, so that its set-up does not fall into the measurement.
  void await_ready(Time limit);
  void begin(Time epoch, Time end);
  /// Everything is recorded; the run ended at `end`.
  void stop(Time end);
  /// Waits for its end, for a bounded time, and adds what went wrong in one sentence.
  void finish(std::vector<std::string>& warnings);

 private:
  /// What it says next; false when it is gone or `limit` has passed.
  bool receive(ChannelMessage::Kind kind, Time limit);
  std::string cause_of_end();

  pid_t process_;
  Channel channel_;
  std::int64_t samples_lost_ = 0;
  std::string failure_;
};

}  // namespace hotpath
