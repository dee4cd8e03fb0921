// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
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
  std::size_t missing = 0;  ///< Outputs whose jobs the trace lacks.
};

/// At most three sentences.
[[nodiscard]] std::vector<std::string> sentences(const Subject& subject, const Explanation& explanation);
[[nodiscard]] std::vector<std::string> sentences(const Subject& subject, const Overview& overview);
/// Why one is faster than the other.
[[nodiscard]] std::vector<std::string> sentences(const Subject& a, const Subject& b, const Comparison& c);

/// The sentences and a table.
void write(std::ostream& out, const Subject& subject, const Explanation& explanation);
void write(std::ostream& out, const Subject& subject, const Overview& overview);
void write(std::ostream& out, const Subject& a, const Subject& b, const Comparison& comparison);

[[nodiscard]] nlohmann::json json_of(const Subject& subject, const Explanation& explanation);
[[nodiscard]] nlohmann::json json_of(const Subject& subject, const Overview& overview);
[[nodiscard]] nlohmann::json json_of(const Subject& a, const Subject& b, const Comparison& comparison);

}  // namespace hotpath::explain
