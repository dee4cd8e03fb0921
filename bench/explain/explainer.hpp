// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "explain/account.hpp"
#include "explain/data_path.hpp"

namespace hotpath::explain {

/// The latency to explain: hot-path latencies of a chain, or response times of a task.
struct Target {
  std::optional<std::uint32_t> chain;  ///< Index into System::chains().
  TaskId task = kNoTask;               ///< Without a chain.
};

/// One latency to explain.
struct Output {
  std::uint32_t repetition = 0;
  std::uint64_t sequence = 0;  ///< Of the sink's job, or of the task's.
  Duration latency{};          ///< As measured, >= 0.
  friend auto operator<=>(const Output&, const Output&) = default;
};

/// Explains outputs while it reads the jobs of a run.
class Explainer {
 public:
  using Use = std::function<void(const Explanation&)>;

  /// `outputs` are sorted; `run` names the run in messages. `system` must outlive the object.
  Explainer(const System& system, Target target, std::vector<Output> outputs, std::string run, Use use);

  void begin(std::uint32_t repetition, RepetitionFacts facts);
  /// Adds a job of this repetition; started jobs in order of start. Throws UsageError if jobs that
  /// overlap a latency do not fit into memory.
  void add(const JobRecord& record);
  void end();

  [[nodiscard]] Time last_start() const { return now_; }
  /// Outputs whose job is not in the trace.
  [[nodiscard]] std::size_t missing() const { return outputs_.size() - explained_; }

 private:
  void add_sink(const Seen& sink);
  void explain_output(const Seen& sink, const std::vector<const Seen*>& path, Duration latency,
                      bool complete);
  void explain_finished();
  void use(Account& account, Explanation explanation);

  const System& system_;
  const Target target_;
  const std::vector<Output> outputs_;
  const Use use_;
  JobWindow window_;
  DataPath paths_;
  Duration longest_{};  // of the outputs
  std::uint32_t repetition_ = 0;
  RepetitionFacts facts_;
  std::vector<Seen> unfinished_;  // jobs of the target task, explained when all that overlap are known
  std::size_t explained_ = 0, added_ = 0;
  Time now_ = Time::min();
};

}  // namespace hotpath::explain
