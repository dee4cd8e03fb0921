// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hotpath/core/task.hpp"

namespace hotpath {

/// One entry of a message's history: a contributing job and its start.
struct Stat {
  TaskId task = 0;
  std::uint32_t dropped = 0;  ///< Samples that the job's inputs lost since its last publication.
  /// Sequence of the job; in upstream's message, the publisher's number of earlier publications.
  std::uint64_t sequence = 0;
  Time start{};  ///< Start of the publishing job.
};

}  // namespace hotpath
