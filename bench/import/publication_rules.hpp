// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "hotpath/reference_system/callback.hpp"
#include "hotpath/tracing/system.hpp"

namespace hotpath::imports {

using tracing::kNone;

/// The rule by which callbacks of one node publish a topic, and how well it explains their jobs.
struct InferredRule {
  std::uint32_t topic = kNone;
  std::vector<std::uint32_t> publishers = {};  ///< Callbacks.
  PublishRule rule = PublishRule::always;
  std::vector<std::uint32_t> of = {};     ///< all_new, last_of: subscriptions of the node.
  std::uint32_t n = 1;                    ///< every.
  std::uint64_t jobs = 0;                 ///< Jobs of the node's callbacks.
  std::uint64_t explained = 0;            ///< Of these, jobs that follow the rule.
  std::vector<std::string> as_good = {};  ///< Other rules that explain as many jobs.
  std::uint64_t most_in_a_job = 1;        ///< Most messages of a job; a rule covers one.
};

/// Tries hypotheses on all jobs of every node: every job publishes, every n-th job, or the job that
/// completes a set of inputs with new samples. The hypothesis that explains most jobs wins; among
/// equals the largest set of inputs that publish nothing else, since sets describe best when data
/// is ready, then the simplest one. Subscriptions that publish nothing and are in no set are
/// assumed to be stored for the messages that the node's timers, or else its other callbacks,
/// publish with every job (last_of); events do not show this. `is_task`: by callback. `jobs` are in
/// the order of starts.
[[nodiscard]] std::vector<InferredRule> infer_rules(const tracing::System& system,
                                                    std::span<const tracing::Job> jobs,
                                                    const std::vector<bool>& is_task);

}  // namespace hotpath::imports
