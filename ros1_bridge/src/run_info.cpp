// SPDX-License-Identifier: Apache-2.0
#include "run_info.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "event.hpp"
#include "text.hpp"

namespace hotpath {

namespace {

/// The limit that the run exceeds, as a sentence; empty: none. The largest runs of tools/load.py
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

using Json = nlohmann::ordered_json;

namespace {

/// Rejects values nested deeper than any value of run.json: they could overflow the stack of a
/// reader or writer.
bool is_shallow(int depth, nlohmann::json::parse_event_t, const nlohmann::json&) {
  constexpr int kMost = 64;
  return depth <= kMost;
}

}  // namespace

std::string run_metadata(const telemetry::RunInfo& run, const std::vector<std::string>& node_names,
                         const std::vector<std::string>& chain_names) {
  Json json = {
      {"run_id", run.run_id()},         {"graph", run.graph()},         {"executor", run.executor()},
      {"repetition", run.repetition()}, {"transport", run.transport()}, {"topic_prefix", run.topic_prefix()},
      {"origin", run.origin()},         {"epoch_ns", run.epoch_ns()},   {"speed", run.speed()},
      {"nodes", Json::array()},         {"edges", Json::array()},       {"chains", Json::array()},
  };
  for (std::size_t i = 0; i < run.nodes().size(); ++i) {
    const telemetry::NodeInfo& node = run.nodes()[i];
    json["nodes"].push_back({{"name", node.name()},
                             {"ros_name", node_names[i]},
                             {"type", node.type()},
                             {"hot", node.hot()},
                             {"deadline_ns", node.deadline_ns()}});
  }
  for (const telemetry::EdgeInfo& edge : run.edges()) {
    json["edges"].push_back({{"source", run.nodes()[edge.source()].name()},
                             {"target", run.nodes()[edge.target()].name()},
                             {"topic", edge.topic()},
                             {"hot", edge.hot()}});
  }
  for (std::size_t c = 0; c < run.chains().size(); ++c) {
    json["chains"].push_back({{"name", run.chains()[c].name()},
                              {"ros_name", chain_names[c]},
                              {"sink", run.nodes()[run.chains()[c].sink()].name()}});
  }
  // Not ordered_json: its key lookup is linear.
  const auto facts = nlohmann::json::parse(run.facts(), is_shallow, false);
  json["facts"] = facts.is_discarded() ? Json(run.facts()) : Json(facts);
  // A name may hold any bytes, including invalid UTF-8.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace hotpath
