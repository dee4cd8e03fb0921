// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "advise/advice.hpp"
#include "advise/objective.hpp"
#include "setup/utilisation.hpp"

namespace hotpath::advise {

/// An executor or a deployment that could run the graph.
struct Candidate {
  std::string name;
  std::string description;
  Graph graph;  ///< With the candidate's platform costs and priorities.
  setup::ExecutorSpec spec;
  bool sets_priorities = false;  ///< `graph` has other priorities than the user's graph.
  GraphTasks tasks = {};         ///< Of `graph`.
  setup::Utilisation load = {};

  /// The name of its executor for --executors and in files, unless it is a deployment.
  [[nodiscard]] std::string executor() const {
    return sets_priorities && spec.entry != nullptr ? std::string(spec.entry->name) : name;
  }
};

/// The candidates that suit the graph, or those of --executors and --deployments, and the current one:
/// - every executor of the registry, except fixed priorities without priorities in the graph, and
///   deadline monotonic without deadlines other than the periods; several threads only if there are
///   cores for them;
/// - every deployment preset;
/// - for the objective's chain, if there is one: fixed priorities with the chain's timers first
///   (`fp-ro:chain`), a thread above all others for the chain's callback groups (`chain-first`),
///   and a thread for each callback group with those of the chain above the others (`cie:chain`).
/// If the current deployment has several processes, an executor replaces each of its executors
/// (`each:NAME`), and `chain-first` is left out.
/// Throws UsageError, InputError.
[[nodiscard]] std::vector<Candidate> make_candidates(const Graph& graph, const Objective& objective,
                                                     const Options& options);

/// The candidate with another graph of the same tasks: updates tasks and load.
[[nodiscard]] Candidate with_graph(Candidate candidate, Graph graph);

/// What `hotpath advise` is asked, and where the answer goes.
struct Question {
  /// A graph without chains gets those that are found, which are printed. Notes an overload and
  /// Objective::note. Throws
  /// UsageError, InputError.
  explicit Question(const Options& options);

  /// Throws UsageError, InputError, also if the folder cannot be written.
  [[nodiscard]] std::vector<Candidate> candidates_to_compare() const;
  /// The system's current executor or deployment.
  [[nodiscard]] const Candidate& current(const std::vector<Candidate>& candidates) const;
  /// Names the folder, and prints the content for --json. Throws RunError.
  void finish(const nlohmann::json& content) const;

  const Options options;
  const Graph graph;
  const GraphTasks tasks;
  const Objective objective;
  const std::filesystem::path folder;  ///< New or empty; created by whoever writes first.
};

}  // namespace hotpath::advise
