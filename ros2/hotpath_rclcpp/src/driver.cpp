// SPDX-License-Identifier: Apache-2.0
#include "driver.hpp"

#include <sys/prctl.h>

#include <algorithm>
#include <latch>
#include <mutex>

namespace hotpath {

namespace {

/// Sleeps of the calling thread end on time during this object's lifetime.
class ExactSleeps {
 public:
  ExactSleeps() : slack_(prctl(PR_GET_TIMERSLACK, 0UL, 0UL, 0UL, 0UL)) { minimise_timer_slack(); }
  ~ExactSleeps() {
    if (slack_ >= 0) prctl(PR_SET_TIMERSLACK, static_cast<unsigned long>(slack_), 0UL, 0UL, 0UL);
  }
  ExactSleeps(const ExactSleeps&) = delete;
  ExactSleeps& operator=(const ExactSleeps&) = delete;

 private:
  const int slack_;
};

}  // namespace

ExecutorDriver::ExecutorDriver(Setup setup) : schedule_(std::move(setup)) {
  lanes_ = std::vector<Lane>(schedule_.scheduler().workers().size());
  const bool release_only = this->setup().executor->traits.timers == TimerHandling::release_only;
  without_timer_thread_ = release_only && lanes_.size() == 2 && !this->setup().timer_thread.required;
}

void ExecutorDriver::release_until(Time now) {
  while (next_release_ <= now) {
    next_release_ = take_turn(schedule_.scheduler(), timer_worker(), next_release_).decision.wake_at;
  }
}

void ExecutorDriver::release_now(Time now) {
  if (!releases_) return;
  next_release_ = take_turn(schedule_.scheduler(), timer_worker(), now).decision.wake_at;
}

WorkerSet ExecutorDriver::claim(WorkerSet wake) {
  WorkerSet claimed;
  if (alone_ && !wake.empty()) wake = WorkerSet::of(0);
  while (!wake.empty()) {
    const Worker w = wake.pop_first();
    if (std::exchange(lanes_[w].parked, false)) claimed.insert(w);
  }
  return claimed;
}

void ExecutorDriver::unpark(WorkerSet claimed) {
  while (!claimed.empty()) lanes_[claimed.pop_first()].parker.unpark();
}

WorkerSet ExecutorDriver::everybody() const {
  WorkerSet all;
  for (Worker w = 0; w < lanes_.size(); ++w) all.insert(w);
  return all;
}

void ExecutorDriver::wake_all() {
  wake_claimed([&] { return claim(everybody()); });
}

void ExecutorDriver::note_change() {
  changed_.store(true);
  wake_all();
}

void ExecutorDriver::shut_down() {
  shut_down_.store(true);
  wake_all();
}

std::size_t ExecutorDriver::queued(const Refresh& refresh) {
  Lock lock(mutex_);
  while (look_after(lock, now(), refresh)) continue;
  if (running_ == 0) schedule_.compact(now());  // work() never compacts if the user only calls spin_some()
  return schedule_.queued(now());
}

void ExecutorDriver::sleep(Lock& lock, Worker worker, Time until, WorkerSet claimed) {
  Lane& lane = lanes_[worker];
  const std::uint32_t ticket = lane.parker.ticket();
  lane.parked = true;
  lock.unlock();
  unpark(claimed);
  lane.parker.park_until(ticket, until);
  lock.lock();
  lane.parked = false;
}

bool ExecutorDriver::look_after(Lock& lock, Time now, const Refresh& refresh) {
  const auto unlocked = [&](const auto& action) {
    lock.unlock();
    action();
    lock.lock();
    return true;
  };
  if (changed_.load() && changed_.exchange(false)) return unlocked(refresh);
  if (!jumped_.empty()) return unlocked([&] { release_jumped(); });
  if (now >= poll_at_) return unlocked([&] { poll_cancelled(); });
  if (!notices_.due(now)) return false;
  return unlocked([lines = notices_.take(now, schedule_)] { log(lines); });
}

void ExecutorDriver::unpark(Lock& lock, WorkerSet claimed) {
  if (claimed.empty()) return;
  lock.unlock();
  unpark(claimed);
  lock.lock();
}

ExecutorDriver::Started ExecutorDriver::start(Entry& entry, const Job& job) {
  Started started{job, entry.clock, {}, {}};
  if (entry.is_timer()) {
    if (!entry.task.always_due) started.period = entry.task.period;
    if (entry.clock != TimerClock::simulated) {
      entry.next_release = job.timestamp + entry.task.period * (1 + static_cast<std::int64_t>(job.skipped));
    }
  }
  if (!entry.ready.empty()) {
    started.which = entry.ready.front();
    entry.ready.pop_front();
  }
  entry.pending = false;
  if (entry.events > 0) --entry.events;
  return started;
}

bool ExecutorDriver::run_job(Lock& lock, Worker worker, const Job& job, WorkerSet claimed, Time& now) {
  const std::shared_ptr<Entry> entry = schedule_.entry(job.task);
  const Started started = start(*entry, job);
  ++running_;
  notices_.waited(entry, now - std::max(job.timestamp, entry->joined), schedule_.period_of(job.task), now);
  lock.unlock();
  unpark(claimed);
  bool ran = false;
  std::exception_ptr error;
  try {
    ran = execute(entry, started);
  } catch (...) {
    error = std::current_exception();
  }
  lock.lock();
  --running_;
  now = hotpath::now();
  const WorkerSet wake = schedule_.scheduler().finished(worker, job, now).wake;
  if (releases_ && wake.contains(timer_worker())) next_release_ = now;  // a timer that is always due
  const WorkerSet next = claim(wake);
  if (!next.empty()) {
    unpark(lock, next);
    now = hotpath::now();
  }
  if (error) std::rethrow_exception(error);
  return ran;
}

void ExecutorDriver::work(Worker worker, std::atomic_bool& spinning, const Refresh& refresh) {
  Lock lock(mutex_);
  Time now = hotpath::now();
  while (goes_on(spinning)) {
    if (keeps_up(worker) && look_after(lock, now, refresh)) {
      now = hotpath::now();
      continue;
    }
    if (releases_) release_until(now);
    const Turn turn = take_turn(schedule_.scheduler(), worker, now);
    WorkerSet claimed = claim(turn.decision.wake);
    if (turn.decision.job) {
      run_job(lock, worker, *turn.decision.job, claimed, now);
      continue;
    }
    if (worker == 0 && running_ == 0 && schedule_.compact(now)) {
      release_now(now);
      claimed |= claim(everybody());
      unpark(lock, claimed);
    } else {
      Time until = keeps_up(worker) ? std::min({turn.decision.wake_at, poll_at_, notices_.next()})
                                    : turn.decision.wake_at;
      if (releases_) until = std::min(until, next_release_);
      until > now ? sleep(lock, worker, until, claimed) : unpark(lock, claimed);
    }
    now = hotpath::now();
  }
}

void ExecutorDriver::spin(std::atomic_bool& spinning, const Refresh& refresh) {
  {
    const std::lock_guard lock(mutex_);
    error_ = nullptr;
    notices_.begin(now());
    for (Lane& lane : lanes_) lane.policy.reset();
    alone_ = releases_ = without_timer_thread_;
    release_now(now());
  }
  const std::size_t threads = without_timer_thread_ ? 1 : lanes_.size();
  const auto guarded = [&](const auto& action) {
    try {
      action();
    } catch (...) {
      {
        const std::lock_guard lock(mutex_);
        if (!error_) error_ = std::current_exception();
      }
      spinning.store(false);
    }
  };
  std::latch prepared(static_cast<std::ptrdiff_t>(threads));
  const auto live = [&](Worker worker) {
    guarded([&] { prepare(worker); });
    prepared.arrive_and_wait();  // no callback runs before every thread has its required policy
    guarded([&] { work(worker, spinning, refresh); });
    wake_all();  // a thread that ends, for any reason, wakes the sleeping threads so that they end too
  };
  for (Worker w = 1; w < threads; ++w) lanes_[w].thread = std::thread([&, w] { live(w); });
  {
    std::optional<ExactSleeps> exact;
    if (without_timer_thread_) exact.emplace();
    live(0);
  }
  spinning.store(false);
  wake_all();
  for (Lane& lane : lanes_) {
    if (lane.thread.joinable()) lane.thread.join();
  }
  {
    const std::lock_guard lock(mutex_);
    alone_ = releases_ = false;
  }
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

std::size_t ExecutorDriver::run_some(std::atomic_bool& spinning, const Refresh& refresh, std::size_t jobs,
                                     Time until, Time wait_until) {
  std::size_t ran = 0;
  Lock lock(mutex_);
  alone_ = true;
  const auto together = [&](void*) {
    if (!lock.owns_lock()) lock.lock();
    alone_ = false;
  };
  const std::unique_ptr<void, decltype(together)> scope(this, together);
  while (goes_on(spinning) && ran < jobs) {
    Time now = hotpath::now();
    if (look_after(lock, now, refresh)) continue;
    Time wake_at = std::min(poll_at_, notices_.next());
    std::optional<std::pair<Worker, Job>> next;
    for (const Worker worker : {timer_worker(), Worker{0}}) {
      const Turn turn = take_turn(schedule_.scheduler(), worker, now);
      wake_at = std::min(wake_at, turn.decision.wake_at);
      if (!turn.decision.job) continue;
      next.emplace(worker, *turn.decision.job);
      break;
    }
    if (next) {
      ran += run_job(lock, next->first, next->second, {}, now) ? 1 : 0;
    } else if (ran == 0 && now < wait_until) {
      if (running_ > 0 || !schedule_.compact(now)) sleep(lock, 0, std::min(wake_at, wait_until), {});
    } else {
      break;
    }
    if (hotpath::now() >= until) break;
  }
  return ran;
}

}  // namespace hotpath
