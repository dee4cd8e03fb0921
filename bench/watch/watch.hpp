// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "hotpath/core/enum_text.hpp"

namespace hotpath::watch {

enum class FailOn : std::uint8_t { broken };
constexpr auto enum_texts(FailOn) { return texts_in_order<FailOn>({"broken"}); }

struct WatchOptions {
  std::vector<std::string> command;  ///< Program and arguments; empty: attach to programs that run.
  bool print_environment = false;    ///< Only print the variables of programs to attach to.
  std::optional<double> seconds;     ///< Length; by default until the program or an interrupt ends it.
  bool once = false, json = false;
  std::string contract;                ///< File; empty: none.
  std::optional<FailOn> fail_on = {};  ///< Needs a contract.
  std::string record;                  ///< Folder for the last events; empty: not kept.
  std::optional<double> keep;          ///< Seconds of events that are kept.
};

/// Starts the program with the sensor, and reports what its callbacks do until it ends, until the
/// given time, or until an interrupt. Then it asks the program to end. Without a program it attaches
/// to those that run with the sensor, and leaves them running. Throws UsageError and InputError,
/// RunError if the program cannot be started or fails, and ContractBroken.
void watch(const WatchOptions& options);

}  // namespace hotpath::watch
