// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <deque>
#include <string>
#include <vector>

#include "hotpath/live/clock.hpp"
#include "hotpath/reference_system/run_channel.hpp"
#include "live/repetition_runner.hpp"
#include "program/child_process.hpp"
#include "program/text.hpp"

namespace hotpath::live {

/// The process that publishes a repetition while it runs (`plan.published`), from its fork to its
/// end. It reads the records of the measured processes in `memories` and yields to all other
/// processes (nice 19). Messages with the coordinator: `matched` when it is ready, then `begin`,
/// then `stop` with the end of the run, then `done` with the number of lost chain samples. Returns
/// the exit code.
int run_publisher_process(const Plan& plan, const std::deque<RunMemory>& memories,
                          const Channel& coordinator);

/// The coordinator's side of the publishing process, whose failure does not end the repetition.
class Publisher {
 public:
  /// `process` runs run_publisher_process().
  explicit Publisher(ForkedProcess process) : process_(std::move(process)) {}

  /// Waits until the process is ready or has failed: its set-up must not overlap the measurement.
  void await_ready(Time limit) { receive(Kind::matched, limit); }
  void begin(Time epoch, Time end) { process_.channel.send({Kind::begin, {to_ns(epoch), to_ns(end)}}); }
  /// Everything is recorded; the run ended at `end`.
  void stop(Time end) { process_.channel.send({Kind::stop, {to_ns(end)}}); }
  /// Waits for the end of the process, for a bounded time, and adds a warning for each problem.
  void finish(std::vector<std::string>& warnings) {
    receive(Kind::done, now() + kTimeToEnd);
    const std::string cause = cause_of_end();
    if (failure_.empty()) failure_ = cause;
    if (!failure_.empty())
      warnings.push_back("Live publishing stopped (" + failure_ + "); the run itself continued.");
    if (samples_lost_ > 0) {
      warnings.push_back(
          program::concat("Live publishing: ", samples_lost_,
                          " chain samples may not have reached every reader: a reader was too slow."));
    }
  }

 private:
  using Kind = ChannelMessage::Kind;
  /// At nice 19 it gets little of a busy processor, and it flushes for a second.
  static constexpr Duration kTimeToEnd = std::chrono::seconds(5);

  /// Waits for `kind`, the end of the process, or `limit`.
  void receive(Kind kind, Time limit) {
    while (process_.id > 0 && failure_.empty() && now() < limit) {
      const auto message = process_.channel.receive(limit);
      if (!message) continue;
      if (message->kind == Kind::failed) failure_ = message->text.data();
      if (message->kind == Kind::done) samples_lost_ = message->number[0];
      if (message->kind == kind || message->kind == Kind::closed) return;
    }
  }

  std::string cause_of_end() {
    if (process_.id < 0) return "its process could not be started";
    int status = 0;
    const Time limit = now() + kTimeToEnd;
    while (program::await_process(process_.id, &status, WNOHANG) == 0) {
      if (now() < limit) {
        usleep(1000);
        continue;
      }
      kill(process_.id, SIGKILL);
      program::await_process(process_.id, nullptr);
      return "its process did not end in time and was killed";
    }
    return status == 0 ? "" : "its process " + program::how_it_ended(status);
  }

  ForkedProcess process_;
  std::int64_t samples_lost_ = 0;
  std::string failure_;
};

}  // namespace hotpath::live
