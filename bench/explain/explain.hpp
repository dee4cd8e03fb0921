// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "explain/explainer.hpp"
#include "hotpath/analysis/statistics.hpp"
#include "setup/stored_system.hpp"
#include "simulated/repetition.hpp"

namespace hotpath::explain {

/// Sums over many outputs.
struct Totals {
  /// What the time passed with.
  struct Key {
    Cause cause = Cause::unexplained;
    Rule rule = Rule::none;
    TaskId task = kNoTask;  ///< Of the job that was waited for or, of Cause::running, that ran on the path.

    [[nodiscard]] bool waited() const { return task != kNoTask && cause != Cause::running; }
    friend auto operator<=>(const Key&, const Key&) = default;
  };

  std::uint64_t outputs = 0;
  Duration latency{};
  std::map<Key, Duration> times = {};

  void add(const Explanation& explanation) {
    ++outputs;
    latency += explanation.latency;
    for (const Part& part : explanation.parts) {
      const JobRecord& on_path = explanation.path[part.step];
      const TaskId task = part.cause == Cause::running ? on_path.job.task : part.behind.task;
      times[{part.cause, part.rule, task}] += part.length;
    }
  }
  [[nodiscard]] Duration sum(Cause cause) const {
    Duration sum{};
    for (const auto& [key, time] : times) sum += key.cause == cause ? time : Duration{};
    return sum;
  }
  /// Means in ms; 0 without outputs.
  [[nodiscard]] double mean_ms() const { return mean_ms(latency); }
  [[nodiscard]] double mean_ms(Cause cause) const { return mean_ms(sum(cause)); }
  [[nodiscard]] double mean_ms(const Key& key) const {
    const auto time = times.find(key);
    return time == times.end() ? 0 : mean_ms(time->second);
  }

 private:
  [[nodiscard]] double mean_ms(Duration time) const {
    return outputs == 0 ? 0 : to_ms(time) / static_cast<double>(outputs);
  }
};

/// Share of the outputs in the tail.
inline constexpr double kTail = 0.01;

[[nodiscard]] inline std::vector<Output> sorted_by_latency(std::vector<Output> outputs) {
  std::ranges::stable_sort(outputs, {}, &Output::latency);
  return outputs;
}

/// The causes of all outputs, of those around the median, and of the worst.
class Overview {
 public:
  /// `outputs` must not be empty.
  explicit Overview(const std::vector<Output>& outputs) {
    const std::vector<Output> sorted = sorted_by_latency(outputs);
    middle_from_ = sorted[nearest_rank(sorted.size(), 0.45)].latency;
    middle_to_ = sorted[nearest_rank(sorted.size(), 0.55)].latency;
    const auto worst = std::max(1.0, std::floor(kTail * static_cast<double>(sorted.size())));
    tail_from_ = sorted[sorted.size() - static_cast<std::size_t>(worst)].latency;
  }
  void add(const Explanation& explanation) {
    const Duration latency = explanation.latency;
    all.add(explanation);
    if (latency >= middle_from_ && latency <= middle_to_) middle.add(explanation);
    if (latency >= tail_from_) tail.add(explanation);
  }

  Totals all, middle, tail;

 private:
  Duration middle_from_{}, middle_to_{}, tail_from_{};
};

/// The names of what was explained.
struct Subject {
  const TaskSet& set;
  std::string executor;  ///< Its label; of a comparison of two runs, also the run.
  std::string name;      ///< Of the chain; of response times, of the task.
  Latency latency = Latency::age;
  std::size_t missing = 0;                 ///< Outputs whose jobs the trace lacks.
  std::size_t fewer = 0;                   ///< Of a comparison: outputs that the other side has more.
  std::vector<std::string> warnings = {};  ///< Sentences about overload and starvation.
};

/// What is shown of an explanation: the sentences, and tables and notes as text or the data as JSON.
struct Report {
  std::vector<std::string> sentences;  ///< At most six.
  std::string text;
  nlohmann::json data;
};
[[nodiscard]] Report report(const Subject& subject, const Explanation& explanation);
[[nodiscard]] Report report(const Subject& subject, const Overview& overview);
/// Why one is faster than the other.
[[nodiscard]] Report report(const Subject& a, const Totals& of_a, const Subject& b, const Totals& of_b);

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
  bool json = false;        ///< Instead of text.
  std::size_t slowest = 0;  ///< If > 0: explains this many of the slowest jobs of each task.
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

  /// In the order of the file; the slowest jobs in that of their tasks. Only the slowest jobs may be none.
  [[nodiscard]] const std::vector<Output>& outputs() const { return outputs_; }
  [[nodiscard]] const Subject& subject() const { return subject_; }
  /// How many outputs `other` has more, over the repetitions that both ran; 0 if their lengths differ. Those
  /// that cannot be explained count.
  [[nodiscard]] std::size_t fewer_than(const StoredOutputs& other) const;
  /// Explains these outputs. Throws UsageError if none of their jobs is in the trace, InputError.
  void explain(const std::vector<Output>& outputs, const Explainer::Use& use);

 private:
  [[nodiscard]] bool selected(const auto& row) const {
    return row.executor == subject_.executor && (!repetition_ || row.repetition == *repetition_);
  }
  void find_outputs(const Options& options);
  /// The counted jobs of one task, or the slowest of all.
  void find_jobs(const Options& options);

  const results::StoredRun& run_;
  const setup::StoredSystem stored_;
  const std::optional<std::uint32_t> repetition_;
  std::optional<System> system_;
  std::optional<std::uint32_t> chain_;  // to explain; none: jobs
  Subject subject_;
  std::vector<Output> outputs_;
  std::map<std::uint32_t, std::size_t> counted_;  // by repetition, with those left out
  std::size_t left_out_ = 0;  // outputs of unknown age, or (cyclic nodes) with data younger than the job
};

}  // namespace hotpath::explain
