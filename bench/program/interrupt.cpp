// SPDX-License-Identifier: Apache-2.0
#include "program/interrupt.hpp"

#include <csignal>
#include <ctime>

namespace hotpath::program {

namespace {

volatile std::sig_atomic_t received = 0;
volatile std::time_t received_at = 0;

std::time_t seconds_now() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec;
}

void note(int signal) {
  if (received == 0) {
    received_at = seconds_now();
    received = signal;
  } else if (seconds_now() > received_at + 1) {
    std::signal(signal, SIG_DFL);
    raise(signal);
  }
}

}  // namespace

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = note;
  // No SA_RESTART: blocking calls return, so that their callers check interrupted().
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

int interrupted() { return received; }

}  // namespace hotpath::program
