// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace hotpath {

/// A priority that a file gives to a callback.
struct GivenPriority {
  std::string id;             ///< `/NODE@Timer(NANOSECONDS)`, `/NODE@Subscription(/TOPIC)`, ...
  std::int64_t priority = 0;  ///< The smaller first.
  int line = 0;
};

/// Reads `priorities: [{id: ID, priority: N}]`, YAML. An id is that of a callback group in the configuration
/// of Autoware's CallbackIsolatedExecutor: what stands for several callbacks
/// (`/NODE@Subscription(/A)@Timer(N)`) becomes one item for each. Throws InputError.
[[nodiscard]] std::vector<GivenPriority> read_priorities(const std::string& path);

/// What to say of an id that nothing has: `FILE:LINE: ...` with the nearest of those that there are.
[[nodiscard]] std::string no_such_callback(const std::string& path, const GivenPriority& given,
                                           std::span<const std::string> known);

}  // namespace hotpath
