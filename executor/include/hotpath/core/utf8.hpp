// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace hotpath {

/// Whether the text is valid UTF-8: whole sequences, none longer than needed, no surrogates.
[[nodiscard]] bool is_utf8(std::string_view text);

/// Any bytes as UTF-8 of at most `most` bytes (at least 3) on one line, as a terminal or a log can show them.
/// What is no UTF-8, a control character, or turns the direction of the text or ends its line becomes `\xHH`;
/// what is too long ends in `...`.
[[nodiscard]] std::string printable(std::string_view text, std::size_t most = std::string_view::npos);

}  // namespace hotpath
