// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace hotpath {

/// The candidate that is most like a misspelt `word` (letter case aside); nothing if none is alike.
[[nodiscard]] std::optional<std::string> nearest(std::string_view word, std::span<const std::string> candidates);

/// "did you mean `X`?" with the nearest candidate, else "known are: ..." with all of them.
[[nodiscard]] std::string suggest(std::string_view word, std::span<const std::string> candidates);

}  // namespace hotpath
