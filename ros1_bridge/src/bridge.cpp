// SPDX-License-Identifier: Apache-2.0
#include "bridge.hpp"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <rosgraph_msgs/Clock.h>
#include <std_msgs/Float64.h>
#include <std_msgs/String.h>
#include <tf2_msgs/TFMessage.h>

#include <utility>

#include "graph_markers.hpp"
#include "lidar.hpp"
#include "messages.hpp"
#include "names.hpp"
#include "node_health.hpp"
#include "run_info.hpp"
#include "text.hpp"

namespace hotpath {

namespace {

/// The nodes' health is published with every n-th statistics: once a second.
constexpr std::uint64_t kDiagnosticsEvery = 10;

std_msgs::Float64 milliseconds_message(std::int64_t ns) {
  return message_of<std_msgs::Float64>(static_cast<double>(ns) / 1e6);
}

template <class Items>
std::vector<std::string> names_of(const Items& items) {
  std::vector<std::string> names;
  for (const auto& item : items) names.push_back(item.name());
  return names;
}

std::vector<std::string> unique_names(const std::vector<std::string>& names, const std::string& what) {
  RosNames result = ros_names(names);
  if (!result.clashes.empty()) {
    ROS_WARN_STREAM(what << " with the same ROS name: " << printable(joined(result.clashes), kMostOfList)
                         << "; the later topic gets a numeric suffix, and hotpath/run maps the names");
  }
  return std::move(result.names);
}

}  // namespace

Bridge::Bridge(const Parameters& parameters, TelemetryInput& input)
    : parameters_(parameters),
      input_(input),
      name_(ros::this_node::getName().substr(1)),
      graph_(advertise<visualization_msgs::MarkerArray>("hotpath/graph", kQueue, true)),
      metadata_(advertise<std_msgs::String>("hotpath/run", 1, true)),
      diagnostics_(advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics")) {}

void Bridge::handle(Event event) {
  const bool of_any_run =
      std::holds_alternative<telemetry::RunInfo>(event) || std::holds_alternative<LidarSample>(event);
  if (of_any_run || (run_ && run_of(event) == run_->run_id())) {
    std::visit([this](auto& sample) { show(sample); }, event);
  } else {
    pending_.keep(std::move(event), Clock::now());
  }
}

void Bridge::show(telemetry::RunInfo& run) {
  if (run_ && run_->run_id() == run.run_id()) return;
  const std::string defect = run_defect(run);
  if (!defect.empty()) {
    ++counts_.malformed;
    // A foreign program may publish invalid runs at any rate: log at most one per second.
    if (!std::exchange(refusal_known_, true)) {
      ROS_ERROR_STREAM("a run of graph " << printable(run.graph(), kMostOfName)
                                         << " cannot be shown: " << defect);
    }
    return;
  }
  make_printable(run);
  ROS_INFO_STREAM("showing " << run.graph() << ", " << run.executor() << ", repetition " << run.repetition()
                             << " (" << run.origin() << ", " << run.transport() << ")");
  ++counts_.runs;
  run_ = std::move(run);
  diagnosed_.reset();
  statistics_shown_ = 0;
  next_statistics_.reset();
  not_published_ = 0;
  other_run_known_ = false;
  node_names_ = unique_names(names_of(run_->nodes()), "nodes");
  chain_names_ = unique_names(names_of(run_->chains()), "chains");
  response_times_ =
      advertise_all<std_msgs::Float64>(response_time_topics_, "hotpath/response_time/", node_names_);
  latencies_ = advertise_all<std_msgs::Float64>(latency_topics_, "hotpath/latency/", chain_names_);
  next_samples_.assign(latencies_.size(), std::nullopt);
  advertise_points();
  metadata_.publish(message_of<std_msgs::String>(run_metadata(*run_, node_names_, chain_names_)));
  graph_.publish(graph_markers(*run_, nullptr, parameters_.frame));
  for (Event& event : pending_.take(run_->run_id())) handle(std::move(event));
}

void Bridge::advertise_points() {
  std::vector<Lidar> found;
  if (parameters_.points && !run_->topic_prefix().empty()) found = lidars(*run_);
  std::vector<std::string> names, dds_topics;
  tf2_msgs::TFMessage transforms;
  for (const Lidar& lidar : found) {
    names.push_back(node_names_[lidar.node]);
    dds_topics.push_back(run_->topic_prefix() + lidar.topic);
    const geometry_msgs::Point place = scan_position(run_->nodes()[lidar.node]);
    geometry_msgs::TransformStamped& transform = transforms.transforms.emplace_back();
    transform.header = header(run_->epoch_ns(), parameters_.frame);
    transform.child_frame_id = parameters_.frame + "/" + names.back();
    transform.transform.translation = at<geometry_msgs::Vector3>(place.x, place.y, place.z);
    transform.transform.rotation.w = 1;
  }
  points_.clear();
  for (ros::Publisher& publisher :
       advertise_all<sensor_msgs::PointCloud2>(points_topics_, "hotpath/points/", names)) {
    const std::string& frame = transforms.transforms[points_.size()].child_frame_id;
    points_.push_back({std::move(publisher), frame});
  }
  if (!found.empty()) {
    if (!transforms_) transforms_ = advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
    transforms_.publish(transforms);
  }
  input_.read_points(dds_topics);
}

void Bridge::show(const telemetry::Statistics& statistics) {
  if (statistics.nodes().size() != run_->nodes().size() ||
      statistics.chains().size() != run_->chains().size()) {
    ++counts_.malformed;
    return;
  }
  if (next_statistics_ && statistics.number() > *next_statistics_) {
    counts_.lost += statistics.number() - *next_statistics_;
  }
  next_statistics_ = statistics.number() + 1;
  not_published_ = statistics.samples_lost();
  for (std::size_t i = 0; i < response_times_.size(); ++i) {
    const std::int64_t mean = statistics.nodes()[i].response_window_ns();
    if (mean >= 0) response_times_[i].publish(milliseconds_message(mean));
  }
  graph_.publish(graph_markers(*run_, &statistics, parameters_.frame));
  // The last statistics of a run stay visible.
  if (statistics_shown_++ % kDiagnosticsEvery == 0 || statistics.last()) diagnose(statistics);
}

void Bridge::show(const telemetry::ChainSample& sample) {
  if (sample.chain() >= latencies_.size()) {
    ++counts_.malformed;
    return;
  }
  std::optional<std::uint64_t>& next = next_samples_[sample.chain()];
  if (!next) counts_.before_first += sample.number();
  if (next && sample.number() > *next) counts_.lost += sample.number() - *next;
  next = sample.number() + 1;
  latencies_[sample.chain()].publish(milliseconds_message(sample.hot_path_latency_ns()));
}

void Bridge::show(const telemetry::Clock& clock) {
  if (!parameters_.clock) return;
  if (!clock_) clock_ = advertise<rosgraph_msgs::Clock>("/clock");
  bool followed = false;
  if (!std::exchange(clock_known_, true) && !(ros::param::get("/use_sim_time", followed) && followed)) {
    ROS_INFO_STREAM(
        "a replay drives /clock: to follow it, run `rosparam set use_sim_time true`, then start nodes");
  }
  rosgraph_msgs::Clock message;
  message.clock = to_time(clock.time_ns());
  clock_.publish(message);
}

void Bridge::show(const LidarSample& sample) {
  if (sample.topic >= points_.size()) return;
  const Points& points = points_[sample.topic];
  points.publisher.publish(stand_in_scan(sample, points.frame));
}

void Bridge::diagnose(const telemetry::Statistics& statistics) {
  std::vector<diagnostic_msgs::DiagnosticStatus> statuses;
  const telemetry::Statistics& before = diagnosed_ ? *diagnosed_ : statistics;
  const double seconds = statistics.run_time_s() - before.run_time_s();
  for (std::size_t i = 0; i < run_->nodes().size(); ++i) {
    statuses.push_back(node_health(name_ + ": " + run_->nodes()[i].name(), before.nodes()[i],
                                   statistics.nodes()[i], seconds));
    statuses.back().hardware_id = run_->graph() + ", " + run_->executor();
  }
  publish_status(statistics.stamp_ns(), statuses);
  diagnosed_ = statistics;
}

void Bridge::publish_status(std::int64_t stamp_ns,
                            const std::vector<diagnostic_msgs::DiagnosticStatus>& statuses) {
  diagnostic_msgs::DiagnosticArray message;
  message.header = header(stamp_ns, "");
  message.status = statuses;
  diagnostics_.publish(message);
}

void Bridge::tick(Clock::time_point now) {
  constexpr std::chrono::seconds kPatience{5};
  pending_.forget(now - kPatience);
  refusal_known_ = false;
  for (const std::string& complaint : input_.take_complaints()) ROS_ERROR_STREAM(complaint);
  report_partners();
  publish_status(now_ns(), {own_health()});
}

void Bridge::report_partners() {
  const std::string domain = "DDS domain " + std::to_string(parameters_.telemetry.domain);
  const std::int32_t benchmarks = input_.benchmarks();
  if (benchmarks == 0 && benchmarks_ != 0) {
    ROS_INFO_STREAM((benchmarks_ > 0 ? "the benchmark has gone; " : "")
                    << "waiting for a benchmark (`hotpath run --live`) in " << domain);
  }
  benchmarks_ = benchmarks;
  if (pending_.forgotten() != other_run_reported_ && !other_run_known_) {
    ROS_WARN_STREAM("ignored samples in "
                    << domain
                    << " that belong to another run than the last one started: give each benchmark and its "
                       "bridge their own domain (--domain)");
    other_run_known_ = true;
  }
  other_run_reported_ = pending_.forgotten();
}

diagnostic_msgs::DiagnosticStatus Bridge::own_health() {
  using Status = diagnostic_msgs::DiagnosticStatus;
  Status health;
  health.name = name_ + ": bridge";
  health.hardware_id = "DDS domain " + std::to_string(parameters_.telemetry.domain);
  health.message = benchmarks_ > 0 && run_ ? "showing " + run_->graph() + ", " + run_->executor()
                                           : "waiting for a benchmark (`hotpath run --live`)";
  const auto value = [&](const std::string& key, std::uint64_t number) {
    add_value(health, key, std::to_string(number));
  };
  std::uint64_t losses = counts_.lost + counts_.malformed;
  for (std::size_t stream = 0; stream < kStreams.size(); ++stream) {
    const TelemetryInput::Counts counts = input_.counts(stream);
    value(std::string(kStreams[stream]) + " received", counts.received);
    value(std::string(kStreams[stream]) + " dropped, queue full", counts.dropped);
    losses += counts.dropped;
  }
  value("runs", counts_.runs);
  value("samples before the first", counts_.before_first);
  value("lost on the way", counts_.lost);
  value("chain samples not published by the benchmark", not_published_);
  value("samples of another run", pending_.forgotten());
  value("malformed", counts_.malformed);

  if (losses > losses_reported_) {
    health.level = Status::WARN;
    health.message = std::to_string(losses - losses_reported_) + " samples lost in the last second";
  }
  losses_reported_ = losses;
  return health;
}

}  // namespace hotpath
