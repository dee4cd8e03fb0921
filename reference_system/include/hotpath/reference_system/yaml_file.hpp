// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace hotpath {

/// Name and path of all files *.yaml in the folders of the environment variable, separated by
/// colons, then in `built_in`. Of two files with the same name the first one counts; folders that
/// do not exist count as empty.
std::map<std::string, std::filesystem::path> yaml_files(const char* variable, const std::string& built_in);

/// Whether the text is a path and not a bare name: it has a slash or ends in .yaml or .yml.
bool is_yaml_path(const std::string& name_or_path);

/// The path of the file with this name, of a `kind` of files. Throws InputError with the names that there
/// are, first those of `others`, which have no file.
std::string find_yaml(const std::string& kind, const std::map<std::string, std::filesystem::path>& files,
                      const std::string& name, std::vector<std::string> others = {});

/// Reads a regular text file of at most 4 MiB. Throws InputError.
std::string read_text_file(const std::string& path);

/// Parses a text that must be a map. `remedy` describes such a file. Throws InputError.
YAML::Node read_yaml(const std::string& file, const std::string& text, const std::string& remedy);

}  // namespace hotpath
