// SPDX-License-Identifier: Apache-2.0
#include "run_check.hpp"

#include <array>
#include <cmath>

#include "event.hpp"
#include "text.hpp"

namespace hotpath {

namespace {

/// The limit that the run exceeds, as a sentence; empty: none. The largest live runs of nightly.sh
/// have 10,000 nodes.
std::string excess(const telemetry::RunInfo& run) {
  struct Limit {
    const char* what;
    std::size_t is, most;
  };
  const std::array<Limit, 5> limits = {{
      {"nodes", run.nodes().size(), 20'000},
      {"edges", run.edges().size(), 200'000},
      {"chains", run.chains().size(), 20'000},
      {"bytes of facts", run.facts().size(), 16 << 20},
      {"bytes", bytes_of(run), 64 << 20},
  }};
  for (const auto& [what, is, most] : limits) {
    if (is > most) {
      return "it has " + std::to_string(is) + " " + what + ", and the bridge shows at most " +
             std::to_string(most);
    }
  }
  return "";
}

}  // namespace

std::string run_defect(const telemetry::RunInfo& run) {
  if (std::string defect = excess(run); !defect.empty()) return defect;
  constexpr double kFarthest = 1e6;
  for (const telemetry::NodeInfo& node : run.nodes()) {
    // Also rejects NaN, which is never less.
    if (!(std::abs(node.layout_x()) < kFarthest && std::abs(node.layout_y()) < kFarthest))
      return "node " + printable(node.name(), kMostOfName) + " has no place to draw it";
  }
  const std::size_t nodes = run.nodes().size();
  for (const telemetry::EdgeInfo& edge : run.edges()) {
    if (edge.source() >= nodes || edge.target() >= nodes)
      return "an edge of topic " + printable(edge.topic(), kMostOfName) + " has no node";
  }
  for (const telemetry::ChainInfo& chain : run.chains()) {
    if (chain.sink() >= nodes) return "chain " + printable(chain.name(), kMostOfName) + " has no sink";
  }
  return "";
}

void make_printable(telemetry::RunInfo& run) {
  const auto mend = [](std::string& text) { text = printable(text, kMostOfName); };
  for (std::string* text : {&run.graph(), &run.executor(), &run.transport(), &run.origin()}) mend(*text);
  for (telemetry::NodeInfo& node : run.nodes()) {
    mend(node.name());
    mend(node.type());
  }
  for (telemetry::ChainInfo& chain : run.chains()) mend(chain.name());
}

}  // namespace hotpath
