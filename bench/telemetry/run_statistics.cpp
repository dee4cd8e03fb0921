// SPDX-License-Identifier: Apache-2.0
#include "telemetry/run_statistics.hpp"

#include <algorithm>
#include <utility>

#include "results/measures.hpp"

namespace hotpath::telemetry {

RunStatistics::RunStatistics(const Graph& graph, const GraphTasks& tasks, std::string run_id,
                             const UnixTime& time, Duration warm_up)
    : tasks_(tasks),
      run_id_(std::move(run_id)),
      time_(time),
      counted_from_(time.epoch + warm_up),
      published_(tasks.set.size(), 0),
      nodes_(graph.nodes.size()),
      chains_(graph.chains.size()),
      window_start_(time.epoch) {
  for (const Callback& callback : tasks.callbacks) stores_only_.push_back(callback.stores_only);
}

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
  node.window_busy += r.finish - r.start;
  if (!hotpath::results::counts(r, counted_from_)) return;
  const Duration response = results::response_time(r);
  node.counts.overruns(node.counts.overruns() + results::overruns_deadline(tasks_.set[task], response));
  // A job that only stores its sample has no response time: another job processes the sample.
  if (stores_only_[task]) return;
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
  sample.stamp_ns(time_(sink_start));
  sample.hot_path_latency_ns(r.hot_path_latency.count());
  sample.end_to_end_latency_ns(r.end_to_end_latency.count());
  chain.latencies.add(r.hot_path_latency);
  chain.dropped += r.dropped;
  return sample;
}

std::uint64_t RunStatistics::reached(TaskId timer, Time now) const {
  const Task& task = tasks_.set[timer];
  const Time first = time_.epoch + task.phase;
  return now <= first ? 0 : 1 + static_cast<std::uint64_t>((now - Duration(1) - first) / task.period);
}

telemetry::Statistics RunStatistics::take(Time now) {
  std::vector<std::uint64_t> expected(nodes_.size(), 0);
  for (TaskId id = 0; id < tasks_.set.size(); ++id) {
    expected[tasks_.origin[id].node] +=
        tasks_.set[id].kind == TaskKind::timer ? reached(id, now) : published_[id];
  }
  telemetry::Statistics statistics;
  statistics.run_id(run_id_);
  statistics.number(taken_++);
  statistics.last(false);
  statistics.stamp_ns(time_(now));
  statistics.run_time_s(to_ms(now - time_.epoch) / 1000);
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
