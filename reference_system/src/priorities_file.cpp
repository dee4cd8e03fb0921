// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/priorities_file.hpp"

#include <algorithm>

#include "hotpath/core/suggestion.hpp"
#include "hotpath/reference_system/yaml_file.hpp"

namespace hotpath {

namespace {

constexpr const char* kExample = "[{id: /NODE@Timer(100000000), priority: 1}]";

void read_callbacks(const YamlMap& map, std::vector<GivenPriority>& priorities) {
  const YamlValue id = map.require("id", "/NODE@Timer(100000000)");
  const std::int64_t priority = map.require("priority", "1").priority();
  const std::string text = id.text();
  const std::size_t first = text.find('@');
  if (!text.starts_with('/') || first == std::string::npos) {
    id.fail("`" + text + "` names no callback", "write /NODE@Timer(NANOSECONDS), /NODE@Subscription(/TOPIC)");
  }
  const std::string node = text.substr(0, first);
  for (std::size_t at = first; at < text.size();) {
    const std::size_t end = std::min(text.find('@', at + 1), text.size());
    const std::string callback = node + text.substr(at, end - at);
    if (std::ranges::count(priorities, callback, &GivenPriority::id) > 0)
      id.fail(callback + " occurs twice", "keep one");
    priorities.push_back({callback, priority, id.line()});
    at = end;
  }
}

}  // namespace

std::vector<GivenPriority> read_priorities(const std::string& path) {
  const std::string remedy = std::string("the file is `priorities: ") + kExample + "`";
  const YamlMap map(path, read_text_file(path), "the file", remedy);
  map.check_keys({"priorities"});
  std::vector<GivenPriority> priorities;
  for (const YamlValue& value : map.require("priorities", kExample).list("a callback")) {
    const YamlMap callback(value, "a callback");
    callback.check_keys({"id", "priority"});
    read_callbacks(callback, priorities);
  }
  return priorities;
}

std::string no_such_callback(const std::string& path, const GivenPriority& given,
                             std::span<const std::string> known) {
  return path + ":" + std::to_string(given.line) + ": no callback " + given.id + " so far; " +
         suggest(given.id, known);
}

}  // namespace hotpath
