// SPDX-License-Identifier: Apache-2.0
// The watcher on simulated runs: no false alarm, and a planted fault is named.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "import/import_ctf.hpp"
#include "import/recognition.hpp"
#include "program/text.hpp"
#include "properties.hpp"
#include "random_systems.hpp"
#include "reference_nodes.hpp"
#include "watch/contract.hpp"
#include "watch/observer.hpp"

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

/// What the operating system would say of the threads of a deployment: each one waits for a processor while
/// its jobs are displaced.
class SimulatedFacts {
 public:
  SimulatedFacts(const setup::ExecutorSpec& executor, const Trace& trace, const ExecutionTimes& times) {
    if (executor.entry) return;
    for (const setup::ExecutorSpec& part : setup::parts(executor)) {
      watch::ThreadFacts facts{.process = kProcess, .policy = part.place.policy};
      facts.processors = part.place.processors;
      std::ranges::sort(facts.processors);
      for (std::uint32_t w = worker_count(*part.entry, part.scheduler); w > 0; --w) {
        facts.thread = kProcess + static_cast<std::uint32_t>(facts_.size());
        facts_.push_back(facts);
      }
    }
    for (const JobRecord& r : trace.jobs) {
      if (r.outcome != Outcome::ran) continue;
      const Duration length = r.finish - r.start, ran = std::min(length, times.of(r.job));
      runs_.emplace(imports::kExportedEpoch + (r.finish - trace.epoch), Run{r.worker, ran, length - ran});
    }
  }

  /// Ascending instants.
  const std::vector<watch::ThreadFacts>& at(Time instant) {
    while (!runs_.empty() && runs_.begin()->first <= instant && !facts_.empty()) {
      const Run& run = runs_.begin()->second;
      facts_[run.worker].ran += run.ran;
      facts_[run.worker].waited += run.waited;
      runs_.erase(runs_.begin());
    }
    return facts_;
  }

 private:
  struct Run {
    std::uint16_t worker;
    Duration ran, waited;
  };
  static constexpr std::uint32_t kProcess = 1000;  // of exported events
  std::vector<watch::ThreadFacts> facts_;          // by worker
  std::multimap<Time, Run> runs_;                  // by their ends
};

class WatchedCase {
 public:
  WatchedCase(const Graph& graph, GraphTasks tasks, setup::ExecutorSpec executor, std::uint64_t seed)
      : random_(seed), graph_(graph), tasks_(std::move(tasks)), executor_(std::move(executor)) {
    draw_phases(random_, graph_, tasks_);
  }

  CaseResult check(bool planted) {
    const UniformTimes times(tasks_.set, random_());
    if (!simulate(times)) return {};
    if (!planted) return watch(times, std::nullopt);
    std::vector<const JobRecord*> ran;
    for (const JobRecord& r : trace_.jobs)
      if (r.outcome == Outcome::ran && r.finish > r.start) ran.push_back(&r);
    if (ran.empty()) return {};
    const JobRecord& chosen =
        *ran[static_cast<std::size_t>(draw(random_, 0, static_cast<std::int64_t>(ran.size()) - 1))];
    const JobRef job = chosen.job.ref();
    const Time begin = chosen.start;
    const PlantedTimes longer(times, job, tasks_.set[job.task].wcet * 11 / 10 + 1us);
    if (!simulate(longer)) return {};
    const auto overrun = std::ranges::find_if(
        trace_.jobs, [&](const JobRecord& r) { return r.job.ref() == job && r.outcome == Outcome::ran; });
    if (overrun == trace_.jobs.end() || overrun->start != begin) return {};  // the run ended before
    return watch(longer, job.task);
  }

 private:
  /// False: the system is overloaded.
  bool simulate(const ExecutionTimes& times) {
    observations_.clear();
    std::optional<Trace> trace = simulated(graph_, tasks_, executor_, times, kLength, &observations_);
    if (trace) trace_ = std::move(*trace);
    return trace.has_value();
  }

  imports::ExportedRun exported() const {
    imports::ExportedRun run{graph_, tasks_, trace_, {}, {}, {}, true, graph_.platform.cores};
    for (const setup::ExecutorSpec& part : setup::parts(executor_)) {
      const std::uint32_t workers = worker_count(*part.entry, part.scheduler);
      run.polled.insert(run.polled.end(), workers, imports::emits_waits(part.entry->traits));
      run.states_jobs.insert(run.states_jobs.end(), workers, states_jobs(part));
      run.processors.insert(run.processors.end(), workers, part.place.processors);
    }
    return run;
  }

  static bool states_jobs(const setup::ExecutorSpec& executor) {
    const TimerHandling timers = executor.entry->traits.timers;
    return timers == TimerHandling::release_only || timers == TimerHandling::release_and_execute;
  }

  /// `culprit`: the task whose job was planted.
  CaseResult watch(const ExecutionTimes& times, std::optional<TaskId> culprit) {
    const imports::ExportedRun run = exported();
    const imports::RunEvents recorded = imports::events_of(run, false);
    const watch::Contract stated =
        watch::parse_contract("a contract", contract_text(watch::stated_contract(graph_, tasks_, executor_)));
    if (culprit && !has_budget(stated, *culprit)) return {};
    watch::Observer observer(stated, nullptr);
    SimulatedFacts facts(executor_, trace_, times);
    CaseResult result;
    std::optional<Time> next;
    for (const tracing::Event& event : recorded.events) {
      for (next = next.value_or(event.at); *next <= event.at; *next += kPoll) {
        observer.observed_until(*next, 0);
        observer.threads(facts.at(*next), *next);
      }
      observer.event(event);
      result.jobs += event.kind == tracing::EventKind::callback_end ? 1 : 0;
    }
    const std::string said = observer.judge().incident();
    if (!culprit) {
      if (!said.empty()) result.wrong = "a false alarm: " + said;
      // rcl derives a timestamp before the cost of the dispatch, the watcher at the start after it.
      const bool exact = std::ranges::all_of(setup::parts(executor_), states_jobs) ||
                         graph_.platform.timer_dispatch_cost == Duration::zero();
      if (said.empty() && exact && !splits_a_node()) result.wrong = differences(observer);
    } else if (const std::string name = stated.callbacks[*culprit].name(); !tells_overrun(said, name)) {
      result.wrong = "an overrun of " + name + " is called: " + said;
    }
    if (!result.wrong.empty())
      result.wrong += "\n" + graph_yaml(graph_) + deployment_text(executor_, tasks_.set);
    return result;
  }

  /// Whether the contract limits the task's jobs to their worst case: not where threads of equal rank
  /// displace one another.
  bool has_budget(const watch::Contract& contract, TaskId task) const {
    const watch::Term* const budget = find(contract.callbacks[task].terms, watch::Clause::budget);
    return budget != nullptr && budget->limit == tasks_.set[task].wcet.count();
  }

  /// Whether the sentence tells an overrun of the callback, after its instant.
  static bool tells_overrun(const std::string& sentence, const std::string& callback) {
    const std::string told = sentence.substr(std::min(sentence.find(' '), sentence.size() - 1) + 1);
    return told.starts_with(callback + " ran ") || told.starts_with(callback + " has run for ");
  }

  /// Whether several executors run callbacks of one node. Those that only store a sample take no time: a
  /// trace does not tell in which order two threads do so at one instant.
  bool splits_a_node() const {
    std::map<std::uint32_t, std::uint32_t> executor_of_node;
    for (TaskId task = 0; !executor_.entry && task < tasks_.set.size(); ++task) {
      const std::uint32_t executor = executor_.plan.executor_of[task];
      if (executor_of_node.try_emplace(tasks_.origin[task].node, executor).first->second != executor)
        return true;
    }
    return false;
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
  std::string differences(const watch::Observer& observer) const {
    std::vector<std::uint64_t> outputs(graph_.chains.size());
    std::vector<Duration> age(outputs.size(), Duration(-1)), hot_path = age;
    for (const ChainRecord& c : join_chains(graph_, tasks_, trace_, observations_)) {
      if (c.end_to_end_latency < Duration{}) continue;  // its job had not ended
      ++outputs[c.chain];
      age[c.chain] = std::max(age[c.chain], c.end_to_end_latency);
      hot_path[c.chain] = std::max(hot_path[c.chain], c.hot_path_latency);
    }
    const std::vector<ChainIndex> chains = index_chains(graph_, tasks_);
    // Other threads may displace a thread between the call of a timer and the start of its job.
    const bool exact_ages = executor_.entry || std::ranges::all_of(setup::parts(executor_), states_jobs);
    for (std::size_t c = 0; c < outputs.size(); ++c) {
      const watch::ObservedChain& seen = observer.chains()[c];
      if (is_unseen(chains[c])) continue;
      const bool same_age = !exact_ages || seen.age.max() == age[c];
      if (seen.hot_path.count() == outputs[c] && same_age && seen.hot_path.max() == hot_path[c]) continue;
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

/// The exported job takes its sample when it starts, not when it is chosen: another thread may publish
/// between them. Nor does a trace tell in which order jobs that two threads start and end at one instant read
/// their data: all jobs last.
void prepare_threads(Graph& graph, Random& random) {
  graph.platform.set_dispatch_costs({});
  const auto last = [&](Duration& best, Duration& worst) {
    if (worst > Duration::zero()) return;
    best = worst = Duration(draw(random, 1, 1000));
  };
  for (Node& node : graph.nodes) {
    Callback& working = node.callbacks.back();
    if (node.type == NodeType::cyclic) {
      last(working.best, working.worst);
    } else if (node.type == NodeType::callbacks) {
      for (Callback& callback : node.callbacks) last(callback.best, callback.worst);
    } else {
      last(working.best, working.worst);
      for (Callback& callback : node.callbacks) callback.best = working.best, callback.worst = working.worst;
    }
  }
}

CaseResult check_deployed(Graph& graph, Random& random, bool planted) {
  const bool any_sample = std::ranges::any_of(graph.nodes, [](const Node& n) { return !n.inputs.empty(); });
  if (any_sample) {
    prepare_threads(graph, random);
    graph.platform.wait_cost = graph.platform.wait_cost_per_entity = {};  // a job is chosen before it
  }
  GraphTasks tasks = make_tasks(graph);
  const setup::ExecutorSpec executor = random_deployment(random, graph, tasks);
  return WatchedCase(graph, tasks, executor, random()).check(planted);
}

/// Simulates a random graph under an executor with random phases and execution times, and passes the events
/// of the run to the watcher with the contract of the graph. `planted`: one job takes longer than its budget.
/// Wrong: an alarm without a fault, a planted fault that is not named, or a chain whose latencies differ from
/// those of the simulation. No executor: a random deployment, whose threads the watcher sees as well.
CaseResult check_watched(const std::string& executor, std::uint64_t seed, bool planted) {
  Random random(seed);
  Graph graph = random_graph(random);
  Random services(seed);  // in the contract; subscriptions stand for them in the run
  for (Node& node : graph.nodes)
    for (Callback& callback : node.callbacks)
      if (callback.input && draw(services, 0, 3) == 0) callback.entity = EntityKind::service;
  graph.platform.delivery_delay = {};  // a sample on its way counts as unread from its publication on
  if (executor.empty()) return check_deployed(graph, random, planted);
  const setup::ExecutorSpec parsed = setup::parse_executor(executor, {});
  const TimerHandling timers = parsed.entry->traits.timers;
  const bool jobless = timers == TimerHandling::release_only || timers == TimerHandling::marked_ready;
  const std::uint32_t threads = worker_count(*parsed.entry, parsed.scheduler) - (jobless ? 1 : 0);
  if (threads > 1) prepare_threads(graph, random);
  return WatchedCase(graph, make_tasks(graph), parsed, random()).check(planted);
}

void expect_calm(const Graph& graph, const std::string& executor) {
  std::uint64_t jobs = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    WatchedCase watched(graph, make_tasks(graph), setup::parse_executor(executor, {}), seed);
    const CaseResult result = watched.check(false);
    ASSERT_EQ(result.wrong, "") << executor;
    jobs += result.jobs;
  }
  EXPECT_GT(jobs, 0U);
}

// While 40 ms of work last 100 ms, the timer thread pays for ten releases: as many as in the time of its own
// jobs, not in that of the work alone.
TEST(ReleaseAndExecute, BudgetsCountTheReleasesDuringTheJobsOfTheTimerThread) {
  Graph graph;
  graph.platform.release_cost = 1ms;
  graph.nodes = {reference_node("slow", NodeType::sensor, {}, 200ms),
                 reference_node("fast", NodeType::sensor, {}, 10ms, 5ms),
                 reference_node("filter", NodeType::transform, {{"slow", 1, {}}}, {}, 40ms)};
  for (const char* executor : {"rm-re", "edf-re", "fp-re"}) expect_calm(graph, executor);
}

// Both timers publish at one instant, at which the other thread takes the first sample between them.
TEST(ReleaseAndExecute, KeepsTheOrderOfThreadsAtOneInstant) {
  Graph graph;
  graph.platform.cores = 2;
  for (const char* name : {"one", "two"}) {
    ReferenceNode node = reference_node(name, NodeType::sensor, {}, 10ms);
    node.outputs = {"points"};
    graph.nodes.push_back(node);
  }
  graph.nodes.push_back(reference_node("filter", NodeType::transform, {{"points", 1, {}}}, {}, 1ms));
  for (const char* executor : {"events-re", "rm-re"}) expect_calm(graph, executor);
}

}  // namespace

std::vector<Property> properties() {
  std::vector<Property> all;
  for (const char* name : {"default", "static", "events-ro", "rm-ro", "dm-ro", "fp-ro", "edf-ro",
                           "rm-ro:first", "events-re", "rm-re", "edf-re", "multi:2", "cbg:1", ""}) {
    for (const bool planted : {false, true}) {
      const std::string system = *name == '\0' ? "deployments" : name;
      all.push_back({(planted ? "planted/" : "calm/") + system, 3, 1,
                     [name = std::string(name), planted](std::uint64_t seed) {
                       return check_watched(name, seed, planted);
                     }});
    }
  }
  return all;
}

}  // namespace hotpath::test
