// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "hotpath/core/job.hpp"
#include "hotpath/fastdds/options.hpp"
#include "hotpath/live/executor.hpp"
#include "hotpath/live/sensor_call.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "hotpath/reference_system/run_memory.hpp"
#include "hotpath/reference_system/work.hpp"

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

  /// Calls a function that no job waits for.
  template <class... Arguments>
  static void call(const char* name, Arguments... arguments) {
    sensor_call<void(Arguments...)>(name)(arguments...);
  }

  const Call<Handle, Handle, std::int64_t, bool> take_ = Named{"ros_trace_rmw_take"};
  const Call<Handle, bool> start_ = Named{"ros_trace_callback_start"};
  const Call<Handle> end_ = Named{"ros_trace_callback_end"};
  const Call<Handle, Handle> rcl_publish_ = Named{"ros_trace_rcl_publish"};
  const Call<Handle, Handle, std::int64_t> rmw_publish_ = Named{"ros_trace_rmw_publish"};
  const Call<Handle, std::uint64_t, std::int64_t, std::int64_t> job_ = Named{"hotpath_watch_job"};
};

/// The transport between the nodes of a live system.
enum class TransportKind : std::uint8_t { fastdds, intra_process };
constexpr auto enum_texts(TransportKind) {
  return texts_in_order<TransportKind>({"fastdds", "intra_process"});
}
/// Whether it needs Fast DDS, takes the options of DDS, and connects processes.
constexpr bool is_dds(TransportKind transport) { return transport == TransportKind::fastdds; }

/// Whether this build has the `fastdds` transport.
[[nodiscard]] bool has_fastdds();

/// One executor of a live system.
struct LiveExecutor {
  const ExecutorEntry* entry = nullptr;
  SchedulerOptions scheduler;
  ExecutorOptions threads;
};

/// Parameters of a live system.
struct LiveOptions {
  std::vector<LiveExecutor> executors;
  std::vector<std::uint32_t> executor_of;  ///< By task; empty: the first executor serves all tasks.
  TransportKind transport = TransportKind::fastdds;
  FastDdsOptions fastdds;
  Calibration calibration;
};

/// The nodes of a graph in this process (`tasks.set[id].local`), connected to a transport; runs
/// their jobs.
class LiveNodes : public JobHandler {
 public:
  virtual ~LiveNodes() = default;
  /// Creates the endpoints; samples go to `sink`. `sensor`, which outlives the nodes, hears of the jobs;
  /// nullptr: none. Throws TransportError.
  virtual void connect(SampleSink& sink, const SensorCalls* sensor) = 0;
  /// See Transport.
  virtual void wait_until_matched(Time deadline) = 0;
};

/// Creates the nodes on the requested transport. Throws TransportError.
std::unique_ptr<LiveNodes> make_live_nodes(const Graph& graph, const GraphTasks& tasks,
                                           const LiveOptions& options, RunMemory& memory);

/// The nodes of a graph in this process, driven by one or more executors. Their messages are
/// upstream's, or TaskMessage if the graph has nodes of type `callbacks`. First timestamps are the
/// phases in `tasks`. If the program runs with the sensor of `hotpath watch`, it is watched.
class LiveSystem : private SampleSink {
 public:
  /// `memory` must have logs for all workers and executors. Throws TransportError.
  LiveSystem(const Graph& graph, const GraphTasks& tasks, const LiveOptions& options, RunMemory& memory);
  ~LiveSystem();

  /// Waits until all endpoints of the graph, including other processes, are matched. Throws
  /// TransportError.
  void wait_until_matched(Time deadline) { nodes_->wait_until_matched(deadline); }

  /// See Executor; for all executors, with their workers numbered consecutively.
  void start(Time epoch, Time end);
  void stop();
  Time join();
  /// `end`: of the run; not before the instant that join() returned.
  void close(Time end);
  [[nodiscard]] std::uint64_t arrived(TaskId task) const { return executor_of(task).arrived(task); }
  [[nodiscard]] std::vector<WorkerThread> workers() const;

 private:
  void deliver(TaskId task, const SampleInfo& info, Sample sample) override {
    executor_of(task).deliver(task, info, std::move(sample));
  }
  void rejected() override { ++memory_.rejected(); }
  [[nodiscard]] Executor& executor_of(TaskId task) const {
    return *executors_[executor_of_.empty() ? 0 : executor_of_[task]];
  }

  const std::vector<std::uint32_t> executor_of_;  // by task
  const RunMemory& memory_;
  const std::unique_ptr<const SensorCalls> sensor_ = SensorCalls::find();
  std::unique_ptr<LiveNodes> nodes_;
  std::vector<std::unique_ptr<Executor>> executors_;
};

}  // namespace hotpath
