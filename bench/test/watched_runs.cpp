// SPDX-License-Identifier: Apache-2.0
#include "watched_runs.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "hotpath/reference_system/graph_writer.hpp"
#include "hotpath/reference_system/phases.hpp"
#include "import/hypothesis.hpp"
#include "import/run_events.hpp"
#include "program/text.hpp"
#include "random_graphs.hpp"
#include "setup/executor_spec.hpp"
#include "simulated/simulated_system.hpp"
#include "watch/observer.hpp"
#include "watch/stated_contract.hpp"

namespace hotpath::test {

using namespace std::chrono_literals;

namespace {

constexpr Duration kLength = 3s, kPoll = 20ms;

/// Times of which one exceeds its task's worst case.
class PlantedTimes final : public ExecutionTimes {
 public:
  PlantedTimes(const ExecutionTimes& times, JobRef job, Duration length)
      : times_(times), job_(job), length_(length) {}
  [[nodiscard]] Duration of(const Job& job) const override {
    return job.ref() == job_ ? length_ : times_.of(job);
  }

 private:
  const ExecutionTimes& times_;
  const JobRef job_;
  const Duration length_;
};

class WatchedCase {
 public:
  WatchedCase(const Graph& graph, const std::string& executor, std::uint64_t seed)
      : random_(seed),
        graph_(graph),
        tasks_(make_tasks(graph_)),
        executor_(setup::parse_executor(executor, {})) {
    const Phases kinds[] = {Phases::random, Phases::synchronous, Phases::creation};
    PhaseOptions options;
    options.seed = random_();
    const std::vector<Duration> first =
        make_phases(graph_, tasks_, kinds[static_cast<std::size_t>(draw(random_, 0, 2))], options);
    for (TaskId id = 0; id < first.size(); ++id) tasks_.set.tasks[id].phase = first[id];
  }

  CaseResult check(bool planted) {
    const UniformTimes times(tasks_.set, random_());
    if (!simulate(times)) return {};
    if (!planted) return watch("");
    std::vector<const JobRecord*> ran;
    for (const JobRecord& r : trace_.jobs)
      if (r.outcome == Outcome::ran && r.finish > r.start) ran.push_back(&r);
    if (ran.empty()) return {};
    const JobRecord& chosen =
        *ran[static_cast<std::size_t>(draw(random_, 0, static_cast<std::int64_t>(ran.size()) - 1))];
    const JobRef job = chosen.job.ref();
    const Time begin = chosen.start;
    if (!simulate(PlantedTimes(times, job, tasks_.set[job.task].wcet * 11 / 10 + 1us))) return {};
    const auto overrun = std::ranges::find_if(
        trace_.jobs, [&](const JobRecord& r) { return r.job.ref() == job && r.outcome == Outcome::ran; });
    if (overrun == trace_.jobs.end() || overrun->start != begin) return {};  // the run ended before
    return watch(tasks_.set[job.task].name);
  }

 private:
  /// False: the system is overloaded.
  bool simulate(const ExecutionTimes& times) {
    observations_.clear();
    trace_ = {};
    GraphWorkload workload(graph_, tasks_, times, &observations_);
    SimulationOptions options;
    options.platform = make_platform(graph_, *executor_.entry);
    options.duration = kLength;
    options.max_backlog = 1000;
    const simulated::System system(executor_, graph_, tasks_);
    TraceRecorder recorder(trace_);
    try {
      hotpath::simulate(tasks_.set, system.executors(), system.executor_of(), workload, options, &recorder);
      return true;
    } catch (const SimulationError&) {
      return false;
    }
  }

  /// `culprit`: the task whose job was planted; empty: none.
  CaseResult watch(const std::string& culprit) {
    const ExecutorTraits& traits = executor_.entry->traits;
    const bool states_jobs =
        traits.timers == TimerHandling::release_only || traits.timers == TimerHandling::release_and_execute;
    const imports::ExportedRun run{
        graph_, tasks_,      trace_, std::vector<bool>(kMaxWorkers, imports::emits_waits(traits)),
        {},     states_jobs, true,   graph_.platform.cores};
    const imports::RunEvents recorded = imports::events_of(run, false);
    const watch::Contract stated =
        watch::parse_contract("a contract", watch::stated_contract(graph_, tasks_, executor_));
    if (!culprit.empty() && !has_budget(stated, culprit)) return {};
    watch::ContractCheck contract(stated, watch::WallClock(Duration{}));
    watch::Observer observer(&contract, nullptr);
    CaseResult result;
    std::optional<Time> next;
    for (const tracing::Event& event : recorded.events) {
      for (next = next.value_or(event.at); *next <= event.at; *next += kPoll)
        observer.observed_until(*next, {});
      observer.event(event);
      result.jobs += event.kind == tracing::EventKind::callback_end ? 1 : 0;
    }
    const std::string said = contract.incident({});
    if (culprit.empty()) {
      if (!said.empty()) result.wrong = "a false alarm: " + said;
      // rcl derives a timestamp before the cost of the dispatch, the watcher at the start after it.
      const bool exact = states_jobs || graph_.platform.timer_dispatch_cost == Duration::zero();
      if (said.empty() && exact) result.wrong = differences(contract);
    } else if (!names(said, culprit)) {
      result.wrong = "an overrun of " + culprit + " is called: " + said;
    }
    if (!result.wrong.empty()) result.wrong += "\n" + graph_yaml(graph_);
    return result;
  }

  /// Whether the contract limits the task's jobs to their worst case: not where threads of equal rank
  /// displace one another.
  bool has_budget(const watch::Contract& contract, const std::string& culprit) const {
    const auto task = std::ranges::find(tasks_.set.tasks, culprit, &Task::name);
    const std::vector<watch::Term>& terms =
        contract.callbacks[static_cast<std::size_t>(task - tasks_.set.tasks.begin())].terms;
    return std::ranges::any_of(terms, [&](const watch::Term& term) {
      return term.clause == watch::Clause::budget && term.limit == task->wcet.count();
    });
  }

  /// Whether the sentence begins with an overrun of the task, after its instant.
  bool names(const std::string& sentence, const std::string& culprit) const {
    const auto task = std::ranges::find(tasks_.set.tasks, culprit, &Task::name);
    const TaskOrigin& origin = tasks_.origin[static_cast<TaskId>(task - tasks_.set.tasks.begin())];
    const Node& node = graph_.nodes[origin.node];
    const std::string name =
        node.name + (origin.input ? "/" + node.inputs[*origin.input].topic + " " : std::string(" (timer"));
    const std::size_t subject = std::min(sentence.find(' '), sentence.size() - 1) + 1;
    const std::size_t deed =
        std::min(sentence.find(" ran ", subject), sentence.find(" has run for ", subject));
    return sentence.substr(subject).starts_with(name) && deed < sentence.find(';', subject);
  }

  /// Whether the exported events lack messages of the chain's end: a simulation does not tell which jobs
  /// publish a set of samples that nobody takes.
  bool is_unseen(const ChainIndex& chain) const {
    return std::ranges::any_of(chain.sink_tasks, [&](TaskId sink) {
      const std::vector<Publication>& publishes = tasks_.callbacks[sink].publishes;
      for (std::size_t p = 0; p < publishes.size(); ++p) {
        const bool always =
            publishes[p].rule == PublishRule::always || publishes[p].rule == PublishRule::last_of;
        if (!always && tasks_.readers[sink][p].empty()) return true;
      }
      return false;
    });
  }

  /// Latencies of chains, as the simulated messages have them.
  std::string differences(watch::ContractCheck& contract) const {
    std::vector<std::uint64_t> outputs(graph_.chains.size());
    std::vector<Duration> age(outputs.size(), Duration(-1)), hot_path = age;
    for (const ChainRecord& c : join_chains(graph_, tasks_, trace_, observations_)) {
      if (c.end_to_end_latency < Duration{}) continue;  // its job had not ended
      ++outputs[c.chain];
      age[c.chain] = std::max(age[c.chain], c.end_to_end_latency);
      hot_path[c.chain] = std::max(hot_path[c.chain], c.hot_path_latency);
    }
    const std::vector<ChainIndex> chains = index_chains(graph_, tasks_);
    for (std::size_t c = 0; c < outputs.size(); ++c) {
      const watch::ObservedChain& seen = contract.chains()[c];
      if (is_unseen(chains[c])) continue;
      if (seen.hot_path.count() == outputs[c] && seen.age.max() == age[c] &&
          seen.hot_path.max() == hot_path[c])
        continue;
      return program::concat("chain ", graph_.chains[c].name, " has ", seen.hot_path.count(),
                             " outputs, age ", seen.age.max().count(), ", hot path ",
                             seen.hot_path.max().count(), " ns, not ", outputs[c], ", ", age[c].count(), ", ",
                             hot_path[c].count());
    }
    return "";
  }

  Random random_;
  const Graph& graph_;
  GraphTasks tasks_;
  const setup::ExecutorSpec executor_;
  Trace trace_;
  std::vector<ChainObservation> observations_;
};

/// A trace does not tell in which order jobs that two threads start and end at one instant read their data.
void let_all_jobs_last(Graph& graph, Random& random) {
  const auto last = [&](Duration& best, Duration& worst) {
    if (worst > Duration::zero()) return;
    best = worst = Duration(draw(random, 1, 1000));
  };
  for (Node& node : graph.nodes) {
    if (node.type != NodeType::callbacks) last(node.best_case_execution_time, node.execution_time);
    for (Callback& callback : node.callbacks) last(callback.best, callback.worst);
  }
}

}  // namespace

CaseResult check_watched(const Graph& graph, const std::string& executor, std::uint64_t seed, bool planted) {
  return WatchedCase(graph, executor, seed).check(planted);
}

CaseResult check_watched(const std::string& executor, std::uint64_t seed, bool planted) {
  Random random(seed);
  Graph graph = random_graph(random);
  Random services(seed);  // in the contract; subscriptions stand for them in the run
  for (Node& node : graph.nodes)
    for (Callback& callback : node.callbacks)
      callback.service = callback.input.has_value() && draw(services, 0, 3) == 0;
  graph.platform.delivery_delay = {};  // a sample on its way counts as unread from its publication on
  // The exported job takes its sample when it starts, not when it is chosen: another thread may publish
  // between them.
  const setup::ExecutorSpec parsed = setup::parse_executor(executor, {});
  const TimerHandling timers = parsed.entry->traits.timers;
  const bool jobless = timers == TimerHandling::release_only || timers == TimerHandling::marked_ready;
  const std::uint32_t threads = worker_count(*parsed.entry, parsed.scheduler) - (jobless ? 1 : 0);
  if (threads > 1) {
    graph.platform.set_dispatch_costs({});
    let_all_jobs_last(graph, random);
  }
  return check_watched(graph, executor, random(), planted);
}

std::string findings() { return ""; }

std::vector<Property> properties() {
  std::vector<Property> all;
  for (const char* name : {"default", "static", "events-ro", "rm-ro", "dm-ro", "fp-ro", "edf-ro",
                           "rm-ro:first", "events-re", "rm-re", "edf-re", "multi:2", "cbg:1"}) {
    for (const bool planted : {false, true}) {
      all.push_back({std::string(planted ? "planted/" : "calm/") + name, 3,
                     [name = std::string(name), planted](std::uint64_t seed) {
                       return check_watched(name, seed, planted);
                     }});
    }
  }
  return all;
}

}  // namespace hotpath::test
