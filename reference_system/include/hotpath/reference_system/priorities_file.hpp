// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace hotpath {

/// A callback's priority from a file.
struct GivenPriority {
  std::string id;             ///< `/NODE@Timer(NANOSECONDS)`, `/NODE@Subscription(/TOPIC)`, ...
  std::int64_t priority = 0;  ///< Smaller first.
  int line = 0;
};

/// Reads `priorities: [{id: ID, priority: N}]`, YAML. An id is the id of a callback group in the
/// configuration of Autoware's CallbackIsolatedExecutor; an id of several callbacks
/// (`/NODE@Subscription(/A)@Timer(N)`) becomes one item per callback. Throws InputError.
[[nodiscard]] std::vector<GivenPriority> read_priorities(const std::string& path);

/// The message for an unknown id: `FILE:LINE: ...` with the nearest known id.
[[nodiscard]] std::string no_such_callback(const std::string& path, const GivenPriority& given,
                                           std::span<const std::string> known);

}  // namespace hotpath
