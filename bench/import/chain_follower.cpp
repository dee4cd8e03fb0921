// SPDX-License-Identifier: Apache-2.0
#include "import/chain_follower.hpp"

#include <algorithm>

#include "hotpath/reference_system/observe.hpp"

namespace hotpath::imports {

namespace {

/// Samples that threads have taken, but whose jobs have not started.
constexpr std::size_t kTaken = 64;
/// Of a subscription that keeps all.
constexpr std::size_t kKeepAll = 1000;

}  // namespace

ChainFollower::ChainFollower(std::vector<ChainIndex> chains, std::vector<HeldInputs> held,
                             std::vector<std::size_t> unread, std::vector<bool> publishing, ChainLanes lanes,
                             Observed observed)
    : chains_(std::move(chains)),
      rules_(std::move(held)),
      unread_(std::move(unread)),
      publishing_(std::move(publishing)),
      observed_(std::move(observed)),
      history_(std::move(lanes)) {
  for (const HeldInputs& rule : rules_) held_.emplace_back(rule.of.size());
}

std::size_t ChainFollower::most_unread(std::uint32_t depth) {
  return std::min<std::size_t>(depth == 0 ? kKeepAll : depth, kKeepAll) + kTaken;
}

void ChainFollower::start(const tracing::JobRef& job, JobRef as, Time at, const std::optional<Taken>& taken) {
  Running& running = running_[key_of(job)];
  running.ref = as;
  running.start = at;
  if (taken) running.own = message_of(*taken);
  if (!running.own) return;
  for (std::size_t r = 0; r < rules_.size(); ++r) {
    const auto slot = std::ranges::find(rules_[r].of, as.task);
    if (slot != rules_[r].of.end())
      held_[r][static_cast<std::size_t>(slot - rules_[r].of.begin())] = running.own;
  }
}

ChainFollower::Message ChainFollower::message_of(const Taken& taken) const {
  const auto published = messages_.find({taken.by, taken.topic});
  if (published == messages_.end()) return nullptr;
  const auto& latest = published->second;
  const auto message = std::find_if(latest.rbegin(), latest.rend(),
                                    [&](const auto& m) { return m.first == key_of(taken.job); });
  return message == latest.rend() ? nullptr : message->second;
}

void ChainFollower::publish(const tracing::JobRef& job, std::uint32_t topic) {
  const auto open = running_.find(key_of(job));
  if (open == running_.end()) return;
  Running& running = open->second;
  auto message = std::make_shared<SimulatedMessage>();
  for (std::size_t r = 0; r < rules_.size(); ++r) {
    const HeldInputs& rule = rules_[r];
    const bool by_rule =
        rule.topic == topic && std::ranges::find(rule.publishers, running.ref.task) != rule.publishers.end();
    if (!by_rule) continue;
    for (Message& held : held_[r]) {
      if (held) history_.merge(*message, *held, running.ref.task);
      held.reset();
    }
  }
  if (running.own) history_.merge(*message, *running.own, running.ref.task);
  history_.append(*message, {running.ref.task, 0, running.ref.sequence, running.start}, 0);
  observe(*message, running);
  if (topic >= unread_.size()) return;
  auto& latest = messages_[{running.ref.task, topic}];
  if (!latest.empty() && latest.back().first == key_of(job)) latest.pop_back();
  latest.emplace_back(key_of(job), std::move(message));
  if (latest.size() > unread_[topic]) latest.pop_front();
}

std::optional<JobRef> ChainFollower::end(const tracing::JobRef& job, bool ended) {
  const auto running = running_.find(key_of(job));
  if (running == running_.end()) return std::nullopt;
  const JobRef ref = running->second.ref;
  if (ended && !publishing_[ref.task] && running->second.own) observe(*running->second.own, running->second);
  running_.erase(running);
  return ref;
}

void ChainFollower::observe(const SimulatedMessage& message, Running& running) {
  ends_.clear();
  for (std::uint32_t c = 0; c < chains_.size(); ++c)
    if (chains_[c].ends_in(running.ref.task)) ends_.push_back(c);
  observe_chains(history_, message, chains_, ends_, running, observed_);
}

}  // namespace hotpath::imports
