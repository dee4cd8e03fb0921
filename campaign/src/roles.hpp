// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hotpath/campaign/crew.hpp"
#include "link.hpp"

namespace hotpath {

/// What rank 0 does: works, hands out cells, gathers. `link` is nullptr when it is alone.
std::vector<std::string> coordinate(const Campaign& campaign, const CrewOptions& options, Link* link);

/// What every other rank does.
void work_for_coordinator(const Campaign& campaign, const CrewOptions& options, Link& link);

/// What the hello of a rank must say.
std::uint64_t identity(const Campaign& campaign);

}  // namespace hotpath
