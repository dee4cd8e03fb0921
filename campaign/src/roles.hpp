// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/campaign/crew.hpp"
#include "link.hpp"

namespace hotpath {

/// The role of rank 0: works, hands out cells, gathers. `link` is nullptr for a single process.
std::vector<std::string> coordinate(const Campaign& campaign, const CrewOptions& options, Link* link);

/// The role of every other rank.
void work_for_coordinator(const Campaign& campaign, const CrewOptions& options, Link& link);

/// The number that a rank's hello must contain.
std::uint64_t identity(const Campaign& campaign);

}  // namespace hotpath
