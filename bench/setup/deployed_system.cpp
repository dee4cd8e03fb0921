// SPDX-License-Identifier: Apache-2.0
#include "setup/deployed_system.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>

#include "bounds/bounds.hpp"
#include "hotpath/core/input_file.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "program/text.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::setup {

static void check_processors(const DeployedExecutor& executor, const std::string& file, unsigned cores) {
  for (const int processor : executor.processors) {
    if (static_cast<unsigned>(processor) < cores) continue;
    throw InputError(
        file, executor.line,
        program::concat("executor ", executor.name, ": the simulated machine has no processor ", processor),
        program::concat("it has processors 0 to ", cores - 1, "; add some with --cores"));
  }
}

std::vector<DeployedThread> threads_of(const Graph& graph, const ExecutorSpec& spec) {
  std::vector<DeployedThread> threads;
  for (const ExecutorSpec& part : parts(spec)) {
    const DeployedExecutor& plan = part.place;
    check_processors(plan, spec.plan.file, graph.platform.cores);
    DeployedThread& thread = threads.emplace_back();
    thread.name = plan.name;
    thread.executor = part.entry;
    thread.scheduling = part.scheduler;
    const bool fifo = plan.policy.scheduling_class == ThreadPolicy::Class::fifo;
    if (fifo) thread.priority = thread.timers_priority = plan.policy.priority;
    if (!fifo && !plan.policy.ordinary()) thread.other_policy = to_string(plan.policy);
    if (make_platform(graph, *part.entry).raised_releaser)
      thread.timers_priority = raised_above(plan.policy).priority;
    thread.processors.assign(plan.processors.begin(), plan.processors.end());
    if (thread.processors.empty()) {
      thread.processors.resize(graph.platform.cores);
      std::iota(thread.processors.begin(), thread.processors.end(), 0U);
    }
  }
  return threads;
}

std::vector<GraphBounds> bounds_of(const Graph& graph, const CallbackGraph& callbacks,
                                   const ExecutorSpec& spec) {
  if (spec.entry)
    return graph_bounds({callbacks, *spec.entry, spec.scheduler, make_platform(graph, *spec.entry)});
  const DeployedSystem system{callbacks, threads_of(graph, spec), spec.plan.executor_of,
                              make_platform(graph, *parts(spec).back().entry)};
  std::vector<GraphBounds> all = {deployment_bounds(system)};
  const DeployedThread& thread = system.threads.front();
  const bool has_a_processor =
      system.threads.size() == 1 && thread.priority > 0 && thread.processors.size() == 1;
  if (!has_a_processor || thread.executor->traits.timers != TimerHandling::polled) return all;
  if (worker_count(*thread.executor, thread.scheduling) > 1) return all;
  // One thread that finds its timers itself, and nothing beside it: as without the deployment.
  std::ranges::move(graph_bounds({callbacks, *thread.executor, thread.scheduling, system.platform}),
                    std::back_inserter(all));
  return all;
}

Premises premises(const Graph& graph, const TaskSet& set, const ExecutorSpec& spec, bool phases_known) {
  using program::concat;
  const Duration delivery = graph.platform.longest_delivery();
  const auto& [longest, median, samples] = graph.platform.measured_delivery;
  const std::string most =
      samples > 0 ? concat(" us of ", samples, " samples, median ", to_us(median), " us") : " us";
  const bool jitter = set.has_release_jitter();
  std::vector<std::string> kinds = {"timers"}, costs, assumed;
  for (const auto& [kind, word] : enum_texts(EntityKind{})) {
    const auto is_one = [kind = kind](const Task& task) {
      return task.kind == TaskKind::subscription && task.entity == kind;
    };
    if (std::ranges::any_of(set.tasks, is_one))
      kinds.push_back(kind == EntityKind::intra_process ? "intra-process subscriptions" : concat(word, "s"));
  }
  for (const PlatformCost& cost : kPlatformCosts) {
    const Duration value = cost.in(graph.platform).value_or(Duration{});
    if (value != Duration{} && cost.value != &Platform::delivery_delay)
      costs.push_back(concat(cost.key, " ", to_us(value)));
  }
  std::vector<std::string> stated = {
      spec.entry ? concat("executor ", spec.entry->class_name, " (", spec.entry->description, ")")
                 : "deployment " + spec.label,
      concat("callbacks: ", program::joined(kinds), kinds.size() == 1 ? " only" : ""),
      "no job takes longer than the graph says", phases_known ? "the given phases" : "any phases"};
  const auto add = [&](bool is_stated, const std::string& statement, const std::string& otherwise) {
    is_stated ? stated.push_back(statement) : assumed.push_back(otherwise);
  };
  add(delivery > Duration{},
      delivery == longest ? concat("delivery measured, up to ", to_us(delivery), most)
                          : concat("delivery takes ", to_us(delivery), " us"),
      "delivery takes no time");
  add(!costs.empty(), program::joined(costs), "the executor's own work takes no time");
  add(jitter, "release jitter as in the graph", "timers have no jitter");
  assumed.emplace_back("its threads have the processor to themselves");
  if (spec.entry && spec.entry->traits.many_workers && worker_count(*spec.entry, spec.scheduler) > 1)
    assumed.emplace_back("no thread idles while a callback is ready (see rclcpp issue 3240)");
  return {program::joined(stated, "; "), program::joined(assumed, "; ")};
}

std::optional<bounds::Guarantees> guarantees(const Graph& graph, const GraphTasks& given,
                                             const ExecutorSpec& spec, const CommonOptions* options,
                                             std::string* refusal) {
  try {
    const CallbackGraph callbacks = bounds::callback_graph(graph, given, false);
    Graph delivered = graph;
    delivered.platform.delivery_delay = graph.platform.longest_delivery();
    std::vector<GraphBounds> all = bounds_of(delivered, callbacks, spec);
    if (options != nullptr && spec.entry && job_threads(spec) > 1) {
      const bool known = options->phases != Phases::random && options->phases_of.empty();
      if (known) {
        GraphTasks tasks = given;
        set_phases(tasks.set, phases_of_repetition(*options, graph, given, spec, 0));
        all.push_back(bounds::exact_worst_cases(delivered, tasks, *spec.entry, spec.scheduler,
                                                {.max_states = bounds::usual_state_limit(tasks.set)}));
      }
      const GraphBounds& last = all.back();  // the exploration, or the method for several threads
      if (last.refusal) *refusal = (known ? "exploration" : last.method) + ": " + *last.refusal;
    }
    return bounds::smallest_of(callbacks, all);
  } catch (const AnalysisError&) {
    return std::nullopt;  // no method covers the rules by which some node publishes
  }
}

}  // namespace hotpath::setup
