// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "explain/causes.hpp"
#include "explain/data_path.hpp"
#include "hotpath/core/workload.hpp"

namespace hotpath::explain {

/// The jobs around a latency, and what is known of them.
struct Surroundings {
  const System& system;
  const JobWindow& window;
  const ExecutionTimes* times;  ///< Of every job that works, in a simulation; nullptr: not known.
};

/// Divides the response time of a job among causes.
[[nodiscard]] std::vector<Part> parts_of_response(const Surroundings& around, const Seen& job);

/// Divides the latency of an output from `begin` on among causes: of the hot path, to the start of the last
/// job of the path; else to its finish, with the first job's wait. Part::step is an index into `path`.
[[nodiscard]] std::vector<Part> parts_of_path(const Surroundings& around,
                                              const std::vector<const Seen*>& path, Time begin,
                                              Latency latency);

/// One latency to explain.
struct Output {
  std::uint32_t repetition = 0;
  std::uint64_t sequence = 0;  ///< Of the sink's job, or of the task's.
  Duration latency{};          ///< As measured, >= 0.
  TaskId sink = kNoTask;       ///< The task of that job; kNoTask: any of the chain's sink.
};

/// The output at a quantile in [0, 1]: the smallest that at least this share of outputs do not
/// exceed. `outputs` must not be empty.
[[nodiscard]] const Output& at_quantile(const std::vector<Output>& by_latency, double quantile);
[[nodiscard]] std::vector<Output> sorted_by_latency(std::vector<Output> outputs);

/// Explains outputs while it reads the jobs of a run.
class Explainer {
 public:
  using Use = std::function<void(const Explanation&)>;

  /// `chain`: index into System::chains; none: response times of the outputs' tasks.
  /// `outputs` of unknown sink tasks that have the same sequence are in the order of their jobs' ends.
  /// `system` must outlive the object.
  Explainer(const System& system, std::optional<std::uint32_t> chain, std::vector<Output> outputs, Use use,
            Latency latency = Latency::response);

  void begin(std::uint32_t repetition, const ExecutionTimes* times);
  /// Adds a job of this repetition; started jobs in order of start.
  void add(const JobRecord& record);
  void end();

  [[nodiscard]] Time last_start() const { return now_; }
  /// Outputs whose job is not in the trace.
  [[nodiscard]] std::size_t missing() const { return outputs_.size() - explained_; }

 private:
  [[nodiscard]] std::span<const Output> outputs_of(const Job& job) const;
  void explain_finished();
  bool explain_output(const Seen& job, const Output& output);
  [[nodiscard]] std::vector<const Seen*> of_triggers(const Seen& sink, Time begin) const;

  const System& system_;
  const ChainIndex* const chain_;  // nullptr: response times
  const Latency latency_;
  std::vector<Output> outputs_;  // by repetition and sequence
  const Use use_;
  std::vector<bool> done_;  // by output
  JobWindow window_;
  DataPath paths_;
  Duration longest_{};  // of the outputs
  std::uint32_t repetition_ = 0;
  const ExecutionTimes* times_ = nullptr;
  std::vector<Seen> unfinished_;  // jobs of outputs, explained when all jobs that overlap are known
  std::size_t explained_ = 0, added_ = 0;
  Time now_ = Time::min();
};

}  // namespace hotpath::explain
