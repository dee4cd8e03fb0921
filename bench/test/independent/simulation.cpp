// SPDX-License-Identifier: Apache-2.0
#include "simulation.hpp"

#include <algorithm>
#include <deque>
#include <stdexcept>
#include <tuple>

namespace independent {

namespace {

constexpr Nanoseconds kNever = std::numeric_limits<Nanoseconds>::max();

struct Sample {
  std::int64_t sequence = 0;
  Nanoseconds published = 0, deadline = 0;
  int parent = -1;
  std::int64_t parent_sequence = 0;
  History history{};
};

/// A released job, a ready entity of a snapshot, or an event.
struct Ready {
  int task = 0;
  std::int64_t sequence = 0;  ///< Of timers.
  Nanoseconds timestamp = 0, release = 0, deadline = 0;
  std::int64_t activation = 0;  ///< Counts releases and arrivals.
};

struct TaskState {
  Nanoseconds next_call = kNever;  ///< Of timers, as in rcl.
  std::int64_t sequence = 0;       ///< Next timestamp of a timer, next sample of a subscription.
  bool armed = true;               ///< cbg: the timer thread watches the timer.
  std::int64_t armed_order = 0;    ///< cbg: of simultaneous timers, that watched for longest goes first.
  std::int64_t jobs = 0;           ///< For `every: N`.
  std::deque<Sample> unread{};
  std::int64_t rank = 0;  ///< Fixed priority.
};

struct Group {
  std::deque<Ready> ready{};
  bool listed = false;  ///< Among the ready groups, or running.
};

/// A sample that a node keeps.
struct Kept {
  int publisher = 0;
  History history{};
};

void merge(History& into, const History& from) {
  for (std::size_t s = 0; s < kMostSources; ++s) {
    if (from[s].jobs == 0) continue;
    const bool same = into[s].jobs == 1 && from[s].jobs == 1 && into[s].oldest == from[s].oldest;
    into[s].jobs = same ? 1 : into[s].jobs + from[s].jobs > 1 ? 2 : 1;
    into[s].oldest = std::min(into[s].oldest, from[s].oldest);
    into[s].latest_start = std::max(into[s].latest_start, from[s].latest_start);
  }
}

class Simulation {
 public:
  Simulation(const Graph& graph, const Executor& executor, const Conditions& conditions, const Draw& draw)
      : graph_(graph),
        executor_(executor),
        conditions_(conditions),
        draw_(draw),
        tasks_(graph.tasks.size()),
        groups_(static_cast<std::size_t>(graph.groups)) {
    for (const std::size_t inputs : graph.slots) slots_.emplace_back(inputs);
    for (std::size_t t = 0; t < tasks_.size(); ++t) {
      if (graph.tasks[t].timer) tasks_[t].next_call = conditions.phases[t];
    }
    if (executor.family == Family::fixed_priority) rank_tasks();
  }

  Result run() {
    while (now_ < conditions_.until) {
      release_timers(now_ + 1);
      const std::optional<Ready> ready = decide();
      if (ready) {
        execute(*ready);
      } else {
        now_ = kNever;
        for (const TaskState& task : tasks_) now_ = std::min(now_, task.armed ? task.next_call : kNever);
      }
    }
    end();
    return std::move(result_);
  }

 private:
  bool faulty(Fault fault) const { return executor_.fault == fault; }
  const Task& task(int id) const { return graph_.tasks[static_cast<std::size_t>(id)]; }
  TaskState& state(int id) { return tasks_[static_cast<std::size_t>(id)]; }

  /// Subscriptions inherit from the timers upstream; a priority of their own goes first under fp.
  void rank_tasks() {
    const bool least = faulty(Fault::least_urgent_inherited);
    const auto own = [&](const Task& t) {
      return executor_.policy == "rm"   ? t.period
             : executor_.policy == "dm" ? t.deadline
                                        : t.priority.value_or(0);
    };
    for (TaskState& s : tasks_) s.rank = least ? std::numeric_limits<std::int64_t>::min() : kNever;
    for (std::size_t t = 0; t < tasks_.size(); ++t) {
      if (!graph_.tasks[t].timer) continue;
      tasks_[t].rank = own(graph_.tasks[t]);
      std::vector<int> reached = successors(graph_, static_cast<int>(t), true);
      for (std::size_t i = 0; i < reached.size(); ++i) {
        std::int64_t& rank = state(reached[i]).rank;
        rank = least ? std::max(rank, tasks_[t].rank) : std::min(rank, tasks_[t].rank);
        for (const int next : successors(graph_, reached[i], true)) {
          if (std::ranges::find(reached, next) == reached.end()) reached.push_back(next);
        }
      }
    }
    for (std::size_t t = 0; t < tasks_.size(); ++t) {
      if (executor_.policy == "fp" && graph_.tasks[t].priority) tasks_[t].rank = *graph_.tasks[t].priority;
    }
  }

  /// Of a timer that is overdue at the end, the first timestamp is queued and the others are skipped.
  void end() {
    if (executor_.family != Family::wait_set && executor_.family != Family::groups) return;
    for (std::size_t t = 0; t < tasks_.size(); ++t) {
      if (!graph_.tasks[t].timer) continue;
      TaskState& timer = tasks_[t];
      for (Nanoseconds due = timer.next_call + graph_.tasks[t].period; due < conditions_.until;) {
        result_.jobs.push_back({static_cast<int>(t), ++timer.sequence, Outcome::skipped, due});
        due += graph_.tasks[t].period;
      }
    }
  }

  /// Releases the timers that are due before an instant, where a timer thread does so.
  void release_timers(Nanoseconds before) {
    if (executor_.family == Family::wait_set) return;
    while (true) {
      int due = -1;
      for (std::size_t t = 0; t < tasks_.size(); ++t) {
        const TaskState& timer = tasks_[t];
        if (!timer.armed || timer.next_call >= before) continue;
        if (due < 0 || std::tie(timer.next_call, timer.armed_order) <
                           std::tie(state(due).next_call, state(due).armed_order))
          due = static_cast<int>(t);
      }
      if (due < 0) return;
      TaskState& timer = state(due);
      enqueue({due, timer.sequence, timer.next_call, std::max(now_, timer.next_call),
               timer.next_call + task(due).deadline});
      if (executor_.family == Family::groups) {
        timer.armed = false;  // call() follows when the timer is picked
      } else {
        timer.next_call += task(due).period;
        ++timer.sequence;
      }
    }
  }

  void enqueue(Ready ready) {
    ready.activation = activations_++;
    if (executor_.family != Family::groups || faulty(Fault::groups_ignored)) {
      queue_.push_back(ready);
      return;
    }
    Group& group = groups_[static_cast<std::size_t>(task(ready.task).group)];
    group.ready.push_back(ready);
    if (!group.listed) ready_groups_.push_back(task(ready.task).group);
    group.listed = true;
  }

  std::optional<Ready> decide() {
    if (executor_.family == Family::wait_set && (queue_.empty() || faulty(Fault::polls_after_each_job)))
      poll();
    if (executor_.family == Family::groups && !faulty(Fault::groups_ignored)) {
      if (ready_groups_.empty()) return std::nullopt;
      std::deque<Ready>& ready = groups_[static_cast<std::size_t>(ready_groups_.front())].ready;
      ready_groups_.pop_front();
      const Ready first = ready.front();
      ready.pop_front();
      return first;
    }
    if (queue_.empty()) return std::nullopt;
    auto first = queue_.begin();
    if (executor_.family == Family::fixed_priority || executor_.family == Family::deadline) {
      first = std::ranges::min_element(queue_, [&](const Ready& a, const Ready& b) { return before(a, b); });
    }
    const Ready result = *first;
    queue_.erase(first);
    return result;
  }

  /// Snapshot: all ready timers and all subscriptions with unread samples, in the order of creation.
  void poll() {
    queue_.clear();
    const bool timers_first = executor_.timers_first != faulty(Fault::kinds_swapped);
    for (const bool timers : {timers_first, !timers_first}) {
      for (std::size_t t = 0; t < tasks_.size(); ++t) {
        if (graph_.tasks[t].timer != timers) continue;
        if (timers ? tasks_[t].next_call <= now_ : !tasks_[t].unread.empty())
          queue_.push_back({static_cast<int>(t), 0, 0, now_});
      }
    }
  }

  /// The order of events under fixed priorities and deadlines.
  bool before(const Ready& a, const Ready& b) {
    const bool timer_a = task(a.task).timer, timer_b = task(b.task).timer;
    const auto urgency = [&](const Ready& r, bool timer) -> std::pair<bool, std::int64_t> {
      if (executor_.samples_first && !timer) return {false, 0};
      return {executor_.samples_first, executor_.policy == "edf" ? r.deadline : state(r.task).rank};
    };
    if (urgency(a, timer_a) != urgency(b, timer_b)) return urgency(a, timer_a) < urgency(b, timer_b);
    if (executor_.fifo) return a.activation < b.activation;
    if (timer_a != timer_b) return timer_b != faulty(Fault::timers_before_samples);
    if (timer_a) return std::tie(a.task, a.timestamp) < std::tie(b.task, b.timestamp);
    return (a.activation > b.activation) != faulty(Fault::equal_priority_fifo);
  }

  /// rcl's call(): skips timestamps that have passed, for executors that call when they pick.
  void call(Ready& ready) {
    TaskState& timer = state(ready.task);
    ready.sequence = timer.sequence++;
    ready.timestamp = timer.next_call;
    ready.deadline = ready.timestamp + task(ready.task).deadline;
    timer.next_call += task(ready.task).period;
    while (timer.next_call < now_ + (faulty(Fault::exact_timestamp_kept) ? 0 : 1)) {
      skipped_.push_back({ready.task, timer.sequence++, Outcome::skipped, timer.next_call});
      timer.next_call += task(ready.task).period;
    }
  }

  void execute(Ready ready) {
    const Task& t = task(ready.task);
    Job job{ready.task, ready.sequence, Outcome::ran, ready.timestamp, ready.release};
    History history{};
    if (t.timer) {
      if (executor_.family == Family::wait_set || executor_.family == Family::groups) call(ready);
      job.sequence = ready.sequence;
      job.timestamp = ready.timestamp;
      job.deadline = ready.deadline;
    } else if (state(ready.task).unread.empty()) {
      job.outcome = Outcome::empty;
      if (faulty(Fault::stale_events_withdrawn)) return;
    } else {
      const Sample sample = state(ready.task).unread.front();
      state(ready.task).unread.pop_front();
      history = sample.history;
      job.sequence = sample.sequence;
      job.timestamp = sample.published;
      job.release = std::max(job.release, sample.published);  // it may have replaced the snapshot's sample
      job.deadline = sample.deadline;
      job.parent = sample.parent;
      job.parent_sequence = sample.parent_sequence;
    }
    const bool costs = job.outcome != Outcome::empty || !faulty(Fault::dispatch_of_work_only);
    const Nanoseconds dispatch = t.timer ? conditions_.timer_dispatch : conditions_.dispatch;
    job.start = now_ + (costs ? dispatch : 0);
    job.finish = job.start;
    if (job.outcome != Outcome::empty) {
      for (const auto& [set, position] : t.stores) slot(set, position) = {job.parent, history};
      if (works(t)) job.finish += draw_(ready.task, job.sequence);
    }
    release_timers(job.finish);
    if (job.finish >= conditions_.until) job.outcome = Outcome::running;
    if (job.start < conditions_.until) result_.jobs.push_back(job);  // otherwise it counts as queued
    result_.jobs.insert(result_.jobs.end(), skipped_.begin(), skipped_.end());
    skipped_.clear();
    now_ = job.finish;
    if (job.outcome == Outcome::ran) publish(job, history);
    after(ready.task);
  }

  /// What the sample of one task hands on to messages of another task.
  History handed_on(const History& history, int from, int to) const {
    History result{};
    for (std::size_t s = 0; s < graph_.ways.size(); ++s)
      if (graph_.ways[s].contains({from, to})) result[s] = history[s];
    return result;
  }

  std::optional<Kept>& slot(int set, int position) {
    return slots_[static_cast<std::size_t>(set)][static_cast<std::size_t>(position)];
  }

  bool complete(const Publication& publication) {
    const auto full = [](const std::optional<Kept>& input) { return input.has_value(); };
    const auto& inputs = slots_[static_cast<std::size_t>(publication.slots)];
    return faulty(Fault::join_of_any) ? std::ranges::any_of(inputs, full) : std::ranges::all_of(inputs, full);
  }

  /// If all publications wait for sets, a job that completes none takes no time.
  bool works(const Task& t) {
    const auto waits = [&](const Publication& p) { return p.rule == Rule::all_new && !complete(p); };
    return t.publications.empty() || faulty(Fault::incomplete_set_works) ||
           !std::ranges::all_of(t.publications, waits);
  }

  void publish(const Job& job, const History& sample) {
    const Task& t = task(job.task);
    History own = handed_on(sample, job.parent, job.task);
    History started{};
    for (const int s : t.sources) {
      own[static_cast<std::size_t>(s)] = {};
      started[static_cast<std::size_t>(s)] = {job.timestamp, job.start, 1};
    }
    merge(own, started);
    const std::int64_t count = ++state(job.task).jobs;
    std::vector<bool> observed(graph_.chains.size(), false);
    if (t.publications.empty()) observe(job, own, observed);
    for (const Publication& p : t.publications) {
      const std::int64_t turn = faulty(Fault::every_from_first) ? 1 % p.every : 0;
      if (p.rule == Rule::every && count % p.every != turn) continue;
      if (p.rule == Rule::all_new && !complete(p)) continue;
      History history = own;
      if (p.slots >= 0) {
        for (std::optional<Kept>& input : slots_[static_cast<std::size_t>(p.slots)]) {
          if (input) merge(history, handed_on(input->history, input->publisher, job.task));
          const Fault keeps = p.rule == Rule::all_new ? Fault::join_keeps_slots : Fault::last_of_repeats;
          if (!faulty(keeps)) input.reset();
        }
      }
      observe(job, history, observed);
      std::vector<int> readers = p.readers;
      if (faulty(Fault::delivery_reversed)) std::ranges::reverse(readers);
      for (const int reader : readers) deliver(reader, job, history);
    }
  }

  /// The first message with data of a source counts for a chain.
  void observe(const Job& job, const History& history, std::vector<bool>& observed) {
    for (std::size_t c = 0; c < graph_.chains.size(); ++c) {
      if (!graph_.chains[c].is_sink[static_cast<std::size_t>(job.task)] || observed[c]) continue;
      Mark data;
      for (const int s : graph_.chains[c].sources) {
        const Mark& mark = history[static_cast<std::size_t>(s)];
        const bool newest =
            faulty(Fault::newest_source_timestamp) && data.oldest != kNever && mark.oldest != kNever;
        data.oldest = newest ? std::max(data.oldest, mark.oldest) : std::min(data.oldest, mark.oldest);
        const bool earliest =
            faulty(Fault::earliest_source_start) && data.latest_start >= 0 && mark.latest_start >= 0;
        data.latest_start = earliest ? std::min(data.latest_start, mark.latest_start)
                                     : std::max(data.latest_start, mark.latest_start);
        data.jobs = std::max(data.jobs, mark.jobs);
      }
      if (data.oldest == kNever) continue;
      observed[c] = true;
      result_.outputs.push_back({static_cast<int>(c), job.sequence, job.start - data.latest_start,
                                 job.finish - data.oldest, data.jobs > 1});
    }
  }

  void deliver(int reader, const Job& job, const History& history) {
    TaskState& s = state(reader);
    const Nanoseconds deadline =
        faulty(Fault::own_deadline) ? now_ + job.deadline - job.timestamp : job.deadline;
    const Sample sample{s.sequence++, now_, deadline, job.task, job.sequence, history};
    if (s.unread.size() == task(reader).depth) {
      const Sample& lost = faulty(Fault::newest_overwritten) ? sample : s.unread.front();
      result_.jobs.push_back({reader, lost.sequence, Outcome::overwritten, lost.published, 0, now_, 0,
                              lost.deadline, lost.parent, lost.parent_sequence});
      if (!faulty(Fault::newest_overwritten)) s.unread.pop_front();
    }
    if (s.unread.size() < task(reader).depth) s.unread.push_back(sample);
    if (executor_.family != Family::wait_set) enqueue({reader, 0, now_, now_, deadline});
  }

  /// cbg: the timer thread regains the timer, and the group queues again behind the others.
  void after(int id) {
    if (executor_.family != Family::groups) return;
    state(id).armed = true;
    state(id).armed_order = ++activations_;
    Group& group = groups_[static_cast<std::size_t>(task(id).group)];
    group.listed = !group.ready.empty();
    if (group.listed) ready_groups_.push_back(task(id).group);
  }

  const Graph& graph_;
  const Executor& executor_;
  const Conditions& conditions_;
  const Draw& draw_;
  Nanoseconds now_ = 0;
  std::vector<TaskState> tasks_;
  std::vector<std::vector<std::optional<Kept>>> slots_;  ///< Newest samples of fusions and cyclic nodes.
  std::vector<Ready> queue_;                             ///< Events, or the rest of the snapshot.
  std::vector<Group> groups_;
  std::deque<int> ready_groups_;
  std::int64_t activations_ = 0;
  std::vector<Job> skipped_;  ///< By the job that is about to run.
  Result result_;
};

}  // namespace

Executor::Executor(const std::string& name) : label(name) {
  const std::string base = name.substr(0, name.find(':'));
  samples_first = name.find(":first") != std::string::npos;
  fifo = name.find(":fifo") != std::string::npos;
  if (base == "default" || base == "static") {
    family = Family::wait_set;
    timers_first = base == "default";
  } else if (base == "cbg") {
    family = Family::groups;
  } else if (base != "events-ro") {
    policy = base.substr(0, base.find('-'));
    family = policy == "edf" ? Family::deadline : Family::fixed_priority;
    if (policy != "rm" && policy != "dm" && policy != "fp" && policy != "edf")
      throw std::runtime_error("unknown executor " + name);
  }
}

Result simulate(const Graph& graph, const Executor& executor, const Conditions& conditions,
                const Draw& draw) {
  return Simulation(graph, executor, conditions, draw).run();
}

}  // namespace independent
