// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

/// What `hotpath watch --json` says, in the form of ROS diagnostics. Without ROS: the nodes for ROS 2
/// and ROS 1 share it.
namespace hotpath {

/// diagnostic_msgs/DiagnosticStatus, with its values of `level`.
struct WatchStatus {
  enum class Level : std::uint8_t { ok, warn, error, stale };
  Level level = Level::ok;
  std::string name, message;
  std::vector<std::array<std::string, 2>> values;
};

/// A line is not a report of `hotpath watch --json`.
struct NoReport : std::runtime_error {
  explicit NoReport(const std::string& why)
      : std::runtime_error("the input is no report of `hotpath watch --json`: " + why) {}
};

/// One status for the watcher, for each callback that ran, for each subject of the contract, which is a
/// callback or what else a contract has terms for, and for the latest incident. An incident is an error
/// in the line that states it, and then a warning.
///
/// A subject is in error if a term was broken since the previous line. A term that was broken
/// earlier, or that cannot be judged because events were lost, is a warning. A subject of which no
/// term can be judged is stale.
class WatchStatuses {
 public:
  /// Of the next line. Throws NoReport.
  std::vector<WatchStatus> of(const std::string& line);
  /// The statuses of the latest line, stale, because no further line has come. `reason`: why.
  [[nodiscard]] std::vector<WatchStatus> stale(const std::string& reason) const;

 private:
  std::map<std::string, std::uint64_t> counts_;  // of the latest line
  std::vector<WatchStatus> latest_;
  std::optional<WatchStatus> incident_;
};

}  // namespace hotpath
