// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "advise/prediction.hpp"

namespace hotpath::advise {

/// Predictions ordered by an objective, the best first, overloaded candidates last.
[[nodiscard]] std::vector<const Prediction*> ranked(const std::vector<Prediction>& predictions,
                                                    const Objective& objective);

/// Number of tasks that never ran.
[[nodiscard]] std::size_t never_ran(const results::ExecutorSummary& summary);

/// Whether a deployment file can express the candidate: it splits no callback group.
[[nodiscard]] bool can_be_written(const Candidate& candidate);

/// Why a candidate that keeps up cannot be recommended: a task never runs, it loses over one
/// percent more than the current executor `now` (which may be overloaded), or no deployment file
/// can express it. Empty: it can.
[[nodiscard]] std::string why_not(const Prediction& prediction, const Prediction& now);

/// The best candidate that can be recommended. The current executor is preferred, if it can be
/// recommended, unless the best one is better beyond noise and in the objective as printed. nullptr: there
/// is none.
[[nodiscard]] const Prediction* recommended(const std::vector<const Prediction*>& ranked,
                                            const Prediction& now, const Objective& objective);

/// Whether two predictions differ beyond the noise between draws; none: unknown.
[[nodiscard]] std::optional<bool> differs(const Objective& objective, const Prediction& a,
                                          const Prediction& b);

}  // namespace hotpath::advise
