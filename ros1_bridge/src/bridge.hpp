// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "parameters.hpp"
#include "pending_samples.hpp"
#include "ros_node.hpp"
#include "telemetry_input.hpp"

namespace hotpath {

/// Converts telemetry into messages on ROS topics. Use it from one thread only.
class Bridge {
 public:
  using Clock = std::chrono::steady_clock;

  Bridge(const Parameters& parameters, TelemetryInput& input);

  /// May block until the master is back, if a new graph needs topics.
  void handle(Event event);
  /// Call once a second: publishes the bridge's own health and logs what it is waiting for.
  void tick(Clock::time_point now);

 private:
  struct Points {
    ros::Publisher publisher;
    std::string frame;
  };
  /// Counts since the start of this process.
  struct Counts {
    std::uint64_t runs = 0;
    std::uint64_t lost = 0;          ///< Missing numbers: samples lost between benchmark and bridge.
    std::uint64_t before_first = 0;  ///< Chain samples published before the bridge discovered the benchmark.
    std::uint64_t malformed = 0;     ///< Samples that do not match their run.
  };

  void show(telemetry::RunInfo& run);
  void advertise_points();
  void show(const telemetry::Statistics& statistics);
  void show(const telemetry::ChainSample& sample);
  void show(const telemetry::Clock& clock);
  void show(const LidarSample& sample);
  void diagnose(const telemetry::Statistics& statistics);
  void publish_status(std::int64_t stamp_ns, const std::vector<diagnostic_msgs::DiagnosticStatus>& statuses);
  void report_partners();
  diagnostic_msgs::DiagnosticStatus own_health();

  const Parameters parameters_;
  TelemetryInput& input_;
  const std::string name_;  ///< Of the node, without the first slash.

  std::optional<telemetry::RunInfo> run_;
  std::optional<telemetry::Statistics> diagnosed_;  ///< Statistics of the last diagnosis.
  PendingSamples pending_;
  std::uint64_t statistics_shown_ = 0;
  std::optional<std::uint64_t> next_statistics_;
  std::uint64_t not_published_ = 0;  ///< In this run, as counted by the benchmark.
  Counts counts_;
  std::uint64_t losses_reported_ = 0, other_run_reported_ = 0;
  std::int32_t benchmarks_ = -1;
  bool other_run_known_ = false, clock_known_ = false;
  bool refusal_known_ = false;  ///< A refusal was logged in this second.

  std::vector<std::string> node_names_, chain_names_;  ///< ROS names; parallel to the run's.
  Topics latency_topics_, response_time_topics_, points_topics_;
  std::vector<ros::Publisher> response_times_;              ///< Parallel to the run's nodes.
  std::vector<ros::Publisher> latencies_;                   ///< Parallel to the run's chains.
  std::vector<std::optional<std::uint64_t>> next_samples_;  ///< Expected numbers, likewise.
  std::vector<Points> points_;
  ros::Publisher graph_, metadata_, diagnostics_;
  ros::Publisher transforms_, clock_;  ///< Advertised when they are needed.
};

}  // namespace hotpath
