// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "machine/proc_files.hpp"

namespace hotpath {

/// Remembers which files of /dev/shm a process maps or has open, so that they can be removed when it dies
/// without doing so itself (Fast DDS's segments and their lock files outlive a killed process).
class SharedMemoryWatch {
 public:
  void note(pid_t process) { files_.merge(used_files(std::to_string(process))); }

  /// Removes the files noted that no living process uses.
  void remove_orphans() const {
    std::set<std::string> orphans = files_;
    for (const std::string& process : processes()) {
      if (orphans.empty()) return;
      for (const std::string& used : used_files(process)) orphans.erase(used);
    }
    for (const std::filesystem::path file : orphans) {
      unlink(file.c_str());
      // The semaphore that guards the opening of a port of Fast DDS is in use for a moment only.
      unlink((file.parent_path() / ("sem." + file.filename().string() + "_mutex")).c_str());
    }
  }

 private:
  /// What a process maps (segments, semaphores) or has open (the segments' lock files).
  static std::set<std::string> used_files(const std::string& process) {
    std::set<std::string> files;
    const auto add = [&files](const std::string& text) {
      const std::size_t path = text.find("/dev/shm/");
      if (path != std::string::npos && text.find(" (deleted)") == std::string::npos) {
        files.insert(text.substr(path));
      }
    };
    std::ifstream maps("/proc/" + process + "/maps");
    for (std::string line; std::getline(maps, line);) add(line);
    std::error_code ignored;
    for (std::filesystem::directory_iterator it("/proc/" + process + "/fd", ignored), end; it != end;
         it.increment(ignored)) {
      add(std::filesystem::read_symlink(it->path(), ignored));
    }
    return files;
  }

  std::set<std::string> files_;
};

}  // namespace hotpath
