// SPDX-License-Identifier: Apache-2.0
#pragma once

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

/// `other`, `other:-5`, `fifo:80`, `rr:10`.
[[nodiscard]] std::string to_string(const ThreadPolicy& policy);
/// Throws std::invalid_argument that says what would be right.
[[nodiscard]] ThreadPolicy parse_thread_policy(const std::string& text);

}  // namespace hotpath
