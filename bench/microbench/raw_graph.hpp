// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Message4kbPubSubTypes.h>

#include <deque>
#include <map>

#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/message.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "microbench/measurement.hpp"
#include "microbench/raw_executor.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::microbench {

/// The yardstick of a whole graph without work: its topics, timers and message sizes over Fast DDS
/// alone, with the threads of a live executor. Nodes only forward data, as messages with
/// uninitialised contents.
class RawGraph {
 public:
  /// First timestamps are the phases in `tasks`, relative to `epoch`. Throws TransportError.
  RawGraph(const Graph& graph, const GraphTasks& tasks, const FastDdsOptions& options, Time epoch)
      : participant_(options) {
    participant_.register_type(eprosima::fastdds::dds::TypeSupport(new msg::Message4kbPubSubType));
    std::map<std::string, std::uint32_t> readers, writers;
    for (const Node& node : graph.nodes) {
      for (const Input& input : node.inputs) ++readers[input.topic];
      for (const std::string& output : node.outputs) ++writers[output];
    }
    for (const Node& node : graph.nodes) {
      RawNode& raw = nodes_.emplace_back();
      for (const std::string& output : node.outputs) {
        raw.writers.push_back(participant_.add_writer(output, 1, readers[output]));
      }
    }
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      const TaskOrigin origin = tasks.origin[id];
      const Node& node = graph.nodes[origin.node];
      RawNode& raw = nodes_[origin.node];
      if (origin.input) {
        const Input& input = node.inputs[*origin.input];
        executor_.add_reader(participant_, input.topic, input.depth, writers[input.topic],
                             subscription(node, raw, *origin.input));
      } else {
        executor_.add_timer(epoch + tasks.set[id].phase, node.period, [this, &raw] {
          ++callbacks_;
          publish(*raw.writers.front());
        });
      }
    }
    participant_.wait_until_matched(now() + std::chrono::seconds(10));
  }

  void start() { executor_.start(); }
  void stop() { executor_.stop(); }

  /// Number of timers and samples handled until stop().
  std::uint64_t callbacks() const { return callbacks_; }

 private:
  using Executor = RawExecutor<msg::Message4kb>;

  struct RawNode {
    std::vector<eprosima::fastdds::dds::DataWriter*> writers;
    std::uint32_t inputs_seen = 0;  // of a fusion, since its last publication
  };

  Executor::OnSample subscription(const Node& node, RawNode& raw, std::uint32_t input) {
    const bool passes_on = node.type == NodeType::transform || node.type == NodeType::intersection;
    auto* const writer = passes_on                       ? raw.writers[input]
                         : node.type == NodeType::fusion ? raw.writers.front()
                                                         : nullptr;
    // A fusion publishes when all of its inputs have arrived, other nodes with every sample.
    const std::uint32_t own = passes_on ? 0 : 1U << input,
                        all = passes_on ? 0 : (1U << node.inputs.size()) - 1;
    return [this, &raw, writer, own, all](const msg::Message4kb&) {
      ++callbacks_;
      raw.inputs_seen |= own;
      if (writer == nullptr || raw.inputs_seen != all) return;
      raw.inputs_seen = 0;
      publish(*writer);
    };
  }

  static void publish(eprosima::fastdds::dds::DataWriter& writer) { writer.write(borrow_raw(writer)); }

  std::deque<RawNode> nodes_;
  Executor executor_;
  FastDdsParticipant participant_;
  std::uint64_t callbacks_ = 0;
};

/// CPU time of one callback of Autoware without work on Fast DDS alone, measured over `length`.
inline Measurement raw_callback(const FastDdsOptions& options, Duration length) {
  Graph graph = load_graph(find_graph("autoware"));
  scale_to_load(graph, 0);
  GraphTasks tasks = make_tasks(graph);
  setup::set_phases(tasks.set, make_phases(graph, tasks, Phases::creation));
  const Time epoch = now() + 500ms;
  RawGraph raw(graph, tasks, options, epoch);
  std::this_thread::sleep_until(epoch);
  const Duration before = process_cpu_time();
  raw.start();
  std::this_thread::sleep_until(epoch + length);
  raw.stop();
  const auto callbacks = static_cast<double>(raw.callbacks());
  const double each = ns(process_cpu_time() - before) / callbacks;
  return {each, {{"cpu_per_callback_ns", each}, {"callbacks", callbacks}}};
}

}  // namespace hotpath::microbench
