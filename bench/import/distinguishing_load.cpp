// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <optional>

#include "hotpath/core/job_order.hpp"
#include "hotpath/core/simulator.hpp"
#include "import/recognition.hpp"
#include "program/text.hpp"
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

std::string distinguishing_load(const Graph& graph, const GraphTasks& tasks,
                                std::vector<std::string> executors, std::size_t threads) {
  std::erase_if(executors, needs_numbers);
  if (executors.size() < 2) return {};
  const std::vector<results::MeasuredChain> chains = setup::measured_chains(graph, tasks);
  const std::unique_ptr<ExecutionTimes> times = simulated::execution_times_of(graph, tasks, 1);
  // The jobs that ran, by start; none: the executor is overloaded.
  const auto simulate = [&](const std::string& executor, double factor) -> std::optional<std::vector<Job>> {
    const setup::ExecutorSpec spec = setup::parse_executor(executor, {});
    const ScaledTimes scaled(*times, factor);
    simulated::Plan plan{spec, graph, tasks, chains, scaled};
    plan.duration = kLength;
    try {
      Trace trace = simulated::simulate_repetition(plan).trace;
      std::erase_if(trace.jobs, [](const JobRecord& r) { return r.outcome != Outcome::ran; });
      std::ranges::stable_sort(trace.jobs, {}, &JobRecord::start);
      std::vector<Job> jobs;
      for (const JobRecord& r : trace.jobs) jobs.push_back(r.job);
      return jobs;
    } catch (const SimulationError&) {
      return std::nullopt;
    }
  };
  const auto order_of = [](const std::vector<Job>& jobs) {
    JobOrder order;
    for (const Job& job : jobs) order.push_back(job.task);
    return order;
  };
  const std::optional<std::vector<Job>> recorded = simulate(executors.front(), 1);
  if (!recorded) return {};
  Duration work{};
  for (const Job& job : *recorded) work += times->of(job);
  const double load_percent = 100 * to_ms(work) / to_ms(kLength) / static_cast<double>(threads);
  if (load_percent <= 0 || load_percent >= kLast_percent) return {};
  const std::size_t others = executors.size() - 1;
  const int first = kStep_percent * (1 + static_cast<int>(load_percent) / kStep_percent);
  for (int percent = first; percent <= kLast_percent; percent += kStep_percent) {
    const double factor = percent / load_percent;
    const std::optional<std::vector<Job>> reference = simulate(executors.front(), factor);
    if (!reference) return {};
    const auto differing = std::count_if(executors.begin() + 1, executors.end(), [&](const std::string& e) {
      const std::optional<std::vector<Job>> other = simulate(e, factor);
      return !other || differ(order_of(*reference), order_of(*other));
    });
    if (differing > 0)
      return program::text("With the threads %d %% busy (recorded: %.0f %%), ", percent, load_percent) +
             program::concat(differing, " of the other ", others, " would run jobs in another order than ",
                             executors.front(), ".");
  }
  return program::text("Simulated with the threads up to %d %% busy (recorded: %.0f %%), ", kLast_percent,
                       load_percent) +
         program::concat(executors.front(), " and the other ", others,
                         " run this graph's jobs in nearly the same order.");
}

}  // namespace hotpath::imports
