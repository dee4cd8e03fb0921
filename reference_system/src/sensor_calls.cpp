// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/live_system.hpp"

#include <bit>
#include <string>

namespace hotpath {

namespace {

enum class Entity : std::uint64_t { executor = 1, node, publisher, subscription, timer, callback, message };

/// Handles are never dereferenced.
const void* handle(Entity entity, std::uint64_t index) {
  return std::bit_cast<const void*>((static_cast<std::uint64_t>(entity) << 40) + 16 * (index + 1));
}
const void* publisher_of(std::uint32_t node, std::uint32_t output) {
  return handle(Entity::publisher, (std::uint64_t{node} << 16) + output);
}

}  // namespace

std::unique_ptr<const SensorCalls> SensorCalls::find() {
  if (sensor_call<void()>("hotpath_watch_job") == nullptr) return nullptr;
  return std::unique_ptr<const SensorCalls>(new SensorCalls);
}

void SensorCalls::create(const Graph& graph, const GraphTasks& tasks) const {
  call("hotpath_watch_executor", handle(Entity::executor, 0), "live");
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (!tasks.set[id].local) continue;
    const TaskOrigin& origin = tasks.origin[id];
    const Node& of = graph.nodes[origin.node];
    const void* const node = handle(Entity::node, origin.node);
    if (origin.callback == 0) {
      call("ros_trace_rcl_node_init", node, node, of.name.c_str(), "/");
      for (std::uint32_t o = 0; o < of.outputs.size(); ++o) {
        const void* const publisher = publisher_of(origin.node, o);
        call("ros_trace_rcl_publisher_init", publisher, node, publisher, ("/" + of.outputs[o]).c_str(),
             std::size_t{1});
      }
    }
    const void* const callback = handle(Entity::callback, id);
    if (origin.input) {
      const Input& input = of.inputs[*origin.input];
      const void* const subscription = handle(Entity::subscription, id);
      call("ros_trace_rcl_subscription_init", subscription, node, subscription, ("/" + input.topic).c_str(),
           std::size_t{input.depth});
      call("ros_trace_rclcpp_subscription_init", subscription, subscription);
      call("ros_trace_rclcpp_subscription_callback_added", subscription, callback);
    } else {
      const void* const timer = handle(Entity::timer, id);
      call("ros_trace_rcl_timer_init", timer, tasks.set[id].period.count());
      call("ros_trace_rclcpp_timer_callback_added", timer, callback);
      call("ros_trace_rclcpp_timer_link_node", timer, node);
    }
  }
}

void SensorCalls::start(const Job& job, bool takes_sample) const {
  job_(handle(Entity::executor, 0), job.task, to_ns(job.timestamp), to_ns(job.release));
  if (takes_sample)
    take_(handle(Entity::subscription, job.task), handle(Entity::message, 0), to_ns(job.timestamp), true);
  start_(handle(Entity::callback, job.task), false);
}

void SensorCalls::publish(std::uint32_t node, std::uint32_t output, Time at) const {
  const void* const publisher = publisher_of(node, output);
  rcl_publish_(publisher, handle(Entity::message, 0));
  rmw_publish_(publisher, handle(Entity::message, 0), to_ns(at));
}

void SensorCalls::end(TaskId task) const { end_(handle(Entity::callback, task)); }

}  // namespace hotpath
