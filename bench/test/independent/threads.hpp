// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "hotpath_program.hpp"
#include "nodes.hpp"

namespace independent {

/// An error in the model, which the comparison must find.
enum class Planted { none, one_thread, group_ignored, blocked_kept, order_kept, group_first, count };
constexpr std::size_t kPlanted = static_cast<std::size_t>(Planted::count);

/// The execution times that one instant chooses; another() goes on to the next combination.
struct Choices {
  std::vector<std::pair<Nanoseconds, Nanoseconds>> made{};
  std::size_t next = 0;

  Nanoseconds choose(Nanoseconds least, Nanoseconds most) {
    if (next == made.size()) made.emplace_back(least, most);
    return made[next++].first;
  }
  bool another() {
    next = 0;
    while (!made.empty() && made.back().first == made.back().second) made.pop_back();
    if (!made.empty()) ++made.back().first;
    return !made.empty();
  }
};

struct Worst {
  std::map<Target, Nanoseconds> values{};
  std::set<Target> duplicates{};  ///< Latencies of outputs with several jobs of one source.
  std::size_t states = 0;         ///< 0: there are too many.
};

enum class Step { asleep, decides, runs };

struct Worker {
  Step step = Step::decides;
  Job job{};
  History history{};  ///< Of the sample that it took.
};

struct EventGroup {
  std::vector<int> events{};
  bool idle = true;  ///< Neither ready nor running: its next event makes it ready.
};

/// One schedule of an executor with several threads, each with a processor, as rclcpp makes it
/// (multi_threaded_executor.cpp and executor.cpp of rclcpp 16 and 28, events_cbg_executor.cpp).
class System {
 public:
  System(const Graph& graph, const std::string& label, Planted planted)
      : graph_(&graph),
        planted_(planted),
        events_(label.starts_with("cbg")),
        at_dispatch_(label.starts_with("cbg-3178")),
        rebuilds_(label.starts_with("multi-jazzy")),
        threads_(planted == Planted::one_thread ? 1 : std::stoi(label.substr(label.find(':') + 1))),
        tasks_(graph.tasks.size()),
        nodes_(graph, Fault::none),
        workers_(static_cast<std::size_t>(threads_) + (events_ ? 1 : 0)),
        busy_(static_cast<std::size_t>(graph.groups)),
        groups_(busy_.size()) {
    for (int w = events_ ? -1 : 0; w < threads_; ++w) awake_.push_back(w < 0 ? threads_ : w);
    for (const std::string& kind : kKinds) {
      for (std::size_t t = 0; t < tasks_.size(); ++t)
        if (graph.tasks[t].kind == kind) in_order_.push_back(static_cast<int>(t));
    }
    if (rebuilds_) waited_ = in_order_;
    for (const int t : in_order_) {
      state(t).next_call = task(t).timer ? task(t).phase : kNever;
      if (task(t).timer) watched_.push_back(t);
    }
  }

  /// When the next job ends or the next timer is due that some thread waits for.
  Nanoseconds next() {
    Nanoseconds next = kNever;
    for (const Worker& w : workers_)
      if (w.step == Step::runs) next = std::min(next, w.job.finish);
    for (const int t : events_ ? watched_ : waited_)
      if ((events_ || waiter_ >= 0) && state(t).next_call > now_) next = std::min(next, state(t).next_call);
    return next;
  }

  /// Some of the jobs that end now do so, timers are due, then the threads act in rounds, in the order in
  /// which they awoke. What else ends now does so in a later call.
  void advance(Nanoseconds instant, Choices& choices, Worst& worst) {
    choices_ = &choices;
    worst_ = &worst;
    const bool comes = std::exchange(now_, instant) < instant;
    const auto is_due = [this](int t) { return state(t).next_call == now_; };
    const bool due = comes && std::ranges::any_of(events_ ? watched_ : waited_, is_due);
    std::vector<int> ending;
    for (int w = 0; w < threads_; ++w)
      if (worker(w).step == Step::runs && worker(w).job.finish == now_) ending.push_back(w);
    held_.clear();
    for (const int w : ending) {
      const bool needed = !due && w == ending.back() && held_.size() + 1 == ending.size();
      if (!needed && choices.choose(0, 1) == 1) held_.insert(w);
    }
    for (const int w : ending)
      if (!held_.contains(w)) finish(w);
    if (due) wake(events_ ? threads_ : waiter_);
    for (bool acted = true; acted;) {
      acted = false;
      for (std::size_t i = 0; i < awake_.size(); ++i) {
        const int w = awake_[i];
        if (worker(w).step == Step::runs && (worker(w).job.finish > now_ || held_.contains(w))) continue;
        act(w);
        acted = true;
      }
    }
  }

  /// Equal for states with the same future.
  std::string key() {
    std::string key;
    const auto add = [&key](auto... values) {
      for (const std::int64_t value : {static_cast<std::int64_t>(values)...})
        key.append(reinterpret_cast<const char*>(&value), sizeof value);
    };
    const auto add_all = [&](const auto&... lists) {
      const auto add_list = [&](const auto& list) {
        for (const auto value : list) add(value);
        add(-9);
      };
      (add_list(lists), ...);
    };
    const auto add_data = [&](const History& history) {
      for (std::size_t s = 0; s < graph_->ways.size(); ++s)
        history[s].jobs ? add(history[s].jobs, history[s].oldest - now_, history[s].latest_start - now_)
                        : add(0);
    };
    for (const Worker& w : workers_) {
      add(w.step);
      if (w.step != Step::runs) continue;
      add(w.job.timestamp - now_, w.job.start - now_, w.job.finish - now_, w.job.task, w.job.parent);
      add_data(w.history);
    }
    for (const int t : in_order_) {
      if (task(t).timer) add(state(t).next_call - now_);
      for (const Sample& s : state(t).unread) add(s.published - now_, s.parent), add_data(s.history);
      add(-9, nodes_.jobs()[static_cast<std::size_t>(t)] % 6);  // `every` is at most 3
    }
    for (const auto& set : nodes_.slots())
      for (const auto& kept : set) kept ? add(kept->publisher), add_data(kept->history) : add(-9);
    for (const EventGroup& group : groups_) add(group.idle), add_all(group.events);
    add_all(awake_, idle_, busy_, snapshot_, waited_, ready_, watched_);
    add(guard_, rebuild_, waiter_, woken_);
    return key;
  }

 private:
  const Task& task(int id) const { return graph_->tasks[static_cast<std::size_t>(id)]; }
  TaskState& state(int id) { return tasks_[static_cast<std::size_t>(id)]; }
  Worker& worker(int w) { return workers_[static_cast<std::size_t>(w)]; }
  EventGroup& group_of(int id) { return groups_[static_cast<std::size_t>(task(id).group)]; }
  bool is_free(int id) const { return !busy_[static_cast<std::size_t>(task(id).group)]; }
  bool is_ready(int id) { return state(id).next_call <= now_ || !state(id).unread.empty(); }
  bool waits_for(int id) const { return std::ranges::find(waited_, id) != waited_.end(); }
  bool excludes(int id) const {
    return !graph_->reentrant.contains(task(id).group) && planted_ != Planted::group_ignored;
  }

  void wake(int w) {
    if (w < 0 || worker(w).step != Step::asleep) return;
    worker(w).step = Step::decides;
    awake_.insert(w == threads_ ? awake_.begin() : awake_.end(), w);  // the timer thread is raised
  }

  /// Finds no job.
  int sleep(int w) {
    worker(w).step = Step::asleep;
    std::erase(awake_, w);
    idle_.insert(w);
    return -1;
  }

  void act(int w) {
    if (worker(w).step == Step::runs) return finish(w);
    if (w == threads_) return release_timers();
    idle_.erase(w);
    if (const int t = events_ ? take_event(w) : rebuilds_ ? look_and_rebuild(w) : look(w); t >= 0)
      begin(w, t);
  }

  // MultiThreadedExecutor: a thread that finds nothing waits in rcl_wait and keeps the mutex.

  int look(int w) {
    if (waiter_ >= 0 && waiter_ != w) return sleep(w);
    if (std::exchange(waiter_, -1) == w) poll();
    if (const int found = pick(); found >= 0) return found;
    if (planted_ != Planted::blocked_kept) snapshot_.clear();
    waited_.clear();
    std::ranges::copy_if(in_order_, std::back_inserter(waited_), [this](int t) { return is_free(t); });
    waiter_ = w;
    return std::ranges::any_of(waited_, [this](int t) { return is_ready(t); }) ? -1 : sleep(w);
  }

  void poll() {
    if (planted_ != Planted::blocked_kept) snapshot_.clear();
    for (const int t : waited_)
      if ((is_ready(t) || is_asked_at_turn(t)) && std::ranges::find(snapshot_, t) == snapshot_.end())
        snapshot_.push_back(t);
  }

  bool is_asked_at_turn(int t) const { return rebuilds_ && task(t).intra_process; }

  int pick() {
    const auto first = std::ranges::find_if(
        snapshot_, [this](int t) { return is_free(t) && (is_ready(t) || !is_asked_at_turn(t)); });
    const int found = first == snapshot_.end() ? -1 : *first;
    // Since rclcpp 28, subscriptions of busy groups leave the result.
    const auto leaves = [this](int t) { return rebuilds_ && !task(t).timer; };
    snapshot_.erase(std::remove_if(snapshot_.begin(), first, leaves), first + (found < 0 ? 0 : 1));
    if (found >= 0 && waiter_ < 0 && !idle_.empty()) wake(*idle_.begin());
    return found;
  }

  /// Since rclcpp 28, an interrupted wait makes the thread rebuild the wait set before the next one. A thread
  /// whose job ends while another one waits takes that one's place, which it has woken: they are equal.
  int look_and_rebuild(int w) {
    if (waiter_ == w) waiter_ = -1;
    int found = pick();
    while (found < 0) {
      if (std::exchange(rebuild_, false)) rebuild();
      poll();
      rebuild_ = std::exchange(guard_, false);
      found = pick();
      if (!rebuild_) break;
    }
    if (found >= 0) return found;
    if (waiter_ < 0) waiter_ = w;
    return sleep(w);
  }

  /// Groups that are busy leave; those that are free again follow in the order of a hash map.
  void rebuild() {
    if (planted_ == Planted::order_kept) return;
    std::erase_if(waited_, [this](int t) { return !is_free(t); });
    const auto before = static_cast<std::ptrdiff_t>(waited_.size());
    for (const int t : in_order_)
      if (is_free(t) && !waits_for(t)) waited_.push_back(t);
    std::sort(waited_.begin() + before, waited_.end(), std::greater<>());
    std::ranges::stable_sort(waited_, {}, [this](int t) { return std::ranges::find(kKinds, task(t).kind); });
  }

  // EventsCBGExecutor

  int take_event(int w) {
    if (woken_ == w) woken_ = -1;
    if (ready_.empty()) return sleep(w);
    const int number = ready_.front();
    ready_.erase(ready_.begin());
    std::vector<int>& events = groups_[static_cast<std::size_t>(number)].events;
    const int t = events.front();
    events.erase(events.begin());
    if (at_dispatch_ && graph_->reentrant.contains(number) && !events.empty()) ready_.push_back(number);
    if (at_dispatch_ && !ready_.empty()) wake_one();
    return t;
  }

  void add_event(int id) {
    group_of(id).events.push_back(id);
    if (std::exchange(group_of(id).idle, false)) queue(task(id).group);
  }

  void queue(int group) {
    planted_ == Planted::group_first ? void(ready_.insert(ready_.begin(), group)) : ready_.push_back(group);
    wake_one();
  }

  void wake_one() {
    if (idle_.empty() || woken_ >= 0) return;
    const int w = *idle_.begin();
    idle_.erase(w);
    if (at_dispatch_) woken_ = w;
    wake(w);
  }

  int first_watched() {
    const auto first = std::ranges::min_element(watched_, {}, [this](int t) { return state(t).next_call; });
    return first == watched_.end() ? -1 : *first;
  }

  void release_timers() {
    for (int t = first_watched(); t >= 0 && state(t).next_call <= now_; t = first_watched()) {
      std::erase(watched_, t);
      add_event(t);
    }
    sleep(threads_);
    idle_.erase(threads_);  // it takes no events
  }

  // Jobs

  void begin(int w, int id) {
    const Task& t = task(id);
    Job job{id, 0, Outcome::ran, state(id).next_call};
    History history{};
    if (t.timer) {
      do state(id).next_call += t.period;
      while (state(id).next_call <= now_);
    } else if (state(id).unread.empty()) {
      return after(w, id);  // an event without a sample
    } else {
      const Sample& sample = state(id).unread.front();
      job.timestamp = sample.published;
      job.parent = sample.parent;
      history = sample.history;
      state(id).unread.erase(state(id).unread.begin());
    }
    if (!events_) busy_[static_cast<std::size_t>(t.group)] = excludes(id);
    nodes_.store(job, history);
    job.start = now_;
    job.finish = now_ + (nodes_.works(t) ? choices_->choose(t.best, t.worst) : 0);
    worker(w) = {Step::runs, job, history};
  }

  void finish(int w) {
    const Job job = worker(w).job;
    keep("task", task(job.task).name, now_ - job.timestamp, false);
    const auto observe = [this](const Output& output) {
      const std::string& chain = graph_->chains[static_cast<std::size_t>(output.chain)].name;
      keep("hot_path", chain, output.hot_path, output.duplicates);
      keep("chain", chain, output.end_to_end, false);
    };
    nodes_.publish(job, worker(w).history, observe, [&](int reader, const History& history) {
      std::vector<Sample>& unread = state(reader).unread;
      if (unread.size() == task(reader).depth) unread.erase(unread.begin());
      unread.push_back({0, now_, 0, job.task, 0, history});
      events_ ? add_event(reader) : waits_for(reader) ? wake(waiter_) : void();
    });
    after(w, job.task);
  }

  void after(int w, int id) {
    worker(w).step = Step::decides;
    if (!events_) {
      busy_[static_cast<std::size_t>(task(id).group)] = false;
      guard_ = guard_ || (rebuilds_ && excludes(id));
      return !rebuilds_ || excludes(id) ? wake(waiter_) : void();
    }
    group_of(id).idle = group_of(id).events.empty();
    const bool waits = std::ranges::find(ready_, task(id).group) != ready_.end();
    if (!group_of(id).idle && !waits) queue(task(id).group);
    if (!task(id).timer) return;
    watched_.push_back(id);
    if (first_watched() == id) wake(threads_);
  }

  void keep(const std::string& kind, const std::string& name, Nanoseconds value, bool duplicates) {
    Nanoseconds& largest = worst_->values.try_emplace({kind, name}, value).first->second;
    largest = std::max(largest, value);
    if (duplicates) worst_->duplicates.insert({kind, name});
  }

  const Graph* graph_;
  Planted planted_;
  bool events_, at_dispatch_, rebuilds_;
  int threads_;
  Choices* choices_ = nullptr;
  Worst* worst_ = nullptr;
  Nanoseconds now_ = 0;
  std::vector<TaskState> tasks_;
  Nodes nodes_;
  std::vector<Worker> workers_;  ///< The threads, then the timer thread of cbg.
  std::vector<int> in_order_{};  ///< Tasks by kind, then by creation.
  std::vector<int> awake_{};
  std::set<int> idle_{};
  std::vector<bool> busy_;  ///< Groups of wait sets.
  std::vector<int> snapshot_{}, waited_{};
  bool guard_ = false, rebuild_ = false;  ///< The guard condition is triggered; entities_need_rebuild_.
  int waiter_ = -1;                       ///< The thread in rcl_wait.
  std::vector<EventGroup> groups_;        ///< Of cbg.
  std::vector<int> ready_{};
  std::set<int> held_{};        ///< Threads whose jobs end in a later call.
  std::vector<int> watched_{};  ///< Timers, in the order in which the timer thread got them.
  int woken_ = -1;              ///< Has not looked for a group yet.
};

}  // namespace independent
