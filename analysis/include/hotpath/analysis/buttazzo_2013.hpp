// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/sequence_task.hpp"

namespace hotpath {

/// Response time bounds of sporadic tasks under fixed priorities with fixed preemption points
/// between the segments, arbitrary deadlines (Buttazzo, Bertogna, Yao: "Limited preemptive
/// scheduling for real-time systems", IEEE TII 9(1), 2013; Bril 2009). A task has no bound if its
/// level's utilisation is above 1, or equal to 1 with blocking. Throws AnalysisError for
/// suspensions, which chen_2019() accepts.
ResponseTimes buttazzo_2013(const SequenceTasks& tasks, TimeModel model = TimeModel::continuous);

}  // namespace hotpath
