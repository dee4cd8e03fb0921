// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "advise/prediction.hpp"

namespace hotpath {

/// Predictions in the order of an objective, the best first; those that cannot keep up last.
[[nodiscard]] std::vector<const Prediction*> ranked(const std::vector<Prediction>& predictions,
                                                    const Objective& objective);

/// How many tasks never ran.
[[nodiscard]] std::size_t never_ran(const ExecutorSummary& summary);

/// Why a candidate that keeps up cannot be recommended: a task never runs, it loses more than what runs now
/// (`now`, which may not keep up) and one percent, or no file can say it. Empty: it can.
[[nodiscard]] std::string why_not(const Prediction& prediction, const Prediction& now);

/// The best that can be recommended; what runs now, if that can, unless the best is better beyond noise.
/// nullptr: there is none.
[[nodiscard]] const Prediction* recommended(const std::vector<const Prediction*>& ranked,
                                            const Prediction& now, const Objective& objective);

/// Whether the difference of two is beyond what draws differ by; nothing where that is not known.
[[nodiscard]] std::optional<bool> differs(const Objective& objective, const Prediction& a,
                                          const Prediction& b);

}  // namespace hotpath
