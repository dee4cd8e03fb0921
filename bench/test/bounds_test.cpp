// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "bounds/bounds.hpp"
#include "hotpath/reference_system/graph_file.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "program/text.hpp"
#include "properties.hpp"
#include "random_graphs.hpp"
#include "random_systems.hpp"
#include "setup/deployed_system.hpp"

namespace hotpath::test {

using namespace std::chrono_literals;

namespace {

constexpr int kRuns = 4;  // of each graph

SchedulerOptions scheduling(const Graph& graph) {
  SchedulerOptions options;
  options.service_wait = graph.service_wait;
  return options;
}

/// A task, chain or hot path, by its number; and values in ns.
using Which = std::pair<Latency, std::uint32_t>;
using Values = std::map<Which, std::int64_t>;

class BoundCase {
 public:
  BoundCase(std::uint64_t seed, const std::string& executor, std::uint32_t also_covers, bool of_lines)
      : seed_(seed),
        random_(seed),
        any_delivery_(seed % 5 == 3 ||
                      (also_covers & static_cast<std::uint32_t>(Assumption::any_delivery)) != 0),
        graph_(of_lines ? draw_lines(random_) : draw_graph(random_, seed, any_delivery_)),
        tasks_(make_tasks(graph_)),
        executor_(executor.empty() ? random_deployment(random_, graph_, tasks_)
                                   : setup::parse_executor(executor, scheduling(graph_))),
        also_covers_(also_covers) {}

  CaseResult check() {
    phases_known_ = chance(random_, 25);
    draw_phases(random_, graph_, tasks_);
    if (phases_known_ && executor_.entry && seed_ % 3 == 0) draw_uncertainty();
    bounds_ = bounds();
    const bool any = std::ranges::any_of(bounds_, [](const GraphBounds& b) { return !b.refusal; });
    if (!any) return {};
    const TaskSet given = tasks_.set;
    for (int run = 0; run < (uncertainty_ > Duration{} ? 2 * kRuns : kRuns) && result_.wrong.empty(); ++run) {
      if (!phases_known_ && run > 0) draw_phases(random_, graph_, tasks_);
      if (uncertainty_ > Duration{}) draw_phases_near(given);
      simulate_once(run);
    }
    if (result_.wrong.empty()) compare();
    for (const bounds::ReachedWorstCase& worst : reached_) expect_reached(worst);
    return result_;
  }

 private:
  /// At most a quarter of the shortest period.
  void draw_uncertainty() {
    Random own(~seed_);
    std::int64_t shortest = Duration(1h).count();
    for (const Task& task : tasks_.set.tasks) {
      if (task.kind == TaskKind::timer) shortest = std::min(shortest, task.period.count());
    }
    uncertainty_ = Duration(draw(own, 1, shortest / (chance(own, 50) ? 4 : 100)));
  }

  /// Phases up to the uncertainty earlier or later than `given`, often by all of it. All are later by
  /// the uncertainty, so that none precedes the beginning.
  void draw_phases_near(const TaskSet& given) {
    for (TaskId id = 0; id < given.size(); ++id) {
      if (given[id].kind != TaskKind::timer) continue;
      const std::int64_t most = 2 * uncertainty_.count();
      const std::int64_t later = chance(random_, 50)   ? draw(random_, 0, most)
                                 : chance(random_, 50) ? most
                                                       : 0;
      tasks_.set.tasks[id].phase = given[id].phase + Duration(later);
    }
  }

  /// As `analyze` does: the other methods know only how far the phases are apart.
  void forget_phases() {
    callbacks_.phases_known = false;
    for (const Task& task : callbacks_.set.tasks) {
      callbacks_.creation_spread = std::max(callbacks_.creation_spread, task.phase + 2 * uncertainty_);
    }
  }

  std::vector<GraphBounds> bounds() {
    callbacks_ = bounds::callback_graph(graph_, tasks_, phases_known_);
    if ((also_covers_ & static_cast<std::uint32_t>(Assumption::any_delivery)) != 0)
      callbacks_.delivery_known = true;
    if (!executor_.entry) return setup::bounds_of(graph_, callbacks_, executor_);
    if (uncertainty_ > Duration{}) forget_phases();
    SchedulerOptions scheduling = executor_.scheduler;
    if ((also_covers_ & static_cast<std::uint32_t>(Assumption::service_wait)) != 0)
      scheduling.service_wait = {};
    const BoundedSystem system{callbacks_, *executor_.entry, scheduling,
                               make_platform(graph_, *executor_.entry)};
    std::vector<GraphBounds> all = graph_bounds(system, also_covers_);
    if (!phases_known_) return all;
    // With several threads or delivery, a state has many successors.
    const bool wide = executor_.scheduler.workers > 1 || graph_.platform.delivery_delay > Duration{};
    const std::size_t most_states = wide ? 2'000 : 20'000;
    const bool near = uncertainty_ > Duration{}, with_witnesses = seed_ % 4 == 0 && !near;
    all.push_back(bounds::exact_worst_cases(graph_, tasks_, *executor_.entry, executor_.scheduler,
                                            {.max_states = most_states, .phase_uncertainty = uncertainty_},
                                            with_witnesses ? &reached_ : nullptr));
    if (!all.back().refusal && !near) exact_ = all.size() - 1;
    return all;
  }

  /// The graph's tasks, with an order of delivery where it is unknown.
  GraphTasks tasks_of_run(int number) const {
    Graph graph = graph_;
    Random random(seed_ + static_cast<std::uint64_t>(number));
    if (any_delivery_) draw_deliveries(random, graph);
    GraphTasks tasks = make_tasks(graph);
    for (TaskId id = 0; id < tasks.set.size(); ++id) tasks.set.tasks[id].phase = tasks_.set[id].phase;
    return tasks;
  }

  void simulate_once(int number) {
    const std::uint64_t seed = random_();
    std::unique_ptr<ExecutionTimes> times = std::make_unique<WorstCaseTimes>(tasks_.set);
    if (number % 2 != 0) times = std::make_unique<UniformTimes>(tasks_.set, seed);
    times->set_releases(std::make_unique<UniformReleases>(tasks_.set, seed));
    simulate(tasks_of_run(number), *times, 2s);
  }

  void simulate(const GraphTasks& tasks, const ExecutionTimes& times, Duration duration) {
    std::vector<ChainObservation> observations;
    const std::optional<Trace> run = simulated(graph_, tasks, executor_, times, duration, &observations);
    if (!run) return;
    const Trace& trace = *run;
    result_.jobs += trace.jobs.size();
    const auto see = [&](Latency kind, std::uint32_t number, Duration value) {
      std::int64_t& largest = seen_[{kind, number}];
      largest = std::max(largest, value.count());
    };
    for (const JobRecord& r : trace.jobs)
      if (r.outcome == Outcome::ran) see(Latency::response, r.job.task, r.finish - r.job.timestamp);
    for (const ChainRecord& c : join_chains(graph_, tasks_, trace, observations)) {
      see(Latency::age, c.chain, c.end_to_end_latency);
      see(Latency::hot_path, c.chain, c.hot_path_latency);
    }
  }

  /// The witness of a worst case reaches it to the nanosecond.
  void expect_reached(const bounds::ReachedWorstCase& worst) {
    seen_.clear();
    simulate(tasks_, WitnessTimes(tasks_.set, worst.witness), worst.witness.instant - Time{} + 1ns);
    const Which which{worst.latency, worst.number};
    if (seen_[which] != worst.value_ns) wrong("its witness", which, seen_[which], worst.value_ns);
  }

  static Values values(const GraphBounds& b) {
    Values all;
    for (TaskId id = 0; id < b.tasks.size(); ++id)
      if (b.tasks[id]) all[{Latency::response, id}] = *b.tasks[id];
    for (std::uint32_t c = 0; c < b.chains.size(); ++c) {
      if (!b.chains[c]) continue;
      all[{Latency::age, c}] = b.chains[c]->latency;
      if (b.chains[c]->hot_path) all[{Latency::hot_path, c}] = *b.chains[c]->hot_path;
    }
    return all;
  }

  /// No sound bound lies below an observation or the exact worst case.
  void compare() {
    for (const GraphBounds& b : bounds_) {
      compare(b, seen_, b.method);
      if (exact_) compare(b, values(bounds_[*exact_]), b.method + " below the exact value");
    }
  }

  void compare(const GraphBounds& b, const Values& reached, const std::string& method) {
    for (const auto& [which, bound] : values(b)) {
      const auto value = reached.find(which);
      if (value != reached.end() && value->second > bound) wrong(method, which, value->second, bound);
    }
  }

  void wrong(const std::string& method, const Which& which, std::int64_t seen, std::int64_t bound) {
    if (!result_.wrong.empty()) return;
    const auto& [kind, number] = which;
    const std::string& name =
        kind == Latency::response ? tasks_.set[number].name : graph_.chains[number].name;
    result_.wrong =
        executor_.label + ", " + method + ": " + std::string(to_string(kind)) + " " + name +
        " was observed with " + std::to_string(seen) + " ns, against " + std::to_string(bound) +
        " ns, seed " + std::to_string(seed_) + (phases_known_ ? ", phases known" : ", phases unknown") +
        (uncertainty_ > Duration{} ? " up to " + std::to_string(uncertainty_.count()) + " ns" : "") +
        ". Graph:\n" + graph_yaml(graph_) + deployment_text(executor_, tasks_.set);
  }

  const std::uint64_t seed_;
  Random random_;
  const bool any_delivery_;
  Graph graph_;
  GraphTasks tasks_;
  const setup::ExecutorSpec executor_;
  const std::uint32_t also_covers_;
  bool phases_known_ = false;
  Duration uncertainty_{};  // of known phases
  CallbackGraph callbacks_;
  std::vector<GraphBounds> bounds_;
  std::optional<std::size_t> exact_;  // of bounds_
  std::vector<bounds::ReachedWorstCase> reached_;
  Values seen_;  // the largest observations
  CaseResult result_;
};

/// Simulates a random graph under an executor (`NAME` or `NAME:VARIANT`) with random phases and
/// execution times, and compares the observations with all of its bounds. No executor: a random
/// deployment. `also_covers`: assumptions that no method checks. `of_lines`: the graph is one of
/// draw_lines().
CaseResult check_bounds(std::uint64_t seed, const std::string& executor, std::uint32_t also_covers = 0,
                        bool of_lines = false) {
  return BoundCase(seed, executor, also_covers, of_lines).check();
}

/// Graphs in which a state stands for schedules with earlier releases than those of the simulated one.
TEST(ExactValues, HoldForTheReleasesOfEverySchedule) {
  for (const auto& [executor, seed] :
       {std::pair{"static", 41'001'116}, {"rm-ro", 40'001'383}, {"events-ro", 41'000'304}}) {
    const CaseResult result = check_bounds(static_cast<std::uint64_t>(seed), executor, 0);
    EXPECT_EQ(result.wrong, "");
    EXPECT_GT(result.jobs, 0U) << executor;
  }
}

/// Without the check of one assumption, the search finds a wrong bound. Methods that do not cover
/// subscriptions also reject them as input.
struct Unchecked {
  const char* executor;
  Assumption assumption;
  std::uint64_t from = 0;  ///< First seed.
};

class EveryCheck : public testing::TestWithParam<Unchecked> {};

TEST_P(EveryCheck, IsNeeded) {
  for (std::uint64_t seed = GetParam().from; seed < GetParam().from + 2000; ++seed) {
    const auto result =
        check_bounds(seed, GetParam().executor, static_cast<std::uint32_t>(GetParam().assumption));
    if (!result.wrong.empty()) return;
  }
  FAIL() << "no bound was exceeded";
}

INSTANTIATE_TEST_SUITE_P(
    Assumptions, EveryCheck,
    testing::Values(
        Unchecked{"fp-ro", Assumption::fixed_priorities}, Unchecked{"edf-ro", Assumption::deadlines},
        Unchecked{"default", Assumption::polling}, Unchecked{"events-ro", Assumption::activation_order},
        Unchecked{"static", Assumption::other_order}, Unchecked{"rm-re", Assumption::runs_timers},
        Unchecked{"multi:2", Assumption::several_threads},
        Unchecked{"fp-ro:fifo", Assumption::ties_by_activation},
        Unchecked{"edf-ro", Assumption::mixed_deadlines}, Unchecked{"rm-ro", Assumption::wake_up},
        Unchecked{"rm-ro", Assumption::late_releases, 4'800}, Unchecked{"rm-ro", Assumption::any_delivery},
        Unchecked{"cbg:1", Assumption::woken_by_jobs, 29'000},
        Unchecked{"fp-ro", Assumption::service_wait, 2000}, Unchecked{"edf-ro", Assumption::service_wait}));

}  // namespace

std::vector<Property> properties() {
  std::vector<Property> all;
  std::vector<std::string> names = {"rm-ro:first",      "rm-ro:fifo",   "fp-ro:first", "fp-ro:fifo",
                                    "fp-ro:first:fifo", "edf-ro:first", "cbg:1"};
  for (const ExecutorEntry& executor : executors())
    names.push_back(std::string(executor.name) + (executor.traits.many_workers ? ":2" : ""));
  all.reserve(names.size() + 1);
  for (const std::string& name : names)
    all.push_back(
        {"bounds/" + name, 150, 0, [name](std::uint64_t seed) { return check_bounds(seed, name); }});
  for (const std::string name :
       {"multi:2", "multi:3", "multi-jazzy:2", "multi-fair:3", "cbg:2", "cbg:3", "cbg-3178:2"})
    all.push_back({"bounds/lines/" + name, 150, 0,
                   [name](std::uint64_t seed) { return check_bounds(seed, name, 0, true); }});
  all.push_back({"bounds/deployments", 600, 0, [](std::uint64_t seed) { return check_bounds(seed, ""); }});
  return all;
}

}  // namespace hotpath::test
