// SPDX-License-Identifier: Apache-2.0
#include "program/interrupt.hpp"

#include <unistd.h>

#include <csignal>
#include <cstring>
#include <ctime>

namespace hotpath::program {

namespace {

volatile std::sig_atomic_t received = 0;
volatile std::time_t received_at = 0;
const char* last_line = "";

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

void end_program(int signal) {
  if (received != 0) return;  // another thread ends the program
  received = signal;
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, last_line, std::strlen(last_line));
  _exit(128 + signal);
}

void handle_with(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  // No SA_RESTART: blocking calls return, so that their callers check interrupted().
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

}  // namespace

void catch_interrupts() { handle_with(note); }

void end_on_interrupt(const char* line) {
  last_line = line;
  handle_with(end_program);
}

int interrupted() { return received; }

}  // namespace hotpath::program
