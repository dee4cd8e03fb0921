// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <iosfwd>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "advise/prediction.hpp"

namespace hotpath::advise {

/// The ranking under a changed assumption.
struct Doubt {
  std::string assumption;           ///< Such as `execution times 20 % longer`.
  std::vector<std::string> order;   ///< Names, the best first.
  std::vector<std::string> values;  ///< In that order: name and value, or that it cannot keep up.
  bool same_first = true;           ///< No candidate overtakes the recommended one.
};

/// What `hotpath advise` is asked, and the answer.
struct Advice : Question {
  using Question::Question;

  std::vector<Candidate> candidates;
  std::vector<Prediction> ranked;
  const Prediction* now = nullptr;
  const Prediction* best = nullptr;  ///< nullptr: nothing can be recommended.
  std::vector<Doubt> doubts;
  /// Why the recommended executor is faster than today's along the objective's chain, in the first
  /// draw; empty: there is no difference to explain.
  std::vector<std::string> causes;
  /// Labels in the stored runs now/run and recommended/run of the first draw; empty: there are none.
  std::vector<std::string> stored;
  std::string change;  ///< The file of the recommended change; empty: none is needed.

  /// The number of draws that random phases, execution times or deliveries need, and that were finished.
  [[nodiscard]] std::uint32_t asked_draws() const;
  [[nodiscard]] std::uint32_t draws() const;
  [[nodiscard]] bool changes() const { return best != nullptr && best != now; }
  /// Whether there are values of another executor today, with which the recommended one is compared.
  [[nodiscard]] bool compares() const { return changes() && now->keeps_up(); }
};

/// The content of advice.json.
void to_json(nlohmann::json& j, const Advice& advice);
/// The ranking, the sentences, the doubts, and the causes of the gain; `content`: of advice.json.
void write_text(std::ostream& out, const Advice& advice, const nlohmann::json& content);

/// Writes executor.yaml and the graph.yaml that it names into the folder: the options with which
/// hotpath_rclcpp's PriorityExecutor runs the candidate in each process. Returns the files, none for
/// wait-set executors, which are rclcpp's own, and for deployments to different executors.
/// `platform` replaces the candidate's costs in graph.yaml. `offsets`: a file of phases in the same
/// folder; empty: none.
std::vector<std::string> write_executor_files(const Candidate& candidate, const GraphPlatform& platform,
                                              const std::string& offsets,
                                              const std::filesystem::path& folder);

/// Text to paste that installs the executor files of the folder, with `shown` as its path; empty: it has
/// none.
std::string installation(const std::filesystem::path& folder, const std::filesystem::path& shown);

}  // namespace hotpath::advise
