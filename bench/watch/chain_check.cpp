// SPDX-License-Identifier: Apache-2.0
#include "watch/chain_check.hpp"

#include <algorithm>
#include <tuple>

namespace hotpath::watch {

namespace {

/// The inputs that enter messages; callbacks of a node that publish by the same set share its samples.
std::vector<imports::HeldInputs> held_inputs(const Contract& contract, const StatedNames& names) {
  std::map<std::tuple<std::string, std::uint32_t, std::vector<std::string>>, imports::HeldInputs> held;
  for (std::uint32_t c = 0; c < contract.callbacks.size(); ++c) {
    const CallbackContract& callback = contract.callbacks[c];
    for (const StatedPublication& p : callback.publishes)
      if (!p.with.empty()) held[{callback.node, names.number_of(p.topic), p.with}].publishers.push_back(c);
  }
  std::vector<imports::HeldInputs> rules;
  for (auto& [key, inputs] : held) {
    const auto& [node, topic, with] = key;
    inputs.topic = topic;
    for (std::uint32_t c = 0; c < contract.callbacks.size(); ++c) {
      const CallbackContract& callback = contract.callbacks[c];
      if (callback.node == node && std::ranges::find(with, callback.topic) != with.end())
        inputs.of.push_back(c);
    }
    rules.push_back(std::move(inputs));
  }
  return rules;
}

/// By callback: the callbacks whose messages have the data of its messages: the subscriptions that take
/// them, and callbacks of their nodes that publish `with` them.
std::vector<std::vector<TaskId>> next_of(const Contract& contract) {
  const auto takes_from = [&](const CallbackContract& reader, const CallbackContract& by) {
    return !reader.topic.empty() &&
           std::ranges::count(by.publishes, reader.topic, &StatedPublication::topic) > 0;
  };
  const auto publishes_with = [](const CallbackContract& callback, const CallbackContract& input) {
    return callback.node == input.node && std::ranges::any_of(callback.publishes, [&](const auto& p) {
             return std::ranges::count(p.with, input.topic) > 0;
           });
  };
  std::vector<std::vector<TaskId>> next(contract.callbacks.size());
  for (TaskId from = 0; from < next.size(); ++from) {
    for (TaskId reader = 0; reader < next.size(); ++reader) {
      if (!takes_from(contract.callbacks[reader], contract.callbacks[from])) continue;
      next[from].push_back(reader);
      for (TaskId to = 0; to < next.size(); ++to)
        if (to != reader && publishes_with(contract.callbacks[to], contract.callbacks[reader]))
          next[from].push_back(to);
    }
  }
  return next;
}

std::size_t depth_of(const CallbackContract& subscription) {
  const auto depth = std::ranges::find(subscription.terms, Clause::depth, &Term::clause);
  const std::int64_t samples = depth == subscription.terms.end() ? 0 : depth->limit;
  return imports::ChainFollower::most_unread(static_cast<std::uint32_t>(samples));
}

}  // namespace

ChainCheck::ChainCheck(const Contract& contract, const StatedNames& names)
    : taken_(contract.callbacks.size(), tracing::kNone),
      jobs_(contract.callbacks.size()),
      observed_(contract.chains.size()),
      follower_(follower(contract, names)) {}

imports::ChainFollower ChainCheck::follower(const Contract& contract, const StatedNames& names) {
  std::vector<ChainIndex> chains;
  for (const ChainContract& chain : contract.chains) {
    ChainIndex& index = chains.emplace_back();
    index.sources.assign(chain.sources.begin(), chain.sources.end());
    index.sink_tasks.assign(chain.sinks.begin(), chain.sinks.end());
    sources_.push_back(index.sources);
    for (const std::uint32_t source : chain.sources) source_jobs_[source];
  }
  std::vector<std::size_t> unread(names.topics());
  std::vector<bool> publishing;
  for (std::uint32_t c = 0; c < contract.callbacks.size(); ++c) {
    const CallbackContract& callback = contract.callbacks[c];
    publishing.push_back(!callback.publishes.empty());
    if (!callback.topic.empty()) taken_[c] = names.number_of(callback.topic);
    if (taken_[c] != tracing::kNone) unread[taken_[c]] = std::max(unread[taken_[c]], depth_of(callback));
  }
  ChainLanes lanes(chains, next_of(contract));
  return {std::move(chains), held_inputs(contract, names),
          std::move(unread), std::move(publishing),
          std::move(lanes),  [this](const ChainObservation& o) { pending_.push_back(o); }};
}

void ChainCheck::started(std::uint32_t entry, const tracing::Job& job, std::uint32_t publisher,
                         std::optional<Time> timestamp) {
  const std::uint64_t number = jobs_[entry]++;
  if (const auto source = source_jobs_.find(entry); source != source_jobs_.end()) {
    auto& [first, timestamps] = source->second;
    timestamps.push_back(timestamp);
    if (timestamps.size() > kRemembered) {
      timestamps.pop_front();
      ++first;
    }
  }
  std::optional<imports::ChainFollower::Taken> taken;
  if (publisher != tracing::kNone && taken_[entry] != tracing::kNone)
    taken = {job.sample.parent, publisher, taken_[entry]};
  follower_.start(job.ref, {entry, number}, job.start, taken);
}

const std::vector<ChainOutput>& ChainCheck::ended(const tracing::Job& job) {
  outputs_.clear();
  const std::optional<JobRef> ref = follower_.end(job.ref, job.ended);
  std::erase_if(pending_, [&](const ChainObservation& o) {
    if (!ref || !(o.sink == *ref)) return false;
    if (!job.ended) return true;
    ChainOutput& output = outputs_.emplace_back();
    output.chain = o.chain;
    output.start = o.sink_start;
    output.finish = job.finish;
    output.hot_path = o.sink_start - o.latest_source_start;
    if (const std::optional<Time> oldest = oldest_source(o)) output.age = job.finish - *oldest;
    ObservedChain& observed = observed_[o.chain];
    ++observed.outputs;
    observed.hot_path.add(output.hot_path);
    if (!output.age) return true;
    observed.age.add(*output.age);
    observed.latest = std::max(observed.latest, *output.age);
    return true;
  });
  return outputs_;
}

std::optional<Time> ChainCheck::oldest_source(const ChainObservation& observation) const {
  std::optional<Time> oldest;
  const std::vector<TaskId>& sources = sources_[observation.chain];
  for (std::size_t s = 0; s < sources.size(); ++s) {
    if (((observation.sources_seen >> s) & 1U) == 0) continue;
    const auto& [first, timestamps] = source_jobs_.at(sources[s]);
    const std::uint64_t number = observation.source_sequence[s];
    if (number < first || number - first >= timestamps.size() || !timestamps[number - first])
      return std::nullopt;
    oldest = oldest ? std::min(*oldest, *timestamps[number - first]) : timestamps[number - first];
  }
  return oldest;
}

}  // namespace hotpath::watch
