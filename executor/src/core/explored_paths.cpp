// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cassert>
#include <map>
#include <stdexcept>

#include "explored_state.hpp"

namespace hotpath {

Witness ExploredPaths::witness(const Edge& last) const {
  std::vector<Step> steps = {{&last, last.zone.point(kNow)}};
  while (steps.back().edge->from.state != kNowhere) {
    const Step after = steps.back();
    steps.push_back(edge_to(after.edge->from, after.point));
    steps.back().origin = after.origin + after.edge->from.origin - steps.back().edge->to.origin;
  }
  std::reverse(steps.begin(), steps.end());
  Witness witness;
  struct Begun {
    std::size_t job = 0;
    Time instant = kNever;
    std::uint32_t round = 0;
  };
  std::map<std::uint32_t, Begun> running;  // by name
  std::uint32_t round = 0;                 // of those at one instant
  for (const auto& [edge, point, origin] : steps) {
    const auto& [begun, ended, sent, released] = edge->happened;
    const Time instant = from_ns(point[kNow] + origin);
    round = instant == witness.instant ? round + 1 : 0;
    witness.instant = instant;
    for (const auto& [timer, timestamp] : released)
      witness.delays.emplace_back(timer, from_ns(point[kNow]) - timestamp);
    for (const auto& [subscription, arrival] : sent) {
      const std::int64_t delay = arrival == 0 ? 0 : point[arrival] - point[kNow];
      witness.deliveries.emplace_back(subscription, Duration(delay));
    }
    for (const std::uint32_t name : ended) {
      const auto& [job, started, its_round] = running[name];
      if (started == instant) {
        witness.jobs[job].end_round = round - its_round;
      } else if (round > 0) {
        witness.jobs[job].end_round = round + 1;
      }
    }
    for (const BegunJob& job : begun) {
      running[job.name] = {witness.jobs.size(), instant, round};
      witness.jobs.push_back({job.task, Duration(point[job.end] - point[kNow])});
    }
  }
  return witness;
}

ExploredPaths::Step ExploredPaths::edge_to(const End& end, const std::vector<std::int64_t>& point) const {
  for (const Edge& edge : edges_[end.state]) {
    Zone zone = edge.zone;
    bool leads_here = true;
    for (std::size_t i = 0; i < end.coordinates.size() && leads_here; ++i) {
      const std::int64_t there = point[end.coordinates[i]] - end.origin + edge.to.origin;
      leads_here = edge.to.coordinates[i] == 0 || zone.equate(edge.to.coordinates[i], 0, there);
    }
    if (leads_here) return {&edge, zone.point(kNow), 0};
  }
  assert(false && "no edge leads to a point of a state");
  throw ExplorationRefused("no schedule leads to a state");
}

WitnessTimes::WitnessTimes(const TaskSet& set, const Witness& witness)
    : set_(set), witness_(witness), delays_left_(set.size()) {
  std::vector<std::uint64_t> sent(set.size());
  for (const auto& [subscription, delay] : witness.deliveries)
    given_[{subscription, sent[subscription]++}].delivery = delay;
  for (const auto& [timer, delay] : witness.delays) delays_left_[timer].push_back(delay);
}

Time WitnessTimes::due(JobRef job, Time timestamp) const {
  Duration delay = set_[job.task].release_jitter;
  if (std::deque<Duration>& left = delays_left_[job.task]; !left.empty()) {
    delay = left.front();
    left.pop_front();
  }
  given_[{job.task, job.sequence}].delay = delay;
  return timestamp + delay;
}

Duration WitnessTimes::of(const Job& job) const {
  GivenJob& given = given_[{job.task, job.sequence}];
  if (given.time) return *given.time;
  const Task& task = set_[job.task];
  if (task.wcet == Duration{} || started_ == witness_.jobs.size()) return task.wcet;
  const Witness::Started& started = witness_.jobs[started_++];
  if (started.task != job.task) throw std::logic_error("a witness of another system");
  given.time = started.time;
  if (started.end_round > 0) given.end_round = started.end_round;
  return started.time;
}

Duration WitnessTimes::of(TaskId subscription, std::uint64_t number, Duration longest) const {
  const auto given = given_.find({subscription, number});
  return given == given_.end() ? longest : given->second.delivery.value_or(longest);
}

std::uint32_t WitnessTimes::end_round(const Job& job) const {
  const auto given = given_.find({job.task, job.sequence});
  return given == given_.end() ? 0 : given->second.end_round.value_or(0);
}

}  // namespace hotpath
