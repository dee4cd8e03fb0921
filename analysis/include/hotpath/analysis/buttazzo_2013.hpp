// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/sequence_task.hpp"

namespace hotpath {

/// Fixed priorities with fixed preemption points between the segments, sporadic, arbitrary deadlines
/// (Buttazzo, Bertogna, Yao: "Limited preemptive scheduling for real-time systems", IEEE TII 9(1), 2013; Bril
/// 2009). None where the level's utilisation is above 1, or equal to 1 with blocking. Throws AnalysisError
/// for suspensions, which chen_2019() takes.
ResponseTimes buttazzo_2013(const SequenceTasks& tasks, TimeModel model = TimeModel::continuous);

}  // namespace hotpath
