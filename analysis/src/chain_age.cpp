// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/chain_age.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "hotpath/analysis/exact.hpp"

namespace hotpath {

namespace {

using exact::add, exact::multiply, exact::subtract;

/// The age of a job's data at the timestamp of the timer that leads to the job; std::nullopt if the
/// job has no data of a source.
using Delay = std::optional<std::int64_t>;

class Ages {
 public:
  Ages(const GraphTopology& topology, const PathBounds& paths, const CallbackGraph::DataChain& chain)
      : topology_(topology), graph_(topology.graph()), paths_(paths), chain_(chain) {}

  std::optional<ChainAge> largest() {
    std::optional<ChainAge> age;
    for (const TaskId sink : chain_.sinks) {
      for (const TaskId root : topology_.roots(sink)) {
        const Delay delay = message_delay(root, sink);
        if (!delay) continue;
        const std::int64_t response = finish(root, sink);
        const std::int64_t latency = add(*delay, response);
        if (!age || latency > age->latency) age = {latency, response, *delay, root, sink, kNoTask, {}};
      }
    }
    if (!age) return age;
    age->waited_at = waited_at(age->last_timer, age->sink);
    age->parts = paths_.parts(age->last_timer, age->sink);
    return age;
  }

 private:
  using Pair = std::pair<TaskId, TaskId>;  // a timer and a task that it leads to

  [[noreturn]] void fail(TaskId root, TaskId to) const {
    throw AnalysisError("from " + topology_.set()[root].name + " to " + topology_.set()[to].name +
                        " there is no bound: the work that may come before can use all processor time");
  }

  using Bound = std::optional<std::int64_t> (PathBounds::*)(TaskId, TaskId) const;

  std::int64_t known(std::map<Pair, std::int64_t>& all, Bound bound, TaskId root, TaskId to) const {
    const auto [entry, is_new] = all.try_emplace({root, to});
    if (!is_new) return entry->second;
    const std::optional<std::int64_t> value = (paths_.*bound)(root, to);
    if (!value) fail(root, to);
    return entry->second = *value;
  }

  std::int64_t finish(TaskId root, TaskId to) { return known(finish_, &PathBounds::until_finish, root, to); }
  std::int64_t start(TaskId root, TaskId to) { return known(start_, &PathBounds::until_start, root, to); }

  /// The last task on the path whose message is older than the sample that it took.
  TaskId waited_at(TaskId root, TaskId id) {
    const Delay sample = sample_delay(root, id);
    const Delay message = message_delay(root, id);
    if (sample < message) return id;
    for (const TaskId p : topology_.publishers(id)) {
      if (id != root && leads_to(root, p) && message_delay(root, p) == message) return waited_at(root, p);
    }
    return kNoTask;
  }

  /// Bound on the end of a job, whether or not it completes its join.
  std::int64_t latest(TaskId root, TaskId to) { return std::max(start(root, to), finish(root, to)); }

  /// The age of the sample that a job takes.
  Delay sample_delay(TaskId root, TaskId id) {
    if (id == root) {
      const bool source = std::find(chain_.sources.begin(), chain_.sources.end(), id) != chain_.sources.end();
      return source ? Delay(0) : Delay();
    }
    Delay largest;
    for (const TaskId p : topology_.publishers(id)) {
      if (!leads_to(root, p)) continue;
      largest = std::max(largest, message_delay(root, p));
    }
    return largest;
  }

  /// The age of the data that a job publishes: of its own sample, and of the samples that waited
  /// for it.
  Delay message_delay(TaskId root, TaskId id) {
    const auto [entry, is_new] = message_.try_emplace({root, id});
    if (!is_new) {
      if (open_.contains({root, id})) {
        throw AnalysisError("data goes round in a circle through " + topology_.set()[id].name);
      }
      return entry->second;
    }
    open_.insert({root, id});
    Delay largest = sample_delay(root, id);
    const auto waited = [&](TaskId input, std::int64_t longest) {
      const Delay age = stored_age(input);
      if (!age) return;
      // The sample was the newest of its input, so the next one came later.
      const std::int64_t newest = subtract(gap(input, &Ages::start), topology_.least_until_start(root, id));
      largest = std::max(largest, Delay(add(*age, std::min(longest, newest))));
    };
    if (const auto* join = topology_.join_of(id)) {
      for (const TaskId other : join->inputs) {
        if (other != id) waited(other, join_wait(root, id, other));
      }
    }
    // A job reads these inputs at its end, so their samples came after the previous job.
    for (const TaskId input : graph_.reads[id]) waited(input, read_wait(root, id, input));
    open_.erase({root, id});
    return message_[{root, id}] = largest;
  }

  /// Largest age of an input's data at the start of its job, which stores the data.
  Delay stored_age(TaskId input) {
    Delay largest;
    for (const TaskId root : topology_.roots(input)) {
      const Delay delay = sample_delay(root, input);
      if (delay) largest = std::max(largest, Delay(add(*delay, start(root, input))));
    }
    return largest;
  }

  /// Time from the storing of a sample of `other` to the timestamp of `root` whose data completes
  /// the join at input `id`. No job of this input started in between.
  std::int64_t join_wait(TaskId root, TaskId id, TaskId other) {
    const std::int64_t least = topology_.least_until_start(root, id);
    const bool each_arrives = topology_.alone(root, id) && start(root, id) <= period(root);
    const std::int64_t longest = each_arrives ? period(root) : gap(id, &Ages::start);
    return add(subtract(longest, least), first_wait(id, other, least));
  }

  /// Time from the storing of a sample of `input` to the timestamp of `root` whose job reads it;
  /// the previous job has not read it.
  std::int64_t read_wait(TaskId root, TaskId id, TaskId input) {
    return add(id == root ? period(id) : gap(id, &Ages::latest), first_wait(id, input, 0));
  }

  /// Additional wait for the first job of `id` after a sample of `other`: as if each timer had had
  /// a job one period before its first. The lower bound `least` does not apply to that job, because
  /// it did not run.
  std::int64_t first_wait(TaskId id, TaskId other, std::int64_t least) const {
    std::int64_t earliest = std::numeric_limits<std::int64_t>::max(), shortest = earliest;
    for (const TaskId timer : topology_.roots(other)) {
      earliest = std::min(earliest, topology_.set()[timer].phase.count());
      shortest = std::min(shortest, period(timer));
    }
    if (!graph_.phases_known)
      return add(least, std::max<std::int64_t>(0, graph_.creation_spread.count() - shortest));
    std::int64_t latest = 0;
    for (const TaskId timer : topology_.roots(id)) {
      latest = std::max(latest, topology_.set()[timer].phase.count() - period(timer) - earliest + least);
    }
    return latest;
  }

  std::int64_t period(TaskId timer) const { return topology_.set()[timer].period.count(); }

  /// Longest time between the starts or ends of two consecutive jobs. It follows from the gaps
  /// between publications at borders on the path: timers, joins, and tasks with several publishers.
  std::int64_t gap(TaskId id, std::int64_t (Ages::*until)(TaskId, TaskId)) {
    std::map<TaskId, std::int64_t>& known = until == &Ages::start ? start_gap_ : end_gap_;
    const auto entry = known.find(id);
    return entry != known.end() ? entry->second : known[id] = find_gap(id, until);
  }

  std::int64_t find_gap(TaskId id, std::int64_t (Ages::*until)(TaskId, TaskId)) {
    TaskId border = id;
    while (topology_.publishers(border).size() == 1) {
      const TaskId p = topology_.publishers(border).front();
      if (topology_.set()[p].kind == TaskKind::timer && graph_.every[p] == 1) {
        return add(period(p), (this->*until)(p, id));
      }
      if (graph_.every[p] > 1 || topology_.join_of(p) != nullptr) break;
      border = p;
    }
    std::optional<std::int64_t> shortest;
    for (const TaskId p : topology_.publishers(border)) {
      if (topology_.roots(p).empty()) continue;
      const std::int64_t longest = add(publication_gap(p), after_publication(p, id, until));
      shortest = shortest ? std::min(*shortest, longest) : longest;
    }
    if (!shortest) throw AnalysisError("no task publishes to " + topology_.set()[id].name);
    return *shortest;
  }

  /// Longest time from a publication of `p`, or of its join, to the job of `id` that it leads to.
  std::int64_t after_publication(TaskId p, TaskId id, std::int64_t (Ages::*until)(TaskId, TaskId)) {
    const auto* join = topology_.join_of(p);
    std::int64_t longest = 0;
    for (const TaskId from : join ? join->inputs : std::vector<TaskId>{p}) {
      for (const TaskId root : topology_.roots(from)) {
        const std::int64_t least =
            add(topology_.least_until_start(root, from), topology_.set()[from].bcet.count());
        longest = std::max(longest, subtract((this->*until)(root, id), least));
      }
    }
    return longest;
  }

  std::int64_t publication_gap(TaskId id) {
    std::int64_t longest = 0;
    if (topology_.set()[id].kind == TaskKind::timer) {
      longest = add(period(id), finish(id, id));
    } else if (const auto* join = topology_.join_of(id)) {
      for (const TaskId input : join->inputs) longest = std::max(longest, gap(input, &Ages::latest));
    } else {
      longest = gap(id, &Ages::latest);
    }
    return multiply(longest, static_cast<std::int64_t>(graph_.every[id]));
  }

  bool leads_to(TaskId root, TaskId id) const {
    const std::vector<TaskId>& roots = topology_.roots(id);
    return std::binary_search(roots.begin(), roots.end(), root);
  }

  const GraphTopology& topology_;
  const CallbackGraph& graph_;
  const PathBounds& paths_;
  const CallbackGraph::DataChain& chain_;
  std::map<Pair, std::int64_t> start_, finish_;
  std::map<Pair, Delay> message_;
  std::set<Pair> open_;
  std::map<TaskId, std::int64_t> start_gap_, end_gap_;
};

}  // namespace

std::optional<ChainAge> chain_age(const GraphTopology& topology, const PathBounds& paths,
                                  const CallbackGraph::DataChain& chain, std::string& why) {
  try {
    auto age = Ages(topology, paths, chain).largest();
    if (!age) why = "no data of its sources reaches its sink";
    return age;
  } catch (const AnalysisError& error) {
    why = error.what();
    return std::nullopt;
  }
}

}  // namespace hotpath
