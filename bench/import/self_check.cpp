// SPDX-License-Identifier: Apache-2.0
#include "import/stages.hpp"

#include <algorithm>
#include <cmath>

#include "hotpath/core/simulator.hpp"
#include "hotpath/reference_system/graph_workload.hpp"
#include "program/text.hpp"
#include "results/measures.hpp"
#include "setup/run_setup.hpp"
#include "simulated/repetition.hpp"

namespace hotpath::imports {

namespace {

/// Of the outputs on each side of a median that count as it: their share, and how many are compared.
constexpr double kMedianRank = 0.02;
constexpr int kRanks = 4;
/// A deviation is red beyond this multiple of the green limit, in a quantile of so many outputs.
constexpr double kRed = 3;
constexpr std::size_t kFewestForMedian = 20, kFewestForP99 = 100;

/// The start of the executors, which begin after nodes and timers exist.
Duration first_start(const Trace& recorded) {
  Duration first = recorded.end - Time{} - Duration(1);
  for (const JobRecord& r : recorded.jobs)
    if (r.outcome == Outcome::ran) first = std::min(first, r.start - Time{});
  return std::max(first, Duration::zero());
}

/// A job gets the time of its task's recorded job nearest in time: numbers would shift with each job more.
class TimesOfMoment final : public ExecutionTimes {
 public:
  TimesOfMoment(const TaskSet& set, const Trace& trace) : recorded_(set.size()) {
    for (const Task& task : set.tasks) wcet_.push_back(task.wcet);
    for (const JobRecord& r : trace.jobs)
      if (r.outcome == Outcome::ran) recorded_[r.job.task].emplace_back(r.job.timestamp, own_time(r));
    for (auto& of_task : recorded_) std::ranges::sort(of_task);
  }
  Duration of(const Job& job) const override {
    const auto& of_task = recorded_[job.task];
    if (of_task.empty()) return wcet_[job.task];
    auto next = std::ranges::lower_bound(of_task, job.timestamp, {}, &Recorded::first);
    if (next == of_task.end()) return of_task.back().second;
    if (next != of_task.begin() && job.timestamp - std::prev(next)->first < next->first - job.timestamp)
      --next;
    return next->second;
  }

 private:
  using Recorded = std::pair<Time, Duration>;    // timestamp and execution time
  std::vector<std::vector<Recorded>> recorded_;  // by task
  std::vector<Duration> wcet_;
};

Trace simulate_recorded(const Graph& graph, const GraphTasks& tasks, const setup::ExecutorSpec& executor,
                        const Trace& recorded) {
  const TimesOfMoment times(tasks.set, working_jobs(tasks, recorded));
  simulated::Plan plan{executor, graph, tasks, times};
  plan.duration = recorded.end - Time{};
  plan.start = first_start(recorded);
  plan.max_backlog = 1000 * tasks.set.size();
  return simulated::simulate_repetition(plan).trace;
}

/// Latencies that differ by less count as equal, which matters for callbacks without work.
constexpr double kSame_ms = 1e-3;

double error_percent(double recorded_ms, double simulated_ms) {
  return std::abs(simulated_ms - recorded_ms) < kSame_ms ? 0 : 100 * (simulated_ms / recorded_ms - 1);
}

/// The lost percentage of all timestamps and samples.
double lost_percent(const Trace& trace) {
  std::uint64_t lost = 0, all = 0;
  for (const JobRecord& r : trace.jobs) {
    if (r.job.timestamp < Time{} || r.outcome == Outcome::empty) continue;
    all += 1 + r.job.skipped;
    lost += r.job.skipped + (r.outcome == Outcome::overwritten);
  }
  return results::percent_of(lost, all);
}

/// Adds the reason if `deviation` exceeds the limit `green`.
void judge(SelfCheck& check, double deviation, double green, const std::string& reason, bool enough = true) {
  const bool red = enough && deviation > kRed * green;
  if (deviation > green) check.doubt(reason, red ? Light::red : Light::yellow);
}

/// Whether the median of each is an output near the median of the other: between two modes, few outputs
/// decide.
bool middles_agree(std::vector<double> recorded, std::vector<double> simulated) {
  std::ranges::sort(recorded);
  std::ranges::sort(simulated);
  const auto at = [](const std::vector<double>& sorted, int rank) {
    const double share = 0.5 + kMedianRank * rank / kRanks;
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  };
  bool of_recording = false, of_simulation = false;
  for (int r = -kRanks; r <= kRanks; ++r) {
    of_recording |= std::abs(error_percent(at(recorded, 0), at(simulated, r))) <= kMedianError_percent;
    of_simulation |= std::abs(error_percent(at(recorded, r), at(simulated, 0))) <= kMedianError_percent;
  }
  return of_recording && of_simulation;
}

void compare_latencies(SelfCheck& check, const std::string& name, const std::vector<double>& recorded,
                       const std::vector<double>& simulated, bool doubted) {
  SelfCheck::ChainCheck& chain = check.chains.emplace_back();
  chain.chain = name;
  const auto& of_recording = chain.recorded_ms = quantiles(recorded);
  const auto& of_simulation = chain.simulated_ms = quantiles(simulated);
  if (recorded.empty() || simulated.empty())
    return check.doubt(
        program::concat("No output of ", name, recorded.empty() ? " was recorded" : " was simulated",
                        ": its latency cannot be compared."),
        recorded.empty() ? Light::yellow : Light::red);
  chain.median_error_percent = error_percent(of_recording.p50, of_simulation.p50);
  chain.p99_error_percent = error_percent(of_recording.p99, of_simulation.p99);
  chain.between_modes = std::abs(chain.median_error_percent) > kMedianError_percent &&
                        recorded.size() >= kFewestForMedian && middles_agree(recorded, simulated);
  if (doubted) return;
  const auto judge_error = [&](const char* quantile, double percent, double green, double simulated_value,
                               double recorded_value, std::size_t fewest) {
    judge(check, std::abs(percent), green,
          program::text("The %s of %s is %.1f ms simulated and %.1f ms recorded.", quantile, name.c_str(),
                        simulated_value, recorded_value),
          recorded.size() >= fewest);
  };
  if (!chain.between_modes)
    judge_error("median", chain.median_error_percent, kMedianError_percent, of_simulation.p50,
                of_recording.p50, kFewestForMedian);
  judge_error("p99", chain.p99_error_percent, kP99Error_percent, of_simulation.p99, of_recording.p99,
              kFewestForP99);
}

}  // namespace

SelfCheck self_check(const Graph& graph, const GraphTasks& tasks, const setup::ExecutorSpec& executor,
                     const Trace& recorded, const std::map<std::string, std::string>& doubted) {
  SelfCheck check;
  try {
    check.simulated = simulate_recorded(graph, tasks, executor, recorded);
  } catch (const SimulationError& error) {
    check.failure = error.what();
    check.doubt(program::concat("The simulation stops: ", check.failure, "."), Light::red);
    return check;
  }
  const Trace& simulated = check.simulated;
  check.schedule = validation::compare_schedules(results::schedule_of(tasks.set, recorded),
                                                 results::schedule_of(tasks.set, simulated));
  judge(check, 1 - check.schedule.similarity, 1 - kSimilarity,
        program::text("The order of jobs differs: %.3f similar.", check.schedule.similarity));
  const auto of_recording = results::counted_chains(recorded, Time{}),
             of_simulation = results::counted_chains(simulated, Time{});
  for (std::size_t c = 0; c < graph.chains.size(); ++c) {
    const std::string& name = graph.chains[c].name;
    compare_latencies(check, name, results::latencies_ms(of_recording, c, Latency::hot_path),
                      results::latencies_ms(of_simulation, c, Latency::hot_path), doubted.contains(name));
    if (doubted.contains(name)) check.doubt(doubted.at(name));
  }
  check.lost_recorded_percent = lost_percent(recorded);
  check.lost_simulated_percent = lost_percent(simulated);
  judge(check, std::abs(check.lost_recorded_percent - check.lost_simulated_percent), kLossError_points,
        program::text("Losses are %.2f %% of all timestamps and samples simulated and %.2f %% recorded.",
                      check.lost_simulated_percent, check.lost_recorded_percent));
  return check;
}

}  // namespace hotpath::imports
