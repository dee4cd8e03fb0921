// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>

#include "hotpath/core/thread_policy.hpp"
#include "hotpath/reference_system/yaml_file.hpp"
#include "hotpath_rclcpp/priority_executor.hpp"
#include "setup.hpp"

namespace hotpath {

namespace {

constexpr const char* kRemedy = "the file is, for example, `{executor: rm-ro, graph: graph.yaml}`";

bool is_path(const std::string& graph) {
  return graph.find('/') != std::string::npos || graph.ends_with(".yaml") || graph.ends_with(".yml");
}

/// Checks a value here for the sake of the line. `check` throws `PROBLEM; REMEDY` or only the problem.
template <class Check>
void check_value(const YamlValue& value, const Check& check) {
  try {
    static_cast<void>(check());
  } catch (const std::exception& error) {
    const std::string said = error.what(), separator = "; ";
    const std::size_t end = std::min(said.find(separator), said.size());
    value.fail(said.substr(0, end), end < said.size() ? said.substr(end + separator.size()) : kRemedy);
  }
}

/// A policy in the notation of ThreadPolicy.
std::string policy(const YamlValue& value) {
  check_value(value, [&] { return parse_thread_policy(value.text()); });
  return value.text();
}

}  // namespace

PriorityExecutorOptions PriorityExecutorOptions::from_file(const std::string& file) {
  const YamlMap map(YamlValue(file, read_yaml(file, read_text_file(file), kRemedy), "the file", 1),
                    "the file");
  map.check_keys({"executor", "threads", "priorities", "graph", "offsets", "learn", "service_wait_ms",
                  "timer_thread", "executor_threads", "middleware_threads"});
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  const auto path = [&](const YamlValue& value) { return (folder / value.text()).string(); };
  PriorityExecutorOptions options;
  if (const auto value = map.find("executor")) {
    options.executor = value->text();
    check_value(*value, [&] { return understand(options); });
  }
  if (const auto value = map.find("threads")) {
    options.threads = static_cast<unsigned>(value->integer(1, std::numeric_limits<unsigned>::max()));
    check_value(*value, [&] { return understand(options); });
  }
  if (const auto value = map.find("priorities")) options.priorities = path(*value);
  if (const auto value = map.find("graph")) {
    options.graph = is_path(value->text()) ? path(*value) : value->text();
  }
  if (const auto value = map.find("offsets")) options.offsets = path(*value);
  if (const auto value = map.find("learn")) options.learn = value->choice({"false", "true"}) == 1;
  if (const auto value = map.find("service_wait_ms")) options.service_wait = value->milliseconds(true);
  if (const auto value = map.find("timer_thread")) options.timer_thread = policy(*value);
  if (const auto value = map.find("executor_threads")) options.executor_threads = policy(*value);
  if (const auto value = map.find("middleware_threads")) options.middleware_threads = policy(*value);
  return options;
}

}  // namespace hotpath
