// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

namespace hotpath {

/// The text of a regular file of at most 4 MiB. Throws InputError.
std::string read_text_file(const std::string& path);

/// The map that the text consists of. `remedy` says what such a file looks like. Throws InputError.
YAML::Node read_yaml(const std::string& file, const std::string& text, const std::string& remedy);

}  // namespace hotpath
