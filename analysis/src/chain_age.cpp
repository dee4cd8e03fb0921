// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/chain_age.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

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
    std::optional<std::int64_t> hot_path;
    for (const TaskId sink : chain_.sinks) {
      for (const TaskId root : topology_.roots(sink)) {
        const Delay latency = age_at_end(root, sink);
        if (!latency) continue;
        hot_path = std::max(hot_path, Delay(since_source_start(root, sink, *latency)));
        if (age && *latency <= age->latency) continue;
        const std::int64_t response = std::min(*latency, finish(root, sink));
        age = {*latency, response, *latency - response, root, sink, kNoTask, {}, {}};
      }
    }
    if (!age) return age;
    if (age->waiting > 0) age->waited_at = waited_at(age->last_timer, age->sink);
    age->parts = paths_.parts(age->last_timer, age->sink);
    age->hot_path = hot_path;
    return age;
  }

 private:
  using Pair = std::pair<TaskId, TaskId>;  // a timer and a task that it leads to

  [[noreturn]] void fail(TaskId root, TaskId to) const {
    throw AnalysisError("from " + topology_.set()[root].name + " to " + topology_.set()[to].name +
                        " there is no bound: the work that may come before can use all processor time");
  }

  [[noreturn]] void fail_in_circle(TaskId id) const {
    throw AnalysisError("data goes round in a circle through " + topology_.set()[id].name);
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
      if (id != root && topology_.leads_to(root, p) && message_delay(root, p) == message)
        return waited_at(root, p);
    }
    return kNoTask;
  }

  /// Bound on the end of a job, whether or not it completes its join.
  std::int64_t latest(TaskId root, TaskId to) { return std::max(start(root, to), finish(root, to)); }

  /// The age of the sample that a job takes.
  Delay sample_delay(TaskId root, TaskId id) {
    if (id == root) {
      return is_source(id) ? Delay(0) : Delay();
    }
    Delay largest;
    for (const TaskId p : topology_.publishers(id)) {
      if (!topology_.leads_to(root, p)) continue;
      largest = std::max(largest, message_delay(root, p));
    }
    return largest;
  }

  /// Data of another input that waited for a job, and is in its message.
  struct Waited {
    std::int64_t delay;  ///< Its age at the timestamp of the job's root.
    /// Its age if the next job of its own root, released meanwhile, starts: as long as that job may
    /// take, and without that time. Both std::nullopt: not known.
    Delay until_next, until_next_release;
    TaskId input;
    bool joined;  ///< At a join; else the job reads it at its end.
  };

  /// The data that waited for the jobs of `id` which lead back to `root`.
  const std::vector<Waited>& waited(TaskId root, TaskId id) {
    const auto [entry, is_new] = waited_.try_emplace({root, id});
    if (!is_new) {
      if (open_.contains({root, id})) fail_in_circle(id);
      return entry->second;
    }
    open_.insert({root, id});
    std::vector<Waited> all;
    if (const auto* join = topology_.join_of(id)) {
      for (const TaskId other : join->inputs) {
        if (other != id) add_waited(root, id, other, true, all);
      }
    }
    // A job reads these inputs at its end, so their samples came after the previous job.
    for (const TaskId input : graph_.reads[id]) add_waited(root, id, input, false, all);
    open_.erase({root, id});
    return waited_[{root, id}] = std::move(all);
  }

  void add_waited(TaskId root, TaskId id, TaskId input, bool joined, std::vector<Waited>& all) {
    for (const TaskId from : topology_.roots(input)) {
      const Delay age = sample_delay(from, input);
      std::int64_t turn = 0;
      // If the two take turns and `root` comes first, no sample waits for it.
      if (!age || (joined && take_turns(root, id, from, input, turn))) continue;
      const std::int64_t stored = start(from, input);
      const std::int64_t longest = joined ? join_wait(root, id, input) : read_wait(root, id, input);
      const std::int64_t least = topology_.least_until_start(root, id);
      // The sample was the newest of its input, so the next one came later.
      const std::int64_t newest = subtract(gap(input, &Ages::start), least);
      std::int64_t apart = add(stored, std::min(longest, newest));
      Waited data{0, {}, {}, input, joined};
      if (topology_.alone(from, input)) {
        const std::int64_t next = next_timestamp(from);
        apart = std::min(apart, subtract(add(next, stored), least));
        if (const auto before = paths_.precedence(from, input, root)) {
          apart = std::min(apart, add(next, *before) - 1);
        }
        if (from != root) {
          data.until_next = add(*age, add(next, stored));
          data.until_next_release = add(*age, add(next, paths_.lateness()));
        }
      }
      if (joined && take_turns(from, input, root, id, turn)) apart = std::min(apart, turn);
      data.delay = add(*age, possible_distance(from, root, apart));
      all.push_back(data);
    }
  }

  /// Longest time from the timestamp of a job of `timer` to the next timestamp that leads to a job.
  /// A wait set skips timestamps that pass before the job starts.
  std::int64_t next_timestamp(TaskId timer) {
    const std::int64_t late = start(timer, timer);
    return late <= period(timer) ? period(timer) : add(period(timer), late);
  }

  /// The largest distance, up to `most`, of a timestamp of `root` from an earlier or later one of
  /// `from`.
  std::int64_t possible_distance(TaskId from, TaskId root, std::int64_t most) const {
    if (!graph_.phases_known) return most;
    const std::int64_t step = std::gcd(period(from), period(root));
    const std::int64_t beyond = (most - (phase(root) - phase(from))) % step;
    return most - (beyond < 0 ? beyond + step : beyond);
  }

  /// With known phases: whether the inputs `first` and `last` of a join take turns, `first` first,
  /// such that each job of `last` completes the join with the job of `first` before it. `distance`
  /// is the time from the timestamp of the one to that of the other.
  bool take_turns(TaskId root, TaskId first, TaskId other_root, TaskId last, std::int64_t& distance) {
    if (!graph_.phases_known || root == other_root || topology_.join_of(first)->inputs.size() != 2)
      return false;
    if (period(root) != period(other_root) || phase(root) > phase(other_root)) return false;
    if (!each_arrives(root, first) || !each_arrives(other_root, last)) return false;
    distance = (phase(other_root) - phase(root)) % period(root);
    return starts_before(root, first, other_root, last, distance) &&
           starts_before(other_root, last, root, first, period(root) - distance);
  }

  /// Whether a job of `first` leads to a job of `to` that starts before the job of `other` that a
  /// job of `from`, released `later`, leads to.
  bool starts_before(TaskId first, TaskId to, TaskId from, TaskId other, std::int64_t later) {
    if (start(first, to) < add(later, topology_.least_until_start(from, other))) return true;
    const auto before = paths_.precedence(first, to, from);
    return before && later >= *before;
  }

  /// Whether each job of `root` leads to a job of `id` that starts before the next one is released.
  bool each_arrives(TaskId root, TaskId id) {
    return topology_.alone(root, id) && start(root, id) <= period(root) && start(root, root) <= period(root);
  }

  /// The age of the data that a job publishes: of its own sample, and of the samples that waited
  /// for it.
  Delay message_delay(TaskId root, TaskId id) {
    const auto [entry, is_new] = message_.try_emplace({root, id});
    if (!is_new) {
      if (open_messages_.contains({root, id})) fail_in_circle(id);
      return entry->second;
    }
    open_messages_.insert({root, id});
    Delay largest = sample_delay(root, id);
    for (const Waited& data : waited(root, id)) largest = std::max(largest, Delay(data.delay));
    open_messages_.erase({root, id});
    return message_[{root, id}] = largest;
  }

  /// The age of the data of a job of `to` at the end of that job.
  Delay age_at_end(TaskId root, TaskId to) {
    const std::int64_t response = finish(root, to);
    Delay largest;
    if (is_source(root)) largest = response;
    const bool overtakes = paths_.overtakes(root, to);
    const std::int64_t after_start = since_start(&PathBounds::start_to_finish, root, to);
    for (const TaskId id : topology_.tasks_between(root, to)) {
      for (const Waited& data : waited(root, id)) {
        std::int64_t age = add(data.delay, response);
        // If the next job of the data's root was pending at the start of the job of `root`, it
        // starts behind the job of `to`.
        if (overtakes && data.until_next) {
          age = std::min(age, std::max(*data.until_next, add(*data.until_next_release, after_start)));
        }
        largest = std::max(largest, Delay(age));
      }
    }
    return largest;
  }

  /// From the latest start of a source job in the data of a job of `to` to the start of that job.
  std::int64_t since_source_start(TaskId root, TaskId to, std::int64_t age) {
    const std::int64_t least_work = topology_.set()[to].bcet.count();
    const std::int64_t by_age = subtract(age, least_work);
    if (!is_source(root)) return by_age;
    // Older data of the same source hides the job of `root`.
    const CallbackGraph::DataChain alone{chain_.name, {root}, chain_.sinks};
    const Delay own = Ages(topology_, paths_, alone).message_delay(root, to);
    if (own > Delay(0)) return by_age;
    std::int64_t least = std::min(by_age, since_start(&PathBounds::start_to_start, root, to));
    for (const TaskId other : chain_.sources) {
      if (other == root) continue;
      const CallbackGraph::DataChain others{chain_.name, {other}, chain_.sinks};
      const auto join = Ages(topology_, paths_, others).only_join(root, to);
      if (!join || !topology_.alone(other, join->first)) continue;
      const auto later = paths_.later_start_to_start(root, to, other, join->first, join->second);
      if (later) least = std::min(least, *later);
    }
    return least;
  }

  /// If data waits for the path at a single input of a join, that input, and the input by which the
  /// path completes the join.
  std::optional<Pair> only_join(TaskId root, TaskId to) {
    std::optional<Pair> only;
    for (const TaskId id : topology_.tasks_between(root, to)) {
      for (const Waited& data : waited(root, id)) {
        if (only || !data.joined) return std::nullopt;
        only = Pair{data.input, id};
      }
    }
    return only;
  }

  std::int64_t since_start(Bound bound, TaskId root, TaskId to) const {
    const std::optional<std::int64_t> value = (paths_.*bound)(root, to);
    if (!value) fail(root, to);
    return *value;
  }

  /// Time from the storing of a sample of `other` to the timestamp of `root` whose data completes
  /// the join at input `id`. No job of this input started in between.
  std::int64_t join_wait(TaskId root, TaskId id, TaskId other) {
    const std::int64_t least = topology_.least_until_start(root, id);
    const bool arrives = topology_.alone(root, id) && start(root, id) <= period(root);
    const std::int64_t longest = arrives ? period(root) : gap(id, &Ages::start);
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
  std::int64_t phase(TaskId timer) const { return topology_.set()[timer].phase.count(); }
  bool is_source(TaskId id) const { return std::ranges::find(chain_.sources, id) != chain_.sources.end(); }

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

  const GraphTopology& topology_;
  const CallbackGraph& graph_;
  const PathBounds& paths_;
  const CallbackGraph::DataChain& chain_;
  std::map<Pair, std::int64_t> start_, finish_;
  std::map<Pair, std::vector<Waited>> waited_;
  std::map<Pair, Delay> message_;
  std::set<Pair> open_, open_messages_;
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
