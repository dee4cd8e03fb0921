// SPDX-License-Identifier: Apache-2.0
#include "live/run_options.hpp"

#include <algorithm>
#include <charconv>
#include <set>
#include <sstream>

#include "program/errors.hpp"

namespace hotpath {

std::vector<int> parse_cpus(const std::string& option, const std::string& text) {
  std::set<int> cpus;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const char* const end = part.data() + part.size();
    int first = -1, last = -1;
    auto parsed = std::from_chars(part.data(), end, first);
    last = first;
    if (parsed.ec == std::errc{} && parsed.ptr != end && *parsed.ptr == '-') {
      parsed = std::from_chars(parsed.ptr + 1, end, last);
    }
    if (parsed.ec != std::errc{} || parsed.ptr != end || first < 0 || last < first || last > 4095) {
      throw UsageError(option + " " + text + ": `" + part +
                       "` is not a processor number or a range like 2-3");
    }
    for (int cpu = first; cpu <= last; ++cpu) cpus.insert(cpu);
  }
  const std::vector<int> available = allowed_cpus();
  for (const int cpu : cpus) {
    if (std::find(available.begin(), available.end(), cpu) != available.end()) continue;
    std::string list;
    for (const int a : available) list += (list.empty() ? "" : ",") + std::to_string(a);
    throw UsageError(option + " " + text + ": there is no processor " + std::to_string(cpu) +
                     " for this process; there are " + list);
  }
  return {cpus.begin(), cpus.end()};
}

}  // namespace hotpath
