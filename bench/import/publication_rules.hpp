// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "hotpath/reference_system/callback.hpp"
#include "import/recorded_system.hpp"

namespace hotpath {

/// By which rule callbacks of one node publish a topic, and how well what they did agrees.
struct InferredRule {
  std::uint32_t topic = kNone;
  std::vector<std::uint32_t> publishers = {};  ///< Callbacks.
  PublishRule rule = PublishRule::always;
  std::vector<std::uint32_t> of = {};     ///< all_new, last_of: subscriptions of the node.
  std::uint32_t n = 1;                    ///< every.
  std::uint64_t jobs = 0;                 ///< Of the callbacks concerned.
  std::uint64_t explained = 0;            ///< Of these, jobs that published as the rule says.
  std::vector<std::string> as_good = {};  ///< Other rules that explain as many.
  std::uint64_t most_in_a_job = 1;        ///< Messages; a rule knows no more than one.
};

/// Tries hypotheses on all jobs of every node: every job publishes, every n-th, whichever completes a set of
/// inputs with new samples. The one that explains most jobs is taken; among equals the largest set of
/// inputs that publish nothing else, since sets say more of when data is ready, then the simplest.
/// Subscriptions that publish nothing and are in no set are taken to be kept for what the node's timers, or
/// else its other callbacks, publish with every job (last_of): events do not show whether they are. `is_task`
/// says which callbacks count; `jobs` are by start.
[[nodiscard]] std::vector<InferredRule> infer_rules(const RecordedSystem& system,
                                                    std::span<const RecordedJob> jobs,
                                                    const std::vector<bool>& is_task);

}  // namespace hotpath
