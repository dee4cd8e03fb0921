// SPDX-License-Identifier: Apache-2.0
#include "explain/data_path.hpp"

#include <algorithm>

namespace hotpath::explain {

namespace {

/// Limits the recursion; a path has as many jobs as the graph has tasks, or a few times more.
constexpr std::size_t kMostJobs = 10'000;

}  // namespace

std::vector<const Seen*> DataPath::from_source(const Seen& sink, const ChainIndex& chain, Time source_start) {
  chain_ = &chain;
  source_start_ = source_start;
  visited_.clear();
  path_.clear();
  reach(sink, Samples::all, kNoTask);
  return path_;
}

std::vector<const Seen*> DataPath::of_triggers(const Seen& sink, Time begin) const {
  std::vector<const Seen*> path = {&sink};
  while (path.back()->record.start > begin) {
    const Seen* const publisher = window_.find(path.back()->record.job.parent);
    if (publisher == nullptr || publisher->order >= path.back()->order) break;
    path.push_back(publisher);
  }
  std::ranges::reverse(path);
  return path;
}

bool DataPath::reach(const Seen& job, Samples samples, TaskId reader) {
  const Time start = job.record.start;
  if (start < source_start_ || visited_.size() >= kMostJobs) return false;
  if (!visited_.emplace(job.order, samples == Samples::own).second) return false;
  const bool is_source = std::ranges::count(chain_->sources, job.record.job.task) > 0;
  bool reached = is_source && start == source_start_;
  if (!reached) {
    // A job's own sample came later than all samples that its node had stored.
    const Seen* const publisher = window_.find(job.record.job.parent);
    reached = publisher != nullptr && publisher->order < job.order &&
              reach(*publisher, Samples::of_message, job.record.job.task);
  }
  if (!reached && samples != Samples::own) {
    reached = std::ranges::any_of(stored_for(job, samples, reader),
                                  [&](const Seen* stored) { return reach(*stored, Samples::own, kNoTask); });
  }
  if (reached) path_.push_back(&job);
  return reached;
}

/// The jobs of the node's other inputs whose samples the job's messages contain, the latest first.
std::vector<const Seen*> DataPath::stored_for(const Seen& job, Samples samples, TaskId reader) const {
  const GraphTasks& tasks = system_.tasks();
  const TaskId id = job.record.job.task;
  const std::vector<Publication>& publications = tasks.callbacks[id].publishes;
  std::vector<const Seen*> stored;
  for (std::size_t p = 0; p < publications.size(); ++p) {
    if (samples == Samples::of_message && std::ranges::count(tasks.readers[id][p], reader) == 0) continue;
    for (const TaskId input : tasks.merged_inputs(id)) {
      if (input == id || std::ranges::count(publications[p].of, *tasks.origin[input].input) == 0) continue;
      const Seen* const last = last_stored(input, job, publications[p].rule);
      if (last != nullptr) stored.push_back(last);
    }
  }
  std::ranges::sort(stored, std::greater<>(), &Seen::order);
  return stored;
}

/// The job that stored the sample of `input` that a message of `job` contains. A set is complete
/// when the job starts; a cyclic node reads its inputs when its timer's work is done.
const Seen* DataPath::last_stored(TaskId input, const Seen& job, PublishRule rule) const {
  const std::deque<Seen>& jobs = window_.of_task(input);
  const auto last = std::find_if(jobs.rbegin(), jobs.rend(), [&](const Seen& s) {
    return s.order < job.order || (rule == PublishRule::last_of && s.record.start < job.record.finish);
  });
  return last == jobs.rend() ? nullptr : &*last;
}

}  // namespace hotpath::explain
