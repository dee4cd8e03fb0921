// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/core/job.hpp"

namespace hotpath {

/// When the jobs of timers become ready, if not at their timestamps.
class ReleaseDelays {
 public:
  virtual ~ReleaseDelays() = default;
  /// The instant at which `job` becomes ready: `timestamp`, or up to Task::release_jitter later; kNever: when
  /// the driver calls ExploredScheduler::release_at(). Asked when the timer begins to wait for it.
  [[nodiscard]] virtual Time due(JobRef job, Time timestamp) const = 0;
};

/// The driver says when each job becomes ready.
class HeldReleases final : public ReleaseDelays {
 public:
  [[nodiscard]] Time due(JobRef, Time) const override { return kNever; }
};

}  // namespace hotpath
