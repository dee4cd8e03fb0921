// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hotpath/analysis/statistics.hpp"
#include "hotpath/core/trace.hpp"

namespace hotpath::comparison {

/// Smaller differences count as none: simulated values are whole nanoseconds.
inline constexpr double kNothing_ms = 1e-6;

/// What was recorded from another system is live.
enum class Source : std::uint8_t { live, simulated };
constexpr auto enum_texts(Source) { return texts_in_order<Source>({"live", "simulated"}); }

/// What both sides must have to be compared, in the order of the rows.
struct Key {
  std::optional<Latency> latency;  ///< None: losses.
  std::string study;               ///< Chain, task or graph; of a reproduction, the study.
  Source source{};
  std::string setting;  ///< The load, such as `80 %`.
  std::string executor;
  std::string tasks;  ///< Of a reproduction: a group of timers, or a task; else empty.

  friend auto operator<=>(const Key&, const Key&) = default;
};
/// The key in words.
[[nodiscard]] std::string text_of(const Key& key);

/// One quantity (ms) in the repetitions that have samples of it, each in time order.
struct Samples {
  struct Repetition {
    std::int64_t number = 0;  ///< Repetitions with equal draws have equal numbers.
    std::vector<double> ms;
  };
  std::vector<Repetition> repetitions;
  bool deterministic = false;  ///< A single repetition has no sampling error.

  [[nodiscard]] bool exact() const { return deterministic && repetitions.size() == 1; }
  /// The samples of a repetition, which is added if it is new.
  std::vector<double>& of(std::int64_t number);
  /// For estimates: a single repetition becomes blocks of consecutive samples, unless it is exact.
  [[nodiscard]] RepeatedSamples resampled() const;
};

/// What the gate judges, one value per repetition: statistics of a latency (ms), then counts.
enum class Measure : std::uint8_t { mean, p50, p99, losses, outputs, jobs, repetitions };
constexpr auto enum_texts(Measure) {
  return texts_in_order<Measure>(
      {"mean", "p50", "p99", "lost jobs and samples", "outputs", "jobs", "repetitions"});
}

using Series = std::map<std::int64_t, double>;  ///< By number of the repetition.

/// What the random numbers of a simulated repetition decided, and how long it was.
struct Draw {
  std::string execution_times;
  double warm_up_s = 0, duration_s = 0;
  std::map<std::string, Duration> first_timestamps;  ///< By timer.
};

/// One result of a comparison.
struct Side {
  std::map<Key, Samples> samples;
  /// Losses (skipped timestamps and overwritten samples); outputs of each chain and jobs of each task in
  /// every planned repetition.
  std::map<std::pair<Measure, Key>, Series> counts;
  std::map<std::pair<std::string, std::int64_t>, Draw> draws;  ///< By executor and repetition.
  /// Warm-up and duration of a repetition in seconds; none for reproductions.
  std::optional<std::pair<double, double>> length;
  std::string mode;   ///< Of a reproduction.
  std::string graph;  ///< Of a run.
};

/// Whether repetitions of a simulated executor with equal numbers have equal models of execution times,
/// lengths, and phases of the timers that both have.
[[nodiscard]] bool draws_agree(const Side& before, const Side& after, const std::string& executor);

/// Reads a reproduction, a run, or a folder of runs: one build's repetitions, measured by turns. Without
/// `losses`, a run needs no summary.json. Throws UsageError and InputError.
[[nodiscard]] Side read_side(const std::filesystem::path& folder, bool losses);

/// The folders of repetitions that were measured by turns; empty for a run.
[[nodiscard]] std::vector<std::filesystem::path> parts_of(const std::filesystem::path& folder);

/// Passes on the JSON of a file that `made_by` wrote. Throws InputError, and UsageError for nlohmann's
/// exceptions of `use`.
void use_json(const std::filesystem::path& file, const std::string& made_by,
              const std::function<void(const nlohmann::json&)>& use);

/// Adds a reproduction of the paper, if the folder has one. Throws UsageError and InputError.
bool add_reproduction(const std::filesystem::path& folder, Side& side);
/// Dropped timestamps of a reproduction in percent.
[[nodiscard]] std::map<Key, double> drop_rates(const std::filesystem::path& folder);

}  // namespace hotpath::comparison
