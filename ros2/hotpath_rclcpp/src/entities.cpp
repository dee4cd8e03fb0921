// SPDX-License-Identifier: Apache-2.0
#include "entities.hpp"

#include <algorithm>
#include <rclcpp/experimental/subscription_intra_process_base.hpp>
#include <stdexcept>

namespace hotpath {

namespace {

using IntraProcess = rclcpp::experimental::SubscriptionIntraProcessBase;

/// Keeps events that were announced to one executor but not taken, for the next executor: the
/// middleware announces each event only once.
class Announced {
 public:
  void keep(const std::weak_ptr<void>& entity, std::vector<int> what) {
    if (what.empty() || entity.expired()) return;
    const std::lock_guard lock(mutex_);
    std::erase_if(kept_, [](const auto& item) { return item.first.expired(); });
    kept_[entity] = std::move(what);
  }
  std::vector<int> take(const std::weak_ptr<void>& entity) {
    const std::lock_guard lock(mutex_);
    const auto found = kept_.find(entity);
    if (found == kept_.end()) return {};
    std::vector<int> what = std::move(found->second);
    kept_.erase(found);
    return what;
  }

 private:
  std::mutex mutex_;
  std::map<std::weak_ptr<void>, std::vector<int>, std::owner_less<>> kept_;
};
Announced announced;

/// Capacity for ready jobs per entity. Jobs beyond it are not lost: their events remain.
constexpr std::uint32_t kMostDepth = 256;
constexpr std::uint32_t kDepthOfOthers = 16;

constexpr std::string_view kParameterEvents = "/parameter_events";  // served like a service

std::uint32_t depth(const rclcpp::QoS& qos) {
  const auto profile = qos.get_rmw_qos_profile();
  if (profile.history == RMW_QOS_POLICY_HISTORY_KEEP_ALL) return kMostDepth;
  return static_cast<std::uint32_t>(std::clamp<std::size_t>(profile.depth, 1, kMostDepth));
}

/// `reader`: a subscription or the waitable of one.
void describe_topic(Entry& entry, const auto& reader) {
  entry.topic = reader.get_topic_name();
  entry.id += "@Subscription(" + entry.topic + ")";
  entry.task.depth = depth(reader.get_actual_qos());
}

void describe_timer(Entry& entry, rclcpp::TimerBase& timer) {
  entry.task.kind = TaskKind::timer;
  entry.handle = timer.get_timer_handle().get();
  std::int64_t period = 0;
  if (rcl_timer_get_period(timer.get_timer_handle().get(), &period) != RCL_RET_OK) rcl_reset_error();
  entry.id += "@Timer(" + std::to_string(period) + ")";
  entry.task.period = Duration(period);
}

std::string quoted(const versions::NodeBase& node) {
  return "'" + std::string(node.get_fully_qualified_name()) + "'";
}

void set_callback(rclcpp::GuardCondition& condition, const std::function<void(std::size_t)>& callback) {
  condition.set_on_trigger_callback(callback);
}

std::shared_ptr<Group> make_group(const rclcpp::CallbackGroup::SharedPtr& group) {
  const bool reentrant = group->type() == rclcpp::CallbackGroupType::Reentrant;
  return std::make_shared<Group>(
      Group{reentrant ? CallbackGroup::reentrant : CallbackGroup::mutually_exclusive, 0, 0, group});
}

/// Of a subscription without topic until it is described.
std::shared_ptr<Entry> make_entry(const std::shared_ptr<void>& entity,
                                  const versions::NodeBase::SharedPtr& node,
                                  const std::shared_ptr<Group>& group) {
  auto entry = std::make_shared<Entry>();
  entry->entity = entity;
  entry->group = group;
  if (node) entry->node = node->get_fully_qualified_name();
  entry->id = entry->node;
  entry->task.kind = TaskKind::subscription;
  entry->task.depth = kDepthOfOthers;
  return entry;
}

}  // namespace

Entities::~Entities() {
  const std::lock_guard lock(mutex_);
  for (const auto& [handle, entry] : entries_) ignore(entry);
  for (const auto& [handle, of] : groups_) {
    const auto group = of.group->group.lock();
    if (!group) continue;
    if (of.changes) set_callback(*of.changes, nullptr);
    group->get_associated_with_executor_atomic().store(false);
  }
  for (const auto& weak : nodes_) {
    const auto node = weak.lock();
    if (!node) continue;
    set_callback(versions::changes_of(*node), nullptr);
    node->get_associated_with_executor_atomic().store(false);
  }
}

void Entities::add_node(const versions::NodeBase::SharedPtr& node) {
  if (node->get_associated_with_executor_atomic().exchange(true)) {
    throw std::runtime_error("Node " + quoted(*node) + " has already been added to an executor.");
  }
  const std::lock_guard lock(mutex_);
  nodes_.push_back(node);
  set_callback(versions::changes_of(*node), [driver = driver_](std::size_t) { driver->note_change(); });
  try {
    refresh_locked();
  } catch (...) {
    drop_node(node);
    throw;
  }
}

void Entities::remove_node(const versions::NodeBase::SharedPtr& node) {
  const std::lock_guard lock(mutex_);
  if (std::ranges::none_of(nodes_, [&](const auto& weak) { return weak.lock() == node; })) {
    throw std::runtime_error("Node " + quoted(*node) + " needs to be associated with this executor.");
  }
  drop_node(node);
}

void Entities::drop_node(const versions::NodeBase::SharedPtr& node) {
  std::erase_if(nodes_, [&](const auto& weak) { return weak.lock() == node; });
  set_callback(versions::changes_of(*node), nullptr);
  std::vector<rclcpp::CallbackGroup::SharedPtr> released;
  std::erase_if(groups_, [&](const auto& item) {
    const OfGroup& of = item.second;
    if (of.by_hand || of.node.lock() != node) return false;
    if (auto group = of.group->group.lock()) released.push_back(std::move(group));
    return true;
  });
  let_go();
  // From here on another executor may add them.
  for (const auto& group : released) group->get_associated_with_executor_atomic().store(false);
  node->get_associated_with_executor_atomic().store(false);
}

void Entities::add_group(const rclcpp::CallbackGroup::SharedPtr& group,
                         const versions::NodeBase::SharedPtr& node) {
  if (group->get_associated_with_executor_atomic().exchange(true)) {
    throw std::runtime_error("Callback group has already been added to an executor.");
  }
  const std::lock_guard lock(mutex_);
  OfGroup& of = groups_[group] = {make_group(group), node, true, versions::changes_of(*group, context_)};
  if (of.changes) set_callback(*of.changes, [driver = driver_](std::size_t) { driver->note_change(); });
  try {
    refresh_locked();
  } catch (...) {
    drop_group(group);
    throw;
  }
}

void Entities::remove_group(const rclcpp::CallbackGroup::SharedPtr& group) {
  const std::lock_guard lock(mutex_);
  const auto found = groups_.find(group);
  if (found == groups_.end() || !found->second.by_hand) {
    throw std::runtime_error(
        "Callback group needs to be associated with this executor, by add_callback_group.");
  }
  drop_group(group);
}

void Entities::drop_group(const rclcpp::CallbackGroup::SharedPtr& group) {
  const auto found = groups_.find(group);
  if (found->second.changes) set_callback(*found->second.changes, nullptr);
  groups_.erase(found);
  let_go();
  group->get_associated_with_executor_atomic().store(false);
}

std::vector<rclcpp::CallbackGroup::WeakPtr> Entities::groups(Added how) {
  const std::lock_guard lock(mutex_);
  collect_groups();
  std::vector<rclcpp::CallbackGroup::WeakPtr> all;
  for (const auto& [handle, of] : groups_) {
    if (how == Added::any || of.by_hand == (how == Added::by_hand)) all.push_back(of.group->group);
  }
  return all;
}

void Entities::collect_groups() {
  std::erase_if(nodes_, [](const auto& weak) { return weak.expired(); });
  std::erase_if(groups_, [](const auto& item) {
    const OfGroup& of = item.second;
    const auto group = of.group->group.lock();
    if (group && (of.by_hand || !of.node.expired())) return false;
    if (group) group->get_associated_with_executor_atomic().store(false);
    return true;
  });
  for (const auto& weak : nodes_) {
    const auto node = weak.lock();
    if (!node) continue;
    node->for_each_callback_group([&](const rclcpp::CallbackGroup::SharedPtr& group) {
      if (!group->automatically_add_to_executor_with_node()) return;
      if (group->get_associated_with_executor_atomic().exchange(true)) return;
      groups_[group] = {make_group(group), node, false, nullptr};
    });
  }
}

void Entities::collect(const OfGroup& of, ByHandle<std::shared_ptr<Entry>>& found) {
  const auto group = of.group->group.lock();
  const auto node = of.node.lock();
  if (!group) return;
  ByHandle<rclcpp::SubscriptionBase::SharedPtr> subscription_of;  // intra-process waitables
  const auto add = [&](const auto& entity, EntityKind kind, const auto& describe) {
    if (const auto known = entries_.find(Handle(entity)); known != entries_.end()) {
      found.insert(*known);
      return;
    }
    const auto entry = make_entry(entity, node, of.group);
    entry->task.entity = kind;
    describe(*entry);
    entry->task.service = is_service(entry->task.entity) || entry->topic == kParameterEvents;
    found.emplace(Handle(entity), entry);
  };
  group->collect_all_ptrs(
      [&](const rclcpp::SubscriptionBase::SharedPtr& s) {
        add(s, EntityKind::subscription, [&](Entry& e) {
          e.handle = s->get_subscription_handle().get();
          describe_topic(e, *s);
          if (const auto waitable = s->get_intra_process_waitable()) subscription_of[waitable] = s;
        });
      },
      [&](const rclcpp::ServiceBase::SharedPtr& s) {
        add(s, EntityKind::service, [&](Entry& e) {
          e.handle = s->get_service_handle().get();
          e.id += "@Service(" + std::string(s->get_service_name()) + ")";
        });
      },
      [&](const rclcpp::ClientBase::SharedPtr& c) {
        add(c, EntityKind::client, [&](Entry& e) {
          e.handle = c->get_client_handle().get();
          e.id += "@Client(" + std::string(c->get_service_name()) + ")";
        });
      },
      [&](const rclcpp::TimerBase::SharedPtr& t) {
        add(t, EntityKind::subscription, [&](Entry& e) { describe_timer(e, *t); });
      },
      [&](const rclcpp::Waitable::SharedPtr& w) {
        add(w, EntityKind::waitable, [&](Entry& e) {
          const auto intra_process = std::dynamic_pointer_cast<IntraProcess>(w);
          if (!intra_process) return void(e.id += "@Waitable");
          e.task.entity = EntityKind::intra_process;
          describe_topic(e, *intra_process);
          const auto s = subscription_of.find(Handle(w));
          if (s == subscription_of.end()) return;
          e.stands_for = s->second;
          e.handle = s->second->get_subscription_handle().get();
        });
      });
}

void Entities::refresh() {
  const std::lock_guard lock(mutex_);
  refresh_locked();
}

void Entities::refresh_locked() {
  collect_groups();
  ByHandle<std::shared_ptr<Entry>> found;
  for (const auto& [handle, of] : groups_) collect(of, found);
  ByHandle<std::shared_ptr<Entry>> before = std::exchange(entries_, std::move(found));
  for (const auto& [handle, entry] : before) {
    const auto now = entries_.find(handle);
    if (now == entries_.end() || now->second != entry) ignore(entry);
  }
  std::exception_ptr first_error;
  std::erase_if(entries_, [&](const auto& item) {
    if (before.find(item.first) != before.end()) return false;
    try {
      listen(item.second);
      return false;
    } catch (...) {
      if (!first_error) first_error = std::current_exception();
      driver_->leave(item.second);
      return true;
    }
  });
  if (first_error) std::rethrow_exception(first_error);
}

void Entities::let_go() {
  try {
    refresh_locked();
  } catch (const std::exception& error) {
    // The error concerns another, new entity; spinning reports it again.
    driver_->note_change();
    RCLCPP_ERROR(rclcpp::get_logger("hotpath_rclcpp"), "%s", error.what());
  }
}

void Entities::listen_to_jumps(const rclcpp::Clock::SharedPtr& clock, const std::shared_ptr<Entry>& entry) {
  if (clock->get_clock_type() != RCL_ROS_TIME) return;
  rcl_jump_threshold_t any{};
  any.on_clock_change = true;
  any.min_forward.nanoseconds = 1;
  any.min_backward.nanoseconds = -1;
  entry->jumps = clock->create_jump_callback(
      [] {},
      [driver = driver_, weak = std::weak_ptr<Entry>(entry)](const rcl_time_jump_t& jump) {
        const bool changed =
            jump.clock_change == RCL_ROS_TIME_ACTIVATED || jump.clock_change == RCL_ROS_TIME_DEACTIVATED;
        if (const auto e = weak.lock()) driver->time_jumped(e, changed);
      },
      any);
}

void Entities::listen(const std::shared_ptr<Entry>& entry) {
  driver_->join(entry);
  if (!entry->is_timer()) {
    for (const int which : announced.take(entry->entity)) driver_->arrived(entry, 1, which);
  }
  const auto arrived = [driver = driver_, entry](std::size_t count, int which = 0) {
    driver->arrived(entry, count, which);
  };
  try {
    const auto alive = entry->entity.lock();  // keeps it alive during the set-up: its owner may drop it
    if (!alive) return;
    if (entry->is_timer()) {
      const auto timer = lock<rclcpp::TimerBase>(*entry);
      versions::on_reset(*timer, [driver = driver_, entry](std::size_t) { driver->timer_reset(entry); });
      return listen_to_jumps(versions::clock_of(*timer), entry);
    }
    switch (entry->task.entity) {
      case EntityKind::subscription:
        entry->messages = std::make_unique<MessageCallback>(lock<rclcpp::SubscriptionBase>(*entry), arrived);
        return;
      case EntityKind::service:
        return lock<rclcpp::ServiceBase>(*entry)->set_on_new_request_callback(arrived);
      case EntityKind::client:
        return lock<rclcpp::ClientBase>(*entry)->set_on_new_response_callback(arrived);
      case EntityKind::waitable:
      case EntityKind::intra_process: {
        const auto waitable = lock<rclcpp::Waitable>(*entry);
        if (versions::may_call_back(*waitable)) waitable->set_on_ready_callback(arrived);
        return;
      }
    }
  } catch (const std::exception& error) {
    throw std::runtime_error(
        "PriorityExecutor cannot serve " + entry->id + ": it does not support a callback for ready events (" +
        error.what() + "). Middleware: " + rmw_get_implementation_identifier() +
        ". Use rmw_fastrtps_cpp or rmw_cyclonedds_cpp, override set_on_ready_callback() in "
        "a waitable, or use a wait-set executor of rclcpp.");
  }
}

void Entities::ignore(const std::shared_ptr<Entry>& entry) {
  entry->jumps.reset();
  entry->messages.reset();
  if (const auto alive = entry->entity.lock()) {
    const EntityKind kind = entry->task.entity;
    if (entry->is_timer()) versions::on_reset(*lock<rclcpp::TimerBase>(*entry), nullptr);
    if (kind == EntityKind::service) lock<rclcpp::ServiceBase>(*entry)->clear_on_new_request_callback();
    if (kind == EntityKind::client) lock<rclcpp::ClientBase>(*entry)->clear_on_new_response_callback();
    if (entry->is_waitable()) lock<rclcpp::Waitable>(*entry)->clear_on_ready_callback();
  }
  std::vector<int> left = driver_->leave(entry);
  if (!entry->is_timer()) announced.keep(entry->entity, std::move(left));
}

}  // namespace hotpath
