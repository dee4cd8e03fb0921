// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "hotpath/tracing/system.hpp"
#include "program/text.hpp"
#include "watch/judged_term.hpp"
#include "watch/stated_names.hpp"

namespace hotpath::watch {

/// Compares the publishers of topics with those of a contract.
class PublisherCheck {
 public:
  /// The contract must outlive it.
  PublisherCheck(const Contract& contract, const StatedNames& names)
      : contract_(contract), nodes_(names.topics().size()) {
    for (const CallbackContract& callback : contract.callbacks)
      for (const StatedPublication& p : callback.publishes)
        nodes_[names.number_of(p.topic)].insert(callback.node);
    for (const std::string& name : names.topics())
      subjects_.emplace_back("topic", name, std::vector<Term>{{Clause::publishers}}, "it has no publisher");
  }

  /// A message of a job on a stated topic. `entry`: its callback in the contract, with its verdicts;
  /// kNone: none.
  void published(const tracing::System& system, const tracing::Job& job, std::uint32_t topic,
                 std::uint32_t entry, Subject* callback, Incidents& incidents) {
    const tracing::Publication& p = job.published.back();
    const std::string& name = subjects_[topic].name;
    const bool known = entry != tracing::kNone && std::ranges::count(contract_.callbacks[entry].publishes,
                                                                     name, &StatedPublication::topic) > 0;
    JudgedTerm* const publishes = entry == tracing::kNone ? nullptr : callback->find(Clause::publishes);
    const auto messages = std::ranges::count(job.published, p.topic, &tracing::Publication::topic);
    if (publishes == nullptr) {
      const std::string node = node_name(system, system.callbacks[job.ref.callback].node);
      if (!known) judge(topic, false, "is also published by " + node, p.at, incidents);
    } else if (known && messages == 1) {
      publishes->hold();
    } else {
      publishes->judge(false,
                       known ? program::concat("published ", messages, " messages of ", name, " in one job")
                             : "published " + name + ", which the contract lacks",
                       p.at, incidents);
    }
  }

  /// A subscription got a sample that no watched job published, unlike earlier ones.
  void from_stranger(std::uint32_t topic, Time at, Incidents& incidents) {
    judge(topic, false, "is also published by a node that is not watched, or outside of callbacks", at,
          incidents);
  }

  /// Judges publishers that were created since the last call.
  void created(const tracing::System& system, StatedNames& names, Time at, Incidents& incidents) {
    judged_.resize(system.endpoints.size());
    for (std::size_t e = 0; names.kept() && e < system.endpoints.size(); ++e) {
      const tracing::Endpoint& endpoint = system.endpoints[e];
      if (judged_[e] || endpoint.kind != tracing::Endpoint::Kind::publisher ||
          endpoint.topic == tracing::kNone)
        continue;
      judged_[e] = true;
      const std::uint32_t topic = names.number_of(system, endpoint.topic);
      if (topic == tracing::kNone) continue;
      subjects_[topic].seen = true;
      const bool known =
          endpoint.node < system.nodes.size() && nodes_[topic].contains(names.node(system, endpoint.node));
      const std::string node = node_name(system, endpoint.node);
      judge(topic, known, "has a publisher of " + node + ", which the contract lacks", at, incidents);
    }
  }

  /// By stated topic.
  [[nodiscard]] const std::vector<Subject>& subjects() const { return subjects_; }

 private:
  void judge(std::uint32_t topic, bool known, const std::string& observed, Time at, Incidents& incidents) {
    subjects_[topic].terms.front().judge(known, observed, at, incidents);
  }

  const Contract& contract_;
  std::vector<Subject> subjects_;
  std::vector<std::set<std::string>> nodes_;  // by topic: that publish it
  std::vector<bool> judged_;                  // by endpoint of the system
};

}  // namespace hotpath::watch
