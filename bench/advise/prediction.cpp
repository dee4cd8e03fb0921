// SPDX-License-Identifier: Apache-2.0
#include "advise/prediction.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include "hotpath/analysis/parallel.hpp"
#include "hotpath/core/simulator.hpp"
#include "program/interrupt.hpp"
#include "program/progress.hpp"
#include "program/text.hpp"
#include "results/measures.hpp"
#include "setup/deployed_system.hpp"
#include "simulated/repetition.hpp"

namespace hotpath::advise {

namespace {

/// Simulates one more draw. Throws SimulationError if the candidate cannot keep up.
void add_draw(Prediction& p, const setup::CommonOptions& options, std::uint32_t d) {
  const Candidate& candidate = *p.candidate;
  SimulatedDraw drawn = simulate_draw(candidate, options, d);
  Trace& trace = drawn.repetition.trace;
  trace.repetition = d;
  results::JobMeasures measures(candidate.tasks.set, Time{} + from_s(options.warm_up_s), trace.end, false);
  Duration work{};
  for (const JobRecord& r : trace.jobs) {
    measures.add(r);
    // A job that waits for others of its set takes no time.
    if (r.outcome == Outcome::ran && r.finish > r.start) work += drawn.times->of(r.job);
  }
  p.cores_used += to_ms(work);
  std::exchange(trace.jobs, {});  // frees the memory; chain records and measures remain
  drawn.repetition.measures = measures.result();
  p.draws.push_back(std::move(drawn.repetition));
}

void summarise(Prediction& p, const setup::CommonOptions& options) {
  p.cores_used /= 1e3 * static_cast<double>(p.draws.size()) * (options.warm_up_s + options.duration_s);
  const Candidate& candidate = *p.candidate;
  p.summary = std::move(results::summarize(candidate.tasks.set, {{candidate.name, p.draws}},
                                           setup::summary_options(options, candidate.graph))
                            .executors.front());
  const std::vector<double> intended = setup::intended_losses(candidate.graph, candidate.tasks);
  for (TaskId id = 0; id < intended.size(); ++id) {
    const TaskAccount& account = p.summary.tasks[id].account;
    const double samples = intended[id] * static_cast<double>(account.accounted());
    p.summary.overwritten -= std::min(account[Outcome::overwritten], static_cast<std::uint64_t>(samples));
  }
}

/// The latencies of the objective's chain in ms by draw.
RepeatedSamples latencies_of(const Prediction& prediction, const Objective& objective) {
  std::vector<std::vector<double>> by_draw;
  for (const results::Repetition& draw : prediction.draws)
    by_draw.push_back(results::latencies_ms(draw.trace.chains, objective.chain, objective.latency));
  return RepeatedSamples(std::move(by_draw));
}

/// Adds the tightest bound of the objective's chain, if a method covers the candidate; with several threads
/// and known phases its exact worst case.
void add_bounds(Prediction& prediction, const Objective& objective, const setup::CommonOptions& options) {
  const Candidate& candidate = *prediction.candidate;
  if (candidate.graph.chains.empty()) return;
  const auto all =
      setup::guarantees(candidate.graph, candidate.tasks, candidate.spec, &options, &prediction.refusal);
  const auto bound_of = [&](std::size_t c) {
    return all ? all->of(objective.latency, candidate.graph.chains[c].name) : std::nullopt;
  };
  prediction.bound = bound_of(objective.chain);
  prediction.proven = !objective.requirements.empty() &&
                      std::ranges::all_of(objective.requirements, [&](const Objective::Requirement& r) {
                        const auto bound = bound_of(r.chain);
                        return bound && to_ms(Duration(bound->ns)) <= r.most_ms;
                      });
}

}  // namespace

SimulatedDraw simulate_draw(const Candidate& candidate, const setup::CommonOptions& o, std::uint32_t d) {
  SimulatedDraw drawn{
      candidate.tasks, simulated::execution_times_of(candidate.graph, candidate.tasks, o.seed + d), {}};
  set_delivery(with_drawn_deliveries(candidate.graph, o.seed + d), drawn.tasks);
  setup::set_phases(drawn.tasks.set,
                    setup::phases_of_repetition(o, candidate.graph, candidate.tasks, candidate.spec, d));
  simulated::Plan plan{candidate.spec, candidate.graph, drawn.tasks, *drawn.times};
  plan.warm_up = from_s(o.warm_up_s);
  plan.duration = from_s(o.duration_s);
  drawn.repetition = simulated::simulate_repetition(plan);
  return drawn;
}

std::vector<Prediction> predict(const std::vector<Candidate>& candidates, const Options& options,
                                const Objective& objective, const std::string& title) {
  const Duration budget = from_s(options.budget_s);
  program::Progress progress(1, budget);
  progress.begin(title);
  const auto begin = std::chrono::steady_clock::now();
  const auto elapsed = [&] { return std::chrono::steady_clock::now() - begin; };
  std::vector<Prediction> predictions(candidates.size());
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    predictions[c].candidate = &candidates[c];
    predictions[c].overload = candidates[c].load.overload;
  }
  for (std::uint32_t d = 0;
       d < options.draws && (d == 0 || (elapsed() <= budget && program::interrupted() == 0)); ++d) {
    for_each_index(candidates.size(), options.threads, [&](std::size_t c) {
      Prediction& p = predictions[c];
      try {
        if (p.keeps_up()) add_draw(p, options, d);
      } catch (const SimulationError& error) {
        p.overload = error.what();
      }
    });
    progress.update(elapsed(), budget);
  }
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    if (!predictions[c].keeps_up()) continue;
    summarise(predictions[c], options);
    add_bounds(predictions[c], objective, options);
  }
  std::ranges::stable_sort(predictions, [&](const Prediction& a, const Prediction& b) {
    if (!a.keeps_up() || !b.keeps_up()) return a.keeps_up() && !b.keeps_up();
    if (a.proven != b.proven) return a.proven;
    return score(objective, a.summary) < score(objective, b.summary);
  });
  return predictions;
}

std::optional<bool> differs(const Objective& objective, const Prediction& a, const Prediction& b) {
  if (objective.kind != Objective::Kind::latency) return std::nullopt;
  const Estimate difference =
      difference_of_quantiles(latencies_of(a, objective), latencies_of(b, objective),
                              traits_of(objective.statistic).probability, {.pairs = true});
  return difference.interval ? std::optional(difference.excludes(0)) : std::nullopt;
}

std::string timer_beside_group(const Candidate& candidate) {
  const TaskSet& set = candidate.tasks.set;
  const auto runs_timers = [&](TaskId id) {
    const setup::ExecutorSpec& part = setup::parts(candidate.spec)[executor_of(candidate.spec, id)];
    return part.entry->traits.timers == TimerHandling::release_and_execute;
  };
  std::set<std::uint32_t> with_subscriptions;
  for (const Task& task : set.tasks) {
    const bool exclusive = set.groups[task.group] == CallbackGroup::mutually_exclusive;
    if (exclusive && task.kind == TaskKind::subscription) with_subscriptions.insert(task.group);
  }
  for (const TaskId id : set.timers())
    if (with_subscriptions.contains(set[id].group) && runs_timers(id)) return set[id].name;
  return "";
}

bool can_be_written(const Candidate& candidate) {
  if (candidate.spec.entry) return true;
  try {
    (void)deployment_yaml(candidate.graph, candidate.tasks, candidate.spec.plan);
    return true;
  } catch (const std::invalid_argument&) {
    return false;
  }
}

std::optional<std::string> refusal(const Prediction& p, const Prediction& now) {
  constexpr double kMoreLosses_percent = 1;
  if (p.summary.never_ran() > 0) return "a task never runs";
  if (!results::starved(p.summary).empty()) return "a task starves";
  const double most = now.keeps_up() ? now.summary.lost_percent() + kMoreLosses_percent : INFINITY;
  if (p.summary.lost_percent() > most) return "it loses more than today";
  if (!timer_beside_group(*p.candidate).empty()) return "";
  if (!can_be_written(*p.candidate)) return "it splits callback groups";
  return std::nullopt;
}

const Prediction* recommended(const std::vector<Prediction>& ranked, const Prediction& now,
                              const Objective& objective) {
  const auto suits = [&](const Prediction& p) { return p.keeps_up() && !refusal(p, now); };
  const auto best = std::ranges::find_if(ranked, suits);
  if (best == ranked.end()) return nullptr;
  const bool same = now.proven || differs(objective, *best, now) == false ||
                    (now.keeps_up() && value_text(objective, *best) == value_text(objective, now));
  return suits(now) && same ? &now : &*best;
}

std::string value_text(const Objective& objective, const Prediction& p) {
  using program::concat, program::fixed;
  const auto [value, late, tie] = score(objective, p.summary);
  if (objective.kind == Objective::Kind::losses) return fixed(value, 2) + " %";
  if (objective.kind == Objective::Kind::requirements) {
    return value > 0 ? "missed by " + fixed(value, 1) + " % in all"
                     : concat(fixed(100 * (1 - tie), 0), " % below its limit (",
                              p.proven ? "proven)" : "only simulated)");
  }
  return std::isfinite(value) ? fixed(value, 1) + " ms" : "no value";
}

}  // namespace hotpath::advise
