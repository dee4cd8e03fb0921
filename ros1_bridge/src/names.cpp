// SPDX-License-Identifier: Apache-2.0
#include "names.hpp"

#include <algorithm>
#include <map>

namespace hotpath {

std::string ros_name(std::string_view text) {
  const auto legal = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  std::string name(text);
  std::replace_if(
      name.begin(), name.end(), [&](char c) { return !legal(c); }, '_');
  return name.empty() ? "_" : name;
}

RosNames ros_names(const std::vector<std::string>& texts) {
  RosNames result;
  std::map<std::string, std::string> taken;  // name, text
  for (const std::string& text : texts) {
    const std::string wanted = ros_name(text);
    std::string name = wanted;
    for (int number = 2; taken.contains(name); ++number) name = wanted + "_" + std::to_string(number);
    if (name != wanted) result.clashes.push_back("`" + taken[wanted] + "` and `" + text + "`");
    taken[name] = text;
    result.names.push_back(name);
  }
  return result;
}

}  // namespace hotpath
