// SPDX-License-Identifier: Apache-2.0
#include "machine/shared_memory_watch.hpp"

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "machine/proc_files.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

/// What a process maps (segments, semaphores) or has open (the segments' lock files).
std::set<std::string> used_files(const std::string& process) {
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
  for (fs::directory_iterator it("/proc/" + process + "/fd", ignored), end; it != end;
       it.increment(ignored)) {
    add(fs::read_symlink(it->path(), ignored));
  }
  return files;
}

}  // namespace

void SharedMemoryWatch::note(pid_t process) { files_.merge(used_files(std::to_string(process))); }

void SharedMemoryWatch::note_group(pid_t group) {
  for (const std::string& process : processes()) {
    if (getpgid(std::stoi(process)) == group) files_.merge(used_files(process));
  }
}

void SharedMemoryWatch::remove_orphans() const {
  std::set<std::string> orphans = files_;
  for (const std::string& process : processes()) {
    if (orphans.empty()) return;
    for (const std::string& used : used_files(process)) orphans.erase(used);
  }
  for (const fs::path file : orphans) {
    unlink(file.c_str());
    // The semaphore that guards the opening of a port of Fast DDS is in use for a moment only.
    unlink((file.parent_path() / ("sem." + file.filename().string() + "_mutex")).c_str());
  }
}

}  // namespace hotpath
