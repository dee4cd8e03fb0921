// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "driver.hpp"

namespace hotpath {

/// The nodes and callback groups of one executor, and what they have. Any thread.
class Entities {
 public:
  Entities(std::shared_ptr<ExecutorDriver> driver, rclcpp::Context::SharedPtr context)
      : driver_(std::move(driver)), context_(std::move(context)) {}
  ~Entities();
  Entities(const Entities&) = delete;
  Entities& operator=(const Entities&) = delete;

  /// These throw std::runtime_error for what is in an executor already, or not in this one.
  void add_node(const versions::NodeBase::SharedPtr& node);
  void remove_node(const versions::NodeBase::SharedPtr& node);
  void add_group(const rclcpp::CallbackGroup::SharedPtr& group, const versions::NodeBase::SharedPtr& node);
  void remove_group(const rclcpp::CallbackGroup::SharedPtr& group);
  enum class Added : std::uint8_t { any, by_hand, with_node };
  [[nodiscard]] std::vector<rclcpp::CallbackGroup::WeakPtr> groups(Added how);

  /// Takes up what nodes have got, lets go what is gone. Throws std::runtime_error for an entity that cannot
  /// call back.
  void refresh();

 private:
  using Handle = std::weak_ptr<void>;
  template <class Value>
  using ByHandle = std::map<Handle, Value, std::owner_less<>>;
  struct OfGroup {
    std::shared_ptr<Group> group;
    versions::NodeBase::WeakPtr node;
    bool by_hand = false;
    /// By hand: triggered when it gets an entity. A group gives it away only as long as its context is valid.
    rclcpp::GuardCondition::SharedPtr changes;
  };

  void refresh_locked();
  /// refresh_locked() after something was taken out, which what cannot be served does not prevent.
  void let_go();
  void drop_node(const versions::NodeBase::SharedPtr& node);
  void drop_group(const rclcpp::CallbackGroup::SharedPtr& group);
  void collect_groups();
  void collect(const OfGroup& of, ByHandle<std::shared_ptr<Entry>>& found);
  void listen(const std::shared_ptr<Entry>& entry);
  void ignore(const std::shared_ptr<Entry>& entry);

  const std::shared_ptr<ExecutorDriver> driver_;
  const rclcpp::Context::SharedPtr context_;
  std::mutex mutex_;
  std::vector<versions::NodeBase::WeakPtr> nodes_;
  ByHandle<OfGroup> groups_;
  ByHandle<std::shared_ptr<Entry>> entries_;
};

}  // namespace hotpath
