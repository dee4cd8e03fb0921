// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <unordered_map>

#include "import/recorded_graph.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

using tracing::Endpoint, tracing::kNone;
using Order = std::vector<std::uint32_t>;  // callbacks

/// Fewer irregular samples are taken for single events that do not recur.
constexpr std::size_t kFewestRecurring = 10;
/// The most timers for one topic.
constexpr std::size_t kMostTimers = 100;
/// Samples are regular if their distances differ from the mean by less than this share.
constexpr double kRegular = 0.1;
/// Period of a timer that fires once.
constexpr Duration kOnce = std::chrono::hours(1);

bool is_regular(const std::vector<Time>& at, Duration mean) {
  if (at.size() < 3) return false;
  const auto differs = [&](Time a, Time b) {
    return to_ms(std::chrono::abs(b - a - mean)) > kRegular * to_ms(mean);
  };
  return std::ranges::adjacent_find(at, differs) == at.end();
}

/// Whether the arrivals go on: they fill half of the recording, or enough of them last until its end.
bool go_on(const std::vector<Time>& at, Duration mean, Time begin, Time end) {
  return 2 * std::ssize(at) * mean >= end - begin ||
         (at.size() >= kFewestRecurring && end - at.back() <= 2 * mean);
}

std::string in_ms(Duration time) { return program::concat(program::fixed(to_ms(time), 1), " ms"); }

/// Timers that take turns so that the period of each exceeds the largest deviation of an arrival from
/// the mean distance; none if that takes too many.
OutsideReleases with_jitter(const std::vector<Time>& at, Duration mean) {
  std::vector<Time> due;  // the first timestamp of a timer of the mean period, if this sample is on time
  for (std::size_t i = 0; i < at.size(); ++i) due.push_back(at[i] - mean * static_cast<std::int64_t>(i));
  const auto [earliest, latest] = std::ranges::minmax(due);
  const std::int64_t timers = (latest - earliest) / mean + 1;
  if (timers > static_cast<std::int64_t>(kMostTimers)) return {};
  OutsideReleases releases{{}, timers * mean, latest - earliest, {}};
  for (std::int64_t i = 0; i < timers; ++i) releases.first.push_back(earliest + i * mean);
  releases.timers = program::concat(timers == 1 ? "a timer" : program::concat(timers, " timers"), " of ",
                                    in_ms(releases.period), " with a release jitter of ",
                                    in_ms(releases.jitter), ", which covers all ", at.size(), " arrivals");
  return releases;
}

constexpr std::uint32_t kFastDds = 0x010f;
/// Topics named in a sentence; the others are counted.
constexpr std::size_t kNamed = 3;

/// A publisher, and the readers in the order in which it serves them.
struct Writer {
  std::uint32_t topic;
  std::uint64_t publications;
  Order readers;
  DeliverySource source = DeliverySource::creation;
};

/// The publishers of a process, and the readers of the same process that they serve.
std::vector<Writer> writers_of(const tracing::System& system, std::uint32_t process) {
  struct Reader {
    std::uint32_t topic, callback;
  };
  std::unordered_map<std::size_t, Reader> readers{1};  // as that of Fast DDS
  std::vector<Writer> writers;
  bool complete = true;    // A gap is an endpoint of which the trace has no event.
  std::uint32_t next = 0;  // number of the next endpoint; 0: unknown
  for (const Endpoint& endpoint : system.endpoints) {
    if (endpoint.process != process) continue;
    const bool writes = endpoint.kind == Endpoint::Kind::publisher;
    const bool with_id = writes || endpoint.kind == Endpoint::Kind::subscription;
    if (with_id) {
      const bool follows = next == 0 || endpoint.id.number() == next;
      complete = complete && endpoint.id.vendor() == kFastDds && follows;
      next = endpoint.id.number();
    }
    if (!writes) {
      // Without ids the numbers only have to differ.
      readers.emplace(complete ? next : (std::size_t{1} << 32) + readers.size(),
                      Reader{endpoint.topic, endpoint.callback});
      for (Writer& writer : writers)
        if (writer.topic == endpoint.topic && endpoint.callback != kNone)
          writer.readers.push_back(endpoint.callback);
    } else if (endpoint.topic != kNone) {
      Writer& writer = writers.emplace_back(Writer{endpoint.topic, endpoint.publications, {}});
      for (const auto& [number, reader] : readers)
        if (reader.topic == endpoint.topic && reader.callback != kNone)
          writer.readers.push_back(reader.callback);
      if (writer.readers.size() > 1) writer.source = complete ? DeliverySource::ids : DeliverySource::unknown;
    }
    // rmw_fastrtps creates the reader of a service or a client before its writer.
    next += with_id ? 1 : 2;
  }
  return writers;
}

/// The order for all publishers of a topic: that of the one with the most messages. Readers in other
/// processes follow; several of them have no known order.
RecordedDelivery delivery_of(Order subscriptions, const std::vector<const Writer*>& writers) {
  RecordedDelivery delivery{.subscriptions = std::move(subscriptions)};
  if (writers.empty()) return delivery;
  const Writer& most =
      **std::ranges::max_element(writers, {}, [](const Writer* w) { return w->publications; });
  Order order = most.readers;
  for (const std::uint32_t c : delivery.subscriptions)
    if (std::ranges::count(order, c) == 0) order.push_back(c);
  if (order.size() <= most.readers.size() + 1) delivery.source = most.source;
  delivery.subscriptions = std::move(order);
  delivery.one_order =
      std::ranges::all_of(writers, [&](const Writer* w) { return w->readers == most.readers; });
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
    const tracing::JobRef& parent = job.sample.parent;
    if (topic != topic_of.end() && job.has_sample && parent.callback != kNone)
      readers[{parent.callback, parent.number, topic->second}].push_back(job.ref.callback);
  }
  std::map<std::uint32_t, std::map<Order, std::uint64_t>> orders;
  for (const auto& [message, order] : readers) {
    const std::uint32_t topic = std::get<2>(message);
    const auto executor = [&](std::uint32_t c) { return executor_of[c]; };
    const bool whole = order.size() == deliveries.at(topic).subscriptions.size();
    const bool together = std::ranges::count(order, executor(order.front()), executor) == std::ssize(order);
    if (whole && together) ++orders[topic][order];
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

OutsideReleases outside_releases(const std::vector<Time>& at, Time begin, Time end) {
  const auto n = static_cast<std::int64_t>(at.size());
  const Duration mean = std::max(Duration(1000), (at.back() - at.front()) / std::max<std::int64_t>(1, n - 1));
  const bool goes_on = go_on(at, mean, begin, end);
  if (goes_on && is_regular(at, mean))
    return {{at.front()}, mean, {}, program::concat("a timer of ", in_ms(mean))};
  if (at.size() < kFewestRecurring)
    return {
        at, kOnce, {}, program::concat(n, n == 1 ? " timer" : " timers", " for one release, at its arrival")};
  if (at.size() <= kMostTimers) {
    const Duration period = std::max(n * mean, end - begin);
    return {at, period, {}, program::concat(n, " timers of ", in_ms(period), ", one for each arrival")};
  }
  OutsideReleases releases = goes_on ? with_jitter(at, mean) : OutsideReleases{};
  if (!releases.first.empty()) return releases;
  const Duration rate = goes_on ? mean : std::max(mean, (end - begin) / n);
  return {{at.front()},
          rate,
          {},
          program::concat("a timer of ", in_ms(rate), ", without the bursts of arrivals")};
}

RecordedDeliveries created_deliveries(const tracing::System& system) {
  std::map<std::uint32_t, std::vector<Writer>> all;  // by process
  for (const Endpoint& endpoint : system.endpoints)
    if (!all.contains(endpoint.process)) all[endpoint.process] = writers_of(system, endpoint.process);
  RecordedDeliveries deliveries;
  for (std::uint32_t topic = 0; topic < system.topics.size(); ++topic) {
    Order subscriptions;
    for (const std::uint32_t c : system.topics[topic].subscriptions)
      if (system.callbacks[c].samples + system.callbacks[c].jobs > 0) subscriptions.push_back(c);
    if (subscriptions.size() < 2 || is_housekeeping(system.topics[topic].name)) continue;
    std::vector<const Writer*> writers;
    for (const auto& [process, of_process] : all)
      for (const Writer& writer : of_process)
        if (writer.topic == topic && writer.publications > 0) writers.push_back(&writer);
    deliveries[topic] = delivery_of(std::move(subscriptions), writers);
  }
  return deliveries;
}

bool add_started_deliveries(RecordedDeliveries& deliveries, std::span<const tracing::Job> jobs, Family family,
                            const std::vector<std::uint32_t>& executor_of) {
  bool more = false;
  if (family != Family::events) return more;
  for (const auto& [topic, orders] : started_orders(jobs, executor_of, deliveries)) {
    RecordedDelivery& delivery = deliveries.at(topic);
    const auto& [order, messages] =
        *std::ranges::max_element(orders, {}, [](const auto& o) { return o.second; });
    for (const auto& [other, count] : orders) delivery.messages += count;
    if (delivery.source == DeliverySource::unknown && 2 * messages > delivery.messages) {
      more = true;
      delivery.subscriptions = order;
      delivery.source = DeliverySource::starts;
    }
    const auto agreeing = orders.find(delivery.subscriptions);
    if (agreeing != orders.end()) delivery.agreeing = agreeing->second;
  }
  return more;
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

}  // namespace hotpath::imports
