// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/executor_callback.hpp"

namespace hotpath {

ExecutorCallbacks executor_callbacks(const TaskSet& set) {
  ExecutorCallbacks callbacks;
  for (const TaskKind kind : {TaskKind::timer, TaskKind::subscription}) {
    for (TaskId id = 0; id < set.size(); ++id) {
      const Task& t = set[id];
      if (t.kind != kind) continue;
      callbacks.push_back({.name = t.name,
                           .id = id,
                           .kind = kind,
                           .wcet = t.wcet.count(),
                           .period = t.period.count(),
                           .executor = 0,
                           .depth = t.depth,
                           .asynchronous = false,
                           .deliveries = {}});
    }
  }
  return callbacks;
}

void check_callbacks(const ExecutorCallbacks& callbacks, const TaskChain& chain, std::string_view method) {
  const auto refuse = [&](const std::string& problem) {
    throw AnalysisError(std::string(method) + ": " + problem);
  };
  if (callbacks.empty()) refuse("there are no callbacks");
  for (const ExecutorCallback& c : callbacks) {
    const std::string callback = "callback '" + c.name + "': ";
    if (c.wcet < 0)
      refuse(callback + "worst-case execution time " + std::to_string(c.wcet) + " ns is negative");
    if (c.period < 0) refuse(callback + "period " + std::to_string(c.period) + " ns is negative");
    if (c.depth == 0) refuse(callback + "queue depth is 0; it must be 1 or more");
    for (const DdsDelivery& d : c.deliveries) {
      if (d.latency < 0) refuse(callback + "DDS latency " + std::to_string(d.latency) + " ns is negative");
      if (d.to >= callbacks.size() || callbacks[d.to].kind != TaskKind::subscription ||
          callbacks[d.to].executor == c.executor) {
        refuse(callback + "a DDS delivery must lead to a subscription on another executor");
      }
    }
  }
  for (std::size_t i = 0; i < chain.size(); ++i) {
    if (chain[i] >= callbacks.size()) {
      refuse("element " + std::to_string(i + 1) + " of the chain is callback number " +
             std::to_string(chain[i]) + ", but there are only " + std::to_string(callbacks.size()));
    }
  }
}

}  // namespace hotpath
