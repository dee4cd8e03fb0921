// SPDX-License-Identifier: Apache-2.0
#include "yaml_folders.hpp"

#include <algorithm>
#include <cstdlib>
#include <vector>

namespace hotpath {

namespace {

namespace fs = std::filesystem;

void append_folders(std::vector<fs::path>& folders, const std::string& colon_separated) {
  std::size_t begin = 0;
  while (begin <= colon_separated.size()) {
    const std::size_t end = std::min(colon_separated.find(':', begin), colon_separated.size());
    if (end > begin) folders.emplace_back(colon_separated.substr(begin, end - begin));
    begin = end + 1;
  }
}

}  // namespace

std::map<std::string, fs::path> yaml_files(const char* variable, const std::string& built_in) {
  std::vector<fs::path> folders;
  if (const char* given = std::getenv(variable)) append_folders(folders, given);
  append_folders(folders, built_in);
  std::map<std::string, fs::path> files;
  for (const fs::path& folder : folders) {
    std::error_code error, ignored;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      const fs::path& path = it->path();
      if (path.extension() == ".yaml" && !it->is_directory(ignored)) files.emplace(path.stem(), path);
    }
  }
  return files;
}

bool is_yaml_path(const std::string& name_or_path) {
  const fs::path path(name_or_path);
  return name_or_path.find('/') != std::string::npos || path.extension() == ".yaml" ||
         path.extension() == ".yml";
}

}  // namespace hotpath
