// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "hotpath/tracing/system.hpp"
#include "watch/judged_term.hpp"
#include "watch/stated_names.hpp"

namespace hotpath::watch {

/// Compares the publishers of topics with those of a contract.
class PublisherCheck {
 public:
  /// The contract must outlive it.
  PublisherCheck(const Contract& contract, const StatedNames& names);

  /// A message of a job on a stated topic. `entry`: its callback in the contract, with its verdicts;
  /// kNone: none.
  void published(const tracing::System& system, const tracing::Job& job, std::uint32_t topic,
                 std::uint32_t entry, Subject* callback, Incidents& incidents);
  /// A subscription got a sample that no watched job published, unlike earlier ones.
  void from_stranger(std::uint32_t topic, Time at, Incidents& incidents);
  /// Judges publishers that were created since the last call.
  void created(const tracing::System& system, StatedNames& names, Time at, Incidents& incidents);

  /// By stated topic.
  [[nodiscard]] const std::vector<Subject>& subjects() const { return subjects_; }

 private:
  const Contract& contract_;
  std::vector<Subject> subjects_;
  std::vector<std::set<std::string>> nodes_;  // by topic: that publish it
  std::vector<bool> judged_;                  // by endpoint of the system
};

}  // namespace hotpath::watch
