// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unistd.h>

#include <algorithm>
#include <string>

#include "hotpath/core/time.hpp"
#include "program/shown_text.hpp"
#include "program/text.hpp"

namespace hotpath::program {

/// A progress line with the remaining time on standard error, if that is a terminal.
class Progress {
 public:
  /// `expected`: time of each step; 0: unknown before it runs.
  Progress(std::size_t steps, Duration expected) : steps_(steps), expected_(expected) {}
  ~Progress() { clear(); }

  /// The next step begins.
  void begin(const std::string& name) {
    name_ = concat("[", ++step_, "/", steps_, "] ", name);
    update(Duration::zero(), Duration::zero());
  }
  /// The step has run for `elapsed` of `most`.
  void update(Duration elapsed, Duration most) {
    if (!terminal_) return;
    const auto steps_left = static_cast<std::int64_t>(steps_ - step_ + 1);
    const Duration all = expected_ > Duration::zero() ? steps_left * expected_ : most;
    const auto left = std::chrono::ceil<std::chrono::seconds>(std::max(all - elapsed, Duration::zero()));
    const auto done = std::chrono::floor<std::chrono::seconds>(std::min(elapsed, most));
    const auto of = std::chrono::round<std::chrono::seconds>(most);
    replace_terminal_line(
        name_ + text(": %lld of %lld s; %lld min %02lld s left", static_cast<long long>(done.count()),
                     static_cast<long long>(of.count()), static_cast<long long>(left.count() / 60),
                     static_cast<long long>(left.count() % 60)));
  }
  /// Removes the line, for other output.
  void clear() {
    if (terminal_) replace_terminal_line("");
  }

 private:
  const bool terminal_ = isatty(STDERR_FILENO) != 0;
  const std::size_t steps_;
  const Duration expected_;
  std::size_t step_ = 0;
  std::string name_;
};

}  // namespace hotpath::program
