// SPDX-License-Identifier: Apache-2.0
#include "setup/utilisation.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <numeric>
#include <set>

#include "hotpath/reference_system/graph_workload.hpp"
#include "program/text.hpp"

namespace hotpath::setup {

namespace {

using program::concat, program::fixed;

double mean_ms(const Callback& callback, ExecutionTimeModel model) {
  if (model == ExecutionTimeModel::worst) return to_ms(callback.worst);
  if (model == ExecutionTimeModel::uniform || !callback.measured)
    return (to_ms(callback.worst) + to_ms(callback.best)) / 2;
  const double sum = std::accumulate(callback.measured->begin(), callback.measured->end(), 0.0,
                                     [](double s, Duration d) { return s + to_ms(d); });
  return sum / static_cast<double>(callback.measured->size());
}

/// By task, in cores.
std::vector<double> loads_of(const Graph& graph, const GraphTasks& tasks) {
  std::vector<double> loads = activation_rates(tasks);
  for (TaskId id = 0; id < tasks.set.size(); ++id)
    loads[id] *= mean_ms(tasks.callbacks[id], graph.platform.execution_times) / 1e3;
  return loads;
}

/// When the kernel withholds a core from real-time threads, and how.
struct KernelRule {
  double share = 0.95;  ///< Of the core.
  std::string text =
      "Linux up to 6.11 stops such threads for 50 ms in each second (sched_rt_runtime_us); from 6.12 on, "
      "its fair server gives up to 50 ms in each second to ordinary threads that starve on their core";
};

/// std::nullopt: the machine has none.
std::optional<KernelRule> kernel_rule(const LiveThreads* live) {
  int major = 0, minor = 0;
  if (live == nullptr || std::sscanf(live->machine.kernel.c_str(), "%d.%d", &major, &minor) != 2)
    return KernelRule{};
  const std::string kernel = concat("Linux ", major, ".", minor);
  if (std::pair(major, minor) >= std::pair(6, 12))
    return KernelRule{.text = concat("the fair server of ", kernel, " gives up to 50 ms in each second to ",
                                     "ordinary threads that starve on their core")};
  const long most = live->machine.rt_runtime_us, period = live->machine.rt_period_us;
  if (most < 0 || period <= 0) return std::nullopt;
  return KernelRule{static_cast<double>(most) / static_cast<double>(period),
                    concat(kernel, " stops such threads for ", (period - most) / 1000, " of ", period / 1000,
                           " ms (/proc/sys/kernel/sched_rt_runtime_us)")};
}

bool is_real_time(const ThreadPolicy& policy) {
  return !policy.ordinary() && policy.scheduling_class != ThreadPolicy::Class::deadline;
}

/// Threads, a callback group or cores: how much they can do at once, and their work, in cores.
struct Server {
  std::string name;
  unsigned at_once = 1;
  const char* noun = "thread";
  std::string remedy = {};
  double load = 0, droppable = 0;  ///< All work, and that of readers that leave out samples instead.
  double real_time = 0;            ///< The work at SCHED_FIFO and SCHED_RR.

  void add(double work, bool drops, bool at_real_time) {
    load += work;
    if (drops) droppable += work;
    if (at_real_time) real_time += work;
  }
  [[nodiscard]] std::string has(double work) const {
    return concat(name, " has ", fixed(100 * work, 0), " % of one core of work");
  }
  [[nodiscard]] std::string overload() const {
    return concat(has(load), " for ", at_once, " ", noun, at_once == 1 ? "" : "s", remedy);
  }
};

/// The threads of an executor that run jobs.
struct Threads {
  Server server, timers;
  unsigned count = 1;
  bool runs_timers = false, real_time = false, real_time_timers = false;
  std::vector<int> processors = {};     ///< Empty: all.
  std::set<std::uint32_t> groups = {};  ///< With work.
  bool reentrant = false;               ///< Of one of them.
};

std::vector<Threads> threads_of(const Graph& graph, const ExecutorSpec& spec, const LiveThreads* live) {
  std::vector<Threads> all;
  for (const ExecutorSpec& part : parts(spec)) {
    DeployedExecutor plan = part.place;
    if (live != nullptr && live->executor) plan.policy = *live->executor;
    const TimerHandling timers = part.entry->traits.timers;
    const bool raised = live != nullptr && live->timers ? is_real_time(*live->timers)
                                                        : make_platform(graph, *part.entry).raised_releaser;
    Threads& threads = all.emplace_back();
    threads.server.name = spec.entry ? "it" : "executor " + plan.name;
    threads.timers.name = (spec.entry ? "its" : threads.server.name + "'s") + " timer thread";
    threads.count = job_threads(part);
    threads.server.at_once =
        std::min(threads.count, plan.processors.empty() ? graph.platform.cores
                                                        : static_cast<unsigned>(plan.processors.size()));
    threads.runs_timers = timers == TimerHandling::release_and_execute;
    threads.real_time = is_real_time(plan.policy);
    threads.real_time_timers = threads.real_time || raised;
    threads.processors = plan.processors;
  }
  return all;
}

/// All servers, those whose sentences say most first.
std::vector<Server> servers_of(const Graph& graph, const GraphTasks& tasks, const ExecutorSpec* spec,
                               std::vector<Threads>& threads) {
  const std::vector<double> loads = loads_of(graph, tasks), losses = intended_losses(graph, tasks);
  std::vector<Server> groups(tasks.set.groups.size());
  std::map<int, Server> processors;
  Server cores{"the graph", graph.platform.cores, "core"};
  for (TaskId id = 0; id < loads.size(); ++id) {
    const Task& task = tasks.set[id];
    const bool drops = losses[id] > 0, reentrant = tasks.set.groups[task.group] == CallbackGroup::reentrant;
    const double load = drops ? 1 : loads[id];
    bool real_time = false, beside_group = reentrant;
    if (spec != nullptr) {
      Threads& own = threads[executor_of(*spec, id)];
      const bool on_timers = own.runs_timers && task.kind == TaskKind::timer;
      real_time = on_timers ? own.real_time_timers : own.real_time;
      beside_group |= own.runs_timers;
      (on_timers ? own.timers : own.server).add(load, drops, real_time);
      if (own.processors.size() == 1) {
        const int n = own.processors.front();
        processors.try_emplace(n, Server{concat("processor ", n), 1, "core"})
            .first->second.add(load, drops, real_time);
      }
      if (load > 0) own.groups.insert(task.group);
      own.reentrant |= reentrant && load > 0;
    }
    Server& group = groups[task.group];
    if (group.name.empty()) group.name = "the callback group of " + task.name;
    if (!beside_group) group.add(load, drops, real_time);
    cores.add(load, drops, real_time);
  }
  std::vector<Server> all;
  for (const Threads& of : threads) all.insert(all.end(), {of.server, of.timers});
  all.insert(all.end(), groups.begin(), groups.end());
  for (const auto& [n, processor] : processors) all.push_back(processor);
  cores.remedy = concat("; give it ", static_cast<unsigned>(cores.load) + 1, " cores or more, or less work");
  all.push_back(cores);
  return all;
}

/// Threads without a core or a callback group for themselves; empty: there are none.
std::string idle_threads(const Threads& t) {
  const std::size_t groups = t.reentrant || t.groups.empty() ? t.count : t.groups.size();
  const bool few_cores = t.server.at_once < t.count;
  const std::size_t busy = few_cores ? t.server.at_once : groups;
  if (busy >= t.count) return "";
  return concat(t.server.name, " has ", t.count, " threads for ", busy,
                few_cores ? " core" : " mutually exclusive group", busy == 1 ? "" : "s", ", so more than ",
                busy, " of them gain nothing");
}

}  // namespace

Utilisation utilisation(const Graph& graph, const GraphTasks& tasks, const ExecutorSpec* spec,
                        const LiveThreads* live) {
  Utilisation u;
  std::vector<Threads> threads;
  if (spec != nullptr) threads = threads_of(graph, *spec, live);
  const std::vector<Server> servers = servers_of(graph, tasks, spec, threads);
  const std::optional<KernelRule> rule = kernel_rule(live);
  const std::string subject = spec != nullptr ? spec->label : graph.name;
  const auto reaches = [](double work, double most) { return work > 0 && work > most - 1e-9; };
  const auto warn_first = [&](const auto& applies, const auto& sentence) {
    const auto server = std::ranges::find_if(servers, applies);
    if (server != servers.end()) u.warnings.push_back(concat(subject, sentence(*server), "."));
  };
  for (const Server& s : servers) {
    u.percent = std::max(u.percent, 100 * s.load / s.at_once);
    if (!u.overload && reaches(s.load - s.droppable, s.at_once)) u.overload = s.overload();
  }
  warn_first([&](const Server& s) { return reaches(s.load, s.at_once); },
             [](const Server& s) { return " is overloaded: " + s.overload(); });
  warn_first([&](const Server& s) { return rule && reaches(s.real_time, rule->share * s.at_once); },
             [&](const Server& s) {
               return concat(": ", s.has(s.real_time), " at SCHED_FIFO or SCHED_RR; ", rule->text);
             });
  for (const Threads& of : threads) {
    u.threads += of.count + (of.runs_timers ? 1 : 0);
    if (const std::string idle = idle_threads(of); !idle.empty())
      u.warnings.push_back(concat(subject, ": ", idle, "."));
  }
  return u;
}

std::vector<double> intended_losses(const Graph& graph, const GraphTasks& tasks) {
  std::vector<double> losses = loads_of(graph, tasks);
  for (TaskId id = 0; id < losses.size(); ++id) {
    const bool drops = tasks.set[id].kind == TaskKind::subscription && tasks.set[id].depth == 1;
    losses[id] = drops ? std::max(0.0, 1 - 1 / losses[id]) : 0;
  }
  return losses;
}

}  // namespace hotpath::setup
