// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <regex>
#include <set>
#include <sstream>

#include "live/live_run.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::live {

std::vector<int> parse_cpus(const std::string& option, const std::string& text) {
  static const std::regex kRange("([0-9]{1,4})(-([0-9]{1,4}))?");
  const auto refuse = [&](const auto&... words) {
    throw program::UsageError(program::concat(option, " ", text, ": ", words...));
  };
  std::set<int> cpus;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    std::smatch range;
    const bool matches = std::regex_match(part, range, kRange);
    const int first = matches ? std::stoi(range[1]) : 0;
    const int last = matches && range[3].matched ? std::stoi(range[3]) : first;
    if (!matches || last < first || last > 4095) {
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
