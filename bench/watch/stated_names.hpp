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

/// Finds the nodes and topics of a contract in a running system, whose nodes may all be in one
/// further namespace, as in `/robot1/filter` and `/robot1/points` for `filter` and `points`.
class StatedNames {
 public:
  explicit StatedNames(const Contract& contract);

  /// Whether any node of the contract runs. The namespace in which most of them run is used.
  bool resolve(const tracing::System& system);
  /// A callback of the contract has run: the namespace stays.
  void keep() { kept_ = true; }
  [[nodiscard]] bool kept() const { return kept_; }
  /// Counts the changes of the namespace.
  [[nodiscard]] std::uint64_t changes() const { return changes_; }
  /// The graph's name of a node, without the namespace; with a leading slash if it is in another one.
  [[nodiscard]] std::string node(const tracing::System& system, std::uint32_t node) const;
  /// The same for a topic.
  [[nodiscard]] std::string topic(const tracing::System& system, std::uint32_t topic) const;

  /// The name that an imported graph gives to a node of the contract.
  [[nodiscard]] std::string imported(const std::string& node) const;

  /// Topics that callbacks of the contract publish.
  [[nodiscard]] const std::vector<std::string>& topics() const { return topics_; }
  /// Its index in topics(); kNone: no callback of the contract publishes it.
  [[nodiscard]] std::uint32_t number_of(const std::string& topic) const;
  /// The same for a topic of the running system; kNone also before resolve().
  [[nodiscard]] std::uint32_t number_of(const tracing::System& system, std::uint32_t topic);

 private:
  std::set<std::string> nodes_;
  std::vector<std::string> topics_;
  std::map<std::string, std::uint32_t> numbers_;
  std::optional<std::string> space_;  // `/robot1`; empty: none
  std::size_t resolved_ = 0;          // nodes of the system
  std::uint64_t changes_ = 0;
  bool kept_ = false;
  std::vector<std::uint32_t> of_system_;  // by topic of the system
};

}  // namespace hotpath::watch
