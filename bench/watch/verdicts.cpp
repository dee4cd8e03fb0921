// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "program/text.hpp"
#include "watch/contract_check.hpp"

namespace hotpath::watch {

ContractCheck::Verdict ContractCheck::verdict(const Subject& subject, const JudgedTerm& term,
                                              const Losses& losses) const {
  const std::string counts = program::concat(term.broken(), " of ", term.checked());
  if (term.first())
    return {"broken", counts + "; first at " + clock_.text(term.first()->at) + ": " + term.first()->sentence};
  if (!subject.seen) return {"not observable", subject.unseen};
  if (term.checked() == 0) return {"not observable", "no event tells it"};
  if (losses.dropped + losses.damaged + losses.late > 0) return {"not observable", "events were lost"};
  return {"held", program::concat(term.checked(), " of ", term.checked())};
}

std::string ContractCheck::unseen(const Losses& losses) const {
  for (const Subject* subject : all_subjects()) {
    for (const JudgedTerm& term : subject->terms) {
      const bool observable = *verdict(*subject, term, losses).word != 'n';
      if (role_of(term.clause()) == Role::assumption && !observable)
        return subject->name + " " + term.title();
    }
  }
  return "";
}

std::string ContractCheck::text(const Incident& incident, const Losses& losses) const {
  return incident.text(clock_, unseen(losses));
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
  for (const Subject* subject : all_subjects()) {
    for (const JudgedTerm& term : subject->terms) {
      const auto [word, reason] = verdict(*subject, term, losses);
      table.add_row({subject->kind == "callback" ? subject->name : subject->kind + " " + subject->name,
                     term.title(), term.limit_text(), term.extreme_text(), word, reason});
    }
  }
  return table;
}

nlohmann::json ContractCheck::json(const Losses& losses) const {
  nlohmann::json terms = nlohmann::json::array();
  for (const Subject* subject : all_subjects()) {
    for (const JudgedTerm& term : subject->terms) {
      const auto [word, reason] = verdict(*subject, term, losses);
      nlohmann::json& stored = terms.emplace_back(term.json());
      stored[subject->kind] = subject->name;
      stored["verdict"] = word;
      stored["reason"] = reason;
    }
  }
  nlohmann::json incidents = nlohmann::json::array();
  const std::string unobserved = unseen(losses);
  for (const Incident& incident : incidents_.kept())
    incidents.push_back(json(incident, incident.text(clock_, unobserved)));
  return {{"terms", terms}, {"incident", incident(losses)}, {"incidents", incidents}};
}

double ContractCheck::nearness_of_callback(std::uint32_t entry) const { return nearness(subjects_[entry]); }

double ContractCheck::nearness_of_chain(std::uint32_t chain) const {
  return nearness(subjects_[contract_.callbacks.size() + chain]);
}

double ContractCheck::nearness(const Subject& subject) {
  double nearest = -1;
  for (const JudgedTerm& term : subject.terms) nearest = std::max(nearest, term.nearness());
  return nearest;
}

}  // namespace hotpath::watch
