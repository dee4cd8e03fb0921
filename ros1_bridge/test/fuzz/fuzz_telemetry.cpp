// SPDX-License-Identifier: Apache-2.0
// Fuzzes telemetry payloads as received from the network, whose first byte selects the type, and
// the conversion of a run and its statistics.
#include <TelemetryPubSubTypes.h>

#include <algorithm>
#include <optional>

#include "graph_markers.hpp"
#include "hotpath/fastdds/guarded_type.hpp"
#include "lidar.hpp"
#include "names.hpp"
#include "node_health.hpp"
#include "run_info.hpp"

namespace {

using namespace hotpath;
using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;

template <class PubSubType>
std::optional<typename PubSubType::type> read(Payload& payload) {
  GuardedType<PubSubType> type;
  typename PubSubType::type sample;
  if (!type.deserialize(&payload, &sample)) return std::nullopt;
  return sample;
}

void show_run(Payload& payload) {
  auto run = read<telemetry::RunInfoPubSubType>(payload);
  if (!run || !run_defect(*run).empty()) return;
  make_printable(*run);
  std::vector<std::string> nodes, chains;
  for (const auto& node : run->nodes()) nodes.push_back(node.name());
  for (const auto& chain : run->chains()) chains.push_back(chain.name());
  static_cast<void>(run_metadata(*run, ros_names(nodes).names, ros_names(chains).names));
  for (const Lidar& lidar : lidars(*run)) static_cast<void>(scan_position(run->nodes()[lidar.node]));
  telemetry::Statistics statistics;
  statistics.nodes().resize(nodes.size());  // the bridge requires matching sizes
  statistics.chains().resize(chains.size());
  static_cast<void>(graph_markers(*run, &statistics, "hotpath"));
}

void show_statistics(Payload& payload) {
  const auto statistics = read<telemetry::StatisticsPubSubType>(payload);
  if (!statistics) return;
  const telemetry::NodeStatistics before;
  for (const auto& node : statistics->nodes()) {
    static_cast<void>(node_health("node", before, node, statistics->run_time_s()));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  Payload payload(static_cast<std::uint32_t>(size));
  payload.length = static_cast<std::uint32_t>(size - 1);
  std::copy_n(data + 1, size - 1, payload.data);
  switch (data[0] % 4) {
    case 0:
      show_run(payload);
      break;
    case 1:
      show_statistics(payload);
      break;
    case 2:
      read<telemetry::ChainSamplePubSubType>(payload);
      break;
    default:
      read<telemetry::ClockPubSubType>(payload);
  }
  return 0;
}
