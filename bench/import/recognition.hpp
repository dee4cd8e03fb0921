// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "import/hypothesis.hpp"

namespace hotpath::imports {

/// The answer to the question which executor ran a recording.
enum class Verdict : std::uint8_t {
  recognised,
  tie,        ///< Several executors explain it equally well.
  undecided,  ///< Too few decisions distinguish the executors.
  none_fits,
};
constexpr auto enum_texts(Verdict) {
  return texts_in_order<Verdict>({"recognised", "tie", "undecided", "none fits"});
}

/// By pair of tasks, the smaller one first: how many more contradictions there are if it comes second.
using OrderEvidence = std::map<std::pair<TaskId, TaskId>, std::int64_t>;

/// How well a hypothesis explains the decisions of the judged part of a recording.
struct Score {
  Hypothesis hypothesis;        ///< Fitted.
  OrderEvidence evidence = {};  ///< Empty: the order of creation explains the recording as well.
  std::size_t contradictions = 0;
  double agreement = 0;  ///< Share of the contested decisions that agree.
  double margin = 0;     ///< Log-likelihood ratio of the best hypothesis to this one.
  /// The kinds of these decisions, by the tasks that ran and that this one would have run.
  std::size_t kinds_against = 0;
  std::size_t against = 0, in_favour = 0;  ///< Decisions that only the best, or only this one explains.
  std::size_t plain_against = 0, plain_in_favour = 0;  ///< Those that timing cannot explain.
  bool unlikely = false;  ///< Not excluded, but the best one is a thousand times as likely.

  [[nodiscard]] double difference() const {
    return static_cast<double>(against) - static_cast<double>(in_favour);
  }
  [[nodiscard]] std::size_t differing() const { return against + in_favour; }
};

struct Recognition {
  Verdict verdict = Verdict::undecided;
  std::string stated;                        ///< The name that the executor gives itself; empty: none.
  std::vector<Score> ranking;                ///< The best first.
  std::size_t leading = 0;                   ///< The first ones, which the recording cannot tell apart.
  std::size_t decisions = 0, contested = 0;  ///< Of the judged part.
  std::string breaks;  ///< When the best first does not explain a decision, in words; empty: never.

  /// Labels of the leading hypotheses, or of the unlikely ones among them.
  [[nodiscard]] std::vector<std::string> names(bool unlikely_only = false) const;
};

/// Compares all executors that can have run the threads, fitted on the first half of the decisions, and
/// judged on the second half. A hypothesis that the executor `stated` itself is believed.
[[nodiscard]] Recognition recognise(const tracing::System& system, const RecordedGraph& graph,
                                    const RecordedSteps& steps, const std::vector<Hypothesis>& possible,
                                    const std::string& stated = {});

/// Nodes and callbacks in the order that agrees with most evidence; equals in the order of creation.
[[nodiscard]] ServiceOrder service_order(const tracing::System& system, const RecordedGraph& graph,
                                         const OrderEvidence& evidence);

/// One or two sentences: the verdict, its evidence, and what would decide an open one.
[[nodiscard]] std::string sentence(const Recognition& recognition);

}  // namespace hotpath::imports
