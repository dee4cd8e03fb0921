// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <csignal>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace hotpath {

/// Handles SIGINT and SIGTERM for an orderly end. Construct it before any other thread starts, so
/// that all threads block these signals. If a ROS or DDS call does not return, it ends the process
/// after 5 s; the bridge has no data to lose.
class Termination {
 public:
  Termination();
  ~Termination();
  Termination(const Termination&) = delete;
  Termination& operator=(const Termination&) = delete;

  bool requested() const;
  /// Waits for at most `time`; returns whether a signal has arrived, now or earlier.
  bool wait_for(std::chrono::milliseconds time) const;
  /// Calls `then` on a signal, in another thread.
  void on_request(std::function<void()> then);

 private:
  void wait_for_signal();

  sigset_t signals_{};
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  bool requested_ = false, ended_ = false;
  std::function<void()> then_ = [] {};
  std::thread thread_;
};

}  // namespace hotpath
