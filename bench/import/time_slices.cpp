// SPDX-License-Identifier: Apache-2.0
#include "import/time_slices.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "hotpath/core/platform.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

/// Time slices explain a recording if at most one in so many changes of hands came too early.
constexpr std::size_t kExplains = 20;

/// The export separates simultaneous events of several processors by a few nanoseconds.
constexpr Duration kInstant{100};
/// A job that ends so soon did not lose its processor before.
constexpr Duration kPrompt = std::chrono::microseconds(100);

/// Threads that run on the same processors, and their jobs.
struct Pool {
  std::set<std::int32_t> processors;
  std::set<std::uint32_t> threads;
  std::vector<std::size_t> jobs;  // in the order of starts
};

/// Replays how the simulated operating system gives processors to threads of the ordinary policy, from the
/// recorded instants at which they became ready, started and ended jobs.
class Slices {
 public:
  Slices(const RecordedWindow& window, const Pool& pool)
      : window_(window), processors_(pool.processors.size()) {
    find_changes(pool);
  }

  /// Adds the time on a processor of each job to `own`.
  void follow(std::vector<Duration>& own) {
    for (auto next = changes_.begin(); next != changes_.end();) {
      const auto end = std::find_if(
          next, changes_.end(), [at = next->at](const Change& change) { return change.at - at > kInstant; });
      std::stable_sort(next, end, [](const Change& x, const Change& y) { return x.kind < y.kind; });
      rotate(next->at);
      for (; next != end && next->kind <= Kind::ready; ++next)
        next->kind == Kind::finish ? finish(*next) : make_ready(next->thread);
      rotate_expired();
      leave();
      for (; next != end; ++next) next->kind == Kind::start ? start(*next) : finish(*next);
      leave();
    }
    for (const auto& [j, used] : used_) own[j] = used;
  }

  [[nodiscard]] const TimeSlices& found() const { return found_; }

 private:
  enum class Kind : std::uint8_t { finish, ready, start, finish_at_once };  // the order at one instant

  struct Change {
    Time at;
    Kind kind = Kind::ready;
    Time start;  // of its job: threads that become ready together wait in this order
    std::size_t job = 0;
    std::uint32_t thread = 0;
    bool sleeps = false;  // after the end of the job
  };

  struct Thread {
    bool queues = false, on_processor = false, works = false;
    bool leaves = false;  // sleeps as soon as it has a processor
    std::size_t job = 0;
    Time since;  // when it got or lost its processor, or started its job
    Time slice_end;
    Duration slice_left{};
  };

  void find_changes(const Pool& pool) {
    std::map<std::uint32_t, std::size_t> previous;  // by thread: the end of its last job in changes_
    for (const std::size_t j : pool.jobs) {
      const tracing::Job& job = window_.jobs[j];
      const JobRecord& record = window_.records[j];
      const Time ready = record.job.task == kNoTask ? job.start : std::min(record.job.timestamp, job.start);
      const auto [last, is_first] = previous.try_emplace(job.thread, 0);
      const bool sleeps = is_first || changes_[last->second].at < ready;
      if (!is_first) changes_[last->second].sleeps = sleeps;
      if (sleeps) changes_.push_back({ready, Kind::ready, job.start, j, job.thread});
      changes_.push_back({job.start, Kind::start, job.start, j, job.thread});
      last->second = changes_.size();
      const Kind end = job.finish > job.start ? Kind::finish : Kind::finish_at_once;
      changes_.push_back({job.finish, end, job.start, j, job.thread, true});
    }
    std::ranges::stable_sort(changes_, {}, [](const Change& c) { return std::pair(c.at, c.start); });
  }

  /// Gives processors to waiting threads where time slices end before `until`.
  void rotate(Time until) {
    while (queue_.size() > processors_) {
      const auto of = [&](std::uint32_t t) { return displaced_at(t); };
      const auto on = std::span(queue_).first(processors_);
      const Time at = of(*std::ranges::min_element(on, {}, of));
      if (at >= until) break;
      now_ = at;
      rotate_expired();
      leave();
    }
    now_ = until;
  }

  /// When the thread on a processor loses it to one that waits. One that ends its job promptly keeps it.
  Time displaced_at(std::uint32_t thread) const {
    const Thread& t = threads_.at(thread);
    const Time at = std::max(t.slice_end, now_);
    return t.works && window_.jobs[t.job].finish - at <= kPrompt ? kNever : at;
  }

  void rotate_expired() {
    for (std::size_t i = 0; i < processors_ && queue_.size() > processors_;) {
      const std::uint32_t t = queue_[i];
      if (displaced_at(t) > now_) {
        ++i;
        continue;
      }
      queue_.erase(queue_.begin() + static_cast<std::ptrdiff_t>(i));
      queue_.push_back(t);
      assign();
      threads_[t].slice_left = Platform{}.time_slice;
    }
  }

  /// Threads that have ended their work sleep if they have a processor.
  void leave() {
    for (std::size_t i = 0; i < std::min(processors_, queue_.size());) {
      Thread& t = threads_[queue_[i]];
      if (!t.leaves) {
        ++i;
        continue;
      }
      t.leaves = t.queues = t.on_processor = false;
      queue_.erase(queue_.begin() + static_cast<std::ptrdiff_t>(i));
      assign();
    }
  }

  /// The first threads of the queue have the processors.
  void assign() {
    for (std::size_t i = 0; i < queue_.size(); ++i) {
      Thread& t = threads_[queue_[i]];
      const bool gets = i < processors_;
      if (t.on_processor == gets) continue;
      t.on_processor = gets;
      const Time since = std::exchange(t.since, now_);
      if (gets) {
        t.slice_end = now_ + t.slice_left;
        found_.displaced += t.works && now_ > since;
        continue;
      }
      t.slice_left = std::max(Duration::zero(), t.slice_end - now_);
      if (t.works) used_[t.job] += now_ - since;
    }
  }

  void make_ready(std::uint32_t thread) {
    Thread& t = threads_[thread];
    t.leaves = false;
    if (std::exchange(t.queues, true)) return;
    queue_.push_back(thread);
    t.slice_left = Platform{}.time_slice;
    assign();
  }

  /// The recording contradicts the replay: the thread has a processor. The thread whose time slice ends first
  /// loses it.
  void give(std::uint32_t thread) {
    ++found_.early;
    if (found_.first_early == Time{}) found_.first_early = now_;
    std::erase(queue_, thread);
    const auto on = std::span(queue_).first(processors_);
    std::uint32_t& loses =
        *std::ranges::min_element(on, {}, [&](std::uint32_t t) { return threads_[t].slice_end; });
    const std::uint32_t displaced = std::exchange(loses, thread);
    queue_.push_back(displaced);
    assign();
    threads_[displaced].slice_left = Platform{}.time_slice;
  }

  void start(const Change& change) {
    Thread& t = threads_[change.thread];
    if (!t.on_processor) give(change.thread);
    t.works = true;
    t.job = change.job;
    t.since = now_;
    used_[t.job] = {};
  }

  void finish(const Change& change) {
    Thread& t = threads_[change.thread];
    if (!t.on_processor) give(change.thread);
    used_[t.job] += now_ - t.since;
    t.works = false;
    t.leaves = change.sleeps;
  }

  const RecordedWindow& window_;
  const std::size_t processors_;
  std::vector<Change> changes_;
  Time now_ = Time::min();
  std::map<std::uint32_t, Thread> threads_;
  std::vector<std::uint32_t> queue_;      // threads; the first ones have the processors
  std::map<std::size_t, Duration> used_;  // by job
  TimeSlices found_;
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

void follow_time_slices(const tracing::System& system, const RecordedWindow& window,
                        Displacement& displacement) {
  for (const Pool& pool : pools_of(system, window)) {
    if (pool.processors.empty() || pool.threads.size() <= pool.processors.size()) continue;
    std::vector<Duration> times = displacement.own;
    Slices slices(window, pool);
    slices.follow(times);
    const TimeSlices& found = slices.found();
    const bool explains = found.early * kExplains <= found.displaced;
    const bool ordinary =
        std::ranges::all_of(pool.threads, [&](std::uint32_t t) { return displacement.level[t] == 0; });
    if (found.displaced == 0 || (!explains && (!ordinary || pool.processors.size() > 1))) continue;
    displacement.own = std::move(times);
    for (const std::uint32_t t : pool.threads) {
      displacement.level[t] = 0;
      displacement.processors[t].assign(pool.processors.begin(), pool.processors.end());
    }
    TimeSlices& all = displacement.slices;
    all.threads += pool.threads.size();
    all.jobs += pool.jobs.size();
    all.displaced += found.displaced;
    all.early += found.early;
    if (all.first_early == Time{}) all.first_early = found.first_early;
  }
}

std::string sentence(const TimeSlices& slices, Time epoch) {
  std::string text = program::text(
      "%zu threads share processors in time slices, whose ends a trace does not show: the execution times of "
      "their jobs are those that slices of %.0f ms give the recorded starts and ends. In %zu jobs a "
      "processor "
      "changed hands %zu times",
      slices.threads, to_ms(Platform{}.time_slice), slices.jobs, slices.displaced);
  if (slices.early == 0) return text + ".";
  return text + program::text("; %zu times sooner than after such a slice, first at %.3f ms.", slices.early,
                              to_ms(slices.first_early - epoch));
}

}  // namespace hotpath::imports
