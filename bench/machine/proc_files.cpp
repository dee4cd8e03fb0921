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

#include "program/memory_limit.hpp"

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
    const std::size_t from = line.find(separator);
    if (!line.starts_with(key) || from == std::string::npos) continue;
    const std::size_t first = line.find_first_not_of(" \t\"", from + 1);
    return first == line.npos ? "" : line.substr(first, line.find_last_not_of(" \t\"") + 1 - first);
  }
  return "";
}

long number_in(const std::string& path, long otherwise) {
  long value = 0;
  return std::ifstream(path) >> value ? value : otherwise;
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
  std::erase_if(ids, [](const std::string& id) { return id.find_first_not_of("0123456789") != id.npos; });
  return ids;
}

namespace {

/// Clock ticks: user nice system idle iowait irq softirq steal.
using Ticks = std::array<long long, 8>;
constexpr int kAllCpus = -1;

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
  const std::string file =
      program::cgroup_folder(program::content_of("/proc/self/cgroup"), "cpu") / "cpu.stat";
  const auto counted = [&](const char* key) { return std::atoll(value_of(file, key, ' ').c_str()); };
  // Version 2 of cgroups counts in microseconds, version 1 in nanoseconds.
  Duration sum = std::chrono::microseconds(counted("throttled_usec")) + Duration(counted("throttled_time"));
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
    times.busy += of_ticks(ticks[0] + ticks[1] + ticks[2] + ticks[5] + ticks[6]);
    times.stolen += of_ticks(ticks.back());
  }
  return times;
}

ProcessorTimes processor_times(const std::vector<int>& cpus) {
  ProcessorTimes times = processor_times(program::content_of("/proc/stat"), cpus);
  times.throttled = throttled_time(cpus);
  return times;
}

double stolen_percent() {
  const Ticks all = ticks_by_cpu(first_line("/proc/stat"))[kAllCpus];
  const long long total = std::accumulate(all.begin(), all.end(), 0LL);
  return total > 0 ? 100 * static_cast<double>(all.back()) / static_cast<double>(total) : 0;
}

}  // namespace hotpath::machine
