// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hotpath/core/task.hpp"

namespace hotpath {

/// One entry of a message's history: which job contributed, and when.
struct Stat {
  TaskId task = 0;
  std::uint32_t dropped = 0;   ///< Samples that its inputs lost since its last publication.
  std::uint64_t sequence = 0;  ///< Of the job; in upstream's message its publisher's publications before it.
  Time start{};                ///< Start of the publishing job.
};

}  // namespace hotpath
