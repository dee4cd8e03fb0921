// SPDX-License-Identifier: Apache-2.0
#include "advise/prediction.hpp"

#include <chrono>
#include <utility>

#include "hotpath/core/simulator.hpp"
#include "program/interrupt.hpp"
#include "program/parallel.hpp"
#include "program/text.hpp"
#include "setup/deployed_system.hpp"
#include "simulated/repetition.hpp"
#include "simulated/run_totals.hpp"

namespace hotpath::advise {

namespace {

/// One candidate in one draw.
struct Drawn {
  results::Repetition repetition;
  std::unique_ptr<simulated::RunTotals> totals;
  Duration work{};
  std::string overload;
};

/// Sums the execution times of the jobs that ran.
Duration work_of(const Trace& trace, const ExecutionTimes& times) {
  Duration sum{};
  for (const JobRecord& r : trace.jobs) {
    // A job that waits for others of its set takes no time.
    if (r.outcome == Outcome::ran && r.finish > r.start) sum += times.of(r.job);
  }
  return sum;
}

class Draws {
 public:
  Draws(const std::vector<Candidate>& candidates, const PredictionOptions& options)
      : options_(options), predictions_(candidates.size()), totals_(candidates.size()) {
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      predictions_[c].candidate = &candidates[c];
      predictions_[c].overload = candidates[c].overload;
    }
  }

  std::vector<Prediction> run(const std::function<void(std::uint32_t)>& progress) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point begin = Clock::now();
    for (std::uint32_t d = 0; d < options_.draws; ++d) {
      if (d > 0 && (Clock::now() - begin > options_.budget || program::interrupted() != 0)) break;
      draw(d);
      progress(d + 1);
    }
    for (std::size_t c = 0; c < predictions_.size(); ++c) summarise(c);
    return std::move(predictions_);
  }

 private:
  /// Simulates all candidates in parallel; the result does not depend on the assignment to threads.
  void draw(std::uint32_t d) {
    std::vector<Drawn> drawn(predictions_.size());
    program::for_each_index(predictions_.size(), options_.threads, [&](std::size_t c) {
      if (predictions_[c].overload.empty()) drawn[c] = simulate(*predictions_[c].candidate, d);
    });
    for (std::size_t c = 0; c < drawn.size(); ++c) {
      Prediction& p = predictions_[c];
      if (p.overload.empty()) p.overload = drawn[c].overload;
      if (!p.overload.empty()) continue;
      p.cores_used += to_ms(drawn[c].work);
      p.draws.push_back(std::move(drawn[c].repetition));
      totals_[c].push_back(std::move(drawn[c]));
    }
  }

  Drawn simulate(const Candidate& candidate, std::uint32_t d) const {
    Drawn drawn;
    SimulatedDraw simulated;
    try {
      simulated = simulate_draw(candidate, options_.common, d);
    } catch (const SimulationError& error) {
      drawn.overload = error.what();
      return drawn;
    }
    drawn.repetition = std::move(simulated.repetition);
    Trace& trace = drawn.repetition.trace;
    trace.repetition = d;
    drawn.totals = std::make_unique<simulated::RunTotals>(
        candidate.graph, candidate.tasks, setup::measured_chains(candidate.graph, candidate.tasks),
        Time{} + setup::seconds(options_.common.warm_up_s), trace.end);
    for (const JobRecord& r : trace.jobs) drawn.totals->ended(r);
    drawn.work = work_of(trace, *simulated.times);
    std::exchange(trace.jobs, {});  // frees the memory; chain records and totals remain
    return drawn;
  }

  void summarise(std::size_t c) {
    Prediction& p = predictions_[c];
    if (!p.overload.empty()) return;
    const Candidate& candidate = *p.candidate;
    p.cores_used /=
        1e3 * static_cast<double>(p.draws.size()) * (options_.common.warm_up_s + options_.common.duration_s);
    std::vector<results::ExecutorRuns> runs(1);
    runs.front().executor = candidate.name;
    runs.front().repetitions = p.draws;
    results::Summary summary = results::summarize(candidate.tasks.set, runs,
                                                  setup::summary_options(options_.common, candidate.graph));
    p.summary = std::move(summary.executors.front());
    for (std::size_t d = 0; d < totals_[c].size(); ++d) totals_[c][d].totals->add_to(p.summary, d);
  }

  const PredictionOptions& options_;
  std::vector<Prediction> predictions_;
  std::vector<std::vector<Drawn>> totals_;  // by candidate
};

}  // namespace

SimulatedDraw simulate_draw(const Candidate& candidate, const setup::CommonOptions& o, std::uint32_t d) {
  SimulatedDraw drawn{
      candidate.tasks, simulated::execution_times_of(candidate.graph, candidate.tasks, o.seed + d), {}};
  set_delivery(with_drawn_deliveries(candidate.graph, o.seed + d), drawn.tasks);
  setup::set_phases(drawn.tasks.set,
                    setup::phases_of_repetition(o, candidate.graph, candidate.tasks, candidate.spec, d));
  const std::vector<results::MeasuredChain> chains = setup::measured_chains(candidate.graph, candidate.tasks);
  simulated::Plan plan{candidate.spec, candidate.graph, drawn.tasks, chains, *drawn.times};
  plan.warm_up = setup::seconds(o.warm_up_s);
  plan.duration = setup::seconds(o.duration_s);
  drawn.repetition = simulated::simulate_repetition(plan);
  return drawn;
}

std::vector<Prediction> predict(const std::vector<Candidate>& candidates, const PredictionOptions& options,
                                const std::function<void(std::uint32_t)>& progress) {
  return Draws(candidates, options).run(progress);
}

void add_bound(Prediction& prediction, const Objective& objective) {
  const Candidate& candidate = *prediction.candidate;
  if (candidate.graph.chains.empty()) return;
  const auto all = setup::guarantees(candidate.graph, candidate.tasks, candidate.spec);
  if (!all) return;
  const bounds::ChainGuarantee* chain = all->chain(candidate.graph.chains[objective.chain].name);
  if (chain == nullptr) return;
  const auto& bound = objective.of_hot_path() ? chain->hot_path : chain->age;
  if (!bound) return;
  prediction.bound_ms = to_ms(Duration(bound->ns));
  prediction.bound_method = bound->method;
}

RepeatedSamples latencies_of(const Prediction& prediction, const Objective& objective) {
  std::vector<std::vector<double>> by_draw;
  for (const results::Repetition& draw : prediction.draws) {
    std::vector<double>& samples = by_draw.emplace_back();
    for (const ChainRecord& r : draw.trace.chains) {
      if (r.chain != objective.chain) continue;
      samples.push_back(to_ms(objective.of_hot_path() ? r.hot_path_latency : r.end_to_end_latency));
    }
  }
  return RepeatedSamples(std::move(by_draw));
}

}  // namespace hotpath::advise
