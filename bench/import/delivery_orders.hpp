// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/core/registry.hpp"
#include "hotpath/tracing/system.hpp"
#include "import/recorded_graph.hpp"

namespace hotpath::imports {

/// How an order of delivery is known.
enum class DeliverySource : std::uint8_t {
  unknown,
  creation,  ///< All subscriptions were created after the publishers, which DDS matches in that order.
  ids,       ///< From the ids of Fast DDS's endpoints.
  starts,    ///< An executor that queues samples in the order of arrival ran them in this order.
};
constexpr auto enum_texts(DeliverySource) {
  return texts_in_order<DeliverySource>({"unknown", "creation", "ids", "starts"});
}

/// The order in which samples of one topic reach its subscriptions, as far as a trace shows it.
struct RecordedDelivery {
  DeliverySource source = DeliverySource::unknown;
  std::vector<std::uint32_t> subscriptions;  ///< Callbacks, the first one reached first.
  bool one_order = true;                     ///< All publishers have this order.
  std::uint64_t messages = 0;                ///< Messages whose readers show their order by their starts.
  std::uint64_t agreeing = 0;                ///< Of these: messages that agree with `subscriptions`.
};

/// By topic of the trace; topics with several subscriptions only.
using RecordedDeliveries = std::map<std::uint32_t, RecordedDelivery>;

/// The orders that follow from the creation of endpoints. A writer of Fast DDS serves the readers of its
/// process in the order of matching: first those that existed before it, as they stand in the participant's
/// std::unordered_map, keyed by the ids of the endpoints (Fast DDS 2.9 and 2.14, ProxyHashTables.hpp,
/// EDP.cpp, StatefulWriter.cpp), then the others as they were created. For other middleware, or without ids,
/// no order follows if some readers existed before the writer, nor for several readers in other processes.
[[nodiscard]] RecordedDeliveries created_deliveries(const tracing::System& system);

/// Compares the orders with the starts of sorted `jobs`, if an executor of this family starts readers in the
/// order of arrival; unknown ones become that of most messages. The second value: whether one became known.
[[nodiscard]] std::pair<RecordedDeliveries, bool> with_started_deliveries(
    RecordedDeliveries deliveries, std::span<const tracing::Job> jobs, Family family,
    const std::vector<std::uint32_t>& executor_of);

/// The orders for the graph's topics; unknown orders are entries, too.
[[nodiscard]] std::map<std::string, DeliveryOrder> delivery_of_graph(const RecordedDeliveries& deliveries,
                                                                     const RecordedGraph& graph);

/// Sentences about orders that are unknown or that not all messages have.
[[nodiscard]] std::vector<std::string> delivery_notes(const tracing::System& system,
                                                      const RecordedDeliveries& deliveries);

}  // namespace hotpath::imports
