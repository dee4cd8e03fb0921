// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace hotpath::program {

/// Bytes of memory that this process may use: the machine's memory, or less if a cgroup,
/// `ulimit -v` or `ulimit -d` limits it.
[[nodiscard]] std::uint64_t memory_limit();

/// Bytes of memory that this process uses; 0: unknown.
[[nodiscard]] std::uint64_t memory_in_use();

/// The content of one of the kernel's text files, whose length is not known; empty without the file.
[[nodiscard]] std::string content_of(const std::string& file);

/// The folder of the cgroup in `proc_cgroup`, a text like /proc/self/cgroup, that has this controller: of
/// version 1, or else of version 2; empty: none. `root` is their mount point.
[[nodiscard]] std::filesystem::path cgroup_folder(const std::string& proc_cgroup,
                                                  const std::string& controller,
                                                  const std::filesystem::path& root = "/sys/fs/cgroup");

/// The smallest limit of the cgroups in `proc_cgroup`, a text like /proc/self/cgroup, and of their
/// parents; `root` is their mount point. The largest number without a limit.
[[nodiscard]] std::uint64_t cgroup_memory_limit(const std::string& proc_cgroup,
                                                const std::filesystem::path& root);

/// Throws UsageError if traces of `bytes` exceed half of the available memory. The message begins with
/// `option` and states that they need `bytes`, the available memory, and `remedy`. Every
/// computation whose memory grows with its input calls this function before it starts.
void check_trace_memory(double bytes, const std::string& option, const std::string& remedy);

}  // namespace hotpath::program
