// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include "hotpath/core/trace.hpp"
#include "hotpath/reference_system/chain_observation.hpp"

namespace hotpath::explain {

/// A started job. A job that was running at the end of the run has the finish kNever.
struct Seen : JobRecord {
  std::uint64_t order = 0;  ///< Counts the started jobs of the repetition, in order of start.
};
using Jobs = std::vector<const Seen*>;

/// The started jobs of one repetition that ended recently, by task and by worker.
class JobWindow {
 public:
  explicit JobWindow(TaskId tasks) : by_task_(tasks) {}

  /// Adds a started job, in order of start, and returns it; valid until it is forgotten.
  const Seen& add(const JobRecord& record) {
    Seen seen{record, next_order_++};
    if (seen.outcome == Outcome::running) seen.finish = kNever;
    if (seen.worker >= by_worker_.size()) by_worker_.resize(seen.worker + 1U);
    by_worker_[seen.worker].push_back(seen);
    return by_task_[seen.job.task].emplace_back(seen);
  }
  /// Forgets jobs that finished before `horizon`.
  void forget_before(Time horizon) {
    for (auto* const all : {&by_task_, &by_worker_}) {
      for (std::deque<Seen>& jobs : *all)
        while (!jobs.empty() && jobs.front().finish < horizon) jobs.pop_front();
    }
  }

  /// nullptr: not in the window.
  [[nodiscard]] const Seen* find(JobRef job) const {
    if (job.task >= by_task_.size()) return nullptr;
    return last_of(job.task, [&](const Seen& seen) { return seen.job.ref() == job; });
  }
  /// `sink` and the jobs that published the samples that started it, back to the last one that started
  /// at or before `begin`, as far as the trace has them.
  [[nodiscard]] Jobs of_triggers(const Seen& sink, Time begin) const {
    Jobs path = {&sink};
    while (path.back()->start > begin) {
      const Seen* const publisher = find(path.back()->job.parent);
      if (publisher == nullptr || publisher->order >= path.back()->order) break;
      path.push_back(publisher);
    }
    std::ranges::reverse(path);
    return path;
  }
  /// The last job of a task for which `holds`; nullptr: none in the window.
  [[nodiscard]] const Seen* last_of(TaskId task, const auto& holds) const {
    const std::deque<Seen>& jobs = by_task_[task];
    const auto last = std::find_if(jobs.rbegin(), jobs.rend(), holds);
    return last == jobs.rend() ? nullptr : &*last;
  }
  /// In order of start.
  [[nodiscard]] const std::deque<Seen>& of_task(TaskId task) const { return by_task_[task]; }
  /// The jobs of a worker, or of all others, that ran at some time in [from, to), in order of start.
  [[nodiscard]] Jobs of_worker(std::size_t worker, Time from, Time to, bool others = false) const {
    Jobs jobs;
    for (std::size_t w = 0; w < by_worker_.size(); ++w) {
      const std::deque<Seen>& all = by_worker_[w];
      if ((w == worker) == others) continue;
      for (auto seen = all.rbegin(); seen != all.rend() && seen->finish > from; ++seen)
        if (seen->start < to) jobs.push_back(&*seen);
    }
    std::ranges::sort(jobs, {}, &Seen::order);
    return jobs;
  }

 private:
  std::vector<std::deque<Seen>> by_task_, by_worker_;
  std::uint64_t next_order_ = 0;
};

/// Follows the data of a chain's outputs backwards through recorded jobs.
class DataPath {
 public:
  DataPath(const GraphTasks& tasks, const JobWindow& window, const ChainIndex& chain)
      : tasks_(tasks), window_(window), chain_(chain) {
    for (TaskId id = 0; id < tasks.set.size(); ++id) {
      if (tasks.origin[id].node != chain.sink) continue;
      for (const Publication& p : tasks.callbacks[id].publishes) {
        const auto same = [&](const Set& set) { return same_rule(set.what, p); };
        if (p.rule == PublishRule::all_new && std::ranges::none_of(sets_, same)) sets_.push_back({p, {}});
      }
    }
  }

  /// Notes the sets that a started job completes. Jobs are added in order of start.
  void add(const Seen& job) {
    const TaskOrigin& origin = tasks_.origin[job.job.task];
    if (origin.node != chain_.sink) return;
    const std::vector<Publication>& publications = publications_of(job);
    for (Set& set : sets_) {
      if (origin.input && std::ranges::count(set.what.of, *origin.input) > 0)
        set.inputs.insert(*origin.input);
      for (std::size_t p = 0; p < publications.size(); ++p) {
        if (!same_rule(set.what, publications[p]) || set.inputs.size() < set.what.of.size()) continue;
        completed_.emplace(job.order, p);
        set.inputs.clear();
      }
    }
  }

  /// The jobs that carried the data of a source's job with the start or timestamp `source` to `sink`, in
  /// order. Where several ways lead there, the one whose data came last. Empty: there is no way.
  [[nodiscard]] Jobs from_source(const Seen& sink, Time source, bool by_start) {
    source_ = source;
    by_start_ = by_start;
    for (const std::size_t publication : messages_of(sink)) {
      visited_.clear();
      path_.clear();
      if (reach(sink, publication)) break;
    }
    return path_;
  }

 private:
  static constexpr std::size_t kOwn = ~std::size_t{0};  ///< The sample that a job took, not a publication.
  /// Limits the recursion; a path has as many jobs as the graph has tasks, or a few times more.
  static constexpr std::size_t kMostJobs = 10'000;
  /// A set of the sink's node, with the inputs that have a sample.
  struct Set {
    Publication what;
    std::set<std::uint32_t> inputs;
  };
  using Message = std::pair<std::uint64_t, std::size_t>;  // Seen::order and publication

  [[nodiscard]] const std::vector<Publication>& publications_of(const Seen& job) const {
    return tasks_.callbacks[job.job.task].publishes;
  }

  /// The publications of the sink's job in their order, since the first message that contains data of a
  /// source counts; last those that wait for a set which it does not complete as far as the trace tells.
  [[nodiscard]] std::vector<std::size_t> messages_of(const Seen& sink) const {
    const std::vector<Publication>& publications = publications_of(sink);
    if (publications.empty()) return {kOwn};
    std::vector<std::size_t> messages(publications.size());
    std::iota(messages.begin(), messages.end(), std::size_t{0});
    std::ranges::stable_sort(messages, {}, [&](std::size_t p) {
      const bool waits =
          publications[p].rule == PublishRule::all_new && !completed_.contains({sink.order, p});
      return std::pair(waits, publications[p].at);
    });
    return messages;
  }

  /// `publication` of the job: the samples in its message count.
  bool reach(const Seen& job, std::size_t publication) {
    const Time instant = by_start_ ? job.start : job.job.timestamp;
    if (std::max(instant, job.start) < source_ || visited_.size() >= kMostJobs) return false;
    if (!visited_.emplace(job.order, publication).second) return false;
    bool reached = instant == source_ && std::ranges::count(chain_.sources, job.job.task) > 0;
    // A job's own sample came later than all samples that its node had stored.
    const Seen* const publisher = reached ? nullptr : window_.find(job.job.parent);
    if (publisher != nullptr && publisher->order < job.order) {
      const auto& readers = tasks_.readers[publisher->job.task];
      const auto own = std::ranges::find_if(
          readers, [&](const auto& of_topic) { return std::ranges::count(of_topic, job.job.task) > 0; });
      reached =
          reach(*publisher, own == readers.end() ? kOwn : static_cast<std::size_t>(own - readers.begin()));
    }
    if (!reached && publication != kOwn) {
      reached = std::ranges::any_of(stored_for(job, publications_of(job)[publication]),
                                    [&](const Seen* stored) { return reach(*stored, kOwn); });
    }
    if (reached) path_.push_back(&job);
    return reached;
  }

  /// The jobs of the node's other inputs whose samples the job's message contains, the latest first.
  [[nodiscard]] Jobs stored_for(const Seen& job, const Publication& message) const {
    Jobs stored;
    for (const TaskId input : tasks_.merged_inputs(job.job.task)) {
      if (input == job.job.task || std::ranges::count(message.of, *tasks_.origin[input].input) == 0) continue;
      if (const Seen* const last = last_stored(input, job, message)) stored.push_back(last);
    }
    std::ranges::sort(stored, std::greater<>(), &Seen::order);
    return stored;
  }

  /// The job that stored the sample of `input` that a message of `job` contains. A set is complete
  /// when the job starts; `last_of` reads its inputs at the publication, and leaves out a sample that an
  /// earlier message contains.
  [[nodiscard]] const Seen* last_stored(TaskId input, const Seen& job, const Publication& message) const {
    const bool last_of = message.rule == PublishRule::last_of;
    const auto is_before = [&](const Seen& stored, const Seen& reading) {
      return stored.order < reading.order || (last_of && stored.start < published(reading, message));
    };
    const Seen* const last = window_.last_of(input, [&](const Seen& s) { return is_before(s, job); });
    const auto place = [&](const Seen& s) { return std::pair(published(s, message), s.order); };
    const auto took_it = [&](const Seen& other) {
      return place(other) < place(job) && is_before(*last, other);
    };
    const bool taken =
        last != nullptr && last_of && std::ranges::any_of(window_.of_task(job.job.task), took_it);
    return taken ? nullptr : last;
  }

  /// When the job publishes. Only estimated before its end if other threads displace it.
  static Time published(const Seen& job, const Publication& message) {
    if (message.at == 1 || job.outcome != Outcome::ran) return job.finish;
    return job.start + Duration(std::llround(message.at * static_cast<double>(job.duration().count())));
  }

  const GraphTasks& tasks_;
  const JobWindow& window_;
  const ChainIndex& chain_;
  std::vector<Set> sets_;
  std::set<Message> completed_;
  // Of the current search:
  Time source_{};
  bool by_start_ = true;
  std::set<Message> visited_;
  Jobs path_;  // from the source on
};

}  // namespace hotpath::explain
