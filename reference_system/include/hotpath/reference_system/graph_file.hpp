// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hotpath/core/input_error.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// Limit of the bytes in a node name, except for type `callbacks`: the message reserves 48
/// including the closing NUL (upstream's TransmissionStats.idl).
inline constexpr std::size_t kMaxNameBytes = 47;

/// Limit of the nodes in one message's history, in graphs without nodes of type `callbacks`
/// (upstream's Message4kb.idl).
inline constexpr std::size_t kMaxHistory = 63;

/// Reads and checks a graph file, YAML with the keys
///
///     name, description, work: cpu_time (default)|wall|fixed, service_wait_ms,
///     topics:  {TOPIC: {publishers: one|many, delivery: [NODE] or unknown}}
///     nodes:   - name, type, execution_time_ms, best_case_execution_time_ms, callback_group, and by type
///                sensor:        period_ms, phase_ms, deadline_ms, release_jitter_ms, priority,
///                               output
///                transform:     input, output
///                fusion:        inputs, output
///                cyclic:        inputs, and all of sensor's
///                intersection:  connections: - input, output
///                command:       input
///                callbacks:     only groups: {GROUP: mutually_exclusive|reentrant}, callbacks: list of
///                  - timer, period_ms, phase_ms, deadline_ms, release_jitter_ms, or subscription,
///                    depth, service: true|false; each with
///                    priority, execution_time_ms, group, publishes: [TOPIC or {topic, RULE}]
///                    where RULE is when: always, when: all_new with of: [TOPIC], every: N,
///                    or last_of: [TOPIC]; and at_percent: the share of the execution time before it
///     chains:  - name, nodes, sources, sink
///     platform: cores, timer_thread: by_executor|raised|equal, execution_times:
///     worst|uniform|measured|replayed,
///              release_cost_us, pass_cost_us, dispatch_cost_us or
///              timer_dispatch_cost_us and subscription_dispatch_cost_us, wait_cost_us,
///              wait_cost_per_entity_us, wake_up_us, delivery_delay_us
///
/// An input is a topic or {topic, depth, priority}. `input: T` is short for `inputs: [T]`. The output is the
/// node's name unless given; the depth is 1, for command nodes 10 (upstream). The order of nodes is the order
/// of creation. The execution time of a callback is one number, {min, max}, {measured: [...]} or {file: CSV},
/// see docs/graphs.md. Chains name nodes or tasks. Milliseconds and microseconds are decimal and exact down
/// to one nanosecond. The platform is the machine of simulations (GraphPlatform). Throws InputError for a
/// file that cannot be read or is not a valid graph.
[[nodiscard]] Graph load_graph(const std::string& path);

/// The path of a graph file. A name with a slash or ending in .yaml or .yml is a path already. A
/// bare name is searched as NAME.yaml in the folders of the environment variable HOTPATH_GRAPHS
/// (separated by colons), then in the built-in folders. Throws InputError if there is no such file.
[[nodiscard]] std::string find_graph(const std::string& name_or_path);

/// One graph file in these folders.
struct GraphListing {
  std::string name;  ///< The argument of find_graph: the file name without .yaml.
  std::string description;
  std::size_t nodes = 0;
  std::string path;
  std::string error;  ///< The reason why the file is not a valid graph; empty if it is valid.
};

/// All graphs that are available by bare name, sorted by name. If two files have the same name,
/// lists the one that find_graph takes.
[[nodiscard]] std::vector<GraphListing> list_graphs();

}  // namespace hotpath
