// SPDX-License-Identifier: Apache-2.0
#include "import/recorded_window.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <tuple>

#include "hotpath/reference_system/observe.hpp"
#include "hotpath/reference_system/simulated_message.hpp"

namespace hotpath::imports {

namespace {

using Message = std::shared_ptr<const SimulatedMessage>;

/// Key of a message: the job that published it, and its topic.
using MessageKey = std::tuple<std::uint32_t, std::uint64_t, std::uint32_t>;

class Follower {
 public:
  Follower(const tracing::System& system, const RecordedGraph& graph, const RecordedWindow& window)
      : system_(system),
        graph_(graph),
        window_(window),
        chains_(index_chains(graph.graph, graph.tasks)),
        history_(ChainLanes(graph.graph, graph.tasks)) {
    for (const InferredRule& rule : graph.rules) {
      held_.emplace_back(rule.of.size());
    }
  }

  std::vector<ChainObservation> follow() {
    for (const auto& [event, step] : steps()) step();
    return std::move(observations_);
  }

 private:
  struct Running {
    JobRef ref;
    Time start{};
    Message own;
    std::vector<std::uint32_t> observed;
    bool published = false;
  };

  /// What to do at which event of the trace, in its order.
  std::vector<std::pair<std::uint64_t, std::function<void()>>> steps() {
    std::vector<std::pair<std::uint64_t, std::function<void()>>> steps;
    for (std::size_t i = 0; i < window_.jobs.size(); ++i) {
      const tracing::Job& job = window_.jobs[i];
      if (graph_.task(job.ref) == kNoTask) continue;
      steps.emplace_back(job.started, [this, i] { start(i); });
      if (job.ended) steps.emplace_back(job.finished, [this, i] { finish(i); });
      for (const tracing::Publication& p : job.published)
        steps.emplace_back(p.event, [this, i, &p] { publish(i, p); });
      if (job.has_sample) ++readers_[key_of(job)];
    }
    std::ranges::sort(steps, {}, [](const auto& step) { return step.first; });
    return steps;
  }

  /// Of the message that the job took.
  MessageKey key_of(const tracing::Job& job) const {
    return {job.sample.parent.callback, job.sample.parent.number, system_.callbacks[job.ref.callback].topic};
  }

  void start(std::size_t i) {
    const tracing::Job& job = window_.jobs[i];
    Running& running = running_[i];
    running.ref = window_.records[i].job.ref();
    running.start = job.start;
    if (!job.has_sample) return;
    const MessageKey key = key_of(job);
    const auto message = messages_.find(key);
    if (message == messages_.end()) return;
    running.own = message->second;
    if (--readers_[key] == 0) {
      readers_.erase(key);
      messages_.erase(message);
    }
    for (std::size_t r = 0; r < graph_.rules.size(); ++r) {
      const auto& of = graph_.rules[r].of;
      const auto slot = std::ranges::find(of, job.ref.callback);
      if (slot != of.end()) held_[r][static_cast<std::size_t>(slot - of.begin())] = running.own;
    }
  }

  void publish(std::size_t i, const tracing::Publication& publication) {
    Running& running = running_[i];
    const tracing::Job& job = window_.jobs[i];
    auto message = std::make_shared<SimulatedMessage>();
    for (std::size_t r = 0; r < graph_.rules.size(); ++r) {
      const InferredRule& rule = graph_.rules[r];
      const bool by_rule = rule.topic == publication.topic &&
                           (std::ranges::find(rule.publishers, job.ref.callback) != rule.publishers.end());
      if (!by_rule) continue;
      for (Message& held : held_[r]) {
        if (held) history_.merge(*message, *held, running.ref.task);
        held.reset();
      }
    }
    if (running.own) history_.merge(*message, *running.own, running.ref.task);
    history_.append(*message, {running.ref.task, 0, running.ref.sequence, running.start}, 0);
    running.published = true;
    observe(*message, running);
    const MessageKey key{job.ref.callback, job.ref.number, publication.topic};
    if (readers_.contains(key)) messages_[key] = std::move(message);
  }

  void finish(std::size_t i) {
    const auto running = running_.find(i);
    if (!running->second.published && running->second.own) observe(*running->second.own, running->second);
    running_.erase(running);
  }

  void observe(const SimulatedMessage& message, Running& running) {
    ends_.clear();
    for (std::uint32_t c = 0; c < chains_.size(); ++c)
      if (chains_[c].ends_in(running.ref.task)) ends_.push_back(c);
    observe_chains(history_, message, chains_, ends_, running,
                   [this](const ChainObservation& o) { observations_.push_back(o); });
  }

  const tracing::System& system_;
  const RecordedGraph& graph_;
  const RecordedWindow& window_;
  const std::vector<ChainIndex> chains_;
  const SimulatedHistory history_;
  std::vector<std::vector<Message>> held_;  // by rule, by its inputs
  std::map<std::size_t, Running> running_;  // by job
  std::map<MessageKey, std::uint32_t> readers_;
  std::map<MessageKey, Message> messages_;
  std::vector<std::uint32_t> ends_;
  std::vector<ChainObservation> observations_;
};

}  // namespace

std::vector<ChainObservation> recorded_chains(const tracing::System& system, const RecordedGraph& graph,
                                              const RecordedWindow& window) {
  return Follower(system, graph, window).follow();
}

}  // namespace hotpath::imports
