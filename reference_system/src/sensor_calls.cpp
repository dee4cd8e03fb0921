// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/sensor_calls.hpp"

#include <bit>
#include <string>
#include <type_traits>
#include <vector>

#include "hotpath/live/sensor_call.hpp"

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
  Functions f{};
  const auto look_up = [](auto& function, const char* name) {
    function = sensor_call<std::remove_pointer_t<std::remove_reference_t<decltype(function)>>>(name);
  };
  look_up(f.node, "ros_trace_rcl_node_init");
  look_up(f.publisher, "ros_trace_rcl_publisher_init");
  look_up(f.subscription, "ros_trace_rcl_subscription_init");
  look_up(f.rclcpp_subscription, "ros_trace_rclcpp_subscription_init");
  look_up(f.subscription_callback, "ros_trace_rclcpp_subscription_callback_added");
  look_up(f.timer, "ros_trace_rcl_timer_init");
  look_up(f.timer_callback, "ros_trace_rclcpp_timer_callback_added");
  look_up(f.timer_node, "ros_trace_rclcpp_timer_link_node");
  look_up(f.take, "ros_trace_rmw_take");
  look_up(f.start, "ros_trace_callback_start");
  look_up(f.end, "ros_trace_callback_end");
  look_up(f.rcl_publish, "ros_trace_rcl_publish");
  look_up(f.rmw_publish, "ros_trace_rmw_publish");
  look_up(f.executor, "hotpath_watch_executor");
  look_up(f.job, "hotpath_watch_job");
  return std::unique_ptr<const SensorCalls>(new SensorCalls(f));
}

void SensorCalls::create(const Graph& graph, const GraphTasks& tasks) const {
  call_.executor(handle(Entity::executor, 0), "live");
  std::vector<bool> created(graph.nodes.size());
  for (TaskId id = 0; id < tasks.set.size(); ++id) {
    if (!tasks.set[id].local) continue;
    const TaskOrigin& origin = tasks.origin[id];
    const Node& of = graph.nodes[origin.node];
    const void* const node = handle(Entity::node, origin.node);
    if (!created[origin.node]) {
      created[origin.node] = true;
      call_.node(node, node, of.name.c_str(), "/");
      for (std::uint32_t o = 0; o < of.outputs.size(); ++o) {
        const void* const publisher = publisher_of(origin.node, o);
        call_.publisher(publisher, node, publisher, ("/" + of.outputs[o]).c_str(), 1);
      }
    }
    const void* const callback = handle(Entity::callback, id);
    if (origin.input) {
      const Input& input = of.inputs[*origin.input];
      const void* const subscription = handle(Entity::subscription, id);
      call_.subscription(subscription, node, subscription, ("/" + input.topic).c_str(), input.depth);
      call_.rclcpp_subscription(subscription, subscription);
      call_.subscription_callback(subscription, callback);
    } else {
      const void* const timer = handle(Entity::timer, id);
      call_.timer(timer, tasks.set[id].period.count());
      call_.timer_callback(timer, callback);
      call_.timer_node(timer, node);
    }
  }
}

void SensorCalls::start(const Job& job, bool takes_sample) const {
  call_.job(handle(Entity::executor, 0), job.task, to_ns(job.timestamp), to_ns(job.release));
  if (takes_sample)
    call_.take(handle(Entity::subscription, job.task), handle(Entity::message, 0), to_ns(job.timestamp),
               true);
  call_.start(handle(Entity::callback, job.task), false);
}

void SensorCalls::publish(std::uint32_t node, std::uint32_t output, Time at) const {
  const void* const publisher = publisher_of(node, output);
  call_.rcl_publish(publisher, handle(Entity::message, 0));
  call_.rmw_publish(publisher, handle(Entity::message, 0), to_ns(at));
}

void SensorCalls::end(TaskId task) const { call_.end(handle(Entity::callback, task)); }

}  // namespace hotpath
