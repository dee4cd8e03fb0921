// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/core/registry.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/tracing/system.hpp"
#include "import/recorded_system.hpp"

namespace hotpath::imports {

[[nodiscard]] inline Callback& callback_of_task(Graph& graph, const TaskOrigin& origin) {
  return graph.nodes[origin.node].callbacks[origin.callback];
}

/// The sample above `percent` of all, which exist, without interpolation: other readers of a trace find the
/// same. Reorders them.
[[nodiscard]] auto ranked(auto& samples, std::size_t percent) {
  const auto at = samples.begin() + std::min(samples.size() - 1, samples.size() * percent / 100);
  std::ranges::nth_element(samples, at);
  return *at;
}

/// The rule by which callbacks of one node publish a topic, and how well it explains their jobs.
struct InferredRule {
  std::uint32_t topic = kNone;
  std::vector<std::uint32_t> publishers = {};  ///< Callbacks.
  PublishRule rule = PublishRule::always;
  std::vector<std::uint32_t> of = {};      ///< all_new, last_of: subscriptions of the node.
  std::uint32_t n = 1, first = 0;          ///< every: as in a graph.
  std::uint64_t jobs = 0;                  ///< Jobs of the node's callbacks.
  std::uint64_t explained = 0;             ///< Of these, jobs that follow the rule.
  std::vector<InferredRule> as_good = {};  ///< Other rules that explain as many jobs.
  std::uint64_t most_in_a_job = 1;         ///< Most messages of a job; a rule covers one.
};

/// The graph of a recorded system, with the mapping between tasks and callbacks of the trace.
struct RecordedGraph {
  Graph graph;  ///< Execution times, chains and platform are not filled in yet.
  GraphTasks tasks;
  std::vector<TaskId> task_of;             ///< By callback; kNoTask: not in the graph.
  std::vector<std::uint32_t> callback_of;  ///< By task; kNone: a timer for publications outside of callbacks.
  std::vector<InferredRule> rules;
  Time epoch{};     ///< Creation of the first timer: phases count from here.
  Remarks remarks;  ///< With those of the system.

  std::vector<std::string> node_names;                ///< As in the graph, by node of the trace.
  std::vector<std::vector<std::string>> topic_names;  ///< The same by topic, and then those of its copies.

  [[nodiscard]] TaskId task(const tracing::JobRef& ref) const {
    return ref.callback < task_of.size() ? task_of[ref.callback] : kNoTask;
  }
  [[nodiscard]] Callback& callback(TaskId id) { return callback_of_task(graph, tasks.origin[id]); }
};

/// The node whose timers publish what no recorded callback does.
inline constexpr const char* kOutside = "outside";

/// The order in which executors served nodes and callbacks; empty: the order of creation.
struct ServiceOrder {
  std::vector<std::uint32_t> nodes, callbacks;
};

/// What recognised executors show of a graph.
struct Shown {
  ServiceOrder order = {};
  std::map<std::uint32_t, std::int64_t> priorities = {};  ///< Of timers, by callback.
  bool other = false;                                     ///< The second reading of what is undecided.
};

/// Callbacks that overlapped, or whose executors differ, are in different callback groups. A task publishes
/// early if it usually does so in its jobs. Throws UsageError if no task is left for a graph.
[[nodiscard]] RecordedGraph make_recorded_graph(const RecordedSystem& recorded, const std::string& name,
                                                const Shown& shown = {});

/// Tries hypotheses on all jobs of every node: every job publishes, every n-th job, or the job that completes
/// a set of inputs with new samples. The one that explains most jobs wins; among equals the largest set of
/// inputs that publish nothing else, then the simplest one. An input that never completed a set, although it
/// ran far more often than messages were published, is in none. Subscriptions without a part in any rule are
/// assumed to be stored for the messages that the node's timers, or else its other callbacks, publish with
/// every job (last_of). `jobs` are in the order of starts. `other`: of equals, the second best.
[[nodiscard]] std::vector<InferredRule> infer_rules(const tracing::System& system,
                                                    std::span<const tracing::Job> jobs,
                                                    const std::vector<bool>& is_task, bool other = false);

/// When it publishes, as part of a sentence.
[[nodiscard]] std::string rule_text(const tracing::System& system, const InferredRule& rule);

/// The longest and most loaded chains whose data reaches their sinks and does not all come from outside of
/// the recorded callbacks: of the others no output can have been recorded.
[[nodiscard]] std::vector<Chain> recorded_chains_of(const Graph& graph, const GraphTasks& tasks);

/// By callback and topic: the median share of its jobs before their last message, if early.
using EarlyPublications = std::map<std::pair<std::uint32_t, std::uint32_t>, double>;
[[nodiscard]] EarlyPublications early_publications(std::span<const tracing::Job> jobs);

/// Whether every node has the topic, so that graphs leave it out: /rosout, /parameter_events.
[[nodiscard]] inline bool is_housekeeping(const std::string& topic) {
  return topic == "/rosout" || topic == "/parameter_events";
}

/// What a graph does not express, as sentences: synchronisers, and topics published by no rule.
[[nodiscard]] std::vector<std::string> unmodelled(const tracing::System& system, const RecordedGraph& graph);
/// By name: chains that contain a synchroniser, as sentences with the time for which it held messages.
[[nodiscard]] std::map<std::string, std::string> synchronised_chains(const RecordedSystem& recorded,
                                                                     const RecordedGraph& graph);

/// The chain of `--chain SOURCE,...:SINK`, from nodes or tasks, with all tasks between them. Throws
/// UsageError if there is no such chain.
[[nodiscard]] Chain chain_of(const std::string& text, const Graph& graph, const GraphTasks& tasks);

/// Timers that together release the samples of a topic that no recorded callback published.
struct OutsideReleases {
  std::vector<Time> first;      ///< By timer: its first timestamp.
  Duration period{}, jitter{};  ///< Of each of them; jitter < period.
  std::string timers;           ///< Names them in a sentence.
};

/// Regular samples that go on have one timer. A few others are repeated once, more of them recur in the
/// recorded order, and of very many the timers' jitter covers the arrivals. `at`: ascending, at least one.
/// `begin`, `end`: of the recording.
[[nodiscard]] OutsideReleases outside_releases(const std::vector<Time>& at, Time begin, Time end);

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
/// order of arrival; unknown ones become that of most messages. Returns whether one became known.
[[nodiscard]] bool add_started_deliveries(RecordedDeliveries& deliveries, std::span<const tracing::Job> jobs,
                                          Family family, const std::vector<std::uint32_t>& executor_of);

/// The orders for the graph's topics; unknown orders are entries, too.
[[nodiscard]] std::map<std::string, DeliveryOrder> delivery_of_graph(const RecordedDeliveries& deliveries,
                                                                     const RecordedGraph& graph);

/// Sentences about orders that are unknown or that not all messages have.
[[nodiscard]] std::vector<std::string> delivery_notes(const tracing::System& system,
                                                      const RecordedDeliveries& deliveries);

}  // namespace hotpath::imports
