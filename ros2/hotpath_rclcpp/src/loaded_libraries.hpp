// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace hotpath {

/// Files of the Fast DDS that are loaded into this process. Two of them take each other for themselves, since
/// they have the same symbols: a crash, sooner or later.
[[nodiscard]] std::vector<std::string> loaded_fast_dds();

}  // namespace hotpath
