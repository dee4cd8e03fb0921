// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "hotpath/core/job.hpp"
#include "hotpath/live/sensor_call.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// Calls the tracepoints of the sensor that `hotpath watch` preloads, as rclcpp calls them: the nodes
/// of a live system can be watched like those of ROS 2. Callable from any thread.
class SensorCalls {
 public:
  /// nullptr: this program runs without the sensor.
  [[nodiscard]] static std::unique_ptr<const SensorCalls> find();

  /// The local nodes, publishers and callbacks of a system.
  void create(const Graph& graph, const GraphTasks& tasks) const;
  void start(const Job& job, bool takes_sample) const;
  /// `output`: of the node. Before the message is handed over.
  void publish(std::uint32_t node, std::uint32_t output, Time at) const;
  void end(TaskId task) const;

 private:
  using Handle = const void*;
  template <class... Arguments>
  using Call = void (*)(Arguments...);
  /// The function with this name, as a pointer to a function of any type.
  struct Named {
    const char* name;
    template <class... Arguments>
    operator Call<Arguments...>() const {  // NOLINT(google-explicit-constructor)
      return sensor_call<void(Arguments...)>(name);
    }
  };
  SensorCalls() = default;

  const Call<Handle, Handle, const char*, const char*> node_ = Named{"ros_trace_rcl_node_init"};
  const Call<Handle, Handle, Handle, const char*, std::size_t> publisher_ =
      Named{"ros_trace_rcl_publisher_init"};
  const Call<Handle, Handle, Handle, const char*, std::size_t> subscription_ =
      Named{"ros_trace_rcl_subscription_init"};
  const Call<Handle, Handle> rclcpp_subscription_ = Named{"ros_trace_rclcpp_subscription_init"};
  const Call<Handle, Handle> subscription_callback_ = Named{"ros_trace_rclcpp_subscription_callback_added"};
  const Call<Handle, std::int64_t> timer_ = Named{"ros_trace_rcl_timer_init"};
  const Call<Handle, Handle> timer_callback_ = Named{"ros_trace_rclcpp_timer_callback_added"};
  const Call<Handle, Handle> timer_node_ = Named{"ros_trace_rclcpp_timer_link_node"};
  const Call<Handle, Handle, std::int64_t, bool> take_ = Named{"ros_trace_rmw_take"};
  const Call<Handle, bool> start_ = Named{"ros_trace_callback_start"};
  const Call<Handle> end_ = Named{"ros_trace_callback_end"};
  const Call<Handle, Handle> rcl_publish_ = Named{"ros_trace_rcl_publish"};
  const Call<Handle, Handle, std::int64_t> rmw_publish_ = Named{"ros_trace_rmw_publish"};
  const Call<Handle, const char*> executor_ = Named{"hotpath_watch_executor"};
  const Call<Handle, std::uint64_t, std::int64_t, std::int64_t> job_ = Named{"hotpath_watch_job"};
};

}  // namespace hotpath
