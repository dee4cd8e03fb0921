// SPDX-License-Identifier: Apache-2.0
#include "watch/judged_term.hpp"

#include <algorithm>
#include <utility>

#include "program/text.hpp"
#include "watch/thread_facts.hpp"

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
  if (term_.clause == Clause::processors) return shown_processors(static_cast<std::uint64_t>(value));
  return program::concat(value);
}

std::string JudgedTerm::limit_text() const {
  const Unit unit = traits_of(term_.clause).unit;
  if (unit == Unit::policy) return to_string(term_.policy);
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

Breach JudgedTerm::breach(std::int64_t observed, Time at, std::size_t further,
                          std::optional<ThreadKey> thread) const {
  Breach breach{at, sentence(observed, further), this};
  if (!is_duration(term_.clause)) return breach;
  breach.excess = std::chrono::abs(Duration(observed - limit(further)));
  breach.since = at - Duration(std::max(observed, limit(further)));
  breach.until = at;
  breach.thread = thread;
  return breach;
}

void JudgedTerm::compare(std::int64_t observed, Time at, Incidents& incidents,
                         std::optional<ThreadKey> thread) {
  const Comparison comparison = comparison_of(term_.clause);
  observe(observed);
  const bool continues = comparison == Comparison::equal && state_ == observed;
  state_ = observed;
  if (holds(comparison, observed, term_.limit)) return hold();
  count(breach(observed, at, 0, thread), continues, incidents);
}

/// A late sample shortens the distance to the next one, and by as much the longer distances that begin
/// with it. So the excesses of consecutive samples add up, but those of longer distances do not.
void JudgedTerm::compare_distances(const std::vector<Duration>& distances, Time at, Incidents& incidents) {
  if (distances.empty()) return;
  observe(distances.front().count());
  std::optional<Breach> first;
  Duration excess = latest_ && !over_ ? latest_->excess : Duration::zero();
  for (std::size_t k = 0; k < distances.size(); ++k) {
    const std::int64_t observed = distances[k].count();
    if (holds(Comparison::at_least, observed, limit(k))) continue;
    Breach found = breach(observed, at, k, {});
    excess = k == 0 ? excess + found.excess : std::max(excess, found.excess);
    if (!first) first = std::move(found);
  }
  if (!first) return hold();
  count(*std::move(first), false, incidents);
  latest_->excess = excess;
}

void JudgedTerm::judge_lasting(Time since, Time until, Incidents& incidents) {
  const Duration limit(term_.limit), length = until - since;
  observe(length.count());
  std::string said = sentence(length.count());
  if (clause() == Clause::budget)
    said = program::concat(subject_, " has run for ", shown(length.count()), " without an end, budget ",
                           limit_text());
  count({since + limit, std::move(said), this, length - limit, since, until}, false, incidents);
  latest_->excess -= length - limit;  // its end tells
}

void JudgedTerm::judge_ended(Time since, Duration length, Incidents& incidents,
                             std::optional<ThreadKey> thread) {
  const Duration limit(term_.limit);
  observe(length.count());
  const Breach breach{since + limit, sentence(length.count()), this,  length - limit,
                      since,         since + length,           thread};
  if (first_->continues(breach)) first_ = breach;
  latest_->excess += breach.excess;
  latest_->until = breach.until;
  incidents.correct(role_of(clause()), breach);
}

void JudgedTerm::judge(bool holds, const std::string& observed, Time at, Incidents& incidents,
                       bool continues) {
  constexpr std::size_t kMostSaid = 1000;
  if (holds) return hold();
  Breach breach{at, subject_ + " " + observed, this};
  if (clause() == Clause::serves || clause() == Clause::publishers)
    continues = said_.size() >= kMostSaid || !said_.insert(breach.sentence).second;
  count(std::move(breach), continues, incidents);
}

void JudgedTerm::restate(const std::string& observed, Time at, Incidents& incidents) const {
  incidents.add(role_of(clause()), {at, subject_ + " " + observed, this});
}

void JudgedTerm::count(Breach breach, bool continues, Incidents& incidents) {
  ++checked_;
  ++broken_;
  if (!continues) incidents.add(role_of(term_.clause), breach);
  if (!latest_ || std::exchange(over_, false)) {
    latest_ = breach;
  } else {
    latest_->excess += breach.excess;
    latest_->until = breach.until;
  }
  if (!first_ || breach.at < first_->at) first_ = std::move(breach);
}

double JudgedTerm::nearness() const {
  const Comparison comparison = comparison_of(term_.clause);
  if (!extreme_ || !is_duration(term_.clause) || comparison == Comparison::equal) return broken_ > 0 ? 2 : -1;
  if (broken_ > 0 && holds(comparison, *extreme_, term_.limit)) return 2;  // by a shorter wait, for example
  const auto limit = static_cast<double>(term_.limit), value = static_cast<double>(*extreme_);
  if (comparison == Comparison::at_least) return value > 0 ? limit / value : 2;
  return limit > 0 ? value / limit : value > 0 ? 2 : 0;
}

nlohmann::json JudgedTerm::json() const {
  const auto number = [&](std::int64_t value) -> nlohmann::json {
    if (is_duration(term_.clause)) return to_ms(Duration(value));
    if (term_.clause == Clause::processors) return processor_list(static_cast<std::uint64_t>(value));
    return value;
  };
  nlohmann::json limit;  // null: a list that the contract states
  if (term_.clause == Clause::policy) {
    limit = to_string(term_.policy);
  } else if (limit_text() != "as stated") {
    limit = number(term_.limit);
  }
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

double Subject::nearness() const {
  double nearest = -1;
  for (const JudgedTerm& term : terms) nearest = std::max(nearest, term.nearness());
  return nearest;
}

void Subject::compare(Clause clause, std::int64_t observed, Time at, Incidents& incidents) {
  if (JudgedTerm* const term = find(clause)) term->compare(observed, at, incidents);
}

}  // namespace hotpath::watch
