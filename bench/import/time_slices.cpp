// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_window.hpp"

#include <algorithm>
#include <cassert>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "hotpath/core/platform.hpp"
#include "program/text.hpp"

namespace hotpath::imports {

namespace {

/// Time slices explain a recording if at most one in so many changes of hands came too early.
constexpr std::size_t kExplains = 20;

/// A thread that has a processor starts its next job sooner.
constexpr Duration kIdlesFor = std::chrono::milliseconds(1);

/// A thread takes turns if more than one in so many jobs lost its processor. Fewer do not change its median.
constexpr std::size_t kMatters = 10;

/// The export separates simultaneous events of several processors by a few nanoseconds.
constexpr Duration kOneInstant{100};
/// A job that ends so soon did not lose its processor before.
constexpr Duration kPrompt = std::chrono::microseconds(100);

/// Threads that run on the same processors, and their jobs.
struct Pool {
  std::set<std::int32_t> processors;
  std::set<std::uint32_t> threads;
  std::vector<std::size_t> jobs;  // in the order of starts
};

/// Replays how the simulated operating system gives processors to threads, from the recorded instants at
/// which they became ready, started and ended jobs. `level`: by thread; 0: the ordinary policy.
class Slices {
 public:
  Slices(const RecordedWindow& window, const Pool& pool, const std::vector<int>& level)
      : window_(window), processors_(pool.processors.size()) {
    for (const std::uint32_t t : pool.threads) threads_[t].level = level[t];
    find_changes(pool);
    for (auto next = changes_.begin(); next != changes_.end();) {
      const auto end = std::find_if(next, changes_.end(), [at = next->at](const Change& change) {
        return change.at - at > kOneInstant;
      });
      std::stable_sort(next, end, [](const Change& x, const Change& y) {
        return std::min(x.kind, Kind::start) < std::min(y.kind, Kind::start);
      });
      rotate(next->at);
      for (; next != end && next->kind <= Kind::ready; ++next)
        next->kind == Kind::finish ? finish(*next) : make_ready(next->thread);
      rotate_expired();
      for (; next != end; ++next) next->kind == Kind::start ? start(*next) : finish(*next);
      leave();
    }
  }

  /// Sets the time on a processor of each job, and the levels and processors of the threads.
  void set_times(const Pool& pool, Displacement& displacement) const {
    for (const auto& [j, used] : used_) displacement.own[j] = used;
    for (const auto& [id, thread] : threads_) {
      displacement.level[id] = thread.level;
      displacement.processors[id].assign(pool.processors.begin(), pool.processors.end());
    }
  }

  /// Whether at most one change of hands in kExplains came too early or too late, and so few jobs of each
  /// thread that appears to have a level, or not to use all of the processors.
  [[nodiscard]] bool explain(const tracing::System& system, const Displacement& apparent) const {
    const bool one_thread_contradicts = std::ranges::any_of(threads_, [&](const auto& of) {
      const auto& [id, t] = of;
      const bool fewer = usual_processors(system.threads[id]).size() < processors_;
      const std::size_t contradictions = (apparent.level[id] > t.level ? t.early : 0) + (fewer ? t.late : 0);
      return contradictions * kExplains > t.jobs;
    });
    return (found_.early + late_) * kExplains <= found_.displaced && !one_thread_contradicts;
  }

  /// Whether at least two threads of the ordinary policy took turns. Where most changes of hands came early,
  /// there were other reasons.
  [[nodiscard]] bool ordinary_threads_share() const {
    const auto takes_turns = [](const auto& of) {
      return of.second.level == 0 && of.second.displaced * kMatters > of.second.jobs;
    };
    return 2 * found_.early <= found_.displaced && std::ranges::count_if(threads_, takes_turns) > 1;
  }

  [[nodiscard]] const TimeSlices& found() const { return found_; }

 private:
  /// The order at one instant, except that the last two keep theirs.
  enum class Kind : std::uint8_t { finish, ready, start, finish_at_once };

  struct Change {
    Time at;
    Kind kind = Kind::ready;
    Time start;  // of its job: threads that become ready together wait in this order
    std::size_t job = 0;
    std::uint32_t thread = 0;
    bool sleeps = false;  // after the end of the job
  };

  struct Thread {
    int level = 0;
    bool queues = false, on_processor = false, works = false;
    bool leaves = false;  // sleeps as soon as it has a processor
    std::size_t job = 0, jobs = 0, displaced = 0, early = 0, late = 0;
    Time since;  // when it got or lost its processor, or started its job
    Time slice_end;
    Duration slice_left{};
  };

  void find_changes(const Pool& pool) {
    std::map<std::uint32_t, std::size_t> previous;  // by thread: the end of its last job in changes_
    for (const std::size_t j : pool.jobs) {
      const tracing::Job& job = window_.jobs[j];
      const Job& record = window_.records[j].job;
      const Time ready = record.task == kNoTask ? job.start : std::min(record.timestamp, job.start);
      const auto [last, is_first] = previous.try_emplace(job.thread, 0);
      const bool sleeps = is_first || changes_[last->second].at < ready;
      if (!is_first) changes_[last->second].sleeps = sleeps;
      if (sleeps) changes_.push_back({ready, Kind::ready, job.start, j, job.thread});
      changes_.push_back({job.start, Kind::start, job.start, j, job.thread});
      last->second = changes_.size();
      const bool at_once = job.finish - job.start <= kOneInstant;
      const Kind end = at_once ? Kind::finish_at_once : Kind::finish;
      changes_.push_back({job.finish, end, job.start, j, job.thread, true});
    }
    std::ranges::stable_sort(changes_, {}, [](const Change& c) { return std::pair(c.at, c.start); });
  }

  /// Gives processors to waiting threads where time slices end before `until`.
  void rotate(Time until) {
    while (one_waits_in_turn()) {
      Time at = kNever;
      for (std::size_t i = 0; i < processors_; ++i) at = std::min(at, displaced_at(threads_[queue_[i]]));
      if (at >= until) break;
      now_ = at;
      rotate_expired();
    }
    now_ = until;
  }

  /// Whether a thread waits that only others of the ordinary policy keep waiting.
  bool one_waits_in_turn() const {
    return queue_.size() > processors_ && threads_.at(queue_[processors_]).level == 0;
  }

  /// When the thread on a processor loses it to one that waits. One that ends its job promptly keeps it.
  Time displaced_at(const Thread& t) const {
    const Time at = std::max(t.slice_end, now_);
    return t.level > 0 || (t.works && window_.jobs[t.job].finish - at <= kPrompt) ? kNever : at;
  }

  void rotate_expired() {
    for (std::size_t i = 0; i < processors_ && one_waits_in_turn();) {
      Thread& t = threads_[queue_[i]];
      if (displaced_at(t) > now_) {
        ++i;
        continue;
      }
      std::rotate(place(i), place(i) + 1, queue_.end());
      assign();
      t.slice_left = Platform{}.time_slice;
    }
    leave();
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
      queue_.erase(place(i));
      assign();
    }
  }

  std::vector<std::uint32_t>::iterator place(std::size_t i) {
    return queue_.begin() + static_cast<std::ptrdiff_t>(i);
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
        const bool displaced = t.works && now_ > since;
        found_.displaced += displaced;
        t.displaced += displaced;
      } else {
        t.slice_left = std::max(Duration::zero(), t.slice_end - now_);
        if (t.works) used_[t.job] += now_ - since;
      }
    }
  }

  void make_ready(std::uint32_t thread) {
    Thread& t = threads_[thread];
    t.leaves = false;
    if (t.on_processor) t.since = now_;
    if (std::exchange(t.queues, true)) return;
    insert(thread, 0);
    t.slice_left = Platform{}.time_slice;
    assign();
  }

  /// Inserts behind the threads of its level, at `first` or later.
  void insert(std::uint32_t thread, std::size_t first) {
    const auto below = [&](std::uint32_t other) { return threads_[other].level < threads_[thread].level; };
    queue_.insert(std::find_if(place(first), queue_.end(), below), thread);
  }

  /// The recording contradicts the replay: the thread has a processor. The thread of the lowest level whose
  /// time slice ends first loses it.
  void need_processor(std::uint32_t thread) {
    if (threads_[thread].on_processor) return;
    assert(threads_[thread].queues && queue_.size() > processors_ && "a thread without a processor waits");
    ++found_.early;
    ++threads_[thread].early;
    if (found_.first_early == Time{}) found_.first_early = now_;
    std::erase(queue_, thread);
    std::uint32_t& loses = *std::min_element(place(0), place(processors_), [&](auto a, auto b) {
      const Thread &x = threads_[a], &y = threads_[b];
      return std::pair(x.level, x.slice_end) < std::pair(y.level, y.slice_end);
    });
    const std::uint32_t displaced = std::exchange(loses, thread);
    insert(displaced, processors_);
    assign();
    threads_[displaced].slice_left = Platform{}.time_slice;
  }

  void start(const Change& change) {
    Thread& t = threads_[change.thread];
    if (!t.queues || t.leaves) make_ready(change.thread);  // It ended a job within this instant.
    const bool late = t.on_processor && now_ - t.since > kIdlesFor;
    t.late += late;
    late_ += late;
    need_processor(change.thread);
    t.works = true;
    ++t.jobs;
    t.job = change.job;
    t.since = now_;
    used_[t.job] = {};
  }

  void finish(const Change& change) {
    Thread& t = threads_[change.thread];
    assert(t.works && t.job == change.job && "jobs of a thread end in the order in which they start");
    need_processor(change.thread);
    used_[t.job] += change.kind == Kind::finish_at_once ? change.at - change.start : now_ - t.since;
    t.works = false;
    t.since = now_;
    t.leaves = change.sleeps;
  }

  const RecordedWindow& window_;
  std::size_t processors_;
  std::vector<Change> changes_;
  Time now_ = Time::min();
  std::vector<std::uint32_t> queue_;      // threads; the first ones have the processors
  std::map<std::size_t, Duration> used_;  // by job
  TimeSlices found_;
  std::map<std::uint32_t, Thread> threads_;
  std::size_t late_ = 0;  // starts
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
    const bool has_levels =
        std::ranges::any_of(pool.threads, [&](std::uint32_t t) { return displacement.level[t] > 0; });
    const Slices ordinary(window, pool, std::vector<int>(system.threads.size(), 0));
    const Slices* best = &ordinary;
    std::optional<Slices> with_levels;
    bool follows = ordinary.explain(system, displacement);
    if (has_levels && (!follows || ordinary.found().displaced == 0)) {
      with_levels.emplace(window, pool, displacement.level);
      const bool levels_explain = with_levels->explain(system, displacement);
      if (levels_explain || !follows) {
        follows = with_levels->ordinary_threads_share() && levels_explain;
        best = &*with_levels;
      }
    } else {
      follows = ordinary.found().displaced > 0 && (follows || pool.processors.size() == 1);
    }
    TimeSlices& all = displacement.slices;
    if (!follows) {
      if (best->ordinary_threads_share()) all.unexplained += pool.threads.size();
      continue;
    }
    const TimeSlices& found = best->found();
    best->set_times(pool, displacement);
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
      "their jobs are those that slices of %.0f ms give the recorded starts and ends. During %zu jobs, "
      "processors changed hands %zu times",
      slices.threads, to_ms(Platform{}.time_slice), slices.jobs, slices.displaced);
  if (slices.early == 0) return text + ".";
  return text + program::text("; %zu times sooner than after such a slice, first at %.3f ms.", slices.early,
                              to_ms(slices.first_early - epoch));
}

std::string unexplained_sentence(const TimeSlices& slices) {
  return program::text(
      "%zu threads share processors, but time slices of %.0f ms on processors that all of them use do not "
      "explain how: their jobs keep the times from start to end, less those of jobs within them, which may "
      "be too long, and SCHED_FIFO may be a wrong guess. Correct the deployment and pass it with "
      "--deployments.",
      slices.unexplained, to_ms(Platform{}.time_slice));
}

}  // namespace hotpath::imports
