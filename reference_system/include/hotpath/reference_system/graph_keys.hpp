// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "hotpath/core/worker.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// The maps in a graph file, besides the nodes of each NodeType.
enum class KeysOf : std::uint8_t {
  graph = enum_texts(NodeType{}).size(),
  topic_rule,
  timer,
  subscription,
  execution_time,  ///< Of a timer or subscription.
  publication,
  input,
  connection,
  chain,
  platform,
};

/// What a key's value is, and which values it may have.
enum class ValueKind : std::uint8_t {
  text,
  name,       ///< Of at most kMaxNameBytes.
  long_name,  ///< Of any length.
  topic,
  word,  ///< Of an enumeration.
  time,  ///< >= 0, in the unit of the key's name.
  positive_time,
  percent,  ///< In [0, 100].
  number,   ///< In [GraphKey::least, GraphKey::most].
  priority,
  list,  ///< One item or more.
  form,  ///< Has a form of its own, or a map.
};

/// A key of a graph file: the only place that states its name, unit, kind, default, and where it may stand.
struct GraphKey {
  std::string_view name;  ///< Ends in its unit.
  std::uint32_t of;       ///< Bits of NodeType and KeysOf.
  ValueKind kind;
  std::string_view standard =
      "";  ///< The value that writers omit; empty: none. A deadline of 0 is the period.
  std::string_view example = "";  ///< Of a key that its map must have; empty: it may be absent.
  std::int64_t least = 0, most = 0;
};

/// The bits of these maps.
constexpr std::uint32_t keys_in(auto... maps) { return (0U | ... | (1U << static_cast<unsigned>(maps))); }

namespace graph_keys {
using enum NodeType;
using enum KeysOf;
using enum ValueKind;
inline constexpr std::uint32_t kTimed = keys_in(sensor, cyclic, timer),
                               kShort = keys_in(sensor, transform, fusion, cyclic, intersection, command),
                               kNodes = kShort | keys_in(callbacks),
                               kCallbacks = keys_in(timer, subscription);

/// In the order in which messages list the keys of a map.
inline constexpr auto kAll = std::to_array<GraphKey>({
    {"name", kNodes, long_name, "", "NAME"},
    {"name", keys_in(graph, chain), name, "", "NAME"},
    {"description", keys_in(graph), text},
    // Nodes, their callbacks and topics.
    {"type", kNodes, word, "", "sensor"},
    {"execution_time_ms", kShort, time, "0"},
    {"best_case_execution_time_ms", kShort, time},
    {"callback_group", kShort, word, "mutually_exclusive"},
    {"timer", keys_in(timer), long_name},
    {"period_ms", kTimed, positive_time, "", "100"},
    {"phase_ms", kTimed, time},
    {"deadline_ms", kTimed, positive_time, "0"},
    {"release_jitter_ms", kTimed, time, "0"},
    {"subscription", keys_in(subscription), topic},
    {"topic", keys_in(input, publication), topic, "", "TOPIC"},
    {"depth", keys_in(subscription, input), number, "1", "", 1, 1000},
    {"service", keys_in(subscription), word, "false"},
    {"client", keys_in(subscription), word, "false"},
    {"waitable", keys_in(subscription), word, "false"},
    {"priority", kTimed | keys_in(subscription, input), priority},
    {"execution_time_ms", kCallbacks, form, "0"},
    {"group", kCallbacks, text},
    {"publishes", kCallbacks, form},
    {"when", keys_in(publication), word, "always"},
    {"of", keys_in(publication), list},
    {"every", keys_in(publication), number, "", "", 1, std::numeric_limits<std::int32_t>::max()},
    {"first", keys_in(publication), number, "", "", 1, std::numeric_limits<std::int32_t>::max()},
    {"last_of", keys_in(publication), list},
    {"at_percent", keys_in(publication), percent, "100"},
    {"connections", keys_in(intersection), list, "", "[{input: TOPIC, output: TOPIC}]"},
    {"input", keys_in(transform, fusion, cyclic, command), form},
    {"input", keys_in(connection), form, "", "TOPIC"},
    {"inputs", keys_in(transform, fusion, cyclic, command), list},
    {"output", keys_in(sensor, transform, fusion, cyclic), topic, "name"},
    {"output", keys_in(connection), topic, "", "TOPIC"},
    {"groups", keys_in(callbacks), form},
    {"callbacks", keys_in(callbacks), list, "", "[{timer: NAME, period_ms: 100}]"},
    {"min", keys_in(execution_time), time, "", "1.5"},
    {"p50", keys_in(execution_time), time},
    {"p95", keys_in(execution_time), time},
    {"p99", keys_in(execution_time), time},
    {"max", keys_in(execution_time), time, "", "4.2"},
    {"measured", keys_in(execution_time), list},
    {"file", keys_in(execution_time), text},
    // The graph as a whole. The costs of its platform are in kPlatformCosts.
    {"work", keys_in(graph), word, "cpu_time"},
    {"service_wait_ms", keys_in(graph), time, "0"},
    {"ros_distro", keys_in(graph), word, "jazzy"},
    {"topics", keys_in(graph), form},
    {"publishers", keys_in(topic_rule), word, "one"},
    {"intra_process", keys_in(topic_rule, subscription), word, "false"},
    {"delivery", keys_in(topic_rule), form},
    {"nodes", keys_in(graph), list, "", "[{name: NAME, type: sensor, period_ms: 100}]"},
    {"nodes", keys_in(chain), list, "", "[SOURCE, ..., SINK]"},
    {"sources", keys_in(chain), list},
    {"sink", keys_in(chain), text},
    {"chains", keys_in(graph), list},
    {"platform", keys_in(graph), form},
    {"cores", keys_in(platform), number, "1", "", 1, kMaxWorkers},
    {"timer_thread", keys_in(platform), word, "by_executor"},
    {"execution_times", keys_in(platform), word, "worst"},
    {"measured_delivery_us", keys_in(platform), time, "0"},
    {"median_delivery_us", keys_in(platform), time, "0"},
    {"delivery_samples", keys_in(platform), number, "0", "", 0, std::numeric_limits<std::int32_t>::max()},
});

// The keys with one value each: readers and writers go through these lists.
inline constexpr auto kOfTimer =
    std::make_tuple(std::pair("period_ms", &StatedTimer::period), std::pair("phase_ms", &StatedTimer::phase),
                    std::pair("deadline_ms", &StatedTimer::deadline),
                    std::pair("release_jitter_ms", &StatedTimer::release_jitter),
                    std::pair("priority", &StatedTimer::priority));
inline constexpr auto kOfGraph = std::make_tuple(std::pair("service_wait_ms", &Graph::service_wait),
                                                 std::pair("ros_distro", &Graph::release));
inline constexpr auto kOfPlatform = std::make_tuple(
    std::pair("cores", &GraphPlatform::cores), std::pair("timer_thread", &GraphPlatform::timer_thread),
    std::pair("execution_times", &GraphPlatform::execution_times));
/// The quantiles of an execution time: key and percent.
inline constexpr auto kOfExecutionTime = std::to_array<std::pair<const char*, double>>(
    {{"min", 0}, {"p50", 50}, {"p95", 95}, {"p99", 99}, {"max", 100}});
}  // namespace graph_keys

/// The names of the keys of these maps (bits), in the order of the table.
[[nodiscard]] inline std::vector<std::string> key_names(std::uint32_t maps) {
  std::vector<std::string> names;
  for (const GraphKey& key : graph_keys::kAll)
    if ((key.of & maps) != 0) names.emplace_back(key.name);
  for (const PlatformCost& cost : kPlatformCosts)
    if ((maps & keys_in(KeysOf::platform)) != 0) names.emplace_back(cost.key);
  return names;
}
/// The key with this name of a map; it must have one.
[[nodiscard]] inline const GraphKey& key_of(KeysOf map, std::string_view name) {
  const auto key = std::ranges::find_if(
      graph_keys::kAll, [&](const GraphKey& k) { return k.name == name && (k.of & keys_in(map)) != 0; });
  assert(key != graph_keys::kAll.end() && "a key that is not in the table");
  return *key;
}

}  // namespace hotpath
