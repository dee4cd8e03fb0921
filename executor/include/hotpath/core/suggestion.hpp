// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace hotpath {

/// The candidate most similar to a misspelt `word`, ignoring case; std::nullopt if none is similar.
[[nodiscard]] std::optional<std::string> nearest(std::string_view word,
                                                 std::span<const std::string> candidates);

/// "did you mean `X`?" with the nearest candidate, otherwise "choose one of: ..." with all
/// candidates.
[[nodiscard]] std::string suggest(std::string_view word, std::span<const std::string> candidates);

}  // namespace hotpath
