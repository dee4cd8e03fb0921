// SPDX-License-Identifier: Apache-2.0
#include "job_counts.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

using exact::add, exact::multiply;

namespace {

/// Number of cached windows: tens of MB for the largest graphs.
constexpr std::size_t kMaxKnown = 1000;

}  // namespace

void JobChange::start() {
  for (const std::size_t node : changed_) change_[node] = 0, open_[node / 64] = 0;
  changed_.clear();
}

void JobChange::add(std::size_t node, std::int64_t jobs) {
  change_[node] = exact::add(change_[node], jobs);
  const std::uint64_t bit = std::uint64_t{1} << (node % 64);
  if ((open_[node / 64] & bit) != 0) return;
  open_[node / 64] |= bit;
  changed_.push_back(node);
}

/// Largest number of input jobs that complete the join: at the start of the window one of its
/// inputs has no sample, and the others may have one.
std::int64_t JobChange::outputs(const BusyLevel::Node& join, const JobCounts& from) const {
  std::int64_t least = join.complete ? std::numeric_limits<std::int64_t>::max() - 1 : 0, most = 0;
  for (const std::size_t input : join.inputs) {
    const std::int64_t jobs = exact::add(from.jobs[input], change_[input]);
    least = std::min(least, jobs);
    most = std::max(most, jobs);
  }
  return std::min(least + 1, most);
}

std::int64_t JobChange::finish(const BusyLevel& level, const JobCounts& from, std::size_t target,
                               bool target_completes) {
  const bool joined = target != BusyLevel::kNone && level.nodes[target].joined;
  const std::size_t completed =
      joined && target_completes ? level.nodes[target].feeds.front() : BusyLevel::kNone;
  if (target != BusyLevel::kNone) add(target, 0);
  if (completed != BusyLevel::kNone) add(completed, 0);
  std::int64_t work = 0;
  for (std::size_t word = 0; word < open_.size(); ++word) {
    while (open_[word] != 0) {
      const std::size_t n = word * 64 + static_cast<std::size_t>(std::countr_zero(open_[word]));
      open_[word] &= open_[word] - 1;
      const BusyLevel::Node& node = level.nodes[n];
      std::int64_t& change = change_[n];
      if (!node.inputs.empty()) {
        change = std::max<std::int64_t>(0, outputs(node, from) - (n == completed ? 1 : 0)) - from.jobs[n];
      }
      work = exact::add(work, multiply(change - (n == target ? 1 : 0), node.work));
      if (n == target && !joined) --change;
      if (change == 0) continue;
      for (const std::size_t fed : node.feeds) add(fed, level.nodes[fed].inputs.empty() ? change : 0);
    }
  }
  return work;
}

void JobChange::apply(JobCounts& counts, std::int64_t work) const {
  for (const std::size_t node : changed_) counts.jobs[node] = exact::add(counts.jobs[node], change_[node]);
  counts.work = exact::add(counts.work, work);
}

const JobCounts& KnownCounts::at(const BusyLevel& level, const std::vector<std::int64_t>& timers,
                                 JobChange& scratch) {
  auto next = known_.lower_bound(timers);
  if (next != known_.end() && next->first == timers) return next->second;
  if (known_.size() >= kMaxKnown) known_.clear(), next = known_.end();
  if (next != known_.begin() && (next == known_.end() || next->first.front() != timers.front())) --next;
  JobCounts counts{std::vector<std::int64_t>(level.nodes.size(), 0), 0};
  const bool similar = next != known_.end() && next->first.front() == timers.front();
  if (similar) counts = next->second;
  scratch.start();
  for (std::size_t i = 0; i < level.timers.size(); ++i) {
    const std::int64_t more = timers[i + 1] - (similar ? next->first[i + 1] : 0);
    if (more == 0) continue;
    for (const std::size_t node : level.timers[i].nodes) scratch.add(node, more);
  }
  scratch.apply(counts, scratch.finish(level, counts, BusyLevel::kNone, false));
  return known_.emplace(timers, std::move(counts)).first->second;
}

}  // namespace hotpath
