// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/analysis/response_times.hpp"

namespace hotpath {

/// Worst-case response times of sporadic tasks under non-preemptive EDF, arbitrary deadlines, over
/// all deadline busy periods; ties go against the analysed task (Spuri, INRIA RR-2772, 1996;
/// non-preemptive: George, Rivierre, Spuri, INRIA RR-2966, 1996). Throws AnalysisError for jitter
/// or a utilisation above 1.
ResponseTimes spuri_1996(const PeriodicTasks& tasks, TimeModel model = TimeModel::continuous);

}  // namespace hotpath
