// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// One line on a terminal's standard error that says what runs and how long it takes yet; nothing in a log.
class Progress {
 public:
  /// `total`: expected time of all steps.
  explicit Progress(Duration total);
  ~Progress();

  /// A step begins, after steps that were expected to take `before`.
  void begin(const std::string& what, Duration before);
  /// The step has run for `elapsed` of the `expected` time.
  void update(Duration elapsed, Duration expected);
  /// Removes the line, for other output.
  void clear();

 private:
  const bool terminal_;
  const Duration total_;
  Duration before_{};
  std::string what_;
};

}  // namespace hotpath
