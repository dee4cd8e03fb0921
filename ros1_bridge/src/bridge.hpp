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

/// Turns telemetry into messages on ROS topics. Belongs to one thread.
class Bridge {
 public:
  using Clock = std::chrono::steady_clock;

  Bridge(const RosNode& node, const Parameters& parameters, TelemetryInput& input);

  /// Waits for the master when a new graph needs topics and the master is away.
  void handle(Event event);
  /// Once a second: health of the bridge itself, and what it waits for.
  void tick(Clock::time_point now);

 private:
  struct Chain {
    RosPublisher<Scalar> latency;
    RosPublisher<StampedVector> stamped;
    std::string frame;
    std::optional<std::uint64_t> next;  ///< Number of the sample after the last.
  };
  /// Since the start of this process.
  struct Counts {
    std::uint64_t runs = 0;
    std::uint64_t lost = 0;          ///< Numbers that are missing: lost between benchmark and bridge.
    std::uint64_t before_first = 0;  ///< Chain samples of a run from before the bridge knew its benchmark.
    std::uint64_t malformed = 0;     ///< Samples that do not fit their run.
    std::uint64_t graph_left_out = 0, points_left_out = 0, diagnostics_left_out = 0;  ///< Decimation.
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
  std::optional<telemetry::Statistics> diagnosed_;  ///< Of the last diagnosis.
  PendingSamples pending_;
  std::uint64_t statistics_shown_ = 0;
  std::optional<std::uint64_t> next_statistics_;
  std::uint64_t not_published_ = 0;  ///< Of this run, by the benchmark's own count.
  Counts counts_;
  std::uint64_t losses_reported_ = 0, other_run_reported_ = 0;
  std::int32_t benchmarks_ = -1;
  bool other_run_known_ = false, clock_known_ = false;
  bool refusal_known_ = false;  ///< In this second.
  std::string unknown_chains_;

  std::vector<std::string> node_names_, chain_names_;  ///< For ROS; parallel to the run's.
  TopicSet<Scalar> latency_topics_, response_time_topics_;
  TopicSet<StampedVector> stamped_topics_;
  TopicSet<PointCloud> points_topics_;
  std::vector<Chain> chains_;  ///< Parallel to the run's; without publisher if not asked for.
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
