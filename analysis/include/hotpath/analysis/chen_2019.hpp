// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/sequence_task.hpp"

namespace hotpath {

/// Response time bounds of sequences whose segments are separated by DDS delays: segmented
/// self-suspension, where the suspension of higher-priority tasks acts as release jitter (Chen et
/// al.: "Many suspensions, many problems", Real-Time Systems 55, 2019). The bound is the least t <=
/// D_i with t >= C_i + S_i + (m + 1) B_i + sum_{h<i} ceil((t + R_h - C_h) / T_h) C_h, for m gaps
/// and B_i the longest segment of a lower-priority task. Sufficient; D <= T.
ResponseTimes chen_2019(const SequenceTasks& tasks);

}  // namespace hotpath
