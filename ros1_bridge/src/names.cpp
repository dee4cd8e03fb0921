// SPDX-License-Identifier: Apache-2.0
#include "names.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace hotpath {

std::string ros_name(std::string_view text) {
  const auto legal = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  constexpr std::size_t kMost = 200;
  std::string name(text.substr(0, kMost));
  std::replace_if(
      name.begin(), name.end(), [&](char c) { return !legal(c); }, '_');
  return name.empty() ? "_" : name;
}

RosNames ros_names(const std::vector<std::string>& texts) {
  RosNames result;
  struct First {
    std::string text;
    int number = 1;  // the last suffix tried
  };
  std::map<std::string, First> wanted_by;
  std::set<std::string> taken;
  for (const std::string& text : texts) {
    const std::string wanted = ros_name(text);
    First& first = wanted_by.try_emplace(wanted, First{text}).first->second;
    std::string name = wanted;
    while (taken.contains(name)) name = wanted + "_" + std::to_string(++first.number);
    if (name != wanted) result.clashes.push_back("`" + first.text + "` and `" + text + "`");
    taken.insert(name);
    result.names.push_back(std::move(name));
  }
  return result;
}

}  // namespace hotpath
