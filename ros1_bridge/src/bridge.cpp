// SPDX-License-Identifier: Apache-2.0
#include "bridge.hpp"

#include <algorithm>
#include <limits>
#include <string_view>
#include <type_traits>
#include <utility>

#include "graph_markers.hpp"
#include "lidar.hpp"
#include "names.hpp"
#include "node_health.hpp"
#include "run_check.hpp"
#include "run_metadata.hpp"
#include "text.hpp"

namespace hotpath {

namespace {

using Severity = RosNode::Severity;

double to_ms(std::int64_t ns) { return static_cast<double>(ns) / 1e6; }

template <class Items>
std::vector<std::string> names_of(const Items& items) {
  std::vector<std::string> names;
  for (const auto& item : items) names.push_back(item.name());
  return names;
}

std::vector<std::string> with_prefix(const std::string& prefix, const std::vector<std::string>& names) {
  std::vector<std::string> result;
  for (const std::string& name : names) result.push_back(prefix + name);
  return result;
}

std::vector<std::string> unique_names(const std::vector<std::string>& names, const std::string& what) {
  RosNames result = ros_names(names);
  if (!result.clashes.empty()) {
    RosNode::log(Severity::warning,
                 what + " with the same ROS name: " + printable(joined(result.clashes), kMostOfList) +
                     "; the later topic gets a numeric suffix, and hotpath/run maps the names");
  }
  return std::move(result.names);
}

}  // namespace

Bridge::Bridge(const RosNode& node, const Parameters& parameters, TelemetryInput& input)
    : node_(node),
      parameters_(parameters),
      input_(input),
      graph_("hotpath/graph", {parameters.ros_queue, true}),
      metadata_("hotpath/run", {1, true}),
      diagnostics_("/diagnostics", {parameters.ros_queue, false}) {
  for (const std::string& name :
       unique_names(parameters.telemetry.bytes_topics, "DDS topics of ~bytes_topics")) {
    bytes_.emplace_back("hotpath/bytes/" + name,
                        RosPublisher<ByteArray>::Options{parameters.bytes_ros_queue, false});
  }
}

void Bridge::handle(Event event) {
  if (auto* run = std::get_if<telemetry::RunInfo>(&event)) {
    begin(std::move(*run));
  } else if (of_this_run(event)) {
    std::visit(
        [this](auto& sample) {
          if constexpr (!std::is_same_v<std::decay_t<decltype(sample)>, telemetry::RunInfo>) show(sample);
        },
        event);
  } else {
    pending_.keep(std::move(event), Clock::now());
  }
}

void Bridge::begin(telemetry::RunInfo run) {
  if (run_ && run_->run_id() == run.run_id()) return;
  const std::string defect = run_defect(run);
  if (!defect.empty()) {
    ++counts_.malformed;
    // A foreign program may publish invalid runs at any rate: log at most one per second.
    if (!std::exchange(refusal_known_, true)) {
      RosNode::log(Severity::error,
                   "a run of graph " + printable(run.graph(), kMostOfName) + " cannot be shown: " + defect);
    }
    return;
  }
  make_printable(run);
  RosNode::log(Severity::info, "showing " + run.graph() + ", " + run.executor() + ", repetition " +
                                   std::to_string(run.repetition()) + " (" + run.origin() + ", " +
                                   run.transport() + ")");
  ++counts_.runs;
  run_ = std::move(run);
  diagnosed_.reset();
  statistics_shown_ = 0;
  next_statistics_.reset();
  not_published_ = 0;
  other_run_known_ = false;
  advertise();
  metadata_.publish({run_metadata(*run_, node_names_, chain_names_)});
  draw(nullptr);
  for (Event& event : pending_.take(run_->run_id())) handle(std::move(event));
}

void Bridge::advertise() {
  node_names_ = unique_names(names_of(run_->nodes()), "nodes");
  response_times_ = response_time_topics_.advertise(with_prefix("hotpath/response_time/", node_names_),
                                                    parameters_.ros_queue);
  advertise_chains();
  advertise_points();
}

void Bridge::advertise_chains() {
  const std::vector<std::string> all = names_of(run_->chains());
  chain_names_ = unique_names(all, "chains");
  std::vector<std::string> shown, unknown;
  for (std::size_t c = 0; c < all.size(); ++c) {
    const auto& wanted = parameters_.chains;
    if (wanted.empty() || std::find(wanted.begin(), wanted.end(), all[c]) != wanted.end()) {
      shown.push_back(chain_names_[c]);
    }
  }
  for (const std::string& name : parameters_.chains) {
    if (std::find(all.begin(), all.end(), name) == all.end()) unknown.push_back("`" + name + "`");
  }
  unknown_chains_ = printable(joined(unknown), kMostOfList);
  if (!unknown.empty()) {
    RosNode::log(Severity::error, "parameter ~chains names " + unknown_chains_ + ", which graph " +
                                      run_->graph() + " does not have; it has " +
                                      printable(joined(all), kMostOfList));
  }
  const auto latencies =
      latency_topics_.advertise(with_prefix("hotpath/latency/", shown), parameters_.ros_queue);
  const auto stamped =
      stamped_topics_.advertise(with_prefix("hotpath/latency_stamped/", shown), parameters_.ros_queue);
  chains_.assign(all.size(), {});
  for (std::size_t c = 0, s = 0; c < all.size(); ++c) {
    chains_[c].frame = chain_names_[c];
    if (s == shown.size() || shown[s] != chain_names_[c]) continue;
    chains_[c].latency = latencies[s];
    chains_[c].stamped = stamped[s];
    ++s;
  }
}

void Bridge::advertise_points() {
  std::vector<Lidar> found;
  if (parameters_.points && !run_->topic_prefix().empty()) found = lidars(*run_);
  std::vector<std::string> ros_topics, dds_topics;
  StaticTransforms transforms{run_->epoch_ns(), {}};
  point_frames_.clear();
  for (const Lidar& lidar : found) {
    const std::string& name = node_names_[lidar.node];
    dds_topics.push_back(run_->topic_prefix() + lidar.topic);
    ros_topics.push_back("hotpath/points/" + name);
    point_frames_.push_back(parameters_.frame + "/" + name);
    transforms.all.push_back(
        {parameters_.frame, point_frames_.back(), scan_position(run_->nodes()[lidar.node])});
  }
  scans_.assign(found.size(), 0);
  points_ = points_topics_.advertise(ros_topics, parameters_.ros_queue);
  if (!found.empty()) {
    if (!transforms_) transforms_ = RosPublisher<StaticTransforms>("/tf_static", {1, true});
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
    if (mean >= 0) response_times_[i].publish({to_ms(mean)});
  }
  // Always show the last statistics of a run: they stay visible.
  if (statistics.last() || statistics_shown_ % parameters_.graph_every == 0) {
    draw(&statistics);
  } else {
    ++counts_.graph_left_out;
  }
  if (statistics.last() || statistics_shown_ % parameters_.diagnostics_every == 0) {
    diagnose(statistics);
  } else {
    ++counts_.diagnostics_left_out;
  }
  ++statistics_shown_;
}

void Bridge::show(const telemetry::ChainSample& sample) {
  if (sample.chain() >= chains_.size()) {
    ++counts_.malformed;
    return;
  }
  Chain& chain = chains_[sample.chain()];
  if (!chain.next) counts_.before_first += sample.number();
  if (chain.next && sample.number() > *chain.next) counts_.lost += sample.number() - *chain.next;
  chain.next = sample.number() + 1;
  const double latency = to_ms(sample.hot_path_latency_ns());
  const double end_to_end = sample.end_to_end_latency_ns() < 0 ? std::numeric_limits<double>::quiet_NaN()
                                                               : to_ms(sample.end_to_end_latency_ns());
  chain.latency.publish({latency});
  chain.stamped.publish(
      {sample.stamp_ns(), chain.frame, {latency, end_to_end, static_cast<double>(sample.number())}});
}

void Bridge::show(const telemetry::Clock& clock) {
  if (!parameters_.clock) return;
  if (!clock_) clock_ = RosPublisher<ClockTime>("/clock", {parameters_.ros_queue, false});
  if (!clock_known_ && !RosNode::uses_simulated_time()) {
    RosNode::log(
        Severity::info,
        "a replay drives /clock: to follow it, run `rosparam set use_sim_time true`, then start nodes");
  }
  clock_known_ = true;
  clock_.publish({clock.time_ns()});
}

void Bridge::show(const LidarSample& sample) {
  if (sample.topic >= points_.size()) return;
  if (scans_[sample.topic]++ % parameters_.points_every != 0) {
    ++counts_.points_left_out;
    return;
  }
  points_[sample.topic].publish(stand_in_scan(sample, point_frames_[sample.topic]));
}

void Bridge::show(BytesSample& sample) { bytes_[sample.topic].publish({std::move(sample.data)}); }

void Bridge::draw(const telemetry::Statistics* statistics) {
  MarkerSet set = graph_markers(*run_, statistics, parameters_.frame);
  set.replaces_all = statistics == nullptr;
  graph_.publish(set);
}

void Bridge::diagnose(const telemetry::Statistics& statistics) {
  Diagnoses diagnoses{statistics.stamp_ns(), {}};
  const telemetry::Statistics& before = diagnosed_ ? *diagnosed_ : statistics;
  const double seconds = statistics.run_time_s() - before.run_time_s();
  for (std::size_t i = 0; i < run_->nodes().size(); ++i) {
    Diagnosis& diagnosis = diagnoses.all.emplace_back(
        node_health(node_.name().substr(1) + ": " + run_->nodes()[i].name(), before.nodes()[i],
                    statistics.nodes()[i], seconds, parameters_.limits));
    diagnosis.hardware_id = run_->graph() + ", " + run_->executor();
  }
  diagnostics_.publish(diagnoses);
  diagnosed_ = statistics;
}

bool Bridge::of_this_run(const Event& event) const {
  const std::string_view run = run_of(event);
  return run.empty() || (run_ && run == run_->run_id());
}

}  // namespace hotpath
