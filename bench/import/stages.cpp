// SPDX-License-Identifier: Apache-2.0
#include "import/stages.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>

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

/// The executors that can have run these threads; with its name only the one as which they state themselves,
/// if hotpath knows it, with its levels.
std::pair<std::string, std::vector<Hypothesis>> possible_executors(const RecordedSystem& recorded,
                                                                   const RecordedGraph& graph,
                                                                   const RecordedExecutor& executor,
                                                                   const RecordedSteps& steps) {
  const tracing::System& system = recorded.system;
  const RosDistros releases = releases_of(system.rcl_version);
  for (const tracing::StatedExecutor& stated : system.stated_executors) {
    if (!executor.is(stated)) continue;
    try {
      const setup::ExecutorSpec spec = setup::parse_executor(stated.name, {});
      // It emits no waits; an executor of rclcpp may have waited on its thread before.
      std::vector<Hypothesis> possible = possible_hypotheses(steps, false, releases);
      std::erase_if(possible, [&](const Hypothesis& h) {
        return h.entry != spec.entry || h.options.rule != spec.scheduler.rule ||
               h.options.ties != spec.scheduler.ties;
      });
      if (possible.empty()) break;
      Hypothesis& only = possible.front();
      if (only.needs_levels()) only.levels.assign(graph.tasks.set.size(), kLast);
      for (const auto& [callback, level] : stated.levels)
        if (only.needs_levels() && graph.task_of[callback] != kNoTask)
          only.levels[graph.task_of[callback]] = level;
      return {stated.name, std::move(possible)};
    } catch (const program::UsageError&) {  // of a later version
    }
  }
  const bool waits =
      std::ranges::any_of(executor.threads, [&](std::uint32_t t) { return system.threads[t].waits > 0; });
  return {"", possible_hypotheses(steps, waits, releases)};
}

Interpretation interpret(const RecordedSystem& recorded, const CtfOptions& options,
                         const RecordedDeliveries& deliveries, const Shown& shown = {}) {
  const std::string name = std::filesystem::path(options.trace).lexically_normal().filename();
  RecordedGraph made = make_recorded_graph(recorded, name, shown);
  Graph& graph = made.graph;
  graph.delivery = delivery_of_graph(deliveries, made);
  const RosDistro release = releases_of(recorded.system.rcl_version).last;
  if (release < RosDistro::jazzy) graph.release = release;
  RecordedTimers timers = recorded_timers(recorded.system, made, recorded.jobs, recorded.end);
  set_phases(made, timers);
  for (const std::string& text : options.chains) graph.chains.push_back(chain_of(text, graph, made.tasks));
  if (options.chains.empty()) graph.chains = recorded_chains_of(graph, made.tasks);
  std::optional<Deployment> deployment;
  if (!options.deployment.empty()) deployment = find_deployment(options.deployment, graph, made.tasks);
  return {std::move(made), std::move(timers), std::move(deployment),
          std::filesystem::path(options.output) / "deployment.yaml"};
}

/// Compares the possible executors of each group of threads with its decisions, unless one describes itself.
std::vector<Recognition> recognise_executors(const RecordedSystem& recorded, const Interpretation& found) {
  const RecordedRows rows = recorded_rows(recorded, found.graph, found.timers, found.timers.released);
  const RecordedWindow window{recorded.jobs, rows.jobs};
  std::vector<Recognition> recognitions;
  for (const RecordedExecutor& executor : recorded.executors) {
    const RecordedSteps steps = recorded_steps(found.graph, window, recorded.lost, executor, kTried);
    const auto [name, possible] = possible_executors(recorded, found.graph, executor, steps);
    recognitions.push_back(recognise(recorded.system, found.graph, steps, possible, name));
  }
  return recognitions;
}

/// The executors under which a recording is reproduced, and what their fits say.
struct ChosenExecutors {
  std::vector<std::string> labels;  ///< By executor.
  std::vector<bool> given;          ///< By executor: the user named it.
  OrderEvidence order;
  std::map<std::uint32_t, std::int64_t> priorities;  ///< Of timers, by callback.
};

/// The score of the executor with this name; the number of threads may be missing.
auto place_of(const std::string& name, const std::vector<Score>& ranking) {
  return std::ranges::find_if(ranking, [&](const Score& s) {
    const ExecutorEntry& entry = *s.hypothesis.entry;
    return s.hypothesis.label == name || (entry.traits.many_workers && entry.name == name);
  });
}

/// `given`: the executors that the user named, each for the threads that it can have run; a single one that
/// can have run none, for all. `graph`: that of the recognitions. Throws UsageError.
ChosenExecutors choose_executors(const std::vector<Recognition>& recognitions, const RecordedGraph& graph,
                                 const std::vector<std::string>& given) {
  const auto can_be = [&](const std::string& name) {
    return std::ranges::any_of(
        recognitions, [&](const Recognition& r) { return place_of(name, r.ranking) < r.ranking.end(); });
  };
  const bool believed = given.size() == 1 && !can_be(given.front());
  for (const std::string& name : given)
    if (!believed && !can_be(name))
      throw program::UsageError(program::concat(
          "--executors ", name,
          ": no threads of the trace can be its own; without the option, import.md lists what can be"));
  ChosenExecutors chosen;
  for (const Recognition& recognition : recognitions) {
    auto score = recognition.ranking.end();
    for (const std::string& name : given) score = std::min(score, place_of(name, recognition.ranking));
    chosen.given.push_back(believed || score < recognition.ranking.end());
    if (!chosen.given.back()) score = recognition.ranking.begin();
    if (believed || score == recognition.ranking.end()) {
      chosen.labels.push_back(believed ? given.front() : std::string(kBaselineExecutor));
      continue;
    }
    const Hypothesis& hypothesis = score->hypothesis;
    chosen.labels.push_back(hypothesis.label);
    chosen.order.insert(score->evidence.begin(), score->evidence.end());
    if (hypothesis.entry->traits.policy != Policy::fp) continue;
    for (const TaskId id : graph.tasks.set.timers())
      if (graph.callback_of[id] != kNone && hypothesis.levels[id] != kLast)
        chosen.priorities[graph.callback_of[id]] = hypothesis.levels[id];
  }
  return chosen;
}

/// Sentences about what the executors show of the graph.
std::vector<std::string> fitted(const ChosenExecutors& chosen, const std::vector<Recognition>& recognitions) {
  std::vector<std::string> notes;
  if (!chosen.order.empty())
    notes.push_back(
        "Nodes and callbacks are in the order in which the executor served them, which is not that of "
        "their creation.");
  const auto is_stated = [](const Recognition& r) { return !r.stated.empty(); };
  if (!chosen.priorities.empty() && std::ranges::none_of(recognitions, is_stated))
    notes.push_back(
        "The priorities of timers in the graph are fitted to the order of jobs; only their order counts.");
  return notes;
}

/// What another reading changes in percent, and as the end of a sentence, of the chains that both have.
std::pair<double, std::string> effect_of(const Reproduction& best, const Reproduction& other) {
  std::string largest = ", without effect on any chain";
  double most = -1;
  for (const auto& chain : other.check.chains) {
    const auto& of_best = best.check.chains;
    const auto same = std::ranges::find(of_best, chain.chain, [](const auto& c) { return c.chain; });
    if (same == of_best.end()) continue;
    const double one = same->simulated_ms.p50, two = chain.simulated_ms.p50;
    const double percent = 100 * std::abs(two / one - 1);
    if (!(percent > most)) continue;
    most = percent;
    largest = program::text(", which %s: the median of %s is %.1f or %.1f ms",
                            percent > kMedianError_percent ? "matters" : "does not matter",
                            chain.chain.c_str(), one, two);
  }
  return {most, largest};
}

/// Notes what is open about services and about the graph, with what the other readings change in the chains;
/// those through services only exist in the first reading.
void add_readings(Imported& all, Shown shown) {
  const RecordedSystem& recorded = all.recorded;
  const Reproduction& best = all.best;
  std::vector<std::string>& open = all.remarks[Remark::open];
  CtfOptions plain = all.options;
  plain.chains.clear();  // which the other graph may not have
  const auto effect = [&](const RecordedSystem& of, const std::vector<Chain>& chains) {
    Interpretation other = interpret(of, plain, all.deliveries, shown);
    other.graph.graph.chains = chains;
    return effect_of(best, reproduce(of, other, best.labels));
  };
  std::vector<Chain> chains = best.graph.chains;
  std::erase_if(chains, [&](const Chain& chain) {
    return std::ranges::any_of(best.tasks.set.tasks, [&](const Task& task) {
      const bool called = task.entity == EntityKind::service || task.entity == EntityKind::client;
      return called && std::ranges::count(chain.nodes, task.name) > 0;
    });
  });
  for (std::size_t s = 0; s < recorded.open.size(); ++s) {
    const OpenService& service = recorded.open[s];
    std::pair<double, std::string> most{-2, ""};
    for (std::size_t c = 1; c < service.callers.size(); ++c)
      most = std::max(most, effect(recorded.with_caller(s, c), chains));
    open.push_back(program::concat("whether the requests to ", recorded.system.topics[service.topic].name,
                                   " come from ", program::joined(service.callers, ", or "), " (undecided)",
                                   most.second));
  }
  const std::vector<std::string>& what = all.remarks[Remark::undecided];
  if (what.empty()) return;
  shown.other = true;
  open.push_back(program::concat("whether ", what.front(),
                                 what.size() > 1 ? program::concat(", and ", what.size() - 1, " more") : "",
                                 effect(recorded, best.graph.chains).second));
}

/// What the recording leaves open about the executors that the user did not name, as phrases: none is known,
/// or it does not tell generations of one class of rclcpp.
std::vector<std::string> open_executors(const Imported& all) {
  std::vector<std::string> open;
  for (std::size_t e = 0; e < all.recognitions.size(); ++e) {
    if (all.given[e] || all.found.deployment) continue;
    const Recognition& recognition = all.recognitions[e];
    const std::string &name = all.recorded.executors[e].name, &label = all.best.labels[e];
    if (recognition.verdict == Verdict::undecided || recognition.verdict == Verdict::none_fits)
      open.push_back(program::concat("the executor of ", name, " (", to_string(recognition.verdict),
                                     ", simulated as ", label, ")"));
    const ExecutorEntry* const entry = setup::parse_executor(label, {}).entry;
    std::string which = program::concat("whether ", name, " is ", label);
    std::pair<double, std::string> most{-2, ""};
    for (const Score& score : std::span(recognition.ranking).first(recognition.leading)) {
      const Hypothesis& other = score.hypothesis;
      if (other.entry == entry || !are_of_one_design(*other.entry, *entry)) continue;
      std::vector<std::string> labels = all.best.labels;
      labels[e] = other.label;
      most = std::max(most, effect_of(all.best, reproduce(all.recorded, all.found, labels)));
      which += program::concat(" or ", other.label, " (--executors ", other.label, ")");
    }
    if (!most.second.empty()) open.push_back(which + most.second);
  }
  return open;
}

}  // namespace

Imported import_system(RecordedSystem recorded, const CtfOptions& options) {
  Imported all;
  all.recorded = std::move(recorded);
  all.options = options;
  all.deliveries = created_deliveries(all.recorded.system);
  all.found = interpret(all.recorded, options, all.deliveries);
  if (all.recorded.executors.empty())
    throw program::UsageError("the trace shows no executor: record it from the start of the nodes on");
  all.recognitions = recognise_executors(all.recorded, all.found);
  const ChosenExecutors chosen = choose_executors(all.recognitions, all.found.graph, options.executors);
  all.given = chosen.given;
  const Family family = setup::parse_executor(chosen.labels.front(), {}).entry->traits.family;
  const bool more =
      add_started_deliveries(all.deliveries, all.recorded.jobs, family, all.recorded.executor_of);
  Shown shown{{}, chosen.priorities};
  if (!chosen.order.empty()) shown.order = service_order(all.recorded.system, all.found.graph, chosen.order);
  if (more || !chosen.order.empty() || !chosen.priorities.empty())
    all.found = interpret(all.recorded, options, all.deliveries, shown);
  all.best = reproduce(all.recorded, all.found, chosen.labels);
  all.remarks = all.found.graph.remarks;
  all.remarks[Remark::fitted] = fitted(chosen, all.recognitions);
  all.remarks[Remark::delivery] = delivery_notes(all.recorded.system, all.deliveries);
  all.remarks[Remark::unmodelled] = unmodelled(all.recorded.system, all.found.graph);
  all.remarks[Remark::open] = open_executors(all);
  SelfCheck& check = all.best.check;
  for (std::size_t e = 0; e < all.recognitions.size(); ++e)
    if (!chosen.given[e] && all.recognitions[e].verdict == Verdict::none_fits)
      check.doubt(program::concat(all.recorded.executors[e].name,
                                  " is left out of the recognition, and simulated as ", chosen.labels[e],
                                  ". ", sentence(all.recognitions[e])));
  add_readings(all, shown);
  if (all.best.slices.unexplained > 0) check.doubt(unexplained_sentence(all.best.slices));
  if (all.best.slices.threads > 0)
    all.remarks[Remark::unmodelled].push_back(sentence(all.best.slices, all.found.graph.epoch));
  if (check.light != Light::green)  // they may explain a deviation
    std::ranges::copy(all.remarks[Remark::unmodelled], std::back_inserter(check.reasons));
  return all;
}

}  // namespace hotpath::imports
