// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "explain/explain.hpp"
#include "explain/explain_report.hpp"
#include "explain/explainer.hpp"
#include "setup/stored_system.hpp"

namespace hotpath::explain {

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
  /// Explains these outputs. Throws UsageError if none of their jobs is in the trace, InputError.
  void explain(const std::vector<Output>& outputs, const Explainer::Use& use);

  /// Explains the counted jobs with the largest response times of every task, at most `most` of each, and
  /// reads the jobs twice for all tasks. Throws as the constructor and explain() do.
  static void explain_tasks(const results::StoredRun& run, const std::string& executor, std::size_t most,
                            const std::function<void(TaskId, const Explanation&)>& use);

 private:
  /// Without a target.
  StoredOutputs(const results::StoredRun& run, const std::string& executor,
                std::optional<std::uint32_t> repetition);
  void choose_target(const Options& options);
  [[nodiscard]] bool selected(std::string_view executor, std::uint32_t repetition) const;
  void read_chains();
  /// `use` gets the counted jobs of all tasks.
  void for_each_response(const std::function<void(TaskId, const Output&)>& use) const;
  /// Passes the jobs to all of them.
  void pass_jobs(std::deque<Explainer>& explainers) const;

  const results::StoredRun& run_;
  const setup::StoredSystem stored_;
  const std::string executor_;
  const std::optional<std::uint32_t> repetition_;
  std::optional<System> system_;
  Target target_;
  Subject subject_;
  std::vector<Output> outputs_;
  std::size_t younger_ = 0;  // outputs whose data is younger than the sink's job (cyclic nodes)
};

}  // namespace hotpath::explain
