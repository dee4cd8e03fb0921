// SPDX-License-Identifier: Apache-2.0
#include "program/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace hotpath {

Progress::Progress(Duration total) : terminal_(isatty(STDERR_FILENO) != 0), total_(total) {}

Progress::~Progress() { clear(); }

void Progress::begin(const std::string& what, Duration before) {
  what_ = what;
  before_ = before;
  update(Duration::zero(), Duration::zero());
}

void Progress::update(Duration elapsed, Duration expected) {
  if (!terminal_) return;
  const auto left =
      std::chrono::ceil<std::chrono::seconds>(std::max(total_ - before_ - elapsed, Duration::zero()));
  const auto done = std::chrono::floor<std::chrono::seconds>(std::min(elapsed, expected));
  const auto of = std::chrono::round<std::chrono::seconds>(expected);
  std::fprintf(stderr, "\r\033[K%s: %lld of %lld s; %lld min %02lld s left", what_.c_str(),
               static_cast<long long>(done.count()), static_cast<long long>(of.count()),
               static_cast<long long>(left.count() / 60), static_cast<long long>(left.count() % 60));
  std::fflush(stderr);
}

void Progress::clear() {
  if (!terminal_) return;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
}

}  // namespace hotpath
