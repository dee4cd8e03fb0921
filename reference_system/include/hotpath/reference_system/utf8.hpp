// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace hotpath {

/// Whether the text is valid UTF-8: whole sequences, none longer than needed, no surrogates.
[[nodiscard]] bool is_utf8(std::string_view text);

}  // namespace hotpath
