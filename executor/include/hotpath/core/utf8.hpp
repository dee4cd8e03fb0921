// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace hotpath {

/// Whether the text is valid UTF-8: complete sequences, no overlong encoding, no surrogates.
[[nodiscard]] bool is_utf8(std::string_view text);

/// Converts any bytes to one line of UTF-8 of at most `most` bytes (at least 3) that is safe for
/// terminals and logs. Invalid bytes, control characters, and characters that change the text
/// direction or end the line become `\xHH`; longer text ends in `...`.
[[nodiscard]] std::string printable(std::string_view text, std::size_t most = std::string_view::npos);

}  // namespace hotpath
