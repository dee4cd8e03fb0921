// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "advise/prediction.hpp"

namespace hotpath::advise {

/// The ranking under a changed assumption.
struct Doubt {
  std::string assumption;           ///< Such as `execution times 20 % longer`.
  std::vector<std::string> order;   ///< Names, the best first.
  std::vector<std::string> values;  ///< In that order: name and value, or that it cannot keep up.
  bool same_first = true;           ///< No candidate overtakes the recommended one.
};

/// The result of `hotpath advise`.
struct Advice {
  const Graph& graph;
  const Objective& objective;
  std::vector<const Prediction*> ranked;
  const Prediction* now = nullptr;
  const Prediction* best = nullptr;  ///< nullptr: nothing can be recommended.
  std::uint32_t draws = 0, asked_draws = 0;
  double seconds = 0;  ///< Of each draw, without warm-up.
  std::vector<Doubt> doubts;
  /// Why the recommended executor is faster than today's along the objective's chain, in the first
  /// draw; empty: there is no difference to explain.
  std::vector<std::string> causes;
  /// Labels in the stored runs now/run and recommended/run of the first draw; empty: there are none.
  std::vector<std::string> stored;
  std::string change;  ///< The file of the recommended change; empty: none is needed.
};

/// `21.4 ms`, or another objective's value with its unit.
[[nodiscard]] std::string value_text(const Objective& objective, const Prediction& prediction);

/// The latency that Prediction::bound_ms bounds.
[[nodiscard]] const char* bounded_latency(const Objective& objective);

void write_ranking(std::ostream& out, const Advice& advice);
/// The recommendation and its gain, the confidence in it, its cost, and the timers whose period varies more.
[[nodiscard]] std::vector<std::string> sentences(const Advice& advice);
/// The content of advice.json.
[[nodiscard]] nlohmann::json advice_json(const Advice& advice);

}  // namespace hotpath::advise
