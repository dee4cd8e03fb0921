// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "hotpath/core/trace.hpp"
#include "hotpath/core/worker.hpp"

namespace hotpath {

/// Receives what becomes of every job while a simulation runs.
class JobSink {
 public:
  virtual ~JobSink() = default;

  /// A job starts: `finish` and `outcome` are not set yet. Not called for empty events.
  virtual void started(const JobRecord& record) { static_cast<void>(record); }

  /// The record is complete. Called at the instant at which that is so: `ran` at the finish, `overwritten` at
  /// the delivery of the newer sample, `empty` when the event finds nothing, `queued` and `running` at the
  /// end of the run.
  virtual void ended(const JobRecord& record) = 0;
};

/// Collects the records of a simulation into a trace, ordered by start; jobs that never start are where
/// their fate was settled.
class TraceRecorder final : public JobSink {
 public:
  explicit TraceRecorder(Trace& trace) : trace_(trace) {}
  void started(const JobRecord& record) override;
  void ended(const JobRecord& record) override;

 private:
  Trace& trace_;
  std::vector<std::size_t> open_;  // per worker: place of its running job
};

}  // namespace hotpath
