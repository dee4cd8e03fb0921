// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace hotpath::test {

/// What came of one random case of a property.
struct CaseResult {
  std::string wrong;     ///< Empty: the property holds.
  std::size_t jobs = 0;  ///< Jobs that were looked at.
};

/// Something that must hold of every schedule of certain executors, whatever the task set.
struct Property {
  std::string name;     ///< `property/executor`, unique.
  std::uint64_t cases;  ///< How many the unit tests look at.
  /// Draws a task set or graph and checks its schedule. A function of the seed alone; may be called by
  /// several threads at once.
  std::function<CaseResult(std::uint64_t seed)> check;
};

/// All properties that the program looks at.
std::vector<Property> properties();

/// What the checks have found out beside, as lines of text.
std::string findings();

}  // namespace hotpath::test
