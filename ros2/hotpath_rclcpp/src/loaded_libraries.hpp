// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace hotpath {

/// Paths of the Fast DDS libraries loaded into this process. Two copies export the same symbols,
/// call into each other and eventually crash.
[[nodiscard]] std::vector<std::string> loaded_fast_dds();

}  // namespace hotpath
