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

/// Sums the execution times of the jobs that ran.
Duration work_of(const Trace& trace, const ExecutionTimes& times) {
  Duration sum{};
  for (const JobRecord& r : trace.jobs) {
    // A job that waits for others of its set takes no time.
    if (r.outcome == Outcome::ran && r.finish > r.start) sum += times.of(r.job);
  }
  return sum;
}

using Totals = std::vector<std::unique_ptr<simulated::RunTotals>>;  // by draw

/// Simulates one more draw. Throws SimulationError if the candidate cannot keep up.
void add_draw(Prediction& p, Totals& totals, const setup::CommonOptions& options, std::uint32_t d) {
  const Candidate& candidate = *p.candidate;
  SimulatedDraw drawn = simulate_draw(candidate, options, d);
  Trace& trace = drawn.repetition.trace;
  trace.repetition = d;
  totals.push_back(std::make_unique<simulated::RunTotals>(
      candidate.graph, candidate.tasks, setup::measured_chains(candidate.graph, candidate.tasks),
      Time{} + setup::seconds(options.warm_up_s), trace.end));
  for (const JobRecord& r : trace.jobs) totals.back()->ended(r);
  p.cores_used += to_ms(work_of(trace, *drawn.times));
  std::exchange(trace.jobs, {});  // frees the memory; chain records and totals remain
  p.draws.push_back(std::move(drawn.repetition));
}

void summarise(Prediction& p, const Totals& totals, const setup::CommonOptions& options) {
  p.cores_used /= 1e3 * static_cast<double>(p.draws.size()) * (options.warm_up_s + options.duration_s);
  std::vector<results::ExecutorRuns> runs(1);
  runs.front().executor = p.candidate->name;
  runs.front().repetitions = p.draws;
  results::Summary summary =
      results::summarize(p.candidate->tasks.set, runs, setup::summary_options(options, p.candidate->graph));
  p.summary = std::move(summary.executors.front());
  for (std::size_t d = 0; d < totals.size(); ++d) totals[d]->add_to(p.summary, d);
}

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
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  std::vector<Prediction> predictions(candidates.size());
  std::vector<Totals> totals(candidates.size());
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    predictions[c].candidate = &candidates[c];
    predictions[c].overload = candidates[c].overload;
  }
  for (std::uint32_t d = 0; d < options.draws; ++d) {
    if (d > 0 && (Clock::now() - begin > options.budget || program::interrupted() != 0)) break;
    program::for_each_index(candidates.size(), options.threads, [&](std::size_t c) {
      Prediction& p = predictions[c];
      try {
        if (p.overload.empty()) add_draw(p, totals[c], options.common, d);
      } catch (const SimulationError& error) {
        p.overload = error.what();
      }
    });
    progress(d + 1);
  }
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    if (predictions[c].overload.empty()) summarise(predictions[c], totals[c], options.common);
  }
  return predictions;
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
