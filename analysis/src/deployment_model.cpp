// SPDX-License-Identifier: Apache-2.0
#include "deployment_model.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "hotpath/analysis/exact.hpp"
#include "timer_responses.hpp"

namespace hotpath {

using exact::add;

std::optional<std::string> refusal_of(const DeployedSystem& system) {
  using A = Assumption;
  constexpr std::uint32_t kCovers =
      kAnyOrder | bits({A::subscriptions, A::unknown_phases, A::shifted_phases, A::costs, A::wake_up,
                        A::delivery_delay, A::any_delivery});
  // Of an ordinary thread below a raised timer thread: they delay jobs of that executor alone.
  constexpr std::uint32_t kBelow = bits({A::several_threads, A::woken_by_jobs, A::service_wait});
  Platform processor = system.platform;
  processor.cores = 1;
  processor.raised_releaser = true;
  bool any = false;
  for (const DeployedThread& thread : system.threads) {
    const std::string name = "executor " + thread.name;
    const bool bounded = thread.priority > 0;
    if (!thread.other_policy.empty())
      return name + " runs under " + thread.other_policy + "; give it fifo or other";
    if (!bounded && thread.timers_priority == 0) continue;
    if (bounded && thread.processors.size() != 1) return name + " may run on several processors; give it one";
    const std::uint32_t missing =
        assumptions_of({system.graph, *thread.executor, thread.scheduling, processor}) &
        ~(bounded ? kCovers : kCovers | kBelow);
    if (missing != 0) return name + ": " + not_covered(missing);
    if (bounded && thread.executor->traits.timers != TimerHandling::polled &&
        thread.timers_priority <= thread.priority) {
      return name + " has a timer thread that does not preempt it; raise that thread's priority";
    }
    any = any || bounded;
  }
  if (any) return std::nullopt;
  return "no executor has a thread under SCHED_FIFO that is bound to a processor";
}

GraphOrder order_on(const DeployedSystem& system, const std::vector<bool>& here) {
  const TaskSet& set = system.graph.set;
  std::map<int, std::set<std::uint32_t>, std::greater<>> levels;
  for (TaskId id = 0; id < set.size(); ++id) {
    if (here[id]) levels[system.threads[system.thread_of[id]].priority].insert(system.thread_of[id]);
  }
  GraphOrder order = any_order(set);
  order.releases_first = system.platform.wake_up_latency + system.platform.delivery_delay == Duration{};
  std::int64_t next = 0;
  for (const auto& [priority, threads] : levels) {
    const DeployedThread& first = system.threads[*threads.begin()];
    GraphOrder within = any_order(set);
    const Policy policy = first.executor->traits.queue_order();
    if (threads.size() == 1 && traits_of(policy).levels == Levels::fixed) {
      within = priority_ranks({system.graph, *first.executor, first.scheduling, system.platform});
    }
    std::int64_t largest = 0;
    for (TaskId id = 0; id < set.size(); ++id) {
      if (!here[id] || !threads.contains(system.thread_of[id])) continue;
      order.rank[id] = next + within.rank[id];
      largest = std::max(largest, within.rank[id]);
    }
    next += largest + 1;
    if (priority > 0) order.threads.push_back(next - 1);
  }
  return order;
}

GraphOverheads overheads_on(const DeployedSystem& system, const std::vector<bool>& here) {
  const Platform& p = system.platform;
  GraphOverheads overheads;
  overheads.job = p.longest_dispatch_cost().count();
  for (TaskId id = 0; id < here.size(); ++id) {
    const DeployedThread& thread = system.threads[system.thread_of[id]];
    if (!here[id] || thread.executor->traits.family != Family::wait_set) continue;
    const std::int64_t entities = std::int64_t{p.other_entities} + system.graph.set.size();
    const std::int64_t wait =
        add(p.wait_cost.count(), exact::multiply(p.wait_cost_per_entity.count(), entities));
    overheads.job = add(p.longest_dispatch_cost().count(), wait);
  }
  return overheads;
}

CallbackGraph with_joins_of_one_thread(const DeployedSystem& system) {
  CallbackGraph graph = system.graph;
  std::erase_if(graph.joins, [&](const CallbackGraph::Join& join) {
    const std::uint32_t thread = system.thread_of[join.inputs.front()];
    return std::ranges::any_of(join.inputs, [&](TaskId id) { return system.thread_of[id] != thread; });
  });
  return graph;
}

}  // namespace hotpath
