// SPDX-License-Identifier: Apache-2.0
#include "telemetry/run_statistics.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "hotpath/core/accounting.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_layout.hpp"
#include "program/text.hpp"
#include "results/measures.hpp"

namespace hotpath::telemetry {

telemetry::RunInfo make_run_info(const Graph& graph, const results::RunRecord& run,
                                 const std::string& executor, std::uint32_t repetition,
                                 std::int64_t epoch_ns) {
  telemetry::RunInfo info;
  info.run_id(program::concat(epoch_ns, "-", executor, "-", repetition));
  info.graph(graph.name);
  info.executor(executor);
  info.repetition(repetition);
  info.epoch_ns(epoch_ns);
  info.transport(run.live ? to_string(run.live->transport) : "simulated");
  info.origin("live");
  info.speed(1);
  nlohmann::json facts = run;
  facts.erase("runs");
  info.facts(facts.dump());
  const std::vector<GraphPosition> positions = graph_layout(graph);
  for (std::size_t n = 0; n < graph.nodes.size(); ++n) {
    const Node& node = graph.nodes[n];
    telemetry::NodeInfo& i = info.nodes().emplace_back();
    i.name(node.name);
    i.type(to_string(node.type));
    i.hot(on_hot_path(graph, node));
    i.layout_x(positions[n].column);
    i.layout_y(positions[n].row);
    if (node.type != NodeType::callbacks) i.deadline_ns(node.callbacks.back().deadline.count());
  }
  for (const GraphEdge& edge : graph_edges(graph)) {
    telemetry::EdgeInfo& i = info.edges().emplace_back();
    i.source(edge.source);
    i.target(edge.target);
    i.topic(edge.topic);
    i.hot(edge.hot);
  }
  for (const ChainIndex& chain : index_chains(graph, make_tasks(graph))) {
    telemetry::ChainInfo& i = info.chains().emplace_back();
    i.name(graph.chains[info.chains().size() - 1].name);
    i.sink(chain.sink);
  }
  return info;
}

std::int64_t unix_ns(Duration from_now) {
  const auto now = std::chrono::time_point_cast<Duration>(std::chrono::system_clock::now());
  return (now.time_since_epoch() + from_now).count();
}

RunStatistics::RunStatistics(const Graph& graph, const GraphTasks& tasks, const telemetry::RunInfo& info,
                             Time epoch, Duration warm_up)
    : tasks_(tasks),
      run_id_(info.run_id()),
      epoch_(epoch),
      epoch_ns_(info.epoch_ns()),
      counted_from_(epoch + warm_up),
      nodes_(graph.nodes.size()),
      chains_(graph.chains.size()),
      window_start_(epoch) {}

void RunStatistics::add(const JobRecord& r) {
  const TaskId task = r.job.task;
  NodeState& node = nodes_[tasks_.origin[task].node];
  if (r.outcome == Outcome::overwritten) {
    node.counts.overwritten(node.counts.overwritten() + 1);
    ++node.accounted;
  }
  if (r.outcome != Outcome::ran) return;
  node.counts.ran(node.counts.ran() + 1);
  node.counts.skipped(node.counts.skipped() + r.job.skipped);
  node.accounted += 1 + r.job.skipped;
  node.window_busy += r.duration();
  if (!hotpath::results::counts(r, counted_from_)) return;
  const Duration response = r.response_time();
  node.counts.overruns(node.counts.overruns() + results::overruns_deadline(tasks_.set[task], response));
  // A job that only stores its sample has no response time: another job processes the sample.
  if (tasks_.callbacks[task].stores_only) return;
  node.responses.add(response);
  node.window_responses += response;
  ++node.window_jobs;
}

telemetry::ChainSample RunStatistics::add(const ChainRecord& r, Time sink_start) {
  ChainState& chain = chains_[r.chain];
  telemetry::ChainSample sample;
  sample.run_id(run_id_);
  sample.chain(r.chain);
  sample.number(chain.latencies.count());
  sample.job(r.sequence);
  sample.stamp_ns(unix_time(sink_start));
  sample.hot_path_latency_ns(r.hot_path_latency.count());
  sample.end_to_end_latency_ns(r.end_to_end_latency.count());
  chain.latencies.add(r.hot_path_latency);
  chain.dropped += r.dropped;
  return sample;
}

telemetry::Statistics RunStatistics::take(Time now, const std::function<std::uint64_t(TaskId)>& published) {
  Trace so_far;
  so_far.epoch = epoch_;
  so_far.end = now;
  for (TaskId id = 0; id < tasks_.set.size(); ++id) so_far.published.push_back(published(id));
  const std::vector<std::uint64_t> of_tasks = expected_jobs(tasks_.set, so_far);
  std::vector<std::uint64_t> expected(nodes_.size(), 0);
  for (TaskId id = 0; id < of_tasks.size(); ++id) expected[tasks_.origin[id].node] += of_tasks[id];
  telemetry::Statistics statistics;
  statistics.run_id(run_id_);
  statistics.number(taken_++);
  statistics.last(false);
  statistics.stamp_ns(unix_time(now));
  statistics.run_time_s(to_s(now - epoch_));
  const Duration window = std::max(now - window_start_, Duration(1));
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    NodeState& node = nodes_[n];
    telemetry::NodeStatistics& s = statistics.nodes().emplace_back(node.counts);
    s.queued(static_cast<std::uint32_t>(expected[n] - std::min(expected[n], node.accounted)));
    s.response_window_ns(node.window_jobs == 0 ? -1 : node.window_responses.count() / node.window_jobs);
    s.utilization(to_ms(node.window_busy) / to_ms(window));
    s.response_median_ns(node.responses.quantile(0.5).count());
    s.response_p99_ns(node.responses.quantile(0.99).count());
    s.response_max_ns(node.responses.max().count());
  }
  for (const ChainState& chain : chains_) {
    telemetry::ChainStatistics& s = statistics.chains().emplace_back();
    s.samples(chain.latencies.count());
    s.dropped(chain.dropped);
    s.latency_median_ns(chain.latencies.quantile(0.5).count());
    s.latency_p99_ns(chain.latencies.quantile(0.99).count());
    s.latency_max_ns(chain.latencies.max().count());
  }
  begin_window(now);
  return statistics;
}

void RunStatistics::begin_window(Time now) {
  window_start_ = now;
  for (NodeState& node : nodes_) {
    node.window_busy = node.window_responses = Duration::zero();
    node.window_jobs = 0;
  }
}

}  // namespace hotpath::telemetry
