// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/thread_policy.hpp"

#include <array>
#include <charconv>
#include <optional>
#include <stdexcept>

namespace hotpath {

namespace {

using Class = ThreadPolicy::Class;

std::string milliseconds(Duration duration) {
  std::array<char, 32> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), to_ms(duration), std::chars_format::fixed).ptr;
  return {text.data(), end};
}

/// Parses `RUNTIME/DEADLINE/PERIOD` in ms.
std::optional<ThreadPolicy> parse_budget(std::string_view text) {
  ThreadPolicy policy{Class::deadline};
  for (Duration* const part : {&policy.runtime, &policy.deadline, &policy.period}) {
    const std::size_t slash = text.find('/');
    const auto ms = parse<double>(text.substr(0, slash));
    if (!ms || !(*ms > 0) || *ms > 1e9 || (slash == std::string_view::npos) != (part == &policy.period)) {
      return std::nullopt;
    }
    *part = from_ms(*ms);
    text.remove_prefix(std::min(slash, text.size() - 1) + 1);
  }
  return policy;
}

}  // namespace

std::string to_string(const ThreadPolicy& policy) {
  const std::string name = to_string(policy.scheduling_class);
  if (policy.scheduling_class == Class::deadline) {
    return name + ":" + milliseconds(policy.runtime) + "/" + milliseconds(policy.deadline) + "/" +
           milliseconds(policy.period);
  }
  return policy.ordinary() && policy.priority == 0 ? name : name + ":" + std::to_string(policy.priority);
}

ThreadPolicy parse_thread_policy(const std::string& text) {
  const std::size_t colon = text.find(':');
  const auto scheduling_class = parse<Class>(text.substr(0, colon));
  const std::string_view rest = colon == std::string::npos ? "" : std::string_view(text).substr(colon + 1);
  if (scheduling_class == Class::deadline) {
    if (const auto policy = parse_budget(rest)) {
      check_budget(*policy);
      return *policy;
    }
  } else if (scheduling_class) {
    ThreadPolicy policy{*scheduling_class};
    if (policy.ordinary() && colon == std::string::npos) return policy;
    const int least = policy.ordinary() ? -20 : 1, most = policy.ordinary() ? 19 : kHighestPriority;
    const auto priority = parse<int>(rest);
    policy.priority = priority.value_or(0);
    if (priority && policy.priority >= least && policy.priority <= most) return policy;
  }
  throw std::invalid_argument("thread policy `" + text +
                              "` is not one of other, other:N, batch:N, idle:N (nice, -20 to 19), fifo:N, "
                              "rr:N (1 to 99), deadline:RUNTIME/DEADLINE/PERIOD (ms)");
}

void check_budget(const ThreadPolicy& policy) {
  if (policy.runtime >= kLeastRuntime && policy.runtime <= policy.deadline &&
      policy.deadline <= policy.period) {
    return;
  }
  throw std::invalid_argument("thread policy `" + to_string(policy) +
                              "`: the runtime must be at least 0.001024 ms and at most the deadline, and the "
                              "deadline at most the period");
}

}  // namespace hotpath
