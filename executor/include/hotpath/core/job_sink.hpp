// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "hotpath/core/trace.hpp"
#include "hotpath/core/worker.hpp"

namespace hotpath {

/// Receives the record of every job while a simulation runs.
class JobSink {
 public:
  virtual ~JobSink() = default;

  /// A job starts: `finish` and `outcome` are not set yet. Not called for empty events.
  virtual void started(const JobRecord& record) { static_cast<void>(record); }

  /// The record is complete. Called as soon as the outcome is known: `ran` at the finish,
  /// `overwritten` at the delivery of the newer sample, `empty` when the event finds no sample,
  /// `queued` and `running` at the end of the run.
  virtual void ended(const JobRecord& record) = 0;
};

/// Collects the records of a simulation into a trace, ordered by start. A job that never starts is
/// placed at the instant that decided its outcome.
class TraceRecorder final : public JobSink {
 public:
  explicit TraceRecorder(Trace& trace) : trace_(trace) {}
  void started(const JobRecord& record) override;
  void ended(const JobRecord& record) override;

 private:
  Trace& trace_;
  std::vector<std::size_t> open_;  // by worker: index of the running job's record
};

}  // namespace hotpath
