// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hotpath/core/time.hpp"

namespace hotpath {

/// Readers of the kernel's small text files, in /proc and /sys. A file that is not there is empty.

std::string first_line(const std::string& path);

/// Value of the first `key<separator>value` line of a file.
std::string value_of(const std::string& path, const std::string& key, char separator);

long number_in(const std::string& path, long otherwise);

/// The ids of all processes, as /proc names them. Any may have ended by now.
std::vector<std::string> processes();

/// Time that the hypervisor has taken since boot from these processors, or from all if none are named, in the
/// steps of the kernel's clock ticks (10 ms). Zero where the kernel does not count it.
Duration stolen_time(const std::vector<int>& cpus);
/// The same from the text of /proc/stat.
Duration stolen_time(const std::string& proc_stat, const std::vector<int>& cpus);

/// Of all processors' time since boot.
double stolen_percent();

}  // namespace hotpath
