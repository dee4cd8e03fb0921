// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "hotpath/core/time.hpp"

namespace hotpath::machine {

/// Readers of the kernel's small text files in /proc and /sys. A missing file counts as empty.

std::string first_line(const std::string& path);

/// Value of the first `key<separator>value` line of a file.
std::string value_of(const std::string& path, const std::string& key, char separator);

long number_in(const std::string& path, long otherwise);

/// The names of the files in a folder, and the ids of all processes. Any may be gone meanwhile.
std::vector<std::string> names_in(const std::string& folder);
std::vector<std::string> processes();

/// Counters of the kernel since boot, summed over CPUs. The resolution is its clock tick (10 ms);
/// what it does not count is zero.
struct ProcessorTimes {
  std::size_t cpus = 0;
  Duration busy{};       ///< Used by any process, and by interrupts.
  Duration stolen{};     ///< Taken by the hypervisor.
  Duration throttled{};  ///< Lost to the quota of this program's cgroup, and to overheating.
};

/// Of these CPUs, of all CPUs if the list is empty.
ProcessorTimes processor_times(const std::vector<int>& cpus);
/// The same from the text of /proc/stat, without `throttled`.
ProcessorTimes processor_times(const std::string& proc_stat, const std::vector<int>& cpus);

/// ProcessorTimes::stolen of each CPU.
std::map<int, Duration> stolen_times(const std::string& proc_stat);

/// Share of all CPU time since boot that the hypervisor took.
double stolen_percent();

}  // namespace hotpath::machine
