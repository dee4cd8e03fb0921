// SPDX-License-Identifier: Apache-2.0
#include "hotpath/bench/interrupt.hpp"

#include <csignal>

namespace hotpath {

namespace {

volatile std::sig_atomic_t received = 0;

void note(int signal) {
  received = signal;
  std::signal(signal, SIG_DFL);
}

}  // namespace

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = note;
  // No SA_RESTART: whatever waits returns and looks.
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

int interrupted() { return received; }

}  // namespace hotpath
