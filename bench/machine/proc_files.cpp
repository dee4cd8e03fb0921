// SPDX-License-Identifier: Apache-2.0
#include "machine/proc_files.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
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

std::vector<std::string> names_in(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  std::filesystem::directory_iterator at(folder, error);
  for (const std::filesystem::directory_iterator end; !error && at != end; at.increment(error))
    names.push_back(at->path().filename());
  return names;
}

std::vector<std::string> processes() {
  std::vector<std::string> ids = names_in("/proc");
  std::erase_if(
      ids, [](const std::string& name) { return name.find_first_not_of("0123456789") != std::string::npos; });
  return ids;
}

namespace {

/// Clock ticks: user nice system idle iowait irq softirq steal.
using Ticks = std::array<long long, 8>;
constexpr int kAllCpus = -1;

long long busy(const Ticks& t) { return t[0] + t[1] + t[2] + t[5] + t[6]; }

Duration of_ticks(long long ticks) {
  return Duration(std::chrono::seconds(1)) * ticks / sysconf(_SC_CLK_TCK);
}

/// By number of the CPU; kAllCpus: their sum.
std::map<int, Ticks> ticks_by_cpu(const std::string& proc_stat) {
  std::istringstream stat(proc_stat);
  std::map<int, Ticks> all;
  for (std::string line; std::getline(stat, line) && line.starts_with("cpu");) {
    std::istringstream words(line);
    std::string name;
    words >> name;
    Ticks& ticks = all[name == "cpu" ? kAllCpus : std::atoi(name.c_str() + 3)];
    for (long long& count : ticks) words >> count;
  }
  return all;
}

Duration throttled_time(const std::vector<int>& cpus) {
  Duration sum{};
  // Version 2 of cgroups has one line of this process, `0::/PATH`.
  if (const std::string group = value_of("/proc/self/cgroup", "0::", ':'); !group.empty()) {
    const std::string file = "/sys/fs/cgroup" + group.substr(1) + "/cpu.stat";
    sum = std::chrono::microseconds(std::atoll(value_of(file, "throttled_usec", ' ').c_str()));
  }
  for (const int cpu : cpus) {
    sum += std::chrono::milliseconds(number_in(
        "/sys/devices/system/cpu/cpu" + std::to_string(cpu) + "/thermal_throttle/core_throttle_total_time_ms",
        0));
  }
  return sum;
}

}  // namespace

std::map<int, Duration> stolen_times(const std::string& proc_stat) {
  std::map<int, Duration> stolen;
  for (const auto& [cpu, ticks] : ticks_by_cpu(proc_stat)) stolen[cpu] = of_ticks(ticks.back());
  stolen.erase(kAllCpus);
  return stolen;
}

ProcessorTimes processor_times(const std::string& proc_stat, const std::vector<int>& cpus) {
  ProcessorTimes times;
  for (const auto& [cpu, ticks] : ticks_by_cpu(proc_stat)) {
    if (cpu == kAllCpus || (!cpus.empty() && std::ranges::count(cpus, cpu) == 0)) continue;
    ++times.cpus;
    times.busy += of_ticks(busy(ticks));
    times.stolen += of_ticks(ticks.back());
  }
  return times;
}

ProcessorTimes processor_times(const std::vector<int>& cpus) {
  std::ifstream file("/proc/stat");
  std::ostringstream content;
  content << file.rdbuf();
  ProcessorTimes times = processor_times(content.str(), cpus);
  times.throttled = throttled_time(cpus);
  return times;
}

double stolen_percent() {
  const Ticks all = ticks_by_cpu(first_line("/proc/stat"))[kAllCpus];
  const long long total = std::accumulate(all.begin(), all.end(), 0LL);
  return total > 0 ? 100 * static_cast<double>(all.back()) / static_cast<double>(total) : 0;
}

}  // namespace hotpath::machine
