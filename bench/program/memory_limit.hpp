// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace hotpath {

/// Bytes of memory that this process may have: the machine's, or fewer where a cgroup or `ulimit -v` or `-d`
/// limits it.
[[nodiscard]] std::uint64_t memory_limit();

/// The least limit of the cgroups that `proc_cgroup`, a text like that of /proc/self/cgroup, names and of
/// those above them; `root` is where they are mounted. The largest number where there is none.
[[nodiscard]] std::uint64_t cgroup_memory_limit(const std::string& proc_cgroup,
                                                const std::filesystem::path& root);

/// Refuses what would not fit: throws UsageError that begins with `option` and says that `what` would take
/// `bytes` of memory, how much there is, and `remedy`. Half of the memory is left for all else. The one place
/// for estimates of memory: whatever grows with its input asks here before it starts.
void check_memory(double bytes, const std::string& option, const std::string& what,
                  const std::string& remedy);
/// The same for traces.
void check_trace_memory(double bytes, const std::string& option, const std::string& remedy);

}  // namespace hotpath
