// SPDX-License-Identifier: Apache-2.0
#include <chrono>

#include "bridge.hpp"
#include "text.hpp"

namespace hotpath {

using Severity = RosNode::Severity;

void Bridge::tick(Clock::time_point now) {
  constexpr std::chrono::seconds kPatience{5};
  pending_.forget(now - kPatience);
  refusal_known_ = false;
  for (const std::string& complaint : input_.take_complaints()) RosNode::log(Severity::error, complaint);
  report_partners();
  const auto stamp = std::chrono::system_clock::now().time_since_epoch();
  diagnostics_.publish({std::chrono::duration_cast<std::chrono::nanoseconds>(stamp).count(), {own_health()}});
}

void Bridge::report_partners() {
  const std::string domain = "DDS domain " + std::to_string(parameters_.telemetry.domain);
  const std::int32_t benchmarks = input_.benchmarks();
  if (benchmarks == 0 && benchmarks_ != 0) {
    RosNode::log(Severity::info, std::string(benchmarks_ > 0 ? "the benchmark has gone; " : "") +
                                     "waiting for a benchmark (`hotpath run --live`) in " + domain);
  }
  benchmarks_ = benchmarks;
  if (pending_.forgotten() != other_run_reported_ && !other_run_known_) {
    RosNode::log(Severity::warning,
                 "ignored samples in " + domain +
                     " that belong to another run than the last one started: give each benchmark and its "
                     "bridge their own domain (--domain)");
    other_run_known_ = true;
  }
  other_run_reported_ = pending_.forgotten();
}

Diagnosis Bridge::own_health() {
  Diagnosis health;
  health.name = node_.name().substr(1) + ": bridge";
  health.hardware_id = "DDS domain " + std::to_string(parameters_.telemetry.domain);
  health.message = benchmarks_ > 0 && run_ ? "showing " + run_->graph() + ", " + run_->executor()
                                           : "waiting for a benchmark (`hotpath run --live`)";
  const auto value = [&](const std::string& key, std::uint64_t number) {
    health.values.push_back({key, std::to_string(number)});
  };
  std::uint64_t losses = counts_.lost + counts_.malformed;
  for (std::size_t stream = 0; stream < kStreams.size(); ++stream) {
    const TelemetryInput::Counts counts = input_.counts(stream);
    value(std::string(kStreams[stream]) + " received", counts.received);
    value(std::string(kStreams[stream]) + " dropped, queue full", counts.dropped);
    losses += counts.dropped;
  }
  value("longest queue", input_.longest_queue());
  value("runs", counts_.runs);
  value("samples before the first", counts_.before_first);
  value("lost on the way", counts_.lost);
  value("chain samples not published by the benchmark", not_published_);
  value("samples of another run", pending_.forgotten());
  value("malformed", counts_.malformed);
  value("left out by ~graph_every", counts_.graph_left_out);
  value("left out by ~points_every", counts_.points_left_out);
  value("left out by ~diagnostics_every", counts_.diagnostics_left_out);

  if (losses > losses_reported_) {
    health.level = Diagnosis::Level::warn;
    health.message = std::to_string(losses - losses_reported_) + " samples lost in the last second";
  } else if (!unknown_chains_.empty()) {
    health.level = Diagnosis::Level::warn;
    health.message = "unknown in ~chains: " + unknown_chains_;
  }
  losses_reported_ = losses;
  return health;
}

}  // namespace hotpath
