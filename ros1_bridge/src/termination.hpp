// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <csignal>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace hotpath {

/// SIGINT and SIGTERM end the process in order. To be made before any other thread, all of which then leave
/// the signals to it. A process that does not end by itself, because a call of ROS or DDS does not return,
/// ends after some seconds: nothing that it holds would be lost.
class Termination {
 public:
  Termination();
  ~Termination();
  Termination(const Termination&) = delete;
  Termination& operator=(const Termination&) = delete;

  bool requested() const;
  /// True when a signal came meanwhile or before.
  bool wait_for(std::chrono::milliseconds time) const;
  /// `then` is called at a signal, in another thread.
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
