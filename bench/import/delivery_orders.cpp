// SPDX-License-Identifier: Apache-2.0
#include "import/delivery_orders.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <unordered_map>

#include "program/text.hpp"

namespace hotpath::imports {

namespace {

using tracing::Endpoint, tracing::kNone;
using Order = std::vector<std::uint32_t>;  // callbacks

constexpr std::uint32_t kFastDds = 0x010f;
/// Topics named in a sentence; the others are counted.
constexpr std::size_t kNamed = 3;

/// The readers of one process, and the order in which each of its publishers serves them.
class Matching {
 public:
  struct Writer {
    std::uint32_t topic;
    std::uint64_t publications;
    Order readers;
    DeliverySource source;
  };

  void add(const Endpoint& endpoint) {
    const bool writer = endpoint.kind == Endpoint::Kind::publisher;
    const bool with_id = writer || endpoint.kind == Endpoint::Kind::subscription;
    if (with_id) {
      // A gap: an endpoint of which the trace has no event.
      complete_ =
          complete_ && endpoint.id.vendor() == kFastDds && (next_ == 0 || endpoint.id.number() == next_);
      next_ = endpoint.id.number();
    }
    writer ? add_writer(endpoint) : add_reader(endpoint);
    // rmw_fastrtps creates the reader of a service or a client before its writer.
    next_ += with_id ? 1 : 2;
  }

  [[nodiscard]] const std::vector<Writer>& writers() const { return writers_; }

 private:
  struct Reader {
    std::uint32_t topic, callback;
  };

  void add_writer(const Endpoint& endpoint) {
    if (endpoint.topic == kNone) return;
    Writer writer{endpoint.topic, endpoint.publications, {}, DeliverySource::creation};
    for (const auto& [number, reader] : readers_)
      if (reader.topic == endpoint.topic && reader.callback != kNone)
        writer.readers.push_back(reader.callback);
    if (writer.readers.size() > 1) writer.source = complete_ ? DeliverySource::ids : DeliverySource::unknown;
    writers_.push_back(std::move(writer));
  }

  void add_reader(const Endpoint& endpoint) {
    // Without ids the numbers only have to differ.
    readers_.emplace(complete_ ? next_ : (std::size_t{1} << 32) + readers_.size(),
                     Reader{endpoint.topic, endpoint.callback});
    if (endpoint.callback == kNone) return;
    for (Writer& writer : writers_)
      if (writer.topic == endpoint.topic) writer.readers.push_back(endpoint.callback);
  }

  bool complete_ = true;
  std::uint32_t next_ = 0;  // number of the next endpoint; 0: unknown
  std::unordered_map<std::size_t, Reader> readers_{1};
  std::vector<Writer> writers_;
};

/// The order for all publishers of a topic: that of the one with the most messages. Readers in other
/// processes follow; several of them have no known order.
RecordedDelivery delivery_of(const Order& subscriptions,
                             const std::vector<const Matching::Writer*>& writers) {
  RecordedDelivery delivery;
  delivery.subscriptions = subscriptions;
  if (writers.empty()) return delivery;
  const Matching::Writer& most =
      **std::ranges::max_element(writers, {}, [](const auto* w) { return w->publications; });
  Order order = most.readers;
  for (const std::uint32_t c : subscriptions)
    if (std::ranges::count(order, c) == 0) order.push_back(c);
  const bool known = order.size() <= most.readers.size() + 1;
  delivery.subscriptions = std::move(order);
  delivery.source = known ? most.source : DeliverySource::unknown;
  delivery.one_order =
      std::ranges::all_of(writers, [&](const auto* w) { return w->readers == most.readers; });
  return delivery;
}

/// The readers of each message in the order of their starts, by topic and order.
std::map<std::uint32_t, std::map<Order, std::uint64_t>> started_orders(
    std::span<const tracing::Job> jobs, const std::vector<std::uint32_t>& executor_of,
    const RecordedDeliveries& deliveries) {
  std::unordered_map<std::uint32_t, std::uint32_t> topic_of;  // by subscription
  for (const auto& [topic, delivery] : deliveries)
    for (const std::uint32_t c : delivery.subscriptions) topic_of[c] = topic;
  std::map<std::tuple<std::uint32_t, std::uint64_t, std::uint32_t>, Order> readers;  // by job and topic
  for (const tracing::Job& job : jobs) {
    const auto topic = topic_of.find(job.ref.callback);
    if (topic == topic_of.end() || !job.has_sample || job.sample.parent.callback == kNone) continue;
    readers[{job.sample.parent.callback, job.sample.parent.number, topic->second}].push_back(
        job.ref.callback);
  }
  std::map<std::uint32_t, std::map<Order, std::uint64_t>> orders;
  for (auto& [message, order] : readers) {
    const std::uint32_t topic = std::get<2>(message);
    const auto executor = [&](std::uint32_t c) { return executor_of[c]; };
    const bool whole = order.size() == deliveries.at(topic).subscriptions.size();
    const bool together = std::ranges::count(order, executor(order.front()), executor) == std::ssize(order);
    if (whole && together) ++orders[topic][std::move(order)];
  }
  return orders;
}

std::string named(std::vector<std::string> topics) {
  const std::size_t more = topics.size() - std::min(kNamed, topics.size());
  topics.resize(topics.size() - more);
  const std::string text = program::joined(topics, ", ");
  return more > 0 ? program::concat(text, " and ", more, " more") : text;
}

}  // namespace

RecordedDeliveries created_deliveries(const tracing::System& system) {
  std::map<std::uint32_t, Matching> processes;
  for (const Endpoint& endpoint : system.endpoints) processes[endpoint.process].add(endpoint);
  RecordedDeliveries deliveries;
  for (std::uint32_t topic = 0; topic < system.topics.size(); ++topic) {
    Order subscriptions;
    for (const std::uint32_t c : system.topics[topic].subscriptions)
      if (system.callbacks[c].samples + system.callbacks[c].jobs > 0) subscriptions.push_back(c);
    if (subscriptions.size() < 2 || is_housekeeping(system.topics[topic].name)) continue;
    std::vector<const Matching::Writer*> writers;
    for (const auto& [process, matching] : processes)
      for (const Matching::Writer& writer : matching.writers())
        if (writer.topic == topic && writer.publications > 0) writers.push_back(&writer);
    deliveries[topic] = delivery_of(subscriptions, writers);
  }
  return deliveries;
}

bool add_started_deliveries(std::span<const tracing::Job> jobs, Family family,
                            const std::vector<std::uint32_t>& executor_of, RecordedDeliveries& deliveries) {
  if (family != Family::events) return false;
  bool changed = false;
  for (const auto& [topic, orders] : started_orders(jobs, executor_of, deliveries)) {
    RecordedDelivery& delivery = deliveries.at(topic);
    const auto& [order, messages] =
        *std::ranges::max_element(orders, {}, [](const auto& o) { return o.second; });
    for (const auto& [other, count] : orders) delivery.messages += count;
    if (delivery.source == DeliverySource::unknown && 2 * messages > delivery.messages) {
      changed = true;
      delivery.subscriptions = order;
      delivery.source = DeliverySource::starts;
    }
    const auto agreeing = orders.find(delivery.subscriptions);
    delivery.agreeing = agreeing == orders.end() ? 0 : agreeing->second;
  }
  return changed;
}

std::map<std::string, DeliveryOrder> delivery_of_graph(const RecordedDeliveries& deliveries,
                                                       const RecordedGraph& graph) {
  std::map<std::string, DeliveryOrder> orders;
  for (const auto& [topic, delivery] : deliveries) {
    std::map<std::string, DeliveryOrder> of_topic;  // and of its copies
    for (const std::uint32_t c : delivery.subscriptions) {
      const TaskId id = graph.task_of[c];
      if (id == kNoTask) continue;
      const Node& node = graph.graph.nodes[graph.tasks.origin[id].node];
      of_topic[node.inputs[*graph.tasks.origin[id].input].topic].nodes.push_back(node.name);
    }
    for (auto& [name, order] : of_topic) {
      for (std::string& node : subscribers_of(graph.graph, name))
        if (std::ranges::count(order.nodes, node) == 0) order.nodes.push_back(std::move(node));
      if (order.nodes.size() < 2) continue;
      if (delivery.source == DeliverySource::unknown) order.nodes.clear();
      orders[name] = std::move(order);
    }
  }
  return orders;
}

std::vector<std::string> delivery_notes(const tracing::System& system, const RecordedDeliveries& deliveries) {
  std::vector<std::string> unknown, several, other;
  for (const auto& [topic, delivery] : deliveries) {
    const std::string& name = system.topics[topic].name;
    if (delivery.source == DeliverySource::unknown) unknown.push_back(name);
    if (!delivery.one_order) several.push_back(name);
    if (delivery.agreeing < delivery.messages) {
      other.push_back(
          program::concat(name, " (", delivery.messages - delivery.agreeing, " of ", delivery.messages, ")"));
    }
  }
  std::vector<std::string> notes;
  const auto note = [&](const std::vector<std::string>& topics, const char* text, const char* end) {
    if (!topics.empty()) notes.push_back(program::concat(text, named(topics), end));
  };
  note(unknown,
       "The order in which samples reach subscribers is not known, and simulations use the order of "
       "creation: ",
       ".");
  note(several,
       "Publishers of one topic reach its subscribers in different orders; the graph has the order of the "
       "publisher with the most messages: ",
       ".");
  note(other,
       "Not all messages were read in the graph's order of delivery: ", ". Another executor may have run.");
  return notes;
}

nlohmann::json deliveries_json(const tracing::System& system, const RecordedDeliveries& deliveries) {
  nlohmann::json all = nlohmann::json::array();
  for (const auto& [topic, delivery] : deliveries) {
    nlohmann::json nodes = nlohmann::json::array();
    for (const std::uint32_t c : delivery.subscriptions) {
      const std::uint32_t node = system.callbacks[c].node;
      nodes.push_back(node == kNone ? "?" : system.nodes[node]);
    }
    all.push_back({{"topic", system.topics[topic].name},
                   {"subscribers", std::move(nodes)},
                   {"source", to_string(delivery.source)},
                   {"messages", delivery.messages},
                   {"agreeing", delivery.agreeing}});
  }
  return all;
}

}  // namespace hotpath::imports
