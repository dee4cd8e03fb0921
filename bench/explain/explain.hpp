// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "explain/explain_report.hpp"
#include "explain/explainer.hpp"
#include "setup/stored_system.hpp"
#include "simulated/repetition.hpp"

namespace hotpath::explain {

/// The command line of `hotpath explain`.
struct Options {
  std::string run;
  std::string other;                        ///< A second run, to compare.
  std::vector<std::string> executors;       ///< At most two; empty: the first of the run.
  std::optional<std::uint32_t> repetition;  ///< std::nullopt: all.
  std::string chain;                        ///< Empty: the first of the graph.
  std::string task;                         ///< Response times of this task in place of a chain.
  bool hot_path = false;  ///< A chain's hot-path latencies in place of the ages of its data.
  bool worst = false;
  std::optional<double> quantile;  ///< In [0, 1].
  std::optional<std::uint64_t> sequence;
  bool json = false;  ///< Instead of text.
};

/// Explains one output, many outputs, or the difference of two executors. Reads jobs.csv row by row;
/// memory grows with the number of outputs and with the jobs that overlap the longest latency.
/// Throws UsageError and InputError.
void explain(const Options& options);

/// A simulation with the records of its jobs and chains.
struct SimulatedRun {
  simulated::Plan plan;
  const Trace& trace;
};
/// Why one is faster than the other along a chain of the graph, by the age of the data or the hot-path
/// latency: up to three sentences. Both have the same tasks, phases and execution times.
[[nodiscard]] std::vector<std::string> difference(const SimulatedRun& a, const SimulatedRun& b,
                                                  std::uint32_t chain, Latency latency);

/// The outputs of a stored run under one executor that the options select.
class StoredOutputs {
 public:
  /// `executor` empty: the first of the run. Throws UsageError, InputError.
  StoredOutputs(const results::StoredRun& run, const std::string& executor, const Options& options);
  StoredOutputs(const StoredOutputs&) = delete;
  StoredOutputs& operator=(const StoredOutputs&) = delete;

  /// In the order of the file; not empty.
  [[nodiscard]] const std::vector<Output>& outputs() const { return outputs_; }
  [[nodiscard]] const Subject& subject() const { return subject_; }
  /// How many outputs `other` has more, over the repetitions that both ran; 0 if their lengths differ. Those
  /// that cannot be explained count.
  [[nodiscard]] std::size_t fewer_than(const StoredOutputs& other) const;
  /// Explains these outputs. Throws UsageError if none of their jobs is in the trace, InputError.
  void explain(const std::vector<Output>& outputs, const Explainer::Use& use);

  /// Explains the counted jobs with the largest response times of every task, at most `most` of each. Throws
  /// as the constructor and explain() do.
  static void explain_tasks(const results::StoredRun& run, const std::string& executor, std::size_t most,
                            const Explainer::Use& use);

 private:
  /// Without a target.
  StoredOutputs(const results::StoredRun& run, const std::string& executor,
                std::optional<std::uint32_t> repetition);
  [[nodiscard]] bool selected(std::string_view executor, std::uint32_t repetition) const;
  /// `use` gets the counted jobs of all tasks.
  void for_each_response(const std::function<void(const Output&)>& use) const;
  void pass_jobs(Explainer& explainer) const;

  const results::StoredRun& run_;
  const setup::StoredSystem stored_;
  const std::string executor_;
  const std::optional<std::uint32_t> repetition_;
  std::optional<System> system_;
  std::optional<std::uint32_t> chain_;  // to explain; none: a task
  Subject subject_;
  std::vector<Output> outputs_;
  std::map<std::uint32_t, std::size_t> counted_;  // by repetition, with those left out
  std::size_t left_out_ = 0;  // outputs of unknown age, or (cyclic nodes) with data younger than the job
};

}  // namespace hotpath::explain
