// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hotpath {

/// A bound of a task or chain and the largest value observed, nanoseconds; none where there is no bound, or
/// nothing ran.
struct BoundAndObservation {
  std::string name;
  std::optional<std::int64_t> bound;
  std::optional<std::int64_t> observed;
};

struct Tightness {
  std::string name;
  std::optional<std::int64_t> bound;
  std::optional<std::int64_t> observed;
  std::optional<double> ratio;  ///< observed / bound.
  bool violated = false;        ///< observed > bound.
};

struct TightnessReport {
  std::vector<Tightness> rows;
  std::size_t violations = 0;
};

/// Sets bounds against observations. Throws AnalysisError for a bound that is not positive.
TightnessReport compare_with_bounds(const std::vector<BoundAndObservation>& pairs);

}  // namespace hotpath
