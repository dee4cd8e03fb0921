// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>

#include "hotpath/reference_system/run_channel.hpp"
#include "live/repetition_runner.hpp"

namespace hotpath::live {

/// One process of a repetition, from its fork to its end: it sets the system up, runs it when the
/// coordinator says so, and reports. `memories`: of all processes of the repetition. Returns the
/// exit code.
int run_process(const Plan& plan, std::uint32_t process, const std::vector<std::uint32_t>& process_of_node,
                std::deque<RunMemory>& memories, const Channel& coordinator);

}  // namespace hotpath::live
