// SPDX-License-Identifier: Apache-2.0
#include "program/text.hpp"
#include "watch/contract_check.hpp"

namespace hotpath::watch {

ContractCheck::Verdict ContractCheck::verdict(const Subject& subject, const JudgedTerm& term,
                                              const Losses& losses) const {
  constexpr const char* kUnseen = "not observable";
  if (const std::optional<Breach>& first = term.first())
    return {subject, term, "broken",
            program::concat(term.broken(), " of ", term.checked(), "; first at ", clock_.text(first->at),
                            ": ", first->sentence)};
  if (!subject.seen) return {subject, term, kUnseen, subject.unseen};
  if (term.checked() == 0) return {subject, term, kUnseen, "no event tells it"};
  if (losses.total() > 0) return {subject, term, kUnseen, "events were lost"};
  return {subject, term, "held", program::concat(term.checked(), " of ", term.checked())};
}

std::vector<ContractCheck::Verdict> ContractCheck::verdicts(const Losses& losses) const {
  std::vector<Verdict> all;
  for (const auto* subjects : {&subjects_, &thread_check_.subjects(), &publisher_check_.subjects()})
    for (const Subject& subject : *subjects)
      for (const JudgedTerm& term : subject.terms) all.push_back(verdict(subject, term, losses));
  return all;
}

std::string ContractCheck::unseen(const Incident& incident, const Losses& losses) const {
  constexpr auto kLately = std::chrono::minutes(1);
  for (const Verdict& v : verdicts(losses))
    if (role_of(v.term.clause()) == Role::assumption && *v.word == 'n')
      return v.subject.name + " " + v.term.title();
  const bool withheld = thread_check_.withheld() >= incident.begin().at - kLately;  // false if it never was
  return withheld ? "less than 10 ms that the hypervisor withheld" : "";
}

std::string ContractCheck::text(const Incident& incident, const Losses& losses) const {
  return incident.text(clock_, unseen(incident, losses));
}

nlohmann::json ContractCheck::json(const Incident& incident, const std::string& text) const {
  return {{"number", incident.number()},
          {"at", clock_.text(incident.begin().at)},
          {"last", clock_.text(incident.last())},
          {"breaches", incident.breaches()},
          {"incident", text}};
}

std::string ContractCheck::incident(const Losses& losses) const {
  return broken() ? text(incidents_.kept().front(), losses) : "";
}

program::TextTable ContractCheck::table(const Losses& losses) const {
  program::TextTable table("Contract", {"of", "term", "limit", "observed", "verdict", "reason"});
  for (const auto& [subject, term, word, reason] : verdicts(losses))
    table.add_row({subject.kind == "callback" ? subject.name : subject.kind + " " + subject.name,
                   term.title(), term.limit_text(), term.extreme_text(), word, reason});
  return table;
}

nlohmann::json ContractCheck::json(const Losses& losses) const {
  nlohmann::json terms = nlohmann::json::array();
  for (const auto& [subject, term, word, reason] : verdicts(losses)) {
    nlohmann::json& stored = terms.emplace_back(term.json());
    stored[subject.kind] = subject.name;
    stored["verdict"] = word;
    stored["reason"] = reason;
  }
  nlohmann::json incidents = nlohmann::json::array();
  for (const Incident& incident : incidents_.kept())
    incidents.push_back(json(incident, text(incident, losses)));
  return {{"terms", terms}, {"incident", incident(losses)}, {"incidents", incidents}};
}

}  // namespace hotpath::watch
