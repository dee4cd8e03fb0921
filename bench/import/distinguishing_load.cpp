// SPDX-License-Identifier: Apache-2.0
#include "import/distinguishing_load.hpp"

#include <algorithm>

#include "hotpath/core/job_order.hpp"
#include "hotpath/core/simulator.hpp"
#include "program/text.hpp"
#include "setup/executor_spec.hpp"
#include "setup/run_setup.hpp"
#include "simulated/repetition.hpp"

namespace hotpath::imports {

namespace {

/// Length of each simulation.
constexpr Duration kLength = std::chrono::seconds(4);
/// Loads from the first tenth above the recorded one up to the last, in percent.
constexpr int kStep_percent = 10, kLast_percent = 100;
/// Jobs in another place count as another order from this number on: fewer would not suffice to
/// tell executors apart.
constexpr double kDiffering = 20;

/// Execution times, multiplied.
class ScaledTimes final : public ExecutionTimes {
 public:
  ScaledTimes(const ExecutionTimes& times, double factor) : times_(times), factor_(factor) {}
  Duration of(const Job& job) const override {
    return Duration(static_cast<std::int64_t>(factor_ * static_cast<double>(times_.of(job).count())));
  }

 private:
  const ExecutionTimes& times_;
  const double factor_;
};

class Trials {
 public:
  Trials(const Graph& graph, const GraphTasks& tasks)
      : graph_(graph),
        tasks_(tasks),
        chains_(setup::measured_chains(graph, tasks)),
        times_(simulated::execution_times_of(graph, tasks, 1)) {}

  const ExecutionTimes& times() const { return *times_; }

  /// None: the executor is overloaded.
  std::optional<Trace> run(const std::string& executor, double factor) const {
    const setup::ExecutorSpec spec = setup::parse_executor(executor, {});
    const ScaledTimes times(*times_, factor);
    simulated::Plan plan{spec, graph_, tasks_, chains_, times};
    plan.duration = kLength;
    try {
      return simulated::simulate_repetition(plan).trace;
    } catch (const SimulationError&) {
      return std::nullopt;
    }
  }

 private:
  const Graph& graph_;
  const GraphTasks& tasks_;
  const std::vector<results::MeasuredChain> chains_;
  const std::unique_ptr<ExecutionTimes> times_;
};

JobOrder order_of(const Trace& trace) {
  std::vector<const JobRecord*> ran;
  for (const JobRecord& r : trace.jobs)
    if (r.outcome == Outcome::ran) ran.push_back(&r);
  std::ranges::stable_sort(ran, {}, [](const JobRecord* r) { return r->start; });
  JobOrder order;
  for (const JobRecord* r : ran) order.push_back(r->job.task);
  return order;
}

double load_percent(const Trace& trace, const ExecutionTimes& times, std::size_t threads) {
  Duration work{};
  for (const JobRecord& r : trace.jobs)
    if (r.outcome == Outcome::ran) work += times.of(r.job);
  return 100 * to_ms(work) / to_ms(kLength) / static_cast<double>(threads);
}

bool differ(const JobOrder& a, const JobOrder& b) {
  if (a == b) return false;
  const auto jobs = static_cast<double>(std::max(a.size(), b.size()));
  return (1 - similarity(a, b)) * jobs >= kDiffering;
}

bool needs_numbers(const std::string& executor) {
  const std::optional<Policy> policy = setup::parse_executor(executor, {}).entry->traits.policy;
  return policy == Policy::fp || policy == Policy::dm;
}

}  // namespace

DistinguishingLoad distinguishing_load(const Graph& graph, const GraphTasks& tasks,
                                       std::span<const std::string> executors, std::size_t threads) {
  std::vector<std::string> candidates(executors.begin(), executors.end());
  std::erase_if(candidates, needs_numbers);
  DistinguishingLoad result;
  if (candidates.size() < 2) return result;
  result.first = candidates.front();
  result.others = candidates.size() - 1;
  const Trials trials(graph, tasks);
  const std::optional<Trace> recorded = trials.run(candidates.front(), 1);
  if (!recorded) return result;
  result.recorded_percent = load_percent(*recorded, trials.times(), threads);
  if (result.recorded_percent <= 0) return result;
  const int first = kStep_percent * (1 + static_cast<int>(result.recorded_percent) / kStep_percent);
  for (int percent = first; percent <= kLast_percent; percent += kStep_percent) {
    const double factor = percent / result.recorded_percent;
    const std::optional<Trace> reference = trials.run(candidates.front(), factor);
    if (!reference) return {};
    const JobOrder order = order_of(*reference);
    for (std::size_t i = 1; i < candidates.size(); ++i) {
      const std::optional<Trace> other = trials.run(candidates[i], factor);
      result.differing += !other || differ(order, order_of(*other));
    }
    if (result.differing == 0) continue;
    result.percent = percent;
    return result;
  }
  return result;
}

std::string DistinguishingLoad::sentence() const {
  if (others == 0 || recorded_percent <= 0) return {};
  if (!percent && recorded_percent >= kLast_percent) return {};  // nothing was simulated
  if (!percent)
    return program::text("Simulated with the threads up to %d %% busy (recorded: %.0f %%), ", kLast_percent,
                         recorded_percent) +
           first +
           program::text(" and the other %zu run this graph's jobs in nearly the same order.", others);
  return program::text("With the threads %.0f %% busy (recorded: %.0f %%), ", *percent, recorded_percent) +
         program::text("%zu of the other %zu would run jobs in another order than ", differing, others) +
         first + ".";
}

}  // namespace hotpath::imports
