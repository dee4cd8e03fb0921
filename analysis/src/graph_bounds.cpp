// SPDX-License-Identifier: Apache-2.0
#include "hotpath/analysis/graph_bounds.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <set>

#include "hotpath/analysis/bedarkar_2022.hpp"
#include "hotpath/analysis/brueggen_2015.hpp"
#include "hotpath/analysis/davis_2007.hpp"
#include "hotpath/analysis/exact.hpp"
#include "hotpath/analysis/graph_busy_window.hpp"
#include "hotpath/analysis/processing_windows.hpp"
#include "hotpath/analysis/spuri_1996.hpp"
#include "service_paths.hpp"
#include "stream_paths.hpp"
#include "threaded_chains.hpp"
#include "timer_responses.hpp"

namespace hotpath {

namespace {

using exact::add, exact::multiply;
using A = Assumption;

struct AssumptionText {
  A assumption;
  const char* text;
};
constexpr std::array kTexts = {
    AssumptionText{A::subscriptions, "subscriptions"},
    AssumptionText{A::fixed_priorities, "fixed priorities"},
    AssumptionText{A::deadlines, "an order by deadlines"},
    AssumptionText{A::activation_order, "an order by activation"},
    AssumptionText{A::polling, "the processing windows of a wait set"},
    AssumptionText{A::other_order, "this executor's order"},
    AssumptionText{A::runs_timers, "a timer thread that runs timers itself"},
    AssumptionText{A::several_threads, "several executor threads"},
    AssumptionText{A::ties_by_activation, "jobs of equal priority in the order of their activation"},
    AssumptionText{A::unknown_phases, "unknown phases"},
    AssumptionText{A::shifted_phases, "phases other than 0"},
    AssumptionText{A::costs, "the costs of dispatches and waits"},
    AssumptionText{A::release_costs, "release costs"},
    AssumptionText{A::wake_up, "wake-up latencies"},
    AssumptionText{
        A::late_releases,
        "a timer thread that waits for the executor thread (raise its priority, or give it a core)"},
    AssumptionText{A::delivery_delay, "a delay of delivery"},
    AssumptionText{A::mixed_deadlines,
                   "subscriptions that do not run by the deadline of the sample that they take"},
    AssumptionText{A::any_delivery, "an unknown order of delivery"},
    AssumptionText{A::release_jitter, "release jitter"},
    AssumptionText{A::service_wait, "services that run next after `service_wait_ms`"},
    AssumptionText{A::woken_by_jobs,
                   "a timer thread with a wake-up latency that the end of each timer's job wakes up"},
};

bool has_releaser(const ExecutorEntry& e) { return e.traits.timers != TimerHandling::polled; }

bool has_fixed_priorities(const ExecutorEntry& executor) {
  return traits_of(executor.traits.queue_order()).levels == Levels::fixed;
}

bool equal_timers(const TaskSet& set, Policy policy) {
  const std::vector<std::int64_t> level = inherited_levels(set, policy);
  std::set<std::int64_t> seen;
  const auto is_new = [&](TaskId id) { return seen.insert(level[id]).second; };
  return !std::ranges::all_of(set.timers(), is_new);
}

/// An event takes the oldest sample, not necessarily the one that raised it. Under the rule `first`
/// no event has its sample's deadline; if samples with deadlines of several timers queue, they may
/// be swapped.
bool mixes_deadlines(const BoundedSystem& system) {
  if (!by_deadline(traits_of(system.executor.traits.queue_order()).levels)) return false;
  if (system.scheduling.rule == SubscriptionRule::first) return true;
  const GraphTopology topology(system.graph);
  for (TaskId id = 0; id < topology.size(); ++id) {
    if (topology.set()[id].depth > 1 && topology.roots(id).size() > 1) return true;
  }
  return false;
}

std::uint32_t order_of(const BoundedSystem& system) {
  const ExecutorTraits& t = system.executor.traits;
  if (t.family == Family::wait_set && t.runs_first == TaskKind::timer) return bits({A::polling});
  if (t.family == Family::wait_set || t.family == Family::callback_groups) return bits({A::other_order});
  switch (traits_of(t.queue_order()).levels) {
    case Levels::fixed:
      return bits({A::fixed_priorities});
    case Levels::deadline:
      return bits({A::deadlines});
    case Levels::arrival:
      return bits({A::activation_order});
    case Levels::other:
      break;
  }
  return bits({A::other_order});
}

std::int64_t largest_jitter(const TaskSet& set) {
  std::int64_t largest = 0;
  for (const Task& task : set.tasks) largest = std::max(largest, task.release_jitter.count());
  return largest;
}

Duration release_cost(const Platform& platform) { return platform.release_cost + platform.pass_cost; }

GraphOverheads overheads_of(const BoundedSystem& system, bool waits_with_jobs) {
  const Platform& p = system.platform;
  GraphOverheads o;
  o.job = p.longest_dispatch_cost().count();
  o.wake_up = p.wake_up_latency.count();
  o.delivery = p.delivery_delay.count();
  if (system.executor.traits.family == Family::wait_set) {
    const std::int64_t entities = std::int64_t{p.other_entities} + system.graph.set.size();
    const std::int64_t wait = add(p.wait_cost.count(), multiply(p.wait_cost_per_entity.count(), entities));
    (waits_with_jobs ? o.job : o.wait) = add(waits_with_jobs ? o.job : o.wait, wait);
  }
  if (has_releaser(system.executor)) {
    o.release = release_cost(p).count();
    const std::int64_t all = multiply(o.release, static_cast<std::int64_t>(system.graph.set.timers().size()));
    o.lateness = add(o.wake_up, all);
    if (!p.raised_releaser && p.cores == 1) {
      const std::int64_t slice = p.time_slice.count();
      o.lateness = add(o.lateness, multiply(slice, 1 + all / slice));
    }
  }
  o.lateness = add(o.lateness, largest_jitter(system.graph.set));
  return o;
}

bool releases_first(const BoundedSystem& system, const GraphOverheads& overheads) {
  return system.platform.raised_releaser && overheads.lateness == 0 && overheads.release == 0;
}

/// 0: none.
std::int64_t service_wait(const BoundedSystem& system) {
  const bool waits = system.executor.traits.family == Family::priority_events &&
                     std::ranges::any_of(system.graph.set.tasks, &Task::service);
  return waits ? system.scheduling.service_wait.count() : 0;
}

/// bound_graph(), also by the longest wait of services, unless their samples may come late.
void bound_graph(const BoundedSystem& system, const GraphTopology& topology, const PathBounds& paths,
                 GraphBounds& out) {
  const std::int64_t wait = service_wait(system);
  if (wait == 0 || system.platform.delivery_delay > Duration{}) return bound_graph(topology, paths, out);
  bound_graph(topology, *service_paths(topology, paths, overheads_of(system, true), wait), out);
}

/// Every subscription before every timer; timers in any order.
GraphOrder subscriptions_first(const BoundedSystem& system, const GraphOverheads& overheads) {
  const TaskSet& set = system.graph.set;
  GraphOrder order = any_order(set);
  for (TaskId id = 0; id < set.size(); ++id) order.rank[id] = set[id].kind == TaskKind::timer ? 1 : 0;
  order.newest_first = system.scheduling.ties == Ties::lifo;
  order.releases_first = releases_first(system, overheads);
  order.service_wait = service_wait(system);
  return order;
}

/// Fixed priorities if samples may come late. A service that runs next breaks the windows by priority.
void bound_late_samples(const BoundedSystem& system, const GraphTopology& topology, GraphBounds& out) {
  const TaskSet& set = system.graph.set;
  StreamedProcessor processor{std::vector<bool>(set.size(), true), priority_ranks(system),
                              overheads_of(system, true)};
  const GraphBusyWindow in_any_order(topology, any_order(set), processor.overheads);
  if (service_wait(system) > 0) return bound_graph(topology, in_any_order, out);
  processor.overheads.delivery = 0;
  StreamedSystem streamed;
  streamed.graph = system.graph;
  streamed.thread_of.assign(set.size(), 0);
  streamed.processor_of.assign(set.size(), 0);
  streamed.bounded.assign(set.size(), true);
  streamed.processors[0] = std::move(processor);
  streamed.delivery = system.platform.delivery_delay.count();
  bound_graph(topology, *stream_paths(std::move(streamed), &in_any_order), out);
}

struct Method {
  const char* name;  ///< Author and year, or the name in docs/analysis.md.
  std::uint32_t covers;
  void (*bound)(const BoundedSystem&, GraphBounds&);
};

constexpr std::uint32_t kTimers = bits({A::unknown_phases, A::shifted_phases, A::costs, A::release_costs});
constexpr std::uint32_t kGraphs =
    kTimers | bits({A::subscriptions, A::wake_up, A::late_releases, A::any_delivery});

void bound_timers(const BoundedSystem& system, const ResponseTimeAnalysis& analysis, GraphBounds& out) {
  const OverheadAwareResponse response = timer_responses(system, analysis);
  out.tasks.resize(system.graph.set.size());
  for (std::size_t i = 0; i < response.tasks.size(); ++i) {
    out.tasks[response.tasks[i].id] = response.bounds[i];
  }
}

const std::array kMethods = {
    Method{"Brueggen 2015 (Theorem 1)", kTimers | bits({A::fixed_priorities, A::runs_timers}),
           [](const BoundedSystem& s, GraphBounds& out) { bound_timers(s, brueggen_2015, out); }},
    Method{"Davis 2007 (exact)", kTimers | bits({A::fixed_priorities, A::runs_timers}),
           [](const BoundedSystem& s, GraphBounds& out) {
             bound_timers(
                 s, [](const PeriodicTasks& t) { return davis_2007(t); }, out);
           }},
    Method{"Spuri 1996", kTimers | bits({A::deadlines, A::runs_timers, A::ties_by_activation}),
           [](const BoundedSystem& s, GraphBounds& out) {
             bound_timers(
                 s, [](const PeriodicTasks& t) { return spuri_1996(t); }, out);
           }},
    Method{"Bedarkar 2022", kTimers | bits({A::activation_order, A::ties_by_activation, A::late_releases}),
           [](const BoundedSystem& s, GraphBounds& out) {
             bound_timers(
                 s, [](const PeriodicTasks& t) { return ResponseTimes(t.size(), bedarkar_2022(t)); }, out);
           }},
    Method{"busy windows by priority",
           kGraphs | bits({A::fixed_priorities, A::ties_by_activation, A::release_jitter, A::service_wait,
                           A::delivery_delay}),
           [](const BoundedSystem& s, GraphBounds& out) {
             const GraphTopology topology(s.graph);
             const GraphOverheads overheads = overheads_of(s, true);
             if (overheads.delivery > 0) return bound_late_samples(s, topology, out);
             GraphOrder order = priority_ranks(s);
             order.releases_first = releases_first(s, overheads);
             order.service_wait = service_wait(s);
             const GraphBusyWindow by_priority(topology, order, overheads);
             const GraphBusyWindow in_any_order(topology, any_order(s.graph.set), overheads);
             bound_graph(s, topology, TighterPaths(by_priority, in_any_order), out);
           }},
    Method{"processing windows", kGraphs | bits({A::polling, A::delivery_delay, A::release_jitter}),
           [](const BoundedSystem& s, GraphBounds& out) {
             const GraphTopology topology(s.graph);
             const auto windows =
                 processing_windows(topology, s.scheduling.entity_order, overheads_of(s, false));
             const GraphBusyWindow in_any_order(topology, any_order(s.graph.set), overheads_of(s, true));
             // With jitter one window may call a timer twice.
             if (largest_jitter(s.graph.set) > 0) return bound_graph(topology, in_any_order, out);
             bound_graph(topology, TighterPaths(*windows, in_any_order), out);
           }},
    Method{"busy windows by deadline",
           kGraphs | bits({A::deadlines, A::ties_by_activation, A::release_jitter, A::service_wait}),
           [](const BoundedSystem& s, GraphBounds& out) {
             const GraphTopology topology(s.graph);
             const GraphOverheads overheads = overheads_of(s, true);
             const GraphBusyWindow in_any_order(topology, any_order(s.graph.set), overheads);
             GraphOrder order = any_order(s.graph.set);
             order.by_deadline = true;
             order.newest_first = s.scheduling.ties == Ties::lifo;
             order.releases_first = releases_first(s, overheads);
             order.service_wait = service_wait(s);
             const GraphBusyWindow by_deadline(topology, order, overheads);
             bound_graph(s, topology, TighterPaths(by_deadline, in_any_order), out);
           }},
    Method{"busy windows in any order",
           kGraphs | bits({A::deadlines, A::activation_order, A::other_order, A::ties_by_activation,
                           A::mixed_deadlines, A::release_jitter, A::service_wait, A::delivery_delay}),
           [](const BoundedSystem& s, GraphBounds& out) {
             const GraphTopology topology(s.graph);
             const GraphOverheads overheads = overheads_of(s, true);
             const GraphBusyWindow paths(topology, any_order(s.graph.set), overheads);
             const bool first = s.scheduling.rule == SubscriptionRule::first;
             if (!first || s.executor.traits.family != Family::priority_events || overheads.delivery > 0)
               return bound_graph(s, topology, paths, out);
             const GraphBusyWindow ahead_of_timers(topology, subscriptions_first(s, overheads), overheads);
             bound_graph(s, topology, TighterPaths(ahead_of_timers, paths), out);
           }},
    Method{"chains on several threads",
           kAnyOrder | bits({A::subscriptions, A::several_threads, A::unknown_phases, A::shifted_phases,
                             A::any_delivery}),
           bound_threads},
};

}  // namespace

void bound_graph(const GraphTopology& topology, const PathBounds& paths, GraphBounds& out) {
  for (TaskId id = 0; id < topology.size(); ++id) {
    const bool timer = topology.set()[id].kind == TaskKind::timer;
    const bool runs = !topology.roots(id).empty();
    out.tasks.push_back(!runs ? std::nullopt : timer ? paths.until_finish(id, id) : paths.response(id));
    if (timer && out.tasks.back()) out.parts[id] = paths.parts(id, id);
  }
  for (const CallbackGraph::DataChain& chain : topology.graph().chains) {
    out.chains.push_back(chain_age(topology, paths, chain, out.no_chain_bound.emplace_back()));
  }
}

std::string not_covered(std::uint32_t missing) {
  std::string text = "it does not cover ";
  for (const AssumptionText& a : kTexts) {
    if ((missing & static_cast<std::uint32_t>(a.assumption)) == 0) continue;
    text += std::string(text.back() == ' ' ? "" : ", ") + a.text;
  }
  return text;
}

OverheadAwareResponse timer_responses(const BoundedSystem& system, const ResponseTimeAnalysis& analysis) {
  PeriodicTasks tasks = periodic_tasks(system.graph.set, system.executor.traits.queue_order());
  for (PeriodicTask& task : tasks)
    task.wcet = add(task.wcet, system.platform.longest_dispatch_cost().count());
  const ReleaseMode mode = system.executor.traits.timers == TimerHandling::release_and_execute
                               ? ReleaseMode::release_and_execute
                               : ReleaseMode::release_only;
  return with_release_overhead(tasks, release_cost(system.platform).count(), mode, analysis);
}

std::uint32_t assumptions_of(const BoundedSystem& system) {
  const ExecutorTraits& traits = system.executor.traits;
  const Platform& p = system.platform;
  const TaskSet& set = system.graph.set;
  std::uint32_t present = order_of(system);
  const auto add_if = [&](bool holds, A assumption) {
    if (holds) present |= static_cast<std::uint32_t>(assumption);
  };
  const bool runs_timers = traits.timers == TimerHandling::release_and_execute;
  const bool releaser = has_releaser(system.executor);
  add_if(set.timers().size() < set.size(), A::subscriptions);
  add_if(runs_timers, A::runs_timers);
  const unsigned workers = worker_count(system.executor, system.scheduling);
  add_if(traits.many_workers && workers > (releaser ? 2U : 1U), A::several_threads);
  const bool distinct = has_fixed_priorities(system.executor) && set.timers().size() == set.size() &&
                        !equal_timers(set, *traits.policy);
  add_if(system.scheduling.ties == Ties::fifo && traits.family == Family::priority_events && !distinct,
         A::ties_by_activation);
  const bool known = system.graph.phases_known;
  add_if(!known, A::unknown_phases);
  add_if(known && std::ranges::any_of(set.tasks, [](const Task& t) { return t.phase > Duration::zero(); }),
         A::shifted_phases);
  const bool waits =
      traits.family == Family::wait_set && p.wait_cost + p.wait_cost_per_entity > Duration::zero();
  add_if(waits || p.longest_dispatch_cost() > Duration::zero(), A::costs);
  add_if(releaser && release_cost(p) > Duration::zero(), A::release_costs);
  add_if(p.wake_up_latency > Duration::zero(), A::wake_up);
  add_if(set.timers().size() < set.size() && mixes_deadlines(system), A::mixed_deadlines);
  add_if(releaser && !runs_timers && !p.raised_releaser && p.cores == 1, A::late_releases);
  add_if(traits.timers == TimerHandling::marked_ready && p.wake_up_latency > Duration::zero(),
         A::woken_by_jobs);
  add_if(!system.graph.delivery_known, A::any_delivery);
  add_if(largest_jitter(set) > 0, A::release_jitter);
  add_if(service_wait(system) > 0, A::service_wait);
  add_if(p.delivery_delay > Duration::zero() && set.timers().size() < set.size(), A::delivery_delay);
  return present;
}

GraphBounds attempt(const char* method, std::uint32_t missing,
                    const std::function<void(GraphBounds&)>& bound) {
  if (missing != 0) return {.method = method, .refusal = not_covered(missing)};
  GraphBounds out{.method = method};
  try {
    bound(out);
  } catch (const AnalysisError& error) {
    return {.method = method, .refusal = error.what()};
  }
  return out;
}

std::vector<GraphBounds> graph_bounds(const BoundedSystem& system, std::uint32_t also_covers) {
  const std::uint32_t present = assumptions_of(system);
  const auto would =
      std::ranges::find_if(kMethods, [&](const Method& m) { return (present & ~m.covers) == 0; });
  const std::string instead =
      would == kMethods.end() ? "; no method here does" : "; " + std::string(would->name) + " does";
  std::vector<GraphBounds> all;
  for (const Method& method : kMethods) {
    const std::uint32_t missing = present & ~method.covers & ~also_covers;
    all.push_back(attempt(method.name, missing, [&](GraphBounds& out) { method.bound(system, out); }));
    if (missing != 0) *all.back().refusal += instead;
  }
  return all;
}

}  // namespace hotpath
