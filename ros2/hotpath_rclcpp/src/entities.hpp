// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "driver.hpp"

namespace hotpath {

/// The nodes and callback groups of one executor, with their entities. Callable from any thread.
class Entities {
 public:
  Entities(std::shared_ptr<ExecutorDriver> driver, rclcpp::Context::SharedPtr context)
      : driver_(std::move(driver)), context_(std::move(context)) {}
  ~Entities();
  Entities(const Entities&) = delete;
  Entities& operator=(const Entities&) = delete;

  // The add functions throw std::runtime_error if the node or group is already in an executor, the
  // remove functions if it is not in this one.
  void add_node(const versions::NodeBase::SharedPtr& node);
  void remove_node(const versions::NodeBase::SharedPtr& node);
  void add_group(const rclcpp::CallbackGroup::SharedPtr& group, const versions::NodeBase::SharedPtr& node);
  void remove_group(const rclcpp::CallbackGroup::SharedPtr& group);
  enum class Added : std::uint8_t { any, by_hand, with_node };
  [[nodiscard]] std::vector<rclcpp::CallbackGroup::WeakPtr> groups(Added how);

  /// Adds new entities of the nodes and drops entities that are gone. Throws std::runtime_error for
  /// an entity that does not support callbacks.
  void refresh();

 private:
  using Handle = std::weak_ptr<void>;
  template <class Value>
  using ByHandle = std::map<Handle, Value, std::owner_less<>>;
  struct OfGroup {
    std::shared_ptr<Group> group;
    versions::NodeBase::WeakPtr node;
    bool by_hand = false;
    /// Groups added by hand: triggered when the group gets an entity. Kept here because a group
    /// returns it only while its context is valid.
    rclcpp::GuardCondition::SharedPtr changes;
  };

  void refresh_locked();
  /// refresh_locked() after a removal; an entity that cannot be served is logged and does not
  /// prevent it.
  void let_go();
  void drop_node(const versions::NodeBase::SharedPtr& node);
  void drop_group(const rclcpp::CallbackGroup::SharedPtr& group);
  void collect_groups();
  void collect(const OfGroup& of, ByHandle<std::shared_ptr<Entry>>& found);
  void listen(const std::shared_ptr<Entry>& entry);
  void listen_to_jumps(const rclcpp::Clock::SharedPtr& clock, const std::shared_ptr<Entry>& entry);
  void ignore(const std::shared_ptr<Entry>& entry);

  const std::shared_ptr<ExecutorDriver> driver_;
  const rclcpp::Context::SharedPtr context_;
  std::mutex mutex_;
  std::vector<versions::NodeBase::WeakPtr> nodes_;
  ByHandle<OfGroup> groups_;
  ByHandle<std::shared_ptr<Entry>> entries_;
};

}  // namespace hotpath
