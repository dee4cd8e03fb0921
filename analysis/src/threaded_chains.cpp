// SPDX-License-Identifier: Apache-2.0
#include "threaded_chains.hpp"

#include <algorithm>
#include <map>
#include <string>

#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/analysis/exact.hpp"
#include "hotpath/analysis/graph_bounds.hpp"
#include "timer_responses.hpp"

namespace hotpath {

namespace {

using exact::add, exact::multiply;

constexpr std::int64_t kLongestWait = std::int64_t{1} << 50;  // 13 days
constexpr int kMostSteps = 100'000;
constexpr std::size_t kNoLine = ~std::size_t{0};

}  // namespace

ThreadedChains::ThreadedChains(const GraphTopology& topology, unsigned threads)
    : topology_(topology),
      threads_(threads),
      line_of_(topology.size(), kNoLine),
      work_before_(topology.size()) {
  const TaskSet& set = topology.set();
  const auto refuse = [&](TaskId id, const std::string& why) {
    throw AnalysisError("on several threads it covers chains of callbacks one after the other, but " +
                        set[id].name + " " + why);
  };
  for (const TaskId root : topology.timers()) {
    if (set[root].always_due) refuse(root, "has the period 0");
    Line line{{}, set[root].period.count(), 0, set[root].period.count()};
    for (TaskId id = root;; id = set[id].feeds.front()) {
      if (topology.join_of(id) != nullptr) refuse(id, "waits for other inputs");
      if (!topology.graph().reads[id].empty()) refuse(id, "reads other inputs");
      if (topology.publishers(id).size() > 1) refuse(id, "takes samples of several callbacks");
      line_of_[id] = lines_.size();
      work_before_[id] = line.work;
      line.tasks.push_back(id);
      line.work = add(line.work, set[id].wcet.count());
      if (set[id].feeds.empty()) break;
      if (set[id].feeds.size() > 1) refuse(id, "activates several callbacks");
    }
    lines_.push_back(std::move(line));
  }
  check_groups();
  bounded_ = find_responses();
}

void ThreadedChains::check_groups() const {
  const TaskSet& set = topology_.set();
  std::map<std::uint32_t, TaskId> first;  // by exclusive group
  for (TaskId id = 0; id < set.size(); ++id) {
    if (line_of_[id] == kNoLine || set.groups[set[id].group] == CallbackGroup::reentrant) continue;
    const auto [other, is_new] = first.emplace(set[id].group, id);
    if (!is_new && line_of_[other->second] != line_of_[id])
      throw AnalysisError(
          "on several threads it covers no mutually exclusive group of several chains, such as that "
          "of " +
          set[other->second].name + " and " + set[id].name);
  }
}

/// The most work of a line in a window, if each of its jobs ends within its response time.
std::int64_t ThreadedChains::work_beside(const Line& line, std::int64_t window) const {
  const std::int64_t length = add(window, line.response) - line.work;
  if (length < 0) return 0;
  return add(multiply(length / line.period, line.work), std::min(line.work, length % line.period));
}

/// The longest wait of a line's jobs, up to the start of a task before which they work for `before`. While
/// they wait, all threads run other lines: the largest wait for which these have enough work. A smaller
/// solution proves nothing.
std::optional<std::int64_t> ThreadedChains::waiting(std::size_t of, std::int64_t before) const {
  std::int64_t wait = kLongestWait;
  for (int step = 0; step < kMostSteps; ++step) {
    std::int64_t work = 0;
    for (std::size_t other = 0; other < lines_.size(); ++other) {
      if (other != of) work = add(work, std::min(work_beside(lines_[other], add(before, wait)), wait));
    }
    const std::int64_t next = work / threads_;
    if (next == wait) return wait;
    if (next > wait) return std::nullopt;  // too much work
    wait = next;
  }
  return std::nullopt;
}

/// Lowers all response times until nothing changes. False: some job may last longer than its period.
bool ThreadedChains::find_responses() {
  for (bool changed = true; changed;) {
    changed = false;
    bool all = true;
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      Line& line = lines_[k];
      const std::int64_t before = work_before_[line.tasks.back()];
      const std::optional<std::int64_t> wait = waiting(k, before);
      const std::int64_t response = wait ? add(line.work, *wait) : line.period + 1;
      all = all && response <= line.period;
      if (response >= line.response) continue;
      line.response = response;
      changed = true;
    }
    if (!changed) return all;
  }
  return false;
}

std::optional<std::int64_t> ThreadedChains::until_start(TaskId root, TaskId to) const {
  if (!bounded_ || line_of_[to] == kNoLine || lines_[line_of_[to]].tasks.front() != root) return std::nullopt;
  const std::optional<std::int64_t> wait = waiting(line_of_[to], work_before_[to]);
  return wait ? std::optional(add(work_before_[to], *wait)) : std::nullopt;
}

std::optional<std::int64_t> ThreadedChains::until_finish(TaskId root, TaskId to) const {
  const std::optional<std::int64_t> start = until_start(root, to);
  return start ? std::optional(add(*start, topology_.set()[to].wcet.count())) : std::nullopt;
}

std::optional<std::int64_t> ThreadedChains::response(TaskId subscription) const {
  if (line_of_[subscription] == kNoLine) return std::nullopt;
  const TaskId root = lines_[line_of_[subscription]].tasks.front();
  const std::optional<std::int64_t> finish = until_finish(root, subscription);
  return finish ? std::optional(*finish - topology_.least_until_start(root, subscription)) : std::nullopt;
}

void bound_threads(const BoundedSystem& system, GraphBounds& out) {
  const TaskSet& set = system.graph.set;
  const bool releaser = system.executor.traits.timers != TimerHandling::polled,
             raised = system.platform.raised_releaser;
  const unsigned threads = worker_count(system.executor, system.scheduling) - (releaser ? 1 : 0);
  if (threads < 2) throw AnalysisError("it is for several threads");
  const unsigned needed = threads + (releaser && !raised ? 1 : 0);
  if (system.platform.cores < needed)
    throw AnalysisError("its threads need " + std::to_string(needed) + " cores, one each (--cores)");
  const auto reentrant = [&](const Task& task) { return set.groups[task.group] == CallbackGroup::reentrant; };
  if (system.executor.traits.family == Family::callback_groups && std::ranges::any_of(set.tasks, reentrant))
    throw AnalysisError(
        "it covers no reentrant groups under `cbg`, which may leave a thread idle beside them");
  const GraphTopology topology(system.graph);
  bound_graph(topology, ThreadedChains(topology, threads), out);
}

}  // namespace hotpath
