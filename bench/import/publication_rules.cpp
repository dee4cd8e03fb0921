// SPDX-License-Identifier: Apache-2.0
#include "import/publication_rules.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "import/recorded_graph.hpp"

namespace hotpath::imports {

namespace {

using Callbacks = std::vector<std::uint32_t>;

/// With more candidates for a set, only each candidate alone and all of them together are tried.
constexpr std::size_t kMostSubsets = 6;

/// One job of a node, with its messages on one topic.
struct Seen {
  std::uint32_t callback;
  std::uint64_t messages;
};

bool contains(const Callbacks& all, std::uint32_t one) { return std::ranges::find(all, one) != all.end(); }

class TopicOfNode {
 public:
  TopicOfNode(const tracing::System& system, const Callbacks& callbacks, std::uint32_t topic,
              const std::vector<const tracing::Job*>& jobs)
      : system_(system), topic_(topic) {
    std::set<std::uint32_t> publishers;
    for (const tracing::Job* job : jobs) {
      const auto messages =
          static_cast<std::uint64_t>(std::ranges::count(job->published, topic, &tracing::Publication::topic));
      seen_.push_back({job->ref.callback, messages});
      if (messages > 0) publishers.insert(job->ref.callback);
      if (messages < job->published.size()) has_others_.insert(job->ref.callback);
      most_ = std::max(most_, messages);
    }
    publishers_.assign(publishers.begin(), publishers.end());
    for (const std::uint32_t c : callbacks) {
      if (system.callbacks[c].kind == tracing::CallbackKind::subscription && !contains(publishers_, c))
        other_inputs_.push_back(c);
    }
  }

  InferredRule best() {
    add({.rule = PublishRule::always}, always());
    if (publishers_.size() == 1) add_every();
    const bool subscriptions_only = std::ranges::all_of(publishers_, [&](std::uint32_t c) {
      return system_.callbacks[c].kind == tracing::CallbackKind::subscription;
    });
    if (subscriptions_only) add_sets();
    const auto most = std::ranges::max(candidates_, {}, &InferredRule::explained).explained;
    std::erase_if(candidates_, [&](const InferredRule& c) { return c.explained != most; });
    InferredRule best = candidates_.front();
    std::vector<std::string> others;
    for (const InferredRule& c : std::span(candidates_).subspan(1))
      others.push_back(words_for(worth(c) > worth(best) ? std::exchange(best, c) : c));
    best.as_good = std::move(others);
    return best;
  }

 private:
  /// Among equal rules the larger set wins; a set with an input that publishes other topics loses.
  std::ptrdiff_t worth(const InferredRule& rule) const {
    const bool foreign = std::ranges::any_of(
        rule.of, [&](std::uint32_t c) { return has_others_.contains(c) && !contains(publishers_, c); });
    return foreign ? -1 : static_cast<std::ptrdiff_t>(rule.of.size());
  }

  void add(InferredRule rule, std::uint64_t explained) {
    rule.topic = topic_;
    rule.publishers = publishers_;
    rule.jobs = seen_.size();
    rule.explained = explained;
    rule.most_in_a_job = most_;
    candidates_.push_back(std::move(rule));
  }

  std::uint64_t always() const {
    return static_cast<std::uint64_t>(std::ranges::count_if(
        seen_, [&](const Seen& s) { return (s.messages > 0) == contains(publishers_, s.callback); }));
  }

  void add_every() {
    std::uint64_t jobs = 0, published = 0;
    for (const Seen& s : seen_) {
      if (s.callback != publishers_.front()) continue;
      ++jobs;
      published += s.messages > 0;
    }
    const std::uint64_t n = published == 0 ? 0 : (jobs + published / 2) / published;
    if (n < 2) return;
    // A trace may begin anywhere between two messages.
    std::uint64_t best = 0;
    for (std::uint64_t offset = 0; offset < n; ++offset) {
      std::uint64_t explained = 0, number = 0;
      for (const Seen& s : seen_) {
        const bool due = s.callback == publishers_.front() && number++ % n == offset;
        explained += due == (s.messages > 0);
      }
      best = std::max(best, explained);
    }
    add({.rule = PublishRule::every, .n = static_cast<std::uint32_t>(n)}, best);
  }

  void add_sets() {
    const std::size_t others = other_inputs_.size();
    if (others > kMostSubsets) {
      for (const std::uint32_t other : other_inputs_) add_set({other});
      return add_set(other_inputs_);
    }
    for (std::uint32_t chosen = 0; chosen < 1U << others; ++chosen) {
      Callbacks set;
      for (std::size_t i = 0; i < others; ++i)
        if (chosen >> i & 1U) set.push_back(other_inputs_[i]);
      add_set(std::move(set));
    }
  }

  /// Adds the set of the publishers and these inputs.
  void add_set(Callbacks set) {
    set.insert(set.end(), publishers_.begin(), publishers_.end());
    if (set.size() < 2) return;
    std::ranges::sort(set);
    std::set<std::uint32_t> fresh;
    std::uint64_t explained = 0;
    for (const Seen& s : seen_) {
      bool complete = false;
      if (contains(set, s.callback)) {
        fresh.insert(s.callback);
        complete = fresh.size() == set.size();
        if (complete || s.messages > 0) fresh.clear();
      }
      explained += complete == (s.messages > 0);
    }
    add({.rule = PublishRule::all_new, .of = std::move(set)}, explained);
  }

  std::string words_for(const InferredRule& rule) const {
    switch (rule.rule) {
      case PublishRule::every:
        return "every " + std::to_string(rule.n);
      case PublishRule::all_new: {
        std::string text = "all_new of";
        for (const std::uint32_t c : rule.of) text += " " + system_.topics[system_.callbacks[c].topic].name;
        return text;
      }
      default:
        return "always";
    }
  }

  const tracing::System& system_;
  const std::uint32_t topic_;
  std::vector<Seen> seen_;
  Callbacks publishers_, other_inputs_;
  std::set<std::uint32_t> has_others_;  // callbacks that also publish other topics
  std::vector<InferredRule> candidates_;
  std::uint64_t most_ = 0;
};

/// Stored samples go into the messages that the node's timers publish with every job; without such
/// timers, into the messages of its other subscriptions.
void keep_samples(const tracing::System& system, const Callbacks& callbacks, std::span<InferredRule> rules) {
  Callbacks kept;
  for (const std::uint32_t c : callbacks) {
    const auto has_part = [&](const InferredRule& r) {
      return contains(r.publishers, c) || contains(r.of, c);
    };
    if (system.callbacks[c].kind == tracing::CallbackKind::subscription &&
        std::ranges::none_of(rules, has_part))
      kept.push_back(c);
  }
  if (kept.empty()) return;
  const auto is_timer = [&](const InferredRule& r) {
    return system.callbacks[r.publishers.front()].kind == tracing::CallbackKind::timer;
  };
  const bool timers = std::ranges::any_of(rules, is_timer);
  for (InferredRule& rule : rules) {
    if (rule.rule != PublishRule::always || is_timer(rule) != timers) continue;
    rule.rule = PublishRule::last_of;
    rule.of = kept;
  }
}

/// A task publishes early if it does so before this share of its jobs, and by more than kSoon.
constexpr double kLate = 0.9;
constexpr Duration kSoon = std::chrono::microseconds(100);
/// Shares are rounded to this: jobs of one task vary by more.
constexpr double kStep = 1e-4;

template <class T>
T median(std::vector<T>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace

std::vector<InferredRule> infer_rules(const tracing::System& system, std::span<const tracing::Job> jobs,
                                      const std::vector<bool>& is_task) {
  std::vector<Callbacks> callbacks(system.nodes.size());
  for (std::uint32_t c = 0; c < is_task.size(); ++c)
    if (is_task[c]) callbacks[system.callbacks[c].node].push_back(c);
  std::vector<std::vector<const tracing::Job*>> of_node(system.nodes.size());
  for (const tracing::Job& job : jobs)
    if (job.ended && job.ref.callback < is_task.size() && is_task[job.ref.callback])
      of_node[system.callbacks[job.ref.callback].node].push_back(&job);
  std::vector<InferredRule> rules;
  for (std::uint32_t node = 0; node < system.nodes.size(); ++node) {
    std::set<std::uint32_t> topics;
    for (const tracing::Job* job : of_node[node])
      for (const tracing::Publication& p : job->published) topics.insert(p.topic);
    const std::size_t before = rules.size();
    for (const std::uint32_t topic : topics)
      rules.push_back(TopicOfNode(system, callbacks[node], topic, of_node[node]).best());
    keep_samples(system, callbacks[node], std::span(rules).subspan(before));
  }
  return rules;
}

EarlyPublications early_publications(const RecordedGraph& graph, std::span<const tracing::Job> jobs) {
  struct Instants {
    std::vector<Duration> before_end;
    std::vector<double> share;
  };
  std::map<std::pair<TaskId, std::uint32_t>, Instants> all;  // by task and topic
  for (const tracing::Job& job : jobs) {
    const TaskId task = graph.task(job.ref);
    if (task == kNoTask || !job.ended || job.finish <= job.start) continue;
    std::map<std::uint32_t, Time> last;  // by topic: a job that publishes twice sends its last message
    for (const tracing::Publication& p : job.published) last[p.topic] = p.at;
    for (const auto& [topic, at] : last) {
      Instants& instants = all[{task, topic}];
      instants.before_end.push_back(job.finish - at);
      instants.share.push_back(to_ms(at - job.start) / to_ms(job.finish - job.start));
    }
  }
  EarlyPublications early;
  for (auto& [from, instants] : all) {
    const double share = std::round(median(instants.share) / kStep) * kStep;
    if (share < kLate && median(instants.before_end) > kSoon) early[from] = std::clamp(share, 0.0, 1.0);
  }
  return early;
}

}  // namespace hotpath::imports
