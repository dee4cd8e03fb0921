// SPDX-License-Identifier: Apache-2.0
#include "threaded_chains.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hotpath/analysis/analysis_error.hpp"
#include "hotpath/analysis/callback_graph.hpp"
#include "hotpath/analysis/exact.hpp"
#include "hotpath/analysis/path_bounds.hpp"
#include "timer_responses.hpp"

namespace hotpath {

namespace {

using exact::add, exact::multiply;

constexpr std::int64_t kLongestWait = std::int64_t{1} << 50;  // 13 days
constexpr int kMostSteps = 100'000;
constexpr std::size_t kNoTree = ~std::size_t{0};

/// Timers and the subscriptions that follow them, on several threads that never idle while a callback is
/// ready, in the manner of Bertogna and Cirinei, and where a task activates several others, of Melani et al.
/// (docs/chain_bounds.md, "Threads of one executor"). Costs nothing but the callbacks' own work.
class ThreadedChains final : public PathBounds {
 public:
  /// `topology` must outlive this object; `threads` > 0. Throws AnalysisError if a task waits for or reads
  /// several others, or if an exclusive group has tasks of which neither leads to the other.
  ThreadedChains(const GraphTopology& topology, unsigned threads)
      : topology_(topology), threads_(threads), places_(topology.size(), {.tree = kNoTree}) {
    for (const TaskId root : topology.timers()) {
      const Task& timer = topology.set()[root];
      if (timer.always_due)
        throw AnalysisError("on several threads it covers no timer with the period 0, such as " + timer.name);
      place(root, {.tree = trees_.size()});
      const std::int64_t period = timer.period.count();
      trees_.push_back(
          {root, period, places_[root].work_from, std::min(places_[root].width, threads_), period});
    }
    check_groups();
    bounded_ = find_responses();
  }

  std::optional<std::int64_t> until_start(TaskId root, TaskId to) const override {
    if (!bounded_ || !leads_to(root, to) || places_[root].before != kNoTask) return std::nullopt;
    const std::optional<std::int64_t> wait = waiting(to);
    return wait ? std::optional(add(places_[to].work_before, *wait)) : std::nullopt;
  }
  std::optional<std::int64_t> until_finish(TaskId root, TaskId to) const override {
    const std::optional<std::int64_t> start = until_start(root, to);
    return start ? std::optional(add(*start, topology_.set()[to].wcet.count())) : std::nullopt;
  }
  std::optional<std::int64_t> response(TaskId subscription) const override {
    if (places_[subscription].tree == kNoTree) return std::nullopt;
    const TaskId root = trees_[places_[subscription].tree].root;
    const std::optional<std::int64_t> finish = until_finish(root, subscription);
    return finish ? std::optional(*finish - topology_.least_until_start(root, subscription)) : std::nullopt;
  }
  std::optional<std::int64_t> start_to_start(TaskId root, TaskId to) const override {
    return root == to ? std::optional<std::int64_t>(0) : until_start(root, to);
  }
  std::optional<std::int64_t> start_to_finish(TaskId root, TaskId to) const override {
    return until_finish(root, to);
  }
  std::int64_t lateness() const override { return 0; }
  PathParts parts(TaskId, TaskId) const override { return {}; }

 private:
  /// A timer and all that follows it.
  struct Tree {
    TaskId root;
    std::int64_t period, work;
    std::int64_t width;     ///< How many of its tasks can run at once, on these threads.
    std::int64_t response;  ///< From the timestamp to the end of the last task.
  };
  struct Place {
    std::size_t tree;
    TaskId before = kNoTask;       ///< The task that activates it.
    std::int64_t work_before = 0;  ///< Of the tasks from the timer on.
    std::int64_t work_from = 0;    ///< Of the task and all that follows it.
    std::int64_t width = 0;        ///< How many of these can run at once.
  };

  /// Also places all that follows the task.
  void place(TaskId id, Place at) {
    const Task& task = topology_.set()[id];
    const auto refuse = [&](const char* why) {
      throw AnalysisError("on several threads it covers chains that do not meet, but " + task.name + " " +
                          why);
    };
    if (topology_.join_of(id) != nullptr) refuse("waits for other inputs");
    if (!topology_.graph().reads[id].empty()) refuse("reads other inputs");
    if (topology_.publishers(id).size() > 1) refuse("takes samples of several callbacks");
    at.work_from = task.wcet.count();
    for (const TaskId fed : task.feeds) {
      place(fed, {.tree = at.tree, .before = id, .work_before = add(at.work_before, task.wcet.count())});
      at.work_from = add(at.work_from, places_[fed].work_from);
      at.width += places_[fed].width;
    }
    at.width = std::max<std::int64_t>(at.width, 1);
    places_[id] = at;
  }
  bool leads_to(TaskId from, TaskId to) const {
    while (to != from && to != kNoTask) to = places_[to].before;
    return to == from;
  }
  void check_groups() const {
    const TaskSet& set = topology_.set();
    std::map<std::uint32_t, std::vector<TaskId>> groups;  // exclusive ones
    for (TaskId id = 0; id < set.size(); ++id) {
      if (places_[id].tree == kNoTree || set.groups[set[id].group] == CallbackGroup::reentrant) continue;
      for (const TaskId other : groups[set[id].group]) {
        if (!leads_to(id, other) && !leads_to(other, id))
          throw AnalysisError(
              "on several threads it covers no mutually exclusive group of callbacks of which neither leads "
              "to "
              "the other, such as that of " +
              set[other].name + " and " + set[id].name);
      }
      groups[set[id].group].push_back(id);
    }
  }
  /// The most work of a tree in a window, if each of its jobs ends within its response time.
  std::int64_t work_beside(const Tree& tree, std::int64_t window) const {
    const std::int64_t length = add(window, tree.response) - tree.work / tree.width;
    if (length < 0) return 0;
    return add(multiply(length / tree.period, tree.work),
               std::min(tree.work, multiply(length % tree.period, tree.width)));
  }
  /// The longest wait up to the start of a task. While it or a task before it waits, all threads run other
  /// tasks: the largest wait for which these have enough work. A smaller solution proves nothing.
  std::optional<std::int64_t> waiting(TaskId task) const {
    const Place& at = places_[task];
    const Tree& own = trees_[at.tree];
    const std::int64_t work_aside = own.work - at.work_before - at.work_from,
                       width_aside = std::min(places_[own.root].width - at.width, threads_);
    std::int64_t wait = kLongestWait;
    for (int step = 0; step < kMostSteps; ++step) {
      std::int64_t work = std::min(work_aside, multiply(width_aside, wait));
      for (const Tree& tree : trees_) {
        if (&tree == &own) continue;
        work = add(work, std::min(work_beside(tree, add(at.work_before, wait)), multiply(tree.width, wait)));
      }
      const std::int64_t next = work / threads_;
      if (next == wait) return wait;
      if (next > wait) return std::nullopt;  // too much work
      wait = next;
    }
    return std::nullopt;
  }
  /// Lowers all response times until nothing changes. False: some job may last longer than its period.
  bool find_responses() {
    std::vector<std::int64_t> responses(trees_.size());
    for (;;) {
      std::ranges::fill(responses, 0);
      for (TaskId id = 0; id < topology_.size(); ++id) {
        if (places_[id].tree == kNoTree) continue;
        const std::optional<std::int64_t> wait = waiting(id);
        std::int64_t& response = responses[places_[id].tree];
        response =
            std::max(response, wait ? add(places_[id].work_before + topology_.set()[id].wcet.count(), *wait)
                                    : kLongestWait);
      }
      bool changed = false, all = true;
      for (std::size_t t = 0; t < trees_.size(); ++t) {
        all = all && responses[t] <= trees_[t].period;
        changed = changed || responses[t] < trees_[t].response;
        trees_[t].response = std::min(trees_[t].response, responses[t]);
      }
      if (!changed) return all;
    }
  }

  const GraphTopology& topology_;
  const std::int64_t threads_;
  std::vector<Tree> trees_;
  std::vector<Place> places_;  // by task
  bool bounded_ = false;
};

}  // namespace

void bound_threads(const BoundedSystem& system, GraphBounds& out) {
  const TaskSet& set = system.graph.set;
  const bool releaser = system.executor.traits.timers != TimerHandling::polled,
             raised = system.platform.raised_releaser;
  const unsigned threads = worker_count(system.executor, system.scheduling) - (releaser ? 1 : 0);
  if (threads < 2) throw AnalysisError("it is for several threads");
  const unsigned needed = threads + (releaser && !raised ? 1 : 0);
  if (system.platform.cores < needed)
    throw AnalysisError("its threads need " + std::to_string(needed) + " cores, one each (--cores)");
  const auto reentrant = [&](const Task& task) { return set.groups[task.group] == CallbackGroup::reentrant; };
  if (system.executor.traits.family == Family::callback_groups && std::ranges::any_of(set.tasks, reentrant))
    throw AnalysisError(
        "it covers no reentrant groups under `cbg`, which may leave a thread idle beside them");
  const GraphTopology topology(system.graph);
  bound_graph(topology, ThreadedChains(topology, threads), out);
}

}  // namespace hotpath
