// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/thread_policy.hpp"

#include <charconv>
#include <stdexcept>

namespace hotpath {

std::string to_string(const ThreadPolicy& policy) {
  const std::string name = to_string(policy.scheduling_class);
  return policy == ThreadPolicy{} ? name : name + ":" + std::to_string(policy.priority);
}

ThreadPolicy parse_thread_policy(const std::string& text) {
  const std::size_t colon = text.find(':');
  ThreadPolicy policy;
  if (const auto scheduling_class = parse<ThreadPolicy::Class>(text.substr(0, colon))) {
    const bool ordinary = *scheduling_class == ThreadPolicy::Class::other;
    policy.scheduling_class = *scheduling_class;
    if (ordinary && colon == std::string::npos) return policy;
    const char* end = text.data() + text.size();
    const auto parsed =
        std::from_chars(text.data() + std::min(colon, text.size() - 1) + 1, end, policy.priority);
    const int least = ordinary ? -20 : 1, most = ordinary ? 19 : 99;
    if (parsed.ec == std::errc{} && parsed.ptr == end && policy.priority >= least &&
        policy.priority <= most) {
      return policy;
    }
  }
  throw std::invalid_argument("thread policy `" + text +
                              "` is not one of other, other:N (nice, -20 to 19), fifo:N, rr:N (1 to 99)");
}

}  // namespace hotpath
