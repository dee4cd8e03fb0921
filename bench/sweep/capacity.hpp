// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sweep/rows.hpp"

namespace hotpath {

/// The levels at which a requirement may hold: from `low` to `high`, `step` apart.
struct Levels {
  double low = 0, high = 0, step = 1;

  [[nodiscard]] std::size_t count() const;  ///< >= 1.
  [[nodiscard]] double at(std::size_t index) const { return low + static_cast<double>(index) * step; }
};

/// What came of the search. Levels that were tried have their reason, empty where the requirement held.
struct Capacity {
  std::map<std::size_t, std::string> tried;
  std::optional<std::size_t>
      highest;  ///< Up to it the requirement held wherever it was tried; none: nowhere.
  /// Levels above a failed one at which it holds again: the requirement is not monotone in the level.
  [[nodiscard]] std::vector<std::size_t> again() const;
};

/// Tries `coarse` levels spread over all of them, then halves the distance between the first that fails and
/// the one before. `failure` says why a level fails, empty if it holds.
[[nodiscard]] Capacity find_capacity(const Levels& levels, std::size_t coarse,
                                     const std::function<std::string(double level)>& failure);

/// What a run must fulfil.
struct Requirement {
  bool no_loss = false, deadlines = false;
  std::optional<double> latency_ms;  ///< The largest that a chain's hot-path latency may be.

  /// `no-loss`, `deadlines`, `latency:MS`. Throws UsageError.
  [[nodiscard]] static Requirement parse(const std::vector<std::string>& words);
  /// Why an executor of a run does not fulfil it; empty: it does.
  [[nodiscard]] std::string failure(const std::vector<MeasuredRow>& rows, const std::string& executor) const;
};

}  // namespace hotpath
