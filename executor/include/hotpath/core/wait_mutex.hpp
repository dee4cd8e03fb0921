// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "hotpath/core/worker.hpp"

namespace hotpath {

/// The mutex under which the workers of rclcpp's MultiThreadedExecutor look for work and wait for
/// it (multi_threaded_executor.cpp): one idle worker sleeps in rcl_wait and keeps the mutex, the
/// others queue for it, also those that have just ended a job.
class WaitMutex {
 public:
  /// `worker` looks for work. Returns whether another worker keeps the mutex; then this one queues.
  bool blocks(Worker worker) {
    if (!waiting_ || waiting_ == worker) return false;
    idle_.insert(worker);
    return true;
  }

  /// `worker` looks for work. Returns whether this worker slept in rcl_wait.
  bool enter(Worker worker) {
    idle_.erase(worker);
    if (waiting_ != worker) return false;
    waiting_.reset();
    return true;
  }

  /// The worker that gets the mutex after a worker has found a job: it runs the rest of the
  /// snapshot or waits in its place.
  [[nodiscard]] WorkerSet next() const {
    return waiting_ || idle_.empty() ? WorkerSet{} : WorkerSet::of(idle_.first());
  }

  /// `worker` found no job. Returns whether it sleeps in rcl_wait, which it does unless another
  /// worker does.
  bool wait(Worker worker) {
    idle_.insert(worker);
    if (waiting_) return false;
    waiting_ = worker;
    return true;
  }

  /// The worker in rcl_wait, if there is one.
  [[nodiscard]] WorkerSet waiting() const { return waiting_ ? WorkerSet::of(*waiting_) : WorkerSet{}; }

 private:
  WorkerSet idle_;
  std::optional<Worker> waiting_;
};

}  // namespace hotpath
