// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iomanip>
#include <sstream>
#include <string>
#include <vector>

#include "hotpath/core/utf8.hpp"

namespace hotpath {

/// Maximum bytes of foreign text in one message: for a name, and for a list of names.
inline constexpr std::size_t kMostOfName = 200, kMostOfList = 1000;

/// Formats with `places` decimals, in at most 30 characters; beyond 10^15 with an exponent.
inline std::string decimals(double value, int places) {
  std::ostringstream out;
  if (std::abs(value) < 1e15) out << std::fixed;
  out << std::setprecision(places) << value;
  return out.str();
}

/// Formats a duration of the telemetry, where negative means unknown.
inline std::string milliseconds(std::int64_t ns, int places) {
  return ns < 0 ? "-" : decimals(static_cast<double>(ns) / 1e6, places);
}

inline std::string joined(const std::vector<std::string>& items, const char* separator = ", ") {
  std::string text;
  for (const std::string& item : items) text += (text.empty() ? "" : separator) + item;
  return text;
}

}  // namespace hotpath
