// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/live_system.hpp"

#include <algorithm>
#include <cassert>

namespace hotpath {

LiveSystem::LiveSystem(const Graph& graph, const GraphTasks& tasks, const LiveOptions& options,
                       RunMemory& memory)
    : executor_of_(options.executor_of),
      memory_(memory),
      nodes_(make_live_nodes(graph, tasks, options, memory)) {
  const std::size_t all_workers = memory.jobs().size() - options.executors.size();
  Worker first_worker = 0;
  for (const LiveExecutor& live : options.executors) {
    TaskSet own = tasks.set;
    for (TaskId id = 0; id < own.size() && !executor_of_.empty(); ++id) {
      own.tasks[id].local &= executor_of_[id] == executors_.size();
    }
    auto scheduler = live.entry->make(own, live.scheduler);
    const auto workers = static_cast<Worker>(scheduler->workers().size());
    assert(first_worker + workers <= all_workers);
    const auto first_log = memory.jobs().begin() + first_worker;
    Executor::Logs logs(first_log, first_log + workers);
    logs.push_back(memory.jobs()[all_workers + executors_.size()]);
    ExecutorOptions threads = live.threads;
    threads.first_worker = std::exchange(first_worker, first_worker + workers);
    executors_.push_back(
        std::make_unique<Executor>(own, std::move(scheduler), *nodes_, std::move(logs), threads));
  }
  nodes_->connect(*this, sensor_.get());
  if (sensor_) sensor_->create(graph, tasks);
}

LiveSystem::~LiveSystem() {
  stop();
  // Samples must return to the transport while its readers exist, and the readers must be destroyed
  // before the executors that they call.
  close(join());
  nodes_.reset();
}

void LiveSystem::start(Time epoch, Time end) {
  for (const auto& executor : executors_) executor->start(epoch, end);
}

void LiveSystem::stop() {
  for (const auto& executor : executors_) executor->stop();
}

Time LiveSystem::join() {
  Time end{};
  for (const auto& executor : executors_) end = std::max(end, executor->join());
  return end;
}

void LiveSystem::close(Time end) {
  // Jobs that became ready in an executor after it stopped, but before the end, belong to the run.
  for (const auto& executor : executors_) executor->close(end);
}

std::vector<WorkerThread> LiveSystem::workers() const {
  std::vector<WorkerThread> all;
  for (const auto& executor : executors_) {
    all.insert(all.end(), executor->workers().begin(), executor->workers().end());
  }
  return all;
}

}  // namespace hotpath
