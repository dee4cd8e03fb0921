// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Message4kbPubSubTypes.h>

#include <deque>
#include <map>
#include <string>

#include "hotpath/reference_system/graph.hpp"
#include "hotpath/reference_system/message.hpp"
#include "microbench/raw_executor.hpp"

namespace hotpath::gbench {

struct RawMessage4kbTraits {
  using Message = msg::Message4kb;
  using PubSubType = msg::Message4kbPubSubType;
};

/// The yardstick of a whole graph without work: its topics, timers and message sizes over Fast DDS, with the
/// threads of a live executor and none of our code, and with nodes that only pass data on. (What they publish
/// is left as the loan came.)
class RawGraph {
 public:
  /// First timestamps are the phases in `tasks`, relative to `epoch`. Throws TransportError.
  RawGraph(const Graph& graph, const GraphTasks& tasks, const FastDdsOptions& options, Time epoch)
      : participant_(options) {
    participant_.register_type(eprosima::fastdds::dds::TypeSupport(new RawMessage4kbTraits::PubSubType));
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

  /// Timers and samples handled until stop().
  std::uint64_t callbacks() const { return callbacks_; }

 private:
  using Executor = RawExecutor<RawMessage4kbTraits>;

  struct RawNode {
    std::vector<eprosima::fastdds::dds::DataWriter*> writers;
    std::uint32_t inputs_seen = 0;  // of a fusion, since its last publication
  };

  Executor::OnSample subscription(const Node& node, RawNode& raw, std::uint32_t input) {
    switch (node.type) {
      case NodeType::transform:
      case NodeType::intersection:
        return [this, writer = raw.writers[input]](const msg::Message4kb&) {
          ++callbacks_;
          publish(*writer);
        };
      case NodeType::fusion:
        return [this, &raw, bit = 1U << input, all = (1U << node.inputs.size()) - 1](const msg::Message4kb&) {
          ++callbacks_;
          raw.inputs_seen |= bit;
          if (raw.inputs_seen != all) return;
          raw.inputs_seen = 0;
          publish(*raw.writers.front());
        };
      default:
        return [this](const msg::Message4kb&) { ++callbacks_; };
    }
  }

  static void publish(eprosima::fastdds::dds::DataWriter& writer) { writer.write(borrow_raw(writer)); }

  std::deque<RawNode> nodes_;
  Executor executor_;
  FastDdsParticipant participant_;
  std::uint64_t callbacks_ = 0;
};

}  // namespace hotpath::gbench
