// SPDX-License-Identifier: Apache-2.0
#include "yaml_folders.hpp"

#include <cstdlib>
#include <sstream>

namespace hotpath {

namespace fs = std::filesystem;

std::map<std::string, fs::path> yaml_files(const char* variable, const std::string& built_in) {
  const char* const given = std::getenv(variable);
  std::istringstream folders((given != nullptr ? std::string(given) + ":" : "") + built_in);
  std::map<std::string, fs::path> files;
  for (std::string folder; std::getline(folders, folder, ':');) {
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
