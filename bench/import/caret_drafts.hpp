// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "hotpath/reference_system/callback.hpp"
#include "import/caret_files.hpp"

namespace hotpath::imports {

/// A callback of the graph under construction.
struct CaretDraft {
  std::size_t node = 0;  ///< Index into the architecture's nodes.
  const CaretCallback* caret = nullptr;
  const CaretStats* stats = nullptr;  ///< nullptr: not measured.
  double hertz = 0;                   ///< 0: unknown.
  Callback callback;

  [[nodiscard]] Duration typical_time() const {
    return stats == nullptr || stats->times.empty() ? Duration::zero()
                                                    : stats->times[stats->times.size() / 2].time;
  }
};

/// All callbacks that become tasks, and the topics that each publishes.
struct CaretDrafts {
  std::vector<CaretDraft> all;
  std::map<std::string, std::size_t> index;                     ///< By callback.
  std::map<std::string, std::vector<std::size_t>> subscribers;  ///< By topic.
  std::map<std::size_t, std::vector<std::string>> published;    ///< Topics by draft.
  std::map<std::size_t, std::vector<std::string>> guesses;      ///< Of these, the topics that were guessed.
  std::vector<std::string> unassigned;                          ///< Topics without a possible publisher.
  std::size_t idle = 0;                ///< Callbacks that did not run while CARET measured.
  std::size_t twice = 0;               ///< Second subscriptions of a node to a topic.
  std::size_t known = 0, guessed = 0;  ///< Publications.
  std::size_t unheard = 0;             ///< Topics without subscribers and without a known callback.
  std::size_t cycles = 0;              ///< Rejected guesses that would have closed a cycle.

  /// Frequency of a topic in Hz, from the statistics of its subscribers; 0: unknown.
  [[nodiscard]] double frequency(const std::string& topic) const;
};

/// Steps of named paths: node, topic taken, topic sent.
using CaretSteps = std::set<std::tuple<std::string, std::string, std::string>>;

/// The drafts refer to both arguments, which must outlive them. `stats` may be empty.
[[nodiscard]] CaretDrafts make_drafts(const CaretArchitecture& architecture,
                                      const std::map<std::string, CaretStats>& stats);

/// Assigns the publications that CARET names, then those that named paths need, then the rest. An
/// assignment that would close a cycle is rejected. `measured`: there are statistics.
void assign_publications(const CaretArchitecture& architecture, const CaretSteps& on_path, bool measured,
                         CaretDrafts& drafts);

}  // namespace hotpath::imports
