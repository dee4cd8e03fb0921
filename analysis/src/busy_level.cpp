// SPDX-License-Identifier: Apache-2.0
#include "busy_level.hpp"

#include <algorithm>
#include <limits>
#include <map>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

using exact::add;

BusyLevel::BusyLevel(const GraphTopology& topology, const GraphOrder& order, const GraphOverheads& overheads,
                     const std::vector<std::int64_t>& job_work, std::int64_t its_rank)
    : rank(its_rank),
      node_of(topology.size(), kNone),
      timers_of(topology.size(), kNone),
      topology_(topology),
      order_(order),
      overheads_(overheads),
      job_work_(job_work) {
  for (const TaskId id : topology.order()) {
    if (order.rank[id] <= rank) add_task(id);
  }
  for (TaskId id = 0; id < topology.size(); ++id) {
    if (inside(id) && topology.join_of(id)) join_at(topology.join_index(id));
  }
  add_up();
  if (order.service_wait > 0) find_ahead();
  if (!order.threads.empty() && rank > order.threads.back()) utilisation = kInfinite;
  if (utilisation > 1) return;
  blockers = all_blockers();
  drop_dominated();
}

/// Before samples of the task arrive, the thread may idle, and then has to wake up.
std::int64_t BusyLevel::transit(TaskId id) const {
  const bool delayed = overheads_.delivery > 0 && !topology_.set()[id].feeds.empty();
  return delayed ? add(overheads_.delivery, overheads_.wake_up) : 0;
}

void BusyLevel::add_task(TaskId id) {
  std::vector<std::size_t> before;
  for (const TaskId p : topology_.publishers(id)) {
    if (!inside(p)) continue;
    const bool joined = topology_.join_of(p) != nullptr;
    const std::size_t from = joined ? join_at(topology_.join_index(p)) : node_of[p];
    if (!joined || std::ranges::count(before, from) == 0) before.push_back(from);
  }
  const std::size_t own = nodes.size();
  for (const std::size_t from : before) nodes[from].feeds.push_back(own);
  node_of[id] = own;
  const bool joined = topology_.join_of(id) != nullptr;
  nodes.push_back(
      {.id = id, .joined = joined, .work = joined ? overheads_.job : add(job_work_[id], transit(id))});
  const Task& task = topology_.set()[id];
  if (task.kind != TaskKind::timer) return;
  const std::size_t thread = order_.thread_of(order_.rank[id]);
  const auto same = [&](const Timers& some) {
    return some.period == task.period.count() && some.deadline == task.deadline.count() &&
           some.jitter == order_.jitter_of(id) && some.thread == thread;
  };
  const auto known = std::ranges::find_if(timers, same);
  timers_of[id] = static_cast<std::size_t>(known - timers.begin());
  if (known == timers.end()) {
    timers.push_back({task.period.count(), task.deadline.count(), order_.jitter_of(id), thread, {}});
  }
  timers[timers_of[id]].nodes.push_back(own);
}

/// Returns the position of a join; its inputs in the level have positions already.
std::size_t BusyLevel::join_at(std::size_t index) {
  const TaskId first = topology_.graph().joins[index].inputs.front();
  Node join{.join = index, .work = add(topology_.join_work(index), transit(first))};
  for (const TaskId input : topology_.graph().joins[index].inputs) {
    if (inside(input)) {
      join.inputs.push_back(node_of[input]);
    } else {
      join.complete = false;
    }
  }
  std::vector<std::size_t>& known = nodes[join.inputs.front()].feeds;
  if (!known.empty()) return known.front();
  for (const std::size_t input : join.inputs) nodes[input].feeds = {nodes.size()};
  nodes.push_back(std::move(join));
  return nodes.size() - 1;
}

void BusyLevel::add_up() {
  for (const TaskId timer : topology_.timers()) {
    utilisation +=
        static_cast<double>(overheads_.release) / static_cast<double>(topology_.set()[timer].period.count());
  }
  std::vector<double> rate(nodes.size(), 0);
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const Node& node = nodes[n];
    if (node.id == kNoTask) {
      rate[n] = node.complete ? std::numeric_limits<double>::max() : 0;
      for (const std::size_t input : node.inputs) rate[n] = std::min(rate[n], rate[input]);
    } else if (timers_of[node.id] != kNone) {
      const Timers& timer = timers[timers_of[node.id]];
      rate[n] += 1.0 / static_cast<double>(timer.period);
      // A level that such samples do not enter has a bound all the same.
      if (timer.jitter == GraphOrder::kUnbounded && !node.feeds.empty()) {
        utilisation = kInfinite;
      }
    }
    for (const std::size_t fed : node.feeds) {
      if (nodes[fed].id != kNoTask) rate[fed] += rate[n];
    }
    utilisation += rate[n] * static_cast<double>(node.work);
  }
}

/// The longest of the blockers with the same effect.
std::vector<Blocker> BusyLevel::all_blockers() const {
  std::map<std::vector<TaskId>, Blocker> longest = {{{}, Blocker{kNoTask, kNoTask, overheads_.wake_up}}};
  std::map<std::vector<TaskId>, Blocker> begins;
  const std::size_t thread = order_.thread_of(rank);
  for (TaskId id = 0; id < topology_.size(); ++id) {
    if (inside(id) || topology_.roots(id).empty()) continue;
    const bool preempted = order_.thread_of(order_.rank[id]) != thread;
    std::vector<TaskId> activated;
    for (const TaskId fed : topology_.set()[id].feeds) {
      if (inside(fed)) activated.push_back(fed);
    }
    if (preempted) {
      // It cannot run in the window, but its publication may begin it.
      if (!activated.empty()) begins[activated] = {id, kNoTask, 0};
      continue;
    }
    Blocker& blocker = longest[activated];
    if (!activated.empty()) blocker.task = id;
    if (job_work_[id] > blocker.work) blocker.longest = id;
    blocker.work = std::max({blocker.work, job_work_[id], overheads_.wake_up});
  }
  std::vector<Blocker> all;
  all.reserve(longest.size() + begins.size());
  for (const auto* some : {&longest, &begins}) {
    for (const auto& [activated, blocker] : *some) all.push_back(blocker);
  }
  return all;
}

/// By node: the effect of one more job; an upper limit if joins are downstream.
std::vector<BusyLevel::Effect> BusyLevel::effects() const {
  std::vector<Effect> of(nodes.size());
  for (std::size_t n = nodes.size(); n-- > 0;) {
    of[n] = {nodes[n].work, nodes[n].id != kNoTask};
    for (const std::size_t fed : nodes[n].feeds) {
      of[n] = {add(of[n].work, of[fed].work), of[n].exact && of[fed].exact};
    }
  }
  return of;
}

/// The effect of one more job of each service, which runs though more urgent jobs are pending. Its sample may
/// fill an input of a join once more. Under deadlines, what it activates has a later deadline.
void BusyLevel::find_ahead() {
  const std::vector<Effect> effect = effects();
  for (TaskId id = 0; id < topology_.size(); ++id) {
    if (!topology_.set()[id].service || topology_.roots(id).empty()) continue;
    std::int64_t work = job_work_[id];
    std::size_t joined = kNone;
    if (const auto* join = topology_.join_of(id)) {
      for (const TaskId input : join->inputs) {
        if (inside(input)) joined = nodes[node_of[input]].feeds.front();
      }
    }
    if (joined != kNone) work = add(work, effect[joined].work);
    for (const TaskId fed : topology_.set()[id].feeds) {
      if (joined == kNone && !order_.by_deadline && inside(fed)) work = add(work, effect[node_of[fed]].work);
    }
    if (any_ahead_.task == kNoTask || work > any_ahead_.work) any_ahead_ = {id, work};
    if (!inside(id) && (outside_ahead_.task == kNoTask || work > outside_ahead_.work))
      outside_ahead_ = {id, work};
  }
  if (order_.by_deadline) return;
  utilisation += static_cast<double>(outside_ahead_.work) / static_cast<double>(order_.service_wait);
}

/// Drops blockers that never delay more than another one. An exact effect delays everything by its
/// sum.
void BusyLevel::drop_dominated() {
  const std::vector<Effect> effect = effects();
  const auto total = [&](const Blocker& blocker) {
    Effect sum{blocker.work, blocker.work > 0};
    if (blocker.task == kNoTask) return sum;
    for (const TaskId fed : topology_.set()[blocker.task].feeds) {
      if (!inside(fed)) continue;
      const Effect& of = effect[node_of[fed]];
      sum = {add(sum.work, of.work), sum.exact && of.exact};
    }
    return sum;
  };
  std::int64_t most = -1;
  std::size_t worst = kNone;
  for (std::size_t b = 0; b < blockers.size(); ++b) {
    const Effect sum = total(blockers[b]);
    if (sum.exact && sum.work > most) worst = b, most = sum.work;
  }
  std::vector<Blocker> kept;
  for (std::size_t b = 0; b < blockers.size(); ++b) {
    const Effect sum = total(blockers[b]);
    const bool dominated = blockers[b].work > 0 && sum.work <= most;
    if (b == worst || !dominated) kept.push_back(blockers[b]);
  }
  blockers = std::move(kept);
}

}  // namespace hotpath
