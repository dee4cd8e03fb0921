// SPDX-License-Identifier: Apache-2.0
// Live graphs with nodes of type `callbacks`: nothing is lost, histories have any length, messages
// have several holders. Checks counts, never durations.
#include <gtest/gtest.h>

#include <map>
#include <thread>
#include <tuple>
#include <utility>

#include "graph_fixture.hpp"
#include "hotpath/core/accounting.hpp"
#include "hotpath/reference_system/message.hpp"
#include "live_fixture.hpp"

namespace hotpath::callbacks_live_test {

Time at(int ms) { return Time{} + std::chrono::milliseconds(ms); }

struct Live {
  GraphTasks tasks;
  Trace trace;
  std::vector<ChainObservation> observations;
  std::vector<TaskAccount> accounts;
};

Live run(Graph graph, const std::string& executor, TransportKind transport, double load_percent = 0) {
  scale_to_load(graph, load_percent);
  Live live;
  live.tasks = tasks_with(graph, Phases::synchronous);
  ConnectedSystem connected(graph, live.tasks, executor, transport);
  LiveSystem& system = connected.system;
  const RunMemory& memory = connected.memory;
  live.trace.epoch = now() + std::chrono::milliseconds(20);
  system.start(live.trace.epoch, live.trace.epoch + std::chrono::milliseconds(600));
  live.trace.end = system.join();
  const Time limit = now() + std::chrono::seconds(2);
  for (TaskId id = 0; id < live.tasks.set.size(); ++id)
    while (system.arrived(id) < memory.published()[id].load() && now() < limit) std::this_thread::yield();
  system.close(live.trace.end);
  for (const auto& published : memory.published()) live.trace.published.push_back(published.load());
  for (const auto& log : memory.jobs())
    for (const JobRecord& record : log.contents()) live.trace.jobs.push_back(record);
  for (const auto& log : memory.chains())
    for (const ChainObservation& o : log.contents()) live.observations.push_back(o);
  live.trace.chains = join_chains(graph, live.tasks, live.trace, live.observations);
  live.accounts = account(live.tasks.set, live.trace);
  return live;
}

/// Samples reach the executor in the graph's order, whatever the order of creation and of deadlines.
TEST(LiveDelivery, FollowsTheGraph) {
  Graph g = load_graph(find_graph("autoware"));
  g.delivery["PointCloudFusion"].nodes = {"RayGroundFilter", "VoxelGridDownsampler"};
  g.delivery["Lanelet2MapLoader"].nodes = {"BehaviorPlanner", "ParkingPlanner", "LanePlanner"};
  for (const TransportKind transport : {TransportKind::intra_process, TransportKind::fastdds}) {
    const Live live = run(g, "events-ro", transport);
    std::map<std::pair<TaskId, std::uint64_t>, std::map<TaskId, Time>> arrivals;  // by publishing job
    for (const JobRecord& r : live.trace.jobs) {
      if (r.outcome == Outcome::ran && r.job.parent.task != kNoTask)
        arrivals[{r.job.parent.task, r.job.parent.sequence}][r.job.task] = r.job.release;
    }
    std::size_t compared = 0;
    for (const auto& [parent, at] : arrivals) {
      const std::vector<TaskId>& order = live.tasks.set[parent.first].feeds;
      for (std::size_t i = 1; i < order.size(); ++i) {
        if (!at.contains(order[i - 1]) || !at.contains(order[i])) continue;
        EXPECT_LE(at.at(order[i - 1]), at.at(order[i])) << live.tasks.set[order[i]].name;
        ++compared;
      }
    }
    EXPECT_GT(compared, 0U);
  }
}

/// Each sample carries the instant of its publication, within the job that published it.
TEST(LivePublications, FollowTheirInstantsWithinTheJob) {
  Graph g = load_graph(find_graph("callbacks"));
  for (Node& node : g.nodes)
    for (Callback& callback : node.callbacks)
      for (Publication& p : callback.publishes) p.at = 0.25;
  g.work = WorkMode::wall;
  const Live live = run(g, "multi", TransportKind::intra_process, 20);
  std::map<std::pair<TaskId, std::uint64_t>, const JobRecord*> jobs;
  for (const JobRecord& r : live.trace.jobs) {
    if (r.outcome == Outcome::ran) jobs[{r.job.task, r.job.sequence}] = &r;
  }
  std::size_t before_the_end = 0;
  for (const JobRecord& r : live.trace.jobs) {
    const auto parent = jobs.find({r.job.parent.task, r.job.parent.sequence});
    if (parent == jobs.end() || live.tasks.set[parent->first.first].wcet == Duration{}) continue;
    const Task& task = live.tasks.set[parent->first.first];
    EXPECT_GE(r.job.timestamp, parent->second->start + task.wcet / 4) << task.name;
    before_the_end += r.job.timestamp < parent->second->start + task.wcet;
  }
  EXPECT_GT(before_the_end, 0U);
}

TEST(LiveCallbacksChain, MessagesRememberMoreNodesThanFastDdsExpectsOfASequence) {
  std::string nodes;
  for (int i = 0; i < 150; ++i) {
    const std::string name = "N" + std::to_string(i), before = "N" + std::to_string(i - 1);
    nodes += "- {name: " + name + ", type: callbacks, callbacks: [{";
    nodes += i == 0 ? "timer: t, period_ms: 100" : "subscription: " + before;
    nodes += ", publishes: " + name + "}]}\n";
  }
  Graph g = load("name: g\nnodes:\n" + nodes);
  // Fast DDS reserves memory for 100 entries. The chain is read from its last node.
  g.chains = {{"c", {"N0", "N149"}, {"N0"}, "N149"}};
  for (const TransportKind transport : {TransportKind::intra_process, TransportKind::fastdds}) {
    const Live live = run(g, "events-ro", transport);
    ASSERT_GT(live.observations.size(), 0U);
    for (const ChainObservation& o : live.observations) EXPECT_EQ(o.sources_seen, 1U);
    for (const TaskAccount& account : live.accounts) EXPECT_TRUE(account.balanced());
  }
}

/// Of a source that arrives by two paths. The live messages of graphs without nodes of type `callbacks`.
TEST(Message4kb, KeepsTheOldestJobOfANode) {
  const Graph g =
      load("name: g\nnodes: [{name: S, type: sensor, period_ms: 10}, {name: N, type: sensor, period_ms: 9}]");
  const Message4kbHistory history(g, make_tasks(g));
  const TaskId s = 0, n = 1;
  const auto with = [&](const std::vector<Stat>& entries) {
    msg::Message4kb message;
    for (const Stat& entry : entries)
      history.append(message, entry, static_cast<std::uint32_t>(entry.sequence));
    return message;
  };
  const msg::Message4kb direct = with({{s, 0, 7, at(70)}}),
                        by_n = with({{s, 2, 4, at(40)}, {n, 0, 3, at(71)}});
  for (const auto& [first, second] : {std::pair(&direct, &by_n), std::pair(&by_n, &direct)}) {
    msg::Message4kb joined = with({});
    history.merge(joined, *first, n);
    history.merge(joined, *second, n);
    EXPECT_EQ(joined.size(), 2U);
    Stat oldest;
    history.find(joined, std::span(&s, 1), [&](const Stat& stat) { oldest = stat; });
    EXPECT_EQ(std::tuple(oldest.sequence, oldest.dropped, oldest.start), std::tuple(4U, 2U, at(40)));
  }
  EXPECT_EQ(Message4kbHistory::publication(by_n), 3U);
}

}  // namespace hotpath::callbacks_live_test
