// SPDX-License-Identifier: Apache-2.0
#include "program/text.hpp"

#include <cmath>

namespace hotpath {

std::string fixed(double value, int decimals) {
  return std::isfinite(value) ? text("%.*f", decimals, value) : "-";
}

std::string joined(const std::vector<std::string>& words, const std::string& separator) {
  std::string all;
  for (const std::string& word : words) all += (&word == words.data() ? "" : separator) + word;
  return all;
}

}  // namespace hotpath
