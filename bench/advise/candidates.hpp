// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "advise/objective.hpp"
#include "setup/executor_spec.hpp"

namespace hotpath {

/// What could serve the graph, and what that asks for.
struct Candidate {
  std::string name;
  std::string description;
  Graph graph;       ///< With the platform, and where the candidate gives some, with its priorities.
  GraphTasks tasks;  ///< Of `graph`.
  ExecutorSpec spec;
  bool sets_priorities = false;  ///< `graph` has other priorities than the one given.
  unsigned threads = 0;          ///< That run jobs.
  std::string overload;          ///< Why it cannot keep up; empty: it can.
};

struct CandidateOptions {
  std::vector<std::string> executors, deployments;  ///< Both empty: all that suit.
  std::string now;              ///< What the system has today: an executor or a deployment.
  SchedulerOptions scheduling;  ///< Threads of executors that are given none.
  bool reference_costs = true;  ///< What an executor costs on the reference machine; else the platform's.
};

/// What suits the graph by the traits of the registry: every executor, but neither fixed priorities that
/// nobody gave nor deadlines that are the periods, and several threads where there are cores for them; every
/// deployment preset; and, made for the chain of the objective, if it has one, fixed priorities that put its
/// timers first (`fp-ro:chain`), a thread above all others for its callback groups (`chain-first`), and
/// threads for all callback groups with those of the chain above (`cie:chain`). Throws UsageError,
/// InputError.
[[nodiscard]] std::vector<Candidate> make_candidates(const Graph& graph, const Objective& objective,
                                                     const CandidateOptions& options);

/// After a change of the candidate's graph: its tasks, its threads, and whether they can keep up.
void weigh(Candidate& candidate);

/// The mean work of the graph in percent of one core: by the execution times that its platform asks for.
[[nodiscard]] double mean_load_percent(const Graph& graph, const GraphTasks& tasks);

}  // namespace hotpath
