// SPDX-License-Identifier: Apache-2.0
#include "run_metadata.hpp"

#include <nlohmann/json.hpp>

namespace hotpath {

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
