// SPDX-License-Identifier: Apache-2.0
#include "processor_windows.hpp"

#include <algorithm>

namespace hotpath {

ProcessorWindows::ProcessorWindows(const CallbackGraph& whole, const std::vector<bool>& here,
                                   const Elsewhere& elsewhere, GraphOrder order,
                                   const GraphOverheads& overheads, std::vector<SampleStream> streams)
    : first_(whole.set.size()),
      streams_(std::move(streams)),
      order_(std::move(order)),
      overheads_(overheads) {
  graph_.set = whole.set;
  graph_.reads.resize(first_ + streams_.size());
  graph_.every.assign(first_ + streams_.size(), 1);
  for (TaskId id = 0; id < first_; ++id) {
    Task& task = graph_.set.tasks[id];
    if (here[id]) {
      std::erase_if(task.feeds, [&](TaskId fed) { return !here[fed] || elsewhere(id, fed); });
      continue;
    }
    task.kind = TaskKind::subscription;  // without a timer upstream, it never runs
    task.feeds.clear();
    order_.rank[id] = 0;
  }
  for (const SampleStream& stream : streams_) {
    Task timer;
    timer.period = timer.deadline = whole.set[stream.root].period;
    for (const TaskId fed : whole.set[stream.publisher].feeds) {
      if (here[fed] && elsewhere(stream.publisher, fed)) timer.feeds.push_back(fed);
    }
    graph_.set.tasks.push_back(timer);
    order_.rank.push_back(GraphOrder::kArrival);
  }
  for (const CallbackGraph::Join& join : whole.joins) {
    if (here[join.inputs.front()]) graph_.joins.push_back(join);
  }
  topology_.emplace(graph_);
}

void ProcessorWindows::set_jitter(const std::vector<std::int64_t>& jitter, std::int64_t late) {
  order_.jitter.assign(first_, late);
  order_.jitter.insert(order_.jitter.end(), jitter.begin(), jitter.end());
  windows_.emplace(*topology_, order_, overheads_);
}

bool ProcessorWindows::leads_to(TaskId from, TaskId to) const { return topology_->leads_to(from, to); }

}  // namespace hotpath
