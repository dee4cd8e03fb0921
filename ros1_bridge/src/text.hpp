// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <iomanip>
#include <sstream>
#include <string>
#include <vector>

namespace hotpath {

inline std::string decimals(double value, int places) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(places) << value;
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
