// SPDX-License-Identifier: Apache-2.0
#include "explain/explainer.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "program/memory_limit.hpp"

namespace hotpath::explain {

namespace {

/// Limits the recursion; a path has as many jobs as the graph has tasks, or a few times more.
constexpr std::size_t kMostJobs = 10'000;

/// When the job publishes. Only estimated before its end if other threads displace it.
Time published(const Seen& job, const Publication& message) {
  const Duration whole = job.record.duration();
  if (message.at == 1 || job.record.outcome != Outcome::ran) return job.record.finish;
  return job.record.start + Duration(std::llround(message.at * static_cast<double>(whole.count())));
}

}  // namespace

const Seen& JobWindow::add(const JobRecord& record) {
  Seen seen{record, next_order_++};
  if (record.outcome == Outcome::running) seen.record.finish = kNever;
  if (record.worker >= by_worker_.size()) by_worker_.resize(record.worker + 1U);
  by_worker_[record.worker].push_back(seen);
  return by_task_[record.job.task].emplace_back(seen);
}

void JobWindow::forget_before(Time horizon) {
  const auto forget = [horizon](std::deque<Seen>& jobs) {
    while (!jobs.empty() && jobs.front().record.finish < horizon) jobs.pop_front();
  };
  std::ranges::for_each(by_worker_, forget);
  std::ranges::for_each(by_task_, forget);
}

void JobWindow::clear() {
  for (std::deque<Seen>& jobs : by_task_) jobs.clear();
  by_worker_.clear();
  next_order_ = 0;
}

const Seen* JobWindow::find(JobRef job) const {
  if (job.task >= by_task_.size()) return nullptr;
  const std::deque<Seen>& jobs = by_task_[job.task];
  const auto match =
      std::find_if(jobs.rbegin(), jobs.rend(), [&](const Seen& s) { return s.record.job.ref() == job; });
  return match == jobs.rend() ? nullptr : &*match;
}

std::vector<const Seen*> JobWindow::of_worker(std::size_t worker, Time from, Time to) const {
  std::vector<const Seen*> jobs;
  if (worker >= by_worker_.size()) return jobs;
  const std::deque<Seen>& all = by_worker_[worker];
  for (auto seen = all.rbegin(); seen != all.rend() && seen->record.finish > from; ++seen) {
    if (seen->record.start < to) jobs.push_back(&*seen);
  }
  std::ranges::reverse(jobs);
  return jobs;
}

std::vector<const Seen*> JobWindow::beside(std::size_t worker, Time from, Time to) const {
  std::vector<const Seen*> jobs;
  for (std::size_t other = 0; other < by_worker_.size(); ++other) {
    if (other == worker) continue;
    const std::vector<const Seen*> of_other = of_worker(other, from, to);
    jobs.insert(jobs.end(), of_other.begin(), of_other.end());
  }
  return jobs;
}

DataPath::DataPath(const System& system, const JobWindow& window, const ChainIndex* chain)
    : system_(system), window_(window), chain_(chain) {
  const GraphTasks& tasks = system_.tasks;
  for (TaskId id = 0; chain_ != nullptr && id < tasks.set.size(); ++id) {
    if (tasks.origin[id].node != chain_->sink) continue;
    for (const Publication& p : tasks.callbacks[id].publishes) {
      const auto same = [&](const Set& set) { return same_rule(set.what, p); };
      if (p.rule == PublishRule::all_new && std::ranges::none_of(sets_, same)) sets_.push_back({p, {}});
    }
  }
}

void DataPath::add(const Seen& job) {
  const TaskOrigin& origin = system_.tasks.origin[job.record.job.task];
  if (sets_.empty() || origin.node != chain_->sink) return;
  for (Set& set : sets_) {
    if (origin.input && std::ranges::count(set.what.of, *origin.input) > 0) set.inputs.insert(*origin.input);
  }
  const std::vector<Publication>& publications = publications_of(job);
  for (std::size_t p = 0; p < publications.size(); ++p) {
    for (Set& set : sets_) {
      if (!same_rule(set.what, publications[p]) || set.inputs.size() < set.what.of.size()) continue;
      completed_.emplace(job.order, p);
      set.inputs.clear();
    }
  }
}

void DataPath::clear() {
  completed_.clear();
  for (Set& set : sets_) set.inputs.clear();
}

std::vector<const Seen*> DataPath::from_source(const Seen& sink, Time source, bool by_start) {
  source_ = source;
  by_start_ = by_start;
  for (const std::size_t publication : messages_of(sink)) {
    visited_.clear();
    path_.clear();
    if (reach(sink, publication)) break;
  }
  return path_;
}

/// The publications of the sink's job in their order, since the first message that contains data of a source
/// counts; last those that wait for a set which it does not complete as far as the trace tells.
std::vector<std::size_t> DataPath::messages_of(const Seen& sink) const {
  const std::vector<Publication>& publications = publications_of(sink);
  if (publications.empty()) return {kOwn};
  std::vector<std::size_t> messages(publications.size());
  std::iota(messages.begin(), messages.end(), std::size_t{0});
  std::ranges::stable_sort(messages, {}, [&](std::size_t p) {
    const bool waits = publications[p].rule == PublishRule::all_new && !completed_.contains({sink.order, p});
    return std::pair(waits, publications[p].at);
  });
  return messages;
}

/// `publication` of the job: the samples in its message count.
bool DataPath::reach(const Seen& job, std::size_t publication) {
  const Time instant = by_start_ ? job.record.start : job.record.job.timestamp;
  if (std::max(instant, job.record.start) < source_ || visited_.size() >= kMostJobs) return false;
  if (!visited_.emplace(job.order, publication).second) return false;
  bool reached = instant == source_ && std::ranges::count(chain_->sources, job.record.job.task) > 0;
  // A job's own sample came later than all samples that its node had stored.
  const Seen* const publisher = reached ? nullptr : window_.find(job.record.job.parent);
  if (publisher != nullptr && publisher->order < job.order) {
    const auto& readers = system_.tasks.readers[publisher->record.job.task];
    const auto own = std::ranges::find_if(
        readers, [&](const auto& of_topic) { return std::ranges::count(of_topic, job.record.job.task) > 0; });
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
std::vector<const Seen*> DataPath::stored_for(const Seen& job, const Publication& message) const {
  const TaskId id = job.record.job.task;
  std::vector<const Seen*> stored;
  for (const TaskId input : system_.tasks.merged_inputs(id)) {
    if (input == id || std::ranges::count(message.of, *system_.tasks.origin[input].input) == 0) continue;
    const Seen* const last = last_stored(input, job, message);
    if (last != nullptr) stored.push_back(last);
  }
  std::ranges::sort(stored, std::greater<>(), &Seen::order);
  return stored;
}

/// The job that stored the sample of `input` that a message of `job` contains. A set is complete
/// when the job starts; `last_of` reads its inputs at the publication, and leaves out a sample that an
/// earlier message contains.
const Seen* DataPath::last_stored(TaskId input, const Seen& job, const Publication& message) const {
  const bool last_of = message.rule == PublishRule::last_of;
  const auto is_before = [&](const Seen& stored, const Seen& reading) {
    return stored.order < reading.order || (last_of && stored.record.start < published(reading, message));
  };
  const std::deque<Seen>& jobs = window_.of_task(input);
  const auto last =
      std::find_if(jobs.rbegin(), jobs.rend(), [&](const Seen& s) { return is_before(s, job); });
  if (last == jobs.rend()) return nullptr;
  const auto place = [&](const Seen& s) { return std::pair(published(s, message), s.order); };
  const auto took_it = [&](const Seen& other) {
    return place(other) < place(job) && is_before(*last, other);
  };
  if (last_of && std::ranges::any_of(window_.of_task(job.record.job.task), took_it)) return nullptr;
  return &*last;
}

}  // namespace hotpath::explain
