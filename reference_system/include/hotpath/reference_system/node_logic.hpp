// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <mutex>
#include <utility>
#include <vector>

#include "hotpath/reference_system/graph.hpp"
#include "hotpath/reference_system/stat.hpp"

namespace hotpath {

/// Inputs of a fusion node that one job can work on.
inline constexpr std::size_t kMaxFusionInputs = 8;

/// What one job does, between its start and its finish. `Messages` says how messages are held:
///   `Messages::History`  sample management of its message type, see Message4kbHistory;
///   `Messages::Held`     a sample that a node keeps; movable, false when it holds none;
///   `Messages::message(held)`  its message; `Messages::Mutex`.
template <class Messages>
struct Activation {
  Time start{};
  bool works = false;      ///< Burns the node's execution time.
  bool publishes = false;  ///< finish() fills a message, which is then published.
  std::uint32_t dropped = 0;
  std::array<typename Messages::Held, kMaxFusionInputs> held;
};

/// The behaviour of one node of the reference system, the same for live executors and simulator. A job is
/// start(), then its work, then finish(). Jobs of one node may overlap (reentrant groups,
/// release-and-execute).
template <class Messages>
class NodeLogic {
 public:
  using Held = typename Messages::Held;
  using History = typename Messages::History;
  using Message = typename History::Message;

  NodeLogic(std::uint32_t index, const Node& node, const History& history)
      : index_(index),
        type_(node.type),
        history_(&history),
        slots_(node.type == NodeType::fusion || node.type == NodeType::cyclic ? node.inputs.size() : 0),
        last_seen_(node.inputs.size(), 0),
        published_(std::max<std::size_t>(node.outputs.size(), 1), 0),
        has_output_(!node.outputs.empty()) {
    assert(type_ != NodeType::fusion || slots_.size() <= kMaxFusionInputs);
  }

  /// A job of the timer.
  void start_timer(Time now, Activation<Messages>& job) {
    job.start = now;
    job.works = true;
    job.publishes = has_output_;
  }

  /// A job of the subscription `input`, which takes `sample`.
  void start_subscription(std::uint32_t input, Held sample, Time now, Activation<Messages>& job) {
    job.start = now;
    const std::lock_guard lock(mutex_);
    switch (type_) {
      case NodeType::transform:
      case NodeType::intersection:
      case NodeType::command:
        job.dropped = missed(input, sample);
        job.held[0] = std::move(sample);
        job.works = true;
        job.publishes = type_ != NodeType::command && has_output_;
        break;
      case NodeType::fusion:
        slots_[input] = std::move(sample);
        for (const Held& slot : slots_) {
          if (!slot) return;
        }
        for (std::uint32_t i = 0; i < slots_.size(); ++i) {
          job.dropped += missed(i, slots_[i]);
          job.held[i] = std::move(slots_[i]);
        }
        job.works = true;
        job.publishes = has_output_;
        break;
      case NodeType::cyclic:
        slots_[input] = std::move(sample);
        break;
      case NodeType::sensor:
        assert(false && "a sensor has no input");
    }
  }

  /// Output of a job of `input` (timers: 0): index into the node's outputs.
  [[nodiscard]] std::uint32_t output(std::uint32_t input) const {
    return type_ == NodeType::intersection ? input : 0;
  }

  /// Fills the message that the job publishes on `output`.
  void finish(std::uint32_t output, Activation<Messages>& job, Message& out) {
    const std::lock_guard lock(mutex_);
    History::clear(out);
    if (type_ == NodeType::cyclic) {
      // The inputs are read after the work, as upstream does.
      for (std::uint32_t i = 0; i < slots_.size(); ++i) {
        if (!slots_[i]) continue;
        job.dropped += missed(i, slots_[i]);
        History::merge(out, Messages::message(slots_[i]));
        slots_[i] = Held();
      }
    } else {
      for (const Held& held : job.held) {
        if (held) History::merge(out, Messages::message(held));
      }
    }
    history_->append(out, {index_, published_[output]++, job.dropped, job.start});
  }

 private:
  /// Samples of an input that were lost since the last one used. The first loss is under-counted by one
  /// sample, since sequences start at 0 and so does the memory (upstream).
  std::uint32_t missed(std::uint32_t input, const Held& sample) {
    const std::uint32_t sequence = History::last_sequence(Messages::message(sample));
    const std::uint32_t previous = std::exchange(last_seen_[input], sequence);
    return sequence > previous ? sequence - previous - 1 : 0;
  }

  const std::uint32_t index_;
  const NodeType type_;
  const History* history_;
  [[no_unique_address]] typename Messages::Mutex mutex_;
  std::vector<Held> slots_;
  std::vector<std::uint32_t> last_seen_;
  std::vector<std::uint32_t> published_;
  const bool has_output_;
};

}  // namespace hotpath
