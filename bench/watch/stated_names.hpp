// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "hotpath/tracing/system.hpp"
#include "watch/contract.hpp"

namespace hotpath::watch {

[[nodiscard]] std::string node_name(const tracing::System& system, std::uint32_t node);
/// `/node (timer 100 ms)`, `/node /topic` or `/node /name (service)`.
[[nodiscard]] std::string callback_name(const tracing::System& system, const tracing::Callback& callback);

/// Finds the callbacks and topics of a contract in a running system, whose nodes may all be in one
/// further namespace, as in `/robot1/filter` and `/robot1/points` for `filter` and `points`. Until a
/// callback of the contract has run, that is the namespace in which most of the nodes are.
class StatedNames {
 public:
  /// Both must outlive it.
  StatedNames(const Contract& contract, const tracing::System& system);

  /// Index of the contract's entry for a callback of the system; kNone: none.
  [[nodiscard]] std::uint32_t entry_of(std::uint32_t callback);
  /// A job of the entry, a timer, started.
  void timer_ran(std::uint32_t entry, Time start) { latest_[entry] = start; }
  /// Whether a callback of the contract has run.
  [[nodiscard]] bool kept() const { return kept_; }

  /// Topics that callbacks of the contract publish.
  [[nodiscard]] const std::vector<std::string>& topics() const { return topics_; }
  /// Its index in topics(); kNone: no callback of the contract publishes it.
  [[nodiscard]] std::uint32_t number_of(const std::string& topic) const;
  /// The same for a topic of the running system.
  [[nodiscard]] std::uint32_t number_of(std::uint32_t topic);
  /// Whether the contract lets the node of the running system publish the topic of this number.
  [[nodiscard]] bool may_publish(std::uint32_t node, std::uint32_t number) const;

 private:
  bool resolve();
  [[nodiscard]] bool is_inside(const std::string& name) const {
    return space_ && name.starts_with(*space_ + "/");
  }
  [[nodiscard]] std::string stated_node(std::uint32_t node) const;
  [[nodiscard]] std::string stated_topic(std::uint32_t topic) const;
  [[nodiscard]] std::uint32_t find_entry(std::uint32_t callback) const;
  [[nodiscard]] std::uint32_t replaced_timer(const std::string& node, std::uint32_t number,
                                             const tracing::Callback& by) const;

  const Contract& contract_;
  const tracing::System& system_;
  std::set<std::string> nodes_;
  std::vector<std::string> topics_;
  std::map<std::string, std::uint32_t> numbers_;
  std::optional<std::string> space_;  // `/robot1`; empty: none
  std::size_t resolved_ = 0;          // nodes of the system
  bool kept_ = false;
  std::vector<std::optional<std::uint32_t>> entries_;  // by callback of the system
  std::vector<std::uint32_t> of_system_;               // by topic of the system
  std::vector<std::optional<Time>> latest_;            // by entry: start of a timer's latest job
};

}  // namespace hotpath::watch
