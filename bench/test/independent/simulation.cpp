// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <tuple>

#include "nodes.hpp"
#include "transit.hpp"

namespace independent {

namespace {

class Simulation {
 public:
  Simulation(const Graph& graph, const Deployment& deployment, const Conditions& conditions, const Draw& draw)
      : graph_(graph),
        deployment_(deployment),
        conditions_(conditions),
        draw_(draw),
        tasks_(graph.tasks.size()),
        nodes_(graph, deployment.fault),
        transit_(conditions.delay, conditions.any_order) {
    for (std::size_t t = 0; t < tasks_.size(); ++t) {
      if (graph.tasks[t].timer) tasks_[t].next_call = conditions.phases[t];
    }
    for (const Thread& thread : deployment.threads) {
      threads_.push_back({thread});
      threads_.back().groups.resize(static_cast<std::size_t>(graph.groups));
      processors_ = std::max(processors_, thread.processor + 1);
      if (thread.executor.family != Family::fixed_priority) continue;
      const auto ranks = ranks_of(graph, thread.executor.policy, deployment.fault);
      for (std::size_t t = 0; t < tasks_.size(); ++t)
        if (deployment.thread_of[t] == threads_.size() - 1) tasks_[t].rank = ranks[t];
    }
  }

  Result run() {
    while (now_ < conditions_.until) {
      for (std::size_t p = 0; p < processors_; ++p) {
        ThreadState* const thread = running_on(p);
        if (thread != nullptr && thread->job && thread->started && thread->left == 0) finish(*thread);
      }
      while (const auto arrival = transit_.take(now_)) deliver(arrival->first, arrival->second);
      release_timers();
      wake_threads();
      if (!step()) advance();
    }
    end();
    return std::move(result_);
  }

 private:
  /// Of the threads that are awake, the processor runs the one with the largest priority.
  ThreadState* running_on(std::size_t processor) {
    ThreadState* first = nullptr;
    for (ThreadState& t : threads_) {
      if (!t.awake || (faulty(Fault::one_processor) ? 0 : t.thread.processor) != processor) continue;
      if (faulty(Fault::not_preempted) && t.job) return &t;
      const auto key = [&](const ThreadState& of) {
        return std::pair(faulty(Fault::thread_priority_ignored) ? 0 : -of.thread.priority, of.since);
      };
      if (first == nullptr || key(t) < key(*first)) first = &t;
    }
    return first;
  }

  bool has_work(const ThreadState& thread, std::size_t number) const {
    if (thread.job || !thread.queue.empty() || !thread.ready_groups.empty()) return true;
    if (thread.thread.executor.family != Family::wait_set) return false;
    for (std::size_t t = 0; t < tasks_.size(); ++t) {
      if (deployment_.thread_of[t] != number) continue;
      if (graph_.tasks[t].timer ? tasks_[t].next_call <= now_ : !tasks_[t].unread.empty()) return true;
    }
    return false;
  }

  void wake_threads() {
    for (std::size_t t = 0; t < threads_.size(); ++t) {
      if (threads_[t].awake || !has_work(threads_[t], t)) continue;
      threads_[t].awake = true;
      threads_[t].since = ++activations_;
    }
  }

  /// A decision or a start at this instant; false if there is none.
  bool step() {
    for (std::size_t p = 0; p < processors_; ++p) {
      ThreadState* const thread = running_on(p);
      if (thread == nullptr) continue;
      if (!thread->job) {
        const std::optional<Ready> ready = decide(*thread);
        ready ? begin(*thread, *ready) : void(thread->awake = false);
        return true;
      }
      if (!thread->started && thread->left == 0) return start(*thread), true;
      if (thread->left == 0) return true;
    }
    return false;
  }

  void advance() {
    Nanoseconds next = std::min(conditions_.until, transit_.next());
    for (const TaskState& t : tasks_) {
      if (t.armed && t.next_call > now_) next = std::min(next, t.next_call);
    }
    std::vector<ThreadState*> running;
    for (std::size_t p = 0; p < processors_; ++p) {
      if (ThreadState* const thread = running_on(p)) running.push_back(thread);
    }
    for (const ThreadState* thread : running) next = std::min(next, now_ + thread->left);
    for (ThreadState* thread : running) thread->left -= next - now_;
    now_ = next;
  }

  bool faulty(Fault fault) const { return deployment_.fault == fault; }
  const Task& task(int id) const { return graph_.tasks[static_cast<std::size_t>(id)]; }
  ThreadState& thread_of(int id) { return threads_[deployment_.thread_of[static_cast<std::size_t>(id)]]; }
  const Executor& executor_of(int id) { return thread_of(id).thread.executor; }
  TaskState& state(int id) { return tasks_[static_cast<std::size_t>(id)]; }

  /// Of a timer that is overdue at the end, the first timestamp is queued and the others are skipped.
  void end() {
    while (const auto arrival = transit_.take(kNever - 1)) deliver(arrival->first, arrival->second);
    for (std::size_t t = 0; t < tasks_.size(); ++t) {
      const Family family = executor_of(static_cast<int>(t)).family;
      if (!graph_.tasks[t].timer || (family != Family::wait_set && family != Family::groups)) continue;
      TaskState& timer = tasks_[t];
      const Nanoseconds period = graph_.tasks[t].period;
      for (Nanoseconds due = timer.next_call + period; due < conditions_.until; due += period)
        result_.jobs.push_back({static_cast<int>(t), ++timer.sequence, Outcome::skipped, due});
    }
  }

  /// Releases the timers that are due, where a timer thread does so.
  void release_timers() {
    while (true) {
      int due = -1;
      for (std::size_t t = 0; t < tasks_.size(); ++t) {
        const TaskState& timer = tasks_[t];
        if (!timer.armed || timer.next_call > now_) continue;
        if (executor_of(static_cast<int>(t)).family == Family::wait_set) continue;
        if (due < 0 || std::tie(timer.next_call, timer.armed_order) <
                           std::tie(state(due).next_call, state(due).armed_order))
          due = static_cast<int>(t);
      }
      if (due < 0) return;
      TaskState& timer = state(due);
      enqueue({due, timer.sequence, timer.next_call, now_, timer.next_call + task(due).deadline});
      if (executor_of(due).family == Family::groups) {
        timer.armed = false;  // call() follows when the timer is picked
      } else {
        timer.next_call += task(due).period;
        ++timer.sequence;
      }
    }
  }

  void enqueue(Ready ready) {
    ready.activation = activations_++;
    ready.timer = task(ready.task).timer;
    ready.rank = state(ready.task).rank;
    ThreadState& thread = thread_of(ready.task);
    if (task(ready.task).guaranteed) thread.requests.emplace_back(ready.task, now_);
    if (thread.thread.executor.family != Family::groups || faulty(Fault::groups_ignored)) {
      thread.queue.push_back(ready);
      return;
    }
    Group& group = thread.groups[static_cast<std::size_t>(task(ready.task).group)];
    group.ready.push_back(ready);
    if (!group.listed) thread.ready_groups.push_back(task(ready.task).group);
    group.listed = true;
  }

  std::optional<Ready> decide(ThreadState& thread) {
    const Executor& executor = thread.thread.executor;
    if (executor.family == Family::wait_set) {
      if (executor.waits_after_each_job) thread.queue.clear();
      pass_waitables(thread);
      if (thread.queue.empty() || faulty(Fault::polls_after_each_job)) poll(thread);
      pass_waitables(thread);
    }
    if (executor.family == Family::groups && !faulty(Fault::groups_ignored)) {
      if (thread.ready_groups.empty()) return std::nullopt;
      const int group = thread.ready_groups.front();
      std::vector<Ready>& ready = thread.groups[static_cast<std::size_t>(group)].ready;
      thread.ready_groups.erase(thread.ready_groups.begin());
      const Ready first = ready.front();
      ready.erase(ready.begin());
      thread.again = executor.at_dispatch && graph_.reentrant.contains(group) && !ready.empty();
      if (thread.again) thread.ready_groups.push_back(group);
      return first;
    }
    if (thread.queue.empty()) return std::nullopt;
    auto first = thread.queue.begin();
    if (executor.family == Family::fixed_priority || executor.family == Family::deadline) {
      const int service = waited_for_long(thread);
      first = std::ranges::min_element(thread.queue, [&](const Ready& a, const Ready& b) {
        if ((a.task == service) != (b.task == service)) return a.task == service;
        return precedes(executor, deployment_.fault, a, b);
      });
    }
    const Ready result = *first;
    thread.queue.erase(first);
    const auto request = std::ranges::find(thread.requests, result.task, &std::pair<int, Nanoseconds>::first);
    if (request != thread.requests.end()) thread.requests.erase(request);
    return result;
  }

  /// The service that runs next because its oldest request has waited for the service wait; -1: none. The
  /// next one may do so only after another wait.
  int waited_for_long(ThreadState& thread) {
    const Nanoseconds wait = graph_.service_wait;
    if (wait == 0 || now_ < thread.next_service || thread.requests.empty()) return -1;
    if (thread.requests.front().second + wait > now_ || faulty(Fault::services_wait)) return -1;
    thread.next_service = now_ + wait;
    return thread.requests.front().first;
  }

  /// Snapshot: ready timers and tasks with unread samples, kind by kind, each in the order of creation.
  void poll(ThreadState& thread) {
    thread.queue.clear();
    const bool timers_first = thread.thread.executor.timers_first != faulty(Fault::kinds_swapped);
    for (const std::string& kind : timers_first ? kKinds : kKindsOfStatic) {
      for (std::size_t t = 0; t < tasks_.size(); ++t) {
        const Task& task = graph_.tasks[t];
        if (task.kind != kind || &thread_of(static_cast<int>(t)) != &thread) continue;
        if (task.timer ? tasks_[t].next_call <= now_
                       : !tasks_[t].unread.empty() || is_asked_at_turn(task, thread))
          thread.queue.push_back({static_cast<int>(t), 0, 0, now_});
      }
    }
  }

  /// Waitables of topics within a process are in each snapshot, and asked for samples at their turn.
  bool is_asked_at_turn(const Task& task, const ThreadState& thread) const {
    const bool early = graph_.until_iron && thread.thread.executor.timers_first;
    return task.intra_process && !early && !faulty(Fault::waitables_asked_early);
  }

  void pass_waitables(ThreadState& thread) {
    const auto is_empty = [this](int t) { return task(t).intra_process && state(t).unread.empty(); };
    while (!thread.queue.empty() && is_empty(thread.queue.front().task))
      thread.queue.erase(thread.queue.begin());
  }

  /// rcl's call(): skips timestamps that have passed, for executors that call when they pick.
  void call(Ready& ready) {
    TaskState& timer = state(ready.task);
    ready.sequence = timer.sequence++;
    ready.timestamp = timer.next_call;
    ready.deadline = ready.timestamp + task(ready.task).deadline;
    timer.next_call += task(ready.task).period;
    while (timer.next_call < now_ + (faulty(Fault::exact_timestamp_kept) ? 0 : 1)) {
      result_.jobs.push_back({ready.task, timer.sequence++, Outcome::skipped, timer.next_call});
      timer.next_call += task(ready.task).period;
    }
  }

  void begin(ThreadState& thread, Ready ready) {
    const Task& t = task(ready.task);
    const Family family = thread.thread.executor.family;
    Job job{ready.task, ready.sequence, Outcome::ran, ready.timestamp, ready.release};
    thread.history = {};
    if (t.timer) {
      if (family == Family::wait_set || family == Family::groups) call(ready);
      job.sequence = ready.sequence;
      job.timestamp = ready.timestamp;
      job.deadline = ready.deadline;
    } else if (state(ready.task).unread.empty()) {
      job.outcome = Outcome::empty;
      if (faulty(Fault::stale_events_withdrawn)) return;
    } else {
      const Sample sample = state(ready.task).unread.front();
      state(ready.task).unread.erase(state(ready.task).unread.begin());
      thread.history = sample.history;
      job.sequence = sample.sequence;
      job.timestamp = sample.published;
      job.release = std::max(job.release, sample.published);  // it may have replaced the snapshot's sample
      job.deadline = sample.deadline;
      job.parent = sample.parent;
      job.parent_sequence = sample.parent_sequence;
    }
    const bool costs = job.outcome != Outcome::empty || !faulty(Fault::dispatch_of_work_only);
    thread.job = job;
    thread.started = false;
    thread.left = !costs ? 0 : t.timer ? conditions_.timer_dispatch : conditions_.dispatch;
  }

  void start(ThreadState& thread) {
    Job& job = *thread.job;
    const Task& t = task(job.task);
    job.start = now_;
    thread.started = true;
    if (job.outcome != Outcome::empty) {
      nodes_.store(job, thread.history);
      if (nodes_.works(t)) thread.left = draw_(job.task, job.sequence);
      job.outcome = Outcome::running;
    }
    thread.row = result_.jobs.size();
    result_.jobs.push_back(job);
  }

  void finish(ThreadState& thread) {
    Job job = *thread.job;
    thread.job.reset();
    job.finish = now_;
    const bool runs = job.outcome == Outcome::running;
    if (runs) job.outcome = Outcome::ran;
    result_.jobs[thread.row] = job;
    const auto observe = [this](const Output& output) { result_.outputs.push_back(output); };
    const auto publish = [&](int reader, const History& history) { send(reader, job, history); };
    if (runs) nodes_.publish(job, thread.history, observe, publish);
    after(thread, job.task);
  }

  void send(int reader, const Job& job, const History& history) {
    const Nanoseconds deadline =
        faulty(Fault::own_deadline) ? now_ + job.deadline - job.timestamp : job.deadline;
    const Sample sample{0, now_, deadline, job.task, job.sequence, history};
    conditions_.delay ? transit_.send(reader, sample) : deliver(reader, sample);
  }

  void deliver(int reader, Sample sample) {
    TaskState& s = state(reader);
    sample.sequence = s.sequence++;
    if (s.unread.size() == task(reader).depth) {
      const Sample& lost = faulty(Fault::newest_overwritten) ? sample : s.unread.front();
      result_.jobs.push_back({reader, lost.sequence, Outcome::overwritten, lost.published, 0, now_, 0,
                              lost.deadline, lost.parent, lost.parent_sequence});
      if (!faulty(Fault::newest_overwritten)) s.unread.erase(s.unread.begin());
    }
    if (s.unread.size() < task(reader).depth) s.unread.push_back(sample);
    if (executor_of(reader).family != Family::wait_set) enqueue({reader, 0, now_, now_, sample.deadline});
    wake_threads();  // in the order of delivery, which decides between threads of one priority
  }

  /// cbg: the timer thread regains the timer, and the group queues again behind the others.
  void after(ThreadState& thread, int id) {
    if (thread.thread.executor.family != Family::groups) return;
    state(id).armed = true;
    state(id).armed_order = ++activations_;
    Group& group = thread.groups[static_cast<std::size_t>(task(id).group)];
    group.listed = !group.ready.empty();
    if (group.listed && !thread.again) thread.ready_groups.push_back(task(id).group);
  }

  const Graph& graph_;
  const Deployment& deployment_;
  const Conditions& conditions_;
  const Draw& draw_;
  Nanoseconds now_ = 0;
  std::vector<TaskState> tasks_;
  Nodes nodes_;
  Transit transit_;
  std::vector<ThreadState> threads_{};
  std::size_t processors_ = 0;
  std::int64_t activations_ = 0;
  Result result_;
};

}  // namespace

Result simulate(const Graph& graph, const Deployment& deployment, const Conditions& conditions,
                const Draw& draw) {
  return Simulation(graph, deployment, conditions, draw).run();
}

}  // namespace independent
