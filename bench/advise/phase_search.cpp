// SPDX-License-Identifier: Apache-2.0
#include "advise/phase_search.hpp"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <map>
#include <numeric>

#include "program/parallel.hpp"

namespace hotpath::advise {

namespace {

using Microseconds = std::chrono::microseconds;

constexpr int kPoints = 16;     // of the coarse grid
constexpr int kRefinement = 4;  // the step of a grid to that of the next
constexpr int kLevels = 4;
constexpr int kMostSweeps = 4;  // over all timers on one grid

/// Timers that move together.
struct Move {
  std::vector<TaskId> timers;
  Duration range{};
};

std::vector<Move> moves_of(const TaskSet& set, const std::vector<TaskId>& together) {
  std::vector<Move> moves;
  for (TaskId id = 0; id < set.size(); ++id) {
    if (set[id].kind == TaskKind::timer) moves.push_back({{id}, range_of_phases(set, {id})});
  }
  if (together.size() > 1 && together.size() < moves.size()) {
    moves.push_back({together, range_of_phases(set, together)});
  }
  // Only differences of phases matter.
  if (!moves.empty()) moves.erase(moves.begin());
  return moves;
}

class Search {
 public:
  Search(const TaskSet& set, const std::vector<TaskId>& together, const ScorePhases& evaluate,
         const PhaseSearchOptions& options)
      : set_(set), moves_(moves_of(set, together)), evaluate_(evaluate), options_(options) {}

  FoundPhases run(const std::vector<FirstTimestamps>& starts) {
    for (const FirstTimestamps& start : starts) {
      current_ = normal(start);
      if (!evaluate({current_}, PhaseScore{}) || !descend(0)) break;
    }
    if (complete_) current_ = best_;
    for (int level = 1; level < kLevels && complete_; ++level) descend(level);
    if (best_.empty()) return {normal(starts.front()), {}, 0, false};
    return {best_, known_.at(best_).score, known_.size(), complete_};
  }

 private:
  struct Known {
    PhaseScore score;
    bool whole = true;  // otherwise it may be greater
  };

  /// Takes the timers below their periods, on whole microseconds.
  FirstTimestamps normal(FirstTimestamps first) const {
    for (TaskId id = 0; id < first.size(); ++id) {
      if (set_[id].kind != TaskKind::timer) continue;
      first[id] = std::chrono::floor<Microseconds>(first[id]) % set_[id].period;
    }
    return first;
  }

  /// False: it was stopped.
  bool descend(int level) {
    bool better = true;
    for (int sweep = 0; better && sweep < kMostSweeps; ++sweep) {
      better = false;
      for (const Move& move : moves_) {
        const PhaseScore before = known_.at(current_).score;
        if (!improve(move, level)) return false;
        better = better || known_.at(current_).score < before;
      }
    }
    return true;
  }

  bool improve(const Move& move, int level) {
    std::int64_t fraction = kPoints;
    for (int l = 0; l < level; ++l) fraction *= kRefinement;
    const Duration step =
        std::max<Duration>(Microseconds(1), std::chrono::floor<Microseconds>(move.range / fraction));
    std::vector<FirstTimestamps> points;
    const int least = level == 0 ? 0 : -kRefinement, most = level == 0 ? kPoints - 1 : kRefinement;
    for (int k = least; k <= most; ++k) {
      FirstTimestamps& point = points.emplace_back(current_);
      for (const TaskId id : move.timers) {
        point[id] = (point[id] + k * step) % set_[id].period;
        if (point[id] < Duration::zero()) point[id] += set_[id].period;
      }
    }
    if (!evaluate(points, known_.at(current_).score)) return false;
    const std::size_t middle = middle_of_best(points, level == 0);
    if (known_.at(points[middle]).score > known_.at(current_).score)
      return true;  // the current phases are not on the grid
    // Of equal phases, those that the search came to later lie further inside of their neighbours.
    const bool of_best = current_ == best_;
    current_ = points[middle];
    const PhaseScore best = known_.at(best_).score, now = known_.at(current_).score;
    if (now < best || (now == best && of_best)) best_ = current_;
    return true;
  }

  /// The middle of the longest run of points with the best score.
  std::size_t middle_of_best(const std::vector<FirstTimestamps>& points, bool circular) const {
    std::vector<PhaseScore> scores;
    scores.reserve(points.size());
    for (const FirstTimestamps& point : points) scores.push_back(known_.at(point).score);
    const PhaseScore best =
        *std::ranges::min_element(scores, [](const auto& a, const auto& b) { return a < b; });
    const std::size_t size = scores.size();
    std::size_t longest = 0, middle = 0;
    for (std::size_t begin = 0; begin < size; ++begin) {
      std::size_t length = 0;
      while (length < size && (circular || begin + length < size) &&
             scores[(begin + length) % size] == best) {
        ++length;
      }
      if (length <= longest) continue;
      longest = length;
      middle = (begin + (length - 1) / 2) % size;
    }
    return middle;
  }

  /// Makes the scores of all points known, as far as they are not greater than `enough`. False: it was
  /// stopped.
  bool evaluate(const std::vector<FirstTimestamps>& points, const PhaseScore& enough) {
    std::vector<FirstTimestamps> unknown;
    for (const FirstTimestamps& point : points) {
      const auto known = known_.find(point);
      if (known != known_.end() && (known->second.whole || known->second.score > enough)) continue;
      if (std::ranges::count(unknown, point) == 0) unknown.push_back(point);
    }
    if (!unknown.empty() && options_.stop()) complete_ = false;
    if (!complete_) return false;
    std::vector<PhaseScore> scores(unknown.size());
    program::for_each_index(unknown.size(), options_.threads,
                            [&](std::size_t i) { scores[i] = evaluate_(unknown[i], enough); });
    for (std::size_t i = 0; i < unknown.size(); ++i) {
      known_[unknown[i]] = {scores[i], !(scores[i] > enough)};
      if (best_.empty()) best_ = unknown[i];
    }
    return true;
  }

  const TaskSet& set_;
  const std::vector<Move> moves_;
  const ScorePhases& evaluate_;
  const PhaseSearchOptions& options_;
  std::map<FirstTimestamps, Known> known_;
  FirstTimestamps current_, best_;
  bool complete_ = true;
};

}  // namespace

Duration range_of_phases(const TaskSet& set, const std::vector<TaskId>& moved) {
  std::int64_t range = 1, longest = 1;
  for (const TaskId id : moved) {
    const std::int64_t period = set[id].period.count();
    longest = std::max(longest, period);
    for (TaskId other = 0; other < set.size(); ++other) {
      if (set[other].kind != TaskKind::timer || std::ranges::count(moved, other) > 0) continue;
      const std::int64_t common = std::gcd(period, set[other].period.count());
      if (__builtin_mul_overflow(range / std::gcd(range, common), common, &range)) return Duration(longest);
      if (range >= longest) range = longest;
    }
  }
  return Duration(range);
}

FoundPhases search_phases(const TaskSet& set, const std::vector<TaskId>& together,
                          const std::vector<FirstTimestamps>& starts, const ScorePhases& evaluate,
                          const PhaseSearchOptions& options) {
  assert(!starts.empty());
  return Search(set, together, evaluate, options).run(starts);
}

}  // namespace hotpath::advise
