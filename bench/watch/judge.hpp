// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "program/table.hpp"
#include "program/text.hpp"
#include "watch/incident.hpp"

namespace hotpath::watch {

enum class Verdict : std::uint8_t { held, broken, not_observable };
constexpr auto enum_texts(Verdict) { return texts_in_order<Verdict>({"held", "broken", "not observable"}); }

/// A term, compared with what was observed. Each comparison counts once; a breach is a fact of an incident.
class JudgedTerm {
 public:
  /// `subject`: of sentences, `Filter/points`.
  JudgedTerm(Term term, std::string subject, Incidents& incidents)
      : term_(std::move(term)), subject_(std::move(subject)), incidents_(&incidents) {}

  /// Compares an observed value in the unit of the limit.
  void compare(std::int64_t observed, Time at) {
    observe(observed);
    const bool same = state_ == observed && traits().comparison == Comparison::equal;
    state_ = observed;
    if (holds(observed, term_.limit)) return hold();
    fail(breach(observed, term_.limit, at), same);
  }
  /// Compares the distances between a sample and those before it, the nearest one first, with the limits
  /// of a minimum_distance. Together they are one comparison.
  void compare_distances(const std::vector<Duration>& distances, Time at) {
    if (distances.empty()) return;
    observe(distances.front().count());
    for (std::size_t k = 0; k < distances.size(); ++k) {
      const std::int64_t observed = distances[k].count(), limit = k == 0 ? term_.limit : term_.further[k - 1];
      if (!holds(observed, limit)) return fail(breach(observed, limit, at, k + 2));
    }
    hold();
  }
  /// A duration from `since` that has not ended by `until`, and exceeds its limit.
  void judge_lasting(Time since, Time until) {
    const Duration length = until - since;
    observe(length.count());
    Fact fact = lasting(since, length);
    if (clause() == Clause::budget)
      fact.sentence = program::concat(subject_, " has run for ", shown(length.count()),
                                      " without an end, budget ", limit_text());
    fail(std::move(fact));
  }
  /// It has ended, not earlier than when it was judged.
  void judge_ended(Time since, Duration length) {
    observe(length.count());
    const Fact breach = lasting(since, length);
    if (first_->at == breach.at && first_->since == since) first_ = breach;
    incidents_->add(breach, false);
  }
  /// Shows the value, without a comparison.
  void observe(std::int64_t value) {
    const Comparison comparison = traits().comparison;
    const bool nearer = !extreme_ || (comparison == Comparison::at_least ? value < *extreme_
                                      : comparison == Comparison::equal  ? *extreme_ == term_.limit
                                                                         : value > *extreme_);
    if (nearer) extreme_ = value;
  }
  /// Counts a comparison that holds.
  void hold() { ++checked_; }
  /// Counts one that does not. `continues`: a state that was broken before, which begins no incident.
  void fail(Fact breach, bool continues = false) {
    ++checked_;
    ++broken_;
    if (!continues) incidents_->add(breach);
    if (!first_ || breach.at < first_->at) first_ = std::move(breach);
  }
  /// Compares by other means; `observed` completes the sentence.
  void judge(bool holds, const std::string& observed, Time at, bool continues = false) {
    constexpr std::size_t kMostSaid = 1000;
    if (holds) return hold();
    std::string said = subject_ + " " + observed;
    if (clause() == Clause::serves || clause() == Clause::publishers)
      continues = said_.size() >= kMostSaid || !said_.insert(said).second;
    fail({traits().role, at, std::move(said), this}, continues);
  }

  [[nodiscard]] Clause clause() const { return term_.clause; }
  [[nodiscard]] const Term& term() const { return term_; }
  [[nodiscard]] const std::string& subject() const { return subject_; }
  [[nodiscard]] std::uint64_t checked() const { return checked_; }
  [[nodiscard]] std::uint64_t broken() const { return broken_; }
  [[nodiscard]] const std::optional<Fact>& first() const { return first_; }
  /// `5.000 ms`, `fifo:80`.
  [[nodiscard]] std::string limit_text() const {
    const Unit unit = traits().unit;
    if (unit == Unit::policy) return to_string(term_.policy);
    if (unit == Unit::processors) return program::joined(term_.processors, ",");
    return unit == Unit::stated ? "as stated" : shown(term_.limit);
  }
  /// The observed value that came nearest to breaking the term, or broke it most; empty: it is no number.
  [[nodiscard]] std::string extreme_text() const { return extreme_ ? shown(*extreme_) : ""; }
  [[nodiscard]] nlohmann::json json() const {
    nlohmann::json limit = stored(term_.limit);
    const Unit unit = traits().unit;
    if (unit == Unit::policy) limit = to_string(term_.policy);
    if (unit == Unit::processors) limit = term_.processors;
    if (unit == Unit::stated) limit = nullptr;  // a list
    return {{"term", to_string(clause())},
            {"limit", limit},
            {"from", to_string(term_.origin)},
            {"checked", checked_},
            {"broken", broken_},
            {"observed", extreme_ ? stored(*extreme_) : nlohmann::json()}};
  }
  /// The key of the clause without its unit.
  [[nodiscard]] std::string title() const {
    std::string text(to_string(clause()));
    if (text.ends_with("_ms")) text.resize(text.size() - 3);
    std::ranges::replace(text, '_', ' ');
    return text;
  }

 private:
  [[nodiscard]] const ClauseTraits& traits() const { return traits_of(term_.clause); }
  /// A value in the unit of the limit.
  [[nodiscard]] nlohmann::json stored(std::int64_t value) const {
    return traits().unit == Unit::ms ? nlohmann::json(to_ms(Duration(value))) : nlohmann::json(value);
  }
  [[nodiscard]] std::string shown(std::int64_t value) const {
    return traits().unit == Unit::ms ? shown_ms(Duration(value)) : std::to_string(value);
  }
  [[nodiscard]] bool holds(std::int64_t observed, std::int64_t limit) const {
    const Comparison comparison = traits().comparison;
    if (comparison == Comparison::equal) return observed == limit;
    return comparison == Comparison::at_most ? observed <= limit : observed >= limit;
  }
  [[nodiscard]] std::string sentence(std::int64_t observed, std::int64_t limit,
                                     const std::string& deed) const {
    const std::string what = traits().role == Role::bound ? "bound" : title();
    return subject_ + deed + shown(observed) + ", " + what + " " + shown(limit) + " (" +
           to_string(term_.origin) + ")";
  }
  /// `samples`: that together exceed the limit of a minimum_distance.
  [[nodiscard]] Fact breach(std::int64_t observed, std::int64_t limit, Time at,
                            std::size_t samples = 2) const {
    const std::string deed =
        samples > 2 ? program::concat(" got ", samples, " samples within ") : traits().deed;
    Fact fact{traits().role, at, sentence(observed, limit, deed), this};
    if (traits().unit == Unit::ms) fact.since = at - Duration(std::max(observed, limit));
    return fact;
  }
  /// Of a duration that exceeds its limit from the returned instant on.
  [[nodiscard]] Fact lasting(Time since, Duration length) const {
    const std::string said = sentence(length.count(), term_.limit, traits().deed);
    return {traits().role, since + Duration(term_.limit), said, this, since, since + length};
  }

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
  [[nodiscard]] JudgedTerm* find(Clause clause) {
    const auto at = std::ranges::find(terms, clause, &JudgedTerm::clause);
    return at == terms.end() ? nullptr : &*at;
  }
  /// Compares with the term, if there is one.
  void compare(Clause clause, std::int64_t observed, Time at) {
    if (JudgedTerm* const term = find(clause)) term->compare(observed, at);
  }
};

/// All terms of a contract, their verdicts and the incidents.
class Judge {
 public:
  /// `topics`: that callbacks of the contract publish. `realtime`: the real-time clock minus that of Time.
  Judge(const Contract& contract, const std::vector<std::string>& topics, Duration realtime)
      : incidents_(realtime) {
    for (const CallbackContract& callback : contract.callbacks)
      add(Kind::callback, callback.name(), "no such callback has run", callback.terms);
    for (const Group& chain : contract.chains)
      add(Kind::chain, chain.name, "no data of its sources reached its end", chain.terms);
    for (const Group& thread : contract.threads)
      add(Kind::thread, thread.name, "no thread ran its callbacks", thread.terms);
    for (const std::string& topic : topics)
      add(Kind::topic, topic, "it has no publisher", {{Clause::publishers}});
  }
  Judge(const Judge&) = delete;
  Judge& operator=(const Judge&) = delete;

  /// In the order of the contract.
  [[nodiscard]] std::vector<Subject>& all(Kind kind) { return subjects_[static_cast<std::size_t>(kind)]; }
  [[nodiscard]] Subject& callback(std::uint32_t c) { return all(Kind::callback)[c]; }
  /// The only term of a topic.
  [[nodiscard]] JudgedTerm& publishers(std::uint32_t t) { return all(Kind::topic)[t].terms.front(); }
  [[nodiscard]] Incidents& incidents() { return incidents_; }
  /// Whether any term is broken.
  [[nodiscard]] bool broken() const { return incidents_.count() > 0; }
  /// What broke first in the most severe incident; empty: there is none.
  [[nodiscard]] std::string incident() const {
    return broken() ? std::ranges::min_element(incidents_.kept(), {}, &Incident::severity)->text() : "";
  }

  /// `lossy`: lost events make terms that are not broken unobservable.
  [[nodiscard]] program::Table table(bool lossy) const {
    program::Table table("Contract", {"of", "term", "limit", "observed", "verdict", "reason"});
    each([&](const Subject& of, const JudgedTerm& term) {
      const auto& [verdict, reason] = judged(of, term, lossy);
      const std::string kind = of.kind == Kind::callback ? "" : to_string(of.kind) + std::string(" ");
      table.add_row({kind + of.name, term.title(), term.limit_text(), term.extreme_text(), verdict, reason});
    });
    return table;
  }
  [[nodiscard]] nlohmann::json json(bool lossy) const {
    nlohmann::json terms = nlohmann::json::array(), incidents = nlohmann::json::array();
    each([&](const Subject& of, const JudgedTerm& term) {
      const auto& [verdict, reason] = judged(of, term, lossy);
      nlohmann::json& row = terms.emplace_back(term.json());
      row[to_string(of.kind)] = of.name;
      row["verdict"] = to_string(verdict);
      row["reason"] = reason;
    });
    for (const Incident& incident : incidents_.kept()) incidents.push_back(incident.json());
    return {{"terms", terms}, {"incident", incident()}, {"incidents", incidents}};
  }

 private:
  void add(Kind kind, const std::string& name, const char* unseen, const std::vector<Term>& terms) {
    Subject& subject = all(kind).emplace_back(Subject{kind, name, unseen});
    for (const Term& term : terms) subject.terms.emplace_back(term, name, incidents_);
  }
  void each(const auto& visit) const {
    for (const std::vector<Subject>& subjects : subjects_)
      for (const Subject& subject : subjects)
        for (const JudgedTerm& term : subject.terms) visit(subject, term);
  }
  /// The verdict and its reason.
  [[nodiscard]] std::pair<Verdict, std::string> judged(const Subject& of, const JudgedTerm& term,
                                                       bool lossy) const {
    const std::string checked = program::concat(" of ", term.checked());
    if (const std::optional<Fact>& first = term.first())
      return {Verdict::broken,
              program::concat(term.broken(), checked, "; first at ",
                              time_of_day(first->at, incidents_.realtime()), ": ", first->sentence)};
    if (!of.seen) return {Verdict::not_observable, of.unseen};
    if (term.checked() == 0) return {Verdict::not_observable, "no event tells it"};
    if (lossy) return {Verdict::not_observable, "events were lost"};
    return {Verdict::held, program::concat(term.checked(), checked)};
  }

  Incidents incidents_;
  std::array<std::vector<Subject>, enum_texts(Kind{}).size()> subjects_;
};

}  // namespace hotpath::watch
