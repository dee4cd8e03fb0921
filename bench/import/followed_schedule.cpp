// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "hotpath/core/platform.hpp"
#include "import/recognition.hpp"

namespace hotpath::imports {

namespace {

/// No wake-up or delivery takes longer; an ordinary thread that releases timers may wait for a time slice.
constexpr Duration kLong = std::chrono::milliseconds(1);
constexpr int kSlices = 2;
/// Threads whose callbacks start within this time may have decided in the other order.
constexpr Duration kTogether = std::chrono::microseconds(100);
/// No thread decides and hands the mutex on within this time: simulated threads decide at one instant,
/// and an exported trace does not contain their order.
constexpr Duration kInstant{100};

/// Drives a scheduler whose tasks have their places in the hypothesis's order as ids.
class Follower {
 public:
  Follower(const TaskSet& set, const RecordedSteps& recorded, const Hypothesis& hypothesis)
      : recorded_(recorded),
        hypothesis_(hypothesis),
        traits_(hypothesis.entry->traits),
        place_(set.size()),
        started_(set.size(), 0),
        started_on_(recorded.ready_on.size(), 0),
        free_(recorded.ready_on.size(), Time::min()),
        slice_began_(recorded.ready_on.size(), Time::min()),
        owed_(set.size(), 0),
        deadline_(recorded.deadline) {
    for (TaskId at = 0; at < set.size(); ++at) place_[tasks_[at]] = at;
    set_ = {std::vector<Task>(set.size()), set.groups};
    for (TaskId id = 0; id < set.size(); ++id) add_task(id, set[id]);
    scheduler_ = hypothesis.entry->make(set_, hypothesis.options);
    scheduler_->follow([this](TaskId at) { return may_run(at); });
    scheduler_->begin(recorded.epoch);
    const std::span<const WorkerRole> roles = scheduler_->workers();
    const auto manager = std::ranges::find(roles, WorkerRole::timer_management);
    manager_ = static_cast<Worker>(manager - roles.begin());
    if (traits_.timers != TimerHandling::polled && !traits_.raises_timer_thread)
      long_ = kSlices * Platform{}.time_slice;
    releases_ = manager != roles.end() && traits_.timers != TimerHandling::release_and_execute;
  }

  Agreement run(std::size_t from, std::size_t starts) {
    agreement_.decisions.reserve(starts);
    const std::vector<RecordedStep>& steps = recorded_.steps;
    for (std::size_t i = 0; i < steps.size() && agreement_.decisions.size() < starts;) {
      advance(steps[i].at);
      if (steps[i].kind == RecordedStep::Kind::arrival) {
        i = deliver(i);
        continue;
      }
      counts_ = agreement_.decisions.size() >= from;
      steps[i].kind == RecordedStep::Kind::start ? start(steps[i]) : finish(steps[i]);
      ++i;
    }
    return std::move(agreement_);
  }

 private:
  struct Running {
    std::uint32_t job;
    Worker worker;
    Job scheduled;
  };

  /// Tasks of other executors only pass on their priorities.
  void add_task(TaskId id, const Task& recorded) {
    Task& task = set_.tasks[place_[id]];
    task = recorded;
    task.local = recorded_.own[id];
    for (TaskId& fed : task.feeds) fed = place_[fed];
    if (task.kind == TaskKind::subscription) return;
    task.deadline = task.period;
    if (hypothesis_.levels.empty()) return;
    if (hypothesis_.levels[id] != kLast) task.priority = hypothesis_.levels[id];
    // A deadline is added to instants, and a level may be missing.
    if (traits_.policy == Policy::dm) task.deadline = Duration(std::min(hypothesis_.levels[id], kLast / 2));
  }

  /// When the thread that releases timers runs, having woken at `wake_at_`.
  struct Release {
    Time at = kNever;
    bool displaces = false;  ///< It takes the core of a thread that runs.
  };

  /// When the thread sleeps, at `wake_at_` or later, before its next job becomes ready.
  [[nodiscard]] Time sleeps_at(Worker w) const {
    if (runs(w)) return kNever;
    const Time next = next_ready(w), at = std::max(wake_at_, free_[w]);
    return next > at || (next == at && at > free_[w]) ? at : kNever;
  }

  /// A late one waits until a thread sleeps, or has had its core for `late_`. Then it releases all due.
  [[nodiscard]] Release next_release() const {
    if (late_ == Duration::zero() || wake_at_ <= released_at_) return {wake_at_};
    Release next{kNever};
    for (Worker w = 0; w < slice_began_.size(); ++w) {
      const Time sleeps = sleeps_at(w);
      const Time displaces = late_ == kUntilIdle ? kNever : std::max(wake_at_, slice_began_[w] + late_);
      if (std::min(sleeps, displaces) < next.at) next = {std::min(sleeps, displaces), displaces < sleeps};
    }
    return next;
  }

  /// Advances the clock, and a thread that only releases timers, which spins from the first job on.
  void advance(Time at, bool idle = false) {
    while (releases_ && wake_at_ != kNever) {
      const Release release = idle ? Release{wake_at_} : next_release();
      if (release.at > at) break;
      // The threads whose time slice was over get a new one after it.
      for (Time& began : slice_began_)
        if (release.displaces && began + late_ <= release.at) began = release.at;
      now_ = released_at_ = std::max(now_, release.at);
      const Turn turn = take_turn(*scheduler_, manager_, now_);
      const bool stays = turn.released == 0 && turn.decision.wake_at <= wake_at_;
      wake_at_ = turn.decision.wake_at;
      if (stays) break;
    }
    now_ = std::max(now_, at);
  }

  /// Delivers one message to all its readers; returns the step after the last one.
  std::size_t deliver(std::size_t first) {
    const std::vector<RecordedStep>& steps = recorded_.steps;
    readers_.clear();
    std::size_t i = first;
    for (; i < steps.size() && steps[i].kind == RecordedStep::Kind::arrival &&
           steps[i].at == steps[first].at && steps[i].job == steps[first].job;
         ++i)
      readers_.push_back(place_[steps[i].task]);
    std::ranges::sort(readers_);
    const std::uint32_t job = steps[first].job;
    for (const TaskId at : readers_) {
      SampleInfo sample{steps[first].at, kNever, {at, 0}};
      if (job != kNone) sample.deadline = deadline_[job];
      const WorkerSet wake = scheduler_->sample_arrived(at, sample, now_).wake;
      note_wake_up(wake);
      settle(wake);
    }
    return i;
  }

  void note_wake_up(WorkerSet wake) {
    if (releases_ && wake.contains(manager_)) wake_at_ = std::min(wake_at_, now_);
  }

  /// Asks for the woken threads that sleep until their next job becomes ready.
  void settle(WorkerSet woken) {
    if (!hypothesis_.asks_in_vain) return;
    wanted_ = kNoTask;
    for (std::size_t asked = 0; !woken.empty() && asked < 2 * started_on_.size(); ++asked) {
      const Worker worker = woken.pop_first();
      if (next_ready(worker) > now_ && !runs(worker))
        woken |= take_turn(*scheduler_, worker, now_).decision.wake;
    }
  }

  [[nodiscard]] bool is_subscription(TaskId at) const { return set_[at].kind == TaskKind::subscription; }

  /// With a thread for timers alone, the kind of the job tells the worker.
  [[nodiscard]] Worker worker_of(std::uint32_t thread, TaskId at) const {
    const bool timers_apart = traits_.timers == TimerHandling::release_and_execute;
    return timers_apart ? Worker{!is_subscription(at)} : thread;
  }
  [[nodiscard]] bool runs(Worker w) const {
    return std::ranges::find(running_, w, &Running::worker) != running_.end();
  }
  /// When the next job of the thread becomes ready.
  [[nodiscard]] Time next_ready(Worker w) const {
    const std::vector<Time>& ready = recorded_.ready_on[w];
    return started_on_[w] == ready.size() ? kNever : ready[started_on_[w]];
  }

  /// The scheduler's question whether it may run a job of the task.
  bool may_run(TaskId at) {
    if (at == wanted_) return true;
    if (wanted_ == kNoTask) return false;
    if (is_subscription(at) && scheduler_->unread(at) == 0) return true;  // an event that finds no sample
    if (owed_[at] > 0) {
      --owed_[at];
      return true;
    }
    if (preferred_ == kNoTask) preferred_ = at;
    // It starts again with a new snapshot.
    if (std::ranges::find(asked_, at) != asked_.end()) asked_.clear();
    asked_.push_back(at);
    return false;
  }

  void start(const RecordedStep& step) {
    if (!begun_) {
      begun_ = true;
      wake_at_ = now_;
      advance(now_, true);
    }
    if (step.free < step.ready) {
      advance(now_, true);
      slice_began_[step.thread] = step.ready;
    }
    wanted_ = place_[step.task];
    const Worker worker = worker_of(step.thread, wanted_);
    for (bool slept = false;;) {
      preferred_ = kNoTask;
      asked_.clear();
      const Turn turn = take_turn(*scheduler_, worker, now_);
      const std::optional<Job>& job = turn.decision.job;
      if (job && job->task == wanted_ && !job->empty) {
        if (step.job < deadline_.size()) deadline_[step.job] = job->deadline;
        running_.push_back({step.job, worker, *job});
        woken_ = turn.decision.wake;
      } else if (job) {
        note_wake_up(scheduler_->finished(worker, *job, now_).wake);
        continue;
      } else if (late_ > Duration::zero() && !slept && wake_at_ <= now_) {
        // The thread found nothing to run and slept, which let the timers be released.
        slept = true;
        slice_began_[step.thread] = std::max(step.free, wake_at_);
        advance(now_, true);
        continue;
      } else if (traits_.timers == TimerHandling::release_only && !is_subscription(wanted_)) {
        ++owed_[wanted_];
      }
      judge(step, job.has_value());
      ++started_[step.task];
      ++started_on_[step.thread];
      settle(std::exchange(woken_, {}));
      return;
    }
  }

  /// Whether another thread starts a job of the task so soon that it may have decided before this one.
  [[nodiscard]] bool decides_together(const RecordedStep& step, TaskId task) const {
    if (started_[task] == recorded_.decided[task].size()) return false;
    const auto& [at, thread] = recorded_.decided[task][started_[task]];
    return thread != step.thread && at - step.at <= (step.shows_decision ? kInstant : kTogether);
  }

  void judge(const RecordedStep& step, bool possible) {
    using Of = Agreement::Of;
    Of of = possible ? Of::yes : Of::no;
    bool plain = false;
    if (possible && preferred_ != kNoTask) {
      const TaskId preferred = tasks_[preferred_];
      const std::vector<Time>& ready = recorded_.ready[preferred];
      const Time at = started_[preferred] < ready.size() ? ready[started_[preferred]] : Time::min();
      const Time decided = std::max(step.free, step.ready);
      of = at > decided || decides_together(step, preferred) ? Of::open : Of::no;
      plain = of == Of::no && at < decided - long_;
      for (const TaskId asked : asked_)
        if (counts_ && of == Of::no) ++agreement_.before[{step.task, tasks_[asked]}];
    }
    if (counts_ && of == Of::no) ++agreement_.contradictions;
    agreement_.decisions.push_back(of);
    agreement_.plain.push_back(plain);
    agreement_.preferred.push_back(preferred_ == kNoTask ? kNoTask : tasks_[preferred_]);
  }

  void finish(const RecordedStep& step) {
    free_[step.thread] = step.at;
    const auto running = std::ranges::find(running_, step.job, &Running::job);
    if (running == running_.end()) return;
    const Worker worker = worker_of(step.thread, running->scheduled.task);
    WorkerSet wake = scheduler_->finished(worker, running->scheduled, now_).wake;
    running_.erase(running);
    note_wake_up(wake);
    wake.insert(worker);
    settle(wake);
  }

  const RecordedSteps& recorded_;
  const Hypothesis& hypothesis_;
  const ExecutorTraits& traits_;
  const std::vector<TaskId>& tasks_ = hypothesis_.order;  // by place
  const Duration late_ = hypothesis_.release_delay;
  std::vector<TaskId> place_;  // by task
  TaskSet set_;                // by place
  std::unique_ptr<Scheduler> scheduler_;
  bool releases_ = false, begun_ = false, counts_ = false;
  Worker manager_ = 0;
  Duration long_ = kLong;
  Time now_ = Time::min(), wake_at_ = kNever, released_at_ = Time::min();
  std::vector<std::size_t> started_;     // by task
  std::vector<std::size_t> started_on_;  // by thread
  std::vector<Time> free_;               // by thread: end of its last job
  std::vector<Time> slice_began_;        // by thread: when it woke, or lost the core to a release
  WorkerSet woken_;
  std::vector<std::uint32_t> owed_;  // by place: jobs that ran before the scheduler released them
  std::vector<Time> deadline_;       // by recorded job
  std::vector<Running> running_;
  TaskId wanted_ = kNoTask, preferred_ = kNoTask;  // places
  std::vector<TaskId> asked_, readers_;            // places
  Agreement agreement_;
};

}  // namespace

Agreement follow(const TaskSet& set, const RecordedSteps& recorded, const Hypothesis& hypothesis,
                 std::size_t from, std::size_t starts) {
  return Follower(set, recorded, hypothesis).run(from, starts);
}

}  // namespace hotpath::imports
