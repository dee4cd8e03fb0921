// SPDX-License-Identifier: Apache-2.0
#include "program/memory_limit.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>

#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath::program {

namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

/// The number in a file; `max`, or no file, is no limit.
std::uint64_t number_in_file(const fs::path& file) {
  std::uint64_t limit = kUnlimited;
  std::ifstream in(file);
  return in >> limit ? limit : kUnlimited;
}

/// The smallest limit of a cgroup and its parents.
std::uint64_t least_limit(const fs::path& mount, const fs::path& cgroup, const char* file) {
  const std::uint64_t own = number_in_file(mount / cgroup.relative_path() / file);
  return cgroup.has_relative_path() ? std::min(own, least_limit(mount, cgroup.parent_path(), file)) : own;
}

}  // namespace

std::uint64_t cgroup_memory_limit(const std::string& proc_cgroup, const fs::path& root) {
  std::uint64_t least = kUnlimited;
  std::istringstream lines(proc_cgroup);
  // `NUMBER:CONTROLLERS:PATH`; version 2 has no controllers.
  for (std::string number, controllers, path; std::getline(lines, number, ':') &&
                                              std::getline(lines, controllers, ':') &&
                                              std::getline(lines, path);) {
    if (controllers == "memory") {
      least = std::min(least, least_limit(root / "memory", path, "memory.limit_in_bytes"));
    } else if (controllers.empty()) {
      least = std::min(
          {least, least_limit(root, path, "memory.max"), least_limit(root / "unified", path, "memory.max")});
    }
  }
  return least;
}

std::uint64_t memory_limit() {
  std::ifstream in("/proc/self/cgroup");
  std::ostringstream cgroups;
  cgroups << in.rdbuf();
  const auto physical =
      static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  std::uint64_t least = std::min(physical, cgroup_memory_limit(cgroups.str(), "/sys/fs/cgroup"));
  for (const auto resource : {RLIMIT_AS, RLIMIT_DATA}) {
    rlimit limit{};
    if (getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
      least = std::min(least, static_cast<std::uint64_t>(limit.rlim_cur));
    }
  }
  return least;
}

std::uint64_t memory_in_use() {
  std::ifstream in("/proc/self/statm");
  std::uint64_t size = 0, resident = 0;
  in >> size >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

void check_trace_memory(double bytes, const std::string& option, const std::string& remedy) {
  const auto available = static_cast<double>(memory_limit());
  if (bytes < available / 2) return;
  throw UsageError(
      text("%s: the traces would take about %.2g GB of memory, but %.2g GB are available; take %s",
           option.c_str(), bytes / 1e9, available / 1e9, remedy.c_str()));
}

}  // namespace hotpath::program
