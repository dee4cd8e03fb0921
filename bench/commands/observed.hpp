// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>

#include "hotpath/core/task.hpp"

namespace hotpath {

/// The largest response times of tasks and end-to-end latencies of chains that a run observed, by executor.
class Observed {
 public:
  /// Throws UsageError, which names `--trace`, for what is not the folder of a run of these tasks.
  Observed(const std::string& folder, const TaskSet& tasks);

  /// None where the run has none.
  std::optional<Duration> task(const std::string& executor, const std::string& name) const;
  std::optional<Duration> chain(const std::string& executor, const std::string& name) const;

 private:
  /// By executor and name.
  using Largest = std::map<std::pair<std::string, std::string>, Duration>;
  Largest tasks_, chains_;
};

}  // namespace hotpath
