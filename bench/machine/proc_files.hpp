// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace hotpath {

/// Readers of the kernel's small text files, in /proc and /sys. A file that is not there is empty.

std::string first_line(const std::string& path);

/// Value of the first `key<separator>value` line of a file.
std::string value_of(const std::string& path, const std::string& key, char separator);

long number_in(const std::string& path, long otherwise);

/// The ids of all processes, as /proc names them. Any may have ended by now.
std::vector<std::string> processes();

}  // namespace hotpath
