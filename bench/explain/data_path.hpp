// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <set>
#include <utility>
#include <vector>

#include "explain/system.hpp"

namespace hotpath::explain {

/// A started job. A job that was running at the end of the run has the finish kNever.
struct Seen {
  JobRecord record;
  std::uint64_t order = 0;  ///< Counts the started jobs of the repetition, in order of start.
};

/// The started jobs of one repetition that ended recently, by task and by worker.
class JobWindow {
 public:
  explicit JobWindow(TaskId tasks) : by_task_(tasks) {}

  /// Adds a started job, in order of start, and returns it; valid until it is forgotten.
  const Seen& add(const JobRecord& record);
  /// Forgets jobs that finished before `horizon`.
  void forget_before(Time horizon);
  void clear();

  /// nullptr: not in the window.
  [[nodiscard]] const Seen* find(JobRef job) const;
  /// In order of start.
  [[nodiscard]] const std::deque<Seen>& of_task(TaskId task) const { return by_task_[task]; }
  /// The jobs of a worker that ran at some time in [from, to), in order of start.
  [[nodiscard]] std::vector<const Seen*> of_worker(std::size_t worker, Time from, Time to) const;
  /// The same of all other workers, by worker.
  [[nodiscard]] std::vector<const Seen*> beside(std::size_t worker, Time from, Time to) const;

 private:
  std::vector<std::deque<Seen>> by_task_, by_worker_;
  std::uint64_t next_order_ = 0;
};

/// Follows the data of a chain's outputs backwards through recorded jobs.
class DataPath {
 public:
  /// `chain`: nullptr if no path will be asked for.
  DataPath(const System& system, const JobWindow& window, const ChainIndex* chain);

  /// Notes the sets that a started job completes. Jobs are added in order of start.
  void add(const Seen& job);
  /// Forgets all jobs.
  void clear();

  /// The jobs that carried the data of a source's job with the start or timestamp `source` to `sink`, in
  /// order. Where several ways lead there, the one whose data came last. Empty: there is no way.
  [[nodiscard]] std::vector<const Seen*> from_source(const Seen& sink, Time source, bool by_start);

 private:
  static constexpr std::size_t kOwn = ~std::size_t{0};  ///< The sample that a job took, not a publication.
  /// A set of the sink's node, with the inputs that have a sample.
  struct Set {
    Publication what;
    std::set<std::uint32_t> inputs;
  };
  using Message = std::pair<std::uint64_t, std::size_t>;  // Seen::order and publication

  [[nodiscard]] const std::vector<Publication>& publications_of(const Seen& job) const {
    return system_.tasks.callbacks[job.record.job.task].publishes;
  }
  [[nodiscard]] std::vector<std::size_t> messages_of(const Seen& sink) const;
  bool reach(const Seen& job, std::size_t publication);
  [[nodiscard]] std::vector<const Seen*> stored_for(const Seen& job, const Publication& message) const;
  [[nodiscard]] const Seen* last_stored(TaskId input, const Seen& job, const Publication& message) const;

  const System& system_;
  const JobWindow& window_;
  const ChainIndex* const chain_;
  std::vector<Set> sets_;
  std::set<Message> completed_;
  // Of the current search:
  Time source_{};
  bool by_start_ = true;
  std::set<Message> visited_;
  std::vector<const Seen*> path_;  // from the source on
};

}  // namespace hotpath::explain
