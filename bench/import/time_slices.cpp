// SPDX-License-Identifier: Apache-2.0
#include "import/time_slices.hpp"

#include <algorithm>
#include <deque>
#include <map>
#include <numeric>
#include <set>

#include "hotpath/core/platform.hpp"

namespace hotpath::imports {

namespace {

/// A thread that gets a processor starts its next job sooner.
constexpr Duration kPrompt = std::chrono::microseconds(100);

/// Threads that run on the same processors, and their jobs.
struct Pool {
  std::set<std::int32_t> processors;
  std::set<std::uint32_t> threads;
  std::vector<std::size_t> jobs;  // in the order of starts
};

class Slices {
 public:
  Slices(const RecordedWindow& window, const Pool& pool) : window_(window), pool_(pool) {}

  /// Adds the time on a processor of each job to `own`.
  void follow(std::vector<Duration>& own) {
    std::vector<std::pair<Time, std::size_t>> instants;  // the end of a job before the start of another
    for (const std::size_t j : pool_.jobs) {
      instants.emplace_back(job(j).finish, 2 * j);
      instants.emplace_back(job(j).start, 2 * j + 1);
    }
    std::ranges::sort(instants);
    for (const std::size_t j : pool_.jobs) {
      own[j] = {};
      starts_.push_back(j);
    }
    for (const auto& [at, what] : instants) {
      rotate(at);
      what % 2 == 1 ? start(what / 2) : finish(what / 2);
    }
    for (const auto& [j, used] : used_) own[j] = used;
  }

  [[nodiscard]] bool shares() const { return shares_; }

 private:
  struct OnProcessor {
    std::size_t job;
    Time since, slice_began;
  };

  const tracing::Job& job(std::size_t j) const { return window_.jobs[j]; }

  /// Whether another thread gets the processor that becomes free then: it starts a job.
  bool starts_then(Time at) const { return !starts_.empty() && job(starts_.front()).start - at <= kPrompt; }

  /// Gives processors to waiting threads where time slices end before `until`.
  void rotate(Time until) {
    while (!waiting_.empty() && !running_.empty()) {
      const auto first = std::ranges::min_element(running_, {}, &OnProcessor::slice_began);
      const Time at = std::max(first->slice_began + Platform{}.time_slice, now_);
      if (at >= until || starts_then(at)) break;
      displace(first, at);
      resume(at);
    }
    now_ = until;
  }

  void displace(std::vector<OnProcessor>::iterator of, Time at) {
    used_[of->job] += at - of->since;
    waiting_.push_back(of->job);
    running_.erase(of);
    shares_ = true;
  }

  void resume(Time at) {
    running_.push_back({waiting_.front(), at, at});
    waiting_.pop_front();
  }

  void start(std::size_t j) {
    const Time at = job(j).start;
    starts_.pop_front();
    if (running_.size() >= pool_.processors.size())
      displace(std::ranges::min_element(running_, {}, &OnProcessor::slice_began), at);
    const auto kept = kept_.find(job(j).thread);
    const bool keeps = kept != kept_.end() && at - kept->second.first <= kPrompt;
    running_.push_back({j, at, keeps ? kept->second.second : at});
  }

  void finish(std::size_t j) {
    const Time at = job(j).finish;
    const auto of = std::ranges::find(running_, j, &OnProcessor::job);
    if (of == running_.end()) {  // it must have got a processor
      std::erase(waiting_, j);
      return;
    }
    used_[j] += at - of->since;
    kept_[job(j).thread] = {at, of->slice_began};
    running_.erase(of);
    if (!waiting_.empty() && !starts_then(at)) resume(at);
  }

  const RecordedWindow& window_;
  const Pool& pool_;
  Time now_ = Time::min();
  std::vector<OnProcessor> running_;
  std::deque<std::size_t> waiting_, starts_;  // jobs; those that have not started
  std::map<std::size_t, Duration> used_;      // by job
  std::map<std::uint32_t, std::pair<Time, Time>>
      kept_;  // by thread: end of its last job, and its slice's begin
  bool shares_ = false;
};

std::vector<Pool> pools_of(const tracing::System& system, const RecordedWindow& window) {
  std::vector<Pool> pools;
  for (std::uint32_t t = 0; t < system.threads.size(); ++t) {
    Pool own{{}, {t}, {}};
    for (const std::int32_t p : usual_processors(system.threads[t])) own.processors.insert(p);
    for (auto other = pools.begin(); other != pools.end();) {
      const bool apart =
          std::ranges::none_of(other->processors, [&](std::int32_t p) { return own.processors.contains(p); });
      if (apart) {
        ++other;
        continue;
      }
      own.processors.merge(other->processors);
      own.threads.merge(other->threads);
      other = pools.erase(other);
    }
    pools.push_back(std::move(own));
  }
  std::map<std::uint32_t, Time> busy_until;  // by thread: jobs within jobs of their thread do not count
  for (std::size_t j = 0; j < window.jobs.size(); ++j) {
    const tracing::Job& job = window.jobs[j];
    if (!job.ended || job.start < busy_until[job.thread]) continue;
    busy_until[job.thread] = job.finish;
    std::ranges::find_if(pools, [&](const Pool& pool) {
      return pool.threads.contains(job.thread);
    })->jobs.push_back(j);
  }
  return pools;
}

}  // namespace

std::size_t follow_time_slices(const tracing::System& system, const RecordedWindow& window,
                               const std::vector<int>& level, std::vector<Duration>& own) {
  std::size_t sharing = 0;
  for (const Pool& pool : pools_of(system, window)) {
    // With several processors, the rule does not find who lost one.
    if (pool.processors.size() != 1 || pool.threads.size() < 2) continue;
    if (std::ranges::any_of(pool.threads, [&](std::uint32_t t) { return level[t] > 0; })) continue;
    std::vector<Duration> times = own;
    Slices slices(window, pool);
    slices.follow(times);
    if (!slices.shares()) continue;
    own = std::move(times);
    sharing += pool.threads.size();
  }
  return sharing;
}

}  // namespace hotpath::imports
