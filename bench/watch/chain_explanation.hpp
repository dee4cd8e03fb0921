// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "program/forked_task.hpp"
#include "watch/flight_recorder.hpp"

namespace hotpath::watch {

/// Where the time of a chain went in the kept events: `hotpath import` and `hotpath explain`, in a process
/// of its own.
class ChainExplanation {
 public:
  /// `chain`: as for `hotpath import ctf --chain`. Throws RunError.
  ChainExplanation(const FlightRecorder& recorder, const std::string& chain);
  /// The lines of `hotpath explain`, or of what failed, once it has ended.
  [[nodiscard]] std::optional<std::vector<std::string>> lines();

 private:
  struct Folder {
    Folder();
    ~Folder();
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    const std::filesystem::path path;
  };
  Folder folder_;
  program::ForkedTask task_;
};

}  // namespace hotpath::watch
