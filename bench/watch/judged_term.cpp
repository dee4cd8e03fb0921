// SPDX-License-Identifier: Apache-2.0
#include "watch/judged_term.hpp"

#include <algorithm>
#include <utility>

#include "program/text.hpp"

namespace hotpath::watch {

namespace {

Comparison comparison_of(Clause clause) { return traits_of(clause).comparison; }

bool holds(Comparison comparison, std::int64_t observed, std::int64_t limit) {
  if (comparison == Comparison::equal) return observed == limit;
  return comparison == Comparison::at_most ? observed <= limit : observed >= limit;
}

bool is_duration(Clause clause) { return traits_of(clause).unit == Unit::ms; }

}  // namespace

std::string JudgedTerm::shown(std::int64_t value) const {
  if (is_duration(term_.clause)) return program::fixed(to_ms(Duration(value)), 3) + " ms";
  return program::concat(value);
}

std::string JudgedTerm::limit_text() const {
  const Unit unit = traits_of(term_.clause).unit;
  if (unit == Unit::policy) return to_string(term_.policy);
  if (unit == Unit::processors) return program::joined(term_.processors, ",");
  return unit == Unit::stated ? "as stated" : shown(term_.limit);
}

std::string JudgedTerm::title() const {
  std::string text(to_string(term_.clause));
  if (text.ends_with("_ms")) text.resize(text.size() - 3);
  std::ranges::replace(text, '_', ' ');
  return text;
}

std::int64_t JudgedTerm::limit(std::size_t further) const {
  return further == 0 ? term_.limit : term_.further[further - 1];
}

std::string JudgedTerm::sentence(std::int64_t observed, std::size_t further) const {
  const std::string deed_text =
      further == 0 ? traits_of(term_.clause).deed + shown(observed)
                   : program::concat(" got ", further + 2, " samples within ", shown(observed));
  return subject_ + deed_text + ", " + (role_of(term_.clause) == Role::bound ? "bound" : title()) + " " +
         shown(limit(further)) + " (" + std::string(to_string(term_.origin)) + ")";
}

void JudgedTerm::observe(std::int64_t value) {
  const Comparison comparison = comparison_of(term_.clause);
  const bool nearer = !extreme_ || (comparison == Comparison::at_least ? value < *extreme_
                                    : comparison == Comparison::equal  ? *extreme_ == term_.limit
                                                                       : value > *extreme_);
  if (nearer) extreme_ = value;
}

Fact JudgedTerm::breach(std::int64_t observed, Time at, std::size_t further) const {
  Fact fact{role_of(clause()), at, sentence(observed, further), this};
  if (is_duration(clause())) fact.since = at - Duration(std::max(observed, limit(further)));
  return fact;
}

void JudgedTerm::compare(std::int64_t observed, Time at, Incidents& incidents) {
  const Comparison comparison = comparison_of(term_.clause);
  observe(observed);
  const bool continues = comparison == Comparison::equal && state_ == observed;
  state_ = observed;
  if (holds(comparison, observed, term_.limit)) return hold();
  fail(breach(observed, at), incidents, continues);
}

void JudgedTerm::compare_distances(const std::vector<Duration>& distances, Time at, Incidents& incidents) {
  if (distances.empty()) return;
  observe(distances.front().count());
  for (std::size_t k = 0; k < distances.size(); ++k) {
    const std::int64_t observed = distances[k].count();
    if (!holds(Comparison::at_least, observed, limit(k))) return fail(breach(observed, at, k), incidents);
  }
  hold();
}

Fact JudgedTerm::lasting(Time since, Duration length, std::string sentence) const {
  return {role_of(clause()), since + Duration(term_.limit), std::move(sentence), this, since, since + length};
}

void JudgedTerm::judge_lasting(Time since, Time until, Incidents& incidents) {
  const Duration length = until - since;
  observe(length.count());
  std::string said = sentence(length.count());
  if (clause() == Clause::budget)
    said = program::concat(subject_, " has run for ", shown(length.count()), " without an end, budget ",
                           limit_text());
  fail(lasting(since, length, std::move(said)), incidents);
}

void JudgedTerm::judge_ended(Time since, Duration length, Incidents& incidents) {
  observe(length.count());
  const Fact breach = lasting(since, length, sentence(length.count()));
  if (first_->at == breach.at && first_->since == since) first_ = breach;
  incidents.add(breach, false);
}

void JudgedTerm::judge(bool holds, const std::string& observed, Time at, Incidents& incidents,
                       bool continues) {
  constexpr std::size_t kMostSaid = 1000;
  if (holds) return hold();
  std::string said = subject_ + " " + observed;
  if (clause() == Clause::serves || clause() == Clause::publishers)
    continues = said_.size() >= kMostSaid || !said_.insert(said).second;
  fail({role_of(clause()), at, std::move(said), this}, incidents, continues);
}

void JudgedTerm::fail(Fact breach, Incidents& incidents, bool continues) {
  ++checked_;
  ++broken_;
  if (!continues) incidents.add(breach);
  if (!first_ || breach.at < first_->at) first_ = std::move(breach);
}

nlohmann::json JudgedTerm::json() const {
  const auto number = [&](std::int64_t value) -> nlohmann::json {
    if (is_duration(term_.clause)) return to_ms(Duration(value));
    return value;
  };
  nlohmann::json limit = number(term_.limit);
  const Unit unit = traits_of(term_.clause).unit;
  if (unit == Unit::policy) limit = to_string(term_.policy);
  if (unit == Unit::processors) limit = term_.processors;
  if (unit == Unit::stated) limit = nullptr;  // a list
  return {{"term", to_string(term_.clause)},
          {"limit", limit},
          {"from", to_string(term_.origin)},
          {"checked", checked_},
          {"broken", broken_},
          {"observed", extreme_ ? number(*extreme_) : nlohmann::json()}};
}

Subject::Subject(std::string of_kind, std::string named, const std::vector<Term>& stated, const char* why)
    : kind(std::move(of_kind)), name(std::move(named)), unseen(why) {
  for (const Term& term : stated) terms.emplace_back(term, name);
}

JudgedTerm* Subject::find(Clause clause) {
  const auto at = std::ranges::find(terms, clause, &JudgedTerm::clause);
  return at == terms.end() ? nullptr : &*at;
}

void Subject::compare(Clause clause, std::int64_t observed, Time at, Incidents& incidents) {
  if (JudgedTerm* const term = find(clause)) term->compare(observed, at, incidents);
}

}  // namespace hotpath::watch
