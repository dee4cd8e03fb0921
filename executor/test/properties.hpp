// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace hotpath::test {

/// The result of one random case of a property.
struct CaseResult {
  std::string wrong;     ///< The violation; empty if the property holds.
  std::size_t jobs = 0;  ///< Number of jobs checked.
};

/// An invariant of every schedule of certain executors, for any task set.
struct Property {
  std::string name;         ///< `property/executor`, unique.
  std::uint64_t cases;      ///< Number of cases that every run of the tests checks.
  std::size_t fewest_jobs;  ///< Per case on average; with fewer the property says nothing.
  /// Draws a task set or graph and checks its schedule. Depends only on the seed.
  std::function<CaseResult(std::uint64_t seed)> check;
};

/// All properties that the program checks.
std::vector<Property> properties();

}  // namespace hotpath::test
