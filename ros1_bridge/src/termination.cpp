// SPDX-License-Identifier: Apache-2.0
#include "termination.hpp"

#include <pthread.h>
#include <unistd.h>

#include <utility>

namespace hotpath {

Termination::Termination() {
  sigemptyset(&signals_);
  sigaddset(&signals_, SIGINT);
  sigaddset(&signals_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  thread_ = std::thread([this] { wait_for_signal(); });
}

Termination::~Termination() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  pthread_kill(thread_.native_handle(), SIGTERM);
  thread_.join();
}

bool Termination::requested() const {
  const std::lock_guard lock(mutex_);
  return requested_;
}

bool Termination::wait_for(std::chrono::milliseconds time) const {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, time, [this] { return requested_; });
}

void Termination::on_request(std::function<void()> then) {
  const std::lock_guard lock(mutex_);
  then_ = std::move(then);
}

void Termination::wait_for_signal() {
  constexpr std::chrono::seconds kPatience{5};
  int signal = 0;
  sigwait(&signals_, &signal);
  std::function<void()> then;
  {
    const std::lock_guard lock(mutex_);
    if (ended_) return;
    requested_ = true;
    then = then_;
  }
  changed_.notify_all();
  then();
  std::unique_lock lock(mutex_);
  if (!changed_.wait_for(lock, kPatience, [this] { return ended_; })) _exit(0);
}

}  // namespace hotpath
