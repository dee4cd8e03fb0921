// SPDX-License-Identifier: Apache-2.0
#include "import/stages.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <tuple>

#include "program/errors.hpp"
#include "program/text.hpp"
#include "setup/run_setup.hpp"

namespace hotpath::imports {

namespace {

/// Counts the phases of timers from the epoch; those of the node `outside` become timestamps.
void set_phases(RecordedGraph& graph, RecordedTimers& timers) {
  for (TaskId id = 0; id < graph.callback_of.size(); ++id) {
    Callback& callback = graph.callback(id);
    if (callback.input) continue;
    const bool recorded = graph.callback_of[id] != kNone;
    Duration phase = (recorded ? timers.first[id] : Time{} + *callback.phase) - graph.epoch;
    if (phase < Duration::zero()) phase -= ((phase + Duration(1)) / callback.period - 1) * callback.period;
    callback.phase = phase;
    if (!recorded) timers.first[id] = graph.epoch + phase;
  }
  graph.tasks = make_tasks(graph.graph);
}

/// The name that an executor gives itself, if hotpath knows it, and its hypothesis, with its levels.
std::pair<std::string, std::vector<Hypothesis>> stated_executor(const RecordedSystem& recorded,
                                                                const RecordedGraph& graph,
                                                                const RecordedExecutor& executor,
                                                                const RecordedSteps& steps) {
  for (const tracing::StatedExecutor& stated : recorded.system.stated_executors) {
    if (!executor.is(stated)) continue;
    try {
      const setup::ExecutorSpec spec = setup::parse_executor(stated.name, {});
      // It emits no waits; an executor of rclcpp may have waited on its thread before.
      std::vector<Hypothesis> possible = possible_hypotheses(steps, false, recorded.system.rcl_version);
      std::erase_if(possible, [&](const Hypothesis& h) {
        return h.entry != spec.entry || h.options.rule != spec.scheduler.rule ||
               h.options.ties != spec.scheduler.ties;
      });
      for (Hypothesis& hypothesis : possible) {
        if (!hypothesis.needs_levels()) continue;
        hypothesis.levels.assign(graph.tasks.set.size(), kLast);
        for (const auto& [callback, level] : stated.levels)
          if (graph.task_of[callback] != kNoTask) hypothesis.levels[graph.task_of[callback]] = level;
      }
      return {stated.name, std::move(possible)};
    } catch (const program::UsageError&) {  // of a later version
    }
  }
  return {};
}

Interpretation interpret(const RecordedSystem& recorded, const CtfOptions& options,
                         const RecordedDeliveries& deliveries, const Shown& shown = {}) {
  const std::string name = std::filesystem::path(options.trace).lexically_normal().filename();
  RecordedGraph made = make_recorded_graph(recorded, name, shown);
  Graph& graph = made.graph;
  graph.delivery = delivery_of_graph(deliveries, made);
  RecordedTimers timers = recorded_timers(recorded.system, made, recorded.jobs, recorded.end);
  set_phases(made, timers);
  for (const std::string& text : options.chains) graph.chains.push_back(chain_of(text, graph, made.tasks));
  if (options.chains.empty()) graph.chains = recorded_chains_of(graph, made.tasks);
  std::optional<Deployment> deployment;
  if (!options.deployment.empty()) deployment = find_deployment(options.deployment, graph, made.tasks);
  return {std::move(made), std::move(timers), std::move(deployment)};
}

/// Compares the possible executors of each group of threads with its decisions, unless one describes itself.
std::vector<Recognition> recognise_executors(const RecordedSystem& recorded, const Interpretation& found) {
  const tracing::System& system = recorded.system;
  const RecordedRows rows = recorded_rows(recorded, found.graph, found.timers, found.timers.released);
  const RecordedWindow window{recorded.jobs, rows.jobs};
  std::vector<Recognition> recognitions;
  for (const RecordedExecutor& executor : recorded.executors) {
    const RecordedSteps steps = recorded_steps(found.graph, window, recorded.lost, executor, kTried);
    const bool waits =
        std::ranges::any_of(executor.threads, [&](std::uint32_t t) { return system.threads[t].waits > 0; });
    auto [name, possible] = stated_executor(recorded, found.graph, executor, steps);
    if (possible.size() != 1) name.clear();
    if (possible.empty()) possible = possible_hypotheses(steps, waits, system.rcl_version);
    recognitions.push_back(recognise(system, found.graph, steps, possible, name));
  }
  return recognitions;
}

/// The executors under which a recording is reproduced, and what their fits say.
struct ChosenExecutors {
  std::vector<std::string> labels;  ///< By executor.
  OrderEvidence order;
  std::map<std::uint32_t, std::int64_t> priorities;  ///< Of timers, by callback.
};

/// `given`: the executor that the user named, or empty. `graph`: that of the recognitions.
ChosenExecutors choose_executors(const std::vector<Recognition>& recognitions, const RecordedGraph& graph,
                                 const std::string& given) {
  ChosenExecutors chosen;
  for (const Recognition& recognition : recognitions) {
    const auto is_it = [&](const Score& s) { return given.empty() || s.hypothesis.label == given; };
    const auto score = std::ranges::find_if(recognition.ranking, is_it);
    if (score == recognition.ranking.end()) {
      chosen.labels.push_back(given.empty() ? std::string(kBaselineExecutor) : given);
      continue;
    }
    const Hypothesis& hypothesis = score->hypothesis;
    chosen.labels.push_back(hypothesis.label);
    chosen.order.insert(score->evidence.begin(), score->evidence.end());
    if (hypothesis.entry->traits.policy != Policy::fp) continue;
    for (TaskId id = 0; id < graph.tasks.set.size(); ++id)
      if (graph.callback_of[id] != kNone && graph.tasks.set[id].kind == TaskKind::timer &&
          hypothesis.levels[id] != kLast)
        chosen.priorities[graph.callback_of[id]] = hypothesis.levels[id];
  }
  return chosen;
}

/// Sentences about the graph, its order and what a trace does not show.
std::vector<std::string> notes_of(const RecordedSystem& recorded, const RecordedGraph& graph,
                                  const ChosenExecutors& chosen, const std::vector<Recognition>& recognitions,
                                  const RecordedDeliveries& deliveries) {
  std::vector<std::string> notes = graph.notes;
  if (!chosen.order.empty())
    notes.push_back(
        "Nodes and callbacks are in the order in which the executor served them, which is not that of "
        "their creation.");
  const auto is_stated = [](const Recognition& r) { return !r.stated.empty(); };
  if (!chosen.priorities.empty() && std::ranges::none_of(recognitions, is_stated))
    notes.push_back(
        "The priorities of timers in the graph are fitted to the order of jobs; only their order counts.");
  for (const auto* more : {&graph.missing, &recorded.notes})
    std::ranges::copy(*more, std::back_inserter(notes));
  std::ranges::copy(delivery_notes(recorded.system, deliveries), std::back_inserter(notes));
  return notes;
}

/// What another reading changes, as the end of a sentence. Both have the same chains.
std::string effect_of(const Reproduction& best, const Reproduction& other) {
  std::string largest = ", without effect on any chain";
  double most = -1;
  for (std::size_t i = 0; i < std::min(best.check.chains.size(), other.check.chains.size()); ++i) {
    const double one = best.check.chains[i].simulated_ms.p50, two = other.check.chains[i].simulated_ms.p50;
    const double percent = 100 * std::abs(two / one - 1);
    if (!(percent > most)) continue;
    most = percent;
    largest = program::text(", which %s: the median of %s is %.1f or %.1f ms",
                            percent > kMedianError_percent ? "matters" : "does not matter",
                            best.check.chains[i].chain.c_str(), one, two);
  }
  return largest;
}

}  // namespace

Imported import_system(RecordedSystem recorded, const CtfOptions& options) {
  const RecordedDeliveries created = created_deliveries(recorded.system);
  Interpretation first = interpret(recorded, options, created);
  if (recorded.executors.empty())
    throw program::UsageError("the trace shows no executor: record it from the start of the nodes on");
  std::vector<Recognition> recognitions = recognise_executors(recorded, first);
  const ChosenExecutors chosen = choose_executors(recognitions, first.graph, options.executor);
  const Family family = setup::parse_executor(chosen.labels.front(), {}).entry->traits.family;
  auto [deliveries, more] = with_started_deliveries(created, recorded.jobs, family, recorded.executor_of);
  Shown shown{{}, chosen.priorities};
  if (!chosen.order.empty()) shown.order = service_order(recorded.system, first.graph, chosen.order);
  const bool rearranged = more || !chosen.order.empty() || !chosen.priorities.empty();
  Interpretation found = rearranged ? interpret(recorded, options, deliveries, shown) : first;
  const std::string deployment_file = std::filesystem::path(options.output) / "deployment.yaml";
  Reproduction best = reproduce(recorded, found, chosen.labels, deployment_file);
  std::vector<std::string> uncertain, missing = unmodelled(recorded.system, found.graph);
  for (std::size_t e = 0; e < recognitions.size(); ++e) {
    const auto& [verdict, name] = std::tie(recognitions[e].verdict, recorded.executors[e].name);
    if (!options.executor.empty() || (verdict != Verdict::undecided && verdict != Verdict::none_fits))
      continue;
    uncertain.push_back(program::concat("the executor of ", name, " (", to_string(verdict), ", simulated as ",
                                        chosen.labels[e], ")"));
    if (verdict == Verdict::none_fits)
      best.check.doubt(program::concat(name, " is left out of the recognition, and simulated as ",
                                       chosen.labels[e], ". ", sentence(recognitions[e])));
  }
  if (const std::vector<std::string>& what = found.graph.undecided; !what.empty()) {
    shown.other = true;
    CtfOptions plain = options;
    plain.chains.clear();  // which the other graph may not have
    Interpretation other = interpret(recorded, plain, deliveries, shown);
    other.graph.graph.chains = found.graph.graph.chains;
    uncertain.push_back(program::concat(
        "whether ", what.front(), what.size() > 1 ? program::concat(", and ", what.size() - 1, " more") : "",
        effect_of(best, reproduce(recorded, other, chosen.labels, deployment_file))));
  }
  for (const std::string& chain : synchronised_chains(recorded, found.graph)) best.check.doubt(chain);
  if (best.slices.unexplained > 0) best.check.doubt(unexplained_sentence(best.slices));
  if (best.slices.threads > 0) missing.push_back(sentence(best.slices, found.graph.epoch));
  std::vector<std::string> notes = notes_of(recorded, found.graph, chosen, recognitions, deliveries);
  if (shown.other) notes.push_back(program::concat("Uncertain: ", uncertain.back(), "."));
  // They explain a deviation; of a green reproduction they are remarks.
  std::ranges::copy(missing,
                    std::back_inserter(best.check.light == Light::green ? notes : best.check.reasons));
  std::ranges::move(missing, std::back_inserter(found.graph.missing));
  return {std::move(recorded), std::move(recognitions), std::move(deliveries), std::move(found),
          std::move(best),     std::move(notes),        std::move(uncertain)};
}

}  // namespace hotpath::imports
