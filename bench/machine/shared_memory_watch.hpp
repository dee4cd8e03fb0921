// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "machine/proc_files.hpp"

namespace hotpath::machine {

/// Records the files of /dev/shm that a process maps or has open, and removes them after the
/// process was killed: Fast DDS's segments and lock files outlive a killed process. A file created
/// just before the kill cannot be recorded, so all of this user's files with Fast DDS's names that
/// appeared since the watch began count as recorded.
class SharedMemoryWatch {
 public:
  SharedMemoryWatch() : before_(fast_dds_files()) {}

  void note(pid_t process) { files_.merge(used_files(std::to_string(process))); }

  /// Removes the recorded files that no living process uses.
  void remove_orphans() const {
    std::set<std::string> orphans = files_;
    std::ranges::set_difference(fast_dds_files(), before_, std::inserter(orphans, orphans.end()));
    for (const std::string& process : orphans.empty() ? std::vector<std::string>() : processes())
      for (const std::string& used : used_files(process)) orphans.erase(used);
    for (const std::filesystem::path file : orphans) {
      unlink(file.c_str());
      // Fast DDS uses the semaphore of a port only while it opens the port.
      unlink((file.parent_path() / ("sem." + file.filename().string() + "_mutex")).c_str());
    }
  }

 private:
  static std::set<std::string> fast_dds_files() {
    std::set<std::string> files;
    for (const std::string& name : names_in("/dev/shm")) {
      const std::string file = "/dev/shm/" + name;
      struct stat facts {};
      if (name.find("fastrtps_") != std::string::npos && stat(file.c_str(), &facts) == 0 &&
          facts.st_uid == geteuid())
        files.insert(file);
    }
    return files;
  }
  /// The files that a process maps (segments, semaphores) or has open (the segments' lock files).
  /// Another container has another /dev/shm, where Fast DDS's ports have the same names.
  static std::set<std::string> used_files(const std::string& process) {
    std::set<std::string> files;
    const std::filesystem::path folder = "/proc/" + process;
    std::error_code ignored;
    const auto add = [&](const std::string& text) {
      const std::size_t path = text.find("/dev/shm/");
      if (path == std::string::npos) return;
      const std::string file = text.substr(path);
      if (std::filesystem::equivalent(folder / "root" / file.substr(1), file, ignored)) files.insert(file);
    };
    std::ifstream maps(folder / "maps");
    for (std::string line; std::getline(maps, line);) add(line);
    for (const std::string& open : names_in(folder / "fd"))
      add(std::filesystem::read_symlink(folder / "fd" / open, ignored));
    return files;
  }

  const std::set<std::string> before_;
  std::set<std::string> files_;
};

}  // namespace hotpath::machine
