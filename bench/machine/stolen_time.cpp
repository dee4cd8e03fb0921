// SPDX-License-Identifier: Apache-2.0
#include "machine/stolen_time.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <numeric>
#include <sstream>

#include "machine/proc_files.hpp"

namespace hotpath {

namespace {

/// A line of /proc/stat: `cpu` or `cpuN`, and what became of the time.
struct ProcessorTicks {
  explicit ProcessorTicks(const std::string& line) {
    std::istringstream fields(line);
    fields >> name;
    for (long long& count : ticks) fields >> count;
  }
  std::string name;
  std::array<long long, 8> ticks{};  ///< user nice system idle iowait irq softirq steal
  long long stolen() const { return ticks.back(); }
};

}  // namespace

Duration stolen_time(const std::string& proc_stat, const std::vector<int>& cpus) {
  std::istringstream stat(proc_stat);
  std::string line;
  long long ticks = 0;
  while (std::getline(stat, line) && line.starts_with("cpu")) {
    const ProcessorTicks processor(line);
    const bool asked_for = std::any_of(cpus.begin(), cpus.end(), [&](int number) {
      return processor.name == "cpu" + std::to_string(number);
    });
    if (cpus.empty() ? processor.name == "cpu" : asked_for) ticks += processor.stolen();
  }
  return Duration(std::chrono::seconds(1)) * ticks / sysconf(_SC_CLK_TCK);
}

Duration stolen_time(const std::vector<int>& cpus) {
  std::ifstream file("/proc/stat");
  std::ostringstream content;
  content << file.rdbuf();
  return stolen_time(content.str(), cpus);
}

double stolen_percent() {
  const ProcessorTicks all(first_line("/proc/stat"));
  const long long total = std::accumulate(all.ticks.begin(), all.ticks.end(), 0LL);
  return total > 0 ? 100 * static_cast<double>(all.stolen()) / static_cast<double>(total) : 0;
}

}  // namespace hotpath
