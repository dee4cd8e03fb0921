// SPDX-License-Identifier: Apache-2.0
#include "watch/publisher_check.hpp"

#include <algorithm>

#include "program/text.hpp"

namespace hotpath::watch {

using tracing::kNone;

namespace {

std::string node_named(const tracing::System& system, std::uint32_t node) {
  return node < system.nodes.size() ? system.nodes[node] : "an unknown node";
}

}  // namespace

PublisherCheck::PublisherCheck(const Contract& contract, const StatedNames& names)
    : contract_(contract), nodes_(names.topics().size()) {
  for (const CallbackContract& callback : contract.callbacks)
    for (const StatedPublication& p : callback.publishes)
      nodes_[names.number_of(p.topic)].insert(callback.node);
  for (const std::string& name : names.topics())
    subjects_.emplace_back("topic", name, std::vector<Term>{{Clause::publishers}}, "it has no publisher");
}

void PublisherCheck::published(const tracing::System& system, const tracing::Job& job, std::uint32_t topic,
                               std::uint32_t entry, Subject* callback, Incidents& incidents) {
  const tracing::Publication& p = job.published.back();
  const std::string& name = subjects_[topic].name;
  const bool known = entry != kNone && std::ranges::count(contract_.callbacks[entry].publishes, name,
                                                          &StatedPublication::topic) > 0;
  JudgedTerm* const publishes = entry == kNone ? nullptr : callback->find(Clause::publishes);
  if (publishes == nullptr) {
    if (known) return;
    const std::string node = node_named(system, system.callbacks[job.ref.callback].node);
    return subjects_[topic].terms.front().judge(false, "is also published by " + node, p.at, incidents);
  }
  const auto messages = std::ranges::count(job.published, p.topic, &tracing::Publication::topic);
  if (known && messages == 1) return publishes->hold();
  publishes->judge(false,
                   known ? program::concat("published ", messages, " messages of ", name, " in one job")
                         : "published " + name + ", which the contract lacks",
                   p.at, incidents);
}

void PublisherCheck::from_stranger(std::uint32_t topic, Time at, Incidents& incidents) {
  subjects_[topic].terms.front().judge(
      false, "is also published by a node that is not watched, or outside of callbacks", at, incidents);
}

void PublisherCheck::created(const tracing::System& system, StatedNames& names, Time at,
                             Incidents& incidents) {
  if (!names.kept()) return;
  judged_.resize(system.endpoints.size());
  for (std::size_t e = 0; e < system.endpoints.size(); ++e) {
    const tracing::Endpoint& endpoint = system.endpoints[e];
    if (judged_[e] || endpoint.kind != tracing::Endpoint::Kind::publisher || endpoint.topic == kNone)
      continue;
    judged_[e] = true;
    const std::uint32_t topic = names.number_of(system, endpoint.topic);
    if (topic == kNone) continue;
    subjects_[topic].seen = true;
    const bool known =
        endpoint.node < system.nodes.size() && nodes_[topic].contains(names.node(system, endpoint.node));
    subjects_[topic].terms.front().judge(
        known, "has a publisher of " + node_named(system, endpoint.node) + ", which the contract lacks", at,
        incidents);
  }
}

}  // namespace hotpath::watch
