// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "parameters.hpp"
#include "pending_samples.hpp"
#include "ros_publisher.hpp"
#include "telemetry_input.hpp"
#include "topic_set.hpp"

namespace hotpath {

/// Converts telemetry into messages on ROS topics. Use it from one thread only.
class Bridge {
 public:
  using Clock = std::chrono::steady_clock;

  Bridge(const RosNode& node, const Parameters& parameters, TelemetryInput& input);

  /// May block until the master is back, if a new graph needs topics.
  void handle(Event event);
  /// Call once a second: publishes the bridge's own health and logs what it is waiting for.
  void tick(Clock::time_point now);

 private:
  struct Chain {
    RosPublisher<Scalar> latency;
    RosPublisher<StampedVector> stamped;
    std::string frame;
    std::optional<std::uint64_t> next;  ///< Expected number of the next sample.
  };
  /// Counts since the start of this process.
  struct Counts {
    std::uint64_t runs = 0;
    std::uint64_t lost = 0;          ///< Missing numbers: samples lost between benchmark and bridge.
    std::uint64_t before_first = 0;  ///< Chain samples published before the bridge discovered the benchmark.
    std::uint64_t malformed = 0;     ///< Samples that do not match their run.
    std::uint64_t graph_left_out = 0, points_left_out = 0, diagnostics_left_out = 0;  ///< By decimation.
  };

  void begin(telemetry::RunInfo run);
  void advertise();
  void advertise_chains();
  void advertise_points();
  void show(const telemetry::Statistics& statistics);
  void show(const telemetry::ChainSample& sample);
  void show(const telemetry::Clock& clock);
  void show(const LidarSample& sample);
  void show(BytesSample& sample);
  void draw(const telemetry::Statistics* statistics);
  void diagnose(const telemetry::Statistics& statistics);
  bool of_this_run(const Event& event) const;
  void report_partners();
  Diagnosis own_health();

  const RosNode& node_;
  const Parameters parameters_;
  TelemetryInput& input_;

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
  std::string unknown_chains_;

  std::vector<std::string> node_names_, chain_names_;  ///< ROS names; parallel to the run's.
  TopicSet<Scalar> latency_topics_, response_time_topics_;
  TopicSet<StampedVector> stamped_topics_;
  TopicSet<PointCloud> points_topics_;
  std::vector<Chain> chains_;  ///< Parallel to the run's; without publisher if not in ~chains.
  std::vector<RosPublisher<Scalar>> response_times_;  ///< Parallel to the run's nodes.
  std::vector<RosPublisher<PointCloud>> points_;
  std::vector<std::string> point_frames_;
  std::vector<std::uint64_t> scans_;  ///< Parallel to points_.
  std::vector<RosPublisher<ByteArray>> bytes_;
  RosPublisher<MarkerSet> graph_;
  RosPublisher<Text> metadata_;
  RosPublisher<Diagnoses> diagnostics_;
  RosPublisher<StaticTransforms> transforms_;
  RosPublisher<ClockTime> clock_;
};

}  // namespace hotpath
