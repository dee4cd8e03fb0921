// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "explain/totals.hpp"

namespace hotpath::explain {

/// The names of what was explained.
struct Subject {
  const TaskSet& set;
  std::string executor;  ///< Its label; of a comparison of two runs, also the run.
  std::string chain;     ///< Empty: response times of `task`.
  std::string task;
  bool hot_path = false;                   ///< Of a chain: hot-path latencies, not ages of data.
  std::size_t missing = 0;                 ///< Outputs whose jobs the trace lacks.
  std::vector<std::string> warnings = {};  ///< Sentences about overload and starvation.
};

/// What is shown of an explanation: the sentences, and tables and notes as text or the data as JSON.
struct Report {
  std::vector<std::string> sentences;  ///< At most three.
  std::string text;
  nlohmann::json data;
};
[[nodiscard]] Report report(const Subject& subject, const Explanation& explanation);
[[nodiscard]] Report report(const Subject& subject, const Overview& overview);
/// Why one is faster than the other.
[[nodiscard]] Report report(const Subject& a, const Totals& of_a, const Subject& b, const Totals& of_b);

/// Prints to standard output.
void show(const Report& report, bool as_json);

}  // namespace hotpath::explain
