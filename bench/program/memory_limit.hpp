// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace hotpath {

/// Bytes of memory that this process may have: the machine's, or fewer where a cgroup limits it.
[[nodiscard]] std::uint64_t memory_limit();

/// The least limit of the cgroups that `proc_cgroup`, a text like that of /proc/self/cgroup, names and of
/// those above them; `root` is where they are mounted. The largest number where there is none.
[[nodiscard]] std::uint64_t cgroup_memory_limit(const std::string& proc_cgroup,
                                                const std::filesystem::path& root);

/// Refuses traces that would not fit: throws UsageError that begins with `option` and names the memory that
/// `bytes` of them would take, what there is, and `remedy`. Reading and sorting needs room beside them.
void check_trace_memory(double bytes, const std::string& option, const std::string& remedy);

}  // namespace hotpath
