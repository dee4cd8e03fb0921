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

/// Bytes of what the bridge repeats from others in one go: a name, a list of names.
inline constexpr std::size_t kMostOfName = 200, kMostOfList = 1000;

/// At most 30 characters; beyond 10^15 with an exponent.
inline std::string decimals(double value, int places) {
  std::ostringstream out;
  if (std::abs(value) < 1e15) out << std::fixed;
  out << std::setprecision(places) << value;
  return out.str();
}

/// A duration of the telemetry, where a negative one is unknown.
inline std::string milliseconds(std::int64_t ns, int places) {
  return ns < 0 ? "-" : decimals(static_cast<double>(ns) / 1e6, places);
}

inline std::string joined(const std::vector<std::string>& items, const char* separator = ", ") {
  std::string text;
  for (const std::string& item : items) text += (text.empty() ? "" : separator) + item;
  return text;
}

}  // namespace hotpath
