// SPDX-License-Identifier: Apache-2.0
#include "termination.hpp"

#include <pthread.h>
#include <ros/init.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <thread>

namespace hotpath {

using namespace std::chrono_literals;

namespace {
std::atomic<bool> requested{false};
}

void handle_termination() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::thread([signals] {
    int signal = 0;
    sigwait(&signals, &signal);
    requested = true;
    ros::requestShutdown();
    std::this_thread::sleep_for(5s);
    _exit(0);
  }).detach();
}

bool terminated(std::chrono::milliseconds time) {
  constexpr std::chrono::milliseconds kLook{20};
  for (; !requested && time > 0ms; time -= kLook) std::this_thread::sleep_for(std::min(time, kLook));
  return requested;
}

}  // namespace hotpath
