// SPDX-License-Identifier: Apache-2.0
#include "event.hpp"

namespace hotpath {

namespace {

/// Bytes of texts and sequences.
std::size_t beyond(const telemetry::RunInfo& run) {
  std::size_t bytes = run.run_id().size() + run.graph().size() + run.executor().size() +
                      run.transport().size() + run.topic_prefix().size() + run.origin().size() +
                      run.facts().size();
  for (const auto& node : run.nodes()) bytes += sizeof node + node.name().size() + node.type().size();
  for (const auto& edge : run.edges()) bytes += sizeof edge + edge.topic().size();
  for (const auto& chain : run.chains()) bytes += sizeof chain + chain.name().size();
  return bytes;
}
std::size_t beyond(const telemetry::Statistics& s) {
  return s.run_id().size() + s.nodes().size() * sizeof(telemetry::NodeStatistics) +
         s.chains().size() * sizeof(telemetry::ChainStatistics);
}
std::size_t beyond(const telemetry::ChainSample& s) { return s.run_id().size(); }
std::size_t beyond(const telemetry::Clock& s) { return s.run_id().size(); }
std::size_t beyond(const LidarSample&) { return 0; }

}  // namespace

std::size_t bytes_of(const Event& event) {
  return sizeof event + std::visit([](const auto& sample) { return beyond(sample); }, event);
}

std::string run_of(const Event& event) {
  return std::visit(
      [](const auto& sample) -> std::string {
        if constexpr (requires { sample.run_id(); }) return sample.run_id();
        return "";
      },
      event);
}

}  // namespace hotpath
