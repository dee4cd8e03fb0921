// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <compare>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "advise/advice.hpp"
#include "hotpath/reference_system/graph.hpp"
#include "results/measures.hpp"
#include "results/summary.hpp"
#include "setup/utilisation.hpp"

namespace hotpath::advise {

/// The quantity that `hotpath advise --for` minimises.
struct Objective {
  enum class Kind : std::uint8_t { latency, worst_lateness, losses, requirements };
  /// A limit of the age of a chain's data.
  struct Requirement {
    std::size_t chain = 0;  ///< Index into the graph's chains.
    double most_ms = 0;     ///< > 0.
  };

  Kind kind = Kind::latency;
  results::Judged statistic = results::kP99;  ///< latency.
  Latency latency = Latency::age;             ///< Of or beside latencies: of the chain.
  std::size_t chain = 0;                      ///< latency: index into the graph's chains.
  std::vector<Requirement> requirements = {};
  std::string text = {};  ///< In words, such as `age of the data of hot_path (p99)`.
  std::string note = {};  ///< What was meant instead of what was asked; empty: nothing else.

  [[nodiscard]] bool of_age() const { return latency == Latency::age; }
  /// Whether it is about worst cases of latencies or response times, which theory can guarantee.
  [[nodiscard]] bool of_worst_cases() const {
    return kind == Kind::latency ? statistic == results::kWorst : kind != Kind::losses;
  }
};

/// Parses `CHAIN:age:p99` (also median, worst; `CHAIN:age`: `usual`) of the age, `CHAIN:p99` of the hot-path
/// latency, a list of `CHAIN<MS` with commas, `worst_lateness`, or `losses`. The chain `hot_path` is the
/// first one, with a note, if no other has that name. By default the age of the first chain or, without
/// chains, `worst_lateness`. Throws UsageError, also if the graph lacks the chain.
[[nodiscard]] Objective parse_objective(const std::optional<std::string>& given, const Graph& graph,
                                        results::Judged usual = results::kP99);

/// How well an objective is met; smaller is better. By default the worst.
struct Score {
  double value = INFINITY;
  std::size_t late_timers = 0;  ///< Of guarantees: timers whose worst response time exceeds their deadline.
  double tie = 0;               ///< Decides between equal values.
  friend std::partial_ordering operator<=>(const Score&, const Score&) = default;
};
/// The value of requirements is the sum by which worst-case latencies exceed their limits, in
/// percent of the limit. Lateness is in ms (negative: before the deadline), losses in percent,
/// latencies in ms. Without samples the value is infinite.
[[nodiscard]] Score score(const Objective& objective, const results::ExecutorSummary& summary);

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
