// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hotpath/core/thread_policy.hpp"

namespace hotpath {

/// Gives this policy to the threads of this process in which the middleware works: those that exist
/// now, known by their names. Throws std::runtime_error if there is none or if the policy is refused.
void set_middleware_policy(const ThreadPolicy& policy);

/// Whether a thread with this name belongs to Fast DDS or Cyclone DDS.
[[nodiscard]] bool is_of_middleware(const std::string& thread);

}  // namespace hotpath
