// SPDX-License-Identifier: Apache-2.0
#include "shared_memory_watch.hpp"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace hotpath {

namespace {

std::set<std::string> mapped_files(const std::string& process) {
  std::set<std::string> files;
  std::ifstream maps("/proc/" + process + "/maps");
  for (std::string line; std::getline(maps, line);) {
    const std::size_t path = line.find("/dev/shm/");
    if (path != std::string::npos && line.find(" (deleted)") == std::string::npos)
      files.insert(line.substr(path));
  }
  return files;
}

}  // namespace

void SharedMemoryWatch::note(pid_t process) { files_.merge(mapped_files(std::to_string(process))); }

void SharedMemoryWatch::remove_orphans() const {
  std::set<std::string> orphans = files_;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", ignored)) {
    const std::string name = entry.path().filename();
    if (orphans.empty() ||
        !std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; })) {
      continue;
    }
    for (const std::string& used : mapped_files(name)) orphans.erase(used);
  }
  for (const std::string& file : orphans) unlink(file.c_str());
}

}  // namespace hotpath
