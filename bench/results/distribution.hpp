// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "hotpath/analysis/statistics.hpp"

namespace hotpath::results {

/// Samples for estimates: a single repetition becomes blocks of consecutive samples, unless it is `exact`:
/// has no sampling error.
[[nodiscard]] RepeatedSamples resampled(std::vector<std::vector<double>> repetitions, bool exact);

/// The curve of a distribution with its intervals, in ms rounded to nanoseconds: {n, q, value, low, high}.
[[nodiscard]] nlohmann::json curve_of(const RepeatedSamples& samples);

}  // namespace hotpath::results
