// SPDX-License-Identifier: Apache-2.0
#include "watch/contract_check.hpp"

#include <algorithm>

#include "hotpath/reference_system/ros_names.hpp"
#include "program/text.hpp"

namespace hotpath::watch {

namespace {

using tracing::CallbackKind;
using tracing::kNone;

/// Not yet looked for in the contract.
constexpr std::uint32_t kUnknown = kNone - 1;

std::string shown(Clause clause, std::int64_t value) {
  return clause == Clause::depth ? program::concat(value) : program::fixed(to_ms(Duration(value)), 3) + " ms";
}

/// What a job did that breaks a term.
const char* deed(Clause clause) {
  switch (clause) {
    case Clause::budget:
      return " ran ";
    case Clause::period:
      return " has a period of ";
    case Clause::minimum_distance:
      return " got samples at a distance of ";
    case Clause::depth:
      return " has a queue depth of ";
    case Clause::response:
      return " responded after ";
  }
  return "";
}

/// The key of a term without its unit.
std::string title(Clause clause) {
  std::string text(to_string(clause));
  if (text.ends_with("_ms")) text.resize(text.size() - 3);
  std::ranges::replace(text, '_', ' ');
  return text;
}

}  // namespace

ContractCheck::ContractCheck(Contract contract, Time begin) : contract_(std::move(contract)), begin_(begin) {
  for (const CallbackContract& callback : contract_.callbacks) {
    CallbackState& state = states_.emplace_back();
    for (const Term& term : callback.terms) state.terms.push_back({term});
  }
}

std::uint32_t ContractCheck::entry_of(const tracing::System& system, std::uint32_t callback) {
  if (callback >= entries_.size()) entries_.resize(callback + 1, kUnknown);
  if (entries_[callback] == kUnknown) entries_[callback] = find_entry(system, callback);
  return entries_[callback];
}

std::uint32_t ContractCheck::find_entry(const tracing::System& system, std::uint32_t callback) const {
  const tracing::Callback& of = system.callbacks[callback];
  const bool timer = of.kind == CallbackKind::timer;
  if (of.node >= system.nodes.size() || (!timer && of.kind != CallbackKind::subscription)) return kNone;
  const std::string node = graph_node_name(system.nodes[of.node]);
  const std::string topic = timer ? "" : graph_topic_name(system.topics[of.topic].name);
  std::uint32_t number = 0;
  for (std::uint32_t c = 0; c <= callback; ++c)
    number += system.callbacks[c].kind == CallbackKind::timer && system.callbacks[c].node == of.node ? 1 : 0;
  const auto entry = std::ranges::find_if(contract_.callbacks, [&](const CallbackContract& stated) {
    return stated.node == node && stated.topic == topic && (!timer || stated.timer == number);
  });
  return entry == contract_.callbacks.end() ? kNone
                                            : static_cast<std::uint32_t>(entry - contract_.callbacks.begin());
}

void ContractCheck::job(const tracing::System& system, const tracing::Job& job,
                        std::optional<Time> timestamp) {
  const std::uint32_t entry = entry_of(system, job.ref.callback);
  if (entry == kNone) return;
  CallbackState& state = states_[entry];
  const tracing::Callback& callback = system.callbacks[job.ref.callback];
  for (TermState& term : state.terms) check(state, entry, term, callback, job, timestamp);
  state.seen = true;
  if (job.has_sample) state.previous = job.sample;
}

void ContractCheck::check(CallbackState& state, std::uint32_t entry, TermState& term,
                          const tracing::Callback& callback, const tracing::Job& job,
                          std::optional<Time> timestamp) {
  const std::int64_t limit = term.term.limit;
  switch (term.term.clause) {
    case Clause::budget: {
      const std::int64_t ran = (job.finish - job.start).count();
      return compare(entry, term, ran, ran <= limit, job.finish);
    }
    case Clause::period:
      return compare(entry, term, callback.period.count(), callback.period.count() == limit, job.start);
    case Clause::minimum_distance: {
      const bool successor =
          state.previous && job.has_sample && job.sample.sequence == state.previous->sequence + 1;
      if (!successor) return;
      const std::int64_t distance = (job.sample.published - state.previous->published).count();
      return compare(entry, term, distance, distance >= limit, job.sample.published);
    }
    case Clause::depth:
      if (callback.depth == 0) return;  // keeps all, or unknown
      return compare(entry, term, callback.depth, callback.depth == limit, job.start);
    case Clause::response:
      if (!timestamp) return;
      return compare(entry, term, (job.finish - *timestamp).count(),
                     (job.finish - *timestamp).count() <= limit, job.finish);
  }
}

void ContractCheck::compare(std::uint32_t entry, TermState& term, std::int64_t observed, bool holds,
                            Time at) {
  ++term.checked;
  if (holds) return;
  ++term.broken;
  if (term.first) return;
  const Clause clause = term.term.clause;
  term.first = {at, contract_.callbacks[entry].name() + deed(clause) + shown(clause, observed) + ", " +
                        (clause == Clause::response ? "bound" : title(clause)) + " " +
                        shown(clause, term.term.limit) + " (" + std::string(to_string(term.term.origin)) +
                        ")"};
  std::optional<Breach>& first = clause == Clause::response ? excess_ : cause_;
  if (!first || at < first->at) first = term.first;
}

std::string ContractCheck::incident() const {
  const auto at = [&](const Breach& breach) { return program::fixed(seconds(breach.at), 3) + " s: "; };
  if (cause_ && excess_ && cause_->at <= excess_->at) {
    return at(*cause_) + cause_->sentence + "; " + program::fixed(to_ms(excess_->at - cause_->at), 3) +
           " ms later " + excess_->sentence;
  }
  if (excess_) {
    return at(*excess_) + excess_->sentence +
           ", while every assumption that the contract states held: the bound is wrong, or an assumption is "
           "missing in the contract";
  }
  return cause_ ? at(*cause_) + cause_->sentence : "";
}

ContractCheck::Verdict ContractCheck::verdict(const CallbackState& state, const TermState& term,
                                              const Losses& losses) const {
  if (term.first) {
    return {"broken",
            program::concat(term.broken, " of ", term.checked, "; first at ",
                            program::fixed(seconds(term.first->at), 3), " s: ", term.first->sentence)};
  }
  if (!state.seen) return {"not observable", "no such callback has run"};
  if (term.checked == 0) return {"not observable", "no event tells it"};
  if (losses.dropped + losses.damaged + losses.late > 0) return {"not observable", "events were lost"};
  return {"held", program::concat(term.checked, " of ", term.checked)};
}

program::TextTable ContractCheck::table(const Losses& losses) const {
  program::TextTable table("Contract", {"callback", "term", "limit", "verdict", "reason"});
  for (std::size_t c = 0; c < states_.size(); ++c) {
    for (const TermState& term : states_[c].terms) {
      const auto [word, reason] = verdict(states_[c], term, losses);
      table.add_row({contract_.callbacks[c].name(), title(term.term.clause),
                     shown(term.term.clause, term.term.limit), word, reason});
    }
  }
  return table;
}

nlohmann::json ContractCheck::json(const Losses& losses) const {
  nlohmann::json terms = nlohmann::json::array();
  for (std::size_t c = 0; c < states_.size(); ++c) {
    for (const TermState& term : states_[c].terms) {
      const auto [word, reason] = verdict(states_[c], term, losses);
      const bool depth = term.term.clause == Clause::depth;
      terms.push_back(
          {{"callback", contract_.callbacks[c].name()},
           {"term", to_string(term.term.clause)},
           {"limit", depth ? static_cast<double>(term.term.limit) : to_ms(Duration(term.term.limit))},
           {"from", to_string(term.term.origin)},
           {"verdict", word},
           {"checked", term.checked},
           {"broken", term.broken},
           {"reason", reason}});
    }
  }
  return {{"terms", terms}, {"incident", incident()}};
}

}  // namespace hotpath::watch
