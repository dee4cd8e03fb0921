// SPDX-License-Identifier: Apache-2.0
#include "explored_paths.hpp"

#include <algorithm>
#include <cassert>
#include <stdexcept>

namespace hotpath {

Witness ExploredPaths::witness(const Edge& last) const {
  Witness witness;
  std::vector<std::int64_t> point = last.zone.point(last.instant);
  std::int64_t instant = point[last.instant] - last.from.origin;
  const auto note_releases = [&](const Edge& edge) {
    for (const auto& [timer, timestamp] : edge.released) {
      witness.delays.emplace_back(timer, Time{} + Duration(point[edge.instant]) - timestamp);
    }
  };
  note_releases(last);
  for (const Edge* edge = &last; edge->from.state != kNowhere;) {
    const auto [before, at] = edge_to(edge->from, point);
    edge = before;
    point = at;
    instant += edge->to.origin - edge->from.origin;
    note_releases(*edge);
    for (auto job = edge->starts.rbegin(); job != edge->starts.rend(); ++job)
      witness.jobs.emplace_back(job->first, Duration(point[job->second] - point[edge->instant]));
  }
  std::reverse(witness.jobs.begin(), witness.jobs.end());
  std::reverse(witness.delays.begin(), witness.delays.end());
  witness.instant = Time{} + Duration(instant);
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
    if (leads_here) return {&edge, zone.point(edge.instant)};
  }
  assert(false && "no edge leads to a point of a state");
  throw ExplorationRefused("no schedule leads to a state");
}

WitnessTimes::WitnessTimes(const TaskSet& set, const Witness& witness)
    : set_(set), witness_(witness), delays_left_(set.size()) {
  for (const auto& [timer, delay] : witness.delays) delays_left_[timer].push_back(delay);
}

Time WitnessTimes::due(JobRef job, Time timestamp) const {
  Duration delay = set_[job.task].release_jitter;
  if (std::deque<Duration>& left = delays_left_[job.task]; !left.empty()) {
    delay = left.front();
    left.pop_front();
  }
  given_delays_.emplace_back(job, delay);
  return timestamp + delay;
}

Duration WitnessTimes::of(const Job& job) const {
  if (!given_.empty() && given_.back().first == job.ref()) return given_.back().second;
  const Task& task = set_[job.task];
  if (task.wcet == Duration{} || given_.size() == witness_.jobs.size()) return task.wcet;
  const auto [started, time] = witness_.jobs[given_.size()];
  if (started != job.task) throw std::logic_error("a witness of another system");
  given_.emplace_back(job.ref(), time);
  return time;
}

}  // namespace hotpath
