// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "watch/incident.hpp"

namespace hotpath::watch {

/// A term, compared with what was observed.
class JudgedTerm {
 public:
  /// `subject`: of sentences, `Filter/points`.
  JudgedTerm(Term term, std::string subject) : term_(std::move(term)), subject_(std::move(subject)) {}

  /// Compares an observed value in the unit of the limit.
  void compare(std::int64_t observed, Time at, Incidents& incidents);
  /// Compares the distances between a sample and those before it, the nearest one first, with the limits
  /// of a minimum_distance. Together they are one comparison.
  void compare_distances(const std::vector<Duration>& distances, Time at, Incidents& incidents);
  /// A duration from `since` that has not ended by `until`, and exceeds its limit.
  void judge_lasting(Time since, Time until, Incidents& incidents);
  /// It has ended, not earlier than when it was judged.
  void judge_ended(Time since, Duration length, Incidents& incidents);
  /// Shows the value, without a comparison.
  void observe(std::int64_t value);
  /// Counts a comparison that holds.
  void hold() { ++checked_; }
  /// Counts one that does not. `continues`: a state that was broken before, which begins no incident.
  void fail(Fact breach, Incidents& incidents, bool continues = false);
  /// Compares by other means; `observed` completes the sentence.
  void judge(bool holds, const std::string& observed, Time at, Incidents& incidents, bool continues = false);

  [[nodiscard]] Clause clause() const { return term_.clause; }
  [[nodiscard]] const Term& term() const { return term_; }
  [[nodiscard]] const std::string& subject() const { return subject_; }
  [[nodiscard]] std::uint64_t checked() const { return checked_; }
  [[nodiscard]] std::uint64_t broken() const { return broken_; }
  [[nodiscard]] const std::optional<Fact>& first() const { return first_; }
  /// The observed value that came nearest to breaking the term, or broke it most; std::nullopt: it is
  /// no number.
  [[nodiscard]] std::optional<std::int64_t> extreme() const { return extreme_; }
  /// `5.000 ms`, `fifo:80`.
  [[nodiscard]] std::string limit_text() const;
  /// The extreme in the same form; empty: none.
  [[nodiscard]] std::string extreme_text() const { return extreme_ ? shown(*extreme_) : ""; }
  [[nodiscard]] nlohmann::json json() const;
  /// The key of the clause without its unit.
  [[nodiscard]] std::string title() const;

  /// A value in the unit of the limit.
  [[nodiscard]] std::string shown(std::int64_t value) const;

 private:
  /// `further`: of the limits for a minimum_distance, 0: the first one.
  [[nodiscard]] std::int64_t limit(std::size_t further) const;
  [[nodiscard]] std::string sentence(std::int64_t observed, std::size_t further = 0) const;
  [[nodiscard]] Fact breach(std::int64_t observed, Time at, std::size_t further = 0) const;
  /// Of a duration that exceeds its limit from the returned instant on.
  [[nodiscard]] Fact lasting(Time since, Duration length, std::string sentence) const;

  Term term_;
  std::string subject_;
  std::uint64_t checked_ = 0, broken_ = 0;
  std::optional<std::int64_t> extreme_;
  std::optional<std::int64_t> state_;  // the latest value, where all values have to be equal
  std::set<std::string> said_;         // of terms about what exists
  std::optional<Fact> first_;
};

/// A callback, chain, executor's threads or topic of a contract.
struct Subject {
  std::string kind;  ///< Key in JSON.
  std::string name;
  std::vector<JudgedTerm> terms = {};
  bool seen = false;
  const char* unseen = "";  ///< The reason why nothing was compared as long as it was not seen.

  Subject(std::string of_kind, std::string named, const std::vector<Term>& stated, const char* why);
  /// nullptr: the contract lacks it.
  [[nodiscard]] JudgedTerm* find(Clause clause);
  /// Compares with the term, if there is one.
  void compare(Clause clause, std::int64_t observed, Time at, Incidents& incidents);
};

}  // namespace hotpath::watch
