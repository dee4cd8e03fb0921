// SPDX-License-Identifier: Apache-2.0
#include "busy_level.hpp"

#include <algorithm>
#include <limits>
#include <map>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

using exact::add;

BusyLevel::BusyLevel(const GraphTopology& topology, const GraphOrder& order, const GraphOverheads& overheads,
                     std::int64_t its_rank)
    : rank(its_rank), member_of(topology.size(), kNone), topology_(topology), overheads_(overheads) {
  for (const TaskId id : topology.order()) {
    if (order.rank[id] <= rank) add_member(id);
  }
  for (const Member& m : std::vector<Member>(members)) {
    if (topology.join_of(m.id) != nullptr) join_at(topology.join_index(m.id));
  }
  add_up();
  if (utilisation > 1) return;
  blockers = all_blockers();
  drop_dominated();
}

std::int64_t BusyLevel::job_work(TaskId id) const {
  return add(topology_.set()[id].wcet.count(), overheads_.job);
}

void BusyLevel::add_member(TaskId id) {
  Member m;
  m.id = id;
  const Task& task = topology_.set()[id];
  m.timer = task.kind == TaskKind::timer;
  if (m.timer) {
    const auto known = std::ranges::find(periods, task.period.count());
    m.period = static_cast<std::size_t>(known - periods.begin());
    if (known == periods.end()) periods.push_back(task.period.count());
  }
  m.work = topology_.join_of(id) ? overheads_.job : job_work(id);
  std::vector<std::size_t> seen;
  for (const TaskId p : topology_.publishers(id)) {
    if (!inside(p)) continue;
    if (topology_.join_of(p) == nullptr) {
      publishers.push_back(member_of[p]);
    } else if (const std::size_t j = join_at(topology_.join_index(p)); std::ranges::count(seen, j) == 0) {
      seen.push_back(j);
    }
  }
  sources.insert(sources.end(), seen.begin(), seen.end());
  m.publishers_end = publishers.size();
  m.sources_end = sources.size();
  member_of[id] = members.size();
  members.push_back(m);
}

/// The place of a join whose inputs in the level are members already.
std::size_t BusyLevel::join_at(std::size_t index) {
  const auto known = std::ranges::find(joins, index, &Join::index);
  if (known != joins.end()) return static_cast<std::size_t>(known - joins.begin());
  Join join{index, {}, true, topology_.join_work(index)};
  for (const TaskId input : topology_.graph().joins[index].inputs) {
    if (inside(input)) {
      join.inputs.push_back(member_of[input]);
    } else {
      join.complete = false;
    }
  }
  joins.push_back(std::move(join));
  return joins.size() - 1;
}

void BusyLevel::add_up() {
  std::vector<double> rate(members.size(), 0);
  const auto slowest = [&](const Join& join) {
    double least = join.complete ? std::numeric_limits<double>::max() : 0;
    for (const std::size_t input : join.inputs) least = std::min(least, rate[input]);
    return least;
  };
  for (const TaskId timer : topology_.timers()) {
    utilisation +=
        static_cast<double>(overheads_.release) / static_cast<double>(topology_.set()[timer].period.count());
  }
  std::size_t publisher = 0, source = 0;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const Member& m = members[i];
    if (m.timer) rate[i] += 1.0 / static_cast<double>(periods[m.period]);
    for (; publisher < m.publishers_end; ++publisher) rate[i] += rate[publishers[publisher]];
    for (; source < m.sources_end; ++source) rate[i] += slowest(joins[sources[source]]);
    utilisation += rate[i] * static_cast<double>(m.work);
  }
  for (const Join& join : joins) utilisation += slowest(join) * static_cast<double>(join.work);
}

/// Of those with the same effect the longest.
std::vector<Blocker> BusyLevel::all_blockers() const {
  std::map<std::vector<TaskId>, Blocker> longest = {{{}, Blocker{kNoTask, kNoTask, overheads_.wake_up}}};
  for (TaskId id = 0; id < topology_.size(); ++id) {
    if (inside(id) || topology_.roots(id).empty()) continue;
    std::vector<TaskId> activated;
    for (const TaskId fed : topology_.set()[id].feeds) {
      if (inside(fed)) activated.push_back(fed);
    }
    Blocker& blocker = longest[activated];
    if (!activated.empty()) blocker.task = id;
    if (job_work(id) > blocker.work) blocker.longest = id;
    blocker.work = std::max({blocker.work, job_work(id), overheads_.wake_up});
  }
  std::vector<Blocker> all;
  for (const auto& [activated, blocker] : longest) all.push_back(blocker);
  return all;
}

/// By member; where joins are on its way, at most.
std::vector<BusyLevel::Effect> BusyLevel::effects() const {
  std::vector<Effect> of(members.size()), of_joins(joins.size());
  for (std::size_t j = 0; j < joins.size(); ++j) of_joins[j] = {joins[j].work, false};
  for (std::size_t i = members.size(); i-- > 0;) {
    const Member& m = members[i];
    Effect& own = of[i];
    own.work = add(own.work, m.work);
    if (topology_.join_of(m.id) != nullptr) {
      const auto join = std::ranges::find(joins, topology_.join_index(m.id), &Join::index);
      own = {add(own.work, of_joins[static_cast<std::size_t>(join - joins.begin())].work), false};
    }
    const std::size_t first_publisher = i > 0 ? members[i - 1].publishers_end : 0;
    for (std::size_t p = first_publisher; p < m.publishers_end; ++p) {
      Effect& publisher = of[publishers[p]];
      publisher = {add(publisher.work, own.work), publisher.exact && own.exact};
    }
    const std::size_t first_source = i > 0 ? members[i - 1].sources_end : 0;
    for (std::size_t s = first_source; s < m.sources_end; ++s) {
      of_joins[sources[s]].work = add(of_joins[sources[s]].work, own.work);
    }
  }
  return of;
}

/// Drops those that delay nothing more than another one does. What is exact delays everything by its sum.
void BusyLevel::drop_dominated() {
  const std::vector<Effect> effect = effects();
  const auto total = [&](const Blocker& blocker) {
    Effect sum{blocker.work, blocker.work > 0};
    if (blocker.task == kNoTask) return sum;
    for (const TaskId fed : topology_.set()[blocker.task].feeds) {
      if (!inside(fed)) continue;
      const Effect& of = effect[member_of[fed]];
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
