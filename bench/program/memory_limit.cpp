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

}  // namespace

std::string content_of(const std::string& file) {
  return (std::ostringstream() << std::ifstream(file).rdbuf()).str();
}

fs::path cgroup_folder(const std::string& proc_cgroup, const std::string& controller, const fs::path& root) {
  fs::path folder;
  std::istringstream lines(proc_cgroup);
  // `NUMBER:CONTROLLERS:PATH`; version 2 has no controllers.
  for (std::string number, controllers, path; std::getline(lines, number, ':') &&
                                              std::getline(lines, controllers, ':') &&
                                              std::getline(lines, path);) {
    const bool own = ("," + controllers + ",").find("," + controller + ",") != std::string::npos;
    if (own || (controllers.empty() && folder.empty()))
      folder = (own ? root / controller : root) / fs::path(path).relative_path();
  }
  return folder;
}

std::uint64_t cgroup_memory_limit(const std::string& proc_cgroup, const fs::path& root) {
  std::uint64_t least = kUnlimited;
  for (fs::path at = cgroup_folder(proc_cgroup, "memory", root); at.native().size() >= root.native().size();
       at = at.parent_path())
    least =
        std::min({least, number_in_file(at / "memory.max"), number_in_file(at / "memory.limit_in_bytes")});
  return least;
}

std::uint64_t memory_limit() {
  const auto physical =
      static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  std::uint64_t least =
      std::min(physical, cgroup_memory_limit(content_of("/proc/self/cgroup"), "/sys/fs/cgroup"));
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
