// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "advise/prediction.hpp"

namespace hotpath {

/// What was predicted once more after a change of what was assumed.
struct Doubt {
  std::string assumption;          ///< Such as `execution times 20 % longer`.
  std::vector<std::string> order;  ///< Names, the best first.
  std::vector<std::string> tells;  ///< In that order: name and value, or why it cannot keep up.
  bool same_first = true;          ///< Whether the recommended one is still before all others.
};

/// All that `hotpath advise` found.
struct Advice {
  const Graph& graph;
  const Objective& objective;
  std::vector<const Prediction*> ranked;
  const Prediction* now = nullptr;
  const Prediction* best = nullptr;  ///< nullptr: nothing can be recommended.
  std::uint32_t draws = 0, asked_draws = 0;
  double seconds = 0;  ///< Of each draw that count.
  std::vector<Doubt> doubts;
  std::string change;  ///< The file of the change; empty: none is needed.
};

/// `21.4 ms`, or what the objective's value is called.
[[nodiscard]] std::string value_text(const Objective& objective, const Prediction& prediction);

void write_ranking(std::ostream& out, const Advice& advice);
/// Three sentences: what to take and what it brings, how sure that is, what it costs.
[[nodiscard]] std::vector<std::string> sentences(const Advice& advice);
/// The content of advice.json.
[[nodiscard]] nlohmann::json advice_json(const Advice& advice);

}  // namespace hotpath
