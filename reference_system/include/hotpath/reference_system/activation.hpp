// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hotpath/core/job.hpp"

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
    std::uint32_t taken = 0;  ///< End of its samples among those of the job.
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

}  // namespace hotpath
