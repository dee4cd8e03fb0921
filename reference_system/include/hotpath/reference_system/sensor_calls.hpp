// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "hotpath/core/job.hpp"
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
  struct Functions {
    void (*node)(Handle, Handle, const char*, const char*);
    void (*publisher)(Handle, Handle, Handle, const char*, std::size_t);
    void (*subscription)(Handle, Handle, Handle, const char*, std::size_t);
    void (*rclcpp_subscription)(Handle, Handle);
    void (*subscription_callback)(Handle, Handle);
    void (*timer)(Handle, std::int64_t);
    void (*timer_callback)(Handle, Handle);
    void (*timer_node)(Handle, Handle);
    void (*take)(Handle, Handle, std::int64_t, bool);
    void (*start)(Handle, bool);
    void (*end)(Handle);
    void (*rcl_publish)(Handle, Handle);
    void (*rmw_publish)(Handle, Handle, std::int64_t);
    void (*executor)(Handle, const char*);
    void (*job)(Handle, std::uint64_t, std::int64_t, std::int64_t);
  };
  explicit SensorCalls(const Functions& functions) : call_(functions) {}

  const Functions call_;
};

}  // namespace hotpath
