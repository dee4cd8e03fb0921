// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "simulated/simulated_run.hpp"

namespace hotpath::sweep {

/// The levels of a search: from `low` to `high`, `step` apart.
struct Levels {
  double low = 0, high = 0, step = 1;

  /// >= 1.
  [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>((high - low) / step + 1e-9) + 1; }
  [[nodiscard]] double at(std::size_t index) const;  ///< Rounded to 12 digits.
};

/// The result of a search.
struct Capacity {
  std::map<std::size_t, std::optional<std::string>> tried;  ///< Why each level failed; none: it held.
  /// The requirement held at this level and at every tried level below; none: it held nowhere.
  std::optional<std::size_t> highest;
  /// Levels above a failed one at which the requirement holds: it is not monotone in the level.
  [[nodiscard]] std::vector<std::size_t> again() const;
};

/// Tries `coarse` levels, >= 2, spread over the range, then bisects between the first level that fails and
/// the level before it. `failure` returns why a level fails, none if it holds.
[[nodiscard]] Capacity find_capacity(const Levels& levels, std::size_t coarse,
                                     const std::function<std::optional<std::string>(double level)>& failure);

/// The requirement on a run.
struct Requirement {
  bool no_loss = false, deadlines = false;
  std::map<Latency, double> most_ms{};  ///< Of every chain.
  std::vector<std::string> words;       ///< As given.

  /// Parses `no-loss`, `deadlines`, `age:MS` and `latency:MS`. Throws UsageError.
  [[nodiscard]] static Requirement parse(const std::vector<std::string>& words);
  /// Why an executor does not meet the requirement in every repetition; none: it does.
  [[nodiscard]] std::optional<std::string> failure(const results::ExecutorSummary& executor) const;
};

/// The quantity that grows from level to level.
enum class Over : std::uint8_t { load, rate, copies };
constexpr auto enum_texts(Over) { return texts_in_order<Over>({"load", "rate", "copies"}); }

struct CapacityOptions : simulated::Options {
  Over over = Over::load;
  Requirement require = Requirement::parse({"no-loss", "deadlines"});
  double from = 5, to = 120, resolution = 1;
};

/// Searches for the largest level of each executor and deployment, prints the results as a table
/// and writes them, with every tried level, into the output folder. Throws UsageError for too many
/// levels.
void search_capacities(const CapacityOptions& options);

}  // namespace hotpath::sweep
