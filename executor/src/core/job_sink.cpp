// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/job_sink.hpp"

namespace hotpath {

void TraceRecorder::started(const JobRecord& record) {
  if (record.worker >= open_.size()) open_.resize(record.worker + 1U);
  open_[record.worker] = trace_.jobs.size();
  trace_.jobs.push_back(record);
}

void TraceRecorder::ended(const JobRecord& record) {
  if (hotpath::started(record)) {
    trace_.jobs[open_[record.worker]] = record;
  } else {
    trace_.jobs.push_back(record);
  }
}

}  // namespace hotpath
