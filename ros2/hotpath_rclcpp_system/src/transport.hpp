// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <rclcpp/rclcpp.hpp>
#include <string>
#include <vector>

#include "hotpath/live/clock.hpp"
#include "hotpath/live/transport.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "message.hpp"

namespace hotpath {

/// Publishers and subscriptions of rclcpp, in nodes named as in the graph. A subscription's
/// callback passes its sample to the sink, which runs the job immediately.
class RclcppTransport final : public Transport<BoundedMessage>, private SampleOwner {
 public:
  using RosMessage = hotpath_rclcpp_interfaces::msg::Message4kb;

  RclcppTransport(const Graph& graph, const GraphTasks& tasks, const std::string& name_space)
      : tasks_(tasks) {
    for (const Node& node : graph.nodes) {
      nodes_.push_back(std::make_shared<rclcpp::Node>(node.name, name_space));
      for (std::size_t i = 0; i < node.outputs.size(); ++i) node_of_writer_.push_back(nodes_.back());
    }
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      const bool mutual = tasks.set.groups[tasks.set[id].group] == CallbackGroup::mutually_exclusive;
      auto& group = groups_[tasks.set[id].group];
      if (group) continue;
      group = nodes_[tasks.origin[id].node]->create_callback_group(
          mutual ? rclcpp::CallbackGroupType::MutuallyExclusive : rclcpp::CallbackGroupType::Reentrant);
    }
  }

  [[nodiscard]] const std::vector<rclcpp::Node::SharedPtr>& nodes() const { return nodes_; }
  [[nodiscard]] const rclcpp::CallbackGroup::SharedPtr& group(TaskId task) const {
    return groups_.at(tasks_.set[task].group);
  }

  WriterId add_writer(const std::string& topic, std::uint32_t depth, std::uint32_t readers) override {
    rclcpp::Node& node = *node_of_writer_[writers_.size()];  // writers come in the graph's node order
    writers_.push_back({node.create_publisher<RosMessage>(topic, depth), readers});
    return static_cast<WriterId>(writers_.size() - 1);
  }

  void add_reader(const std::string& topic, TaskId task, std::uint32_t depth, std::uint32_t writers,
                  SampleSink& sink) override {
    rclcpp::SubscriptionOptions options;
    options.callback_group = group(task);
    const auto deliver = [this, task, &sink](RosMessage::ConstSharedPtr message) {
      auto* held = new Held{std::move(message), {1}};
      const BoundedMessage& sample = content(*held->message);
      sink.deliver(task, read_info(sample), Sample(&sample, *this, reinterpret_cast<std::uintptr_t>(held)));
    };
    rclcpp::Node& node = *nodes_[tasks_.origin[task].node];
    readers_.push_back({node.create_subscription<RosMessage>(topic, depth, deliver, options), writers});
  }

  void wait_until_matched(Time deadline) override {
    const auto check = [&](const char* what, const std::string& topic, const auto& count,
                           std::size_t wanted) {
      while (count() < wanted) {
        if (now() >= deadline)
          throw TransportError(std::string(what) + " of " + topic + " did not match its partners in time");
        rclcpp::sleep_for(std::chrono::milliseconds(2));
      }
    };
    for (const auto& [publisher, readers] : writers_) {
      check(
          "the publisher", publisher->get_topic_name(), [&] { return publisher->get_subscription_count(); },
          readers);
    }
    for (const auto& [subscription, writers] : readers_) {
      check(
          "a subscription", subscription->get_topic_name(),
          [&] { return subscription->get_publisher_count(); }, writers);
    }
  }

  BoundedMessage& borrow(WriterId) override { return content(scratch()); }

  void publish(WriterId writer, BoundedMessage&, const SampleInfo&) override {
    writers_[writer].publisher->publish(scratch());
  }

 private:
  struct Writer {
    rclcpp::Publisher<RosMessage>::SharedPtr publisher;
    std::size_t readers;
  };
  struct Reader {
    rclcpp::Subscription<RosMessage>::SharedPtr subscription;
    std::size_t writers;
  };
  struct Held {
    RosMessage::ConstSharedPtr message;
    std::atomic<int> holders;
  };
  /// The message of this thread, which fills one message at a time.
  static RosMessage& scratch() {
    thread_local RosMessage message;
    return message;
  }
  void give_back(const void*, std::uintptr_t token) noexcept override {
    auto* held = reinterpret_cast<Held*>(token);
    if (held->holders.fetch_sub(1) == 1) delete held;
  }
  void lend_again(std::uintptr_t token) noexcept override { ++reinterpret_cast<Held*>(token)->holders; }

  const GraphTasks& tasks_;
  std::vector<rclcpp::Node::SharedPtr> nodes_, node_of_writer_;
  std::map<std::uint32_t, rclcpp::CallbackGroup::SharedPtr> groups_;  // by group of the graph
  std::vector<Writer> writers_;
  std::vector<Reader> readers_;
};

}  // namespace hotpath
