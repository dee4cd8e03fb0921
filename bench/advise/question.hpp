// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "advise/advice.hpp"
#include "advise/candidates.hpp"

namespace hotpath::advise {

/// What `hotpath advise` is asked, and where the answer goes.
struct Question {
  /// A graph without chains gets those that are found, which are printed. The objective is by default
  /// `usual`, or worst_lateness for a graph without chains. Throws UsageError, InputError, and OverloadError
  /// with the number of cores that would suffice.
  Question(const Options& options, const std::string& usual);

  /// `costs`: the costs if the options name none. Throws UsageError, InputError.
  [[nodiscard]] std::vector<Candidate> candidates(const std::string& costs) const;
  /// The system's current executor or deployment.
  [[nodiscard]] const Candidate& now(const std::vector<Candidate>& candidates) const;
  /// Names the folder, and prints the content for --json. Throws RunError.
  void finish(const nlohmann::json& content) const;

  const Options options;
  const Graph graph;
  const GraphTasks tasks;
  const Objective objective;
  const std::filesystem::path folder;  ///< New or empty; created by whoever writes first.
};

}  // namespace hotpath::advise
