// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// Parses a decimal number of milliseconds ("4.2", "-1") as exact nanoseconds. std::nullopt for
/// other text, for more than nine digits before the point, and for digits below a nanosecond.
std::optional<Duration> parse_ms(std::string_view text);

/// Decimal milliseconds without trailing zeros: the inverse of parse_ms.
std::string format_ms(Duration duration);

}  // namespace hotpath
