// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// One entry of a message's history: which node contributed, and when.
struct Stat {
  std::uint32_t node = 0;      ///< Index into the graph's nodes.
  std::uint32_t sequence = 0;  ///< Publications of that publisher before this one.
  std::uint32_t dropped = 0;   ///< Samples that its inputs lost since its last publication.
  Time start{};                ///< Start of the publishing job.
};

}  // namespace hotpath
