// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

namespace hotpath {

/// Reads a regular text file of at most 4 MiB. Throws InputError.
std::string read_text_file(const std::string& path);

/// Parses a text that must be a map. `remedy` describes such a file. Throws InputError.
YAML::Node read_yaml(const std::string& file, const std::string& text, const std::string& remedy);

}  // namespace hotpath
