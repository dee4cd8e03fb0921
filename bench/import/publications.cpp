// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_graph.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "program/text.hpp"

namespace hotpath::imports {

namespace {

using Callbacks = std::vector<std::uint32_t>;

/// With more candidates for a set, only each candidate alone and all of them together are tried.
constexpr std::size_t kMostSubsets = 6;

/// An input of so many times as many jobs as messages would have completed some of the sets.
constexpr double kOutpaced = 1.5;

/// One job of a node, with its messages on one topic.
struct Seen {
  std::uint32_t callback;
  std::uint64_t messages;
};

bool contains(const Callbacks& all, std::uint32_t one) { return std::ranges::find(all, one) != all.end(); }

std::vector<std::string> topics_of(const tracing::System& system, const Callbacks& subscriptions) {
  std::vector<std::string> names;
  for (const std::uint32_t c : subscriptions) names.push_back(system.topics[system.callbacks[c].topic].name);
  return names;
}

/// A topic that a node publishes.
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
      publishing_ += messages > 0;
      if (messages > 0) publishers.insert(job->ref.callback);
      if (messages < job->published.size()) has_others_.insert(job->ref.callback);
    }
    publishers_.assign(publishers.begin(), publishers.end());
    for (const std::uint32_t c : callbacks)
      if (is_subscription(c) && !publishers.contains(c)) other_inputs_.push_back(c);
  }

  InferredRule best() {
    add({.rule = PublishRule::always});
    if (publishers_.size() == 1) add_every();
    if (std::ranges::all_of(publishers_, [&](std::uint32_t c) { return is_subscription(c); })) add_sets();
    const auto most = std::ranges::max(candidates_, {}, &InferredRule::explained).explained;
    std::erase_if(candidates_, [&](const InferredRule& c) { return c.explained != most; });
    InferredRule best = candidates_.front();
    std::vector<InferredRule> others;
    for (const InferredRule& c : std::span(candidates_).subspan(1))
      others.push_back(worth(c) > worth(best) ? std::exchange(best, c) : c);
    std::ranges::stable_sort(others, std::ranges::greater{}, [&](const InferredRule& c) { return worth(c); });
    best.as_good = std::move(others);
    return best;
  }

 private:
  bool is_subscription(std::uint32_t c) const {
    return system_.callbacks[c].kind == tracing::CallbackKind::subscription;
  }
  auto jobs_of(std::uint32_t c) const { return std::ranges::count(seen_, c, &Seen::callback); }

  /// Among equal rules the larger set wins; a set with an input that publishes other topics loses, and so
  /// does one with an input that had many chances to complete it.
  std::ptrdiff_t worth(const InferredRule& rule) const {
    const bool foreign = std::ranges::any_of(rule.of, [&](std::uint32_t c) {
      const bool outpaced = static_cast<double>(jobs_of(c)) > kOutpaced * static_cast<double>(publishing_);
      return !contains(publishers_, c) && (has_others_.contains(c) || outpaced);
    });
    return foreign ? -1 : std::ssize(rule.of);
  }

  /// The number of jobs that publish if and only if the rule makes them due.
  std::uint64_t explained(const InferredRule& rule) const {
    const bool set = rule.rule == PublishRule::all_new;
    std::set<std::uint32_t> fresh;  // members of the set with new samples
    std::uint64_t explained = 0, number = 0;
    for (const Seen& s : seen_) {
      bool is_due = contains(set ? rule.of : publishers_, s.callback);
      if (is_due && set) {
        fresh.insert(s.callback);
        is_due = fresh.size() == rule.of.size();
        if (is_due || s.messages > 0) fresh.clear();
      } else if (is_due && rule.rule == PublishRule::every) {
        is_due = number++ % rule.n + 1 == rule.first;
      }
      explained += is_due == (s.messages > 0);
    }
    return explained;
  }

  void add(InferredRule rule) {
    rule.topic = topic_;
    rule.publishers = publishers_;
    rule.jobs = seen_.size();
    rule.explained = explained(rule);
    rule.most_in_a_job = std::ranges::max(seen_, {}, &Seen::messages).messages;
    candidates_.push_back(std::move(rule));
  }

  void add_every() {
    const std::uint32_t publisher = publishers_.front();
    const auto n = static_cast<std::uint32_t>((jobs_of(publisher) + publishing_ / 2) / publishing_);
    if (n < 2) return;
    std::vector<std::uint64_t> messages(n, 0);  // by place: a trace may begin between two messages
    std::size_t number = 0;
    for (const Seen& s : seen_)
      if (s.callback == publisher) messages[number++ % n] += s.messages > 0;
    const auto place = static_cast<std::uint32_t>(std::ranges::max_element(messages) - messages.begin());
    add({.rule = PublishRule::every, .n = n, .first = place + 1});
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
    std::ranges::sort(set);
    if (set.size() > 1) add({.rule = PublishRule::all_new, .of = std::move(set)});
  }

  const tracing::System& system_;
  const std::uint32_t topic_;
  std::vector<Seen> seen_;         // not empty
  std::ptrdiff_t publishing_ = 0;  // of these
  Callbacks publishers_, other_inputs_;
  std::set<std::uint32_t> has_others_;  // callbacks that also publish other topics
  std::vector<InferredRule> candidates_;
};

/// Stored samples go into the messages that the node's timers publish with every job; without such
/// timers, into the messages of its other subscriptions.
void keep_samples(const tracing::System& system, const Callbacks& callbacks, std::span<InferredRule> rules) {
  Callbacks kept;
  for (const std::uint32_t c : callbacks) {
    const auto has_part = [&](const InferredRule& r) {
      return contains(r.publishers, c) || contains(r.of, c);
    };
    const tracing::Callback& callback = system.callbacks[c];
    if (callback.kind == tracing::CallbackKind::subscription && !callback.of_action &&
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

/// A rule that explains a smaller share of a node's jobs does not describe it.
constexpr double kDescribes = 0.95;

/// Callbacks of subscriptions are functions of this namespace.
constexpr const char* kSynchronisers = "message_filters";

auto median(auto& samples) { return ranked(samples, 50); }

/// Callbacks of the graph that are a synchroniser's, by node.
std::map<std::uint32_t, Callbacks> synchronisers(const tracing::System& system, const RecordedGraph& graph) {
  std::map<std::uint32_t, Callbacks> filtered;
  for (std::uint32_t c = 0; c < graph.task_of.size(); ++c)
    if (graph.task_of[c] != kNoTask && system.callbacks[c].symbol.find(kSynchronisers) != std::string::npos)
      filtered[system.callbacks[c].node].push_back(c);
  return filtered;
}

/// How long a synchroniser held the oldest message of each output: if it joins the latest ones, and if its
/// n-th output joins the n-th message of the rarest input and those just before that one. The latter is empty
/// if it drops messages of the rarest input.
std::pair<std::vector<Duration>, std::vector<Duration>> times_held(const RecordedSystem& recorded,
                                                                   const Callbacks& of) {
  std::pair<std::vector<Duration>, std::vector<Duration>> held;
  auto& [least, most] = held;
  const auto jobs_of = [&](std::uint32_t c) { return recorded.system.callbacks[c].jobs; };
  const std::uint32_t rarest = *std::ranges::min_element(of, {}, jobs_of);
  std::map<std::uint32_t, std::vector<Time>> arrived;  // by callback
  for (const tracing::Job& job : recorded.jobs) {
    if (!contains(of, job.ref.callback)) continue;
    arrived[job.ref.callback].push_back(job.sample.published);
    if (job.published.empty()) continue;
    const Time at = job.published.back().at;
    Time latest = at, earliest = at;
    if (const std::vector<Time>& rare = arrived[rarest]; most.size() < rare.size())
      earliest = rare[most.size()];
    for (const auto& [callback, messages] : arrived) {
      if (messages.empty()) continue;
      latest = std::min(latest, messages.back());
      const auto later = std::ranges::upper_bound(messages, earliest);
      if (later != messages.begin() && callback != rarest) earliest = *std::prev(later);
    }
    least.push_back(at - latest);
    most.push_back(at - earliest);
  }
  if (static_cast<double>(most.size()) < kDescribes * static_cast<double>(arrived[rarest].size()))
    most.clear();
  return held;
}

}  // namespace

std::vector<InferredRule> infer_rules(const tracing::System& system, std::span<const tracing::Job> jobs,
                                      const std::vector<bool>& is_task, bool other) {
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
    for (const std::uint32_t topic : topics) {
      InferredRule best = TopicOfNode(system, callbacks[node], topic, of_node[node]).best();
      if (other && !best.as_good.empty()) best = InferredRule(best.as_good.front());
      rules.push_back(std::move(best));
    }
    keep_samples(system, callbacks[node], std::span(rules).subspan(before));
  }
  return rules;
}

std::string rule_text(const tracing::System& system, const InferredRule& rule) {
  const std::string topics = program::joined(topics_of(system, rule.of));
  switch (rule.rule) {
    case PublishRule::always:
      return "with every job";
    case PublishRule::every:
      return program::concat("with one in ", rule.n, " jobs, from job ", rule.first, " on");
    case PublishRule::all_new:
      return "when all are new: " + topics;
    case PublishRule::last_of:
      return "with every job, with the last of " + topics + " (assumed)";
  }
  return {};
}

EarlyPublications early_publications(std::span<const tracing::Job> jobs) {
  struct Instants {
    std::vector<Duration> before_end;
    std::vector<double> share;
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, Instants> all;
  for (const tracing::Job& job : jobs) {
    if (!job.ended || job.finish <= job.start) continue;
    std::map<std::uint32_t, Time> last;  // by topic: a job that publishes twice sends its last message
    for (const tracing::Publication& p : job.published) last[p.topic] = p.at;
    for (const auto& [topic, at] : last) {
      Instants& instants = all[{job.ref.callback, topic}];
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

std::vector<std::string> unmodelled(const tracing::System& system, const RecordedGraph& graph) {
  std::vector<std::string> all;
  for (const auto& [node, of] : synchronisers(system, graph)) {
    all.push_back(program::concat(
        "Node ", system.nodes[node], " passes ", program::joined(topics_of(system, of)),
        " through message_filters, which may hold them until later ones arrive; the graph does not."));
  }
  for (const InferredRule& rule : graph.rules) {
    if (static_cast<double>(rule.explained) >= kDescribes * static_cast<double>(rule.jobs)) continue;
    all.push_back(program::concat(
        "No rule of publication describes topic ", system.topics[rule.topic].name, ": the best one explains ",
        rule.explained, " of ", rule.jobs, " jobs of ",
        system.nodes[system.callbacks[rule.publishers.front()].node],
        ". A lifecycle node publishes only while it is active; other nodes decide by content."));
  }
  return all;
}

std::map<std::string, std::string> synchronised_chains(const RecordedSystem& recorded,
                                                       const RecordedGraph& graph) {
  std::map<std::string, std::string> all;
  for (const auto& [node, of] : synchronisers(recorded.system, graph)) {
    auto [least, most] = times_held(recorded, of);
    if (least.empty()) continue;
    std::string held = program::text("%.1f ms (median) or longer", to_ms(median(least)));
    if (!most.empty() && median(most) > median(least))
      held += program::text(", or %.1f ms if it joins each in turn by the instants of publication",
                            to_ms(median(most)));
    const std::string text = program::concat(
        " contains a synchroniser (node ", recorded.system.nodes[node], "): it held messages for ", held,
        ". A trace does not show which messages it joins: not modelled, and not compared.");
    const auto is_its = [&, &callbacks = of](const std::string& task) {
      return std::ranges::any_of(
          callbacks, [&](std::uint32_t c) { return graph.tasks.set[graph.task_of[c]].name == task; });
    };
    for (const Chain& chain : graph.graph.chains)
      if (std::ranges::any_of(chain.nodes, is_its)) all[chain.name] = chain.name + text;
  }
  return all;
}

}  // namespace hotpath::imports
