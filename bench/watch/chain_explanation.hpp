// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "watch/flight_recorder.hpp"

namespace hotpath::watch {

/// Where the time of a chain went in the kept events: `hotpath import` and `hotpath explain`, in a process
/// of its own.
class ChainExplanation {
 public:
  /// `chain`: as for `hotpath import ctf --chain`. Throws RunError.
  ChainExplanation(const FlightRecorder& recorder, const std::string& chain);
  ChainExplanation(const ChainExplanation&) = delete;
  ChainExplanation& operator=(const ChainExplanation&) = delete;
  /// Ends the process.
  ~ChainExplanation();

  /// The lines of `hotpath explain`, or of what failed, once it has ended.
  [[nodiscard]] std::optional<std::vector<std::string>> lines();

 private:
  std::filesystem::path folder_;
  pid_t id_ = -1;
};

}  // namespace hotpath::watch
