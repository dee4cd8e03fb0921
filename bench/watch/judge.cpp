// SPDX-License-Identifier: Apache-2.0
#include "watch/judge.hpp"

#include <algorithm>
#include <utility>

#include "program/text.hpp"

namespace hotpath::watch {

namespace {

enum class Verdict : std::uint8_t { held, broken, not_observable };
constexpr auto enum_texts(Verdict) {
  return std::to_array<EnumText<Verdict>>(
      {{Verdict::held, "held"}, {Verdict::broken, "broken"}, {Verdict::not_observable, "not observable"}});
}

bool is_duration(Clause clause) { return traits_of(clause).unit == Unit::ms; }

nlohmann::json stored(Clause clause, std::int64_t value) {
  if (is_duration(clause)) return to_ms(Duration(value));
  return value;
}

}  // namespace

std::string JudgedTerm::shown(std::int64_t value) const {
  return is_duration(clause()) ? shown_ms(Duration(value)) : program::concat(value);
}

std::string JudgedTerm::limit_text() const {
  const Unit unit = traits_of(clause()).unit;
  if (unit == Unit::policy) return to_string(term_.policy);
  if (unit == Unit::processors) return program::joined(term_.processors, ",");
  return unit == Unit::stated ? "as stated" : shown(term_.limit);
}

std::string JudgedTerm::title() const {
  std::string text(to_string(clause()));
  if (text.ends_with("_ms")) text.resize(text.size() - 3);
  std::ranges::replace(text, '_', ' ');
  return text;
}

bool JudgedTerm::holds(std::int64_t observed, std::int64_t limit) const {
  const Comparison comparison = traits_of(clause()).comparison;
  if (comparison == Comparison::equal) return observed == limit;
  return comparison == Comparison::at_most ? observed <= limit : observed >= limit;
}

std::string JudgedTerm::sentence(std::int64_t observed, std::int64_t limit, std::string deed) const {
  const std::string what = traits_of(clause()).role == Role::bound ? "bound" : title();
  return subject_ + deed + shown(observed) + ", " + what + " " + shown(limit) + " (" +
         to_string(term_.origin) + ")";
}

void JudgedTerm::observe(std::int64_t value) {
  const Comparison comparison = traits_of(clause()).comparison;
  const bool nearer = !extreme_ || (comparison == Comparison::at_least ? value < *extreme_
                                    : comparison == Comparison::equal  ? *extreme_ == term_.limit
                                                                       : value > *extreme_);
  if (nearer) extreme_ = value;
}

Fact JudgedTerm::breach(std::int64_t observed, std::int64_t limit, Time at, std::size_t samples) const {
  const ClauseTraits& traits = traits_of(clause());
  const std::string deed = samples > 2 ? program::concat(" got ", samples, " samples within ") : traits.deed;
  Fact fact{traits.role, at, sentence(observed, limit, deed), this};
  if (is_duration(clause())) fact.since = at - Duration(std::max(observed, limit));
  return fact;
}

void JudgedTerm::compare(std::int64_t observed, Time at) {
  observe(observed);
  const bool same = state_ == observed && traits_of(clause()).comparison == Comparison::equal;
  state_ = observed;
  if (holds(observed, term_.limit)) return hold();
  fail(breach(observed, term_.limit, at), same);
}

void JudgedTerm::compare_distances(const std::vector<Duration>& distances, Time at) {
  if (distances.empty()) return;
  observe(distances.front().count());
  for (std::size_t k = 0; k < distances.size(); ++k) {
    const std::int64_t observed = distances[k].count(), limit = k == 0 ? term_.limit : term_.further[k - 1];
    if (!holds(observed, limit)) return fail(breach(observed, limit, at, k + 2));
  }
  hold();
}

Fact JudgedTerm::lasting(Time since, Duration length) const {
  const ClauseTraits& traits = traits_of(clause());
  return {traits.role,
          since + Duration(term_.limit),
          sentence(length.count(), term_.limit, traits.deed),
          this,
          since,
          since + length};
}

void JudgedTerm::judge_lasting(Time since, Time until) {
  const Duration length = until - since;
  observe(length.count());
  Fact fact = lasting(since, length);
  if (clause() == Clause::budget)
    fact.sentence = program::concat(subject_, " has run for ", shown(length.count()),
                                    " without an end, budget ", limit_text());
  fail(std::move(fact));
}

void JudgedTerm::judge_ended(Time since, Duration length) {
  observe(length.count());
  const Fact breach = lasting(since, length);
  if (first_->at == breach.at && first_->since == since) first_ = breach;
  incidents_->add(breach, false);
}

void JudgedTerm::judge(bool holds, const std::string& observed, Time at, bool continues) {
  constexpr std::size_t kMostSaid = 1000;
  if (holds) return hold();
  std::string said = subject_ + " " + observed;
  if (clause() == Clause::serves || clause() == Clause::publishers)
    continues = said_.size() >= kMostSaid || !said_.insert(said).second;
  fail({traits_of(clause()).role, at, std::move(said), this}, continues);
}

void JudgedTerm::fail(Fact breach, bool continues) {
  ++checked_;
  ++broken_;
  if (!continues) incidents_->add(breach);
  if (!first_ || breach.at < first_->at) first_ = std::move(breach);
}

nlohmann::json JudgedTerm::json() const {
  nlohmann::json limit = stored(clause(), term_.limit);
  const Unit unit = traits_of(clause()).unit;
  if (unit == Unit::policy) limit = to_string(term_.policy);
  if (unit == Unit::processors) limit = term_.processors;
  if (unit == Unit::stated) limit = nullptr;  // a list
  return {{"term", to_string(clause())},
          {"limit", limit},
          {"from", to_string(term_.origin)},
          {"checked", checked_},
          {"broken", broken_},
          {"observed", extreme_ ? stored(clause(), *extreme_) : nlohmann::json()}};
}

JudgedTerm* Subject::find(Clause clause) {
  const auto at = std::ranges::find(terms, clause, &JudgedTerm::clause);
  return at == terms.end() ? nullptr : &*at;
}

Judge::Judge(const Contract& contract, const std::vector<std::string>& topics, Duration realtime)
    : incidents_(realtime) {
  for (const CallbackContract& callback : contract.callbacks)
    add(Kind::callback, callback.name(), "no such callback has run", callback.terms);
  for (const ChainContract& chain : contract.chains)
    add(Kind::chain, chain.name, "no data of its sources reached its end", chain.terms);
  for (const ThreadContract& thread : contract.threads)
    add(Kind::thread, thread.name, "no thread ran its callbacks", thread.terms);
  for (const std::string& topic : topics)
    add(Kind::topic, topic, "it has no publisher", {{Clause::publishers}});
}

void Judge::add(Kind kind, const std::string& name, const char* unseen, const std::vector<Term>& terms) {
  Subject& subject = all(kind).emplace_back(Subject{kind, name, unseen});
  for (const Term& term : terms) subject.terms.emplace_back(term, name, incidents_);
}

template <class Use>
void Judge::for_each_verdict(bool lossy, const Use& use) const {
  const auto judged = [&](const Subject& subject, const JudgedTerm& term) -> std::pair<Verdict, std::string> {
    if (const std::optional<Fact>& first = term.first())
      return {Verdict::broken,
              program::concat(term.broken(), " of ", term.checked(), "; first at ",
                              time_of_day(first->at, incidents_.realtime()), ": ", first->sentence)};
    if (!subject.seen) return {Verdict::not_observable, subject.unseen};
    if (term.checked() == 0) return {Verdict::not_observable, "no event tells it"};
    if (lossy) return {Verdict::not_observable, "events were lost"};
    return {Verdict::held, program::concat(term.checked(), " of ", term.checked())};
  };
  for (const std::vector<Subject>& subjects : subjects_)
    for (const Subject& subject : subjects)
      for (const JudgedTerm& term : subject.terms) {
        const auto& [verdict, reason] = judged(subject, term);
        use(subject, term, to_string(verdict), reason);
      }
}

program::TextTable Judge::table(bool lossy) const {
  program::TextTable table("Contract", {"of", "term", "limit", "observed", "verdict", "reason"});
  for_each_verdict(
      lossy, [&](const Subject& of, const JudgedTerm& term, const char* verdict, const auto& why) {
        const std::string kind = of.kind == Kind::callback ? "" : to_string(of.kind) + std::string(" ");
        table.add_row({kind + of.name, term.title(), term.limit_text(), term.extreme_text(), verdict, why});
      });
  return table;
}

nlohmann::json Judge::json(bool lossy) const {
  nlohmann::json terms = nlohmann::json::array(), incidents = nlohmann::json::array();
  for_each_verdict(lossy,
                   [&](const Subject& of, const JudgedTerm& term, const char* verdict, const auto& why) {
                     nlohmann::json& row = terms.emplace_back(term.json());
                     row[to_string(of.kind)] = of.name;
                     row["verdict"] = verdict;
                     row["reason"] = why;
                   });
  for (const Incident& incident : incidents_.kept()) incidents.push_back(incident.json());
  return {{"terms", terms}, {"incident", incident()}, {"incidents", incidents}};
}

}  // namespace hotpath::watch
