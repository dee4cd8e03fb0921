// SPDX-License-Identifier: Apache-2.0
#include "machine/proc_files.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <sstream>

namespace hotpath::machine {

std::string first_line(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  return line;
}

std::string value_of(const std::string& path, const std::string& key, char separator) {
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    if (line.rfind(key, 0) != 0) continue;
    std::size_t from = line.find(separator);
    if (from == std::string::npos) continue;
    from = line.find_first_not_of(" \t\"", from + 1);
    if (from == std::string::npos) return "";
    return line.substr(from, line.find_last_not_of(" \t\"") + 1 - from);
  }
  return "";
}

long number_in(const std::string& path, long otherwise) {
  std::ifstream in(path);
  long value = otherwise;
  in >> value;
  return in ? value : otherwise;
}

std::vector<std::string> processes() {
  std::vector<std::string> ids;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", ignored)) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") == std::string::npos) ids.push_back(name);
  }
  return ids;
}

namespace {

/// A line of /proc/stat: `cpu` or `cpuN`, and its ticks by use.
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
    const bool selected = std::ranges::any_of(
        cpus, [&](int number) { return processor.name == "cpu" + std::to_string(number); });
    if (cpus.empty() ? processor.name == "cpu" : selected) ticks += processor.stolen();
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

}  // namespace hotpath::machine
