// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace hotpath {

/// Name and path of all files *.yaml in the folders of the environment variable, separated by
/// colons, then in `built_in`. Of two files with the same name the first one counts; folders that
/// do not exist count as empty.
std::map<std::string, std::filesystem::path> yaml_files(const char* variable, const std::string& built_in);

/// Whether the text is a path and not a bare name: it has a slash or ends in .yaml or .yml.
bool is_yaml_path(const std::string& name_or_path);

}  // namespace hotpath
