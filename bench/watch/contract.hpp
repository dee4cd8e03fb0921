// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/core/enum_text.hpp"
#include "hotpath/core/time.hpp"

namespace hotpath::watch {

/// Where a number of a contract comes from.
enum class Origin : std::uint8_t { given, measured, derived };
constexpr auto enum_texts(Origin) {
  return std::to_array<EnumText<Origin>>(
      {{Origin::given, "given"}, {Origin::measured, "measured"}, {Origin::derived, "derived"}});
}

/// What a contract says of a callback: assumptions, and the bound that follows from them.
enum class Clause : std::uint8_t {
  budget,            ///< Most time from start to end of a job.
  period,            ///< Of a timer.
  minimum_distance,  ///< Least time between two publications of a subscription's samples.
  depth,             ///< Of a subscription's queue.
  response,          ///< Bound: most time from the timestamp of a job to its end.
};
constexpr auto enum_texts(Clause) {
  return std::to_array<EnumText<Clause>>({{Clause::budget, "budget_ms"},
                                          {Clause::period, "period_ms"},
                                          {Clause::minimum_distance, "minimum_distance_ms"},
                                          {Clause::depth, "depth"},
                                          {Clause::response, "response_ms"}});
}

struct Term {
  Clause clause;
  std::int64_t limit = 0;  ///< ns; depth: samples.
  Origin origin = Origin::given;
};

/// A callback by the names that a graph gives to nodes and topics.
struct CallbackContract {
  std::string node;
  std::string topic;        ///< Empty: a timer.
  std::uint32_t timer = 1;  ///< Number among the node's timers, from 1.
  std::vector<Term> terms;

  /// `Node/topic`, `Node (timer)` or `Node (timer 2)`.
  [[nodiscard]] std::string name() const;
};

/// The assumptions under which the bounds of a system hold.
struct Contract {
  std::vector<CallbackContract> callbacks;
};

/// Throws InputError, which names file, line and remedy.
[[nodiscard]] Contract read_contract(const std::string& file);

}  // namespace hotpath::watch
