// SPDX-License-Identifier: Apache-2.0
#include "nasri_2017.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <tuple>

#include "finished_jobs.hpp"
#include "hotpath/analysis/exact.hpp"

namespace hotpath {

namespace {

constexpr std::int64_t kNoTime = std::numeric_limits<std::int64_t>::max();

/// A state: the jobs in `finished` are done, and the processor becomes available within [earliest,
/// latest].
struct State {
  FinishedJobs finished;
  std::int64_t earliest = 0, latest = 0;
};

class Exploration {
 public:
  Exploration(const std::vector<SagJob>& jobs, const SagLimits& limits)
      : limits_(limits), order_(jobs.size()) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    const auto by_priority = [&](std::size_t a, std::size_t b) {
      return std::tuple(jobs[a].priority, jobs[a].task, jobs[a].job) <
             std::tuple(jobs[b].priority, jobs[b].task, jobs[b].job);
    };
    std::vector<std::size_t> ranked = order_;
    std::sort(ranked.begin(), ranked.end(), by_priority);
    std::vector<std::uint32_t> rank(jobs.size());
    for (std::size_t r = 0; r < ranked.size(); ++r) {
      if (r > 0 && !by_priority(ranked[r - 1], ranked[r])) {
        throw AnalysisError("two jobs have the number " + std::to_string(jobs[ranked[r]].job) + " of task " +
                            std::to_string(jobs[ranked[r]].task) +
                            " and equal priorities; give the jobs of a task distinct numbers");
      }
      rank[ranked[r]] = static_cast<std::uint32_t>(r);
    }
    std::sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
      return std::pair(jobs[a].arrival_min, rank[a]) < std::pair(jobs[b].arrival_min, rank[b]);
    });
    for (const std::size_t i : order_) {
      jobs_.push_back({jobs[i], rank[i]});
    }
    finish_.resize(jobs.size(), {kNoTime, std::numeric_limits<std::int64_t>::min()});
  }

  SagResult run() {
    const auto give_up = std::chrono::steady_clock::now() + limits_.time;
    SagResult result;
    result.states = 1;
    std::vector<State> level(1), next;
    for (std::size_t depth = 0; depth < jobs_.size() && result.end == SagEnd::complete; ++depth) {
      next.clear();
      std::size_t bytes = 0, expanded = 0;
      for (const State& s : level) {
        const std::size_t before = next.size();
        expand(s, next);
        result.edges += next.size() - before;
        bytes += sizeof(State) + s.finished.bytes();
        for (std::size_t i = before; i < next.size(); ++i) bytes += sizeof(State) + next[i].finished.bytes();
        if (bytes > limits_.memory) {
          result.end = SagEnd::memory_limit;
          break;
        }
        if (++expanded % 256 == 1 && std::chrono::steady_clock::now() > give_up) {
          result.end = SagEnd::time_limit;
          break;
        }
      }
      merge(next);
      result.states += next.size();
      std::swap(level, next);
    }
    result.schedulable = result.end == SagEnd::complete;
    result.finish.resize(jobs_.size());
    for (std::size_t i = 0; i < jobs_.size(); ++i) {
      result.finish[order_[i]] = finish_[i];
      if (finish_[i].latest > jobs_[i].job.deadline) result.schedulable = false;
    }
    return result;
  }

 private:
  struct RankedJob {
    SagJob job;
    std::uint32_t rank;
  };

  /// Section IV of Nasri and Brandenburg: the jobs that can start next, and when.
  void expand(const State& s, std::vector<State>& successors) {
    // The processor idles at most until some job has certainly arrived.
    std::int64_t certain = kNoTime;
    candidates_.clear();
    for (std::uint32_t i = s.finished.first_missing(); i < jobs_.size(); ++i) {
      const RankedJob& j = jobs_[i];
      if (j.job.arrival_min > std::max(s.latest, certain)) break;
      if (s.finished.contains(i)) continue;
      certain = std::min(certain, j.job.arrival_max);
      candidates_.push_back(i);
    }
    const std::int64_t latest_idle = std::max(s.latest, certain);
    std::sort(candidates_.begin(), candidates_.end(),
              [&](std::uint32_t a, std::uint32_t b) { return jobs_[a].rank < jobs_[b].rank; });
    std::int64_t higher_arrived = kNoTime;  // when some higher-priority job has certainly arrived
    for (const std::uint32_t i : candidates_) {
      const SagJob& j = jobs_[i].job;
      const std::int64_t earliest_start = std::max(s.earliest, j.arrival_min);
      const std::int64_t latest_start =
          std::min(latest_idle, higher_arrived == kNoTime ? kNoTime : higher_arrived - 1);
      higher_arrived = std::min(higher_arrived, j.arrival_max);
      if (earliest_start > latest_start) continue;
      State next{s.finished, exact::add(earliest_start, j.cost_min), exact::add(latest_start, j.cost_max)};
      next.finished.insert(i);
      finish_[i].earliest = std::min(finish_[i].earliest, next.earliest);
      finish_[i].latest = std::max(finish_[i].latest, next.latest);
      successors.push_back(std::move(next));
    }
  }

  /// Merges states with the same finished jobs and intersecting intervals.
  static void merge(std::vector<State>& states) {
    std::sort(states.begin(), states.end(), [](const State& a, const State& b) {
      return std::pair(a.finished.hash(), a.earliest) < std::pair(b.finished.hash(), b.earliest);
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < states.size(); ++i) {
      State* last = kept > 0 ? &states[kept - 1] : nullptr;
      if (last && last->latest >= states[i].earliest && last->finished == states[i].finished) {
        last->latest = std::max(last->latest, states[i].latest);
      } else {
        if (kept != i) states[kept] = std::move(states[i]);
        ++kept;
      }
    }
    states.resize(kept);
  }

  SagLimits limits_;
  std::vector<std::size_t> order_;  // by release
  std::vector<RankedJob> jobs_;     // in the order of `order_`
  std::vector<SagResult::Finish> finish_;
  std::vector<std::uint32_t> candidates_;
};

}  // namespace

SagResult nasri_2017(const std::vector<SagJob>& jobs, const SagLimits& limits) {
  if (jobs.empty()) throw AnalysisError("nasri_2017: there are no jobs");
  for (const SagJob& j : jobs) {
    if (j.arrival_min < 0 || j.arrival_min > j.arrival_max || j.cost_min < 0 || j.cost_min > j.cost_max) {
      throw AnalysisError("nasri_2017: job " + std::to_string(j.job) + " of task " + std::to_string(j.task) +
                          " must have 0 <= arrival min <= arrival max and 0 <= cost min <= cost max");
    }
  }
  return Exploration(jobs, limits).run();
}

ResponseTimes sag_response_times(const std::vector<SagJob>& jobs, const SagResult& result,
                                 std::size_t tasks) {
  ResponseTimes bounds(tasks);
  if (result.end != SagEnd::complete) return bounds;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    std::optional<std::int64_t>& bound = bounds.at(jobs[i].task);
    bound = std::max(bound.value_or(0), result.finish[i].latest - jobs[i].arrival_min);
  }
  return bounds;
}

}  // namespace hotpath
