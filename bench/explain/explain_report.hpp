// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <compare>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "explain/causes.hpp"
#include "explain/explainer.hpp"

namespace hotpath::explain {

using CauseTimes = std::array<Duration, kCauses>;

/// What was waited for.
struct Behind {
  Cause cause = Cause::unexplained;
  Rule rule = Rule::none;
  TaskId task = kNoTask;
  friend auto operator<=>(const Behind&, const Behind&) = default;
};

/// Sums over many outputs.
struct Totals {
  std::uint64_t outputs = 0;
  Duration latency{};
  CauseTimes causes{};
  std::map<Behind, Duration> behind = {};   ///< Parts with another job.
  std::map<TaskId, Duration> running = {};  ///< Cause::running, by the task on the path.

  void add(const Explanation& explanation);
  /// Means in ms; 0 without outputs.
  [[nodiscard]] double mean_ms() const { return mean_ms(latency); }
  [[nodiscard]] double mean_ms(Cause cause) const { return mean_ms(causes[static_cast<std::size_t>(cause)]); }
  [[nodiscard]] double mean_ms(const Behind& key) const {
    const auto sum = behind.find(key);
    return sum == behind.end() ? 0 : mean_ms(sum->second);
  }
  [[nodiscard]] double running_ms(TaskId task) const {
    const auto sum = running.find(task);
    return sum == running.end() ? 0 : mean_ms(sum->second);
  }

 private:
  [[nodiscard]] double mean_ms(Duration sum) const {
    return outputs == 0 ? 0 : to_ms(sum) / static_cast<double>(outputs);
  }
};

/// Share of the outputs in the tail.
inline constexpr double kTail = 0.01;

/// The causes of all outputs, of those around the median, and of the worst.
class Overview {
 public:
  /// `outputs` must not be empty.
  explicit Overview(const std::vector<Output>& outputs);
  void add(const Explanation& explanation);

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

}  // namespace hotpath::explain
