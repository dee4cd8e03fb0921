// SPDX-License-Identifier: Apache-2.0
#include "hotpath/core/workload.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace hotpath {

namespace {

std::vector<Duration> wcets(const TaskSet& set) {
  std::vector<Duration> all;
  all.reserve(set.size());
  for (const Task& task : set.tasks) all.push_back(task.wcet);
  return all;
}

/// Uniform in [0, count), count <= 2^63: the high half of a 64 x 64 bit product.
std::uint64_t scale(std::uint64_t random, std::uint64_t count) {
  __extension__ using Wide = unsigned __int128;
  return static_cast<std::uint64_t>((Wide{random} * count) >> 64);
}

}  // namespace

TaskSet with_releases(TaskSet set, const ExecutionTimes& times) {
  for (Task& task : set.tasks) {
    if (task.release_jitter > Duration{}) task.release_delays = times.release_delays();
  }
  return set;
}

UniformReleases::UniformReleases(const TaskSet& set, std::uint64_t seed) : seed_(mix(~mix(seed))) {
  for (const Task& task : set.tasks) jitter_.push_back(task.release_jitter);
}

Time UniformReleases::due(JobRef job, Time timestamp) const {
  const std::uint64_t count = 1 + static_cast<std::uint64_t>(jitter_[job.task].count());
  const std::uint64_t random = mix(mix(seed_ ^ job.task) ^ job.sequence);
  return timestamp + Duration(static_cast<std::int64_t>(scale(random, count)));
}

WorstCaseTimes::WorstCaseTimes(const TaskSet& set) : wcet_(wcets(set)) {}

UniformTimes::UniformTimes(const TaskSet& set, std::uint64_t seed) : seed_(mix(seed)) {
  range_.reserve(set.size());
  for (const Task& task : set.tasks) {
    assert(task.bcet <= task.wcet);
    range_.push_back({task.bcet.count(), 1 + static_cast<std::uint64_t>((task.wcet - task.bcet).count())});
  }
}

std::uint64_t UniformTimes::draw(const Job& job, std::uint64_t count) const {
  return scale(mix(mix(seed_ ^ job.task) ^ job.sequence), count);
}

Duration UniformTimes::of(const Job& job) const {
  const Range& range = range_[job.task];
  return Duration(range.bcet_ns + static_cast<std::int64_t>(draw(job, range.count)));
}

MeasuredTimes::MeasuredTimes(const TaskSet& set, std::vector<Values> values, std::uint64_t seed, Draw draw)
    : values_(std::move(values)), others_(set, seed), draw_(draw), place_(mix(seed)) {}

Duration MeasuredTimes::of(const Job& job) const {
  const Values& values = values_[job.task];
  if (!values) return others_.of(job);
  const std::uint64_t count = values->size();
  return (*values)[draw_ == Draw::in_order ? (scale(place_, count) + job.sequence) % count
                                           : others_.draw(job, count)];
}

ReplayedTimes::ReplayedTimes(const TaskSet& set, const Trace& trace)
    : measured_(set.size()), wcet_(wcets(set)) {
  for (const JobRecord& r : trace.jobs) {
    if (r.outcome == Outcome::ran) measured_[r.job.task].push_back({r.job.sequence, r.duration()});
  }
  for (auto& of_task : measured_) {
    std::sort(of_task.begin(), of_task.end(),
              [](const Measured& a, const Measured& b) { return a.sequence < b.sequence; });
  }
}

Duration ReplayedTimes::of(const Job& job) const {
  const auto& of_task = measured_[job.task];
  if (of_task.empty()) return wcet_[job.task];
  const auto later =
      std::upper_bound(of_task.begin(), of_task.end(), job.sequence,
                       [](std::uint64_t sequence, const Measured& m) { return sequence < m.sequence; });
  return later == of_task.begin() ? of_task.front().time : std::prev(later)->time;
}

}  // namespace hotpath
