// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>

#include "hotpath/core/enum_text.hpp"

namespace hotpath {

/// A thread's scheduling class: the ordinary policy with a nice value in [-20, 19], or SCHED_FIFO / SCHED_RR
/// with a priority in [1, 99].
struct ThreadPolicy {
  enum class Class : std::uint8_t { other, fifo, rr };
  Class scheduling_class = Class::other;
  int priority = 0;  ///< Ordinary policy: the nice value.
  friend bool operator==(const ThreadPolicy&, const ThreadPolicy&) = default;
};

constexpr auto enum_texts(ThreadPolicy::Class) {
  return std::to_array<EnumText<ThreadPolicy::Class>>({{ThreadPolicy::Class::other, "other"},
                                                       {ThreadPolicy::Class::fifo, "fifo"},
                                                       {ThreadPolicy::Class::rr, "rr"}});
}

inline constexpr int kHighestPriority = 99;

/// What a timer management thread has that is raised above executor threads of this policy: SCHED_FIFO 90, or
/// more where those have that. At kHighestPriority nothing is above them.
[[nodiscard]] constexpr ThreadPolicy raised_above(const ThreadPolicy& executor) {
  const bool ordinary = executor.scheduling_class == ThreadPolicy::Class::other;
  const int above = ordinary ? 0 : executor.priority + 1;
  return {ThreadPolicy::Class::fifo, std::min(kHighestPriority, std::max(90, above))};
}

/// `other`, `other:-5`, `fifo:80`, `rr:10`.
[[nodiscard]] std::string to_string(const ThreadPolicy& policy);
/// Throws std::invalid_argument that says what would be right.
[[nodiscard]] ThreadPolicy parse_thread_policy(const std::string& text);

}  // namespace hotpath
