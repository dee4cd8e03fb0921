// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "import/chain_follower.hpp"
#include "program/latency_histogram.hpp"
#include "watch/judge.hpp"
#include "watch/stated_names.hpp"

namespace hotpath::watch {

/// What was observed of a chain since the beginning.
struct ObservedChain {
  /// Of each output, a job of a sink that ended with data of the sources: start of the latest source's job
  /// to the start of the sink's.
  program::LatencyHistogram hot_path;
  program::LatencyHistogram age;  ///< Timestamp of the oldest source's job to the end of the sink's.
};

/// Follows the data of a contract's chains through the jobs of a running system.
class ChainCheck {
 public:
  /// The contract and the judge must outlive it.
  ChainCheck(const Contract& contract, const StatedNames& names, Judge& judge)
      : contract_(contract),
        judge_(judge),
        jobs_(contract.callbacks.size()),
        observed_(contract.chains.size()),
        follower_(follower(names)) {}
  ChainCheck(const ChainCheck&) = delete;
  ChainCheck& operator=(const ChainCheck&) = delete;

  // In the order of time.
  /// `entry`: the job's callback in the contract; `publisher`: that of its sample, kNone: unknown.
  void started(std::uint32_t entry, const tracing::Job& job, std::uint32_t publisher,
               std::optional<Time> timestamp) {
    const std::uint64_t number = jobs_[entry]++;
    if (const auto source = source_jobs_.find(entry); source != source_jobs_.end()) {
      source->second.push_back(timestamp);
      if (source->second.size() > kRemembered) source->second.pop_front();
    }
    std::optional<imports::ChainFollower::Taken> taken;
    if (publisher != tracing::kNone && taken_[entry] != tracing::kNone)
      taken = {job.sample.parent, publisher, taken_[entry]};
    follower_.start(job.ref, {entry, number}, job.start, taken);
  }
  /// `topic`: its number among the stated ones.
  void published(const tracing::Job& job, std::uint32_t topic) { follower_.publish(job.ref, topic); }
  /// `judged`: whether the outputs of the job are compared with the contract.
  void ended(const tracing::Job& job, bool judged) {
    const std::optional<JobRef> ref = follower_.end(job.ref, job.ended);
    std::erase_if(pending_, [&](const ChainObservation& output) {
      const bool of_job = ref && output.sink == *ref;
      if (of_job && job.ended) end(output, job, judged);
      return of_job;
    });
  }

  /// By chain of the contract.
  [[nodiscard]] const std::vector<ObservedChain>& chains() const { return observed_; }

 private:
  /// Jobs of a source that data may still come from.
  static constexpr std::size_t kRemembered = 4096;

  imports::ChainFollower follower(const StatedNames& names) {
    imports::ChainFollower::Rules rules{.held = held_inputs(names),
                                        .unread = std::vector<std::size_t>(names.topics().size())};
    for (const Group& chain : contract_.chains) {
      ChainIndex& index = rules.chains.emplace_back();
      index.sources.assign(chain.callbacks.begin(), chain.callbacks.end());
      index.sink_tasks.assign(chain.sinks.begin(), chain.sinks.end());
      for (const std::uint32_t source : chain.callbacks) source_jobs_[source];
    }
    for (const CallbackContract& callback : contract_.callbacks) {
      rules.publishing.push_back(!callback.publishes.empty());
      const std::uint32_t topic = taken_.emplace_back(names.number_of(callback.topic));
      const Term* const depth = find(callback.terms, Clause::depth);
      const auto samples = static_cast<std::uint32_t>(depth ? depth->limit : 0);
      if (topic != tracing::kNone)
        rules.unread[topic] = std::max(rules.unread[topic], imports::ChainFollower::most_unread(samples));
    }
    rules.lanes = ChainLanes(rules.chains, next_of(rules.held));
    return {std::move(rules), [this](const ChainObservation& o) { pending_.push_back(o); }};
  }
  /// The inputs that enter messages; callbacks of a node that publish by the same set share its samples.
  [[nodiscard]] std::vector<imports::HeldInputs> held_inputs(const StatedNames& names) const {
    const std::vector<CallbackContract>& callbacks = contract_.callbacks;
    std::map<std::tuple<std::string, std::uint32_t, std::vector<std::string>>, imports::HeldInputs> held;
    for (std::uint32_t c = 0; c < callbacks.size(); ++c)
      for (const StatedPublication& p : callbacks[c].publishes)
        if (!p.with.empty())
          held[{callbacks[c].node, names.number_of(p.topic), p.with}].publishers.push_back(c);
    std::vector<imports::HeldInputs> rules;
    for (auto& [key, inputs] : held) {
      const auto& [node, topic, with] = key;
      inputs.topic = topic;
      for (std::uint32_t c = 0; c < callbacks.size(); ++c)
        if (callbacks[c].node == node && std::ranges::count(with, callbacks[c].topic) > 0)
          inputs.of.push_back(c);
      rules.push_back(std::move(inputs));
    }
    return rules;
  }
  /// By callback: the callbacks whose messages have the data of its messages: the subscriptions that take
  /// them, and callbacks of their nodes that publish `with` them.
  [[nodiscard]] std::vector<std::vector<TaskId>> next_of(const std::vector<imports::HeldInputs>& held) const {
    std::vector<std::vector<TaskId>> next(contract_.callbacks.size());
    for (TaskId reader = 0; reader < next.size(); ++reader) {
      std::set<TaskId> with = {reader};
      for (const imports::HeldInputs& inputs : held)
        if (std::ranges::count(inputs.of, reader) > 0)
          with.insert(inputs.publishers.begin(), inputs.publishers.end());
      for (TaskId from = 0; from < next.size(); ++from)
        if (contract_.callbacks[from].publication(contract_.callbacks[reader].topic))
          next[from].insert(next[from].end(), with.begin(), with.end());
    }
    return next;
  }
  void end(const ChainObservation& output, const tracing::Job& sink, bool judged) {
    ObservedChain& observed = observed_[output.chain];
    Subject& chain = judge_.all(Kind::chain)[output.chain];
    const Duration hot_path = output.sink_start - output.latest_source_start;
    observed.hot_path.add(hot_path);
    if (judged) {
      chain.seen = true;
      chain.compare(Clause::hot_path, hot_path.count(), output.sink_start);
    }
    const std::optional<Time> oldest = oldest_source(output);
    if (!oldest) return;
    const Duration age = sink.finish - *oldest;
    observed.age.add(age);
    if (!judged) return;
    chain.compare(Clause::age, age.count(), sink.finish);
    chain.compare(Clause::requirement, age.count(), sink.finish);
  }
  /// The timestamp of its job; std::nullopt: unknown.
  [[nodiscard]] std::optional<Time> oldest_source(const ChainObservation& output) const {
    std::optional<Time> oldest;
    const std::vector<std::uint32_t>& sources = contract_.chains[output.chain].callbacks;
    for (std::size_t s = 0; s < sources.size(); ++s) {
      if (((output.sources_seen >> s) & 1U) == 0) continue;
      const std::deque<std::optional<Time>>& latest = source_jobs_.at(sources[s]);
      const std::uint64_t first = jobs_[sources[s]] - latest.size(), number = output.source_sequence[s];
      if (number < first || number - first >= latest.size() || !latest[number - first]) return std::nullopt;
      oldest = std::min(oldest.value_or(Time::max()), *latest[number - first]);
    }
    return oldest;
  }

  const Contract& contract_;
  Judge& judge_;
  std::vector<std::uint32_t> taken_;  // by entry: the stated topic that it takes; kNone: none
  std::vector<std::uint64_t> jobs_;   // by entry: number of the next job
  /// By entry: timestamps of the latest jobs of a source.
  std::map<std::uint32_t, std::deque<std::optional<Time>>> source_jobs_;
  std::vector<ChainObservation> pending_;  // of jobs that have not ended
  std::vector<ObservedChain> observed_;
  imports::ChainFollower follower_;
};

}  // namespace hotpath::watch
