// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>
#include <sstream>
#include <string_view>

#include "hotpath/core/enum_text.hpp"
#include "live/live_run.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::live {

std::vector<int> parse_cpus(const std::string& option, const std::string& text) {
  const auto refuse = [&](const auto&... words) {
    throw program::UsageError(program::concat(option, " ", text, ": ", words...));
  };
  std::set<int> cpus;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const std::string_view range = part;
    const int first = parse<int>(range.substr(0, range.find('-'))).value_or(-1);
    const int last = parse<int>(range.substr(range.find('-') + 1)).value_or(-1);
    if (first < 0 || last < first || last > 4095) {
      refuse("`", part, "` is not a processor number or a range like 2-3");
    }
    for (int cpu = first; cpu <= last; ++cpu) cpus.insert(cpu);
  }
  const std::vector<int> available = allowed_cpus();
  for (const int cpu : cpus) {
    if (std::ranges::find(available, cpu) != available.end()) continue;
    refuse("this process may not use processor ", cpu, "; it may use ", program::joined(available, ","));
  }
  return {cpus.begin(), cpus.end()};
}

}  // namespace hotpath::live
