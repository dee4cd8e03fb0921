// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "program/text_table.hpp"
#include "watch/incident.hpp"

namespace hotpath::watch {

/// A term, compared with what was observed. Each comparison counts once; a breach is a fact of an incident.
class JudgedTerm {
 public:
  /// `subject`: of sentences, `Filter/points`.
  JudgedTerm(Term term, std::string subject, Incidents& incidents)
      : term_(std::move(term)), subject_(std::move(subject)), incidents_(&incidents) {}

  /// Compares an observed value in the unit of the limit.
  void compare(std::int64_t observed, Time at);
  /// Compares the distances between a sample and those before it, the nearest one first, with the limits
  /// of a minimum_distance. Together they are one comparison.
  void compare_distances(const std::vector<Duration>& distances, Time at);
  /// A duration from `since` that has not ended by `until`, and exceeds its limit.
  void judge_lasting(Time since, Time until);
  /// It has ended, not earlier than when it was judged.
  void judge_ended(Time since, Duration length);
  /// Shows the value, without a comparison.
  void observe(std::int64_t value);
  /// Counts a comparison that holds.
  void hold() { ++checked_; }
  /// Counts one that does not. `continues`: a state that was broken before, which begins no incident.
  void fail(Fact breach, bool continues = false);
  /// Compares by other means; `observed` completes the sentence.
  void judge(bool holds, const std::string& observed, Time at, bool continues = false);

  [[nodiscard]] Clause clause() const { return term_.clause; }
  [[nodiscard]] const Term& term() const { return term_; }
  [[nodiscard]] const std::string& subject() const { return subject_; }
  [[nodiscard]] std::uint64_t checked() const { return checked_; }
  [[nodiscard]] std::uint64_t broken() const { return broken_; }
  [[nodiscard]] const std::optional<Fact>& first() const { return first_; }
  /// `5.000 ms`, `fifo:80`.
  [[nodiscard]] std::string limit_text() const;
  /// The observed value that came nearest to breaking the term, or broke it most; empty: it is no number.
  [[nodiscard]] std::string extreme_text() const { return extreme_ ? shown(*extreme_) : ""; }
  [[nodiscard]] nlohmann::json json() const;
  /// The key of the clause without its unit.
  [[nodiscard]] std::string title() const;

 private:
  /// A value in the unit of the limit.
  [[nodiscard]] std::string shown(std::int64_t value) const;
  [[nodiscard]] bool holds(std::int64_t observed, std::int64_t limit) const;
  [[nodiscard]] std::string sentence(std::int64_t observed, std::int64_t limit, std::string deed) const;
  /// `samples`: that together exceed the limit of a minimum_distance.
  [[nodiscard]] Fact breach(std::int64_t observed, std::int64_t limit, Time at,
                            std::size_t samples = 2) const;
  /// Of a duration that exceeds its limit from the returned instant on.
  [[nodiscard]] Fact lasting(Time since, Duration length) const;

  Term term_;
  std::string subject_;
  Incidents* incidents_;
  std::uint64_t checked_ = 0, broken_ = 0;
  std::optional<std::int64_t> extreme_;
  std::optional<std::int64_t> state_;  // the latest value, where all values have to be equal
  std::set<std::string> said_;         // of terms about what exists
  std::optional<Fact> first_;
};

/// A callback, chain, executor's threads or topic of a contract.
struct Subject {
  Kind kind;
  std::string name;
  const char* unseen;  ///< The reason why nothing was compared as long as it was not seen.
  std::vector<JudgedTerm> terms = {};
  bool seen = false;

  /// nullptr: the contract lacks it.
  [[nodiscard]] JudgedTerm* find(Clause clause);
  /// Compares with the term, if there is one.
  void compare(Clause clause, std::int64_t observed, Time at) {
    if (JudgedTerm* const term = find(clause)) term->compare(observed, at);
  }
};

/// All terms of a contract, their verdicts and the incidents.
class Judge {
 public:
  /// `topics`: that callbacks of the contract publish. `realtime`: the real-time clock minus that of Time.
  Judge(const Contract& contract, const std::vector<std::string>& topics, Duration realtime);
  Judge(const Judge&) = delete;
  Judge& operator=(const Judge&) = delete;

  /// In the order of the contract.
  [[nodiscard]] std::vector<Subject>& all(Kind kind) { return subjects_[static_cast<std::size_t>(kind)]; }
  [[nodiscard]] Subject& callback(std::uint32_t c) { return all(Kind::callback)[c]; }
  [[nodiscard]] Incidents& incidents() { return incidents_; }
  /// Whether any term is broken.
  [[nodiscard]] bool broken() const { return incidents_.count() > 0; }
  /// What broke first in the first incident; empty: there is none.
  [[nodiscard]] std::string incident() const { return broken() ? incidents_.kept().front().text() : ""; }

  /// `lossy`: lost events make terms that are not broken unobservable.
  [[nodiscard]] program::TextTable table(bool lossy) const;
  [[nodiscard]] nlohmann::json json(bool lossy) const;

 private:
  void add(Kind kind, const std::string& name, const char* unseen, const std::vector<Term>& terms);
  /// Calls `use(subject, term, verdict, reason)` for all terms.
  template <class Use>
  void for_each_verdict(bool lossy, const Use& use) const;

  Incidents incidents_;
  std::array<std::vector<Subject>, enum_texts(Kind{}).size()> subjects_;
};

}  // namespace hotpath::watch
