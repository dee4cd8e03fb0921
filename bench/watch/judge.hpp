// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <ctime>
#include <deque>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "program/table.hpp"
#include "program/text.hpp"
#include "watch/contract.hpp"

namespace hotpath::watch {

/// Local time, `12:00:01.123`. `realtime`: the real-time clock minus that of Time.
[[nodiscard]] inline std::string time_of_day(Time at, Duration realtime) {
  const auto ms = std::chrono::floor<std::chrono::milliseconds>(at.time_since_epoch() + realtime);
  const auto s = std::chrono::floor<std::chrono::seconds>(ms);
  const std::time_t seconds = s.count();
  std::tm local{};
  localtime_r(&seconds, &local);
  return program::text("%02d:%02d:%02d.%03d", local.tm_hour, local.tm_min, local.tm_sec,
                       static_cast<int>((ms - s).count()));
}

/// `5.000 ms`.
[[nodiscard]] inline std::string shown_ms(Duration duration) {
  return program::fixed(to_ms(duration), 3) + " ms";
}

class JudgedTerm;

/// What was observed of a system at one instant.
struct Fact {
  Role role;
  Time at{};
  std::string sentence;              ///< `Filter ran 6.1 ms, budget 5.0 ms (measured)`.
  const JudgedTerm* term = nullptr;  ///< That is broken; its lifetime is that of the contract.
  Time since = at, until = at;       ///< Begin and end of what the sentence tells.

  /// In this order a fact is what broke first: by severity, but terms by time.
  [[nodiscard]] std::tuple<Role, Time, Role> order() const {
    const bool is_term = role >= Role::assumption && role != Role::circumstance;
    return {is_term ? Role::assumption : role, at, role};
  }
};

/// Facts: what broke first, and what else was observed meanwhile.
class Incident {
 public:
  /// `number`: counts the incidents of a system from 1. `realtime`: for times of day.
  Incident(std::uint64_t number, Duration realtime) : number_(number), realtime_(realtime) {}

  /// A broken term, of which only the first breach is a fact, or what is more severe. `is_new`: false: a
  /// breach that was added before its end has ended.
  void add(Fact breach, bool is_new) {
    last_ = std::max(last_, breach.until);
    breaches_ += is_new ? 1 : 0;
    const auto same =
        std::ranges::find_if(facts_, [&](const Fact& f) { return f.term && f.term == breach.term; });
    const bool again = same != facts_.end();
    if (again && same->order() < breach.order()) return;
    const bool is_first = facts_.empty() || breach.order() < first().order() || (again && &*same == &first());
    if (again) facts_.erase(same);
    if (is_first) std::erase_if(facts_, [](const Fact& f) { return f.role == Role::circumstance; });
    described_ = described_ && !is_first;
    if (is_first || breach.term || facts_.size() < kMostFacts) insert(std::move(breach));
  }
  /// Adds the circumstances of what broke first.
  void describe(const std::vector<Fact>& circumstances) {
    for (const Fact& fact : circumstances) insert(fact);
    described_ = true;
  }
  /// Whether it has the circumstances of what broke first so far.
  [[nodiscard]] bool is_described() const { return described_; }

  [[nodiscard]] std::uint64_t number() const { return number_; }
  [[nodiscard]] Time last() const { return last_; }
  /// The most severe fact, or else the first broken term.
  [[nodiscard]] const Fact& first() const { return *std::ranges::min_element(facts_, {}, &Fact::order); }
  /// Less: it is more severe, or began earlier.
  [[nodiscard]] auto severity() const { return first().order(); }
  /// The instant and the sentence of what broke first.
  [[nodiscard]] std::string text() const { return stated(first()); }
  /// The same of all other facts, in the order of time.
  [[nodiscard]] std::vector<std::string> facts() const {
    std::vector<std::string> others;
    for (const Fact& fact : facts_)
      if (&fact != &first()) others.push_back(stated(fact));
    return others;
  }
  [[nodiscard]] nlohmann::json json() const {
    return {{"number", number_},     {"at", time_of_day(first().at, realtime_)},
            {"breaches", breaches_}, {"last", time_of_day(last_, realtime_)},
            {"incident", text()},    {"facts", facts()}};
  }

 private:
  static constexpr std::size_t kMostFacts = 20;  // besides broken terms

  void insert(Fact fact) {
    facts_.insert(std::ranges::upper_bound(facts_, fact.at, {}, &Fact::at), std::move(fact));
  }
  [[nodiscard]] std::string stated(const Fact& fact) const {
    return time_of_day(fact.at, realtime_) + " " + fact.sentence;
  }

  std::uint64_t number_;
  Duration realtime_;        // of its beginning: somebody may set the clock later
  std::vector<Fact> facts_;  // in the order of time
  Time last_ = Time::min();
  std::uint64_t breaches_ = 0;
  bool described_ = false;
};

/// The incidents of a system: an incident ends when no term breaks for kPause.
struct Incidents {
  static constexpr Duration kPause = std::chrono::seconds(2);
  static constexpr std::size_t kMost = 100;

  void add(Fact breach, bool is_new = true) {
    if (kept.empty() || breach.at > kept.back().last() + kPause) {
      kept.emplace_back(count() + 1, realtime);
      if (kept.size() > kMost) kept.erase(kept.begin() + 1);
    }
    kept.back().add(std::move(breach), is_new);
  }
  [[nodiscard]] std::uint64_t count() const { return kept.empty() ? 0 : kept.back().number(); }

  Duration realtime{};             ///< The real-time clock minus that of Time, as incidents begin.
  std::deque<Incident> kept = {};  ///< The first one and the latest kMost - 1, in the order of time.
};

/// A term, compared with what was observed. Each comparison counts once; a breach is a fact of an incident.
class JudgedTerm {
 public:
  /// `subject`: of sentences, `Filter/points`.
  JudgedTerm(Term term, std::string subject, Incidents& incidents)
      : term_(std::move(term)), subject_(std::move(subject)), incidents_(&incidents) {}

  /// Compares an observed value in the unit of the limit.
  void compare(std::int64_t observed, Time at) {
    observe(observed);
    const bool same = std::exchange(state_, observed) == observed;
    if (holds(observed, term_.limit)) return hold();
    fail(breach(observed, term_.limit, traits().deed, at), same && traits().comparison == Comparison::equal);
  }
  /// Compares the distances between a sample and those before it, the nearest one first, with the limits
  /// of a minimum_distance. Together they are one comparison.
  void compare_distances(const std::vector<Duration>& distances, Time at) {
    if (distances.empty()) return;
    observe(distances.front().count());
    for (std::size_t k = 0; k < distances.size(); ++k) {
      const std::int64_t observed = distances[k].count(), limit = k == 0 ? term_.limit : term_.further[k - 1];
      if (holds(observed, limit)) continue;
      const std::string several = program::concat(" got ", k + 2, " samples within ");
      return fail(breach(observed, limit, k > 0 ? several : traits().deed, at));
    }
    hold();
  }
  /// A duration from `since` that has not ended by `until`, and exceeds its limit.
  void judge_lasting(Time since, Time until) {
    observe((until - since).count());
    Fact fact = lasting(since, until);
    if (clause() == Clause::budget)
      fact.sentence = program::concat(subject_, " has run for ", shown_ms(until - since),
                                      " without an end, budget ", limit_text());
    fail(std::move(fact));
  }
  /// It has ended, not earlier than when it was judged.
  void judge_ended(Time since, Duration length) {
    observe(length.count());
    const Fact breach = lasting(since, since + length);
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
    const nlohmann::json limit = stored_limit();
    if (limit.is_number()) return shown(term_.limit);
    if (limit.is_array()) return program::joined(limit, ",");
    return limit.is_null() ? "as stated" : limit.get<std::string>();
  }
  /// The observed value that came nearest to breaking the term, or broke it most; empty: it is no number.
  [[nodiscard]] std::string extreme_text() const { return extreme_ ? shown(*extreme_) : ""; }
  [[nodiscard]] nlohmann::json json() const {
    return {{"term", to_string(clause())},
            {"limit", stored_limit()},
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
  /// Null: a list.
  [[nodiscard]] nlohmann::json stored_limit() const {
    const Unit unit = traits().unit;
    if (unit == Unit::policy) return to_string(term_.policy);
    if (unit == Unit::processors) return term_.processors;
    return unit == Unit::stated ? nlohmann::json() : stored(term_.limit);
  }
  [[nodiscard]] bool holds(std::int64_t observed, std::int64_t limit) const {
    const Comparison comparison = traits().comparison;
    if (comparison == Comparison::equal) return observed == limit;
    return comparison == Comparison::at_most ? observed <= limit : observed >= limit;
  }
  [[nodiscard]] Fact breach(std::int64_t observed, std::int64_t limit, const std::string& deed,
                            Time at) const {
    const std::string name = traits().role == Role::bound ? "bound" : title();
    Fact fact{traits().role, at,
              subject_ + deed + shown(observed) + ", " + name + " " + shown(limit) + " (" +
                  to_string(term_.origin) + ")",
              this};
    if (traits().unit == Unit::ms) fact.since = at - Duration(std::max(observed, limit));
    return fact;
  }
  /// Of a duration that exceeds its limit some time before `until`.
  [[nodiscard]] Fact lasting(Time since, Time until) const {
    Fact fact = breach((until - since).count(), term_.limit, traits().deed, since + Duration(term_.limit));
    fact.since = since;
    fact.until = until;
    return fact;
  }

  Term term_;
  std::string subject_;
  Incidents* incidents_;
  std::uint64_t checked_ = 0, broken_ = 0;
  std::optional<std::int64_t> extreme_, state_;  // `state_`: the latest value
  std::set<std::string> said_;                   // of terms about what exists
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
      : incidents_{realtime} {
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
  /// What broke first in the most severe incident; empty: no term is broken.
  [[nodiscard]] std::string incident() const {
    const std::deque<Incident>& all = incidents_.kept;
    return all.empty() ? "" : std::ranges::min_element(all, {}, &Incident::severity)->text();
  }

  /// `lossy`: lost events make terms that are not broken unobservable.
  [[nodiscard]] program::Table table(bool lossy) const {
    program::Table table("Contract", {"of", "term", "limit", "observed", "verdict", "reason"});
    each(lossy, [&](const Subject& of, const JudgedTerm& term, const char* verdict, const std::string& why) {
      const std::string kind = of.kind == Kind::callback ? "" : to_string(of.kind) + std::string(" ");
      table.add_row({kind + of.name, term.title(), term.limit_text(), term.extreme_text(), verdict, why});
    });
    return table;
  }
  [[nodiscard]] nlohmann::json json(bool lossy) const {
    nlohmann::json terms = nlohmann::json::array(), incidents = nlohmann::json::array();
    each(lossy, [&](const Subject& of, const JudgedTerm& term, const char* verdict, const std::string& why) {
      nlohmann::json& row = terms.emplace_back(term.json());
      row.update({{to_string(of.kind), of.name}, {"verdict", verdict}, {"reason", why}});
    });
    for (const Incident& incident : incidents_.kept) incidents.push_back(incident.json());
    return {{"terms", terms}, {"incident", incident()}, {"incidents", incidents}};
  }

 private:
  void add(Kind kind, const std::string& name, const char* unseen, const std::vector<Term>& terms) {
    Subject& subject = all(kind).emplace_back(Subject{kind, name, unseen});
    for (const Term& term : terms) subject.terms.emplace_back(term, name, incidents_);
  }
  /// Visits each term with its verdict and the reason.
  void each(bool lossy, const auto& visit) const {
    for (const std::vector<Subject>& subjects : subjects_)
      for (const Subject& of : subjects)
        for (const JudgedTerm& term : of.terms) {
          const std::string checked = program::concat(" of ", term.checked());
          if (const std::optional<Fact>& first = term.first())
            visit(of, term, "broken",
                  program::concat(term.broken(), checked, "; first at ",
                                  time_of_day(first->at, incidents_.realtime), ": ", first->sentence));
          else if (of.seen && term.checked() > 0 && !lossy)
            visit(of, term, "held", program::concat(term.checked(), checked));
          else
            visit(of, term, "not observable",
                  !of.seen              ? of.unseen
                  : term.checked() == 0 ? "no event tells it"
                                        : "events were lost");
        }
  }

  Incidents incidents_;
  std::array<std::vector<Subject>, enum_texts(Kind{}).size()> subjects_;
};

}  // namespace hotpath::watch
