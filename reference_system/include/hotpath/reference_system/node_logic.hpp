// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <functional>
#include <mutex>
#include <utility>
#include <vector>

#include "hotpath/core/job.hpp"
#include "hotpath/reference_system/chain_observation.hpp"
#include "hotpath/reference_system/graph.hpp"

namespace hotpath {

/// The state of one job between its start and its finish; reusable, because clear() keeps its memory.
/// `Messages` defines how messages are held:
///   `Messages::History`  sample management of its message type, see Message4kbHistory and TaskHistory;
///   `Messages::Held`     a sample that a node keeps; movable, false when it holds none;
///   `Messages::message(held)`  its message; `Messages::share(held)` another hold on it;
///   `Messages::Mutex`    guards the state of one node.
template <class Messages>
struct Activation {
  using Held = typename Messages::Held;
  struct Message {
    std::uint32_t publication = 0;  ///< Position among the callback's publications.
    std::uint32_t dropped = 0;
    std::uint32_t taken = 0;   ///< End of its samples among those of the job.
    std::uint32_t output = 0;  ///< Index into the node's outputs.
    double at = 1;             ///< Share of the job's execution time before it.
  };

  JobRef ref;
  Time start{};
  std::uint32_t callback = 0;
  bool works = false;                   ///< Burns the callback's execution time.
  Held own;                             ///< The sample that it took, unless only sets of the node have it.
  std::vector<Held> taken;              ///< Samples of complete sets.
  std::vector<Message> messages;        ///< What it publishes at its finish.
  std::vector<std::uint32_t> observed;  ///< Chains that it has ended.

  /// Gives all samples back.
  void clear() {
    own = Held();
    taken.clear();
    messages.clear();
    observed.clear();
  }
};

/// The behaviour of one node, shared by live executors and simulator. A job consists of start(),
/// its work, and finish() for each of its messages. Jobs of one node may overlap (reentrant groups,
/// release-and-execute).
template <class Messages>
class NodeLogic {
 public:
  using Held = typename Messages::Held;
  using History = typename Messages::History;
  using Message = typename History::Message;

  NodeLogic(const Node& node, const History& history)
      : history_(&history), published_(node.outputs.size(), 0) {
    const std::vector<Callback> callbacks = callbacks_of(node);
    for (const Callback& callback : callbacks) {
      OfCallback& own = callbacks_.emplace_back();
      own.always_works =
          !callback.waits_for_sets() && !(callback.stores_only && callback.worst == Duration::zero());
      for (const Publication& publication : callback.publishes) {
        const std::uint32_t before = publication.first > 0 ? publication.n - publication.first : 0;
        own.publications.push_back(
            {output_of(node, publication.topic), set_of(publication), before, 0, publication});
      }
    }
    for (std::size_t c = 0; c < callbacks.size(); ++c) {
      if (callbacks[c].input) store(*callbacks[c].input, callbacks_[c]);
    }
  }

  /// Reserves memory for any job of the node, and for the ends of `chains` chains.
  void reserve(Activation<Messages>& job, std::size_t chains) const {
    std::size_t samples = 0, messages = 0;
    for (const Set& set : sets_) samples += set.slots.size();
    for (const OfCallback& c : callbacks_) messages = std::max(messages, c.publications.size());
    job.taken.reserve(std::max(job.taken.capacity(), samples));
    job.messages.reserve(std::max(job.messages.capacity(), messages));
    job.observed.reserve(std::max(job.observed.capacity(), chains));
  }

  /// Starts a job of the node's callback at this position, which takes `sample` (timers: none).
  /// `job` must be clear.
  void start(std::uint32_t callback, JobRef ref, Held sample, Time now, Activation<Messages>& job) {
    job.ref = ref;
    job.start = now;
    job.callback = callback;
    OfCallback& own = callbacks_[callback];
    const std::lock_guard lock(mutex_);
    std::uint32_t lost = 0;
    if (sample) {
      if (own.keeps_sample) lost = missed(own.last_seen, sample);
      for (const auto& [set, slot] : own.stores) {
        const bool shared = own.keeps_sample || std::pair(set, slot) != own.stores.back();
        // NOLINTNEXTLINE(bugprone-use-after-move): the last place gets the sample itself
        sets_[set].slots[slot].held = shared ? Messages::share(sample) : std::move(sample);
      }
      if (own.keeps_sample) job.own = std::move(sample);
    }
    for (std::uint32_t p = 0; p < own.publications.size(); ++p) {
      OfPublication& publication = own.publications[p];
      publication.lost += lost;
      if (!due(publication)) continue;
      std::uint32_t dropped = std::exchange(publication.lost, 0);
      if (publication.what.rule == PublishRule::all_new) {
        for (Slot& slot : sets_[publication.set].slots) {
          dropped += missed(slot.last_seen, slot.held);
          job.taken.push_back(std::move(slot.held));
        }
      }
      job.messages.push_back({p, dropped, static_cast<std::uint32_t>(job.taken.size()), publication.output,
                              publication.what.at});
    }
    job.works = own.always_works || !job.messages.empty();
  }

  /// Visits what its later behaviour depends on: numbers, and samples that it keeps.
  void visit_state(const std::function<void(std::uint32_t)>& number,
                   const std::function<void(const Held&)>& sample) const {
    for (const OfCallback& callback : callbacks_) {
      for (const OfPublication& publication : callback.publications) number(publication.jobs);
    }
    for (const Set& set : sets_) {
      for (const Slot& slot : set.slots) sample(slot.held);
    }
  }

  /// Fills the job's message `index`.
  void finish(const Activation<Messages>& job, std::size_t index, Message& out) {
    const OfPublication& publication = callbacks_[job.callback].publications[job.messages[index].publication];
    std::uint32_t dropped = job.messages[index].dropped;
    const std::lock_guard lock(mutex_);
    History::clear(out);
    if (publication.what.rule == PublishRule::last_of) {
      // Inputs are read after the work, like in upstream's cyclic node.
      for (Slot& slot : sets_[publication.set].slots) {
        if (!slot.held) continue;
        dropped += missed(slot.last_seen, slot.held);
        history_->merge(out, Messages::message(slot.held), job.ref.task);
        slot.held = Held();
      }
    }
    for (std::size_t i = index == 0 ? 0 : job.messages[index - 1].taken; i < job.messages[index].taken; ++i) {
      history_->merge(out, Messages::message(job.taken[i]), job.ref.task);
    }
    if (job.own) history_->merge(out, Messages::message(job.own), job.ref.task);
    history_->append(out, {job.ref.task, dropped, job.ref.sequence, job.start},
                     published_[publication.output]++);
  }

 private:
  static constexpr std::uint32_t kNoSet = ~0U;

  struct Slot {
    Held held;
    std::uint32_t last_seen = 0;
  };
  /// Samples that wait for a message, shared by all callbacks that publish it.
  struct Set {
    Publication what;
    std::vector<Slot> slots;  // parallel to what.of
  };
  struct OfPublication {
    std::uint32_t output = 0;
    std::uint32_t set = kNoSet;
    std::uint32_t jobs = 0;  // since the last message, of rule `every`
    std::uint32_t lost = 0;  // samples of the callback's own input, since the last message
    Publication what;
  };
  struct OfCallback {
    bool always_works = true;
    bool keeps_sample = true;
    std::uint32_t last_seen = 0;
    std::vector<OfPublication> publications;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> stores;  // sets and slots for its samples
  };

  static std::uint32_t output_of(const Node& node, const std::string& topic) {
    return static_cast<std::uint32_t>(std::find(node.outputs.begin(), node.outputs.end(), topic) -
                                      node.outputs.begin());
  }

  /// Callbacks that publish the same all_new set share it; each last_of publication has its own
  /// set.
  std::uint32_t set_of(const Publication& publication) {
    if (publication.of.empty()) return kNoSet;
    const auto same = [&](const Set& set) {
      return publication.rule == PublishRule::all_new && same_rule(set.what, publication);
    };
    auto set = std::find_if(sets_.begin(), sets_.end(), same);
    if (set == sets_.end()) set = sets_.insert(set, {publication, std::vector<Slot>(publication.of.size())});
    return static_cast<std::uint32_t>(set - sets_.begin());
  }

  void store(std::uint32_t input, OfCallback& callback) const {
    for (std::uint32_t s = 0; s < sets_.size(); ++s) {
      const std::vector<std::uint32_t>& of = sets_[s].what.of;
      const auto place = std::find(of.begin(), of.end(), input);
      if (place != of.end()) callback.stores.emplace_back(s, static_cast<std::uint32_t>(place - of.begin()));
    }
    const auto needs_it = [&](const OfPublication& p) {
      const std::vector<std::uint32_t>& of = p.what.of;
      return p.what.rule != PublishRule::all_new || std::find(of.begin(), of.end(), input) == of.end();
    };
    callback.keeps_sample = callback.stores.empty() ||
                            std::any_of(callback.publications.begin(), callback.publications.end(), needs_it);
  }

  /// Whether a job that starts now will publish it.
  bool due(OfPublication& publication) {
    switch (publication.what.rule) {
      case PublishRule::always:
      case PublishRule::last_of:
        return true;
      case PublishRule::every:
        if (++publication.jobs < publication.what.n) return false;
        publication.jobs = 0;
        return true;
      case PublishRule::all_new:
        break;
    }
    const std::vector<Slot>& slots = sets_[publication.set].slots;
    return std::all_of(slots.begin(), slots.end(), [](const Slot& s) { return static_cast<bool>(s.held); });
  }

  /// Number of samples of an input lost since the last used one. The first loss is under-counted by
  /// one sample, because both sequences and `last_seen` start at 0 (upstream).
  static std::uint32_t missed(std::uint32_t& last_seen, const Held& sample) {
    const std::uint32_t sequence = History::publication(Messages::message(sample));
    const std::uint32_t previous = std::exchange(last_seen, sequence);
    return sequence > previous ? sequence - previous - 1 : 0;
  }

  const History* history_;
  [[no_unique_address]] typename Messages::Mutex mutex_;
  std::vector<OfCallback> callbacks_;
  std::vector<Set> sets_;
  std::vector<std::uint32_t> published_;  // by output
};

}  // namespace hotpath
